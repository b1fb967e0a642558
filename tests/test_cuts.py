"""A run does not depend on where it is cut or watched; `python -m tests.stress cuts` tries that at random."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from driven_models import closed_crane, oscillator
from recorded import record

from symgen.runtime import load, solve
from symgen.runtime.inputs import Controller
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.schema import RecordingError
from tests.stress.models import described_text, point

ROOT = Path(__file__).resolve().parents[1]
TIMES = [0.013, 0.4, 0.777, 1.31, 1.9]
HELD = """
name = "held"
[parameters]
m = 1.5
[coordinates]
x = { start = 0.3 }
[energy]
kinetic = "m*dot(x)^2/2"
potential = "2*x^2"
[inputs]
u = { default = 0.0 }
[forces]
x = "u"
"""


def bundled(name):
    return load((ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8"))


def test_what_is_between_the_steps_of_euler_is_a_polygon():
    system = point("oscillating", "-4*x")
    run = solve(system, 2.0, method="euler", step=0.05, at=TIMES, fps=173.0)
    grid = solve(system, 2.0, method="euler", step=0.05, at=(0.05 * np.arange(1, 40)).tolist())
    t = np.array([0.0, *(s.t for s in grid.samples), grid.t[-1]])
    x = np.array([1.0, *(s.q[0] for s in grid.samples), grid.q[-1, 0]])
    assert len(run.step_log) == 40
    np.testing.assert_allclose([s.q[0] for s in run.samples], np.interp(TIMES, t, x), rtol=1e-14)
    np.testing.assert_allclose(run.q[:, 0], np.interp(run.t, t, x), rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "taylor", "radau5", "bdf"])
def test_states_between_steps_are_as_right_as_those_at_their_ends(method):
    system = point("oscillating", "-4*x")
    run = solve(system, 2.0, method=method, rtol=1e-9, atol=1e-11, at=TIMES)
    free = solve(system, 2.0, method=method, rtol=1e-9, atol=1e-11)
    assert run.step_log.tobytes() == free.step_log.tobytes()
    assert run.q[-1].tobytes() == free.q[-1].tobytes()
    off = [abs(s.q[0] - np.cos(2.0 * s.t)) for s in run.samples]
    assert max(off) <= 3.0 * max(abs(free.q[-1, 0] - np.cos(4.0)), 1e-9)


@pytest.mark.parametrize("method", ["dop853", "rk4", "radau5", "rattle"])
def test_states_between_steps_are_on_the_constraints(method):
    options = {} if method in ("rk4", "rattle") else {"rtol": 1e-4, "atol": 1e-6}
    run = closed_crane().run(t_end=2.0, method=method, at=TIMES, **options)
    assert len(run.samples) == len(TIMES)
    assert run.constraint_residual.max_position < 1e-10 and run.constraint_residual.max_velocity < 1e-10


def test_what_the_model_is_behind_the_end_does_not_matter():
    """x'' = sqrt(1 - t) is nothing after t = 1; x = 4/15 (1 - t)^(5/2) + 2/3 t - 4/15 from rest."""
    system = point("until", "sqrt(1 - t)", start=0.0)
    for method in ("dop853", "rk4"):
        run = solve(system, 1.0, method=method, **({"step": 0.03} if method == "rk4" else {}))
        assert run.status == "success" and run.t[-1] == 1.0
        assert run.q[-1, 0] == pytest.approx(2 / 3 - 4 / 15, abs=1e-3 if method == "rk4" else 1e-6)


def test_a_step_longer_than_the_run_is_cut_in_one_piece():
    run = solve(oscillator(), 0.01, method="gauss8", step=0.2)
    fine = solve(oscillator(), 0.01, method="gauss8", step=0.001)
    assert len(run.step_log) == 1
    np.testing.assert_allclose(run.q[-1], fine.q[-1], rtol=1e-12)


def held(t, x, memory):
    memory[0] += x[0]
    return -2.0 * x[0] - 0.1 * memory[0]


def controller():
    return {"u": Controller(held, period=0.09, noise={"x": 0.02}, seed=5, memory=[0.0])}


@pytest.mark.parametrize("cut", [0.5, 0.9, 1.23])
def test_a_sampled_controller_goes_on_with_its_memory_and_noise(tmp_path, cut):
    text = described_text(HELD)
    whole = solve(load(text), 2.0, inputs=controller(), method="dop853")
    first = tmp_path / "first.rrd"
    record(first, text, lambda **more: solve(load(text), cut, inputs=controller(), method="dop853", **more))
    with pytest.raises(RecordingError, match="controllers of u are not in the recording"):
        Resumed(first)
    rest = Resumed(first, controller()).run(2.0)
    assert rest.q[-1].tobytes() + rest.v[-1].tobytes() == whole.q[-1].tobytes() + whole.v[-1].tobytes()
    assert rest["u"][-1] == whole["u"][-1]
    with pytest.raises(Exception, match=r"period|calls"):
        Resumed(first, {"u": Controller(held, period=0.03, noise=0.02, seed=5, memory=[0.0])}).run(2.0)


def test_times_of_events_do_not_depend_on_the_end():
    ball = bundled("bouncing_ball")
    long = solve(ball, 2.0, method="dop853")
    for t_end in (0.7, 1.1, 1.5):
        short = solve(ball, t_end, method="dop853")
        assert [e.t for e in short.events] == [e.t for e in long.events if e.t <= t_end]


@pytest.mark.parametrize("form", ["projection", "baumgarte", "partition"])
@pytest.mark.parametrize("part", [0.2, 0.9])
def test_a_cut_within_the_first_step_does_not_change_it(tmp_path, form, part):
    """How long it is was found by trial steps that did not go beyond the end of the run."""
    text = (ROOT / "generated" / "heavy_top_absolute.py").read_text(encoding="utf-8")
    options = {"method": "dop853", "constraints": form}
    whole = solve(load(text), 0.05, **options)
    cut, first = part * float(whole.step_log[0, 1]), tmp_path / "first.rrd"
    record(first, text, lambda **more: solve(load(text), cut, **options, **more))
    rest = Resumed(first).run(0.05)
    assert rest.step_log.tobytes() == whole.step_log.tobytes()
    assert rest.q[-1].tobytes() + rest.v[-1].tobytes() == whole.q[-1].tobytes() + whole.v[-1].tobytes()
