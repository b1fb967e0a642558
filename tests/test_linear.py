"""Small dense factorisations against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from symgen.runtime.integrate.layout import NOT_FINITE, RUNNING, SINGULAR_MATRIX
from symgen.runtime.integrate.linear import (
    lu_factor,
    lu_solve,
    lu_solve_matrix,
    pivot_ratio,
    solve_rank_deficient,
)


def random_matrix(n, dtype, seed=0):
    random = np.random.default_rng([n, seed])
    a = random.normal(size=(n, n)) + 1j * random.normal(size=(n, n))
    return (a if dtype is complex else a.real).astype(dtype)


def factored(a):
    factors, pivots = a.copy(), np.zeros(len(a), dtype=np.int64)
    return lu_factor(factors, pivots), factors, pivots


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize("n", [1, 2, 3, 7, 24, 61])
def test_lu_solves(n, dtype):
    a = random_matrix(n, dtype)
    status, factors, pivots = factored(a)
    assert status == RUNNING
    b = random_matrix(n, dtype, seed=1)[0]
    x = b.copy()
    lu_solve(factors, pivots, x)
    # A backward error of round-off, whatever the condition is.
    assert np.abs(a @ x - b).max() <= 1e-15 * n * np.abs(a).sum(axis=1).max() * np.abs(x).max()
    assert np.allclose(x, np.linalg.solve(a, b), rtol=1e-15 * n * np.linalg.cond(a), atol=0)


@pytest.mark.parametrize("dtype", [float, complex])
def test_lu_factors_are_those_of_the_permuted_matrix(dtype):
    a = random_matrix(9, dtype)
    _, factors, pivots = factored(a)
    permuted = a.copy()
    for k, chosen in enumerate(pivots):
        permuted[[k, chosen]] = permuted[[chosen, k]]
    lower = np.tril(factors, -1) + np.eye(9)
    upper = np.triu(factors, 1) + np.diag(1.0 / np.diag(factors))
    assert np.abs(lower @ upper - permuted).max() < 1e-14
    assert np.abs(np.tril(factors, -1)).max() <= np.sqrt(2.0) + 1e-14, (
        "pivots are the largest of their columns"
    )


@pytest.mark.parametrize("dtype", [float, complex])
def test_lu_pivots_where_the_diagonal_is_zero(dtype):
    a = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 4.0], [1.0, 0.0, 0.0]], dtype=dtype)
    status, factors, pivots = factored(a)
    x = np.array([2.0, 4.0, 1.0], dtype=dtype)
    lu_solve(factors, pivots, x)
    assert status == RUNNING
    assert np.array_equal(x, np.ones(3))


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize("entry", [0.0, np.nan, np.inf])
def test_lu_refuses_singular_and_infinite_matrices(dtype, entry):
    a = random_matrix(4, dtype)
    a[:, 2] = entry
    assert factored(a)[0] == SINGULAR_MATRIX


def test_lu_solves_for_a_matrix():
    a, b = random_matrix(8, float), np.random.default_rng(2).normal(size=(8, 5))
    _, factors, pivots = factored(a)
    x = b.copy()
    lu_solve_matrix(factors, pivots, x)
    assert np.allclose(x, np.linalg.solve(a, b), rtol=0, atol=1e-12)


def test_pivot_ratio_tells_a_singular_matrix():
    a = random_matrix(6, float)
    assert pivot_ratio(factored(a)[1]) > 1e-4
    a[3] = a[1] - 2.0 * a[5]
    status, factors, _ = factored(a)
    assert status == SINGULAR_MATRIX or pivot_ratio(factors) < 1e-14


def kkt(mass, jacobian):
    """The matrix of M a - Gᵀλ = f, G a = γ."""
    m = len(jacobian)
    return np.block([[mass, -jacobian.T], [jacobian, np.zeros((m, m))]])


@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e6])
def test_redundant_constraints_leave_accelerations_determined(unit):
    random = np.random.default_rng(5)
    mass = unit * (np.eye(5) + np.diag([0.3] * 4, 1) + np.diag([0.3] * 4, -1))
    jacobian = random.normal(size=(2, 5))
    dependent = np.vstack([jacobian, 3.0 * jacobian[0], jacobian[1] - 0.5 * jacobian[0]])
    right = random.normal(size=(7, 4))
    expected = np.linalg.solve(kkt(mass, jacobian), right)[:5]
    more = np.vstack([right, 3.0 * right[5], right[6] - 0.5 * right[5]])
    x = more.copy()
    status = solve_rank_deficient(kkt(mass, dependent), x, 5, np.zeros(9, dtype=np.int64), np.zeros(9))
    assert status == RUNNING
    assert np.allclose(x[:5], expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max())
    round_off = 1e-14 * max(1.0, unit) * np.abs(x).max()
    assert np.allclose(kkt(mass, dependent) @ x, more, rtol=0, atol=10.0 * round_off)


def test_complete_pivoting_solves_regular_systems():
    a, b = random_matrix(7, float), np.random.default_rng(3).normal(size=(7, 2))
    x = b.copy()
    assert solve_rank_deficient(a.copy(), x, 7, np.zeros(7, dtype=np.int64), np.zeros(7)) == RUNNING
    assert np.allclose(x, np.linalg.solve(a, b), rtol=0, atol=1e-12)


def test_complete_pivoting_names_what_is_not_determined():
    mass, jacobian = np.diag([1.0, 0.0, 0.0]), np.array([[1.0, 1.0, 0.0]])
    x, scratch = np.ones((4, 1)), (np.zeros(4, dtype=np.int64), np.zeros(4))
    assert solve_rank_deficient(kkt(mass, jacobian), x, 3, *scratch) == SINGULAR_MATRIX
    assert solve_rank_deficient(np.full((4, 4), np.nan), x, 3, *scratch) == NOT_FINITE
