"""Newton systems of large models without full matrices: accelerations and multipliers are unknowns beside the rates.

With the equations F(q, v, a, λ) = 0 and a shift g, full methods solve (g - B - A/g) Δv = r, where [A B] are the rows of
a in -[F_a F_λ]⁻¹ [F_q F_v]. With μ for the change of λ/g, that is

    (g F_a + F_v + F_q/g) Δv + g F_λ μ = F_a r,

which is as sparse as the model. For the rotation vector θ of a quaternion, 1/g becomes (g - K)⁻¹ with Kθ = θ×ω/2, and a
defect s of θ' adds -F_θ (g - K)⁻¹ s on the right.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import magnitude
from symgen.runtime.integrate.quaternions import by_rotation, solve_rotation
from symgen.runtime.integrate.sparse_lu import sparse_factor, sparse_solve

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
