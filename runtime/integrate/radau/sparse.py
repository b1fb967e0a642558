"""The accelerations of all coordinates as equations of the Radau methods for large models, with sparse matrices."""

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.newton_lu import (
    NewtonLU,
    complex_newton_lu,
    newton_lu,
    newton_lu_size,
    solve_newton,
)
from symgen.runtime.integrate.radau.coefficients import RadauIIA
from symgen.runtime.integrate.radau.coupled import never_coupled
from symgen.runtime.integrate.radau.error import filter_accelerations, keep_axes, n_places_of_stages
from symgen.runtime.integrate.radau.newton import Equations
from symgen.runtime.integrate.radau.rows import apply_corrections_to_rows, predict_rows, set_defects_of_rows
from symgen.runtime.integrate.radau.stages import (
    commit_accelerations,
    correct_stages,
    evaluate_stage,
    predict_stages,
    reach_end_by_accelerations,
)
from symgen.runtime.integrate.radau.work import DX, ERROR, N_NUMBERS, shift_of
from symgen.runtime.integrate.sparse import (
    BY_POSITION,
    BY_TURN,
    BY_UNKNOWN,
    clear,
    differentiate_sparse,
    factor_shifted,
    multiply,
    solve_shifted,
)

# Factors of a sparse matrix cost as much as one to three iterations of Newton: where it contracts more slowly, some
# iterations more cost less than factors of each step.
_KEEP_JACOBIAN_RATE = 0.1


class SparseRadauWork(NamedTuple):
    """Work arrays of a Radau method with s = 2 k + 1 stages, for n equations; most are those of `RadauWork`.

    Attributes
    ----------
    numbers, states, rows, real_vectors, complex_vectors, pairs, rotation_rates, scratch : ndarray
        See `RadauWork`.
    arguments : ndarray, shape (nq + 2 nv + m,)
        (q, v, a, λ).
    entries : ndarray, shape (n_entries,)
        The derivative of the equations, see `NewtonPattern`.
    values, complex_values : ndarray, shape (n_values,)
        The entries of a Newton matrix.
    right, complex_right : ndarray, shape (n,)
        Right-hand sides.
    real : NewtonLU
    complex : ndarray, shape (k, newton_lu_size(pattern, nv, 2))
        What `complex_newton_lu` divides, for each ν.
    """

    numbers: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    real_vectors: np.ndarray
    complex_vectors: np.ndarray
    pairs: np.ndarray
    rotation_rates: np.ndarray
    arguments: np.ndarray
    entries: np.ndarray
    values: np.ndarray
    complex_values: np.ndarray
    right: np.ndarray
    complex_right: np.ndarray
    real: NewtonLU
    complex: np.ndarray
    scratch: np.ndarray


@jitted
def sparse_radau_work_size(method, sizes):
    """Length of `work` for `advance_radau_sparse`."""
    s, k, pattern = len(method.c), len(method.c) // 2, method.pattern
    nv, ny, n = sizes[at.NV], sizes[at.NY], sizes[at.NV] + sizes[at.NM]
    own = N_NUMBERS + (s + 2) * ny + (s + 1) * sizes[at.N_ROW] + (8 + 8 * k) * nv + 3 * s
    own += sizes[at.NQ] + nv + n + pattern.kind.shape[0] + 3 * pattern.rows.shape[0] + 3 * n
    factors = newton_lu_size(pattern, nv, 1) + k * newton_lu_size(pattern, nv, 2)
    return own + factors + finish_scratch_size(sizes)


@jitted
def sparse_radau_work(method, sizes, work):
    """Divide `work`, of length `sparse_radau_work_size(method, sizes)`, into a `SparseRadauWork`."""
    s, k, pattern = len(method.c), len(method.c) // 2, method.pattern
    nv, ny, n_row, n = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW], sizes[at.NV] + sizes[at.NM]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    states, rest = rest[: (s + 2) * ny].reshape((s + 2, ny)), rest[(s + 2) * ny :]
    rows, rest = rest[: (s + 1) * n_row].reshape((s + 1, n_row)), rest[(s + 1) * n_row :]
    real_vectors, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    size = 8 * k * nv
    complex_vectors, rest = rest[:size].view(np.complex128).reshape((2 * k, 2 * nv)), rest[size:]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    rotation_rates, rest = rest[: 3 * s].reshape((s, 3)), rest[3 * s :]
    size = sizes[at.NQ] + nv + n
    arguments, rest = rest[:size], rest[size:]
    size = pattern.kind.shape[0]
    entries, rest = rest[:size], rest[size:]
    size = pattern.rows.shape[0]
    values, rest = rest[:size], rest[size:]
    complex_values, rest = rest[: 2 * size].view(np.complex128), rest[2 * size :]
    right, rest = rest[:n], rest[n:]
    complex_right, rest = rest[: 2 * n].view(np.complex128), rest[2 * n :]
    size = newton_lu_size(pattern, nv, 1)
    real, rest = newton_lu(pattern, nv, rest[:size], method.spare), rest[size:]
    size = newton_lu_size(pattern, nv, 2)
    complex_, rest = rest[: k * size].reshape((k, size)), rest[k * size :]
    return SparseRadauWork(
        numbers, states, rows, real_vectors, complex_vectors, pairs, rotation_rates, arguments, entries, values,
        complex_values, right, complex_right, real, complex_, rest,
    )  # fmt: skip


