"""Stores of ensembles: whoever is killed, and whenever, nothing is lost, nothing is there twice; strangers' data."""

from __future__ import annotations

import concurrent.futures
import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from symgen.runtime.ensemble import (
    digests,
    histogram,
    identity,
    linspace,
    normal,
    quantiles,
    shipping,
    zarr_store,
)
from symgen.runtime.ensemble.zarr_store import StoreError, ZarrStore
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.front import load
from symgen.runtime.inputs import Controller

pytest.importorskip("zarr")
MODULE = Path(__file__).parents[1] / "generated" / "double_pendulum.py"
N = 3000
REDUCE = {"theta1": ["mean", "std", "min", "count", quantiles(0.1, 0.5), histogram(8)]}


def ensemble(**options):
    asked = {"n": N, "seed": 2, "rtol": 1e-5, "method": "dop853", "reduce": REDUCE, **options}
    varied = {"parameters": {"L2": normal(1.0, 0.01)}}
    return load(MODULE).ensemble(1.0, **{**varied, **asked})


@pytest.fixture(scope="module")
def whole():
    return ensemble()


def assert_same(e, other):
    """To the last bit, statistics and verdicts too; every member is there once."""
    assert e.n_done == other.n_done == e.reduced["theta1"]["count"] + e.n_failed == N
    for name in other.names:
        assert e[name].tobytes() == other[name].tobytes(), name
    for name in ("status", "ok", "steps", "energy_error"):
        assert getattr(e.verdicts, name).tobytes() == getattr(other.verdicts, name).tobytes(), name
    assert repr(e.reduced) == repr(other.reduced)
    assert e.health == other.health


def test_a_store_is_what_memory_would_be(tmp_path, whole):
    e = ensemble(out=tmp_path / "runs.zarr")
    assert_same(e, whole)
    assert not e.series
    assert e.store.n_chunks > 1
    assert e.member(17).states[-1].tobytes() == np.array([whole[x][17] for x in whole.names]).tobytes()
    assert_same(ensemble(out=tmp_path / "runs.zarr", resume=True), whole)


def test_series_over_time(tmp_path):
    asked = {"frames": 5, "keep": ["theta1", "energy"], "reduce": {"theta1": ["mean", quantiles(0.5)]}}
    one, other = ensemble(**asked), ensemble(out=tmp_path / "runs.zarr", **asked)
    again = ensemble(out=tmp_path / "runs.zarr", resume=True, **asked)
    for e in (other, again):
        assert e["energy"].shape == (N, 5)
        assert e["energy"].tobytes() == one["energy"].tobytes()
        assert repr(e.reduced) == repr(one.reduced)


def test_a_store_is_a_dataset(tmp_path, whole):
    pytest.importorskip("xarray")
    assert np.array_equal(ensemble(out=tmp_path / "ends.zarr").to_xarray()["theta2"], whole["theta2"])
    series = ensemble(out=tmp_path / "runs.zarr", frames=5, keep=["theta1"])
    assert np.array_equal(series.to_xarray()["t"], series.t)


def test_statistics_alone_are_kept_of_all_members(tmp_path, whole):
    e = ensemble(out=tmp_path / "runs.zarr", keep=None)
    assert repr(e.reduced) == repr(whole.reduced)
    assert e.names == []
    assert (e.verdicts.status == 1).all()


def interrupted(tmp_path):
    """A store of which some chunks are done."""

    def stop(done, of, failed):
        if done > N // 3:
            raise KeyboardInterrupt

    return ensemble(out=tmp_path / "runs.zarr", progress=stop, threads=1)


def test_an_interrupted_store_goes_on(tmp_path, whole):
    first = interrupted(tmp_path)
    assert 0 < first.n_done < N
    assert np.isnan(first["theta1"]).any()
    assert_same(ensemble(out=tmp_path / "runs.zarr", resume=True), whole)


