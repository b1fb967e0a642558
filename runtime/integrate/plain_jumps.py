"""What follows where a force goes over to another branch, at a jump or a kink, in machine code.

It is what `EventActions._change_branches` does, which takes fifty times as long; beside it, events of the model's own
and impacts are those of `plain_events`. All else is left to Python: several events at one instant, a choice that has
jumped with what it compares, or stays at zero, and a force that pushes to its jump from both sides.
"""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.plain_events import (
    ACTED,
    AHEAD,
    BEGINNING,
    CLEAR,
    N_LOG,
    NOTHING,
    PILES_UP,
    ZENO,
    fired_alone,
    has_room,
    is_at_break,
    is_jump,
    largest,
    only_records,
    sign,
)
from symgen.runtime.integrate.plain_events import act as act_on_event

ADVANCE, EVENTS, RHS = range(3)  # in `addresses`
N_JUMPS, FIRST_BRANCH, IS_MULTISTEP, LOOKS_FOR_CHOICES, HOLDS_ALL, IS_UNDECIDED = range(6)  # in `counts`
BACK, JUMPED, PART_OF_RISE = 1e-6, 1e6, 1e-3  # as in `event_actions.py`


class Jumps(NamedTuple):
    """What acting on jumps takes, of n branches and NE events.

    Attributes
    ----------
    addresses : ndarray of uint64, shape (3,)
        The step loop's, and those of kernels that take a precomputed `p`.
    block, result : ndarray
        Of the step loop's `CallBlock`.
    counts : ndarray of int64, shape (6,)
        HOLDS_ALL: whether the loop is the one for branches of which none is 0. IS_UNDECIDED: whether Python is to
        choose branches of what is at zero behind an event.
    events : ndarray of int64, shape (n,)
        Which events are jumps.
    p, branched : ndarray
        Precomputed `p`, and scratch for the same with branches.
    before, after : ndarray, shape (n,)
        Branches.
    values, first, last : ndarray, shape (NE,)
    row, ahead : ndarray, shapes (n_row,), (nq + nv,)
    """

    addresses: np.ndarray
    block: np.ndarray
    result: np.ndarray
    counts: np.ndarray
    events: np.ndarray
    p: np.ndarray
    branched: np.ndarray
    before: np.ndarray
    after: np.ndarray
    values: np.ndarray
    first: np.ndarray
    last: np.ndarray
    row: np.ndarray
    ahead: np.ndarray


@jitted
def advance_over_jumps(loop, own):
    """Call the step loop, and change branches at jumps, until something is for Python to do.

    Returns
    -------
    int
        A status of the step loop, EVENT where Python is to act.
    """
    last = loop.counters[at.STEPS] + loop.counters[at.MAX_STEPS_PER_CALL]
    while True:
        call_kernel(own.addresses[ADVANCE], 0.0, own.block, own.block, own.result)
        status = int(own.result[0])
        if status != at.EVENT or is_at_break(loop) or not act(loop, own):
            return status
        if not has_room(last, loop) or needs_another_loop(own):
            return at.RUNNING


@jitted
def advance_over_jumps_and_events(loop, plain, own, after):
    """Do the same, and act on plain events beside jumps.

    Parameters
    ----------
    plain : Loop
        The same with `own.p`, whose choices are looked at as they are.
    after : After

    Returns
    -------
    int
        Also ZENO.
    """
    last = loop.counters[at.STEPS] + loop.counters[at.MAX_STEPS_PER_CALL]
    while True:
        call_kernel(own.addresses[ADVANCE], 0.0, own.block, own.block, own.result)
        status = int(own.result[0])
        if status != at.EVENT or is_at_break(loop):
            return status
        event = fired_alone(loop)
        if event >= 0 and is_jump(event, loop):
            if not act(loop, own):
                return status
        else:
            done = act_on_event(plain, after)
            if done != ACTED:
                return ZENO if done == PILES_UP else status
            if not only_records(loop, after):
                take_sides(loop, own)
        if not has_room(last, loop) or after.counts[N_LOG] >= after.log.shape[0] or needs_another_loop(own):
            return at.RUNNING
        if own.counts[IS_UNDECIDED]:
            return at.RUNNING


@jitted
def take_sides(loop, own):
    """Let forces go on along the branches of the sides that an event has left: `LoopArrays.take_branches`."""
    ne = loop.sizes[at.NE]
    for j in range(own.events.shape[0]):
        own.after[j] = sign(loop.control[at.N_CONTROL + at.SIDE * ne + own.events[j]])
        loop.p[own.counts[FIRST_BRANCH] + j] = own.after[j]
        if own.after[j] == 0.0:
            own.counts[IS_UNDECIDED] = 1


