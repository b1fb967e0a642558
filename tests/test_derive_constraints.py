"""Derived constraints: Jacobian, γ, multipliers, projection; elimination of coordinates without inertia."""

from __future__ import annotations

import numpy as np
import pytest
from derived import Generated, describe
from lagrange import Reference
from mechanisms import CONSTRAINED

from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text


@pytest.fixture(scope="module")
def systems():
    return {build: Generated(build()) for build in CONSTRAINED}


models = pytest.mark.parametrize("build", CONSTRAINED, ids=lambda f: f.__name__)


def states(system: Generated, build, count=3):
    rng = np.random.default_rng(11)
    for _ in range(count):
        yield system.consistent_state(rng, np.array(CONSTRAINED[build]) + rng.uniform(-0.02, 0.02, system.n))


def kkt(M, G):
    return np.block([[M, -G.T], [G, np.zeros((len(G), len(G)))]])


@models
def test_jacobian_and_gamma_are_those_of_the_constraints(systems, build):
    system, reference = systems[build], Reference(build())
    rng = np.random.default_rng(12)
    for _ in range(3):  # anywhere, not only on the constraints
        t, y = system.random_state(rng)
        np.testing.assert_allclose(system.G(t, y), reference.G(t, y), atol=1e-13)
        np.testing.assert_allclose(system("gamma", t, y), reference.gamma(t, y), atol=1e-12)
        expected = reference.number([*reference.position, *reference.velocity], t, y)[:, 0]
        np.testing.assert_allclose(system("constraint_residual", t, y), expected, atol=1e-13)


@models
def test_accelerations_and_multipliers_solve_the_saddle_point_system(systems, build):
    system, reference = systems[build], Reference(build())
    for t, y in states(system, build):
        M, f = reference.equations(t, y)
        expected = np.linalg.solve(kkt(M, reference.G(t, y)), [*f, *reference.gamma(t, y)])
        parts = system.split(t, y)
        np.testing.assert_allclose([*parts.a, *parts.lam], expected, rtol=1e-9, atol=1e-9)
        assert 0.0 < parts.ratio <= 1.0
        residual = system("residual", t, [*y, *parts.a, *parts.lam])
        assert np.abs(residual).max() < 1e-11 * max(1.0, np.abs(expected).max())


@models
def test_levels_are_derivatives_of_each_other_along_the_motion(systems, build):
    """dΦ/dt is the velocity level, and its derivative vanishes with the accelerations of `rhs`."""
    system = systems[build]
    nh = system.nh
    for t, y in states(system, build):
        slope = system.slope("constraint_residual", t, y, [*y[system.n :], *system.split(t, y).a], 1.0)
        np.testing.assert_allclose(slope[:nh], system("constraint_residual", t, y)[nh : 2 * nh], atol=1e-12)
        np.testing.assert_allclose(slope[nh:], 0.0, atol=1e-9)


@models
def test_projection_reduces_the_residuals_quadratically(systems, build):
    system = systems[build]
    n, nh, m = system.n, system.nh, system.m
    rng = np.random.default_rng(13)
    t, y0 = next(states(system, build))
    direction = rng.uniform(-1, 1, 2 * n)
    after = []
    for size in (1e-3, 1e-4):
        y = y0 + size * direction
        out = system("project", t, y)
        before = system("constraint_residual", t, y)
        np.testing.assert_allclose(out[2 * n : 2 * n + nh], before[:nh], atol=1e-15)
        mixed = system("constraint_residual", t, [*out[:n], *y[n:]])
        np.testing.assert_allclose(out[2 * n + nh :], mixed[nh:], atol=1e-13)
        after.append(np.abs(system("constraint_residual", t, out[: 2 * n])).max())
        assert np.abs(before).max() > 0.05 * size
    assert after[0] < 20 * 1e-6
    assert after[1] < 0.03 * after[0] + 1e-14, "ten times closer must be a hundred times better"
    for _ in range(6):
        y = system("project", t, y)[: 2 * n]
    assert np.abs(system("constraint_residual", t, y)).max() < 1e-14
    assert m == len(out) - 2 * n - nh