@pytest.mark.parametrize(
    "asked",
    [
        {
            "inputs": {"F": Controller(lambda t, x: 30.0 * x[1] + 6.0 * x[3], period=0.02)},
            "n": 24,
            "method": "rk4",
        },
        {"n": 2000, "rtol": 1e-12, "method": "dop853"},
    ],
    ids=["one after another", "in lanes"],
)
def test_members_that_an_interrupt_has_ended_are_not_taken_for_done(tmp_path, asked):
    """They were written as failed ones, or without a verdict, and a store that was gone on with had kept them."""

    def run(**more):
        system = load(MODULE.with_name("cart_pole.py"))
        varied = {"parameters": {"l": normal(1.0, 0.01)}}
        return system.ensemble(20.0, seed=2, threads=2, out=tmp_path / "runs.zarr", **varied, **asked, **more)

    def stop(done, of, failed):
        time.sleep(0.05)  # others are on their way
        raise KeyboardInterrupt

    first = run(progress=stop)
    assert 0 < first.n_done < first.n
    store = ZarrStore.open(tmp_path / "runs.zarr")
    assert 0 < store.n_done() < store.n
    for _, piece in store.pieces(["status"]):
        assert (piece["status"] == 1).all()
    assert not store.messages()
    again = run(resume=True)
    assert again.n_failed == 0
    assert not any("run again" in note for note in again.notes)


_CLIENT = """
import sys
sys.path.insert(0, {tests!r})
import test_ensemble_store as t
t.ensemble(out={out!r}, threads=1, progress=lambda *_: __import__("time").sleep(0.3))
"""


def test_a_client_that_is_killed(tmp_path, whole):
    """By a signal that nobody can answer, while it writes."""
    out = tmp_path / "runs.zarr"
    code = _CLIENT.format(tests=str(Path(__file__).parent), out=str(out))
    process = subprocess.Popen([sys.executable, "-c", code])
    until = time.monotonic() + 120.0
    while time.monotonic() < until and not (out / "status" / "c" / "1").exists():
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert 0 < ZarrStore.open(out).n_done() < N
    assert_same(ensemble(out=out, resume=True), whole)


class Deadly:
    """Ends the process that calls it, once."""

    def __init__(self, mark):
        self.mark = mark

    def __call__(self, m):
        if (np.abs(m["L2"] - 1.0) > 0.025).any() and not os.path.exists(self.mark):
            Path(self.mark).touch()
            os._exit(1)
        return m["theta1"]


def test_a_process_that_is_killed(tmp_path, whole):
    reduce = {**REDUCE, "reach": (Deadly(str(tmp_path / "mark")), ["max"])}
    out = tmp_path / "runs.zarr"
    with (
        concurrent.futures.ProcessPoolExecutor(2) as executor,
        pytest.raises(RuntimeModelError, match=r"was lost .* is kept in .*runs\.zarr"),
    ):
        ensemble(out=out, executor=executor, reduce=reduce)
    with concurrent.futures.ProcessPoolExecutor(2) as executor:
        e = ensemble(out=out, executor=executor, reduce=reduce, resume=True)
    assert e.reduced.pop("reach")["max"] == whole["theta1"].max()
    assert e.reduced.keys() == whole.reduced.keys()
    assert_same(e, whole)


def test_a_process_that_is_killed_without_a_store(tmp_path):
    """Nothing says that members are kept that are not."""
    reduce = {"reach": (Deadly(str(tmp_path / "mark")), ["max"])}
    with (
        concurrent.futures.ProcessPoolExecutor(2) as executor,
        pytest.raises(RuntimeModelError, match=r"was lost .* there is no store"),
    ):
        ensemble(executor=executor, reduce=reduce)


def test_a_disk_that_is_full(tmp_path, whole):
    """Here: files that may not grow. The message says what to do, and that is all there is to do."""
    out = tmp_path / "runs.zarr"
    code = (
        "import resource, signal\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        + _CLIENT.format(tests=str(Path(__file__).parent), out=str(out)).replace(
            "t.ensemble", "e = t.ensemble"
        ).replace("import test_ensemble_store as t", "import test_ensemble_store as t\nt.limit_files(2500)")
    )  # fmt: skip
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "StoreError" in process.stderr
    assert "could not be written: File too large" in process.stderr
    assert "resume" in process.stderr
    assert_same(ensemble(out=out, resume=True), whole)


def limit_files(n_bytes):
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))


