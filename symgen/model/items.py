"""Every expression of a description with its address, its role, and the dimension that it must have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy

from .description import Body, Description, Load
from .units import (
    ACCELERATION,
    DIMENSIONLESS,
    ENERGY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    POWER,
    TIME,
    Dimension,
    over,
    parse_unit,
)

RATES, INPUTS, COORDINATES, TIME_ITSELF = "a rate", "an input", "a coordinate", "the time"


@dataclass(frozen=True)
class Role:
    """What kind of expression this is: what it may not depend on, and what to do instead."""

    title: str
    forbidden: tuple[str, ...] = ()
    hint: str | None = None


DEFINITION = Role("a definition")
POSITION = Role("a position or angle", (RATES, INPUTS))
CONSTANT = Role(
    "a mass or inertia",
    (RATES, INPUTS, COORDINATES, TIME_ITSELF),
    "masses and inertias are made of parameters and constants; write others as energy, in [energy] kinetic",
)
GRAVITY = Role(
    "gravity", (RATES, INPUTS, COORDINATES), "write fields that vary as energy, in [energy] potential"
)
KINETIC = Role("the kinetic energy", (INPUTS,), "inputs act through forces and loads")
POTENTIAL = Role(
    "the potential energy", (RATES, INPUTS), "rates belong in the dissipation or in forces, inputs in forces"
)
FORCE_ROLE = Role("a force")
HOLONOMIC = Role(
    "a constraint", (RATES, INPUTS), "an expression with rates belongs in [velocity_constraints]"
)
VELOCITY = Role("a velocity constraint", (INPUTS,), "prescribed motion is written with t")
OBSERVED = Role("an output, event or size")


@dataclass(frozen=True)
class Item:
    """An expression at an address; `dimension` is None where any will do."""

    table: str
    key: str
    expression: sympy.Expr
    role: Role
    dimension: Dimension | None = None


def unit_dimension(unit: str | None) -> Dimension | None:
    """Dimension of a unit's text; None where no unit was given."""
    return None if unit is None else parse_unit(unit).dimension


def items(d: Description) -> Iterator[Item]:
    """All expressions of a description but its definitions, which come first of all (`definition_items`)."""
    for body in d.bodies:
        yield from _body_items(body)
    for axis, value in zip("xyz", d.gravity or ()):
        yield Item("gravity", axis, value, GRAVITY, ACCELERATION)
    energies = (
        ("kinetic", d.kinetic, KINETIC, ENERGY),
        ("potential", d.potential, POTENTIAL, ENERGY),
        ("dissipation", d.dissipation, FORCE_ROLE, POWER),
    )
    for key, value, role, size in energies:
        if value is not None:
            yield Item("energy", key, value, role, size)
    sizes = {c.name: unit_dimension(c.unit) for c in d.coordinates}
    for name, value in d.forces:
        size = sizes.get(name)
        yield Item("forces", name, value, FORCE_ROLE, None if size is None else over(ENERGY, size))
    for load in d.loads:
        yield from _load_items(load)
    for c in d.constraints:
        yield Item("constraints", c.name, c.expression, HOLONOMIC)
    for c in d.velocity_constraints:
        yield Item("velocity_constraints", c.name, c.expression, VELOCITY)
    for name, value in d.outputs:
        yield Item("outputs", name, value, OBSERVED)
    yield from _event_items(d, sizes)


def definition_items(d: Description) -> Iterator[Item]:
    """The definitions, in order."""
    for name, value in d.definitions:
        yield Item("definitions", name, value, DEFINITION)


def _body_items(body: Body) -> Iterator[Item]:
    table = f"bodies.{body.name}"
    if body.mass is not None:
        yield Item(table, "mass", body.mass, CONSTANT, MASS)
    for k, value in enumerate(body.com):
        yield Item(table, f"com[{k}]", value, POSITION, LENGTH)
    for k, value in enumerate(body.inertia):
        yield Item(table, "inertia" if len(body.inertia) == 1 else f"inertia[{k}]", value, CONSTANT, INERTIA)
    if body.angle is not None:
        yield Item(table, "angle", body.angle, POSITION, DIMENSIONLESS)
    for k, (_, value) in enumerate(body.rotation):
        yield Item(table, f"rotation[{k}]", value, POSITION, DIMENSIONLESS)
    if body.shape is not None:
        for k, value in enumerate(body.shape.sizes):
            yield Item(table, f"shape.{body.shape.kind}[{k}]", value, OBSERVED, LENGTH)


def _load_items(load: Load) -> Iterator[Item]:
    table = f"loads.{load.name}"
    for k, value in enumerate(load.point):
        yield Item(table, f"point[{k}]", value, POSITION, LENGTH)
    for k, value in enumerate(load.force):
        yield Item(table, f"force[{k}]", value, FORCE_ROLE, FORCE)
    for k, value in enumerate(load.torque):
        yield Item(table, f"torque[{k}]", value, FORCE_ROLE, ENERGY)


def _event_items(d: Description, sizes: dict[str, Dimension | None]) -> Iterator[Item]:
    for event in d.events:
        yield Item(f"events.{event.name}", "when", event.when, OBSERVED)
        for reset in event.resets:
            size = sizes.get(reset.target)
            if size is not None and reset.is_rate:
                size = over(size, TIME)
            key = f"then.reset.dot({reset.target})" if reset.is_rate else f"then.reset.{reset.target}"
            yield Item(f"events.{event.name}", key, reset.value, OBSERVED, size)
