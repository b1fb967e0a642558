"""Stops and frictions at one instant, in machine code: their equations of motion, and what is as good as zero.

It is what `contact/local_dynamics.py` and `contact/instant.py` know of a state.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite, copy
from symgen.runtime.integrate.plain_events import (
    DEPENDENT,
    EPS,
    EVENTS,
    FORCES,
    GAMMA,
    JACOBIAN,
    MANY,
    MASS,
    MAY_JUMP,
    RESIDUAL,
    RHS,
    SINGULAR_MASS,
    SURELY_SEEN,
    SWITCHES,
    back,
    factor,
    forward,
    solve,
)

# Addresses: those of the free form where `plain_events` has them; rows and rates of what is held take `p` itself, all
# others what is worked out of it. SETUP: what works that out. Resets, in the order of the events, follow.
SETUP, HELD_ADVANCE, HELD_EVENTS, HELD_RHS, HELD_SETUP, ROWS, FIRST_RESET = range(GAMMA + 1, GAMMA + 8)
# In `counts`, behind those of `plain_events`. ASKS: Python is to tell the guard what to expect. STRUCK_IN_TURN: blows
# are those of one stop after another. AT_EVENT: the loop has returned at an event already.
IS_HELD, ASKS, STRUCK_IN_TURN, AT_EVENT = range(MAY_JUMP + 1, MAY_JUMP + 5)
N_COUNTS = AT_EVENT + 1
# Speeds of gaps that close no faster are at rest, as in `contact/switching.py`.
SETTLED, NO_SPEED = 1e-12, 1e-15
# As in `contact/instant.py`, `event_actions.py`.
UNDECIDED, BALANCED, ROUNDED, LIMIT_ROUNDED, LITTLE = 1e-9, 1e-6, 1e-13, 1e-10, 1e-7
CHANGES = 1e-11  # as in `contact/switching.py`: of the largest acceleration, in a moment, more than round-off


class Guard(NamedTuple):
    """The guard of a form with constraints, and what it is told with; empty arrays of a form that has none.

    Attributes
    ----------
    addresses : ndarray of uint64, shape (2,)
        Of the residual of constraints, and of G, which takes what is worked out of `p`.
    context, weights, curve : ndarray
        See `kkt.Lease.arrays`.
    switch : ndarray of int64, shape (number of constraints,)
        Where in `p` it says that one holds; -1 for those of the model, which always hold.
    rank : ndarray of int64, shape (1,)
        `kkt.Expectation.rank` where the run was when these arrays were made.
    rows, squares : ndarray, shapes (number of constraints * nv,), (number of constraints,)
    sizing : Sizing
    """

    addresses: np.ndarray
    context: np.ndarray
    weights: np.ndarray
    curve: np.ndarray
    switch: np.ndarray
    rank: np.ndarray
    rows: np.ndarray
    squares: np.ndarray
    sizing: NamedTuple


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
    steps, places : ndarray
        What weights of guards are found with.
    position, sizes : ndarray, shapes (nq + nv,), (number of groups,)
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
    jacobian, residual, speeds : ndarray, shapes (n * nv,), (nh + m + n,), (n,)
    rows_at, constraints : ndarray of int64, shapes (n,), (m,)
        Which rows of the closed form are those of stops and frictions, and of the model's m constraints.
    all_rows, all_gamma : ndarray, shapes ((m + n) * nv,), (m + n,)
        Of the closed form, with all that can be held.
    tied, ties, multipliers, reactions : ndarray, shapes (m * nv,), (m * m,), (m,), (m * (n + 1),)
        L⁻¹Gᵀ, row by row, factors of its products among each other, scratch; the multipliers of constraints without
        forces of stops and frictions, and by a unit of each.
    reached : ndarray of int64, shape (nv,)
    mass, inertia, response, compliance : ndarray, shapes (nv * nv,), (nv,), (n, nv), (n, n)
    rates, change, free : ndarray, shapes (nv,), (nv,), (n,)
    part, acting : ndarray of int64, shape (n,)
    force, gram, right : ndarray, shapes (n,), (n * n,), (n,)
        Of what is held together: forces, factors of the compliance of what acts, and what these are solved with.
    law : plain_coulomb.Coulomb
        What frictions that follow reactions take.
    of_free, of_held : Guard
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
    steps: np.ndarray
    places: np.ndarray
    position: np.ndarray
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
    rows_at: np.ndarray
    constraints: np.ndarray
    all_rows: np.ndarray
    all_gamma: np.ndarray
    tied: np.ndarray
    ties: np.ndarray
    multipliers: np.ndarray
    reactions: np.ndarray
    reached: np.ndarray
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
    law: NamedTuple
    of_free: NamedTuple
    of_held: NamedTuple


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
def is_closing(i, loop, own):
    """Whether a gap closes by more than what is at rest: `switching.impulses`.

    Where all rates are round-off of each other, so are all speeds: they are measured by the tolerances of the run, too.
    """
    nq, nv, most = loop.sizes[at.NQ], loop.sizes[at.NV], 0.0
    for k in range(own.speeds.shape[0]):
        moved = 0.0
        for j in range(nv):
            moved += abs(own.jacobian[k * nv + j]) * abs(loop.y[nq + j])
        most = max(most, moved)
    speed = own.speeds[i]
    return -speed > SETTLED * abs(speed) + NO_SPEED * max(most, slow(i, loop, own))


@jitted
def gap_tolerance(i, loop, own):
    """Return how much of a gap the tolerances of the run leave open: `Instant._gap_tolerances`."""
    nv, rows, size = loop.sizes[at.NV], 0.0, size_of_gap(i, loop, own)
    for j in range(nv):
        rows += abs(own.jacobian[i * nv + j])
    allowed = rows * (loop.control[at.ATOL] + loop.control[at.RTOL] * size)
    return max(allowed, SURELY_SEEN * EPS * rows * size)


@jitted
def size_of_gap(i, loop, own):
    """Return the largest of the coordinates that a gap is made of, at least 1: `LocalDynamics.sizes`."""
    nv, m, size, grows = loop.sizes[at.NV], own.constraints.shape[0], 1.0, True
    for j in range(nv):
        size = max(size, abs(loop.y[j]))
        own.reached[j] = 1 if own.jacobian[i * nv + j] != 0.0 else 0
    if size == 1.0 or m > MANY:
        return size
    while grows:  # errors of others come to these by constraints alone
        grows = False
        for c in range(m):
            row, ties, is_wider = own.constraints[c] * nv, False, False
            for j in range(nv):
                if own.all_rows[row + j] != 0.0:
                    ties |= own.reached[j] == 1
                    is_wider |= own.reached[j] == 0
            if ties and is_wider:
                grows = True
                for j in range(nv):
                    if own.all_rows[row + j] != 0.0:
                        own.reached[j] = 1
    size = 1.0
    for j in range(nv):
        if own.reached[j] == 1:
            size = max(size, abs(loop.y[j]))
    return size


@jitted
def find_rows(t, y, own):
    """Write the rows of stops and frictions and their speeds to `jacobian` and `speeds`."""
    n_stops = own.closed.shape[0]
    copy(own.p, own.everything)
    for i in range(n_stops):
        own.everything[own.closed[i]] = 1.0
    for j in range(own.stuck.shape[0]):
        own.everything[own.stuck[j]] = 1.0
    call_kernel(own.addresses[JACOBIAN], t, y, own.everything, own.all_rows)
    call_kernel(own.addresses[RESIDUAL], t, y, own.everything, own.residual)
    nv, first = own.rates.shape[0], own.residual.shape[0] - own.all_gamma.shape[0]
    for i in range(own.speeds.shape[0]):
        k = own.rows_at[i]
        copy(own.all_rows[k * nv : (k + 1) * nv], own.jacobian[i * nv : (i + 1) * nv])
        own.speeds[i] = own.residual[first + k]


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
    call_kernel(own.addresses[GAMMA], t, y, own.everything, own.all_gamma)
    for i in range(nv):
        own.inertia[i] = own.mass[i * nv + i]
    if not factor(nv, own.mass, SINGULAR_MASS) or not factor_constraints(nv, own):
        return False
    solve_constrained(1.0, 0, own.rates, own)
    for i in range(n):
        row = own.jacobian[i * nv : (i + 1) * nv]
        copy(row, own.response[i])
        solve_constrained(0.0, 1 + i, own.response[i], own)
        own.free[i] = -own.all_gamma[own.rows_at[i]]
        for j in range(nv):
            own.free[i] += row[j] * own.rates[j]
    for i in range(n):
        for k in range(n):
            own.compliance[i, k] = 0.0
            for j in range(nv):
                own.compliance[i, k] += own.jacobian[i * nv + j] * own.response[k, j]
    return all_finite(own.free, n) and all_finite(own.speeds, n)


@jitted
def factor_constraints(nv, own):
    """Write L⁻¹Gᵀ of the model's constraints to `tied`, factors of its products to `ties`; whether there are such."""
    m = own.constraints.shape[0]
    for c in range(m):
        row, k = own.tied[c * nv : (c + 1) * nv], own.constraints[c] * nv
        copy(own.all_rows[k : k + nv], row)
        forward(nv, own.mass, row)
        for d in range(c + 1):
            total = 0.0
            for j in range(nv):
                total += row[j] * own.tied[d * nv + j]
            own.ties[c * m + d] = total
    return factor(m, own.ties, DEPENDENT)


