"""The stabilised index-2 equations of Gear, Gupta and Leimkuhler for the Radau methods: systems of v and λ."""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.ggl import (
    blocks_size,
    divide_blocks,
    equation_residuals,
    equations_size,
    half_rotated,
    recover,
    set_blocks,
    set_shifted,
    solve_shifted,
)
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.nested_basis import N_ROWS, fit_rows, values
from symgen.runtime.integrate.quaternions import chart_rate, n_quaternions, quaternion_at, rotate, rotated
from symgen.runtime.integrate.radau.coefficients import RadauIIA, radau
from symgen.runtime.integrate.radau.coupled import never_coupled
from symgen.runtime.integrate.radau.error import norm_of_error, weighted
from symgen.runtime.integrate.radau.newton import Equations, keep_rate_of_full
from symgen.runtime.integrate.radau.stages import (
    evaluate_stage,
    integrate_work,
    place,
    place_end,
    predict_rates,
    radau_dense,
)
from symgen.runtime.integrate.radau.work import (
    ERROR,
    F_NEW,
    F_STAGES,
    HAVE_JACOBIAN,
    N_NUMBERS,
    SCALE,
    STAGES,
    Y_NEW,
    Y_STAGE,
    shift_of,
)

# Besides `RadauIIA`: the inverse of its Butcher matrix; where between its ends a step is sampled for dense output, the
# weights of the stages there, and the matrix from samples to rows of dense output.
RadauGgl = namedtuple("RadauGgl", (*RadauIIA._fields, "places", "at_places", "fit"))


def radau_ggl(n_stages: int) -> RadauGgl:
    """Return a Radau IIA method with what index-2 equations need."""
    method = radau(n_stages)
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, N_ROWS - 1) / (N_ROWS - 1))
    conditions = [(0, place) for place in places]
    at_places = values(conditions, n_stages + 1)[:, 2:] @ method.rows
    at_places[:, -1] += places
    return RadauGgl(*method, places, at_places, np.ascontiguousarray(fit_rows(conditions)))


