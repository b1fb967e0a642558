"""Recordings: what is written comes back bit for bit, survives a kill, and is checked again from itself."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from symgen.runtime import load
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.recording import geometry, layout, play, schema
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.recording.recorder import RunRecorder, _thinned
from symgen.runtime.recording.rrd import write
from symgen.runtime.recording.rrd.read import read_rrd
from symgen.runtime.recording.save import module_text
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.recording.verify import verify

ROOT = Path(__file__).resolve().parents[1]
FIXTURES = Path(__file__).parent / "fixtures"
RTOL, ATOL = 1e-9, 1e-11


def recorder(path, name="double_pendulum", p=None, **options):
    """A recorder of a fixture, and the fixture's system."""
    file = FIXTURES / f"{name}.py"
    system = load(file)
    p = system.parameter_values() if p is None else p
    settings = {"method": "dop853", "rtol": RTOL, "atol": ATOL, "constraints": "projection", **options}
    text = file.read_text(encoding="utf-8")
    return RunRecorder(path, system, p, module_text=text, model_text="the model", **settings), system


def motion(name, t, y0=None):
    """States of a fixture at the times t, by SciPy."""
    system = load(FIXTURES / f"{name}.py")
    p, rhs = system.parameter_values(), system.kernel("rhs")
    if y0 is None:
        q, v, _, _ = system.initial_state()
        y0 = np.concatenate([q, v])
    solution = solve_ivp(
        lambda t, y: rhs(t, y, p)[: system.ny], t[[0, -1]], y0, "DOP853", t, rtol=RTOL, atol=ATOL
    )
    return np.ascontiguousarray(solution.y.T)


@pytest.fixture(scope="module")
def times():
    return np.linspace(0.0, 2.0, 121)


@pytest.fixture(scope="module")
def states(times):
    return motion("double_pendulum", times)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, times, states):
    """A complete recording of a double pendulum."""
    path = tmp_path_factory.mktemp("recorded") / "run.rrd"
    recording, _ = recorder(path, title="swing")
    with recording:
        recording.start(times[0], states[0])
        for first in range(0, len(times), 50):
            recording.frames(times[first : first + 50], states[first : first + 50])
        recording.steps(np.column_stack([times[:-1], np.diff(times)]))
        health = [{"check": "energy", "ok": True, "value": 1e-12, "limit": 1e-6, "says": "fine | so far"}]
        recording.finish("success", health, {"steps": 120, "rejected": 0})
    return path


def of_check(report, name):
    """One check of a report."""
    return next(check for check in report.checks if check.name == name)


# What is written comes back


def test_states_come_back_bit_for_bit(tmp_path):
    random = np.random.default_rng(5)
    t = np.cumsum(random.uniform(1e-9, 1e-2, 700))
    y = random.standard_normal((700, 4)) * 10.0 ** random.integers(-8, 2, (700, 4))
    y[3], y[4, 0], y[5, 1] = -0.0, 5e-324, np.nextafter(1.0, 2.0)
    path = tmp_path / "bits.rrd"
    recording, _ = recorder(path)
    recording.start(t[0], y[0])
    recording.frames(t[1:10], y[1:10])
    recording.flush()
    recording.frames(t[10:], y[10:])
    recording.finish("success", [], {})
    read = read_recording(path)
    assert read.t.tobytes() == t.tobytes()
    assert read.q.tobytes() == np.ascontiguousarray(y[:, :2]).tobytes()
    assert read.v.tobytes() == np.ascontiguousarray(y[:, 2:]).tobytes()
    assert read.sha256 == read.state_sha256() and read.n_frames_written == 700


def test_settings_and_texts_come_back(recorded):
    read = read_recording(recorded)
    assert (read.name, read.title, read.status, read.complete) == (
        "double_pendulum",
        "swing",
        "success",
        True,
    )
    assert read.module_text == (FIXTURES / "double_pendulum.py").read_text(encoding="utf-8")
    assert read.model_text == "the model"
    assert (read.method, read.constraints, read.rtol, read.atol) == ("dop853", "projection", RTOL, ATOL)
    assert read.parameters == {"m1": 1.0, "m2": 1.0, "l1": 1.0, "l2": 1.0, "g": 9.81} and read.inputs == {}
    assert read.stats == {"steps": 120, "rejected": 0} and read.health[0]["says"] == "fine | so far"
    assert set(read.versions) == {"generator", "python", "numpy", "numba", "rerun", "machine"}


