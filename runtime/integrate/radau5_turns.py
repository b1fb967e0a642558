"""Quaternions in the stages of radau5: rotation vectors from the start of the step, solved for with the rates."""

from runtime.code.jitted import jitted
from runtime.integrate.layout import NV, NY
from runtime.integrate.quaternions import chart_rate, n_quaternions, quaternion_at, rotate, solve_turning
from runtime.integrate.radau5_transform import add_correction, set_defect, transform_stages
from runtime.integrate.radau5_work import DX, SCALE

SWEEPS = 3  # of the guess; each gains one order of h


@jitted
def place(sizes, y, increments, out):
    """Write the state that is `increments` away from `y`: rotation vectors turn quaternions, the rest is added."""
    for i in range(sizes[NY]):
        out[i] = y[i] + increments[i]
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotate(y, i, increments[i], increments[i + 1], increments[i + 2], out)


@jitted
def turns_to_increments(sizes, y, increments):
    """Replace rotation vectors by the increments of the quaternions that they turn."""
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        rotate(y, i, increments[i], increments[i + 1], increments[i + 2], increments)
        for j in range(i, i + 4):
            increments[j] -= y[j]


@jitted
def turn_rate(s, i, first, y, stages):
    """Return the derivative of stage `s`'s rotation vector, at `i`; the angular velocity is at `first`."""
    z = stages[s]
    u, v, w = y[first] + z[first], y[first + 1] + z[first + 1], y[first + 2] + z[first + 2]
    return chart_rate(z[i], z[i + 1], z[i + 2], u, v, w)


@jitted
def predict_turns(method, h, i, column, first, y, w):
    """Guess the stages' rotation vectors at `i` from their angular velocities, by sweeps of their equations."""
    for s in range(3):
        for j in range(i, i + 3):
            w.states[s, j] = 0.0
    for _ in range(SWEEPS):
        f0 = turn_rate(0, i, first, y, w.states)
        f1 = turn_rate(1, i, first, y, w.states)
        f2 = turn_rate(2, i, first, y, w.states)
        for s in range(3):
            a0, a1, a2 = h * method.a[s, 0], h * method.a[s, 1], h * method.a[s, 2]
            for axis in range(3):
                w.states[s, i + axis] = a0 * f0[axis] + a1 * f1[axis] + a2 * f2[axis]
    for axis in range(3):
        transform_stages(method, i + axis, column + axis, w)


@jitted
def factor_turns(g, j, y, first, jacobian, matrix):
    """Make the columns from `j` on, of the rates of a quaternion, which are in `y` from `first`."""
    a, b, c = -y[first], -y[first + 1], -y[first + 2]
    for i in range(matrix.shape[0]):
        u, v, w = jacobian[i, j], jacobian[i, j + 1], jacobian[i, j + 2]
        # A row times the inverse of a matrix: the inverse of its transpose, which turns the other way.
        x, y_, z = solve_turning(g, a, b, c, u, v, w)
        matrix[i, j] += u / g - x
        matrix[i, j + 1] += v / g - y_
        matrix[i, j + 2] += w / g - z


@jitted
def turning_defect(method, g, g_complex, sizes, i, column, first, y, w):
    """Set the transformed defects of a quaternion's rotation vector, solved for it, and what they add to the rates'.

    The defects of the rates must have been set. With J = [K I; A B], (g - J) (Δθ, Δv) = (r, s) becomes
    Δθ = (g - K)⁻¹ (Δv + r) and (g - B - A (g - K)⁻¹) Δv = s + A (g - K)⁻¹ r.
    """
    f0 = turn_rate(0, i, first, y, w.states)
    f1 = turn_rate(1, i, first, y, w.states)
    f2 = turn_rate(2, i, first, y, w.states)
    for axis in range(3):
        set_defect(method, g, g_complex, f0[axis], f1[axis], f2[axis], column + axis, w)
    solve_turns(g, column, first, y, w.real_vectors[DX])
    solve_turns(g_complex, column, first, y, w.complex_vectors[DX])
    nv = sizes[NV]
    for j in range(nv):
        for axis in range(3):
            by_turn = w.jacobian[j, column + axis]
            w.real_vectors[DX, nv + j] += by_turn * w.real_vectors[DX, column + axis]
            w.complex_vectors[DX, nv + j] += by_turn * w.complex_vectors[DX, column + axis]


@jitted
def solve_turns(g, i, first, y, vector):
    """Multiply the three entries of `vector` from `i` on by (g - K)⁻¹, see `solve_turning`."""
    vector[i], vector[i + 1], vector[i + 2] = solve_turning(
        g, y[first], y[first + 1], y[first + 2], vector[i], vector[i + 1], vector[i + 2]
    )


@jitted
def add_turn(g, column, j, first, y, vector):
    """Add (g - K)⁻¹ times the three entries of `vector` from `j` on to those from `column` on."""
    x, y_, z = solve_turning(g, y[first], y[first + 1], y[first + 2], vector[j], vector[j + 1], vector[j + 2])
    vector[column] += x
    vector[column + 1] += y_
    vector[column + 2] += z


@jitted
def correct_turns(g, g_complex, sizes, column, first, y, w):
    """Correct a quaternion's transformed rotation vectors after the rates; returns the squares, in tolerances."""
    j = sizes[NV] + column
    add_turn(g, column, j, first, y, w.real_vectors[DX])
    add_turn(g_complex, column, j, first, y, w.complex_vectors[DX])
    total = 0.0
    for i in range(column, column + 3):
        squared, squared_complex = add_correction(i, w)
        total += (squared + squared_complex) / w.pairs[SCALE, i] ** 2
    return total
