"""One step of iterative refinement of accelerations and multipliers where constraints nearly depend on each other.

The straight-line elimination has a fixed order. Where a pivot is small it loses digits that a factorisation with
pivoting keeps; the residual with M and G, solved for once more, brings them back (Wilkinson; Higham, Accuracy and
Stability of Numerical Algorithms, 2002, chapter 12).
"""

from __future__ import annotations

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.branch import FORCES, GAMMA, NQ, NV, NW, M, buffers, constrained_solve, factor
from symgen.runtime.integrate.loop import copy

_ANY_RANK = 1e-9  # far below the pivot ratio from which on other code takes over


@jitted
def refined_rhs(context, t, y, p, out, weights, order, work):
    """Improve accelerations and multipliers of a row that the straight-line `rhs` has written.

    Arguments are those of `robust_path.robust_rhs`. A row stays as it is where M is singular without constraints.
    """
    nq, nv, m = context[NQ], context[NV], context[M]
    n, ny = nq + nv, nq + nv + context[NW]
    b = buffers(context, order, work)
    copy(y[:n], b.place)
    rank, _, _ = factor(context, t, b, p, weights, _ANY_RANK)
    if rank < m or b.shift[0] != 0.0:
        return
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    call_kernel(np.uint64(context[GAMMA]), t, b.place, p, b.target)
    for i in range(nv):
        left = b.forces[i]
        for k in range(m):
            left += b.jacobian[k, i] * out[ny + k]
        for j in range(nv):
            left -= b.kept[i, j] * out[nq + j]
        b.forces[i] = left
    for k in range(m):
        left = b.target[k]
        for j in range(nv):
            left -= b.jacobian[k, j] * out[nq + j]
        b.target[k] = left
    constrained_solve(b, rank)
    for i in range(nv):
        out[nq + i] += b.step[i]
    for k in range(m):
        out[ny + k] += b.multipliers[k]


refined_rhs.title = "the refinement of accelerations (once per machine)"
