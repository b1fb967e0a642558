"""How bdf chooses its next step and order."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
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
