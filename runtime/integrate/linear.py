"""Linear systems of equations of motion and constraints, also where constraints depend on each other.

Work arrays that these functions take have `matrix` and `factors`, shape (k, k), `right`, shape (k, 1), `pivots` (int64)
and `scale`, shape (k,).
"""

import math

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import copy

RANK_TOLERANCE = 1e-10
# Numba checks every signed index for "from the end", which costs half the speed of these loops.
unsigned = np.uint64
ONE = unsigned(1)


@jitted
def magnitude(x):
    """Return |re x| + |im x|, which serves as well as |x| for choosing pivots and costs no root."""
    return abs(x.real) + abs(x.imag)


@jitted
def swap_rows(a, i, k):
    """Swap rows `i` and `k` of a matrix."""
    for j in range(unsigned(a.shape[1])):
        upper = a[i, j]
        a[i, j] = a[k, j]
        a[k, j] = upper


@jitted
def subtract_row(a, factor, source, target):
    """Subtract `factor` times row `source` of a matrix from its row `target`."""
    for j in range(unsigned(a.shape[1])):
        a[target, j] -= factor * a[source, j]


@jitted
def lu_factor(a, pivots):
    """Factor P a = L U with partial pivoting (Golub, Van Loan, Matrix Computations, alg. 3.4.1).

    Parameters
    ----------
    a : ndarray, shape (n, n), real or complex
        Overwritten by the factors; the diagonal holds the reciprocals of the pivots.
    pivots : ndarray of int64, shape (n,)
        Overwritten: the row that was swapped with row k in step k.

    Returns
    -------
    int
        RUNNING, or SINGULAR_MATRIX where a pivot is exactly zero or not finite; see `pivot_ratio` for more.
    """
    n = unsigned(a.shape[0])
    for k in range(n):
        best, chosen = 0.0, k
        for i in range(k, n):
            size = magnitude(a[i, k])
            if size > best:
                best, chosen = size, i
        pivots[k] = chosen
        if not (math.isfinite(best) and best > 0.0):
            return at.SINGULAR_MATRIX
        if chosen != k:
            swap_rows(a, k, chosen)
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        for i in range(k + ONE, n):
            factor = a[i, k] * inverse
            a[i, k] = factor
            for j in range(k + ONE, n):
                a[i, j] -= factor * a[k, j]
    return at.RUNNING


@jitted
def pivot_ratio(a):
    """Return the smallest pivot over the largest of factors by `lu_factor`; 1 where there are none."""
    smallest, largest = math.inf, 0.0
    for k in range(a.shape[0]):
        size = magnitude(a[k, k])
        smallest, largest = min(smallest, size), max(largest, size)
    return smallest / largest if largest > 0.0 else 1.0


