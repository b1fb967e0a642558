"""What follows most events, in machine code: resets, records, impacts on stops that stay open.

It is what `event_actions.py` and `contact/switching.py` do of the events of one instant, which take a hundred times as
long. All else is left to them: constraints that depend on each other, frictions, what stays closed, more than two stops
that are struck at one instant and move each other, what ends the run beside other events.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite, copy
from symgen.runtime.integrate.projection import project_state

# Addresses: those behind FIRST_RESET are the kernels of resets, in the order of the events; 0 for other actions.
ADVANCE, EVENTS, RHS, ENERGY, MASS, FORCES, SWITCHES, JACOBIAN, RESIDUAL, GAMMA = range(10)
# Of the model's constraints alone; they take what is worked out of `p`.
OWN_JACOBIAN, OWN_RESIDUAL, FIRST_RESET = range(10, 13)
RECORDS, RESETS, TERMINATES, BY_PYTHON = range(4)  # what an event of the model's own does
# What becomes of an event.
ACTED, NOT_PLAIN, PILES_UP, ENDS = range(4)
ZENO = 10  # status of `advance_over_events`: acted on, and events pile up at `sums[ACCUMULATION]`
N_LOG, N_INTERVALS, IS_ADAPTIVE, MAY_JUMP = range(4)  # in `counts`
ONE_BY_ONE = 4  # the same: stops that are struck at one instant are so one after another, or share a name
N_COUNTS = 5
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
MOST_STRUCK = 4  # stops at one instant
CLEARLY_PRESSED = 1e-9  # of the changes of rates that impulses make
MOST_REFINEMENTS, MASSLESS, SOLVED = 3, 1e-10, 1e-12  # as in `nearest_point.rates_after_reset`
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
    counts : ndarray of int64, shape (N_COUNTS,)
    lowest : ndarray, shape (number of stops,)
        The least gap of each stop at the ends of steps.
    log : ndarray, shape (n, FIRST_STATE + 2 (nq + nv) + 1)
    first, before, slope, moved, row : ndarray, shapes (nq + nv,) four times, (n_row,)
        The first is the state before all events of an instant.
    values, g, floor, other : ndarray, shape (NE,)
    energy, switches : ndarray, shapes (2,), (2 * number of stops,)
    jacobian, residual, gamma : ndarray
        Of the closed form: shapes (n * nv,), (nh + n,), (n,) for n stops and constraints.
    mass, forces : ndarray, shapes (nv * nv,), (nv,)
    struck : ndarray of int64, shape (MOST_STRUCK,)
    response, compliance, impulses : ndarray, shapes (MOST_STRUCK, nv), (MOST_STRUCK, MOST_STRUCK), (MOST_STRUCK,)
        Of the stops that are struck.
    reached : ndarray, shape (nv,)
        Of which coordinates a gap is made.
    held, gram, multipliers : ndarray, shapes (m * nv,), (m * m,), (m,)
        L⁻¹Gᵀ, row by row, its products among each other, which are factored, and what constraints take.
    own_jacobian, own_residual, projected : ndarray, shapes (m * nv,), (nh + m,), (nq + nv + nh + m,)
    places : ndarray of int64, shape (nv,)
        Rates that a reset leaves to the constraints.
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
    first: np.ndarray
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
    forces: np.ndarray
    struck: np.ndarray
    response: np.ndarray
    compliance: np.ndarray
    impulses: np.ndarray
    reached: np.ndarray
    held: np.ndarray
    gram: np.ndarray
    multipliers: np.ndarray
    own_jacobian: np.ndarray
    own_residual: np.ndarray
    projected: np.ndarray
    places: np.ndarray


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
def has_fired(event, loop):
    """Whether an event is one of those of this instant."""
    return loop.control[at.N_CONTROL + at.FIRED * loop.sizes[at.NE] + event] == 1.0


@jitted
def act(loop, after):
    """Act on the events at which a step loop has returned; returns what became of them."""
    n, event = after.before.shape[0], fired_alone(loop)
    if 0 <= event and event < after.actions.shape[0] and after.actions[event] == TERMINATES:
        return ENDS
    is_plain, is_reset, n_struck = look_at_fired(loop, after)
    if not is_plain:
        return NOT_PLAIN
    call_kernel(after.addresses[EVENTS], loop.control[at.T], loop.y, loop.p, after.values)
    if after.counts[MAY_JUMP] and some_jumped(loop, after):
        return NOT_PLAIN
    copy(loop.y[:n], after.first)
    energy, n_logged = after.sums[RESET_ENERGY], after.counts[N_LOG]
    against = is_reset and moves_against(loop, after)
    if not (act_on_own(loop, after) and act_on_stops(n_struck, is_reset, loop, after)):
        copy(after.first, loop.y)
        after.sums[RESET_ENERGY], after.counts[N_LOG] = energy, n_logged
        return NOT_PLAIN
    note_gaps(loop, after)
    loop.counters[at.F_VALID] = 0
    if not is_reset and n_struck == 0:
        renew_bands(loop, after)
        return ACTED
    if math.isfinite(loop.control[at.ENERGY_LEVEL]):
        loop.control[at.ENERGY_LEVEL] = energy_to_keep(loop, after)
    loop.control[at.ERROR_OLD] = 1e-4
    loop.counters[at.LAST_REJECTED] = 0
    arm(True, loop, after)
    status = ACTED
    if is_reset and look_for_pile(against, loop, after):
        status = PILES_UP
    if after.counts[IS_ADAPTIVE]:
        loop.control[at.H] = 0.0
    return status


@jitted
def look_at_fired(loop, after):
    """Look at the events of this instant, and list stops among them in `struck`.

    Returns
    -------
    is_plain, is_reset : bool
        Whether all of them can be acted on here, and one of them resets.
    n_struck : int
    """
    n_own, n_fired, n_struck, is_reset = after.actions.shape[0], 0, 0, False
    for e in range(loop.sizes[at.NE]):
        if not has_fired(e, loop):
            continue
        n_fired += 1
        if e >= n_own:
            if n_struck == MOST_STRUCK:
                return False, is_reset, n_struck
            after.struck[n_struck] = e - n_own
            n_struck += 1
        elif after.actions[e] == RESETS:
            is_reset = True
        elif after.actions[e] != RECORDS:
            return False, is_reset, n_struck
    is_plain = after.counts[N_LOG] + n_fired <= after.log.shape[0]
    is_plain = is_plain and (n_struck <= 1 or after.counts[ONE_BY_ONE] == 0)
    return is_plain, is_reset, n_struck


@jitted
def only_records(loop, after):
    """Whether all events of this instant change nothing of the motion."""
    n_own = after.actions.shape[0]
    for e in range(loop.sizes[at.NE]):
        if has_fired(e, loop) and (e >= n_own or after.actions[e] != RECORDS):
            return False
    return True


@jitted
def some_jumped(loop, after):
    """Whether the function of one of the model's own events of this instant has jumped over zero."""
    for e in range(after.actions.shape[0]):
        if has_fired(e, loop) and has_jumped(e, loop, after):
            return True
    return False


