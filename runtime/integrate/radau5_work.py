"""What radau5 keeps between calls and within a step: its counters, numbers and work arrays."""

from typing import NamedTuple

import numpy as np

from runtime.code.jitted import jitted
from runtime.integrate.after_step import finish_scratch_size
from runtime.integrate.jacobian import jacobian_work_size
from runtime.integrate.layout import N_ROW, NV, NY
from runtime.integrate.newton import N_MONITOR

# Counters of this family: whether work holds a Jacobian, one of the present state, factors; and whether
# `dense` and ERROR_OLD are those of the step before.
HAVE_JACOBIAN, JACOBIAN_IS_FRESH, HAVE_FACTORS, HAVE_HISTORY = range(16, 20)

# `numbers` of the work arrays: Newton's monitor, then these.
FACTORED_FOR, NEWTON_BOUND, ITERATIONS, LAST_RATE = range(N_MONITOR, N_MONITOR + 4)
N_NUMBERS = N_MONITOR + 4


# Rows of `states`, of `rows`, of `real_vectors` and `complex_vectors`, of `pairs`, behind those of the three stages.
Y_STAGE, Y_NEW = 3, 4
F_NEW = 3
X, DX = range(2)
SCALE, ERROR = range(2)


class RadauWork(NamedTuple):
    """Work arrays of radau5. They are few, because every array makes every call of a jitted function longer.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        [A, B] = [∂a/∂q, ∂a/∂v], see `acceleration_jacobian`.
    real, complex : ndarray, shape (nv, nv)
        Factors of μ/h - B - A h/μ and ν/h - B - A h/ν; see `factor_stages` for quaternions.
    pivots : ndarray of int64, shape (2, nv)
        Of both.
    states : ndarray, shape (5, NY)
        Increments of (q, v, w) from the start of the step to each stage, in place of a quaternion's the rotation
        vector that turns it; the argument of a stage; the new state.
    rows : ndarray, shape (4, N_ROW)
        The rhs rows of the stages and of the new state.
    real_vectors, complex_vectors : ndarray, shape (2, 2 nv)
        The increments of (positions, v), transformed, and their corrections; of positions only those that turn
        quaternions, as the others follow from those of v.
    pairs : ndarray, shape (2, 2 nv)
        Tolerance and estimated error of every component, for quaternions of the rotation vector.
    implicit : ndarray
        See `acceleration_jacobian`.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    real: np.ndarray
    complex: np.ndarray
    pivots: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    real_vectors: np.ndarray
    complex_vectors: np.ndarray
    pairs: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def radau_work_size(sizes):
    """Length of `work` for `advance_radau5`."""
    nv, ny, n_row = sizes[NV], sizes[NY], sizes[N_ROW]
    own = N_NUMBERS + 5 * nv * nv + 18 * nv + 5 * ny + 4 * n_row
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def radau_work(sizes, work):
    """Divide `work`, of length `radau_work_size(sizes)`, into a `RadauWork`."""
    nv, ny, n_row = sizes[NV], sizes[NY], sizes[N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    real, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    complex_, rest = rest[: 2 * nv * nv].view(np.complex128).reshape((nv, nv)), rest[2 * nv * nv :]
    pivots, rest = rest[: 2 * nv].view(np.int64).reshape((2, nv)), rest[2 * nv :]
    states, rest = rest[: 5 * ny].reshape((5, ny)), rest[5 * ny :]
    rows, rest = rest[: 4 * n_row].reshape((4, n_row)), rest[4 * n_row :]
    real_vectors, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    complex_vectors, rest = rest[: 8 * nv].view(np.complex128).reshape((2, 2 * nv)), rest[8 * nv :]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    n = jacobian_work_size(sizes)
    return RadauWork(
        numbers, jacobian, real, complex_, pivots, states, rows, real_vectors, complex_vectors, pairs,
        rest[:n], rest[n:],
    )  # fmt: skip
