"""Explicit Runge-Kutta methods in independent coordinates: the others follow from the constraints at every stage."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.explicit.loop import N_STATES, combine_dense, erk_sum, norm_of_two
from symgen.runtime.integrate.explicit.tableau import NO_ESTIMATE, TWO_ESTIMATES
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.projection import count_energy, scale_energy
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, rotate, scale_to_unit
from symgen.runtime.integrate.row_rank import eliminate, independent_rows
from symgen.runtime.integrate.step_control import (
    accept_step,
    error_norm,
    first_step,
    grid_end,
    reject_step,
    step_end,
    too_small,
)

# Wehage, Haug, J. Mech. Des. 104 (1982) 247: elimination of G with complete pivoting; the coordinates of the pivots
# depend on the others.

# Counters of this family: whether a partition has been chosen; how many coordinates and how many rates depend on the
# others; how many did at the first choice; how often another partition was taken since.
HAVE_PARTITION, N_POSITIONS, N_RATES, FIRST_RANK, SWITCHES = range(16, 21)

# `numbers` of the work arrays: the smallest pivot, with the sign of the determinant, at the latest factorisation for
# rates and for positions; quality of the first partition; how fast dependent rates followed others at the last choice;
# then at the start and the end of a step the smallest pivots for positions and rates, and how fast dependents follow.
LATEST, LATEST_POSITIONS, FIRST_QUALITY, FOLLOWED_FIRST, START, END, N_NUMBERS = 0, 1, 2, 3, 4, 7, 10
POSITIONS_PIVOT, RATES_PIVOT, FOLLOWED = range(3)


class PartitionWork(NamedTuple):
    """Work arrays of `advance_partition`.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    stages : ndarray, shape (n_rows, N_ROW)
        Stage derivatives.
    states : ndarray, shape (N_STATES, NY)
        Stage argument, new state, two error estimates.
    mass : ndarray, shape (nv * nv,)
    jacobian : ndarray, shape (m * nv,)
        G as the kernel writes it.
    scaled : ndarray, shape (m, nv)
        G with its rows and columns scaled, being eliminated.
    axes : ndarray, shape (nq - nv, 3, 3)
        Of each quaternion, the axes of the joint's frame in those of the body, as rows.
    residual : ndarray, shape (nh + m,)
    row_scale, column_scale : ndarray, shapes (m,), (nv,)
    rows, columns : ndarray of int64, shapes (m,), (nv,)
        Constraints and coordinates in the order of the pivots: the first N_POSITIONS are solved for positions, the
        first N_RATES for rates.
    square : ndarray, shape (m * m,)
        Factors of the columns that belong to the dependent coordinates.
    pivots : ndarray of int64, shape (m,)
    right : ndarray, shape (m,)
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    stages: np.ndarray
    states: np.ndarray
    mass: np.ndarray
    jacobian: np.ndarray
    scaled: np.ndarray
    axes: np.ndarray
    residual: np.ndarray
    row_scale: np.ndarray
    column_scale: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    square: np.ndarray
    pivots: np.ndarray
    right: np.ndarray
    scratch: np.ndarray


@jitted
def partition_work_size(n_rows, sizes):
    """Length of `work` for a tableau of `n_rows` rows."""
    nv, nh, m = sizes[at.NV], sizes[at.NH], sizes[at.NM]
    own = N_NUMBERS + n_rows * sizes[at.N_ROW] + N_STATES * sizes[at.NY] + nv * nv + 2 * m * nv + nh + m
    return own + 9 * (sizes[at.NQ] - nv) + 2 * m + 2 * nv + m * m + 2 * m + finish_scratch_size(sizes)


