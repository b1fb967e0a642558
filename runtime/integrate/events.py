"""Find the first event in an accepted step and locate it to the last bit."""

import math

import numpy as np

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.integrate.dense import evaluate_dense
from runtime.integrate.layout import EVENT_INDEX, EVENTS, FIRED, FLOOR, N_CONTROL, N_SIZES, NE, NY, SIDE
from runtime.integrate.projection import project_state

# A step is looked at in Chebyshev points, dense at its ends, where a dip is not flanked by other points.
N_UNIFORM = 12
# While an event function has not left zero yet, also at 2^-5, 2^-7, ... of the step: what leaves zero and
# returns within one step would pass unseen.
N_EARLY = 12
N_POINTS = N_EARLY + N_UNIFORM + 1
REFINEMENTS = 24
CHEBYSHEV = tuple(0.5 * (1.0 - math.cos(math.pi * k / N_UNIFORM)) for k in range(N_UNIFORM + 1))
GOLDEN = (3.0 - math.sqrt(5.0)) / 2.0
EPS = float(np.finfo(float).eps)


@jitted
def event_scratch_size(sizes):
    """Length of the scratch array that `find_event` needs, beyond one state."""
    return (N_POINTS + 1) * sizes[NE] + N_POINTS + 2 * sizes[NE]


@jitted
def event_values(theta, on_constraints, model, step, y, buffer, g):
    """Write the event functions at place `theta` of a step to `g`, and the state there to `y`."""
    addresses, sizes, p, control, counters = model
    t0, h, dense, n_terms = step
    evaluate_dense(theta, dense, n_terms, sizes[NY], y)
    if on_constraints:
        project_state(addresses, sizes, p, t0 + theta * h, y, control, counters, buffer)
    call_kernel(addresses[EVENTS], t0 + theta * h, y, p, g)


