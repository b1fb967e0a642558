"""The history of bdf as backward differences: prediction, new points, new distances, dense output."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.bdf.work import (
    CHANGE,
    N_EQUAL,
    ORDER,
    PAST,
    POWER,
    POWER_BEFORE,
    PREDICTED,
    SPACING,
    Y_NEW,
)
from symgen.runtime.integrate.copying import copy

COEFFICIENTS, SAMPLES = range(2)
# Up to this order work follows from the power along the step. What moves evenly, as bodies that stick to a belt do, has
# no error that would shorten a step or raise the order, while springs on it change its power all the same.
WORK_BY_POWER = 2


@jitted
def predict(method, sizes, order, w):
    """Write Σ ∇ⁱ y, i = 0..order, and Σ γ_i ∇ⁱ y / α, i = 1..order."""
    for i in range(sizes[at.NY]):
        predicted, past = w.differences[0, i], 0.0
        for j in range(1, order + 1):
            predicted += w.differences[j, i]
            past += method.gamma[j] * w.differences[j, i]
        w.states[PREDICTED, i] = predicted
        w.states[PAST, i] = past / method.alpha[order]


@jitted
def add_point(sizes, order, w):
    """Make the new state, `w.states[CHANGE]` beyond the predicted one, the newest point of the history."""
    for i in range(sizes[at.NY]):
        change = w.states[CHANGE, i]
        w.differences[order + 2, i] = change - w.differences[order + 1, i]
        w.differences[order + 1, i] = change
        for j in range(order, 0, -1):
            w.differences[j, i] += w.differences[j + 1, i]
        w.differences[0, i] = w.states[Y_NEW, i]


@jitted
def resample(loop, shift, factor, w):
    """Replace the points of the history by others on its polynomial.

    Parameters
    ----------
    shift : float
        Where the newest point will be, counted from the one there is in distances of points; it may be negative.
    factor : float
        New distance of points over the old one.
    """
    n = loop.counters[ORDER] + 1
    weights, samples = w.weights[COEFFICIENTS], w.weights[SAMPLES]
    for i in range(n):
        # s (s+1) … (s+j-1) / j! at the new points.
        place, value = shift - factor * i, 1.0
        for j in range(n):
            samples[j, i] = value
            value *= (place + j) / (j + 1.0)
    for j in range(n):
        for k in range(j + 1):
            # The k-th backward difference of polynomial j at the newest point; those beyond its degree are 0.
            weights[k, j] = samples[j, 0]
            for i in range(n - 1 - k):
                samples[j, i] -= samples[j, i + 1]
    for i in range(loop.sizes[at.NY]):
        # Row k needs old rows from k on only.
        for k in range(n):
            total = 0.0
            for j in range(k, n):
                total += weights[k, j] * w.differences[j, i]
            w.differences[k, i] = total
    w.numbers[SPACING] *= factor
    loop.counters[N_EQUAL] = 0


@jitted
def history_dense(method, sizes, order, y, w, dense):
    """Fill the rows of `dense` with the polynomial through the points of the history, for the step from `y`."""
    for i in range(sizes[at.NY]):
        for r in range(2, order + 1):
            total = 0.0
            for j in range(r, order + 1):
                total += method.rows[r, j] * w.differences[j, i]
            dense[r, i] = total
        for r in range(order + 1, method.rows.shape[0]):
            dense[r, i] = 0.0
        dense[1, i] = w.states[Y_NEW, i] - y[i]
    copy(y, dense[0])
    if sizes[at.NW] > 0 and order <= WORK_BY_POWER:
        # The cubic through work and power at both ends.
        n, h = sizes[at.NQ] + sizes[at.NV], w.numbers[SPACING]
        dense[2, n] = h * w.numbers[POWER_BEFORE] - dense[1, n]
        dense[3, n] = dense[1, n] - h * w.numbers[POWER] - dense[2, n]
