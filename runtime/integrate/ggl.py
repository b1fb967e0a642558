"""Newton's systems of index-2 equations with the constraints' positions (Gear, Gupta, Leimkuhler), of size nv + m.

Gear, Leimkuhler, Gupta, J. Comput. Appl. Math. 12-13 (1985) 77, add the constraints to those of the velocities, and a
multiplier μ that vanishes in the solution:

    q' = v + C μ,   M v' = f + Gᵀλ,   G v + Φ_t = 0 and the velocity constraints,   Φ = 0.

L is what stands for Gᵀ in the derivative of these forces by λ: that, less friction in proportion to reactions.
C = M⁻¹L (G M⁻¹L)⁻¹, holonomic columns, is that of the state at which the Jacobian was taken: as μ is zero, any C
with G C = 1 does. The stages of a method, or a step of backward differences, lead to g q and g v in place of q' and v',
with a real or complex shift g = const/h. With the residuals r of all equations but the first, which stays satisfied,

    g Δq - Δv - C Δμ = 0,   (g M + D) Δv + K Δq - L Δλ = -r₂,   G Δv + H Δq = -r₃,   G Δq = -r₄.

For Δu = g Δq, M C = L Λ and Δλ + g Λ Δμ as unknowns nothing else is left: Δμ = r₃ - g r₄ + H Δu / g.

The rotation vector of a quaternion turns with its rate ω, so the first equation has g Δq + ω×Δq/2. With W = ω×/2 this
is the same system, of D + M W, K + D W and H + G W in place of D, K and H, and Δv gains W Δu / g.

Where constraints depend on each other, as many as do are left idle: their multipliers stay what they are. So are stops
that are open and frictions that do not stick.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import TRUSTED_PIVOT_RATIO, derive_equations, jacobian_work
from symgen.runtime.integrate.linear import lu_factor, lu_solve, pivot_ratio
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.row_rank import independent_rows


@jitted
def leave_open(sizes, b, w):
    """Take constraints that are switched off (λ = 0 instead) off the derivatives; returns how many there are."""
    nv, n_off = sizes[at.NV], 0
    for k in range(sizes[at.NM]):
        if w.block[nv + k, nv + k] != 0.0:
            n_off += 1
            b.idle[k] = 1.0
            for j in range(nv):
                b.gradients[k, j] = b.rotated_gradients[k, j] = b.reactions[j, k] = 0.0
    return n_off


@jitted
def leave_idle(sizes, b, w):
    """Take constraints that depend on others off the derivatives and `w.block`; returns how many there are."""
    nv, m, nh = sizes[at.NV], sizes[at.NM], sizes[at.NH]
    scaled = w.right[:m, :nv]
    scale_gradients(sizes, b, scaled)
    rows, columns = w.pivots[:m], w.pivots[m:]
    _, rank, _ = independent_rows(nh, scaled, rows, columns)
    for r in range(rank, m):
        b.idle[rows[r]] = 1.0
    for i in range(nv + m):
        for j in range(nv + m):
            w.block[i, j] = 0.0
    for k in range(m):
        if b.idle[k] == 1.0:
            w.block[nv + k, nv + k] = 1.0
            for j in range(nv):
                b.gradients[k, j] = b.rotated_gradients[k, j] = b.reactions[j, k] = 0.0
    for i in range(nv):
        for j in range(nv):
            w.block[i, j] = b.mass[i, j]
        for k in range(m):
            w.block[i, nv + k] = b.reactions[i, k]
            w.block[nv + k, i] = b.gradients[k, i]
    return m - rank


@jitted
def scale_gradients(sizes, b, scaled):
    """Write G with columns in units of equal kinetic energy, rows in units of their largest entry."""
    nv, heaviest = sizes[at.NV], 0.0
    for j in range(nv):
        heaviest = max(heaviest, b.mass[j, j])
    for k in range(sizes[at.NM]):
        largest = 0.0
        for j in range(nv):
            inertia = max(b.mass[j, j], 1e-6 * heaviest)
            scaled[k, j] = b.gradients[k, j] / math.sqrt(inertia) if inertia > 0.0 else b.gradients[k, j]
            largest = max(largest, abs(scaled[k, j]))
        for j in range(nv):
            scaled[k, j] /= largest if largest > 0.0 else 1.0


class Blocks(NamedTuple):
    """Derivatives of the equations, of which every shift makes its matrix.

    Attributes
    ----------
    mass : ndarray, shape (nv, nv)
        M.
    by_rates : ndarray, shape (nv, nv)
        D + M W; D is the derivative of M a - f - Gᵀλ by v.
    by_positions : ndarray, shape (nv, nv)
        K + D W - D C (H + G W): K is its derivative by q; what μ changes there is taken off.
    gradients : ndarray, shape (m, nv)
        G, without the rows of idle constraints.
    reactions : ndarray, shape (nv, m)
        -L, without the columns of idle constraints.
    rotated_gradients : ndarray, shape (m, nv)
        H + G W, likewise; H is the derivative of the velocities' residuals by q. The sum is half the derivative of
        their time derivative by v. For velocity constraints this is an estimate, which costs iterations, not accuracy.
    steer, damped : ndarray, shape (nv, nh)
        C and D C.
    lift : ndarray, shape (m, nh)
        Λ.
    spin : ndarray, shape (nv,)
        The rates v, of which those of quaternions make W.
    idle : ndarray, shape (m + 1,)
        1 for idle constraints, 0 for others; behind them one more than the largest rank so far.
    """

    mass: np.ndarray
    by_rates: np.ndarray
    by_positions: np.ndarray
    gradients: np.ndarray
    reactions: np.ndarray
    rotated_gradients: np.ndarray
    steer: np.ndarray
    damped: np.ndarray
    lift: np.ndarray
    spin: np.ndarray
    idle: np.ndarray


@jitted
def blocks_size(sizes):
    """Length of the array that `divide_blocks` divides."""
    nv, m, nh = sizes[at.NV], sizes[at.NM], sizes[at.NH]
    return 3 * nv * nv + 3 * m * nv + 2 * nv * nh + m * nh + nv + m + 1


@jitted
def divide_blocks(sizes, work):
    """Divide `work`, of length `blocks_size(sizes)`, into `Blocks`."""
    nv, m, nh = sizes[at.NV], sizes[at.NM], sizes[at.NH]
    squares, rest = work[: 3 * nv * nv].reshape((3, nv, nv)), work[3 * nv * nv :]
    rows, rest = rest[: 2 * m * nv].reshape((2, m, nv)), rest[2 * m * nv :]
    reactions, rest = rest[: nv * m].reshape((nv, m)), rest[nv * m :]
    columns, rest = rest[: 2 * nv * nh].reshape((2, nv, nh)), rest[2 * nv * nh :]
    lift, rest = rest[: m * nh].reshape((m, nh)), rest[m * nh :]
    return Blocks(
        squares[0], squares[1], squares[2], rows[0], reactions, rows[1], columns[0], columns[1], lift, rest[:nv],
        rest[nv : nv + m + 1],
    )  # fmt: skip


@jitted
def set_blocks(loop, t, y, row, implicit, b):
    """Take the derivatives at (t, y), where the rhs row is `row`.

    Returns
    -------
    int
        RUNNING, or SINGULAR_MATRIX where fewer constraints are independent than at an earlier state.
    """
    nv, m, nh = loop.sizes[at.NV], loop.sizes[at.NM], loop.sizes[at.NH]
    w = jacobian_work(loop.sizes, implicit)
    derive_equations(loop, t, y, row, w)
    for i in range(nv):
        for j in range(nv):
            b.mass[i, j] = w.block[i, j]
            b.by_positions[i, j] = -w.right[i, j]
            b.by_rates[i, j] = -w.right[i, nv + j]
    for k in range(m):
        b.idle[k] = 0.0
        for j in range(nv):
            b.gradients[k, j] = w.block[nv + k, j]
            b.reactions[j, k] = w.block[j, nv + k]
            b.rotated_gradients[k, j] = -0.5 * w.right[nv + k, nv + j]
    n_off = leave_open(loop.sizes, b, w)
    n_dependent, regular = 0, factor_block(w)
    if not regular:
        n_dependent = leave_idle(loop.sizes, b, w) - n_off
        regular = n_dependent > 0 and factor_block(w)
    if not regular:
        return at.SINGULAR_MATRIX
    if m - n_dependent + 1 < b.idle[m]:
        return at.SINGULAR_MATRIX
    b.idle[m] = m - n_dependent + 1
    for k in range(nh):
        for i in range(nv + m):
            w.scale[i] = 0.0
        w.scale[nv + k] = 1.0
        lu_solve(w.block, w.pivots, w.scale)
        for i in range(nv):
            b.steer[i, k] = w.scale[i]
        for i in range(m):
            b.lift[i, k] = w.scale[nv + i]
    multiply(b.by_rates, b.steer, b.damped)
    for k in range(nh):
        for i in range(nv):
            for j in range(nv):
                b.by_positions[i, j] -= b.damped[i, k] * b.rotated_gradients[k, j]
    for j in range(nv):
        b.spin[j] = y[loop.sizes[at.NQ] + j]
    for k in range(n_quaternions(loop.sizes)):
        j = quaternion_at(loop.sizes, k) - k
        for i in range(nv):
            add_rotated_row(j, b.spin, b.by_rates[i], b.by_positions[i])
            add_rotated_row(j, b.spin, b.mass[i], b.by_rates[i])
    return at.RUNNING


@jitted
def factor_block(w):
    """Factor [M -L; G 0]; returns whether the factors can be trusted."""
    return lu_factor(w.block, w.pivots) == at.RUNNING and pivot_ratio(w.block) > TRUSTED_PIVOT_RATIO


@jitted
def add_rotated_row(j, spin, row, out):
    """Add `row` times ω×/2 to `out`, in the columns from `j` on, of the rates of a quaternion."""
    x, y, z = 0.5 * row[j], 0.5 * row[j + 1], 0.5 * row[j + 2]
    a, b, c = spin[j], spin[j + 1], spin[j + 2]
    out[j] += y * c - z * b
    out[j + 1] += z * a - x * c
    out[j + 2] += x * b - y * a


@jitted
def half_rotated(j, spin, x):
    """Return ω×/2 times the three entries of `x`, real or complex, from `j` on."""
    a, b, c = 0.5 * spin[j], 0.5 * spin[j + 1], 0.5 * spin[j + 2]
    return b * x[j + 2] - c * x[j + 1], c * x[j] - a * x[j + 2], a * x[j + 1] - b * x[j]


@jitted
def multiply(a, b, out):
    """Write the product of two matrices."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@jitted
