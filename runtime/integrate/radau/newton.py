"""Simplified Newton for the stages of the Radau methods, whatever the equations and the matrices."""

import math
from collections.abc import Callable
from typing import NamedTuple

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.newton import (
    CONVERGED,
    DIVERGED,
    EPS,
    ITERATING,
    RATE,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.coupled import count_failure
from symgen.runtime.integrate.radau.work import COUPLED, ITERATIONS, LAST_RATE, NEWTON_BOUND, SCALE

# Corrections below this many times the round-off of positions, that no longer shrink, are taken for it.
ROUND_OFF = 4.0
_FADING = 0.5
KEEP_JACOBIAN_RATE = 1e-2  # of full matrices


class Equations(NamedTuple):
    """The equations of the stages and their linear algebra: jitted functions, with which the step loop is compiled.

    `full.py`, `sparse.py` and `ggl.py` have one each. `w` are the work arrays of each, t is the start of the step and h
    its length, t1 its end.

    Attributes
    ----------
    differentiate : (method, loop, t, w) -> status
        Takes the derivatives that Newton's matrices are made of.
    factor : (method, h, loop, w) -> status
        Factors Newton's matrices: the real one and those of the complex pairs.
    predict : (method, h, extrapolate, loop, t, w) -> bool
        Sets the stages from where Newton starts: as the polynomial of the last step goes on where `extrapolate`, or
        with rates that do not change; returns whether all is finite.
    improve : (method, h, loop, t, w) -> (status, float)
        Corrects the stages once; returns also the size of the correction, in tolerances.
    filter_error : (method, h, loop, row, again, w) -> float
        Writes the filtered error to `w.pairs[ERROR]` and returns its norm, in tolerances. `again`: an error is there
        already, and the rhs `row` is that of y + error.
    rotate_error : (sense, sizes, error, x)
        Turns the rates in `x` between body axes and those that the errors of rates are in.
    can_couple : (sizes) -> bool
        Returns whether stages may be coupled (`coupled.py`), which `factor` and `improve` know, in a model of such
        sizes.
    keep_rate : () -> float
        Returns the rate of contraction of Newton below which the Jacobian serves another step, and the factors one of
        equal length.
    n_places : (method, loop) -> int
        Returns how many places, ends included, dense output of quaternions goes through.
    reach_end : (method, h, loop, t, t1, w) -> status
        Writes the new state, on the constraints, and its rhs row.
    commit : (method, loop, t, t1, w) -> status
        Makes the new state the current one, with dense output, and records the step.
    """

    differentiate: Callable
    factor: Callable
    predict: Callable
    improve: Callable
    filter_error: Callable
    rotate_error: Callable
    can_couple: Callable
    keep_rate: Callable
    n_places: Callable
    reach_end: Callable
    commit: Callable


@jitted
def keep_rate_of_full():
    """Return how fast Newton must contract for a full Jacobian to be kept."""
    return KEEP_JACOBIAN_RATE


@jitted
def solve_stages(equations, method, h, loop, t, w):
    """Improve the stages by Newton; returns RUNNING, or why it does not converge."""
    start_newton(w.numbers)
    verdict, size, rate = ITERATING, 0.0, 0.0
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        status, size = equations.improve(method, h, loop, t, w)
        if status != at.RUNNING:
            return status
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
        if iteration == 2:
            rate = w.numbers[RATE]
    if verdict == DIVERGED and iteration > 2:
        # Before round-off had a part in it, the rate of contraction was that of the second iteration.
        if size <= ROUND_OFF * round_off(method, h, loop.sizes, loop.y, w):
            verdict = CONVERGED
            w.numbers[RATE] = rate
            if not loop.counters[COUPLED]:
                count_failure(loop, w)
    w.numbers[ITERATIONS] = iteration
    # One iteration tells nothing of the rate: what was known of it fades, or steps would never grow again.
    w.numbers[LAST_RATE] = w.numbers[RATE] if iteration > 1 else _FADING * w.numbers[LAST_RATE]
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def round_off(method, h, sizes, y, w):
    """Return the size of transformed rates whose motion within the step is the round-off of positions, in tolerances.

    Stiff forces turn that round-off into corrections which no iteration makes smaller, and shorter steps make larger.
    """
    total = 0.0
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            total += (y[i] / w.pairs[SCALE, sizes[at.NV] + i - k]) ** 2
        if end < sizes[at.NQ]:
            for i in range(end - k, end - k + 3):
                total += 1.0 / w.pairs[SCALE, sizes[at.NV] + i] ** 2
        start = end + 4
    return EPS * method.amplification * method.mu / h * math.sqrt(total / (2 * sizes[at.NV]))
