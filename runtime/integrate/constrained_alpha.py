"""The generalised-α method with constraints as equations of each step, of positions, rates and accelerations."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.dense import hermite_dense
from symgen.runtime.integrate.jacobian import by_positions
from symgen.runtime.integrate.linear import factor, solve
from symgen.runtime.integrate.loop import all_finite, copy, evaluate, take_steps
from symgen.runtime.integrate.newton import (
    DIVERGED,
    ITERATING,
    N_MONITOR,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.newton import RATE as CONTRACTION
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import chart_variation, n_quaternions, quaternion_at, retract
from symgen.runtime.integrate.step_control import error_scale, grid_end, grid_length

# Counters of this family: whether work holds what a step starts from, and factors (for steps of length FACTORED_FOR).
HAVE_START, HAVE_FACTORS, TRUSTED = range(16, 19)

# `numbers`, behind Newton's monitor: the steps that factors and the start are for.
FACTORED_FOR, STARTED_FOR = N_MONITOR, N_MONITOR + 1
N_NUMBERS = N_MONITOR + 2

# Rows of `vectors`: A, a and v at the start and at the end of the step; what it moves positions by, and a derivative by
# that.
AVERAGE, NEW_AVERAGE, ACCELERATION, NEW_ACCELERATION, RATE, NEW_RATE, TRAVEL, SLOPE = range(8)
N_VECTORS = 8
# Rows of `multipliers`.
START, END = range(2)


class ConstrainedAlphaWork(NamedTuple):
    """Work arrays of `advance_constrained_alpha`, with k unknowns.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    vectors : ndarray, shape (N_VECTORS, nv)
    multipliers : ndarray, shape (2, m)
        λ at the start and at the end of the step.
    stabiliser : ndarray, shape (nh,)
        What moves positions along the rows of G, in units of accelerations.
    gradient : ndarray, shape (m * nv,)
        G at the start of the step.
    turn : ndarray, shape (m, nv)
        ∂(G v)/∂q, by what the step travels.
    arguments : ndarray, shape (nq + 2 nv + m,)
        (q, v, a, λ).
    derivative : ndarray, shape ((nv + m) (nq + 2 nv + m),)
    residual, drift : ndarray, shapes (nv + m,), (nh + m,)
        What the kernels `residual` and `constraint_residual` write.
    matrix, factors, right, pivots, scale : ndarray
        See `saddle`.
    y_new : ndarray, shape (NY,)
    row : ndarray, shape (N_ROW,)
        The rhs row of the new state.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    vectors: np.ndarray
    multipliers: np.ndarray
    stabiliser: np.ndarray
    gradient: np.ndarray
    turn: np.ndarray
    arguments: np.ndarray
    derivative: np.ndarray
    residual: np.ndarray
    drift: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    right: np.ndarray
    pivots: np.ndarray
    scale: np.ndarray
    y_new: np.ndarray
    row: np.ndarray
    scratch: np.ndarray


@jitted
def n_unknowns(method, sizes):
    """Return how many unknowns a step has: accelerations, multipliers, and what stabilises positions."""
    return sizes[at.NV] + sizes[at.NM] + (sizes[at.NH] if method.stabilised else 0)


@jitted
def constrained_alpha_work_size(method, sizes):
    """Length of `work` for `advance_constrained_alpha`."""
    nv, nh, m, k = sizes[at.NV], sizes[at.NH], sizes[at.NM], n_unknowns(method, sizes)
    n_arguments = sizes[at.NQ] + 2 * nv + m
    own = N_NUMBERS + N_VECTORS * nv + 2 * m + nh + 2 * m * nv + n_arguments * (1 + nv + m) + nv + m + nh + m
    return own + 2 * k * k + 3 * k + sizes[at.NY] + sizes[at.N_ROW] + finish_scratch_size(sizes)


