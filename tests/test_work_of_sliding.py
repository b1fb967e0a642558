"""Work along steps that the motion allows to be long, in runs whose frictions slide and stick."""

from __future__ import annotations

import pytest

from symgen import Model

G, STATIC, SLIDING, T_END = 9.81, 0.35, 0.3, 2.0


@pytest.mark.parametrize("method", ["radau5", "bdf", "dop853", "taylor"])
def test_a_block_that_slips_on_a_cart_which_is_pulled_harder_and_harder(method):
    """Both move as cubics of time, which no step size control has to shorten a step for, and the power as a quartic."""
    m = Model("cart", gravity=(0, -G))
    X, x, y = m.coordinate("X"), m.coordinate("x"), m.coordinate("y", guess=0.5)
    m.body("cart", mass=3, com=(X, 0))
    m.body("block", mass=1, com=(x, y))
    m.constraint("floor", "y - 0.5")
    m.force(X, "20*t")
    m.friction("rub", speed="dot(x) - dot(X)", coefficient=SLIDING, static=STATIC, normal="floor")
    run = m.derive().run(t_end=T_END, method=method, rtol=1e-10, atol=1e-12)
    slips = STATIC * G / 5
    left = T_END - slips
    x_end = 5 * slips**3 / 6 + 2.5 * slips**2 * left + SLIDING * G * left**2 / 2
    assert run["x"][-1] == pytest.approx(x_end, rel=1e-9)
    assert run.energy.max_error < 1e-9
    assert all(check.ok for check in run.health), run.health


@pytest.mark.parametrize("constraints", ["projection", "ggl"])
def test_a_ball_on_a_shaken_plate(constraints):
    """Its centre moves 2/7 as far as the plate; constraints say all of the motion, and steps are as long as may be."""
    m = Model("plate", gravity=(0, 0, -G))
    q = m.coordinate("q", rate=0.5)
    m.body("plate", mass=1, inertia=[1, 1, 1])
    m.joint("q", "prismatic", "plate", axis=[1, 0, 0], coordinate=q)
    m.constraint("drive", "q - 0.1*sin(5*t)")
    m.body("ball", mass=0.5, inertia=[0.002] * 3)
    m.joint("b", "free", "ball", guess=[0, 0, 0.1, 1, 0, 0, 0])
    m.rolling("roll", "ball", ball=0.1, plane="plate")
    run = m.derive().run(t_end=2.0, method="radau5", constraints=constraints, rtol=1e-10, atol=1e-12)
    drift = run["b_vx"][0] - 2 / 7 * 0.5
    assert run["b_x"][-1] == pytest.approx(run["b_x"][0] + 2 * drift + 2 / 7 * run["q"][-1], abs=1e-9)
    assert run.energy.max_error < 1e-6
    assert all(check.ok for check in run.health), run.health