@jitted
def lu_solve(a, pivots, b):
    """Solve a x = b with the factors of `lu_factor`.

    Parameters
    ----------
    a, pivots : ndarray, shapes (n, n), (n,)
    b : ndarray, shape (n,)
        Overwritten by the solution.
    """
    n = unsigned(a.shape[0])
    for k in range(n):
        chosen = unsigned(pivots[k])
        if chosen != k:
            b[k], b[chosen] = b[chosen], b[k]
    for i in range(ONE, n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for m in range(n):
        i = n - m - ONE
        total = b[i]
        for j in range(i + ONE, n):
            total -= a[i, j] * b[j]
        b[i] = total * a[i, i]


@jitted
def lu_solve_matrix(a, pivots, b):
    """Solve a X = B, `b` of shape (n, n_columns), in place with the factors of `lu_factor`."""
    n = unsigned(a.shape[0])
    for k in range(n):
        chosen = unsigned(pivots[k])
        if chosen != k:
            swap_rows(b, k, chosen)
    for i in range(n):
        for k in range(i):
            if a[i, k] != 0.0:
                subtract_row(b, a[i, k], k, i)
    for m in range(n):
        i = n - m - ONE
        for k in range(i + ONE, n):
            if a[i, k] != 0.0:
                subtract_row(b, a[i, k], k, i)
        for j in range(unsigned(b.shape[1])):
            b[i, j] *= a[i, i]


@jitted
def solve_rank_deficient(a, b, n_required, columns, scale):
    """Solve a X = B in place by elimination with complete pivoting, without rows and columns beyond the rank.

    Rows and columns are scaled to a largest entry of 1 first; what remains below RANK_TOLERANCE then is
    dropped, its unknowns are zero. So components of X that the equations determine are right, where the
    equations agree.

    Parameters
    ----------
    a : ndarray, shape (n, n)
        Overwritten.
    b : ndarray, shape (n, n_columns)
        Overwritten by the solution.
    n_required : int
        The first unknowns, that many, must be determined.
    columns : ndarray of int64, shape (n,)
        Scratch: the order of the unknowns.
    scale : ndarray, shape (n,)
        Scratch: the scale of the unknowns.

    Returns
    -------
    int
        RUNNING, NOT_FINITE, or SINGULAR_MATRIX where a required unknown is not determined.
    """
    n = a.shape[0]
    if not equilibrate(a, b, scale):
        return at.NOT_FINITE
    for k in range(n):
        columns[k] = k
    rank = n
    for k in range(n):
        if bring_largest(a, b, columns, k) <= RANK_TOLERANCE:
            rank = k
            break
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            if factor != 0.0:
                subtract_row(a, factor, k, i)
                subtract_row(b, factor, k, i)
    for i in range(rank - 1, -1, -1):
        for j in range(i + 1, rank):
            subtract_row(b, a[i, j], j, i)
        for j in range(b.shape[1]):
            b[i, j] /= a[i, i]
    status = at.RUNNING
    for i in range(rank, n):
        if columns[i] < n_required:
            status = at.SINGULAR_MATRIX
        for j in range(b.shape[1]):
            b[i, j] = 0.0
    restore_order(b, columns, scale)
    return status


@jitted
def equilibrate(a, b, scale):
    """Scale the rows of a X = B, then the columns of `a`, to a largest entry of 1; whether `a` is finite."""
    n = a.shape[0]
    for i in range(n):
        largest = 0.0
        for j in range(n):
            if not math.isfinite(a[i, j]):
                return False
            largest = max(largest, abs(a[i, j]))
        if largest > 0.0:
            for j in range(n):
                a[i, j] /= largest
            for j in range(b.shape[1]):
                b[i, j] /= largest
    for j in range(n):
        scale[j] = 0.0
        for i in range(n):
            scale[j] = max(scale[j], abs(a[i, j]))
        if scale[j] == 0.0:
            scale[j] = 1.0
        for i in range(n):
            a[i, j] /= scale[j]
    return True


@jitted
def bring_largest(a, b, columns, k):
    """Swap the largest entry of the rows and columns from `k` on to place (k, k); returns its size."""
    n = a.shape[0]
    best, row, column = 0.0, k, k
    for i in range(k, n):
        for j in range(k, n):
            if abs(a[i, j]) > best:
                best, row, column = abs(a[i, j]), i, j
    if row != k:
        swap_rows(a, k, row)
        swap_rows(b, k, row)
    if column != k:
        columns[k], columns[column] = columns[column], columns[k]
        for i in range(n):
            a[i, k], a[i, column] = a[i, column], a[i, k]
    return best


@jitted
def restore_order(b, columns, scale):
    """Put the rows of the solution back into the order of the unknowns, by cycles, and undo their scale."""
    n = b.shape[0]
    for k in range(n):
        while columns[k] != k:
            target = columns[k]
            swap_rows(b, k, target)
            columns[k], columns[target] = columns[target], target
    for i in range(n):
        for j in range(b.shape[1]):
            b[i, j] /= scale[i]


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
