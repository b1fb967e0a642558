"""Derivatives at the end of a step of the generalised-α method by what it travels: rotation vectors for quaternions."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.alpha.constrained_work import SLOPE, TRAVEL
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.jacobian import by_positions
from symgen.runtime.integrate.quaternions import chart_variation, n_quaternions, quaternion_at


@jitted
def by_travel(sizes, row, w):
    """Write the derivative by what the step travels, of which `row` holds that by q, to `w.vectors[SLOPE]`."""
    slope = w.vectors[SLOPE]
    by_positions(sizes, w.arguments, row, slope)
    for i in range(sizes[at.NV]):
        slope[i] = -slope[i]
    rotate_back(sizes, w)


@jitted
def gradient_by_travel(k, sizes, w):
    """Write row `k` of G at the end of the step, by what it travels, to `w.vectors[SLOPE]`."""
    first = (sizes[at.NV] + k) * w.arguments.shape[0] + sizes[at.NQ] + sizes[at.NV]
    copy(w.derivative[first : first + sizes[at.NV]], w.vectors[SLOPE])
    rotate_back(sizes, w)


@jitted
def rotate_back(sizes, w):
    """Make derivatives by small turns at the end of the step, in `w.vectors[SLOPE]`, those by rotation vectors."""
    slope, travel = w.vectors[SLOPE], w.vectors[TRAVEL]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        # A row times the matrix of `chart_variation`: its transpose, which is that of the opposite turn.
        slope[j], slope[j + 1], slope[j + 2] = chart_variation(
            -travel[j], -travel[j + 1], -travel[j + 2], slope[j], slope[j + 1], slope[j + 2]
        )


@jitted
def dot(a, b):
    """Return the sum of the products of two vectors' entries."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total