@jitted
def find_event(model, step, y1, buffer, scratch):
    """Find the first event of a step; sets SIDE, FIRED and EVENT_INDEX.

    Parameters
    ----------
    model : tuple
        (addresses, sizes, p, control, counters), see `layout.py`.
    step : tuple
        (t0, h, dense, n_terms).
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
    addresses, sizes, p, _, _ = model
    ne = sizes[NE]
    y, rest = scratch[: sizes[NY]], scratch[sizes[NY] :]
    thetas = rest[:N_POINTS]
    g = rest[N_POINTS : N_POINTS + ne]
    roots = rest[N_POINTS + ne : N_POINTS + 2 * ne]
    table = rest[N_POINTS + 3 * ne : N_POINTS + 3 * ne + N_POINTS * ne]
    n_points = scan_points(model, thetas)
    for k in range(n_points):
        event_values(thetas[k], False, model, step, y, buffer, table[k * ne : (k + 1) * ne])
    # The end is the state that the run goes on from, not its interpolant.
    call_kernel(addresses[EVENTS], step[0] + step[1], y1, p, table[(n_points - 1) * ne : n_points * ne])
    first = 2.0
    for e in range(ne):
        roots[e] = first_root(e, n_points, thetas, table, model, step, y, buffer, g)
        first = min(first, roots[e])
    if first > 1.0:
        last = table[(n_points - 1) * ne : n_points * ne]
        update_sides(model, last)
        return -1.0
    return gather(first, roots, model, step, y, buffer, g)


@jitted
def scan_points(model, thetas):
    """Write the places at which a step is looked at; returns how many."""
    _, sizes, _, control, _ = model
    early = False
    for e in range(sizes[NE]):
        early = early or control[N_CONTROL + SIDE * sizes[NE] + e] == 0.0
    thetas[0] = 0.0
    n = 1
    if early:
        for k in range(N_EARLY):
            thetas[n] = 2.0 ** (-5.0 - 2.0 * (N_EARLY - 1 - k))
            n += 1
    for k in range(1, N_UNIFORM + 1):
        if CHEBYSHEV[k] > thetas[n - 1]:
            thetas[n] = CHEBYSHEV[k]
            n += 1
    thetas[n - 1] = 1.0
    return n


@jitted
def first_root(e, n_points, thetas, table, model, step, y, buffer, g):
    """Return the place just past the first crossing of event `e` in its direction, 2 if there is none."""
    _, sizes, _, control, _ = model
    ne = sizes[NE]
    side = control[N_CONTROL + SIDE * ne + e]
    floor = control[N_CONTROL + FLOOR * ne + e]
    for k in range(1, n_points):
        here = table[k * ne + e]
        if side == 0.0:
            if abs(here) > floor:
                side = math.copysign(1.0, here)
            continue
        if side * here <= 0.0:
            if wanted(sizes, e, side):
                return locate(e, side, thetas[k - 1], thetas[k], model, step, y, buffer, g)
            if here != 0.0:
                side = -side
        elif k + 1 < n_points and dips(side, table[(k - 1) * ne + e], here, table[(k + 1) * ne + e]):
            low = dip(
                e, side, thetas[k - 1], thetas[k], thetas[k + 1], side * here, model, step, y, buffer, g
            )
            if low >= 0.0 and wanted(sizes, e, side):
                return locate(e, side, thetas[k - 1], low, model, step, y, buffer, g)
            if low >= 0.0 and wanted(sizes, e, -side):
                return locate(e, -side, low, thetas[k + 1], model, step, y, buffer, g)
    return 2.0


@jitted
def wanted(sizes, e, side):
    """Whether leaving `side` of zero is the crossing that event `e` waits for."""
    direction = sizes[N_SIZES + e]
    return direction == 0 or direction * side < 0.0


@jitted
def dips(side, before, here, after):
    """Whether |g| has a minimum at the middle one of three points, near enough to zero to hide two crossings."""
    a, m, b = side * before, side * here, side * after
    return m <= a and m <= b and m <= 0.5 * max(a, b)


@jitted
def dip(e, side, left, middle, right, lowest, model, step, y, buffer, g):
    """Search the minimum of side * g by golden sections; returns a place beyond zero, -1 if there is none."""
    for _ in range(REFINEMENTS):
        in_right = right - middle > middle - left
        theta = middle + GOLDEN * (right - middle) if in_right else middle - GOLDEN * (middle - left)
        event_values(theta, False, model, step, y, buffer, g)
        value = side * g[e]
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
def locate(e, side, before, past, model, step, y, buffer, g):
    """Bisect a crossing of event `e` until its time has no more digits; returns the place just past it."""
    t0, h = step[0], step[1]
    # States on the constraints may cross a little sooner or later than their interpolant.
    event_values(past, True, model, step, y, buffer, g)
    while side * g[e] > 0.0 and past < 1.0:
        before, past = past, min(1.0, past + 1e-3)
        event_values(past, True, model, step, y, buffer, g)
    while True:
        middle = 0.5 * (before + past)
        if t0 + middle * h in (t0 + before * h, t0 + past * h) or middle in (before, past):
            return past
        event_values(middle, True, model, step, y, buffer, g)
        if side * g[e] > 0.0:
            before = middle
        else:
            past = middle


@jitted
def gather(first, roots, model, step, y, buffer, g):
    """Mark all events of the instant `first`; leave the state just past them in `y`, and return their place."""
    _, sizes, _, control, counters = model
    ne = sizes[NE]
    t0, h = step[0], step[1]
    same = 8.0 * EPS * max(abs(t0 + h), h)
    last = first
    for e in range(ne):
        fired = roots[e] <= 1.0 and (roots[e] - first) * h <= same
        if roots[e] <= 1.0 and not fired:
            # Its function may only be rounded differently: then it is at zero all the way to its own root.
            event_values(0.5 * (first + roots[e]), True, model, step, y, buffer, g)
            fired = abs(g[e]) <= control[N_CONTROL + FLOOR * ne + e]
        control[N_CONTROL + FIRED * ne + e] = 1.0 if fired else 0.0
        if fired:
            last = max(last, roots[e])
    event_values(last, True, model, step, y, buffer, g)
    update_sides(model, g)
    for e in range(ne - 1, -1, -1):
        if control[N_CONTROL + FIRED * ne + e] == 1.0:
            counters[EVENT_INDEX] = e
            control[N_CONTROL + SIDE * ne + e] = 0.0
    return last


@jitted
def update_sides(model, g):
    """Note on which side of zero every event function is; one that has not left zero stays undecided."""
    _, sizes, _, control, _ = model
    ne = sizes[NE]
    for e in range(ne):
        side = N_CONTROL + SIDE * ne + e
        if control[side] != 0.0 and g[e] != 0.0:
            control[side] = math.copysign(1.0, g[e])
        elif abs(g[e]) > control[N_CONTROL + FLOOR * ne + e]:
            control[side] = math.copysign(1.0, g[e])
