"""Newton for all stages of a Radau method at once, with the derivatives of each stage; and when it pays.

Simplified Newton takes the derivatives at the start of the step for all stages. Where a stiff spring turns by an angle
φ within a step, its force of stiffness k acts on what moves across it by k φ, which the matrix does not know: it
contracts only while k φ h² < 1, so that steps stay of the order of (k ω)^(-1/3), whatever the tolerance. Derivatives
of each stage follow the turning, and steps become as long as the error of the smooth motion lets them be; but they
couple the stages, whose matrix then is s times as large. Yen, Petzold, SIAM J. Sci. Comput. 19 (1998) 1513 describe the
difficulty, and go around it by a projection that needs to know the stiff directions.
"""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import acceleration_jacobian
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.radau.stages import evaluate_stage, retract_positions
from symgen.runtime.integrate.radau.work import (
    COUPLED,
    CREDIT,
    F_STAGES,
    H_UNCOUPLED,
    HAVE_FACTORS,
    HELD_BACK,
    PATIENCE,
    SCALE,
    STAGES,
    Y_STAGE,
)

# How many more steps speak against uncoupled stages than for them before they are coupled, in costs of a coupled step,
# and by how much more after each return; how many a failure of Newton counts for.
_TRIAL, _PATIENCE, _FAILURE = 8, 4, 3
# What coupled steps may cost beyond what they bring in, at first and at most, in costs of one.
_CREDIT, _MOST_CREDIT = 2.0, 8.0
# Newton holds back a step that could be so many times as long.
_MUCH = 2.0
# Iterations of a step, coupled and not.
_COUPLED_ITERATIONS, _UNCOUPLED_ITERATIONS = 3.5, 5.0


@jitted
def never_coupled(sizes):
    """Whether the stages of such a model may be coupled: no."""
    return False


@jitted
def divide_coupled(n_stages, nv, work):
    """Divide `work`, of length `coupled_size(method, sizes)`.

    Returns
    -------
    matrix : ndarray, shape (s nv, s nv)
        Newton's matrix, then its factors.
    pivots : ndarray of int64, shape (s nv,)
    defects : ndarray, shape (s nv,)
        Of all stages, then their corrections.
    jacobian : ndarray, shape (nv, 2 nv)
        [∂a/∂q, ∂a/∂v] of one stage.
    """
    n = n_stages * nv
    matrix, rest = work[: n * n].reshape((n, n)), work[n * n :]
    pivots, rest = rest[:n].view(np.int64), rest[n:]
    return matrix, pivots, rest[:n], rest[n:].reshape((nv, 2 * nv))


@jitted
def correct_coupled_stages(method, h, loop, t, w):
    """Correct the stages once by the derivatives of each; returns a status and the correction's size in tolerances.

    With Z the stages' increments of v, those of q are h (c v0 + a Z). What Newton makes zero is f(Q_i, V_i) - (a⁻¹ Z)_i
    / h, whose derivative by Z_l is B_i δ_il + h A_i a_il - (a⁻¹)_il / h, with A and B of `acceleration_jacobian`.
    """
    nq, nv, n = loop.sizes[at.NQ], loop.sizes[at.NV], len(method.c)
    matrix, pivots, defects, jacobian = divide_coupled(n, nv, w.coupled)
    for s in range(n):
        if not evaluate_stage(s, method, h, loop, t, w):
            return at.NOT_FINITE, 0.0
        row = w.rows[F_STAGES + s]
        status = acceleration_jacobian(
            loop, t + method.c[s] * h, w.states[Y_STAGE], row, w.implicit, jacobian
        )
        if status != at.RUNNING:
            return status, 0.0
        for i in range(nv):
            k = s * nv + i
            defects[k] = row[nq + i]
            for r in range(n):
                by_self, by_q = method.inverse[s, r] / h, h * method.a[s, r]
                defects[k] -= by_self * w.states[STAGES + r, nq + i]
                for j in range(nv):
                    matrix[k, r * nv + j] = -by_q * jacobian[i, j]
                matrix[k, r * nv + i] += by_self
            for j in range(nv):
                matrix[k, s * nv + j] -= jacobian[i, nv + j]
    status = lu_factor(matrix, pivots)
    if status != at.RUNNING:
        return status, 0.0
    lu_solve(matrix, pivots, defects)
    size = _add_corrections(method, h, loop.sizes, defects, w)
    retract_positions(method, h, loop.sizes, loop.y, w)
    return at.RUNNING, size


