"""Work arrays of the one-stage implicit methods."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.newton import N_MONITOR

FACTORED_FOR = N_MONITOR  # in `numbers`, behind Newton's monitor
N_NUMBERS = N_MONITOR + 1

# Rows of `vectors` and `states`.
ACCELERATION, CORRECTION = range(2)
STAGE, Y_NEW = range(2)


class StageWork(NamedTuple):
    """Work arrays of `advance_implicit`. They are few, because each makes every call of a jitted function longer.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        See `acceleration_jacobian`.
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of the Newton matrix.
    vectors : ndarray, shape (2, nv)
        Accelerations of the last step; a correction of v.
    states : ndarray, shape (2, NY)
        The stage; the new state.
    row : ndarray, shape (N_ROW,)
        The rhs row of the stage.
    implicit : ndarray
        See `acceleration_jacobian`.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    vectors: np.ndarray
    states: np.ndarray
    row: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def implicit_work_size(sizes):
    """Length of `work` for `advance_implicit`."""
    nv = sizes[at.NV]
    own = N_NUMBERS + 3 * nv * nv + 3 * nv + 2 * sizes[at.NY] + sizes[at.N_ROW]
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def stage_work(sizes, work):
    """Divide `work`, of length `implicit_work_size(sizes)`, into a `StageWork`."""
    nv, ny = sizes[at.NV], sizes[at.NY]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    vectors, rest = rest[: 2 * nv].reshape((2, nv)), rest[2 * nv :]
    states, rest = rest[: 2 * ny].reshape((2, ny)), rest[2 * ny :]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    n = jacobian_work_size(sizes)
    return StageWork(numbers, jacobian, matrix, pivots, vectors, states, row, rest[:n], rest[n:])
