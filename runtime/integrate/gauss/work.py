"""Work arrays of the Gauss methods, and what they carry from step to step."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import jacobian_work_size

# Counters of this family: whether work holds the last step's accelerations, a Jacobian, factors; and whether the
# fixed-point iteration has once failed, so that Newton's is used.
HAVE_HISTORY, HAVE_JACOBIAN, HAVE_FACTORS, STIFF = range(16, 20)

# `numbers` of the work arrays.
FACTORED_FOR, EXTRAPOLATED_FOR, H_HISTORY, SMALLEST, STALLS = range(5)
N_NUMBERS = 5

# Rows of `states` behind those of the stages.
N_STATES = 3
# Where `weights` holds the interpolation for the next step, and for a frame.
NEXT_STEP, FRAME = range(2)


class GaussWork(NamedTuple):
    """Work arrays of `advance_gauss`, with s stages.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    history : ndarray, shape (nv, s)
        Accelerations at the nodes of the last step, of length `numbers[H_HISTORY]`.
    impulses, travels : ndarray, shapes (nv, s), (nq, s)
        h b_j times the acceleration and the derivative of q at node j.
    sums : ndarray, shape (nq, s)
        What these add up to at each node.
    weights : ndarray, shape (2, s, s)
        Values of the interpolation of `history`, in row j at place i.
    states : ndarray, shape (s + 3, NY)
        Arguments of the stages; the new state, what rounding dropped from it, the old state.
    rows : ndarray, shape (s, N_ROW)
    change : ndarray, shape (nv,)
        The largest change of the impulses in an iteration.
    jacobian : ndarray, shape (nv, 2 nv)
    matrices, pivots : ndarray, shapes (k, nv, nv), (k, nv)
        Factors of 1 - h λ ∂a/∂v - h² λ² ∂a/∂q for every eigenvalue.
    complex : ndarray, shape (nv,)
    implicit, scratch : ndarray
        See `acceleration_jacobian` and `finish_step`.
    """

    numbers: np.ndarray
    history: np.ndarray
    impulses: np.ndarray
    travels: np.ndarray
    sums: np.ndarray
    weights: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    change: np.ndarray
    jacobian: np.ndarray
    matrices: np.ndarray
    pivots: np.ndarray
    complex: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def gauss_work_size(method, sizes):
    """Length of `work` for `advance_gauss`."""
    s, k, nq, nv = method.c.shape[0], method.eigenvalues.shape[0], sizes[at.NQ], sizes[at.NV]
    own = N_NUMBERS + 2 * s * (nq + nv) + 2 * s * s + (s + N_STATES) * sizes[at.NY] + s * sizes[at.N_ROW] + nv
    own += 2 * nv * nv + 2 * k * nv * nv + k * nv + 2 * nv
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def gauss_work(method, sizes, work):
    """Divide `work`, of length `gauss_work_size(method, sizes)`, into a `GaussWork`."""
    s, k, nq, nv = method.c.shape[0], method.eigenvalues.shape[0], sizes[at.NQ], sizes[at.NV]
    ny, n_row = sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    history, rest = rest[: s * nv].reshape((nv, s)), rest[s * nv :]
    impulses, rest = rest[: s * nv].reshape((nv, s)), rest[s * nv :]
    travels, rest = rest[: s * nq].reshape((nq, s)), rest[s * nq :]
    sums, rest = rest[: s * nq].reshape((nq, s)), rest[s * nq :]
    weights, rest = rest[: 2 * s * s].reshape((2, s, s)), rest[2 * s * s :]
    states, rest = rest[: (s + N_STATES) * ny].reshape((s + N_STATES, ny)), rest[(s + N_STATES) * ny :]
    rows, rest = rest[: s * n_row].reshape((s, n_row)), rest[s * n_row :]
    change, rest = rest[:nv], rest[nv:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    matrices, rest = (
        rest[: 2 * k * nv * nv].view(np.complex128).reshape((k, nv, nv)),
        rest[2 * k * nv * nv :],
    )
    pivots, rest = rest[: k * nv].view(np.int64).reshape((k, nv)), rest[k * nv :]
    vector, rest = rest[: 2 * nv].view(np.complex128), rest[2 * nv :]
    n = jacobian_work_size(sizes)
    return GaussWork(
        numbers, history, impulses, travels, sums, weights, states, rows, change, jacobian, matrices, pivots,
        vector, rest[:n], rest[n:],
    )  # fmt: skip