@jitted
def _add_corrections(method, h, sizes, corrections, w):
    """Add corrections to the stages' increments of v; returns their size in tolerances."""
    nq, nv, n = sizes[at.NQ], sizes[at.NV], len(method.c)
    total = 0.0
    for s in range(n):
        for i in range(nv):
            move = 0.0
            for r in range(n):
                move += h * method.a[s, r] * corrections[r * nv + i]
            turn = corrections[s * nv + i]
            w.states[STAGES + s, nq + i] += turn
            total += (turn / w.pairs[SCALE, nv + i]) ** 2 + (move / w.pairs[SCALE, i]) ** 2
    return math.sqrt(total / (2 * nv * n))


@jitted
def relative_cost(method, sizes):
    """Return about how many times as long a step takes with coupled stages: products of its matrices and functions."""
    s, nv, n = len(method.c), 1.0 * sizes[at.NV], 1.0 * (sizes[at.NV] + sizes[at.NM])
    matrices, rhs = 1.0 + 4.0 * (s // 2), 20.0 + n * n + n**3 / 3.0
    derivatives = 20.0 + 5.0 * n * n + 2.0 / 3.0 * n**3 + 4.0 * nv * n * n
    uncoupled = (
        _UNCOUPLED_ITERATIONS * (s * rhs + 2.0 * matrices * nv**2) + derivatives + matrices * nv**3 / 1.5
    )
    coupled = s * (rhs + derivatives) + (s * nv) ** 3 / 1.5 + 2.0 * (s * nv) ** 2
    return _COUPLED_ITERATIONS * coupled / uncoupled


@jitted
def count_failure(loop, w):
    """Let a failure of Newton speak against the stages as they are."""
    if loop.counters[COUPLED]:
        w.numbers[CREDIT] -= 1.0
        if w.numbers[CREDIT] < 0.0:
            uncouple(loop, w)
    else:
        loop.counters[HELD_BACK] += _FAILURE


@jitted
def uncouple(loop, w):
    """Return to uncoupled stages, and to the steps that they had; the next try will be later."""
    loop.counters[COUPLED], loop.counters[HELD_BACK], loop.counters[HAVE_FACTORS] = 0, 0, 0
    loop.counters[PATIENCE] = max(1, loop.counters[PATIENCE]) * _PATIENCE
    loop.control[at.H] = min(loop.control[at.H], w.numbers[H_UNCOUPLED])


@jitted
def choose_coupling(method, h, by_error, h_next, loop, w):
    """Decide after an accepted step of length `h` whether the stages of the next, `h_next`, are coupled.

    Uncoupled stages are given up where again and again the error would let steps be `by_error` long and Newton holds
    them back, or fails (`count_failure`). How long they would become, the error does not tell, in which Newton's
    remainder has a part: so it is tried, on credit. A coupled step costs one unit, and brings in what part it is of the
    way that uncoupled ones would have made for its cost; where the credit is gone, stages are uncoupled.
    """
    if loop.counters[COUPLED]:
        worth = h / (relative_cost(method, loop.sizes) * w.numbers[H_UNCOUPLED])
        w.numbers[CREDIT] = min(_MOST_CREDIT, w.numbers[CREDIT] + worth - 1.0)
        if w.numbers[CREDIT] < 0.0:
            uncouple(loop, w)
        return
    held_back = by_error > _MUCH * h_next
    loop.counters[HELD_BACK] = (
        loop.counters[HELD_BACK] + 1 if held_back else max(0, loop.counters[HELD_BACK] - 1)
    )
    enough = _TRIAL * max(1, loop.counters[PATIENCE])
    if loop.counters[HELD_BACK] >= enough:
        if loop.counters[HELD_BACK] >= enough * relative_cost(method, loop.sizes):
            loop.counters[COUPLED], loop.counters[HELD_BACK], loop.counters[HAVE_FACTORS] = 1, 0, 0
            w.numbers[H_UNCOUPLED], w.numbers[CREDIT] = h, _CREDIT
