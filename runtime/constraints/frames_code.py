"""What constraints come to at the frames of a run, in machine code: their drift, and how their rows turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.call_block import call_block
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.loop import copy
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from collections.abc import Iterator

    from symgen.runtime.system import System

_TOGETHER = 256  # frames of a call
_TINY = 1e-300
DRIFT, VELOCITY_SCALES, WEIGHTS, TURNS = range(4)
_RESIDUAL, _ENTRIES, _MATRIX = range(3)


class Frames(NamedTuple):
    """Frames of a run, and what is found at them.

    Attributes
    ----------
    sizes : ndarray of int64
        nq, nv, nh, m; what is looked for; how many frames there are, and how many there were before.
    addresses : ndarray of uint64
        Of `constraint_residual`, of what writes the entries of G, and of `constraint_jacobian`; 0 of what is not asked.
    times, states : ndarray, shapes (k,), (k, nq + nv)
    p : ndarray, shape (n_precomputed,)
    rows, columns : ndarray of int64
        Where entries of G stand.
    residual, entries, matrix : ndarray
        What the functions write.
    place : ndarray, shape (nq + nv,)
    largest, at : ndarray and ndarray of int64, shape (nh + m,)
        The largest residual of each level and constraint, and its frame; what is not a number is larger than all.
    slow, scales : ndarray, shapes (nv,), (m,)
        Rates below which motion is slow, and the largest term of each constraint's velocity.
    weights : ndarray, shape (nv,)
        Of each rate, the largest sum of squares in the rows of G.
    before, inner : ndarray, shapes (nh, nv), (nh, nh)
        Rows of the frame before, divided by the weights, and their products with those of a frame.
    turned : ndarray, shape (k,)
        1.0 where the exterior product of the rows is more than a right angle from that of the frame before.
    """

    sizes: np.ndarray
    addresses: np.ndarray
    times: np.ndarray
    states: np.ndarray
    p: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    residual: np.ndarray
    entries: np.ndarray
    matrix: np.ndarray
    place: np.ndarray
    largest: np.ndarray
    at: np.ndarray
    slow: np.ndarray
    scales: np.ndarray
    weights: np.ndarray
    before: np.ndarray
    inner: np.ndarray
    turned: np.ndarray


class LookAtFrames:
    """Machine code that looks at frames of a model, some hundred at a time, with the arrays that it needs.

    Attributes
    ----------
    of : Frames
    """

    def __init__(self, system: System, n_precomputed: int):
        nq, nv, nh, m = system.nq, system.nv, system.nh, system.m
        self._by_entries = is_large(system)
        places = system.entry_places("constraint_jacobian") if self._by_entries else np.arange(m * nv)
        rows, columns = np.divmod(places.astype(np.int64), nv)
        turning = 0 if self._by_entries else nh
        self.of = Frames(
            np.array([nq, nv, nh, m, 0, 0, 0]), np.zeros(3, dtype=np.uint64), np.zeros(_TOGETHER),
            np.zeros((_TOGETHER, nq + nv)), np.zeros(n_precomputed), rows, columns, np.zeros(nh + m),
            np.zeros(len(rows)), np.zeros(m * nv if turning else 0), np.zeros(nq + nv), np.zeros(nh + m),
            np.zeros(nh + m, dtype=np.int64), np.zeros(nv), np.zeros(m), np.zeros(nv), np.zeros((turning, nv)),
            np.zeros((turning, turning)), np.zeros(_TOGETHER),
        )  # fmt: skip
        self._call = call_block(look_at_frames, self.of)

    def fits(self, n_precomputed: int) -> bool:
        """Whether it can look at runs of such parameters."""
        return len(self.of.p) == n_precomputed

    def begin(self, system: System, p: np.ndarray) -> None:
        """Take parameters, as `System.precomputed` gives them, and the functions of the model as they are now."""
        jacobian = "constraint_jacobian"
        names = ("constraint_residual", jacobian + ENTRIES if self._by_entries else jacobian)
        residual, entries = (system.kernel(name).precomputed_address for name in names)
        self.of.addresses[:] = residual, entries, entries if len(self.of.matrix) else 0
        self.of.p[:] = p

    def see(self, task: int, times: np.ndarray, states: np.ndarray) -> None:
        """Do a task to the end."""
        for _ in self.look(task, times, states):
            pass

    def look(self, task: int, times: np.ndarray, states: np.ndarray) -> Iterator[tuple[int, int]]:
        """Do a task; yields from which frame to which `turned` is of, each time it has been written."""
        of, n = self.of, self.of.states.shape[1]
        for first in range(0, len(times), _TOGETHER):
            end = min(first + _TOGETHER, len(times))
            of.sizes[4:] = task, end - first, first
            of.times[: end - first], of.states[: end - first] = times[first:end], states[first:end, :n]
            self._call()
            yield first, end


@jitted
def look_at_frames(of):
    """Do what is asked for at each frame; returns 0."""
    task = of.sizes[4]
    if of.sizes[6] == 0:
        begin(of, task)
    for k in range(of.sizes[5]):
        if task == DRIFT:
            find_drift(of, k)
        elif task == VELOCITY_SCALES:
            find_terms(of, k)
        else:
            call_kernel(of.addresses[_MATRIX], of.times[k], of.states[k], of.p, of.matrix)
            if task == WEIGHTS:
                find_weights(of)
            else:
                find_turn(of, k)
    return 0


@jitted
def begin(of, task):
    """Forget what a look before has found."""
    if task == DRIFT:
        of.largest[:] = 0.0
        of.at[:] = 0
    elif task == VELOCITY_SCALES:
        of.scales[:] = 0.0
    elif task == WEIGHTS:
        of.weights[:] = 0.0


@jitted
def find_drift(of, k):
    """Take residuals that are larger than those before."""
    call_kernel(of.addresses[_RESIDUAL], of.times[k], of.states[k], of.p, of.residual)
    for i in range(of.residual.shape[0]):
        if not abs(of.residual[i]) <= of.largest[i] and not math.isnan(of.largest[i]):
            of.largest[i], of.at[i] = abs(of.residual[i]), of.sizes[6] + k


@jitted
def find_terms(of, k):
    """Take terms of velocity residuals that are larger than those before: of the motion, and of time alone."""
    nq, nv, nh, m = of.sizes[0], of.sizes[1], of.sizes[2], of.sizes[3]
    call_kernel(of.addresses[_ENTRIES], of.times[k], of.states[k], of.p, of.entries)
    copy(of.states[k], of.place)
    for j in range(nv):
        of.place[nq + j] = 0.0
    call_kernel(of.addresses[_RESIDUAL], of.times[k], of.place, of.p, of.residual)
    for i in range(m):
        of.scales[i] = larger(of.scales[i], abs(of.residual[nh + i]))
    for e in range(of.rows.shape[0]):
        j = of.columns[e]
        rate = max(abs(of.states[k, nq + j]), of.slow[j])
        of.scales[of.rows[e]] = larger(of.scales[of.rows[e]], abs(of.entries[e] * rate))


@jitted
def find_weights(of):
    """Take sums of squares over rows of G that are larger than those before."""
    nv = of.sizes[1]
    for j in range(nv):
        total = 0.0
        for i in range(of.sizes[2]):
            total += of.matrix[i * nv + j] * of.matrix[i * nv + j]
        of.weights[j] = larger(of.weights[j], total)


@jitted
def find_turn(of, k):
    """Tell whether the exterior product of rows has turned by more than a right angle: by Cauchy and Binet."""
    nv, nh = of.sizes[1], of.sizes[2]
    of.turned[k] = 0.0
    if of.sizes[6] + k > 0:
        for i in range(nh):
            for l in range(nh):
                total = 0.0
                for j in range(nv):
                    total += of.before[i, j] * of.matrix[l * nv + j]
                of.inner[i, l] = total
        of.turned[k] = 1.0 if has_negative_determinant(of.inner) else 0.0
    for j in range(nv):
        weight = 1.0 / max(of.weights[j], _TINY)
        for i in range(nh):
            of.before[i, j] = weight * of.matrix[i * nv + j]


@jitted
def has_negative_determinant(matrix):
    """Tell the sign of a determinant by elimination with pivots of rows, in place."""
    n, sign = matrix.shape[0], 1.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if not abs(matrix[pivot, k]) > 0.0:
            return False
        if pivot != k:
            sign = -sign
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        if matrix[k, k] < 0.0:
            sign = -sign
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
    return sign < 0.0


@jitted
def larger(a, b):
    """Return the larger of two numbers, or the one that is a number."""
    return b if not b <= a and not math.isnan(b) else a
