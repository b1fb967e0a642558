"""Factors of a Newton matrix: by fronts, or, where these do not solve for a known vector, with pivots by size."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.fronts import SOURCES, FrontLU, eliminate_fronts, solve_fronts
from symgen.runtime.integrate.left_looking import (
    SparseLU,
    complex_sparse_lu,
    sparse_factor,
    sparse_lu,
    sparse_lu_size,
    sparse_solve,
)
from symgen.runtime.integrate.linear import magnitude

# The diagonal of multipliers is zero until coordinates of their constraints are eliminated, and waiting for all of
# these makes factors several times as long. With a small one of the sign that it will have (a quasidefinite matrix:
# Vanderbei, SIAM J. Optim. 5 (1995) 100), parts of what comes of the coordinates' own diagonals, they may be eliminated
# in any order; where that changes too much, one step of refinement takes it out.
SMALL_DIAGONAL = 1e-9
# Fronts are taken when they solve for a known vector to so many parts, with a step of refinement if they need one. That
# diagonal leaves 1e-6 of nets of a thousand bars: refined, a solution takes twice as long, and Newton, which contracts
# by a tenth at best, does not see it.
TRUSTED = 1e-6
TRUSTED_WITH_DIAGONAL = 1e-5
BY_FRONTS, BY_SIZE, REFINED = 0, 1, 2


class NewtonLU(NamedTuple):
    """Factors of a matrix of n rows with the pattern of a `NewtonPattern`.

    Attributes
    ----------
    fronts : FrontLU
    pivoted : SparseLU
        In the method's `spare`, which is no part of what a run carries: made again from `entries` where others are.
    scale : ndarray, shape (n,)
        What each row is multiplied by; to be set before `factor_newton`.
    entries : ndarray, shape (n_values + m,), real or complex
        The entries of the matrix, rows scaled, then the diagonal that multipliers get.
    x, rest, moved : ndarray, shape (n,)
        Solution, right-hand side, and what is solved for in the order of elimination.
    kind : ndarray of int64, shape (1,)
        BY_FRONTS, REFINED or BY_SIZE.
    stamp, spare_stamp : ndarray, shape (1,), real or complex
        Of the matrix that is to be solved, and of that whose factors are in `pivoted`.
    """

    fronts: FrontLU
    pivoted: SparseLU
    scale: np.ndarray
    entries: np.ndarray
    x: np.ndarray
    rest: np.ndarray
    moved: np.ndarray
    kind: np.ndarray
    stamp: np.ndarray
    spare_stamp: np.ndarray


@jitted
def newton_lu_size(pattern, nv, width):
    """Length of the array that `newton_lu` (`width` 1) or `complex_newton_lu` (`width` 2) divides."""
    n, plan = pattern.order.shape[0], pattern.plan
    own = plan.value_start[-1] + plan.largest * (plan.largest + SOURCES) + plan.n_waiting
    own += pattern.rows.shape[0] + n - nv + 3 * n
    return width * (own + 1) + 3 * n + 1


def new_spare(pattern, n_pairs):
    """Return room for pivots by size in a real matrix and `n_pairs` complex ones; no memory as long as nobody writes.

    Three times of what factors need, it would be most of what a run carries, to be copied wherever that is looked at.
    """
    size = getattr(sparse_lu_size, "py_func", sparse_lu_size)
    n, room = pattern.order.shape[0], pattern.room
    return np.zeros(size(n, room, 1) + 1 + n_pairs * (size(n, room, 2) + 2))


@jitted
def newton_lu(pattern, nv, work, spare):
    """Divide `work`, and the first part of `spare`, into the factors of a real matrix."""
    n = pattern.order.shape[0]
    size = sparse_lu_size(n, pattern.room, 1)
    pivoted, stamp = sparse_lu(n, pattern.room, spare[:size]), spare[size : size + 1]
    scale, rest = work[:n], work[n:]
    whole, rest = rest[: 2 * n + 1].view(np.int64), rest[2 * n + 1 :]
    fronts, entries, vectors, own_stamp = divide_values(pattern, nv, whole, rest)
    return NewtonLU(
        fronts, pivoted, scale, entries, vectors[0], vectors[1], vectors[2], whole[2 * n :], own_stamp, stamp
    )


@jitted
def complex_newton_lu(pattern, nv, k, work, spare):
    """Divide `work`, and its part of `spare`, into the factors of complex matrix `k`."""
    n = pattern.order.shape[0]
    size = sparse_lu_size(n, pattern.room, 2)
    own = spare[sparse_lu_size(n, pattern.room, 1) + 1 + k * (size + 2) :]
    pivoted, stamp = complex_sparse_lu(n, pattern.room, own[:size]), own[size : size + 2].view(np.complex128)
    scale, rest = work[:n], work[n:]
    whole, rest = rest[: 2 * n + 1].view(np.int64), rest[2 * n + 1 :]
    fronts, entries, vectors, own_stamp = divide_values(pattern, nv, whole, rest.view(np.complex128))
    return NewtonLU(
        fronts, pivoted, scale, entries, vectors[0], vectors[1], vectors[2], whole[2 * n :], own_stamp, stamp
    )


@jitted
def divide_values(pattern, nv, whole, values):
    """What of `NewtonLU` holds entries: fronts, entries, three vectors, a number."""
    n, plan = pattern.order.shape[0], pattern.plan
    factors, values = values[: plan.value_start[-1]], values[plan.value_start[-1] :]
    size = plan.largest * plan.largest
    front, values = values[:size], values[size:]
    sources, values = values[: SOURCES * plan.largest], values[SOURCES * plan.largest :]
    waiting, values = values[: plan.n_waiting], values[plan.n_waiting :]
    size = pattern.rows.shape[0] + n - nv
    entries, values = values[:size], values[size:]
    fronts = FrontLU(factors, front, waiting, whole[:n], whole[n : 2 * n], sources)
    return fronts, entries, values[: 3 * n].reshape((3, n)), values[3 * n : 3 * n + 1]


@jitted
def factor_newton(pattern, nv, values, lu):
    """Factor the matrix with these entries, whose rows count as `lu.scale` says; returns a status."""
    scale, n_values = lu.scale, pattern.rows.shape[0]
    for e in range(n_values):
        lu.entries[e] = scale[pattern.rows[e]] * values[e]
    for k in range(n_values, lu.entries.shape[0]):
        lu.entries[k] = 0.0
    for i in range(pattern.pairs.shape[0]):
        across, diagonal = lu.entries[pattern.pairs[i, 2]], lu.entries[pattern.pairs[i, 3]]
        if magnitude(diagonal) > 0.0:
            share = SMALL_DIAGONAL * lu.entries[pattern.pairs[i, 1]] * across / diagonal
            lu.entries[n_values + pattern.pairs[i, 0]] -= share
    if eliminate_fronts(pattern.plan, lu.entries, lu.fronts) == at.RUNNING:
        lu.kind[0] = BY_FRONTS
        given_a_diagonal = pattern.pairs.shape[0] > 0
        if solves_for_known(pattern, TRUSTED_WITH_DIAGONAL if given_a_diagonal else TRUSTED, lu):
            return at.RUNNING
        lu.kind[0] = REFINED
        if given_a_diagonal and solves_for_known(pattern, TRUSTED, lu):
            return at.RUNNING
    lu.kind[0] = BY_SIZE
    return factor_by_size(pattern, lu)


@jitted
def factor_by_size(pattern, lu):
    """Factor the matrix whose entries are in `lu`, with pivots by size; returns a status."""
    for i in range(lu.scale.shape[0]):
        lu.pivoted.scale[i] = 1.0
    lu.stamp[0] = 0.0
    for e in range(pattern.rows.shape[0]):
        lu.stamp[0] += known(e) * lu.entries[e]
    lu.spare_stamp[0] = lu.stamp[0]
    return sparse_factor(pattern.start, pattern.rows, lu.entries, pattern.order, lu.pivoted)


@jitted
def solves_for_known(pattern, within, lu):
    """Whether the fronts solve for a vector that is known beforehand, to so many parts."""
    n = lu.x.shape[0]
    for i in range(n):
        lu.x[i] = -known(i)
        lu.rest[i] = 0.0
    subtract_product(pattern, lu)
    solve_by_fronts(pattern, lu)
    for i in range(n):
        if not magnitude(lu.x[i] - known(i)) <= within:  # false where it is not a number
            return False
    return True


@jitted
def known(i):
    """Numbers between 0.5 and 1.5, without a pattern that constraints could have."""
    turns = 0.6180339887498949 * (i + 1)
    return 0.5 + turns - math.floor(turns)


@jitted
def subtract_product(pattern, lu):
    """Subtract the matrix times `lu.x` from `lu.rest`; the diagonal that multipliers got is no part of it."""
    for j in range(lu.x.shape[0]):
        value = lu.x[j]
        for e in range(pattern.start[j], pattern.start[j + 1]):
            lu.rest[pattern.rows[e]] -= lu.entries[e] * value


@jitted
def solve_by_fronts(pattern, lu):
    """Solve for the right-hand side `lu.rest`, in scaled rows, which is lost; the solution is left in `lu.x`."""
    n, order = lu.x.shape[0], pattern.plan.order
    for i in range(n):
        lu.x[i] = 0.0
    for again in range(2 if lu.kind[0] == REFINED else 1):
        if again:
            subtract_product(pattern, lu)
        for k in range(n):
            lu.moved[k] = lu.rest[order[k]]
        solve_fronts(pattern.plan, lu.fronts, lu.moved)
        for k in range(n):
            lu.x[order[k]] += lu.moved[k]


@jitted
def solve_newton(pattern, lu, b):
    """Solve with the factors of `factor_newton`; the right-hand side `b`, shape (n,), becomes the solution."""
    if lu.kind[0] == BY_SIZE:
        if lu.spare_stamp[0] != lu.stamp[0]:
            factor_by_size(pattern, lu)
        for i in range(b.shape[0]):
            b[i] *= lu.scale[i]
        sparse_solve(pattern.order, lu.pivoted, b)
        return
    for i in range(b.shape[0]):
        lu.rest[i] = lu.scale[i] * b[i]
    solve_by_fronts(pattern, lu)
    for i in range(b.shape[0]):
        b[i] = lu.x[i]
