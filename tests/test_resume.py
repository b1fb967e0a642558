"""A run that was stopped goes on bit for bit as if it had not been: every family of methods, and the command line."""

from __future__ import annotations

import hashlib
import io
import os
import signal
import subprocess
import sys
import time
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from recorded import assert_same_recording, record

from symgen.cli import main
from symgen.runtime import load, solve
from symgen.runtime.checkpoint_bytes import Checkpoint, CheckpointError
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.recording.reader import read_checkpoint, read_recording
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.recording.verify import verify

ROOT = Path(__file__).resolve().parents[1]
FAMILIES = {
    "explicit": ("double_pendulum", {"method": "dopri5"}),
    "taylor": ("double_pendulum", {"method": "taylor"}),
    "bdf": ("double_pendulum", {"method": "bdf"}),
    "radau": ("double_pendulum", {"method": "radau5"}),
    "gauss": ("double_pendulum", {"method": "gauss8"}),
    "one stage": ("double_pendulum", {"method": "implicit_midpoint"}),
    "alpha": ("double_pendulum", {"method": "generalized_alpha"}),
    "symplectic": ("pendulum", {"method": "verlet"}),
    "composition": ("pendulum", {"method": "verlet4"}),
    "constraints": ("pendulum_dae", {"method": "dop853"}),
    "stabilised": ("pendulum_dae", {"method": "dop853", "constraints": "baumgarte"}),
    "partition": ("pendulum_dae", {"method": "dop853", "constraints": "partition"}),
    "unheld": ("pendulum_dae", {"method": "dop853", "constraints": "none"}),
    "index 2": ("heavy_top_absolute", {"method": "radau5", "constraints": "ggl"}),
    "quaternions": ("free_rigid_body", {"method": "dop853"}),
    "resets": ("bouncing_ball", {"method": "dopri5"}),
    "friction": ("stick_slip", {"method": "dop853"}),
    "friction by series": ("stick_slip", {"method": "taylor"}),
    "stop": ("door_stop", {"method": "dop853"}),
    "input tables": ("rough_road", {"method": "dop853"}),
}


