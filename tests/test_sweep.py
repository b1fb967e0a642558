"""`symgen sweep`: what varies from the command line, files of members, going on after an interrupt."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner

from symgen.cli import main
from symgen.runtime.ensemble import run as runs


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
    path = tmp_path / "other.npz"
    np.savez(path, a=np.zeros(3))
    assert "no ensemble" in call(path, "--show", status=1)
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    assert "no ensemble" in call(path, "--show", status=1)
    np.savez(path, about=np.array([{"a": 1}], dtype=object))
    assert "no ensemble" in call(path, "--show", status=1)
