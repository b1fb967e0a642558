"""What follows the last terms of a series, against sums in closed form; what that makes of a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from symgen.runtime.integrate.layout import N_SIZES, NQ, NV, NY
from symgen.runtime.integrate.taylor import add_tail, append_tail, drop_tail, tail_factors

ORDER = 14


def sizes(n):
    found = np.zeros(N_SIZES, dtype=np.int64)
    found[[NQ, NV, NY]] = n, n, 2 * n
    return found


def series_of(rates):
    """Return a series whose rates have the given coefficients, shape (ORDER, n), and positions all zero."""
    series = np.zeros((ORDER + 2, 2 * rates.shape[1]))
    series[:ORDER, rates.shape[1] :] = rates
    return series


def pair(radius, angle, phase):
    """Coefficients of Re e^(i phase) / (1 - t / z) with a pole at z = radius e^(i angle), and the function."""
    z = radius * np.exp(1j * angle)
    k = np.arange(ORDER)
    return (np.exp(1j * phase) * z**-k).real, lambda t: (np.exp(1j * phase) / (1 - t / z)).real


def sums(rates, h):
    """Return the rates that a series of given coefficients has at `h`, with its tail and without."""
    n, series = rates.shape[1], series_of(rates)
    plain = (rates * h ** np.arange(ORDER)[:, None]).sum(axis=0)
    total, lost, slope = np.concatenate([np.zeros(n), plain]), np.zeros(2 * n), np.zeros(2 * n)
    add_tail(h, ORDER, sizes(n), series, total, lost, slope)
    assert not total[:n].any()
    return total[n:] + lost[n:], plain, slope[n:]


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.4, math.pi])
def test_terms_ruled_by_one_pair_of_poles_are_summed_to_the_end(angle, unit):
    h = 0.35 * unit
    parts = [pair(unit, angle, phase) for phase in (0.3, 1.1, 2.0)]
    rates = np.column_stack([coefficients for coefficients, _ in parts])
    exact = np.array([function(h) for _, function in parts])
    found, plain, _ = sums(rates, h)
    assert np.abs(plain - exact).max() > 1e-8
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-5 * np.abs(plain - exact).max())


def test_branch_points_leave_little_and_the_slope_follows():
    """(1 - t)^(1/2) and its like: their terms decay as a power of k besides."""
    k, h, eps = np.arange(ORDER), 0.35, 1e-6
    exponents = np.array([0.5, -0.5, 1.5])
    rates = np.cumprod(np.vstack([np.ones(3), (k[:-1, None] - exponents) / (k[:-1, None] + 1.0)]), axis=0)
    exact = (1.0 - h) ** exponents
    found, plain, slope = sums(rates, h)
    assert np.all(np.abs(found - exact) < 0.05 * np.abs(plain - exact))
    powers = (k * h ** (k - 1.0))[:, None]
    missing = ((1 - h - eps) ** exponents - (1 - h + eps) ** exponents) / (2 * eps) - (rates * powers).sum(
        axis=0
    )
    assert np.all(np.abs(slope - missing) < 0.1 * np.abs(missing))


@pytest.mark.parametrize("h", [1e-30, 1e-13, 1e-3, 0.9])
def test_nothing_is_made_of_what_is_not_there(h):
    """A polynomial, noise, and terms too small to be squared."""
    polynomial, noise = np.zeros((ORDER, 3)), np.random.default_rng(0).normal(size=(ORDER, 3))
    polynomial[:3] = 1.0
    assert tail_factors(h, ORDER, sizes(3), series_of(polynomial)) == (0.0, 0.0)
    found, plain, _ = sums(noise, h)
    assert np.all(np.abs(found - plain) <= np.abs(noise[-2:]).sum() * h ** (ORDER - 2))


def test_terms_that_hardly_decay_are_left_as_they_are():
    rates = np.column_stack([pair(1.0, angle, 0.3)[0] for angle in (0.1, 0.1, 0.1)])
    assert tail_factors(0.9, ORDER, sizes(3), series_of(rates)) == (0.0, 0.0)


def test_a_single_rate_is_summed_as_it_is():
    """Two terms of one rate fit a recurrence in any case."""
    rates = pair(1.0, 0.4, 0.3)[0][:, None]
    assert tail_factors(0.35, ORDER, sizes(1), series_of(rates)) == (0.0, 0.0)


def test_the_last_row_holds_the_tail_for_dense_output_and_is_cleared_after():
    h = 0.35
    parts = [pair(1.0, 0.9, phase) for phase in (0.3, 1.1)]
    series = series_of(np.column_stack([coefficients for coefficients, _ in parts]))
    series *= h ** np.arange(ORDER + 2.0)[:, None]
    before = series.copy()
    append_tail(ORDER, sizes(2), series)
    for theta, limit in ((1.0, 1e-14), (0.9, 1e-7), (0.5, 1e-10)):
        exact = [function(theta * h) for _, function in parts]
        np.testing.assert_allclose(
            (theta ** np.arange(ORDER + 2.0)) @ series[:, 2:], exact, rtol=0, atol=limit
        )
    drop_tail(ORDER, sizes(2), series)
    np.testing.assert_array_equal(series, before)
