"""The pattern of a large model's Newton matrix, found once: its entries, and in which order they are eliminated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.front_plan import FrontPlan, front_plan, without_fronts
from symgen.runtime.integrate.linear import magnitude
from symgen.runtime.integrate.newton_lu import factor_newton, solve_newton
from symgen.runtime.integrate.quaternions import by_rotation, solve_rotation
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import SuperLU

    from symgen.runtime.system import System


# With the equations F(q, v, a, λ) = 0 and a shift g, full methods solve (g - B - A/g) Δv = r, where [A B] are the rows
# of a in -[F_a F_λ]⁻¹ [F_q F_v]. With μ for the change of λ/g, that is
#
#     (g F_a + F_v + F_q/g) Δv + g F_λ μ = F_a r,
#
# which is as sparse as the model. For the rotation vector θ of a quaternion, 1/g becomes (g - K)⁻¹ with Kθ = θ×ω/2, and
# a defect s of θ' adds -F_θ (g - K)⁻¹ s on the right.

# What an entry of the derivative of F is taken by: positions, rates, accelerations and multipliers, the rotation vector
# of a quaternion; or the quaternion itself, which is passed on to its rotation vector.
N_KINDS = 5
BY_POSITION, BY_RATE, BY_UNKNOWN, BY_TURN, BY_QUATERNION = range(N_KINDS)


class NewtonPattern(NamedTuple):
    """Where the entries of the sparse Newton matrix of n equations stand.

    Attributes
    ----------
    kind, row, column, slot : ndarray of int64, shape (n_entries,)
        Of each entry that the kernel `residual_jacobian_entries` writes, then of those by rotation vectors: what it is
        taken by; its equation; the number of the position (as of its rate), rate, or acceleration (then multiplier);
        its place among the matrix's entries.
    factors, factor_start : ndarray of int64, shapes (n_factors,), (N_KINDS + 1,)
        Numbers of the entries by positions, rates and accelerations, by kind and row, and where each kind begins.
    turns : ndarray of int64, shape (n_turns, 6)
        For each quaternion in each equation, whose three entries stand in this order behind those of the kernel: where
        it begins in q and its rates in v; the entries by its components, -1 where there is none.
    start, rows : ndarray of int64, shapes (n + 1,), (n_values,)
        Where each column of the matrix begins among its entries, and the rows of these.
    order : ndarray of int64, shape (n,)
        In which columns are eliminated where rows become pivots by size.
    n_factor : int
        Entries of L in this order with all pivots on the diagonal.
    room : int
        How many entries each factor may have.
    plan : FrontPlan
        The elimination by fronts, which is tried first.
    pairs : ndarray of int64, shape (n_pairs, 4)
        Of each multiplier that gets a diagonal there, with each coordinate of its constraint: its number, the entries
        in its row, in its column, and on the diagonal of the coordinate. None where no multiplier does.
    """

    kind: np.ndarray
    row: np.ndarray
    column: np.ndarray
    slot: np.ndarray
    factors: np.ndarray
    factor_start: np.ndarray
    turns: np.ndarray
    start: np.ndarray
    rows: np.ndarray
    order: np.ndarray
    n_factor: int
    room: int
    plan: FrontPlan
    pairs: np.ndarray


@jitted
def differentiate_sparse(pattern, loop, t, row, arguments, entries):
    """Write the derivative of the equations at (t, y) to `entries`; `row` is the rhs row there.

    Returns
    -------
    int
        RUNNING or NOT_FINITE.
    """
    n_state, nv = loop.sizes[at.NQ] + loop.sizes[at.NV], loop.sizes[at.NV]
    for i in range(n_state):
        arguments[i] = loop.y[i]
    for i in range(nv):
        arguments[n_state + i] = row[loop.sizes[at.NQ] + i]
    for i in range(loop.sizes[at.NM]):
        arguments[n_state + nv + i] = row[n_state + loop.sizes[at.NW] + i]
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t, arguments, loop.p, entries)
    loop.counters[at.JACOBIANS] += 1
    rotate_entries(pattern, loop.y, entries)
    total = 0.0
    for e in range(pattern.kind.shape[0]):
        total += 0.0 * entries[e]
    return at.RUNNING if math.isfinite(total) else at.NOT_FINITE


@jitted
def rotate_entries(pattern, q, entries):
    """Set the entries by rotation vectors from those by quaternions."""
    first = pattern.kind.shape[0] - 3 * pattern.turns.shape[0]
    for k in range(pattern.turns.shape[0]):
        w = entry_or_zero(entries, pattern.turns[k, 2])
        x = entry_or_zero(entries, pattern.turns[k, 3])
        y = entry_or_zero(entries, pattern.turns[k, 4])
        z = entry_or_zero(entries, pattern.turns[k, 5])
        e = first + 3 * k
        entries[e], entries[e + 1], entries[e + 2] = by_rotation(q, pattern.turns[k, 0], w, x, y, z)


@jitted
def entry_or_zero(entries, e):
    """The entry with number `e`, zero for -1."""
    return entries[e] if e >= 0 else 0.0


@jitted
def factor_shifted(pattern, g, sizes, y, entries, values, lu):
    """Factor the Newton matrix for the real or complex shift `g`; returns a status.

    Parameters
    ----------
    y : ndarray, shape (NY,)
        The state, whose angular velocities turn quaternions.
    values : ndarray, shape (n_values,), real or complex
        Scratch.
    lu : NewtonLU
    """
    inverse = 1.0 / g
    for k in range(values.shape[0]):
        values[k] = 0.0
    for e in range(pattern.kind.shape[0]):
        kind = pattern.kind[e]
        if kind == BY_UNKNOWN:
            values[pattern.slot[e]] += g * entries[e]
        elif kind == BY_RATE:
            values[pattern.slot[e]] += entries[e]
        elif kind == BY_POSITION:
            values[pattern.slot[e]] += inverse * entries[e]
    first = pattern.kind.shape[0] - 3 * pattern.turns.shape[0]
    for k in range(pattern.turns.shape[0]):
        e, j = first + 3 * k, sizes[at.NQ] + pattern.turns[k, 1]
        # A row times the inverse of a matrix: the inverse of its transpose, which turns the other way.
        u, v, w = solve_rotation(g, -y[j], -y[j + 1], -y[j + 2], entries[e], entries[e + 1], entries[e + 2])
        values[pattern.slot[e]] += u
        values[pattern.slot[e + 1]] += v
        values[pattern.slot[e + 2]] += w
    scale_constraints(pattern, sizes[at.NV], values, lu)
    return factor_newton(pattern, sizes[at.NV], values, lu)


@jitted
def scale_constraints(pattern, nv, values, lu):
    """Scale the rows of constraints so that in no column one is larger than the diagonal.

    They are then eliminated after their coordinates, which keeps the factors as sparse as the matrix's graph allows;
    the units of constraints say nothing about pivots.
    """
    n = pattern.order.shape[0]
    for i in range(n):
        lu.scale[i] = 1.0 if i < nv else math.inf
    for j in range(nv):
        diagonal = 0.0
        for e in range(pattern.start[j], pattern.start[j + 1]):
            if pattern.rows[e] == j:
                diagonal = magnitude(values[e])
        for e in range(pattern.start[j], pattern.start[j + 1]):
            i, size = pattern.rows[e], magnitude(values[e])
            if i >= nv and size > 0.0 and diagonal > 0.0:
                lu.scale[i] = min(lu.scale[i], diagonal / size)
    for i in range(nv, n):
        if not math.isfinite(lu.scale[i]):
            lu.scale[i] = 1.0


@jitted
def multiply(pattern, kind, factor, entries, vector, out):
    """Add `factor` times the derivative by `kind`, multipliers apart, times `vector`, shape (nv,), to `out`."""
    row, total = -1, out.dtype.type(0)
    for k in range(pattern.factor_start[kind], pattern.factor_start[kind + 1]):
        e = pattern.factors[k]
        if pattern.row[e] != row:  # sums are not waited for in memory
            if row >= 0:
                out[row] = total
            row = pattern.row[e]
            total = out[row]
        total += factor * entries[e] * vector[pattern.column[e]]
    if row >= 0:
        out[row] = total


@jitted
def solve_shifted(pattern, entries, turned, r, right, lu):
    """Replace r, shape (nv,), by Δv.

    Parameters
    ----------
    turned : ndarray, shape (nv,)
        (g - K)⁻¹ s for every rotation vector; other places are not read.
    right : ndarray, shape (n,)
        Scratch.
    """
    clear(right)
    multiply(pattern, BY_UNKNOWN, 1.0, entries, r, right)
    if pattern.turns.shape[0] > 0:
        multiply(pattern, BY_TURN, -1.0, entries, turned, right)
    solve_newton(pattern, lu, right)
    for i in range(r.shape[0]):
        r[i] = right[i]


@jitted
def clear(vector):
    """Set a vector to zero."""
    for i in range(vector.shape[0]):
        vector[i] = 0.0


# Entries of factors: pivots off the diagonal lead to more than there are with all pivots on it.
_ROOM = 3
_DOMINANT = 1e3
# For each unknown: a chain has 15, and fronts so small that they cost more than they spare; a net of 110 masses on
# springs has 180, and is factored in half the time.
FEWEST_PRODUCTS = 50
# Multipliers get a diagonal where the products of an elimination by degree alone are so few of those that it spares.
_GIVEN_A_DIAGONAL = 0.5


def newton_pattern(system: System) -> NewtonPattern:
    """Return the pattern of the Newton matrix of a model; made once."""
    key = "_newton_pattern"
    if key not in system.__dict__:
        system.__dict__[key] = _pattern(system)
    return system.__dict__[key]


def _pattern(system: System) -> NewtonPattern:
    nv, n = system.nv, system.nv + system.m
    kind, row, column, turns = _entries(system)
    # A diagonal entry that is always there lets a coordinate without inertia or force be found singular, not missing.
    diagonal = np.arange(nv)
    keys = np.concatenate([np.where(kind == BY_QUATERNION, 0, column * n + row), diagonal * n + diagonal])
    unique, slot = np.unique(keys, return_inverse=True)
    start = np.searchsorted(unique, np.arange(n + 1) * n)
    rows = unique % n
    order, n_factor, plan, pairs = _elimination(start, rows, n, nv)
    factors = np.lexsort((row, kind))
    factors = factors[column[factors] < nv]
    factor_start = np.searchsorted(kind[factors], np.arange(N_KINDS + 1))
    return NewtonPattern(
        *(
            np.ascontiguousarray(x, dtype=np.int64)
            for x in (kind, row, column, slot[: len(kind)], factors, factor_start, turns)
        ),
        np.ascontiguousarray(start, dtype=np.int64),
        np.ascontiguousarray(rows, dtype=np.int64),
        order,
        n_factor,
        _ROOM * n_factor + n,
        plan,
        pairs,
    )


def _entries(system: System) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Kinds, rows and columns of entries, and the table `turns`, see `NewtonPattern`."""
    nq, nv = system.nq, system.nv
    row, column = np.divmod(system.entry_places("residual_jacobian"), nq + 2 * nv + system.m)
    kind = np.where(column < nq, BY_POSITION, np.where(column < nq + nv, BY_RATE, BY_UNKNOWN))
    column = column - np.array([0, nq, nq + nv])[kind]
    positions = Positions(system)
    rate = np.zeros(nq, dtype=np.int64)
    rate[positions.plain_q] = positions.plain_v
    number = {(i, k): e for e, (i, k) in enumerate(zip(row, column)) if kind[e] == BY_POSITION}
    turns, turned = [], []
    for i, j in positions.quaternions:
        for equation in sorted({r for r, k in number if i <= k < i + 4}):
            turns.append([i, j, *(number.get((equation, k), -1) for k in range(i, i + 4))])
            turned += [(equation, j + axis) for axis in range(3)]
    for _, _, *entries in turns:
        kind[[e for e in entries if e >= 0]] = BY_QUATERNION
    plain = kind == BY_POSITION
    column[plain] = rate[column[plain]]
    more = np.array(turned, dtype=np.int64).reshape(-1, 2)
    kind = np.concatenate([kind, np.full(len(more), BY_TURN)])
    table = np.array(turns, dtype=np.int64).reshape(-1, 6)
    return kind, np.concatenate([row, more[:, 0]]), np.concatenate([column, more[:, 1]]), table


