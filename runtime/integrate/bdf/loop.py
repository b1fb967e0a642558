"""Numerical differentiation formulas of variable order, 1 to 5, and step, for stiff systems."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.bdf.ggl import bdf_ggl_work, iterate_index2
from symgen.runtime.integrate.bdf.newton import (
    CHANGE,
    FAILURES,
    FAR_STEP,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    ITERATIONS,
    JACOBIAN_IS_FRESH,
    KEPT,
    LEFT_OPEN,
    MAX_ORDER,
    N_EQUAL,
    NEWEST,
    NEWTON_BOUND,
    ORDER,
    PAST,
    PIVOT_RATIO,
    POWER,
    POWER_BEFORE,
    PREDICTED,
    SCALE,
    SPACING,
    Y_NEW,
    bdf_work,
    iterate,
    solve_step,
)
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.newton import MAX_ITERATIONS, RATE
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.step_control import (
    EPS,
    SAFETY,
    error_scale,
    first_step,
    longest_step,
    too_small,
)

SHRINK, GROW = 0.2, 10.0
# A step that would grow by less than this is kept, and with it the factors.
KEEP_STEP = 1.2
KEEP_JACOBIAN_RATE = 0.3


@jitted
def safety(w):
    """Return the factor of safety, which is shy of steps that took many iterations."""
    return SAFETY * (2.0 * MAX_ITERATIONS + 1.0) / (2.0 * MAX_ITERATIONS + w.numbers[ITERATIONS])


@jitted
def growth(method, order, sizes, w):
    """Return by how much the step of formula `order` could grow, by the last difference of the history."""
    n = sizes[at.NQ] + sizes[at.NV]
    total = 0.0
    for i in range(n):
        total += (w.differences[order + 1, i] / w.states[SCALE, i]) ** 2
    error = method.error[order] * math.sqrt(total / n)
    return max(error, 1e-10) ** (-1.0 / (order + 1.0))


@jitted
def choose_step_and_order(method, error, loop, w):
    """Choose them after an accepted step, from order + 1 equal steps on (Shampine, Reichelt 1997, section 2.3)."""
    order, h = loop.counters[ORDER], w.numbers[SPACING]
    if w.numbers[RATE] > KEEP_JACOBIAN_RATE:
        loop.counters[HAVE_JACOBIAN] = 0
    loop.counters[N_EQUAL] += 1
    loop.control[at.H] = h
    if loop.counters[N_EQUAL] <= order:
        return
    best, factor = order, max(error, 1e-10) ** (-1.0 / (order + 1.0))
    if order > 1:
        lower = growth(method, order - 1, loop.sizes, w)
        if lower > factor:
            best, factor = order - 1, lower
    if order < MAX_ORDER:
        higher = growth(method, order + 1, loop.sizes, w)
        if higher > factor:
            best, factor = order + 1, higher
    factor = min(GROW, safety(w) * factor, longest_step(loop.control) / h)
    if factor < KEEP_STEP and best >= order:
        return
    loop.counters[ORDER], loop.counters[N_EQUAL] = best, 0
    loop.control[at.H] = h * factor


@jitted
def shorten_step(solved, error, h, loop, w):
    """Shorten the step after its error was too large or, to half, when Newton failed."""
    factor = 0.5
    if solved:
        factor = SHRINK
        if math.isfinite(error):
            factor = max(SHRINK, safety(w) * error ** (-1.0 / (loop.counters[ORDER] + 1.0)))
    else:
        loop.counters[HAVE_JACOBIAN] = 0
    loop.control[at.H] = h * factor
    loop.counters[at.LAST_REJECTED] = 1
    loop.counters[FAILURES] += 1
    loop.counters[at.REJECTED] += 1


COEFFICIENTS, SAMPLES = range(2)
# Up to this order work follows from the power along the step. What moves evenly, as bodies that stick to a belt do, has
# no error that would shorten a step or raise the order, while springs on it change its power all the same.
WORK_BY_POWER = 2


@jitted
def predict(method, sizes, order, w):
    """Write Σ ∇ⁱ y, i = 0..order, and Σ γ_i ∇ⁱ y / α, i = 1..order."""
    for i in range(sizes[at.NY]):
        predicted, past = w.differences[0, i], 0.0
        for j in range(1, order + 1):
            predicted += w.differences[j, i]
            past += method.gamma[j] * w.differences[j, i]
        w.states[PREDICTED, i] = predicted
        w.states[PAST, i] = past / method.alpha[order]


@jitted
def add_point(sizes, order, w):
    """Make the new state, `w.states[CHANGE]` beyond the predicted one, the newest point of the history."""
    for i in range(sizes[at.NY]):
        change = w.states[CHANGE, i]
        w.differences[order + 2, i] = change - w.differences[order + 1, i]
        w.differences[order + 1, i] = change
        for j in range(order, 0, -1):
            w.differences[j, i] += w.differences[j + 1, i]
        w.differences[0, i] = w.states[Y_NEW, i]


@jitted
def resample(loop, shift, factor, w):
    """Replace the points of the history by others on its polynomial.

    Parameters
    ----------
    shift : float
        Where the newest point will be, counted from the one there is in distances of points; it may be negative.
    factor : float
        New distance of points over the old one.
    """
    n = loop.counters[ORDER] + 1
    weights, samples = w.weights[COEFFICIENTS], w.weights[SAMPLES]
    for i in range(n):
        # s (s+1) … (s+j-1) / j! at the new points.
        place, value = shift - factor * i, 1.0
        for j in range(n):
            samples[j, i] = value
            value *= (place + j) / (j + 1.0)
    for j in range(n):
        for k in range(j + 1):
            # The k-th backward difference of polynomial j at the newest point; those beyond its degree are 0.
            weights[k, j] = samples[j, 0]
            for i in range(n - 1 - k):
                samples[j, i] -= samples[j, i + 1]
    for i in range(loop.sizes[at.NY]):
        # Row k needs old rows from k on only.
        for k in range(n):
            total = 0.0
            for j in range(k, n):
                total += weights[k, j] * w.differences[j, i]
            w.differences[k, i] = total
    w.numbers[SPACING] *= factor
    loop.counters[N_EQUAL] = 0


@jitted
def history_dense(method, sizes, order, y, w, dense):
    """Fill the rows of `dense` with the polynomial through the points of the history, for the step from `y`."""
    for i in range(sizes[at.NY]):
        for r in range(2, order + 1):
            total = 0.0
            for j in range(r, order + 1):
                total += method.rows[r, j] * w.differences[j, i]
            dense[r, i] = total
        for r in range(order + 1, method.rows.shape[0]):
            dense[r, i] = 0.0
        dense[1, i] = w.states[Y_NEW, i] - y[i]
    copy(y, dense[0])
    if sizes[at.NW] > 0 and order <= WORK_BY_POWER:
        # The cubic through work and power at both ends.
        n, h = sizes[at.NQ] + sizes[at.NV], w.numbers[SPACING]
        dense[2, n] = h * w.numbers[POWER_BEFORE] - dense[1, n]
        dense[3, n] = dense[1, n] - h * w.numbers[POWER] - dense[2, n]


# Pivot ratios, which are d² at the distance d from there. Nearer than the smaller one, accelerations are taken without
# the constraint.
NEAR_SINGULAR, ON_SINGULAR = 1e-4, 1e-8
# How fast it is forgotten from step to step, as are the points of the history, and what is nothing.
FADING, NOTHING = 0.5, 10.0
MET_TO = 1e-12  # of their sizes: what projections leave of constraints


@jitted
def allow_for_singularity(sizes, w):
    """Raise the tolerances of rates to what the projection leaves open of them.

    At the distance d, positions that meet the constraints to ε let rates across their branch vary by ε/d. No step,
    however short, has smaller errors, and shorter ones do not lead away from there. Where the pivot ratio is zero all
    the time, constraints are redundant, and nothing is near.
    """
    if sizes[at.NM] == 0:
        return
    ratio, nq = w.row[sizes[at.N_ROW] - 1], sizes[at.NQ]
    if ratio > 0.0:
        w.numbers[PIVOT_RATIO] = ratio
    if is_near_singular(sizes, w):
        own = MET_TO / math.sqrt(max(ratio, ON_SINGULAR))
        w.numbers[LEFT_OPEN] = max(w.numbers[LEFT_OPEN], own)
    if w.numbers[LEFT_OPEN] == 0.0:
        return
    largest = 0.0
    for i in range(nq, nq + sizes[at.NV]):
        largest = max(largest, abs(w.states[PREDICTED, i]))
    for i in range(nq, nq + sizes[at.NV]):
        w.states[SCALE, i] = max(w.states[SCALE, i], w.numbers[LEFT_OPEN] * largest)


@jitted
def is_near_singular(sizes, w):
    """Whether constraints lose rank near the last state: what the projection does to its rates is noise."""
    ratio = w.row[sizes[at.N_ROW] - 1]
    return sizes[at.NM] > 0 and ratio < NEAR_SINGULAR and w.numbers[PIVOT_RATIO] >= ON_SINGULAR


@jitted
def leave_singularity(control, w):
    """After a step: forget, and keep steps as short as they are elsewhere, as errors along the branch are not seen."""
    if w.numbers[LEFT_OPEN] == 0.0:
        w.numbers[FAR_STEP] = w.numbers[SPACING]
        return
    w.numbers[LEFT_OPEN] *= FADING
    if w.numbers[LEFT_OPEN] < NOTHING * MET_TO:
        w.numbers[LEFT_OPEN] = 0.0
    if w.numbers[FAR_STEP] > 0.0:
        control[at.H] = min(control[at.H], w.numbers[FAR_STEP])


N_DENSE = 6
# So many failures in a row say that the past is no guide to the future.
FAILURES_TO_RESTART = 4
ROUND_OFF = 16.0 * EPS


@jitted
def advance_bdf(method, loop):
    """Advance with `Formulas` of variable order until something is for Python to do.

    Shampine, Reichelt, SIAM J. Sci. Comput. 18 (1997) 1: backward differences over points of equal distance, which
    are interpolated to new distances when the step changes. q is eliminated from the Newton systems, which have the
    size of v. Only the newest point is projected onto the constraints, and so are all those behind it: Eich, SIAM J.
    Numer. Anal. 30 (1993) 1467, proves that this keeps the order. Where an event stops a step and nothing changes the
    state, the history is moved there. Work is a component like others, but has no part in any norm. The row `f` serves
    as scratch; F_VALID says that nobody has changed the state. Arguments and result are those of all step loops, see
    docs/step-loops.md.
    """
    w = bdf_work(loop.sizes, loop.work)
    if not begin_bdf(loop, w):
        return at.NOT_FINITE
    return take_steps(index1_step, method, loop, w)


@jitted
def index1_step(method, loop, w):
    """Take an accepted step and record it; returns a status."""
    return bdf_step(solve_index1, method, loop, w)


@jitted
def solve_index1(g, loop, t1, w):
    """Solve the equations of a step as `solve_step` does, to tolerances that configurations of lower rank allow."""
    allow_for_singularity(loop.sizes, w)
    status = solve_step(iterate, g, loop, t1, w)
    if status == at.RUNNING:
        allow_for_singularity(loop.sizes, w)
    return status


@jitted
def advance_bdf_ggl(method, loop):
    """Advance as `advance_bdf` does, on the stabilised index-2 equations of Gear, Gupta and Leimkuhler.

    Lötstedt, Petzold, Math. Comp. 46 (1986) 491, prove the order for these equations. Multipliers have no part in the
    error; what Newton leaves of the constraints is projected away.
    """
    w = bdf_ggl_work(loop.sizes, loop.work)
    if not begin_bdf(loop, w):
        return at.NOT_FINITE
    return take_steps(index2_step, method, loop, w)


@jitted
def index2_step(method, loop, w):
    """Take an accepted step and record it; returns a status."""
    return bdf_step(solve_index2, method, loop, w)


@jitted
def solve_index2(g, loop, t1, w):
    """Solve the equations of a step; returns a status."""
    return solve_step(iterate_index2, g, loop, t1, w)


@jitted
def begin_bdf(loop, w):
    """Make a history where there is none for the state; returns whether derivatives are finite."""
    if not loop.counters[at.F_VALID]:
        if not continue_from_event(loop, w):
            loop.counters[HAVE_JACOBIAN] = 0
            if not restart(loop, w):
                return False
        loop.counters[at.F_VALID] = 1
    return True


@jitted
def bdf_step(solve, method, loop, w):
    """Take an accepted step, record it and choose the next one; returns a status.

    `solve` (g, loop, t1, w) solves the equations of a step for `w.states[Y_NEW]` and `w.states[CHANGE]`, g = α/h.
    """
    t0 = loop.control[at.T]
    status, t1, error = accepted_step(solve, method, loop, w)
    if status != at.RUNNING:
        return status
    add_point(loop.sizes, loop.counters[ORDER], w)
    w.numbers[NEWEST] = t1
    if needs_dense(loop, t1):
        history_dense(method, loop.sizes, loop.counters[ORDER], loop.y, w, loop.dense)
    copy(w.states[Y_NEW], loop.y)
    choose_step_and_order(method, error, loop, w)
    leave_singularity(loop.control, w)
    status = finish_step(loop, t0, t1, loop.dense, N_DENSE, w.scratch)
    if status == at.EVENT:
        copy(loop.y, w.states[KEPT])
    return status


@jitted
def continue_from_event(loop, w):
    """Move the history to the event that stopped the last call; False where there is none for the state `y`."""
    if not loop.counters[HAVE_HISTORY] or loop.control[at.H] <= 0.0:
        return False
    for i in range(loop.sizes[at.NY]):
        if loop.y[i] != w.states[KEPT, i]:
            return False
    resample(loop, (loop.control[at.T] - w.numbers[NEWEST]) / w.numbers[SPACING], 1.0, w)
    copy(loop.y, w.differences[0])
    w.numbers[NEWEST] = loop.control[at.T]
    if loop.sizes[at.NW] > 0:
        if not evaluate(loop, loop.control[at.T], loop.y, w.row):
            return False
        w.numbers[POWER] = w.row[loop.sizes[at.NQ] + loop.sizes[at.NV]]
    return True


@jitted
def restart(loop, w):
    """Begin with order 1 and a step that suits it; returns whether derivatives are finite."""
    if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
        return False
    h = first_step(2, loop, w.row, w.states[Y_NEW])
    loop.control[at.H] = min(h, loop.control[at.H]) if loop.control[at.H] > 0.0 else h
    h = min(loop.control[at.H], longest_step(loop.control))
    for i in range(loop.sizes[at.NY]):
        for j in range(2, w.differences.shape[0]):
            w.differences[j, i] = 0.0
        w.differences[0, i], w.differences[1, i] = loop.y[i], h * loop.f[i]
    w.numbers[SPACING], w.numbers[NEWEST] = h, loop.control[at.T]
    if loop.sizes[at.NW] > 0:
        w.numbers[POWER] = loop.f[loop.sizes[at.NQ] + loop.sizes[at.NV]]
    loop.counters[ORDER], loop.counters[N_EQUAL], loop.counters[FAILURES], loop.counters[HAVE_HISTORY] = (
        1,
        0,
        0,
        1,
    )
    return True


@jitted
def step_end(control):
    """Return where the next step ends: after `control[H]`, at the stop time, or halfway to it."""
    t, stop = control[at.T], control[at.T_STOP]
    h = min(control[at.H], longest_step(control))
    if t + 1.01 * h >= stop:
        return stop
    # Of two steps up to the stop time none may be tiny: the next ones could grow from there only slowly.
    return t + 0.5 * (stop - t) if t + 2.0 * h > stop else t + h


@jitted
def accepted_step(solve, method, loop, w):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.states[CHANGE]` what predicts not.

    Returns
    -------
    tuple
        Status, the time of the new state [s], and the estimated error in units of the tolerance.
    """
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        if too_small(loop.control):
            return cause, t, 0.0
        h = t1 - t
        if abs(h - w.numbers[SPACING]) > 1e-9 * h + 4.0 * EPS * abs(t1):
            resample(loop, 0.0, h / w.numbers[SPACING], w)
        h = w.numbers[SPACING]
        order = loop.counters[ORDER]
        predict(method, loop.sizes, order, w)
        set_tolerances(loop, w)
        error = math.inf
        cause = solve(method.alpha[order] / h, loop, t1, w)
        solved = cause == at.RUNNING
        if solved:
            error = method.error[order] * norm(loop.sizes, w.states[CHANGE], w)
            cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        if error <= 1.0:
            cause = reach_end(method.alpha[order] / h, loop, t1, w)
            if cause == at.RUNNING:
                return at.RUNNING, t1, error
            error = math.inf
        shorten_step(solved, error, h, loop, w)
        if loop.counters[FAILURES] >= FAILURES_TO_RESTART and order > 1:
            if not restart(loop, w):
                return at.NOT_FINITE, t, 0.0