@jitted
def partition_work(n_rows, sizes, work):
    """Divide `work`, of length `partition_work_size(n_rows, sizes)`, into a `PartitionWork`."""
    nv, m, ny, n_row = sizes[at.NV], sizes[at.NM], sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    stages, rest = rest[: n_rows * n_row].reshape((n_rows, n_row)), rest[n_rows * n_row :]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    mass, rest = rest[: nv * nv], rest[nv * nv :]
    jacobian, rest = rest[: m * nv], rest[m * nv :]
    scaled, rest = rest[: m * nv].reshape((m, nv)), rest[m * nv :]
    n = sizes[at.NQ] - nv
    axes, rest = rest[: 9 * n].reshape((n, 3, 3)), rest[9 * n :]
    residual, rest = rest[: sizes[at.NH] + m], rest[sizes[at.NH] + m :]
    row_scale, rest = rest[:m], rest[m:]
    column_scale, rest = rest[:nv], rest[nv:]
    rows, rest = rest[:m].view(np.int64), rest[m:]
    columns, rest = rest[:nv].view(np.int64), rest[nv:]
    square, rest = rest[: m * m], rest[m * m :]
    pivots, rest = rest[:m].view(np.int64), rest[m:]
    right, rest = rest[:m], rest[m:]
    return PartitionWork(
        numbers, stages, states, mass, jacobian, scaled, axes, residual, row_scale, column_scale, rows, columns, square,
        pivots, right, rest,
    )  # fmt: skip


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


# No rate of the dependent ones changes more than this many times as fast as an independent one that is changed alone,
# both in units of equal kinetic energy: errors of the independent ones grow by no more. Another partition is taken
# where that has become worse by as much again.
_MOST_FOLLOWED = 1.3
# A step is too long in which the smallest pivot falls to this part of what it was.
LEAST = 0.4
# All are lost where the smallest pivot of the best has fallen to this part of the first one's: rounding of the
# dependent coordinates grows by its reciprocal, and which branch of a mechanism they follow is then left to chance.
LOST = 1e-3
_EXCHANGES = 8


@jitted
def choose_partition(loop, t, w):
    """Choose the dependent coordinates at a state on the constraints; returns a status.

    PARTITION_LOST where fewer constraints are independent than at the first choice, or nearly so: no coordinates serve.
    """
    n_before = loop.counters[N_RATES]
    for k in range(n_before):
        w.pivots[k] = w.columns[k]
    scale_jacobian(not loop.counters[HAVE_PARTITION], loop, t, w)
    n_positions, n_rates, quality = independent_rows(loop.sizes[at.NH], w.scaled, w.rows, w.columns)
    exchange(0, n_positions, w.scaled, w.columns)
    if n_rates > n_positions:
        n_rates, _ = eliminate(n_positions, n_rates, w.scaled, w.rows, w.columns)
        exchange(n_positions, n_rates, w.scaled, w.columns)
    if loop.counters[HAVE_PARTITION]:
        loop.counters[SWITCHES] += differ(w.pivots, n_before, w.columns, n_rates)
    else:
        loop.counters[FIRST_RANK] = n_rates
        w.numbers[FIRST_QUALITY] = quality
    loop.counters[HAVE_PARTITION] = 1
    loop.counters[N_POSITIONS], loop.counters[N_RATES] = n_positions, n_rates
    kept = n_rates >= loop.counters[FIRST_RANK] and quality >= LOST * w.numbers[FIRST_QUALITY]
    if not (kept and measure(START, loop, t, loop.y, w)):
        return at.PARTITION_LOST
    w.numbers[FOLLOWED_FIRST] = w.numbers[START + FOLLOWED]
    return at.RUNNING


@jitted
def exchange(first, end, scaled, columns):
    """Put independent columns in the place of dependent ones `first` to `end` - 1 until none follows others too fast.

    Complete pivoting alone may leave columns that are nearly dependent on each other. Those of largest volume would
    follow at most once as fast: Goreinov, Tyrtyshnikov, Zamarashkin, Linear Algebra Appl. 261 (1997) 1.

    Parameters
    ----------
    scaled, columns : ndarray
        As `independent_rows` leaves them; the rows `first` to `end` - 1 become those that give dependent columns by
        the others.
    """
    m, nv = scaled.shape
    for k in range(end - 1, first - 1, -1):
        solve_row(k, first, end, scaled)
    for _ in range(_EXCHANGES * (end - first)):
        largest, row, column = _MOST_FOLLOWED, first, end
        for i in range(first, end):
            for j in range(end, nv):
                if abs(scaled[i, j]) > largest:
                    largest, row, column = abs(scaled[i, j]), i, j
        if largest == _MOST_FOLLOWED:
            return
        columns[row], columns[column] = columns[column], columns[row]
        for i in range(m):
            scaled[i, row], scaled[i, column] = scaled[i, column], scaled[i, row]
        solve_row(row, first, m, scaled)


