"""`symgen sweep`: what varies from the command line, files of members, going on after an interrupt."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner

from symgen.cli import main
from symgen.runtime.ensemble import run as runs
from symgen.runtime.recording.reader import read_recording, read_times
from symgen.runtime.recording.schema import RecordingError


def call(*arguments, status=0):
    result = CliRunner().invoke(main, ["sweep", *map(str, arguments)], catch_exceptions=False)
    assert result.exit_code == status, result.output
    return result.output


PENDULUM = ("double_pendulum", "--t-end", "1", "--rtol", "1e-7", "--method", "dop853")


def test_a_sweep_is_the_ensemble(tmp_path):
    out = tmp_path / "runs.npz"
    said = call(*PENDULUM, "--vary", "L2=0.9:1.1:3", "--vary", "theta1=normal(1.5,0.01)", "-n", 4, "--seed", 1,
                "--vary", "dot(theta2)=grid(0, 1)", "--out", out)  # fmt: skip
    assert "24 of 24 members are ok" in said
    with np.load(out) as file:
        about = json.loads(str(file["about"]))
        assert about["n_done"] == about["n"] == 24
        assert set(about["varied"]) == {"L2", "theta1", "dot(theta2)"} - {"theta1", "dot(theta2)"} | set(
            about["varied"]
        )
        assert np.array_equal(np.unique(file["L2"]), np.linspace(0.9, 1.1, 3))
        assert np.isfinite(file["theta2"]).all()
    shown = call(out, "--show")
    assert "24 ok, 0 failed" in shown


def test_a_sweep_that_was_interrupted_goes_on(tmp_path, monkeypatch):
    out, whole = tmp_path / "runs.npz", tmp_path / "whole.npz"
    asked = (*PENDULUM, "--vary", "L2=normal(1, 0.01)", "-n", 3000, "--threads", 1)
    call(*asked, "--out", whole)
    take, parts = runs.Collector.take, []

    def stopping(self, part):
        take(self, part)
        parts.append(part.first)
        if len(parts) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(runs.Collector, "take", stopping)
    call(*asked, "--out", out, status=130)
    monkeypatch.undo()
    with np.load(out) as file:
        done = json.loads(str(file["about"]))["n_done"]
        assert 0 < done < 3000
        assert np.isnan(file["theta1"][done:]).all()
    call(*asked, "--out", out, "--resume")
    with np.load(out) as file, np.load(whole) as other:
        for name in other.files:
            if name != "about":
                assert np.array_equal(file[name], other[name]), name
    refused = CliRunner().invoke(
        main, ["sweep", *map(str, asked), "--seed", "2", "--out", str(out), "--resume"]
    )
    assert refused.exit_code == 1
    assert "another ensemble" in refused.output


def test_ctrl_c_is_answered_in_the_middle_of_a_part(tmp_path):
    """Members of hours in machine code: the command ends within seconds, and says what it has kept."""
    out = tmp_path / "runs.npz"
    arguments = [
        "double_pendulum",
        "--t-end",
        "1e9",
        "--rtol",
        "1e-9",
        "--vary",
        "L2=normal(1, 0.01)",
        "-n",
        "64",
        "--threads",
        "1",
    ]
    process = subprocess.Popen(
        [sys.executable, "-c", "from symgen.cli import main; main()", "sweep", *arguments, "--out", str(out)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    time.sleep(15)  # it derives and compiles first
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=30)
    assert process.returncode == 130, said
    assert "0 of 64 members" in said
    with np.load(out) as file:
        assert json.loads(str(file["about"]))["n_done"] == 0


def test_doubtful_members_make_exit_status_3():
    said = call("double_pendulum", "--t-end", "60", "--rtol", "1e-3", "--atol", "1e-3", "--method", "dop853",
                "--vary", "theta1=0.05:2.5:16", status=3)  # fmt: skip
    assert "doubtful" in said
    assert "look at member" in said


def test_all_failed_is_exit_status_1():
    said = call(*PENDULUM, "--vary", "theta1=0.5:1:3", "--max-steps", 2, status=1)
    assert "more steps than allowed" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--vary", "L9=1:2:3"), "L9"),
        (("--vary", "L2=1"), "one value"),
        (("--vary", "L2=evil(3)"), "evil"),
        (("--vary", "L2=1:2:3", "--set", "L2=1"), "as well"),
        ((), "--vary"),
        (("--vary", "L2=1:2:3", "--resume"), "--out"),
        (("--vary", "L2=1:2:3", "--out", "runs.rrd"), "runs.rrd"),
    ],
)
def test_wrong_usage(arguments, said):
    assert said in call(*PENDULUM, *arguments, status=2)


def test_a_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / "pipe.npz"
    os.mkfifo(path)
    for no_file in (path, "/dev/zero"):
        assert "is no ensemble: it is a device, a pipe" in call(no_file, "--show", status=1)
    path = tmp_path / "other.npz"
    np.savez(path, a=np.zeros(3))
    assert "no ensemble" in call(path, "--show", status=1)
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    assert "name what `symgen sweep --out` has written" in call(path, "--show", status=1)
    np.savez(path, about=np.array([{"a": 1}], dtype=object))
    assert "no ensemble" in call(path, "--show", status=1)
    np.savez_compressed(path, about=np.array("{}"), a=np.zeros(1 << 20))
    assert "compressed" in call(path, "--show", status=1)


@pytest.mark.parametrize(
    "changes",
    [
        {"t_end": None}, {"rtol": "x"}, {"atol": []}, {"model": 7}, {"method": {}}, {"notes": 3}, {"series": ["t"]},
        {"varied": None}, {"messages": {"x": "y"}}, {"messages": []}, {"shape": {"a": "b"}}, {"n": True},
        {"n_done": 99},
        {"n": 0, "n_done": 0}, {"identity": None}, {"t_end": 10**400}, {"theta1": np.zeros(7)}, {"ok": np.zeros(8)},
        {"theta1": np.zeros(8, dtype="M8[s]")}, {"steps": np.zeros((8, 2), dtype=int)}, {"t": np.zeros((1, 1))},
        {"status": np.full(8, 57, dtype=np.int8)}, {"status": np.full(8, -22, dtype=np.int8)},
    ],
    ids=str,
)  # fmt: skip
def test_a_file_of_members_from_strangers(tmp_path, changes):
    path = tmp_path / "runs.npz"
    call(*PENDULUM, "--vary", "L2=normal(1, 0.01)", "-n", 8, "--out", path)
    with np.load(path) as file:
        arrays = dict(file)
    about = json.loads(str(arrays.pop("about")))
    arrays |= {name: value for name, value in changes.items() if isinstance(value, np.ndarray)}
    about |= {name: value for name, value in changes.items() if not isinstance(value, np.ndarray)}
    np.savez(path, **arrays, about=np.array(json.dumps(about)))
    said = call(path, "--show", status=1)
    assert "runs.npz is no ensemble: " in said
    assert "internal" not in said


def test_members_that_somebody_has_made_up_are_not_gone_on_with(tmp_path):
    path = tmp_path / "runs.npz"
    asked = (*PENDULUM, "--vary", "L2=normal(1, 0.01)", "-n", 64, "--out", path)
    call(*asked)
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **{**arrays, "theta1": arrays["theta1"] * 1.5})
    assert "numbers that are not those of this ensemble" in call(*asked, "--resume", status=1)


def test_a_store_grows_and_is_gone_on_with(tmp_path):
    pytest.importorskip("zarr")
    out, html, film = tmp_path / "runs.zarr", tmp_path / "runs.html", tmp_path / "some.rrd"
    asked = (
        *PENDULUM,
        "--vary",
        "L2=0.9:1.1:3",
        "--vary",
        "theta1=normal(1.5, 0.01)",
        "-n",
        50,
        "--frames",
        5,
    )
    asked = (*asked, "--keep", "theta1,energy", "--out", out)
    assert "150 of 150 members are ok" in call(*asked, "--html", html, "--record", film)
    shown = call("--show", out)
    assert shown == call(out, "--show")
    assert "150 ok, 0 failed" in shown
    assert re.search(r"energy +mean", shown)
    page = html.read_text()
    for said in ("Every member reached its end", "Distributions", "Members across their values", "Over time"):
        assert said in page
    assert read_times(film)[-1] == 1.0
    with pytest.raises(RecordingError, match="members of an ensemble"):
        read_recording(film)
    assert "150 of 150 members are ok" in call(*asked, "--resume")
    assert "already" in call(*asked, status=1)
    assert "seed: 0 there, 1 here" in call(*asked, "--resume", "--seed", 1, status=1)
    report = CliRunner().invoke(main, ["report", str(out), "--html", str(tmp_path / "other.html")])
    assert report.exit_code == 0, report.output
    assert (tmp_path / "other.html").read_text() == page


def test_the_page_names_failures(tmp_path):
    out, html = tmp_path / "runs.npz", tmp_path / "page.html"
    call(*PENDULUM, "--vary", "m2=grid(1, -1, 2)", "--out", out, "--html", html, status=3)
    page = html.read_text()
    assert "1 failed (33.33%)" in page
    assert "it cannot begin" in page
    assert "member 1" in page
    assert call("--show", out, "--html", tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text() == page


def test_noise_and_inputs_from_the_command_line(tmp_path):
    table = tmp_path / "push.csv"
    table.write_text("t,F\n0,0\n1,3\n")
    base = ("cart_pole", "--t-end", "1", "--vary", "theta=uniform(0.1, 0.2)", "-n", 3, "--keep", "x")
    ends = []
    for k, given in enumerate(((), ("--input", table), ("--vary", "F=noise(2 N, 20 ms)"))):
        call(*base, *given, "--out", tmp_path / f"{k}.npz")
        with np.load(tmp_path / f"{k}.npz") as file:
            ends.append(file["x"])
    for k, other in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(ends[k] - ends[other]).min() > 1e-4
    assert "given as well" in call(*base, "--input", table, "--vary", "F=noise(2, 0.02)", status=2)


def test_a_cluster_that_is_not_there():
    pytest.importorskip("distributed")
    said = call(*PENDULUM, "--vary", "L2=1:2:3", "--dask", "nonsense://x", status=1)
    assert "no scheduler answers there" in said