@jitted
def constrained_alpha_work(method, sizes, work):
    """Divide `work`, of length `constrained_alpha_work_size(method, sizes)`, into a `ConstrainedAlphaWork`."""
    nv, nh, m, k = sizes[at.NV], sizes[at.NH], sizes[at.NM], n_unknowns(method, sizes)
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    vectors, rest = rest[: N_VECTORS * nv].reshape((N_VECTORS, nv)), rest[N_VECTORS * nv :]
    multipliers, rest = rest[: 2 * m].reshape((2, m)), rest[2 * m :]
    stabiliser, rest = rest[:nh], rest[nh:]
    gradient, rest = rest[: m * nv], rest[m * nv :]
    n_arguments = sizes[at.NQ] + 2 * nv + m
    turn, rest = rest[: m * nv].reshape((m, nv)), rest[m * nv :]
    arguments, rest = rest[:n_arguments], rest[n_arguments:]
    derivative, rest = rest[: (nv + m) * n_arguments], rest[(nv + m) * n_arguments :]
    residual, rest = rest[: nv + m], rest[nv + m :]
    drift, rest = rest[: nh + m], rest[nh + m :]
    matrix, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    factors, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    right, rest = rest[:k].reshape((k, 1)), rest[k:]
    pivots, rest = rest[:k].view(np.int64), rest[k:]
    scale, rest = rest[:k], rest[k:]
    y_new, rest = rest[: sizes[at.NY]], rest[sizes[at.NY] :]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    return ConstrainedAlphaWork(
        numbers, vectors, multipliers, stabiliser, gradient, turn, arguments, derivative, residual, drift, matrix,
        factors, right, pivots, scale, y_new, row, rest,
    )  # fmt: skip


@jitted
def by_travel(sizes, row, w):
    """Write the derivative by what the step travels, of which `row` holds that by q, to `w.vectors[SLOPE]`."""
    slope = w.vectors[SLOPE]
    by_positions(sizes, w.arguments, row, slope)
    for i in range(sizes[at.NV]):
        slope[i] = -slope[i]
    rotate_back(sizes, w)


@jitted
def gradient_by_travel(k, sizes, w):
    """Write row `k` of G at the end of the step, by what it travels, to `w.vectors[SLOPE]`."""
    first = (sizes[at.NV] + k) * w.arguments.shape[0] + sizes[at.NQ] + sizes[at.NV]
    copy(w.derivative[first : first + sizes[at.NV]], w.vectors[SLOPE])
    rotate_back(sizes, w)


@jitted
def rotate_back(sizes, w):
    """Make derivatives by small turns at the end of the step, in `w.vectors[SLOPE]`, those by rotation vectors."""
    slope, travel = w.vectors[SLOPE], w.vectors[TRAVEL]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        # A row times the matrix of `chart_variation`: its transpose, which is that of the opposite turn.
        slope[j], slope[j + 1], slope[j + 2] = chart_variation(
            -travel[j], -travel[j + 1], -travel[j + 2], slope[j], slope[j + 1], slope[j + 2]
        )


@jitted
def dot(a, b):
    """Return the sum of the products of two vectors' entries."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


# Index 3 (Arnold, Brüls, Multibody Syst. Dyn. 18 (2007) 185): M a = f + Gᵀλ and g = 0 hold at the ends of steps, with
# Newmark's formulas between; velocities follow. Stabilised index 2 (Arnold, Brüls, Cardona, Numer. Math. 129 (2015)
# 149): G v = 0 as well, and positions move by h G(q0)ᵀη besides. Residuals of positions are divided by what an
# acceleration moves them, so that Newton's matrix does not depend on h (Bottasso, Bauchau, Cardona, SIAM J. Sci.
# Comput. 29 (2007) 397). What a step travels turns quaternions as a rotation vector (Brüls, Cardona, Arnold, Mech.
# Mach. Theory 48 (2012) 121), η included (Arnold, Cardona, Brüls in: Structure-preserving Integrators in Nonlinear
# Structural Dynamics and Flexible Multibody Dynamics (2016) 91).

# Of the tolerance; multipliers carry what Newton leaves, divided by h².
DEFAULT_NEWTON_TOL = 1e-5
KEEP_JACOBIAN_RATE = 0.2
ROUND_OFF = 4.0 * float(np.finfo(float).eps)


class StepEquations(NamedTuple):
    """What the equations of a step are solved by, with full or sparse matrices.

    Attributes
    ----------
    factor_end : callable
        (method, h, loop, t1, w): factor the derivative of `place_residual` by the unknowns; returns a status.
    solve : callable
        (method, loop, w): replace `w.right` by the solution; returns a status.
    lean_rates : callable
        (method, amount, loop, t, w): add `amount` times the part of NEW_AVERAGE that is across the holonomic
        constraints, in the mass metric, to the rates; returns a status.
    """

    factor_end: Callable
    solve: Callable
    lean_rates: Callable


@jitted
def solve_end(equations, method, h, loop, t0, t1, w):
    """Solve for accelerations and multipliers at `t1` from the guess; where that fails, once more from the start's."""
    if method.stabilised:
        call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t0, loop.y, loop.p, w.gradient)
    place_end(method, h, loop.sizes, loop.y, w)
    # Lengths of steps on the grid differ by round-off of time, which is nothing to Newton.
    if loop.counters[HAVE_FACTORS] and abs(h - w.numbers[FACTORED_FOR]) <= 1e-6 * h:
        if iterate(equations, method, h, loop, t1, w, False) == at.RUNNING:
            return at.RUNNING
        guess_start(loop.sizes, w)
        place_end(method, h, loop.sizes, loop.y, w)
    status = equations.factor_end(method, h, loop, t1, w)
    if status != at.RUNNING:
        return status
    loop.counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
    return iterate(equations, method, h, loop, t1, w, True)


