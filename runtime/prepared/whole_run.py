"""Whole runs in machine code, row by row: what `driver.Run` does of a run with plain events, to the same bits."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints import branch
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import plain_events
from symgen.runtime.integrate.loop import all_finite, copy
from symgen.runtime.integrate.plain_events import act, begin_events
from symgen.runtime.integrate.projection import project_state
from symgen.runtime.prepared import layout as here
from symgen.runtime.prepared.end_checks import balance_is_kept, events_are_seen
from symgen.runtime.prepared.start_look import energy_can_be_kept, look_at_start

STEPS_ASIDE = 256  # `loop_arrays._STEPS_ASIDE`


@jitted
def run_rows(loop, plan, look, after, rows):
    """Make the runs of some rows, from `places[ROW]` to `places[LAST]`, until STEPS_TO_GO steps are taken.

    Returns
    -------
    int
        SUCCESS where all rows are done; else GOES_ON: call again.
    """
    places = rows.places
    while places[here.ROW] < places[here.LAST]:
        i = places[here.ROW]
        if places[here.UNDER_WAY] == 0:
            rows.status[i] = begin(i, loop, plan, look, after, rows)
            places[here.UNDER_WAY] = 1
        if rows.status[i] == here.GOES_ON:
            before = loop.counters[at.STEPS]
            rows.status[i] = go_on(loop, plan, look, after, places[here.STEPS_TO_GO])
            places[here.STEPS_TO_GO] -= loop.counters[at.STEPS] - before
            if rows.status[i] == here.GOES_ON:
                return here.GOES_ON
        end(i, loop, plan, look, rows)
        places[here.ROW] = i + 1
        places[here.UNDER_WAY] = 0
        if places[here.STEPS_TO_GO] <= 0:
            return here.GOES_ON
    return here.SUCCESS


@jitted
def begin(i, loop, plan, look, after, rows):
    """Put a loop at the start of a row; returns GOES_ON, or what speaks against it."""
    n_p, n = plan.base_p.shape[0], rows.y.shape[1]
    if not set_values(plan.base_p, rows.p_at, rows.p[i], loop.p):
        return here.NOT_FINITE_INPUT
    copy(rows.y[i], loop.y)
    if not all_finite(loop.y, n):
        return here.NOT_FINITE_INPUT
    fill_zero(loop.y[n:])
    copy(plan.control, loop.control)
    for k in range(plan.counters.shape[0]):
        loop.counters[k] = plan.counters[k]
    fill_zero(loop.f)
    fill_zero(loop.work)
    for k in range(loop.dense.shape[0]):
        fill_zero(loop.dense[k])
    if plan.asked[here.HAS_HOISTED] > 0.0:
        call_kernel(plan.addresses[here.SETUP], 0.0, loop.p, loop.p, loop.p[n_p:])
    copy(plan.tail, loop.p[loop.p.shape[0] - plan.tail.shape[0] :])
    nv = loop.sizes[at.NV]
    status = look_at_start(loop, plan, look, rows.sizes[i * nv : (i + 1) * nv], rows.is_assembled[i])
    if status != here.SUCCESS:
        return status
    if plan.asked[here.SCALES_ENERGY] != 0.0:
        if energy_can_be_kept(loop, plan, look):
            copy(loop.y[:n], look.y)
            call_kernel(plan.addresses[here.ENERGY], loop.control[at.T], look.y, loop.p, look.energy)
            loop.control[at.ENERGY_LEVEL] = look.energy[0] + look.energy[1]
            loop.addresses[at.ENERGY] = plan.addresses[here.ENERGY]
        elif plan.asked[here.SCALES_ENERGY] > 1.0:
            return here.NEEDS_PYTHON  # it is wanted, and does not suit
        else:
            loop.addresses[at.ENERGY] = 0
    advance(loop, plan, math.inf, math.inf, 0)
    if loop.frame_times.shape[0] > 0:
        copy(loop.y, loop.frames[0])
    loop.counters[at.NEXT_FRAME] = 1
    fill_zero(look.resets)
    if loop.sizes[at.NE] > 0 and not begin_events(loop, after):
        return here.NEEDS_PYTHON
    return here.GOES_ON


@jitted
def set_values(base, places, values, target):
    """Write `base` with some values at `places` to `target`; returns whether these are finite."""
    copy(base, target)
    total = 0.0
    for k in range(places.shape[0]):
        target[places[k]] = values[k]
        total += values[k] * 0.0
    return total == 0.0


@jitted
def fill_zero(array):
    """Set all entries to zero."""
    for k in range(array.shape[0]):
        array[k] = 0.0


@jitted
def advance(loop, plan, stop, watch, max_steps):
    """Call the step loop; see `loop_arrays.LoopArrays.advance`."""
    loop.control[at.T_STOP], loop.control[at.T_WATCH] = stop, watch
    loop.counters[at.MAX_STEPS_PER_CALL] = max_steps
    loop.counters[at.N_LOGGED_STEPS] = 0
    call_kernel(plan.addresses[here.ADVANCE], 0.0, plan.block, plan.block, plan.result)
    return int(plan.result[0])


@jitted
def go_on(loop, plan, look, after, steps):
    """Go on by some steps: to the end, a failure, or GOES_ON."""
    t_end, wanted = plan.asked[here.T_END], loop.counters[at.STEPS] + steps
    while True:
        if loop.control[at.T] >= t_end or is_same(loop, plan):
            # Steps of adaptive methods that nobody watches are projected in passing.
            if plan.asked[here.ADAPTIVE] > 0.0:
                project_state(loop, loop.control[at.T], loop.y, plan.saved)
            return here.SUCCESS
        taken = loop.counters[at.STEPS]
        if taken >= wanted:
            return here.GOES_ON
        if taken >= plan.asked[here.MAX_STEPS]:
            return here.STEPS_USED_UP
        allowed = min(min(wanted, int(plan.asked[here.MAX_STEPS])) - taken, loop.step_log.shape[0])
        status = advance(loop, plan, math.inf, t_end, allowed)
        if status == at.NEAR_WATCH:
            status = step_past(loop, plan, t_end)
            if status == here.GOES_ON:
                return here.SUCCESS
        if status < 0:
            return here.NEEDS_PYTHON if plan.asked[here.HAS_FALLBACK] > 0.0 else status
        if status == at.EVENT:
            after.counts[plain_events.N_LOG] = 0  # nobody reads it
            done = act(loop, after)
            if done == plain_events.NOT_PLAIN:
                return here.NEEDS_PYTHON
            if done == plain_events.PILES_UP:
                return here.ZENO
            if done == plain_events.ENDS:
                return here.TERMINATED
            for k in range(loop.counters[at.NEXT_FRAME], look.resets.shape[0]):
                look.resets[k] = after.sums[plain_events.RESET_ENERGY]


@jitted
def is_same(loop, plan):
    """Whether the time reached is the end, but for ticks of floating-point time."""
    return abs(loop.control[at.T] - plan.asked[here.T_END]) <= plan.asked[here.SAME_WITHIN]


@jitted
def step_past(loop, plan, t_end):
    """Take one step, and the state at the end if that passes it; see `driver.Run._step_past`.

    Returns
    -------
    int
        GOES_ON where the end is reached; else the status of the step.
    """
    save(loop, plan)
    status = advance(loop, plan, math.inf, math.inf, 1)
    if status < 0 and plan.asked[here.HAS_FALLBACK] == 0.0:
        restore(loop, plan)
        return advance(loop, plan, t_end, math.inf, STEPS_ASIDE)
    if not (loop.control[at.T] > t_end and (status == at.EVENT or not is_same(loop, plan))):
        return status
    restore(loop, plan)
    loop.control[at.ASIDE] = 1.0
    next_frame = loop.counters[at.NEXT_FRAME]
    loop.counters[at.NEXT_FRAME] = loop.frame_times.shape[0]
    if advance(loop, plan, t_end, math.inf, STEPS_ASIDE) != at.REACHED_STOP:
        return at.EVENT  # its dense output is for Python to take
    loop.control[at.ASIDE] = 0.0
    loop.counters[at.NEXT_FRAME] = next_frame
    return here.GOES_ON


@jitted
def save(loop, plan):
    """Keep what the loop carries from step to step."""
    saved, n = plan.saved, 0
    n = keep(loop.control, saved, n)
    n = keep(loop.y, saved, n)
    n = keep(loop.f, saved, n)
    n = keep(loop.work, saved, n)
    n = keep(plan.curve, saved, n)
    n = keep(loop.p[loop.p.shape[0] - plan.tail.shape[0] :], saved, n)
    for k in range(loop.dense.shape[0]):
        n = keep(loop.dense[k], saved, n)
    for k in range(loop.counters.shape[0]):
        plan.saved_counters[k] = loop.counters[k]
    if plan.guard.shape[0] > 0:
        plan.saved_counters[loop.counters.shape[0]] = plan.guard[branch.NEAR_SINGULAR]


@jitted
def keep(source, saved, n):
    """Copy `source` to `saved[n:]`; returns where the next one begins."""
    copy(source, saved[n:])
    return n + source.shape[0]


@jitted
def restore(loop, plan):
    """Bring back what `save` has kept."""
    saved, n = plan.saved, 0
    n = bring_back(saved, n, loop.control)
    n = bring_back(saved, n, loop.y)
    n = bring_back(saved, n, loop.f)
    n = bring_back(saved, n, loop.work)
    n = bring_back(saved, n, plan.curve)
    n = bring_back(saved, n, loop.p[loop.p.shape[0] - plan.tail.shape[0] :])
    for k in range(loop.dense.shape[0]):
        n = bring_back(saved, n, loop.dense[k])
    for k in range(loop.counters.shape[0]):
        loop.counters[k] = plan.saved_counters[k]
    if plan.guard.shape[0] > 0:
        plan.guard[branch.NEAR_SINGULAR] = plan.saved_counters[loop.counters.shape[0]]


@jitted
def bring_back(saved, n, target):
    """Copy from `saved[n:]` to `target`; returns where the next one begins."""
    copy(saved[n : n + target.shape[0]], target)
    return n + target.shape[0]


@jitted
def end(i, loop, plan, look, rows):
    """Write what became of a row."""
    status = rows.status[i]
    rows.steps[i], rows.t[i] = loop.counters[at.STEPS], loop.control[at.T]
    for k in range(rows.out.shape[1]):
        rows.out[i, k] = math.nan
    if status != here.SUCCESS and status != here.TERMINATED:
        return
    n, reached = rows.y.shape[1], loop.counters[at.NEXT_FRAME]
    if status == here.SUCCESS:
        loop.control[at.T] = rows.t[i] = plan.asked[here.T_END]
        reached = loop.frame_times.shape[0]
        if reached > 0:
            copy(loop.y, loop.frames[reached - 1])
    if rows.wanted.shape[0] == 0:
        copy(loop.y[:n], rows.out[i])
    for k in range(rows.wanted.shape[0]):
        if rows.wanted[k] < reached:
            copy(loop.frames[rows.wanted[k]][:n], rows.out[i, k * n : (k + 1) * n])
    if plan.asked[here.CHECKS] > 0.0 and not (
        balance_is_kept(reached, loop, plan, look) and events_are_seen(loop)
    ):
        rows.status[i] = here.DOUBTFUL
