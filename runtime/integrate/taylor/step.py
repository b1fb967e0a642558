"""How far a Taylor series reaches, and whether the motion agrees with it there."""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.step_control import longest_step
from symgen.runtime.integrate.taylor.tail import has_tail

LOG_2 = math.log(2.0)
WINDOW = 4  # coefficients that a step is judged by: symmetry makes up to two in a row vanish
DEFECT_LIMIT = 5.0
ROUND_OFF_RTOL = 3e-15
SHARE, SHARE_WITH_TAIL = 0.5, 1.0  # of the tolerance: the largest of the last terms
_SIZES = 3  # coefficients that tell how large a rate becomes during a step


@jitted
def rate_tolerance(control, h, i, series):
    """Return the error allowed in component `i`, a rate, over a step of length `h`."""
    size = abs(series[0, i])
    power = h
    for k in range(1, _SIZES):
        size = max(size, power * abs(series[k, i]))
        power *= h
    return max(control[at.ATOL] + control[at.RTOL] * size, 1e-300)


@jitted
def series_step(order, loop, series, cell):
    """Return the step [s] over which the terms left out stay below the tolerance.

    With terms |v_k| h^k of the rates and the work (orders 0 to p - 1), relative to their sizes,
    h = min |v_k|^(-1/k) (0.5 tol)^(1/(p-1)) over the last terms (Jorba and Zou, Experimental Mathematics 14
    (2005), eq. 3-8, with the factor of section 3.2.1), the window extended downward, as far as half the order, until it
    holds a term that is not zero. Higher terms all zero: a polynomial, at rest or in free fall, which any step follows.
    Where most of what follows the last terms is added to the sum (`tail.py`), they may be twice as large.

    Parameters
    ----------
    series : ndarray, shape (order + 1, NY)
    cell : ndarray
        Its first number is scratch.
    """
    last = order - 1
    h = loop.control[at.H] if loop.control[at.H] > 0.0 else first_guess(order, loop, series)
    if not h < math.inf:
        return longest_step(loop.control)
    tolerance = max(loop.control[at.RTOL], 1e-17)
    t0, t1, t2, t3 = 0.0, 0.0, 0.0, 0.0
    for i in range(loop.sizes[at.NQ], loop.sizes[at.NY]):
        weight = tolerance / rate_tolerance(loop.control, h, i, series)
        t0 = max(t0, weight * abs(series[last, i]))
        t1 = max(t1, weight * abs(series[last - 1, i]))
        t2 = max(t2, weight * abs(series[last - 2, i]))
        t3 = max(t3, weight * abs(series[last - 3, i]))
    if not all_finite_sum(t0, t1, t2, t3):
        return math.nan
    highest = -math.inf
    if t0 > 0.0:
        highest = max(highest, log2(t0, cell) / last)
    if t1 > 0.0:
        highest = max(highest, log2(t1, cell) / (last - 1))
    if t2 > 0.0:
        highest = max(highest, log2(t2, cell) / (last - 2))
    if t3 > 0.0:
        highest = max(highest, log2(t3, cell) / (last - 3))
    if highest == -math.inf:
        highest = first_term_below(last - WINDOW, last // 2, h, tolerance, loop, series, cell)
        if highest == -math.inf:
            return longest_step(loop.control)
    # At the limit of round-off, what is left out must not add up over many steps where rounding does not.
    left_out = tolerance if tolerance > ROUND_OFF_RTOL else 1e-3 * tolerance
    left_out *= SHARE_WITH_TAIL if has_tail(loop.sizes) else SHARE
    return math.exp((log2(left_out, cell) / last - highest) * LOG_2)


@jitted
def quaternion_step(order, loop, series, cell):
    """Return the step [s] over which the last two terms of quaternions stay below the tolerance.

    They follow from the rates, but not by an integral: at a constant angular velocity the rates have no more terms,
    and quaternions are waves. `series_step`, to which rates are all that there is, would take any step.
    """
    second_last, last = 0.0, 0.0
    for k in range(n_quaternions(loop.sizes)):
        first = quaternion_at(loop.sizes, k)
        for i in range(first, first + 4):
            second_last = max(second_last, abs(series[order - 1, i]))
            last = max(last, abs(series[order, i]))
    highest = -math.inf
    if second_last > 0.0:
        highest = log2(second_last, cell) / (order - 1)
    if last > 0.0:
        highest = max(highest, log2(last, cell) / order)
    if highest == -math.inf:
        return math.inf
    tolerance = max(loop.control[at.ATOL] + loop.control[at.RTOL], ROUND_OFF_RTOL)
    return math.exp((log2(SHARE * tolerance, cell) / order - highest) * LOG_2)


@jitted
def all_finite_sum(a, b, c, d):
    """Whether four numbers that are not negative are finite."""
    return a + b + c + d < math.inf


@jitted
def first_term_below(k, end, h, tolerance, loop, series, cell):
    """Return log2 of the highest term from order `k` down to `end` that is not zero, divided by its order."""
    while k >= end:
        largest = 0.0
        for i in range(loop.sizes[at.NQ], loop.sizes[at.NY]):
            largest = max(largest, abs(series[k, i]) * tolerance / rate_tolerance(loop.control, h, i, series))
        if largest > 0.0:
            return log2(largest, cell) / k
        k -= 1
    return -math.inf


@jitted
def log2(x, cell):
    """Return log2 of a positive number to within 0.05, straight from its bits: a step needs no more."""
    cell[0] = x
    return cell.view(np.int64)[0] * 2.0**-52 - 1022.957


@jitted
def first_guess(order, loop, series):
    """Return a length [s] for the sizes of rates during a first step: the radius that the last terms show."""
    nq, longest = loop.sizes[at.NQ], math.inf
    for k in range(order - 1, 0, -1):
        largest, size = 0.0, 0.0
        for i in range(nq, nq + loop.sizes[at.NV]):
            largest = max(largest, abs(series[k, i]))
            size = max(size, abs(series[1, i]), abs(series[0, i]))
        if largest > 0.0:
            longest = min(longest, math.exp(math.log(size / largest) / k))
            if k <= order - WINDOW:
                break
    return 0.1 * longest


@jitted
def defect(h, order, loop, series, slope, predicted):
    """Return how far the accelerations in `slope` are from those that the series predicts at `h`.

    In units of the tolerance of the rates, whose error is about h / order times that of their derivative at the end.
    """
    worst = 0.0
    for i in range(loop.sizes[at.NQ], loop.sizes[at.NQ] + loop.sizes[at.NV]):
        error = abs(slope[i] - predicted[i]) * h / (order * rate_tolerance(loop.control, h, i, series))
        if not error <= worst:
            worst = error
    return worst


@jitted
def scale_series(h, order, series):
    """Turn a series in time into one in the place θ within a step of length `h`, in place."""
    power = h
    for k in range(1, order + 1):
        for i in range(series.shape[1]):
            series[k, i] *= power
        power *= h
