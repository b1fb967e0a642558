"""What follows most events, in machine code: resets of free coordinates, records, impacts on a stop that stays open.

It is what `event_actions.py` and `contact/switching.py` do of such an event, which take a hundred times as long; of
constrained models, records and impacts. All else is left to them: several events at one instant, resets of constrained
coordinates, constraints that depend on each other, frictions, what stays closed, what ends the run.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite, copy

# Addresses: those behind FIRST_RESET are the kernels of resets, in the order of the events; 0 for other actions.
ADVANCE, EVENTS, RHS, ENERGY, MASS, FORCES, SWITCHES, JACOBIAN, RESIDUAL, GAMMA, FIRST_RESET = range(11)
RECORDS, RESETS, TERMINATES, BY_PYTHON = range(4)  # what an event of the model's own does
# What becomes of an event.
ACTED, NOT_PLAIN, PILES_UP, ENDS = range(4)
ZENO = 10  # status of `advance_over_events`: acted on, and events pile up at `sums[ACCUMULATION]`
N_LOG, N_INTERVALS, IS_ADAPTIVE, MAY_JUMP = range(4)  # in `counts`
# In `sums`; no reset so far: nan. NOISE: what of numbers in a state is round-off, relative.
RESET_ENERGY, LAST_RESET, ACCUMULATION, NOISE = range(4)
# Of a row of the log; the states before and after follow, then the work that was done up to it.
EVENT, TIME, CHANGE, NEXT_FRAME, FIRST_STATE = range(5)
MOST_INTERVALS = 64
ROUND_OFF = 4.0 * float(np.finfo(float).eps)
ON_CONSTRAINTS = 4.0  # times round-off: `event_actions._PROJECTION_NOISE`
EPS = float(np.finfo(float).eps)
CLEAR, PART_OF_FLIGHT, AHEAD = 8.0, 1e-2, 1e-6
# Of the largest number of a state: as good as zero for the argument of a choice. A rate that sticks is off by more than
# the round-off of itself.
NOTHING = 1e-3 * EPS
# Times its change in the last digits of time behind an event: a function that changed so much more in those before it
# has jumped.
JUMPED = 1e6
ZENO_SHRINKAGE, ZENO_EVENTS = 1e-7, 5
SURELY_SEEN, LED, PLAINLY = 64.0, 1e-12, 1e-6
# Of a pivot: less is left of a mass, or of a constraint, that (nearly) follows from those before it.
SINGULAR_MASS, DEPENDENT = 1e-12, 1e-8
AT_STOP = 64.0 * EPS  # relative: an event as near to where the call ends is acted on with what changes there
# Relative, as in `event_actions`: an event as near to the start of a step is where that begins.
BEGINNING = 32.0 * EPS
MANY = (
    64  # constraints, as in `contact/local_dynamics.py`: it is not looked what coordinates these tie to which
)


class After(NamedTuple):
    """What acting on events takes.

    Attributes
    ----------
    addresses : ndarray of uint64
    block, result : ndarray
        Of the step loop's `CallBlock`.
    actions, directions : ndarray of int64, shape (number of events but for stops,)
    everything : ndarray, shape (n_p,)
        `p` with all stops closed, as the rows of their gaps are found.
    switches_at : ndarray of int64
        Where it says that they are.
    gaps, constraints : ndarray of int64, shapes (n_stops,), (m,)
        Which rows of the closed form are those of stops, and of the model's constraints.
    sums, intervals : ndarray, shapes (4,), (MOST_INTERVALS,)
    counts : ndarray of int64, shape (4,)
    lowest : ndarray, shape (number of stops,)
        The least gap of each stop at the ends of steps.
    log : ndarray, shape (n, FIRST_STATE + 2 (nq + nv) + 1)
    before, slope, moved, row : ndarray, shapes (nq + nv,) thrice, (n_row,)
    values, g, floor, other : ndarray, shape (NE,)
    energy, switches : ndarray, shapes (2,), (2 * number of stops,)
    jacobian, residual, gamma : ndarray
        Of the closed form: shapes (n * nv,), (nh + n,), (n,) for n stops and constraints.
    mass, response, forces : ndarray, shapes (nv * nv,), (nv,), (nv,)
    reached : ndarray, shape (nv,)
        Of which coordinates a gap is made.
    held, gram, multipliers : ndarray, shapes (m * nv,), (m * m,), (m,)
        L⁻¹Gᵀ, row by row, its products among each other, which are factored, and what constraints take.
    """

    addresses: np.ndarray
    block: np.ndarray
    result: np.ndarray
    actions: np.ndarray
    directions: np.ndarray
    everything: np.ndarray
    switches_at: np.ndarray
    gaps: np.ndarray
    constraints: np.ndarray
    sums: np.ndarray
    intervals: np.ndarray
    counts: np.ndarray
    lowest: np.ndarray
    log: np.ndarray
    before: np.ndarray
    slope: np.ndarray
    moved: np.ndarray
    row: np.ndarray
    values: np.ndarray
    g: np.ndarray
    floor: np.ndarray
    other: np.ndarray
    energy: np.ndarray
    switches: np.ndarray
    jacobian: np.ndarray
    residual: np.ndarray
    gamma: np.ndarray
    mass: np.ndarray
    response: np.ndarray
    forces: np.ndarray
    reached: np.ndarray
    held: np.ndarray
    gram: np.ndarray
    multipliers: np.ndarray


@jitted
def advance_over_events(loop, after):
    """Call the step loop, and act on plain events, until something is for Python to do.

    Returns
    -------
    int
        A status of the step loop, EVENT where Python is to act, or ZENO.
    """
    last = loop.counters[at.STEPS] + loop.counters[at.MAX_STEPS_PER_CALL]
    while True:
        call_kernel(after.addresses[ADVANCE], 0.0, after.block, after.block, after.result)
        status = int(after.result[0])
        if status != at.EVENT or is_at_break(loop):
            return status
        done = act(loop, after)
        if done == PILES_UP:
            return ZENO
        if done != ACTED:
            return status
        if not has_room(last, loop) or after.counts[N_LOG] >= after.log.shape[0]:
            return at.RUNNING


@jitted
def is_at_break(loop):
    """Whether an event lies where the call ends or a step began, but for round-off of time: for Python.

    Inputs change where calls end. What fires where a step begins has jumped there, with an input or with time, and is
    past zero for good (`event_actions.past_event`).
    """
    t = loop.control[at.T]
    at_stop = loop.control[at.T_STOP] - t <= AT_STOP * max(abs(loop.control[at.T_START]), abs(t))
    return at_stop or loop.control[at.H_LAST] <= BEGINNING * abs(t)


@jitted
def has_room(last, loop):
    """Whether there are steps left until the number `last` of them, and room for them in the log; sets how many."""
    loop.counters[at.MAX_STEPS_PER_CALL] = last - loop.counters[at.STEPS]
    is_full = loop.counters[at.N_LOGGED_STEPS] >= loop.step_log.shape[0]
    return loop.counters[at.MAX_STEPS_PER_CALL] >= 1 and not is_full


@jitted
def fired_alone(loop):
    """Return the event that has fired; -1 where several have, at one instant."""
    ne, event = loop.sizes[at.NE], -1
    for e in range(ne):
        if loop.control[at.N_CONTROL + at.FIRED * ne + e] == 1.0:
            if event >= 0:
                return -1
            event = e
    return event


@jitted
def act(loop, after):
    """Act on the event at which a step loop has returned; returns what became of it."""
    n_own = after.actions.shape[0]
    event = fired_alone(loop)
    if event < 0 or after.counts[N_LOG] >= after.log.shape[0]:
        return NOT_PLAIN
    if event < n_own and after.actions[event] == TERMINATES:
        return ENDS
    if event < n_own and after.actions[event] == BY_PYTHON:
        return NOT_PLAIN
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    copy(loop.y[:n], after.before)
    call_kernel(after.addresses[EVENTS], loop.control[at.T], loop.y, loop.p, after.values)
    if event < n_own and after.counts[MAY_JUMP] and has_jumped(event, loop, after):
        return NOT_PLAIN
    if event < n_own and after.actions[event] == RECORDS:
        note_gaps(loop, after)
        write_log(event, 0.0, math.nan, loop, after)
        loop.counters[at.F_VALID] = 0
        renew_bands(event, loop, after)
        return ACTED
    energy = total_energy(loop, after)
    against = False
    if event < n_own:
        against = moves_against(event, loop, after)
        for k in range(n):
            after.moved[k] = 0.0
        call_kernel(
            after.addresses[FIRST_RESET + event], loop.control[at.T], after.before, loop.p, after.moved
        )
        if not all_finite(after.moved, n):
            return NOT_PLAIN
        copy(after.moved, loop.y)
        if not are_open(-1, loop, after):
            copy(after.before, loop.y)
            return NOT_PLAIN
    elif not strike(event - n_own, loop, after):
        copy(after.before, loop.y)
        return NOT_PLAIN
    note_gaps(loop, after)
    change = total_energy(loop, after) - energy
    work = math.nan
    if event >= n_own and loop.sizes[at.NW] > 0:
        work = loop.y[n] + after.sums[RESET_ENERGY]
    after.sums[RESET_ENERGY] += change
    write_log(event, change, work, loop, after)
    loop.counters[at.F_VALID] = 0
    loop.control[at.ERROR_OLD] = 1e-4
    loop.counters[at.LAST_REJECTED] = 0
    arm(event, True, loop, after)
    status = ACTED
    if event < n_own and look_for_pile(event, against, loop, after):
        status = PILES_UP
    if after.counts[IS_ADAPTIVE]:
        loop.control[at.H] = 0.0
    return status


@jitted
def total_energy(loop, after):
    """Return T + V at the present state."""
    call_kernel(after.addresses[ENERGY], loop.control[at.T], loop.y, loop.p, after.energy)
    return after.energy[0] + after.energy[1]


@jitted
def write_log(event, change, work, loop, after):
    """Write a row of the log."""
    n = after.before.shape[0]
    row = after.log[after.counts[N_LOG]]
    row[EVENT], row[TIME], row[CHANGE] = event, loop.control[at.T], change
    row[NEXT_FRAME] = loop.counters[at.NEXT_FRAME]
    copy(after.before, row[FIRST_STATE : FIRST_STATE + n])
    copy(loop.y[:n], row[FIRST_STATE + n : FIRST_STATE + 2 * n])
    row[FIRST_STATE + 2 * n] = work
    after.counts[N_LOG] += 1


@jitted
def note_gaps(loop, after):
    """Take note of how low gaps have been since the last time."""
    ne, n_own = loop.sizes[at.NE], after.actions.shape[0]
    if after.lowest.shape[0] == 0:
        return
    first = at.N_CONTROL + at.LOWEST * ne
    for i in range(after.lowest.shape[0]):
        after.lowest[i] = min(after.lowest[i], loop.control[first + n_own + i])
    for e in range(ne):
        loop.control[first + e] = math.inf


@jitted
def find_slope(loop, after):
    """Write the derivative of the present state to `slope`."""
    call_kernel(after.addresses[RHS], loop.control[at.T], loop.y, loop.p, after.row)
    copy(after.row[: after.slope.shape[0]], after.slope)


@jitted
def find_values_ahead(dt, loop, after, values):
    """Write the event functions where the slope leads in a time `dt` to `values`."""
    for k in range(after.slope.shape[0]):
        after.moved[k] = loop.y[k] + dt * after.slope[k]
    call_kernel(after.addresses[EVENTS], loop.control[at.T] + dt, after.moved, loop.p, values)


@jitted
def has_jumped(event, loop, after):
    """Whether a function that has fired jumped over zero: `event_actions.has_jumped`."""
    here = after.values[event]
    find_slope(loop, after)
    find_values_beside(-1.0, loop, after, after.other)
    before = after.other[event]
    if not here * before < 0.0:
        return False
    find_values_beside(1.0, loop, after, after.other)
    return abs(here - before) > JUMPED * (abs(after.other[event] - here) + EPS * abs(here))


@jitted
def find_values_beside(way, loop, after, values):
    """Write the event functions as far along the motion (1) or back (-1) as the last digits go to `values`."""
    noise = after.sums[NOISE]
    dt = noise * abs(loop.control[at.T])
    for k in range(after.slope.shape[0]):
        y, slope = loop.y[k], after.slope[k]
        after.moved[k] = y + way * (dt * slope + noise * abs(y) * sign(slope))
    call_kernel(after.addresses[EVENTS], loop.control[at.T] + way * dt, after.moved, loop.p, values)


@jitted
def find_values_and_floor(loop, after):
    """Write event functions to `g`, and what of them is round-off to `floor`: see `event_values_and_floor`."""
    n, ne, t, noise = after.slope.shape[0], loop.sizes[at.NE], loop.control[at.T], after.sums[NOISE]
    dt = noise * abs(t)
    find_slope(loop, after)
    call_kernel(after.addresses[EVENTS], t, loop.y, loop.p, after.g)
    for e in range(ne):
        after.floor[e] = 0.0
    copy(loop.y[:n], after.moved)
    call_kernel(after.addresses[EVENTS], t + dt, after.moved, loop.p, after.other)
    add_change(after)
    for k in range(n):
        after.moved[k] = loop.y[k] + noise * abs(loop.y[k])
        call_kernel(after.addresses[EVENTS], t, after.moved, loop.p, after.other)
        add_change(after)
        after.moved[k] = loop.y[k]
    find_values_ahead(dt, loop, after, after.other)
    add_change(after)
    for e in range(ne):
        if not math.isfinite(after.floor[e]):
            after.floor[e] = 0.0


@jitted
def add_change(after):
    """Add what the event functions differ by from `g` to `floor`."""
    for e in range(after.g.shape[0]):
        after.floor[e] += abs(after.other[e] - after.g[e])


@jitted
def renew_bands(event, loop, after):
    """Find anew what of the event functions is as good as zero: see `event_actions.renew_bands`."""
    ne = loop.sizes[at.NE]
    find_values_and_floor(loop, after)
    for e in range(ne):
        band = after.floor[e]
        if e == event:
            band += abs(after.g[e])
        if is_jump(e, loop):
            band = max(band, NOTHING * largest(loop))
        loop.control[at.N_CONTROL + at.FLOOR * ne + e] = after.floor[e]
        if not math.isinf(loop.control[at.N_CONTROL + at.BAND * ne + e]):
            loop.control[at.N_CONTROL + at.BAND * ne + e] = band


@jitted
def arm(event, has_fired, loop, after):
    """Set on which side of zero the event functions are: see `event_actions.arm_events`.

    Parameters
    ----------
    event : int
        The one that has fired.
    has_fired : bool
        False at the start of a run.
    """
    ne, n_own = loop.sizes[at.NE], after.actions.shape[0]
    find_values_and_floor(loop, after)
    heading = 0.0
    if has_fired and event < n_own:
        heading = heading_of(event, loop, after)
    if ne > n_own:
        find_stops(loop, after)
    for e in range(ne):
        side_at = at.N_CONTROL + at.SIDE * ne + e
        fired = has_fired and e == event
        g, floor, lean = after.g[e], after.floor[e], sign(loop.control[side_at])
        if has_fired and abs(after.values[e]) > CLEAR * floor:
            lean = 0.0
        band = floor
        if fired:
            # A reset may carry its own function away, from where it comes again.
            band += min(abs(g), abs(after.values[e]))
            lean = heading
        if e >= n_own:
            lean = 1.0
            sunk = max(0.0, -g)
            if fired:
                sunk *= 2.0  # what sinks although its rates rise fires a few times, not for ever
            band = max(floor, band_of(e - n_own, loop, after)) + sunk
        if is_jump(e, loop):
            band = max(band, NOTHING * largest(loop))
        loop.control[at.N_CONTROL + at.FLOOR * ne + e] = floor
        loop.control[at.N_CONTROL + at.BAND * ne + e] = band
        loop.control[side_at] = sign(g) if abs(g) > band else at.LEANING * lean


@jitted
def is_jump(event, loop):
    """Whether an event is that of a choice which a force makes."""
    return loop.control[at.N_CONTROL + at.BRANCH * loop.sizes[at.NE] + event] > 0.0


@jitted
def largest(loop):
    """Return the largest magnitude of coordinates and rates."""
    found = 0.0
    for k in range(loop.sizes[at.NQ] + loop.sizes[at.NV]):
        found = max(found, abs(loop.y[k]))
    return found


@jitted
def sign(x):
    """Return 1, -1 or 0."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@jitted