def test_the_repeated_start_is_left_out(recorded, times):
    assert read_recording(recorded).t.tobytes() == times.tobytes()


def test_arrays_are_read_only(recorded):
    with pytest.raises(ValueError):
        read_recording(recorded).q[0, 0] = 1.0


def test_poses_are_those_of_the_kernel(recorded, times, states):
    system = load(FIXTURES / "double_pendulum.py")
    kernel, p = system.kernel("poses"), system.parameter_values()
    rows = np.array([kernel(t, y, p) for t, y in zip(times, states)]).reshape(-1, 2, 12)
    _, batches, _ = read_rrd(recorded, [f"{schema.BODIES}/bob1", f"{schema.BODIES}/bob2"])
    for body, name in enumerate(("bob1", "bob2")):
        parts = sorted(batches[f"{schema.BODIES}/{name}"], key=lambda b: b.column(schema.FRAME)[0].as_py())
        moves = np.concatenate([matrix(b, "Transform3D:translation", 3) for b in parts])
        turns = np.concatenate([matrix(b, "Transform3D:quaternion", 4) for b in parts])
        np.testing.assert_array_equal(moves, rows[:, body, :3].astype(np.float32))
        np.testing.assert_allclose(
            Rotation.from_quat(turns).as_matrix(), rows[:, body, 3:].reshape(-1, 3, 3), atol=3e-7
        )


def matrix(batch, column, width):
    """A column of lists of vectors as an array."""
    return batch.column(column).flatten().flatten().to_numpy().reshape(-1, width)


def test_simulated_time_is_rounded_not_cut(recorded, times):
    _, batches, _ = read_rrd(recorded, [schema.STATE])
    column = np.concatenate([b.column(schema.SIM_TIME).to_numpy() for b in batches[schema.STATE]])
    np.testing.assert_array_equal(
        np.sort(column).astype("timedelta64[ns]").astype(np.int64), np.rint(times * 1e9).astype(np.int64)
    )


# Killed runs, damaged and foreign files