def text_of(name):
    return (ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8")


def bundled(name):
    return load(text_of(name))


@pytest.mark.parametrize("t_end", [1.27, 2.28])
def test_a_run_that_ends_just_behind_events_of_machine_code_goes_on(tmp_path, t_end):
    """Its checkpoint has the form that the last of these left (0.1 s and 0.01 s behind a slip and a stick)."""
    whole, path = solve(bundled("stick_slip"), 5.0, method="taylor"), tmp_path / "first.rrd"
    record(
        path,
        text_of("stick_slip"),
        lambda **more: solve(bundled("stick_slip"), t_end, method="taylor", **more),
    )
    rest = Resumed(path).run(5.0)
    np.testing.assert_array_equal(rest.states[-1], whole.states[-1])
    assert len(rest.events) == len(whole.events) > 8


@pytest.mark.parametrize("method, at", [("radau5", 1.85), ("euler", 1.8266283731960136)])
def test_an_impact_in_a_step_that_is_watched_is_that_of_machine_code(method, at):
    """Python acts on it then; the rate behind it was another one in the last digit."""
    runs = [solve(bundled("door_stop"), 2.0, method=method, at=times) for times in ((), (at,))]
    np.testing.assert_array_equal(*(run.states[-1] for run in runs))
    assert [e.t for e in runs[0].events] == [e.t for e in runs[1].events]
    np.testing.assert_array_equal(*([e.v_after for e in run.events] for run in runs))


@pytest.mark.parametrize(("name", "options"), FAMILIES.values(), ids=FAMILIES)
def test_a_stopped_run_goes_on_bit_for_bit(tmp_path, name, options):
    whole, first, rest = (tmp_path / f"{part}.rrd" for part in ("whole", "first", "rest"))
    t_end = {
        "stick_slip": 10.0,
        "bouncing_ball": 1.5,
        "door_stop": 12.0,
        "rough_road": 2.0,
        "free_rigid_body": 3.0,
    }.get(name, 0.5)
    a = record(
        whole, text_of(name), lambda **more: solve(bundled(name), t_end, at=[0.2, 0.4], **options, **more)
    )
    few = max(1, int(0.6 * a.stats["steps"]))
    b = record(
        first,
        text_of(name),
        lambda **more: solve(bundled(name), t_end, at=[0.2, 0.4], max_steps=few, **options, **more),
    )
    assert b.t[-1] < a.t[-1]
    c = record(rest, text_of(name), Resumed(first).run)
    assert_same_recording(whole, rest)
    assert not any("not bit for bit" in note for note in c.notes)
    assert c.stats == a.stats and c.energy.max_error == a.energy.max_error
    assert [sample.t for sample in c.samples] == [sample.t for sample in a.samples]
    for mine, other in zip(a.samples, c.samples, strict=True):
        np.testing.assert_array_equal(mine.q, other.q)


def test_a_finished_run_goes_on_as_if_its_end_had_been_a_stop(tmp_path):
    whole, first, rest = (tmp_path / f"{part}.rrd" for part in ("whole", "first", "rest"))
    options = {"method": "dopri5", "fps": 50}
    record(
        whole,
        text_of("double_pendulum"),
        lambda **more: solve(bundled("double_pendulum"), 10.0, at=[5.0], **options, **more),
    )
    record(
        first,
        text_of("double_pendulum"),
        lambda **more: solve(bundled("double_pendulum"), 5.0, **options, **more),
    )
    record(rest, text_of("double_pendulum"), lambda **more: Resumed(first).run(10.0, **more))
    assert_same_recording(whole, rest)
    assert verify(rest).ok


def test_what_cannot_go_on_is_refused(tmp_path):
    path = tmp_path / "run.rrd"
    record(path, text_of("pendulum"), lambda **more: solve(bundled("pendulum"), 1.0, method="dopri5", **more))
    with pytest.raises(RuntimeModelError, match="give a later t_end than 1 s"):
        Resumed(path).run()
    with pytest.raises(RuntimeModelError, match=r"at: 0.5 s lies before t = 0.99"):
        Resumed(path).run(2.0, at=[0.5])
    solve(bundled("pendulum"), 1.0, method="dopri5").save(path)
    with pytest.raises(RecordingError, match="holds no checkpoint"):
        Resumed(path)


def test_a_damaged_checkpoint_is_refused(tmp_path):
    path = tmp_path / "run.rrd"
    record(path, text_of("pendulum"), lambda **more: solve(bundled("pendulum"), 1.0, method="dopri5", **more))
    checkpoint, _ = read_checkpoint(path)
    content = checkpoint.to_bytes()
    again = Checkpoint.from_bytes(content)
    assert again.facts == checkpoint.facts and again.arrays.keys() == checkpoint.arrays.keys()
    for place in (0, 40, len(content) // 2, len(content) - 1):
        damaged = bytearray(content)
        damaged[place] ^= 1
        with pytest.raises(CheckpointError, match="damaged"):
            Checkpoint.from_bytes(bytes(damaged))


def _strange(content):
    """The same checkpoint without the seal, and with nonsense in all that only the step loop itself understands."""
    checkpoint, random = Checkpoint.from_bytes(content), np.random.default_rng(1)
    assert checkpoint.own
    checkpoint.arrays["counters"][16:] = 10**12
    checkpoint.arrays["work"][:] = 1e300 * random.random(len(checkpoint.arrays["work"]))
    for name in ("dense", "f", "guard"):
        checkpoint.arrays[name][...] = np.nan
    return checkpoint.to_bytes()


@pytest.mark.parametrize("family", ["taylor", "bdf", "radau", "partition", "index 2", "resets", "stop"])
def test_from_a_strangers_checkpoint_a_run_goes_on_by_what_can_be_checked(tmp_path, family):
    name, options = FAMILIES[family]
    t_end = {"bouncing_ball": 1.5, "door_stop": 2.0}.get(name, 0.5)
    whole, few = solve(bundled(name), t_end, **options), 3
    path = tmp_path / "run.rrd"
    record(
        path, text_of(name), lambda **more: solve(bundled(name), t_end, max_steps=few, **options, **more), _strange
    )  # fmt: skip
    rest = Resumed(path).run()
    assert rest.status == whole.status and len(rest.events) == len(whole.events)
    assert sum("not bit for bit" in note for note in rest.notes) == 1
    np.testing.assert_allclose(rest.q[-1], whole.q[-1], atol=1e-5)


FORGED = {
    "a step of nan": (lambda c: _put(c, "control", at.H, np.nan), "no run gets there"),
    "a step of 1e300": (lambda c: _put(c, "control", at.H, 1e300), "no run gets there"),
    "a long step": (lambda c: _put(c, "control", at.H, 1e5), r"step is 100000 s"),
    "another time": (lambda c: _put(c, "control", at.T, 0.1), "its step loop is at 0.1 s"),
    "a time of an event to come": (lambda c: _put(c, "control", at.T_EVENT, 9.0), "times outside the run"),
    "a state of inf": (lambda c: _put(c, "y", 0, np.inf), "state is not finite"),
    "steps below zero": (lambda c: _put(c, "counters", at.STEPS, -1), "counts steps below zero"),
    "no control": (lambda c: c.arrays.pop("control"), "no array 'control'"),
    "a short work": (lambda c: c.arrays.update(work=np.zeros(1)), "its array 'work' is float64 of shape"),
    "counters of floats": (lambda c: c.arrays.update(counters=np.zeros(24)), "its array 'counters'"),
    "no method": (lambda c: c.facts.pop("method"), "does not say 'method'"),
    "an unknown method": (lambda c: c.facts.update(method="../../x"), "not a method of this version"),
    "frames as text": (lambda c: c.facts.update(n_frames="3"), "not a count"),
    "frames that are not there": (lambda c: c.facts.update(n_frames=10**6), "its checkpoint is of"),
    "a time of nan": (lambda c: c.facts.update(t=float("nan")), "not a time"),
    "notes that are none": (lambda c: c.facts.update(notes=[1, {}]), "a list of texts"),
    "an event of its own": (lambda c: c.facts.update(events=[["x", "y", 0.0, 0.0, None]]), "'q_before'"),
    "forms that are not there": (lambda c: c.arrays.update(forms=np.full_like(c.arrays["forms"], 9)), "forms"),
    "frames divided backwards": (lambda c: c.arrays.update(resets_from=np.array([7])), "divide its frames"),
}  # fmt: skip


def _put(checkpoint, name, index, value):
    checkpoint.arrays[name][index] = value


@pytest.mark.parametrize(("change", "says"), FORGED.values(), ids=FORGED)
def test_forged_checkpoints_are_refused_by_file(tmp_path, change, says):
    def forge(content):
        checkpoint = Checkpoint.from_bytes(content)
        change(checkpoint)
        return checkpoint.to_bytes()

    path = tmp_path / "run.rrd"
    record(
        path, text_of("pendulum"),
        lambda **more: solve(bundled("pendulum"), 1.0, method="dopri5", max_steps=3, **more), forge,
    )  # fmt: skip
    with pytest.raises(RecordingError, match=says) as refused:
        Resumed(path).run()
    assert str(refused.value).startswith(str(path))


def _repacked(packed):
    inner = hashlib.sha256(packed).digest()
    return hashlib.sha256(bytes(32) + inner).digest() + bytes(32) + packed


def _huge_array(shape):
    plain = io.BytesIO()
    with zipfile.ZipFile(plain, "w") as archive:
        header = repr({"descr": "<f8", "fortran_order": False, "shape": shape}).encode().ljust(117) + b"\n"
        archive.writestr("facts.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    return zlib.compress(plain.getvalue())


@pytest.mark.parametrize(
    ("packed", "says"),
    [
        (lambda: zlib.compress(bytes(1 << 29), 9), "unpacks to more than 256 MiB"),
        (lambda: _huge_array((10**13,)), "in 0 bytes"),
        (lambda: _huge_array((-1, -1)), "of shape"),
        (lambda: zlib.compress(b"no archive"), "cannot be read"),
        (lambda: zlib.compress(bytes(1000))[:-9], "cut off"),
    ],
)
def test_what_unpacks_to_too_much_is_refused(packed, says):
    with pytest.raises(CheckpointError, match=says):
        Checkpoint.from_bytes(_repacked(packed()))


# By the command line

_OPTIONS = ("--method", "dopri5", "--rtol", "1e-12", "--fps", "2")


def symgen(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no kill -9 here")
@pytest.mark.parametrize("number", ["SIGKILL", "SIGINT"])
def test_a_killed_run_goes_on_from_its_recording(tmp_path, number):
    whole, cut = tmp_path / "whole.rrd", tmp_path / "cut.rrd"
    code = "import sys; from symgen.cli import main; main(sys.argv[1:])"
    command = ["run", "pendulum", "--t-end", "400000", *_OPTIONS, "--log", str(cut), "--quiet"]
    process = subprocess.Popen([sys.executable, "-c", code, *command], stderr=subprocess.DEVNULL)
    end = time.monotonic() + 100
    while (
        time.monotonic() < end
        and process.poll() is None
        and not (cut.exists() and cut.stat().st_size > 1_000_000)
    ):
        time.sleep(0.02)
    os.kill(process.pid, getattr(signal, number))
    process.wait(100)
    before = read_recording(cut)
    if before.status == "success":
        pytest.skip("the run was over before it could be killed")
    t_end = Resumed(cut).t + 5.0
    resumed = symgen("run", "--resume", cut, "--t-end", t_end)
    uninterrupted = symgen("run", "pendulum", "--t-end", t_end, *_OPTIONS, "--log", whole)
    # Fast machines come so far until it is killed that the energy has drifted by more than its limit.
    assert resumed.exit_code == uninterrupted.exit_code and resumed.exit_code in (0, 3), resumed.output
    first, second = read_recording(whole), read_recording(cut)
    assert second.complete and second.t[-1] == t_end
    assert first.t.tobytes() == second.t.tobytes() and first.states.tobytes() == second.states.tobytes()
    assert not (tmp_path / "cut.resumed.rrd").exists()


def test_other_settings_are_refused_by_name(tmp_path):
    path = tmp_path / "run.rrd"
    run = symgen("run", "pendulum", "--t-end", 1, *_OPTIONS, "--log", path, "--quiet")
    assert run.exit_code == 0, run.output
    for options, says in (
        (("--rtol", "1e-6"), "--rtol 1e-06: the run to resume has 1e-12"),
        (("--method", "dop853"), "--method dop853: the run to resume has dopri5"),
        (("--set", "g=3"), "--set g: the run to resume has 9.81"),
        (("--start", "theta=1"), "--start: a resumed run goes on as it was"),
        (("--step", "0.1"), "no fixed step"),
    ):
        refused = symgen("run", "--resume", path, "--t-end", 2, *options)
        assert refused.exit_code == 2 and says in refused.output.replace("\n", " "), refused.output
    other = symgen("run", "double_pendulum", "--resume", path, "--t-end", 2)
    assert other.exit_code == 2 and "is not the model of" in other.output
    assert (
        symgen("run", "pendulum", "--resume", path, "--t-end", 2, "--set", "g=9.81", "--quiet").exit_code == 0
    )
    assert read_recording(path).t[-1] == 2.0
