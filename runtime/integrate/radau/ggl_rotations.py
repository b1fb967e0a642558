"""Quaternions in the stages of the Radau methods for index-2 equations: rotation vectors that follow from the rates.

Angular velocities are collocated in the axes that the body has at the start of the step, which are fixed in space:
u = R(θ) ω, of which θ' = u - ½ θ×u + … and ω' = R(θ)ᵀ u'. Constraints act at points that hardly move there while a
body spins, and so do the gyroscopic forces of a rotor; in its own axes, the gradients G of a constraint turn with it,
and Newton's matrices, which hold G, would serve for a few hundredths of a turn.
"""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import chart_rate, n_quaternions, quaternion_at, rotated
from symgen.runtime.integrate.radau.work import STAGES

# Sweeps contract by h |ω| / 2 or better, and the later ones by more.
_MAX_SWEEPS = 40
_ROUND_OFF, _SETTLED = 2.0 * float(np.finfo(float).eps), 1e-12
# Derivatives are in the axes of the step at whose start they were taken: a step that turns a body by more than this
# [rad] leaves them behind.
KEEP_ROTATION = 0.03


@jitted
def reset_rotations(method, sizes, w):
    """Let the stages' quaternions be those of the start of the step, from where sweeps begin."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for s in range(len(method.c)):
            for j in range(i, i + 4):
                w.states[STAGES + s, j] = 0.0


@jitted
def solve_rotations_index2(method, h, i, j, sizes, y, w):
    """Solve for the stages' rotation vectors at `i` from the rates from `j` on; returns whether sweeps settled.

    Iserles, Munthe-Kaas, Nørsett, Zanna, Acta Numerica 9 (2000) 215: θ' = `chart_rate`(-θ, u), collocated.
    """
    n, first, rates = len(method.c), sizes[at.NQ] + j, w.rotation_rates
    largest, smallest = 0.0, math.inf
    for _ in range(_MAX_SWEEPS):
        for s in range(n):
            z, u = w.states[STAGES + s], w.steered[s]
            spin = y[first] + u[j], y[first + 1] + u[j + 1], y[first + 2] + u[j + 2]
            rates[s, 0], rates[s, 1], rates[s, 2] = chart_rate(-z[i], -z[i + 1], -z[i + 2], *spin)
        largest = 0.0
        for s in range(n):
            for axis in range(3):
                total = 0.0
                for r in range(n):
                    total += method.a[s, r] * rates[r, axis]
                largest = max(largest, abs(h * total - w.states[STAGES + s, i + axis]))
                w.states[STAGES + s, i + axis] = h * total
        if largest <= _ROUND_OFF or not largest < smallest:
            break
        smallest = largest
    return largest <= _SETTLED


@jitted
def largest_rotation(sizes, w):
    """Return by how much the step turns the body that it turns most [rad]."""
    z, largest = w.states[STAGES + w.rotation_rates.shape[0] - 1], 0.0
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        largest = max(largest, z[i] * z[i] + z[i + 1] * z[i + 1] + z[i + 2] * z[i + 2])
    return math.sqrt(largest)


@jitted
def rotate_blocks(sizes, y, row, b):
    """Make derivatives by rates in body axes those by rates in the axes of the start of the step.

    With δω = δu - δθ×u and likewise for u', D + M W becomes D - M W, and K + D W becomes K + D W + M [v'×]; the first
    equation has -W, and G's derivatives add up to the same.
    """
    nq, nv = sizes[at.NQ], sizes[at.NV]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        a, b_, c = y[nq + j], y[nq + j + 1], y[nq + j + 2]
        for i in range(nv):
            add_cross(j, -a, -b_, -c, b.mass[i], b.by_rates[i])
            add_cross(j, row[nq + j], row[nq + j + 1], row[nq + j + 2], b.mass[i], b.by_positions[i])
        b.spin[j], b.spin[j + 1], b.spin[j + 2] = -a, -b_, -c


@jitted
def add_cross(j, a, b, c, row, out):
    """Add three entries of `row`, from `j` on, times the matrix of (a, b, c)× to those of `out`."""
    x, y, z = row[j], row[j + 1], row[j + 2]
    out[j] += y * c - z * b
    out[j + 1] += z * a - x * c
    out[j + 2] += x * b - y * a


@jitted
def to_start_axes(sizes, y, w):
    """Turn the angular velocities of the stages, whose rotation vectors are known, from body axes."""
    for s in range(w.rotation_rates.shape[0]):
        rotate_rates(1.0, sizes, y, w.states[STAGES + s])


@jitted
def to_body_axes(sizes, y, w):
    """Turn the angular velocities of the stages into body axes."""
    for s in range(w.rotation_rates.shape[0]):
        rotate_rates(-1.0, sizes, y, w.states[STAGES + s])


@jitted
def rotate_rates(sense, sizes, y, increments):
    """Turn the angular velocities that are `increments` away from `y`, by `sense` times the rotation vectors."""
    nq = sizes[at.NQ]
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        j = nq + i - k
        for axis in range(3):
            increments[j + axis] += y[j + axis]
        rotate_entries(sense, increments, i, increments, j)
        for axis in range(3):
            increments[j + axis] -= y[j + axis]


@jitted
def rotate_entries(sense, vectors, i, x, j):
    """Turn three entries of `x`, from `j` on, by `sense` times the rotation vector in `vectors` at `i`."""
    a, b, c = sense * vectors[i], sense * vectors[i + 1], sense * vectors[i + 2]
    x[j], x[j + 1], x[j + 2] = rotated(a, b, c, x[j], x[j + 1], x[j + 2])
