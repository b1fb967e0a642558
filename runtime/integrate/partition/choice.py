"""Choose which coordinates are integrated and which follow from the constraints.

Wehage, Haug, J. Mech. Des. 104 (1982) 247: elimination of G with complete pivoting; the coordinates of the pivots
depend on the others.
"""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import lu_solve
from symgen.runtime.integrate.partition.dependents import evaluate_jacobian, factor_dependents
from symgen.runtime.integrate.partition.work import (
    FIRST_QUALITY,
    FIRST_RANK,
    FOLLOWED,
    FOLLOWED_FIRST,
    HAVE_PARTITION,
    LATEST,
    LATEST_POSITIONS,
    N_POSITIONS,
    N_RATES,
    POSITIONS_PIVOT,
    RATES_PIVOT,
    START,
    SWITCHES,
)
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.row_rank import eliminate, independent_rows

# No rate of the dependent ones changes more than this many times as fast as an independent one that is changed alone,
# both in units of equal kinetic energy: errors of the independent ones grow by no more. Another partition is taken
# where that has become worse by as much again.
_MOST_FOLLOWED = 1.3
# A step is too long in which the smallest pivot falls to this part of what it was.
LEAST = 0.4
# All are lost where the smallest pivot of the best has fallen to this part of the first one's: rounding of the
# dependent coordinates grows by its reciprocal, and which branch of a mechanism they follow is then left to chance.
LOST = 1e-3
_EXCHANGES = 8


@jitted
def choose_partition(loop, t, w):
    """Choose the dependent coordinates at a state on the constraints; returns a status.

    PARTITION_LOST where fewer constraints are independent than at the first choice, or nearly so: no coordinates serve.
    """
    n_before = loop.counters[N_RATES]
    for k in range(n_before):
        w.pivots[k] = w.columns[k]
    scale_jacobian(not loop.counters[HAVE_PARTITION], loop, t, w)
    n_positions, n_rates, quality = independent_rows(loop.sizes[at.NH], w.scaled, w.rows, w.columns)
    exchange(0, n_positions, w.scaled, w.columns)
    if n_rates > n_positions:
        n_rates, _ = eliminate(n_positions, n_rates, w.scaled, w.rows, w.columns)
        exchange(n_positions, n_rates, w.scaled, w.columns)
    if loop.counters[HAVE_PARTITION]:
        loop.counters[SWITCHES] += differ(w.pivots, n_before, w.columns, n_rates)
    else:
        loop.counters[FIRST_RANK] = n_rates
        w.numbers[FIRST_QUALITY] = quality
    loop.counters[HAVE_PARTITION] = 1
    loop.counters[N_POSITIONS], loop.counters[N_RATES] = n_positions, n_rates
    kept = n_rates >= loop.counters[FIRST_RANK] and quality >= LOST * w.numbers[FIRST_QUALITY]
    if not (kept and measure(START, loop, t, loop.y, w)):
        return at.PARTITION_LOST
    w.numbers[FOLLOWED_FIRST] = w.numbers[START + FOLLOWED]
    return at.RUNNING


@jitted
def exchange(first, end, scaled, columns):
    """Put independent columns in the place of dependent ones `first` to `end` - 1 until none follows others too fast.

    Complete pivoting alone may leave columns that are nearly dependent on each other. Those of largest volume would
    follow at most once as fast: Goreinov, Tyrtyshnikov, Zamarashkin, Linear Algebra Appl. 261 (1997) 1.

    Parameters
    ----------
    scaled, columns : ndarray
        As `independent_rows` leaves them; the rows `first` to `end` - 1 become those that give dependent columns by
        the others.
    """
    m, nv = scaled.shape
    for k in range(end - 1, first - 1, -1):
        solve_row(k, first, end, scaled)
    for _ in range(_EXCHANGES * (end - first)):
        largest, row, column = _MOST_FOLLOWED, first, end
        for i in range(first, end):
            for j in range(end, nv):
                if abs(scaled[i, j]) > largest:
                    largest, row, column = abs(scaled[i, j]), i, j
        if largest == _MOST_FOLLOWED:
            return
        columns[row], columns[column] = columns[column], columns[row]
        for i in range(m):
            scaled[i, row], scaled[i, column] = scaled[i, column], scaled[i, row]
        solve_row(row, first, m, scaled)


