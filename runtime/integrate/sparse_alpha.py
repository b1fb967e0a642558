"""The generalised-α method of index 3 for large models, with sparse matrices."""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.constrained_alpha import (
    HAVE_START,
    N_NUMBERS,
    N_VECTORS,
    NEW_ACCELERATION,
    NEW_AVERAGE,
    RATE,
    StepEquations,
    constrained_alpha_step,
    leverage,
)
from symgen.runtime.integrate.generalized_alpha import ConstrainedAlpha
from symgen.runtime.integrate.loop import evaluate, take_steps
from symgen.runtime.integrate.newton_lu import (
    NewtonLU,
    factor_newton,
    newton_lu,
    newton_lu_size,
    solve_newton,
)
from symgen.runtime.integrate.sparse import (
    BY_POSITION,
    BY_UNKNOWN,
    clear,
    differentiate_sparse,
    scale_constraints,
)

# Besides `ConstrainedAlpha`: the pattern of a model's Newton matrices (`NewtonPattern`).
SparseAlpha = namedtuple("SparseAlpha", (*ConstrainedAlpha._fields, "pattern", "spare"))


class SparseAlphaWork(NamedTuple):
    """Work arrays of `advance_sparse_alpha`, for n = nv + m unknowns; most are those of `ConstrainedAlphaWork`.

    Attributes
    ----------
    numbers, vectors, multipliers, stabiliser, gradient, arguments, residual, drift, right, y_new, row : ndarray
        See `ConstrainedAlphaWork`, as of `scratch`; `gradient` has no entries, as nothing is stabilised.
    entries : ndarray, shape (n_entries,)
        The derivative of the equations, see `NewtonPattern`.
    turn : ndarray, shape (n_entries,)
        Another: its entries by positions, in velocity constraints, are those of ∂(G v)/∂q.
    values : ndarray, shape (n_values,)
        The entries of a matrix.
    lu : NewtonLU
    """

    numbers: np.ndarray
    vectors: np.ndarray
    multipliers: np.ndarray
    stabiliser: np.ndarray
    gradient: np.ndarray
    arguments: np.ndarray
    residual: np.ndarray
    drift: np.ndarray
    right: np.ndarray
    y_new: np.ndarray
    row: np.ndarray
    entries: np.ndarray
    turn: np.ndarray
    values: np.ndarray
    lu: NewtonLU
    scratch: np.ndarray


@jitted
def sparse_alpha_work_size(method, sizes):
    """Length of `work` for `advance_sparse_alpha`."""
    nv, nh, m, pattern = sizes[at.NV], sizes[at.NH], sizes[at.NM], method.pattern
    own = N_NUMBERS + N_VECTORS * nv + 2 * m + nh + sizes[at.NQ] + 2 * nv + m + nv + m + nh + m + nv + m
    own += sizes[at.NY] + sizes[at.N_ROW] + 2 * pattern.kind.shape[0] + pattern.rows.shape[0]
    return own + newton_lu_size(pattern, nv, 1) + finish_scratch_size(sizes)


@jitted
def sparse_alpha_work(method, sizes, work):
    """Divide `work`, of length `sparse_alpha_work_size(method, sizes)`, into a `SparseAlphaWork`."""
    nv, nh, m, pattern = sizes[at.NV], sizes[at.NH], sizes[at.NM], method.pattern
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    vectors, rest = rest[: N_VECTORS * nv].reshape((N_VECTORS, nv)), rest[N_VECTORS * nv :]
    multipliers, rest = rest[: 2 * m].reshape((2, m)), rest[2 * m :]
    stabiliser, gradient, rest = rest[:nh], rest[:0], rest[nh:]
    size = sizes[at.NQ] + 2 * nv + m
    arguments, rest = rest[:size], rest[size:]
    residual, rest = rest[: nv + m], rest[nv + m :]
    drift, rest = rest[: nh + m], rest[nh + m :]
    right, rest = rest[: nv + m].reshape((nv + m, 1)), rest[nv + m :]
    y_new, rest = rest[: sizes[at.NY]], rest[sizes[at.NY] :]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    size = pattern.kind.shape[0]
    entries, rest = rest[:size], rest[size:]
    turn, rest = rest[:size], rest[size:]
    size = pattern.rows.shape[0]
    values, rest = rest[:size], rest[size:]
    size = newton_lu_size(pattern, nv, 1)
    lu, rest = newton_lu(pattern, nv, rest[:size], method.spare), rest[size:]
    return SparseAlphaWork(
        numbers, vectors, multipliers, stabiliser, gradient, arguments, residual, drift, right, y_new, row, entries,
        turn, values, lu, rest,
    )  # fmt: skip


