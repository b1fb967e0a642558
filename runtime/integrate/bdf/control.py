"""How bdf chooses its next step and order."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.bdf.coefficients import MAX_ORDER
from symgen.runtime.integrate.bdf.work import (
    FAILURES,
    HAVE_JACOBIAN,
    ITERATIONS,
    N_EQUAL,
    ORDER,
    SCALE,
    SPACING,
)
from symgen.runtime.integrate.layout import LAST_REJECTED, NQ, NV, REJECTED, H
from symgen.runtime.integrate.newton import MAX_ITERATIONS, RATE
from symgen.runtime.integrate.step_control import SAFETY, longest_step

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
    n = sizes[NQ] + sizes[NV]
    total = 0.0
    for i in range(n):
        total += (w.differences[order + 1, i] / w.states[SCALE, i]) ** 2
    error = method.error[order] * math.sqrt(total / n)
    return max(error, 1e-10) ** (-1.0 / (order + 1.0))


@jitted
def choose_step_and_order(method, error, sizes, control, counters, w):
    """Choose them after an accepted step, from order + 1 equal steps on (Shampine, Reichelt 1997, section 2.3)."""
    order, h = counters[ORDER], w.numbers[SPACING]
    if w.numbers[RATE] > KEEP_JACOBIAN_RATE:
        counters[HAVE_JACOBIAN] = 0
    counters[N_EQUAL] += 1
    control[H] = h
    if counters[N_EQUAL] <= order:
        return
    best, factor = order, max(error, 1e-10) ** (-1.0 / (order + 1.0))
    if order > 1:
        lower = growth(method, order - 1, sizes, w)
        if lower > factor:
            best, factor = order - 1, lower
    if order < MAX_ORDER:
        higher = growth(method, order + 1, sizes, w)
        if higher > factor:
            best, factor = order + 1, higher
    factor = min(GROW, safety(w) * factor, longest_step(control) / h)
    if factor < KEEP_STEP and best >= order:
        return
    counters[ORDER], counters[N_EQUAL] = best, 0
    control[H] = h * factor


@jitted
def shorten_step(solved, error, h, control, counters, w):
    """Shorten the step after its error was too large or, to half, when Newton failed."""
    factor = 0.5
    if solved:
        factor = SHRINK
        if math.isfinite(error):
            factor = max(SHRINK, safety(w) * error ** (-1.0 / (counters[ORDER] + 1.0)))
    else:
        counters[HAVE_JACOBIAN] = 0
    control[H] = h * factor
    counters[LAST_REJECTED] = 1
    counters[FAILURES] += 1
    counters[REJECTED] += 1
