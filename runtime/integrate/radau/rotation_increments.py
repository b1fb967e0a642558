"""Quaternions in the stages of the Radau methods: rotation vectors from the start of the step, solved for."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import (
    chart_rate,
    n_quaternions,
    quaternion_at,
    rotate,
    solve_rotation,
)
from symgen.runtime.integrate.radau.transform import add_correction, set_defect, shift_of, transform_stages
from symgen.runtime.integrate.radau.work import DX, SCALE, STAGES


@jitted
def place(sizes, y, increments, out):
    """Write the state that is `increments` away from `y`: rotation vectors turn quaternions, the rest is added."""
    for i in range(sizes[at.NY]):
        out[i] = y[i] + increments[i]
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotate(y, i, increments[i], increments[i + 1], increments[i + 2], out)


@jitted
def rotations_to_increments(sizes, y, increments):
    """Replace rotation vectors by the increments of the quaternions that they turn."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotate(y, i, increments[i], increments[i + 1], increments[i + 2], increments)
        for j in range(i, i + 4):
            increments[j] -= y[j]


@jitted
def error_between_places(n_places, sizes, w):
    """Return by how much dense output through so many places is off quaternions, in units of their tolerance.

    While a body spins evenly, rotation vectors are straight lines, however far it turns in a step; but its quaternion
    is cos and sin of half the angle φ. A polynomial through n places is off these by up to 2 (φ/8)^n / n! (those of
    Chebyshev, for which this holds, are the best).
    """
    z, largest = w.states[STAGES + w.rotation_rates.shape[0] - 1], 0.0
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        part = 0.125 * math.sqrt(z[i] * z[i] + z[i + 1] * z[i + 1] + z[i + 2] * z[i + 2])
        error = 2.0
        for j in range(n_places):
            error *= part / (j + 1.0)
        largest = max(largest, error / w.pairs[SCALE, i - k])
    return largest


@jitted
def set_rotation_rates(method, i, first, y, w):
    """Write the derivatives of the stages' rotation vectors, at `i`; the angular velocity is at `first`."""
    for s in range(len(method.c)):
        z = w.states[STAGES + s]
        u, v, w_ = y[first] + z[first], y[first + 1] + z[first + 1], y[first + 2] + z[first + 2]
        w.rotation_rates[s, 0], w.rotation_rates[s, 1], w.rotation_rates[s, 2] = chart_rate(
            z[i], z[i + 1], z[i + 2], u, v, w_
        )


@jitted
def predict_rotations(method, h, i, column, first, y, w):
    """Guess the stages' rotation vectors at `i` from their angular velocities, by sweeps of their equations."""
    n = len(method.c)
    for s in range(n):
        for j in range(i, i + 3):
            w.states[STAGES + s, j] = 0.0
    for _ in range(n):  # each sweep gains one order of h
        set_rotation_rates(method, i, first, y, w)
        for s in range(n):
            for axis in range(3):
                total = 0.0
                for j in range(n):
                    total += method.a[s, j] * w.rotation_rates[j, axis]
                w.states[STAGES + s, i + axis] = h * total
    for axis in range(3):
        transform_stages(method, i + axis, column + axis, w)


@jitted
def factor_rotations(g, j, y, first, jacobian, matrix):
    """Make the columns from `j` on, of the rates of a quaternion, which are in `y` from `first`."""
    a, b, c = -y[first], -y[first + 1], -y[first + 2]
    for i in range(matrix.shape[0]):
        u, v, w = jacobian[i, j], jacobian[i, j + 1], jacobian[i, j + 2]
        # A row times the inverse of a matrix: the inverse of its transpose, which turns the other way.
        x, y_, z = solve_rotation(g, a, b, c, u, v, w)
        matrix[i, j] += u / g - x
        matrix[i, j + 1] += v / g - y_
        matrix[i, j + 2] += w / g - z


@jitted
def set_rotation_defect(method, per_h, i, column, first, y, w):
    """Set the transformed defects of a quaternion's rotation vector, solved for it."""
    set_rotation_rates(method, i, first, y, w)
    for axis in range(3):
        set_defect(method, per_h, w.rotation_rates, 0, axis, column + axis, w)
    solve_rotations(method.mu * per_h, column, first, y, w.real_vectors[DX])
    n_pairs = len(method.c) // 2
    for k in range(n_pairs):
        solve_rotations(shift_of(method, k, per_h), column, first, y, w.complex_vectors[n_pairs + k])


@jitted
def solve_rotations(g, i, first, y, vector):
    """Multiply the three entries of `vector` from `i` on by (g - K)⁻¹, see `solve_rotation`."""
    vector[i], vector[i + 1], vector[i + 2] = solve_rotation(
        g, y[first], y[first + 1], y[first + 2], vector[i], vector[i + 1], vector[i + 2]
    )


@jitted
def add_rotation(g, column, j, first, y, vector):
    """Add (g - K)⁻¹ times the three entries of `vector` from `j` on to those from `column` on."""
    x, y_, z = solve_rotation(
        g, y[first], y[first + 1], y[first + 2], vector[j], vector[j + 1], vector[j + 2]
    )
    vector[column] += x
    vector[column + 1] += y_
    vector[column + 2] += z


@jitted
def correct_rotations(method, per_h, sizes, column, first, y, w):
    """Correct a quaternion's transformed rotation vectors after the rates; returns the squares, in tolerances."""
    j, n_pairs = sizes[at.NV] + column, len(method.c) // 2
    add_rotation(method.mu * per_h, column, j, first, y, w.real_vectors[DX])
    for k in range(n_pairs):
        add_rotation(shift_of(method, k, per_h), column, j, first, y, w.complex_vectors[n_pairs + k])
    total = 0.0
    for i in range(column, column + 3):
        total += add_correction(method, i, w) / w.pairs[SCALE, i] ** 2
    return total
