"""Friction that follows a reaction, in series of so few unknowns that equations enter their solution directly."""

from __future__ import annotations

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
