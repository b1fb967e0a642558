"""What every method does after an accepted step: events, frames, the step log."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.dense import evaluate_dense
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.projection import project_state, projection_size


@jitted
def frame_is_due(loop, t1):
    """Whether the next frame lies at or before `t1` [s]."""
    return (
        loop.counters[at.NEXT_FRAME] < loop.frame_times.shape[0]
        and loop.frame_times[loop.counters[at.NEXT_FRAME]] <= t1
    )


@jitted
def write_frames(loop, t0, h, t1, y1, dense, n_terms, buffer):
    """Write every frame up to `t1` by dense output of the step from `t0` of length `h`, on the constraints.

    Frames are written from row `counters[NEXT_FRAME]` on.

    Parameters
    ----------
    t0, h : float [s]
        Start and length of the step that `dense` describes.
    t1 : float [s]
        Last time to write; frames exactly at `t1` are `y1` itself.
    y1 : ndarray, shape (NY,)
        State at `t1`.
    dense : ndarray, shape (8, NY)
    buffer : ndarray
        See `projection.projection_size`.
    """
    ny, goes_by_frames = loop.sizes[at.NY], False
    while frame_is_due(loop, t1):
        row = loop.counters[at.NEXT_FRAME]
        t = loop.frame_times[row]
        if t == t1:
            copy(y1, loop.frames[row])
        else:
            evaluate_dense((t - t0) / h, dense, n_terms, ny, loop.frames[row])
            project_state(loop, t, loop.frames[row], buffer)
            goes_by_frames = loop.sizes[at.NM] > 0
        loop.counters[at.NEXT_FRAME] = row + 1
    row = loop.counters[at.NEXT_FRAME]
    if goes_by_frames and row < loop.frames.shape[0]:
        # The guard takes the state that was projected last for where the run is: frames must not tell it. What is not
        # written yet serves as scratch.
        copy(y1, loop.frames[row])
        project_state(loop, t1, loop.frames[row], buffer)


# The side of zero that an event function is on follows the motion *inside* the steps (`follow`): a function that leaves
# zero and comes back to it within a step was on that side, wherever the step ends. What is as good as zero (within
# BAND) has no side of its own. It keeps the one that it had, so that no crossing gets lost between the end of a step,
# an event of another function, and the start of the next step:
#
# * 1, -1: it is, or was last, clearly on this side.
# * 0.5, -0.5 (`layout.LEANING`): at zero, and known to leave it, or to have come to it, on this side. Coming clear on
#   the other one is a crossing at the start.
# * 0: at zero, and whichever side it comes clear on is no crossing.

# A step is looked at in Chebyshev points, dense at its ends, where a dip is not flanked by other points.
N_UNIFORM = 12
# While an event function has not left zero yet, also at 2^-5, 2^-7, ... of the step: what leaves zero and
# returns within one step would pass unseen.
N_EARLY = 12
N_POINTS = N_EARLY + N_UNIFORM + 1
REFINEMENTS = 24
# A step that is much longer than what went before is looked at part by part, each as long as all before it: functions
# that come and go many times in it, as teeth do, show their first crossing so.
SHORTEST_PART, FIRST_PART = 2.0**-40, 2.0**-6
# From a step's ends, in parts of the interval next to it, to where the slope there is looked at.
INWARDS = 1e-3
CHEBYSHEV = tuple(0.5 * (1.0 - math.cos(math.pi * k / N_UNIFORM)) for k in range(N_UNIFORM + 1))
GOLDEN = (3.0 - math.sqrt(5.0)) / 2.0
EPS = float(np.finfo(float).eps)
# Of what a function is beside a zero: what it does not change by in the last digits of time, unless it jumps.
OF_JUMP, DOUBLINGS = 1e-6, 8
# Times round-off: how far past zero an event's function may be where another one of its instant is found.
WITHIN = 8.0


class Scan(NamedTuple):
    """A step that is searched for events.

    Attributes
    ----------
    t0, h : float [s]
    dense : ndarray, shape (8, NY)
        Its dense output, `n_terms` rows of it.
    y : ndarray, shape (NY,)
        The state at the place that was looked at last.
    buffer : ndarray
        See `projection.projection_size`.
    g : ndarray, shape (NE,)
        The event functions there.
    thetas : ndarray, shape (N_POINTS,)
        Places of the samples, 0 to 1.
    table : ndarray, shape (N_POINTS * NE,)
        The event functions at these.
    """

    t0: float
    h: float
    dense: np.ndarray
    n_terms: int
    y: np.ndarray
    buffer: np.ndarray
    g: np.ndarray
    thetas: np.ndarray
    table: np.ndarray


@jitted
def event_scratch_size(sizes):
    """Length of the scratch array that `find_event` needs, beyond one state."""
    return (N_POINTS + 1) * sizes[at.NE] + N_POINTS + 2 * sizes[at.NE]


@jitted
def event_values(theta, on_constraints, loop, scan, g):
    """Write the event functions at place `theta` of a step to `g`, and the state there to `y`."""
    evaluate_dense(theta, scan.dense, scan.n_terms, loop.sizes[at.NY], scan.y)
    if on_constraints:
        project_state(loop, scan.t0 + theta * scan.h, scan.y, scan.buffer)
    call_kernel(loop.addresses[at.EVENTS], scan.t0 + theta * scan.h, scan.y, loop.p, g)


@jitted
def find_event(loop, t0, h, dense, n_terms, y1, buffer, scratch):
    """Find the first event of a step; sets SIDE, FIRED and EVENT_INDEX.

    Parameters
    ----------
    t0, h : float [s]
    dense : ndarray, shape (8, NY)
        Dense output of the step, `n_terms` rows of it.
    y1 : ndarray, shape (NY,)
        State at the end of the step.
    buffer : ndarray
        See `projection.projection_size`.
    scratch : ndarray
        Its first NY entries receive the state just past the event.

    Returns
    -------
    float
        Place of the event in the step, 0 to 1, where its function is zero or has its new sign; -1 if there is none.
    """
    ne = loop.sizes[at.NE]
    y, rest = scratch[: loop.sizes[at.NY]], scratch[loop.sizes[at.NY] :]
    thetas = rest[:N_POINTS]
    g = rest[N_POINTS : N_POINTS + ne]
    roots = rest[N_POINTS + ne : N_POINTS + 2 * ne]
    table = rest[N_POINTS + 3 * ne : N_POINTS + 3 * ne + N_POINTS * ne]
    scan = Scan(t0, h, dense, n_terms, y, buffer, g, thetas, table)
    eventless = loop.control[at.EVENTLESS]
    start, end = 0.0, end_of_part(2.0 * eventless / h if eventless > 0.0 else FIRST_PART)
    while True:
        n_points = look_at_part(start, end, y1, loop, scan)
        first = 2.0
        for e in range(ne):
            roots[e] = first_root(e, n_points, loop, scan)
            first = min(first, roots[e])
        if first <= 1.0:
            return gather(first, roots, n_points, loop, scan)
        look_again(n_points, loop, scan)
        follow_sides(n_points, loop, scan, 2.0)
        if end == 1.0:
            note_lowest(n_points, loop, scan)
            return -1.0
        start, end = end, end_of_part(2.0 * end)


@jitted
def end_of_part(wanted):
    """Return where a part of a step ends that begins a step, or is as long as all before it; the rest is one."""
    return 1.0 if wanted >= 0.5 else max(wanted, SHORTEST_PART)


@jitted
def look_at_part(start, end, y1, loop, scan):
    """Write the event functions at places from `start` to `end` of a step to its table; returns how many."""
    ne, t1 = loop.sizes[at.NE], scan.t0 + scan.h
    n_points = scan_points(start, end, loop, scan.thetas)
    n = n_points - 1 if end == 1.0 else n_points
    for k in range(n):
        event_values(scan.thetas[k], False, loop, scan, scan.table[k * ne : (k + 1) * ne])
    if end == 1.0:  # the end is the state that the run goes on from, not its interpolant
        call_kernel(loop.addresses[at.EVENTS], t1, y1, loop.p, scan.table[n * ne : n_points * ne])
    return n_points


@jitted
def look_again(n_points, loop, scan):
    """Look at one more place, another in every step: count where a function has crossed zero between two samples."""
    ne = loop.sizes[at.NE]
    theta = (GOLDEN * (loop.counters[at.STEPS] + 1.0)) % 1.0
    if theta < scan.thetas[0] or theta > scan.thetas[n_points - 1]:
        return
    k = 1
    while scan.thetas[k] < theta:
        k += 1
    event_values(theta, False, loop, scan, scan.g)
    for e in range(ne):
        before, after = scan.table[(k - 1) * ne + e], scan.table[k * ne + e]
        if scan.g[e] * before < 0.0 and scan.g[e] * after < 0.0:
            band = loop.control[at.N_CONTROL + at.BAND * ne + e]
            if min(abs(scan.g[e]), abs(before), abs(after)) > band:
                loop.control[at.N_CONTROL + at.PASSED * ne + e] += 1.0
                loop.control[at.N_CONTROL + at.T_PASSED * ne + e] = scan.t0 + theta * scan.h


@jitted
def note_lowest(n_points, loop, scan):
    """Take note of the event functions at the end of a step."""
    ne = loop.sizes[at.NE]
    for e in range(ne):
        lowest = at.N_CONTROL + at.LOWEST * ne + e
        loop.control[lowest] = min(loop.control[lowest], scan.table[(n_points - 1) * ne + e])


@jitted
def scan_points(start, end, loop, thetas):
    """Write the places at which a step is looked at from `start` to `end`; returns how many."""
    early = False
    for e in range(loop.sizes[at.NE]):
        early = early or abs(loop.control[at.N_CONTROL + at.SIDE * loop.sizes[at.NE] + e]) < 1.0
    thetas[0] = start
    n = 1
    if early and start == 0.0:
        for k in range(N_EARLY):
            thetas[n] = end * 2.0 ** (-5.0 - 2.0 * (N_EARLY - 1 - k))
            n += 1
    for k in range(1, N_UNIFORM + 1):
        theta = start + (end - start) * CHEBYSHEV[k]
        if theta > thetas[n - 1]:
            thetas[n] = theta
            n += 1
    thetas[n - 1] = end
    return n


@jitted
def first_root(e, n_points, loop, scan):
    """Return the place just past the first crossing of event `e` in its direction, 2 if there is none."""
    ne = loop.sizes[at.NE]
    side = loop.control[at.N_CONTROL + at.SIDE * ne + e]
    band = loop.control[at.N_CONTROL + at.BAND * ne + e]
    if abs(side) == 1.0:
        root = first_dip(e, side, n_points, loop, scan)
        if root <= 1.0:
            return root
    for k in range(1, n_points):
        here = scan.table[k * ne + e]
        if abs(side) == 1.0:
            if side * here <= 0.0 and wanted(loop.sizes, e, side):
                root = locate(e, side, 0.0, scan.thetas[k - 1], scan.thetas[k], loop, scan)
                if root <= 1.0 or side * scan.table[(n_points - 1) * ne + e] <= 0.0:
                    return min(root, scan.thetas[n_points - 1])
                return 2.0  # states on the constraints stay on its side up to the end
            if side * here > 0.0 and k + 1 < n_points:
                root = dip_at(e, k, side, loop, scan)
                if root <= 1.0:
                    return root
        elif abs(here) > band and side * here < 0.0 and wanted(loop.sizes, e, side):
            was = math.copysign(1.0, side)
            # At zero it may come and go within round-off: what counts is where it leaves that for good.
            level = 0.0 if was * scan.table[(k - 1) * ne + e] > 0.0 else -band
            root = locate(e, was, level, scan.thetas[k - 1], scan.thetas[k], loop, scan)
            if root <= 1.0 or was * scan.table[(n_points - 1) * ne + e] <= band:
                return min(root, scan.thetas[n_points - 1])
            return 2.0
        side = follow(side, here, band)
    if abs(side) == 1.0:
        return last_dip(e, side, n_points, loop, scan)
    return 2.0


@jitted
def follow(side, here, band):
    """Return the side of a function that is at `here` now and was on `side` before, if it was not an event."""
    if abs(side) == 1.0:
        return -side if side * here < 0.0 else side
    return math.copysign(1.0, here) if abs(here) > band else side


@jitted
def dip_at(e, k, side, loop, scan):
    """Return the place just past a crossing that is hidden by a minimum of |g| near sample `k`, 2 if there is none."""
    ne = loop.sizes[at.NE]
    here = scan.table[k * ne + e]
    if not dips(side, scan.table[(k - 1) * ne + e], here, scan.table[(k + 1) * ne + e]):
        return 2.0
    left, middle, right = scan.thetas[k - 1], scan.thetas[k], scan.thetas[k + 1]
    low = dip(e, side, left, middle, right, side * here, loop, scan)
    return dip_root(e, side, left, low, right, loop, scan)


@jitted
def first_dip(e, side, n_points, loop, scan):
    """Return the same for a minimum between the start of a step and its first sample."""
    here, after = side * scan.table[e], side * scan.table[loop.sizes[at.NE] + e]
    if not (0.0 < here <= after and here <= 0.5 * max(after, side * scan.table[2 * loop.sizes[at.NE] + e])):
        return 2.0
    start = scan.thetas[0]
    theta = start + INWARDS * (scan.thetas[1] - start)
    return dip_inwards(e, side, start, theta, scan.thetas[1], here, loop, scan)


@jitted
def last_dip(e, side, n_points, loop, scan):
    """Return the same for a minimum between the last sample of a step and its end."""
    ne = loop.sizes[at.NE]
    before, here = side * scan.table[(n_points - 2) * ne + e], side * scan.table[(n_points - 1) * ne + e]
    if not (0.0 < here <= before and here <= 0.5 * max(before, side * scan.table[(n_points - 3) * ne + e])):
        return 2.0
    left, end = scan.thetas[n_points - 2], scan.thetas[n_points - 1]
    theta = end - INWARDS * (end - left)
    return dip_inwards(e, side, left, theta, end, here, loop, scan)


@jitted
def dip_inwards(e, side, left, middle, right, end, loop, scan):
    """Return the same between `left` and `right`, if |g| at `middle` is below its value at the `end` nearby."""
    event_values(middle, False, loop, scan, scan.g)
    lowest = side * scan.g[e]
    if not lowest < end:
        return 2.0
    low = middle if lowest < 0.0 else dip(e, side, left, middle, right, lowest, loop, scan)
    return dip_root(e, side, left, low, right, loop, scan)


@jitted
def dip_root(e, side, left, low, right, loop, scan):
    """Return the place just past the crossing that event `e` waits for, next to a place `low` beyond zero; 2: none."""
    if low < 0.0:
        return 2.0
    if wanted(loop.sizes, e, side):
        return locate(e, side, 0.0, left, low, loop, scan)
    if wanted(loop.sizes, e, -side):
        return locate(e, -side, 0.0, low, right, loop, scan)
    return 2.0


@jitted
def wanted(sizes, e, side):
    """Whether leaving `side` of zero is the crossing that event `e` waits for."""
    direction = sizes[at.N_SIZES + e]
    return direction == 0 or (abs(direction) == 1 and direction * side < 0.0)


@jitted
def dips(side, before, here, after):
    """Whether |g| has a minimum at the middle one of three points, near enough to zero to hide two crossings."""
    a, m, b = side * before, side * here, side * after
    return m <= a and m <= b and m <= 0.5 * max(a, b)


@jitted
def dip(e, side, left, middle, right, lowest, loop, scan):
    """Search the minimum of side * g by golden sections; returns a place beyond zero, -1 if there is none."""
    for _ in range(REFINEMENTS):
        in_right = right - middle > middle - left
        theta = middle + GOLDEN * (right - middle) if in_right else middle - GOLDEN * (middle - left)
        event_values(theta, False, loop, scan, scan.g)
        value = side * scan.g[e]
        if value < 0.0:
            return theta
        if value < lowest:
            lowest = value
            if in_right:
                left = middle
            else:
                right = middle
            middle = theta
        elif in_right:
            right = theta
        else:
            left = theta
    return -1.0


@jitted
def locate(e, side, level, before, past, loop, scan):
    """Bisect where side * g of event `e` falls to `level`; returns the place just past it, 2 if there is none.

    The state is left on the constraints.
    """
    t0, h = scan.t0, scan.h
    # States on the constraints may cross a little sooner or later than their interpolant.
    event_values(past, True, loop, scan, scan.g)
    while side * scan.g[e] > level:
        if past >= 1.0:
            return 2.0
        before, past = past, min(1.0, past + 1e-3)
        event_values(past, True, loop, scan, scan.g)
    while True:
        middle = 0.5 * (before + past)
        if t0 + middle * h in (t0 + before * h, t0 + past * h) or middle in (before, past):
            return behind_zero(e, side, past, loop, scan) if level == 0.0 else past
        event_values(middle, True, loop, scan, scan.g)
        if side * scan.g[e] > level:
            before = middle
        else:
            past = middle


@jitted
def behind_zero(e, side, past, loop, scan):
    """Return the place of a crossing, digits of time behind where a function is at zero and jumps on, as `sign(x)`.

    At zero, what is as good as zero would be as large as the jump, and the function never clear of it again.
    """
    event_values(past, True, loop, scan, scan.g)
    digit, behind = EPS * max(abs(scan.t0 + scan.h) / scan.h, 1.0), past
    for _ in range(DOUBLINGS):  # a state that turns back stays at its place for many of them
        if scan.g[e] != 0.0:
            break
        behind, digit = behind + digit, 2.0 * digit
        if behind > 1.0:
            return past
        event_values(behind, True, loop, scan, scan.g)
    size = max(abs(scan.table[e]), abs(scan.table[loop.sizes[at.NE] + e]))
    return behind if -side * scan.g[e] > OF_JUMP * size else past


@jitted
def gather(first, roots, n_points, loop, scan):
    """Mark all events of the instant `first`; leave the state just past them in `y`, and return their place."""
    ne = loop.sizes[at.NE]
    t0, h = scan.t0, scan.h
    same = 8.0 * EPS * max(abs(t0 + h), h)
    last = first
    leader = 0
    while roots[leader] != first:
        leader += 1
    for e in range(ne):
        fired = roots[e] <= 1.0 and (roots[e] - first) * h <= same
        if roots[e] <= 1.0 and not fired:
            # Its function may only be rounded differently: then it is at zero all the way to its own root.
            event_values(0.5 * (first + roots[e]), True, loop, scan, scan.g)
            fired = abs(scan.g[e]) <= loop.control[at.N_CONTROL + at.FLOOR * ne + e]
            if fired:
                # So is what is held at zero, as the choice by a rate that sticks: the first one is at zero there, too.
                event_values(roots[e], True, loop, scan, scan.g)
                floor = loop.control[at.N_CONTROL + at.FLOOR * ne + leader]
                fired = abs(scan.g[leader]) <= WITHIN * floor
        loop.control[at.N_CONTROL + at.FIRED * ne + e] = 1.0 if fired else 0.0
        if fired:
            last = max(last, roots[e])
    follow_sides(n_points, loop, scan, last)
    event_values(last, True, loop, scan, scan.g)
    for e in range(ne - 1, -1, -1):
        side = at.N_CONTROL + at.SIDE * ne + e
        if loop.control[at.N_CONTROL + at.FIRED * ne + e] == 1.0:
            loop.counters[at.EVENT_INDEX] = e
            loop.control[side] = 0.0
        elif roots[e] > 1.0:  # else it is on the side that it is about to leave
            loop.control[side] = follow(
                loop.control[side], scan.g[e], loop.control[at.N_CONTROL + at.BAND * ne + e]
            )
    return last


@jitted
def follow_sides(n_points, loop, scan, end):
    """Take the sides of all event functions along, over the samples before place `end`; branches without one get it."""
    ne = loop.sizes[at.NE]
    for e in range(ne):
        side, band = (
            loop.control[at.N_CONTROL + at.SIDE * ne + e],
            loop.control[at.N_CONTROL + at.BAND * ne + e],
        )
        for k in range(1, n_points):
            if scan.thetas[k] < end:
                side = follow(side, scan.table[k * ne + e], band)
        loop.control[at.N_CONTROL + at.SIDE * ne + e] = side
        branch = int(loop.control[at.N_CONTROL + at.BRANCH * ne + e])
        if branch > 0 and loop.p[branch] == 0.0 and abs(side) == 1.0:
            loop.p[branch] = side


@jitted
def finish_scratch_size(sizes):
    """Length of the scratch array that `finish_step` needs."""
    return projection_size(sizes) + sizes[at.NY] + event_scratch_size(sizes)


@jitted
def needs_dense(loop, t1):
    """Whether `finish_step` for a step that ends at `t1` will read the dense output."""
    if loop.sizes[at.NE] > 0:
        return True
    return (
        loop.counters[at.NEXT_FRAME] < loop.frame_times.shape[0]
        and loop.frame_times[loop.counters[at.NEXT_FRAME]] < t1
    )


@jitted
def finish_step(loop, t0, t1, dense, n_terms, scratch):
    """Record an accepted step from `t0` to `t1`; stop it short at the first event in it.

    `loop.y` is the state at `t1`, already on the constraints. At an event it becomes the state just past it, and
    `control[T]` its time.

    Parameters
    ----------
    t0, t1 : float [s]
    dense : ndarray, shape (8, NY)
        Dense output of the step, `n_terms` rows of it; read only if `needs_dense`.
    scratch : ndarray, shape (finish_scratch_size(sizes),)

    Returns
    -------
    int
        RUNNING, REACHED_STOP or EVENT. After EVENT the derivative row is no longer valid.
    """
    h = t1 - t0
    buffer = scratch[: projection_size(loop.sizes)]
    status = at.RUNNING
    end = t1
    if loop.sizes[at.NE] > 0 and loop.control[at.ASIDE] == 0.0:
        rest = scratch[projection_size(loop.sizes) :]
        theta = find_event(loop, t0, h, dense, n_terms, loop.y, buffer, rest)
        if theta >= 0.0:
            status = at.EVENT
            end = t1 if theta == 1.0 else t0 + theta * h
            copy(rest[: loop.sizes[at.NY]], loop.y)
            since = end - max(loop.control[at.T_EVENT], loop.control[at.T_START])
            loop.control[at.EVENTLESS] = since if since > 0.0 else end - t0
            loop.control[at.T_EVENT] = end
            loop.counters[at.F_VALID] = 0
        else:
            loop.control[at.EVENTLESS] = max(loop.control[at.EVENTLESS], h)
    if frame_is_due(loop, end):
        write_frames(loop, t0, h, end, loop.y, dense, n_terms, buffer)
    loop.counters[at.STEPS] += 1
    row = loop.counters[at.N_LOGGED_STEPS]
    loop.step_log[row, 0] = end
    loop.step_log[row, 1] = end - t0
    loop.counters[at.N_LOGGED_STEPS] = row + 1
    loop.control[at.T] = end
    loop.control[at.H_LAST] = end - t0
    if status == at.RUNNING and end >= loop.control[at.T_STOP]:
        status = at.REACHED_STOP
    return status
