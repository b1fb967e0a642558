"""Ensembles on a Dask cluster: two workers here; workers, then clients, are killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from test_ensemble_store import REDUCE, N, assert_same, ensemble

from symgen.runtime.ensemble import shipping
from symgen.runtime.ensemble.verdict import WORKER_LOST
from symgen.runtime.ensemble.zarr_store import ZarrStore
from symgen.runtime.errors import RuntimeModelError

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")
pytest.importorskip("zarr")
on_dask = pytest.importorskip("symgen.runtime.ensemble.on_dask")


@pytest.fixture(scope="module")
def cluster():
    settings = {"distributed.scheduler.allowed-failures": 1, "distributed.worker.daemon": False}
    with dask.config.set(settings):
        with distributed.LocalCluster(
            2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as found:
            yield found


@pytest.fixture
def client(cluster):
    with distributed.Client(cluster) as found:
        found.wait_for_workers(2)
        yield found


@pytest.fixture(scope="module")
def whole():
    return ensemble()


def test_members_do_not_depend_on_where_they_run(tmp_path, client, whole):
    """In memory, and written by the workers; statistics of functions that cannot be named, too."""
    assert_same(ensemble(executor=client), whole)
    reduce = {**REDUCE, "reach": (lambda m: np.abs(m["theta1"]), ["max"])}
    e = ensemble(executor=client, out=tmp_path / "runs.zarr", reduce=reduce)
    assert e.store.n_chunks >= 8
    assert e.reduced.pop("reach")["max"] == np.abs(whole["theta1"]).max()
    assert_same(e, whole)


def test_machine_code_goes_with_the_text(client, monkeypatch):
    """What a processor like this one needs is there, and is what the worker would have compiled."""
    sent = []
    monkeypatch.setattr(shipping, "_machine_code", _kept(shipping._machine_code, sent))
    ensemble(executor=client, n=100, reduce={})
    assert len(sent[0]) >= 4  # the loop, the map, rhs, energy
    assert all(code.startswith(b"\x7fELF") for code in sent[0].values()) or sys.platform != "linux"


def _kept(function, found):
    def call(*arguments):
        found.append(function(*arguments))
        return found[-1]

    return call


def test_stores_that_workers_cannot_reach_are_written_by_the_client(tmp_path, client, whole, monkeypatch):
    """As on machines that share no folder: what has the name there is another one."""
    packed = shipping.packed

    def elsewhere(plan, wanted, store, gather, **options):
        monkeypatch.setitem(store.about, "token", "of another one")
        return packed(plan, wanted, store, gather, **options)

    monkeypatch.setattr(on_dask, "packed", elsewhere)
    assert_same(ensemble(executor=client, out=tmp_path / "runs.zarr"), whole)


class Slow:
    """Gives others the time to kill."""

    def __call__(self, m):
        time.sleep(0.2)
        return m["theta1"]


def slow(client, out, **options):
    e = ensemble(executor=client, out=out, reduce={**REDUCE, "slow": (Slow(), ["count"])}, **options)
    assert e.reduced.pop("slow")["count"] == N
    return e


def test_a_worker_that_is_killed(tmp_path, client, whole):
    """Nothing is lost, and nothing is there twice."""
    pids, killed = list(client.run(os.getpid).values()), []

    def kill(done, of, failed):
        if not killed:
            killed.append(pids[0])
            os.kill(pids[0], signal.SIGKILL)

    assert_same(slow(client, tmp_path / "runs.zarr", progress=kill), whole)
    assert killed


_CLIENT = """
import sys
sys.path.insert(0, {tests!r})
import distributed, test_ensemble_dask as t
with distributed.Client({address!r}) as client:
    t.slow(client, {out!r})
"""


def test_a_client_that_is_killed(tmp_path, client, whole):
    out = tmp_path / "runs.zarr"
    code = _CLIENT.format(tests=str(Path(__file__).parent), address=client.scheduler.address, out=str(out))
    process = subprocess.Popen([sys.executable, "-c", code])
    until = time.monotonic() + 120.0
    while time.monotonic() < until and not (out / "status" / "c" / "1").exists():
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert ZarrStore.open(out).n_done() < N
    assert_same(slow(client, out, resume=True), whole)


class Deadly:
    """Ends each process that calls it with a member."""

    def __init__(self, least):
        self.least = least

    def __call__(self, m):
        if (m["L2"] <= self.least).any():
            time.sleep(1.0)  # a worker that dies before its nanny has seen it is not replaced
            os._exit(1)
        return m["theta1"]


@pytest.mark.slow
def test_members_that_kill_workers_have_failed(tmp_path, client, whole):
    """Those of a block with one of them; all others are what they are elsewhere."""
    bad = int(np.argmin(whole["L2"]))
    reduce = {"r": (Deadly(whole["L2"][bad]), ["count"])}
    e = ensemble(executor=client, out=tmp_path / "runs.zarr", reduce=reduce)
    lost = e.verdicts.status == WORKER_LOST
    assert lost[bad]
    assert lost.sum() == 192
    assert e.n_done == N == e.reduced["r"]["count"] + e.n_failed
    assert e["theta1"][~lost].tobytes() == whole["theta1"][~lost].tobytes()
    assert "lost" in " ".join(e.health.lines())


def test_a_cluster_without_workers_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(on_dask, "_LOOK_EVERY", 0.2)
    monkeypatch.setattr(on_dask, "_PATIENCE", 1.0)
    settings = {"dashboard_address": None, "silence_logs": 50, "processes": False}
    with distributed.LocalCluster(1, **settings) as cluster, distributed.Client(cluster) as client:
        cluster.scale(0)
        until = time.monotonic() + 30.0
        while client.ncores() and time.monotonic() < until:
            time.sleep(0.05)
        with pytest.raises(RuntimeModelError, match=r"has had no workers .* there is no store"):
            ensemble(executor=client)


def test_two_versions_refuse_each_other(client, monkeypatch):
    monkeypatch.setattr(shipping, "fingerprint", lambda: "9.9 (other)")
    with pytest.raises(RuntimeModelError, match=r"has symgen .* comes from symgen 9.9 \(other\)"):
        ensemble(executor=client)
