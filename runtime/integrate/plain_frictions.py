"""What follows the stick, slip or turn of a friction, in machine code that goes on in the form after it.

It is what `event_actions.py` and `LoopArrays.change_form` do of such an event, which take a hundred times as long; of
impacts on stops, which are open or closed behind that, of their release, of records and resets beside them. What
becomes of stops and frictions is found by `plain_holding.py`, or `plain_coulomb.py` where frictions follow the forces
of stops. All else is left to Python: several that let go at one instant, events that end the run, what is not clear.
"""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.branch import ILL_CONDITIONED, NEAR_SINGULAR, USUAL_RANK
from symgen.runtime.constraints.guard_code import NEAR_LIMIT
from symgen.runtime.constraints.row_weights import fill_row_weights
from symgen.runtime.constraints.size_code import fit_sizes
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite, copy
from symgen.runtime.integrate.plain_coulomb import decide, follows_reactions
from symgen.runtime.integrate.plain_events import (
    ADVANCE,
    CHANGE,
    CLEAR,
    EVENT,
    FIRST_STATE,
    IS_ADAPTIVE,
    LAST_RESET,
    MAY_JUMP,
    N_LOG,
    NEXT_FRAME,
    NOTHING,
    ON_CONSTRAINTS,
    PART_OF_FLIGHT,
    RECORDS,
    RESET_ENERGY,
    RESETS,
    ROUND_OFF,
    TIME,
    ZENO,
    add_change,
    fired_alone,
    has_jumped,
    has_room,
    heading_of,
    is_at_break,
    is_jump,
    largest,
    look_for_pile,
    sign,
    total_energy,
)
from symgen.runtime.integrate.plain_holding import (
    release,
    settle,
    slide,
    stay_held,
    strike,
)
from symgen.runtime.integrate.plain_instant import (
    ASKS,
    AT_EVENT,
    FIRST_RESET,
    HELD_ADVANCE,
    HELD_SETUP,
    IS_HELD,
    SETUP,
    are_open,
    find_events,
    find_events_ahead,
    find_rows,
    find_slope,
    gap_tolerance,
    is_held,
    share,
    slow,
)
from symgen.runtime.integrate.plain_jumps import FIRST_BRANCH, IS_UNDECIDED, take_sides
from symgen.runtime.integrate.plain_jumps import act as change_branch
from symgen.runtime.integrate.projection import LEAST_USUAL, MOST_USUAL, RESIDUAL_LEFT

SLIPS, STICKS, TURNS, STRIKES, OPENS = range(5)  # what becomes of a friction, or a stop
# What `act` has done; GOES_ON_AS_IT_WAS: changed nothing of the motion. Resets pile up at `sums[ACCUMULATION]`.
NOT_KNOWN, GOES_ON, OTHER_SETTINGS, GOES_ON_AS_IT_WAS, PILES_UP = range(5)
ANGLE = -1  # in `groups`: a coordinate whose size is 1


