"""The kernel that sums a series, for every number of components: values, derivative and what rounding loses."""

from __future__ import annotations

import numpy as np
import pytest

from symgen.runtime.code import engine
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.taylor.kernel import sum_kernel

ORDER, H = 6, 0.3


@pytest.mark.parametrize("n", range(1, 40))
def test_sums_are_those_of_the_polynomials(n):
    symbol = "sum_of_series"
    ir = sum_kernel(symbol, n)
    code = engine.MachineCode()
    address = code.add(engine.object_code(engine.cache_key(ir), "taylor", symbol, lambda _: (ir, 0)), symbol)
    series = np.random.default_rng(n).normal(size=(ORDER + 2, n))
    series[ORDER + 1 :] = 0.0
    carry, out = np.full(n, 1e-18), np.zeros(3 * n)
    out[0] = ORDER
    call_kernel(np.uint64(address), H, series.ravel(), carry, out)
    powers = H ** np.arange(ORDER + 2)
    np.testing.assert_allclose(out[:n], powers @ series, rtol=0, atol=1e-14)
    assert np.abs(out[n : 2 * n]).max() < 1e-15
    slope = (np.arange(1, ORDER + 2) * powers[:-1]) @ series[1:]
    np.testing.assert_allclose(out[2 * n :], slope, rtol=0, atol=1e-13)
