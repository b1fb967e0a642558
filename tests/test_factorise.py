"""Sparse factorisation of [M Gᵀ; G 0]: against NumPy, its order against a plain search, its cost along chains."""

from __future__ import annotations

import numpy as np
import pytest
from random_expressions import evaluate

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


def test_pivot_ratio_finds_nearly_dependent_constraints():
    M, G = sparse_system(7, m=3)
    G[2] = G[0] + 1e-3 * G[2]
    g, mass, jacobian, values = on_graph(M, G)
    factors = factorise(g, mass, jacobian, [f"x{k:02d}" for k in range(17)])
    ratio = evaluate(g, [pivot_ratio(g, factors)], values)[0]
    assert 1e-8 < ratio < 1e-4


def plain_order(M, G):
    """The order that a search through all rows finds: eligible, then fewest entries, then first."""
    n, m = len(M), len(G)
    K = np.block([[M, G.T], [G, np.zeros((m, m))]]) != 0.0
    rows = {i: set(np.flatnonzero(K[i])) for i in range(n + m)}
    order = []
    while rows:
        eligible = [
            i for i in rows if i in rows[i] and (i < n or not any(j < n and j in rows[j] for j in rows[i]))
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
