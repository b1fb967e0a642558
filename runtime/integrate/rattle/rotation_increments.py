"""Quaternions in a RATTLE step: the mean rate u turns them by the rotation vector h u = θ in body axes.

Variational integrators on Lie groups (Bou-Rabee, Marsden, Found. Comput. Math. 9 (2009) 197): with the matrix R(θ) of
`chart_rate`, which makes θ' of an angular velocity, the momentum (M0 + M1)/2 u of the module `step` becomes R(θ) times
it at the start and R(-θ) times it at the end. These are one vector in space, so angular momentum is kept exactly.
"""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import chart_rate, chart_variation, n_quaternions, quaternion_at
from symgen.runtime.integrate.rattle.push import momentum
from symgen.runtime.integrate.rattle.work import END, MEAN, START, TRAVEL


@jitted
def travel(h, sizes, y, w):
    """Write what the mean rate changes of the positions of `y` to TRAVEL."""
    u, out = w.vectors[MEAN], w.states[TRAVEL]
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            out[i] = h * u[i - k]
        if end < sizes[at.NQ]:
            j = end - k
            change = rotation_change(y, end, h * u[j], h * u[j + 1], h * u[j + 2])
            out[end], out[end + 1], out[end + 2], out[end + 3] = change
        start = end + 4


@jitted
def rotation_change(q, i, a, b, c):
    """Return what the rotation vector (a, b, c) [rad] changes of the quaternion `q[i:i+4]`, to its own round-off."""
    half = 0.5 * math.sqrt(a * a + b * b + c * c)
    quarter = math.sin(0.5 * half)
    fall = -2.0 * quarter * quarter
    sinc = 0.5 * (math.sin(half) / half if half > 0.0 else 1.0)
    a, b, c = sinc * a, sinc * b, sinc * c
    w, x, y, z = q[i], q[i + 1], q[i + 2], q[i + 3]
    return (
        w * fall - x * a - y * b - z * c,
        x * fall + w * a + y * c - z * b,
        y * fall + w * b + z * a - x * c,
        z * fall + w * c + x * b - y * a,
    )


@jitted
def mean_momentum(j, nv, w):
    """Return the three entries from `j` on of (M0 + M1)/2 u."""
    u, m0, m1 = w.vectors[MEAN], w.masses[START], w.masses[END]
    return (
        0.5 * (momentum(j, nv, m0, u) + momentum(j, nv, m1, u)),
        0.5 * (momentum(j + 1, nv, m0, u) + momentum(j + 1, nv, m1, u)),
        0.5 * (momentum(j + 2, nv, m0, u) + momentum(j + 2, nv, m1, u)),
    )


@jitted
def add_rotated(h, sizes, w):
    """Add what R(h u) makes of the mean momenta of all that turns to `w.right`."""
    u = w.vectors[MEAN]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        before = mean_momentum(j, sizes[at.NV], w)
        after = chart_rate(h * u[j], h * u[j + 1], h * u[j + 2], before[0], before[1], before[2])
        for axis in range(3):
            w.right[j + axis, 0] += after[axis] - before[axis]


@jitted
def rotation_newton(h, sizes, w):
    """Make `w.matrix`, with its borders, that of a step that turns: R(θ) p is p + θ×p/2 but for terms of h²."""
    nv, u = sizes[at.NV], w.vectors[MEAN]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        x, y, z = 0.5 * h * u[j], 0.5 * h * u[j + 1], 0.5 * h * u[j + 2]
        for i in range(nv):
            m = (mean_mass(j, i, nv, w), mean_mass(j + 1, i, nv, w), mean_mass(j + 2, i, nv, w))
            w.matrix[j, i] += y * m[2] - z * m[1]
            w.matrix[j + 1, i] += z * m[0] - x * m[2]
            w.matrix[j + 2, i] += x * m[1] - y * m[0]
        p = mean_momentum(j, nv, w)
        for axis in range(3):
            after, last = (axis + 1) % 3, (axis + 2) % 3
            w.matrix[j + axis, j + after] += 0.5 * h * p[last]
            w.matrix[j + axis, j + last] -= 0.5 * h * p[after]
        for r in range(nv, nv + sizes[at.NM]):
            # A row times the matrix of `chart_variation`: its transpose, which is that of the opposite turn.
            row = w.matrix[r]
            turned = chart_variation(-h * u[j], -h * u[j + 1], -h * u[j + 2], row[j], row[j + 1], row[j + 2])
            row[j], row[j + 1], row[j + 2] = turned


@jitted
def mean_mass(i, j, nv, w):
    """Return an entry of (M0 + M1)/2."""
    return 0.5 * (w.masses[START, i * nv + j] + w.masses[END, i * nv + j])