@jitted
def advance_over_frictions(free, held, own):
    """Call the step loop of the form that applies, and act on frictions, until something is for Python to do.

    Parameters
    ----------
    free, held : Loop
    own : Frictions

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
        go_on(done, free, held, own)
        if not has_room(last, free) or own.counts[N_LOG] >= own.log.shape[0] or own.counts[ASKS]:
            return at.RUNNING


@jitted
def call_loop(own):
    """Call the step loop of the form that applies, unless it is at an event; returns its status."""
    if own.counts[AT_EVENT]:
        own.counts[AT_EVENT] = 0
        return at.EVENT
    if own.counts[IS_HELD]:
        call_kernel(own.addresses[HELD_ADVANCE], 0.0, own.held_block, own.held_block, own.result)
    else:
        call_kernel(own.addresses[ADVANCE], 0.0, own.free_block, own.free_block, own.result)
    return int(own.result[0])


@jitted
def go_on(done, free, held, own):
    """Let the loop of the form that applies go on from an event."""
    if done != GOES_ON_AS_IT_WAS:
        restart(free, own)
    if done == OTHER_SETTINGS:
        if own.counts[IS_HELD]:
            take_form(held, 1, own)
            expect(held, own.of_held, own)
        else:
            take_form(free, 0, own)
            expect(free, own.of_free, own)


@jitted
def advance_over_frictions_and_jumps(free, held, own, of_free, of_held):
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
            go_on(done, free, held, own)
            if of_free.counts[IS_UNDECIDED]:
                return at.RUNNING
        if not has_room(last, free) or own.counts[N_LOG] >= own.log.shape[0] or own.counts[ASKS]:
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
    if follows_reactions(own):
        is_known = decide(i, loop, own) and has_become_another(i, was_held, own)
    elif i >= n_stops:
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
def has_become_another(i, was_held, own):
    """Whether what fired is held no more, is held now, or goes another way: all else is for Python."""
    n_stops, holds = own.closed.shape[0], is_held(i, own)
    if was_held or holds or i < n_stops:
        return not (was_held and holds)
    k = i - n_stops
    return own.p[own.sense[k]] != own.kept[own.stuck.shape[0] + k]


@jitted
def act_on_own(event, loop, own):
    """Act on an event of the model's own: one that records, or resets and leaves what is held as it is."""
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    something_held, action = own.counts[IS_HELD] != 0, own.actions[event]
    if something_held and (own.counts[MAY_JUMP] or some_rest(loop, own)):
        return NOT_KNOWN
    if something_held and action == RESETS and follows_reactions(own):
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
def find_floor(loop, own):
    """Write event functions to `g`, what of them is round-off to `floor`: `event_actions.event_values_and_floor`."""
    held, ne, n, t = own.counts[IS_HELD], loop.sizes[at.NE], own.before.shape[0], loop.control[at.T]
    relative = ROUND_OFF * (ON_CONSTRAINTS if held or own.constraints.shape[0] > 0 else 1.0)
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
def expect(loop, guard, own):
    """Tell the guard of a form how large rows of G are near here: `kkt.Lease.expect`; Python, near a singular place."""
    nq, nv, n = loop.sizes[at.NQ], loop.sizes[at.NV], guard.switch.shape[0]
    if n == 0:
        return
    copy(own.largest, own.sizes)
    for j in range(nv):
        if own.groups[j] != ANGLE:
            own.sizes[own.groups[j]] = max(own.sizes[own.groups[j]], abs(loop.y[j]))
    of_rates = guard.weights[n * nv + n :]
    for j in range(nv):
        size = 1.0 if own.groups[j] == ANGLE else own.sizes[own.groups[j]]
        of_rates[j] = size if size > 0.0 else 1.0
    fit_sizes(guard.addresses[0], loop.control[at.T], loop.y[:nq], own.p, of_rates, guard.sizing)
    fill_row_weights(
        guard.addresses[1], loop.control[at.T], loop.y[:nq], loop.p, own.steps, own.places, own.position, guard.rows,
        guard.weights, guard.squares,
    )  # fmt: skip
    smallest, scale = math.inf, math.inf
    for i in range(n):
        if guard.switch[i] < 0:
            if not guard.squares[i] >= NEAR_LIMIT:
                own.counts[ASKS] = 1
            smallest = min(smallest, guard.squares[i])
        else:  # off, its row of zeros says nothing
            smallest = min(smallest, guard.squares[i] + (1.0 - own.p[guard.switch[i]]))
        scale = min(scale, guard.weights[n * nv + i])
    guard.context[USUAL_RANK], guard.context[ILL_CONDITIONED] = guard.rank[0], 0
    guard.context[NEAR_SINGULAR] = 1 if smallest < NEAR_LIMIT else 0
    for j in range(guard.curve.shape[0]):
        guard.curve[j] = 0.0
    size = 1.0 / scale
    usual = LEAST_USUAL <= size and size <= MOST_USUAL
    loop.control[at.PROJECTION_TOL] = RESIDUAL_LEFT * (1.0 if usual else size * size)