def _elimination(
    start: np.ndarray, rows: np.ndarray, n: int, nv: int
) -> tuple[np.ndarray, int, FrontPlan, np.ndarray]:
    """An order for pivots by size, the entries of L in it with pivots on the diagonal, the fronts, and their pairs.

    Orders of small degree on the graph of A + Aᵀ: SuperLU finds them, and what L has, where the diagonal is dominant
    (Liu, ACM TOMS 11 (1985) 141; Li, ACM TOMS 31 (2005) 302).
    """
    from scipy.sparse import csc_matrix, identity

    pattern: csc_matrix = csc_matrix((np.ones(len(rows)), rows, start), shape=(n, n))
    dominant = (pattern + pattern.T + _DOMINANT * n * identity(n)).tocsc()
    by_degree = np.argsort(_factors(dominant, "MMD_AT_PLUS_A").perm_c)
    order = np.argsort(_after_their_coordinates(pattern, np.argsort(by_degree), nv), kind="stable")
    n_factor = _factors(dominant[order][:, order].tocsc(), "NATURAL").L.nnz
    column = np.repeat(np.arange(n), np.diff(start))
    plan, pairs = front_plan(rows, column, order), np.zeros((0, 4), dtype=np.int64)
    if n > nv:
        diagonal = np.arange(nv, n)
        freely = front_plan(np.append(rows, diagonal), np.append(column, diagonal), by_degree)
        if freely.products < _GIVEN_A_DIAGONAL * plan.products:
            plan, pairs = freely, _pairs(rows, column, n, nv)
    if plan.products < FEWEST_PRODUCTS * n:
        plan, pairs = without_fronts(n), pairs[:0]
    return order.astype(np.int64), int(n_factor), plan, pairs


