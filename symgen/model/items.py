"""Every expression of a description with its address, its role, and the dimension that it must have."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from . import algebra
from .closure_types import CLOSURES
from .description import (
    Body,
    Bushing,
    Closure,
    ContactPair,
    Description,
    Drawing,
    Joint,
    Load,
    Loop,
    Rolling,
    Rotor,
    Solid,
    Spring,
)
from .joint_types import TYPES, JointType
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
    times,
    to_power,
)

# How many vectors each kind of drawing takes: places [m], but the second one of a force is the force [N].
DRAWINGS = {"spring": 2, "damper": 2, "bar": 2, "rail": 2, "pin": 1, "ground": 1, "force": 2}
RATES, INPUTS, COORDINATES, TIME_ITSELF = "a rate", "an input", "a coordinate", "the time"
PLACES = "the place of a point or axis"
STATES = "a state"
TABLES, KINKS = "a table", "a table that has kinks"
SENSED = "a reaction or an acceleration"


@dataclass(frozen=True)
class Role:
    """What kind of expression this is: what it may not depend on, and what to do instead."""

    title: str
    forbidden: tuple[str, ...] = ()
    hint: str | None = None


DEFINITION = Role("a definition")
POSITION = Role("a position or angle", (RATES, INPUTS, STATES, KINKS))
PLACEMENT = Role(
    "the place of a body",
    (RATES, INPUTS, PLACES, STATES, KINKS),
    "attach it by [joints], or by a constraint such as coincident",
)
UNVARYING = (RATES, INPUTS, PLACES, COORDINATES, TIME_ITSELF, STATES, TABLES)
FIXED_COM = Role(
    "the centre of mass of a joint's child", UNVARYING, "it is in the body's own frame, which the joint moves"
)
START = Role("a start", UNVARYING, "it is made of parameters and constants")
FIXED = Role("what is fixed in a body or joint", UNVARYING, "it is made of parameters and constants")
RATIO = Role("a ratio or length", UNVARYING, "it is made of parameters and constants")
SPANNED = Role(
    "the place of what pulls", (RATES, INPUTS, STATES), "rates belong in damping, inputs in forces"
)
REST = Role("the rest of a spring", (RATES, INPUTS), "rates belong in damping, inputs in forces")
CURVE = Role("the force of a spring")
CONSTANT = Role(
    "a mass or inertia",
    UNVARYING,
    "masses and inertias are made of parameters and constants; write others as energy, in [energy] kinetic",
)
GIVEN = Role(
    "the value of a parameter",
    UNVARYING,
    'it is made of parameters and constants; what moves comes in by a port of the kind "value"',
)
SHAPED = Role("the size, place or density of a solid", UNVARYING, "it is made of parameters and constants")
DENSITY = over(MASS, times(LENGTH, times(LENGTH, LENGTH)))
GRAVITY = Role(
    "gravity",
    (RATES, INPUTS, COORDINATES, PLACES, STATES),
    "fields that vary are stated by 'potential', or by attractors",
)
FIELD = Role(
    "a field of gravity", (RATES, INPUTS, STATES), "it is made of here_x, here_y, here_z, coordinates and t"
)
HEIGHT = Role(
    "the height of a surface",
    (RATES, INPUTS, COORDINATES, PLACES, TIME_ITSELF, STATES, KINKS),
    "it is made of here_x, here_y, parameters and constants",
)
KINETIC = Role("the kinetic energy", (INPUTS, STATES), "inputs and states act through forces and loads")
DERIVATIVE = Role("the derivative of a state")
POTENTIAL = Role("the potential energy", (RATES,), "rates belong in the dissipation or in forces")
FORCE_ROLE = Role("a force")
HOLONOMIC = Role(
    "a constraint",
    (RATES, INPUTS, STATES, KINKS),
    "an expression with rates belongs in [velocity_constraints], and so does one with states, by its derivative",
)
COURSE = Role(
    "a prescribed motion",
    (RATES, INPUTS, COORDINATES, PLACES, STATES, KINKS),
    "it is made of t, parameters and constants; hold expressions of coordinates at zero by 'couple'",
)
VELOCITY = Role("a velocity constraint", (KINKS,), "prescribed motion is written with t")
SPEED = Role("a sliding speed", (INPUTS, STATES), "prescribed motion is written with t")
LEVEL = Role(
    "a friction force",
    (RATES,),
    "give 'static', the force while it sticks, as well, or 'smooth'; alone it is made of coordinates, inputs, "
    "parameters and t",
)
STICKING = Role(
    "what a friction takes while it sticks", (RATES,), "it is made of coordinates, inputs, parameters and t"
)
SLIDING = Role("a friction force")
OBSERVED = Role("an output, event or size")
# Where reactions and accelerations may stand, besides in what events look at and in loads and bristles.
SOLVED_TABLES = ("outputs", "definitions", "start", "forces", "states")


class Item(NamedTuple):
    """An expression at an address; `dimension` is None where any will do."""

    table: str
    key: str
    expression: algebra.Expr
    role: Role
    dimension: Dimension | None = None


def unit_dimension(unit: str | None) -> Dimension | None:
    """Dimension of a unit's text; None where no unit was given."""
    return None if unit is None else parse_unit(unit).dimension


