"""Taylor series of the whole motion: one kernel gives all coefficients, steps are as long as the series reach."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.loop import all_finite, copy, evaluate
from symgen.runtime.integrate.projection import count_energy, project_state, projection_size, scale_energy
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.step_control import (
    longest_step,
    room_for_steps,
    smallest_step,
    step_end,
    too_small,
    watch_is_near,
)

# A recurrence that leaves more than this of the last terms, squared, tells nothing about the next ones.
_MOST_LEFT = 0.25
# How far the roots of z^2 = a z + b, by which terms decay, stay away from 1 and -1, about.
_LEAST_DECAY = 0.25
# Added to the diagonal of the normal equations, relative: terms of one ratio fit many a and b, of the same sum.
_RIDGE = 1e-10
_TINY = 1e-200  # sums of squares below it are not exact, and what follows such terms does not matter


@jitted
def has_tail(sizes):
    """Whether there are more terms than it takes to find a recurrence: those of a single rate fit one in any case."""
    return sizes[at.NY] - sizes[at.NQ] > 1


@jitted
def tail_factors(h, order, sizes, series):
    """Return what the last two rows of rates (and work) are multiplied by to give the sum of all terms behind them.

    Far from the start, the terms y_k h^k of all components are ruled by the singularities nearest to it, one on the
    real axis or a complex pair, and nearly satisfy one recurrence y_(k+1) = a y_k + b y_(k-1) (Chang and Corliss,
    J. Inst. Maths Applics 25 (1980) 349). Least squares over the last four terms find a and b, and the recurrence
    sums itself: what follows y_k is ((a + b) y_k + b y_(k-1)) / (1 - a - b).

    Parameters
    ----------
    h : float [s]
    order : int
        Of the positions; rates and work have terms up to one less.
    series : ndarray, shape (order + 1, NY)

    Returns
    -------
    tuple of float
        For row order - 2 and for row order - 1; both 0 where terms follow no such recurrence, or that cannot be told.
    """
    if not has_tail(sizes):
        return 0.0, 0.0
    scale3 = h ** (order - 4)
    scale2 = scale3 * h
    scale1 = scale2 * h
    scale0 = scale1 * h
    aa, ab, bb, ya, yb, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(sizes[at.NQ], sizes[at.NY]):
        y0 = scale0 * series[order - 1, i]
        y1 = scale1 * series[order - 2, i]
        y2 = scale2 * series[order - 3, i]
        y3 = scale3 * series[order - 4, i]
        yy += y0 * y0 + y1 * y1
        ya += y0 * y1 + y1 * y2
        yb += y0 * y2 + y1 * y3
        aa += y1 * y1 + y2 * y2
        ab += y1 * y2 + y2 * y3
        bb += y2 * y2 + y3 * y3
    aa *= 1.0 + _RIDGE
    bb *= 1.0 + _RIDGE
    determinant = aa * bb - ab * ab
    if not (determinant > _TINY and yy > _TINY):
        return 0.0, 0.0
    a = (ya * bb - yb * ab) / determinant
    b = (yb * aa - ya * ab) / determinant
    most = _MOST_LEFT * yy
    left = yy - a * ya - b * yb
    if not (left < most and 1.0 - b - abs(a) > _LEAST_DECAY):
        return 0.0, 0.0
    factor = (most - left) / (most * (1.0 - a - b))
    return factor * b * scale1, factor * (a + b) * scale0


@jitted
def add_tail(h, order, sizes, series, total, lost, slope):
    """Add what follows the last terms to the sum of a series at `h`, what rounding lost in it, and its derivative.

    Nothing where `tail_factors` cannot tell. Positions are left as they are: their terms are smaller by h / order.

    Parameters
    ----------
    total, lost, slope : ndarray, shape (NY,)
        Changed in place.
    """
    before, last = tail_factors(h, order, sizes, series)
    if before == 0.0 and last == 0.0:
        return
    turns = order / h
    for i in range(sizes[at.NQ], sizes[at.NY]):
        tail = before * series[order - 2, i] + last * series[order - 1, i]
        rounded = total[i] + tail
        lost[i] += tail - (rounded - total[i])
        total[i] = rounded
        slope[i] += turns * tail


@jitted
def append_tail(order, sizes, series):
    """Make what follows the last terms of a series in the place θ of a step its last row, for dense output."""
    before, last = tail_factors(1.0, order, sizes, series)
    for i in range(sizes[at.NQ], sizes[at.NY]):
        series[order, i] = before * series[order - 2, i] + last * series[order - 1, i]


@jitted
def drop_tail(order, sizes, series):
    """Clear the last row of rates and work again: the kernel that computes series does not write it."""
    for i in range(sizes[at.NQ], sizes[at.NY]):
        series[order, i] = 0.0


LOG_2 = math.log(2.0)
WINDOW = 4  # coefficients that a step is judged by: symmetry makes up to two in a row vanish
DEFECT_LIMIT = 5.0
ROUND_OFF_RTOL = 3e-15
SHARE, SHARE_WITH_TAIL = 0.5, 1.0  # of the tolerance: the largest of the last terms
_SIZES = 3  # coefficients that tell how large a rate becomes during a step


@jitted
def rate_tolerance(control, h, i, series):
    """Return the error allowed in component `i`, a rate, over a step of length `h`."""
    size = abs(series[0, i])
    power = h
    for k in range(1, _SIZES):
        size = max(size, power * abs(series[k, i]))
        power *= h
    return max(control[at.ATOL] + control[at.RTOL] * size, 1e-300)


@jitted
def series_step(order, loop, series, cell):
    """Return the step [s] over which the terms left out stay below the tolerance.

    With terms |v_k| h^k of the rates and the work (orders 0 to p - 1), relative to their sizes,
    h = min |v_k|^(-1/k) (0.5 tol)^(1/(p-1)) over the last terms (Jorba and Zou, Experimental Mathematics 14
    (2005), eq. 3-8, with the factor of section 3.2.1), the window extended downward, as far as half the order, until it
    holds a term that is not zero. Higher terms all zero: a polynomial, at rest or in free fall, which any step follows.
    Where most of what follows the last terms is added to the sum (`tail.py`), they may be twice as large.

    Parameters
    ----------
    series : ndarray, shape (order + 1, NY)
    cell : ndarray
        Its first number is scratch.
    """
    last = order - 1
    h = loop.control[at.H] if loop.control[at.H] > 0.0 else first_guess(order, loop, series)
    if not h < math.inf:
        return longest_step(loop.control)
    tolerance = max(loop.control[at.RTOL], 1e-17)
    t0, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0
    for i in range(loop.sizes[at.NQ], loop.sizes[at.NY]):
        weight = tolerance / rate_tolerance(loop.control, h, i, series)
        t0 = max(t0, weight * abs(series[last, i]))
        t1 = max(t1, weight * abs(series[last - 1, i]))
        t2 = max(t2, weight * abs(series[last - 2, i]))
        t3 = max(t3, weight * abs(series[last - 3, i]))
    if not all_finite_sum(t0, t1, t2, t3):
        return math.nan
    highest = -math.inf
    if t0 > 0.0:
        highest = max(highest, log2(t0, cell) / last)
    if t1 > 0.0:
        highest = max(highest, log2(t1, cell) / (last - 1))
    if t2 > 0.0:
        highest = max(highest, log2(t2, cell) / (last - 2))
    if t3 > 0.0:
        highest = max(highest, log2(t3, cell) / (last - 3))
    if highest == -math.inf:
        highest = first_term_below(last - WINDOW, last // 2, h, tolerance, loop, series, cell)
        if highest == -math.inf:
            return longest_step(loop.control)
    # At the limit of round-off, what is left out must not add up over many steps where rounding does not.
    left_out = tolerance if tolerance > ROUND_OFF_RTOL else 1e-3 * tolerance
    left_out *= SHARE_WITH_TAIL if has_tail(loop.sizes) else SHARE
    return math.exp((log2(left_out, cell) / last - highest) * LOG_2)


@jitted
def quaternion_step(order, loop, series, cell):
    """Return the step [s] over which the last two terms of quaternions stay below the tolerance.

    They follow from the rates, but not by an integral: at a constant angular velocity the rates have no more terms,
    and quaternions are waves. `series_step`, to which rates are all that there is, would take any step.
    """
    second_last, last = 0.0, 0.0
    for k in range(n_quaternions(loop.sizes)):
        first = quaternion_at(loop.sizes, k)
        for i in range(first, first + 4):
            second_last = max(second_last, abs(series[order - 1, i]))
            last = max(last, abs(series[order, i]))
    highest = -math.inf
    if second_last > 0.0:
        highest = log2(second_last, cell) / (order - 1)
    if last > 0.0:
        highest = max(highest, log2(last, cell) / order)
    if highest == -math.inf:
        return math.inf
    tolerance = max(loop.control[at.ATOL] + loop.control[at.RTOL], ROUND_OFF_RTOL)
    return math.exp((log2(SHARE * tolerance, cell) / order - highest) * LOG_2)


@jitted
def all_finite_sum(a, b, c, d):
    """Whether four numbers that are not negative are finite."""
    return a + b + c + d < math.inf


@jitted
def first_term_below(k, end, h, tolerance, loop, series, cell):
    """Return log2 of the highest term from order `k` down to `end` that is not zero, divided by its order."""
    while k >= end:
        largest = 0.0
        for i in range(loop.sizes[at.NQ], loop.sizes[at.NY]):
            largest = max(largest, abs(series[k, i]) * tolerance / rate_tolerance(loop.control, h, i, series))
        if largest > 0.0:
            return log2(largest, cell) / k
        k -= 1
    return -math.inf


@jitted
def log2(x, cell):
    """Return log2 of a positive number to within 0.05, straight from its bits: a step needs no more."""
    cell[0] = x
    return cell.view(np.int64)[0] * 2.0**-52 - 1022.957


@jitted
def first_guess(order, loop, series):
    """Return a length [s] for the sizes of rates during a first step: the radius that the last terms show."""
    nq, longest = loop.sizes[at.NQ], math.inf
    for k in range(order - 1, 0, -1):
        largest, size = 0.0, 0.0
        for i in range(nq, nq + loop.sizes[at.NV]):
            largest = max(largest, abs(series[k, i]))
            size = max(size, abs(series[1, i]), abs(series[0, i]))
        if largest > 0.0:
            longest = min(longest, math.exp(math.log(size / largest) / k))
            if k <= order - WINDOW:
                break
    return 0.1 * longest


@jitted
def defect(h, order, loop, series, slope, predicted):
    """Return how far the accelerations in `slope` are from those that the series predicts at `h`.

    In units of the tolerance of the rates, whose error is about h / order times that of their derivative at the end.
    """
    worst = 0.0
    for i in range(loop.sizes[at.NQ], loop.sizes[at.NQ] + loop.sizes[at.NV]):
        error = abs(slope[i] - predicted[i]) * h / (order * rate_tolerance(loop.control, h, i, series))
        if not error <= worst:
            worst = error
    return worst


@jitted
def scale_series(h, order, series):
    """Turn a series in time into one in the place θ within a step of length `h`, in place."""
    power = h
    for k in range(1, order + 1):
        for i in range(series.shape[1]):
            series[k, i] *= power
        power *= h


# New state, what rounding lost in it, predicted slope, what was lost before.
NEW, LOST, SLOPE, CARRY = range(4)
N_STATES = 4
EPS = float(np.finfo(float).eps)
LOWEST_ORDER = 8
COST_OF_STEP = 700.0  # operations of a step besides its series
# The least run time at a given error of the end state is that of the order which is best for steps with an error of
# 0.01 rtol^0.8, not rtol: found on six scenes (pendulum, heavy top, Andrews' mechanism, a chain of ten, stiff springs).
ERROR_FACTOR, ERROR_EXPONENT = 1e-2, 0.8
# Counters: which of the two series is that of the current state; whether its step is chosen, but not taken yet.
CURRENT, CHOSEN = 16, 17
MIN_PIVOT = 1e-6  # below it the accelerations are in doubt
# Halving a step divides a defect by 2^order, unless it is round-off: its size is kept in control[ERROR_OLD]. A jump of
# the accelerations does not shrink either, but it is larger than round-off can be.
ROUND_OFF_GAIN = 4.0
LARGEST_ROUND_OFF = 1e-9  # relative
# Behind a kink a defect begins at once, and not with a power of time as that of the terms left out does: one that grows
# with the square of time does this part of the step's length and of itself to the rates.
AT_ONCE = 1.0 / 3.0
# A step that went too far makes later ones 7 % shorter than their series promise, which is forgotten over 50 steps.
CAUTION, FORGET = 0.07, 0.98
# A float taken apart for its logarithm, the part by which steps are shorter, a number between 0 and 1, another one in
# each step, and how far series have reached lately, and for longer.
BITS, SHORTER, VARIED, REACH, FAR = range(5)
N_CELLS = 5
# Steps chosen by the state alone may fall into step with a periodic motion: then every lap rounds alike, and its errors
# add up in proportion to the laps, not to their root. At the limit of round-off, steps are shortened by up to 5 %, by
# multiples of the golden ratio modulo one, so that no two laps are alike.
MOST_VARIED, GOLDEN_RATIO = 0.05, 0.6180339887498949
# A series may reach far past the next event: a ball that hardly bounces any more leaves the floor and returns in a
# small part of the step that its parabola allows. The step after an event is this many times the time since the one
# before.
LONGER_THAN_BEFORE = 2.0
# Towards a change point, where branches of the positions that constraints allow cross, each series reaches only a part
# of the way. States off by round-off lie on a curve that turns from one branch into the other there, and ever shorter
# steps would follow it: below this part of how far series reached before, a method that steps across takes over. It
# needs accelerations that round-off, which grows with the square of that part, leaves right to its tolerance. Steps
# that shrink by little each are told by a second memory, which is longer: below a smaller part of what it holds.
CREEPS, FORGET_REACH = 1e-4, 0.9
CREEPS_FOR_LONG, FORGET_FAR = 0.25, 0.99
CREEPS_AT_MOST, CREEPS_OF_ROUND_OFF = 3e-2, 0.5


class TaylorSeries(NamedTuple):
    """How the step loop takes the method.

    Attributes
    ----------
    address : uint64
        The kernel that computes a series: see `symgen.runtime.taylor.kernel.taylor_addresses`.
    sum_address : uint64
        The kernel that sums it.
    cost_start, cost_order, cost_square : float
        A series of order p takes cost_start + cost_order p + cost_square p^2 operations.
    n_places : int
        In how many places of a step the accelerations are looked at; 0 where branches hold all choices.
    n_rows : int
        Rows of a series, one more than the highest order.
    order : int
        0: chosen by the tolerance.
    """

    address: np.uint64
    sum_address: np.uint64
    cost_start: float
    cost_order: float
    cost_square: float
    n_places: int
    n_rows: int
    order: int


@jitted
def taylor_work_size(n_rows, sizes):
    """Length of `work`: two series with their pivot ratio, the rows of NEW and what follows, five numbers."""
    return 2 * (n_rows * sizes[at.NY] + 1) + N_STATES * sizes[at.NY] + N_CELLS + finish_scratch_size(sizes)


@jitted
def order_for(method, rtol):
    """The order that needs the least time for a tolerance: operations of a step over its length, see `series_step`."""
    best, least = LOWEST_ORDER, math.inf
    left_out = math.log(ERROR_FACTOR) + ERROR_EXPONENT * math.log(max(rtol, EPS)) - 0.7
    for order in range(LOWEST_ORDER, method.n_rows - 1):
        series = method.cost_start + order * (method.cost_order + order * method.cost_square)
        time = (COST_OF_STEP + series) * math.exp(-left_out / (order - 1))
        if time < least:
            best, least = order, time
    return best


@jitted
def compute_series(method, order, loop, t, y, series):
    """Compute the coefficients at (t, y) into `series`; returns RUNNING, or why they are of no use."""
    series[0] = order
    call_kernel(method.address, t, y, loop.p, series)
    loop.counters[at.RHS_CALLS] += 1
    ratio = series[series.shape[0] - 1]
    loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], ratio)
    if not ratio >= MIN_PIVOT:
        return at.SINGULAR_MATRIX
    return at.RUNNING


@jitted
def advance_taylor(method, loop):
    """Advance with Taylor series until something is for Python to do.

    Arguments and result are those of all step loops, see docs/step-loops.md; `method` is a `TaylorSeries`.
    Dense output is the series itself. `counters[F_VALID]` says that the series of the current state is there.
    """
    ny, length = loop.sizes[at.NY], method.n_rows * loop.sizes[at.NY] + 1
    pair = loop.work[: 2 * length].reshape((2, length))
    states = loop.work[2 * length :][: N_STATES * ny].reshape((N_STATES, ny))
    cell = loop.work[2 * length + N_STATES * ny :][:N_CELLS]
    scratch = loop.work[2 * length + N_STATES * ny + N_CELLS :]
    order = method.order if method.order > 0 else order_for(method, loop.control[at.RTOL])
    done = 0
    # Its own loop: whether a watched time is near is known once the series says how far the step may go.
    while room_for_steps(loop, done):
        if not loop.counters[at.F_VALID]:
            status = compute_series(
                method, order, loop, loop.control[at.T], loop.y, pair[loop.counters[CURRENT]]
            )
            if status != at.RUNNING:
                return status
            loop.counters[at.F_VALID] = 1
        t0 = loop.control[at.T]
        status, t1 = take_step(method, order, loop, pair, states, cell, scratch)
        if status != at.RUNNING:
            return status
        old = pair[1 - loop.counters[CURRENT]][: (order + 1) * ny].reshape((order + 1, ny))
        dense_wanted = needs_dense(loop, t1)
        if dense_wanted:
            scale_series(t1 - t0, order, old)
            append_tail(order, loop.sizes, old)
        count_energy(loop)
        copy(states[NEW], loop.y)
        copy(states[LOST], states[CARRY])
        previous_event = loop.control[at.T_EVENT]
        status = finish_step(loop, t0, t1, old, -(order + 1), scratch)
        if dense_wanted:
            drop_tail(order, loop.sizes, old)
        if status == at.EVENT:
            for i in range(ny):
                states[CARRY, i] = 0.0
            cell[REACH] = 0.0
            loop.control[at.H_EVENT] = max(
                LONGER_THAN_BEFORE * (loop.control[at.T_EVENT] - previous_event),
                2.0 * smallest_step(loop.control),  # events at one instant must not end the run
            )
        if status != at.RUNNING:
            return status
        done += 1
    return at.RUNNING


@jitted
def take_step(method, order, loop, pair, states, cell, scratch):
    """Step as far as the series reaches, less where it does not: `states[NEW]` is then the new state.

    The accelerations at the new state, which its series begins with, must be those that the old series predicts.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    ny, t = loop.sizes[at.NY], loop.control[at.T]
    current = loop.counters[CURRENT]
    old = pair[current][: (order + 1) * ny].reshape((order + 1, ny))
    sums = states[NEW:CARRY].reshape(CARRY * ny)
    if not loop.counters[CHOSEN]:
        status = choose_step(order, loop, old, cell)
        if status != at.RUNNING:
            return status, t
    if watch_is_near(loop.control):
        loop.counters[CHOSEN] = 1
        return at.NEAR_WATCH, t
    loop.counters[CHOSEN] = 0
    cause, before = at.STEP_TOO_SMALL, math.inf
    while True:
        shorter = 0.5
        if not loop.control[at.H] > 0.0 or too_small(loop.control):
            return (at.NOT_FINITE if not all_finite(pair[current], (order + 1) * ny) else cause), t
        t1 = step_end(loop.control)
        h = t1 - t
        between = (
            defect_between(method, order, loop, h, pair[current], states) if method.n_places > 0 else 0.0
        )
        sums[0] = order
        call_kernel(method.sum_address, h, pair[current], states[CARRY], sums)
        add_tail(h, order, loop.sizes, old, states[NEW], states[LOST], states[SLOPE])
        cause = reach_end(method, order, loop, t1, pair, states, scratch)
        if cause == at.RUNNING:
            if t1 >= loop.control[at.T_STOP]:
                error = defect(h, order, loop, old, loop.f, states[SLOPE])
            else:
                error = defect(h, order, loop, old, pair[1 - current][ny:], states[SLOPE])
            if (
                method.n_places == 0  # what a kink leaves would be taken for round-off
                and error > max(DEFECT_LIMIT, before / ROUND_OFF_GAIN)
                and error * loop.control[at.RTOL] <= LARGEST_ROUND_OFF
            ):
                loop.control[at.ERROR_OLD] = error
            error = max(error, between)
            if error <= max(DEFECT_LIMIT, ROUND_OFF_GAIN * loop.control[at.ERROR_OLD]):
                loop.counters[CURRENT] = 1 - current
                loop.counters[at.F_VALID] = 0 if t1 >= loop.control[at.T_STOP] else 1
                cell[SHORTER] *= FORGET
                return at.RUNNING, t1
            before = error
            cause = at.STEP_TOO_SMALL
            shorter = max(0.5, 0.85 * (DEFECT_LIMIT / error) ** (1.0 / (order - 1)))
            cell[SHORTER] = min(0.5, 1.0 - (1.0 - cell[SHORTER]) * (1.0 - CAUTION))
        loop.control[at.H] = shorter * h
        loop.counters[at.REJECTED] += 1


