"""The equations that `symgen show` prints: loops over equal parts written out, names of rates."""

import numpy as np
import pytest
import sympy

import symgen
from symgen import Model
from symgen.equations import accelerations_if_diagonal, equations_by_elements, rates_of_coordinates, symbolic
from symgen.model.library import bundled, load
from symgen.runtime.names import acceleration_labels, rate_labels


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


@pytest.mark.parametrize(
    "name",
    ["pendulum", "double_pendulum", "slider_crank", "rolling_disc", "heavy_top_absolute", "free_rigid_body"],
)
def test_the_first_order_form_is_what_rhs_works_out(name):
    """Each equation, with numbers for its elements and what `rhs` gives for its unknowns; one way or the other."""
    system = symgen.load(name)
    start = system.run(t_end=0.01)
    state, p = start.states[0], start.p
    out = system.kernel("rhs")(0.0, state, p)
    names = [*(c["name"] for c in system.coordinates), *rate_labels(system.coordinates, system.rates)]
    numbers = dict(zip(map(sympy.Symbol, [*names, *(x["name"] for x in system.parameters)]), [*state, *p]))
    unknowns = dict(zip(acceleration_labels(system.coordinates, system.rates), out[system.nq :]))
    unknowns |= {f"lambda({c['name']})": x for c, x in zip(system.constraints, out[system.ny :])}
    rates = [r["name"] for r in system.rates]
    held = [c["name"] for c in system.constraints]

    def value(element):
        function, rows = {
            "M": ("mass_matrix", rates),
            "f": ("forces", rates),
            "G": ("constraint_jacobian", held),
            "gamma": ("gamma", held),
        }[element.matrix]
        place = rows.index(element.names[0])
        if len(element.names) == 2:
            place = place * system.nv + rates.index(element.names[1])
        return float(symbolic(system, function)[place].subs(numbers)) * unknowns.get(element.times, 1.0)

    for rate, found in zip(rates_of_coordinates(system), out):
        assert float(rate.subs(numbers)) == pytest.approx(found, rel=1e-12, abs=1e-12)
    for left, right in equations_by_elements(system):
        terms = [value(x) for x in left] + [-value(x) for x in right]
        assert sum(terms) == pytest.approx(0.0, abs=1e-10 * max(map(abs, terms), default=0.0) + 1e-12)
    solved = accelerations_if_diagonal(system)
    assert (solved is None) == (
        name in ("double_pendulum", "slider_crank", "rolling_disc", "heavy_top_absolute")
    )
    if solved is not None:
        found = [float(x.subs(numbers)) for x in solved]
        np.testing.assert_allclose(found, out[system.nq : system.nq + system.nv], rtol=1e-12)