@jitted
def solve_row(k, first, end, scaled):
    """Solve row `k` for its column `k`, and take that out of the other rows from `first` to `end` - 1."""
    nv = scaled.shape[1]
    inverse = 1.0 / scaled[k, k]
    for j in range(nv):
        scaled[k, j] *= inverse
    for i in range(first, end):
        factor = scaled[i, k]
        if i != k and factor != 0.0:
            for j in range(nv):
                scaled[i, j] -= factor * scaled[k, j]


@jitted
def measure(first, loop, t, y, w):
    """Write how well the partition serves at a state to `w.numbers`, from `first` on; whether it does at all."""
    n_positions, n_rates = loop.counters[N_POSITIONS], loop.counters[N_RATES]
    followed = 0.0
    if 0 < n_positions < n_rates:
        if not factor_dependents(n_positions, loop, t, y, w):
            return False
        followed = most_followed(n_positions, loop.sizes, w)
        w.numbers[first + POSITIONS_PIVOT] = w.numbers[LATEST]
    if n_rates > 0 and not factor_dependents(n_rates, loop, t, y, w):
        return False
    w.numbers[first + RATES_PIVOT] = w.numbers[LATEST]
    if n_positions == n_rates:
        w.numbers[first + POSITIONS_PIVOT] = w.numbers[LATEST]
    w.numbers[first + FOLLOWED] = max(followed, most_followed(n_rates, loop.sizes, w))
    return True


@jitted
def most_followed(n, sizes, w):
    """Return how fast one of `n` dependent rates changes at most where an independent one does, with their factors."""
    nv = sizes[at.NV]
    most = 0.0
    for j in range(n, nv):
        column = w.columns[j]
        for k in range(n):
            row = w.rows[k]
            w.right[k] = w.jacobian[row * nv + column] * w.row_scale[row] * w.column_scale[column]
        lu_solve(w.square[: n * n].reshape((n, n)), w.pivots, w.right[:n])
        for k in range(n):
            most = max(most, abs(w.right[k]))
    return most


@jitted
def differ(some, n, others, n_others):
    """Whether the first `n` entries of one array are others than the first `n_others` of another, in any order."""
    for i in range(n):
        found = False
        for j in range(n_others):
            found = found or some[i] == others[j]
        if not found:
            return True
    return n != n_others


@jitted
def scale_jacobian(first, loop, t, w):
    """Write G to `w.scaled`, columns in units of equal kinetic energy, rows in units of the largest entry so far.

    Not of the largest entry now: a row that vanishes as a whole loses rank as well.
    """
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    call_kernel(loop.addresses[at.MASS_MATRIX], t, loop.y, loop.p, w.mass)
    evaluate_jacobian(loop, t, loop.y, w)
    heaviest = 0.0
    for j in range(nv):
        w.column_scale[j] = w.mass[j * nv + j]
        heaviest = max(heaviest, w.column_scale[j])
    rotate_inertias(loop.sizes, w)
    for j in range(nv):
        # What has no mass of its own is best left to the constraints.
        inertia = max(w.column_scale[j], 1e-6 * heaviest)
        w.column_scale[j] = 1.0 / math.sqrt(inertia) if inertia > 0.0 else 1.0
    for k in range(m):
        largest = 0.0
        for j in range(nv):
            w.scaled[k, j] = w.jacobian[k * nv + j] * w.column_scale[j]
            largest = max(largest, abs(w.scaled[k, j]))
        scale = 1.0 / largest if largest > 0.0 else 1.0
        w.row_scale[k] = scale if first else min(scale, w.row_scale[k])
        for j in range(nv):
            w.scaled[k, j] *= w.row_scale[k]


@jitted
def rotate_inertias(sizes, w):
    """Put the inertias about the axes `w.axes` in place of those about axes of bodies in `w.column_scale`."""
    nv = sizes[at.NV]
    for k in range(n_quaternions(sizes)):
        first = quaternion_at(sizes, k) - k
        for c in range(3):
            inertia = 0.0
            for a in range(3):
                for b in range(3):
                    inertia += w.axes[k, c, a] * w.mass[(first + a) * nv + first + b] * w.axes[k, c, b]
            w.column_scale[first + c] = inertia


