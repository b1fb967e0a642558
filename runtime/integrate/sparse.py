"""The pattern of a large model's Newton matrix, found once: its entries, and in which order they are eliminated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import magnitude
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

# Left-looking elimination, column by column (Gilbert, Peierls, SIAM J. Sci. Stat. Comput. 9 (1988) 862, as in Davis,
# Direct Methods for Sparse Linear Systems, 2006, chapter 6): the pattern of a column follows from a depth-first search
# in the columns of L before it, so that the time is proportional to the arithmetic, whichever rows become pivots.

# A diagonal entry becomes the pivot unless another in its column is this many times larger. The second number is for
# where the first leads to more entries than there is room for.
LEAST_DIAGONAL, LEAST_DIAGONAL_WITHOUT_ROOM = 0.1, 1e-4
NO_ROOM = -100  # inside of this file only
N_TABLES = 5  # integers for each row: pivots, marks, the search's stack and its places, the pattern


class SparseLU(NamedTuple):
    """Factors of a matrix with n rows: L of unit diagonal, U by columns; rows in the order of the pivots.

    Attributes
    ----------
    lower_start, upper_start : ndarray of int64, shape (n + 1,)
        Where each column begins among the entries.
    lower_row, upper_row : ndarray of int64, shape (room,)
    lower, upper : ndarray, shape (room,), real or complex
        Entries; the diagonal of L is left out, that of U is the last of its column, as its reciprocal.
    tables : ndarray of int64, shape (N_TABLES, n)
        The pivot's place of each row, then scratch of `sparse_factor`.
    scale : ndarray, shape (n,)
        What each row is multiplied by before it is compared with others; to be set before `sparse_factor`.
    x : ndarray, shape (n,), real or complex
        Scratch.
    """

    lower_start: np.ndarray
    upper_start: np.ndarray
    lower_row: np.ndarray
    upper_row: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    tables: np.ndarray
    scale: np.ndarray
    x: np.ndarray


@jitted
def sparse_lu_size(n, room, width):
    """Length of the array that `sparse_lu` (`width` 1) or `complex_sparse_lu` (`width` 2) divides."""
    return 2 * (n + 1) + (2 + 2 * width) * room + (N_TABLES + 1 + width) * n


@jitted
def sparse_lu(n, room, work):
    """Divide `work` into the factors of a real matrix with n rows."""
    start, rows, tables, scale, rest = divide(n, room, work)
    return SparseLU(
        start[0],
        start[1],
        rows[0],
        rows[1],
        rest[:room],
        rest[room : 2 * room],
        tables,
        scale,
        rest[2 * room :],
    )


@jitted
def complex_sparse_lu(n, room, work):
    """Divide `work` into the factors of a complex matrix with n rows."""
    start, rows, tables, scale, rest = divide(n, room, work)
    values = rest.view(np.complex128)
    return SparseLU(
        start[0], start[1], rows[0], rows[1], values[:room], values[room : 2 * room], tables, scale,
        values[2 * room :],
    )  # fmt: skip


@jitted
def divide(n, room, work):
    """The parts of `work` that are the same for real and complex factors, and the rest."""
    start, rest = work[: 2 * (n + 1)].view(np.int64).reshape((2, n + 1)), work[2 * (n + 1) :]
    rows, rest = rest[: 2 * room].view(np.int64).reshape((2, room)), rest[2 * room :]
    tables, rest = rest[: N_TABLES * n].view(np.int64).reshape((N_TABLES, n)), rest[N_TABLES * n :]
    return start, rows, tables, rest[:n], rest[n:]


@jitted
def sparse_factor(start, row, values, order, lu):
    """Factor a matrix; rows become pivots by size, but the diagonal's where it is nearly as large.

    Parameters
    ----------
    start, row : ndarray of int64
        Where each column begins among the entries, and the rows of these.
    values : ndarray, real or complex
        The entries.
    order : ndarray of int64, shape (n,)
        In which columns are eliminated.
    lu : SparseLU
        Overwritten.

    Returns
    -------
    int
        RUNNING, or SINGULAR_MATRIX where a column has no pivot, or the factors have no room.
    """
    status = eliminate(start, row, values, order, LEAST_DIAGONAL, lu)
    if status == NO_ROOM:
        status = eliminate(start, row, values, order, LEAST_DIAGONAL_WITHOUT_ROOM, lu)
    return at.RUNNING if status == at.RUNNING else at.SINGULAR_MATRIX


@jitted
def eliminate(start, row, values, order, least, lu):
    """Factor with pivots on the diagonal where that is at least `least` of the largest in its column."""
    n = order.shape[0]
    place, marks, pattern = lu.tables[0], lu.tables[1], lu.tables[4]
    for i in range(n):
        place[i], marks[i] = -1, -1
        lu.x[i] = 0.0
    n_lower, n_upper = 0, 0
    for k in range(n):
        lu.lower_start[k], lu.upper_start[k] = n_lower, n_upper
        if n_lower + n > lu.lower.shape[0] or n_upper + n > lu.upper.shape[0]:
            return NO_ROOM
        column = order[k]
        top = find_pattern(start, row, column, k, lu)
        for e in range(start[column], start[column + 1]):
            lu.x[row[e]] = lu.scale[row[e]] * values[e]
        best, pivot_row = 0.0, -1
        for s in range(top, n):
            i = pattern[s]
            j = place[i]
            if j >= 0:
                above = lu.x[i]
                lu.upper_row[n_upper], lu.upper[n_upper] = j, above
                n_upper += 1
                lu.x[i] = 0.0
                for e in range(lu.lower_start[j], lu.lower_start[j + 1]):
                    lu.x[lu.lower_row[e]] -= lu.lower[e] * above
        for s in range(top, n):
            i = pattern[s]
            if place[i] < 0 and magnitude(lu.x[i]) > best:
                best, pivot_row = magnitude(lu.x[i]), i
        if pivot_row < 0 or not math.isfinite(best):
            return at.SINGULAR_MATRIX
        if place[column] < 0 and marks[column] == k and magnitude(lu.x[column]) >= least * best:
            pivot_row = column
        inverse = 1.0 / lu.x[pivot_row]
        lu.upper_row[n_upper], lu.upper[n_upper] = k, inverse
        n_upper += 1
        place[pivot_row] = k
        for s in range(top, n):
            i = pattern[s]
            if place[i] < 0:
                lu.lower_row[n_lower], lu.lower[n_lower] = i, lu.x[i] * inverse
                n_lower += 1
            lu.x[i] = 0.0
        lu.lower_start[k + 1] = n_lower
    lu.lower_start[n], lu.upper_start[n] = n_lower, n_upper
    for e in range(n_lower):
        lu.lower_row[e] = place[lu.lower_row[e]]
    return at.RUNNING


@jitted
def find_pattern(start, row, column, k, lu):
    """Write the rows that column `column`, the k-th, will have to the end of `tables[4]`; returns where they begin.

    A row that is a pivot brings those of its column of L; each stands before those that it brings.
    """
    place, marks, stack, reached, pattern = (
        lu.tables[0],
        lu.tables[1],
        lu.tables[2],
        lu.tables[3],
        lu.tables[4],
    )
    top = pattern.shape[0]
    for first in range(start[column], start[column + 1]):
        if marks[row[first]] == k:
            continue
        depth = 0
        stack[0] = row[first]
        while depth >= 0:
            i = stack[depth]
            j = place[i]
            if marks[i] != k:
                marks[i] = k
                reached[depth] = lu.lower_start[j] if j >= 0 else 0
            end = lu.lower_start[j + 1] if j >= 0 else 0
            e = reached[depth]
            while e < end and marks[lu.lower_row[e]] == k:
                e += 1
            reached[depth] = e + 1
            if e < end:
                depth += 1
                stack[depth] = lu.lower_row[e]
            else:
                depth -= 1
                top -= 1
                pattern[top] = i
    return top


@jitted
def sparse_solve(order, lu, b):
    """Solve with the factors of `sparse_factor`; the right-hand side `b`, shape (n,), becomes the solution."""
    n = order.shape[0]
    place, x = lu.tables[0], lu.x
    for i in range(n):
        x[place[i]] = lu.scale[i] * b[i]
    for k in range(n):
        value = x[k]
        for e in range(lu.lower_start[k], lu.lower_start[k + 1]):
            x[lu.lower_row[e]] -= lu.lower[e] * value
    for m in range(n):
        k = n - 1 - m
        last = lu.upper_start[k + 1] - 1
        value = x[k] * lu.upper[last]
        b[order[k]] = value
        for e in range(lu.upper_start[k], last):
            x[lu.upper_row[e]] -= lu.upper[e] * value


# What an entry of the derivative of F is taken by: positions, rates, accelerations and multipliers, the rotation vector
# of a quaternion; or the quaternion itself, which is passed on to its rotation vector.
BY_POSITION, BY_RATE, BY_UNKNOWN, BY_TURN, BY_QUATERNION = range(5)


class NewtonPattern(NamedTuple):
    """Where the entries of the sparse Newton matrix of n equations stand.

    Attributes
    ----------
    kind, row, column, slot : ndarray of int64, shape (n_entries,)
        Of each entry that the kernel `residual_jacobian_entries` writes, then of those by rotation vectors: what it is
        taken by; its equation; the number of the position (as of its rate), rate, or acceleration (then multiplier);
        its place among the matrix's entries.
    turns : ndarray of int64, shape (n_turns, 6)
        For each quaternion in each equation, whose three entries stand in this order behind those of the kernel: where
        it begins in q and its rates in v; the entries by its components, -1 where there is none.
    start, rows : ndarray of int64, shapes (n + 1,), (n_values,)
        Where each column of the matrix begins among its entries, and the rows of these.
    order : ndarray of int64, shape (n,)
        In which columns are eliminated.
    n_factor : int
        Entries of L with all pivots on the diagonal.
    room : int
        How many entries each factor may have.
    """

    kind: np.ndarray
    row: np.ndarray
    column: np.ndarray
    slot: np.ndarray
    turns: np.ndarray
    start: np.ndarray
    rows: np.ndarray
    order: np.ndarray
    n_factor: int
    room: int


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
    lu : SparseLU
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
    return sparse_factor(pattern.start, pattern.rows, values, pattern.order, lu)


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
    """Add `factor` times the derivative by `kind`, times `vector`, to `out`, shape (n,)."""
    n = vector.shape[0]
    for e in range(pattern.kind.shape[0]):
        if pattern.kind[e] == kind and pattern.column[e] < n:
            out[pattern.row[e]] += factor * entries[e] * vector[pattern.column[e]]


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
    sparse_solve(pattern.order, lu, right)
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
    order, n_factor = _elimination(start, rows, n, nv)
    return NewtonPattern(
        *(np.ascontiguousarray(x, dtype=np.int64) for x in (kind, row, column, slot[: len(kind)], turns)),
        np.ascontiguousarray(start, dtype=np.int64),
        np.ascontiguousarray(rows, dtype=np.int64),
        order,
        n_factor,
        _ROOM * n_factor + n,
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


def _elimination(start: np.ndarray, rows: np.ndarray, n: int, nv: int) -> tuple[np.ndarray, int]:
    """An order of small degree on the graph of A + Aᵀ, and the entries of L with pivots on the diagonal.

    SuperLU finds both where the diagonal is dominant (Liu, ACM TOMS 11 (1985) 141; Li, ACM TOMS 31 (2005) 302).
    """
    from scipy.sparse import csc_matrix, identity

    pattern: csc_matrix = csc_matrix((np.ones(len(rows)), rows, start), shape=(n, n))
    dominant = (pattern + pattern.T + _DOMINANT * n * identity(n)).tocsc()
    by_degree = np.argsort(_factors(dominant, "MMD_AT_PLUS_A").perm_c)
    order = np.argsort(_after_their_coordinates(pattern, np.argsort(by_degree), nv), kind="stable")
    n_factor = _factors(dominant[order][:, order].tocsc(), "NATURAL").L.nnz
    return order.astype(np.int64), int(n_factor)


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
