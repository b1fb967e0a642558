"""Quaternions in the stages of the Gauss methods: their four components are collocated.

Gauss methods keep quadratic invariants, so the length of a quaternion that q' = q (0, ω)/2 turns stays what it was but
for round-off, and the method stays symmetric (Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), IV.2).
"""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.gauss.sums import add_up
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, quaternion_rate

# Sweeps contract by h |ω| / 4 or better, the later the better: so many do for steps of half a turn.
MAX_SWEEPS = 40
_ROUND_OFF, _SETTLED = 2.0 * float(np.finfo(float).eps), 1e-12


@jitted
def reset_rotations(method, sizes, y, w):
    """Put the stages' quaternions at the start of the step, from where sweeps begin."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for s in range(method.c.shape[0]):
            for j in range(i, i + 4):
                w.states[s, j] = y[j]


@jitted
def solve_stage_rotations(method, h, n_sweeps, i, first, y, w):
    """Solve for the stages' quaternions at `i`, whose angular velocities are at `first`, by fixed-point iteration.

    It goes on from `w.states` for at most `n_sweeps` sweeps, while rounding lets them change less and less. Returns
    whether they have settled.
    """
    n = method.c.shape[0]
    rest, travels, sums = w.states[n + 1], w.travels[i : i + 4], w.sums[i : i + 4]
    largest, smallest = 0.0, math.inf
    for _ in range(n_sweeps):
        for s in range(n):
            z, weight = w.states[s], h * method.b[s]
            turned = quaternion_rate(z, i, z[first], z[first + 1], z[first + 2])
            for j in range(4):
                travels[j, s] = weight * turned[j]
        add_up(method.mu, travels, sums)
        largest = 0.0
        for j in range(4):
            for s in range(n):
                placed = y[i + j] + (rest[i + j] + sums[j, s])
                largest = max(largest, abs(placed - w.states[s, i + j]))
                w.states[s, i + j] = placed
        if largest <= _ROUND_OFF or not largest < smallest:
            break
        smallest = largest
    return largest <= _SETTLED