@jitted
def pair_factors(method, k, w):
    """The factors for ν of pair `k`."""
    return complex_newton_lu(method.pattern, w.pairs.shape[1] // 2, k, w.complex[k], method.spare)


# Besides `RadauIIA`: the pattern of a model's Newton matrices (`NewtonPattern`), and what `new_spare` returns.
SparseRadauIIA = namedtuple("SparseRadauIIA", (*RadauIIA._fields, "pattern", "spare"))


@jitted
def differentiate_entries(method, loop, t, w):
    """Take the entries of the equations' derivatives; returns a status."""
    return differentiate_sparse(method.pattern, loop, t, loop.f, w.arguments, w.entries)


@jitted
def factor_sparse(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status."""
    pattern = method.pattern
    status = factor_shifted(pattern, method.mu / h, loop.sizes, loop.y, w.entries, w.values, w.real)
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            g, lu = shift_of(method, k, 1.0 / h), pair_factors(method, k, w)
            status = factor_shifted(pattern, g, loop.sizes, loop.y, w.entries, w.complex_values, lu)
    return status


@jitted
def predict_sparse(method, h, extrapolate, loop, t, w):
    """Start Newton from the last step's collocation polynomial, or from zero increments of v; returns True."""
    if loop.sizes[at.NQ] != loop.sizes[at.NV]:
        return predict_stages(method, h, extrapolate, loop, t, w)
    predict_rows(method, h, extrapolate, loop, w)
    return True


@jitted
def improve_sparse(method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances."""
    if loop.sizes[at.NQ] != loop.sizes[at.NV]:
        return correct_stages(solve_sparse, method, h, loop, t, w)
    for s in range(len(method.c)):
        if not evaluate_stage(s, method, h, loop, t, w):
            return at.NOT_FINITE, 0.0
    set_defects_of_rows(method, h, loop.sizes, w)
    solve_sparse(method, h, loop, w)
    total = apply_corrections_to_rows(method, h, loop.sizes, loop.y, w)
    return at.RUNNING, math.sqrt(total / (2 * loop.sizes[at.NV] * len(method.c)))


@jitted
def solve_sparse(method, h, loop, w):
    """Solve for the corrections of the transformed rates, from the defects."""
    nv, n_pairs, pattern, vector = loop.sizes[at.NV], len(method.c) // 2, method.pattern, w.real_vectors[DX]
    solve_shifted(pattern, w.entries, vector[:nv], vector[nv:], w.right, w.real)
    for k in range(n_pairs):
        pair = w.complex_vectors[n_pairs + k]
        solve_shifted(pattern, w.entries, pair[:nv], pair[nv:], w.complex_right, pair_factors(method, k, w))


@jitted
def filter_sparse(method, h, loop, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]` and return its norm."""
    return filter_accelerations(solve_error_sparse, method, h, loop, row, again, w)


@jitted
def solve_error_sparse(method, w):
    """Filter the rates' part of the error, given that of the positions.

    A e of the full method is -[F_a F_λ]⁻¹ F_q e, which needs no inverse on this side of the system.
    """
    pattern, nv = method.pattern, w.pairs.shape[1] // 2
    positions, rates = w.pairs[ERROR, :nv], w.pairs[ERROR, nv:]
    clear(w.right)
    multiply(pattern, BY_UNKNOWN, 1.0, w.entries, rates, w.right)
    multiply(pattern, BY_POSITION, -1.0, w.entries, positions, w.right)
    multiply(pattern, BY_TURN, -1.0, w.entries, positions, w.right)
    solve_newton(pattern, w.real, w.right)
    for i in range(nv):
        rates[i] = w.right[i]


@jitted
def keep_rate_of_sparse():
    """Return how fast Newton must contract for a sparse Jacobian to be kept."""
    return _KEEP_JACOBIAN_RATE


SPARSE = Equations(
    differentiate_entries, factor_sparse, predict_sparse, improve_sparse, filter_sparse, keep_axes, never_coupled,
    keep_rate_of_sparse, n_places_of_stages, reach_end_by_accelerations, commit_accelerations,
)  # fmt: skip
