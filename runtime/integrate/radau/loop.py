"""Radau IIA of order 5, 9 and 13, for stiff systems: adaptive steps, Jacobian and factors kept while they serve.

There is one loop; what differs between equations and matrices is in its `Equations`.
"""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.loop import evaluate, take_steps
from symgen.runtime.integrate.newton import MAX_ITERATIONS, OVERSHOOT, RATE, forget_rate
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.coupled import (
    choose_coupling,
    correct_coupled_stages,
    count_failure,
)
from symgen.runtime.integrate.radau.error import (
    estimate_error,
    filter_accelerations,
    keep_axes,
    n_places_of_stages,
    set_tolerances,
)
from symgen.runtime.integrate.radau.ggl import INDEX2, ggl_work
from symgen.runtime.integrate.radau.newton import Equations, keep_rate_of_full, solve_stages
from symgen.runtime.integrate.radau.sparse import SPARSE, sparse_radau_work
from symgen.runtime.integrate.radau.stages import (
    commit_accelerations,
    correct_stages,
    factor_rotations,
    predict_stages,
    reach_end_by_accelerations,
)
from symgen.runtime.integrate.radau.work import (
    COUPLED,
    DX,
    ERROR,
    F_NEW,
    FACTORED_FOR,
    HAVE_FACTORS,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    ITERATIONS,
    JACOBIAN_IS_FRESH,
    LAST_RATE,
    Y_STAGE,
    can_couple,
    radau_work,
    shift_of,
)
from symgen.runtime.integrate.step_control import SAFETY, first_step, longest_step, step_end, too_small


@jitted
def differentiate_full(method, loop, t, w):
    """Take the derivatives of the accelerations; returns a status."""
    return acceleration_jacobian(loop, t, loop.y, loop.f, w.implicit, w.jacobian)


