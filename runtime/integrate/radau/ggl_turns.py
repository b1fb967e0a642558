"""Quaternions in the stages of the Radau methods for index-2 equations: rotation vectors that follow from the rates."""

import math

import numpy as np

from runtime.code.jitted import jitted
from runtime.integrate.layout import NQ
from runtime.integrate.quaternions import chart_rate, n_quaternions, quaternion_at
from runtime.integrate.radau.work import STAGES

# Sweeps contract by h |ω| / 2 or better, and the later ones by more.
_MAX_SWEEPS = 40
_ROUND_OFF, _SETTLED = 2.0 * float(np.finfo(float).eps), 1e-12


@jitted
def forget_turns(method, sizes, w):
    """Let the stages' quaternions be those of the start of the step, from where sweeps begin."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for s in range(len(method.c)):
            for j in range(i, i + 4):
                w.states[STAGES + s, j] = 0.0


@jitted
def turn_index2(method, h, i, j, sizes, y, w):
    """Solve for the stages' rotation vectors at `i` from the rates from `j` on; returns whether sweeps settled.

    Iserles, Munthe-Kaas, Nørsett, Zanna, Acta Numerica 9 (2000) 215: θ' = `chart_rate`(θ, ω), collocated.
    """
    n, first, turns = len(method.c), sizes[NQ] + j, w.turns
    largest, smallest = 0.0, math.inf
    for _ in range(_MAX_SWEEPS):
        for s in range(n):
            z, u = w.states[STAGES + s], w.steered[s]
            spin = y[first] + u[j], y[first + 1] + u[j + 1], y[first + 2] + u[j + 2]
            turns[s, 0], turns[s, 1], turns[s, 2] = chart_rate(z[i], z[i + 1], z[i + 2], *spin)
        largest = 0.0
        for s in range(n):
            for axis in range(3):
                total = 0.0
                for r in range(n):
                    total += method.a[s, r] * turns[r, axis]
                largest = max(largest, abs(h * total - w.states[STAGES + s, i + axis]))
                w.states[STAGES + s, i + axis] = h * total
        if largest <= _ROUND_OFF or not largest < smallest:
            break
        smallest = largest
    return largest <= _SETTLED