@models
def test_projection_moves_orthogonally_in_the_mass_metric(systems, build):
    """M times each step lies in the span of the constraint gradients: nothing moves along the constraints."""
    system = systems[build]
    n, nh = system.n, system.nh
    t, y0 = next(states(system, build))
    y = y0 + 1e-2 * np.random.default_rng(14).uniform(-1, 1, 2 * n)
    step = system("project", t, y)[: 2 * n] - y
    M, G = system.mass(t, y), system.G(t, y)
    null = np.linalg.svd(G)[2][np.linalg.matrix_rank(G) :].T
    assert null.shape[1] == n - system.m
    scale = np.abs(M).max() * np.abs(step).max()
    np.testing.assert_allclose(null.T @ M @ step[n:], 0.0, atol=1e-12 * scale)
    if nh:  # velocity constraints hold the position step back, too
        np.testing.assert_allclose(null.T @ M @ step[:n], 0.0, atol=1e-12 * scale)
    else:
        assert (step[:n] == 0.0).all()


def test_projection_leaves_a_consistent_state(systems):
    for build, system in systems.items():
        t, y = next(states(system, build))
        np.testing.assert_allclose(system("project", t, y)[: 2 * system.n], y, atol=1e-13)


def bar(**parts):
    """Two masses of which only their sum has inertia, or neither, unless constraints determine them."""
    return describe("bar", "x y z", {"m": 2.0, "k": 3.0}, potential="k*x**2/2 + k*z*y", **parts)


