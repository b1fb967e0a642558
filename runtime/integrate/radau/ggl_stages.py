"""The stages of the Radau methods for index-2 equations: simplified Newton, reduced to the size of v and λ."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.ggl import divide_blocks, equation_residuals, set_shifted, solve_shifted
from symgen.runtime.integrate.linear import lu_factor
from symgen.runtime.integrate.newton import (
    ITERATING,
    RATE,
    forget_rate,
    judge_correction,
    start_newton,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.radau.ggl_dense_output import predict_rotations_index2
from symgen.runtime.integrate.radau.ggl_rotations import (
    reset_rotations,
    rotate_entries,
    solve_rotations_index2,
    to_body_axes,
    to_start_axes,
)
from symgen.runtime.integrate.radau.rotation_increments import place
from symgen.runtime.integrate.radau.stages import evaluate_stage, finish_newton, predict_rates
from symgen.runtime.integrate.radau.transform import shift_of
from symgen.runtime.integrate.radau.work import (
    F_STAGES,
    FACTORED_FOR,
    NEWTON_BOUND,
    SCALE,
    STAGES,
    Y_STAGE,
)


@jitted
def factor_index2(method, h, loop, w):
    """Factor the real and the complex Newton matrices for a step of length `h`; returns a status."""
    b = divide_blocks(loop.sizes, w.blocks)
    set_shifted(method.mu / h, loop.sizes[at.NH], b, w.real)
    loop.counters[at.FACTORISATIONS] += 1
    w.numbers[FACTORED_FOR] = h
    forget_rate(w.numbers)
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
def solve_index2(method, h, loop, t0, w):
    """Improve the stages by simplified Newton; returns RUNNING, or why it does not converge."""
    start_newton(w.numbers)
    verdict, size, rate = ITERATING, 0.0, 0.0
    iteration = 0
    while verdict == ITERATING:
        iteration += 1
        for s in range(len(method.c)):
            stage_residuals(s, method, h, loop, t0, w)
        correct_residuals(method, h, loop.sizes, w)
        size = correct_index2(method, h, loop.sizes, w)
        if not math.isfinite(size):
            return at.NOT_FINITE
        if not retract_index2(method, h, loop.sizes, loop.y, w):
            return at.NEWTON_FAILED
        loop.counters[at.NEWTON_ITERATIONS] += 1
        verdict = judge_correction(iteration, size, w.numbers[NEWTON_BOUND], w.numbers)
        if iteration == 2:
            rate = w.numbers[RATE]
    return finish_newton(verdict, iteration, size, rate, method, h, loop.sizes, loop.y, w)


@jitted
def stage_residuals(s, method, h, loop, t0, w):
    """Write the residuals of stage `s`, with the accelerations that the stages' rates say."""
    nq, nv, stage = loop.sizes[at.NQ], loop.sizes[at.NV], w.states[STAGES + s]
    place(loop.sizes, loop.y, stage, w.states[Y_STAGE])
    for i in range(nv):
        total = 0.0
        for r in range(len(method.c)):
            total += method.a_inverse[s, r] * w.states[STAGES + r, nq + i]
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
