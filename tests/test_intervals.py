"""Ranges over cells of time hold everywhere in them: for every function of the table, and what is made of them."""

from __future__ import annotations

import dataclasses
import math

import mpmath
import numpy as np
import pytest

from symgen.runtime.graph import functions
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.timing.intervals import Intervals

N_CELLS, N_SAMPLES, N_EXPRESSIONS = 16, 5, 40
ROUNDED, LARGEST = 1e-11, 1e6
EXACT = {
    "pow": lambda x, y: mpmath.power(x, y), "copysign": lambda x, y: abs(x) * (1 if y >= 0 else -1),
    "fabs": abs,
}  # fmt: skip


def cells(random):
    """Times from far away to the start, cells from tiny to those that hold all that a function does."""
    begin = random.uniform(-3.0, 3.0, size=N_CELLS)
    return begin, begin + 10.0 ** random.uniform(-6.0, 0.7, size=N_CELLS)


def apply(arithmetic, name, *args):
    """An operation on ranges, or on numbers of mpmath."""
    if isinstance(arithmetic, Intervals):
        own = getattr(arithmetic, name) if name in ("add", "sub", "mul", "div") else None
        return own(*args) if own else arithmetic.call(name, *args)
    if any(mpmath.im(x) for x in args):
        raise OverflowError("outside of a domain")
    own = {
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b,
    }
    return (own | EXACT).get(name, getattr(mpmath, name, None))(*args)


def assert_encloses(make, random, name):
    """What `make(arithmetic, t)` gives on numbers lies in what it gives on ranges, and so do its slopes."""
    begin, end = cells(random)
    with np.errstate(all="ignore"):
        found = make(arithmetic := Intervals(begin, end, []), arithmetic.time())
    compared = 0
    for k in range(N_CELLS):
        for t in [*random.uniform(begin[k], end[k], size=N_SAMPLES), begin[k], end[k]]:
            try:
                value = make(None, mpmath.mpf(float(t)))
                before, after = (
                    make(None, mpmath.mpf(float(t)) + side * mpmath.mpf("1e-25")) for side in (-1, 1)
                )
            except (ZeroDivisionError, OverflowError):
                continue
            if not (mpmath.im(value) == 0 and mpmath.isfinite(value)):
                continue  # outside of its domain
            slack = ROUNDED * (1.0 + abs(float(value)))
            where = f"{name} at t = {t} in [{begin[k]}, {end[k]}]"
            assert found.low[k] - slack <= value <= found.high[k] + slack, where
            compared += 1
            if not begin[k] < t < end[k] or found.breaks[k] or mpmath.im(before) or mpmath.im(after):
                continue  # at a jump or a kink there is no slope
            slope = float((after - before) / mpmath.mpf("2e-25"))
            slack = 1e-9 * (1.0 + abs(slope))
            assert found.slow[k] - slack <= slope <= found.fast[k] + slack, where
    return compared, found


def argument(random):
    """A straight line, a parabola or a wave."""
    a, b, c = random.normal(size=3)
    return [
        lambda m, t: apply(m, "add", apply(m, "mul", b, t), a),
        lambda m, t: apply(m, "add", apply(m, "mul", c, apply(m, "mul", t, t)), a),
        lambda m, t: apply(m, "mul", 1.5 * b, apply(m, "sin", apply(m, "mul", 3.0 * c, t))),
    ][random.integers(3)]


def of_arguments(name, random):
    inside = [argument(random) for _ in range(IN_CODE[name].arity[0])]
    return lambda m, t: apply(m, name, *(u(m, t) for u in inside))


@pytest.fixture(autouse=True)
def digits():
    with mpmath.workdps(60):
        yield


@pytest.mark.parametrize("name", sorted(IN_CODE))
def test_ranges_of_every_function_hold(name):
    random = np.random.default_rng([3, *name.encode()])
    compared, narrow = 0, 0
    for _ in range(4):
        count, found = assert_encloses(of_arguments(name, random), random, name)
        compared += count
        narrow += int((np.isfinite(found.high) & np.isfinite(found.low)).sum())
    # They are no use if they say nothing.
    assert compared > 80 and narrow > 15


def test_ranges_of_expressions_hold():
    random = np.random.default_rng(5)
    operations = [*IN_CODE, "add", "sub", "mul", "div"]

    def expression(depth):
        if depth == 0:
            return argument(random)
        name = str(random.choice(operations))
        inside = [expression(depth - 1) for _ in range(IN_CODE[name].arity[0] if name in IN_CODE else 2)]
        return lambda m, t: apply(m, name, *(u(m, t) for u in inside))

    compared = sum(
        assert_encloses(expression(int(random.integers(1, 4))), random, number)[0]
        for number in range(N_EXPRESSIONS)
    )
    assert compared > 1000


def test_a_new_function_needs_no_rule(monkeypatch):
    """Its entry in the table has its slopes: bounds follow from them."""
    entry = dataclasses.replace(
        IN_CODE["asin"], name="asinh", value=math.asinh, code="asinh", numpy="", domain=(-math.inf, math.inf),
        slopes=lambda a, x, y: ((a.const(1.0), a.call("sqrt", functions._one_plus_square(a, *x))),),
    )  # fmt: skip
    monkeypatch.setitem(IN_CODE, "asinh", entry)
    random = np.random.default_rng(1)
    compared, found = assert_encloses(
        lambda m, t: apply(m, "asinh", apply(m, "mul", 3.0, t)), random, "asinh"
    )
    assert compared > 80 and (found.high - found.low < 10.0).all() and not found.breaks.any()
