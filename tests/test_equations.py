"""Equations as SymPy expressions: those that `symgen show` prints, and `Model.equations`."""

import time
from pathlib import Path

import numpy as np
import pytest
import sympy

import symgen
from symgen import Model
from symgen.equations import (
    Choices,
    accelerations_if_diagonal,
    equations_by_elements,
    equations_of,
    rates_of_coordinates,
    shortened,
    symbolic,
)
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
    solved = accelerations_if_diagonal(system, Choices(system))
    assert (solved is None) == (
        name in ("double_pendulum", "slider_crank", "rolling_disc", "heavy_top_absolute")
    )
    if solved is not None:
        found = [float(x.subs(numbers)) for x in solved]
        np.testing.assert_allclose(found, out[system.nq : system.nq + system.nv], rtol=1e-12)


ROOT = Path(__file__).resolve().parents[1]
ALL = ["double_pendulum", "cart_pole", "slider_crank", "rolling_disc", "heavy_top_absolute", "rough_road"]


def numbers_of(equations, random):
    """Values for all symbols; quaternions need not be of unit length for what is compared here."""
    found = {x: random.uniform(0.2, 0.9) for x in (*equations.q, *equations.v)}
    return found | equations.values | {equations.t: 0.3}


def worked_out(matrix, numbers):
    """A matrix with numbers for its symbols; common parts are worked out once, or long ones take for ever."""
    found = sympy.lambdify(list(numbers), sympy.Matrix(matrix), cse=True)(*numbers.values())
    return np.array(found, dtype=float).reshape(matrix.shape)


