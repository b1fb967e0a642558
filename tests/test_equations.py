"""The equations that `symgen show` prints: loops over equal parts written out, names of rates."""

import pytest
import sympy

from symgen import Model
from symgen.cli.equations import symbolic
from symgen.model.library import bundled, load


def test_loops_are_written_out():
    system = load(bundled()["pendulum_field"], {"n": "3"}).derive()
    assert "for k in range(3):" in system.source.functions["forces"]
    m, g = sympy.symbols("m g")
    theta, l = sympy.symbols("theta1:4"), sympy.symbols("l1:4")
    mass, forces = symbolic(system, "mass_matrix"), symbolic(system, "forces")
    assert (list(mass), list(forces)) == ([0, 4, 8], [0, 1, 2])
    for k in range(3):
        assert sympy.simplify(mass[4 * k] - m * l[k] ** 2) == 0
        assert sympy.simplify(forces[k] + m * g * l[k] * sympy.sin(theta[k])) == 0


def test_rates_of_a_ball():
    """Euler's equations: A dw/dt = (B - C) w_y w_z and so on."""
    text = '[bodies.b]\nmass = 1\ninertia = [1, 2, 4]\n[joints.j]\ntype = "spherical"\nchild = "b"'
    system = Model.from_toml(text).derive()
    wx, wy, wz = sympy.symbols("j_wx j_wy j_wz")
    forces = symbolic(system, "forces")
    for k, expected in enumerate((-2 * wy * wz, 3 * wx * wz, -wx * wy)):
        assert sympy.expand(forces[k] - expected) == pytest.approx(0)
