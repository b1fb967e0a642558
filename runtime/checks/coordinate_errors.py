"""The error of each coordinate and rate, and how fast it shrinks."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.failures import state_names

if TYPE_CHECKING:
    from symgen.runtime.checks.comparison import Comparison
    from symgen.runtime.system import System

_ROUND_OFF = 1e-12  # in parts of a variable's size: no order is seen in such differences


@dataclass(frozen=True)
class CoordinateError:
    """The estimated error of one coordinate or rate.

    Attributes
    ----------
    name, unit : str
    error, at_end : float
        The largest over the run, and that at its end, in this unit.
    relative : float
        `error` in parts of the variable's size.
    order : float or None
        Power of the step, or of the tolerance, by which differences shrink; None where they are round-off.
    """

    name: str
    unit: str
    error: float
    at_end: float
    relative: float
    order: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return the entry as a dictionary."""
        return asdict(self)


def coordinate_errors(system: System, compared: Comparison, refinement: float) -> tuple[CoordinateError, ...]:
    """Return the errors of all coordinates and rates, in the model's order.

    Parameters
    ----------
    refinement : float
        Factor between the steps or tolerances of successive runs.
    """
    units = [record["unit"] for record in (*system.coordinates, *system.rates)]
    errors, order = compared.errors, _orders(compared, refinement)
    return tuple(
        CoordinateError(name, unit, float(largest), float(last), float(part), power)
        for name, unit, largest, last, part, power in zip(
            state_names(system), units, errors.max(axis=0), errors[-1],
            (errors / compared.size).max(axis=0), order, strict=True,
        )
    )  # fmt: skip


def _orders(compared: Comparison, refinement: float) -> list[float | None]:
    """Return the order seen in the two finest differences of each variable that are not round-off."""
    found: list[float | None] = []
    for differences, size in zip(compared.largest.T, compared.size, strict=True):
        seen = np.flatnonzero(differences[1:] > _ROUND_OFF * size)
        if not seen.size:
            found.append(None)
            continue
        coarse, fine = differences[seen[-1] : seen[-1] + 2]
        found.append(float(np.log(coarse / fine) / np.log(refinement)) if coarse > 0.0 else None)
    return found
