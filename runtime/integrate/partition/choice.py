"""Choose which coordinates are integrated and which follow from the constraints.

Wehage, Haug, J. Mech. Des. 104 (1982) 247: elimination of G with complete pivoting; the coordinates of the pivots
depend on the others.
"""

import math

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.integrate.layout import CONSTRAINT_JACOBIAN, MASS_MATRIX, NH, NM, NV, PARTITION_LOST, RUNNING
from runtime.integrate.linear import swap_rows
from runtime.integrate.partition.work import (
    FIRST_QUALITY,
    FIRST_RANK,
    HAVE_PARTITION,
    LATEST,
    N_POSITIONS,
    N_RATES,
    QUALITY,
    SWITCHES,
)

# Of the largest entry of G with its rows and columns scaled: what is left below this depends on the rows before.
RANK_TOLERANCE = 1e-6
# Another partition is taken where the smallest pivot has fallen to this part of what it was.
WORN = 0.2
# All are lost where the smallest pivot of the best has fallen to this part of the first one's: rounding of the
# dependent coordinates grows by its reciprocal, and which branch of a mechanism they follow is then left to chance.
LOST = 1e-3


@jitted
def choose_partition(addresses, sizes, p, counters, t, y, w):
    """Choose the dependent coordinates at a state on the constraints; returns a status.

    PARTITION_LOST where fewer constraints are independent than at the first choice, or nearly so: no coordinates serve.
    """
    nh, m = sizes[NH], sizes[NM]
    scale_jacobian(not counters[HAVE_PARTITION], addresses, sizes, p, t, y, w)
    for k in range(m):
        w.rows[k] = k
    for j in range(sizes[NV]):
        w.columns[j] = j
    w.numbers[QUALITY] = math.inf
    n_positions = eliminate(0, nh, w)
    # Rows of holonomic constraints that depend on others make room for those of velocities.
    for k in range(n_positions, nh):
        other = m - 1 - (k - n_positions)
        if other >= nh:
            swap_rows(w.scaled, k, other)
            w.rows[k], w.rows[other] = w.rows[other], w.rows[k]
    n_rates = eliminate(n_positions, n_positions + m - nh, w)
    if counters[HAVE_PARTITION]:
        counters[SWITCHES] += 1
    else:
        counters[FIRST_RANK] = n_rates
        w.numbers[FIRST_QUALITY] = w.numbers[QUALITY]
    counters[HAVE_PARTITION] = 1
    counters[N_POSITIONS], counters[N_RATES] = n_positions, n_rates
    w.numbers[LATEST] = w.numbers[QUALITY]
    kept = n_rates >= counters[FIRST_RANK] and w.numbers[QUALITY] >= LOST * w.numbers[FIRST_QUALITY]
    return RUNNING if kept else PARTITION_LOST


@jitted
def scale_jacobian(first, addresses, sizes, p, t, y, w):
    """Write G to `w.scaled`, columns in units of equal kinetic energy, rows in units of the largest entry so far.

    Not of the largest entry now: a row that vanishes as a whole loses rank as well.
    """
    nv, m = sizes[NV], sizes[NM]
    call_kernel(addresses[MASS_MATRIX], t, y, p, w.mass)
    call_kernel(addresses[CONSTRAINT_JACOBIAN], t, y, p, w.jacobian)
    heaviest = 0.0
    for j in range(nv):
        heaviest = max(heaviest, w.mass[j * nv + j])
    for j in range(nv):
        # What has no mass of its own is best left to the constraints.
        inertia = max(w.mass[j * nv + j], 1e-6 * heaviest)
        w.column_scale[j] = 1.0 / math.sqrt(inertia) if inertia > 0.0 else 1.0
    for k in range(m):
        largest = 0.0
        for j in range(nv):
            w.scaled[k, j] = w.jacobian[k * nv + j] * w.column_scale[j]
            largest = max(largest, abs(w.scaled[k, j]))
        scale = 1.0 / largest if largest > 0.0 else 1.0
        w.row_scale[k] = scale if first else min(scale, w.row_scale[k])
        for j in range(nv):
            w.scaled[k, j] *= w.row_scale[k]


@jitted
def eliminate(first, end, w):
    """Eliminate rows `first` to `end` - 1 of `w.scaled` from all below, with complete pivoting.

    Returns where their rank ends. `w.numbers[QUALITY]` becomes the smallest pivot where that is smaller.
    """
    m, nv = w.scaled.shape
    for k in range(first, min(end, nv)):
        best, row, column = 0.0, k, k
        for i in range(k, end):
            for j in range(k, nv):
                if abs(w.scaled[i, j]) > best:
                    best, row, column = abs(w.scaled[i, j]), i, j
        if not best > RANK_TOLERANCE:
            return k
        w.numbers[QUALITY] = min(w.numbers[QUALITY], best)
        if row != k:
            swap_rows(w.scaled, k, row)
            w.rows[k], w.rows[row] = w.rows[row], w.rows[k]
        if column != k:
            w.columns[k], w.columns[column] = w.columns[column], w.columns[k]
            for i in range(m):
                w.scaled[i, k], w.scaled[i, column] = w.scaled[i, column], w.scaled[i, k]
        for i in range(k + 1, m):
            factor = w.scaled[i, k] / w.scaled[k, k]
            for j in range(k, nv):
                w.scaled[i, j] -= factor * w.scaled[k, j]
    return min(end, nv)


@jitted
def is_worn(w):
    """Whether the partition has become worse than another may be."""
    return not w.numbers[LATEST] >= WORN * w.numbers[QUALITY]
