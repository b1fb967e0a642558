"""What is held where frictions are of given size, in machine code: sticks, slips, impacts on stops, and releases.

As frictions follow no reactions there is one answer to what is held, and forces that keep all of it from moving, and
are allowed, are it. What else is closed or sticks may have nothing to do with what happens, or goes on being held by
forces that are far from their limits. It is what `contact/lone_friction.py` and `contact/switching.py` find.
"""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite
from symgen.runtime.integrate.plain_events import DEPENDENT, LED, PLAINLY, factor, sign, solve
from symgen.runtime.integrate.plain_instant import (
    BALANCED,
    CHANGES,
    LIMIT_ROUNDED,
    ROUNDED,
    STRUCK_IN_TURN,
    UNDECIDED,
    acceleration,
    alone,
    are_open,
    can_be_held,
    find_dynamics,
    find_part,
    find_rows,
    gap_tolerance,
    is_closing,
    is_held,
    largest_free,
    level,
    move_ahead,
    others_are_free,
    rounded,
    slow,
)

# In `acting`: no part; a force that balances; a friction that takes all it can, and slides. TRIES: for each of them.
NO_PART, BALANCES, AT_LIMIT = range(3)
TRIES = 4


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
    n, row = own.acting.shape[0], 0
    for k in range(n):
        if own.acting[k] != BALANCES:
            continue
        own.right[row] = -own.free[k]
        for j in range(n):
            if own.acting[j] != BALANCES:
                own.right[row] -= own.compliance[k, j] * own.force[j]
        row += 1
    return solve_balance(own)


@jitted
def solve_balance(own):
    """Write to `force` what makes what balances respond as `right` has it, row by row; whether that is unique."""
    n, m = own.acting.shape[0], 0
    for k in range(n):
        m += 1 if own.acting[k] == BALANCES else 0
    row = 0
    for k in range(n):
        if own.acting[k] != BALANCES:
            continue
        column = 0
        for j in range(n):
            if own.acting[j] == BALANCES:
                own.gram[row * m + column] = own.compliance[k, j]
                column += 1
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
    closing, restitution = own.speeds[i], own.switches[2 * i + 1]
    if not (closing < 0.0 and 0.0 <= restitution <= 1.0) or not own.compliance[i, i] > LED * alone(
        i, nv, own
    ):
        return False
    if some_closed_share(i, own):
        if not share_blow(i, own):
            return False
        for k in range(own.closed.shape[0]):
            for j in range(nv):
                loop.y[nq + j] += own.response[k, j] * own.force[k]
    else:
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
def share_blow(i, own):
    """Write the impulses of a blow that closed stops share to `force`; whether all of them press: `switching._blow`.

    What is closed stays so, and what is struck leaves at -e times the speed that it had.
    """
    n_stops, row = own.closed.shape[0], 0
    if own.counts[STRUCK_IN_TURN]:
        return False
    find_part(i, own)
    for k in range(own.acting.shape[0]):
        takes_part = k == i or (k < n_stops and own.part[k] == 1 and is_held(k, own))
        own.acting[k], own.force[k] = BALANCES if takes_part else NO_PART, 0.0
        if takes_part:
            own.right[row] = -(1.0 + own.switches[2 * k + 1]) * own.speeds[k]
            row += 1
    if not solve_balance(own):
        return False
    least = UNDECIDED * abs(own.speeds[i])
    for k in range(n_stops):
        if own.acting[k] == BALANCES and not own.compliance[k, k] * own.force[k] > least:
            return False
    return True


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
def release(i, loop, own):
    """Open a stop whose force has come to zero; whether that is all that happens: `Holding._settle_stops`."""
    nv, t = loop.sizes[at.NV], loop.control[at.T]
    find_rows(t, loop.y, own)
    if not slide(-1, loop, own) or not find_dynamics(t, loop.y, loop, own) or not are_open(i, loop, own):
        return False
    free, speed = own.free[i], own.speeds[i]
    if not own.compliance[i, i] > LED * alone(i, nv, own) or is_closing(i, loop, own):
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
def look_ahead(i, force, loop, own):
    """Write the state a moment later, with a force in a row, to `moved`; returns its time: `Instant._later`."""
    find_change(i, force, loop, own)
    return move_ahead(loop, own)


@jitted
def find_change(i, force, loop, own):
    """Write the accelerations with a force in a row to `slope`, but for those that are balanced."""
    nv, largest = loop.sizes[at.NV], 0.0
    for j in range(nv):
        largest = max(largest, abs(own.rates[j]))
    for j in range(nv):
        change = own.rates[j] + own.response[i, j] * force
        own.slope[j] = change if abs(change) > ROUNDED * largest else 0.0