class GglWork(NamedTuple):
    """Work arrays of a Radau method with s = 2 k + 1 stages; those not described here are as in `RadauWork`.

    Attributes
    ----------
    numbers, states, rows, pairs, implicit, scratch : ndarray
    blocks : ndarray
        See `ggl.divide_blocks`.
    real, complex : ndarray, shapes (nv + m, nv + m), (k, nv + m, nv + m)
        Factors of `ggl.set_shifted`'s matrix for μ/h and for every ν/h.
    pivots : ndarray of int64, shape (k + 1, nv + m)
    multipliers : ndarray, shape (s, m + nh)
        λ and μ of every stage.
    residuals : ndarray, shape (s, nv + m + nh)
        Those of the stages, then their corrections.
    real_vector, complex_vectors : ndarray, shapes (nv + m + nh), (k, nv + m + nh)
        The same, transformed.
    steered : ndarray, shape (s, nv)
        The stages' rates less those of the start, with what μ adds; or what corrections add to these.
    rotation_rates : ndarray, shape (s, 3)
        Derivatives of the stages' rotation vectors, or increments of their angular velocities.
    rotation_polynomials, samples : ndarray, shapes (s, 3 r), (6, 7 r) for r quaternions
        See `ggl_dense_output`.
    arguments, equations : ndarray, shapes (nq + 2 nv + m), (nv + m)
        What the kernel `residual` reads and writes; `equations` is also what `constraint_residual` writes.
    """

    numbers: np.ndarray
    blocks: np.ndarray
    real: np.ndarray
    complex: np.ndarray
    pivots: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    pairs: np.ndarray
    multipliers: np.ndarray
    residuals: np.ndarray
    real_vector: np.ndarray
    complex_vectors: np.ndarray
    steered: np.ndarray
    rotation_rates: np.ndarray
    rotation_polynomials: np.ndarray
    samples: np.ndarray
    arguments: np.ndarray
    equations: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def ggl_work_size(method, sizes):
    """Length of `work` for `advance_radau_ggl`."""
    s, k = len(method.c), len(method.c) // 2
    nv, ny, n_row, m = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW], sizes[at.NM]
    n, n_all, r = nv + m, nv + m + sizes[at.NH], n_quaternions(sizes)
    own = N_NUMBERS + blocks_size(sizes) + (1 + 2 * k) * n * n + (k + 1) * n + (s + 2) * ny + (s + 1) * n_row
    own += (
        4 * nv + s * (n_all - nv) + s * n_all + (1 + 2 * k) * n_all + s * nv + 3 * s + sizes[at.NQ] + nv + n
    )
    own += 3 * s * r + 7 * (N_ROWS - 2) * r
    return own + equations_size(sizes) + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def ggl_work(method, sizes, work):
    """Divide `work`, of length `ggl_work_size(method, sizes)`, into a `GglWork`."""
    s, k = len(method.c), len(method.c) // 2
    nv, ny, n_row, m = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW], sizes[at.NM]
    n, n_all, r = nv + m, nv + m + sizes[at.NH], n_quaternions(sizes)
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    size = blocks_size(sizes)
    blocks, rest = rest[:size], rest[size:]
    real, rest = rest[: n * n].reshape((n, n)), rest[n * n :]
    size = 2 * k * n * n
    complex_, rest = rest[:size].view(np.complex128).reshape((k, n, n)), rest[size:]
    size = (k + 1) * n
    pivots, rest = rest[:size].view(np.int64).reshape((k + 1, n)), rest[size:]
    size = (s + 2) * ny
    states, rest = rest[:size].reshape((s + 2, ny)), rest[size:]
    size = (s + 1) * n_row
    rows, rest = rest[:size].reshape((s + 1, n_row)), rest[size:]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    size = s * (n_all - nv)
    multipliers, rest = rest[:size].reshape((s, n_all - nv)), rest[size:]
    residuals, rest = rest[: s * n_all].reshape((s, n_all)), rest[s * n_all :]
    real_vector, rest = rest[:n_all], rest[n_all:]
    size = 2 * k * n_all
    complex_vectors, rest = rest[:size].view(np.complex128).reshape((k, n_all)), rest[size:]
    steered, rest = rest[: s * nv].reshape((s, nv)), rest[s * nv :]
    rotation_rates, rest = rest[: 3 * s].reshape((s, 3)), rest[3 * s :]
    size = 3 * s * r
    rotation_polynomials, rest = rest[:size].reshape((s, 3 * r)), rest[size:]
    size = 7 * (N_ROWS - 2) * r
    samples, rest = rest[:size].reshape((N_ROWS - 2, 7 * r)), rest[size:]
    size = sizes[at.NQ] + nv + n
    arguments, rest = rest[:size], rest[size:]
    size = equations_size(sizes)
    equations, rest = rest[:size], rest[size:]
    size = jacobian_work_size(sizes)
    return GglWork(
        numbers, blocks, real, complex_, pivots, states, rows, pairs, multipliers, residuals, real_vector,
        complex_vectors, steered, rotation_rates, rotation_polynomials, samples, arguments, equations,
        rest[:size], rest[size:],
    )  # fmt: skip


# Angular velocities are collocated in the axes that the body has at the start of the step, which are fixed in space:
# u = R(θ) ω, of which θ' = u - ½ θ×u + … and ω' = R(θ)ᵀ u'. Constraints act at points that hardly move there while a
# body spins, and so do the gyroscopic forces of a rotor; in its own axes, the gradients G of a constraint turn with it,
# and Newton's matrices, which hold G, would serve for a few hundredths of a turn.

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


# The polynomials that are collocated are rotation vectors and angular velocities in the axes of the start of the step.
# While a body spins they hardly bend, but its quaternion and its rates in body axes swing. So dense output samples
# these at more places than there are stages, and the stages of the next step are guessed from the former.
#
# Loops run over `w.rotation_rates.shape[0]` stages, not over `len(method.c)`, which compilers would unroll for nothing.


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


@jitted
def differentiate_index2(method, loop, t, w):
    """Take the derivatives of the equations, those by rates in the axes of the start of the step; returns a status."""
    b = divide_blocks(loop.sizes, w.blocks)
    status = set_blocks(loop, t, loop.y, loop.f, w.implicit, b)
    if status == at.RUNNING:
        rotate_blocks(loop.sizes, loop.y, loop.f, b)
    return status


