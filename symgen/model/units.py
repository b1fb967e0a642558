"""Units in models: the table that both halves know, with errors for a model's author. Imports no SymPy."""

from __future__ import annotations

from collections.abc import Iterable

from symgen.runtime.graph import units
from symgen.runtime.graph.units import (
    ACCELERATION,
    ATOMS,
    DIMENSIONLESS,
    ENERGY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    POWER,
    TIME,
    VOLT,
    Dimension,
    Unit,
    dimension,
    dimension_text,
    over,
    times,
    to_power,
    unit_text,
)

from ..errors import ModelError

__all__ = [
    "ACCELERATION",
    "ATOMS",
    "DIMENSIONLESS",
    "ENERGY",
    "FORCE",
    "INERTIA",
    "LENGTH",
    "MASS",
    "POWER",
    "TIME",
    "VOLT",
    "Dimension",
    "Unit",
    "dimension",
    "dimension_text",
    "in_si",
    "over",
    "parse_unit",
    "times",
    "to_power",
    "unit_text",
]


def parse_unit(text: str) -> Unit:
    """Parse a unit such as `kg*m^2`, see `symgen.runtime.graph.units.parse_unit`.

    Raises
    ------
    ModelError
        With the column in `text` and the nearest unit.
    """
    try:
        return units.parse_unit(text)
    except units.UnitError as error:
        raise ModelError(error.message, column=error.column, hint=error.hint) from None


def in_si(values: Iterable[float], size: Unit | None) -> tuple[float, ...]:
    """Return values of a unit in SI; without a unit they are that already.

    Raises
    ------
    ModelError
        One of them is larger than numbers go.
    """
    if size is None or (size.factor == 1 and not size.pi_power):
        return tuple(values)
    return tuple(_in_si(value, size) for value in values)


def _in_si(value: float, size: Unit) -> float:
    try:
        return size.to_si(value)
    except OverflowError:
        message = f"the number {value:g} {size.text} is outside the range of double precision"
        raise ModelError(message, hint="look at the exponent and the unit") from None