def test_torn_chunks_are_run_again(tmp_path, whole):
    out = tmp_path / "runs.zarr"
    e = ensemble(out=out)
    assert e.store.n_chunks > 4
    os.truncate(out / "theta1" / "c" / "0", 100)  # too short
    flipped = bytearray((out / "theta2" / "c" / "1").read_bytes())
    flipped[40] ^= 1
    (out / "theta2" / "c" / "1").write_bytes(flipped)
    (out / "ok" / "c" / "2").unlink()
    (out / "more" / "3" / "c" / "0").write_bytes(b"nothing")
    with pytest.raises(StoreError, match=r"theta2 of members .* cannot be read"):
        ZarrStore.open(out).read("theta2")
    assert ZarrStore.open(out).n_done() < N
    assert_same(ensemble(out=out, resume=True), whole)


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"seed": 3}, "seed: 2 there, 3 here"),
        ({"rtol": 1e-6}, "rtol"),
        ({"n": 2999}, "number of members"),
        ({"keep": ["theta1"]}, "keep"),
        ({"reduce": {}}, "reduce"),
        ({"parameters": {"L2": normal(1.0, 0.02)}}, "what varies"),
        ({"parameters": {"L2": normal(1.0, 0.01), "m1": 2.0}}, "parameters"),
    ],
)
def test_another_ensemble_is_refused_by_name(tmp_path, other, named):
    interrupted(tmp_path)
    with pytest.raises(RuntimeModelError, match=named):
        ensemble(out=tmp_path / "runs.zarr", resume=True, **other)


def test_another_model_or_version_is_refused_by_name(tmp_path, monkeypatch):
    interrupted(tmp_path)
    asked = {"n": N, "seed": 2, "rtol": 1e-5, "method": "dop853", "reduce": {}, "keep": None}
    with pytest.raises(RuntimeModelError, match=r"model: .*double_pendulum .* there, .*cart_pole"):
        load(MODULE.with_name("cart_pole.py")).ensemble(
            1.0, parameters={"l": normal(1.0, 0.01)}, out=tmp_path / "runs.zarr", resume=True, **asked
        )
    monkeypatch.setattr(identity, "fingerprint", lambda: "9.9 (other)")
    with pytest.raises(RuntimeModelError, match="version of symgen"):
        ensemble(out=tmp_path / "runs.zarr", resume=True)


def test_what_is_there_is_not_written_over(tmp_path):
    (tmp_path / "runs.zarr").mkdir()
    with pytest.raises(StoreError, match="is there already"):
        ensemble(out=tmp_path / "runs.zarr")
    with pytest.raises(StoreError, match="no ensemble"):
        ensemble(out=tmp_path / "runs.zarr", resume=True)


def test_another_version_elsewhere_is_refused(tmp_path, monkeypatch):
    """What goes out names its version; whoever runs it looks first."""
    monkeypatch.setattr(shipping, "fingerprint", lambda: "9.9 (other)")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=_spawn()) as executor:
        with pytest.raises(
            RuntimeModelError, match=r"symgen .* but the ensemble comes from symgen 9.9 \(other\)"
        ):
            ensemble(executor=executor)


def _spawn():
    import multiprocessing

    return multiprocessing.get_context("spawn")


def _about(path, **changes):
    file = path / "zarr.json"
    whole = json.loads(file.read_text())
    whole["attributes"]["symgen"].update(changes)
    file.write_text(json.dumps(whole))


def _array(path, name, **changes):
    file = path / name / "zarr.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **changes}))


