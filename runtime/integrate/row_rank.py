"""Which rows of a constraint Jacobian are independent, and which columns can be solved for."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.linear import swap_rows

# Of the largest entry of G with its rows and columns scaled: what is left below this depends on the rows before.
RANK_TOLERANCE = 1e-6


@jitted
def independent_rows(nh, scaled, rows, columns):
    """Eliminate G with complete pivoting, holonomic rows first, so that no velocity constraint takes the place of one.

    Parameters
    ----------
    nh : int
        How many rows are holonomic; they are the first ones.
    scaled : ndarray, shape (m, nv)
        G with its rows and columns scaled; overwritten.
    rows, columns : ndarray of int64, shapes (m,), (nv,)
        Overwritten by the constraints and the rates in the order of the pivots; what depends on others comes last.

    Returns
    -------
    tuple
        How many holonomic rows are independent, how many rows are, and the smallest of their pivots.
    """
    m, nv = scaled.shape
    for k in range(m):
        rows[k] = k
    for j in range(nv):
        columns[j] = j
    n_positions, quality = eliminate(0, nh, scaled, rows, columns)
    # Rows of holonomic constraints that depend on others make room for those of velocities.
    for k in range(n_positions, nh):
        other = m - 1 - (k - n_positions)
        if other >= nh:
            swap_rows(scaled, k, other)
            rows[k], rows[other] = rows[other], rows[k]
    n_rates, smallest = eliminate(n_positions, n_positions + m - nh, scaled, rows, columns)
    return n_positions, n_rates, min(quality, smallest)


@jitted
def eliminate(first, end, scaled, rows, columns):
    """Eliminate rows `first` to `end` - 1 from all below; returns where their rank ends, and their smallest pivot."""
    m, nv = scaled.shape
    quality = math.inf
    for k in range(first, min(end, nv)):
        best, row, column = 0.0, k, k
        for i in range(k, end):
            for j in range(k, nv):
                if abs(scaled[i, j]) > best:
                    best, row, column = abs(scaled[i, j]), i, j
        if not best > RANK_TOLERANCE:
            return k, quality
        quality = min(quality, best)
        if row != k:
            swap_rows(scaled, k, row)
            rows[k], rows[row] = rows[row], rows[k]
        if column != k:
            columns[k], columns[column] = columns[column], columns[k]
            for i in range(m):
                scaled[i, k], scaled[i, column] = scaled[i, column], scaled[i, k]
        for i in range(k + 1, m):
            factor = scaled[i, k] / scaled[k, k]
            for j in range(k, nv):
                scaled[i, j] -= factor * scaled[k, j]
    return min(end, nv), quality