def items(d: Description) -> Iterator[Item]:
    """All expressions of a description but its definitions, which come first of all (`definition_items`)."""
    sizes = {c.name: unit_dimension(c.unit) for c in d.coordinates}
    speeds = {r.name: unit_dimension(r.unit) for r in d.rates}
    yield from _use_items(d)
    children = {j.child for j in d.joints}
    for body in d.bodies:
        yield from body_items(body, body.name in children)
    yield from _value_items(d, sizes)
    for joint in d.joints:
        yield from joint_items(joint)
    yield from _place_items(d)
    yield from _gravity_items(d)
    yield from _energy_items(d)
    yield from _force_items(d, sizes, speeds)
    for c in d.constraints:
        yield Item("constraints", c.name, c.expression, HOLONOMIC)
    for loop in d.loops:
        yield from loop_items(loop, sizes)
    for r in d.rotors:
        yield from _rotor_items(r)
    for c in d.closures:
        yield from _closure_items(c)
    for r in d.rolling:
        yield from _rolling_items(r)
    yield from _contact_items(d)
    for c in d.velocity_constraints:
        yield Item("velocity_constraints", c.name, c.expression, VELOCITY)
    for name, value in d.outputs:
        yield Item("outputs", name, value, OBSERVED)
    yield from _event_items(d, sizes, speeds)
    for equation in d.start.equations if d.start is not None else ():
        yield Item("start", equation.key, equation.expression, OBSERVED, unit_dimension(equation.unit))
    for drawing in d.drawings:
        yield from _drawing_items(drawing)


def _use_items(d: Description) -> Iterator[Item]:
    """What assemblies are given."""
    for use in d.uses:
        for g in use.given:
            if not isinstance(g.value, (str, float)) and g.kind != "free":
                role = GIVEN if g.kind == "parameter" else DEFINITION
                yield Item(f"use.{use.name}", g.key, g.value, role, unit_dimension(g.unit))


def _value_items(d: Description, sizes: dict[str, Dimension | None]) -> Iterator[Item]:
    """Starts of coordinates and rates that are expressions of parameters."""
    starts = [(c, sizes[c.name]) for c in d.coordinates] + [(r, unit_dimension(r.unit)) for r in d.rates]
    for x, size in starts:
        if x.formula is not None:
            yield Item(x.formula.table, x.formula.key, x.formula.expression, START, size)


def _place_items(d: Description) -> Iterator[Item]:
    """What is fixed on bodies: points, frames, springs and bushings between them, axes."""
    framed = {f.name for f in d.frames}
    for point in d.points:
        table = "frames" if point.name in framed else "points"
        yield from _vector_items(f"{table}.{point.name}", "at", point.at, FIXED, LENGTH)
    for frame in d.frames:
        yield from _vector_items(f"frames.{frame.name}", "rpy", frame.rpy, FIXED, DIMENSIONLESS)
    for spring in d.springs:
        yield from spring_items(spring)
    for bushing in d.bushings:
        yield from _bushing_items(bushing)
    for axis in d.axes:
        yield from _vector_items(f"axes.{axis.name}", "direction", axis.direction, FIXED)


def _gravity_items(d: Description) -> Iterator[Item]:
    of_attraction = times(ACCELERATION, times(LENGTH, LENGTH))
    if d.field is not None:
        yield Item("gravity", "potential", d.field, FIELD, times(ACCELERATION, LENGTH))
    if d.gravitation is not None:
        yield Item("gravity", "constant", d.gravitation, RATIO, over(of_attraction, MASS))
    for a in d.attractors:
        yield from _vector_items("gravity", f"attractors.{a.name}.at", a.at, SPANNED, LENGTH)
        yield Item("gravity", f"attractors.{a.name}.mu", a.mu, RATIO, of_attraction)
    for axis, value in zip("xyz", d.gravity or ()):
        yield Item("gravity", axis, value, GRAVITY, ACCELERATION)


