"""Comparing recordings: where and by how much they differ, and how fast they part."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

from symgen.cli import main
from symgen.runtime import load, solve
from symgen.runtime.checks import growth
from symgen.runtime.checks.growth import growth_rate
from symgen.runtime.recording.compare import compare
from symgen.runtime.recording.schema import RecordingError

ROOT = Path(__file__).resolve().parents[1]


def recorded(path, name="double_pendulum", t_end=2.0, **options):
    system = load((ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8"))
    settings = {"method": "dop853", "fps": 50, **options}
    solution = solve(system, t_end, **settings)
    solution.save(path)
    return solution


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A run, the same again, and one with another gravity from the middle of a digit."""
    folder = tmp_path_factory.mktemp("runs")
    solutions = {
        "one": recorded(folder / "one.rrd"),
        "same": recorded(folder / "same.rrd"),
        "other": recorded(folder / "other.rrd", parameters={"g": 9.8}, rtol=1e-9),
    }
    return folder, solutions


def test_equal_runs_are_equal_to_the_last_bit(runs):
    folder, _ = runs
    comparison = compare(folder / "one.rrd", folder / "same.rrd", tolerance=0.0)
    assert comparison.equal and comparison.worst.largest == 0.0 and not comparison.settings
    assert comparison.summary.startswith("equal to the last bit at 101 common times")
    assert comparison.growth is None


def test_differences_are_those_of_the_states(runs):
    folder, solutions = runs
    comparison = compare(folder / "one.rrd", folder / "other.rrd")
    assert not comparison.equal
    assert {(s.name, s.first, s.second) for s in comparison.settings} == {
        ("rtol", 1e-8, 1e-9),
        ("g", 9.81, 9.8),
    }
    one, other = solutions["one"], solutions["other"]
    for name in ("theta1", "theta2", "dot(theta1)", "dot(theta2)"):
        difference = next(d for d in comparison.differences if d.name == name)
        off = np.abs(one[name] - other[name])
        assert difference.largest == off.max() and difference.t == one.t[off.argmax()]
        scale = max(np.abs(one[name]).max(), np.abs(other[name]).max())
        assert difference.relative == pytest.approx(off.max() / scale)
        assert difference.t_first == one.t[np.flatnonzero(off / scale > 1e-6)[0]]


def test_frames_at_other_times_are_left_out(runs, tmp_path):
    folder, _ = runs
    recorded(tmp_path / "coarse.rrd", fps=40)
    comparison = compare(folder / "one.rrd", tmp_path / "coarse.rrd")
    # Frames of 50 and 40 a second coincide ten times a second.
    assert comparison.equal and comparison.n_common == 21
    recorded(tmp_path / "shifted.rrd", t_start=0.0123, t_end=1.99)
    with pytest.raises(RecordingError, match="no frames at common times"):
        compare(folder / "one.rrd", tmp_path / "shifted.rrd")


def test_models_without_a_common_coordinate_are_refused(runs, tmp_path):
    folder, _ = runs
    recorded(tmp_path / "ball.rrd", "bouncing_ball", fps=None)
    with pytest.raises(RecordingError, match="no coordinate in common"):
        compare(folder / "one.rrd", tmp_path / "ball.rrd")


def test_growth_is_that_of_the_difference():
    t = np.linspace(0.0, 10.0, 400)
    assert growth_rate(t, 1e-12 * np.exp(1.7 * t)) == pytest.approx(1.7, rel=1e-6)
    noisy = 1e-12 * np.exp(1.7 * t) * np.abs(np.sin(9.0 * t))
    assert growth_rate(t, noisy) == pytest.approx(1.7, rel=0.05)
    assert growth_rate(t, np.full(400, 1e-9)) is None
    assert growth_rate(t, np.zeros(400)) is None


@pytest.mark.parametrize("n", [1, 2, 7, 37, 400])
def test_the_envelope_is_the_largest_value_of_a_window(n):
    values = np.random.default_rng(n).random(n)
    values[3::11] = np.nan
    for width in (0, 1, 2, 3, 6, 7, 8, n // 20, 30):
        known = np.nan_to_num(values, nan=np.inf)
        expected = [known[max(0, k - width) : k + 1].max() for k in range(n)]
        np.testing.assert_array_equal(growth._envelope(values, width), expected)


def test_growth_on_the_lorenz_attractor_is_its_lyapunov_exponent():
    """0.9056, Sprott, Chaos and Time-Series Analysis, 2003; one orbit of finite length tells it roughly."""

    def lorenz(t, y):
        return 10.0 * (y[1] - y[0]), y[0] * (28.0 - y[2]) - y[1], y[0] * y[1] - 8.0 / 3.0 * y[2]

    t = np.linspace(0.0, 25.0, 1000)
    start = solve_ivp(lorenz, (0.0, 20.0), [1.0, 1.0, 1.0], "DOP853", rtol=1e-10).y[:, -1]
    a, b = (
        solve_ivp(lorenz, (0.0, 25.0), start + shift, "DOP853", t, rtol=1e-12, atol=1e-14).y
        for shift in (0.0, 1e-10)
    )
    assert growth_rate(t, np.abs(a - b).max(axis=0) / 40.0) == pytest.approx(0.9056, rel=0.25)


def test_the_command_says_what_differs(runs, tmp_path):
    folder, _ = runs
    one, same, other = (str(folder / f"{name}.rrd") for name in ("one", "same", "other"))
    equal = CliRunner().invoke(main, ["compare", one, same, "--tolerance", "0"])
    assert equal.exit_code == 0 and "equal to the last bit" in equal.output
    file = tmp_path / "difference.json"
    different = CliRunner().invoke(main, ["compare", one, other, "--json", str(file)])
    assert different.exit_code == 1 and "g: 9.81 and 9.8\n" in different.output
    said = json.loads(file.read_text(encoding="utf-8"))
    assert said["equal"] is False and {d["name"] for d in said["differences"]} >= {"theta1", "dot(theta2)"}
    loose = CliRunner().invoke(main, ["compare", one, other, "--tolerance", "1", "--quiet"])
    assert loose.exit_code == 0 and not loose.output


def test_one_frame_in_common_is_nothing_to_compare(tmp_path):
    for fps, t_end in ((7, 0.9), (11, 0.95)):
        recorded(tmp_path / f"{fps}.rrd", t_end=t_end, fps=fps)
    with pytest.raises(RecordingError, match="one frame at a common time, t = 0 s"):
        compare(tmp_path / "7.rrd", tmp_path / "11.rrd")


def test_numbers_of_events_are_compared(tmp_path):
    """From 1 m the first blow comes after 0.4515 s; half as fast, the ball is down again after as long."""
    for name, t_end, e in (("one", 1.0, 0.9), ("two", 2.0, 0.5)):
        recorded(tmp_path / f"{name}.rrd", name="bouncing_ball", t_end=t_end, parameters={"e": e})
    settings = compare(tmp_path / "one.rrd", tmp_path / "two.rrd").settings
    assert [(s.first, s.second) for s in settings if s.name == "events bounce"] == [(1, 2)]