_KILLED = """
import sys, time
sys.path[:0] = [{root!r}, {tests!r}]
import numpy as np
from test_recording import recorder
recording, _ = recorder({path!r})
y = np.load({states!r})
t = np.load({times!r})
recording.start(t[0], y[0])
for i in range(1, len(t)):
    recording.frames(t[i:i + 1], y[i:i + 1])
    if i == 60:
        recording.flush()  # Rerun is loaded
    if i > 60:
        print(i, flush=True)
        time.sleep(0.05)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no kill -9 here")
def test_a_killed_run_leaves_a_readable_recording(tmp_path, times, states):
    path = tmp_path / "killed.rrd"
    np.save(tmp_path / "t.npy", times)
    np.save(tmp_path / "y.npy", states)
    names = {"path": str(path), "states": str(tmp_path / "y.npy"), "times": str(tmp_path / "t.npy")}
    code = _KILLED.format(root=str(ROOT), tests=str(ROOT / "tests"), **names)
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if int(line) >= 80:  # a second after the first chunk: another one has been written
                break
        process.kill()
    read = read_recording(path)
    n = len(read.t)
    assert not read.complete and read.status == "incomplete" and 51 <= n <= 82
    assert read.states.tobytes() == states[:n].tobytes()
    report = verify(path)
    assert report.ok and not report.complete
    assert report.summary.startswith(f"incomplete: {n} frames up to t = ")


def test_an_aborted_run_is_incomplete_and_an_empty_one_leaves_no_file(tmp_path, times, states):
    recording, _ = recorder(tmp_path / "empty.rrd")
    recording.abort()
    assert not (tmp_path / "empty.rrd").exists()
    with pytest.raises(ZeroDivisionError):
        with recorder(tmp_path / "aborted.rrd")[0] as recording:
            recording.start(times[0], states[0])
            recording.frames(times, states)
            raise ZeroDivisionError
    read = read_recording(tmp_path / "aborted.rrd")
    assert len(read.t) == len(times) and not read.complete


def test_a_run_that_fails_at_its_start_leaves_no_file(tmp_path, times, states):
    text = (FIXTURES / "double_pendulum.py").read_text(encoding="utf-8")
    text = text.replace(
        '"shape": "sphere", "sizes": 1, "mesh": ""', '"shape": "mesh", "sizes": 0, "mesh": "../a.stl"', 1
    )
    text = text.replace("out[0] = 0.05\n    out[1] = 0.05\n", "out[0] = 0.05\n")
    system = load(text)
    path = tmp_path / "failed.rrd"
    recording = RunRecorder(
        path, system, system.parameter_values(), method="rk4", rtol=0, atol=0, constraints="none",
        module_text=text, model_text="", mesh_folder=tmp_path,
    )  # fmt: skip
    recording.start(times[0], states[0])
    with pytest.raises(RuntimeModelError, match=r"bob1.*outside the model's folder"):
        recording.finish("success", [], {})
    recording.abort()
    assert not path.exists()


def test_ctrl_c_waits_until_a_chunk_is_written(tmp_path, times, states):
    path = tmp_path / "interrupted.rrd"
    recording, _ = recorder(path)
    recording.start(times[0], states[0])
    recording.frames(times[:60], states[:60])
    recording.flush()
    writer, write = recording._writer, recording._writer.frames

    def interrupted(*arguments):
        os.kill(os.getpid(), signal.SIGINT)
        write(*arguments)

    writer.frames = interrupted
    recording.frames(times[60:], states[60:])
    with pytest.raises(KeyboardInterrupt):
        recording.flush()
    recording.finish("interrupted", [], {})
    read = read_recording(path)
    assert read.t.tobytes() == times.tobytes() and read.status == "interrupted"


_FULL = """
import resource, sys
sys.path[:0] = [{root!r}, {tests!r}]
import numpy as np
from test_recording import recorder
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
recording, _ = recorder({path!r})
y = np.random.default_rng(0).standard_normal((20_000, 4))
recording.start(0.0, y[0])
try:
    for i in range(1, 20_000, 1000):
        recording.frames(np.arange(i, i + 999) * 0.01, y[i:i + 999])
    recording.finish("success", [], {{}})
except Exception as error:
    print(type(error).__name__, error)
    recording.abort()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limits on files here")
def test_a_full_disk_is_an_error_not_a_silent_loss(tmp_path):
    code = _FULL.format(root=str(ROOT), tests=str(ROOT / "tests"), path=str(tmp_path / "full.rrd"))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.startswith("RecordingError") and "is the disk full?" in run.stdout


def test_a_place_that_cannot_be_written_is_refused_before_the_run(tmp_path):
    with pytest.raises(RuntimeModelError, match="does not exist"):
        recorder(tmp_path / "nowhere" / "run.rrd")
    with pytest.raises(RuntimeModelError, match="is a folder"):
        recorder(tmp_path)


def test_frames_of_the_wrong_length_are_refused(tmp_path, times, states):
    recording, _ = recorder(tmp_path / "run.rrd")
    with pytest.raises(RuntimeError, match="start"):
        recording.frames(times, states)
    recording.start(times[0], states[0])
    with pytest.raises(ValueError, match=r"\(n, 4\)"):
        recording.frames(times, states[:, :3])


def test_one_flipped_bit_in_the_states_is_found(recorded, tmp_path, states):
    content = bytearray(recorded.read_bytes())
    found = [content.find(states[i, 2:].tobytes()) for i in range(10, len(states))]
    place = next(place for place in found if place > 0)
    content[place] ^= 1
    changed = tmp_path / "changed.rrd"
    changed.write_bytes(content)
    check = of_check(verify(changed), "checksum")
    assert check.ok is False and "changed" in check.says
    assert verify(recorded).ok