@jitted
def factor_full(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status.

    Where stages are coupled, only the filter of errors needs factors: the real ones.

    With J = [0 I; A B], (g - J) (Δq, Δv) = (0, r) is Δq = Δv / g and (g - B - A/g) Δv = r: as q' = v is
    linear, the stages satisfy it exactly, and its residual is zero. For the rotation vector of a quaternion, 1/g
    becomes the inverse of g + ω× / 2 (`solve_rotation`), and its equation has a residual.
    """
    set_matrix(method.mu / h, loop.sizes, loop.y, w.jacobian, w.real)
    status = lu_factor(w.real, w.pivots[0])
    if loop.counters[COUPLED]:
        return status
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            set_matrix(shift_of(method, k, 1.0 / h), loop.sizes, loop.y, w.jacobian, w.complex[k])
            status = lu_factor(w.complex[k], w.pivots[k + 1])
    return status


@jitted
def set_matrix(g, sizes, y, jacobian, matrix):
    """Write the Newton matrix for the real or complex shift `g`."""
    nv = matrix.shape[0]
    inverse = 1.0 / g
    for i in range(nv):
        for j in range(nv):
            matrix[i, j] = -jacobian[i, nv + j] - inverse * jacobian[i, j]
        matrix[i, i] += g
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        factor_rotations(g, j, y, sizes[at.NQ] + j, jacobian, matrix)


@jitted
def improve_full(method, h, loop, t, w):
    """Correct the stages once; returns a status and the size of the correction in tolerances."""
    if loop.counters[COUPLED]:
        return correct_coupled_stages(method, h, loop, t, w)
    return correct_stages(solve_full, method, h, loop, t, w)


@jitted
def solve_full(method, h, loop, w):
    """Solve for the corrections of the transformed rates, from the defects."""
    nv, n_pairs = loop.sizes[at.NV], len(method.c) // 2
    for k in range(n_quaternions(loop.sizes)):
        column = quaternion_at(loop.sizes, k) - k
        pass_on(column, loop.sizes, w.jacobian, w.real_vectors[DX])
        for pair in range(n_pairs):
            pass_on(column, loop.sizes, w.jacobian, w.complex_vectors[n_pairs + pair])
    lu_solve(w.real, w.pivots[0], w.real_vectors[DX, nv:])
    for k in range(n_pairs):
        lu_solve(w.complex[k], w.pivots[k + 1], w.complex_vectors[n_pairs + k, nv:])


@jitted
def pass_on(column, sizes, jacobian, vector):
    """Add what the three entries of `vector` from `column` on, of a rotation vector, change the accelerations.

    With J = [K I; A B], (g - J) (Δθ, Δv) = (r, s) becomes Δθ = (g - K)⁻¹ (Δv + r) and (g - B - A (g - K)⁻¹) Δv =
    s + A (g - K)⁻¹ r.
    """
    nv = sizes[at.NV]
    for j in range(nv):
        for axis in range(3):
            vector[nv + j] += jacobian[j, column + axis] * vector[column + axis]


@jitted
def filter_full(method, h, loop, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]` and return its norm."""
    return filter_accelerations(solve_error_full, method, h, loop, row, again, w)


@jitted
def solve_error_full(method, w):
    """Filter the rates' part of the error, given that of the positions."""
    nv = w.jacobian.shape[0]
    for i in range(nv):
        by_v = w.pairs[ERROR, nv + i]
        for k in range(nv):
            by_v += w.jacobian[i, k] * w.pairs[ERROR, k]
        w.pairs[ERROR, nv + i] = by_v
    lu_solve(w.real, w.pivots[0], w.pairs[ERROR, nv:])


FULL = Equations(
    differentiate_full, factor_full, predict_stages, improve_full, filter_full, keep_axes, can_couple,
    keep_rate_of_full, n_places_of_stages, reach_end_by_accelerations, commit_accelerations,
)  # fmt: skip


SHRINK, GROW = 0.2, 8.0
# A step that would grow by less than this is kept, and with it the factors.
KEEP_STEP = 1.2
# Steps that Newton keeps short are far more accurate than was asked. Those of coupled stages are as long as the error
# lets them be, and its estimate is too small where forces have corners: it counts for so many times as much.
CARE = 10.0
# Below this tolerance, estimates see the round-off of stiff forces, and every third coupled step is rejected for it.
FINEST_COUPLED = 1e-10
# Where Newton contracts more slowly than this, the step must not grow.
GROW_RATE = 0.1


@jitted
def advance_radau(method, loop):
    """Advance with Radau IIA until something is for Python to do.

    Hairer, Wanner, Solving ODEs II (1996), IV.8; J. Comput. Appl. Math. 111 (1999) 93, and radau.f, whose tolerances,
    controllers and tests these are. Deviations: the number of stages stays; q is eliminated from the Newton systems; 12
    iterations, and corrections that are round-off are recognised; a Jacobian is kept up to a higher rate of
    contraction, and a slow contraction keeps the step from growing; the state is projected onto the constraints after
    acceptance, before the evaluation at the new point; work is a quadrature and has no part in any norm; quaternions
    are collocated by the rotation vector that turns them from the start of the step.
    Arguments and result are those of all step loops, see docs/step-loops.md; `method` is a `RadauIIA`.
    """
    w = radau_work(method, loop.sizes, loop.work)
    if not begin_radau(method, loop, w):
        return at.NOT_FINITE
    return take_steps(full_step, method, loop, w)


@jitted
def full_step(method, loop, w):
    """Take an accepted step and record it; returns a status."""
    return radau_step(FULL, method, loop, w)


@jitted
def advance_radau_sparse(method, loop):
    """Advance as `advance_radau` does, with sparse matrices; `method` is a `SparseRadauIIA`."""
    w = sparse_radau_work(method, loop.sizes, loop.work)
    if not begin_radau(method, loop, w):
        return at.NOT_FINITE
    return take_steps(sparse_step, method, loop, w)


@jitted
def sparse_step(method, loop, w):
    """Take an accepted step and record it; returns a status."""
    return radau_step(SPARSE, method, loop, w)


@jitted
def advance_radau_ggl(method, loop):
    """Advance as `advance_radau` does, with index-2 equations; `method` is a `RadauGgl`.

    Hairer, Lubich, Roche, The Numerical Solution of Differential-Algebraic Systems by Runge-Kutta Methods (1989): order
    2 s - 1 in positions and rates. The end of a step satisfies the constraints up to Newton's remainder, which the
    projection takes away.
    """
    w = ggl_work(method, loop.sizes, loop.work)
    if not begin_radau(method, loop, w):
        return at.NOT_FINITE
    return take_steps(index2_step, method, loop, w)


@jitted
def index2_step(method, loop, w):
    """Take an accepted step and record it; returns a status."""
    return radau_step(INDEX2, method, loop, w)


@jitted
def begin_radau(method, loop, w):
    """Evaluate where a run begins and choose its first step, unless that is done; returns whether all is finite."""
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return False
        loop.counters[at.F_VALID] = 1
        loop.counters[HAVE_JACOBIAN] = 0
        loop.counters[HAVE_HISTORY] = 0
        w.numbers[LAST_RATE] = 0.0
    if loop.control[at.H] <= 0.0:
        loop.control[at.H] = first_step(len(method.c) + 1, loop, w.rows[F_NEW], w.states[Y_STAGE])
    return True


@jitted
def radau_step(equations, method, loop, w):
    """Take an accepted step and record it; returns a status."""
    t0 = loop.control[at.T]
    status, t1 = accepted_step(equations, method, loop, w)
    if status != at.RUNNING:
        return status
    return equations.commit(method, loop, t0, t1, w)


@jitted
def accepted_step(equations, method, loop, w):
    """Try steps until one is accepted: `w.states[Y_NEW]` is then the new state, `w.rows[F_NEW]` its rhs row.

    Returns
    -------
    tuple
        Status and the time of the new state [s].
    """
    set_tolerances(method, loop, w)
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        h = t1 - t
        if too_small(loop.control):
            return cause, t
        if not loop.counters[HAVE_JACOBIAN]:
            status = equations.differentiate(method, loop, t, w)
            if status != at.RUNNING:
                return status, t
            loop.counters[HAVE_JACOBIAN], loop.counters[JACOBIAN_IS_FRESH] = 1, 1
            loop.counters[HAVE_FACTORS] = 0
        cause = try_step(equations, method, h, loop, t, w)
        if cause != at.RUNNING:
            shrink_step(cause, h, loop, w)
            continue
        error = estimate_error(equations, method, h, loop, t, w) * (CARE if loop.counters[COUPLED] else 1.0)
        cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        if error < 1.0:
            cause = equations.reach_end(method, h, loop, t, t1, w)
            if cause == at.RUNNING:
                accept_radau(equations, method, error, h, loop, w)
                return at.RUNNING, t1
            error = math.inf
        reject_radau(method, error, h, loop, w)


@jitted
def try_step(equations, method, h, loop, t, w):
    """Solve the stages of a step of length `h`; returns RUNNING or why that failed."""
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if not loop.counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        loop.counters[HAVE_FACTORS] = 0
        loop.counters[at.FACTORISATIONS] += 1
        w.numbers[FACTORED_FOR] = h
        forget_rate(w.numbers)
        status = equations.factor(method, h, loop, w)
        if status != at.RUNNING:
            return status
        loop.counters[HAVE_FACTORS] = 1
    if not equations.predict(method, h, loop.counters[HAVE_HISTORY] != 0, loop, t, w):
        return at.NOT_FINITE
    return solve_stages(equations, method, h, loop, t, w)


@jitted
def shrink_step(cause, h, loop, w):
    """Shorten the step after Newton failed: by as much as it was too slow, else to half."""
    factor = 0.5
    if cause != at.SINGULAR_MATRIX and w.numbers[OVERSHOOT] > 0.0:
        rest = 4.0 + MAX_ITERATIONS - 1.0 - w.numbers[ITERATIONS]
        factor = 0.8 * max(1e-4, min(20.0, w.numbers[OVERSHOOT])) ** (-1.0 / rest)
    loop.control[at.H] = h * factor
    if cause == at.NEWTON_FAILED:
        count_failure(loop, w)
    loop.counters[at.LAST_REJECTED] = 1
    loop.counters[at.REJECTED] += 1
    loop.counters[HAVE_FACTORS] = 0
    if not loop.counters[JACOBIAN_IS_FRESH]:
        loop.counters[HAVE_JACOBIAN] = 0


@jitted
def quotient(method, error, w):
    """Return h / h_new of the elementary controller, which is shy of steps that took many iterations."""
    safety = SAFETY * (1.0 + 2.0 * MAX_ITERATIONS) / (w.numbers[ITERATIONS] + 2.0 * MAX_ITERATIONS)
    return max(1.0 / GROW, min(1.0 / SHRINK, error ** (1.0 / (len(method.c) + 1.0)) / min(SAFETY, safety)))


@jitted
def accept_radau(equations, method, error, h, loop, w):
    """Set `control[H]` after an accepted step: Gustafsson's predictive controller (IV.8, (8.25))."""
    wanted, power = loop.control[at.H], 1.0 / (len(method.c) + 1.0)
    factor = quotient(method, error, w)
    by_error = h / factor
    if loop.counters[HAVE_HISTORY]:
        predicted = loop.control[at.H_LAST] / h * (error**2 / loop.control[at.ERROR_OLD]) ** power / SAFETY
        factor = max(factor, max(1.0 / GROW, min(1.0 / SHRINK, predicted)))
        # As in Gustafsson, Söderlind, SIAM J. Sci. Comput. 18 (1997) 23; but the exponent was found by trial: with
        # stiff joints that turn, the error asks again and again for steps for which Newton then diverges.
        factor = max(factor, min(1.0, (w.numbers[LAST_RATE] / GROW_RATE) ** (1.0 / 3.0)))
    h_new = min(h / factor, longest_step(loop.control))
    if loop.counters[at.LAST_REJECTED]:
        h_new = min(h_new, h)
    keep_jacobian = w.numbers[RATE] <= equations.keep_rate() and not loop.counters[COUPLED]
    if keep_jacobian and h <= h_new <= KEEP_STEP * h:
        h_new = h
    # A step that was cut at a stop time says nothing against the step that the method wanted.
    loop.control[at.H] = max(h_new, wanted) if h < wanted else h_new
    loop.control[at.ERROR_OLD] = max(error, 1e-2)
    loop.counters[at.LAST_REJECTED] = 0
    loop.counters[HAVE_HISTORY] = 1
    loop.counters[HAVE_JACOBIAN] = 1 if keep_jacobian else 0
    loop.counters[JACOBIAN_IS_FRESH] = 0
    may_couple = equations.can_couple(loop.sizes) and loop.control[at.RTOL] >= FINEST_COUPLED
    if may_couple and h > 0.99 * wanted:
        choose_coupling(method, h, min(by_error, longest_step(loop.control)), h_new, loop, w)


@jitted
def reject_radau(method, error, h, loop, w):
    """Set `control[H]` after a step with too large an error."""
    if not loop.counters[HAVE_HISTORY]:
        loop.control[at.H] = 0.1 * h
    else:
        loop.control[at.H] = h / (quotient(method, error, w) if math.isfinite(error) else 1.0 / SHRINK)
    loop.counters[at.LAST_REJECTED] = 1
    loop.counters[at.REJECTED] += 1
    if not loop.counters[JACOBIAN_IS_FRESH]:
        loop.counters[HAVE_JACOBIAN] = 0
