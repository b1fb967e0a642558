"""Work arrays and counters of the generalised-α method."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.newton import N_MONITOR

# Counters of this family: whether work holds a Jacobian, and factors (for steps of length FACTORED_FOR).
HAVE_JACOBIAN, HAVE_FACTORS = range(16, 18)

FACTORED_FOR = N_MONITOR  # in `numbers`, behind Newton's monitor
N_NUMBERS = N_MONITOR + 1

# Rows of `vectors`.
AVERAGE, NEW_AVERAGE, ACCELERATION, CORRECTION = range(4)


class AlphaWork(NamedTuple):
    """Work arrays of `advance_generalized_alpha`.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        [∂a/∂q, ∂a/∂v].
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of the Newton matrix.
    vectors : ndarray, shape (4, nv)
        A at the start and at the end of the step, a at its end, a correction of that.
    y_new : ndarray, shape (NY,)
    row : ndarray, shape (N_ROW,)
        The rhs row of the new state.
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    vectors: np.ndarray
    y_new: np.ndarray
    row: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def alpha_work_size(sizes):
    """Length of `work` for `advance_generalized_alpha`."""
    nv = sizes[at.NV]
    own = N_NUMBERS + 3 * nv * nv + 5 * nv + sizes[at.NY] + sizes[at.N_ROW]
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def alpha_work(sizes, work):
    """Divide `work`, of length `alpha_work_size(sizes)`, into an `AlphaWork`."""
    nv, ny, n_row = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    vectors, rest = rest[: 4 * nv].reshape((4, nv)), rest[4 * nv :]
    y_new, rest = rest[:ny], rest[ny:]
    row, rest = rest[:n_row], rest[n_row:]
    n = jacobian_work_size(sizes)
    return AlphaWork(numbers, jacobian, matrix, pivots, vectors, y_new, row, rest[:n], rest[n:])