def record_ends(content):
    """Where each record of a file ends, from its head: kind and length."""
    ends, place = [], 12
    while place < len(content):
        kind, length = struct.unpack_from("<QQ", content, place)
        if kind == 0:
            break
        place += 16 + length
        ends.append(place)
    return ends


def test_a_flipped_bit_is_found_wherever_it_is(recorded, tmp_path):
    """In poses, plots and texts as well, up to the closing record, which has the digest; none brings down the reader.

    One in a record's length looks like a file that was cut off there, which is said as well.
    """
    content, random = recorded.read_bytes(), np.random.default_rng(7)
    covered, end = read_recording(recorded).file_bytes, record_ends(content)[-1]
    assert 0.9 * end < covered < end
    changed = tmp_path / "changed.rrd"
    for place in (*random.integers(12, covered, 50), *random.integers(covered, end, 10)):
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(random.integers(8))
        changed.write_bytes(flipped)
        try:
            report = verify(changed, intervals=0)
            found = not (report.ok and report.complete)
        except RecordingError:
            found = True
        assert found or place >= covered, f"byte {place}"


def test_a_torn_file_is_read_up_to_its_last_whole_record(recorded, tmp_path, states):
    content, random = recorded.read_bytes(), np.random.default_rng(3)
    whole, torn, seen = record_ends(content), tmp_path / "torn.rrd", set()
    for length in [*random.integers(0, len(content), 30), whole[-1] - 1, whole[-1], len(content) - 1]:
        torn.write_bytes(content[:length])
        try:
            read = read_recording(torn)
        except RecordingError as error:
            assert "cut off before its first states" in str(error) or "not a Rerun" in str(error)
            seen.add(0)
            continue
        n = len(read.t)
        seen.add(n)
        assert read.states.tobytes() == states[:n].tobytes() and n > 0
        assert read.complete == (length >= whole[-1])
        if length < whole[-1]:
            assert read.lost == length - max(end for end in whole if end <= length)
        report = verify(torn, intervals=1)
        assert report.ok, [check for check in report.checks if check.ok is False]
    assert len(seen) > 2 and len(states) in seen


@pytest.mark.parametrize("content", [b"", b"not a recording at all\n" * 50])
def test_other_files_are_refused_in_one_line(tmp_path, content):
    path = tmp_path / "other.rrd"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="not a Rerun recording") as error:
        read_recording(path)
    assert "\n" not in str(error.value)


def test_a_missing_file_and_someone_elses_recording_are_refused(tmp_path):
    with pytest.raises(RecordingError, match="no such file"):
        read_recording(tmp_path / "missing.rrd")
    foreign = write.rr.RecordingStream("someone_else")
    foreign.save(tmp_path / "foreign.rrd")
    foreign.log("points", write.rr.Points3D([[0, 0, 0]]), static=True)
    foreign.flush()
    foreign.disconnect()
    with pytest.raises(RecordingError, match="'someone_else', not one of symgen"):
        read_recording(tmp_path / "foreign.rrd")


# Verification


def test_a_good_run_passes_every_check(recorded):
    report = verify(recorded)
    assert report.ok and report.complete and all(check.ok for check in report.checks)
    names = {check.name for check in report.checks}
    assert names == {
        "bytes", "checksum", "frames", "model", "finite", "time", "energies as recorded", "energy", "equations",
        "motion",
    }  # fmt: skip
    assert report.to_dict()["ok"] is True and report.to_dict()["frames"] == 121


def test_states_that_do_not_solve_the_equations_are_found(tmp_path, times, states):
    """The same motion, recorded as that of a model with another gravity."""
    path = tmp_path / "wrong.rrd"
    p = load(FIXTURES / "double_pendulum.py").parameter_values({"g": 9.7})
    recording, _ = recorder(path, p=p)
    recording.start(times[0], states[0])
    recording.frames(times, states)
    recording.finish("success", [], {})
    report = verify(path)
    failed = {check.name for check in report.checks if check.ok is False}
    assert failed == {"energy", "motion"} and "failed: energy, motion" in report.summary


