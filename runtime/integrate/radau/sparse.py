"""The accelerations of all coordinates as equations of the Radau methods for large models, with sparse matrices."""

from collections import namedtuple

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.radau.coefficients import RadauIIA
from symgen.runtime.integrate.radau.error import filter_accelerations, keep_axes, n_places_of_stages
from symgen.runtime.integrate.radau.newton import Equations
from symgen.runtime.integrate.radau.sparse_work import pair_factors
from symgen.runtime.integrate.radau.stages import (
    commit_accelerations,
    correct_stages,
    predict_stages,
    reach_end_by_accelerations,
)
from symgen.runtime.integrate.radau.transform import shift_of
from symgen.runtime.integrate.radau.work import DX, ERROR
from symgen.runtime.integrate.sparse_lu import sparse_solve
from symgen.runtime.integrate.sparse_newton import (
    BY_POSITION,
    BY_TURN,
    BY_UNKNOWN,
    clear,
    differentiate_sparse,
    factor_shifted,
    multiply,
    solve_shifted,
)

# Besides `RadauIIA`: the pattern of a model's Newton matrices (`NewtonPattern`).
SparseRadauIIA = namedtuple("SparseRadauIIA", (*RadauIIA._fields, "pattern"))


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
def improve_sparse(method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances."""
    return correct_stages(solve_sparse, method, h, loop, t, w)


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
    sparse_solve(pattern.order, w.real, w.right)
    for i in range(nv):
        rates[i] = w.right[i]


SPARSE = Equations(
    differentiate_entries, factor_sparse, predict_stages, improve_sparse, filter_sparse, keep_axes,
    n_places_of_stages, reach_end_by_accelerations, commit_accelerations,
)  # fmt: skip
