"""What impulses and travels of the stages of a Gauss method add up to at each of them."""

import numpy as np

from symgen.runtime.code.jitted import jitted

# Numba checks signed indexes for "from the end"; see `linear`.
unsigned = np.uint64
ONE, TWO, THREE, FOUR = unsigned(1), unsigned(2), unsigned(3), unsigned(4)


@jitted
def add_up(mu, terms, sums):
    """Write Σ_j mu[j, s] terms[i, j] to `sums[i, s]`, four s at a time: they stay in registers and run abreast."""
    n = unsigned(terms.shape[1])
    for i in range(unsigned(terms.shape[0])):
        s = unsigned(0)
        while s + FOUR <= n:
            first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
            for j in range(n):
                term = terms[i, j]
                first += mu[j, s] * term
                second += mu[j, s + ONE] * term
                third += mu[j, s + TWO] * term
                fourth += mu[j, s + THREE] * term
            sums[i, s], sums[i, s + ONE], sums[i, s + TWO], sums[i, s + THREE] = first, second, third, fourth
            s += FOUR
        while s < n:
            total = 0.0
            for j in range(n):
                total += mu[j, s] * terms[i, j]
            sums[i, s] = total
            s += ONE
