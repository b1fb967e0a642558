"""Dry friction that sticks and slips, smooth friction, and compliant contacts, against formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from sympy import Abs

from symgen import Model, cos, dot, sin, sqrt
from symgen.errors import ModelError
from symgen.runtime.checks.held import held

G = 9.81


def incline(angle: float, mu: float, rate: float) -> Model:
    m = Model("incline")
    s = m.coordinate("s", start=0.0, rate=rate)
    m.body("block", mass=2.0, com=(s, 0))
    m.potential(2.0 * G * np.sin(angle) * s)
    m.friction("ground", coordinate=s, force=mu * 2.0 * G * np.cos(angle))
    return m


@pytest.mark.parametrize(("angle", "sticks"), [(0.29, True), (0.30, False)])
def test_a_block_sticks_where_the_incline_is_flatter_than_the_friction_angle(angle, sticks):
    mu = 0.3  # tan 0.29 = 0.298, tan 0.30 = 0.309
    solution = incline(angle, mu, 1.0).derive().run(t_end=2.0, method="dop853")
    assert solution.ok
    up = 1.0 / (G * (np.sin(angle) + mu * np.cos(angle)))
    assert solution.events[0].t == pytest.approx(up, rel=1e-10)
    assert solution.events[0].action == ("stick" if sticks else "turn")
    down = 0.0 if sticks else -G * (np.sin(angle) - mu * np.cos(angle)) * (2.0 - up)
    assert solution.v[-1, 0] == pytest.approx(down, abs=1e-12)
    assert solution["force(ground)"][-1] == pytest.approx(
        2.0 * G * (np.sin(angle) if sticks else mu * np.cos(angle)), rel=1e-12
    )
    top = 0.5 * up
    path = top + (top - solution.q[-1, 0])
    assert solution.w[-1] == pytest.approx(-mu * 2.0 * G * np.cos(angle) * path, rel=1e-9)


def belt() -> Model:
    m = Model("belt")
    x = m.coordinate("x", start=0.0, rate=0.3)
    m.body("block", mass=1.0, com=(x, 0))
    m.potential(25.0 * x**2)
    m.friction("belt", speed=dot(x) - 0.3, force=4.0, static=6.0)
    return m


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor"])
def test_stick_slip_on_a_belt_has_the_period_of_the_formula(method):
    solution = belt().derive().run(t_end=8.0, method=method, rtol=1e-9, atol=1e-11)
    assert solution.ok
    slips = [event.t for event in solution.events if event.action == "slip"]
    w, excess = np.sqrt(50.0), 2.0 / 50.0
    # Sliding: half a turn and more about the place where kinetic friction balances the spring.
    period = 2.0 * excess / 0.3 + 2.0 / w * (np.pi - np.arctan(excess * w / 0.3))
    assert slips[0] == pytest.approx(6.0 / 50.0 / 0.3, rel=1e-9)
    np.testing.assert_allclose(np.diff(slips), period, rtol=1e-7)
    assert len(slips) >= 7


def test_two_frictions_in_series_slip_one_at_a_time():
    m = Model("two")
    x, y = m.coordinate("x", start=0.0, rate=0.0), m.coordinate("y", start=0.0, rate=0.0)
    m.body("lower", mass=1.0, com=(x, 0))
    m.body("upper", mass=1.0, com=(y, 0))
    m.friction("floor", coordinate=x, force=3.0)
    m.friction("between", speed=dot(y) - dot(x), force=2.0)
    m.force("y", "t")
    solution = m.derive().run(t_end=4.0, method="dop853")
    assert solution.ok
    # The upper block begins to slide on the lower one at 2 N, which the floor holds for ever.
    assert [(e.name, e.action) for e in solution.events] == [("between", "slip")]
    assert solution.events[0].t == pytest.approx(2.0, rel=1e-10)
    assert solution["y"][-1] == pytest.approx((4.0 - 2.0) ** 3 / 6.0, rel=1e-9)
    assert solution.q[-1, 0] == pytest.approx(0.0, abs=1e-14)


def test_a_stop_and_a_friction_at_once():
    """A block that is thrown against a wall and slides until it sticks away from it."""
    m = Model("wall")
    x = m.coordinate("x", start=1.0, rate=-4.0)
    m.body("block", mass=1.0, com=(x, 0))
    m.friction("floor", coordinate=x, force=2.0)
    m.stop("wall", x, 0.5)
    solution = m.derive().run(t_end=3.0, method="dop853")
    assert solution.ok
    assert [(e.name, e.action) for e in solution.events] == [("wall", "impact"), ("floor", "stick")]
    strike = sqrt(16.0 - 4.0)
    assert solution.q[-1, 0] == pytest.approx(float((strike / 2) ** 2 / 4.0), rel=1e-9)
    assert solution.energy.final == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("rate", [0.0, 2.0])
@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_friction_that_helped_a_stop_holds_on_when_that_lets_go(rate, method):
    """Pressed on a wall, or thrown against it; the pull away from it must exceed the friction."""
    m = Model("held")
    x = m.coordinate("x", start=-0.1 if rate else 0.0, rate=rate)
    m.body("block", mass=1.0, com=(x, 0))
    m.friction("floor", coordinate=x, force=0.5)
    m.force(x, "3 - 4*t")
    m.stop("wall", -x)
    solution = m.derive().run(t_end=1.5, method=method)
    assert solution.status == "success"
    assert [(e.name, e.action) for e in solution.events if e.name == "floor"] == [("floor", "slip")]
    assert solution.events[-1].t == pytest.approx(0.875, rel=1e-9)
    assert solution["x"][-1] == pytest.approx(-4.0 * 0.625**3 / 6.0, rel=1e-8)


def test_smooth_friction_holds_up_to_creep():
    m = Model("smooth")
    s = m.coordinate("s", start=0.0, rate=1.0)
    m.body("block", mass=1.0, com=(s, 0))
    m.friction("ground", coordinate=s, force=2.0, smooth=1e-4)
    m.force(s, 1.0)
    system = m.derive()
    assert not system.switches
    solution = system.run(t_end=3.0, method="radau5")
    assert solution.ok
    creep = 1e-4 / np.sqrt(3.0)  # where 2 s/sqrt(s^2 + w^2) = 1
    assert solution.v[-1, 0] == pytest.approx(creep, rel=1e-6)


def hunt_crossley() -> Model:
    m = Model("dropped")
    x = m.coordinate("x", start=0.0, rate=-1.0)
    m.body("ball", mass=0.5, com=(0, x))
    k, c = m.parameters(k=1e6, c=0.3)
    m.contact("ground", x, stiffness=k, damping=c)
    return m


@pytest.mark.parametrize("speed", [0.1, 1.0, 5.0])
def test_hunt_and_crossley_rebound(speed):
    system = hunt_crossley().derive()
    solution = system.run(t_end=0.1, method="radau5", rate={"x": -speed}, rtol=1e-10, atol=1e-12)
    assert solution.ok
    after, beta = solution.v[-1, 0], 0.45
    # m v dv/dδ = -k δ^n (1 + β v) has v/β - ln(1 + β v)/β² + ... for its integral: the same before and after.
    level = beta * speed - np.log1p(beta * speed)
    exact = brentq(lambda v: -beta * v - np.log1p(-beta * v) - level, 1e-9, min(speed, (1 - 1e-12) / beta))
    assert after == pytest.approx(exact, rel=1e-6)
    if speed == 0.1:
        assert after / speed == pytest.approx(1.0 - 0.3 * speed, abs=1e-3)  # Hunt and Crossley's e = 1 - c v
    forces = 0.5 * solution.accelerations[:, 0]
    assert forces.min() > -1e-60


def test_a_compliant_contact_never_pulls():
    """Pulled out fast, the formula without its limit would hold the body back."""
    m = Model("pulled")
    x = m.coordinate("x", start=-1e-3, rate=10.0)
    m.body("ball", mass=0.5, com=(0, x))
    m.contact("ground", x, stiffness=1e6, damping=1.0)
    system = m.derive()
    assert system.kernel("forces")(0.0, [-1e-3, 10.0], system.parameter_values())[0] == 0.0
    assert system.kernel("forces")(0.0, [-1e-3, -1.0], system.parameter_values())[0] == pytest.approx(
        1e6 * 1e-3**1.5 * 2.5
    )


def test_friction_of_a_compliant_contact():
    m = Model("pad", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=1.0), m.coordinate("y", start=-((G / 1e5) ** (1 / 1.5)))
    m.body("pad", mass=1.0, com=(x, y))
    m.contact("floor", y, stiffness=1e5, damping=1.0, friction=0.4, slip=dot(x), smooth=1e-5)
    solution = m.derive().run(t_end=0.2, method="radau5")
    assert solution.ok
    assert solution["dot(x)"][-1] == pytest.approx(1.0 - 0.4 * G * 0.2, rel=1e-6)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_friction_of_a_driven_motion_turns_with_it(method):
    """What a constraint drives can neither stick nor slip: the drive bears the friction."""
    m = Model("driven")
    x = m.coordinate("x", guess=0.0)
    m.body("block", mass=1.5, com=(x, 0))
    m.constraint("drive", "x - 0.1*sin(2*t)")
    m.friction("rub", coordinate=x, force=3.0)
    solution = m.derive().run(t_end=3.0, method=method)
    assert solution.ok
    assert [e.action for e in solution.events] == ["turn", "turn"]
    np.testing.assert_allclose([e.t for e in solution.events], [np.pi / 4, 3 * np.pi / 4], rtol=1e-9)
    sense = np.sign(np.cos(2.0 * solution.t))
    np.testing.assert_allclose(solution["force(rub)"], -3.0 * sense, rtol=1e-12)
    inertia = -1.5 * 0.4 * np.sin(2.0 * solution.t)
    np.testing.assert_allclose(solution.multipliers[:, 0], inertia + 3.0 * sense, rtol=1e-6)


# Stribeck's law: friction that falls with the speed, and grows again with a viscous part.
BELT, SPRING, SLIDES, STICKS, WIDTH, VISCOUS = 0.1, 10.0, 1.0, 1.6, 0.02, 0.3


def stribeck(fast):
    """A block on a belt by a spring; the friction is a force, or in proportion to what a floor carries."""
    sliding = "(dot(x) - belt)"
    law = f"{SLIDES} + {STICKS - SLIDES}*exp(-({sliding}/{WIDTH})^2)"
    model = Model("stribeck")
    belt = model.parameters(belt=f"{BELT} m/s")
    q = model.coordinate("x", start=0.0, rate=BELT, unit="m")
    model.potential(SPRING * q**2 / 2)
    if fast:
        model.body("block", mass=1.0, com=(q, 0))
        model.definition("level", f"{law} + {VISCOUS}*abs{sliding}")
        model.friction("belt", speed=dot(q) - belt, force="level", static=STICKS)
        return model
    y = model.coordinate("y", start=0.0, unit="m")
    model.body("block", mass=1.0, com=(q, y))
    model.gravity(y=-G)
    model.stop("floor", gap=y)
    share = f"({law})/{G} + {VISCOUS / G}*abs{sliding}"
    model.friction("belt", speed=dot(q) - belt, coefficient=share, static=STICKS / G, normal="floor")
    return model


def stribeck_reference(t_end):
    """Times of slipping and sticking, and the end, from phases that are integrated one after another."""
    t, x, times = 0.0, 0.0, []

    def motion(t, y):
        s = y[1] - BELT
        level = SLIDES + (STICKS - SLIDES) * np.exp(-((s / WIDTH) ** 2)) + VISCOUS * abs(s)
        return [y[1], level - SPRING * y[0]]  # it is slower than the belt

    def same(t, y):
        return y[1] - BELT

    same.terminal, same.direction = True, 1.0
    while True:
        slips = t + (STICKS / SPRING - x) / BELT
        if slips >= t_end:
            return np.array(times), x + BELT * (t_end - t)
        found = solve_ivp(
            motion, (slips, t_end), [STICKS / SPRING, BELT - 1e-15], "DOP853", events=same,
            rtol=1e-12, atol=1e-14, max_step=1e-3,
        )  # fmt: skip
        times.append(slips)
        t, x = found.t[-1], found.y[0, -1]
        if not found.status:
            return np.array(times), x
        assert abs(SPRING * x) < STICKS
        times.append(t)


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize(
    ("method", "tolerance"),
    [("auto", 1e-6), ("dop853", 1e-6), ("dopri5", 1e-6), ("radau5", 1e-6), ("radau9", 1e-6), ("bdf", 1e-4)],
)
def test_friction_by_stribeck_sticks_and_slips_as_phases_say(method, tolerance, fast):
    run = stribeck(fast).derive().run(t_end=12.0, method=method)
    assert run.ok, [check.says for check in run.objections]
    times, end = stribeck_reference(12.0)
    events = [event.t for event in run.events if event.name == "belt" and event.t > 0.0]
    assert len(times) >= 6
    np.testing.assert_allclose(events, times, atol=tolerance)
    assert abs(run["x"][-1] - end) < tolerance


@pytest.mark.parametrize("weighed", [False, True])
def test_what_sticks_beyond_its_limit_is_flagged(weighed):
    """A block that is pushed with 3t slips at 2 N; that it had stuck on is said, by no other check."""
    m = Model("pushed", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=0.0), m.coordinate("y", start=0.0)
    m.body("block", mass=1.0, com=(x, y))
    m.force(x, "3*t")
    m.stop("floor", y)
    level = {"coefficient": 2.0 / G, "normal": "floor"} if weighed else {"force": 2.0}
    m.friction("ground", coordinate=x, **level)
    run = m.derive().run(t_end=1.0, method="dop853")
    entry = held(run)
    assert entry.ok and run.ok and run.forms.index[-1] > 0
    run.forms.index[:] = 0
    entry = held(run)
    assert not entry.ok and entry.value == pytest.approx(
        0.5, abs=0.02
    )  # the last frame may lie before a jump
    assert "friction 'ground'" in entry.says and "beyond what it can bear" in entry.says


def test_round_off_of_larger_forces_is_not_beyond_a_limit():
    """A corner that carries nothing holds with what is left of the others' forces in the last digits."""
    m = Model("corner", gravity=(0, -G))
    x, y = m.coordinate("x"), m.coordinate("y", start=0.0)
    m.body("weight", mass=1.0, com=(0, y))
    m.body("corner", mass=1.0, com=(x, 0))
    m.stop("floor", y)
    m.force(x, "3e-15*t")
    m.friction("ground", coordinate=x, force=2e-15)
    run = m.derive().run(t_end=1.0, method="dop853")
    run.forms.index[:] = 0
    assert held(run).ok