def set_shifted(g, nh, b, matrix):
    """Write the matrix of (Δu, Δλ + g Λ Δμ) for the real or complex shift `g`."""
    nv, m = b.mass.shape[0], b.gradients.shape[0]
    inverse = 1.0 / g
    for i in range(nv):
        for j in range(nv):
            matrix[i, j] = g * b.mass[i, j] + b.by_rates[i, j] + inverse * b.by_positions[i, j]
        for k in range(m):
            matrix[i, nv + k] = b.reactions[i, k]
            matrix[nv + k, i] = b.gradients[k, i]
            if k >= nh:
                matrix[nv + k, i] += inverse * b.rotated_gradients[k, i]
    for i in range(nv, nv + m):
        for j in range(nv, nv + m):
            matrix[i, j] = 0.0
        matrix[i, i] = b.idle[i - nv]


@jitted
def solve_shifted(g, sizes, b, matrix, pivots, x):
    """Replace residuals by corrections, with the factors of `set_shifted`'s matrix.

    Parameters
    ----------
    x : ndarray, shape (nv + m + nh,), real or complex
        Of (r₂, r₃, r₄) becomes (Δv, Δλ, Δμ).
    """
    nv, m, nh = sizes[at.NV], sizes[at.NM], sizes[at.NH]
    n = nv + m
    for k in range(m):
        if b.idle[k] == 1.0:
            x[nv + k] = 0.0
            if k < nh:
                x[n + k] = 0.0
    for k in range(nh):
        moved = g * x[n + k]
        x[n + k] = x[nv + k] - moved
        x[nv + k] = -moved
    for k in range(nv + nh, n):
        x[k] = -x[k]
    for i in range(nv):
        total = -x[i]
        for k in range(nh):
            total += b.damped[i, k] * x[n + k]
        x[i] = total
    lu_solve(matrix, pivots, x[:n])
    recover(g, sizes, b, x)


