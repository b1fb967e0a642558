"""Hairer's test for stiffness, nearly free of cost in explicit methods."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.step_control import EPS

STIFF_AFTER = 15  # signs in a row, with fewer than NON_STIFF_AFTER steps in between that say otherwise
NON_STIFF_AFTER = 6
LOOK_EVERY = 8


@jitted
def watch_stiffness(bound, loop, h, y_new, f_new, y_stage, f_stage):
    """Count signs that stability, not accuracy, limits the step: h |f1 - f2| / |y1 - y2| > bound.

    Hairer, Wanner, Solving ODEs II (1996), IV.2, and dopri5.f, dop853.f.

    Parameters
    ----------
    bound : float
        Extent of the stability region on the negative real axis.
    y_new, f_new : ndarray
        State and derivative at the end of the step.
    y_stage, f_stage : ndarray
        The same of another stage with node 1.
    """
    if loop.counters[at.STIFF_COUNT] == 0 and loop.counters[at.STEPS] % LOOK_EVERY != 0:
        return
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    df, dy, size = 0.0, 0.0, 0.0
    for i in range(n):
        df += (f_new[i] - f_stage[i]) ** 2
        dy += (y_new[i] - y_stage[i]) ** 2
        size += y_new[i] ** 2
    # Two stages that agree to round-off say nothing.
    if dy > (64.0 * EPS) ** 2 * size and h * math.sqrt(df / dy) > bound:
        loop.counters[at.NON_STIFF_COUNT] = 0
        loop.counters[at.STIFF_COUNT] += 1
    elif loop.counters[at.STIFF_COUNT] > 0:
        loop.counters[at.NON_STIFF_COUNT] += 1
        if (
            loop.counters[at.NON_STIFF_COUNT] >= NON_STIFF_AFTER
            and loop.counters[at.STIFF_COUNT] < STIFF_AFTER
        ):
            loop.counters[at.STIFF_COUNT] = 0
            loop.counters[at.NON_STIFF_COUNT] = 0