@jitted
def set_tolerances(loop, w):
    """Set the tolerance of every component, and Newton's; a quaternion's size is 1."""
    predicted, scale = w.states[PREDICTED], w.states[SCALE]
    for i in range(loop.sizes[at.NQ] + loop.sizes[at.NV]):
        scale[i] = error_scale(loop.control, predicted[i], predicted[i])
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        for j in range(i, i + 4):
            scale[j] = error_scale(loop.control, 1.0, 1.0)
    if loop.sizes[at.NM] > 0:
        nq = loop.sizes[at.NQ]
        raise_to_round_off(predicted[:nq], scale[:nq])
        raise_to_round_off(predicted[nq : nq + loop.sizes[at.NV]], scale[nq : nq + loop.sizes[at.NV]])
    w.numbers[NEWTON_BOUND] = loop.control[at.NEWTON_TOL]
    if loop.control[at.NEWTON_TOL] <= 0.0:
        w.numbers[NEWTON_BOUND] = max(10.0 * EPS / max(loop.control[at.RTOL], EPS), 0.05)


@jitted
def raise_to_round_off(values, scale):
    """Raise tolerances to the round-off of the largest value: projection spreads that over all."""
    largest = 0.0
    for i in range(values.shape[0]):
        largest = max(largest, abs(values[i]))
    for i in range(values.shape[0]):
        scale[i] = max(scale[i], ROUND_OFF * largest)


