"""Derivatives of accelerations by positions and rates, from the derivatives of the equations of motion."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import lu_factor, lu_solve_matrix, pivot_ratio, solve_rank_deficient
from symgen.runtime.integrate.quaternions import by_rotation, n_quaternions, quaternion_at

# Below this the ordinary factors are not trusted, and elimination with complete pivoting decides on the rank.
TRUSTED_PIVOT_RATIO = 1e-9


class JacobianWork(NamedTuple):
    """Work arrays of `acceleration_jacobian`, with k = nv + m equations of motion and constraints.

    Attributes
    ----------
    arguments : ndarray, shape (nq + 2 nv + m,)
        (q, v, a, λ).
    derivative : ndarray, shape (k (nq + nv + k),)
        What the kernel `residual_jacobian` writes.
    block : ndarray, shape (k, k)
        Derivative by (a, λ).
    right : ndarray, shape (k, 2 nv)
        Minus the derivative by (q, v), that by a quaternion taken by its rotation vector.
    pivots : ndarray of int64, shape (k,)
    scale : ndarray, shape (k,)
    """

    arguments: np.ndarray
    derivative: np.ndarray
    block: np.ndarray
    right: np.ndarray
    pivots: np.ndarray
    scale: np.ndarray


@jitted
def jacobian_work_size(sizes):
    """Length of the array that `jacobian_work` divides."""
    n_state, n_equations = sizes[at.NQ] + sizes[at.NV], sizes[at.NV] + sizes[at.NM]
    return n_state + n_equations + 2 * n_equations * (n_state + n_equations) + 2 * n_equations


@jitted
def jacobian_work(sizes, work):
    """Divide `work`, of length `jacobian_work_size(sizes)`, into a `JacobianWork`."""
    n_state, n = sizes[at.NQ] + sizes[at.NV], sizes[at.NV] + sizes[at.NM]
    n_columns = n_state + n
    arguments, rest = work[:n_columns], work[n_columns:]
    derivative, rest = rest[: n * n_columns], rest[n * n_columns :]
    block, rest = rest[: n * n].reshape((n, n)), rest[n * n :]
    n_right = 2 * sizes[at.NV]
    right, rest = rest[: n * n_right].reshape((n, n_right)), rest[n * n_right :]
    return JacobianWork(arguments, derivative, block, right, rest[:n].view(np.int64), rest[n : 2 * n])


@jitted
def acceleration_jacobian(loop, t, y, row, work, out):
    """Differentiate a(t, q, v) by implicit differentiation of the equations F(q, v, a, λ) = 0.

    By positions means: by what moves them, as rates do. That is q itself, or the rotation vector in body axes that
    turns a quaternion.

    [F_a F_λ] ∂(a, λ)/∂(q, v) = -[F_q F_v], of which the rows of `a` are kept; so M is never inverted
    by itself, and coordinates without mass are welcome where constraints determine their accelerations. Where
    constraints are redundant, those that depend on others are left out.

    Parameters
    ----------
    t : float [s]
    y : ndarray, shape (NY,)
    row : ndarray, shape (N_ROW,)
        The rhs row at (t, y): accelerations and multipliers are read from it.
    work : ndarray, shape (jacobian_work_size(sizes),)
    out : ndarray, shape (nv, 2 nv)
        Overwritten by [∂a/∂q, ∂a/∂v].

    Returns
    -------
    int
        RUNNING, NOT_FINITE, or SINGULAR_MATRIX where accelerations are not determined.
    """
    nv = loop.sizes[at.NV]
    w = jacobian_work(loop.sizes, work)
    derive_equations(loop, t, y, row, w)
    if lu_factor(w.block, w.pivots) == at.RUNNING and pivot_ratio(w.block) > TRUSTED_PIVOT_RATIO:
        lu_solve_matrix(w.block, w.pivots, w.right)
    else:
        unpack(loop.sizes, w)
        status = solve_rank_deficient(w.block, w.right, nv, w.pivots, w.scale)
        if status != at.RUNNING:
            return status
    total = 0.0
    for i in range(nv):
        for j in range(2 * nv):
            out[i, j] = w.right[i, j]
            total += 0.0 * out[i, j]
    return at.RUNNING if math.isfinite(total) else at.NOT_FINITE


@jitted
def derive_equations(loop, t, y, row, w):
    """Set `w.block` and `w.right` at (t, y), with the accelerations and multipliers of the rhs row `row`."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    n_state = nq + nv
    for i in range(n_state):
        w.arguments[i] = y[i]
    for i in range(nv):
        w.arguments[n_state + i] = row[nq + i]
    for i in range(m):
        w.arguments[n_state + nv + i] = row[n_state + loop.sizes[at.NW] + i]
    differentiate(loop, t, w)
    loop.counters[at.JACOBIANS] += 1


@jitted
def differentiate(loop, t, w):
    """Call the kernel at `w.arguments` and lay its result out as `block` and `right`."""
    for i in range(w.derivative.shape[0]):
        w.derivative[i] = 0.0
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t, w.arguments, loop.p, w.derivative)
    unpack(loop.sizes, w)


@jitted
def unpack(sizes, w):
    """Copy the kernel's result to `block`, and to `right` with its sign changed."""
    n, n_state = w.block.shape[0], sizes[at.NQ] + sizes[at.NV]
    n_columns = n_state + n
    for i in range(n):
        row = w.derivative[i * n_columns : (i + 1) * n_columns]
        by_positions(sizes, w.arguments, row, w.right[i])
        for j in range(sizes[at.NV]):
            w.right[i, sizes[at.NV] + j] = -row[sizes[at.NQ] + j]
        for j in range(n):
            w.block[i, j] = row[n_state + j]


@jitted
def by_positions(sizes, q, row, out):
    """Write minus the derivatives by positions, of which `row` holds those by q, to `out[:nv]`."""
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            out[i - k] = -row[i]
        if end < sizes[at.NQ]:
            x, y, z = by_rotation(q, end, row[end], row[end + 1], row[end + 2], row[end + 3])
            out[end - k], out[end - k + 1], out[end - k + 2] = -x, -y, -z
        start = end + 4
