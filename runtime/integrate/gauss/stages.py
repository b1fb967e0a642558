"""The stages of Gauss collocation for q'' = a(t, q, v): start, fixed-point or Newton iteration, when that stops."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import evaluate
from symgen.runtime.integrate.newton import CONVERGED, DIVERGED, ITERATING
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, quaternion_rate, solve_rotation
from symgen.runtime.integrate.step_control import error_scale

# Counters of this family: whether work holds the last step's accelerations, a Jacobian, factors; and whether the
# fixed-point iteration has once failed, so that Newton's is used.
HAVE_HISTORY, HAVE_JACOBIAN, HAVE_FACTORS, STIFF = range(16, 20)

# `numbers` of the work arrays.
FACTORED_FOR, EXTRAPOLATED_FOR, H_HISTORY, SMALLEST, STALLS = range(5)
N_NUMBERS = 5

# Rows of `states` behind those of the stages.
N_STATES = 3
# Where `weights` holds the interpolation for the next step, and for a frame.
NEXT_STEP, FRAME = range(2)


class GaussWork(NamedTuple):
    """Work arrays of `advance_gauss`, with s stages.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    history : ndarray, shape (nv, s)
        Accelerations at the nodes of the last step, of length `numbers[H_HISTORY]`.
    impulses, travels : ndarray, shapes (nv, s), (nq, s)
        h b_j times the acceleration and the derivative of q at node j.
    sums : ndarray, shape (nq, s)
        What these add up to at each node.
    weights : ndarray, shape (2, s, s)
        Values of the interpolation of `history`, in row j at place i.
    states : ndarray, shape (s + 3, NY)
        Arguments of the stages; the new state, what rounding dropped from it, the old state.
    rows : ndarray, shape (s, N_ROW)
    change : ndarray, shape (nv,)
        The largest change of the impulses in an iteration.
    jacobian : ndarray, shape (nv, 2 nv)
    matrices, pivots : ndarray, shapes (k, nv, nv), (k, nv)
        Factors of 1 - h λ ∂a/∂v - h² λ² ∂a/∂q for every eigenvalue.
    complex : ndarray, shape (nv,)
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    numbers: np.ndarray
    history: np.ndarray
    impulses: np.ndarray
    travels: np.ndarray
    sums: np.ndarray
    weights: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    change: np.ndarray
    jacobian: np.ndarray
    matrices: np.ndarray
    pivots: np.ndarray
    complex: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def gauss_work_size(method, sizes):
    """Length of `work` for `advance_gauss`."""
    s, k, nq, nv = method.c.shape[0], method.eigenvalues.shape[0], sizes[at.NQ], sizes[at.NV]
    own = N_NUMBERS + 2 * s * (nq + nv) + 2 * s * s + (s + N_STATES) * sizes[at.NY] + s * sizes[at.N_ROW] + nv
    own += 2 * nv * nv + 2 * k * nv * nv + k * nv + 2 * nv
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def gauss_work(method, sizes, work):
    """Divide `work`, of length `gauss_work_size(method, sizes)`, into a `GaussWork`."""
    s, k, nq, nv = method.c.shape[0], method.eigenvalues.shape[0], sizes[at.NQ], sizes[at.NV]
    ny, n_row = sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    history, rest = rest[: s * nv].reshape((nv, s)), rest[s * nv :]
    impulses, rest = rest[: s * nv].reshape((nv, s)), rest[s * nv :]
    travels, rest = rest[: s * nq].reshape((nq, s)), rest[s * nq :]
    sums, rest = rest[: s * nq].reshape((nq, s)), rest[s * nq :]
    weights, rest = rest[: 2 * s * s].reshape((2, s, s)), rest[2 * s * s :]
    states, rest = rest[: (s + N_STATES) * ny].reshape((s + N_STATES, ny)), rest[(s + N_STATES) * ny :]
    rows, rest = rest[: s * n_row].reshape((s, n_row)), rest[s * n_row :]
    change, rest = rest[:nv], rest[nv:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrices, rest = (
        rest[: 2 * k * nv * nv].view(np.complex128).reshape((k, nv, nv)),
        rest[2 * k * nv * nv :],
    )
    pivots, rest = rest[: k * nv].view(np.int64).reshape((k, nv)), rest[k * nv :]
    vector, rest = rest[: 2 * nv].view(np.complex128), rest[2 * nv :]
    n = jacobian_work_size(sizes)
    return GaussWork(
        numbers, history, impulses, travels, sums, weights, states, rows, change, jacobian, matrices, pivots,
        vector, rest[:n], rest[n:],
    )  # fmt: skip


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


# Gauss methods keep quadratic invariants, so the length of a quaternion that q' = q (0, ω)/2 turns stays what it was
# but for round-off, and the method stays symmetric (Hairer, Lubich, Wanner, Geometric Numerical Integration (2006),
# IV.2).

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


@jitted
def factor_stages(method, h, loop, y, w):
    """Factor the Newton matrix of every eigenvalue, unless that was done for steps of length `h`.

    With g = hλ it is 1 - g ∂a/∂v - g² ∂a/∂q, where a quaternion's g² is g times the inverse of 1/g + ω× / 2.
    """
    if loop.counters[HAVE_FACTORS] and w.numbers[FACTORED_FOR] == h:
        return at.RUNNING
    nv = w.jacobian.shape[0]
    for k in range(method.eigenvalues.shape[0]):
        g = h * method.eigenvalues[k]
        for i in range(nv):
            for j in range(nv):
                w.matrices[k, i, j] = -g * (w.jacobian[i, nv + j] + g * w.jacobian[i, j])
            w.matrices[k, i, i] += 1.0
        for n in range(n_quaternions(loop.sizes)):
            j = quaternion_at(loop.sizes, n) - n
            factor_rotations(g, j, loop.sizes[at.NQ] + j, y, w.jacobian, w.matrices[k])
        status = lu_factor(w.matrices[k], w.pivots[k])
        if status != at.RUNNING:
            return status
    loop.counters[at.FACTORISATIONS] += 1
    loop.counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = h
    return at.RUNNING


@jitted
def factor_rotations(g, j, first, y, jacobian, matrix):
    """Make the columns from `j` on, of the rates of a quaternion, which are in `y` from `first`."""
    a, b, c = -y[first], -y[first + 1], -y[first + 2]
    for i in range(matrix.shape[0]):
        # A row times the inverse of a matrix: the inverse of its transpose, which turns the other way.
        turned = solve_rotation(1.0 / g, a, b, c, jacobian[i, j], jacobian[i, j + 1], jacobian[i, j + 2])
        for axis in range(3):
            matrix[i, j + axis] += g * (g * jacobian[i, j + axis] - turned[axis])


@jitted
def correct_by_newton(method, h, sizes, w):
    """Correct the impulses by simplified Newton in the eigenvectors of a, a system of size nv for each eigenvalue."""
    n, nq, nv = method.c.shape[0], sizes[at.NQ], sizes[at.NV]
    for i in range(nv):
        for s in range(n):
            w.sums[i, s] = 0.0
    for k in range(method.eigenvalues.shape[0]):
        for i in range(nv):
            total = complex(0.0, 0.0)
            for s in range(n):
                defect = w.rows[s, nq + i] - w.impulses[i, s] / (h * method.b[s])
                total += method.from_stages[k, s] * defect
            w.complex[i] = total
        lu_solve(w.matrices[k], w.pivots[k], w.complex)
        for i in range(nv):
            for s in range(n):
                x = method.to_stages[s, k] * w.complex[i]
                w.sums[i, s] += x.real
    for i in range(nv):
        largest = 0.0
        for s in range(n):
            change = h * method.b[s] * w.sums[i, s]
            largest = max(largest, abs(change))
            w.impulses[i, s] += change
        w.change[i] = largest


MAX_ITERATIONS = 50
# Corrections of this size that no longer shrink are round-off for certain; in units of the rates.
ROUND_OFF = 64.0 * float(np.finfo(float).eps)
# Larger ones count as progress below this ratio to the smallest so far. So many without progress (Newton's contract
# fast if at all) end the iteration: it has converged where they are that small in tolerances.
PROGRESS = 0.9
MAX_STALLS, MAX_STALLS_OF_NEWTON = 5, 2
NOISE_TOL = 0.1
DIVERGENCE = 16.0
# Newton that takes more iterations than this wants a new Jacobian for the next step.
KEEP_JACOBIAN_ITERATIONS = 8


@jitted
def interpolation(method, start, stretch, weights):
    """Write the values of the Lagrange polynomials of the nodes at start + stretch c_i, polynomial j in row j."""
    n = method.c.shape[0]
    for i in range(n):
        place = start + stretch * method.c[i]
        for j in range(n):
            value = method.barycentric[j]
            for k in range(n):
                if k != j:
                    value *= place - method.c[k]
            weights[j, i] = value


@jitted
def predict(which, method, h, loop, t, y, w):
    """Guess the impulses: the last step's collocation polynomial goes on, or the acceleration at the start does.

    `which` says which of `w.weights` to use. Returns whether accelerations are finite.
    """
    n, nq, nv = method.c.shape[0], loop.sizes[at.NQ], loop.sizes[at.NV]
    if not loop.counters[HAVE_HISTORY]:
        if not evaluate(loop, t, y, w.rows[0]):
            return False
        for i in range(nv):
            for s in range(n):
                w.impulses[i, s] = h * method.b[s] * w.rows[0, nq + i]
        return True
    for i in range(nv):
        for s in range(n):
            w.impulses[i, s] = 0.0
        for j in range(n):
            acceleration = w.history[i, j]
            for s in range(n):
                w.impulses[i, s] += w.weights[which, j, s] * acceleration
        for s in range(n):
            w.impulses[i, s] *= h * method.b[s]
    return True


@jitted
def solve_stages(which, method, h, loop, t0, y, w):
    """Solve for the impulses of a step of length `h`; returns RUNNING, or why that failed."""
    if not predict(which, method, h, loop, t0, y, w):
        return at.NOT_FINITE
    if not loop.counters[STIFF]:
        if iterate(method, h, loop, t0, y, w) == at.RUNNING:
            return at.RUNNING
        loop.counters[STIFF] = 1
        loop.counters[HAVE_HISTORY] = 0
        if not predict(which, method, h, loop, t0, y, w):
            return at.NOT_FINITE
    if loop.counters[HAVE_JACOBIAN]:
        status = factor_stages(method, h, loop, y, w)
        if status == at.RUNNING:
            status = iterate(method, h, loop, t0, y, w)
        if status == at.RUNNING:
            return at.RUNNING
        # What the last step says may be what misled Newton.
        loop.counters[HAVE_HISTORY] = 0
        if not predict(which, method, h, loop, t0, y, w):
            return at.NOT_FINITE
    if not evaluate(loop, t0, y, w.rows[0]):
        return at.NOT_FINITE
    status = acceleration_jacobian(loop, t0, y, w.rows[0], w.implicit, w.jacobian)
    if status != at.RUNNING:
        return status
    loop.counters[HAVE_JACOBIAN], loop.counters[HAVE_FACTORS] = 1, 0
    status = factor_stages(method, h, loop, y, w)
    if status != at.RUNNING:
        return status
    return iterate(method, h, loop, t0, y, w)


@jitted
def iterate(method, h, loop, t0, y, w):
    """Improve the impulses until rounding keeps them from changing less; returns RUNNING, or why not.

    To stop at a tolerance would leave errors of one sign, and energy would drift (Hairer, McLachlan, Razakarivony, BIT
    48 (2008) 231).
    """
    n = method.c.shape[0]
    reset_rotations(method, loop.sizes, y, w)
    w.numbers[SMALLEST], w.numbers[STALLS] = math.inf, 0.0
    max_stalls = MAX_STALLS_OF_NEWTON if loop.counters[STIFF] else MAX_STALLS
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        # Iterations of fixed points sweep over quaternions as they go; Newton's take rates for all that is unknown.
        n_sweeps = MAX_SWEEPS if loop.counters[STIFF] or iteration == 1 else 1
        place_stages(method, h, n_sweeps, loop.sizes, y, w)
        for s in range(n):
            if not evaluate(loop, t0 + method.c[s] * h, w.states[s], w.rows[s]):
                return at.NOT_FINITE
        if loop.counters[STIFF]:
            correct_by_newton(method, h, loop.sizes, w)
        else:
            correct_by_substitution(method, h, loop.sizes, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_change(iteration, max_stalls, loop, y, w)
    if iteration > KEEP_JACOBIAN_ITERATIONS:
        loop.counters[HAVE_JACOBIAN] = 0
    return at.RUNNING if verdict == CONVERGED else at.NEWTON_FAILED


@jitted
def place_stages(method, h, n_sweeps, sizes, y, w):
    """Write the stages' arguments, v = v0 + Σ mu L, then q = q0 + Σ mu h b q', and `w.travels` = h b q'.

    Returns whether the sweeps over quaternions have settled.
    """
    n, nq, nv = method.c.shape[0], sizes[at.NQ], sizes[at.NV]
    rest = w.states[n + 1]
    add_up(method.mu, w.impulses, w.sums)
    if nq == nv:  # loops from 0 need no checks of their indexes
        for i in range(nv):
            for s in range(n):
                v = y[nv + i] + (rest[nv + i] + w.sums[i, s])
                w.states[s, nv + i] = v
                w.travels[i, s] = h * method.b[s] * v
        add_up(method.mu, w.travels, w.sums)
        for i in range(nv):
            for s in range(n):
                w.states[s, i] = y[i] + (rest[i] + w.sums[i, s])
        return True
    for i in range(nv):
        for s in range(n):
            w.states[s, nq + i] = y[nq + i] + (rest[nq + i] + w.sums[i, s])
    settled, start = True, 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            for s in range(n):
                w.travels[i, s] = h * method.b[s] * w.states[s, nq + i - k]
        add_up(method.mu, w.travels[start:end], w.sums[start:end])
        for i in range(start, end):
            for s in range(n):
                w.states[s, i] = y[i] + (rest[i] + w.sums[i, s])
        if end < nq:
            settled = solve_stage_rotations(method, h, n_sweeps, end, nq + end - k, y, w) and settled
        start = end + 4
    return settled


@jitted
def correct_by_substitution(method, h, sizes, w):
    """Replace the impulses by those of the accelerations at the stages; their largest changes go to `w.change`."""
    nq = sizes[at.NQ]
    for i in range(sizes[at.NV]):
        largest = 0.0
        for s in range(method.c.shape[0]):
            impulse = h * method.b[s] * w.rows[s, nq + i]
            largest = max(largest, abs(impulse - w.impulses[i, s]))
            w.impulses[i, s] = impulse
        w.change[i] = largest


@jitted
def judge_change(iteration, max_stalls, loop, y, w):
    """Judge the changes `w.change` of the impulses: ITERATING, CONVERGED or DIVERGED.

    Converged is what no longer shrinks, once it is as small as round-off of the rates. Forces that nearly cancel leave
    more round-off than that: changes that make no progress for several iterations, but are well below the tolerance,
    are taken for it.
    """
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    largest = 0.0
    for i in range(nv):
        largest = max(largest, abs(y[nq + i]) + abs(w.impulses[i, 0]))
    size = 0.0
    for i in range(nv):
        change = w.change[i]
        if not math.isfinite(change):
            return DIVERGED
        if change > 0.0:
            rate = abs(y[nq + i]) + abs(w.impulses[i, 0])
            size = max(size, change / max(rate, 1e-3 * largest, change))
    if size == 0.0 or w.numbers[SMALLEST] <= size <= ROUND_OFF:
        return CONVERGED
    w.numbers[STALLS] = 0.0 if size < PROGRESS * w.numbers[SMALLEST] else w.numbers[STALLS] + 1.0
    if w.numbers[STALLS] > 0.0:
        is_noise = size_in_tolerances(loop, y, w) <= NOISE_TOL
        if size > DIVERGENCE * w.numbers[SMALLEST] and not is_noise:
            return DIVERGED
        if w.numbers[STALLS] >= max_stalls:
            return CONVERGED if is_noise else DIVERGED
    w.numbers[SMALLEST] = min(w.numbers[SMALLEST], size)
    return ITERATING if iteration < MAX_ITERATIONS else DIVERGED


@jitted
def size_in_tolerances(loop, y, w):
    """Return the largest change of an impulse in units of its rate's tolerance."""
    size = 0.0
    for i in range(loop.sizes[at.NV]):
        rate = abs(y[loop.sizes[at.NQ] + i]) + abs(w.impulses[i, 0])
        size = max(size, w.change[i] / error_scale(loop.control, rate, rate))
    return size