@pytest.mark.parametrize("name", ALL)
def test_matrices_are_what_the_module_works_out(name):
    system = symgen.load(name)
    equations = equations_of(system)
    numbers = numbers_of(equations, np.random.default_rng(1))
    state = np.array([numbers[x] for x in (*equations.q, *equations.v)])

    def expected(function, *shape, first=0):
        size = int(np.prod(shape))
        return system.kernel(function)(0.3, state, system.parameter_values())[first : first + size].reshape(
            shape
        )

    nq, nv, m, nh = system.nq, system.nv, system.m, system.nh
    checks = [
        (equations.M, expected("mass_matrix", nv, nv)),
        (equations.f, expected("forces", nv, 1)),
        (equations.qdot, expected("rhs", nq, 1)),
        (sympy.Matrix([equations.T, equations.V]), expected("energy", 2, 1)),
    ]
    if m:
        checks += [
            (equations.G, expected("constraint_jacobian", m, nv)),
            (equations.gamma, expected("gamma", m, 1)),
            (equations.Phi, expected("constraint_residual", nh, 1)),
            (equations.Phi_dot, expected("constraint_residual", m, 1, first=nh)),
        ]
    for matrix, values in checks:
        assert matrix.shape == values.shape
        np.testing.assert_allclose(worked_out(matrix, numbers), values, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", ["double_pendulum", "cart_pole", "slider_crank", "spinning_top"])
def test_matrices_are_those_of_lagrange(name):
    """M, f, G, gamma by SymPy's derivatives of T, V and Phi, without dissipation and inputs."""
    equations = equations_of(symgen.load(name))
    q, v, numbers = list(equations.q), list(equations.v), numbers_of(equations, np.random.default_rng(2))
    push = {x: 0.0 for x in equations.values if x.name in ("F", "c", "b")}
    numbers |= push
    momenta = [equations.T.diff(x) for x in v]
    bias = [sum(p.diff(x) * rate for x, rate in zip(q, v)) - equations.T.diff(y) for p, y in zip(momenta, q)]
    expected = {
        "M": sympy.Matrix([[p.diff(x) for x in v] for p in momenta]),
        "f": sympy.Matrix([-b - equations.V.diff(x) for b, x in zip(bias, q)]),
        "G": equations.Phi.jacobian(q) if equations.Phi else equations.G,
        "gamma": -(equations.G * sympy.Matrix(v)).jacobian(q) * sympy.Matrix(v)
        if equations.Phi
        else equations.gamma,
    }
    for key, matrix in expected.items():
        difference = worked_out(matrix, numbers) - worked_out(getattr(equations, key), numbers)
        assert np.abs(difference).max(initial=0.0) < 1e-10, key


@pytest.mark.parametrize("name", ["double_pendulum", "slider_crank", "heavy_top_absolute", "seven_dof_arm"])
def test_shared_subexpressions_are_named_and_substituted(name):
    plain = equations_of(symgen.load(name))
    named = plain.named()
    assert named.shared and not plain.shared and named.substituted().shared == ()
    assert not {x for x, _ in named.shared} & {*plain.q, *plain.v, *plain.values}
    numbers, known = numbers_of(plain, np.random.default_rng(3)), {}
    for x, value in named.shared:
        known[x] = float(value.xreplace(numbers | known))
    for key in ("M", "f", "G", "gamma"):
        ours = worked_out(getattr(named, key), numbers | known)
        np.testing.assert_allclose(ours, worked_out(getattr(plain, key), numbers), rtol=1e-12, atol=1e-12)
    assert not any(x.count_ops() > 200 for _, x in named.shared)


def test_simplified_equations_are_the_same_and_shorter():
    model = Model.from_toml(ROOT / "models" / "slider_crank.toml")
    plain, short = model.equations(), model.equations(simplify=True, time_limit=60.0)
    assert short.notes == ()
    assert short.M[0, 1].count_ops() < plain.M[0, 1].count_ops()  # an angle's difference
    numbers = numbers_of(plain, np.random.default_rng(4))
    for ours, theirs in zip(short._entries(), plain._entries()):
        assert float(ours.evalf(20, subs=numbers)) == pytest.approx(
            float(theirs.evalf(20, subs=numbers)), rel=1e-12
        )


def test_simplifying_ends_when_its_time_is_over():
    plain = equations_of(symgen.load("seven_dof_arm"))
    began = time.perf_counter()
    short = plain.simplified(0.5)
    assert time.perf_counter() - began < 10.0
    (note,) = short.notes
    assert "are not simplified: 0.5 s were over" in note
    numbers = numbers_of(plain, np.random.default_rng(5))
    np.testing.assert_allclose(
        worked_out(short.M, numbers), worked_out(plain.M, numbers), rtol=1e-11, atol=1e-12
    )


def test_functions_of_time():
    moved = equations_of(symgen.load("slider_crank")).named().of_time()
    theta = sympy.Function("theta")(moved.t)
    assert moved.q[0] == theta and moved.v[0] == theta.diff(moved.t)
    assert moved.multipliers[0] == sympy.Function("lambda(pin_x_closes)")(moved.t)
    assert moved.substituted().Phi.diff(moved.t).equals(moved.substituted().Phi_dot)
    ball = equations_of(symgen.load("free_rigid_body")).of_time()
    assert ball.v[0] == sympy.Function("turn_wx")(ball.t)


def test_products_of_sines_and_cosines_become_sums_of_angles_where_that_is_shorter():
    a, b, c = sympy.symbols("a b c")
    sin, cos = sympy.sin, sympy.cos
    written = {
        0: c * cos(a) * cos(b) + c * sin(a) * sin(b),
        1: a * sin(b) ** 2 + a * cos(b) ** 2 + c,
        2: cos(a) * (c + sin(b)),  # as a sum of angles it would be longer
    }
    found = shortened(written)
    assert found[0] == c * cos(a - b) and found[1] == a + c and found[2] == written[2]


def test_settings_of_jumps_are_left_out():
    model = Model.from_toml(
        '[parameters]\nmu = 0.3\n[coordinates]\nx = { start = 1.0 }\n[energy]\nkinetic = "dot(x)^2/2"\n'
        'potential = "abs(x)"\n[forces]\nx = "where(x < 0, -1, 2)"\n[friction.f]\nspeed = "dot(x)"\nforce = "mu"'
    )
    (force,) = model.equations().f
    assert {x.name for x in force.free_symbols} == {"x", "mu", "sense(f)"}
    x, mu, sense = sympy.symbols("x mu sense(f)")
    for at, expected in ((2.0, -1 + 2 - 0.3), (-2.0, 1 - 1 - 0.3)):
        assert float(force.subs({x: at, mu: 0.3, sense: 1})) == pytest.approx(expected)
