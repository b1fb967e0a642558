"""Compiled functions of arrays that do not overlap compute what they compute in Python."""

from __future__ import annotations

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