def heading_of(event, loop, after):
    """Return the sign of an event function's rate by the motion of the coordinates: see `event_actions._heading`."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    speed, size = 0.0, 1.0
    for k in range(nq):
        size = max(size, abs(loop.y[k]))
    for k in range(nq, nq + nv):
        speed = max(speed, abs(loop.y[k]))
    if not math.isfinite(speed) or speed == 0.0:
        return 0.0
    dt = AHEAD * size / speed
    for k in range(nq):
        after.moved[k] = loop.y[k] + dt * loop.y[nq + k]
        after.moved[nq + k] = loop.y[nq + k]
    call_kernel(after.addresses[EVENTS], loop.control[at.T] + dt, after.moved, loop.p, after.other)
    rise = after.other[event] - after.g[event]
    return sign(rise) if abs(rise) > CLEAR * after.floor[event] else 0.0


@jitted
def moves_against(event, loop, after):
    """Whether an event moves against the direction that it waits for: its flight was below the tolerance."""
    last = after.sums[LAST_RESET]
    dt = PART_OF_FLIGHT * (loop.control[at.T] - last) if last == last else 0.0
    if dt == 0.0:
        return False
    find_slope(loop, after)
    find_values_ahead(-dt, loop, after, after.other)
    before = after.other[event]
    find_values_ahead(dt, loop, after, after.other)
    return after.directions[event] * (after.other[event] - before) < 0.0


@jitted
def look_for_pile(event, against, loop, after):
    """Take the time of a reset; whether resets pile up: `event_actions.ZenoDetector`."""
    t, last, n = loop.control[at.T], after.sums[LAST_RESET], after.counts[N_INTERVALS]
    after.sums[LAST_RESET] = t
    if not last == last:
        return False
    interval, gets_away = t - last, not against
    if gets_away and n > 0 and 0.0 < interval < after.intervals[n - 1]:
        half = 0.5 * (interval * interval / after.intervals[n - 1])
        find_slope(loop, after)
        find_values_ahead(half, loop, after, after.other)
        ne = loop.sizes[at.NE]
        floor = loop.control[at.N_CONTROL + at.FLOOR * ne + event]
        gets_away = half == 0.0 or abs(after.other[event]) > CLEAR * floor
    while n > 0 and after.intervals[n - 1] < interval:
        n -= 1
    if n == MOST_INTERVALS:
        for k in range(n // 2, n - 1):
            after.intervals[k] = after.intervals[k + 1]
        n -= 1
    after.intervals[n] = interval
    n += 1
    after.counts[N_INTERVALS] = n
    if n < ZENO_EVENTS:
        return False
    if gets_away and interval > max(ZENO_SHRINKAGE * after.intervals[0], 64.0 * EPS * abs(t)):
        return False
    before = after.intervals[n - 2]
    ratio = interval / before if before > 0.0 else 0.0
    after.sums[ACCUMULATION] = t + interval * ratio / (1.0 - ratio) if ratio < 1.0 else t
    return True


@jitted
def find_stops(loop, after):
    """Write the rows of gaps and their rates at the present state to `jacobian` and `residual`."""
    call_kernel(after.addresses[JACOBIAN], loop.control[at.T], loop.y, after.everything, after.jacobian)
    call_kernel(after.addresses[RESIDUAL], loop.control[at.T], loop.y, after.everything, after.residual)


@jitted
def size_of_gap(i, loop, after):
    """Return the largest of the coordinates that a gap is made of, at least 1: `LocalDynamics.sizes`."""
    nv, m, largest = loop.sizes[at.NV], after.constraints.shape[0], 1.0
    for j in range(nv):
        largest = max(largest, abs(loop.y[j]))
    if largest == 1.0 or m > MANY:
        return largest
    row = after.gaps[i] * nv
    for j in range(nv):
        after.reached[j] = 1.0 if after.jacobian[row + j] != 0.0 else 0.0
    grows = True
    while grows:  # errors of others come to these by constraints alone
        grows = False
        for c in range(m):
            row = after.constraints[c] * nv
            ties, is_wider = False, False
            for j in range(nv):
                if after.jacobian[row + j] != 0.0:
                    ties |= after.reached[j] == 1.0
                    is_wider |= after.reached[j] == 0.0
            if ties and is_wider:
                grows = True
                for j in range(nv):
                    if after.jacobian[row + j] != 0.0:
                        after.reached[j] = 1.0
    size = 1.0
    for j in range(nv):
        if after.reached[j] == 1.0:
            size = max(size, abs(loop.y[j]))
    return size


@jitted
def row_sum(i, nv, after):
    """Return the sum of the magnitudes of the row of a gap."""
    total, row = 0.0, after.gaps[i] * nv
    for j in range(nv):
        total += abs(after.jacobian[row + j])
    return total


@jitted
def gap_tolerance(i, loop, after):
    """Return how much of a gap the tolerances of the run leave open: `Instant._gap_tolerances`."""
    rows, size = row_sum(i, loop.sizes[at.NV], after), size_of_gap(i, loop, after)
    allowed = rows * (loop.control[at.ATOL] + loop.control[at.RTOL] * size)
    return max(allowed, SURELY_SEEN * EPS * rows * size)


@jitted
def speed_tolerance(i, loop, after):
    """Return which rates of a gap are as good as zero: `Instant._speed_tolerances`."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    moved, row = 0.0, after.gaps[i] * nv
    for j in range(nv):
        moved += abs(after.jacobian[row + j]) * abs(loop.y[nq + j])
    rows = row_sum(i, nv, after)
    return rows * (loop.control[at.ATOL] + 1e-15) + max(loop.control[at.RTOL], 1e-15) * moved


