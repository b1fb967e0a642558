"""Solve the constraints for the dependent coordinates and rates."""

import math

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.integrate.layout import (
    CONSTRAINT_JACOBIAN,
    CONSTRAINT_RESIDUAL,
    NEWTON_ITERATIONS,
    NH,
    NQ,
    NV,
    PROJECTION_FAILED,
    RUNNING,
)
from runtime.integrate.linear import lu_factor, lu_solve
from runtime.integrate.partition.work import LATEST, N_POSITIONS, N_RATES
from runtime.integrate.quaternions import n_quaternions, quaternion_at, rotate, scale_to_unit

MAX_ITERATIONS = 10
# Newton's corrections converge quadratically: after one of this size, of 1 + |q|, what is left is round-off.
LAST_CORRECTION = 1e-8


@jitted
def solve_dependents(addresses, sizes, p, control, counters, t, y, w):
    """Move the dependent coordinates and rates of `y` onto the constraints; the independent ones stay.

    Quaternions are scaled to unit length first; then body axes about which they turn depend on others, or do not.

    Returns
    -------
    int
        RUNNING, or PROJECTION_FAILED where there is no solution near.
    """
    nq, nh = sizes[NQ], sizes[NH]
    scale_to_unit(sizes, y)
    size = math.inf if counters[N_POSITIONS] > 0 else 0.0
    iteration = 0
    while size > LAST_CORRECTION:
        if iteration == MAX_ITERATIONS:
            return PROJECTION_FAILED
        iteration += 1
        n = counters[N_POSITIONS]
        call_kernel(addresses[CONSTRAINT_RESIDUAL], t, y, p, w.residual)
        if not factor_dependents(n, addresses, sizes, p, t, y, w):
            return PROJECTION_FAILED
        for k in range(n):
            w.right[k] = w.residual[w.rows[k]] * w.row_scale[w.rows[k]]
        lu_solve(w.square[: n * n].reshape((n, n)), w.pivots, w.right[:n])
        counters[NEWTON_ITERATIONS] += 1
        size = 0.0
        for k in range(n):
            j = w.columns[k]
            change = w.column_scale[j] * w.right[k]
            size = max(size, abs(change) / (1.0 + move_one(sizes, j, -change, y)))
            if not math.isfinite(change):
                return PROJECTION_FAILED
    return solve_rates(iteration > 0, addresses, sizes, p, t, nq, nh, counters, y, w)


@jitted
def move_one(sizes, j, change, y):
    """Move what rate `j` moves by `change`; returns how large that is now, 0 for the angle of a turn."""
    k = 0
    while k < n_quaternions(sizes) and j >= quaternion_at(sizes, k) - k + 3:
        k += 1
    i = quaternion_at(sizes, k)
    if j < i - k:
        y[j + k] += change
        return abs(y[j + k])
    axis = j - (i - k)
    rotate(y, i, change if axis == 0 else 0.0, change if axis == 1 else 0.0, change if axis == 2 else 0.0, y)
    return 0.0


@jitted
def solve_rates(factored, addresses, sizes, p, t, nq, nh, counters, y, w):
    """Move the dependent rates, with the factors for positions where these serve; returns a status."""
    n = counters[N_RATES]
    if n == 0:
        return RUNNING
    if not (factored and n == counters[N_POSITIONS]):
        if not factor_dependents(n, addresses, sizes, p, t, y, w):
            return PROJECTION_FAILED
    call_kernel(addresses[CONSTRAINT_RESIDUAL], t, y, p, w.residual)
    for k in range(n):
        w.right[k] = w.residual[nh + w.rows[k]] * w.row_scale[w.rows[k]]
    lu_solve(w.square[: n * n].reshape((n, n)), w.pivots, w.right[:n])
    finite = 0.0
    for k in range(n):
        j = w.columns[k]
        y[nq + j] -= w.column_scale[j] * w.right[k]
        finite += 0.0 * y[nq + j]
    return RUNNING if finite == 0.0 else PROJECTION_FAILED


@jitted
def factor_dependents(n, addresses, sizes, p, t, y, w):
    """Factor the first `n` rows and columns of the scaled G in the order of the partition; whether that succeeds."""
    nv = sizes[NV]
    call_kernel(addresses[CONSTRAINT_JACOBIAN], t, y, p, w.jacobian)
    matrix = w.square[: n * n].reshape((n, n))
    for k in range(n):
        row = w.rows[k]
        for j in range(n):
            column = w.columns[j]
            matrix[k, j] = w.jacobian[row * nv + column] * w.row_scale[row] * w.column_scale[column]
    if lu_factor(matrix, w.pivots) != RUNNING:
        return False
    # The diagonal holds reciprocals of the pivots.
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(matrix[k, k]))
    w.numbers[LATEST] = 1.0 / largest
    return True