@jitted
def serves(least, counters, w):
    """Whether at the latest factorisations pivots are more than `least` of those at the start of the step."""
    positions, rates = w.numbers[START + POSITIONS_PIVOT], w.numbers[START + RATES_PIVOT]
    if counters[N_POSITIONS] > 0 and not w.numbers[LATEST_POSITIONS] / positions > least:
        return False
    return counters[N_RATES] == 0 or w.numbers[LATEST] / rates > least


@jitted
def is_worn(w):
    """Whether dependent rates follow others so much faster than at the choice that another may serve better."""
    return not w.numbers[START + FOLLOWED] <= _MOST_FOLLOWED * max(_MOST_FOLLOWED, w.numbers[FOLLOWED_FIRST])


# Where steps shrink to nothing while a pivot is below this, it is the constraints that stop them.
_NEARLY_LOST = 1e-2
_APART = 1e-6
# Errors across the constraints are taken off at a slant, so that a part of them stays: on random mechanisms, errors are
# those of projection at the same tolerance, but for this factor.
_CAUTION = 2.0


@jitted
def advance_partition(method, loop):
    """Advance with an explicit Runge-Kutta method in independent coordinates until something is for Python to do.

    `y` holds all coordinates and rates; those that depend on the others are solved for before every evaluation, so that
    only the independent ones are integrated. After a step that leaves the partition worn, another is chosen. Frames and
    events use the method's dense output. Arguments and result are those of all step loops, see
    docs/step-loops.md; `method` is an `ErkTableau`.
    """
    w = partition_work(method.n_rows, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        status = begin(method, loop, w)
        if status != at.RUNNING:
            return status
    return take_steps(partitioned_step, method, loop, w)


@jitted
def partitioned_step(method, loop, w):
    """Take a step in a partition that serves, and record it; returns a status."""
    t0 = loop.control[at.T]
    if is_worn(w):
        status = choose_partition(loop, t0, w)
        if status != at.RUNNING:
            return status
    if method.estimate == NO_ESTIMATE:
        t1 = grid_end(loop)
        status = fixed_step(method, loop, t0, t1, w)
    else:
        status, t1 = adaptive_step(method, loop, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        take_dense(method, loop, t0, t1 - t0, w)
    count_energy(loop)
    copy(w.numbers[END:N_NUMBERS], w.numbers[START:END])
    copy(w.states[1], loop.y)
    copy(w.stages[method.n_stages - method.fsal], loop.f)
    return finish_step(loop, t0, t1, loop.dense, method.n_dense, w.scratch)


@jitted
def begin(method, loop, w):
    """Choose a partition and, where that is open, the first step; returns a status."""
    t = loop.control[at.T]
    status = choose_partition(loop, t, w)
    if status != at.RUNNING:
        return status
    if not evaluate(loop, t, loop.y, loop.f):
        return at.NOT_FINITE
    loop.counters[at.F_VALID] = 1
    if method.estimate != NO_ESTIMATE and loop.control[at.H] <= 0.0:
        loop.control[at.H] = first_step(method.order, loop, w.stages[0], w.states[0])
        loop.control[at.ERROR_OLD] = 1e-4
    return at.RUNNING


@jitted
def adaptive_step(method, loop, w):
    """Try steps until one is accepted; returns status and the time of the new state [s]."""
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        h = t1 - t
        if too_small(loop.control):
            lost = cause == at.PROJECTION_FAILED or abs(w.numbers[LATEST]) < _NEARLY_LOST
            return (at.PARTITION_LOST if lost else cause), t
        cause = take_step(method, loop, t, t1, w)
        error = math.inf
        if cause == at.RUNNING:
            error = step_error(method, loop, t1, h, w)
            if error <= 1.0:
                accept_step(method, error, h, loop)
                return at.RUNNING, t1
            cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        reject_step(method, error, h, loop)
        loop.counters[at.REJECTED] += 1


@jitted
def fixed_step(method, loop, t, t1, w):
    """Take a step of the grid; where it leaves what the partition can describe, with another; returns a status."""
    status = take_step(method, loop, t, t1, w)
    if status == at.PROJECTION_FAILED:
        status = choose_partition(loop, t, w)
        if status == at.RUNNING:
            status = take_step(method, loop, t, t1, w)
    return status


@jitted
def take_step(method, loop, t, t1, w):
    """Fill the stages of a step from `t` to `t1`, the new state and its derivative; returns a status."""
    h, last = t1 - t, method.n_stages - method.fsal
    least = LEAST if method.estimate != NO_ESTIMATE else 0.0
    copy(loop.f, w.stages[0])
    for s in range(1, last + 1):
        argument = w.states[1] if s == last else w.states[0]
        place = t1 if s == last else t + method.c[s] * h
        erk_sum(method.a[s], s, h, loop.y, w.stages, argument)
        status = solve_dependents(loop, place, argument, w)
        if status == at.RUNNING and not serves(least, loop.counters, w):
            status = at.PROJECTION_FAILED
        if status != at.RUNNING:
            return status
        if s == last:
            scale_energy(loop, t1, argument, w.scratch)
        call_kernel(loop.addresses[at.RHS], place, argument, loop.p, w.stages[s])
        loop.counters[at.RHS_CALLS] += 1
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], w.stages[s, loop.sizes[at.N_ROW] - 1]
        )
    if not measure(END, loop, t1, w.states[1], w):
        return at.PROJECTION_FAILED
    if all_finite(w.states[1], loop.sizes[at.NY]) and all_finite(w.stages[last], loop.sizes[at.NY]):
        return at.RUNNING
    return at.NOT_FINITE