@jitted
def speed_of(i, after):
    """Return the rate of a gap."""
    return after.residual[after.residual.shape[0] - after.gamma.shape[0] + after.gaps[i]]


@jitted
def band_of(i, loop, after):
    """Return how far below zero an open gap counts as zero: `Instant.bands`."""
    return 0.0 if abs(speed_of(i, after)) > speed_tolerance(i, loop, after) else gap_tolerance(i, loop, after)


@jitted
def are_open(but, loop, after):
    """Whether all gaps but one are more than what tolerances leave open; finds their rows, too."""
    if after.lowest.shape[0] == 0:
        return True
    find_stops(loop, after)
    call_kernel(after.addresses[SWITCHES], loop.control[at.T], loop.y, loop.p, after.switches)
    for k in range(after.lowest.shape[0]):
        if k != but and not after.switches[2 * k] > gap_tolerance(k, loop, after):
            return False
    return True


@jitted
def strike(i, loop, after):
    """Change the rates by an impact on a stop, if that is all that happens; whether it was.

    One gap is closed, its rate is negative, and behind the impact the flight is one that the run sees: by Newton's law
    the rate then is -e times what it was.
    """
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    if not are_open(i, loop, after):
        return False
    closing, restitution = speed_of(i, after), after.switches[2 * i + 1]
    if not (closing < 0.0 and 0.0 < restitution <= 1.0):
        return False
    for k in range(nv * nv):
        after.mass[k] = 0.0  # structural zeros are not written, and factors fill them
    call_kernel(after.addresses[MASS], t, loop.y, loop.p, after.mass)
    alone, row = 0.0, after.gaps[i] * nv
    for j in range(nv):
        if after.mass[j * nv + j] > 0.0:
            alone += after.jacobian[row + j] * after.jacobian[row + j] / after.mass[j * nv + j]
    if not factor(nv, after.mass, SINGULAR_MASS) or not factor_constraints(nv, after):
        return False
    copy(after.jacobian[row : row + nv], after.response)
    forward(nv, after.mass, after.response)
    keep_to_constraints(nv, 0.0, after, after.response)
    back(nv, after.mass, after.response)
    compliance = 0.0
    for j in range(nv):
        compliance += after.jacobian[row + j] * after.response[j]
    if not compliance > LED * alone:
        return False
    impulse = -(1.0 + restitution) * closing / compliance
    for j in range(nv):
        loop.y[nq + j] += after.response[j] * impulse
    return flies(i, loop, after)