@pytest.mark.parametrize(
    "parts",
    [
        {"kinetic": "m/2*(dot(x) + dot(y))**2 + dot(z)**2", "constraints": {"c": "x - 2*y + sin(z)"}},
        {"kinetic": "(dot(x) + dot(y))**2 + dot(z)**2", "constraints": {"c": "x - 2*y + sin(z)"}},
        {"kinetic": "m/2*dot(x)**2", "constraints": {"c": "x - 2*y", "d": "z - x*y"}},
        {"kinetic": "m/2*dot(x)**2", "constraints": {"c": "x - 2*y + z**2", "d": "z - y"}},
        {
            "kinetic": "m/2*dot(x)**2",
            "constraints": {"d": "z - y"},
            "velocity_constraints": {"c": "dot(y) - x*dot(x)"},
        },
        {"kinetic": "m/2*dot(x)**2", "constraints": {"a": "x - t", "b": "y - t**2", "c": "z + y - x"}},
        {"kinetic": "m/2*(dot(x)**2 + dot(y)**2)", "constraints": {"d": "z*(1 + x**2) - y"}},
        {"kinetic": "m/2*(dot(x)**2 + dot(y)**2)", "constraints": {"c": "z*sin(y) - x", "d": "z*cos(y) - t"}},
    ],
)
def test_coordinates_without_inertia_of_their_own(parts):
    system = Generated(bar(**parts))
    t, y = 0.4, np.array([0.3, 0.2, 0.5, -0.4, 0.7, 0.1])
    expected = np.linalg.solve(
        kkt(system.mass(t, y), system.G(t, y)), [*system("forces", t, y), *system("gamma", t, y)]
    )
    actual = system.split(t, y)
    np.testing.assert_allclose([*actual.a, *actual.lam], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("theta", [0.0, 1e-9, 1e-5, np.pi])
def test_slider_crank_passes_its_dead_centres(systems, theta):
    """Where crank and rod are in line, the piston's constraint moves no mass; the system is regular."""
    system = next(s for build, s in systems.items() if build.__name__ == "slider_crank")
    phi = -np.arcsin(np.sin(theta) / 3)
    x = 0.1 * np.cos(theta) + 0.3 * np.cos(phi)
    y = np.array([theta, phi, x, 2.0, -2.0 * np.cos(theta) / 3 / np.cos(phi), 0.0])
    matrix = kkt(system.mass(0.0, y), system.G(0.0, y))
    assert np.linalg.cond(matrix) < 1e5
    expected = np.linalg.solve(matrix, [*system("forces", 0.0, y), *system("gamma", 0.0, y)])
    actual = system.split(0.0, y)
    np.testing.assert_allclose([*actual.a, *actual.lam], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("theta", [0.0, 1e-9, 0.5])
def test_prescribed_coordinate_needs_no_inertia_of_its_own(theta):
    """A pendulum on a massless cart has a singular M at theta = 0; but not with the cart's motion given."""
    d = describe(
        "massless_cart",
        "x theta",
        {"m": 2.0, "l": 0.5, "A": 0.1},
        kinetic="m/2*(dot(x + l*sin(theta))**2 + dot(l*cos(theta))**2)",
        potential="-m*9.81*l*cos(theta)",
        constraints={"drive": "x - A*sin(5*t)"},
    )
    system = Generated(d)
    t, y = 0.1, np.array([0.1 * np.sin(0.5), theta, 0.5 * np.cos(0.5), 1.0])
    expected = np.linalg.solve(
        kkt(system.mass(t, y), system.G(t, y)), [*system("forces", t, y), *system("gamma", t, y)]
    )
    actual = system.split(t, y)
    np.testing.assert_allclose([*actual.a, *actual.lam], expected, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(
    "parts, culprit",
    [
        ({"kinetic": "m/2*dot(x)**2 + dot(z)**2"}, "y"),
        ({"kinetic": "(dot(x) + dot(y))**2 + dot(z)**2"}, "y"),
        ({"kinetic": "m/2*dot(x)**2 + dot(y)**2", "constraints": {"c": "x - y"}}, "z"),
        ({"kinetic": "m/2*dot(x)**2", "constraints": {"c": "z - y"}}, "[yz]"),
    ],
)
def test_undetermined_accelerations_are_refused_by_name(parts, culprit):
    with pytest.raises(ModelError, match=rf"\b{culprit}\b"):
        Generated(bar(**parts))


@pytest.mark.parametrize(
    "constraints",
    [
        {"c": "x - t", "again": "2*x - 2*t"},
        {"c": "x - y", "d": "z - y", "again": "x - z"},
        {"c": "x*z", "again": "x*z"},
    ],
)
def test_dependent_constraints_derive_and_show_in_the_pivot_ratio(constraints, monkeypatch):
    monkeypatch.setattr("symgen.derive.constraints.LARGEST", 0)  # else what repeats others is left out
    system = Generated(bar(kinetic="m/2*(dot(x)**2 + dot(y)**2 + dot(z)**2)", constraints=constraints))
    y = np.array([0.3, 0.3, 0.3, 0.5, 0.5, 0.5])
    with np.errstate(all="ignore"):
        ratio = system.split(0.3, [np.float64(x) for x in y], system.p).ratio
    assert not ratio > 1e-12


LINKAGE = """
[parameters]
l = 0.3
coupler = 0.8
[coordinates]
a = { start = 0.5, rate = 8.0 }
c = { guess = 1.5 }
%s
[energy]
kinetic = "0.5*0.02*dot(a)^2"
potential = "3*sin(a) + 10*(c - 1.5)^2"
dissipation = "0.05*dot(c)^2"
[constraints]
"""
BY_PLACES = """
cx = "l*cos(a) + coupler*cos(b) - x"
cy = "l*sin(a) + coupler*sin(b) - y"
dx = "0.6*cos(c) + 0.9 - x"
dy = "0.6*sin(c) - y"
"""
BY_A_ROD = 'rod = "(0.6*cos(c) + 0.9 - l*cos(a))^2 + (0.6*sin(c) - l*sin(a))^2 - coupler^2"'


def test_links_without_mass_may_have_angles_and_places_of_their_own():
    """Each stands in two constraints with a coefficient that moves; multipliers at the start were off by 1e-5."""
    own = "x = { guess = 0.9 }\ny = { guess = 0.6 }\nb = { guess = 0.5 }"
    ends = []
    for coordinates, rows in ((own, BY_PLACES), ("", BY_A_ROD)):
        system = derive(read_text("name = 'linkage'" + LINKAGE % coordinates + rows))
        solution = system.run(t_end=2.0, method="taylor", rtol=1e-11)
        assert not solution.objections
        ends.append([solution["a"][-1], solution["c"][-1]])
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_a_mechanism_without_any_mass_follows_its_drive():
    """b, c and x are found from three constraints that share them; it was refused as not determined."""
    system = derive(
        read_text("""
name = "driven"
[coordinates]
a = { start = 0.5, rate = 2.0 }
b = { guess = 0.5 }
c = { guess = 1.5 }
x = { guess = 0.3 }
[constraints]
drive = "a - 0.5 - 2*t"
cx = "0.3*cos(a) + 0.8*cos(b) - 0.6*cos(c) - 0.9"
cy = "0.3*sin(a) + 0.8*sin(b) - 0.6*sin(c)"
more = "x*cos(b) - 0.2*sin(c)"
""")
    )
    solution = system.run(t_end=3.0, method="dop853")
    assert not solution.objections
    a, b, c, x = (solution[name] for name in "abcx")
    assert a == pytest.approx(0.5 + 2.0 * solution.t, abs=1e-9)
    assert 0.3 * np.cos(a) + 0.8 * np.cos(b) == pytest.approx(0.6 * np.cos(c) + 0.9, abs=1e-9)
    assert x * np.cos(b) == pytest.approx(0.2 * np.sin(c), abs=1e-9)


def test_a_loop_of_links_without_mass_takes_the_rate_that_is_given():
    """The tip alone has mass, and the row that the drive does not move is small: rates 'cannot hold', it said."""
    tree = """
name = "tip"
[coordinates]
a = { start = 1.2, rate = 0.5 }
b = { guess = -1.2 }
c = { guess = -1.9 }
[bodies.tip]
mass = 1.0
com = ["0.5*cos(a) + 0.8*cos(a + b)", "0.5*sin(a) + 0.8*sin(a + b)"]
[gravity]
y = "9.81"
[constraints]
cx = "0.5*cos(a) + 0.8*cos(a + b) + 0.6*cos(a + b + c) - 0.9"
cy = "0.5*sin(a) + 0.8*sin(a + b) + 0.6*sin(a + b + c)"
"""
    rod = """
name = "tip"
[coordinates]
a = { start = 1.2, rate = 0.5 }
psi = { guess = -1.9 }
[bodies.tip]
mass = 1.0
com = ["0.9 - 0.6*cos(psi)", "-0.6*sin(psi)"]
[gravity]
y = "9.81"
[constraints]
rod = "(0.9 - 0.6*cos(psi) - 0.5*cos(a))^2 + (0.6*sin(psi) + 0.5*sin(a))^2 - 0.64"
"""
    found = [derive(read_text(text)).run(t_end=2.0, method="dop853", rtol=1e-10) for text in (tree, rod)]
    assert not any(solution.objections for solution in found)
    assert found[0]["a"][-1] == pytest.approx(found[1]["a"][-1], abs=1e-8)


REDUNDANT = """
name = "redundant"
[parameters]
m = 1.3
[coordinates]
a = { start = 0.4, rate = 0.5 }
%s
[energy]
potential = "5*a^2"
[bodies.tip]
mass = "m"
com = %s
"""


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_more_coordinates_may_move_a_mass_than_it_has_ways_to_go(method):
    """M is singular by its structure, with a full diagonal: pivots were round-off, and no run got on."""
    both = REDUNDANT % ("b = { guess = 0.1 }", '["a + 0.7*b", "0.3*a + 0.21*b"]')
    both += '[constraints]\nc = "b - 0.2*sin(a)"\n'
    one = REDUNDANT % ("", '["a + 0.14*sin(a)", "0.3*a + 0.042*sin(a)"]')
    found = [derive(read_text(text)).run(t_end=2.0, method=method, rtol=1e-10) for text in (both, one)]
    assert not any(solution.objections for solution in found)
    assert found[0]["a"][-1] == pytest.approx(found[1]["a"][-1], abs=1e-8)


HELD = {
    "friction": "[friction.rub]\nspeed = 'dot(a)'\nforce = 0.4\n",
    "friction by a reaction": "[friction.rub]\nspeed = 'dot(a)'\ncoefficient = 0.1\nnormal = 'base'\n",
    "stop": "[stops.end]\ngap = '0.405 - a'\nrestitution = 0.0\n",
}


@pytest.mark.parametrize("held", HELD)
def test_series_know_what_is_held_where_rows_are_rearranged(held):
    """M is singular by its structure, and a coordinate without inertia stands in two constraints.

    Series took the solve of the form in which nothing is held, with a traceback.
    """
    more = (
        "d = { guess = 0.28 }\nbeside = { start = 0.2 }\nwall = { guess = 0 }\n",
        '[bodies.weight]\nmass = 0.7\ncom = ["wall", "beside"]\n',
        'base = "wall - 0.3*a - 0.2*beside"\n',
    )
    text = (
        REDUNDANT % ("b = { guess = 0.1 }\n" + more[0], '["a + 0.7*b", "0.3*a + 0.21*b"]')
        + more[1]
        + HELD[held]
    )
    text += "[gravity]\ny = -9.81\n[constraints]\n" + more[2]
    text += 'first = "d - 0.7*a"\ntie = "b - 0.2*sin(a) + 0.8*(d - 0.7*a)"\n'
    found = [derive(read_text(text)).run(t_end=1.5, method=m, rtol=1e-10) for m in ("taylor", "dop853")]
    assert not any(solution.objections for solution in found)
    assert found[0]["a"][-1] == pytest.approx(found[1]["a"][-1], abs=1e-8)
    assert found[0].events and [e.name for e in found[0].events] == [e.name for e in found[1].events]
