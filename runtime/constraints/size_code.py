"""Sizes of coordinates without units in machine code: what `levels._fit` finds, to the same bits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.levels import (
    AT_ONCE,
    DIVIDED_BY,
    FAR,
    LONG_AND_PARTS,
    SMALL_CHANGE,
    SMALLEST,
    STRAIGHT,
    TURNS,
    odd,
    units_of,
)
from symgen.runtime.integrate.loop import all_finite, copy

if TYPE_CHECKING:
    from symgen.runtime.system import System

_LONG, _PART, _SMALL_PART = LONG_AND_PARTS


class Sizing(NamedTuple):
    """What finding sizes takes, of nh position constraints.

    Attributes
    ----------
    bare : ndarray of int64
        Coordinates without units; none where no constraint can tell how large they are.
    is_bare, waits : ndarray, shape (nq,)
        1.0 for coordinates without units; scratch for those of which nothing is known yet.
    of_q, of_p : ndarray, shapes (nq,), (n_p,)
        `levels.odd` of as many numbers.
    place, moved_p : ndarray, shapes (nq + nv,), (n_p,)
        Scratch; the rates in `place` are zero.
    residual : ndarray, shape (nh + m,)
    at, terms, first, part : ndarray, shape (nh,)
    """

    bare: np.ndarray
    is_bare: np.ndarray
    waits: np.ndarray
    of_q: np.ndarray
    of_p: np.ndarray
    place: np.ndarray
    moved_p: np.ndarray
    residual: np.ndarray
    at: np.ndarray
    terms: np.ndarray
    first: np.ndarray
    part: np.ndarray


def make_sizing(system: System, n_p: int) -> Sizing:
    """Return the arrays for a model of as many coordinates as rates, and `n_p` parameters, inputs and settings."""
    nq, nh = system.nq, system.nh
    bare = units_of(system).bare.astype(np.int64) if nh else np.zeros(0, dtype=np.int64)
    is_bare = np.zeros(nq)
    is_bare[bare] = 1.0
    of_constraints = (np.zeros(nh) for _ in range(4))
    return Sizing(
        bare, is_bare, np.zeros(nq), odd(nq), odd(n_p), np.zeros(nq + system.nv), np.zeros(n_p),
        np.zeros(nh + system.m), *of_constraints,
    )  # fmt: skip


@jitted
def fit_sizes(kernel, t, q, p, sizes, own):
    """Make the sizes of coordinates without units smaller, in place, where constraints say so.

    Parameters
    ----------
    kernel : uint64
        Address of the residual of constraints.
    p : ndarray, shape (n_p,)
    """
    n_bare = own.bare.shape[0]
    if n_bare == 0 or not all_finite(q, q.shape[0]):
        return
    copy(q, own.place)
    find_residual(kernel, t, p, own.at, own)
    for i in range(n_bare):
        k = own.bare[i]
        if sizes[k] > 1.0 and not goes_on(kernel, t, q, p, k, math.copysign(sizes[k], q[k]), own):
            sizes[k] = 1.0
    find_terms(kernel, t, q, p, sizes, own)
    for j in range(q.shape[0]):
        own.place[j] = q[j] + own.is_bare[j] * (1.0 - 0.3 * abs(own.of_q[j])) * sizes[j]
    find_change(kernel, t, p, own.first, own)
    if is_within_terms(own):
        return
    n_waiting = 0
    for j in range(q.shape[0]):
        own.waits[j] = 0.0
        # What returns is an angle, however small all of them are here.
        if own.is_bare[j] != 0.0 and goes_on(kernel, t, q, p, j, TURNS, own):
            own.waits[j] = 1.0
            n_waiting += 1
    while n_waiting > 0:
        left = 0
        for j in range(q.shape[0]):
            if own.waits[j] != 0.0:
                if shrink(kernel, t, q, p, j, sizes, own):
                    own.waits[j] = 0.0
                else:
                    left += 1
        if left == n_waiting:
            return
        n_waiting = left
        # What is known of some coordinates says how large the others are in a constraint that has no other terms.
        for j in range(q.shape[0]):
            own.place[j] = q[j] + (1.0 - own.waits[j]) * sizes[j]
        find_change(kernel, t, p, own.first, own)
        for i in range(own.at.shape[0]):
            if not own.terms[i] > 0.0:
                own.terms[i] = own.first[i] if math.isfinite(own.first[i]) else 0.0


@jitted
def find_residual(kernel, t, p, values, own):
    """Write the position constraints at `place` to `values`."""
    call_kernel(kernel, t, own.place, p, own.residual)
    copy(own.residual[: values.shape[0]], values)


@jitted
def find_change(kernel, t, p, values, own):
    """Write by how much they differ there from `at`, inf where that is not a number."""
    find_residual(kernel, t, p, values, own)
    for i in range(values.shape[0]):
        moved = abs(values[i] - own.at[i])
        values[i] = moved if math.isfinite(moved) else math.inf


@jitted
def is_within_terms(own):
    """Whether changes in `first` are none that only sizes of another model make."""
    for i in range(own.first.shape[0]):
        if not own.first[i] <= FAR * own.terms[i]:
            return False
    return True


@jitted
def goes_on(kernel, t, q, p, k, step, own):
    """Whether all constraints go on changing along a step of one coordinate: `levels._goes_on`."""
    copy(q, own.place)
    own.place[k] = q[k] + _LONG * step
    find_residual(kernel, t, p, own.first, own)
    for way in (_PART, _SMALL_PART):
        own.place[k] = q[k] + way * step
        find_residual(kernel, t, p, own.part, own)
        for i in range(own.at.shape[0]):
            if not abs(own.part[i] - own.at[i]) <= STRAIGHT * abs(own.first[i] - own.at[i]):
                return False
    return True


@jitted
def find_terms(kernel, t, q, p, sizes, own):
    """Write the size of the terms of each constraint to `terms`: `levels._terms`."""
    for i in range(p.shape[0]):
        own.moved_p[i] = p[i] * (1.0 + SMALL_CHANGE * own.of_p[i])
    copy(q, own.place)
    find_residual(kernel, t, own.moved_p, own.first, own)
    for j in range(q.shape[0]):
        own.place[j] = q[j] + SMALL_CHANGE * own.of_q[j] * min(max(q[j], -sizes[j]), sizes[j])
    find_residual(kernel, t, p, own.part, own)
    for i in range(own.at.shape[0]):
        of_p, of_q, at = abs(own.first[i] - own.at[i]), abs(own.part[i] - own.at[i]), abs(own.at[i])
        change = (of_p if of_p >= of_q or math.isnan(of_q) else of_q) / SMALL_CHANGE
        change = change if math.isfinite(change) else 0.0
        own.terms[i] = at if at > change else change


@jitted
def shrink(kernel, t, q, p, k, sizes, own):
    """Make a size such that it changes a constraint by no more than its terms; False where no constraint says so."""
    copy(q, own.place)
    own.place[k] = q[k] + sizes[k]
    find_change(kernel, t, p, own.first, own)
    says = False
    for i in range(own.at.shape[0]):
        if own.first[i] > 0.0 and own.terms[i] > 0.0:
            says = True
            if own.first[i] <= FAR * own.terms[i]:
                return True
    if not says:
        return False
    while sizes[k] > SMALLEST:
        size = sizes[k]
        for _ in range(AT_ONCE):
            own.place[k] = q[k] + size
            find_change(kernel, t, p, own.part, own)
            enough = not size > SMALLEST
            for i in range(own.at.shape[0]):
                if own.first[i] > 0.0 and own.terms[i] > 0.0 and own.part[i] <= own.terms[i]:
                    enough = True
            if enough:
                sizes[k] = size
                return True
            size /= DIVIDED_BY  # a power of two
        sizes[k] = size
    return True
