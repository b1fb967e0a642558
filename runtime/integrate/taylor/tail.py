"""What a Taylor series leaves out, estimated from its last terms."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at

# A recurrence that leaves more than this of the last terms, squared, tells nothing about the next ones.
_MOST_LEFT = 0.25
# How far the roots of z^2 = a z + b, by which terms decay, stay away from 1 and -1, about.
_LEAST_DECAY = 0.25
# Added to the diagonal of the normal equations, relative: terms of one ratio fit many a and b, of the same sum.
_RIDGE = 1e-10
_TINY = 1e-200  # sums of squares below it are not exact, and what follows such terms does not matter


@jitted
def has_tail(sizes):
    """Whether there are more terms than it takes to find a recurrence: those of a single rate fit one in any case."""
    return sizes[at.NY] - sizes[at.NQ] > 1


@jitted
def tail_factors(h, order, sizes, series):
    """Return what the last two rows of rates (and work) are multiplied by to give the sum of all terms behind them.

    Far from the start, the terms y_k h^k of all components are ruled by the singularities nearest to it, one on the
    real axis or a complex pair, and nearly satisfy one recurrence y_(k+1) = a y_k + b y_(k-1) (Chang and Corliss,
    J. Inst. Maths Applics 25 (1980) 349). Least squares over the last four terms find a and b, and the recurrence
    sums itself: what follows y_k is ((a + b) y_k + b y_(k-1)) / (1 - a - b).

    Parameters
    ----------
    h : float [s]
    order : int
        Of the positions; rates and work have terms up to one less.
    series : ndarray, shape (order + 1, NY)

    Returns
    -------
    tuple of float
        For row order - 2 and for row order - 1; both 0 where terms follow no such recurrence, or that cannot be told.
    """
    if not has_tail(sizes):
        return 0.0, 0.0
    scale3 = h ** (order - 4)
    scale2 = scale3 * h
    scale1 = scale2 * h
    scale0 = scale1 * h
    aa, ab, bb, ya, yb, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(sizes[at.NQ], sizes[at.NY]):
        y0 = scale0 * series[order - 1, i]
        y1 = scale1 * series[order - 2, i]
        y2 = scale2 * series[order - 3, i]
        y3 = scale3 * series[order - 4, i]
        yy += y0 * y0 + y1 * y1
        ya += y0 * y1 + y1 * y2
        yb += y0 * y2 + y1 * y3
        aa += y1 * y1 + y2 * y2
        ab += y1 * y2 + y2 * y3
        bb += y2 * y2 + y3 * y3
    aa *= 1.0 + _RIDGE
    bb *= 1.0 + _RIDGE
    determinant = aa * bb - ab * ab
    if not (determinant > _TINY and yy > _TINY):
        return 0.0, 0.0
    a = (ya * bb - yb * ab) / determinant
    b = (yb * aa - ya * ab) / determinant
    most = _MOST_LEFT * yy
    left = yy - a * ya - b * yb
    if not (left < most and 1.0 - b - abs(a) > _LEAST_DECAY):
        return 0.0, 0.0
    factor = (most - left) / (most * (1.0 - a - b))
    return factor * b * scale1, factor * (a + b) * scale0


@jitted
def add_tail(h, order, sizes, series, total, lost, slope):
    """Add what follows the last terms to the sum of a series at `h`, what rounding lost in it, and its derivative.

    Nothing where `tail_factors` cannot tell. Positions are left as they are: their terms are smaller by h / order.

    Parameters
    ----------
    total, lost, slope : ndarray, shape (NY,)
        Changed in place.
    """
    before, last = tail_factors(h, order, sizes, series)
    if before == 0.0 and last == 0.0:
        return
    turns = order / h
    for i in range(sizes[at.NQ], sizes[at.NY]):
        tail = before * series[order - 2, i] + last * series[order - 1, i]
        rounded = total[i] + tail
        lost[i] += tail - (rounded - total[i])
        total[i] = rounded
        slope[i] += turns * tail


@jitted
def append_tail(order, sizes, series):
    """Make what follows the last terms of a series in the place θ of a step its last row, for dense output."""
    before, last = tail_factors(1.0, order, sizes, series)
    for i in range(sizes[at.NQ], sizes[at.NY]):
        series[order, i] = before * series[order - 2, i] + last * series[order - 1, i]


@jitted
def drop_tail(order, sizes, series):
    """Clear the last row of rates and work again: the kernel that computes series does not write it."""
    for i in range(sizes[at.NQ], sizes[at.NY]):
        series[order, i] = 0.0