@jitted
def factor_index2(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status."""
    b = divide_blocks(loop.sizes, w.blocks)
    set_shifted(method.mu / h, loop.sizes[at.NH], b, w.real)
    status = lu_factor(w.real, w.pivots[0])
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            set_shifted(shift_of(method, k, 1.0 / h), loop.sizes[at.NH], b, w.complex[k])
            status = lu_factor(w.complex[k], w.pivots[k + 1])
    return status


@jitted
def predict_index2(method, h, extrapolate, loop, t0, w):
    """Start Newton as `predict_stages` does, with the multipliers that the accelerations of that motion take.

    Those of the start of the step would do for convergence, but their first correction would dwarf that of the rates,
    which says nothing of the rate of contraction then.

    Returns
    -------
    bool
        Whether all is finite.
    """
    first = loop.sizes[at.NQ] + loop.sizes[at.NV] + loop.sizes[at.NW]
    predict_rates(method, h, extrapolate, loop, w)
    predict_rotations_index2(method, h, extrapolate, loop, w)
    for s in range(len(method.c)):
        for k in range(loop.sizes[at.NM], loop.sizes[at.NM] + loop.sizes[at.NH]):
            w.multipliers[s, k] = 0.0
    reset_rotations(method, loop.sizes, w)
    if not retract_index2(method, h, loop.sizes, loop.y, w):
        return False
    to_body_axes(loop.sizes, loop.y, w)
    for s in range(len(method.c)):
        if not evaluate_stage(s, method, h, loop, t0, w):
            return False
        for k in range(loop.sizes[at.NM]):
            w.multipliers[s, k] = w.rows[F_STAGES + s, first + k]
    to_start_axes(loop.sizes, loop.y, w)
    return True


@jitted
def retract_index2(method, h, sizes, y, w):
    """Set the stages' increments of q to the integral of v + C μ; returns whether quaternions could be turned by it."""
    nq, n = sizes[at.NQ], len(method.c)
    b = divide_blocks(sizes, w.blocks)
    for s in range(n):
        steer(b, w.states[STAGES + s, nq:], w.multipliers[s, sizes[at.NM] :], w.steered[s])
    settled, start = True, 0
    if nq == sizes[at.NV]:  # loops from 0 need no checks of their indexes
        for i in range(nq):
            travel_index2(method, h, i, i, nq, y, w)
        return True
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            travel_index2(method, h, i, i - k, nq, y, w)
        if end < nq:
            settled = solve_rotations_index2(method, h, end, end - k, sizes, y, w) and settled
        start = end + 4
    return settled


@jitted
def travel_index2(method, h, i, j, nq, y, w):
    """Set the stages' increments of coordinate `i` to the integral of its rate `j`."""
    n = len(method.c)
    for s in range(n):
        total = method.c[s] * y[nq + j]
        for r in range(n):
            total += method.a[s, r] * w.steered[r, j]
        w.states[STAGES + s, i] = h * total


@jitted
def steer(b, rates, multipliers, out):
    """Write `rates` + C `multipliers` to `out`."""
    for i in range(out.shape[0]):
        total = rates[i]
        for k in range(b.steer.shape[1]):
            total += b.steer[i, k] * multipliers[k]
        out[i] = total


@jitted
def improve_index2(method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances."""
    for s in range(len(method.c)):
        stage_residuals(s, method, h, loop, t, w)
    correct_residuals(method, h, loop.sizes, w)
    size = correct_index2(method, h, loop.sizes, w)
    if not math.isfinite(size):
        return at.NOT_FINITE, size
    if not retract_index2(method, h, loop.sizes, loop.y, w):
        return at.NEWTON_FAILED, size
    return at.RUNNING, size


@jitted
def stage_residuals(s, method, h, loop, t0, w):
    """Write the residuals of stage `s`, with the accelerations that the stages' rates say."""
    nq, nv, stage = loop.sizes[at.NQ], loop.sizes[at.NV], w.states[STAGES + s]
    place(loop.sizes, loop.y, stage, w.states[Y_STAGE])
    for i in range(nv):
        total = 0.0
        for r in range(len(method.c)):
            total += method.inverse[s, r] * w.states[STAGES + r, nq + i]
        w.arguments[nq + nv + i] = total / h
    for k in range(loop.sizes[at.NM]):
        w.arguments[nq + 2 * nv + k] = w.multipliers[s, k]
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        rotate_entries(-1.0, stage, i, w.states[Y_STAGE], nq + i - k)
        rotate_entries(-1.0, stage, i, w.arguments, nq + nv + i - k)
    t = t0 + method.c[s] * h
    equation_residuals(loop, t, w.states[Y_STAGE], w.arguments, w.equations, w.residuals[s])
    for k in range(n_quaternions(loop.sizes)):
        i = quaternion_at(loop.sizes, k)
        rotate_entries(1.0, stage, i, w.residuals[s], i - k)


@jitted
def correct_residuals(method, h, sizes, w):
    """Replace the residuals of the stages by corrections of their rates and multipliers."""
    n = len(method.c)
    b = divide_blocks(sizes, w.blocks)
    forth, back = method.from_stages, method.to_stages
    for i in range(w.residuals.shape[1]):
        total = 0.0
        for s in range(n):
            total += forth[0, s] * w.residuals[s, i]
        w.real_vector[i] = total
        for k in range(n // 2):
            real, imag = 0.0, 0.0
            for s in range(n):
                real += forth[2 * k + 1, s] * w.residuals[s, i]
                imag += forth[2 * k + 2, s] * w.residuals[s, i]
            w.complex_vectors[k, i] = complex(real, imag)
    solve_shifted(method.mu / h, sizes, b, w.real, w.pivots[0], w.real_vector)
    for k in range(n // 2):
        g = shift_of(method, k, 1.0 / h)
        solve_shifted(g, sizes, b, w.complex[k], w.pivots[k + 1], w.complex_vectors[k])
    for i in range(w.residuals.shape[1]):
        for s in range(n):
            total = back[s, 0] * w.real_vector[i]
            for k in range(n // 2):
                x = w.complex_vectors[k, i]
                total += back[s, 2 * k + 1] * x.real + back[s, 2 * k + 2] * x.imag
            w.residuals[s, i] = total


@jitted
def correct_index2(method, h, sizes, w):
    """Add the corrections; returns the size of those of positions and rates in tolerances.

    Multipliers have no part in it: they follow from the rates, and what is left of them is gone in the next iteration.
    """
    nq, nv, n = sizes[at.NQ], sizes[at.NV], len(method.c)
    b = divide_blocks(sizes, w.blocks)
    total = 0.0
    for s in range(n):
        change = w.residuals[s]
        for k in range(sizes[at.NM] + sizes[at.NH]):
            w.multipliers[s, k] += change[nv + k]
        for i in range(nv):
            w.states[STAGES + s, nq + i] += change[i]
            total += (change[i] / w.pairs[SCALE, nv + i]) ** 2
        steer(b, change, change[nv + sizes[at.NM] :], w.steered[s])
    for i in range(nv):
        for s in range(n):
            moved = 0.0
            for r in range(n):
                moved += method.a[s, r] * w.steered[r, i]
            total += (h * moved / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / (2 * nv * n))


@jitted
def filter_index2(method, h, loop, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]` and return its norm.

    The estimate is that of all Radau methods, filtered by the Newton matrix with its constraints, as radau5.f does for
    implicit systems: so it satisfies them. λ and μ, whose index is 2, have no part in it: multipliers of results come
    from positions and rates.
    With s₁, s₂ the defects of positions and rates, which take the place of 0 and -r₂ in the module `ggl`:
    Δv = Δu - C Δμ - s₁ and Δμ = H Δu / g - G s₁.
    """
    sizes = loop.sizes
    nq, nv, m, nh = sizes[at.NQ], sizes[at.NV], sizes[at.NM], sizes[at.NH]
    b = divide_blocks(sizes, w.blocks)
    g = method.mu / h
    x = w.real_vector
    slip, pushed = w.residuals[0], w.residuals[1]
    for i in range(nv):
        # v0 + eᵀZ_q / h, in which v0 cancels.
        total = w.pairs[ERROR, nv + i] if again else 0.0
        for s in range(len(method.c)):
            rate = w.states[STAGES + s, nq + i]
            for k in range(nh):
                rate += b.steer[i, k] * w.multipliers[s, m + k]
            total += method.error_a[s] * rate
        slip[i] = total
        pushed[i] = row[nq + i] + weighted(method, method.error, nq + i, w) / h
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        slip_of_rotation(method, h, k, loop, again, slip, w)
        along = half_rotated(i - k, b.spin, slip)
        for axis in range(3):
            pushed[i - k + axis] -= along[axis]  # by_rates has M W in it
    for k in range(m):
        total = 0.0
        for j in range(nv):
            total += b.gradients[k, j] * slip[j]
        x[nv + k] = 0.0 if k < nh else total
        if k < nh:
            x[nv + m + k] = -total
    for i in range(nv):
        total = 0.0
        for j in range(nv):
            total += b.mass[i, j] * (pushed[j] + g * slip[j]) + b.by_rates[i, j] * slip[j]
        for k in range(nh):
            total += b.damped[i, k] * x[nv + m + k]
        x[i] = total
    lu_solve(w.real, w.pivots[0], x[: nv + m])
    for i in range(nv):
        w.pairs[ERROR, i] = x[i] / g
    recover(g, sizes, b, x)
    for i in range(nv):
        w.pairs[ERROR, nv + i] = x[i] - slip[i]
    return norm_of_error(w)


@jitted
def rotate_all(sense, sizes, error, x):
    """Turn angular velocities of a state, or their derivatives in an rhs row, by `sense` times errors of rotation."""
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        rotate_entries(sense, error, j, x, sizes[at.NQ] + j)


@jitted
def slip_of_rotation(method, h, k, loop, again, slip, w):
    """Write the defect of the rotation vector of quaternion `k` to its place in `slip`."""
    sizes, y, error = loop.sizes, loop.y, w.pairs[ERROR]
    i = quaternion_at(sizes, k)
    column = i - k
    first, j = sizes[at.NQ] + column, sizes[at.NV] + column
    x, y_, z = y[first], y[first + 1], y[first + 2]
    if again:
        u, v, w_ = x + error[j], y_ + error[j + 1], z + error[j + 2]
        x, y_, z = chart_rate(-error[column], -error[column + 1], -error[column + 2], u, v, w_)
    slip[column] = x + weighted(method, method.error, i, w) / h
    slip[column + 1] = y_ + weighted(method, method.error, i + 1, w) / h
    slip[column + 2] = z + weighted(method, method.error, i + 2, w) / h


@jitted
def n_places_index2(method, loop):
    """Return how many places dense output of quaternions goes through, see `sample_rotations`."""
    return loop.dense.shape[0]


@jitted
def reach_end_index2(method, h, loop, t, t1, w):
    """Write the new state, on the constraints, and its rhs row; returns why not, or RUNNING."""
    to_body_axes(loop.sizes, loop.y, w)
    if not integrate_work(method, h, loop, t, w):
        return at.NOT_FINITE
    status = place_end(method, loop, t1, w)
    if status == at.RUNNING:
        ratio = w.rows[F_NEW, loop.sizes[at.N_ROW] - 1]
        loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], ratio)
    return status


@jitted
def commit_index2(method, loop, t, t1, w):
    """Make the new state the current one, with dense output, and record the step."""
    if largest_rotation(loop.sizes, w) > KEEP_ROTATION:
        loop.counters[HAVE_JACOBIAN] = 0
    keep_rotation_polynomials(method, loop.sizes, loop.y, w)
    n_terms, rotated_is_read = len(method.c) + 1, False
    if loop.sizes[at.NQ] > loop.sizes[at.NV] and needs_dense(loop, t1):
        n_terms, rotated_is_read = loop.dense.shape[0], True
        sample_rotations(method, loop.sizes, loop.y, w)
    radau_dense(method, loop.sizes, loop.y, w, loop.dense)
    if rotated_is_read:
        fit_rotations(method, loop.sizes, w, loop.dense)
    copy(w.states[Y_NEW], loop.y)
    copy(w.rows[F_NEW], loop.f)
    return finish_step(loop, t, t1, loop.dense, n_terms, w.scratch)


INDEX2 = Equations(
    differentiate_index2, factor_index2, predict_index2, improve_index2, filter_index2, rotate_all, never_coupled,
    keep_rate_of_full, n_places_index2, reach_end_index2, commit_index2,
)  # fmt: skip