def test_constrained_states_carry_their_multipliers(tmp_path):
    """The multiplier of x² + y² = l² is half the rod's force by its length; Newton's law gives the force."""
    t = np.linspace(0.0, 1.0, 61)
    y = motion("cartesian_pendulum", t)
    path = tmp_path / "constrained.rrd"
    recording, _ = recorder(path, "cartesian_pendulum")
    recording.start(t[0], y[0])
    recording.frames(t, y)
    recording.finish("success", [], {})
    read = read_recording(path)
    expected = (9.81 * y[:, 1] - (y[:, 2:] ** 2).sum(axis=1)) / (2 * 0.25)
    np.testing.assert_allclose(read.multipliers[:, 0], expected, rtol=1e-7)
    report = verify(path)
    assert report.ok and of_check(report, "constraint position").value < 1e-8
    assert of_check(report, "multipliers").value == 0.0


def test_a_reset_is_allowed_for_in_the_energy_balance_and_left_out_of_the_motion(tmp_path, times, states):
    system = load(FIXTURES / "double_pendulum.py")
    energy, p = system.kernel("energy"), system.parameter_values()
    after = states[60].copy()
    after[2:] *= 0.5
    change = energy(0, after, p).sum() - energy(0, states[60], p).sum()
    rest = motion("double_pendulum", times[60:], after)
    for told, ok in ((change, True), (0.0, False)):
        path = tmp_path / f"{ok}.rrd"
        recording, _ = recorder(path)
        recording.start(times[0], states[0])
        recording.frames(times[:61], states[:61])
        recording.event("stop", times[60], energy_change=told)
        recording.frames(times[60:], rest)
        recording.finish("success", [], {})
        report = verify(path, intervals=200)
        assert of_check(report, "energy").ok is ok
        assert of_check(report, "motion").ok and of_check(report, "time").ok
        event = read_recording(path).events[0]
        assert (event.name, event.t, event.frame, event.energy_change) == ("stop", times[60], 61, told)


def test_a_frame_that_is_not_finite_is_named(tmp_path, times, states):
    broken = states.copy()
    broken[7, 1] = np.nan
    path = tmp_path / "nan.rrd"
    recording, _ = recorder(path)
    recording.start(times[0], states[0])
    recording.frames(times, broken)
    recording.finish("failed", [], {})
    check = of_check(verify(path), "finite")
    assert check.ok is False and check.says.startswith("frame 7 at t = ")


# Pictures


@pytest.mark.parametrize("seed", range(3))
def test_quaternions_agree_with_scipy(seed):
    rotations = Rotation.random(200, random_state=seed).as_matrix()
    half_turns = Rotation.from_rotvec(
        np.pi * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8]])
    ).as_matrix()
    rotations = np.concatenate([rotations, half_turns, np.eye(3)[None]])
    q = geometry.quaternions(rotations.reshape(5, -1, 3, 3)).reshape(-1, 4)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), rotations, atol=1e-14)


def test_bodies_without_a_shape_are_drawn_by_what_they_do():
    bodies = [{"name": n, "planar": True, "shape": "", "sizes": 0, "mesh": ""} for n in ("point", "block")]
    bodies.append({"name": "rod", "planar": True, "shape": "capsule", "sizes": 2, "mesh": ""})
    turning = Rotation.from_euler("z", [[0.0], [0.3]]).as_matrix()
    rotations = np.stack([np.broadcast_to(np.eye(3), (2, 3, 3)), turning, turning], axis=1)
    point, block, rod = geometry.primitives(bodies, np.array([0.1, 2.0]), rotations, 4.0, None)
    assert point.kind == "sphere" and point.sizes[0] == pytest.approx(0.1)
    assert block.kind == "box" and block.sizes[0] > block.sizes[1]
    assert (rod.kind, rod.sizes, rod.along_x) == ("capsule", (0.1, 2.0), True)
    _, high = geometry.drawn_boxes([rod], np.zeros((1, 1, 3)), np.eye(3)[None, None])
    np.testing.assert_allclose(high, [[1.1, 0.1, 0.1]])


