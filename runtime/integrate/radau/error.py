"""The error of a step of a Radau method: tolerances, the embedded estimate, its filter."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import evaluate
from symgen.runtime.integrate.newton import EPS
from symgen.runtime.integrate.quaternions import (
    chart_rate,
    n_quaternions,
    quaternion_at,
    retract,
    solve_rotation,
)
from symgen.runtime.integrate.radau.stages import add_rotation, error_between_places
from symgen.runtime.integrate.radau.work import (
    ERROR,
    F_NEW,
    HAVE_HISTORY,
    NEWTON_BOUND,
    SCALE,
    STAGES,
    Y_STAGE,
)


@jitted
def set_tolerances(method, loop, w):
    """Set the tolerance of every component, and Newton's.

    The error is estimated with order s for a method of order 2 s - 1; radau.f therefore works with
    0.1 rtol^((s+1)/(2s)).
    """
    n = len(method.c)
    power = (n + 1.0) / (2.0 * n)
    rtol = 0.1 * loop.control[at.RTOL] ** power if loop.control[at.RTOL] > 0.0 else 0.0
    atol = (
        loop.control[at.ATOL] * (rtol / loop.control[at.RTOL])
        if rtol > 0.0
        else 0.1 * loop.control[at.ATOL] ** power
    )
    for i in range(loop.sizes[at.NV]):
        w.pairs[SCALE, loop.sizes[at.NV] + i] = tolerance(rtol, atol, loop.y[loop.sizes[at.NQ] + i])
    start = 0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, end):
            w.pairs[SCALE, i - k] = tolerance(rtol, atol, loop.y[i])
        if end < loop.sizes[at.NQ]:
            for i in range(end - k, end - k + 3):
                w.pairs[SCALE, i] = tolerance(rtol, atol, 1.0)
        start = end + 4
    w.numbers[NEWTON_BOUND] = loop.control[at.NEWTON_TOL]
    if loop.control[at.NEWTON_TOL] <= 0.0:
        w.numbers[NEWTON_BOUND] = max(10.0 * EPS / max(rtol, EPS), min(0.03, rtol ** (1.0 / power - 1.0)))


@jitted
def tolerance(rtol, atol, value):
    """Return the tolerance of one component, never below its round-off."""
    return max(atol + rtol * abs(value), 4.0 * EPS * abs(value) + 1e-300)


@jitted
def estimate_error(equations, method, h, loop, t, w):
    """Return the estimated error of the step in units of the tolerance; work has no part in it.

    The estimate of the embedded method is filtered by (1 - h J / μ)⁻¹; in the first step, and after a
    rejected one, a large estimate is filtered once more (Hairer, Wanner 1996, IV.8, (8.19) and (8.20)). It is not less
    than the error of quaternions between the places that dense output goes through.
    """
    nq, nv, y_error = loop.sizes[at.NQ], loop.sizes[at.NV], w.states[Y_STAGE]
    error = equations.filter_error(method, h, loop, loop.f, False, w)
    if error >= 1.0 and (loop.counters[at.LAST_REJECTED] or not loop.counters[HAVE_HISTORY]):
        retract(loop.sizes, loop.y, 1.0, w.pairs[ERROR], 0, y_error)
        for i in range(nv):
            y_error[nq + i] = loop.y[nq + i] + w.pairs[ERROR, nv + i]
        equations.rotate_error(-1.0, loop.sizes, w.pairs[ERROR], y_error)
        if not evaluate(loop, t, y_error, w.rows[F_NEW]):
            return math.inf
        equations.rotate_error(1.0, loop.sizes, w.pairs[ERROR], w.rows[F_NEW])
        error = equations.filter_error(method, h, loop, w.rows[F_NEW], True, w)
    if not math.isfinite(error):
        return error
    return max(error, error_between_places(equations.n_places(method, loop), loop.sizes, w), 1e-10)


@jitted
def keep_axes(sense, sizes, error, x):
    """Leave the rates in `x` as they are: errors are in body axes too."""


@jitted
def n_places_of_stages(method, loop):
    """Return how many places dense output goes through: the start of the step and its stages."""
    return len(method.c) + 1


@jitted
def filter_accelerations(solve, method, h, loop, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]` and return its norm, see `Equations`.

    `solve` (method, w) filters the part of the rates, where that of the positions is known.
    """
    sizes, y = loop.sizes, loop.y
    nq, nv = sizes[at.NQ], sizes[at.NV]
    shift = h / method.mu
    unfiltered_positions(method, h, loop, again, w)
    for i in range(nv):
        w.pairs[ERROR, nv + i] = row[nq + i] + weighted(method, method.error, nq + i, w) / h
    solve(method, w)
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            w.pairs[ERROR, i] += shift * w.pairs[ERROR, nv + i]
        if end < nv:
            add_rotation(1.0 / shift, end, nv + end, nq + end, y, w.pairs[ERROR])
        start = end + 3
    return norm_of_error(w)


@jitted
def norm_of_error(w):
    """Return the root mean square of the errors of positions and rates, each in units of its tolerance."""
    n, total = w.pairs.shape[1], 0.0
    for i in range(n):
        total += (w.pairs[ERROR, i] / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / n)


@jitted
def weighted(method, weights, i, w):
    """Return the sum of the stages' increments of component `i`, each times its weight."""
    total = 0.0
    for s in range(len(method.c)):
        total += weights[s] * w.states[STAGES + s, i]
    return total


@jitted
def unfiltered_positions(method, h, loop, again, w):
    """Write the positions' part of the error, divided by μ/h (for quaternions, by `solve_rotation`)."""
    sizes = loop.sizes
    nq, nv = sizes[at.NQ], sizes[at.NV]
    shift = h / method.mu
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            j = nq + i
            # v0 + eᵀZ_q / h, in which v0 cancels.
            by_q = weighted(method, method.error_a, j, w)
            w.pairs[ERROR, i] = shift * (by_q + w.pairs[ERROR, nv + i] if again else by_q)
        if end < nv:
            unfiltered_rotation(method, h, k, loop, again, w)
        start = end + 3


@jitted
def unfiltered_rotation(method, h, k, loop, again, w):
    """Write the part of the error that belongs to the rotation vector of quaternion `k`, solved with g - ∂θ'/∂θ."""
    sizes, y, e, error = loop.sizes, loop.y, method.error, w.pairs[ERROR]
    i = quaternion_at(sizes, k)
    column = i - k
    first, j = sizes[at.NQ] + column, sizes[at.NV] + column
    a, b, c = y[first], y[first + 1], y[first + 2]
    x, y_, z = a, b, c
    if again:
        u, v, w_ = a + error[j], b + error[j + 1], c + error[j + 2]
        x, y_, z = chart_rate(error[column], error[column + 1], error[column + 2], u, v, w_)
    x += weighted(method, e, i, w) / h
    y_ += weighted(method, e, i + 1, w) / h
    z += weighted(method, e, i + 2, w) / h
    error[column], error[column + 1], error[column + 2] = solve_rotation(method.mu / h, a, b, c, x, y_, z)
