"""The error of a step of radau5: tolerances, the embedded estimate, its filter."""

import math

from runtime.code.jitted import jitted
from runtime.integrate.evaluation import evaluate
from runtime.integrate.layout import ATOL, LAST_REJECTED, NEWTON_TOL, NV, RTOL
from runtime.integrate.linear import lu_solve
from runtime.integrate.newton import EPS
from runtime.integrate.radau5_stages import ERROR, F_NEW, HAVE_HISTORY, NEWTON_BOUND, SCALE, Y_STAGE


@jitted
def set_tolerances(sizes, control, y, w):
    """Set the tolerance of every component, and Newton's.

    The error is estimated with order 3 for a method of order 5; radau5.f therefore works with 0.1 rtol^(2/3).
    """
    rtol = 0.1 * control[RTOL] ** (2.0 / 3.0) if control[RTOL] > 0.0 else 0.0
    atol = control[ATOL] * (rtol / control[RTOL]) if rtol > 0.0 else 0.1 * control[ATOL] ** (2.0 / 3.0)
    for i in range(2 * sizes[NV]):
        w.pairs[SCALE, i] = max(atol + rtol * abs(y[i]), 4.0 * EPS * abs(y[i]) + 1e-300)
    w.numbers[NEWTON_BOUND] = control[NEWTON_TOL]
    if control[NEWTON_TOL] <= 0.0:
        w.numbers[NEWTON_BOUND] = max(10.0 * EPS / max(rtol, EPS), min(0.03, math.sqrt(rtol)))


@jitted
def estimate_error(method, h, addresses, sizes, p, counters, t, y, f, w):
    """Return the estimated error of the step in units of the tolerance; work has no part in it.

    The estimate of the embedded method is filtered by (1 - h J / μ)⁻¹; in the first step, and after a
    rejected one, a large estimate is filtered once more (Hairer, Wanner 1996, IV.8, (8.19) and (8.20)).
    """
    error = filter_error(method, h, sizes[NV], f, False, w)
    if error >= 1.0 and (counters[LAST_REJECTED] or not counters[HAVE_HISTORY]):
        for i in range(2 * sizes[NV]):
            w.states[Y_STAGE, i] = y[i] + w.pairs[ERROR, i]
        if not evaluate(addresses, sizes, p, counters, t, w.states[Y_STAGE], w.rows[F_NEW]):
            return math.inf
        error = filter_error(method, h, sizes[NV], w.rows[F_NEW], True, w)
    return max(error, 1e-10) if math.isfinite(error) else error


@jitted
def filter_error(method, h, nv, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]`; `again`: it is there already, and `row` belongs to y + error."""
    e, ea = method.error, method.error_a
    shift = h / method.mu
    for i in range(nv):
        j = nv + i
        # v0 + eᵀZ_q / h, in which v0 cancels.
        by_q = ea[0] * w.states[0, j] + ea[1] * w.states[1, j] + ea[2] * w.states[2, j]
        w.pairs[ERROR, i] = by_q + w.pairs[ERROR, j] if again else by_q
    for i in range(nv):
        j = nv + i
        by_v = row[j] + (e[0] * w.states[0, j] + e[1] * w.states[1, j] + e[2] * w.states[2, j]) / h
        for k in range(nv):
            by_v += shift * w.jacobian[i, k] * w.pairs[ERROR, k]
        w.pairs[ERROR, j] = by_v
    lu_solve(w.real, w.pivots[0], w.pairs[ERROR, nv:])
    total = 0.0
    for i in range(nv):
        w.pairs[ERROR, i] = shift * (w.pairs[ERROR, nv + i] + w.pairs[ERROR, i])
    for i in range(2 * nv):
        total += (w.pairs[ERROR, i] / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / (2 * nv))
