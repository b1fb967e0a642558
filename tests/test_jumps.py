"""Forces that jump: branches in modules, steps that end at jumps, motion that a jump holds."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest
from recorded import assert_same_recording, record

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.inputs import Table
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.verify import verify
from tests.stress.jumping_forces import KINDS, try_many
from tests.stress.scenario import FLAGGED, RIGHT


def mass(force: str, start: float = 1.0, rate: float = 0.0) -> Model:
    m = Model("mass")
    x = m.coordinate("x", start=start, rate=rate)
    m.input("u")
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, force)
    return m


def swing(t: np.ndarray) -> np.ndarray:
    """x'' = -sign(x) from 1 at rest."""
    quarter = np.sqrt(2.0)
    s = np.mod(t, 4 * quarter)
    return np.where(
        np.abs(s - 2 * quarter) < quarter,
        -1 + (s - 2 * quarter) ** 2 / 2,
        1 - np.minimum(s, 4 * quarter - s) ** 2 / 2,
    )


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_loose_tolerance_does_not_blur_a_jump(method):
    run = mass("-sign(x)").derive().run(t_end=50.0, method=method, rtol=1e-3)
    assert run.ok and not run.events
    np.testing.assert_allclose(run.q[:, 0], swing(run.t), atol=1e-9)


def test_bdf_restarts_at_jumps():
    run = mass("-sign(x)").derive().run(t_end=20.0, method="bdf", rtol=1e-7)
    np.testing.assert_allclose(run.q[:, 0], swing(run.t), atol=1e-4)


@pytest.mark.parametrize("name", KINDS)
def test_forces_with_branches_against_closed_forms(name):
    counts = try_many(name, "dop853", 3, seed=7)
    assert counts[RIGHT] >= 7 and counts[RIGHT] + counts[FLAGGED] == 9


def test_models_without_choices_have_no_branches():
    text = derive_text(mass("-x")).text
    assert '"jump"' not in text and "b_0" not in text


def test_what_depends_on_time_or_parameters_alone_has_no_branch():
    m = mass("sign(t - 1) + abs(c)*x")
    m.parameter("c", -2.0)
    assert '"jump"' not in derive_text(m).text


def test_a_branch_is_free_outside_of_runs():
    system = runtime.load(derive_text(mass("-2*sign(x) + min(x, u)")).text)
    assert system.settings[-2:] == tuple(f"branch({event['name']})" for event in system.events)
    for x in (-0.5, 0.0, 0.5):
        out = system.kernel("forces")(0.0, np.array([x, 0.0]), system.parameter_values({"u": 0.1}))
        assert out[0] == -2.0 * np.sign(x) + min(x, 0.1)


def test_a_jump_on_a_constrained_mass():
    """A pendulum in two coordinates against one in its angle."""
    m = Model("rod", gravity=(0, -9.81))
    x, y = m.coordinate("x", start=0.6), m.coordinate("y", start=-0.8)
    m.body("b", mass=1.0, com=(x, y))
    m.constraint("length", x**2 + y**2 - 1)
    m.force(x, "-2*sign(x - 0.1)")
    one = Model("angle", gravity=(0, -9.81))
    a = one.coordinate("a", start=float(np.arctan2(0.6, 0.8)))
    one.body("b", mass=1.0, com=("sin(a)", "-cos(a)"))
    one.load("wind", point=("sin(a)", "-cos(a)"), force=("-2*sign(sin(a) - 0.1)", 0))
    assert a is not None
    many, few = (model.derive().run(t_end=3.0, method="dop853", rtol=1e-9) for model in (m, one))
    assert many.ok and few.ok
    np.testing.assert_allclose(many["x"], np.sin(few["a"]), atol=1e-6)


def test_friction_that_comes_to_rest_ends_with_the_reason():
    began = time.perf_counter()
    run = mass("-x - 0.1*sign(dot(x))").derive().run(t_end=50.0, method="dop853")
    assert run.status == "failed" and run.t[-1] == pytest.approx(5 * np.pi, abs=1e-6)
    assert "sign(dot(x)) in the force on x" in run.message and "[friction]" in run.message
    assert time.perf_counter() - began < 60.0


def test_rest_at_a_jump():
    system = mass("u - sign(dot(x))", start=0.0).derive()
    assert system.run(t_end=1.0, method="dop853").ok
    held = system.run(t_end=1.0, method="dop853", parameters={"u": 0.5})
    assert held.status == "failed" and "from both sides" in held.message
    drawn = system.run(t_end=1.0, method="dop853", parameters={"u": 3.0})
    assert drawn.ok and drawn.v[-1, 0] == pytest.approx(2.0)


def test_fixed_steps_run_over_jumps():
    run = mass("-sign(x)").derive().run(t_end=5.0, method="rk4", step=1e-3)
    np.testing.assert_allclose(run.q[:, 0], swing(run.t), atol=1e-2)


def test_a_fixed_step_over_hundreds_of_events_ends_with_the_reason(monkeypatch):
    """Each turn of a mass that rubs ends a step; here ten thousand of them lie in one."""
    monkeypatch.setattr("symgen.runtime.stall._WINDOW", 0.1)
    model = mass("-1e8*x")
    model.friction("floor", coordinate="x", force=1e-3)
    run = model.derive().run(t_end=6.0, method="rk4", step=3.0)
    assert run.status == "failed" and "events of floor follow each other without end" in run.message
    assert "shorten --step" in run.message


def test_a_run_that_does_not_get_on_ends_with_the_reason(monkeypatch):
    """A spring of 1e16 N/m makes an explicit method crawl."""
    monkeypatch.setattr("symgen.runtime.stall._WINDOW", 0.1)
    monkeypatch.setattr("symgen.runtime.stall._TOO_LONG", 1e3)
    run = mass("-1e16*x").derive().run(t_end=1e3, method="dop853")
    assert run.status == "failed" and "does not get on" in run.message and "dot(x)" in run.message


def test_progress_is_shown_where_there_is_no_terminal(tmp_path):
    (tmp_path / "slow.toml").write_text(
        'name = "slow"\n[coordinates]\nx = { start = 1.0 }\n[bodies.b]\nmass = 1\ncom = ["x", 0]\n'
        '[forces]\nx = "-1e14*x"\n'
    )
    code = (
        "import sys, symgen.cli.recorded as r, symgen.cli.progress as p; "
        "r._PROGRESS_AFTER = p.PLAIN_EVERY = 0.05\n"
        f"from symgen.cli import main; sys.argv = ['symgen', 'run', {str(tmp_path / 'slow.toml')!r}, '--no-log', "
        "'--t-end', '0.1', '--method', 'dop853']; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert " of 0.1 s" in done.stderr, done.stderr


@pytest.mark.parametrize("rubbing", [False, True], ids=["alone", "beside stops and friction"])
def test_a_run_with_jumps_is_taken_up_again_and_verified(tmp_path, rubbing):
    """A recording has the settings of stops and frictions; branches of forces follow from the state."""
    m = Model("jumping", gravity=(0, -9.81))
    x, y = m.coordinate("x", start=1.0, rate=2.0), m.coordinate("y", start=0.3)
    m.body("b", mass=1.0, com=(x, y))
    m.force(x, "-2*x - sign(x - 0.2)")
    if rubbing:
        m.stop("floor", y, 0.5)
        m.friction("sole", speed="dot(x)", coefficient=0.1, normal="floor")
    text = derive_text(m).text
    system = runtime.load(text)
    whole, first, rest = (tmp_path / f"{name}.rrd" for name in ("whole", "first", "rest"))
    record(whole, text, lambda **more: solve(system, 2.0, method="dop853", **more))
    record(first, text, lambda **more: solve(system, 2.0, method="dop853", max_steps=5, **more))
    record(rest, text, Resumed(first).run)
    assert_same_recording(whole, rest)
    checked = verify(rest)
    assert checked.ok, checked.checks


CLAMPED = (5.0, -5.0, 0.5, 7.0, -0.2, 0.9, -30.0, 3.0)


@pytest.mark.parametrize("method", ["bs32", "dop853", "taylor", "bdf", "radau9", "rk4"])
@pytest.mark.parametrize(
    "force, value",
    [
        ("max(-1, min(1, u))", lambda u: max(-1.0, min(1.0, u))),
        ("min(1, max(-1, u + 1e-9*x))", lambda u: max(-1.0, min(1.0, u))),
        ("abs(abs(u + 1e-9*x) - 3)", lambda u: abs(abs(u) - 3)),
        ("where(u + 1e-9*x > 1 and u < 6, 2, where(u + 1e-9*x < -4, 5, 1))",
         lambda u: 2.0 if 1 < u < 6 else 5.0 if u < -4 else 1.0),
    ],
)  # fmt: skip
def test_an_input_that_jumps_over_several_sides_at_once(force, value, method):
    """A saturated command, over and over: each side is where the value is, however far it has jumped."""
    m = Model("clamped")
    x = m.coordinate("x")
    m.input("u")
    m.kinetic("dot(x)^2/2")
    m.force(x, force)
    times = np.arange(float(len(CLAMPED)))
    run = solve(
        runtime.load(derive_text(m).text),
        times[-1] + 1.0,
        method=method,
        inputs={"u": Table(times, CLAMPED, kind="hold")},
        t_eval=np.append(times, times[-1] + 1.0),
    )
    assert run.ok
    ends = np.searchsorted(run.t, np.append(times, times[-1] + 1.0))
    expected = np.cumsum([value(each) for each in CLAMPED])
    np.testing.assert_allclose(run["dot(x)"][ends[1:]], expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("method", ["dop853", "rk4", "radau5"])
def test_events_of_what_jumps_are_seen_each_time(method):
    """The side that a function has jumped to is a side, and leaving it an event, also where it is left by less."""
    m = Model("watched")
    x, u = m.coordinate("x", start=1.0), m.input("u")
    m.kinetic("dot(x)^2/2")
    m.potential("2*x^2")
    m.event("both", u + 1e-3 * x)
    m.event("up", u, direction="rising", then={"reset": {"dot(x)": "0.9*dot(x)"}})
    m.event("timed", "where(t < 1.5, -4, where(t < 2.5, 1, where(t < 3.5, -0.2, 0.1))) + 1e-3*x")
    values = [1.0, -5.0, 3.0, -1.0, 0.2, -0.1]
    table = Table(np.arange(6.0), values, kind="hold")
    run = solve(runtime.load(derive_text(m).text), 6.0, method=method, inputs={"u": table})
    times = {name: [round(e.t, 9) for e in run.events if e.name == name] for name in ("both", "up", "timed")}
    assert times == {"both": [1.0, 2.0, 3.0, 4.0, 5.0], "up": [2.0, 4.0], "timed": [1.5, 2.5, 3.5]}


def test_a_motion_that_grows_beyond_squares_ends_with_the_reason(monkeypatch):
    """Radau's steps shrink without end where norms of what it sees are infinite: 1e8 N/m that push away."""
    monkeypatch.setattr("symgen.runtime.stall._WINDOW", 0.1)
    m = Model("pushed")
    m.coordinate("x", start=0.1)
    m.kinetic("dot(x)^2/2")
    m.potential("-5e7*x^2")
    run = m.derive().run(t_end=10.0, method="radau5")
    assert run.status == "failed" and "grows beyond all numbers" in run.message and "dot(x)" in run.message
