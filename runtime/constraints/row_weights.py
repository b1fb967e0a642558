"""How large each constraint's row of G gets near a state: what tells a row that vanishes from one that is small."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.guard_code import NEAR_LIMIT
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.quaternions import rotate

if TYPE_CHECKING:
    from symgen.runtime.system import System

_LARGEST = 4096  # entries of G; the look at all of them after each step is to stay cheap
_SPREAD = 0.5  # of the characteristic sizes
_NEIGHBOURS = 4
# Iterations towards the constraints, the change of a neighbour that ends them, and a row on the constraints in parts of
# what it is off them: a smaller one counts as vanishing everywhere.
_ITERATIONS, _CONVERGED, _SMALLEST_ROW = 20, 1e-8, 1e-5
_LOST_DIRECTIONS = 1e-6  # singular values below are none


def n_weights(system: System) -> int:
    """Return the length of `row_weights`."""
    n = system.m * system.nv
    return n + system.m + system.nv if n <= _LARGEST else 0


def row_weights(system: System, p: np.ndarray, t: float, q: np.ndarray) -> tuple[np.ndarray, float]:
    """Return by what the squares of the entries of G sum up to 1 for rows as large as they get near `q`.

    Behind them, by what residuals are multiplied to be in parts of the change that the characteristic sizes make, and
    those sizes.

    Parameters
    ----------
    system : System
        With constraints.
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    q : ndarray, shape (nq,)

    Returns
    -------
    ndarray, shape (m * nv + m + nv,)
        Empty for a model that is too large to look at each row.
    float
        The smallest size of a row at `q`.
    """
    if not n_weights(system):
        return np.zeros(0), 1.0
    m, nv = system.m, system.nv
    weights, squares, rows = np.zeros(n_weights(system)), np.zeros(m), np.zeros(m * nv)
    weights[m * nv + m :] = Constraints(system, p, t).characteristic_sizes(q)
    place = np.concatenate([q, np.zeros(nv)])
    kernel = np.uint64(system.kernel("constraint_jacobian").precomputed_address)
    fill_row_weights(
        kernel, t, q, system.precomputed(p), random_steps(nv), quaternion_places(system), place, rows, weights, squares
    )  # fmt: skip
    own = [row for row in range(system.nh) if row not in system.switched]
    if own and (squares < NEAR_LIMIT).any():
        _take_those_on_constraints(system, p, t, q, own, weights, squares)
    for row, at in system.switched.items():  # off, its row of zeros says nothing
        squares[row] += 1.0 - p[at]
    squares[list(system.dependent)] = 1.0
    return weights, float(np.min(squares))


def _take_those_on_constraints(
    system: System,
    p: np.ndarray,
    t: float,
    q: np.ndarray,
    own: list[int],
    weights: np.ndarray,
    squares: np.ndarray,
) -> None:
    """Let weights and squares be those of rows as large as they get on the constraints.

    The row of a short rod is as short everywhere, but off the constraints, where the rod is longer.

    Parameters
    ----------
    own : list of int
        The position constraints that hold at all times.
    """
    m, nv, constraints = system.m, system.nv, Constraints(system, p, t)
    sizes, scales = weights[m * nv + m :], weights[m * nv : m * nv + m]
    near = [_on_constraints(constraints, q, step * sizes, sizes, own) for step in random_steps(nv)]
    places = [q, *(place for place in near if place is not None)]
    if len(places) == 1:
        return
    rows = np.array([((constraints.jacobian(place) * sizes) ** 2).sum(axis=1) for place in places])
    if not np.isfinite(rows).all():
        return
    off = scales**-2.0
    taken = np.clip(rows.max(axis=0), _SMALLEST_ROW**2 * off, off)
    squares[:] = np.where(rows[0] > 0.0, rows[0] / taken, 0.0)
    scales[:] = taken**-0.5
    weights[: m * nv] = (sizes**2 / taken[:, None]).ravel()


def _on_constraints(
    constraints: Constraints, q: np.ndarray, step: np.ndarray, sizes: np.ndarray, own: list[int]
) -> np.ndarray | None:
    """Return the place on the constraints that Gauss and Newton come to from a step away from q, if they do."""
    place = constraints.positions.retract(q, step)
    for _ in range(_ITERATIONS):
        rows, off = constraints.jacobian(place)[own] * sizes, constraints.position(place)[own]
        if not (np.isfinite(rows).all() and np.isfinite(off).all()):
            return None
        norms = np.sqrt((rows**2).sum(axis=1))
        norms[norms == 0.0] = 1.0
        change = np.linalg.lstsq(rows / norms[:, None], -off / norms, rcond=_LOST_DIRECTIONS)[0]
        length = float(np.linalg.norm(change))
        place = constraints.positions.retract(place, sizes * change / max(length, 1.0))
        if length <= _CONVERGED:
            return place
    return None


@functools.lru_cache(maxsize=16)
def random_steps(nv: int) -> np.ndarray:
    """Return how far neighbours are, in parts of the characteristic sizes, shape (number of neighbours, nv)."""
    return _SPREAD * np.random.default_rng(20240229).uniform(-1.0, 1.0, (_NEIGHBOURS, nv))


def quaternion_places(system: System) -> np.ndarray:
    """Return where in q quaternions begin, and nq behind them."""
    return np.array([*system.quaternions, system.nq], dtype=np.int64)


@jitted
def retract(places, q, step, out):
    """Write the retraction of `step` at q to `out`: rotation vectors in body axes turn the quaternions at `places`."""
    nq = places[places.shape[0] - 1]
    i = j = k = 0
    while i < nq:
        if i == places[k]:
            rotate(q, i, step[j], step[j + 1], step[j + 2], out)
            i, j, k = i + 4, j + 3, k + 1
        else:
            out[i] = q[i] + step[j]
            i, j = i + 1, j + 1


@jitted
def fill_row_weights(jacobian, t, q, p, steps, places, y, rows, weights, squares):
    """Write the weights of `row_weights`, behind which the characteristic sizes stand already.

    Parameters
    ----------
    jacobian : uint64
        Address of the kernel; it takes a precomputed `p`.
    steps : ndarray, shape (number of neighbours, nv)
        From `random_steps`.
    y : ndarray, shape (nq + nv,)
        Scratch; the rates in it are zero.
    rows : ndarray, shape (m * nv,)
        Scratch, for G.
    squares : ndarray, shape (m,)
        The squares of the sizes of rows at `q`, in parts of the largest ones, are written here.
    """
    m, nv = squares.shape[0], steps.shape[1]
    sizes, scales = weights[m * nv + m :], weights[m * nv : m * nv + m]
    scale_rows(jacobian, t, y, p, q, rows, sizes, squares)
    for i in range(m):
        scales[i] = squares[i] if math.isfinite(squares[i]) else 0.0
    moved = weights[: m * nv]  # is written behind all reading
    for k in range(steps.shape[0]):
        for j in range(nv):
            moved[j] = steps[k, j] * sizes[j]
        retract(places, q, moved, y)
        call_kernel(jacobian, t, y, p, rows)
        for i in range(m):
            total = row_square(rows, i, nv, sizes)
            if math.isfinite(total):
                scales[i] = max(scales[i], total)
    for i in range(m):
        scale = scales[i] if scales[i] > 0.0 else 1.0
        for j in range(nv):
            weights[i * nv + j] = sizes[j] * sizes[j] / scale
        squares[i] /= scale
        scales[i] = 1.0 / math.sqrt(scale)


@jitted
def scale_rows(jacobian, t, y, p, q, rows, sizes, squares):
    """Write G at `q` to `rows`, and the squares of the sizes of its rows to `squares`."""
    copy(q, y)
    call_kernel(jacobian, t, y, p, rows)
    for i in range(squares.shape[0]):
        squares[i] = row_square(rows, i, sizes.shape[0], sizes)


@jitted
def row_square(rows, i, nv, sizes):
    """Return the sum of the squares of row `i` of G, each entry times a size."""
    total = 0.0
    for j in range(nv):
        entry = rows[i * nv + j] * sizes[j]
        total += entry * entry
    return total