@jitted
def flies(i, loop, after):
    """Whether a gap that nothing else keeps open will open so far that the run sees it: `Holding._landed`."""
    nv, t, row = loop.sizes[at.NV], loop.control[at.T], after.gaps[i] * loop.sizes[at.NV]
    find_stops(loop, after)
    for j in range(nv):
        after.forces[j] = 0.0
    call_kernel(after.addresses[FORCES], t, loop.y, loop.p, after.forces)
    call_kernel(after.addresses[GAMMA], t, loop.y, after.everything, after.gamma)
    forward(nv, after.mass, after.forces)
    keep_to_constraints(nv, 1.0, after, after.forces)
    back(nv, after.mass, after.forces)
    free = -after.gamma[after.gaps[i]]
    for j in range(nv):
        free += after.jacobian[row + j] * after.forces[j]
    speed = speed_of(i, after)
    if not (math.isfinite(free) and speed > speed_tolerance(i, loop, after)):
        return False
    if free >= 0.0:
        return True  # nothing presses it shut
    flight = speed * speed
    return flight + 2.0 * free * gap_tolerance(i, loop, after) > PLAINLY * flight


@jitted
def factor_constraints(nv, after):
    """Write L⁻¹Gᵀ of the model's constraints, and the factor of its products; whether they are independent."""
    m = after.constraints.shape[0]
    for c in range(m):
        own, row = after.held[c * nv : (c + 1) * nv], after.constraints[c] * nv
        copy(after.jacobian[row : row + nv], own)
        forward(nv, after.mass, own)
        for d in range(c + 1):
            total = 0.0
            for j in range(nv):
                total += own[j] * after.held[d * nv + j]
            after.gram[c * m + d] = total
    return factor(m, after.gram, DEPENDENT)


