"""Work arrays of the generalised-α method with constraints on positions."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.newton import N_MONITOR

# Counters of this family: whether work holds what a step starts from, and factors (for steps of length FACTORED_FOR).
HAVE_START, HAVE_FACTORS, TRUSTED = range(16, 19)

# `numbers`, behind Newton's monitor: the steps that factors and the start are for.
FACTORED_FOR, STARTED_FOR = N_MONITOR, N_MONITOR + 1
N_NUMBERS = N_MONITOR + 2

# Rows of `vectors`: A, a and v at the start and at the end of the step; what it moves positions by, and a derivative by
# that.
AVERAGE, NEW_AVERAGE, ACCELERATION, NEW_ACCELERATION, RATE, NEW_RATE, TRAVEL, SLOPE = range(8)
N_VECTORS = 8
# Rows of `multipliers`.
START, END = range(2)


class ConstrainedAlphaWork(NamedTuple):
    """Work arrays of `advance_constrained_alpha`, with k unknowns.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    vectors : ndarray, shape (N_VECTORS, nv)
    multipliers : ndarray, shape (2, m)
        λ at the start and at the end of the step.
    stabiliser : ndarray, shape (nh,)
        What moves positions along the rows of G, in units of accelerations.
    gradient : ndarray, shape (m * nv,)
        G at the start of the step.
    turn : ndarray, shape (m, nv)
        ∂(G v)/∂q, by what the step travels.
    arguments : ndarray, shape (nq + 2 nv + m,)
        (q, v, a, λ).
    derivative : ndarray, shape ((nv + m) (nq + 2 nv + m),)
    residual, drift : ndarray, shapes (nv + m,), (nh + m,)
        What the kernels `residual` and `constraint_residual` write.
    matrix, factors, right, pivots, scale : ndarray
        See `saddle`.
    y_new : ndarray, shape (NY,)
    row : ndarray, shape (N_ROW,)
        The rhs row of the new state.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    vectors: np.ndarray
    multipliers: np.ndarray
    stabiliser: np.ndarray
    gradient: np.ndarray
    turn: np.ndarray
    arguments: np.ndarray
    derivative: np.ndarray
    residual: np.ndarray
    drift: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    right: np.ndarray
    pivots: np.ndarray
    scale: np.ndarray
    y_new: np.ndarray
    row: np.ndarray
    scratch: np.ndarray


@jitted
def n_unknowns(method, sizes):
    """Return how many unknowns a step has: accelerations, multipliers, and what stabilises positions."""
    return sizes[at.NV] + sizes[at.NM] + (sizes[at.NH] if method.stabilised else 0)


@jitted
def constrained_alpha_work_size(method, sizes):
    """Length of `work` for `advance_constrained_alpha`."""
    nv, nh, m, k = sizes[at.NV], sizes[at.NH], sizes[at.NM], n_unknowns(method, sizes)
    n_arguments = sizes[at.NQ] + 2 * nv + m
    own = N_NUMBERS + N_VECTORS * nv + 2 * m + nh + 2 * m * nv + n_arguments * (1 + nv + m) + nv + m + nh + m
    return own + 2 * k * k + 3 * k + sizes[at.NY] + sizes[at.N_ROW] + finish_scratch_size(sizes)


@jitted
def constrained_alpha_work(method, sizes, work):
    """Divide `work`, of length `constrained_alpha_work_size(method, sizes)`, into a `ConstrainedAlphaWork`."""
    nv, nh, m, k = sizes[at.NV], sizes[at.NH], sizes[at.NM], n_unknowns(method, sizes)
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    vectors, rest = rest[: N_VECTORS * nv].reshape((N_VECTORS, nv)), rest[N_VECTORS * nv :]
    multipliers, rest = rest[: 2 * m].reshape((2, m)), rest[2 * m :]
    stabiliser, rest = rest[:nh], rest[nh:]
    gradient, rest = rest[: m * nv], rest[m * nv :]
    n_arguments = sizes[at.NQ] + 2 * nv + m
    turn, rest = rest[: m * nv].reshape((m, nv)), rest[m * nv :]
    arguments, rest = rest[:n_arguments], rest[n_arguments:]
    derivative, rest = rest[: (nv + m) * n_arguments], rest[(nv + m) * n_arguments :]
    residual, rest = rest[: nv + m], rest[nv + m :]
    drift, rest = rest[: nh + m], rest[nh + m :]
    matrix, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    factors, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    right, rest = rest[:k].reshape((k, 1)), rest[k:]
    pivots, rest = rest[:k].view(np.int64), rest[k:]
    scale, rest = rest[:k], rest[k:]
    y_new, rest = rest[: sizes[at.NY]], rest[sizes[at.NY] :]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    return ConstrainedAlphaWork(
        numbers, vectors, multipliers, stabiliser, gradient, turn, arguments, derivative, residual, drift, matrix,
        factors, right, pivots, scale, y_new, row, rest,
    )  # fmt: skip
