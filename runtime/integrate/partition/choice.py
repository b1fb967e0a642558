"""Choose which coordinates are integrated and which follow from the constraints.

Wehage, Haug, J. Mech. Des. 104 (1982) 247: elimination of G with complete pivoting; the coordinates of the pivots
depend on the others.
"""

import math

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.integrate.layout import CONSTRAINT_JACOBIAN, MASS_MATRIX, NH, NM, NV, PARTITION_LOST, RUNNING
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
from runtime.integrate.row_rank import independent_rows

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
    scale_jacobian(not counters[HAVE_PARTITION], addresses, sizes, p, t, y, w)
    n_positions, n_rates, w.numbers[QUALITY] = independent_rows(sizes[NH], w.scaled, w.rows, w.columns)
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
def is_worn(w):
    """Whether the partition has become worse than another may be."""
    return not w.numbers[LATEST] >= WORN * w.numbers[QUALITY]
