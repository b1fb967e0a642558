"""What follows the stick, slip or turn of a friction that is alone, in machine code that goes on in the form after it.

It is what `event_actions.py`, `contact/lone_friction.py` and `LoopArrays.change_form` do of such an event, which take a
hundred times as long; and what `contact/switching.py` does of an impact on a stop, which is open or closed behind that,
and of its release. What else is closed or sticks may have nothing to do with it, or goes on being held by forces that
are far from their limits: as frictions follow no reactions there is one answer to what is held, and forces that keep
all of it from moving, and are allowed, are it. All else is left to them: blows that several closed stops share,
several that let go at one instant, events that end the run.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.branch import ILL_CONDITIONED, NEAR_SINGULAR, USUAL_RANK
from symgen.runtime.constraints.guard_code import NEAR_LIMIT
from symgen.runtime.constraints.row_weights import fill_row_weights
from symgen.runtime.constraints.size_code import fit_sizes
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite, copy
from symgen.runtime.integrate.plain_events import (
    ADVANCE,
    CHANGE,
    CLEAR,
    DEPENDENT,
    EPS,
    EVENT,
    EVENTS,
    FIRST_STATE,
    FORCES,
    GAMMA,
    IS_ADAPTIVE,
    JACOBIAN,
    LAST_RESET,
    LED,
    MASS,
    MAY_JUMP,
    N_LOG,
    NEXT_FRAME,
    NOTHING,
    ON_CONSTRAINTS,
    PART_OF_FLIGHT,
    PLAINLY,
    RECORDS,
    RESET_ENERGY,
    RESETS,
    RESIDUAL,
    RHS,
    ROUND_OFF,
    SINGULAR_MASS,
    SURELY_SEEN,
    SWITCHES,
    TIME,
    ZENO,
    add_change,
    factor,
    fired_alone,
    has_jumped,
    has_room,
    heading_of,
    is_at_break,
    is_jump,
    largest,
    look_for_pile,
    sign,
    solve,
    total_energy,
)
from symgen.runtime.integrate.plain_jumps import FIRST_BRANCH, IS_UNDECIDED, take_sides
from symgen.runtime.integrate.plain_jumps import act as change_branch
from symgen.runtime.integrate.projection import LEAST_USUAL, MOST_USUAL, RESIDUAL_LEFT

# Addresses: those of the free form where `plain_events` has them; rows and rates of what is held take `p` itself, all
# others what is worked out of it. SETUP: what works that out. Resets, in the order of the events, follow.
SETUP, HELD_ADVANCE, HELD_EVENTS, HELD_RHS, HELD_SETUP, ROWS, FIRST_RESET = range(GAMMA + 1, GAMMA + 8)
IS_HELD = MAY_JUMP + 1  # in `counts`, behind those of `plain_events`
N_COUNTS = IS_HELD + 1
SLIPS, STICKS, TURNS, STRIKES, OPENS = range(5)  # what becomes of a friction, or a stop
# Speeds of gaps that close no faster are at rest, as in `contact/switching.py`.
SETTLED, NO_SPEED = 1e-12, 1e-15
# What `act` has done; GOES_ON_AS_IT_WAS: changed nothing of the motion. Resets pile up at `sums[ACCUMULATION]`.
NOT_KNOWN, GOES_ON, OTHER_SETTINGS, GOES_ON_AS_IT_WAS, PILES_UP = range(5)
# As in `contact/instant.py`, `event_actions.py`.
UNDECIDED, BALANCED, ROUNDED, LIMIT_ROUNDED, LITTLE = 1e-9, 1e-6, 1e-13, 1e-10, 1e-7
CHANGES = 1e-11  # as in `contact/switching.py`: of the largest acceleration, in a moment, more than round-off
# In `acting`: no part; a force that balances; a friction that takes all it can, and slides. TRIES: for each of them.
NO_PART, BALANCES, AT_LIMIT = range(3)
TRIES = 4
ANGLE = -1  # in `groups`: a coordinate whose size is 1


class Frictions(NamedTuple):
    """What acting on frictions takes, of s stops, k frictions, n of both, and NE events.

    Attributes
    ----------
    addresses : ndarray of uint64, shape (N_ADDRESSES,)
    free_block, held_block, result : ndarray
        Of the step loops' `CallBlock`.
    actions, directions : ndarray of int64, shape (number of events of the model's own,)
    p, everything : ndarray, shape (n_p,)
        Parameters with the settings of frictions; scratch for the same with all of them stuck.
    held_p : ndarray
        What the held form has worked out of `p`.
    closed, stuck, sense : ndarray of int64, shapes (s,), (k,), (k,)
        Places of these settings.
    counts : ndarray of int64, shape (N_COUNTS,)
    sums, intervals : ndarray, shapes (4,), (MOST_INTERVALS,)
        As in `plain_events`.
    limits : ndarray, shape (2, 2)
        H_BASE and H_SHARE, by form.
    groups, largest : ndarray of int64, shape (nv,), and of float64
        Which coordinates have one unit, and the largest parameter with it.
    context, weights, steps, places : ndarray
        Of the guard of the held form, and what its weights are found with.
    position, rows, squares, sizes : ndarray, shapes (nq + nv,), (n * nv,), (n,), (number of groups,)
    lowest : ndarray, shape (s,)
        The least gap of each stop at the ends of steps.
    log : ndarray, shape (rows, FIRST_STATE + 2 (nq + nv) + 1 + 1 + 2 k + s)
        As that of `plain_events`; behind it what became of the friction or stop, which frictions stick, senses, and
        which stops are closed.
    before, moved, slope : ndarray, shape (nq + nv,)
    row, held_row : ndarray
        Of `rhs`.
    values, g, floor, other : ndarray, shape (NE,)
    kept : ndarray, shape (2 k + s,)
        The settings before an event, in the order of a row of the log.
    energy, switches : ndarray, shapes (2,), (2 s + 3 k,)
    jacobian, residual, speeds, gamma : ndarray, shapes (n * nv,), (s + n,), (n,), (n,)
    mass, inertia, response, compliance : ndarray, shapes (nv * nv,), (nv,), (n, nv), (n, n)
    rates, change, free : ndarray, shapes (nv,), (nv,), (n,)
    part, acting : ndarray of int64, shape (n,)
    force, gram, right : ndarray, shapes (n,), (n * n,), (n,)
        Of what is held together: forces, factors of the compliance of what acts, and what these are solved with.
    """

    addresses: np.ndarray
    free_block: np.ndarray
    held_block: np.ndarray
    result: np.ndarray
    actions: np.ndarray
    directions: np.ndarray
    p: np.ndarray
    everything: np.ndarray
    held_p: np.ndarray
    closed: np.ndarray
    stuck: np.ndarray
    sense: np.ndarray
    counts: np.ndarray
    sums: np.ndarray
    intervals: np.ndarray
    limits: np.ndarray
    groups: np.ndarray
    largest: np.ndarray
    context: np.ndarray
    weights: np.ndarray
    steps: np.ndarray
    places: np.ndarray
    position: np.ndarray
    rows: np.ndarray
    squares: np.ndarray
    sizes: np.ndarray
    lowest: np.ndarray
    log: np.ndarray
    before: np.ndarray
    moved: np.ndarray
    slope: np.ndarray
    row: np.ndarray
    held_row: np.ndarray
    values: np.ndarray
    g: np.ndarray
    floor: np.ndarray
    other: np.ndarray
    kept: np.ndarray
    energy: np.ndarray
    switches: np.ndarray
    jacobian: np.ndarray
    residual: np.ndarray
    speeds: np.ndarray
    gamma: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    response: np.ndarray
    compliance: np.ndarray
    rates: np.ndarray
    change: np.ndarray
    free: np.ndarray
    part: np.ndarray
    acting: np.ndarray
    force: np.ndarray
    gram: np.ndarray
    right: np.ndarray


@jitted
def advance_over_frictions(free, held, own, sizing):
    """Call the step loop of the form that applies, and act on frictions, until something is for Python to do.

    Parameters
    ----------
    free, held : Loop
    own : Frictions
    sizing : Sizing

    Returns
    -------
    int
        A status of the step loop, EVENT where Python is to act, or ZENO.
    """
    last = free.counters[at.STEPS] + free.counters[at.MAX_STEPS_PER_CALL]
    while True:
        status = call_loop(own)
        if status != at.EVENT or is_at_break(free):
            return status
        done = act(free, own)
        if done == NOT_KNOWN:
            return status
        if done == PILES_UP:
            return ZENO
        go_on(done, free, held, own, sizing)
        if not has_room(last, free) or own.counts[N_LOG] >= own.log.shape[0]:
            return at.RUNNING


@jitted
def call_loop(own):
    """Call the step loop of the form that applies; returns its status."""
    if own.counts[IS_HELD]:
        call_kernel(own.addresses[HELD_ADVANCE], 0.0, own.held_block, own.held_block, own.result)
    else:
        call_kernel(own.addresses[ADVANCE], 0.0, own.free_block, own.free_block, own.result)
    return int(own.result[0])


@jitted
def go_on(done, free, held, own, sizing):
    """Let the loop of the form that applies go on from an event."""
    if done != GOES_ON_AS_IT_WAS:
        restart(free, own)
    if done == OTHER_SETTINGS:
        if own.counts[IS_HELD]:
            take_form(held, 1, own)
            expect(held, own, sizing)
        else:
            take_form(free, 0, own)


@jitted
def advance_over_frictions_and_jumps(free, held, own, sizing, of_free, of_held):
    """Do the same beside jumps of forces.

    Parameters
    ----------
    of_free, of_held : Jumps
        Of both forms.
    """
    last = free.counters[at.STEPS] + free.counters[at.MAX_STEPS_PER_CALL]
    while True:
        status = call_loop(own)
        if status != at.EVENT or is_at_break(free):
            return status
        event = fired_alone(free)
        if event < 0:
            return status
        if is_jump(event, free):
            if own.counts[IS_HELD]:
                look_as_it_is(held.p, of_held)
                changed = change_branch(held, of_held)
            else:
                look_as_it_is(free.p, of_free)
                changed = change_branch(free, of_free)
            if not changed:
                return status
        else:
            # Python looks at choices as they are, while it acts on an event.
            clear_branches(free.p, of_free)
            clear_branches(own.held_p, of_held)
            done = act(free, own)
            take_sides(free, of_free)
            take_sides(held, of_held)
            if done == NOT_KNOWN:
                of_free.counts[IS_UNDECIDED] = of_held.counts[IS_UNDECIDED] = 0
                return status
            if done == PILES_UP:
                return ZENO
            if done == GOES_ON_AS_IT_WAS:
                of_free.counts[IS_UNDECIDED] = of_held.counts[IS_UNDECIDED] = 0
            go_on(done, free, held, own, sizing)
            if of_free.counts[IS_UNDECIDED]:
                return at.RUNNING
        if not has_room(last, free) or own.counts[N_LOG] >= own.log.shape[0]:
            return at.RUNNING


@jitted
def look_as_it_is(p, jumps):
    """Write what a form has worked out of `p` to `jumps.p`, with branches on neither side."""
    for i in range(jumps.p.shape[0]):
        jumps.p[i] = p[i]
    clear_branches(jumps.p, jumps)


@jitted
def clear_branches(p, jumps):
    """Let choices be looked at as they are."""
    for j in range(jumps.events.shape[0]):
        p[jumps.counts[FIRST_BRANCH] + j] = 0.0


@jitted
def act(loop, own):
    """Act on the event at which a step loop has returned; returns whether that is known here, and changes settings."""
    ne, n_stops, n, nq, nv = (
        loop.sizes[at.NE],
        own.closed.shape[0],
        own.stuck.shape[0],
        loop.sizes[at.NQ],
        loop.sizes[at.NV],
    )
    event, n_own = fired_alone(loop), ne - n_stops - n
    if event < 0 or own.counts[N_LOG] >= own.log.shape[0]:
        return NOT_KNOWN
    copy(loop.y[: nq + nv], own.before)
    if event < n_own:
        return act_on_own(event, loop, own)
    i = event - n_own
    if some_rest(loop, own):
        return NOT_KNOWN
    find_events(loop.control[at.T], loop.y, loop, own, own.values)
    energy = total_energy(loop, own)
    write_settings(own.kept, own)
    was_held = is_held(i, own)
    if i >= n_stops:
        is_known = settle(i - n_stops, loop, own)
    else:
        is_known = release(i, loop, own) if was_held else strike(i, loop, own)
    if not is_known or not all_finite(loop.y, nq + nv):
        put_back(loop, own)
        return NOT_KNOWN
    note_gaps(loop, own)
    own.counts[IS_HELD] = 0
    for k in range(n_stops + n):
        if is_held(k, own):
            own.counts[IS_HELD] = 1
    holds = is_held(i, own)
    if i < n_stops:
        what = OPENS if was_held else STRIKES
    else:
        what = SLIPS if was_held else STICKS if holds else TURNS
    changed = have_changed(own)
    end_row(event, total_energy(loop, own) - energy, what, loop, own)
    arm(event if not (was_held or holds) else -1, loop, own)
    return OTHER_SETTINGS if changed else GOES_ON


@jitted
def act_on_own(event, loop, own):
    """Act on an event of the model's own: one that records, or resets and leaves what is held as it is."""
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    something_held, action = own.counts[IS_HELD] != 0, own.actions[event]
    if something_held and (own.counts[MAY_JUMP] or some_rest(loop, own)):
        return NOT_KNOWN
    find_events(t, loop.y, loop, own, own.values)
    if own.counts[MAY_JUMP] and has_jumped(event, loop, own):
        return NOT_KNOWN
    if action == RECORDS:
        write_settings(own.kept, own)
        note_gaps(loop, own)
        end_row(event, 0.0, 0, loop, own)
        loop.counters[at.F_VALID] = 0
        renew_bands(event, loop, own)
        return GOES_ON_AS_IT_WAS
    if action != RESETS:
        return NOT_KNOWN
    energy, against = total_energy(loop, own), moves_against(event, loop, own)
    for j in range(nq + nv):
        own.moved[j] = 0.0
    call_kernel(own.addresses[FIRST_RESET + event], t, own.before, loop.p, own.moved)
    if not all_finite(own.moved, nq + nv):
        return NOT_KNOWN
    write_settings(own.kept, own)
    copy(own.moved, loop.y)
    find_rows(t, loop.y, own)
    is_known = not some_rest(loop, own) and are_open(-1, loop, own) and slide(-1, loop, own)
    if not is_known or (something_held and not stay_held(loop, own)):
        put_back(loop, own)
        return NOT_KNOWN
    note_gaps(loop, own)
    changed = have_changed(own)
    end_row(event, total_energy(loop, own) - energy, 0, loop, own)
    arm(event, loop, own)
    if look_for_pile(against, loop, own):
        return PILES_UP
    return OTHER_SETTINGS if changed else GOES_ON


@jitted
def moves_against(event, loop, own):
    """Whether an event moves against the direction that it waits for: `EventActions._against_direction`."""
    t, last = loop.control[at.T], own.sums[LAST_RESET]
    dt = PART_OF_FLIGHT * (t - last) if last == last else 0.0
    if dt == 0.0:
        return False
    find_slope(loop, own)
    find_events_ahead(-dt, loop, own)
    before = own.other[event]
    find_events_ahead(dt, loop, own)
    return own.directions[event] * (own.other[event] - before) < 0.0


@jitted
def find_slope(loop, own):
    """Write the derivative of the present state in the form that applies to `slope`."""
    n, t = own.slope.shape[0], loop.control[at.T]
    if own.counts[IS_HELD]:
        call_kernel(own.addresses[HELD_RHS], t, loop.y, own.held_p, own.held_row)
        copy(own.held_row[:n], own.slope)
    else:
        call_kernel(own.addresses[RHS], t, loop.y, loop.p, own.row)
        copy(own.row[:n], own.slope)


@jitted
def find_events_ahead(dt, loop, own):
    """Write the event functions where the slope leads in a time `dt` to `other`."""
    for j in range(own.slope.shape[0]):
        own.moved[j] = loop.y[j] + dt * own.slope[j]
    find_events(loop.control[at.T] + dt, own.moved, loop, own, own.other)


@jitted
def stay_held(loop, own):
    """Hold on behind a reset which has not moved what is held; whether that is so, and clear."""
    n_stops = own.closed.shape[0]
    for k in range(own.speeds.shape[0]):
        if is_held(k, own) and not abs(own.speeds[k]) <= slow(k, loop, own):
            return False
        # Gaps are in `switches` since it was looked which are open.
        if k < n_stops and is_held(k, own) and not abs(own.switches[2 * k]) <= gap_tolerance(k, loop, own):
            return False
    if not hold_on(loop, own):
        return False
    bring_to_rest(loop, own)
    return others_are_free(-1, own) or can_be_held(loop, own)


@jitted
def put_back(loop, own):
    """Undo what was changed of the state and the settings."""
    n = own.stuck.shape[0]
    copy(own.before, loop.y)
    for j in range(n):
        own.p[own.stuck[j]], own.p[own.sense[j]] = own.kept[j], own.kept[n + j]
    for j in range(own.closed.shape[0]):
        own.p[own.closed[j]] = own.kept[2 * n + j]
    if own.counts[IS_HELD] == 0:
        share(loop.p, own.addresses[SETUP], own)
    else:
        share(own.held_p, own.addresses[HELD_SETUP], own)


@jitted
def have_changed(own):
    """Whether the settings are others."""
    n = own.stuck.shape[0]
    for j in range(n):
        if own.kept[j] != own.p[own.stuck[j]] or own.kept[n + j] != own.p[own.sense[j]]:
            return True
    for j in range(own.closed.shape[0]):
        if own.kept[2 * n + j] != own.p[own.closed[j]]:
            return True
    return False


@jitted
def end_row(event, change, what, loop, own):
    """Write a row of the log, and add to the energy that events have added."""
    n, row = own.before.shape[0], own.log[own.counts[N_LOG]]
    behind = row[FIRST_STATE + 2 * n :]
    row[EVENT], row[TIME], row[CHANGE] = event, loop.control[at.T], change
    row[NEXT_FRAME] = loop.counters[at.NEXT_FRAME]
    copy(own.before, row[FIRST_STATE : FIRST_STATE + n])
    copy(loop.y[:n], row[FIRST_STATE + n : FIRST_STATE + 2 * n])
    behind[0], behind[1] = math.nan, what
    if event >= own.actions.shape[0] and loop.sizes[at.NW] > 0:
        behind[0] = loop.y[n] + own.sums[RESET_ENERGY]
    write_settings(behind[2:], own)
    own.counts[N_LOG] += 1
    own.sums[RESET_ENERGY] += change


@jitted
def share(p, setup, own):
    """Let a form know the settings: what it has worked out of `p`, and the code that does so, or 0."""
    copy(own.p, p)
    if setup != 0:
        call_kernel(setup, 0.0, p, p, p[own.p.shape[0] :])


@jitted
def find_events(t, y, loop, own, values):
    """Write the event functions of the form that applies to `values`."""
    if own.counts[IS_HELD]:
        call_kernel(own.addresses[HELD_EVENTS], t, y, own.held_p, values)
    else:
        call_kernel(own.addresses[EVENTS], t, y, loop.p, values)


@jitted
def is_held(k, own):
    """Whether a stop is closed, or a friction, numbered behind the stops, sticks."""
    n_stops = own.closed.shape[0]
    return own.p[own.closed[k] if k < n_stops else own.stuck[k - n_stops]] != 0.0


@jitted
def others_are_free(but, own):
    """Whether nothing is held but perhaps one."""
    for k in range(own.speeds.shape[0]):
        if k != but and is_held(k, own):
            return False
    return True


@jitted
def some_rest(loop, own):
    """Whether a friction rests since others hold it."""
    ne, n = loop.sizes[at.NE], own.stuck.shape[0]
    for j in range(n):
        if math.isinf(loop.control[at.N_CONTROL + at.BAND * ne + ne - n + j]):
            return True
    return False


@jitted
def write_settings(values, own):
    """Write which frictions stick, in which directions they slide, and which stops are closed."""
    n = own.stuck.shape[0]
    for j in range(n):
        values[j], values[n + j] = own.p[own.stuck[j]], own.p[own.sense[j]]
    for j in range(own.closed.shape[0]):
        values[2 * n + j] = own.p[own.closed[j]]


@jitted
def note_gaps(loop, own):
    """Take note of how low gaps have been since the last time, those that were open."""
    ne, n_stops = loop.sizes[at.NE], own.closed.shape[0]
    first, n_own = at.N_CONTROL + at.LOWEST * ne, ne - n_stops - own.stuck.shape[0]
    for i in range(n_stops):
        if own.kept[2 * own.stuck.shape[0] + i] == 0.0:
            own.lowest[i] = min(own.lowest[i], loop.control[first + n_own + i])
    for e in range(ne):
        loop.control[first + e] = math.inf


@jitted
def settle(k, loop, own):
    """Find what becomes of a friction, and write it to `p` and to the state: `LoneFriction._settle_alone`.

    Whether something becomes of it that follows from it alone, and changes the settings.
    """
    nq, nv, n_stops = loop.sizes[at.NQ], loop.sizes[at.NV], own.closed.shape[0]
    i, was_stuck, sense = n_stops + k, own.p[own.stuck[k]] != 0.0, own.p[own.sense[k]]
    find_rows(loop.control[at.T], loop.y, own)
    if not are_open(-1, loop, own) or not slide(k, loop, own):
        return False
    own.p[own.stuck[k]] = own.p[own.sense[k]] = 0.0
    if not find_dynamics(loop.control[at.T], loop.y, loop, own):
        return False
    if not own.compliance[i, i] > LED * alone(i, nv, own):
        return False
    if not others_are_free(i, own):
        return settle_among_others(k, was_stuck, sense, loop, own)
    speed, compliance = own.speeds[i], own.compliance[i, i]
    for j in range(nv):
        own.change[j] = own.response[i, j]
    onset = onset_of(k, loop, own)
    if not math.isfinite(onset):
        return False
    if onset == 0.0:
        if was_stuck:
            return False
        own.p[own.stuck[k]] = 1.0
        for j in range(nv):
            loop.y[nq + j] += own.change[j] * -(speed * (1.0 / compliance))
        return can_be_held(loop, own)
    own.p[own.sense[k]] = onset
    return was_stuck or onset != sense


@jitted
def settle_among_others(k, was_stuck, sense, loop, own):
    """Do what `settle` does, beside what is held and moves with the friction: `Holding._settle`."""
    i = own.closed.shape[0] + k
    onset = onset_among_others(k, loop, own)
    if not math.isfinite(onset) or (onset == 0.0 and was_stuck):
        return False
    if not let_slip(i, loop, own):
        return False
    own.p[own.stuck[k]], own.p[own.sense[k]] = 1.0 if onset == 0.0 else 0.0, onset
    if not hold_on(loop, own) or (onset == 0.0 and not is_held(i, own)):
        return False
    if onset != 0.0 and not onset * acceleration(i, own) > -UNDECIDED * largest_free(i, own):
        return False
    bring_to_rest(loop, own)
    return can_be_held(loop, own) and (was_stuck or onset != sense)


@jitted
def onset_among_others(k, loop, own):
    """Return in which direction a friction begins to slide, 0 where it sticks; nan where that is not clear."""
    i, t = own.closed.shape[0] + k, loop.control[at.T]
    take_part(i, own)
    if not find_limited_forces(t, loop.y, loop, own):
        return math.nan
    most, force = level(k, t, loop.y, loop, own), own.force[i]
    if abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most:
        return 0.0
    pull = acceleration(i, own)
    if abs(pull) <= UNDECIDED * largest_free(
        i, own
    ):  # at its limit, which it may be about to leave on either side
        if not are_clear(i, t, loop.y, loop, own):
            return math.nan
        t = look_ahead_by_forces(loop, own)
        if not find_dynamics(t, own.moved, loop, own):
            return math.nan
        take_part(i, own)
        if not find_limited_forces(t, own.moved, loop, own) or not are_clear(i, t, own.moved, loop, own):
            return math.nan
        most, force = level(k, t, own.moved, loop, own), own.force[i]
        if abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most:
            return 0.0
    return -sign(force) if force != 0.0 else sign(pull)


@jitted
def hold_on(loop, own):
    """Find the forces of all that is held, and let frictions slide that would have to take too much.

    Whether that is clear: what begins to slide has its sliding friction, which the others must bear.
    """
    t = loop.control[at.T]
    for _ in range(own.stuck.shape[0] + 1):
        if not find_dynamics(t, loop.y, loop, own):
            return False
        take_part(-1, own)
        if not find_limited_forces(t, loop.y, loop, own):
            return False
        if are_clear(-1, t, loop.y, loop, own):
            return True
        if not let_slip(-1, loop, own):
            return False
    return False


@jitted
def let_slip(but, loop, own):
    """Let all frictions at their limit slide, but one; whether it is clear that they do."""
    n_stops = own.closed.shape[0]
    for k in range(n_stops, own.acting.shape[0]):
        if k != but and own.acting[k] == AT_LIMIT:
            small = 2.0 * max(rounded(k, loop.sizes[at.NV], own), UNDECIDED * largest_free(k, own))
            onset = -sign(own.force[k])
            if not onset * acceleration(k, own) > small:
                return False
            own.p[own.stuck[k - n_stops]], own.p[own.sense[k - n_stops]] = 0.0, onset
    return True


@jitted
def take_part(i, own):
    """Mark in `acting` what is held, and one more unless it is -1; the forces of others are none."""
    for k in range(own.acting.shape[0]):
        own.acting[k] = BALANCES if k == i or is_held(k, own) else NO_PART
        own.force[k] = 0.0


@jitted
def find_limited_forces(t, y, loop, own):
    """Write the forces of what acts to `force`, those of frictions no larger than they can be; whether they are found.

    Those at their limit are marked in `acting`; they are so as long as what they act on slides against them.
    """
    n_stops, n = own.closed.shape[0], own.acting.shape[0]
    for _ in range(TRIES * n):
        if not find_forces(own):
            return False
        worst, most = -1, 0.0
        for k in range(n_stops, n):
            if own.acting[k] == BALANCES:
                beyond = abs(own.force[k]) - level(k - n_stops, t, y, loop, own)
                if own.compliance[k, k] * beyond > most:
                    worst, most = k, own.compliance[k, k] * beyond
        if worst >= 0:
            own.force[worst] = sign(own.force[worst]) * level(worst - n_stops, t, y, loop, own)
            own.acting[worst] = AT_LIMIT
            continue
        for k in range(n_stops, n):
            if own.acting[k] == AT_LIMIT and acceleration(k, own) * own.force[k] > 0.0:
                own.acting[k], worst = BALANCES, k
        if worst < 0:
            return True
    return False


@jitted
def find_forces(own):
    """Write the forces by which what balances is not accelerated to `force`; whether they are unique.

    The forces of others are as `force` has them.
    """
    n, m = own.acting.shape[0], 0
    for k in range(n):
        m += 1 if own.acting[k] == BALANCES else 0
    row = 0
    for k in range(n):
        if own.acting[k] != BALANCES:
            continue
        own.right[row], column = -own.free[k], 0
        for j in range(n):
            if own.acting[j] == BALANCES:
                own.gram[row * m + column] = own.compliance[k, j]
                column += 1
            else:
                own.right[row] -= own.compliance[k, j] * own.force[j]
        row += 1
    if not factor(m, own.gram, DEPENDENT):
        return False
    solve(m, own.gram, own.right)
    spread(own.force, own)
    return all_finite(own.force, n)


@jitted
def spread(values, own):
    """Write what was solved for to the places of what balances."""
    row = 0
    for k in range(own.acting.shape[0]):
        if own.acting[k] == BALANCES:
            values[k] = own.right[row]
            row += 1


@jitted
def acceleration(i, own):
    """Return the acceleration of a gap or sliding under `force`."""
    total = own.free[i]
    for k in range(own.force.shape[0]):
        total += own.compliance[i, k] * own.force[k]
    return total


@jitted
def are_clear(but, t, y, loop, own):
    """Whether the forces of what acts, but one, are far from where it lets go: what is zero, what friction can take."""
    n_stops, nv = own.closed.shape[0], loop.sizes[at.NV]
    for k in range(own.acting.shape[0]):
        if k == but or own.acting[k] == NO_PART:
            continue
        if own.acting[k] == AT_LIMIT:
            return False
        left = own.force[k]
        if k >= n_stops:
            left = level(k - n_stops, t, y, loop, own) - abs(own.force[k])
        small = 2.0 * max(rounded(k, nv, own), UNDECIDED * largest_free(k, own))
        if not own.compliance[k, k] * left > small:
            return False
    return True


@jitted
def bring_to_rest(loop, own):
    """Take what is left of the speeds of what is held: `LocalDynamics.holding`; factors are those of `find_forces`."""
    nq, nv, n, m = loop.sizes[at.NQ], loop.sizes[at.NV], own.acting.shape[0], 0
    for k in range(n):
        if own.acting[k] == BALANCES:
            own.right[m] = -own.speeds[k]
            m += 1
    solve(m, own.gram, own.right)
    spread(own.force, own)
    for k in range(n):
        if own.acting[k] == BALANCES:
            for j in range(nv):
                loop.y[nq + j] += own.response[k, j] * own.force[k]


@jitted
def look_ahead_by_forces(loop, own):
    """Write the state a moment later under `force` to `moved`; returns its time: `Instant._later`."""
    nv, largest = loop.sizes[at.NV], 0.0
    for j in range(nv):
        largest = max(largest, abs(own.rates[j]))
    for j in range(nv):
        change = own.rates[j]
        for k in range(own.force.shape[0]):
            change += own.response[k, j] * own.force[k]
        own.slope[j] = change if abs(change) > UNDECIDED * largest else 0.0
    return move_ahead(loop, own)


@jitted
def are_open(but, loop, own):
    """Whether all gaps that are not closed, but one, are more than what tolerances leave open."""
    n_stops = own.closed.shape[0]
    if n_stops == 0:
        return True
    call_kernel(own.addresses[SWITCHES], loop.control[at.T], loop.y, loop.p, own.switches)
    for i in range(n_stops):
        if i == but or own.p[own.closed[i]] != 0.0:
            continue
        if not own.switches[2 * i] > gap_tolerance(i, loop, own):
            return False
    return True


@jitted
def slide(but, loop, own):
    """Let all frictions that do not stick, but one, slide as they do, if all of them do clearly; whether they do."""
    n_stops = own.closed.shape[0]
    for j in range(own.stuck.shape[0]):
        if j != but and own.p[own.stuck[j]] == 0.0:
            if not abs(own.speeds[n_stops + j]) > slow(n_stops + j, loop, own):
                return False
            own.p[own.sense[j]] = sign(own.speeds[n_stops + j])
    return True


@jitted
def strike(i, loop, own):
    """Change the rates by an impact on a stop, and close it where it stays: `Switching._decide_once`.

    Frictions of given size are bounded forces, and take no part. Returns whether that is all that happens.
    """
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    if not find_dynamics(t, loop.y, loop, own) or not are_open(i, loop, own):
        return False
    is_alone = others_are_free(i, own)
    if some_closed_share(i, own):
        return False
    closing, restitution = own.speeds[i], own.switches[2 * i + 1]
    if not (closing < 0.0 and 0.0 <= restitution <= 1.0) or not own.compliance[i, i] > LED * alone(
        i, nv, own
    ):
        return False
    impulse = -(1.0 + restitution) * closing / own.compliance[i, i]
    for j in range(nv):
        loop.y[nq + j] += own.response[i, j] * impulse
    find_rows(t, loop.y, own)
    tear_off(loop, own)
    if not slide(-1, loop, own) or not find_dynamics(t, loop.y, loop, own):
        return False
    if not is_alone:
        return land_among_others(i, loop, own)
    # Whether it opens so far that the run sees it: `Holding._landed`.
    free, speed = own.free[i], own.speeds[i]
    flight = max(speed, 0.0) ** 2
    excess = flight + 2.0 * free * gap_tolerance(i, loop, own)
    if speed > slow(i, loop, own) and (free >= 0.0 or excess > PLAINLY * flight):
        return True  # nothing presses it shut, or too late
    return excess < -PLAINLY * flight and rest(i, loop, own)


@jitted
def some_closed_share(i, own):
    """Whether a blow on a stop is one on stops that are closed, too."""
    for k in range(own.closed.shape[0]):
        if k != i and is_held(k, own) and own.compliance[i, k] != 0.0:
            return True
    return False


@jitted
def tear_off(loop, own):
    """Let frictions slide that stuck and have a speed behind a blow, which rubs on none."""
    n_stops = own.closed.shape[0]
    for j in range(own.stuck.shape[0]):
        if own.p[own.stuck[j]] != 0.0 and abs(own.speeds[n_stops + j]) > slow(n_stops + j, loop, own):
            own.p[own.stuck[j]] = 0.0


@jitted
def land_among_others(i, loop, own):
    """Close a stop behind a blow, or let it fly, beside what is held and moves with it; whether either is clear."""
    t, height = loop.control[at.T], gap_tolerance(i, loop, own)
    take_part(i, own)
    if not find_limited_forces(t, loop.y, loop, own):
        return False
    pull = own.compliance[i, i] * own.force[i]
    take_part(-1, own)
    if not find_limited_forces(t, loop.y, loop, own):
        return False
    fall, speed, flight = -acceleration(i, own), own.speeds[i], max(own.speeds[i], 0.0) ** 2
    least, most = flight - 2.0 * max(pull, fall) * height, flight - 2.0 * min(pull, fall) * height
    if not (speed > slow(i, loop, own) and (max(pull, fall) <= 0.0 or least > PLAINLY * flight)):
        if not most < -PLAINLY * flight:
            return False
        own.p[own.closed[i]] = 1.0
    if not hold_on(loop, own):
        return False
    bring_to_rest(loop, own)
    return others_are_free(-1, own) or can_be_held(loop, own)


@jitted
def rest(i, loop, own):
    """Close a stop that is pressed shut clearly, and take what is left of its speed; whether it is."""
    nq, nv, free = loop.sizes[at.NQ], loop.sizes[at.NV], own.free[i]
    if not -free > 2.0 * max(rounded(i, nv, own), UNDECIDED * largest_free(i, own)):
        return False
    own.p[own.closed[i]] = 1.0
    impulse = -own.speeds[i] / own.compliance[i, i]
    for j in range(nv):
        loop.y[nq + j] += own.response[i, j] * impulse
    return can_be_held(loop, own)


@jitted
def can_be_held(loop, own):
    """Whether the forces of what is held are known: `EventActions._check_forces`."""
    share(own.held_p, own.addresses[HELD_SETUP], own)
    call_kernel(own.addresses[HELD_EVENTS], loop.control[at.T], loop.y, own.held_p, own.other)
    return all_finite(own.other, own.other.shape[0])


@jitted
def rounded(i, nv, own):
    """Return what is round-off of the accelerations that the force of a stop balances: `Holding._press`."""
    total = 0.0
    for j in range(nv):
        total += abs(own.jacobian[i * nv + j]) * abs(own.rates[j])
    return ROUNDED * total


@jitted
def release(i, loop, own):
    """Open a stop whose force has come to zero; whether that is all that happens: `Holding._settle_stops`."""
    nv, t = loop.sizes[at.NV], loop.control[at.T]
    find_rows(t, loop.y, own)
    if not slide(-1, loop, own) or not find_dynamics(t, loop.y, loop, own) or not are_open(i, loop, own):
        return False
    free, speed = own.free[i], own.speeds[i]
    if not own.compliance[i, i] > LED * alone(i, nv, own) or is_closing(speed, loop, own):
        return False
    if not others_are_free(i, own):
        return release_among_others(i, loop, own)
    small, size = UNDECIDED * largest_free(i, own), abs(free)
    if not size > small:
        if not opens_soon(i, loop, own):
            return False
        own.p[own.closed[i]] = 0.0
        return True
    lands = max(speed, 0.0) ** 2 <= 2.0 * size * gap_tolerance(i, loop, own)
    if free < 0.0 and not (lands and size <= rounded(i, nv, own)):
        return False  # it presses on
    own.p[own.closed[i]] = 0.0
    return True


@jitted
def release_among_others(i, loop, own):
    """Open a stop whose force has come to zero, beside what is held and moves with it; whether it clearly opens."""
    speed = own.speeds[i]
    own.p[own.closed[i]] = 0.0
    if not hold_on(loop, own):
        return False
    rise, small = acceleration(i, own), UNDECIDED * largest_free(i, own)
    if not rise > small:
        least = CHANGES * largest_free(i, own)
        if not (abs(rise) <= small and abs(speed) <= slow(i, loop, own)):
            return False
        t = look_ahead_by_forces(loop, own)
        if not find_dynamics(t, own.moved, loop, own) or not find_forces(own):
            return False
        if not (are_clear(-1, t, own.moved, loop, own) and acceleration(i, own) - rise > least):
            return False
        if not hold_on(loop, own):
            return False
    bring_to_rest(loop, own)
    return others_are_free(-1, own) or can_be_held(loop, own)


@jitted
def opens_soon(i, loop, own):
    """Whether a stop that neither presses nor opens does open a moment later: `Holding._about_to_press`."""
    free, least = own.free[i], CHANGES * largest_free(i, own)
    if not abs(own.speeds[i]) <= slow(i, loop, own):
        return False
    t = look_ahead(i, 0.0, loop, own)
    return find_dynamics(t, own.moved, loop, own) and own.free[i] - free > least


@jitted
def is_closing(speed, loop, own):
    """Whether a gap closes by more than what is at rest: `switching.impulses`."""
    nq, nv, most = loop.sizes[at.NQ], loop.sizes[at.NV], 0.0
    for k in range(own.speeds.shape[0]):
        moved = 0.0
        for j in range(nv):
            moved += abs(own.jacobian[k * nv + j]) * abs(loop.y[nq + j])
        most = max(most, moved)
    return -speed > SETTLED * abs(speed) + NO_SPEED * most


@jitted
def gap_tolerance(i, loop, own):
    """Return how much of a gap the tolerances of the run leave open: `Instant._gap_tolerances`."""
    nv, rows, size = loop.sizes[at.NV], 0.0, 1.0
    for j in range(nv):
        entry = abs(own.jacobian[i * nv + j])
        rows += entry
        if entry > 0.0:
            size = max(size, abs(loop.y[j]))
    allowed = rows * (loop.control[at.ATOL] + loop.control[at.RTOL] * size)
    return max(allowed, SURELY_SEEN * EPS * rows * size)


@jitted
def find_rows(t, y, own):
    """Write the rows of stops and frictions and their speeds to `jacobian` and `speeds`."""
    n_stops = own.closed.shape[0]
    copy(own.p, own.everything)
    for i in range(n_stops):
        own.everything[own.closed[i]] = 1.0
    for j in range(own.stuck.shape[0]):
        own.everything[own.stuck[j]] = 1.0
    call_kernel(own.addresses[JACOBIAN], t, y, own.everything, own.jacobian)
    call_kernel(own.addresses[RESIDUAL], t, y, own.everything, own.residual)
    copy(own.residual[n_stops:], own.speeds)


@jitted
def find_dynamics(t, y, loop, own):
    """Write what `LocalDynamics` knows at a state to the arrays; whether all of it is finite."""
    nv, n = loop.sizes[at.NV], own.speeds.shape[0]
    find_rows(t, y, own)
    share(loop.p, own.addresses[SETUP], own)
    for i in range(nv * nv):
        own.mass[i] = 0.0  # structural zeros are not written, and factors fill them
    for i in range(nv):
        own.rates[i] = 0.0
    call_kernel(own.addresses[MASS], t, y, loop.p, own.mass)
    call_kernel(own.addresses[FORCES], t, y, loop.p, own.rates)
    call_kernel(own.addresses[GAMMA], t, y, own.everything, own.gamma)
    for i in range(nv):
        own.inertia[i] = own.mass[i * nv + i]
    if not factor(nv, own.mass, SINGULAR_MASS):
        return False
    solve(nv, own.mass, own.rates)
    for i in range(n):
        row = own.jacobian[i * nv : (i + 1) * nv]
        copy(row, own.response[i])
        solve(nv, own.mass, own.response[i])
        own.free[i] = -own.gamma[i]
        for j in range(nv):
            own.free[i] += row[j] * own.rates[j]
    for i in range(n):
        for k in range(n):
            own.compliance[i, k] = 0.0
            for j in range(nv):
                own.compliance[i, k] += own.jacobian[i * nv + j] * own.response[k, j]
    return all_finite(own.free, n) and all_finite(own.speeds, n)


@jitted
def alone(k, nv, own):
    """Return the compliance of a row without the inertia that others have in common with it."""
    total = 0.0
    for j in range(nv):
        if own.inertia[j] > 0.0:
            total += own.jacobian[k * nv + j] * own.jacobian[k * nv + j] / own.inertia[j]
    return total


@jitted
def slow(k, loop, own):
    """Return which sliding speeds are zero within the tolerances of the run: `Instant._speed_tolerances`."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    size = moved = 0.0
    for j in range(nv):
        entry = abs(own.jacobian[k * nv + j])
        size += entry
        moved += entry * abs(loop.y[nq + j])
    return size * (loop.control[at.ATOL] + 1e-15) + max(loop.control[at.RTOL], 1e-15) * moved


@jitted
def onset_of(k, loop, own):
    """Return in which direction a friction begins to slide, 0 where it sticks: `LoneFriction._onset`."""
    i = own.closed.shape[0] + k
    free, compliance = own.free[i], own.compliance[i, i]
    most = level(k, loop.control[at.T], loop.y, loop, own)
    force = min(max(-free / compliance, -most), most)
    pull = free + compliance * force
    small = UNDECIDED * largest_free(i, own)
    balanced = BALANCED * (abs(free) + compliance * (abs(force) + most))
    if abs(pull) <= max(small, balanced) and abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most:
        return 0.0
    if abs(pull) <= small:  # at its limit, which it may be about to leave on either side
        t = look_ahead(i, force, loop, own)
        if not find_dynamics(t, own.moved, loop, own) or not own.compliance[i, i] > 0.0:
            return math.nan
        most = level(k, t, own.moved, loop, own)
        force = min(max(-own.free[i] / own.compliance[i, i], -most), most)
        if abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most:
            return 0.0
    return -sign(force) if force != 0.0 else sign(pull)


@jitted
def level(k, t, y, loop, own):
    """Return how large a friction can be that sticks."""
    call_kernel(own.addresses[SWITCHES], t, y, loop.p, own.switches)
    return max(own.switches[2 * own.closed.shape[0] + 3 * k + 2], 0.0)


@jitted
def find_part(k, own):
    """Mark in `part` which frictions move with one: `local_dynamics.parts_of`."""
    n = own.part.shape[0]
    for i in range(n):
        own.part[i] = 0
    own.part[k] = 1
    grows = True
    while grows:
        grows = False
        for i in range(n):
            if own.part[i] == 0:
                for j in range(n):
                    if own.part[j] and (own.compliance[i, j] != 0.0 or own.compliance[j, i] != 0.0):
                        own.part[i] = 1
                        grows = True


@jitted
def largest_free(k, own):
    """Return the largest acceleration of what moves with a friction: `LocalDynamics.sizes_of_free`."""
    find_part(k, own)
    size = 0.0
    for i in range(own.part.shape[0]):
        if own.part[i]:
            size = max(size, abs(own.free[i]))
    return size


@jitted
def look_ahead(i, force, loop, own):
    """Write the state a moment later, with a force in a row, to `moved`; returns its time: `Instant._later`."""
    find_change(i, force, loop, own)
    return move_ahead(loop, own)


@jitted
def move_ahead(loop, own):
    """Write the state a moment later under the accelerations `slope` to `moved`; returns its time."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    ahead = LITTLE * find_moment(loop, own)
    for j in range(nv):
        own.moved[j] = loop.y[j] + ahead * loop.y[nq + j]
        own.moved[nq + j] = loop.y[nq + j] + ahead * own.slope[j]
    return loop.control[at.T] + ahead


@jitted
def find_change(i, force, loop, own):
    """Write the accelerations with a force in a row to `slope`, but for those that are balanced."""
    nv, largest = loop.sizes[at.NV], 0.0
    for j in range(nv):
        largest = max(largest, abs(own.rates[j]))
    for j in range(nv):
        change = own.rates[j] + own.response[i, j] * force
        own.slope[j] = change if abs(change) > ROUNDED * largest else 0.0


@jitted
def find_moment(loop, own):
    """Return the time in which the motion changes under the accelerations `slope`: `LocalDynamics.moment`."""
    nv, n = loop.sizes[at.NV], own.part.shape[0]
    for j in range(nv):
        own.slope[nv + j] = 0.0  # whether some stop or friction moves it, or is made of it
    least = math.inf
    for i in range(n):
        find_part(i, own)
        size = speed = 0.0
        for j in range(nv):
            reached = False
            for other in range(n):
                if own.part[other]:
                    reached |= own.jacobian[other * nv + j] != 0.0 or own.response[other, j] != 0.0
            if reached:
                own.slope[nv + j] = 1.0
                size, speed = max(size, size_of(j, loop)), max(speed, speed_of(j, loop, own))
        if speed > 0.0:
            least = min(least, size / speed)
    for j in range(nv):
        speed = speed_of(j, loop, own)
        if own.slope[nv + j] == 0.0 and speed > 0.0:
            least = min(least, size_of(j, loop) / speed)
    return least if math.isfinite(least) else 1.0


@jitted
def size_of(j, loop):
    """Return what a change of a coordinate and its rate is large beside."""
    return max(max(1.0, abs(loop.y[j])), abs(loop.y[loop.sizes[at.NQ] + j]))


@jitted
def speed_of(j, loop, own):
    """Return how fast a coordinate or its rate changes; rates that are zero within the tolerances do not count."""
    rate = abs(loop.y[loop.sizes[at.NQ] + j])
    moving = rate if rate > loop.control[at.ATOL] + ROUNDED else 0.0
    return max(moving, abs(own.slope[j]))


@jitted
def find_floor(loop, own):
    """Write event functions to `g`, what of them is round-off to `floor`: `event_actions.event_values_and_floor`."""
    held, ne, n, t = own.counts[IS_HELD], loop.sizes[at.NE], own.before.shape[0], loop.control[at.T]
    relative = ROUND_OFF * (ON_CONSTRAINTS if held else 1.0)
    dt = relative * abs(t)
    find_events(t, loop.y, loop, own, own.g)
    for e in range(ne):
        own.floor[e] = 0.0
    find_slope(loop, own)
    copy(loop.y[:n], own.moved)
    find_events(t + dt, own.moved, loop, own, own.other)
    add_change(own)
    for j in range(n):
        own.moved[j] = loop.y[j] + relative * abs(loop.y[j])
        find_events(t, own.moved, loop, own, own.other)
        add_change(own)
        own.moved[j] = loop.y[j]
    find_events_ahead(dt, loop, own)
    add_change(own)
    for e in range(ne):
        if not math.isfinite(own.floor[e]):
            own.floor[e] = 0.0


@jitted
def renew_bands(event, loop, own):
    """Find anew what of the event functions is as good as zero: `event_actions.renew_bands`."""
    ne = loop.sizes[at.NE]
    find_floor(loop, own)
    for e in range(ne):
        loop.control[at.N_CONTROL + at.FLOOR * ne + e] = own.floor[e]
        if not math.isinf(loop.control[at.N_CONTROL + at.BAND * ne + e]):
            band = own.floor[e] + (abs(own.g[e]) if e == event else 0.0)
            if is_jump(e, loop):
                band = max(band, NOTHING * largest(loop))
            loop.control[at.N_CONTROL + at.BAND * ne + e] = band


@jitted
def arm(moved, loop, own):
    """Set on which side of zero the event functions are: `event_actions.arm_events`.

    Parameters
    ----------
    moved : int
        The event that has fired, if its function is the same as before; else -1.
    """
    ne, n_stops, n = loop.sizes[at.NE], own.closed.shape[0], own.speeds.shape[0]
    if own.counts[IS_HELD]:
        share(own.held_p, own.addresses[HELD_SETUP], own)
    else:
        share(loop.p, own.addresses[SETUP], own)
    find_floor(loop, own)
    heading = heading_of(moved, loop, own) if 0 <= moved and moved < ne - n else 0.0
    find_rows(loop.control[at.T], loop.y, own)
    for e in range(ne):
        side_at = at.N_CONTROL + at.SIDE * ne + e
        g, floor, lean, i = own.g[e], own.floor[e], sign(loop.control[side_at]), e - (ne - n)
        if abs(own.values[e]) > CLEAR * floor:
            lean = 0.0
        band = floor
        if e == moved and i < 0:
            # A reset may carry its own function away, from where it comes again.
            band += min(abs(g), abs(own.values[e]))
            lean = heading
        if 0 <= i and own.p[own.closed[i] if i < n_stops else own.stuck[i - n_stops]] == 0.0:
            lean = 1.0
            sunk = max(0.0, -g)
            if e == moved:
                sunk *= 2.0  # what sinks although its rates rise fires a few times, not for ever
            width = 0.0
            if not abs(own.speeds[i]) > slow(i, loop, own):
                width = gap_tolerance(i, loop, own) if i < n_stops else slow(i, loop, own)
            band = max(floor, width) + sunk
        if is_jump(e, loop):
            band = max(band, NOTHING * largest(loop))
        loop.control[at.N_CONTROL + at.FLOOR * ne + e] = floor
        loop.control[at.N_CONTROL + at.BAND * ne + e] = band
        loop.control[side_at] = sign(g) if abs(g) > band else at.LEANING * lean


@jitted
def restart(loop, own):
    """Let the loop forget what no longer holds: `LoopArrays.restart`, and choose its step anew."""
    loop.counters[at.F_VALID] = loop.counters[at.LAST_REJECTED] = 0
    loop.control[at.ERROR_OLD] = 1e-4
    if own.counts[IS_ADAPTIVE]:
        loop.control[at.H] = 0.0


@jitted
def take_form(loop, form, own):
    """Let the loop of a form go on from here: `LoopArrays.change_form`."""
    for i in range(loop.f.shape[0]):
        loop.f[i] = 0.0
    for i in range(loop.work.shape[0]):
        loop.work[i] = 0.0
    for i in range(at.FAMILY_COUNTERS, at.N_COUNTERS):
        loop.counters[i] = 0
    loop.control[at.H_BASE], loop.control[at.H_SHARE] = own.limits[form, 0], own.limits[form, 1]


@jitted
def expect(loop, own, sizing):
    """Tell the guard how large rows of G are near here: `kkt.Lease.expect`."""
    nq, nv, n_stops, n = loop.sizes[at.NQ], loop.sizes[at.NV], own.closed.shape[0], own.speeds.shape[0]
    copy(own.largest, own.sizes)
    for j in range(nv):
        if own.groups[j] != ANGLE:
            own.sizes[own.groups[j]] = max(own.sizes[own.groups[j]], abs(loop.y[j]))
    of_rates = own.weights[n * nv + n :]
    for j in range(nv):
        size = 1.0 if own.groups[j] == ANGLE else own.sizes[own.groups[j]]
        of_rates[j] = size if size > 0.0 else 1.0
    fit_sizes(own.addresses[RESIDUAL], loop.control[at.T], loop.y[:nq], own.p, of_rates, sizing)
    fill_row_weights(
        own.addresses[ROWS], loop.control[at.T], loop.y[:nq], loop.p, own.steps, own.places, own.position, own.rows,
        own.weights, own.squares,
    )  # fmt: skip
    smallest, scale = math.inf, math.inf
    for i in range(n):  # off, its row of zeros says nothing
        on = own.p[own.closed[i]] if i < n_stops else own.p[own.stuck[i - n_stops]]
        smallest = min(smallest, own.squares[i] + (1.0 - on))
        scale = min(scale, own.weights[n * nv + i])
    own.context[USUAL_RANK] = own.context[ILL_CONDITIONED] = 0
    own.context[NEAR_SINGULAR] = 1 if smallest < NEAR_LIMIT else 0
    size = 1.0 / scale
    usual = LEAST_USUAL <= size and size <= MOST_USUAL
    loop.control[at.PROJECTION_TOL] = RESIDUAL_LEFT * (1.0 if usual else size * size)
