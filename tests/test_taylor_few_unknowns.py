"""Friction that follows a reaction, in series of so few unknowns that equations enter their solution directly."""

from __future__ import annotations

import random

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.runtime.taylor.motion import read_motion
from symgen.runtime.taylor.plan import Plan

G, MASS, MU, BEND = 9.81, 0.4, 0.2, 0.5


def bead(start, rate, speed="dot(x) + 2*c*x*dot(y)"):
    """A bead on the rough wire y = c x²; the friction's work is that of μ N along the wire."""
    m = Model("bead", gravity=(0, -G))
    m.parameters(mu=MU, c=BEND)
    x, y = m.coordinate("x", start=start, rate=rate), m.coordinate("y", guess=0.7)
    m.body("bead", mass=MASS, com=(x, y))
    m.constraint("wire", "y - c*x^2")
    # N = multiplier √(1 + 4 c²x²), and the force along dot(x) + 2 c x dot(y) is √(1 + 4 c²x²) times smaller.
    m.friction("rub", speed=speed, coefficient="mu", normal="wire")
    return m.derive()


def by_hand(start, rate, sense, t_end):
    def f(t, state):
        x, v = state
        slope = 2 * BEND * x
        length = np.sqrt(1 + slope**2)
        normal = G / length + v**2 * length**2 * 2 * BEND / length**3
        along = -G * slope / length - sense * MU * normal
        return [v, (along - v**2 * slope * 2 * BEND / length) / length]

    return solve_ivp(f, (0, t_end), [start, rate], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("start, rate, sense", [(1.2, 0.0, -1), (1.2, -0.5, -1), (-0.8, 0.3, 1)])
def test_a_bead_on_a_rough_wire(start, rate, sense):
    system = bead(start, rate)
    assert Plan(read_motion(system)).by_weights  # else this test is of something else
    run = system.run(t_end=0.3, method="taylor", rtol=1e-10, atol=1e-12)
    found = [run["x"][-1], run["dot(x)"][-1]]
    np.testing.assert_allclose(found, by_hand(start, rate, sense, 0.3), rtol=1e-9)
    assert run.stats["steps"] < 20 and all(check.ok for check in run.health)


def test_in_ensembles():
    system = bead(1.2, -0.5)
    made = system.ensemble(parameters={"mu": [0.2, 0.1]}, t_end=0.3, method="taylor", rtol=1e-10, atol=1e-12)
    for k, mu in enumerate((0.2, 0.1)):
        alone = system.run(t_end=0.3, method="dop853", rtol=1e-10, atol=1e-12, parameters={"mu": mu})
        assert made["x"][k] == pytest.approx(alone["x"][-1], rel=1e-9)


def drawn(seed: int) -> Model:
    """A model of one to three unknowns, of products, quotients, roots and powers that wait for them in many ways."""
    r = random.Random(seed)
    names = ["x", "y", "z"][: r.choice([1, 2, 2, 3])]
    held = len(names) == 2 and r.random() < 0.6

    def expression(depth: int) -> str:
        if depth == 0 or r.random() < 0.15:
            return r.choice(names)
        a, b = expression(depth - 1), expression(depth - 1)
        return r.choice([
            f"sin({a})", f"cos({a})", f"({a})*({b})", f"({a} - 0.5*({b}))", f"1/(2 + ({a})^2)", f"sqrt(1 + ({a})^2)",
            f"(1.5 + ({a})^2)^1.5/4", f"exp(-({a})^2)",
        ])  # fmt: skip

    m = Model("drawn")
    for c in names:
        key = "guess" if held else "start"
        m.coordinate(c, **{key: r.uniform(-1, 1), "rate_guess" if held else "rate": r.uniform(-1, 1)})
        m.kinetic(f"(1 + ({expression(1)})^2)*dot({c})^2/2")
    if len(names) > 1:
        m.kinetic(f"0.3*cos({expression(1)})*dot(x)*dot(y)")
    m.potential(f"{'+'.join(f'{c}^2/2' for c in names)} + 0.5*({expression(2)})")
    m.force(r.choice(names), f"-0.1*dot({r.choice(names)}) + 0.2*sin(t)*({expression(1)})")
    if held:
        m.constraint("held", r.choice(["y - 0.4*x^2 - 0.1*sin(x)", "x^2 + y^2 - 1.3", "y - 0.5*sin(x)"]))
        if r.random() < 0.5:
            m.friction("rub", speed="dot(x)", coefficient=0.1, normal="held")
    return m


def test_drawn_models():
    """Beside another method at a tolerance a thousand times as tight; five or more of them enter by weights."""
    weighted = 0
    for seed in range(14):
        system = drawn(seed).derive()
        weighted += Plan(read_motion(system)).by_weights
        run = system.run(1.0, method="taylor", rtol=1e-9, atol=1e-11)
        beside = system.run(1.0, method="dop853", rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(run.states[-1], beside.states[-1], rtol=1e-7, atol=1e-7, err_msg=str(seed))
    assert weighted >= 5