@jitted
def guess_start(sizes, w):
    """Guess that accelerations and multipliers stay."""
    copy(w.vectors[ACCELERATION], w.vectors[NEW_ACCELERATION])
    copy(w.multipliers[START], w.multipliers[END])
    for k in range(sizes[at.NH]):
        w.stabiliser[k] = 0.0


@jitted
def carry_on(sizes, w):
    """Make the end of the step the start of the next; accelerations and multipliers are guessed to go on."""
    copy(w.vectors[NEW_AVERAGE], w.vectors[AVERAGE])
    copy(w.vectors[NEW_RATE], w.vectors[RATE])
    for i in range(sizes[at.NV]):
        old, new = w.vectors[ACCELERATION, i], w.vectors[NEW_ACCELERATION, i]
        w.vectors[ACCELERATION, i] = new
        w.vectors[NEW_ACCELERATION, i] = 2.0 * new - old
    for k in range(sizes[at.NM]):
        before, now = w.multipliers[START, k], w.multipliers[END, k]
        w.multipliers[START, k] = now
        w.multipliers[END, k] = 2.0 * now - before


@jitted
def iterate(equations, method, h, loop, t1, w, last):
    """Improve the guess by simplified Newton; returns a status.

    The `last` attempt has converged as well where it stalls in what round-off of all constraints may add up to.
    """
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    tolerance = loop.control[at.NEWTON_TOL] if loop.control[at.NEWTON_TOL] > 0.0 else DEFAULT_NEWTON_TOL
    start_newton(w.numbers)
    verdict = ITERATING
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        place_residual(method, h, loop, t1, w)
        status = equations.solve(method, loop, w)
        if status != at.RUNNING:
            return status
        for i in range(nv):
            w.vectors[NEW_ACCELERATION, i] -= w.right[i, 0]
        for k in range(m):
            w.multipliers[END, k] -= w.right[nv + k, 0]
        for k in range(w.right.shape[0] - nv - m):
            w.stabiliser[k] -= w.right[nv + m + k, 0]
        place_end(method, h, loop.sizes, loop.y, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        size = size_of_correction(method, h, loop, w, ROUND_OFF)
        verdict = judge_correction(iteration, size, tolerance, w.numbers)
    if verdict == DIVERGED:
        # Along a chain, positions that were rounded at every joint add up: by chance, to the root of their number.
        if last and size_of_correction(method, h, loop, w, ROUND_OFF * math.sqrt(1.0 + m)) <= tolerance:
            loop.counters[HAVE_FACTORS] = 0
            return at.RUNNING
        return at.NEWTON_FAILED
    if w.numbers[CONTRACTION] > KEEP_JACOBIAN_RATE:
        loop.counters[HAVE_FACTORS] = 0
    return at.RUNNING


@jitted
def leverage(method, h):
    """Return by how much q and v at the end of the step change with a there."""
    share = (1.0 - method.alpha_f) / (1.0 - method.alpha_m)
    return h * h * method.beta * share, h * method.gamma * share


@jitted
def place_end(method, h, sizes, y, w):
    """Write A, v, and (q, v, a, λ) at the end of the step, in `w.arguments`, that belong to a, λ and η there."""
    nq, nv = sizes[at.NQ], sizes[at.NV]
    beta, gamma = method.beta, method.gamma
    by_q, _ = leverage(method, h)
    for i in range(nv):
        old, now = w.vectors[AVERAGE, i], w.vectors[NEW_ACCELERATION, i]
        mixed = (1.0 - method.alpha_f) * now + method.alpha_f * w.vectors[ACCELERATION, i]
        new = (mixed - method.alpha_m * old) / (1.0 - method.alpha_m)
        w.vectors[NEW_AVERAGE, i] = new
        rate = w.vectors[RATE, i] + h * ((1.0 - gamma) * old + gamma * new)
        w.vectors[NEW_RATE, i] = rate
        travel = h * (w.vectors[RATE, i] + h * ((0.5 - beta) * old + beta * new))
        if method.stabilised:
            for k in range(sizes[at.NH]):
                travel += by_q * w.gradient[k * nv + i] * w.stabiliser[k]
        w.vectors[TRAVEL, i] = travel
        w.arguments[nq + i] = rate
        w.arguments[nq + nv + i] = now
    retract(sizes, y, 1.0, w.vectors[TRAVEL], 0, w.arguments)
    for k in range(sizes[at.NM]):
        w.arguments[nq + 2 * nv + k] = w.multipliers[END, k]


@jitted
def place_residual(method, h, loop, t1, w):
    """Write what the equations leave at the end of the step to `w.right`."""
    nv, nh, m = loop.sizes[at.NV], loop.sizes[at.NH], loop.sizes[at.NM]
    by_q, by_v = leverage(method, h)
    call_kernel(loop.addresses[at.RESIDUAL], t1, w.arguments, loop.p, w.residual)
    call_kernel(loop.addresses[at.CONSTRAINT_RESIDUAL], t1, w.arguments, loop.p, w.drift)
    for i in range(nv):
        w.right[i, 0] = w.residual[i]
    for k in range(m):
        if k < nh and not method.stabilised:
            w.right[nv + k, 0] = w.drift[k] / by_q
        else:
            w.right[nv + k, 0] = w.drift[nh + k] / by_v
    for k in range(w.right.shape[0] - nv - m):
        w.right[nv + m + k, 0] = w.drift[k] / by_q


@jitted
def factor_end(method, h, loop, t1, w):
    """Factor the derivative of `place_residual` by (a, λ, η); returns RUNNING, as dependent constraints are solved."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    n_columns, n_state = w.arguments.shape[0], nq + nv
    by_q, by_v = leverage(method, h)
    if method.stabilised or m > loop.sizes[at.NH]:
        rotation_of_constraints(loop, t1, w)
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.derivative)
    loop.counters[at.JACOBIANS] += 1
    for i in range(w.matrix.shape[0]):
        for j in range(w.matrix.shape[0]):
            w.matrix[i, j] = 0.0
    for i in range(nv):
        row = w.derivative[i * n_columns : (i + 1) * n_columns]
        by_travel(loop.sizes, row, w)
        for j in range(nv):
            w.matrix[i, j] = row[n_state + j] + by_v * row[nq + j] + by_q * w.vectors[SLOPE, j]
        for k in range(m):
            w.matrix[i, nv + k] = row[n_state + nv + k]
    for k in range(m):
        if method.stabilised or k >= loop.sizes[at.NH]:
            first = (nv + k) * n_columns + n_state
            for j in range(nv):
                w.matrix[nv + k, j] = w.derivative[first + j] + by_q / by_v * w.turn[k, j]
        else:
            gradient_by_travel(k, loop.sizes, w)
            for j in range(nv):
                w.matrix[nv + k, j] = w.vectors[SLOPE, j]
    if method.stabilised:
        border_with_stabiliser(by_q, by_v, loop.sizes, w)
    loop.counters[TRUSTED] = 1 if factor(loop.counters, w) else 0
    return at.RUNNING


@jitted
def solve_full(method, loop, w):
    """Replace `w.right` by the solution; returns a status."""
    return solve(loop.counters[TRUSTED], loop.sizes[at.NV], w)


@jitted
def rotation_of_constraints(loop, t1, w):
    """Write ∂(G v)/∂q to `w.turn`: what ∂(G a - γ)/∂q, linear in a, gains from a + v in place of a."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    n_columns, first = w.arguments.shape[0], nq + nv
    for more in range(2):
        for i in range(nv):
            a = w.vectors[NEW_ACCELERATION, i]
            w.arguments[first + i] = a + w.arguments[nq + i] if more else a
        call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t1, w.arguments, loop.p, w.derivative)
        for k in range(m):
            by_travel(loop.sizes, w.derivative[(nv + k) * n_columns : (nv + k + 1) * n_columns], w)
            for j in range(nv):
                entry = w.vectors[SLOPE, j]
                w.turn[k, j] = entry - w.turn[k, j] if more else entry
    for i in range(nv):
        w.arguments[first + i] = w.vectors[NEW_ACCELERATION, i]
    loop.counters[at.JACOBIANS] += 2


