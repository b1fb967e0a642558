"""Evaluate the right-hand side within step loops, with counting and a check for infinities and nan."""

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at


@jitted
def all_finite(values, n):
    """Whether the first `n` values are finite."""
    total = 0.0
    for i in range(n):
        total += values[i] * 0.0
    return total == 0.0


@jitted
def evaluate(loop, t, y, row):
    """Evaluate the right-hand side into `row`; returns whether its derivatives are finite."""
    call_kernel(loop.addresses[at.RHS], t, y, loop.p, row)
    loop.counters[at.RHS_CALLS] += 1
    return all_finite(row, loop.sizes[at.NY])
