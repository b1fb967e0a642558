"""Solve the constraints for the dependent coordinates and rates."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.partition.work import LATEST, LATEST_POSITIONS, N_POSITIONS, N_RATES
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, rotate, scale_to_unit

MAX_ITERATIONS = 10
# Newton's corrections converge quadratically: after one of this part of all coordinates, what is left is round-off.
LAST_CORRECTION = 1e-9


@jitted
def solve_dependents(loop, t, y, w):
    """Move the dependent coordinates and rates of `y` onto the constraints; the independent ones stay.

    Quaternions are scaled to unit length first; then turns about axes of their joint's frame depend on others, or do
    not: axes of the body turn with it, and what depends on what would change as fast.

    Returns
    -------
    int
        RUNNING, or PROJECTION_FAILED where there is no solution near.
    """
    scale_to_unit(loop.sizes, y)
    n = loop.counters[N_POSITIONS]
    size = math.inf if n > 0 else 0.0
    iteration = 0
    while size > LAST_CORRECTION * extent(loop.sizes, y, w):
        if iteration == MAX_ITERATIONS:
            return at.PROJECTION_FAILED
        iteration += 1
        call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t, y, loop.p, w.residual)
        if not factor_dependents(n, loop, t, y, w):
            return at.PROJECTION_FAILED
        solve_factored(n, 0, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        size = largest_of(n, w)
        if not math.isfinite(size):
            return at.PROJECTION_FAILED
        retract_positions(n, loop.sizes, y, w)
        w.numbers[LATEST_POSITIONS] = w.numbers[LATEST]
    return solve_rates(n > 0 and n == loop.counters[N_RATES], loop, t, y, w)


@jitted
def solve_rates(factored, loop, t, y, w):
    """Move the dependent rates, with the factors for positions where these serve; returns a status."""
    n = loop.counters[N_RATES]
    if n == 0:
        return at.RUNNING
    if not factored and not factor_dependents(n, loop, t, y, w):
        return at.PROJECTION_FAILED
    size, iteration = math.inf, 0
    # Factors of the last place but one leave a small part of the first correction, and nothing of the second.
    while size > LAST_CORRECTION * speed(loop.sizes, y, w) and iteration < MAX_ITERATIONS:
        iteration += 1
        call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t, y, loop.p, w.residual)
        solve_factored(n, loop.sizes[at.NH], w)
        size = largest_of(n, w)
        if not math.isfinite(size):
            return at.PROJECTION_FAILED
        move_rates(n, loop.sizes, y, w)
    return at.RUNNING


@jitted
def solve_factored(n, first, w):
    """Write what `n` dependents have to change by to `w.right`, from the residuals from `first` on."""
    for k in range(n):
        w.right[k] = w.residual[first + w.rows[k]] * w.row_scale[w.rows[k]]
    lu_solve(w.square[: n * n].reshape((n, n)), w.pivots, w.right[:n])


@jitted
def largest_of(n, w):
    """Return the largest change of a dependent coordinate or rate, in units of equal kinetic energy; inf for nan."""
    largest = 0.0
    for k in range(n):
        if not math.isfinite(w.right[k]):
            return math.inf
        largest = max(largest, abs(w.right[k]))
    return largest


@jitted
def extent(sizes, y, w):
    """Return the size of the positions in the units of `largest_of`; one radian for turns."""
    largest, start = 0.0, 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            largest = max(largest, abs(y[i]) / w.column_scale[i - k])
        if end < sizes[at.NQ]:
            largest = max(largest, 1.0 / w.column_scale[end - k])
        start = end + 4
    return largest


@jitted
def speed(sizes, y, w):
    """Return the size of the rates in the units of `largest_of`."""
    largest = 0.0
    for j in range(sizes[at.NV]):
        largest = max(largest, abs(y[sizes[at.NQ] + j]) / w.column_scale[j])
    return largest


@jitted
def retract_positions(n, sizes, y, w):
    """Take `w.right` off what the dependent rates move."""
    for i in range(n):
        j = w.columns[i]
        change = -w.column_scale[j] * w.right[i]
        k = quaternion_of(sizes, j)
        place = quaternion_at(sizes, k)
        if j < place - k:
            y[j + k] += change
        else:
            axis = w.axes[k, j - (place - k)]
            rotate(y, place, change * axis[0], change * axis[1], change * axis[2], y)


@jitted
def move_rates(n, sizes, y, w):
    """Take `w.right` off the dependent rates."""
    nq = sizes[at.NQ]
    for i in range(n):
        j = w.columns[i]
        change = -w.column_scale[j] * w.right[i]
        k = quaternion_of(sizes, j)
        first = quaternion_at(sizes, k) - k
        if j < first:
            y[nq + j] += change
        else:
            for b in range(3):
                y[nq + first + b] += change * w.axes[k, j - first, b]


@jitted
def quaternion_of(sizes, j):
    """Return which quaternion rate `j` turns, or the next one where it turns none."""
    k = 0
    while k < n_quaternions(sizes) and j >= quaternion_at(sizes, k) - k + 3:
        k += 1
    return k


@jitted
def evaluate_jacobian(loop, t, y, w):
    """Write G to `w.jacobian`, by angular velocities in the axes of the joint's frame, and these axes to `w.axes`."""
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    if n_quaternions(loop.sizes) > 0:
        # The kernel leaves zeros alone that are always there, but turned columns are full.
        for i in range(m * nv):
            w.jacobian[i] = 0.0
    call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t, y, loop.p, w.jacobian)
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        set_axes(y[i], y[i + 1], y[i + 2], y[i + 3], w.axes[k])
        for row in range(m):
            j = row * nv + i - k
            x, y_, z = w.jacobian[j], w.jacobian[j + 1], w.jacobian[j + 2]
            for c in range(3):
                w.jacobian[j + c] = x * w.axes[k, c, 0] + y_ * w.axes[k, c, 1] + z * w.axes[k, c, 2]


@jitted
def set_axes(w, x, y, z, axes):
    """Write the axes of the frame that a unit quaternion turns a body in, in the body's axes, to the rows of `axes`."""
    axes[0, 0], axes[0, 1], axes[0, 2] = (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
    )
    axes[1, 0], axes[1, 1], axes[1, 2] = (
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
    )
    axes[2, 0], axes[2, 1], axes[2, 2] = (
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


@jitted
def factor_dependents(n, loop, t, y, w):
    """Factor the first `n` rows and columns of the scaled G in the order of the partition; whether that succeeds."""
    nv = loop.sizes[at.NV]
    evaluate_jacobian(loop, t, y, w)
    matrix = w.square[: n * n].reshape((n, n))
    for k in range(n):
        row = w.rows[k]
        for j in range(n):
            column = w.columns[j]
            matrix[k, j] = w.jacobian[row * nv + column] * w.row_scale[row] * w.column_scale[column]
    if lu_factor(matrix, w.pivots) != at.RUNNING:
        return False
    # The diagonal holds reciprocals of the pivots.
    largest, sign = 0.0, 1.0
    for k in range(n):
        largest = max(largest, abs(matrix[k, k]))
        if (matrix[k, k] < 0.0) != (w.pivots[k] != k):
            sign = -sign
    w.numbers[LATEST] = sign / largest
    return True
