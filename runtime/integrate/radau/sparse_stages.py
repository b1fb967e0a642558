"""The stages of the Radau methods, and their error, with sparse Newton systems (`integrate/sparse_newton.py`)."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.evaluation import evaluate
from symgen.runtime.integrate.newton import (
    ITERATING,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, retract
from symgen.runtime.integrate.radau.error import unfiltered_positions, weighted
from symgen.runtime.integrate.radau.rotation_increments import (
    add_rotation,
    correct_rotations,
    set_rotation_rates,
    solve_rotations,
)
from symgen.runtime.integrate.radau.sparse_work import pair_factors
from symgen.runtime.integrate.radau.stages import evaluate_stage, finish_newton, retract_stages, squared_move
from symgen.runtime.integrate.radau.transform import add_correction, set_defect, shift_of
from symgen.runtime.integrate.radau.work import (
    DX,
    ERROR,
    F_NEW,
    F_STAGES,
    FACTORED_FOR,
    HAVE_HISTORY,
    NEWTON_BOUND,
    SCALE,
    Y_STAGE,
)
from symgen.runtime.integrate.sparse_lu import sparse_solve
from symgen.runtime.integrate.sparse_newton import (
    BY_POSITION,
    BY_TURN,
    BY_UNKNOWN,
    clear,
    factor_shifted,
    multiply,
    solve_shifted,
)


@jitted
def factor_sparse_stages(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status."""
    pattern = method.pattern
    loop.counters[at.FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
    status = factor_shifted(pattern, method.mu / h, loop.sizes, loop.y, w.entries, w.values, w.real)
    for k in range(len(method.c) // 2):
        if status == at.RUNNING:
            g, lu = shift_of(method, k, 1.0 / h), pair_factors(method, k, w)
            status = factor_shifted(pattern, g, loop.sizes, loop.y, w.entries, w.complex_values, lu)
    return status


@jitted
def solve_sparse_stages(method, h, loop, t0, w):
    """Improve the stages by simplified Newton, as `solve_stages` does; returns RUNNING, or why it does not converge."""
    start_newton(w.numbers)
    verdict, size, rate = ITERATING, 0.0, 0.0
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        for s in range(len(method.c)):
            if not evaluate_stage(s, method, h, loop, t0, w):
                return at.NOT_FINITE
        size = correct_sparse_stages(method, h, loop.sizes, loop.y, w)
        retract_stages(method, h, loop.sizes, loop.y, w)
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
        if iteration == 2:
            rate = w.numbers[RATE]
    return finish_newton(verdict, iteration, size, rate, method, h, loop.sizes, loop.y, w)


@jitted
def correct_sparse_stages(method, h, sizes, y, w):
    """Correct the transformed increments; returns the size of the correction in tolerances."""
    nq, nv, n_pairs, pattern, per_h = sizes[at.NQ], sizes[at.NV], len(method.c) // 2, method.pattern, 1.0 / h
    for i in range(nv):
        set_defect(method, per_h, w.rows, F_STAGES, nq + i, nv + i, w)
    for k in range(n_quaternions(sizes)):
        i = quaternion_at(sizes, k)
        set_rotation_defect(method, per_h, i, i - k, nq + i - k, y, w)
    vector = w.real_vectors[DX]
    solve_shifted(pattern, w.entries, vector[:nv], vector[nv:], w.right, w.real)
    for k in range(n_pairs):
        pair = w.complex_vectors[n_pairs + k]
        solve_shifted(pattern, w.entries, pair[:nv], pair[nv:], w.complex_right, pair_factors(method, k, w))
    total = 0.0
    for i in range(nv):
        total += add_correction(method, nv + i, w) / w.pairs[SCALE, nv + i] ** 2
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            total += squared_move(method, h, nv + i, w) / w.pairs[SCALE, i] ** 2
        if end < nv:
            total += correct_rotations(method, per_h, sizes, end, nq + end, y, w)
        start = end + 3
    return math.sqrt(total / (2 * nv * len(method.c)))


@jitted
def set_rotation_defect(method, per_h, i, column, first, y, w):
    """Set the transformed defects of a quaternion's rotation vector, solved for it; see `rotation_defect`."""
    set_rotation_rates(method, i, first, y, w)
    for axis in range(3):
        set_defect(method, per_h, w.rotation_rates, 0, axis, column + axis, w)
    solve_rotations(method.mu * per_h, column, first, y, w.real_vectors[DX])
    n_pairs = len(method.c) // 2
    for k in range(n_pairs):
        solve_rotations(shift_of(method, k, per_h), column, first, y, w.complex_vectors[n_pairs + k])


@jitted
def estimate_sparse_error(method, h, loop, t, w):
    """Return the estimated error of the step in units of the tolerance, as `estimate_error` does."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    error = filter_sparse_error(method, h, loop.sizes, loop.y, loop.f, False, w)
    if error >= 1.0 and (loop.counters[at.LAST_REJECTED] or not loop.counters[HAVE_HISTORY]):
        retract(loop.sizes, loop.y, 1.0, w.pairs[ERROR], 0, w.states[Y_STAGE])
        for i in range(nv):
            w.states[Y_STAGE, nq + i] = loop.y[nq + i] + w.pairs[ERROR, nv + i]
        if not evaluate(loop, t, w.states[Y_STAGE], w.rows[F_NEW]):
            return math.inf
        error = filter_sparse_error(method, h, loop.sizes, loop.y, w.rows[F_NEW], True, w)
    return max(error, 1e-10) if math.isfinite(error) else error


@jitted
def filter_sparse_error(method, h, sizes, y, row, again, w):
    """Write the filtered error to `w.pairs[ERROR]`; `again`: it is there already, and `row` belongs to y + error."""
    nq, nv, pattern = sizes[at.NQ], sizes[at.NV], method.pattern
    positions, rates = w.pairs[ERROR, :nv], w.pairs[ERROR, nv:]
    shift = h / method.mu
    unfiltered_positions(method, h, sizes, y, again, w)
    for i in range(nv):
        rates[i] = row[nq + i] + weighted(method, method.error, nq + i, w) / h
    # A e of the full method is -[F_a F_λ]⁻¹ F_q e, which needs no inverse on this side of the system.
    clear(w.right)
    multiply(pattern, BY_UNKNOWN, 1.0, w.entries, rates, w.right)
    multiply(pattern, BY_POSITION, -1.0, w.entries, positions, w.right)
    multiply(pattern, BY_TURN, -1.0, w.entries, positions, w.right)
    sparse_solve(pattern.order, w.real, w.right)
    for i in range(nv):
        rates[i] = w.right[i]
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            positions[i] += shift * rates[i]
        if end < nv:
            add_rotation(1.0 / shift, end, nv + end, nq + end, y, w.pairs[ERROR])
        start = end + 3
    total = 0.0
    for i in range(2 * nv):
        total += (w.pairs[ERROR, i] / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / (2 * nv))