@jitted
def needs_another_loop(own):
    """Whether steps have to look for choices from here on, or no longer: `LoopArrays.look_for_choices`."""
    holds_all = 1
    for k in range(own.after.shape[0]):
        if own.after[k] == 0.0:
            holds_all = 0
    return own.counts[LOOKS_FOR_CHOICES] == 1 and holds_all != own.counts[HOLDS_ALL]


@jitted
def act(loop, own):
    """Let the force whose event has fired go over to its other branch; whether that is all there is to do."""
    ne, n, t = loop.sizes[at.NE], own.events.shape[0], loop.control[at.T]
    event, k = fired_alone(loop), -1
    for j in range(n):
        own.before[j] = loop.p[own.counts[FIRST_BRANCH] + j]
        own.after[j] = sign(loop.control[at.N_CONTROL + at.SIDE * ne + own.events[j]])
        if own.events[j] == event:
            k = j
    if k < 0:
        return False
    # On the branches that hold: a place at which one of them begins may be a hair before it.
    take_branches(own.before, own)
    call_kernel(own.addresses[EVENTS], t, loop.y, own.branched, own.values)
    g, floor = own.values[event], loop.control[at.N_CONTROL + at.FLOOR * ne + event]
    after = -own.before[k] if own.before[k] != 0.0 else sign(g)
    begins, past = loop.control[at.H_LAST] <= BEGINNING * abs(t), abs(g)
    if begins and past > CLEAR * floor:
        past = 0.0
    # What jumped exactly to zero is on neither side yet; what its own motion brought there goes on.
    side = sign(g) if begins and past == 0.0 else at.LEANING * after
    own.after[k] = sign(side)
    if not begins and past > JUMPED * floor and past > PART_OF_RISE * abs(rise(event, loop, own)):
        return False  # it may have jumped there with a choice that it is made of
    if slides(event, k, floor, loop, own) or stays(own):
        return False
    loop.control[at.N_CONTROL + at.SIDE * ne + event] = side
    loop.control[at.N_CONTROL + at.BAND * ne + event] = max(floor + past, NOTHING * largest(loop))
    for j in range(n):
        loop.p[own.counts[FIRST_BRANCH] + j] = own.after[j]
    own.counts[N_JUMPS] += 1
    loop.counters[at.F_VALID] = 0
    if own.counts[IS_MULTISTEP]:
        loop.control[at.H] = 0.0  # its history is of the motion before the jump
    return True


@jitted
def take_branches(branches, own):
    """Write parameters with some branches to `branched`."""
    copy(own.p, own.branched)
    for j in range(branches.shape[0]):
        own.branched[own.counts[FIRST_BRANCH] + j] = branches[j]


@jitted
def slides(event, k, floor, loop, own):
    """Whether the force pushes to its jump from both sides: `EventActions._refuse_sliding`.

    Leaves event functions here and a short time later, on the branches `after`, in `first` and `last`.
    """
    side = own.after[k]
    own.after[k] = -side
    there = rise(event, loop, own)
    own.after[k] = side
    here = rise(event, loop, own)
    clear = max(CLEAR * floor, BACK * abs(there))
    return side * here < -clear and side * there > clear


@jitted
def stays(own):
    """Whether something that a branch belongs to is at zero and stays there: `EventActions._leave_what_stays`."""
    for j in range(own.events.shape[0]):
        event = own.events[j]
        if own.after[j] != 0.0 and own.first[event] == 0.0 and own.last[event] == 0.0:
            return True
    return False


@jitted
def rise(event, loop, own):
    """Return by how much an event function rises in a short time on the branches `after`: `EventActions._rises`."""
    nq, nv, t = loop.sizes[at.NQ], loop.sizes[at.NV], loop.control[at.T]
    n = nq + nv
    take_branches(own.after, own)
    call_kernel(own.addresses[RHS], t, loop.y, own.branched, own.row)
    least, fastest = min(max(largest(loop), 1e-3), 1.0), 0.0
    for j in range(n):
        fastest = max(fastest, abs(own.row[j]) / max(abs(loop.y[j]), least))
    dt = AHEAD / fastest if 0.0 < fastest and fastest < math.inf else AHEAD
    for j in range(n):
        own.ahead[j] = loop.y[j] + dt * own.row[j]
    if nq == nv:  # from rest, accelerations tell
        for j in range(nq):
            own.ahead[j] += 0.5 * dt * dt * own.row[nq + j]
    call_kernel(own.addresses[EVENTS], t + dt, own.ahead, own.p, own.last)
    call_kernel(own.addresses[EVENTS], t, loop.y, own.p, own.first)
    return own.last[event] - own.first[event]