@jitted
def norm(sizes, change, w):
    """Return the root mean square of the changes of positions and rates, each in units of its tolerance."""
    n = sizes[at.NQ] + sizes[at.NV]
    total = 0.0
    for i in range(n):
        total += (change[i] / w.states[SCALE, i]) ** 2
    return math.sqrt(total / n)


@jitted
def reach_end(g, loop, t1, w):
    """Bring the new state onto the constraints, and add work; returns why that failed, or RUNNING."""
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    y, change = w.states[Y_NEW], w.states[CHANGE]
    if loop.sizes[at.NM] > 0:
        loop.control[at.MIN_PIVOT_RATIO] = min(
            loop.control[at.MIN_PIVOT_RATIO], w.row[loop.sizes[at.N_ROW] - 1]
        )
    copy(y, w.states[KEPT])
    status = project_state(loop, t1, y, w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    if is_near_singular(loop.sizes, w):
        copy(w.states[KEPT, loop.sizes[at.NQ] : n], y[loop.sizes[at.NQ] : n])
    for i in range(n):
        change[i] += y[i] - w.states[KEPT, i]
    if loop.sizes[at.NW] > 0:
        by_power = loop.counters[ORDER] <= WORK_BY_POWER
        if by_power and not evaluate_middle(loop, t1, w):
            return at.NOT_FINITE
        between = w.row[n]
        # The row is that of the last iterate but one.
        if not evaluate(loop, t1, y, w.row):
            return at.NOT_FINITE
        before, after = w.numbers[POWER], w.row[n]
        change[n] = after / g - w.states[PAST, n]
        if by_power:
            done = w.numbers[SPACING] / 6.0 * (before + 4.0 * between + after)
            change[n] = w.differences[0, n] + done - w.states[PREDICTED, n]
        y[n] = w.states[PREDICTED, n] + change[n]
        w.numbers[POWER_BEFORE], w.numbers[POWER] = before, after
    loop.counters[at.LAST_REJECTED], loop.counters[FAILURES], loop.counters[JACOBIAN_IS_FRESH] = 0, 0, 0
    return at.RUNNING if all_finite(y, loop.sizes[at.NY]) else at.NOT_FINITE


@jitted
def evaluate_middle(loop, t1, w):
    """Evaluate the row in the middle of a step of order 1 or 2, on its polynomial; returns whether it is finite."""
    middle, new = w.scratch[: loop.sizes[at.NY]], w.states[Y_NEW]
    for i in range(loop.sizes[at.NQ] + loop.sizes[at.NV]):
        last = w.differences[0, i]
        middle[i] = 0.5 * (last + new[i])
        if loop.counters[ORDER] == 2:
            # The second difference of the new point and the two before it.
            middle[i] -= 0.125 * (new[i] - last - w.differences[1, i])
    return evaluate(loop, t1 - 0.5 * w.numbers[SPACING], middle, w.row)