@jitted
def act_on_own(loop, after):
    """Act on the model's own events of this instant, in their order; whether that is known here."""
    n = after.before.shape[0]
    for e in range(after.actions.shape[0]):
        if not has_fired(e, loop):
            continue
        copy(loop.y[:n], after.before)
        change = 0.0
        if after.actions[e] == RESETS:
            energy = total_energy(loop, after)
            if not reset(e, loop, after):
                return False
            change = total_energy(loop, after) - energy
            after.sums[RESET_ENERGY] += change
        write_log(e, change, math.nan, loop, after)
    return True


@jitted
def reset(event, loop, after):
    """Reset the state, and make it consistent with the constraints; whether that is known here."""
    n = after.before.shape[0]
    for k in range(n):
        after.moved[k] = 0.0
    call_kernel(after.addresses[FIRST_RESET + event], loop.control[at.T], after.before, loop.p, after.moved)
    if not all_finite(after.moved, n):
        return False
    copy(after.moved, loop.y)
    if after.multipliers.shape[0] == 0:
        return True
    projections, residual = loop.counters[at.PROJECTIONS], loop.control[at.MAX_RESIDUAL]
    status = project_state(loop, loop.control[at.T], loop.y, after.projected)
    if status == at.RUNNING and keep_given(loop, after):
        return True
    loop.counters[at.PROJECTIONS], loop.control[at.MAX_RESIDUAL] = projections, residual
    return False


