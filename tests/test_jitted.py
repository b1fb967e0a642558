"""Compiled functions: arrays that do not overlap, functions as arguments and in records, what the key of code holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from symgen.runtime.code.jitted import DISABLE_JIT, Jitted, jitted
from symgen.runtime.integrate.explicit.loop import erk_sum

pytestmark = pytest.mark.skipif(DISABLE_JIT, reason="nothing is compiled")


def scaled(x, factor, out):
    for i in range(out.shape[0]):
        out[i] = factor * x[i]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 41])
def test_short_loops_over_distinct_arrays_have_the_bits_of_python(n):
    random = np.random.default_rng(n)
    weights, y, k = random.normal(size=6), random.normal(size=n), random.normal(size=(6, n + 3))
    weights[2] = 0.0
    compiled, plain = np.zeros(n), np.zeros(n)
    erk_sum(weights, 6, 0.1, y, k, compiled)
    erk_sum.py_func(weights, 6, 0.1, y, k, plain)
    assert np.array_equal(compiled, plain)


def test_whether_arrays_are_distinct_is_part_of_what_is_compiled():
    assert isinstance(jitted(scaled), Jitted) and isinstance(jitted(distinct_arrays=True)(scaled), Jitted)
    assert jitted(scaled).fingerprint != jitted(distinct_arrays=True)(scaled).fingerprint


class Rule(NamedTuple):
    """What a sum is made of."""

    term: Callable
    weight: Callable


@jitted
def square(x):
    return x * x


@jitted
def cube(x):
    return x * x * x


@jitted
def weighted_sum(rule, x):
    total = 0.0
    for i in range(x.shape[0]):
        total += rule.weight(i + 1.0) * rule.term(x[i])
    return total


SQUARES, CUBES = Rule(square, cube), Rule(cube, square)


@jitted
def sum_of_squares(x):
    return weighted_sum(SQUARES, x)


@jitted
def sum_of_cubes(x):
    return weighted_sum(CUBES, x)


def test_functions_in_a_record_are_compiled_with_what_they_are_handed_to():
    x = np.array([0.5, -2.0, 3.0])
    places = np.array([1.0, 2.0, 3.0])
    assert sum_of_squares(x) == pytest.approx(places**3 @ x**2, rel=1e-15)
    assert sum_of_cubes(x) == pytest.approx(places**2 @ x**3, rel=1e-15)


def test_the_key_of_code_holds_the_functions_in_its_records(monkeypatch):
    def key(rule):
        monkeypatch.setitem(globals(), "SQUARES", rule)
        return jitted(sum_of_squares.py_func).fingerprint

    def quartic(x):
        return x * x * x * x

    assert key(Rule(square, cube)) == key(Rule(square, cube))
    # The same functions in other places, and another function in the same place.
    assert key(Rule(cube, square)) != key(Rule(square, cube))
    assert key(Rule(square, jitted(quartic))) != key(Rule(square, cube))
