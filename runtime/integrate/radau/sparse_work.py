"""Work arrays of the Radau methods for large models, whose Newton matrices are sparse."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.radau.work import N_NUMBERS
from symgen.runtime.integrate.sparse_lu import SparseLU, complex_sparse_lu, sparse_lu, sparse_lu_size


class SparseRadauWork(NamedTuple):
    """Work arrays of a Radau method with s = 2 k + 1 stages, for n equations; most are those of `RadauWork`.

    Attributes
    ----------
    numbers, states, rows, real_vectors, complex_vectors, pairs, rotation_rates, scratch : ndarray
        See `RadauWork`.
    arguments : ndarray, shape (nq + 2 nv + m,)
        (q, v, a, λ).
    entries : ndarray, shape (n_entries,)
        The derivative of the equations, see `NewtonPattern`.
    values, complex_values : ndarray, shape (n_values,)
        The entries of a Newton matrix.
    right, complex_right : ndarray, shape (n,)
        Right-hand sides.
    real : SparseLU
    complex : ndarray, shape (k, sparse_lu_size(n, room, 2))
        What `complex_sparse_lu` divides, for each ν.
    """

    numbers: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    real_vectors: np.ndarray
    complex_vectors: np.ndarray
    pairs: np.ndarray
    rotation_rates: np.ndarray
    arguments: np.ndarray
    entries: np.ndarray
    values: np.ndarray
    complex_values: np.ndarray
    right: np.ndarray
    complex_right: np.ndarray
    real: SparseLU
    complex: np.ndarray
    scratch: np.ndarray


@jitted
def sparse_radau_work_size(method, sizes):
    """Length of `work` for `advance_radau_sparse`."""
    s, k, pattern = len(method.c), len(method.c) // 2, method.pattern
    nv, ny, n = sizes[at.NV], sizes[at.NY], sizes[at.NV] + sizes[at.NM]
    own = N_NUMBERS + (s + 2) * ny + (s + 1) * sizes[at.N_ROW] + (8 + 8 * k) * nv + 3 * s
    own += sizes[at.NQ] + nv + n + pattern.kind.shape[0] + 3 * pattern.rows.shape[0] + 3 * n
    factors = sparse_lu_size(n, pattern.room, 1) + k * sparse_lu_size(n, pattern.room, 2)
    return own + factors + finish_scratch_size(sizes)


@jitted
def sparse_radau_work(method, sizes, work):
    """Divide `work`, of length `sparse_radau_work_size(method, sizes)`, into a `SparseRadauWork`."""
    s, k, pattern = len(method.c), len(method.c) // 2, method.pattern
    nv, ny, n_row, n = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW], sizes[at.NV] + sizes[at.NM]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    states, rest = rest[: (s + 2) * ny].reshape((s + 2, ny)), rest[(s + 2) * ny :]
    rows, rest = rest[: (s + 1) * n_row].reshape((s + 1, n_row)), rest[(s + 1) * n_row :]
    real_vectors, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    size = 8 * k * nv
    complex_vectors, rest = rest[:size].view(np.complex128).reshape((2 * k, 2 * nv)), rest[size:]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    rotation_rates, rest = rest[: 3 * s].reshape((s, 3)), rest[3 * s :]
    size = sizes[at.NQ] + nv + n
    arguments, rest = rest[:size], rest[size:]
    size = pattern.kind.shape[0]
    entries, rest = rest[:size], rest[size:]
    size = pattern.rows.shape[0]
    values, rest = rest[:size], rest[size:]
    complex_values, rest = rest[: 2 * size].view(np.complex128), rest[2 * size :]
    right, rest = rest[:n], rest[n:]
    complex_right, rest = rest[: 2 * n].view(np.complex128), rest[2 * n :]
    size = sparse_lu_size(n, pattern.room, 1)
    real, rest = sparse_lu(n, pattern.room, rest[:size]), rest[size:]
    size = sparse_lu_size(n, pattern.room, 2)
    complex_, rest = rest[: k * size].reshape((k, size)), rest[k * size :]
    return SparseRadauWork(
        numbers, states, rows, real_vectors, complex_vectors, pairs, rotation_rates, arguments, entries, values,
        complex_values, right, complex_right, real, complex_, rest,
    )  # fmt: skip


@jitted
def pair_factors(method, k, w):
    """The factors for ν of pair `k`."""
    return complex_sparse_lu(method.pattern.order.shape[0], method.pattern.room, w.complex[k])
