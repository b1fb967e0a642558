"""What a start is given as: the model's values, those of the user over them, quaternions of unit length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symgen.runtime.constraints.contradictions import AssemblyError
from symgen.runtime.errors import UnknownNameError, nearest
from symgen.runtime.lazy import Late
from symgen.runtime.names import inside_dot, rate_indices
from symgen.runtime.positions import Positions
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.system import System

# Most runs are given numbers.
quantities = Late("symgen.runtime.quantities")

_UNIT_LENGTH = 1e-9  # what a quaternion's length may be off without a word


class StartValues(NamedTuple):
    """A start before constraints are looked at.

    Attributes
    ----------
    q, v : ndarray, shape (nq,) and (nv,)
    q_enforced, v_enforced : ndarray of bool, shape (nq,) and (nv,)
    notes : list of str
    """

    q: np.ndarray
    v: np.ndarray
    q_enforced: np.ndarray
    v_enforced: np.ndarray
    notes: list[str]


@record
class Assembly:
    """Consistent initial conditions, and what it took.

    Attributes
    ----------
    q, v : ndarray, shape (nq,) and (nv,)
    moved : list of (str, float, float)
        Coordinate or rate (`dot(x)`, `ball_wx`), its value before and after.
    notes : list of str
        What a user should know: enforced values that were repaired, redundant constraints.
    redundant : list of str
        Constraints that follow from those before them.
    rank : int
        Structural rank of the constraint Jacobian; smaller than m when constraints are redundant.
    """

    q: np.ndarray
    v: np.ndarray
    moved: list[tuple[str, float, float]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    redundant: list[str] = field(default_factory=list)
    rank: int = 0


_MOVED = 1e-13  # of the characteristic size: below this a change is round-off


def changes(
    names: list[str], old: np.ndarray, new: np.ndarray, sizes: np.ndarray
) -> list[tuple[str, float, float]]:
    """Return what has moved by more than round-off: name, value before and after."""
    changed = np.flatnonzero(np.abs(new - old) > _MOVED * sizes)
    return [(names[i], float(old[i]), float(new[i])) for i in changed]


def moved_notes(moved: Sequence[tuple[str, float, float]], by: str = "assembly") -> list[str]:
    """Return a note on each value that has moved, with as many digits as tell the two apart."""
    notes = []
    for name, before, after in moved:
        digits = next((k for k in (9, 12, 17) if f"{before:.{k}g}" != f"{after:.{k}g}"), 17)
        notes.append(f"{by} moved {name} from {before:.{digits}g} to {after:.{digits}g}")
    return notes


def start_values(
    system: System,
    p: np.ndarray,
    start: Mapping[str, float | str] | None,
    rate: Mapping[str, float | str] | None,
) -> StartValues:
    """Return the model's start at these parameters with the values of `start` and `rate`, which are enforced.

    Raises
    ------
    AssemblyError
        A value is not finite, or a quaternion is zero.
    UnknownNameError
        A name is not that of a coordinate or rate.
    """
    q, v, q_enforced, v_enforced = system.initial_state(p)
    if start or rate:
        _enforce(system, start, rate, q, v, q_enforced, v_enforced)
    q, notes = _unit_quaternions(system, q)
    return StartValues(q, v, q_enforced, v_enforced, notes)


def _enforce(
    system: System,
    start: Mapping[str, float | str] | None,
    rate: Mapping[str, float | str] | None,
    q: np.ndarray,
    v: np.ndarray,
    q_enforced: np.ndarray,
    v_enforced: np.ndarray,
) -> None:
    """Write values that are given into q and v, in place."""
    coordinates = {record["name"]: index for index, record in enumerate(system.coordinates)}
    states = {system.rates[i]["name"]: i for i in system.states}
    for name, value in (start or {}).items():
        if name in states:
            v[states[name]] = _in_si(f"start: {name}", value, system.rates[states[name]])
            v_enforced[states[name]] = True
            continue
        index = _index(system, "start", name, name, coordinates | states)
        q[index], q_enforced[index] = _in_si(f"start: {name}", value, system.coordinates[index]), True
    rates = rate_indices(system.coordinates, system.rates, system.quaternions)
    for name, value in (rate or {}).items():
        index = _index(system, "rate", name, inside_dot(name), rates)
        v[index], v_enforced[index] = _in_si(f"rate: {name}", value, system.rates[index]), True


def _index(system: System, option: str, given: str, name: str, places: Mapping[str, int]) -> int:
    """Return where a coordinate or rate stands in the state."""
    if name not in places:
        what = "coordinate" if option == "start" or system.nq == system.nv else "rate"
        raise UnknownNameError(
            f"{option}: model {system.name!r} has no {what} {given!r}: {nearest(name, places)}"
        )
    return places[name]


def _in_si(what: str, value: float | str, record: Mapping[str, Any]) -> float:
    if isinstance(value, str):
        value = quantities.in_si(value, record["unit"], what.replace(":", ""))
    if not np.isfinite(value):
        raise AssemblyError(f"{what} is {value}; give a finite number")
    return float(value)


def _unit_quaternions(system: System, q: np.ndarray) -> tuple[np.ndarray, list[str]]:
    if not system.quaternions:
        return q, []
    positions, notes = Positions(system), []
    for (i, _), length in zip(positions.quaternions, positions.lengths(q)):
        names = f"{system.coordinates[i]['name']}, …, {system.coordinates[i + 3]['name']}"
        if not (np.isfinite(length) and length > 0.0):
            raise AssemblyError(
                f"the quaternion {names} has the length {length:g}, which is no orientation: "
                "give one, such as 1, 0, 0, 0"
            )
        if abs(length - 1.0) > _UNIT_LENGTH:
            notes.append(f"the quaternion {names} had the length {length:.9g}, and was scaled to unit length")
    return positions.normalised(q), notes