@jitted
def border_with_stabiliser(by_q, by_v, sizes, w):
    """Write the rows of g = 0 and the columns of η, which moves positions along G at the start, to `w.matrix`."""
    nv, nh, m, n_columns = sizes[at.NV], sizes[at.NH], sizes[at.NM], w.arguments.shape[0]
    slope = w.vectors[SLOPE]
    for i in range(nv):
        by_travel(sizes, w.derivative[i * n_columns : (i + 1) * n_columns], w)
        for k in range(nh):
            w.matrix[i, nv + m + k] = by_q * dot(slope, w.gradient[k * nv : (k + 1) * nv])
    for r in range(m):
        for k in range(nh):
            w.matrix[nv + r, nv + m + k] = by_q / by_v * dot(w.turn[r], w.gradient[k * nv : (k + 1) * nv])
    for r in range(nh):
        gradient_by_travel(r, sizes, w)
        copy(slope, w.matrix[nv + m + r, :nv])
        for k in range(nh):
            w.matrix[nv + m + r, nv + m + k] = dot(slope, w.gradient[k * nv : (k + 1) * nv])


@jitted
def size_of_correction(method, h, loop, w, rounded):
    """Return the size of the correction `w.right` in positions and rates, in tolerances, beyond round-off.

    That is `rounded` of the largest position. Constraints hold to round-off of positions, which shows divided by h
    in rates.
    """
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    by_q, by_v = leverage(method, h)
    farthest = 0.0
    for i in range(nq):
        farthest = max(farthest, abs(w.arguments[i]))
    noise = rounded * farthest
    total, start = 0.0, 0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, min(end + 3, nq)):
            j = i - k
            change, v, q = abs(w.right[j, 0]), w.arguments[nq + j], w.arguments[i] if i < end else 1.0
            in_q = max(0.0, by_q * change - noise) / error_scale(loop.control, q, q)
            in_v = max(0.0, by_v * change - noise / h) / error_scale(loop.control, v, v)
            total += in_q * in_q + in_v * in_v + 0.0 * change
        start = end + 4
    return math.sqrt(total / (2 * nv))