def _pairs(rows: np.ndarray, column: np.ndarray, n: int, nv: int) -> np.ndarray:
    """The table `pairs`, see `NewtonPattern`."""
    keys = column * n + rows  # ascending
    own = np.flatnonzero((rows >= nv) & (column < nv))
    i, j = rows[own], column[own]
    wanted = i * n + j
    mirrored = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    there = keys[mirrored] == wanted
    diagonal = np.searchsorted(keys, j * n + j)
    return np.stack([i - nv, own, mirrored, diagonal], axis=1)[there].astype(np.int64)


def _factors(matrix: csc_matrix, order: str) -> SuperLU:
    from scipy.sparse.linalg import splu

    return splu(matrix, permc_spec=order, options={"SymmetricMode": True})


def _after_their_coordinates(pattern: csc_matrix, place: np.ndarray, nv: int) -> np.ndarray:
    """Places of all unknowns in an elimination, such that no multiplier comes before a coordinate of its constraint.

    The diagonal is zero until these are eliminated. Orders by degree alone begin with multipliers; then their pivots
    are elsewhere, and of a net of constraints the factors grow to many times their size.
    """
    entries = pattern.tocoo()
    place = place.astype(float)
    own = (entries.row >= nv) & (entries.col < nv)
    last = np.full(len(place), -1.0)
    np.maximum.at(last, entries.row[own], place[entries.col[own]])
    return np.maximum(place, last + 0.5)