def _energy_items(d: Description) -> Iterator[Item]:
    energies = (
        ("kinetic", d.kinetic, KINETIC, ENERGY),
        ("potential", d.potential, POTENTIAL, ENERGY),
        ("dissipation", d.dissipation, FORCE_ROLE, POWER),
    )
    for key, value, role, size in energies:
        if value is not None:
            yield Item("energy", key, value, role, size)


def _force_items(
    d: Description, sizes: dict[str, Dimension | None], speeds: dict[str, Dimension | None]
) -> Iterator[Item]:
    """Forces on coordinates, derivatives of states, loads."""
    for name, value in d.forces:
        size = over(sizes[name], TIME) if sizes.get(name) else speeds.get(name)
        yield Item("forces", name, value, FORCE_ROLE, None if size is None else over(POWER, size))
    for state in d.states:
        size = speeds.get(state.name)
        derivative = None if size is None else over(size, TIME)
        yield Item("states", f"{state.name}.derivative", state.derivative, DERIVATIVE, derivative)
    for load in d.loads:
        yield from _load_items(load)


def _rotor_items(r: Rotor) -> Iterator[Item]:
    table = f"rotors.{r.name}"
    yield Item(table, "inertia", r.inertia, CONSTANT, INERTIA)
    yield from _vector_items(table, "at", r.at, FIXED, LENGTH)
    if r.angle is not None:
        yield Item(table, "angle", r.angle, POSITION, DIMENSIONLESS)


def _rolling_items(r: Rolling) -> Iterator[Item]:
    table = f"rolling.{r.name}"
    if r.radius is not None:
        yield Item(table, r.kind, r.radius, RATIO, LENGTH)
    yield from _vector_items(table, "at", r.at, FIXED, LENGTH)
    if r.height is not None:
        yield Item(table, "height", r.height, HEIGHT, LENGTH)


def definition_items(d: Description) -> Iterator[Item]:
    """The definitions, in order."""
    for name, value in d.definitions:
        yield Item("definitions", name, value, DEFINITION)


def body_items(body: Body, is_child: bool) -> Iterator[Item]:
    """The expressions of a body; `is_child` tells that a joint places it."""
    place = PLACEMENT if not is_child else FIXED_COM
    table = f"bodies.{body.name}"
    for solid in body.solids:
        yield from _solid_items(table, solid)
    if body.mass is not None:
        yield Item(table, "mass", body.mass, CONSTANT, MASS)
    yield from _vector_items(table, "com", body.com, place, LENGTH)
    for k, value in enumerate(body.inertia):
        yield Item(table, "inertia" if len(body.inertia) == 1 else f"inertia[{k}]", value, CONSTANT, INERTIA)
    if body.angle is not None:
        yield Item(table, "angle", body.angle, place, DIMENSIONLESS)
    for k, (_, value) in enumerate(body.rotation):
        yield Item(table, f"rotation[{k}]", value, place, DIMENSIONLESS)
    if body.shape is not None:
        for k, value in enumerate(body.shape.sizes):
            yield Item(table, f"shape.{body.shape.kind}[{k}]", value, OBSERVED, LENGTH)


def spring_items(s: Spring) -> Iterator[Item]:
    """The expressions of a spring."""
    table = f"springs.{s.name}"
    for k, place in enumerate(s.places):
        yield from _vector_items(table, f"points[{k}]", place, SPANNED, LENGTH)
    turns = s.angle is not None
    size, force = (DIMENSIONLESS, ENERGY) if turns else (LENGTH, FORCE)
    stiffness, damping = (over(ENERGY, times(size, size)), over(times(ENERGY, TIME), times(size, size)))
    for key, value, role, dimension in (
        ("angle", s.angle, SPANNED, DIMENSIONLESS),
        ("stiffness", s.stiffness, RATIO, stiffness),
        ("curve", s.curve, CURVE, force),
        ("rest" if turns else "length", s.rest, REST, size),
        ("damping", s.damping, RATIO, damping),
        ("preload", s.preload, RATIO, force),
        ("mass", s.mass, CONSTANT, MASS),
    ):
        if value is not None:
            yield Item(table, key, value, role, dimension)


def _bushing_items(b: Bushing) -> Iterator[Item]:
    area = times(LENGTH, LENGTH)
    for key, values, energy in (
        ("stiffness", b.stiffness, ENERGY),
        ("damping", b.damping, times(ENERGY, TIME)),
    ):
        n = len(values) - (1 if len(values) == 3 else 3)  # along axes; the others about them
        for k, value in enumerate(values):
            size = over(energy, area) if k < n else energy
            yield Item(f"bushings.{b.name}", f"{key}[{k}]", value, RATIO, size)