HOSTILE = {
    "no file of its own": lambda p: (p / "zarr.json").unlink(),
    "not JSON": lambda p: (p / "zarr.json").write_bytes(b"\xff{"),
    "nested": lambda p: (p / "zarr.json").write_text("[" * 100_000),
    "huge": lambda p: _about(p, n=1 << 60),
    "endless chunks": lambda p: _about(p, chunk=1 << 40),
    "negative": lambda p: _about(p, n=-5),
    "a float": lambda p: _about(p, n=3000.0),
    "way out": lambda p: _about(p, series=["../../etc"]),
    "own name": lambda p: _about(p, series=["status"]),
    "no list": lambda p: _about(p, varied="L2"),
    "other format": lambda p: _about(p, format=99),
    "no identity": lambda p: _about(p, identity=7),
    "compressed": lambda p: _array(p, "theta1", codecs=[{"name": "bytes"}, {"name": "zstd"}]),
    "strange codec": lambda p: _array(p, "theta1", codecs=[{"name": "pickle"}]),
    "other shape": lambda p: _array(p, "theta1", shape=[1 << 50]),
    "other kind": lambda p: _array(p, "theta1", data_type="string"),
    "no array": lambda p: _array(p, "ok", node_type="group"),
    "a pipe": lambda p: ((p / "zarr.json").unlink(), os.mkfifo(p / "zarr.json")),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_stores_from_strangers(tmp_path, name):
    interrupted(tmp_path)
    HOSTILE[name](tmp_path / "runs.zarr")
    with pytest.raises(StoreError, match=r"runs.zarr is no ensemble") as caught:
        ZarrStore.open(tmp_path / "runs.zarr")
    said = str(caught.value)
    assert not any(mark in said for mark in ("{", "<", "Error", "0x", "codec", "['")), said


def test_chunks_from_strangers(tmp_path):
    """A chunk that is no plain file, or longer than it has to be, is never read."""
    interrupted(tmp_path)
    out = tmp_path / "runs.zarr"
    for name, make in (("theta1", lambda f: f.symlink_to("/dev/zero")), ("theta2", os.mkfifo)):
        file = out / name / "c" / "0"
        file.unlink()
        make(file)
        with pytest.raises(StoreError, match="bytes in place of"):
            ZarrStore.open(out).chunk_of(name, 0)
    assert not ZarrStore.open(out).is_done(0)


def test_every_member_is_accounted_for(tmp_path):
    """Whatever strangers give: infinite, not a number, negative, tiny, huge."""
    values = np.array([1.0, np.inf, np.nan, -1.0, 0.0, 1e-300, 1e300, 1.1, -np.inf, 1e-16, 2.0, 5e-324])
    asked = {
        "n": None,
        "parameters": {"m2": values, "L2": linspace(0.9, 1.1, 2)},
        "reduce": {},
        "max_steps": 2000,
    }
    with np.errstate(all="ignore"):
        e, stored = ensemble(**asked), ensemble(out=tmp_path / "runs.zarr", **asked)
    for one in (e, stored):
        assert one.n_done == one.n == 2 * len(values)
        assert (one.verdicts.status != 0).all()
        assert sum(one.health.causes.values()) == one.n_failed == len(one.failed)
        there = one.verdicts.status == 1
        assert np.isfinite(one["theta1"][there]).all()
        assert np.isnan(one["theta1"][~there]).all()
        assert {0, 7, 10} <= set(np.flatnonzero(one.verdicts.ok))
        assert {1, 2, 3, 8} <= set(one.failed)
    assert e["theta1"].tobytes() == stored["theta1"].tobytes()


def test_chunks_that_have_changed_places_are_noticed(tmp_path, whole):
    """Checksums agree: each is whole, but stands where another was."""
    out = tmp_path / "runs.zarr"
    ensemble(out=out)
    for name in ("L2", "theta1", "theta2", "dot(theta1)", "dot(theta2)", "steps", "energy_error"):
        first, second = out / name / "c" / "0", out / name / "c" / "1"
        a, b = first.read_bytes(), second.read_bytes()
        first.write_bytes(b)
        second.write_bytes(a)
    with pytest.raises(StoreError, match=r"theta1 of members 0 to .* its digest says; .* resume"):
        ZarrStore.open(out).read("theta1")
    assert_same(ensemble(out=out, resume=True), whole)


def test_a_chunk_of_another_store_of_the_same_ensemble_is_noticed(tmp_path):
    """One that is laid out in the same way, of another seed."""
    ensemble(out=tmp_path / "runs.zarr")
    ensemble(out=tmp_path / "other.zarr", seed=3)
    file = Path("theta2") / "c" / "1"
    (tmp_path / "runs.zarr" / file).write_bytes((tmp_path / "other.zarr" / file).read_bytes())
    with pytest.raises(StoreError, match=r"theta2 of members .* digest"):
        ZarrStore.open(tmp_path / "runs.zarr").read("theta2")


def test_numbers_in_another_order_of_bytes_are_noticed(tmp_path):
    interrupted(tmp_path)
    _array(
        tmp_path / "runs.zarr",
        "theta1",
        codecs=[{"name": "bytes", "configuration": {"endian": "big"}}, {"name": "crc32c"}],
    )
    with pytest.raises(StoreError, match="the array theta1 is not as it should be"):
        ZarrStore.open(tmp_path / "runs.zarr")


@pytest.mark.parametrize("changes", [{"rtol": 1e-9}, {"method": "radau5"}, {"model": "x"}, {"t_end": 7.0}])
def test_what_a_store_says_of_itself_cannot_be_changed_unnoticed(tmp_path, changes):
    interrupted(tmp_path)
    _about(tmp_path / "runs.zarr", **changes)
    with pytest.raises(StoreError, match=r"what its zarr\.json says was changed after it was written"):
        ZarrStore.open(tmp_path / "runs.zarr")


@pytest.mark.parametrize("name", ["status", "more", "more/digests", "singly"])
def test_a_pipe_is_not_waited_for(tmp_path, name):
    interrupted(tmp_path)
    file = tmp_path / "runs.zarr" / name / "zarr.json"
    file.unlink()
    os.mkfifo(file)
    with pytest.raises(StoreError, match="is no plain file"):
        ZarrStore.open(tmp_path / "runs.zarr")


def _forge(store, name, edit, k=0):
    """Change numbers of a chunk and sign them, as whoever has read the sources can."""
    import zarr

    first, last = store.rows(k)
    group = zarr.open_group(store.path, mode="r+")
    values = group[name][first:last]
    edit(values)
    group[name][first:last] = values
    sums = group["more/digests"][:]
    sums[k, store.names.index(name)] = digests.of_chunk(store.about["digest"], name, k, values)
    group["more/digests"][:] = sums


def test_members_that_somebody_has_made_up_are_run_again(tmp_path, whole):
    out = tmp_path / "runs.zarr"
    ensemble(out=out)
    _forge(ZarrStore.open(out), "theta1", lambda values: values.__imul__(1.5))
    assert np.array_equal(ZarrStore.open(out).read("theta2"), whole["theta2"])  # nothing tells so far
    e = ensemble(out=out, resume=True)
    assert any("were not those of the model, and run again" in note for note in e.notes)
    assert e["theta1"].tobytes() == whole["theta1"].tobytes()


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [("status", 57, "verdicts that there are not"), ("status", -22, "contradict themselves")],
)
def test_verdicts_that_contradict_themselves_are_refused(tmp_path, name, value, said):
    out = tmp_path / "runs.zarr"
    ensemble(out=out)
    _forge(ZarrStore.open(out), name, lambda values: values.__setitem__(3, value))
    with pytest.raises(StoreError, match=said):
        [*ZarrStore.open(out).pieces(["status", "ok"])]


