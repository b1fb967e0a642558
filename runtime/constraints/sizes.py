"""What counts as large for a coordinate: from its unit, or, where it has none, from what constraints make of it.

Without units nothing tells an angle from a length in micrometres but the constraints themselves: a coordinate that
changes them by many times the size of their terms has been moved too far.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.system import System

_ANGLES = ("rad", "deg")
_SMALL_CHANGE = 1e-6  # of parameters: what they make of the constraints' terms
_FAR = 30.0  # terms of a constraint: a change by more says that the sizes are not those of the model
_DIVIDED_BY = 4.0
_SMALLEST = 1e-30
_MOST_REMEMBERED = 16
_PARTS = (1.0 / 16.0, 1.0 / 37.0)  # of a long way,
_TURNS = 100.0  # [rad]
_STRAIGHT = 0.3  # and what they may change of what all of it does


class PositionConstraints(Protocol):
    """Constraints at a time and parameters, as `levels.Constraints` has them."""

    t: float
    p: np.ndarray

    def position(self, q: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Return the residuals of positions, perhaps with other parameters."""


def coordinate_sizes(
    system: System, constraints: PositionConstraints, q: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Return what counts as large for each coordinate, shape (nq,).

    1 for angles. Where there is a unit, the largest value among coordinates and parameters that have it. Without one 1,
    or the largest value of such coordinates, unless constraints are not of that size.
    """
    records = [*system.coordinates, *system.parameters, *system.inputs]
    largest: dict[str, float] = {}
    for record, value in zip(records, np.abs(np.concatenate([q, p]))):
        largest[record["unit"]] = max(largest.get(record["unit"], 0.0), float(value))
    units = [record["unit"] for record in system.coordinates]
    sizes = np.array([1.0 if unit in _ANGLES else largest[unit] or 1.0 for unit in units])
    bare = np.array([unit == "" for unit in units])
    bare[[k for i in system.quaternions for k in range(i, i + 4)]] = False
    if bare.any():
        sizes[bare] = max(1.0, np.abs(q[bare]).max())
        if system.nh and np.isfinite(q).all():
            sizes = _remembered(system, constraints, q, sizes, bare)
    return sizes


def _remembered(
    system: System, constraints: PositionConstraints, q: np.ndarray, sizes: np.ndarray, bare: np.ndarray
) -> np.ndarray:
    """What `_fit` makes of the sizes; the start of a run is asked for several times."""
    known = vars(system).setdefault("_fitted_sizes", {})
    key = constraints.t, q.tobytes(), constraints.p.tobytes()
    if key not in known:
        if len(known) >= _MOST_REMEMBERED:
            known.clear()
        _fit(constraints, q, sizes, bare)
        known[key] = sizes
    return known[key].copy()


def _fit(constraints: PositionConstraints, q: np.ndarray, sizes: np.ndarray, bare: np.ndarray) -> None:
    """Make the sizes of coordinates without units smaller, where constraints say so."""
    at = constraints.position(q)

    def change(where: np.ndarray) -> np.ndarray:
        """How much the constraints change where some coordinates move by their sizes."""
        moved = np.abs(constraints.position(q + where * sizes) - at)
        return np.where(np.isfinite(moved), moved, np.inf)

    each = np.eye(len(q))
    for k in np.flatnonzero(bare & (sizes > 1.0)):
        if not _goes_on(constraints, q, at, np.copysign(sizes[k], q[k]) * each[k]):
            sizes[k] = 1.0
    terms = _terms(constraints, q, at, sizes)
    if (change(bare * (1.0 - 0.3 * np.abs(_odd(len(q))))) <= _FAR * terms).all():
        return
    # What returns is an angle, however small all of them are here.
    waiting = [k for k in np.flatnonzero(bare) if _goes_on(constraints, q, at, _TURNS * each[k])]
    while waiting:
        left = [k for k in waiting if not _shrink(sizes, k, lambda k=k: change(each[k]), terms)]
        if len(left) == len(waiting):
            return
        waiting = left
        # What is known of some coordinates says how large the others are in a constraint that has no other terms.
        known = np.where(np.isin(np.arange(len(q)), waiting), 0.0, 1.0)
        reach = change(known)
        terms = np.where(terms > 0.0, terms, np.where(np.isfinite(reach), reach, 0.0))


def _shrink(sizes: np.ndarray, k: int, change: Callable[[], np.ndarray], terms: np.ndarray) -> bool:
    """Make a size such that it changes a constraint by no more than its terms; False where no constraint says so."""
    first = change()
    says = (first > 0.0) & (terms > 0.0)
    if not says.any():
        return False
    if (first[says] <= _FAR * terms[says]).any():
        return True
    while sizes[k] > _SMALLEST and not (change()[says] <= terms[says]).any():
        sizes[k] /= _DIVIDED_BY
    return True


def _goes_on(constraints: PositionConstraints, q: np.ndarray, at: np.ndarray, step: np.ndarray) -> bool:
    """Whether all constraints go on changing along a step, as they do with lengths: angles of many turns return."""
    whole, *parts = (np.abs(constraints.position(q + part * step) - at) for part in (1.0, *_PARTS))
    return bool((np.maximum(*parts) <= _STRAIGHT * whole).all())


def _terms(constraints: PositionConstraints, q: np.ndarray, at: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the size of the terms of each constraint: by what relative changes of all numbers in it change it."""
    of_p = constraints.position(q, constraints.p * (1.0 + _SMALL_CHANGE * _odd(len(constraints.p))))
    of_q = constraints.position(q + _SMALL_CHANGE * _odd(len(q)) * np.clip(q, -sizes, sizes))
    change = np.fmax(np.abs(of_p - at), np.abs(of_q - at)) / _SMALL_CHANGE
    return np.fmax(np.where(np.isfinite(change), change, 0.0), np.abs(at))


def _odd(n: int) -> np.ndarray:
    """Return numbers between -1 and 1 that are in no simple ratio to each other."""
    return np.cos(1.0 + np.arange(n) ** 1.5)
