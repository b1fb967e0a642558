"""Sensors: what is measured of a mechanism, by name, as expressions and as what only the solved equations tell.

A sensor is a symbol that is called as it is written, `velocity("tip", "x")`. Places, velocities, distances, angles and
powers are functions of the state: they become definitions. Accelerations and reactions follow from the state through
the equations of motion; they stay symbols, which the derivation gives values (`symgen/derive/sensed.py`).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..errors import ModelError, nearest
from . import algebra
from .description import Description, Frame, Sensor
from .elements import Vector, Writer, cardan, euler_angles, scalar_product
from .expression_tree import names_in
from .functions import dot, sensor
from .items import Item, definition_items, items
from .joint_types import TYPES, sequence_fault
from .names import SENSOR_ARITY
from .ready_made import HALF, WORLD
from .sources import Sources
from .unevaluated import difference, negated, product, squared, total
from .units import DIMENSIONLESS, ENERGY, FORCE, LENGTH, POWER, TIME, Dimension, over

AXES = ("x", "y", "z")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
_CALL = re.compile(r'(\w+)\(((?:"[\w.]+"(?:, )?)+)\)')
# What NAME.vx means, by the letters before the axis.
SHORT = {"": "position", "v": "velocity", "a": "acceleration", "w": "angular_velocity"}
_DOTTED = re.compile(rf"(.+)\.({'|'.join(SHORT)})([xyz])")
DEFINITION, SOLVED = "definition", "sensor"  # what a sensor's name is


def with_sensors(
    d: Description, sources: Sources, kinds: Mapping[str, str]
) -> tuple[Description, dict[str, str]]:
    """Write out the sensors that the expressions of a description mention.

    Parameters
    ----------
    d : Description
        In which bodies, joints, frames and force elements fit together.
    sources : Sources
    kinds : mapping of str to str
        What each declared name is.

    Returns
    -------
    Description
        With definitions for what the state tells, `sensors` for the rest, and the points and axes that they need.
    dict of str to str
        What each name is, those of sensors and of these points and axes included.
    """
    mentioned: dict[str, Item] = {}
    for item in (*definition_items(d), *items(d)):
        for name in names_in(item.expression):
            if name not in kinds:
                mentioned.setdefault(name, item)
    calls = {name: sensor_call(name) for name in sorted(mentioned)}
    found = {name: call for name, call in calls.items() if call is not None}
    if not found:
        return d, dict(kinds)
    writer = _Sensors(d, sources, set(kinds))
    for name, (kind, arguments) in found.items():
        item = mentioned[name]
        writer.item = item
        writer.define(name, kind, arguments)
    points, axes = writer.writer.points, writer.writer.axes
    return replace(
        d,
        definitions=(*d.definitions, *writer.definitions.items()),
        points=(*d.points, *points),
        axes=(*d.axes, *axes),
        sensors=tuple(writer.solved.values()),
    ), {
        **kinds,
        **dict.fromkeys(writer.definitions, DEFINITION),
        **dict.fromkeys(writer.solved, SOLVED),
        **{f"{p.name}_{c}": "point component" for p in points for c in AXES},
        **{f"{a.name}_{c}": "axis component" for a in axes for c in AXES},
    }


def sensor_call(name: str) -> tuple[str, tuple[str, ...]] | None:
    """The sensor that a name is: its kind and the names that it takes."""
    call = _CALL.fullmatch(name)
    if call is not None and call[1] in SENSOR_ARITY:
        return call[1], tuple(part.strip('"') for part in call[2].split(", "))
    short = _DOTTED.fullmatch(name)
    return None if short is None else (SHORT[short[2]], (short[1], short[3]))


def resolve(
    sensors: tuple[Sensor, ...], d: Description, parts: Mapping, sources: Sources
) -> tuple[Sensor, ...]:
    """Sensors with the constraints, stops and frictions that they name.

    Parameters
    ----------
    sensors : tuple of Sensor
    d : Description
        With all its constraints written out.
    parts : mapping of str to tuple of str
        The constraints that each ready-made one has made.
    sources : Sources
    """
    held = {x.name for x in (*d.constraints, *d.velocity_constraints, *d.stops)}
    held |= {row for f in d.frictions for row in f.rows}
    made: list[Sensor] = []
    for s in sensors:
        rows = tuple(part for name in s.rows for part in parts.get(name, (name,)))
        for name in rows:
            if name not in held:
                known = [*held, *parts, *(j.name for j in d.joints)]
                message = (
                    f"there is no constraint, joint, stop or friction '{name}' whose reaction it could be"
                )
                raise sources.error(s.table, s.key, message, hint=nearest(name, known, "reactions"))
        made.append(replace(s, rows=rows))
    return tuple(made)


def without_sensed(d: Description) -> Description:
    """The description without the definitions that wait for what the equations tell when they are solved."""
    late = late_definitions(d, {s.name for s in d.sensors} - acting(d).keys())
    return replace(d, definitions=tuple(x for x in d.definitions if x[0] not in late)) if late else d


def late_definitions(d: Description, sensed: Collection[str] | None = None) -> dict[str, algebra.Expr]:
    """The definitions that depend on sensors of the solved equations, on all or on some `sensed`, in order."""
    known = {s.name for s in d.sensors} if sensed is None else set(sensed)
    late = {}
    for name, expression in d.definitions if known else ():
        if not known.isdisjoint(names_in(expression)):
            known.add(name)
            late[name] = expression
    return late


def acting(d: Description) -> dict[str, int]:
    """The sensors of the solved equations that forces and derivatives of states follow, with their numbers.

    Returns
    -------
    dict of str to int
        Places in `d.sensors`, by name, in order.
    """
    if not d.sensors:
        return {}
    found = set()
    for expression in acting_expressions(d):
        found |= names_in(expression)
    for name, expression in reversed(d.definitions):
        if name in found:
            found |= names_in(expression)
    return {s.name: k for k, s in enumerate(d.sensors) if s.name in found}


def acting_expressions(d: Description) -> Iterator[algebra.Expr]:
    """The expressions that may follow sensors of the solved equations: forces, loads, derivatives of states."""
    yield from (x for _, x in d.forces)
    yield from (s.derivative for s in d.states)
    yield from (x for load in d.loads for x in (*load.force, *load.torque))
    yield from (force for _, force in d.rubbing)


def has_sensed_outputs(d: Description) -> bool:
    """Whether outputs of a description depend on accelerations or reactions."""
    sensed = {s.name for s in d.sensors} | late_definitions(d).keys()
    return any(not sensed.isdisjoint(names_in(e)) for _, e in d.outputs) if sensed else False


def sensor_dimensions(d: Description, names: Mapping[str, Any]) -> dict[str, Dimension]:
    """Dimensions of a description's sensors, as far as they are known.

    Parameters
    ----------
    d : Description
    names : mapping of str to Dimension
        Those of declared names.
    """
    speed = over(LENGTH, TIME)
    turning = over(DIMENSIONLESS, TIME)
    by_kind = {
        "position": LENGTH, "velocity": speed, "angular_velocity": turning, "distance": LENGTH,
        "angle": DIMENSIONLESS, "power": POWER, "angular_acceleration": over(turning, TIME),
    }  # fmt: skip
    found = {}
    for name in (*(name for name, _ in d.definitions), *(s.name for s in d.sensors)):
        call = sensor_call(name)
        if call is not None and call[0] in by_kind:
            found[name] = by_kind[call[0]]
        elif call is not None and call[0] == "acceleration":
            whole = speed if len(call[1]) > 1 else names.get(call[1][0])
            known = isinstance(whole, tuple)
            own_rate = len(call[1]) > 1 or any(r.name == call[1][0] != r.coordinate for r in d.rates)
            found |= {name: over(whole if own_rate else over(whole, TIME), TIME)} if known else {}
        elif call is not None and call[1][1:] and call[1][1] in WRENCH:
            found[name] = FORCE if call[1][1][0] == "f" else ENERGY
    return found


@dataclass
class _Sensors:
    """Writes sensors out, one after another; `item` is the expression in which the present one was met."""

    d: Description
    sources: Sources
    taken: set[str]
    definitions: dict[str, algebra.Expr] = field(default_factory=dict)
    solved: dict[str, Sensor] = field(default_factory=dict)
    item: Item | None = None

    def __post_init__(self) -> None:
        bodies = tuple(b if b.com else replace(b, com=(algebra.ZERO,) * 3) for b in self.d.bodies)
        self.writer = Writer(replace(self.d, bodies=bodies), self.taken)
        self.bodies = {b.name: b for b in self.d.bodies}
        self.points = {p.name: p.body for p in self.d.points}
        self.frames = {f.name: f.body for f in self.d.frames}
        self.axes = {a.name: a.body for a in self.d.axes}
        self.joints = {j.name: j for j in self.d.joints}

    def define(self, name: str, kind: str, arguments: tuple[str, ...]) -> None:
        """Give a sensor its definition, or note it as one that the solved equations tell."""
        made = getattr(self, f"_{kind}")(*arguments)
        if isinstance(made, Sensor):
            self.solved[name] = replace(made, name=name)
        else:
            self.definitions[name] = made

    def _error(self, message: str, hint: str) -> ModelError:
        return self.sources.error(self.item.table, self.item.key, message, hint=hint)

    def _known(self, name: str, among: Mapping, what: str) -> str:
        if name not in among:
            raise self._error(f"there is no {what} '{name}'", nearest(name, among, f"{what}s"))
        return name

    def _axis_number(self, axis: str, choices: tuple[str, ...] = AXES) -> int:
        if axis not in choices:
            raise self._error(f"'{axis}' is not one of {', '.join(choices)}", nearest(axis, choices))
        return choices.index(axis)

    # Places, axes and their rates.

    def _place(self, name: str) -> Vector:
        """World coordinates of a point, a frame's origin, or a body's centre of mass."""
        if name in self.points:
            return [algebra.Symbol(f"{name}_{c}") for c in AXES]
        self._known(name, {**self.points, **self.bodies}, "point, frame or body")
        return [*self.writer.centre(name), algebra.ZERO][:3]

    def _frame(self, name: str | None) -> list[Vector] | None:
        """World components of the axes of a frame or body; None stands for the world's."""
        if name in (None, WORLD):
            return None
        return self.writer.directions(
            self._known(name, {**self.frames, **self.bodies, WORLD: WORLD}, "frame or body")
        )

    @staticmethod
    def _seen(vector: Vector, k: int, axes: list[Vector] | None) -> algebra.Expr:
        return vector[k] if axes is None else scalar_product(vector, axes[k])

    def _position(self, place: str, axis: str, frame: str | None = None) -> algebra.Expr:
        k, axes, at = self._axis_number(axis), self._frame(frame), self._place(place)
        if axes is None:
            return at[k]
        return scalar_product([difference(x, o) for x, o in zip(at, self.writer.origin(frame))], axes[k])

    def _velocity(self, place: str, axis: str, frame: str | None = None) -> algebra.Expr:
        k, axes = self._axis_number(axis), self._frame(frame)
        return self._seen([_rate(x) for x in self._place(place)], k, axes)

    def _turning(self, name: str) -> Vector:
        """World components of the angular velocity of a body or frame: half the sum of e_i x de_i/dt."""
        self._known(name, {**self.bodies, **self.frames}, "body or frame")
        body = self.bodies.get(self.writer.body_of(name))
        if body is None:
            return [algebra.ZERO] * 3
        if body.planar and body.angle is not None:
            return [algebra.ZERO, algebra.ZERO, _rate(body.angle)]
        axes = self.writer.directions(body.name)
        if body.planar:
            return [algebra.ZERO, algebra.ZERO, _cross(axes[0], [_rate(x) for x in axes[0]])[2]]
        terms = [_cross(e, [_rate(x) for x in e]) for e in axes]
        return [product([HALF, total(parts)]) for parts in zip(*terms)]

    def _angular_velocity(self, body: str, axis: str, frame: str | None = None) -> algebra.Expr:
        return self._seen(self._turning(body), self._axis_number(axis), self._frame(frame))

    def _distance(self, a: str, b: str) -> algebra.Expr:
        squares = [squared(difference(x, y)) for x, y in zip(self._place(a), self._place(b))]
        return algebra.Pow(total(squares), HALF, evaluate=False)

    def _angle(self, a: str, b: str, axis: str | None = None) -> algebra.Expr:
        if a in self.axes and b in self.axes and axis is None:
            first, second = ([algebra.Symbol(f"{n}_{c}") for c in AXES] for n in (a, b))
            across = total(squared(x) for x in _cross(first, second))
            along = scalar_product(first, second)
            return algebra.atan2(algebra.Pow(across, HALF, evaluate=False), along, evaluate=False)
        first, second = (self._frame(x) or _UNITY for x in (a, b))
        bodies = [self.bodies.get(self.writer.body_of(x)) for x in (a, b)]
        if all(body is None or body.planar for body in bodies):
            if axis not in (None, "z"):
                raise self._error("planar bodies turn about z", "leave the axis out")
            x, y = scalar_product(first[0], second[0]), scalar_product(first[1], second[0])
            return algebra.atan2(y, x, evaluate=False)
        if axis is None:
            message = f"the angle between '{a}' and '{b}' in space has an axis"
            raise self._error(message, "x, y or z of successive rotations about these; or name two of [axes]")
        if axis[:-1] and not sequence_fault(axis[:-1]):
            if axis[-1] not in "123":
                raise self._error(f"'{axis}' does not say which angle", f"such as {axis[:-1]}1, the first")
            return euler_angles(first, second, axis[:-1])[int(axis[-1]) - 1]
        return cardan(first, second)[self._axis_number(axis)]

    # What force elements do.

    def _power(self, name: str) -> algebra.Expr:
        found = [
            (what, x)
            for what, elements in (
                ("spring", self.d.springs), ("bushing", self.d.bushings), ("load", self.d.loads),
                ("joint", self.d.joints),
            )
            for x in elements
            if x.name == name
        ]  # fmt: skip
        if not found:
            known = [x.name for x in (*self.d.springs, *self.d.bushings, *self.d.loads, *self.d.joints)]
            message = f"there is no spring, bushing, load or joint '{name}' that could have a power"
            raise self._error(message, nearest(name, known, "elements"))
        if len(found) > 1:
            kinds = " and a ".join(what for what, _ in found)
            raise self._error(f"'{name}' is a {kinds}", "give one of them another name")
        ((what, element),) = found
        return getattr(self, f"_power_of_{what}")(element)

    @staticmethod
    def _power_of_spring(s) -> algebra.Expr:
        return negated(product([algebra.Symbol(s.exerted), dot(algebra.Symbol(s.measured))]))

    def _power_of_bushing(self, b) -> algebra.Expr:
        self.writer.bushing(b)
        stored, lost = ([*self.writer.terms[key]] for key in ("potential", "dissipation"))
        for terms in (*self.writer.terms.values(), self.writer.drawings, self.writer.windings):
            terms.clear()
        return negated(total([*(dot(x) for x in stored), *lost, *lost]))

    def _power_of_load(self, load) -> algebra.Expr:
        powers = []
        for plain in self.writer.load(load):
            if plain.force:
                speeds = [_rate(x) for x in plain.point]
                powers += [product(pair) for pair in zip(plain.force, speeds)]
            else:
                turning = self._turning(plain.body)
                torque = plain.torque if len(plain.torque) == 3 else (*turning[:2], *plain.torque)
                powers += [product(pair) for pair in zip(torque, turning)]
        return total(powers)

    def _power_of_joint(self, j) -> algebra.Expr:
        if not (j.stiffness or j.damping):
            raise self._error(f"the joint '{j.name}' has no spring and no damper", "name one that has")
        quaternion = TYPES[j.type].quaternion
        rates = [algebra.Symbol(x) if quaternion else dot(algebra.Symbol(x)) for x in j.rates]
        lost = [product([c, squared(v)]) for c, v in zip(_each(j.damping, len(rates)), rates)]
        if j.stiffness:
            stretch = [
                difference(algebra.Symbol(q), rest)
                for q, rest in zip(j.coordinates, _each(j.rest or (algebra.ZERO,), len(rates)))
            ]
            lost += [
                product(factors)
                for factors in zip(_each(j.stiffness, len(rates)), stretch, rates, strict=True)
            ]
        return negated(total(lost))

    # What the solved equations tell.

    def _sensor(self, **what) -> Sensor:
        return Sensor("", self.item.table, self.item.key, **what)

    def _solved(
        self, vector: Vector, kind: str, name: str, k: int, axes: list[Vector] | None
    ) -> Sensor | algebra.Expr:
        """The derivative of a vector's component, or that of the vector along an axis of a frame."""
        if axes is None:
            return self._sensor(derivative=vector[k])
        made = []
        for i, letter in enumerate(AXES):
            symbol = sensor(kind, name, letter)
            self.solved[symbol.name] = replace(self._sensor(derivative=vector[i]), name=symbol.name)
            made.append(symbol)
        return scalar_product(made, axes[k])

    def _acceleration(
        self, name: str, axis: str | None = None, frame: str | None = None
    ) -> Sensor | algebra.Expr:
        if axis is not None:
            k, axes = self._axis_number(axis), self._frame(frame)
            return self._solved([_rate(x) for x in self._place(name)], "acceleration", name, k, axes)
        coordinates = {c.name: c for c in self.d.coordinates}
        own = {r.name for r in self.d.rates if r.coordinate != r.name}
        definitions = dict(self.d.definitions)
        if name in own:
            return self._sensor(derivative=algebra.Symbol(name))
        if name in self.points or name in self.bodies:
            raise self._error(
                f"the acceleration of '{name}' has an axis", f'for example acceleration("{name}", "x")'
            )
        self._known(
            name, {**coordinates, **dict.fromkeys(own), **definitions}, "coordinate, rate or definition"
        )
        if name in coordinates and coordinates[name].quaternion is not None:
            joint = coordinates[name].quaternion
            raise self._error(
                f"'{name}' is an element of a quaternion", f"'{joint}_wx' is an angular velocity"
            )
        return self._sensor(derivative=dot(algebra.Symbol(name)))

    def _angular_acceleration(self, body: str, axis: str, frame: str | None = None) -> Sensor | algebra.Expr:
        k, axes = self._axis_number(axis), self._frame(frame)
        return self._solved(self._turning(body), "angular_acceleration", body, k, axes)

    def _reaction(
        self, name: str, axis: str | None = None, frame: str | None = None
    ) -> Sensor | algebra.Expr:
        if name not in self.joints:
            if frame is not None:
                raise self._error(f"'{name}' is no joint", "forces of constraints have no axes")
            return self._sensor(rows=(name if axis is None else f"{name}_{axis}",))
        joint = self.joints[name]
        child = self.bodies[joint.child]
        parts = ("fx", "fy", "tz") if child.planar else WRENCH
        if axis is None:
            message = f"the reaction of the joint '{name}' has components: {', '.join(parts)}"
            raise self._error(message, f'for example reaction("{name}", "fx")')
        self._axis_number(axis, parts)
        if TYPES[joint.type].nv == 6:
            raise self._error(f"the joint '{name}' is free: it joins nothing", "name another joint")
        k = WRENCH.index(axis)
        if frame is None or (frame == WORLD and joint.parent == WORLD and not any(joint.rpy)):
            return self._sensor(joint=name, component=k)
        axes = self._frame(frame) or _UNITY
        joint_frame = Frame(f"{name}_frame", joint.parent, joint.xyz, joint.rpy)
        self.writer.frames.setdefault(joint_frame.name, joint_frame)
        own = self.writer.directions(joint_frame.name)
        terms = []
        for i in range(3):
            part = WRENCH[k - k % 3 + i]
            if part in parts or not child.planar:
                symbol = sensor("reaction", name, part)
                made = self._sensor(joint=name, component=k - k % 3 + i)
                self.solved[symbol.name] = replace(made, name=symbol.name)
                terms.append(product([symbol, scalar_product(own[i], axes[k % 3])]))
        return total(terms)


_UNITY = [[algebra.Integer(int(i == k)) for i in range(3)] for k in range(3)]


def _rate(x: algebra.Expr) -> algebra.Expr:
    return algebra.ZERO if x.is_Number else dot(x)


def _cross(a: Vector, b: Vector) -> Vector:
    pairs = ((1, 2), (2, 0), (0, 1))
    return [difference(product([a[i], b[j]]), product([a[j], b[i]])) for i, j in pairs]


def _each(values: tuple[algebra.Expr, ...], count: int) -> Iterator[algebra.Expr]:
    return iter(values * count if len(values) == 1 else values)
