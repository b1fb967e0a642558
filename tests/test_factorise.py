"""Sparse factorisation of [M Gᵀ; G 0]: against NumPy, its order against a plain search, its cost along chains."""

from __future__ import annotations

import numpy as np
import pytest
from random_expressions import evaluate

from symgen import Model, dot
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.nodes import PARAM, Q
from symgen.derive.pipeline import derive
from symgen.derive.solve.factorise import factorise, pivot_ratio, solve
from symgen.model.library import find, load


def sparse_system(seed, n=14, m=5, massless=0, prescribed=0):
    """Random M (positive definite but for `massless` last coordinates) and G of full rank, mostly zeros."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.15)
    M = root @ root.T + np.eye(n)
    G = rng.normal(size=(m, n)) * (rng.random((m, n)) < 0.25)
    for k in range(m):
        G[k, k] += 2.0
    for k in range(massless):
        z = n - 1 - k
        M[z, :] = M[:, z] = 0.0
        G[:, z] = 0.0
        G[k, z] = 1.5
    for k in range(prescribed):
        G[m - 1 - k, :] = 0.0
        G[m - 1 - k, m - 1 - k] = 1.0
    return M, G


def on_graph(M, G):
    """The system with a variable for each nonzero entry, and the variables' values."""
    g, values = Graph(), {}

    def node(x, k):
        variable = g.var(Q, k)
        values[variable] = x
        return variable

    n = len(M)
    mass = [{j: node(M[i, j], min(i, j) * n + max(i, j)) for j in range(n) if M[i, j]} for i in range(n)]
    jacobian = [{j: node(x, n * n + k * n + j) for j, x in enumerate(row) if x} for k, row in enumerate(G)]
    return g, mass, jacobian, values


@pytest.mark.parametrize("massless", [0, 2])
@pytest.mark.parametrize("prescribed", [0, 1])
@pytest.mark.parametrize("seed", range(4))
def test_solution_agrees_with_numpy(seed, massless, prescribed):
    M, G = sparse_system(seed, massless=massless, prescribed=prescribed)
    g, mass, jacobian, values = on_graph(M, G)
    n, m = len(M), len(G)
    right = np.random.default_rng(seed + 100).normal(size=n + m)
    nodes = [g.var(PARAM, k) for k in range(n + m)]
    factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(n + m)])
    x = evaluate(g, solve(g, factors, nodes), values | dict(zip(nodes, right, strict=True)))
    K = np.block([[M, G.T], [G, np.zeros((m, m))]])
    assert x == pytest.approx(np.linalg.solve(K, right), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("constraints_of_it", [1, 2])
@pytest.mark.parametrize("seed", range(4))
def test_stops_of_coordinates_without_inertia_hold_and_let_go(seed, constraints_of_it):
    """The angle of a closure has no inertia: whether a stop holds it or not, another constraint determines it."""
    M, G = sparse_system(seed, massless=2)
    if constraints_of_it == 2:
        G[3, -1], G[4, -2] = 0.7, 0.4
    n, m = len(M), len(G)
    stops = np.zeros((3, n))
    stops[0, -1] = stops[1, -2] = stops[2, 0] = 1.0
    g, mass, jacobian, values = on_graph(M, G)
    closed = [g.var(PARAM, n + m + 3 + k) for k in range(3)]
    jacobian += [
        {int(j): g.mul(closed[k], g.const(row[j])) for j in np.flatnonzero(row)}
        for k, row in enumerate(stops)
    ]
    corner = {m + k: g.sub(node, g.one) for k, node in enumerate(closed)}
    right = np.random.default_rng(seed + 100).normal(size=n + m + 3)
    nodes = [g.var(PARAM, k) for k in range(n + m + 3)]
    factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(n + m + 3)], corner)
    solution = solve(g, factors, nodes)
    for pattern in range(8):
        holds = np.array([pattern >> k & 1 for k in range(3)], dtype=float)
        given = values | dict(zip([*nodes, *closed], [*right, *holds], strict=True))
        rows = np.vstack([G, holds[:, None] * stops])
        K = np.block([[M, rows.T], [rows, np.diag([*np.zeros(m), *(holds - 1.0)])]])
        assert evaluate(g, solution, given) == pytest.approx(np.linalg.solve(K, right), rel=1e-8, abs=1e-8)


