"""Taylor series of the whole motion: one kernel gives all coefficients, steps are as long as the series reach."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.energy_scaling import count_energy, scale_energy
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.step_control import (
    longest_step,
    room_for_steps,
    step_end,
    too_small,
    watch_is_near,
)
from symgen.runtime.integrate.taylor.step import (
    DEFECT_LIMIT,
    ROUND_OFF_RTOL,
    defect,
    quaternion_step,
    scale_series,
    series_step,
)
from symgen.runtime.integrate.taylor.tail import add_tail, append_tail, drop_tail

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
# A step that went too far makes later ones 7 % shorter than their series promise, which is forgotten over 50 steps.
CAUTION, FORGET = 0.07, 0.98
# A float taken apart for its logarithm, the part by which steps are shorter, a limit of the next step (0: none), a
# number between 0 and 1, another one in each step, and how far series have reached lately.
BITS, SHORTER, LIMIT, VARIED, REACH = range(5)
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
# needs accelerations that round-off, which grows with the square of that part, leaves right to its tolerance.
CREEPS, FORGET_REACH = 1e-4, 0.9
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
            least = max(2.0 * loop.control[at.H_MIN], 8.0 * EPS * abs(loop.control[at.T]))
            cell[LIMIT] = max(LONGER_THAN_BEFORE * (loop.control[at.T_EVENT] - previous_event), least)
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
                error > max(DEFECT_LIMIT, before / ROUND_OFF_GAIN)
                and error * loop.control[at.RTOL] <= LARGEST_ROUND_OFF
            ):
                loop.control[at.ERROR_OLD] = error
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
        if reach < creeps * min(cell[REACH], longest_step(loop.control), left):
            return at.STEP_TOO_SMALL
        cell[REACH] = max(loop.control[at.H], FORGET_REACH * cell[REACH])
    if loop.control[at.RTOL] <= ROUND_OFF_RTOL:
        cell[VARIED] = (cell[VARIED] + GOLDEN_RATIO) % 1.0
        loop.control[at.H] *= 1.0 - MOST_VARIED * cell[VARIED]
    if cell[LIMIT] > 0.0:
        loop.control[at.H] = min(loop.control[at.H], cell[LIMIT])
        cell[LIMIT] = 0.0
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