def test_meshes_stay_below_the_models_folder(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "secret.stl").touch()
    body = {"name": "arm", "planar": False, "shape": "mesh", "sizes": 0, "mesh": "../secret.stl"}
    with pytest.raises(RuntimeModelError, match="outside the model's folder"):
        geometry.primitives([body], np.zeros(0), np.eye(3)[None, None], 1.0, tmp_path / "models")


@pytest.mark.parametrize(
    ("seconds", "speed"), [(0.03, 0.005), (1.0, 0.2), (10.0, 1.0), (60.0, 1.0), (1000.0, 20.0), (0.0, 1.0)]
)
def test_playback_takes_a_time_one_can_watch(seconds, speed):
    assert layout.choose_speed(seconds) == pytest.approx(speed)


def test_a_long_step_log_keeps_its_extremes():
    log = np.column_stack([np.arange(100_000.0), np.random.default_rng(1).uniform(1e-6, 1.0, 100_000)])
    thin = _thinned(log)
    assert len(thin) == 1000 and (np.diff(thin[:, 0]) >= 0).all()
    assert thin[:, 1].min() == log[:, 1].min() and thin[:, 1].max() == log[:, 1].max()


# Rerun is kept in one place


def test_rerun_is_imported_when_the_first_chunk_is_written():
    code = "import sys\nfrom symgen.runtime.recording import play, recorder\nsys.exit('rerun' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_nothing_global_is_left_in_rerun(recorded):
    rr = write.rr
    assert rr.get_global_data_recording() is None and rr.get_thread_local_data_recording() is None
    before = rr.strict_mode()
    writer = write.RrdWriter(recorded.with_name("strict.rrd"), "strict", True)
    writer.times(np.zeros(2))
    with pytest.raises(Exception):  # noqa: B017  what Rerun raises is its own affair; without care it would only warn
        writer.scalars("plots/x", np.zeros((3, 1)))
    writer.close()
    assert rr.strict_mode() == before


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="Linux shows the threads of libraries there")
def test_a_recording_leaves_no_thread_behind(tmp_path, times, states):
    def threads_after(number: int, at_most: int) -> int:
        recording, _ = recorder(tmp_path / f"{number}.rrd")
        recording.start(times[0], states[0])
        recording.finish("success", [], {})
        deadline = time.monotonic() + 10.0  # they end a moment after they are told to
        while (n := len(os.listdir("/proc/self/task"))) > at_most and time.monotonic() < deadline:
            time.sleep(0.01)
        return n

    first = threads_after(0, at_most=10**6)
    for number in range(1, 4):
        assert threads_after(number, first) <= first


# Playback


def test_without_a_screen_play_says_what_to_do(recorded, monkeypatch):
    monkeypatch.setattr(play.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RuntimeModelError, match=r"no screen.*--web"):
        play.play(recorded)


_VIEWER = """
import subprocess, sys
subprocess.call([sys.executable, "-c", "import time; print(1, flush=True); time.sleep(60)"])
"""


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
def test_ctrl_c_ends_the_viewer_and_its_wrapper(recorded, tmp_path):
    """A stand-in for the viewer: a wrapper with a child, as Rerun's is."""
    code = f"""
import sys
from symgen.runtime.recording import play
play.viewer_command = lambda: [sys.executable, "-c", {_VIEWER!r}]
sys.exit(play.play({str(recorded)!r}, web=True))
"""
    process = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline().strip() == "1"
    children = descendants(process.pid)
    assert len(children) == 2
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    time.sleep(0.2)
    assert not [child for child in children if alive(child)]


def descendants(pid):
    """Processes below one, from /proc."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(status.parent.name)] = int(fields[1])
    found = [pid]
    for parent in found:
        found += [child for child, own in parents.items() if own == parent]
    return found[1:]


def alive(pid):
    """Whether a process is there and not merely waiting to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


# A run that is over


@pytest.fixture(scope="module")
def bounces():
    from symgen.runtime import solve

    return solve(load(FIXTURES / "ball.py"), 2.0, fps=50)