@jitted
def step_error(method, loop, t1, h, w):
    """Return the error of a step in units of the tolerance, in the dependent coordinates and rates as well.

    Their error is what that of the others makes of them, so they are solved for in the solutions of lower order too.
    That alone would not see errors across the constraints, which say that a step is too long.
    """
    y_new = w.states[1]
    for e in range(method.estimate):
        sum_errors(method, e, loop.sizes, h, w.stages, w.states[2 + e])
    error = estimates_norm(method, loop, w)
    if not error <= 1.0:
        return error
    for e in range(method.estimate):
        difference = w.states[2 + e]
        # The difference of two solutions that are very near each other would be the rounding of both.
        apart = part_of_motion(loop.sizes, y_new, difference)
        scale = max(1.0, _APART / apart) if apart > 0.0 else 1.0
        for i in range(loop.sizes[at.NY]):
            difference[i] = y_new[i] - scale * difference[i]
        if solve_dependents(loop, t1, difference, w) != at.RUNNING:
            return math.inf
        for i in range(loop.sizes[at.NY]):
            difference[i] = (y_new[i] - difference[i]) / scale
    return _CAUTION * max(error, estimates_norm(method, loop, w))


@jitted
def sum_errors(method, e, sizes, h, k, out):
    """Write estimate `e` of the error of (q, v) to `out`; work is left out, it follows the motion."""
    for i in range(sizes[at.NY]):
        out[i] = 0.0
    for j in range(method.n_stages):
        weight = h * method.error[e, j]
        if weight != 0.0:
            for i in range(sizes[at.NQ] + sizes[at.NV]):
                out[i] += weight * k[j, i]


@jitted
def estimates_norm(method, loop, w):
    """Return the size of the estimates in `w.states` in units of the tolerance."""
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    if method.estimate == TWO_ESTIMATES:
        return norm_of_two(loop.control, n, loop.y, w.states[1], w.states[2], w.states[3])
    return error_norm(loop.control, n, loop.y, w.states[1], w.states[2])


@jitted
def part_of_motion(sizes, y, change):
    """Return the largest change of a coordinate in parts of the largest coordinate, or of a rate likewise."""
    largest = 0.0
    for first, end in ((0, sizes[at.NQ]), (sizes[at.NQ], sizes[at.NQ] + sizes[at.NV])):
        moved, size = 0.0, 0.0
        for i in range(first, end):
            moved, size = max(moved, abs(change[i])), max(size, abs(y[i]))
        if size > 0.0:
            largest = max(largest, moved / size)
    return largest


@jitted
def take_dense(method, loop, t, h, w):
    """Fill the dense output of the step, whose further stages lie on the constraints as all others do."""
    for s in range(method.n_stages + 1 - method.fsal, method.n_rows):
        erk_sum(method.a[s], s, h, loop.y, w.stages, w.states[0])
        solve_dependents(loop, t + method.c[s] * h, w.states[0], w)
        call_kernel(loop.addresses[at.RHS], t + method.c[s] * h, w.states[0], loop.p, w.stages[s])
        loop.counters[at.RHS_CALLS] += 1
    combine_dense(method, loop, h, w)