@jitted
def keep_given(loop, after):
    """Let the rates that a reset gave stay, and others follow from the constraints: `nearest_point.rates_after_reset`.

    Whether the constraints are independent by these. The positions are on them, and rates were projected.
    """
    nq, nv, m, t, n = loop.sizes[at.NQ], loop.sizes[at.NV], after.multipliers.shape[0], loop.control[at.T], 0
    for j in range(nv):
        if after.moved[nq + j] == after.before[nq + j]:
            after.places[n] = j
            n += 1
    if n == nv:
        return True
    copy(after.moved[nq:], loop.y[nq : nq + nv])
    for k in range(nv * nv):
        after.mass[k] = 0.0  # structural zeros are not written, and factors fill them
    call_kernel(after.addresses[MASS], t, loop.y, loop.p, after.mass)
    call_kernel(after.addresses[OWN_JACOBIAN], t, loop.y, loop.p, after.own_jacobian)
    if not factor_of_free(n, nv, after):
        return False
    for c in range(m):
        own = after.held[c * n : (c + 1) * n]
        for a in range(n):
            own[a] = after.own_jacobian[c * nv + after.places[a]]
        forward(n, after.mass, own)
    if not factor_products(m, n, after):
        return False
    for _ in range(MOST_REFINEMENTS):
        call_kernel(after.addresses[OWN_RESIDUAL], t, loop.y, loop.p, after.own_residual)
        copy(after.own_residual[after.own_residual.shape[0] - m :], after.multipliers)
        solve(m, after.gram, after.multipliers)
        for a in range(n):
            after.forces[a] = 0.0
            for c in range(m):
                after.forces[a] += after.held[c * n + a] * after.multipliers[c]
        back(n, after.mass, after.forces)
        for a in range(n):
            loop.y[nq + after.places[a]] -= after.forces[a]
    return are_met(loop, after)


@jitted
def factor_of_free(n, nv, after):
    """Factor the mass matrix of the first `n` of `places`, in place; what moves no mass gives way to what does.

    Whether the rest of it is definite: `nearest_point.metric`.
    """
    mass, largest, some_move = after.mass, 0.0, False
    for a in range(n):
        for b in range(n):
            mass[a * n + b] = mass[after.places[a] * nv + after.places[b]]
    for a in range(n):
        largest = max(largest, mass[a * n + a])
    for a in range(n):
        moves = False
        for b in range(n):
            moves |= mass[a * n + b] != 0.0 or mass[b * n + a] != 0.0
        some_move |= moves
        if not moves:
            mass[a * n + a] = MASSLESS * largest
    return some_move and factor(n, mass, SINGULAR_MASS)