@jitted
def factor_end_sparse(method, h, loop, t1, w):
    """Factor the derivative of what the step's equations leave by (a, λ); returns a status."""
    pattern, nv, nh = method.pattern, loop.sizes[at.NV], loop.sizes[at.NH]
    by_q, by_v = leverage(method, h)
    if loop.sizes[at.NM] > nh:
        turn_of_constraints(loop, t1, w)
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.entries)
    loop.counters[at.JACOBIANS] += 1
    clear(w.values)
    for e in range(pattern.kind.shape[0]):
        kind, row = pattern.kind[e], pattern.row[e]
        if kind == BY_UNKNOWN:
            w.values[pattern.slot[e]] += w.entries[e]
        elif row < nv:
            leverage_here = by_q if kind == BY_POSITION else by_v
            w.values[pattern.slot[e]] += leverage_here * w.entries[e]
        elif row >= nv + nh and kind == BY_POSITION:
            w.values[pattern.slot[e]] += by_q / by_v * w.turn[e]
    return factor_values(method, loop, w)


@jitted
def turn_of_constraints(loop, t1, w):
    """Write ∂(G v)/∂q to `w.turn`: what ∂(G a - γ)/∂q, linear in a, gains from a + v in place of a."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    for i in range(nv):
        w.arguments[nq + nv + i] = w.vectors[NEW_ACCELERATION, i] + w.arguments[nq + i]
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.turn)
    for i in range(nv):
        w.arguments[nq + nv + i] = w.vectors[NEW_ACCELERATION, i]
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.entries)
    for e in range(w.turn.shape[0]):
        w.turn[e] -= w.entries[e]
    loop.counters[at.JACOBIANS] += 2


@jitted
def factor_values(method, loop, w):
    """Factor the matrix with the entries `w.values`; returns a status."""
    loop.counters[at.FACTORISATIONS] += 1
    scale_constraints(method.pattern, loop.sizes[at.NV], w.values, w.lu)
    return factor_newton(method.pattern, loop.sizes[at.NV], w.values, w.lu)


@jitted
def solve_sparse(method, loop, w):
    """Replace `w.right` by the solution; returns RUNNING."""
    solve_newton(method.pattern, w.lu, w.right[:, 0])
    return at.RUNNING


@jitted
def lean_rates_sparse(method, amount, loop, t, w):
    """Add `amount` times NEW_AVERAGE, the part across the holonomic constraints, to the rates; returns a status."""
    pattern, nv, nh = method.pattern, loop.sizes[at.NV], loop.sizes[at.NH]
    status = differentiate_sparse(pattern, loop, t, loop.f, w.arguments, w.entries)
    if status != at.RUNNING:
        return status
    clear(w.values)
    for i in range(w.right.shape[0]):
        w.right[i, 0] = 0.0
    for e in range(pattern.kind.shape[0]):
        if pattern.kind[e] == BY_UNKNOWN:
            row, column = pattern.row[e], pattern.column[e]
            w.values[pattern.slot[e]] += w.entries[e]
            if nv <= row < nv + nh and column < nv:
                w.right[row, 0] += w.entries[e] * w.vectors[NEW_AVERAGE, column]
    status = factor_values(method, loop, w)
    if status != at.RUNNING:
        return status
    solve_newton(pattern, w.lu, w.right[:, 0])
    for i in range(nv):
        w.vectors[RATE, i] += amount * w.right[i, 0]
    return at.RUNNING


SPARSE = StepEquations(factor_end_sparse, solve_sparse, lean_rates_sparse)


@jitted
def advance_sparse_alpha(method, loop):
    """Advance with the index-3 form of a `SparseAlpha` method; see `advance_constrained_alpha`."""
    w = sparse_alpha_work(method, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID], loop.counters[HAVE_START] = 1, 0
    return take_steps(sparse_step, method, loop, w)


@jitted
def sparse_step(method, loop, w):
    """Take one step with sparse matrices and record it; returns a status."""
    return constrained_alpha_step(SPARSE, method, loop, w)