@jitted
def keep_to_constraints(nv, part, after, x):
    """Change x = L⁻¹f so that G a = part γ with a = L⁻ᵀx; a second time, for what round-off has left."""
    m = after.constraints.shape[0]
    for _ in range(2 if m > 0 else 0):
        for c in range(m):
            left = part * after.gamma[after.constraints[c]]
            for j in range(nv):
                left -= after.held[c * nv + j] * x[j]
            after.multipliers[c] = left
        solve(m, after.gram, after.multipliers)
        for c in range(m):
            for j in range(nv):
                x[j] += after.held[c * nv + j] * after.multipliers[c]


@jitted
def factor(n, matrix, least):
    """Factor a symmetric positive definite matrix, row by row, into L Lᵀ in place; whether that is possible.

    Parameters
    ----------
    n : int
    matrix : ndarray, shape (n * n,)
        Its lower triangle is read.
    least : float
        What must be left of each number on the diagonal, as a part of it.
    """
    for j in range(n):
        pivot = matrix[j * n + j]
        size = pivot
        for k in range(j):
            pivot -= matrix[j * n + k] * matrix[j * n + k]
        if not (pivot > least * size and math.isfinite(pivot)):
            return False
        matrix[j * n + j] = math.sqrt(pivot)
        for i in range(j + 1, n):
            for k in range(j):
                matrix[i * n + j] -= matrix[i * n + k] * matrix[j * n + k]
            matrix[i * n + j] /= matrix[j * n + j]
    return True


@jitted
def solve(n, lower, x):
    """Solve with the factors of `factor`, in place."""
    forward(n, lower, x)
    back(n, lower, x)


@jitted
def forward(n, lower, x):
    """Replace x by L⁻¹x."""
    for i in range(n):
        for k in range(i):
            x[i] -= lower[i * n + k] * x[k]
        x[i] /= lower[i * n + i]


@jitted
def back(n, lower, x):
    """Replace x by L⁻ᵀx."""
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= lower[k * n + i] * x[k]
        x[i] /= lower[i * n + i]


@jitted
def begin_events(loop, after):
    """Arm the events at the start of a run; whether that is all there is to do."""
    copy(loop.p[: after.everything.shape[0]], after.everything)
    for k in range(after.switches_at.shape[0]):
        after.everything[after.switches_at[k]] = 1.0
    after.counts[N_LOG] = after.counts[N_INTERVALS] = 0
    after.sums[RESET_ENERGY] = 0.0
    after.sums[LAST_RESET] = math.nan
    for i in range(after.lowest.shape[0]):
        after.lowest[i] = math.inf
    if not are_open(-1, loop, after):
        return False
    arm(0, False, loop, after)
    return True