def test_a_number_of_members_that_nobody_can_hold_is_refused(tmp_path):
    """Nor is one looked for that is not there."""
    out = tmp_path / "runs.zarr"
    ensemble(out=out)
    whole = json.loads((out / "zarr.json").read_text())
    about = whole["attributes"]["symgen"]
    about["n"] = 1 << 47
    about["digest"] = digests.of_about(about)
    (out / "zarr.json").write_text(json.dumps(whole))
    for file in out.glob("*/zarr.json"):
        if file.parent.name != "more":
            _array(out, file.parent.name, shape=[1 << 47])
    n_chunks = -(-(1 << 47) // about["chunk"])
    _array(
        out,
        "more/digests",
        shape=[n_chunks, *json.loads((out / "more/digests/zarr.json").read_text())["shape"][1:]],
    )
    store = ZarrStore.open(out)
    assert store.n_done() < 1 << 20
    with pytest.raises(StoreError, match=r"theta1 of .* members need .* GiB"):
        store.read("theta1")
    with pytest.raises(
        RuntimeModelError, match="contradicts itself: it is of this ensemble, but its n is of another"
    ):
        ensemble(out=out, resume=True)


def test_of_two_that_write_to_a_store_one_is_refused(tmp_path, whole):
    out = tmp_path / "runs.zarr"
    interrupted(tmp_path)
    with ZarrStore.open(out).held(), pytest.raises(StoreError, match="another process is writing to it"):
        ensemble(out=out, resume=True)
    assert_same(ensemble(out=out, resume=True), whole)


def test_of_two_that_make_a_store_one_is_refused(tmp_path, monkeypatch):
    """The other one is there when it has been laid out; nothing of it is touched, and nothing left behind."""
    out = tmp_path / "runs.zarr"
    lay_out = zarr_store._lay_out

    def slowly(*arguments):
        lay_out(*arguments)
        out.mkdir()
        (out / "precious").touch()

    monkeypatch.setattr(zarr_store, "_lay_out", slowly)
    with pytest.raises(StoreError, match="is there already"):
        ensemble(out=out)
    assert [x.name for x in tmp_path.iterdir()] == ["runs.zarr"]
    assert [x.name for x in out.iterdir()] == ["precious"]