def test_a_solution_is_saved_with_its_events(tmp_path, bounces):
    path = tmp_path / "saved.rrd"
    bounces.save(path, title="bounces", model_text="a ball")
    read = read_recording(path)
    assert read.t.tobytes() == bounces.t.tobytes() and read.q.tobytes() == bounces.q.tobytes()
    assert [(e.name, e.t) for e in read.events] == [(e.name, e.t) for e in bounces.events] and read.events
    assert (read.title, read.model_text, read.status) == ("bounces", "a ball", bounces.status)
    report = verify(path, intervals=40)
    assert report.ok, report.summary
    assert of_check(report, "energy").value == pytest.approx(bounces.energy.max_error, abs=1e-14)


def test_a_module_that_has_no_file_is_put_together_again():
    file = FIXTURES / "cartesian_pendulum.py"
    text = file.read_text(encoding="utf-8")
    assert module_text(load(file)) == text
    again = load(module_text(load(text)))
    assert again.source.header == load(file).source.header
    assert again.source.functions == load(file).source.functions


@pytest.mark.parametrize("name", ["stick_slip", "door_stop"])
def test_stops_and_frictions_are_recorded_and_checked(tmp_path, name):
    from symgen.runtime import solve

    system = load((ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8"))
    path = tmp_path / "saved.rrd"
    solution = solve(system, 3.0, method="dop853", fps=100)
    solution.save(path)
    read, report = read_recording(path), verify(path, intervals=40)
    np.testing.assert_array_equal(read.settings, solution.forms.settings[solution.forms.index])
    assert len(np.unique(read.settings, axis=0)) > 1
    assert report.ok, [check for check in report.checks if check.ok is False]
    assert of_check(report, "equations").ok and of_check(report, "motion").ok


def test_curves_that_would_be_flat_get_a_plot_of_their_own():
    names = [{"name": name, "unit": "rad"} for name in ("crank", "coupler", "rocker")]
    header = {"coordinates": names, "rates": names, "outputs": [], "constraints": []}
    low = {"q": np.array([0.0, -0.5, -0.4]), "v": np.array([-1.0, -1.0, -1.0])}
    high = {"q": np.array([120.0, 0.5, 0.6]), "v": np.array([1.0, 2.0, 1.0])}
    large, small, rates = layout.readable(layout.plot_rows(header), low, high)[0].plots
    assert (large.title, large.shown) == ("Coordinates [rad]: crank", (True, False, False))
    assert (small.title, small.shown) == ("Coordinates [rad]: coupler, rocker", (False, True, True))
    assert large.path == small.path and rates.shown == ()


def test_many_curves_are_spread_over_plots():
    many = [{"name": f"q{i}", "unit": "m"} for i in range(100)]
    plots = layout.plot_rows({"coordinates": many, "rates": [], "outputs": [], "constraints": []})[0].plots
    assert [len(plot.columns) for plot in plots] == [12, 12, 12, 12]
    assert plots[1].title == "Coordinates [m] 13 to 24 of 100" and plots[1].names[0] == "q12"
    assert len({plot.path for plot in plots}) == 4


class _SlowStream:
    """A stream whose flushes time out; `grow` writes to the file meanwhile."""

    def __init__(self, grow, times_out):
        self.grow, self.left = grow, times_out

    def flush(self, timeout_sec):
        if self.left:
            self.left -= 1
            self.grow()
            raise RuntimeError("Flush timed out - not all log messages were sent")


def test_a_slow_disk_is_waited_for_and_a_dead_writer_is_not(tmp_path):
    from symgen.runtime.recording.rrd.write import RrdWriter

    writer = RrdWriter.__new__(RrdWriter)
    writer.path = tmp_path / "slow.rrd"
    writer.path.write_bytes(b"")

    def grow():
        with writer.path.open("ab") as file:
            file.write(b"more")

    writer._stream = _SlowStream(grow, 3)
    writer.flush()
    assert writer._stream.left == 0
    writer._stream = _SlowStream(lambda: None, 10)
    with pytest.raises(RecordingError, match="is the disk full"):
        writer.flush()
    assert writer._stream.left == 8
