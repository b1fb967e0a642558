"""What bdf keeps between calls and within a step: its counters, numbers and work arrays."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.bdf.coefficients import MAX_ORDER
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.newton import N_MONITOR

# Counters of this family: the order; steps of equal length and order; failures in a row; whether work holds a history
# (that of an event: up to KEPT), a Jacobian, one of the present state, factors.
ORDER, N_EQUAL, FAILURES, HAVE_HISTORY, HAVE_JACOBIAN, JACOBIAN_IS_FRESH, HAVE_FACTORS = range(16, 23)

# `numbers` of the work arrays, behind Newton's monitor: the distance of the points of the history, the time of its
# newest one, the γ = h / α that factors are for, iterations of the last Newton, its bound; of
# configurations where constraints lose rank (see `singular.py`) the last pivot ratio that was not zero, which part of
# the rates is left open, the step far from them.
SPACING, NEWEST, FACTORED_FOR, ITERATIONS, NEWTON_BOUND = range(N_MONITOR, N_MONITOR + 5)
PIVOT_RATIO, LEFT_OPEN, FAR_STEP = range(N_MONITOR + 5, N_MONITOR + 8)
# Power [W] at the newest point, and at the one before it.
POWER, POWER_BEFORE = range(N_MONITOR + 8, N_MONITOR + 10)
N_NUMBERS = N_MONITOR + 10

N_DIFFERENCES = MAX_ORDER + 3
# Rows of `states`.
PREDICTED, PAST, CHANGE, Y_NEW, SCALE, KEPT = range(6)
N_STATES = 6
N_COLUMNS = MAX_ORDER + 1


class BdfWork(NamedTuple):
    """Work arrays of bdf.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    differences : ndarray, shape (8, NY)
        Backward differences ∇ⁱ of the state at the newest point; rows order + 1 and order + 2 are those of the last
        step, for choosing the order.
    states : ndarray, shape (6, NY)
        The predicted state; Σ γ_i ∇ⁱ y / α; the new state minus the predicted; the new state; the tolerance of every
        component; the state at which an event has stopped the last call.
    weights : ndarray, shape (2, 6, 6)
        See `resample`.
    jacobian : ndarray, shape (nv, 2 nv)
        [A, B] = [∂a/∂q, ∂a/∂v], see `acceleration_jacobian`.
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of g - B - A/g, with g = α/h; see `factor` for quaternions.
    correction : ndarray, shape (nv,)
    row : ndarray, shape (N_ROW,)
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    numbers: np.ndarray
    differences: np.ndarray
    states: np.ndarray
    weights: np.ndarray
    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    correction: np.ndarray
    row: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def bdf_work_size(sizes):
    """Length of `work` for `advance_bdf`."""
    nv, ny = sizes[at.NV], sizes[at.NY]
    own = (
        N_NUMBERS
        + (N_DIFFERENCES + N_STATES) * ny
        + 2 * N_COLUMNS**2
        + 3 * nv * nv
        + 2 * nv
        + sizes[at.N_ROW]
    )
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def bdf_work(sizes, work):
    """Divide `work`, of length `bdf_work_size(sizes)`, into a `BdfWork`."""
    nv, ny = sizes[at.NV], sizes[at.NY]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    n = N_DIFFERENCES * ny
    differences, rest = rest[:n].reshape((N_DIFFERENCES, ny)), rest[n:]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    n = 2 * N_COLUMNS * N_COLUMNS
    weights, rest = rest[:n].reshape((2, N_COLUMNS, N_COLUMNS)), rest[n:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    correction, rest = rest[:nv], rest[nv:]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    n = jacobian_work_size(sizes)
    return BdfWork(
        numbers, differences, states, weights, jacobian, matrix, pivots, correction, row, rest[:n], rest[n:]
    )
