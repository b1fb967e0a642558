"""Work arrays of partitioned integration."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.explicit.loop import N_STATES

# Counters of this family: whether a partition has been chosen; how many coordinates and how many rates depend on the
# others; how many did at the first choice; how often another partition was taken since.
HAVE_PARTITION, N_POSITIONS, N_RATES, FIRST_RANK, SWITCHES = range(16, 21)

# `numbers` of the work arrays: the smallest pivot, with the sign of the determinant, at the latest factorisation for
# rates and for positions; quality of the first partition; how fast dependent rates followed others at the last choice;
# then at the start and the end of a step the smallest pivots for positions and rates, and how fast dependents follow.
LATEST, LATEST_POSITIONS, FIRST_QUALITY, FOLLOWED_FIRST, START, END, N_NUMBERS = 0, 1, 2, 3, 4, 7, 10
POSITIONS_PIVOT, RATES_PIVOT, FOLLOWED = range(3)


class PartitionWork(NamedTuple):
    """Work arrays of `advance_partition`.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    stages : ndarray, shape (n_rows, N_ROW)
        Stage derivatives.
    states : ndarray, shape (N_STATES, NY)
        Stage argument, new state, two error estimates.
    mass : ndarray, shape (nv * nv,)
    jacobian : ndarray, shape (m * nv,)
        G as the kernel writes it.
    scaled : ndarray, shape (m, nv)
        G with its rows and columns scaled, being eliminated.
    axes : ndarray, shape (nq - nv, 3, 3)
        Of each quaternion, the axes of the joint's frame in those of the body, as rows.
    residual : ndarray, shape (nh + m,)
    row_scale, column_scale : ndarray, shapes (m,), (nv,)
    rows, columns : ndarray of int64, shapes (m,), (nv,)
        Constraints and coordinates in the order of the pivots: the first N_POSITIONS are solved for positions, the
        first N_RATES for rates.
    square : ndarray, shape (m * m,)
        Factors of the columns that belong to the dependent coordinates.
    pivots : ndarray of int64, shape (m,)
    right : ndarray, shape (m,)
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    stages: np.ndarray
    states: np.ndarray
    mass: np.ndarray
    jacobian: np.ndarray
    scaled: np.ndarray
    axes: np.ndarray
    residual: np.ndarray
    row_scale: np.ndarray
    column_scale: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    square: np.ndarray
    pivots: np.ndarray
    right: np.ndarray
    scratch: np.ndarray


@jitted
def partition_work_size(n_rows, sizes):
    """Length of `work` for a tableau of `n_rows` rows."""
    nv, nh, m = sizes[at.NV], sizes[at.NH], sizes[at.NM]
    own = N_NUMBERS + n_rows * sizes[at.N_ROW] + N_STATES * sizes[at.NY] + nv * nv + 2 * m * nv + nh + m
    return own + 9 * (sizes[at.NQ] - nv) + 2 * m + 2 * nv + m * m + 2 * m + finish_scratch_size(sizes)


@jitted
def partition_work(n_rows, sizes, work):
    """Divide `work`, of length `partition_work_size(n_rows, sizes)`, into a `PartitionWork`."""
    nv, m, ny, n_row = sizes[at.NV], sizes[at.NM], sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    stages, rest = rest[: n_rows * n_row].reshape((n_rows, n_row)), rest[n_rows * n_row :]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    mass, rest = rest[: nv * nv], rest[nv * nv :]
    jacobian, rest = rest[: m * nv], rest[m * nv :]
    scaled, rest = rest[: m * nv].reshape((m, nv)), rest[m * nv :]
    n = sizes[at.NQ] - nv
    axes, rest = rest[: 9 * n].reshape((n, 3, 3)), rest[9 * n :]
    residual, rest = rest[: sizes[at.NH] + m], rest[sizes[at.NH] + m :]
    row_scale, rest = rest[:m], rest[m:]
    column_scale, rest = rest[:nv], rest[nv:]
    rows, rest = rest[:m].view(np.int64), rest[m:]
    columns, rest = rest[:nv].view(np.int64), rest[nv:]
    square, rest = rest[: m * m], rest[m * m :]
    pivots, rest = rest[:m].view(np.int64), rest[m:]
    right, rest = rest[:m], rest[m:]
    return PartitionWork(
        numbers, stages, states, mass, jacobian, scaled, axes, residual, row_scale, column_scale, rows, columns, square,
        pivots, right, rest,
    )  # fmt: skip
