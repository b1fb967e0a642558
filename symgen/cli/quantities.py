"""Quantities of the command line: '10 deg' is 0.1745… for an angle; '5 N' for a length is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import click

from symgen.errors import ModelError
from symgen.runtime.errors import nearest
from symgen.runtime.lazy import Late
from symgen.runtime.names import inside_dot, rate_indices

if TYPE_CHECKING:
    from symgen.runtime.system import System

units = Late("symgen.model.units")

_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?(?=$|[\s*]|[A-Za-z])", re.ASCII
)


def parameter_values(system: System, pairs: Iterable[tuple[str, str]]) -> dict[str, float]:
    """Return the values of `--set`, in SI."""
    records = {record["name"]: record for record in (*system.parameters, *system.inputs)}
    constants = {record["name"] for record in system.constants}
    coordinates = {record["name"] for record in system.coordinates}

    def why_not(name: str) -> str | None:
        if name in constants:
            return (
                f"{name!r} is a constant of model {system.name!r}: it is folded into the code, "
                "not settable at run time; make it a parameter in the model"
            )
        return f"{name!r} is a coordinate: use --start or --rate" if name in coordinates else None

    return _values("--set", pairs, records, f"model {system.name!r} has no parameter or input", why_not)


def start_values(system: System, option: str, pairs: Iterable[tuple[str, str]]) -> dict[str, float]:
    """Return the values of `--start` or `--rate`, in SI; a rate may also be written `dot(x)` or as its coordinate."""
    records = {record["name"]: record for record in system.coordinates}
    if option == "--rate":
        places = rate_indices(system.coordinates, system.rates, system.quaternions)
        records = {name: system.rates[index] for name, index in places.items()}
        pairs = [(inside_dot(name), text) for name, text in pairs]
    what = "rate" if option == "--rate" and system.quaternions else "coordinate"
    return _values(
        option, pairs, records, f"model {system.name!r} has no {what}", lambda name: _elsewhere(system, name)
    )


def _elsewhere(system: System, name: str) -> str | None:
    """Say how a name is given that is no coordinate, or no rate."""
    if any(name == record["name"] for record in (*system.parameters, *system.inputs)):
        return f"{name!r} is a parameter: use --set"
    if any(name == record["name"] for record in system.rates):
        return f"{name!r} is a rate: use --rate"
    for number, place in enumerate(system.quaternions):
        if any(name == record["name"] for record in system.coordinates[place : place + 4]):
            first = place - number  # each quaternion before it has one rate less than coordinates
            spin = ", ".join(record["name"] for record in system.rates[first : first + 3])
            return f"{name!r} is an element of a quaternion, whose rates are the angular velocity {spin}"
    return None


def _values(
    option: str, pairs, by_name: Mapping[str, dict[str, Any]], unknown: str, why_not
) -> dict[str, float]:
    values: dict[str, float] = {}
    for name, text in pairs:
        if name not in by_name:
            raise click.UsageError(why_not(name) or f"{option}: {unknown} {name!r}: {nearest(name, by_name)}")
        if name in values:
            raise click.UsageError(f"{option} gives {name!r} twice")
        values[name] = quantity(text, by_name[name]["unit"], f"{option} {name}={text}")
    return values


def quantity(text: str, unit: str, shown: str) -> float:
    """Return a number, or a number with a unit, in SI.

    Parameters
    ----------
    text : str
    unit : str
        The unit that the value must fit; "" fits all.
    shown : str
        What the user wrote, for messages.

    Raises
    ------
    click.UsageError
        It is no quantity, or its unit does not fit.
    """
    match = _NUMBER.match(text)
    if match is None:
        raise click.UsageError(
            f"{shown}: {text!r} is neither a number nor a quantity such as '0.2 {unit or 'm'}'"
        )
    number, rest = match.group(), text[match.end() :].strip()
    value = float(number)
    if rest:
        value = _in_si(Fraction(number), rest.removeprefix("*").strip(), unit, shown)
    if not math.isfinite(value):
        raise click.UsageError(f"{shown}: {number} is outside the range of double precision")
    return value


def _in_si(number: Fraction, given: str, unit: str, shown: str) -> float:
    # Numbers without a unit need no unit tables: they take a while to make.
    try:
        parsed = units.parse_unit(given)
    except ModelError as error:
        raise click.UsageError(
            f"{shown}: {error.message}" + (f"; {error.hint}" if error.hint else "")
        ) from None
    if unit:
        wanted = units.parse_unit(unit)
        if wanted.dimension != parsed.dimension:
            raise click.UsageError(
                f"{shown}: the unit {given} does not fit {unit}, in which the model has it: "
                f"{units.dimension_text(parsed.dimension)} against {units.dimension_text(wanted.dimension)}"
            )
    return parsed.to_si(number)
