"""What is held where frictions follow reactions, in machine code: Coulomb's law at one instant.

It is what `contact/switching.py` finds of impacts that rub, of what stays closed or sticks behind them, and in which
direction the rest slides, by the complementarity problem of `contact/coulomb.py`. Left to Python: stops or frictions
that follow from others, so that a load can be shared in many ways; what is closed and bears nothing without clearly
opening; motions that are not unique.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.contact.local_dynamics import Normal, given
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.plain_events import DEPENDENT, LED, PLAINLY, SWITCHES, factor, sign
from symgen.runtime.integrate.plain_holding import BALANCES, NO_PART, bring_to_rest, look_ahead_by_forces
from symgen.runtime.integrate.plain_instant import (
    BALANCED,
    CHANGES,
    LIMIT_ROUNDED,
    NO_SPEED,
    SETTLED,
    UNDECIDED,
    acceleration,
    alone,
    are_open,
    can_be_held,
    find_dynamics,
    find_rows,
    gap_tolerance,
    is_held,
    largest_free,
    others_are_free,
    rounded,
    slow,
)

GIVEN, BY_CONSTRAINTS = -1, -2  # in `presses`
AT_REST = 1e-6  # as in `contact/switching.py`: of what a sliding speed changes by in a step
NO_GAIN, HALVINGS = 1e-12, 40
MOST_BLOWS, MOST_STOPS = 200, 4  # of one instant; of those in touch, sets of which are looked at
MOST_PASSES, CONVERGED = 50, 1e-13  # as in `contact/coulomb.py`, and what follows
PIVOTED, PIVOTS = 1e-12, 50  # of the largest number, and for each row
REGULAR, NO_MINOR = 1e-9, 1e-10


class Coulomb(NamedTuple):
    """What Coulomb's law takes, of s stops, k frictions, n of both, N = n + k.

    Attributes
    ----------
    presses : ndarray of int64, shape (k,)
        Which stop presses each friction; GIVEN, or BY_CONSTRAINTS.
    first, pressing : ndarray of int64, shapes (k + 1,), (any,)
        Where the constraints that press each friction begin, and which these are.
    flags : ndarray of int64, shape (1,)
        Whether stops that touch are struck one after another.
    touching, dead, rises : ndarray of int64, shape (s,)
        Stops that may stay closed, those whose restitution does not count, and those that stay closed behind a rebound.
    slow, waits, still, sticks : ndarray of int64, shape (k,)
        Frictions that may stick as far as events tell, those that may stick, those that may still, and that do.
    fixed, coefficient, most, constant, shift, onset, speed : ndarray, shape (k,)
        Levels that are given, and in proportion to a normal force; levels, and what of them does not follow forces; the
        direction of sliding in the law; in which direction sliding begins; sliding speeds before an impact.
    slope : ndarray, shape (k * n,)
        By what forces change the levels.
    restitution, opening : ndarray, shape (s,)
    force, total, now, free, before : ndarray, shape (n,)
        Scratch: forces of now while a moment later is looked at; impulses; rates of gaps and slidings behind these;
        what the law has in place of accelerations; the forces of the last pass.
    places, part : ndarray of int64, shapes (n,), (N,)
    inverse, by_z, matrix, right, z, tableau, basis : ndarray
        Of the complementarity problem: shapes (n * n,) twice, (N * N,), (N,), (N,), (N * (2 N + 2),), int64 (N,).
    """

    presses: np.ndarray
    first: np.ndarray
    pressing: np.ndarray
    flags: np.ndarray
    touching: np.ndarray
    dead: np.ndarray
    rises: np.ndarray
    slow: np.ndarray
    waits: np.ndarray
    still: np.ndarray
    sticks: np.ndarray
    fixed: np.ndarray
    coefficient: np.ndarray
    most: np.ndarray
    constant: np.ndarray
    shift: np.ndarray
    onset: np.ndarray
    speed: np.ndarray
    slope: np.ndarray
    restitution: np.ndarray
    opening: np.ndarray
    force: np.ndarray
    total: np.ndarray
    now: np.ndarray
    free: np.ndarray
    before: np.ndarray
    places: np.ndarray
    part: np.ndarray
    inverse: np.ndarray
    by_z: np.ndarray
    matrix: np.ndarray
    right: np.ndarray
    z: np.ndarray
    tableau: np.ndarray
    basis: np.ndarray


def make_law(normals: list[Normal], n_stops: int, *, sequential: bool) -> Coulomb:
    """Return the arrays for frictions that follow reactions; none where all levels are given."""
    if all(given(normal) for normal in normals):
        normals, n_stops = [], 0
    presses = [
        GIVEN if given((stop, rows)) else BY_CONSTRAINTS if stop is None else stop for stop, rows in normals
    ]
    first = np.cumsum([0, *(len(rows) for _, rows in normals)])
    pressing = np.concatenate([np.zeros(0, dtype=np.int64), *(rows for _, rows in normals)])
    s, k = n_stops, len(normals)
    n, size = s + k, s + 2 * k

    def integers(length: int) -> np.ndarray:
        return np.zeros(length, dtype=np.int64)

    return Coulomb(
        presses=np.array(presses, dtype=np.int64), first=first.astype(np.int64), pressing=pressing.astype(np.int64),
        flags=np.array([sequential], dtype=np.int64), touching=integers(s), dead=integers(s), rises=integers(s),
        slow=integers(k), waits=integers(k), still=integers(k), sticks=integers(k), fixed=np.zeros(k),
        coefficient=np.zeros(k), most=np.zeros(k), constant=np.zeros(k), shift=np.zeros(k), onset=np.zeros(k),
        speed=np.zeros(k), slope=np.zeros(k * n), restitution=np.zeros(s), opening=np.zeros(s), force=np.zeros(n),
        total=np.zeros(n), now=np.zeros(n), free=np.zeros(n), before=np.zeros(n), places=integers(n),
        part=integers(size), inverse=np.zeros(n * n), by_z=np.zeros(n * n), matrix=np.zeros(size * size),
        right=np.zeros(size), z=np.zeros(size), tableau=np.zeros(size * (2 * size + 2)), basis=integers(size),
    )  # fmt: skip


@jitted
def follows_reactions(own):
    """Whether some friction follows a reaction."""
    return own.law.presses.shape[0] > 0


@jitted
def decide(i, loop, own):
    """Find what becomes of all stops and frictions at the event of one: `Switching.act`; whether it is clear.

    Settings are written to `p`, and the rates are changed.
    """
    nq, n_stops, t = loop.sizes[at.NQ], own.closed.shape[0], loop.control[at.T]
    law, was_held = own.law, is_held(i, own)
    if not find_dynamics(t, loop.y, loop, own) or not are_open(i, loop, own):
        return False
    for row in range(own.speeds.shape[0]):
        if not own.compliance[row, row] > LED * alone(row, loop.sizes[at.NV], own):
            return False
    if i < n_stops and (own.speeds[i] < 0.0) == was_held and abs(own.speeds[i]) > slow(i, loop, own):
        return False  # struck while it opens, or while it is closed
    for k in range(law.slow.shape[0]):
        law.slow[k] = 1 if is_held(n_stops + k, own) else 0
    if i >= n_stops and not was_held:
        law.slow[i - n_stops] = 1 if came_to_rest(i - n_stops, loop, own) else 0
    for s in range(n_stops):
        law.dead[s] = 0
    if not decide_once(i, loop, own):
        return False
    rebounds = False
    for s in range(n_stops):
        law.dead[s] = law.rises[s]
        rebounds |= law.rises[s] != 0
    if not rebounds:
        return True
    # A stop that stays closed does not rebound, which would rub for nothing: `Switching._decide`.
    copy(own.before[nq:], loop.y[nq : own.before.shape[0]])
    restore(own)
    return decide_once(i, loop, own)


@jitted
def restore(own):
    """Write the settings before the event to `p`."""
    n = own.stuck.shape[0]
    for j in range(n):
        own.p[own.stuck[j]], own.p[own.sense[j]] = own.kept[j], own.kept[n + j]
    for j in range(own.closed.shape[0]):
        own.p[own.closed[j]] = own.kept[2 * n + j]


@jitted
def came_to_rest(k, loop, own):
    """Whether a friction whose event has fired is at rest: one that follows a reaction may have come to a paradox."""
    row = own.closed.shape[0] + k
    last = AT_REST * abs(own.free[row]) * loop.control[at.H_LAST]
    return own.law.presses[k] == GIVEN or abs(own.speeds[row]) <= max(slow(row, loop, own), last)


@jitted
def decide_once(i, loop, own):
    """Settle impacts, what stays closed or sticks, and how the rest slides: `Switching._decide_once`."""
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    n_stops, law, impacted = own.closed.shape[0], own.law, False
    if not find_dynamics(t, loop.y, loop, own):
        return False
    call_kernel(own.addresses[SWITCHES], t, loop.y, loop.p, own.switches)
    for s in range(n_stops):
        law.touching[s] = 1 if s == i or is_held(s, own) else 0
        law.restitution[s] = 0.0 if law.dead[s] else own.switches[2 * s + 1]
        impacted |= law.touching[s] != 0 and own.speeds[s] < 0.0
    for k in range(law.speed.shape[0]):
        law.speed[k] = own.speeds[n_stops + k]
    if impacted:
        if not impulses(loop, own):
            return False
        for row in range(law.total.shape[0]):
            for j in range(nv):
                loop.y[nq + j] += own.response[row, j] * law.total[row]
        find_rows(t, loop.y, own)
    for k in range(law.still.shape[0]):
        row = n_stops + k
        least = slow(row, loop, own)
        jumped = impacted and abs(own.speeds[row] - law.speed[k]) > least
        at_rest = abs(own.speeds[row]) <= least or (law.slow[k] != 0 and not jumped)
        law.still[k] = 1 if at_rest and is_pressed(k, own) else 0
        own.p[own.stuck[k]], own.p[own.sense[k]] = 0.0, 0.0 if at_rest else sign(own.speeds[row])
    if not settle_together(loop, own):
        return False
    for s in range(n_stops):
        rising = impacted and is_held(s, own) and own.speeds[s] > slow(s, loop, own)
        law.rises[s] = 1 if rising else 0
    bring_to_rest(loop, own)
    return others_are_free(-1, own) or can_be_held(loop, own)


@jitted
def is_pressed(k, own):
    """Whether a friction can act: not on a stop that is open."""
    stop = own.law.presses[k]
    return stop < 0 or own.law.touching[stop] != 0


@jitted
def impulses(loop, own):
    """Write the impulses after which no stop closes to `total`: `switching.impulses`; whether there are such."""
    n, n_stops, law, most, slowest = own.speeds.shape[0], own.closed.shape[0], own.law, 0.0, 0.0
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    for row in range(n):
        moved = 0.0
        for j in range(nv):
            moved += abs(own.jacobian[row * nv + j]) * abs(loop.y[nq + j])
        slowest = max(slowest, moved)
        if row < n_stops:
            most = max(most, abs(own.speeds[row]))
        law.total[row], law.now[row] = 0.0, own.speeds[row]
    slowest = SETTLED * most + NO_SPEED * slowest
    for _ in range(MOST_BLOWS):
        fastest, closing = 0, 0.0
        for s in range(n_stops):
            if law.touching[s] and -law.now[s] > closing:
                fastest, closing = s, -law.now[s]
        if closing <= slowest:
            return True
        if not blow(fastest if law.flags[0] else -1, own):
            return False
        for row in range(n):
            law.total[row] += own.force[row]
        for row in range(n):
            law.now[row] = own.speeds[row]
            for other in range(n):
                law.now[row] += own.compliance[row, other] * law.total[other]
    return False


@jitted
def blow(only, own):
    """Write the impulses of one blow, on one stop or on all (-1) that touch, to `force`: `switching._blow`."""
    n_stops, law, n_struck, rubs, struck = own.closed.shape[0], own.law, 0, False, 0
    for s in range(n_stops):
        is_struck = law.touching[s] != 0 and (only < 0 or s == only)
        own.acting[s] = BALANCES if is_struck else NO_PART
        if is_struck:
            n_struck, struck = n_struck + 1, s
    for k in range(law.presses.shape[0]):
        stop = law.presses[k]
        rubbing = stop == BY_CONSTRAINTS or (stop >= 0 and own.acting[stop] == BALANCES)
        own.acting[n_stops + k] = BALANCES if rubbing else NO_PART
        law.fixed[k] = 0.0
        law.coefficient[k] = max(own.switches[2 * n_stops + 3 * k + 1], 0.0) if rubbing else 0.0
        law.shift[k] = 1.0 if rubbing else 0.0
        rubs |= rubbing
    if n_struck == 1 and not rubs:
        for row in range(own.force.shape[0]):
            own.force[row] = 0.0
        push = -(1.0 + law.restitution[struck]) * law.now[struck] / own.compliance[struck, struck]
        own.force[struck] = max(push, 0.0)
        return True
    if not with_restitution(1.0, own):
        return False
    if not rubs or not adds_energy(own):
        return True
    least, most = 0.0, 1.0
    for _ in range(HALVINGS):
        part = 0.5 * (least + most)
        if not with_restitution(part, own):
            return False
        if adds_energy(own):
            most = part
        else:
            least = part
    return with_restitution(least, own)


@jitted
def with_restitution(part, own):
    """Write the impulses with a part of the restitutions to `force`; whether there are such."""
    law = own.law
    for row in range(own.force.shape[0]):
        more = part * law.restitution[row] if row < law.restitution.shape[0] else 0.0
        law.free[row] = law.now[row] * (1.0 + more)
    return find_law(0.0, own)


@jitted
def adds_energy(own):
    """Whether impulses add to the kinetic energy."""
    law, gain, size = own.law, 0.0, 0.0
    for row in range(own.force.shape[0]):
        behind = law.now[row]
        for other in range(own.force.shape[0]):
            behind += 0.5 * own.compliance[row, other] * own.force[other]
        gain += own.force[row] * behind
        size += abs(own.force[row]) * abs(law.now[row])
    return gain > NO_GAIN * size


@jitted
def settle_together(loop, own):
    """Find what is held by forces that are allowed: `Holding._settle`; whether it is clear.

    Settings are written; factors of what is held are those that `bring_to_rest` takes.
    """
    t, law = loop.control[at.T], own.law
    copy(law.still, law.waits)
    for _ in range(law.still.shape[0] + 1):
        if not find_dynamics(t, loop.y, loop, own):
            return False
        find_levels(t, loop.y, loop, own)
        if not land(loop, own) or not load_is_borne_one_way(own) or not find_sticking(loop, own):
            return False
        slips = False
        for k in range(law.still.shape[0]):
            if law.still[k] != law.sticks[k]:
                own.p[own.sense[k]], law.still[k], slips = law.onset[k], 0, True
        if not slips:
            return close_and_stick(loop, own)
    return False


@jitted
def find_levels(t, y, loop, own):
    """Write how large frictions can be, those that are still before they slide, the others while they do."""
    n_stops, law = own.closed.shape[0], own.law
    call_kernel(own.addresses[SWITCHES], t, y, loop.p, own.switches)
    for k in range(law.presses.shape[0]):
        level = max(own.switches[2 * n_stops + 3 * k + (2 if law.still[k] else 1)], 0.0)
        is_given = law.presses[k] == GIVEN
        law.fixed[k], law.coefficient[k] = (level, 0.0) if is_given else (0.0, level)


@jitted
def land(loop, own):
    """Find the forces, without stops whose flight the run sees, which then do not touch: `Holding._landed`.

    Whether there are such, and it is clear.
    """
    n_stops, law = own.closed.shape[0], own.law
    for _ in range(n_stops + 1):
        fastest, leaves, most = -1, -1, 0.0
        if find_acting_law(own):
            for s in range(n_stops):
                pull = own.compliance[s, s] * own.force[s]
                if law.touching[s] and pull > 0.0:
                    flight = max(own.speeds[s], 0.0) ** 2
                    excess = flight - 2.0 * pull * gap_tolerance(s, loop, own)
                    if abs(excess) <= PLAINLY * flight:
                        return False
                    if excess > most:
                        leaves, most = s, excess
            if leaves < 0:
                return True
        else:
            for s in range(n_stops):
                rises = law.touching[s] != 0 and own.speeds[s] > slow(s, loop, own)
                if rises and (fastest < 0 or own.speeds[s] > own.speeds[fastest]):
                    fastest = s
            leaves = fastest
            if leaves < 0:
                return False
        law.touching[leaves] = 0
    return False


@jitted
def find_acting_law(own):
    """Find the forces of stops that touch and of frictions; whether there are such."""
    n_stops, law = own.closed.shape[0], own.law
    for s in range(n_stops):
        own.acting[s] = BALANCES if law.touching[s] else NO_PART
    for k in range(law.presses.shape[0]):
        own.acting[n_stops + k] = BALANCES if law.still[k] and is_pressed(k, own) else NO_PART
        slides_by = own.p[own.sense[k]] if law.coefficient[k] > 0.0 else 0.0
        law.shift[k] = 1.0 if own.acting[n_stops + k] == BALANCES else slides_by
    copy(own.free, law.free)
    if not find_law(1.0, own):
        return False
    find_most(own)
    return True


@jitted
def load_is_borne_one_way(own):
    """Whether stops that bear and frictions that are still do not follow from each other."""
    n_stops, law = own.closed.shape[0], own.law
    for row in range(own.acting.shape[0]):
        bears = own.force[row] > 0.0 if row < n_stops else law.most[row - n_stops] > 0.0
        if not bears:
            own.acting[row] = NO_PART
    return factor_acting(own)


@jitted
def factor_acting(own):
    """Factor the compliance of what acts; whether its rows do not follow from each other."""
    n, m = own.acting.shape[0], 0
    for row in range(n):
        m += 1 if own.acting[row] == BALANCES else 0
    i = 0
    for row in range(n):
        if own.acting[row] == BALANCES:
            j = 0
            for other in range(n):
                if own.acting[other] == BALANCES:
                    own.gram[i * m + j] = own.compliance[row, other]
                    j += 1
            i += 1
    return factor(m, own.gram, DEPENDENT)


@jitted
def find_sticking(loop, own):
    """Mark which frictions stick, and where others begin to slide: `Holding._sticking`; whether it is known."""
    n_stops, law, is_undecided = own.closed.shape[0], own.law, False
    close = 1.0 - 2.0 * LIMIT_ROUNDED
    for k in range(law.still.shape[0]):
        row = n_stops + k
        pulled, force = acceleration(row, own), own.force[row]
        small, terms = UNDECIDED * largest_free(row, own), abs(own.free[row])
        for other in range(own.force.shape[0]):
            terms += abs(own.compliance[row, other]) * abs(own.force[other])
        terms += own.compliance[row, row] * law.most[k]
        held = abs(pulled) <= max(small, BALANCED * terms)
        law.sticks[k] = 1 if law.still[k] and held and abs(force) < close * law.most[k] else 0
        law.onset[k] = -sign(force) if force != 0.0 else sign(pulled)
        if law.still[k] and not law.sticks[k] and abs(pulled) <= small:
            law.sticks[k], is_undecided = -1, True
    if not is_undecided:
        return True
    copy(own.force, law.force)
    t = look_ahead_by_forces(loop, own)
    if not find_dynamics(t, own.moved, loop, own):
        return False
    find_levels(t, own.moved, loop, own)
    if not find_acting_law(own):
        return False
    for k in range(law.still.shape[0]):
        if law.sticks[k] < 0:
            force = own.force[n_stops + k]
            law.sticks[k] = 1 if abs(force) < close * law.most[k] else 0
            law.onset[k] = -sign(force) if force != 0.0 else law.onset[k]
    return come_back(loop, own)


@jitted
def come_back(loop, own):
    """Go back from a moment later to now, with the forces that were found."""
    t, law = loop.control[at.T], own.law
    if not find_dynamics(t, loop.y, loop, own):
        return False
    find_levels(t, loop.y, loop, own)
    copy(law.force, own.force)
    find_most(own)
    return True


@jitted
def close_and_stick(loop, own):
    """Write which stops are closed and which frictions stick, as forces tell; whether it is clear, and one motion."""
    n_stops, law, is_weak = own.closed.shape[0], own.law, False
    for s in range(n_stops):
        pull, closed = own.compliance[s, s] * own.force[s], False
        law.opening[s] = math.nan
        if law.touching[s]:
            small = UNDECIDED * largest_free(s, own)
            closed = pull > rounded(s, loop.sizes[at.NV], own)
            if abs(pull) <= small and abs(acceleration(s, own)) <= small and is_at_rest(s, loop, own):
                law.opening[s], is_weak, closed = acceleration(s, own) - pull, True, False
        own.p[own.closed[s]] = 1.0 if closed else 0.0
    if is_weak and not open_soon(loop, own):
        return False
    if not is_one_motion(loop, own):
        return False
    for k in range(law.still.shape[0]):
        own.p[own.stuck[k]] = float(law.still[k])
    for k in range(law.still.shape[0]):
        if law.waits[k] and not law.still[k] and not moves_by_itself(n_stops + k, own):
            return False
    return moves_by_itself(-1, own)


@jitted
def is_at_rest(row, loop, own):
    """Whether a gap or sliding has no speed within the tolerances."""
    return abs(own.speeds[row]) <= slow(row, loop, own)


@jitted
def moves_by_itself(row, own):
    """Factor what is held, and one more row (-1: none); whether they do not follow from each other."""
    for other in range(own.acting.shape[0]):
        own.acting[other] = BALANCES if other == row or is_held(other, own) else NO_PART
    return factor_acting(own)


@jitted
def open_soon(loop, own):
    """Whether all stops that neither press nor open do open a moment later: `Holding._about_to_press`."""
    n_stops, law = own.closed.shape[0], own.law
    for s in range(n_stops):
        law.restitution[s] = CHANGES * largest_free(s, own)  # these have had their use
    copy(own.force, law.force)
    t = look_ahead_by_forces(loop, own)
    if not find_dynamics(t, own.moved, loop, own):
        return False
    find_levels(t, own.moved, loop, own)
    if not find_acting_law(own):
        return False
    for s in range(n_stops):
        opening = law.opening[s]
        if opening == opening:
            change = acceleration(s, own) - own.compliance[s, s] * own.force[s] - opening
            if not change > law.restitution[s]:
                return False
    return come_back(loop, own)


@jitted
def is_one_motion(loop, own):
    """Whether sliding frictions that follow stops leave one motion: `coulomb.check_unique`."""
    n_stops, law, n_touching, slides = own.closed.shape[0], own.law, 0, False
    for k in range(law.presses.shape[0]):
        by = 0.0 if law.still[k] or not law.coefficient[k] > 0.0 else own.p[own.sense[k]]
        law.shift[k] = by
        slides |= by != 0.0
    if not slides:
        return True
    find_slopes(1.0, own)
    if not constraints_answer(own) or not invert_slopes(own):
        return False
    for s in range(n_stops):
        if law.touching[s] and own.speeds[s] <= slow(s, loop, own):
            law.places[n_touching] = s
            n_touching += 1
    if n_touching > MOST_STOPS:
        return False
    for subset in range(1, 1 << n_touching):
        for row in range(own.acting.shape[0]):
            own.acting[row] = BALANCES if row >= n_stops and law.still[row - n_stops] else NO_PART
        for index in range(n_touching):
            if subset >> index & 1:
                own.acting[law.places[index]] = BALANCES
        without = minor(False, own)
        if without > NO_MINOR and not minor(True, own) > REGULAR * without:
            return False
    return True


@jitted
def constraints_answer(own):
    """Whether the reactions that frictions follow answer to them with less than these: `coulomb._check_answers`.

    The largest sum of a row, or of a column, bounds the eigenvalues; where it does not tell, it is not known.
    """
    n, n_stops, law, by_rows, by_columns = own.force.shape[0], own.closed.shape[0], own.law, 0.0, 0.0
    for j in range(law.presses.shape[0]):
        row = column = 0.0
        for i in range(law.presses.shape[0]):
            row += answer(j, i, n, n_stops, own)
            column += answer(i, j, n, n_stops, own)
        by_rows, by_columns = max(by_rows, row), max(by_columns, column)
    return min(by_rows, by_columns) < 1.0 - REGULAR


@jitted
def answer(j, i, n, n_stops, own):
    """Return by how much at most the level of a friction changes with the force of another one that slides."""
    law, square = own.law, 0.0
    for c in range(law.first[j], law.first[j + 1]):
        change = own.reactions[law.pressing[c] * (n + 1) + 1 + n_stops + i] * law.shift[i]
        square += change * change
    return law.coefficient[j] * math.sqrt(square)


@jitted
def minor(with_friction, own):
    """Return the determinant of the compliance of what acts, scaled, with what slides or without."""
    n, law, m = own.acting.shape[0], own.law, 0
    for row in range(n):
        m += 1 if own.acting[row] == BALANCES else 0
    i = 0
    for row in range(n):
        if own.acting[row] != BALANCES:
            continue
        j = 0
        for other in range(n):
            if own.acting[other] != BALANCES:
                continue
            entry = own.compliance[row, other]
            if with_friction:
                entry = 0.0
                for k in range(n):
                    entry += own.compliance[row, k] * law.inverse[k * n + other]
            scale = max(own.compliance[row, row], 1e-300) * max(own.compliance[other, other], 1e-300)
            law.matrix[i * m + j] = entry / math.sqrt(scale)
            j += 1
        i += 1
    return determinant(m, law.matrix)


@jitted
def determinant(m, matrix):
    """Return the determinant of a matrix, which is overwritten."""
    found = 1.0
    for j in range(m):
        best = j
        for i in range(j + 1, m):
            if abs(matrix[i * m + j]) > abs(matrix[best * m + j]):
                best = i
        pivot = matrix[best * m + j]
        if not abs(pivot) > 0.0:
            return 0.0
        if best != j:
            found = -found
            for k in range(m):
                matrix[best * m + k], matrix[j * m + k] = matrix[j * m + k], matrix[best * m + k]
        found *= pivot
        for i in range(j + 1, m):
            part = matrix[i * m + j] / pivot
            for k in range(j, m):
                matrix[i * m + k] -= part * matrix[j * m + k]
    return found


@jitted
def find_slopes(driven, own):
    """Write how levels follow forces, about those found so far: `Levels.linear`.

    Parameters
    ----------
    driven : float
        1, or 0 for impulses, which nothing but they cause.
    """
    n, law = own.force.shape[0], own.law
    for k in range(law.presses.shape[0]):
        slope, stop, size = law.slope[k * n : (k + 1) * n], law.presses[k], 0.0
        law.constant[k] = law.fixed[k]
        for j in range(n):
            slope[j] = law.coefficient[k] if j == stop else 0.0
        for c in range(law.first[k], law.first[k + 1]):
            size += reaction(law.pressing[c], driven, own) ** 2
        size = math.sqrt(size)
        if not size > 0.0:
            continue
        law.constant[k] += law.coefficient[k] * size
        for c in range(law.first[k], law.first[k + 1]):
            part = law.coefficient[k] * reaction(law.pressing[c], driven, own) / size
            for j in range(n):
                slope[j] += part * own.reactions[law.pressing[c] * (n + 1) + 1 + j]
        for j in range(n):
            law.constant[k] -= slope[j] * own.force[j]


@jitted
def reaction(c, driven, own):
    """Return the multiplier of a constraint under the forces found so far."""
    n = own.force.shape[0]
    total = driven * own.reactions[c * (n + 1)]
    for j in range(n):
        total += own.reactions[c * (n + 1) + 1 + j] * own.force[j]
    return total


@jitted
def find_most(own):
    """Write how large frictions can be under the forces found."""
    find_slopes(1.0, own)
    write_most(own)


@jitted
def write_most(own):
    """Write levels as they follow forces."""
    n, law = own.force.shape[0], own.law
    for k in range(law.presses.shape[0]):
        law.most[k] = law.constant[k]
        for j in range(n):
            law.most[k] += law.slope[k * n + j] * own.force[j]


@jitted
def invert_slopes(own):
    """Write the inverse of 1 + E S C to `inverse`, of the directions S of sliding and the slopes C of levels."""
    n, n_stops, law = own.force.shape[0], own.closed.shape[0], own.law
    for i in range(n):
        for j in range(n):
            law.inverse[i * n + j] = 1.0 if i == j else 0.0
            law.by_z[i * n + j] = law.inverse[i * n + j]
            if i >= n_stops:
                law.by_z[i * n + j] += law.shift[i - n_stops] * law.slope[(i - n_stops) * n + j]
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(law.by_z[i * n + j]) > abs(law.by_z[best * n + j]):
                best = i
        pivot = law.by_z[best * n + j]
        if not abs(pivot) > 0.0:
            return False
        take_pivot(best, j, pivot, n, law.by_z)
        take_pivot(best, j, pivot, n, law.inverse)
        for i in range(n):
            part = law.by_z[i * n + j]
            if i != j and part != 0.0:
                for k in range(n):
                    law.by_z[i * n + k] -= part * law.by_z[j * n + k]
                    law.inverse[i * n + k] -= part * law.inverse[j * n + k]
    return True


@jitted
def take_pivot(best, j, pivot, n, matrix):
    """Let two rows of a matrix change their places, and divide the one that is in its place then."""
    for k in range(n):
        entry = matrix[best * n + k] / pivot
        matrix[best * n + k] = matrix[j * n + k]
        matrix[j * n + k] = entry


@jitted
def find_law(driven, own):
    """Write the forces (or impulses) of what acts by Coulomb's law to `force`, levels to `most`; whether there are any.

    Levels that follow multipliers are linearised about the last forces: `coulomb.coulomb_forces`.
    """
    law = own.law
    for row in range(own.force.shape[0]):
        own.force[row] = 0.0
    for _ in range(MOST_PASSES):
        find_slopes(driven, own)
        copy(own.force, law.before)
        if not invert_slopes(own) or not find_linear_forces(own):
            return False
        largest = change = 0.0
        for row in range(own.force.shape[0]):
            largest = max(largest, abs(own.force[row]))
            change = max(change, abs(own.force[row] - law.before[row]))
        if law.pressing.shape[0] == 0 or change <= CONVERGED * largest:
            return True
    return False


@jitted
def find_linear_forces(own):
    """Write the forces with levels that follow these linearly, and the levels: `coulomb._linear_forces`.

    With the forces z of stops, and z = x + L of frictions x in the limits of L that may stick, it is a complementarity
    problem; frictions that slide follow these. Returns whether it has a solution.
    """
    n, n_stops, law, n_z, n_y = own.acting.shape[0], own.closed.shape[0], own.law, 0, 0
    for row in range(n):
        if own.acting[row] == BALANCES:
            law.places[n_z] = row
            n_z += 1
            n_y += 1 if row >= n_stops else 0
    size = n_z + n_y
    for row in range(n):
        own.force[row] = 0.0
        for k in range(law.presses.shape[0]):
            own.force[row] -= law.inverse[row * n + n_stops + k] * law.shift[k] * law.constant[k]
        for column in range(n_z):
            law.by_z[row * n + column] = law.inverse[row * n + law.places[column]]
    for i in range(size * size):
        law.matrix[i] = 0.0
    y = n_z
    for i in range(n_z):
        row = law.places[i]
        law.right[i] = law.free[row]
        for other in range(n):
            law.right[i] += own.compliance[row, other] * own.force[other]
            for column in range(n_z):
                law.matrix[i * size + column] += own.compliance[row, other] * law.by_z[other * n + column]
        if row >= n_stops:
            k = row - n_stops
            law.matrix[i * size + y], law.right[y] = 1.0, 2.0 * law.constant[k]
            for other in range(n):
                slope = 2.0 * law.slope[k * n + other]
                law.right[y] += slope * own.force[other]
                for column in range(n_z):
                    law.matrix[y * size + column] += slope * law.by_z[other * n + column]
            law.matrix[y * size + i] -= 1.0
            y += 1
    if not solve_by_parts(size, law):
        return False
    for row in range(n):
        for column in range(n_z):
            own.force[row] += law.by_z[row * n + column] * law.z[column]
    write_most(own)
    y = n_z
    for i in range(n_z):
        row = law.places[i]
        if row >= n_stops:
            if law.z[y] > 0.0:  # at its limit exactly: the round-off of larger forces would leave it within
                own.force[row] = law.most[row - n_stops]
            y += 1
    return True


@jitted
def solve_by_parts(size, law):
    """Solve the complementarity problem of `matrix` and `right` for z, in parts that do not move each other."""
    for i in range(size):
        law.part[i] = -1
    for first in range(size):
        if law.part[first] >= 0:
            continue
        law.part[first], grows = first, True
        while grows:
            grows = False
            for i in range(size):
                if law.part[i] < 0:
                    for j in range(size):
                        tied = law.matrix[i * size + j] != 0.0 or law.matrix[j * size + i] != 0.0
                        if law.part[j] == first and tied and law.part[i] < 0:
                            law.part[i], grows = first, True
        if not pivot_to_complements(first, size, law):
            return False
    copy(law.right, law.z)
    return True


@jitted
def pivot_to_complements(which, size, law):
    """Solve one part of the complementarity problem by Lemke's pivots: `coulomb.lemke`; whether there is a solution.

    Rows and columns are scaled alike; ties are broken by the lexicographic rule.
    """
    n, largest, is_done = 0, 0.0, True
    for i in range(size):
        if law.part[i] == which:
            law.basis[n] = i
            n += 1
            largest = max(largest, abs(law.right[i] * scale_of(i, size, law)))
            is_done &= law.right[i] >= 0.0
            if not math.isfinite(law.right[i]):
                return False
    if not math.isfinite(largest):
        return False
    if is_done:
        for a in range(n):
            law.right[law.basis[a]] = 0.0
        return True
    width, tableau = 2 * n + 2, law.tableau
    for a in range(n):
        i = law.basis[a]
        for c in range(width):
            tableau[a * width + c] = 0.0
        tableau[a * width] = law.right[i] * scale_of(i, size, law) / largest
        tableau[a * width + 1 + a] = 1.0
        for b in range(n):
            j = law.basis[b]
            entry = law.matrix[i * size + j] * (scale_of(i, size, law) * scale_of(j, size, law))
            tableau[a * width + 1 + n + b] = -entry
        tableau[a * width + 1 + 2 * n] = -1.0
    # From here on the basis is that of the tableau: w as 0 to n - 1, z behind, then what makes all w positive.
    row, entering, artificial = 0, 2 * n, 2 * n
    for a in range(n):
        law.basis[a] = a
        if tableau[a * width] < tableau[row * width]:
            row = a
    for _ in range(PIVOTS * (n + 1)):
        eliminate(row, 1 + entering, n, width, tableau)
        leaving, law.basis[row] = law.basis[row], entering
        if leaving == artificial:
            write_solution(which, n, size, width, largest, law)
            return True
        entering = leaving + n if leaving < n else leaving - n
        row = leaving_row(1 + entering, n, width, artificial, law)
        if row < 0:
            return False
    return False


@jitted
def scale_of(i, size, law):
    """Return by what a row of the complementarity problem is multiplied."""
    diagonal = law.matrix[i * size + i]
    return 1.0 / math.sqrt(diagonal if diagonal > 0.0 else 1.0)


@jitted
def eliminate(row, column, n, width, tableau):
    """Let a column of the tableau be a unit vector."""
    pivot = tableau[row * width + column]
    for c in range(width):
        tableau[row * width + c] /= pivot
    for a in range(n):
        if a != row:
            part = tableau[a * width + column]
            for c in range(width):
                tableau[a * width + c] -= part * tableau[row * width + c]


@jitted
def leaving_row(column, n, width, artificial, law):
    """Return the row whose variable comes to zero first, -1 where none does: `coulomb._leaving_row`."""
    tableau, first = law.tableau, -1
    for k in range(n + 1):  # by the right-hand side, then by the columns of w, as long as rows tie
        least, n_left = math.inf, 0
        for a in range(n):
            if may_leave(a, column, k, width, law):
                least = min(least, tableau[a * width + k] / tableau[a * width + column])
        first = -1
        for a in range(n):
            law.z[a] = 1.0 if may_leave(a, column, k, width, law) else 0.0
            if law.z[a] != 0.0:
                ratio = tableau[a * width + k] / tableau[a * width + column]
                if ratio <= least + PIVOTED:
                    if k == 0 and law.basis[a] == artificial:
                        return a
                    first = a if first < 0 else first
                    n_left += 1
                else:
                    law.z[a] = 0.0
        if n_left <= 1:
            break
    return first


@jitted
def may_leave(a, column, k, width, law):
    """Whether a row is among those that tie so far."""
    if k == 0:
        return law.tableau[a * width + column] > PIVOTED
    return law.z[a] != 0.0


@jitted
def write_solution(which, n, size, width, largest, law):
    """Write what a tableau has found to the part's places in `z`."""
    a = 0
    for i in range(size):
        if law.part[i] == which:
            value = 0.0
            for row in range(n):
                if law.basis[row] == n + a:
                    value = max(law.tableau[row * width], 0.0)
            law.right[i] = value * scale_of(i, size, law) * largest
            a += 1
