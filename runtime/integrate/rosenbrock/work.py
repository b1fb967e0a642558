"""Work arrays of rodas5p."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.layout import N_ROW, NV, NY
from symgen.runtime.integrate.rosenbrock.coefficients import N_STAGES

# Rows of `states`, `rows` and `vectors`.
Y_STAGE, Y_NEW = range(2)
STAGE, F_NEW, F_LATER = range(3)
SLOPE, POWER = range(2)


class RodasWork(NamedTuple):
    """Work arrays of rodas5p.

    Attributes
    ----------
    jacobian : ndarray, shape (nv, 2 nv)
        [A, B] = [∂a/∂q, ∂a/∂v].
    matrix, pivots : ndarray, shapes (nv, nv), (nv,)
        Factors of g - B - A/g, with g = 1/(h γ).
    increments : ndarray, shape (8, 2 nv)
        Of what rates move, which are rotation vectors for quaternions, and of the rates.
    states : ndarray, shape (2, NY)
        The argument of a stage; the new state.
    rows : ndarray, shape (3, N_ROW)
        The rhs rows of a stage, of the new state, of another state.
    vectors : ndarray, shape (2, nv + 2)
        ∂a/∂t; power at the start, at two places within, and at the end of the step.
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    jacobian: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    increments: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    vectors: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def rodas_work_size(sizes):
    """Length of `work` for `advance_rodas5p`."""
    nv = sizes[NV]
    own = 3 * nv * nv + nv + 2 * N_STAGES * nv + 2 * sizes[NY] + 3 * sizes[N_ROW] + 2 * (nv + 2)
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def rodas_work(sizes, work):
    """Divide `work`, of length `rodas_work_size(sizes)`, into a `RodasWork`."""
    nv, ny, n_row = sizes[NV], sizes[NY], sizes[N_ROW]
    jacobian, rest = work[: 2 * nv * nv].reshape((nv, 2 * nv)), work[2 * nv * nv :]
    matrix, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    pivots, rest = rest[:nv].view(np.int64), rest[nv:]
    n_increments = 2 * N_STAGES * nv
    increments, rest = rest[:n_increments].reshape((N_STAGES, 2 * nv)), rest[n_increments:]
    states, rest = rest[: 2 * ny].reshape((2, ny)), rest[2 * ny :]
    rows, rest = rest[: 3 * n_row].reshape((3, n_row)), rest[3 * n_row :]
    vectors, rest = rest[: 2 * (nv + 2)].reshape((2, nv + 2)), rest[2 * (nv + 2) :]
    n = jacobian_work_size(sizes)
    return RodasWork(jacobian, matrix, pivots, increments, states, rows, vectors, rest[:n], rest[n:])
