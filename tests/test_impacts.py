"""Events between restarts and ends of steps, gaps above zero, blows passed on: see tests/stress/impacts.py."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from symgen import Model, dot
from symgen.runtime.checks.stops import stops
from tests.stress import balls as rows_of_balls
from tests.stress.impacts import KINDS, try_many
from tests.stress.models import made
from tests.stress.scenario import FLAGGED, RIGHT

G = 9.81


@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5", "bdf", "rk4", "gauss6"])
@pytest.mark.parametrize("kind", KINDS)
def test_events_fire_where_formulas_say(kind, method):
    counts = try_many(kind, method, 8, seed=3)
    assert counts[RIGHT] >= 7 and counts[RIGHT] + counts[FLAGGED] == 8


@pytest.fixture(scope="module")
def ball():
    m = Model("bouncer", gravity=(0, "-9.81 m/s^2"))
    y = m.coordinate("y", unit="m", start=1.0)
    m.body("ball", mass=1.0, com=(0, y))
    m.stop("floor", y, m.parameter("e", 1.0))
    return m.derive()


def test_a_ball_is_caught_at_every_height(ball):
    """The step after an impact doubles the flight's length, to within round-off of the next impact."""
    for height in np.random.default_rng(5).uniform(0.1, 3.0, size=15):
        flight = np.sqrt(8.0 * height / G)
        run = ball.run(t_end=10.2 * flight, start={"y": height}, method="taylor")
        assert run.ok
        np.testing.assert_allclose(
            [event.t for event in run.events], flight * (np.arange(10) + 0.5), rtol=1e-9
        )


def test_a_gap_below_zero_is_an_objection(ball):
    run = ball.run(t_end=1.0, method="dop853")
    assert stops(run).ok
    q = run.q.copy()
    q[10, 0] = -1e-3
    found = stops(dataclasses.replace(run, q=q))
    assert not found.ok and "'floor'" in found.says and found.value == pytest.approx(1e-3)
    found = stops(dataclasses.replace(run, lowest_gaps=np.array([-0.5])))
    assert not found.ok and found.value == 0.5


def balls(gap: float, n: int = 5) -> Model:
    m = Model("row")
    x = [m.coordinate(f"x{k}", start=k * (1.0 + gap), rate=1.0 if k == 0 else 0.0) for k in range(n)]
    for k in range(n):
        m.body(f"b{k}", mass=1.0, com=(x[k], 0))
    for k in range(n - 1):
        m.stop(f"s{k}", x[k + 1] - x[k] - 1.0, 1.0)
    return m


@pytest.mark.parametrize("gap", [1e-3, 1e-9, 1e-12])
def test_balls_pass_a_blow_on_however_near_they_are(gap):
    run = balls(gap).derive().run(t_end=1.0, method="dop853")
    assert run.ok and [event.name for event in run.events] == ["s0", "s1", "s2", "s3"]
    np.testing.assert_allclose(run.v[-1], [0, 0, 0, 0, 1], atol=1e-9)


def test_a_stack_that_falls_with_gaps_of_a_nanometre_knocks_ball_by_ball():
    m = Model("stack", gravity=(0, -G))
    y = [m.coordinate(f"y{k}", start=1.0 + k * 1e-9) for k in range(2)]
    for k, mass in enumerate((3.0, 1.0)):
        m.body(f"b{k}", mass=mass, com=(0, y[k]))
    m.stop("floor", y[0], 1.0)
    m.stop("between", y[1] - y[0], 1.0)
    run = m.derive().run(t_end=0.46, method="dop853")
    assert run.ok and [event.name for event in run.events][:2] == ["floor", "between"]
    # The heavy one meets the light one head on, gives it twice its speed, and lies down.
    flown = run.t[-1] - np.sqrt(2.0 / G)
    np.testing.assert_allclose(run.v[-1], [0.0, 2.0 * np.sqrt(2.0 * G) - G * flown], atol=1e-6)


@pytest.mark.parametrize("seed, number", [(1, 80), (2, 106), (2, 110), (2, 159), (3, 9)])
def test_rows_of_balls_of_all_kinds(seed, number):
    """Stacks: gaps that open in one blow and close in the next, gaps of 1e-12 that nothing presses."""
    random = np.random.default_rng([seed, number])
    verdict, why = rows_of_balls.judge(rows_of_balls.draw(random), "dop853", random)
    assert verdict == RIGHT, why


def test_rebounds_within_a_step_of_order_1_come_to_rest(ball):
    """The step from such a rebound ends below the floor, and its straight line is below it all along."""
    run = ball.run(t_end=3.0, method="implicit_euler", step=1e-2, parameters={"e": 0.5}, max_steps=5000)
    assert run.status == "success" and run.q[-1, 0] == pytest.approx(0.0, abs=1e-9)
    assert len(run.events) < 100


def test_events_that_never_end_use_up_the_steps():
    m = Model("ticking")
    x = m.coordinate("x", rate=1.0)
    m.body("b", mass=1.0, com=(x, 0))
    m.event("tick", "sin(1e6*t)", then="record")
    run = m.derive().run(t_end=1.0, method="dop853", max_steps=300)
    assert run.status == "failed" and "All 300 steps" in run.message


@pytest.mark.parametrize(
    "method",
    [
        "rattle",
        "rattle4",
        "rattle6",
        "verlet",
        "rk4",
        "implicit_midpoint",
        "gauss4",
        "generalized_alpha",
        "hht",
    ],
)
def test_work_until_an_impact_inside_a_step_is_that_of_the_force(method):
    """A weight that is no potential: what it works until the impact is m g h, wherever in a step that is."""
    m = Model("thrown")
    y = m.coordinate("y", start=1.0)
    m.kinetic(dot(y) ** 2 / 2)
    m.force(y, -G)
    m.stop("floor", y, restitution=0.8)
    run = made(m).run(3.0, method=method, step=0.04)
    assert len(run.events) > 5 and run.energy.max_error < 1e-13


@pytest.mark.parametrize("method", ["rattle", "rattle4", "rattle6"])
def test_a_body_goes_on_turning_as_it_did_where_an_event_cuts_a_step(method):
    """Angular velocities at an event are those of the motion: one more event changes nothing of it."""
    m = Model("spinner")
    m.body("block", mass=1.0, inertia=[1.0, 2.0, 2.5], com=(0, 0, 0))
    m.joint("turn", "spherical", "block", rate=[1.0, 2.0, 3.0])
    y = m.coordinate("y", start=0.33, rate=-1.0)
    m.kinetic(dot(y) ** 2 / 2)
    m.event("through", y, then={"reset": {"dot(y)": -1.0}})
    system = made(m)
    cut, whole = (
        system.run(0.6, method=method, step=0.05, start={"y": y0}, parameters={}) for y0 in (0.33, 5.0)
    )
    assert len(cut.events) == 1 and not whole.events
    assert (
        np.abs(cut.v[-1, :3] - whole.v[-1, :3]).max()
        < {"rattle": 2e-3, "rattle4": 2e-5, "rattle6": 2e-5}[method]
    )