def _closure_items(c: Closure) -> Iterator[Item]:
    slides = CLOSURES[c.type].moves == "slide"
    size = LENGTH if slides else DIMENSIONLESS
    stiffness = over(ENERGY, times(size, size))
    for key, role, dimension in (
        ("pitch", RATIO, LENGTH),
        ("stiffness", RATIO, stiffness),
        ("rest", RATIO, size),
        ("damping", RATIO, times(stiffness, TIME)),
        ("friction", LEVEL, FORCE if slides else ENERGY),
    ):
        value = getattr(c, key)
        if value is not None:
            yield Item(f"closures.{c.name}", key, value, role, dimension)


def _solid_items(table: str, solid: Solid) -> Iterator[Item]:
    key = solid.place
    yield from _vector_items(table, f"{key}.{solid.kind}", solid.sizes, SHAPED, LENGTH)
    yield from _vector_items(table, f"{key}.offset", solid.offset, SHAPED, LENGTH)
    yield from _vector_items(table, f"{key}.rpy", solid.rpy, SHAPED, DIMENSIONLESS)
    if solid.density is not None:
        yield Item(
            table, f"{key}.density" if solid.own_density else "density", solid.density, SHAPED, DENSITY
        )


def _load_items(load: Load) -> Iterator[Item]:
    table = f"loads.{load.name}"
    yield from _vector_items(table, "point", load.point, POSITION, LENGTH)
    yield from _vector_items(table, "force", load.force, FORCE_ROLE, FORCE)
    yield from _vector_items(table, "torque", load.torque, FORCE_ROLE, ENERGY)


def _vector_items(
    table: str, key: str, values: tuple[algebra.Expr, ...], role: Role, dimension: Dimension | None = None
) -> Iterator[Item]:
    for k, value in enumerate(values):
        yield Item(table, f"{key}[{k}]", value, role, dimension)


def joint_items(joint: Joint) -> Iterator[Item]:
    """The expressions of a joint, with the dimensions that its type gives them."""
    table, kind = f"joints.{joint.name}", TYPES[joint.type]
    yield from _vector_items(table, "origin.xyz", joint.xyz, FIXED, LENGTH)
    yield from _vector_items(table, "origin.rpy", joint.rpy, FIXED, DIMENSIONLESS)
    for key in ELASTIC:
        values = getattr(joint, key)
        single = len(values) == 1
        for k, value in enumerate(values):
            # One number for displacements and angles alike can have no unit: its two dimensions differ.
            sizes = _elastic_dimensions(kind, key)
            for size in dict.fromkeys(sizes if single else sizes[k : k + 1]):
                yield Item(table, key if single else f"{key}[{k}]", value, FIXED, size)
    if joint.limits:
        yield from _vector_items(table, "limits", joint.limits, FIXED, _elastic_dimensions(kind, "rest")[0])
    if joint.restitution is not None:
        yield Item(table, "restitution", joint.restitution, RATIO, DIMENSIONLESS)
    if joint.pitch is not None:
        yield Item(table, "pitch", joint.pitch, FIXED, LENGTH)


ELASTIC = ("stiffness", "damping", "armature", "rest")


@functools.cache
def _elastic_dimensions(kind: JointType, key: str) -> tuple[Dimension, ...]:
    """Dimensions of a joint's spring or damper, one for each coordinate or rate; `rest` has the coordinates'."""
    sizes = [unit_dimension(unit) for unit in kind.units] + [DIMENSIONLESS] * (3 * kind.quaternion)
    if key == "rest":
        return tuple(sizes)
    energy = POWER if key == "damping" else ENERGY
    divisors = sizes if key == "stiffness" else [over(size, TIME) for size in sizes]
    return tuple(over(energy, times(x, x)) for x in divisors)


def loop_items(loop: Loop, sizes: Mapping[str, Dimension | None]) -> Iterator[Item]:
    """The expressions among the arguments of a ready-made constraint."""
    arguments = dict(loop.arguments)
    named = arguments.get("coordinates") or (arguments.get("coordinate") or arguments.get("input"), None)
    first, second = (sizes.get(x) for x in named)
    if loop.kind == "rack":
        first, second = second, first
    if loop.kind == "differential":
        second = sizes.get(arguments["outputs"][0])
    around = LENGTH if loop.kind == "belt" else first
    roles = {
        "length": (RATIO, LENGTH),
        "ratio": (RATIO, None if first is None or second is None else over(first, second)),
        "radius": (RATIO, LENGTH),
        "radii": (RATIO, LENGTH),
        "teeth": (RATIO, DIMENSIONLESS),
        "efficiency": (RATIO, DIMENSIONLESS),
        "offset": (HOLONOMIC, around),
        "follows": (COURSE, first),
        "expression": (HOLONOMIC, None),
    }
    for key, (role, dimension) in roles.items():
        value, place = arguments.get(key), f"{loop.kind}.{key}"
        if isinstance(value, tuple):
            yield from _vector_items(f"constraints.{loop.name}", place, value, role, dimension)
        elif value is not None:
            yield Item(f"constraints.{loop.name}", place, value, role, dimension)


