"""The frozen description of a mechanical system: exactly what the user said, nothing derived."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sympy import Expr


@dataclass(frozen=True)
class Parameter:
    """A run-time settable number; `unit` is None where the user gave none."""

    name: str
    value: float
    unit: str | None = None
    doc: str = ""


@dataclass(frozen=True)
class Constant:
    """A number that is folded into the code at derive time."""

    name: str
    value: float
    unit: str | None = None


@dataclass(frozen=True)
class Coordinate:
    """A generalised coordinate: `start`, `rate` are enforced, `guess`, `rate_guess` assembly may move."""

    name: str
    unit: str | None = None
    start: float | None = None
    rate: float | None = None
    guess: float = 0.0
    rate_guess: float = 0.0


@dataclass(frozen=True)
class Input:
    """A control input with its default value."""

    name: str
    unit: str | None = None
    default: float = 0.0


@dataclass(frozen=True)
class Shape:
    """What is drawn for a body: box, sphere, cylinder, capsule (with sizes) or mesh (with a file)."""

    kind: str
    sizes: tuple[Expr, ...] = ()
    mesh: str = ""


@dataclass(frozen=True)
class Body:
    """A rigid body or point mass.

    `com` has 2 (planar) or 3 components; `inertia` has 0, 1 (planar), 3 or 6 entries
    (Ixx, Iyy, Izz, Ixy, Ixz, Iyz: elements of the tensor about the centre of mass, in body axes).
    `angle` orients a planar body; `rotation` is a sequence of (axis, angle), successive and body-fixed.
    """

    name: str
    com: tuple[Expr, ...]
    mass: Expr | None = None
    inertia: tuple[Expr, ...] = ()
    angle: Expr | None = None
    rotation: tuple[tuple[str, Expr], ...] = ()
    shape: Shape | None = None

    @property
    def planar(self) -> bool:
        """Whether the body moves in the x-y plane."""
        return len(self.com) == 2


@dataclass(frozen=True)
class Load:
    """A force at a point, or a torque on a body, in world axes; 2 or 3 components (a planar torque: 1)."""

    name: str
    point: tuple[Expr, ...] = ()
    force: tuple[Expr, ...] = ()
    body: str | None = None
    torque: tuple[Expr, ...] = ()


@dataclass(frozen=True)
class Constraint:
    """An expression that is held at zero; `kind` is "holonomic" or "velocity"."""

    name: str
    expression: Expr
    kind: str = "holonomic"


@dataclass(frozen=True)
class Reset:
    """After an event, coordinate `target` (or its rate) becomes `value` of the state before."""

    target: str
    is_rate: bool
    value: Expr


@dataclass(frozen=True)
class Event:
    """A zero crossing of `when`; `action` is terminate, record, reset; `direction` rising, falling, both."""

    name: str
    when: Expr
    direction: str = "both"
    action: str = "record"
    resets: tuple[Reset, ...] = ()


@dataclass(frozen=True)
class Description:
    """A mechanical system as the user described it.

    Expressions are SymPy objects over plain `Symbol(name)` (parameters, constants, coordinates, inputs,
    definitions, `t`) and the opaque functions of `symgen.model.functions` (`dot`, `minimum`, `maximum`).
    A definition's symbol stands for its expression; definitions come in an order in which each uses
    only those before it. `gravity` is an acceleration vector.
    """

    name: str
    coordinates: tuple[Coordinate, ...]
    description: str = ""
    parameters: tuple[Parameter, ...] = ()
    constants: tuple[Constant, ...] = ()
    inputs: tuple[Input, ...] = ()
    definitions: tuple[tuple[str, Expr], ...] = ()
    bodies: tuple[Body, ...] = ()
    gravity: tuple[Expr, Expr, Expr] | None = None
    kinetic: Expr | None = None
    potential: Expr | None = None
    dissipation: Expr | None = None
    forces: tuple[tuple[str, Expr], ...] = ()
    loads: tuple[Load, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    velocity_constraints: tuple[Constraint, ...] = ()
    outputs: tuple[tuple[str, Expr], ...] = ()
    events: tuple[Event, ...] = ()
    run: MappingProxyType[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    folder: Path | None = None