# Of the step: how far accelerations are looked at on either side of the start.
_REACH = 0.05


@jitted
def start(equations, method, h, loop, t, w):
    """Set A, a, v and λ for steps of length `h` from the state `y`, whose rhs row is `f`; returns a status.

    A runs behind a by (α_f - α_m) h. In index-3 form the formula for positions misses h³ c a', and the turn of a
    quaternion by h³ ω×ω'/12 besides, which constraints make up for in the velocities across them, by 1/h of that in
    the long run: those that start without it shake the multipliers by O(h) (Arnold, Brüls, Cardona, Numer. Math. 129
    (2015) 149).
    """
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    status = jerk(h, loop, t, w)
    if status != at.RUNNING:
        return status
    lead = method.alpha_m - method.alpha_f
    for i in range(nv):
        w.vectors[ACCELERATION, i] = loop.f[nq + i]
        w.vectors[AVERAGE, i] = loop.f[nq + i] + lead * h * w.vectors[NEW_AVERAGE, i]
        w.vectors[RATE, i] = loop.y[nq + i]
    for k in range(m):
        w.multipliers[START, k] = loop.f[nq + nv + loop.sizes[at.NW] + k]
    if not method.stabilised:
        for i in range(nv):
            w.vectors[NEW_AVERAGE, i] *= 1.0 / 6.0 - 0.5 * lead - method.beta
        add_rotations_missed(loop.sizes, loop.y, loop.f, w.vectors[NEW_AVERAGE])
        status = equations.lean_rates(method, h * h, loop, t, w)
    guess_start(loop.sizes, w)
    w.numbers[STARTED_FOR] = h
    loop.counters[HAVE_START], loop.counters[HAVE_FACTORS] = 1, 0
    return status