def _contact_items(d: Description) -> Iterator[Item]:
    for stop in d.stops:
        table = f"stops.{stop.name}"
        yield Item(table, "gap", stop.gap, HOLONOMIC)
        yield Item(table, "restitution", stop.restitution, RATIO, DIMENSIONLESS)
    for f in d.frictions:
        table = f"friction.{f.name}"
        if f.across is None:
            yield Item(table, "speed", f.speed, SPEED)
        else:
            yield from (Item(table, f"speeds[{k}]", s, SPEED) for k, s in enumerate(f.speeds))
        # What slides may know how fast; what sticks needs a force of its own.
        sliding = LEVEL if f.static is None and f.smooth is None else SLIDING
        yield Item(table, "coefficient" if f.normal else "force", f.level, sliding)
        if f.static is not None:
            yield Item(table, "static", f.static, STICKING)
        if f.smooth is not None:
            yield Item(table, "creep" if f.creeps else "smooth", f.smooth, RATIO)
    for b in d.bristles:
        table = f"bristles.{b.name}"
        yield Item(table, "speed", b.speed, SPEED)
        for key in ("stiffness", "damping", "viscous", "coulomb", "static"):
            if getattr(b, key) is not None:
                yield Item(table, key, getattr(b, key), LEVEL)
        if b.stribeck is not None:
            yield Item(table, "stribeck", b.stribeck, RATIO)
    for c in d.contacts:
        table = f"contacts.{c.name}"
        yield Item(table, "gap", c.gap, HOLONOMIC)
        for key in ("stiffness", "exponent", "damping", "friction", "smooth"):
            value = getattr(c, key)
            if value is not None:
                size = DIMENSIONLESS if key in ("exponent", "friction") else None
                yield Item(table, key, value, RATIO, size)
        if c.slip is not None:
            yield Item(table, "slip", c.slip, SPEED)
    for pair in d.pairs:
        yield from _pair_items(pair)


def _pair_items(pair: ContactPair) -> Iterator[Item]:
    table, exponent = f"contacts.{pair.name}", pair.exponent
    for solid in (*pair.shapes, *pair.other_shapes):
        yield from _solid_items(table, solid)
    if pair.height is not None:
        yield Item(table, "height", pair.height, HEIGHT, LENGTH)
    stiffness = None
    if exponent is not None and exponent.is_Number:
        stiffness = over(FORCE, to_power(LENGTH, Fraction(str(exponent)).limit_denominator(1000)))
    for key, size in (
        ("restitution", DIMENSIONLESS),
        ("friction", DIMENSIONLESS),
        ("static", DIMENSIONLESS),
        ("stiffness", stiffness),
        ("exponent", DIMENSIONLESS),
        ("damping", over(TIME, LENGTH)),
        ("smooth", over(LENGTH, TIME)),
    ):
        value = getattr(pair, key)
        if value is not None:
            yield Item(table, key, value, RATIO, size)


def _event_items(
    d: Description, sizes: Mapping[str, Dimension | None], speeds: Mapping[str, Dimension | None]
) -> Iterator[Item]:
    for event in d.events:
        yield Item(f"events.{event.name}", "when", event.when, OBSERVED)
        for reset in event.resets:
            size = sizes.get(reset.target)
            if size is not None and reset.is_rate:
                size = over(size, TIME)
            elif size is None:
                size = speeds.get(reset.target)
            key = f"then.reset.dot({reset.target})" if reset.is_rate else f"then.reset.{reset.target}"
            yield Item(f"events.{event.name}", key, reset.value, OBSERVED, size)


def _drawing_items(drawing: Drawing) -> Iterator[Item]:
    for k, vector in enumerate(drawing.vectors):
        key = drawing_key(drawing.kind, k)
        dimension = FORCE if drawing.kind == "force" and k == 1 else LENGTH
        yield from _vector_items(f"draw.{drawing.name}", key, vector, OBSERVED, dimension)


def drawing_key(kind: str, k: int) -> str:
    """The key of the k-th vector of a drawing."""
    return f"{kind}[{k}]" if DRAWINGS[kind] > 1 else kind
