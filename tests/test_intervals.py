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


NEAR = {
    "sin": (0.0, 1e15), "cos": (0.0, 1e15), "tan": (math.pi / 2, 1e15), "asin": (1.0, 2.0), "acos": (-1.0, 2.0),
    "exp": (709.0, 745.0), "sinh": (0.0, 710.0), "cosh": (0.0, 710.0), "log": (0.0, 1e15), "sqrt": (0.0, 1e15),
}  # fmt: skip
DOMAINS = {
    "asin": lambda x: abs(x) <= 1, "acos": lambda x: abs(x) <= 1, "log": lambda x: x > 0, "sqrt": lambda x: x >= 0,
}  # fmt: skip


class Exactly:
    """The operations of expressions on numbers of mpmath."""

    add, sub, mul = (staticmethod(f) for f in (lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b))

    def div(self, a, b):
        return a / b

    def select(self, is_strict, a, b, then, otherwise):
        return then if (a < b if is_strict else a <= b) else otherwise

    def call(self, name, *args):
        if not DOMAINS.get(name, lambda x: True)(args[0]) or max(abs(x) for x in args[-1:]) > 1e16:
            raise OverflowError
        if name == "pow" and args[0] <= 0 and args[1] != int(args[1]):
            raise OverflowError
        return (EXACT | {"pow": mpmath.power}).get(name, getattr(mpmath, name, None))(*args)


def hard_case(random, begin, end):
    """A function where it is steep, turns, jumps or rounds much, inside of sums, quotients, powers and choices."""
    name = str(random.choice([*NEAR, "floor", "heaviside", "atan2", "power", "pole", "tanh", "fabs"]))
    at, size = NEAR.get(name, (float(random.integers(-3, 4)), 1e15))
    c = begin + (end - begin) * float(random.choice([0.0, 0.5, 1.0, random.random()]))
    slope = float(random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-16.0, math.log10(size)))
    power = float(random.choice([2.0, 3.0, -1.0, -2.0, 7.0, 20.0, 0.5, 1.5, -0.5, -1.7]))

    def make(m, t):
        u = m.add(m.mul(slope, m.sub(t, c)), at)
        if name == "heaviside":
            value = m.select(bool(power > 1.0), u, at, m.mul(u, u), t)
        elif name == "power":
            value = m.call("pow", m.add(u, 1e-3), power)
        elif name == "pole":
            value = m.div(m.sub(t, c + 1.0), m.sub(u, at))
        elif name == "atan2":
            value = m.call("atan2", m.sub(u, at), m.sub(t, c - 1e-9))
        else:
            value = m.call(name, u)
        return m.sub(m.mul(value, value), m.add(value, m.mul(1e6, t)))

    return name, make


@pytest.mark.parametrize("seed", range(4))
def test_ends_are_rounded_outward(seed):
    """Not by a slack, but to the last digit: arguments up to 1e15, cells that begin, end and lie around hard places."""
    random, compared, finite = np.random.default_rng([11, seed]), 0, 0
    for _ in range(80):
        begin = np.full(3, random.uniform(0.0, 10.0 ** random.uniform(-3.0, 9.0)))
        end = begin * (1.0 + 1e-14) + 10.0 ** random.uniform(-7.0, 1.0, size=3)
        name, make = hard_case(random, begin[0], end[0])
        with np.errstate(all="ignore"):
            found = make(arithmetic := Intervals(begin, end, []), arithmetic.time())
        finite += int((np.isfinite(found.high) & np.isfinite(found.low)).sum())
        for k in range(3):
            for t in [*random.uniform(begin[k], end[k], size=3), begin[k], end[k]]:
                try:
                    value = make(Exactly(), mpmath.mpf(float(t)))
                except (ZeroDivisionError, OverflowError):
                    continue
                where = f"{name} at t = {t!r} in [{begin[k]!r}, {end[k]!r}]: {mpmath.nstr(value, 20)}"
                assert found.low[k] <= value <= found.high[k], where
                compared += 1
    assert compared > 300 and finite > 60


def test_whole_exponents_that_change_have_powers_of_negative_numbers():
    cells_of = Intervals(np.array([0.0, 1.5]), np.array([0.5, 2.5]), [])
    t = cells_of.time()
    with np.errstate(all="ignore"):
        found = cells_of.call("pow", cells_of.sub(t, 3.0), cells_of.call("floor", t))
    assert (found.low <= [1.0, -2.0]).all() and (found.high >= [1.0, 1.0]).all()


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
