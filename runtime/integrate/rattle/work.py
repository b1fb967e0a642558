"""Work arrays of RATTLE, and what they carry from step to step."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.copying import copy

# Counters of this family: whether work holds M, G and ∂M/∂q of the current positions, and guesses for the next step.
HAVE_START, HAVE_GUESS = range(16, 18)

# `numbers` of the work arrays: the smallest correction so far and how often none was smaller; the step of the guesses,
# and that kept while frames are written.
SMALLEST, STALLS, H_GUESS, H_KEPT = range(4)
N_NUMBERS = 4

# Rows of `vectors`: the mean rate of the step; the rate that derivatives are taken at; the momentum and the push
# h/2 (L_q + Q) at one end; half the change of the rate in the last step; what is kept while frames are written.
MEAN, PROBE, MOMENTUM, PUSH, HALF_CHANGE, KEPT_PROBE, KEPT_CHANGE = range(7)
N_VECTORS = 7
# Blocks of `masses` and `slopes`, for the start and the end of the step, and of `slopes` for -∂(M v)/∂q.
START, END, TURN = range(3)
KEPT = 2  # in `impulses`
# Rows of `states`.
TRIAL, Y_OLD, Y_SUB, REST, KEPT_REST, TRAVEL = range(6)
N_STATES = 6


class RattleWork(NamedTuple):
    """Work arrays of `advance_rattle`, with k = nv + m rates and multipliers.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    states : ndarray, shape (N_STATES, NY)
        A state that kernels are called with, that at the start of the step, that which the composition has come to,
        what rounding dropped from its positions, and from those that are kept while frames are written, and what the
        mean rate changes of positions.
    vectors : ndarray, shape (N_VECTORS, nv)
    impulses : ndarray, shape (3, m)
        Half the step times the multipliers, at the start and at the end; those kept while frames are written.
    masses : ndarray, shape (2, nv * nv)
        M at the start and at the end.
    slopes : ndarray, shape (3, nv, nv)
        -∂residual/∂q with a = 0 at the start and at the end; -∂(M v)/∂q.
    gradients : ndarray, shape (2, m * nv)
        G at the start and at the end.
    arguments, derivative : ndarray
        What the kernel `residual_jacobian` reads and writes.
    residual : ndarray, shape (nh + m,)
    matrix, factors : ndarray, shape (k, k)
    right : ndarray, shape (k, 1)
    pivots : ndarray of int64, shape (k,)
    scale : ndarray, shape (k,)
    row : ndarray, shape (N_ROW,)
        The rhs row of the new state.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    states: np.ndarray
    vectors: np.ndarray
    impulses: np.ndarray
    masses: np.ndarray
    slopes: np.ndarray
    gradients: np.ndarray
    arguments: np.ndarray
    derivative: np.ndarray
    residual: np.ndarray
    matrix: np.ndarray
    factors: np.ndarray
    right: np.ndarray
    pivots: np.ndarray
    scale: np.ndarray
    row: np.ndarray
    scratch: np.ndarray


@jitted
def rattle_work_size(sizes):
    """Length of `work` for `advance_rattle`."""
    nv, m = sizes[at.NV], sizes[at.NM]
    k = nv + m
    n_arguments = sizes[at.NQ] + nv + k
    own = (
        N_NUMBERS + N_STATES * sizes[at.NY] + N_VECTORS * nv + 3 * m + 5 * nv * nv + 2 * m * nv + n_arguments
    )
    own += k * n_arguments + sizes[at.NH] + m + 2 * k * k + 3 * k + sizes[at.N_ROW]
    return own + finish_scratch_size(sizes)


@jitted
def rattle_work(sizes, work):
    """Divide `work`, of length `rattle_work_size(sizes)`, into a `RattleWork`."""
    nv, m, ny = sizes[at.NV], sizes[at.NM], sizes[at.NY]
    k = nv + m
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    vectors, rest = rest[: N_VECTORS * nv].reshape((N_VECTORS, nv)), rest[N_VECTORS * nv :]
    impulses, rest = rest[: 3 * m].reshape((3, m)), rest[3 * m :]
    masses, rest = rest[: 2 * nv * nv].reshape((2, nv * nv)), rest[2 * nv * nv :]
    slopes, rest = rest[: 3 * nv * nv].reshape((3, nv, nv)), rest[3 * nv * nv :]
    gradients, rest = rest[: 2 * m * nv].reshape((2, m * nv)), rest[2 * m * nv :]
    n_arguments = sizes[at.NQ] + nv + k
    arguments, rest = rest[:n_arguments], rest[n_arguments:]
    derivative, rest = rest[: k * n_arguments], rest[k * n_arguments :]
    residual, rest = rest[: sizes[at.NH] + m], rest[sizes[at.NH] + m :]
    matrix, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    factors, rest = rest[: k * k].reshape((k, k)), rest[k * k :]
    right, rest = rest[:k].reshape((k, 1)), rest[k:]
    pivots, rest = rest[:k].view(np.int64), rest[k:]
    scale, rest = rest[:k], rest[k:]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    return RattleWork(
        numbers, states, vectors, impulses, masses, slopes, gradients, arguments, derivative, residual, matrix,
        factors, right, pivots, scale, row, rest,
    )  # fmt: skip


@jitted
def keep_guess(w):
    """Keep what the next step starts from, while other steps are taken."""
    copy(w.vectors[PROBE], w.vectors[KEPT_PROBE])
    copy(w.vectors[HALF_CHANGE], w.vectors[KEPT_CHANGE])
    copy(w.impulses[START], w.impulses[KEPT])
    copy(w.states[REST], w.states[KEPT_REST])
    w.numbers[H_KEPT] = w.numbers[H_GUESS]


@jitted
def restore_guess(w):
    """Undo what has changed since `keep_guess`."""
    copy(w.vectors[KEPT_PROBE], w.vectors[PROBE])
    copy(w.vectors[KEPT_CHANGE], w.vectors[HALF_CHANGE])
    copy(w.impulses[KEPT], w.impulses[START])
    copy(w.states[KEPT_REST], w.states[REST])
    w.numbers[H_GUESS] = w.numbers[H_KEPT]
