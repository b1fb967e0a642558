"""The motion of bodies that turn over a step of a Radau method for index-2 equations: dense output, the next guess.

The polynomials that are collocated are rotation vectors and angular velocities in the axes of the start of the step.
While a body spins they hardly bend, but its quaternion and its rates in body axes swing. So dense output samples these
at more places than there are stages, and the stages of the next step are guessed from the former.

Loops run over `w.rotation_rates.shape[0]` stages, not over `len(method.c)`, which compilers would unroll for nothing.
"""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, rotate, rotated
from symgen.runtime.integrate.radau.work import STAGES, Y_STAGE


@jitted
def keep_rotation_polynomials(method, sizes, y, w):
    """Keep the polynomials of angular velocities, in body axes of the end of the step, for the next one."""
    n, nq = w.rotation_rates.shape[0], sizes[at.NQ]
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        z = w.states[STAGES + n - 1]
        increments_of_rotations(method, i, nq + i - k, y, w)
        for r in range(n):
            a, b, c = w.rotation_rates[n - 1, 0], w.rotation_rates[n - 1, 1], w.rotation_rates[n - 1, 2]
            if r > 0:
                a, b, c = weighted_rotations(method.rows[r - 1], w)
            row, j = w.rotation_polynomials[r], 3 * k
            row[j], row[j + 1], row[j + 2] = rotated(-z[i], -z[i + 1], -z[i + 2], a, b, c)


@jitted
def increments_of_rotations(method, i, first, y, w):
    """Write the stages' increments of the angular velocity at `first`, in axes of the start, to `w.rotation_rates`."""
    a, b, c = y[first], y[first + 1], y[first + 2]
    for s in range(w.rotation_rates.shape[0]):
        z, turn = w.states[STAGES + s], w.rotation_rates[s]
        x, y_, z_ = a + z[first], b + z[first + 1], c + z[first + 2]
        x, y_, z_ = rotated(z[i], z[i + 1], z[i + 2], x, y_, z_)
        turn[0], turn[1], turn[2] = x - a, y_ - b, z_ - c


@jitted
def weighted_rotations(weights, w):
    """Return the sum of `w.rotation_rates`, each times its weight."""
    a, b, c = 0.0, 0.0, 0.0
    for s in range(w.rotation_rates.shape[0]):
        a += weights[s] * w.rotation_rates[s, 0]
        b += weights[s] * w.rotation_rates[s, 1]
        c += weights[s] * w.rotation_rates[s, 2]
    return a, b, c


@jitted
def predict_rotations_index2(method, h, extrapolate, loop, w):
    """Set the stages' increments of angular velocities to those of the last step's polynomial, or to zero."""
    n, nq = w.rotation_rates.shape[0], loop.sizes[at.NQ]
    for k in range(n_quaternions(loop.sizes)):
        for axis in range(3):
            column, i = 3 * k + axis, nq + quaternion_at(loop.sizes, k) - k + axis
            for s in range(n):
                w.states[STAGES + s, i] = 0.0
                if extrapolate:
                    theta = 1.0 + method.c[s] * h / loop.control[at.H_LAST]
                    bend = w.rotation_polynomials[n - 1, column]
                    for j in range(n - 2, 0, -1):
                        bend = (
                            bend * (1.0 - theta if j % 2 == 0 else theta) + w.rotation_polynomials[j, column]
                        )
                    w.states[STAGES + s, i] = (theta - 1.0) * (
                        w.rotation_polynomials[0, column] - theta * bend
                    )


@jitted
def sample_rotations(method, sizes, y, w):
    """Write how far quaternions and their rates are from the chord between the ends of the step to `w.samples`."""
    nq, n_places = sizes[at.NQ], method.places.shape[0]
    end, there = w.states[STAGES + w.rotation_rates.shape[0] - 1], w.states[Y_STAGE]
    for k in range(n_quaternions(sizes)):
        i, j = quaternion_at(sizes, k), 7 * k
        first = nq + i - k
        increments_of_rotations(method, i, first, y, w)
        for m in range(n_places):
            sample_rotation(method, m, i, first, y, there, w)
            for entry in range(4):
                w.samples[m, j + entry] = there[i + entry] - y[i + entry]
            for axis in range(3):
                w.samples[m, j + 4 + axis] = there[first + axis] - y[first + axis]
        rotate(y, i, end[i], end[i + 1], end[i + 2], there)
        for m in range(n_places):
            for entry in range(4):
                w.samples[m, j + entry] -= method.places[m] * (there[i + entry] - y[i + entry])
            for axis in range(3):
                w.samples[m, j + 4 + axis] -= method.places[m] * end[first + axis]


@jitted
def sample_rotation(method, m, i, first, y, out, w):
    """Write the quaternion at `i` and its rates, at `first`, at one place in the step."""
    a, b, c = 0.0, 0.0, 0.0
    for s in range(w.rotation_rates.shape[0]):
        weight, z = method.at_places[m, s], w.states[STAGES + s]
        a, b, c = a + weight * z[i], b + weight * z[i + 1], c + weight * z[i + 2]
    u, v, x = weighted_rotations(method.at_places[m], w)
    u, v, x = u + y[first], v + y[first + 1], x + y[first + 2]
    rotate(y, i, a, b, c, out)
    out[first], out[first + 1], out[first + 2] = rotated(-a, -b, -c, u, v, x)


@jitted
def fit_rotations(method, sizes, w, dense):
    """Replace the rows of `dense` for quaternions and their rates, from the third on, by those through the samples."""
    for r in range(w.rotation_rates.shape[0] + 1, dense.shape[0]):
        for i in range(dense.shape[1]):
            dense[r, i] = 0.0
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        for entry in range(7):
            place = i + entry if entry < 4 else sizes[at.NQ] + i - k + entry - 4
            for r in range(method.fit.shape[0]):
                total = 0.0
                for m in range(method.fit.shape[1]):
                    total += method.fit[r, m] * w.samples[m, 7 * k + entry]
                dense[2 + r, place] = total
