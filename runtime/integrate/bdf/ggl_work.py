"""What bdf keeps when it integrates index-2 equations."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.bdf.work import N_COLUMNS, N_DIFFERENCES, N_NUMBERS, N_STATES
from symgen.runtime.integrate.ggl import blocks_size, equations_size
from symgen.runtime.integrate.jacobian import jacobian_work_size


class BdfGglWork(NamedTuple):
    """Work arrays; those not described here are as in `BdfWork`.

    Attributes
    ----------
    numbers, differences, states, weights, row, implicit, scratch : ndarray
    blocks : ndarray
        See `ggl.divide_blocks`.
    matrix, pivots : ndarray, shapes (nv + m, nv + m), (nv + m)
        Factors of `ggl.set_shifted`'s matrix for g = α/h.
    multipliers : ndarray, shape (m + nh,)
        λ and μ.
    correction : ndarray, shape (nv + m + nh,)
    rates : ndarray, shape (nv,)
        v + C μ, or what a correction adds to that.
    arguments, equations : ndarray
        See `ggl.equation_residuals`.
    """

    numbers: np.ndarray
    differences: np.ndarray
    states: np.ndarray
    weights: np.ndarray
    row: np.ndarray
    blocks: np.ndarray
    matrix: np.ndarray
    pivots: np.ndarray
    multipliers: np.ndarray
    correction: np.ndarray
    rates: np.ndarray
    arguments: np.ndarray
    equations: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def bdf_ggl_work_size(sizes):
    """Length of `work` for `advance_bdf_ggl`."""
    nv, ny, m, nh = sizes[at.NV], sizes[at.NY], sizes[at.NM], sizes[at.NH]
    n = nv + m
    own = (
        N_NUMBERS + (N_DIFFERENCES + N_STATES) * ny + 2 * N_COLUMNS**2 + sizes[at.N_ROW] + blocks_size(sizes)
    )
    own += n * n + n + m + nh + n + nh + nv + sizes[at.NQ] + nv + n + equations_size(sizes)
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def bdf_ggl_work(sizes, work):
    """Divide `work`, of length `bdf_ggl_work_size(sizes)`, into a `BdfGglWork`."""
    nv, ny, m, nh = sizes[at.NV], sizes[at.NY], sizes[at.NM], sizes[at.NH]
    n = nv + m
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    size = N_DIFFERENCES * ny
    differences, rest = rest[:size].reshape((N_DIFFERENCES, ny)), rest[size:]
    states, rest = rest[: N_STATES * ny].reshape((N_STATES, ny)), rest[N_STATES * ny :]
    size = 2 * N_COLUMNS * N_COLUMNS
    weights, rest = rest[:size].reshape((2, N_COLUMNS, N_COLUMNS)), rest[size:]
    row, rest = rest[: sizes[at.N_ROW]], rest[sizes[at.N_ROW] :]
    size = blocks_size(sizes)
    blocks, rest = rest[:size], rest[size:]
    matrix, rest = rest[: n * n].reshape((n, n)), rest[n * n :]
    pivots, rest = rest[:n].view(np.int64), rest[n:]
    multipliers, rest = rest[: m + nh], rest[m + nh :]
    correction, rest = rest[: n + nh], rest[n + nh :]
    rates, rest = rest[:nv], rest[nv:]
    size = sizes[at.NQ] + nv + n
    arguments, rest = rest[:size], rest[size:]
    size = equations_size(sizes)
    equations, rest = rest[:size], rest[size:]
    size = jacobian_work_size(sizes)
    return BdfGglWork(
        numbers, differences, states, weights, row, blocks, matrix, pivots, multipliers, correction,
        rates, arguments, equations, rest[:size], rest[size:],
    )  # fmt: skip
