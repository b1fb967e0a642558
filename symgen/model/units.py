"""Units in models: the table that both halves know, with errors for a model's author. Imports no SymPy."""

from __future__ import annotations

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