@jitted
def are_met(loop, after):
    """Whether rates meet the constraints but for round-off of them."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], after.multipliers.shape[0]
    call_kernel(after.addresses[OWN_RESIDUAL], loop.control[at.T], loop.y, loop.p, after.own_residual)
    for c in range(m):
        size = 0.0
        for j in range(nv):
            size += abs(after.own_jacobian[c * nv + j] * loop.y[nq + j])
        if not abs(after.own_residual[after.own_residual.shape[0] - m + c]) <= SOLVED * size:
            return False
    return True


@jitted
def act_on_stops(n_struck, is_reset, loop, after):
    """Act on the stops of this instant; whether that is known here. Behind a reset, all others are to be open."""
    n, n_own = after.before.shape[0], after.actions.shape[0]
    if n_struck == 0:
        return not is_reset or are_open(False, loop, after)
    copy(loop.y[:n], after.before)
    energy = total_energy(loop, after)
    if not strike(n_struck, is_reset, loop, after):
        return False
    change = total_energy(loop, after) - energy
    work = loop.y[n] + after.sums[RESET_ENERGY] if loop.sizes[at.NW] > 0 else math.nan
    after.sums[RESET_ENERGY] += change
    for a in range(n_struck):
        write_log(n_own + after.struck[a], change if a == 0 else 0.0, work, loop, after)
    return True


@jitted
def total_energy(loop, after):
    """Return T + V at the present state."""
    call_kernel(after.addresses[ENERGY], loop.control[at.T], loop.y, loop.p, after.energy)
    return after.energy[0] + after.energy[1]


@jitted
def energy_to_keep(loop, after):
    """Return T + V less the work that was done: the level to which a run scales its rates."""
    work = 0.0
    for k in range(after.before.shape[0], loop.y.shape[0]):
        work += loop.y[k]
    return total_energy(loop, after) - work


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
def renew_bands(loop, after):
    """Find anew what of the event functions is as good as zero: see `event_actions.renew_bands`."""
    ne = loop.sizes[at.NE]
    find_values_and_floor(loop, after)
    for e in range(ne):
        band = after.floor[e]
        if has_fired(e, loop):
            band += abs(after.g[e])
        if is_jump(e, loop):
            band = max(band, NOTHING * largest(loop))
        loop.control[at.N_CONTROL + at.FLOOR * ne + e] = after.floor[e]
        if not math.isinf(loop.control[at.N_CONTROL + at.BAND * ne + e]):
            loop.control[at.N_CONTROL + at.BAND * ne + e] = band


@jitted
def arm(behind_events, loop, after):
    """Set on which side of zero the event functions are: see `event_actions.arm_events`.

    Parameters
    ----------
    behind_events : bool
        False at the start of a run.
    """
    ne, n_own = loop.sizes[at.NE], after.actions.shape[0]
    find_values_and_floor(loop, after)
    if ne > n_own:
        find_stops(loop, after)
    for e in range(ne):
        side_at = at.N_CONTROL + at.SIDE * ne + e
        fired = behind_events and has_fired(e, loop)
        g, floor, lean = after.g[e], after.floor[e], sign(loop.control[side_at])
        if behind_events and abs(after.values[e]) > CLEAR * floor:
            lean = 0.0
        band = floor
        if fired and e < n_own:
            # A reset may carry its own function away, from where it comes again.
            resets = after.actions[e] == RESETS
            band += min(abs(g), abs(after.values[e])) if resets else abs(g)
            lean = heading_of(e, loop, after)
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
def moves_against(loop, after):
    """Whether an event of this instant moves against the direction that it waits for: its flight was too low."""
    last = after.sums[LAST_RESET]
    dt = PART_OF_FLIGHT * (loop.control[at.T] - last) if last == last else 0.0
    if dt == 0.0:
        return False
    find_slope(loop, after)
    find_values_ahead(-dt, loop, after, after.g)
    find_values_ahead(dt, loop, after, after.other)
    for e in range(after.actions.shape[0]):
        if has_fired(e, loop) and after.directions[e] * (after.other[e] - after.g[e]) < 0.0:
            return True
    return False


@jitted
def look_for_pile(against, loop, after):
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
        ne, gets_away = loop.sizes[at.NE], half == 0.0
        for e in range(ne):
            floor = loop.control[at.N_CONTROL + at.FLOOR * ne + e]
            gets_away |= has_fired(e, loop) and abs(after.other[e]) > CLEAR * floor
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
def are_open(but_struck, loop, after):
    """Whether gaps, but perhaps those that are struck, are more than what tolerances leave open; finds rows, too."""
    n_own = after.actions.shape[0]
    if after.lowest.shape[0] == 0:
        return True
    find_stops(loop, after)
    call_kernel(after.addresses[SWITCHES], loop.control[at.T], loop.y, loop.p, after.switches)
    for k in range(after.lowest.shape[0]):
        is_struck = but_struck and has_fired(n_own + k, loop)
        if not is_struck and not after.switches[2 * k] > gap_tolerance(k, loop, after):
            return False
    return True


@jitted
def strike(n, is_reset, loop, after):
    """Change the rates by a blow on the first `n` of `struck`, if that is all that happens; whether it was.

    Their gaps are closed, their rates are negative, and behind the blow flights are ones that the run sees: by Newton's
    law each rate then is -e times what it was. Behind a reset, gaps must not have moved.
    """
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    if not are_open(True, loop, after):
        return False
    for a in range(n):
        i = after.struck[a]
        closing, restitution = speed_of(i, after), after.switches[2 * i + 1]
        if not (closing < 0.0 and 0.0 < restitution <= 1.0):
            return False
        if is_reset and not abs(after.switches[2 * i]) <= gap_tolerance(i, loop, after):
            return False
        after.impulses[a] = -(1.0 + restitution) * closing
    for k in range(nv * nv):
        after.mass[k] = 0.0  # structural zeros are not written, and factors fill them
    call_kernel(after.addresses[MASS], t, loop.y, loop.p, after.mass)
    for a in range(n):
        after.compliance[a, a] = alone(after.struck[a], nv, after)
    if not factor(nv, after.mass, SINGULAR_MASS) or not factor_constraints(nv, after):
        return False
    if not (find_responses(n, nv, after) and share_blow(n, after)):
        return False
    for a in range(n):
        for j in range(nv):
            loop.y[nq + j] += after.response[a, j] * after.impulses[a]
    return fly(n, loop, after)


@jitted
def alone(i, nv, after):
    """Return the compliance of a gap without the inertia that others have in common with it."""
    total, row = 0.0, after.gaps[i] * nv
    for j in range(nv):
        if after.mass[j * nv + j] > 0.0:
            total += after.jacobian[row + j] * after.jacobian[row + j] / after.mass[j * nv + j]
    return total


@jitted
def find_responses(n, nv, after):
    """Write how rates respond to impulses on what is struck, and gaps to these; whether each of them responds.

    `compliance` holds on its diagonal what they would do alone.
    """
    for a in range(n):
        row, response, own = after.gaps[after.struck[a]] * nv, after.response[a], after.compliance[a, a]
        copy(after.jacobian[row : row + nv], response)
        forward(nv, after.mass, response)
        keep_to_constraints(nv, 0.0, after, response)
        back(nv, after.mass, response)
        for b in range(a + 1):
            total, row = 0.0, after.gaps[after.struck[b]] * nv
            for j in range(nv):
                total += after.jacobian[row + j] * response[j]
            after.compliance[a, b] = after.compliance[b, a] = total
        if not after.compliance[a, a] > LED * own:
            return False
    return True


@jitted
def are_apart(n, after):
    """Whether nothing that is struck moves something else that is."""
    for a in range(n):
        for b in range(a):
            if after.compliance[a, b] != 0.0:
                return False
    return True


@jitted
def share_blow(n, after):
    """Replace changes of rates in `impulses` by impulses; whether all of them press, for certain."""
    w = after.compliance
    if are_apart(n, after):
        for a in range(n):
            after.impulses[a] /= w[a, a]
        return True
    if n != 2:
        return False
    first, second = after.impulses[0], after.impulses[1]
    least = CLEARLY_PRESSED * max(abs(first), abs(second))
    after.impulses[0], after.impulses[1] = of_two(first, second, w)
    return w[0, 0] * after.impulses[0] > least and w[1, 1] * after.impulses[1] > least


@jitted
def of_two(first, second, w):
    """Solve two equations with the compliance of what is struck; not a number where these depend on each other."""
    determinant = w[0, 0] * w[1, 1] - w[0, 1] * w[0, 1]
    if not determinant > DEPENDENT * w[0, 0] * w[1, 1]:
        return math.nan, math.nan
    return (
        (w[1, 1] * first - w[0, 1] * second) / determinant,
        (w[0, 0] * second - w[0, 1] * first) / determinant,
    )


@jitted
def fly(n, loop, after):
    """Whether gaps that nothing else keeps open will open so far that the run sees it: `Holding._landed`.

    Of two that move each other, each is pressed shut by what it falls with, by itself or with the other held.
    """
    nv, t = loop.sizes[at.NV], loop.control[at.T]
    find_stops(loop, after)
    for j in range(nv):
        after.forces[j] = 0.0
    call_kernel(after.addresses[FORCES], t, loop.y, loop.p, after.forces)
    call_kernel(after.addresses[GAMMA], t, loop.y, after.everything, after.gamma)
    forward(nv, after.mass, after.forces)
    keep_to_constraints(nv, 1.0, after, after.forces)
    back(nv, after.mass, after.forces)
    for a in range(n):
        gap = after.gaps[after.struck[a]]
        after.impulses[a] = -after.gamma[gap]
        for j in range(nv):
            after.impulses[a] += after.jacobian[gap * nv + j] * after.forces[j]
    first = second = 0.0
    if not are_apart(n, after):
        first, second = of_two(-after.impulses[0], -after.impulses[1], after.compliance)
    for a in range(n):
        i, free = after.struck[a], after.impulses[a]
        speed = speed_of(i, after)
        if not (math.isfinite(free) and speed > speed_tolerance(i, loop, after)):
            return False
        if first > 0.0 and second > 0.0:
            free = min(free, -after.compliance[a, a] * (first if a == 0 else second))
        flight = speed * speed
        if free < 0.0 and not flight + 2.0 * free * gap_tolerance(i, loop, after) > PLAINLY * flight:
            return False  # what presses it shut ends that before the run sees it
    return True


@jitted
def factor_constraints(nv, after):
    """Write L⁻¹Gᵀ of the model's constraints, and the factor of its products; whether they are independent."""
    m = after.constraints.shape[0]
    for c in range(m):
        own, row = after.held[c * nv : (c + 1) * nv], after.constraints[c] * nv
        copy(after.jacobian[row : row + nv], own)
        forward(nv, after.mass, own)
    return factor_products(m, nv, after)


@jitted
def factor_products(m, n, after):
    """Factor the products of the first `m` rows of `held`, of `n` numbers each; whether they are independent."""
    for c in range(m):
        for d in range(c + 1):
            total = 0.0
            for j in range(n):
                total += after.held[c * n + j] * after.held[d * n + j]
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
    if not are_open(False, loop, after):
        return False
    arm(False, loop, after)
    return True