def drawn_with_bare_coordinates(seed):
    """M with some rows of zeros, a dense G, rows that can be switched on; None where some of that is near singular."""
    r = np.random.default_rng(seed)
    n, bare, n_switched = int(r.integers(3, 12)), int(r.integers(1, 4)), int(r.integers(0, 3))
    m = int(r.integers(min(bare, n - 1), min(n, 7)))
    bare = min(bare, m)
    root = r.normal(size=(n, n)) * (r.random((n, n)) < 0.3)
    M = root @ root.T + np.diag(r.uniform(0.5, 2.0, n))
    M[n - bare :] = M[:, n - bare :] = 0.0
    G = r.normal(size=(m, n)) * (r.random((m, n)) < r.uniform(0.2, 0.6))
    S = r.normal(size=(n_switched, n)) * (r.random((n_switched, n)) < 0.4)
    if not (G.any(axis=1).all() and S.any(axis=1).all()):
        return None
    patterns = [np.array([k >> i & 1 for i in range(n_switched)], dtype=float) for k in range(2**n_switched)]
    matrices = []
    for closed in patterns:
        rows = np.vstack([G, closed[:, None] * S])
        matrices.append(np.block([[M, rows.T], [rows, np.diag([*np.zeros(m), *(closed - 1.0)])]]))
    return None if max(map(np.linalg.cond, matrices)) > 1e5 else (M, G, S, patterns, matrices)


def test_coordinates_without_inertia_may_stand_in_any_constraints():
    """Several of them in several constraints, with coefficients that move: no one constraint determines them."""
    tested = 0
    for seed in range(120):
        case = drawn_with_bare_coordinates(seed)
        if case is None:
            continue
        M, G, S, patterns, matrices = case
        g, mass, jacobian, values = on_graph(M, G)
        n = len(matrices[0])
        nodes, closed = [g.var(PARAM, k) for k in range(n)], [g.var(PARAM, n + k) for k in range(len(S))]
        jacobian += [
            {int(j): g.mul(closed[k], g.const(row[j])) for j in np.flatnonzero(row)}
            for k, row in enumerate(S)
        ]
        corner = {len(G) + k: g.sub(node, g.one) for k, node in enumerate(closed)}
        factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(n)], corner)
        right = np.random.default_rng(seed).normal(size=n)
        for pattern, matrix in zip(patterns, matrices, strict=True):
            given = values | dict(zip([*nodes, *closed], [*right, *pattern], strict=True))
            x, known = np.array(evaluate(g, solve(g, factors, nodes), given)), np.linalg.solve(matrix, right)
            assert np.abs(x - known).max() < 1e-8 * np.abs(known).max()
        tested += 1
    assert tested > 40


def test_pivot_ratio_finds_nearly_dependent_constraints():
    M, G = sparse_system(7, m=3)
    G[2] = G[0] + 1e-3 * G[2]
    g, mass, jacobian, values = on_graph(M, G)
    factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(17)])
    ratio = evaluate(g, [pivot_ratio(g, factors)], values)[0]
    assert 1e-8 < ratio < 1e-4


def plain_order(M, G):
    """The order that a search through all rows finds: eligible, then fewest entries, then first.

    A constraint waits for the coordinates of its own row of G, not for those that fill has put there.
    """
    n, m = len(M), len(G)
    own = {n + k: set(np.flatnonzero(row)) for k, row in enumerate(G)}
    K = np.block([[M, G.T], [G, np.zeros((m, m))]]) != 0.0
    rows = {i: set(np.flatnonzero(K[i])) for i in range(n + m)}
    order = []
    while rows:
        eligible = [
            i for i in rows if i in rows[i] and (i < n or not any(j in rows[j] for j in rows[i] & own[i]))
        ]
        k = min(eligible, key=lambda i: (len(rows[i]), i))
        neighbours = rows.pop(k) - {k}
        for i in neighbours:
            rows[i] = (rows[i] | neighbours) - {k}
        order.append(k)
    return order


@pytest.mark.parametrize("seed", range(6))
def test_order_is_that_of_a_plain_search(seed):
    M, G = sparse_system(seed + 20, n=18, m=6)
    G[:, -1] = 1.0  # no constraint prescribes a coordinate
    g, mass, jacobian, _ = on_graph(M, G)
    factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(24)])
    assert [row for pivot in factors.pivots for row in pivot.rows] == plain_order(M, G)