@jitted
def solve_constrained(part, column, x, own):
    """Replace forces by the accelerations a that they cause with G a = part γ; multipliers go to `reactions`.

    Constraints are met a second time, for what round-off has left.
    """
    nv, m, n_columns = own.rates.shape[0], own.constraints.shape[0], own.speeds.shape[0] + 1
    forward(nv, own.mass, x)
    for c in range(m):
        own.reactions[c * n_columns + column] = 0.0
    for _ in range(2 if m > 0 else 0):
        for c in range(m):
            left = part * own.all_gamma[own.constraints[c]]
            for j in range(nv):
                left -= own.tied[c * nv + j] * x[j]
            own.multipliers[c] = left
        solve(m, own.ties, own.multipliers)
        for c in range(m):
            own.reactions[c * n_columns + column] += own.multipliers[c]
            for j in range(nv):
                x[j] += own.tied[c * nv + j] * own.multipliers[c]
    back(nv, own.mass, x)


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
def level(k, t, y, loop, own):
    """Return how large a friction can be that sticks."""
    call_kernel(own.addresses[SWITCHES], t, y, loop.p, own.switches)
    return max(own.switches[2 * own.closed.shape[0] + 3 * k + 2], 0.0)


@jitted
def acceleration(i, own):
    """Return the acceleration of a gap or sliding under `force`."""
    total = own.free[i]
    for k in range(own.force.shape[0]):
        total += own.compliance[i, k] * own.force[k]
    return total


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
def move_ahead(loop, own):
    """Write the state a moment later under the accelerations `slope` to `moved`; returns its time."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    ahead = LITTLE * find_moment(loop, own)
    for j in range(nv):
        own.moved[j] = loop.y[j] + ahead * loop.y[nq + j]
        own.moved[nq + j] = loop.y[nq + j] + ahead * own.slope[j]
    return loop.control[at.T] + ahead


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