@jitted
def recover(g, sizes, b, x):
    """From (Δu, Δλ + g Λ Δμ, Δμ - H Δu / g) make (Δv, Δλ, Δμ)."""
    nv, m, nh = sizes[at.NV], sizes[at.NM], sizes[at.NH]
    n = nv + m
    inverse = 1.0 / g
    for k in range(nh):
        total = 0.0 * g
        for j in range(nv):
            total += b.rotated_gradients[k, j] * x[j]
        x[n + k] += inverse * total
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        along = half_rotated(j, b.spin, x)
        for axis in range(3):
            x[j + axis] += inverse * along[axis]
    for k in range(nh):
        for i in range(m):
            x[nv + i] -= g * b.lift[i, k] * x[n + k]
        for i in range(nv):
            x[i] -= b.steer[i, k] * x[n + k]


@jitted
def equations_size(sizes):
    """Length of what the kernels `residual` and `constraint_residual` write, the longer of the two."""
    return sizes[at.NM] + max(sizes[at.NV], sizes[at.NH])


@jitted
def equation_residuals(loop, t, y, arguments, equations, out):
    """Write (r₂, r₃, r₄) at (t, y).

    Parameters
    ----------
    y : ndarray
        Begins with (q, v).
    arguments : ndarray, shape (nq + 2 nv + m,)
        Its end holds accelerations and multipliers; the beginning is written here.
    equations : ndarray
        What kernels write.
    out : ndarray, shape (nv + m + nh,)
    """
    nv, m, nh = loop.sizes[at.NV], loop.sizes[at.NM], loop.sizes[at.NH]
    for i in range(loop.sizes[at.NQ] + nv):
        arguments[i] = y[i]
    call_kernel(loop.addresses[at.RESIDUAL], t, arguments, loop.p, equations)
    for i in range(nv):
        out[i] = equations[i]
    call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t, arguments, loop.p, equations)
    for k in range(m):
        out[nv + k] = equations[nh + k]
    for k in range(nh):
        out[nv + m + k] = equations[k]