def coupled_elements(seed, apart, n=16, m=7):
    """M of elements that couple three neighbours each, G of neighbours; one row of G is nearly another."""
    rng = np.random.default_rng(seed)
    M, G = np.zeros((n, n)), np.zeros((m, n))
    for k in range(n - 2):
        root = rng.normal(size=(3, 3))
        M[k : k + 3, k : k + 3] += root @ root.T
    for c in range(m):
        first = c * (n - 4) // (m - 1)
        G[c, first : first + 4] = rng.normal(size=4)
    G[m // 2] = np.where(G[m // 2] != 0.0, apart * G[m // 2], 0.0) + G[m // 2 - 1]
    return M, G


@pytest.mark.parametrize("apart", [1.0, 1e-2, 1e-4])
def test_near_dependent_constraints_cost_no_more_digits_than_a_pivoted_factorisation_loses(apart):
    errors = []
    for seed in range(12):
        M, G = coupled_elements(seed, apart)
        n, m = len(M), len(G)
        g, mass, jacobian, values = on_graph(M, G)
        factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(n + m)])
        K = np.block([[M, G.T], [G, np.zeros((m, m))]])
        nodes = [g.var(PARAM, k) for k in range(n + m)]
        exact = np.random.default_rng(seed).integers(-9, 10, n + m).astype(float)
        right = K @ exact
        given = values | dict(zip(nodes, right, strict=True))
        x = np.array(evaluate(g, solve(g, factors, nodes), given))
        by_lu = np.abs(np.linalg.solve(K, right) - exact).max()
        errors.append(np.abs(x - exact).max() / max(by_lu, 1e-15))
    assert np.median(errors) < 5 and max(errors) < 100


def windows_of_rods(n):
    """N four-bar windows by the places of their joints: inertia couples neighbours along the whole row."""
    model = Model("windows")
    before, kinetic = None, 0
    for k in range(n + 1):
        x, y = model.coordinate(f"x{k}", guess=float(k)), model.coordinate(f"y{k}", guess=1.0)
        kinetic += (dot(x) ** 2 + dot(y) ** 2) / 6
        model.constraint(f"rocker{k}", (x - k) ** 2 + y**2 - 1)
        if before is not None:
            u, w = before
            kinetic += (dot(x) ** 2 + dot(x) * dot(u) + dot(u) ** 2) / 6
            kinetic += (dot(y) ** 2 + dot(y) * dot(w) + dot(w) ** 2) / 6
            model.constraint(f"coupler{k}", (x - u) ** 2 + (y - w) ** 2 - 1)
        before = x, y
    model.kinetic(kinetic)
    return model


def test_cost_of_a_row_of_windows_by_joints_is_linear():
    rhs = [derive(windows_of_rods(n).describe()).operations()["rhs"] for n in (8, 16, 24)]
    assert rhs[2] - rhs[1] == rhs[1] - rhs[0] <= 8 * 205


def test_cost_of_a_chain_in_absolute_coordinates_is_linear():
    programs = [derive(load(find("chain_absolute"), {"N": str(N)}).describe()) for N in (10, 20, 30)]
    rhs = [p.operations()["rhs"] for p in programs]
    project = [p.operations()["project"] for p in programs]
    assert rhs[2] - rhs[1] == rhs[1] - rhs[0] <= 10 * 96
    assert project[2] - project[1] == project[1] - project[0] <= 10 * 132


def test_chain_in_absolute_coordinates_moves_as_one_in_angles():
    """Angular accelerations against Lagrange's equations of the second kind, reduced by hand with NumPy."""
    from symgen.link import derive as link

    n = 6
    system = link(load(find("chain_absolute"), {"N": str(n)}))
    p = {entry["name"]: entry["value"] for entry in system.parameters}
    m, L, grav = p["m"], p["L"], p["g"]
    rng = np.random.default_rng(2)
    theta, omega = rng.uniform(-1, 1, n), rng.uniform(-2, 2, n)
    reach = L * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))  # of rod j's turn to the centre of rod i
    x, y = reach @ np.sin(theta), -reach @ np.cos(theta)
    Jx, Jy = reach * np.cos(theta), reach * np.sin(theta)
    bias_x, bias_y = -reach @ (np.sin(theta) * omega**2), reach @ (np.cos(theta) * omega**2)
    M = m * (Jx.T @ Jx + Jy.T @ Jy) + m * L**2 / 12 * np.eye(n)
    expected = np.linalg.solve(M, -m * (Jx.T @ bias_x + Jy.T @ (bias_y + grav)))
    q = np.ravel(np.column_stack([x, y, theta]))
    v = np.ravel(np.column_stack([Jx @ omega, Jy @ omega, omega]))
    out = system.kernel("rhs")(0.0, np.concatenate([q, v]), system.parameter_values())
    assert out[3 * n : 6 * n][2::3] == pytest.approx(expected, rel=1e-10)