@jitted
def solve_row(k, first, end, scaled):
    """Solve row `k` for its column `k`, and take that out of the other rows from `first` to `end` - 1."""
    nv = scaled.shape[1]
    inverse = 1.0 / scaled[k, k]
    for j in range(nv):
        scaled[k, j] *= inverse
    for i in range(first, end):
        factor = scaled[i, k]
        if i != k and factor != 0.0:
            for j in range(nv):
                scaled[i, j] -= factor * scaled[k, j]


@jitted
def measure(first, loop, t, y, w):
    """Write how well the partition serves at a state to `w.numbers`, from `first` on; whether it does at all."""
    n_positions, n_rates = loop.counters[N_POSITIONS], loop.counters[N_RATES]
    followed = 0.0
    if 0 < n_positions < n_rates:
        if not factor_dependents(n_positions, loop, t, y, w):
            return False
        followed = most_followed(n_positions, loop.sizes, w)
        w.numbers[first + POSITIONS_PIVOT] = w.numbers[LATEST]
    if n_rates > 0 and not factor_dependents(n_rates, loop, t, y, w):
        return False
    w.numbers[first + RATES_PIVOT] = w.numbers[LATEST]
    if n_positions == n_rates:
        w.numbers[first + POSITIONS_PIVOT] = w.numbers[LATEST]
    w.numbers[first + FOLLOWED] = max(followed, most_followed(n_rates, loop.sizes, w))
    return True


@jitted
def most_followed(n, sizes, w):
    """Return how fast one of `n` dependent rates changes at most where an independent one does, with their factors."""
    nv = sizes[at.NV]
    most = 0.0
    for j in range(n, nv):
        column = w.columns[j]
        for k in range(n):
            row = w.rows[k]
            w.right[k] = w.jacobian[row * nv + column] * w.row_scale[row] * w.column_scale[column]
        lu_solve(w.square[: n * n].reshape((n, n)), w.pivots, w.right[:n])
        for k in range(n):
            most = max(most, abs(w.right[k]))
    return most


@jitted
def differ(some, n, others, n_others):
    """Whether the first `n` entries of one array are others than the first `n_others` of another, in any order."""
    for i in range(n):
        found = False
        for j in range(n_others):
            found = found or some[i] == others[j]
        if not found:
            return True
    return n != n_others


@jitted
def scale_jacobian(first, loop, t, w):
    """Write G to `w.scaled`, columns in units of equal kinetic energy, rows in units of the largest entry so far.

    Not of the largest entry now: a row that vanishes as a whole loses rank as well.
    """
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    call_kernel(loop.addresses[at.MASS_MATRIX], t, loop.y, loop.p, w.mass)
    evaluate_jacobian(loop, t, loop.y, w)
    heaviest = 0.0
    for j in range(nv):
        w.column_scale[j] = w.mass[j * nv + j]
        heaviest = max(heaviest, w.column_scale[j])
    rotate_inertias(loop.sizes, w)
    for j in range(nv):
        # What has no mass of its own is best left to the constraints.
        inertia = max(w.column_scale[j], 1e-6 * heaviest)
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
def rotate_inertias(sizes, w):
    """Put the inertias about the axes `w.axes` in place of those about axes of bodies in `w.column_scale`."""
    nv = sizes[at.NV]
    for k in range(n_quaternions(sizes)):
        first = quaternion_at(sizes, k) - k
        for c in range(3):
            inertia = 0.0
            for a in range(3):
                for b in range(3):
                    inertia += w.axes[k, c, a] * w.mass[(first + a) * nv + first + b] * w.axes[k, c, b]
            w.column_scale[first + c] = inertia


@jitted
def serves(least, counters, w):
    """Whether at the latest factorisations pivots are more than `least` of those at the start of the step."""
    positions, rates = w.numbers[START + POSITIONS_PIVOT], w.numbers[START + RATES_PIVOT]
    if counters[N_POSITIONS] > 0 and not w.numbers[LATEST_POSITIONS] / positions > least:
        return False
    return counters[N_RATES] == 0 or w.numbers[LATEST] / rates > least


@jitted
def is_worn(w):
    """Whether dependent rates follow others so much faster than at the choice that another may serve better."""
    return not w.numbers[START + FOLLOWED] <= _MOST_FOLLOWED * max(_MOST_FOLLOWED, w.numbers[FOLLOWED_FIRST])
