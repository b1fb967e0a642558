"""Friction by bristles (LuGre) against equations written a second time, integrated by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model, dot
from symgen.errors import ModelError

# Canudas de Wit et al. (1995), table 1: 1 kg, in N, m, s.
STIFFNESS, DAMPING, VISCOUS, COULOMB, STATIC, STRIBECK = 1e5, 1e5**0.5, 0.4, 1.0, 1.5, 0.001
LAW = {
    "stiffness": "1e5 N/m", "damping": f"{DAMPING!r} N*s/m", "viscous": "0.4 N*s/m", "coulomb": "1 N",
    "static": "1.5 N", "stribeck": "0.001 m/s", "unit": "m",
}  # fmt: skip


def level(v):
    return COULOMB + (STATIC - COULOMB) * np.exp(-((v / STRIBECK) ** 2))


def friction(v, z):
    """Return the force and the rate of the deflection."""
    rate = v - STIFFNESS * abs(v) * z / level(v)
    return STIFFNESS * z + DAMPING * rate + VISCOUS * v, rate


def block(force=None, spring=None, speed="0.1 m/s"):
    """A block of 1 kg that a force moves, or a spring whose other end moves on."""
    m = Model("block")
    x = m.coordinate("x", unit="m", start=0.0)
    m.body("block", mass="1 kg", com=(x, 0))
    if spring is not None:
        m.parameters(k=f"{spring} N/m", pull=speed)
        m.force(x, "k*(pull*t - x)")
    else:
        m.force(x, force)
    m.bristle("rub", coordinate=x, **LAW)
    m.output("force", "rub_force")
    return m


def reference(force, t_end, times, tol=1e-10):
    def f(t, y):
        x, v, z = y
        push, rate = friction(v, z)
        return [v, force(t, x) - push, rate]

    found = solve_ivp(
        f, (0.0, t_end), [0.0, 0.0, 0.0], "Radau", rtol=tol, atol=[1e-13, 1e-12, 1e-15], t_eval=times
    )
    assert found.success
    return found.y


@pytest.mark.parametrize("method", ["auto", "radau5", "bdf"])
def test_stick_slip_by_a_spring_is_that_of_the_equations(method):
    t_end = 30.0 if method != "bdf" else 12.0  # errors grow with each slip
    solution = block(spring=2.0).derive().run(t_end=t_end, method=method, rtol=1e-8, atol=1e-12)
    assert solution.ok, [check.says for check in solution.objections]
    x, _, z = reference(lambda t, x: 2.0 * (0.1 * t - x), t_end, solution.t)
    np.testing.assert_allclose(solution["x"], x, atol=2e-4)
    np.testing.assert_allclose(solution["rub"], z, atol=2e-6)
    # It slips, and the spring pulls by little more than what sticks can take: the rest accelerates it.
    lag = 0.1 * solution.t - solution["x"]
    assert 0.95 * STATIC / 2.0 < lag.max() < 1.02 * STATIC / 2.0, lag.max()
    assert solution["dot(x)"].max() > 0.15


def test_presliding_has_hysteresis_and_no_slip():
    """A force below what breaks away moves the block by micrometres, along a loop that is the equations'."""
    solution = block(force="1.2*sin(t)").derive().run(t_end=13.0)
    assert solution.ok, [check.says for check in solution.objections]
    x, _, _ = reference(lambda t, x: 1.2 * np.sin(t), 13.0, solution.t)
    np.testing.assert_allclose(solution["x"], x, atol=1e-8)
    assert 1e-5 < np.ptp(solution["x"]) < 1e-3


def break_away(rate):
    """Return the largest friction while a force grows at a rate [N/s] until the block slides."""
    system = block(force=f"{rate}*t").derive()
    solution = system.run(t_end=2.2 / rate, method="radau5", rtol=1e-9, atol=1e-13, fps=1000.0 * rate)
    assert solution.status == "success"
    t = solution.t
    _, v, z = reference(lambda t, x: rate * t, t[-1], t)
    theirs = np.array([friction(a, b)[0] for a, b in zip(v, z)])
    before = v < STRIBECK
    np.testing.assert_allclose(solution["force"][before], theirs[before], atol=1e-4)
    return solution["force"].max()


def test_the_force_that_breaks_away_falls_with_its_rate():
    slow, fast = break_away(1.0), break_away(20.0)
    assert COULOMB < fast < slow - 0.02 and slow <= STATIC


def test_its_work_is_in_the_energy_balance():
    solution = block(force="3 + 0*t").derive().run(t_end=1.0, method="radau5")
    assert solution.ok and solution.energy.max_error < 1e-5
    moved = solution.v[-1, 0] ** 2 / 2.0
    assert moved < 3.0 * solution["x"][-1]


def test_a_file_round_trips():
    text = """
name = "block"
[coordinates]
x = { unit = "m", start = 0.0 }
[bodies.block]
mass = "1 kg"
com = ["x", "0"]
[bristles.rub]
speed = "dot(x) - 0.1"
stiffness = "1e5 N/m"
damping = "300 N*s/m"
coulomb = "1 N"
start = "1e-6 m"
unit = "m"
"""
    model = Model.from_toml(text)
    again = Model.from_toml(model.to_toml())
    assert again.to_toml() == model.to_toml()
    assert [s.name for s in again.describe().states] == ["rub"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"stiffness": None}, "'stiffness' is missing"),
        ({"stribeck": None}, "go together"),
        ({"static": "0.5 N"}, "less than what slides"),
        ({"stiffness": "-1 N/m"}, "positive"),
        ({"stiffness": "1 N"}, "dimension|unit|N"),
        ({"speed": "dot(x)"}, "one 'coordinate' or one 'speed'"),
    ],
)
def test_what_does_not_fit_is_refused(options, says):
    m = Model("m")
    x = m.coordinate("x", unit="m")
    m.body("b", mass="1 kg", com=(x, 0))
    with pytest.raises(ModelError, match=says):
        m.bristle("rub", coordinate=x, **(LAW | options))
        m.derive()


def test_against_a_moving_belt():
    m = Model("belt")
    x = m.coordinate("x", unit="m")
    m.body("b", mass="1 kg", com=(x, 0))
    m.force(x, "-2*x")
    m.bristle("rub", speed=dot(x) - 0.1, **LAW)
    solution = m.derive().run(t_end=20.0)
    assert solution.ok, [check.says for check in solution.objections]
    # Slow belts carry it until the static force gives way: it swings about the place of the sliding one.
    assert 0.6 < solution["x"].max() < 0.77 and solution["x"].min() < 0.6


def test_bristles_that_bear_nothing_are_refused_by_name():
    m = Model("m")
    m.body("b", mass=1, com=(m.coordinate("x", unit="m"), 0))
    with pytest.raises(
        ModelError, match=r"coulomb: it is 0 .* write what is left as a force, such as -c\*dot"
    ):
        m.bristle("rub", coordinate="x", stiffness=1e5, coulomb=0)
        m.describe()
