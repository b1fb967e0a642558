"""What the Radau methods keep when they integrate index-2 equations: work arrays, and coefficients."""

from __future__ import annotations

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.ggl import blocks_size, equations_size
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.nested_basis import N_ROWS, fit_rows, values
from symgen.runtime.integrate.quaternions import n_quaternions
from symgen.runtime.integrate.radau.coefficients import RadauIIA, radau
from symgen.runtime.integrate.radau.work import N_NUMBERS

# Besides `RadauIIA`: the inverse of its Butcher matrix; where between its ends a step is sampled for dense output, the
# weights of the stages there, and the matrix from samples to rows of dense output.
RadauGgl = namedtuple("RadauGgl", (*RadauIIA._fields, "a_inverse", "places", "at_places", "fit"))


def radau_ggl(n_stages: int) -> RadauGgl:
    """Return a Radau IIA method with what index-2 equations need."""
    method = radau(n_stages)
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, N_ROWS - 1) / (N_ROWS - 1))
    conditions = [(0, place) for place in places]
    at_places = values(conditions, n_stages + 1)[:, 2:] @ method.rows
    at_places[:, -1] += places
    a_inverse = np.ascontiguousarray(np.linalg.inv(method.a))
    return RadauGgl(*method, a_inverse, places, at_places, np.ascontiguousarray(fit_rows(conditions)))


class GglWork(NamedTuple):
    """Work arrays of a Radau method with s = 2 k + 1 stages; those not described here are as in `RadauWork`.

    Attributes
    ----------
    numbers, states, rows, pairs, implicit, scratch : ndarray
    blocks : ndarray
        See `ggl.divide_blocks`.
    real, complex : ndarray, shapes (nv + m, nv + m), (k, nv + m, nv + m)
        Factors of `ggl.set_shifted`'s matrix for μ/h and for every ν/h.
    pivots : ndarray of int64, shape (k + 1, nv + m)
    multipliers : ndarray, shape (s, m + nh)
        λ and μ of every stage.
    residuals : ndarray, shape (s, nv + m + nh)
        Those of the stages, then their corrections.
    real_vector, complex_vectors : ndarray, shapes (nv + m + nh), (k, nv + m + nh)
        The same, transformed.
    steered : ndarray, shape (s, nv)
        The stages' rates less those of the start, with what μ adds; or what corrections add to these.
    rotation_rates : ndarray, shape (s, 3)
        Derivatives of the stages' rotation vectors, or increments of their angular velocities.
    rotation_polynomials, samples : ndarray, shapes (s, 3 r), (6, 7 r) for r quaternions
        See `ggl_dense_output`.
    arguments, equations : ndarray, shapes (nq + 2 nv + m), (nv + m)
        What the kernel `residual` reads and writes; `equations` is also what `constraint_residual` writes.
    """

    numbers: np.ndarray
    blocks: np.ndarray
    real: np.ndarray
    complex: np.ndarray
    pivots: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    pairs: np.ndarray
    multipliers: np.ndarray
    residuals: np.ndarray
    real_vector: np.ndarray
    complex_vectors: np.ndarray
    steered: np.ndarray
    rotation_rates: np.ndarray
    rotation_polynomials: np.ndarray
    samples: np.ndarray
    arguments: np.ndarray
    equations: np.ndarray
    implicit: np.ndarray
    scratch: np.ndarray


@jitted
def ggl_work_size(method, sizes):
    """Length of `work` for `advance_radau_ggl`."""
    s, k = len(method.c), len(method.c) // 2
    nv, ny, n_row, m = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW], sizes[at.NM]
    n, n_all, r = nv + m, nv + m + sizes[at.NH], n_quaternions(sizes)
    own = N_NUMBERS + blocks_size(sizes) + (1 + 2 * k) * n * n + (k + 1) * n + (s + 2) * ny + (s + 1) * n_row
    own += (
        4 * nv + s * (n_all - nv) + s * n_all + (1 + 2 * k) * n_all + s * nv + 3 * s + sizes[at.NQ] + nv + n
    )
    own += 3 * s * r + 7 * (N_ROWS - 2) * r
    return own + equations_size(sizes) + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def ggl_work(method, sizes, work):
    """Divide `work`, of length `ggl_work_size(method, sizes)`, into a `GglWork`."""
    s, k = len(method.c), len(method.c) // 2
    nv, ny, n_row, m = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW], sizes[at.NM]
    n, n_all, r = nv + m, nv + m + sizes[at.NH], n_quaternions(sizes)
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    size = blocks_size(sizes)
    blocks, rest = rest[:size], rest[size:]
    real, rest = rest[: n * n].reshape((n, n)), rest[n * n :]
    size = 2 * k * n * n
    complex_, rest = rest[:size].view(np.complex128).reshape((k, n, n)), rest[size:]
    size = (k + 1) * n
    pivots, rest = rest[:size].view(np.int64).reshape((k + 1, n)), rest[size:]
    size = (s + 2) * ny
    states, rest = rest[:size].reshape((s + 2, ny)), rest[size:]
    size = (s + 1) * n_row
    rows, rest = rest[:size].reshape((s + 1, n_row)), rest[size:]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    size = s * (n_all - nv)
    multipliers, rest = rest[:size].reshape((s, n_all - nv)), rest[size:]
    residuals, rest = rest[: s * n_all].reshape((s, n_all)), rest[s * n_all :]
    real_vector, rest = rest[:n_all], rest[n_all:]
    size = 2 * k * n_all
    complex_vectors, rest = rest[:size].view(np.complex128).reshape((k, n_all)), rest[size:]
    steered, rest = rest[: s * nv].reshape((s, nv)), rest[s * nv :]
    rotation_rates, rest = rest[: 3 * s].reshape((s, 3)), rest[3 * s :]
    size = 3 * s * r
    rotation_polynomials, rest = rest[:size].reshape((s, 3 * r)), rest[size:]
    size = 7 * (N_ROWS - 2) * r
    samples, rest = rest[:size].reshape((N_ROWS - 2, 7 * r)), rest[size:]
    size = sizes[at.NQ] + nv + n
    arguments, rest = rest[:size], rest[size:]
    size = equations_size(sizes)
    equations, rest = rest[:size], rest[size:]
    size = jacobian_work_size(sizes)
    return GglWork(
        numbers, blocks, real, complex_, pivots, states, rows, pairs, multipliers, residuals, real_vector,
        complex_vectors, steered, rotation_rates, rotation_polynomials, samples, arguments, equations,
        rest[:size], rest[size:],
    )  # fmt: skip
