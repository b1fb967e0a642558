"""Quantities of the command line: '10 deg' is 0.1745… for an angle; '5 N' for a length is refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import click

from symgen.runtime.errors import nearest
from symgen.runtime.names import inside_dot, motion_records, rate_indices
from symgen.runtime.quantities import QuantityError, in_si

if TYPE_CHECKING:
    from symgen.runtime.system import System


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
    records = {record["name"]: record for _, record in motion_records(system.coordinates, system.integrals)}
    records |= {record["name"]: record for record in (system.rates[i] for i in system.states)}
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
        try:
            values[name] = in_si(text, by_name[name]["unit"], f"{option} {name}={text}")
        except QuantityError as error:
            raise click.UsageError(str(error)) from None
    return values
