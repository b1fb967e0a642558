"""Events: exact times, double crossings, order at one instant, resting contact, Zeno."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from symgen import Model, dot, sign
from symgen.runtime import load, solve
from symgen.runtime.checks.jumped_over import Path as RecordedPath
from symgen.runtime.checks.missed_events import _crossings
from symgen.runtime.inputs import Table

FIXTURES = Path(__file__).parent / "fixtures"
METHODS = ("dop853", "dopri5", "rk4", "verlet")


@pytest.fixture(scope="module")
def ball():
    return load(FIXTURES / "ball.py")


@pytest.fixture(scope="module")
def oscillator():
    return load(FIXTURES / "oscillator.py")


def times(solution, name):
    return [event.t for event in solution.events if event.name == name]


def impact_times(n, e=0.8, g=9.81, height=1.0):
    first = np.sqrt(2 * height / g)
    flights = 2 * first * e ** np.arange(1, n)
    return first + np.concatenate([[0.0], np.cumsum(flights)])


@pytest.mark.parametrize("method", METHODS)
def test_impacts_of_a_bouncing_ball(ball, method):
    exact = impact_times(6)
    solution = solve(
        ball, exact[-1] + 0.01, method=method, step=0.01 if method in ("rk4", "verlet") else None
    )
    np.testing.assert_allclose(times(solution, "floor"), exact, rtol=0, atol=1e-12)
    impact = solution.events[-1]
    assert impact.v_after[0] == pytest.approx(-0.8 * impact.v_before[0], rel=1e-14)
    assert solution.status == "success"
    # Energy that impacts take is counted as work, so the balance closes.
    assert solution.energy.max_error < 1e-12
    assert solution.energy.final < 0.2 * solution.energy.initial


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-6, 1e-9])
def test_double_crossing_within_one_step(ball, method, gap):
    """The apex rises above the level by a hair; steps are far longer than the time above it."""
    v0, g = 3.0, 9.81
    apex = 10.0 + v0**2 / (2 * g)
    solution = solve(
        ball, 0.7, method=method, start={"x": 10.0}, rate={"x": v0}, parameters={"level": apex - gap}
    )
    half = np.sqrt(2 * gap / g)
    # The level is known to round-off of 10 m, its crossing times to that over the speed there.
    tolerance = 1e-14 / (g * half) + 1e-14
    exact = [v0 / g - half, v0 / g + half]
    np.testing.assert_allclose(times(solution, "passes"), exact, rtol=0, atol=tolerance)
    np.testing.assert_allclose(times(solution, "ascends"), exact[:1], rtol=0, atol=tolerance)
    np.testing.assert_allclose(times(solution, "descends"), exact[1:], rtol=0, atol=tolerance)


def test_a_near_miss_is_not_an_event(ball):
    solution = solve(
        ball, 0.7, start={"x": 10.0}, rate={"x": 3.0}, parameters={"level": 10.0 + 9.0 / 19.62 + 1e-9}
    )
    assert solution.events == [] or {event.name for event in solution.events} <= {"late", "later"}


@pytest.mark.parametrize("method", METHODS)
def test_events_of_one_instant_act_in_file_order(ball, method):
    solution = solve(ball, 0.4, method=method, step=0.07 if method in ("rk4", "verlet") else None)
    together = [event for event in solution.events if event.name in ("late", "later")]
    assert [event.name for event in together] == ["late", "later"]
    assert together[0].t == together[1].t == pytest.approx(0.3, abs=1e-15)


def test_active_at_the_start_fires_only_after_leaving_zero(ball):
    # At rest on the level: falls away from it and never comes back.
    solution = solve(ball, 0.1, parameters={"level": 1.0})
    assert times(solution, "passes") == times(solution, "descends") == []
    # Thrown up from the level: comes back once.
    solution = solve(ball, 0.9, rate={"x": 2.0}, parameters={"level": 1.0})
    np.testing.assert_allclose(times(solution, "passes"), [2 * 2.0 / 9.81], atol=1e-13)
    np.testing.assert_allclose(times(solution, "descends"), [2 * 2.0 / 9.81], atol=1e-13)
    assert times(solution, "ascends") == []


def test_an_event_does_not_fire_again_at_its_own_instant(ball):
    # "passes" watches the floor itself, in both directions: one record for each impact.
    exact = impact_times(4)
    solution = solve(ball, exact[-1] + 0.01, parameters={"level": 0.0})
    np.testing.assert_allclose(times(solution, "floor"), exact, atol=1e-12)
    np.testing.assert_allclose(times(solution, "passes"), exact, atol=1e-12)


def test_zeno(ball):
    e = 0.6
    first = np.sqrt(2 / 9.81)
    rest = first * (1 + 2 * e / (1 - e))
    solution = solve(ball, 5.0, parameters={"e": e})
    assert solution.status == "zeno"
    assert solution.t[-1] == pytest.approx(rest, abs=1e-6)
    assert "'floor'" in solution.message and f"{rest:.5f}" in solution.message
    assert np.abs(solution.q).max() <= 1.0 + 1e-12
    assert solution.q.min() > -1e-9


def test_zeno_where_bounces_are_lower_than_the_tolerance(ball):
    """A method that finds an impact while the ball rises: the reset would send it through the floor."""
    solution = solve(ball, 10.0, parameters={"e": 0.5, "g": 1.0}, method="bdf")
    assert solution.status == "zeno"
    assert solution.t[-1] == pytest.approx(3.0 * np.sqrt(2.0), abs=1e-2)
    assert solution.q.min() > -1e-5


def test_stop_with_spring_against_scipy(oscillator):
    """Independent oracle: SciPy's own event location, restarted by hand at each impact."""
    from scipy.integrate import solve_ivp

    def f(t, y):
        return [y[1], 0.5 * np.sin(3.0 * t) - 0.2 * y[1] - 25.0 * y[0]]

    def stop(t, y):
        return y[0] + 0.05

    stop.terminal, stop.direction = True, -1
    t, y, exact = 0.0, [0.1, 0.0], []
    while t < 6.0:
        leg = solve_ivp(f, (t, 6.0), y, method="DOP853", rtol=1e-12, atol=1e-14, events=stop)
        t, y = leg.t[-1], leg.y[:, -1]
        if leg.status == 1:
            exact.append(t)
            y = [-0.05 + 1e-15, -0.6 * y[1]]
    solution = solve(oscillator, 6.0, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(times(solution, "stop"), exact, atol=1e-9)
    np.testing.assert_allclose(solution.q[-1, 0], y[0], atol=1e-9)
    assert solution.energy.max_error < 1e-9


def test_terminate(oscillator):
    solution = solve(oscillator, 10.0, parameters={"t_limit": 0.1234567})
    assert solution.status == "terminated"
    assert solution.t[-1] == pytest.approx(0.1234567, abs=1e-15)
    assert "'limit'" in solution.message
    assert solution.events[-1].action == "terminate"


def test_frames_before_an_event_are_those_without_it(ball):
    free = solve(ball, 0.45, fps=500)
    stopped = solve(ball, 2.0, fps=500)
    np.testing.assert_allclose(stopped.q[:200], free.q[:200], atol=1e-14)


PISTON = """
[parameters]
e = 0.6
[coordinates]
theta = { start = 0.5, rate = 20.0 }
phi = { guess = -0.2 }
x = { guess = 0.4 }
[bodies.crank]
mass = 1.0
inertia = 0.01
com = ["0.1*cos(theta)", "0.1*sin(theta)"]
angle = "theta"
[constraints]
closes_x = "0.1*cos(theta) + 0.3*cos(phi) - x"
closes_y = "0.1*sin(theta) + 0.3*sin(phi)"
[forces]
theta = "1.0"
[events.stop]
when = "x - 0.25"
direction = "falling"
then = { reset = { "dot(x)" = "-e*dot(x)" } }
"""


@pytest.fixture(scope="module")
def piston():
    from symgen import Model

    return Model.from_toml(PISTON).derive()


def test_reset_of_a_coordinate_without_mass(piston):
    """The piston has no mass: only the constraints carry its impact to the crank."""
    first = solve(piston, 0.3).events[0]
    assert first.v_after[2] == pytest.approx(-0.6 * first.v_before[2], rel=1e-12)
    np.testing.assert_allclose(first.v_after, -0.6 * first.v_before, rtol=1e-9)
    assert first.energy_change < 0.0


def test_zeno_where_bounces_vanish_in_round_off(piston):
    solution = solve(piston, 5.0)
    assert solution.status == "zeno"
    assert solution["x"].min() > 0.25 - 1e-9


@pytest.mark.parametrize(("direction", "first"), [("both", 1), ("rising", 1), ("falling", 2)])
@pytest.mark.parametrize("method", ["auto", "dop853", "taylor", "radau5", "bdf"])
def test_an_input_that_is_held_fires_the_events_that_read_it(direction, first, method):
    model = Model("clock")
    model.coordinate("x", start=1.0)
    u = model.input("u")
    model.kinetic("dot(x)^2/2")
    model.potential("x^2/2")
    model.event("tick", u - 0.5, direction=direction)
    table = Table(0.5 * np.arange(11), np.arange(11) % 2, kind="hold")
    run = model.derive().run(5.25, inputs={"u": table}, method=method)
    every = 1 if direction == "both" else 2
    assert times(run, "tick") == pytest.approx([0.5 * k for k in range(first, 11, every)])
    assert run.ok


@pytest.mark.parametrize("direction", ["both", "falling"])
def test_what_jumps_at_the_end_and_at_frames_has_not_been_passed_by(direction):
    model = Model("clock")
    model.coordinate("x", start=1.0)
    model.kinetic("dot(x)^2/2")
    model.potential("x^2/2")
    model.event("tick", "mod(t, 1) - 0.5", direction=direction)
    run = model.derive().run(5.0)
    halves = [0.5, 1.5, 2.5, 3.5, 4.5] if direction == "both" else []
    assert times(run, "tick") == pytest.approx(sorted([1.0, 2.0, 3.0, 4.0, *halves]))
    assert run.ok


SAW = """
[coordinates]
x = { start = 0.1, rate = 1.0 }
[energy]
kinetic = "dot(x)^2/2"
[events.tooth]
when = "mod(x, 1) - 0.5"
direction = "both"
[events.edge]
when = "mod(x, 1) - 0.75"
direction = "falling"
then = { reset = { "dot(x)" = "dot(x) + sign(dot(x))*speed_up" } }
[parameters]
speed_up = 0.0
"""


@pytest.fixture(scope="module")
def saw():
    return Model.from_toml(SAW).derive()


@pytest.mark.parametrize("rate", [1.0, -1.0])
@pytest.mark.parametrize("method", ["taylor", "radau5"])
def test_functions_that_jump_over_zero_fire_again(saw, method, rate):
    """Behind a jump a function is past zero for good: what it is at is no round-off that hides its next crossings."""
    solution = saw.run(t_end=5.3, method=method, max_step=0.3, rate={"x": rate})
    teeth = np.arange(12) / 2.0 - 0.1 * rate
    np.testing.assert_allclose(times(solution, "tooth"), teeth[(teeth > 0.0) & (teeth < 5.3)], atol=1e-12)
    edges = np.arange(7) + (0.9 if rate > 0.0 else 0.35)  # it falls at the jump, or at its own zero
    np.testing.assert_allclose(times(solution, "edge"), edges[edges < 5.3], atol=1e-12)
    assert all(check.ok for check in solution.health), [c.says for c in solution.health if not c.ok]


def test_a_function_that_jumps_fires_again_after_a_reset(saw):
    solution = saw.run(t_end=3.0, method="taylor", max_step=0.1, parameters={"speed_up": 1.0})
    expected = 0.9 + np.cumsum([0.0, *(1.0 / np.arange(2, 20))])
    np.testing.assert_allclose(times(solution, "edge"), expected[expected < 3.0], atol=1e-12)


@pytest.mark.parametrize("direction, first", [("rising", 0.25), ("falling", 0.5)])
@pytest.mark.parametrize("method", ["taylor", "bs32"])
def test_teeth_within_a_step_are_found_one_by_one(method, direction, first):
    """x = 2 t: a step behind the last turn of the input is as long as a method likes."""
    m = Model("rack")
    m.coordinate("x", rate=2.0)
    m.input("u")
    m.kinetic("dot(x)^2/2")
    m.event("tooth", "mod(x, 1) - 0.5", direction=direction)
    ramp = Table([0.0, 2.0, 9.3], [0.0, 1.0, 0.0], kind="linear")
    m.event("fine", "sin(60*x)", direction="rising")
    run = m.derive().run(20.1, method=method, inputs={"u": ramp})
    assert len(times(run, "fine")) == 383
    assert times(run, "tooth") == pytest.approx(np.arange(first, 20.1, 0.5), abs=1e-12)
    assert run.ok


def test_a_crossing_that_is_zero_where_it_is_looked_at_counts():
    assert list(_crossings(np.array([-1.0, 0.0, 1.0, 0.0, 1.0]), 1e-9, 1)) == [0]


@pytest.mark.parametrize(("width", "flagged"), [(1e-4, True), (0.05, False)])
def test_a_well_that_is_passed_within_a_step_is_said(width, flagged):
    """What crosses zero and comes back between all looks of a run shows on ranges over its path."""
    model = f"""
        [coordinates]
        x = {{ start = 1.0 }}
        [energy]
        kinetic = "dot(x)^2/2"
        potential = "x^2/2"
        [events.inside]
        when = "0.5 - exp(-((x - 0.3)/{width})^2)"
        direction = "falling"
    """
    solution = (
        Model.from_toml(model).derive().run(t_end=3.0, method="dop853", max_step=0.2 if flagged else 0.02)
    )
    says = [check.says for check in solution.health if check.check == "missed events" and not check.ok]
    assert len(says) == flagged
    assert len(times(solution, "inside")) == (not flagged)
    if flagged:
        assert "'inside' was passed by at about t = 1.26" in says[0]


def test_a_well_beside_other_events_and_jumps_is_said():
    """What is passed between two frames at which something else happens, or the rate jumps."""
    model = """
        [coordinates]
        x = { start = 1.0 }
        [energy]
        kinetic = "dot(x)^2/2"
        potential = "x^2/2"
        [events.mark]
        when = "x - 0.302"
        [events.hit]
        when = "x - 0.1"
        then = { reset = { "dot(x)" = "-dot(x)" } }
        [events.WHERE]
        when = "0.5 - exp(-((x - PLACE)/1e-5)^2)"
        direction = "falling"
    """
    for place in (0.3, 0.1001):
        text = model.replace("WHERE", "inside").replace("PLACE", str(place))
        solution = Model.from_toml(text).derive().run(t_end=3.0, method="dop853", max_step=0.2)
        assert not times(solution, "inside")
        (said,) = solution.objections
        assert said.check == "missed events" and "'inside' was passed by" in said.says
    far = model.replace("WHERE", "inside").replace("PLACE", "0.05")
    assert not Model.from_toml(far).derive().run(t_end=3.0, method="dop853", max_step=0.2).objections


def test_frames_that_are_round_off_apart_make_no_slopes_of_round_off():
    """Frames of two grids are: the path between others dipped below zero there, which looked like a crossing."""
    m = Model("spin", gravity=(0, 0, 0))
    m.body("top", mass=1, inertia=[0.02, 0.03, 0.04], shape={"sphere": [0.1]})
    m.joint("free", type="free", child="top", rate=[0.1, 0, 0, 0, 0, 2.0])
    run = m.derive().run(t_end=1.0, fps=100, method="dop853")
    twice = np.insert(np.arange(len(run.t)), 50, 49)
    t = run.t[twice]
    t[50] = np.nextafter(t[50], 2.0)
    states = run.states[twice]
    states[50, 3] += 1e-16
    of_path = SimpleNamespace(system=run.system, p=run.p, t=t, states=states, step_log=run.step_log)
    with np.errstate(all="ignore"):
        slopes = RecordedPath(of_path, "residual", run.system.nv)._slopes[:, 3:7]
    assert np.abs(slopes).max() < 1.1  # of a unit quaternion at 2 rad/s


@pytest.mark.parametrize(("method", "start"), [("dop853", 1.192), ("dop853", 12 / 13), ("taylor", 1.192)])
def test_a_sign_that_is_zero_where_it_crosses_is_seen_again(method, start):
    """Of 25 places some are hit to the last bit, and near where it turns for many digits of time."""
    m = Model("signs")
    x = m.coordinate("x", start=start)
    m.kinetic(dot(x) ** 2 / 2)
    m.potential(3.976**2 * x**2 / 2)
    places = [round(-1.1 + 0.09 * k, 3) for k in range(25)]
    for k, place in enumerate(places):
        m.event(f"sign{k}", sign(x - place))
        m.event(f"plain{k}", x - place)
    run = m.derive().run(t_end=6.0, method=method)
    assert run.ok
    for k in range(len(places)):
        assert times(run, f"sign{k}") == pytest.approx(times(run, f"plain{k}"), abs=1e-9)