@jitted
def defect_between(method, order, loop, h, flat, states):
    """Return the largest defect of a series in places of a step up to its end, where a choice may be another one.

    Where a choice has no value there is no number.
    """
    ny, worst = loop.sizes[at.NY], 0.0
    series = flat[: (order + 1) * ny].reshape((order + 1, ny))
    sums = states[NEW:CARRY].reshape(CARRY * ny)
    for place in range(1, method.n_places + 1):
        part = h * place / method.n_places
        sums[0] = order
        call_kernel(method.sum_address, part, flat, states[CARRY], sums)
        add_tail(part, order, loop.sizes, series, states[NEW], states[LOST], states[SLOPE])
        if not evaluate(loop, loop.control[at.T] + part, states[NEW], loop.f):
            return math.inf
        error = defect(h, order, loop, series, loop.f, states[SLOPE]) * order * AT_ONCE
        if not error <= worst:
            worst = error
    return worst


@jitted
def choose_step(order, loop, series, cell):
    """Set `control[H]` to how far the series of the current state reaches; returns RUNNING, or why to give up."""
    reach = min(series_step(order, loop, series, cell), quaternion_step(order, loop, series, cell))
    reach *= 1.0 - cell[SHORTER]
    loop.control[at.H] = min(reach, longest_step(loop.control))
    if loop.sizes[at.NM] > 0:
        # A limit of the step, or a stop, announces what is short by itself: a pulse in time.
        creeps = max(
            CREEPS, min(CREEPS_AT_MOST, CREEPS_OF_ROUND_OFF * math.sqrt(EPS / loop.control[at.RTOL]))
        )
        left = loop.control[at.T_STOP] - loop.control[at.T]
        before = max(cell[REACH], CREEPS_FOR_LONG * cell[FAR])
        if reach < creeps * min(before, longest_step(loop.control), left):
            return at.STEP_TOO_SMALL
        cell[REACH] = max(loop.control[at.H], FORGET_REACH * cell[REACH])
        cell[FAR] = max(loop.control[at.H], FORGET_FAR * cell[FAR])
    if loop.control[at.RTOL] <= ROUND_OFF_RTOL:
        cell[VARIED] = (cell[VARIED] + GOLDEN_RATIO) % 1.0
        loop.control[at.H] *= 1.0 - MOST_VARIED * cell[VARIED]
    if loop.control[at.H_EVENT] > 0.0:  # known to no work array: the form may be another one by now
        loop.control[at.H] = min(loop.control[at.H], loop.control[at.H_EVENT])
        loop.control[at.H_EVENT] = 0.0
    return at.RUNNING


@jitted
def reach_end(method, order, loop, t1, pair, states, scratch):
    """Project the new state and compute its series; at a stop time, only its derivative."""
    y_new = states[NEW]
    if loop.addresses[at.PROJECT] != 0:
        if project_state(loop, t1, y_new, scratch[: projection_size(loop.sizes)]):
            return at.PROJECTION_FAILED
        scale_energy(loop, t1, y_new, scratch)
        for i in range(loop.sizes[at.NY]):
            states[LOST, i] = 0.0
    if t1 >= loop.control[at.T_STOP]:
        return at.RUNNING if evaluate(loop, t1, y_new, loop.f) else at.NOT_FINITE
    series = pair[1 - loop.counters[CURRENT]]
    status = compute_series(method, order, loop, t1, y_new, series)
    if status != at.RUNNING and loop.sizes[at.NM] > 0:
        return status
    return at.RUNNING if all_finite(series, 2 * loop.sizes[at.NY]) else at.NOT_FINITE
