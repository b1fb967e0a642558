"""Compensated summation: what rounding drops from a sum is kept and added with the next term."""

from symgen.runtime.code.jitted import jitted


@jitted
def add_compensated(increment, i, y, rest):
    """Add `increment` to `y[i]`, where `y[i] + rest[i]` is the sum as it would be without rounding.

    Kahan, Comm. ACM 8 (1965) 40; as in Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), VIII.5. The
    terms are smaller than the sum.
    """
    term = rest[i] + increment
    total = y[i] + term
    rest[i] = (y[i] - total) + term
    y[i] = total
