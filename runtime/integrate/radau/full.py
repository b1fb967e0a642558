"""The accelerations of all coordinates as equations of the Radau methods, with full matrices of the size of v."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.error import filter_accelerations, keep_axes, n_places_of_stages
from symgen.runtime.integrate.radau.newton import Equations
from symgen.runtime.integrate.radau.stages import (
    commit_accelerations,
    correct_stages,
    factor_rotations,
    predict_stages,
    reach_end_by_accelerations,
)
from symgen.runtime.integrate.radau.work import DX, ERROR, shift_of


@jitted
def differentiate_full(method, loop, t, w):
    """Take the derivatives of the accelerations; returns a status."""
    return acceleration_jacobian(loop, t, loop.y, loop.f, w.implicit, w.jacobian)


@jitted
def factor_full(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status.

    With J = [0 I; A B], (g - J) (Δq, Δv) = (0, r) is Δq = Δv / g and (g - B - A/g) Δv = r: as q' = v is
    linear, the stages satisfy it exactly, and its residual is zero. For the rotation vector of a quaternion, 1/g
    becomes the inverse of g + ω× / 2 (`solve_rotation`), and its equation has a residual.
    """
    set_matrix(method.mu / h, loop.sizes, loop.y, w.jacobian, w.real)
    status = lu_factor(w.real, w.pivots[0])
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            set_matrix(shift_of(method, k, 1.0 / h), loop.sizes, loop.y, w.jacobian, w.complex[k])
            status = lu_factor(w.complex[k], w.pivots[k + 1])
    return status


@jitted
def set_matrix(g, sizes, y, jacobian, matrix):
    """Write the Newton matrix for the real or complex shift `g`."""
    nv = matrix.shape[0]
    inverse = 1.0 / g
    for i in range(nv):
        for j in range(nv):
            matrix[i, j] = -jacobian[i, nv + j] - inverse * jacobian[i, j]
        matrix[i, i] += g
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        factor_rotations(g, j, y, sizes[at.NQ] + j, jacobian, matrix)


@jitted
def improve_full(method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances."""
    return correct_stages(solve_full, method, h, loop, t, w)


@jitted
def solve_full(method, h, loop, w):
    """Solve for the corrections of the transformed rates, from the defects."""
    nv, n_pairs = loop.sizes[at.NV], len(method.c) // 2
    for k in range(n_quaternions(loop.sizes)):
        column = quaternion_at(loop.sizes, k) - k
        pass_on(column, loop.sizes, w.jacobian, w.real_vectors[DX])
        for pair in range(n_pairs):
            pass_on(column, loop.sizes, w.jacobian, w.complex_vectors[n_pairs + pair])
    lu_solve(w.real, w.pivots[0], w.real_vectors[DX, nv:])
    for k in range(n_pairs):
        lu_solve(w.complex[k], w.pivots[k + 1], w.complex_vectors[n_pairs + k, nv:])


@jitted
def pass_on(column, sizes, jacobian, vector):
    """Add what the three entries of `vector` from `column` on, of a rotation vector, change the accelerations.

    With J = [K I; A B], (g - J) (Δθ, Δv) = (r, s) becomes Δθ = (g - K)⁻¹ (Δv + r) and (g - B - A (g - K)⁻¹) Δv =
    s + A (g - K)⁻¹ r.
    """
    nv = sizes[at.NV]
    for j in range(nv):
        for axis in range(3):
            vector[nv + j] += jacobian[j, column + axis] * vector[column + axis]


@jitted
def filter_full(method, h, loop, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]` and return its norm."""
    return filter_accelerations(solve_error_full, method, h, loop, row, again, w)


@jitted
def solve_error_full(method, w):
    """Filter the rates' part of the error, given that of the positions."""
    nv = w.jacobian.shape[0]
    for i in range(nv):
        by_v = w.pairs[ERROR, nv + i]
        for k in range(nv):
            by_v += w.jacobian[i, k] * w.pairs[ERROR, k]
        w.pairs[ERROR, nv + i] = by_v
    lu_solve(w.real, w.pivots[0], w.pairs[ERROR, nv:])


FULL = Equations(
    differentiate_full, factor_full, predict_stages, improve_full, filter_full, keep_axes,
    n_places_of_stages, reach_end_by_accelerations, commit_accelerations,
)  # fmt: skip