@jitted
def jerk(h, loop, t, w):
    """Write the derivative of the accelerations along the motion to NEW_AVERAGE; returns a status."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    reach = _REACH * h
    for side in range(2):
        shift = reach if side == 0 else -reach
        retract(loop.sizes, loop.y, shift, loop.y, nq, w.y_new)
        for i in range(nq, loop.y.shape[0]):
            w.y_new[i] = loop.y[i] + shift * loop.f[i]
        if not evaluate(loop, t + shift, w.y_new, w.row):
            return at.NOT_FINITE
        for i in range(nv):
            if side == 0:
                w.vectors[NEW_ACCELERATION, i] = w.row[nq + i]
            else:
                w.vectors[NEW_AVERAGE, i] = (w.vectors[NEW_ACCELERATION, i] - w.row[nq + i]) / (2.0 * reach)
    return at.RUNNING


@jitted
def add_rotations_missed(sizes, y, f, missed):
    """Add ω×ω'/12 for every quaternion: Magnus' series of a turn, whose rate changes its axis."""
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        i = sizes[at.NQ] + j
        missed[j] += (y[i + 1] * f[i + 2] - y[i + 2] * f[i + 1]) / 12.0
        missed[j + 1] += (y[i + 2] * f[i] - y[i] * f[i + 2]) / 12.0
        missed[j + 2] += (y[i] * f[i + 1] - y[i + 1] * f[i]) / 12.0


@jitted
def lean_rates(method, amount, loop, t, w):
    """Add `amount` times NEW_AVERAGE, the part across the holonomic constraints, to the rates; returns a status."""
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    mass = w.derivative[: nv * nv]
    for i in range(nv * nv):
        mass[i] = 0.0
    call_kernel(loop.addresses[at.MASS_MATRIX], t, loop.y, loop.p, mass)
    call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t, loop.y, loop.p, w.gradient)
    for i in range(nv + m):
        w.right[i, 0] = 0.0
        for j in range(nv + m):
            w.matrix[i, j] = 0.0
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = mass[i * nv + j]
    for k in range(m):
        for i in range(nv):
            w.matrix[nv + k, i] = w.gradient[k * nv + i]
            w.matrix[i, nv + k] = w.gradient[k * nv + i]
            if k < loop.sizes[at.NH]:
                w.right[nv + k, 0] += w.gradient[k * nv + i] * w.vectors[NEW_AVERAGE, i]
    status = solve(factor(loop.counters, w), nv, w)
    for i in range(nv):
        w.vectors[RATE, i] += amount * w.right[i, 0]
    for i in range(w.derivative.shape[0]):
        w.derivative[i] = 0.0
    return status


N_DENSE_TERMS = 4
FULL = StepEquations(factor_end, solve_full, lean_rates)


@jitted
def advance_constrained_alpha(method, loop):
    """Advance with a `ConstrainedAlpha` method until something is for Python to do; see `constrained`.

    The velocities of index-3 form leave G v = 0 by O(h²); `y` has those projected onto it, while the recursion goes on
    with its own. A step of another length starts the recursion anew. `control[NEWTON_TOL]` is in units of the error
    tolerance; 0 means DEFAULT_NEWTON_TOL. Arguments and result are those of all step loops, see docs/step-loops.md.
    """
    w = constrained_alpha_work(method, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID], loop.counters[HAVE_START] = 1, 0
    return take_steps(full_step, method, loop, w)


@jitted
def full_step(method, loop, w):
    """Take one step with full matrices and record it; returns a status."""
    return constrained_alpha_step(FULL, method, loop, w)


@jitted
def constrained_alpha_step(equations, method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    h = grid_length(loop.control, t0, t1)
    status = at.RUNNING
    if not loop.counters[HAVE_START] or abs(h - w.numbers[STARTED_FOR]) > 1e-6 * h:
        status = start(equations, method, h, loop, t0, w)
    if status == at.RUNNING:
        status = solve_end(equations, method, h, loop, t0, t1, w)
    if status == at.RUNNING:
        status = reach_end(h, loop, t1, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        hermite_dense(loop.y, w.y_new, loop.f, w.row, h, loop.sizes[at.NY], loop.dense)
    copy(w.y_new, loop.y)
    copy(w.row, loop.f)
    carry_on(loop.sizes, w)
    return finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)


@jitted
def reach_end(h, loop, t1, w):
    """Project the new state, evaluate its rhs row, add the work (trapezoidal rule); returns a status."""
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    for i in range(n):
        w.y_new[i] = w.arguments[i]
    status = project_state(loop, t1, w.y_new, w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    if not evaluate(loop, t1, w.y_new, w.row):
        return at.NOT_FINITE
    loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], w.row[loop.sizes[at.N_ROW] - 1])
    for i in range(n, n + loop.sizes[at.NW]):
        w.y_new[i] = loop.y[i] + 0.5 * h * (loop.f[i] + w.row[i])
    return at.RUNNING if all_finite(w.y_new, loop.sizes[at.NY]) else at.NOT_FINITE