def test_a_closed_stop_that_pulls_is_flagged():
    """A block that is pulled up with 20t takes off where that is its weight."""
    m = Model("lifted", gravity=(0, -G))
    y = m.coordinate("y", start=0.0)
    m.body("block", mass=1.0, com=(0, y))
    m.force(y, "20*t")
    m.stop("floor", y)
    run = m.derive().run(t_end=1.0, method="dop853")
    assert run.ok and held(run).ok
    run.forms.index[:] = 0
    assert not held(run).ok and "stop 'floor'" in held(run).says


def test_what_sticks_has_a_force_of_its_own_where_sliding_knows_how_fast():
    model = Model("m")
    x = model.coordinate("x")
    model.body("b", mass=1.0, com=(x, 0))
    model.definition("level", "1 + dot(x)^2")
    model.friction("f", coordinate=x, force="level")
    with pytest.raises(ModelError, match=r"cannot depend on a rate.*give 'static'"):
        model.derive()


def arm_on_a_dry_hinge(with_choice: bool):
    """A double pendulum whose lower hinge rubs; a force of nothing with a choice by the rate that sticks, or none."""
    m = Model("arm", gravity=(0, "-9.81 m/s^2"))
    a, b = m.coordinate("a", start=0.8, rate=0.3), m.coordinate("b", start=-0.2, rate=1.0)
    k, soft, nothing = m.parameters(k="57 N*m", soft="13.2 N*m", nothing="0 N*m*s")
    m.body("upper", mass="2.2 kg", com=(0.5 * sin(a), -0.5 * cos(a)))
    m.body("lower", mass="3 kg", com=(0.5 * sin(a) + 0.5 * sin(b), -0.5 * cos(a) - 0.5 * cos(b)))
    m.force(a, -k * a)
    m.force(b, -soft * b)
    if with_choice:
        m.force(b, -nothing * Abs(dot(b)))
    m.friction("hinge", speed=dot(b), torque="4 N*m")
    return m.derive()


@pytest.mark.parametrize(
    ("method", "rtol", "allowed"),
    [("taylor", 1e-8, 1e-9), ("dop853", 1e-8, 1e-7), ("dopri5", 1e-8, 1e-7), ("radau5", 1e-8, 1e-6)],
)
def test_a_choice_that_is_held_at_its_threshold_moves_no_other_event(method, rtol, allowed):
    """It counted as at one instant with whatever came in its step, which then came at the end of that."""
    with_choice, without = (
        arm_on_a_dry_hinge(x).run(4.0, method=method, rtol=rtol, atol=1e-10) for x in (True, False)
    )
    assert [e.action for e in with_choice.events] == [e.action for e in without.events]
    assert "slip" in [e.action for e in without.events]
    assert with_choice.stats["steps"] < 1.3 * without.stats["steps"]
    times = [[e.t for e in run.events] for run in (with_choice, without)]
    np.testing.assert_allclose(*times, rtol=0.0, atol=allowed)
    np.testing.assert_allclose(with_choice.states[-1], without.states[-1], rtol=0.0, atol=10.0 * allowed)
