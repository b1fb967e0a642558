"""Linear systems of equations of motion and constraints, also where constraints depend on each other.

Work arrays that these functions take have `matrix` and `factors`, shape (k, k), `right`, shape (k, 1), `pivots` (int64)
and `scale`, shape (k,).
"""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.linear import lu_factor, lu_solve, pivot_ratio, solve_rank_deficient

# Below this the factors are not trusted, and elimination with complete pivoting decides on the rank.
TRUSTED_PIVOT_RATIO = 1e-12


@jitted
def border(above, below, nv, w):
    """Write -Gᵀ beside, and G' below the leading block of `w.matrix`; `above` is G, `below` G', row-major."""
    m = w.matrix.shape[0] - nv
    for k in range(m):
        for i in range(nv):
            w.matrix[i, nv + k] = -above[k * nv + i]
            w.matrix[nv + k, i] = below[k * nv + i]
        for j in range(m):
            w.matrix[nv + k, nv + j] = 0.0


@jitted
def factor(counters, w):
    """Factor a copy of `w.matrix`; returns whether the factors can be trusted."""
    for i in range(w.matrix.shape[0]):
        copy(w.matrix[i], w.factors[i])
    counters[at.FACTORISATIONS] += 1
    return lu_factor(w.factors, w.pivots) == at.RUNNING and pivot_ratio(w.factors) > TRUSTED_PIVOT_RATIO


@jitted
def solve(trusted, nv, w):
    """Replace `w.right` by the solution; multipliers of redundant constraints are zero.

    Returns
    -------
    int
        RUNNING, or why the first `nv` unknowns are not determined.
    """
    if trusted:
        lu_solve(w.factors, w.pivots, w.right[:, 0])
        return at.RUNNING
    for i in range(w.matrix.shape[0]):
        copy(w.matrix[i], w.factors[i])
    return solve_rank_deficient(w.factors, w.right, nv, w.pivots, w.scale)
