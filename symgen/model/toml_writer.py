"""Writing a model as TOML text that `toml_reader` reads back to the same description."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ..errors import ModelError
from . import algebra
from .description import (
    NOTHING,
    Body,
    Bushing,
    Closure,
    ContactPair,
    Coordinate,
    Description,
    Drawing,
    Event,
    Formula,
    Frame,
    Input,
    Joint,
    Load,
    Loop,
    Port,
    Rate,
    Rolling,
    Rotor,
    Solid,
    Spring,
    StartConditions,
    State,
    Table,
    Use,
)
from .functions import dot
from .items import drawing_key
from .joint_types import TYPES
from .printing import to_text
from .rolling import held_by
from .sources import Sources
from .tyres import Tyre

SPRING_FIELDS = ("angle", "stiffness", "rest", "damping", "preload", "mass")
BRISTLE_KEYS = ("stiffness", "damping", "viscous", "coulomb", "static", "stribeck")
PAIR_FIELDS = ("height", "restitution", "friction", "static", "stiffness", "exponent", "damping", "smooth")
CONTACT_KEYS = ("stiffness", "exponent", "damping", "friction", "slip", "smooth")


def blocks(
    d: Description, sources: Sources, ports: Iterable[Port], within: str = "", tyres: Iterable[Tyre] = ()
) -> Iterator[str]:
    """The parts of the TOML text of a description; expressions that were given as text are kept as they were written.

    An assembly's are `within` a table, whose name ends in a dot. What `tyres` are made of is not in the description.
    """
    writer = _Writer(sources)
    head = [*([f"[{within[:-1]}]"] if within else []), *list(writer.head(d))[1 if within else 0 :]]
    yield "\n".join(head)
    for block in (writer.ports(ports), *writer.blocks(d, tyres)):
        if len(block) > 1:
            yield _block(block, within)


def uses(given: Iterable[Use], sources: Sources, within: str = "") -> Iterator[str]:
    """The parts of the TOML text that use assemblies."""
    yield from (_block(_Writer(sources).use(x), within) for x in given)


def _block(lines: list[str], within: str) -> str:
    return "\n".join([f"[{within}{lines[0][1:]}", *lines[1:]])


class _Writer:
    def __init__(self, sources: Sources) -> None:
        self.sources = sources

    def ports(self, ports: Iterable[Port]) -> list[str]:
        """What an assembly is given."""
        entries = [
            f"{p.name} = {_quoted(p.kind) if p.unit is None else _table(kind=p.kind, unit=p.unit)}"
            for p in ports
        ]
        return ["[ports]", *entries]

    def use(self, use: Use) -> list[str]:
        """A use of an assembly, with what it gives."""
        table = f"use.{use.name}"
        lines, vectors = [f"[{table}]", f"assembly = {_quoted(use.assembly)}"], {}
        for g in (x for x in use.given if x.said):
            if isinstance(g.value, str):
                lines.append(f"{g.key} = {_quoted(g.value)}")
            elif isinstance(g.value, float):
                lines.append(f"{g.key} = {_number(g.value, g.unit)}")
            elif "[" in g.key:
                vectors.setdefault(g.key.partition("[")[0], []).append(self.value(table, g.key, g.value))
            else:
                lines.append(f"{g.key} = {self.value(table, g.key, g.value)}")
        return [*lines, *(f"{key} = [{', '.join(values)}]" for key, values in vectors.items())]

    def head(self, d: Description) -> Iterator[str]:
        yield f"name = {_quoted(d.name)}"
        if d.description:
            yield f"description = {_quoted(d.description)}"
        if d.impacts != "simultaneous":
            yield f"impacts = {_quoted(d.impacts)}"

    def blocks(self, d: Description, tyres: Iterable[Tyre]) -> Iterator[list[str]]:
        """The tables of a description, in the order in which a person reads a mechanism."""
        yield from self.quantities(d)
        yield from self.geometry(d)
        yield from self.gravity(d)
        yield from self.forces(d)
        yield from self.couplings(d, tyres)
        yield from self.observed(d)
        yield ["[run]", *(f"{key} = {_literal(value)}" for key, value in d.run.items())]

    def quantities(self, d: Description) -> Iterator[list[str]]:
        """What has a name and a value: parameters, coordinates, tables, states, inputs, definitions."""
        yield ["[parameters]", *(f"{p.name} = {_number(p.value, p.unit, p.doc)}" for p in d.parameters)]
        yield ["[constants]", *(f"{c.name} = {_number(c.value, c.unit)}" for c in d.constants)]
        own = [c for c in d.coordinates if c.joint is None and not c.integral]
        yield ["[coordinates]", *(_coordinate(self, c) for c in own)]
        for table in d.tables:
            yield _table_of_numbers(table)
        rates = {r.name: r for r in d.rates}
        bristles = {b.name for b in d.bristles}
        yield ["[states]", *(self.state(s, rates[s.name]) for s in d.states if s.name not in bristles)]
        yield ["[inputs]", *(f"{u.name} = {_input(u)}" for u in d.inputs)]
        made = {name for s in d.springs for name in (s.measured, s.exerted)}
        made |= {name for b in d.bristles for name in b.made}
        yield ["[definitions]", *self.entries("definitions", [x for x in d.definitions if x[0] not in made])]

    def geometry(self, d: Description) -> Iterator[list[str]]:
        """Bodies, how they are joined, and what is fixed on them."""
        for body in d.bodies:
            yield self.body(body)
        made = _by_joint(d)
        for joint in d.joints:
            yield self.joint(joint, *made.get(joint.name, ((), ())))
        framed = {f.name for f in d.frames}
        for point in d.points:
            if point.name not in framed:
                yield self.fixed(f"points.{point.name}", point.body, "at", point.at)
        for frame in d.frames:
            yield self.frame(frame)
        for spring in d.springs:
            yield self.spring(spring)
        for bushing in d.bushings:
            yield self.bushing(bushing)
        for axis in d.axes:
            yield self.fixed(f"axes.{axis.name}", axis.body, "direction", axis.direction)

    def gravity(self, d: Description) -> Iterator[list[str]]:
        fields = [(k, x) for k, x in (("potential", d.field), ("constant", d.gravitation)) if x is not None]
        if d.gravity is not None:
            axes = [(a, x) for a, x in zip("xyz", d.gravity, strict=True) if x is not algebra.ZERO]
            fields = [*(axes or [("x", algebra.ZERO)]), *fields]
        yield ["[gravity]", *self.entries("gravity", fields)]
        for a in d.attractors:
            key = f"attractors.{a.name}"
            yield [
                f"[gravity.{key}]",
                f"at = {self.array('gravity', f'{key}.at', a.at)}",
                f"mu = {self.value('gravity', f'{key}.mu', a.mu)}",
                *(["gradient = true"] if a.gradient else []),
            ]

    def forces(self, d: Description) -> Iterator[list[str]]:
        """Energies, forces and loads."""
        energies = [(k, getattr(d, k)) for k in ("kinetic", "potential", "dissipation")]
        yield ["[energy]", *self.entries("energy", [(k, x) for k, x in energies if x is not None])]
        yield ["[forces]", *self.entries("forces", d.forces)]
        for load in d.loads:
            yield self.load(load)

    def couplings(self, d: Description, tyres: Iterable[Tyre]) -> Iterator[list[str]]:
        """Contacts, constraints and what makes constraints."""
        for table, entry in _contact_tables(d, self):
            yield self.table(table, entry)
        for pair in d.pairs:
            yield self.pair(pair)
        yield ["[constraints]", *self.entries("constraints", [(c.name, c.expression) for c in d.constraints])]
        for loop in d.loops:
            yield self.loop(loop)
        coordinate = {c.name: c for c in d.coordinates}
        for c in d.closures:
            yield self.closure(c, coordinate.get(c.coordinate))
        for r in d.rotors:
            yield self.rotor(r, coordinate.get(r.name))
        for r in d.rolling:
            yield self.rolling(r)
        for tyre in tyres:
            table = f"tyres.{tyre.name}"
            yield [f"[{table}]", *(f"{key} = {self.given(table, key, x)}" for key, x in tyre.given.items())]
        held = [(c.name, c.expression) for c in d.velocity_constraints]
        yield ["[velocity_constraints]", *self.entries("velocity_constraints", held)]

    def observed(self, d: Description) -> Iterator[list[str]]:
        """Outputs, events, the start and drawings."""
        yield ["[outputs]", *self.entries("outputs", d.outputs)]
        for event in d.events:
            yield self.event(event)
        if d.start is not None:
            yield ["[start]", *self.start(d.start)]
        for drawing in d.drawings:
            yield self.drawing(drawing)

    def frame(self, frame: Frame) -> list[str]:
        table = f"frames.{frame.name}"
        turn = [f"rpy = {self.array(table, 'rpy', frame.rpy)}"] if any(frame.rpy) else []
        if frame.said:
            turn = [f"{key} = {self.given(table, key, x)}" for key, x in frame.said]
        return [*self.fixed(table, frame.body, "at", frame.at), *turn]

    def bushing(self, bushing: Bushing) -> list[str]:
        table = f"bushings.{bushing.name}"
        values = [(key, getattr(bushing, key)) for key in ("stiffness", "damping")]
        return [
            f"[{table}]",
            f"frames = {_literal(bushing.frames)}",
            *(f"{key} = {self.array(table, key, x)}" for key, x in values if x),
        ]

    def entries(self, table: str, pairs: Iterable[tuple[str, algebra.Expr]]) -> list[str]:
        return [f"{key} = {self.value(table, key, x)}" for key, x in pairs]

    def value(self, table: str, key: str, expression: algebra.Expr) -> str:
        given = [x for x in self.sources.of(table, key) if not x.use]
        if len(given) == 1 and given[0].text is not None:
            return _quoted(given[0].text)
        if isinstance(expression, algebra.Integer):
            return str(int(expression)) if abs(expression) < 2**53 else repr(float(expression))
        if isinstance(expression, algebra.Float):
            return repr(float(expression))
        try:
            return _quoted(to_text(expression))
        except ModelError as error:
            raise self.sources.locate(error, table, key) from None

    def given(self, table: str, key: str, value: Any) -> str:
        """An argument as it was given: text, a number, an expression, or several of these."""
        if isinstance(value, algebra.Expr):
            return self.value(table, key, value)
        if isinstance(value, (list, tuple)):
            return f"[{', '.join(self.given(table, f'{key}[{k}]', x) for k, x in enumerate(value))}]"
        return _literal(value)

    def array(self, table: str, key: str, values: tuple[algebra.Expr, ...]) -> str:
        return "[" + ", ".join(self.value(table, f"{key}[{k}]", x) for k, x in enumerate(values)) + "]"

    def body(self, body: Body) -> list[str]:
        table = f"bodies.{body.name}"
        lines = [f"[{table}]"]
        made = any(solid.density is not None for solid in body.solids)
        if body.mass is not None and not made:
            lines.append(f"mass = {self.value(table, 'mass', body.mass)}")
        if len(body.inertia) == 1 and not made:
            lines.append(f"inertia = {self.value(table, 'inertia', body.inertia[0])}")
        elif body.inertia and not made:
            lines.append(f"inertia = {self.array(table, 'inertia', body.inertia)}")
        if body.com and not body.centred:
            lines.append(f"com = {self.array(table, 'com', body.com)}")
        if body.angle is not None:
            lines.append(f"angle = {self.value(table, 'angle', body.angle)}")
        if body.rotation:
            steps = (
                f"[{_quoted(axis)}, {self.value(table, f'rotation[{k}]', x)}]"
                for k, (axis, x) in enumerate(body.rotation)
            )
            lines.append(f"rotation = [{', '.join(steps)}]")
        if body.shape is not None and body.shape.kind == NOTHING:
            lines.append(f"shape = {_quoted(NOTHING)}")
        elif body.shape is not None:
            kind = body.shape.kind
            sizes = self.array(table, f"shape.{kind}", body.shape.sizes)
            color = f", color = {_quoted(body.color)}" if body.color else ""
            lines.append(
                f"shape = {{ {kind} = {_quoted(body.shape.mesh) if kind == 'mesh' else sizes}{color} }}"
            )
        if body.solids:
            shapes = [self.solid(table, solid) for solid in body.solids]
            if body.color:
                shapes[0] = f"{shapes[0][:-2]}, color = {_quoted(body.color)} }}"
            several = body.solids[0].place != "shape"
            lines.append(f"shape = [{', '.join(shapes)}]" if several else f"shape = {shapes[0]}")
        common = [s.density for s in body.solids if s.density is not None and not s.own_density]
        if common:
            lines.append(f"density = {self.value(table, 'density', common[0])}")
        return lines

    def solid(self, table: str, solid: Solid) -> str:
        if solid.mesh:
            offset = self.array(table, f"{solid.place}.offset", solid.offset) if solid.offset else ""
            return f"{{ mesh = {_quoted(solid.mesh)}{offset and ', offset = '}{offset} }}"
        pairs = [f"{solid.kind} = {self.array(table, f'{solid.place}.{solid.kind}', solid.sizes)}"]
        for key in ("offset", "rpy"):
            values = getattr(solid, key)
            values = values[: 2 if solid.planar and key == "offset" else 3]
            pairs += [f"{key} = {self.array(table, f'{solid.place}.{key}', values)}"] if values else []
        pairs += [f"axis = {_literal(solid.axis)}"] if solid.axis else []
        if solid.own_density:
            pairs.append(f"density = {self.value(table, f'{solid.place}.density', solid.density)}")
        return f"{{ {', '.join([*pairs, *(['cut = true'] if solid.cut else [])])} }}"

    def joint(self, joint: Joint, made: Sequence[Coordinate], rates: Sequence[Rate]) -> list[str]:
        table = f"joints.{joint.name}"
        lines = [
            f"type = {_quoted(joint.type)}",
            f"parent = {_quoted(joint.parent)}",
            f"child = {_quoted(joint.child)}",
        ]
        origin = [
            f"{key} = {self.array(table, f'origin.{key}', values)}"
            for key, values in (("xyz", joint.xyz), ("rpy", joint.rpy))
            if any(x is not algebra.ZERO for x in values)
        ]
        if origin:
            lines.append(f"origin = {{ {', '.join(origin)} }}")
        lines += [f"{key} = {_literal(x)}" for key, x in (("axis", joint.axis), ("axis2", joint.axis2)) if x]
        if joint.coordinates != TYPES[joint.type].coordinate_names(joint.name):
            lines.append(f"coordinate = {_one_or_list(joint.coordinates)}")
        if joint.sequence:
            lines.append(f"sequence = {_quoted(joint.sequence)}")
        lines += _joint_state(self, joint, made, rates)
        for key in ("stiffness", "damping", "rest", "armature"):
            values = getattr(joint, key)
            if len(values) == 1:
                lines.append(f"{key} = {self.value(table, key, values[0])}")
            elif values:
                lines.append(f"{key} = {self.array(table, key, values)}")
        if joint.limits:
            lines.append(f"limits = {self.array(table, 'limits', joint.limits)}")
        if joint.restitution is not None:
            lines.append(f"restitution = {self.value(table, 'restitution', joint.restitution)}")
        if joint.pitch is not None:
            lines.append(f"pitch = {self.value(table, 'pitch', joint.pitch)}")
        return [f"[{table}]", *lines]

    def fixed(self, table: str, body: str, key: str, vector: tuple[algebra.Expr, ...]) -> list[str]:
        return [f"[{table}]", f"body = {_quoted(body)}", f"{key} = {self.array(table, key, vector)}"]

    def loop(self, loop: Loop) -> list[str]:
        table, arguments = f"constraints.{loop.name}", dict(loop.arguments)
        if loop.kind == "coincident":
            return [f"[{table}]", f"coincident = {_literal(arguments['points'])}"]
        pairs = [
            f"{key} = {self.argument(table, f'{loop.kind}.{key}', x)}"
            for key, x in arguments.items()
            if not (key == "offset" and x is algebra.ZERO)
        ]
        return [f"[{table}]", f"{loop.kind} = {{ {', '.join(pairs)} }}"]

    def argument(self, table: str, key: str, x: Any) -> str:
        if isinstance(x, algebra.Expr):
            return self.value(table, key, x)
        several = isinstance(x, tuple) and all(isinstance(part, algebra.Expr) for part in x)
        return self.array(table, key, x) if several else _literal(x)

    def table(
        self, table: str, entries: Iterable[tuple[str, algebra.Expr | tuple[str, ...] | _Written]]
    ) -> list[str]:
        lines = [f"[{table}]"]
        for key, value in entries:
            if isinstance(value, _Written):
                lines.append(f"{key} = {value}")
            elif not isinstance(value, tuple):
                lines += self.entries(table, [(key, value)])
            elif isinstance(value[0], str):
                lines.append(f"{key} = {_one_or_list(value)}")
            else:
                lines.append(f"{key} = {self.array(table, key, value)}")
        return lines

    def load(self, load: Load) -> list[str]:
        table = f"loads.{load.name}"
        more = [(key, getattr(load, key)) for key in ("frame", "reaction")]
        named = [f"{key} = {_quoted(name)}" for key, name in more if name is not None]
        if load.force:
            point, force = self.array(table, "point", load.point), self.array(table, "force", load.force)
            return [f"[{table}]", f"point = {point}", f"force = {force}", *named]
        return [
            f"[{table}]",
            f"body = {_quoted(load.body)}",
            f"torque = {self.array(table, 'torque', load.torque)}",
            *named,
        ]

    def closure(self, c: Closure, coordinate: Coordinate | None) -> list[str]:
        table = f"closures.{c.name}"
        lines = [f"[{table}]", f"type = {_quoted(c.type)}", f"frames = {_literal(c.frames)}"]
        lines += [f"{key} = {_literal(x)}" for key, x in (("axis", c.axis), ("axis2", c.axis2)) if x]
        if coordinate is not None:
            lines.append(f"coordinate = {_quoted(coordinate.name)}")
            lines += [f"{key} = {_literal(x)}" for key, x in _initial(self, coordinate).items()]
        keys = ("pitch", "stiffness", "rest", "damping", "friction")
        return [*lines, *self.entries(table, [(k, x) for k in keys if (x := getattr(c, k)) is not None])]

    def rotor(self, r: Rotor, coordinate: Coordinate | None) -> list[str]:
        table = f"rotors.{r.name}"
        lines = [
            f"[{table}]",
            f"inertia = {self.value(table, 'inertia', r.inertia)}",
            f"body = {_quoted(r.body)}",
        ]
        lines += [f"axis = {_literal(r.axis)}"] if r.axis else []
        lines += [f"at = {self.array(table, 'at', r.at)}"] if r.at else []
        if r.angle is not None:
            lines.append(f"angle = {self.value(table, 'angle', r.angle)}")
        elif coordinate is not None:
            lines += [f"{key} = {_literal(x)}" for key, x in _initial(self, coordinate).items()]
        return [*lines, *([] if r.gyroscopic else ["gyroscopic = false"])]

    def rolling(self, r: Rolling) -> list[str]:
        table = f"rolling.{r.name}"
        lines = [f"[{table}]", f"body = {_quoted(r.body)}"]
        if r.kind == "knife":
            lines.append(f"knife = {_literal(r.axis)}")
        else:
            lines.append(f"{r.kind} = {self.value(table, r.kind, r.radius)}")
            lines += [f"axis = {_literal(r.axis)}"] if r.axis else []
        lines += [f"at = {self.array(table, 'at', r.at)}"] if r.at else []
        lines += [f"plane = {_quoted(r.plane)}"] if r.plane != "world" else []
        lines += [f"height = {self.value(table, 'height', r.height)}"] if r.height is not None else []
        return [*lines, *([f"holds = {_literal(r.holds)}"] if r.holds != held_by(r.kind) else [])]

    def pair(self, pair: ContactPair) -> list[str]:
        table = f"contacts.{pair.name}"
        lines = [f"[{table}]", f"body = {_quoted(pair.body)}"]
        lines += [f"plane = {_quoted(pair.plane)}"] if pair.plane != "world" else []
        lines += [f"other = {_quoted(pair.other)}"] if pair.other is not None else []
        for key, solids in (("shape", pair.shapes), ("other_shape", pair.other_shapes)):
            if solids:
                shapes = [self.solid(table, solid) for solid in solids]
                lines.append(f"{key} = [{', '.join(shapes)}]" if len(shapes) > 1 else f"{key} = {shapes[0]}")
        values = ((key, getattr(pair, key)) for key in PAIR_FIELDS)
        return [*lines, *(f"{key} = {self.value(table, key, x)}" for key, x in values if x is not None)]

    def spring(self, spring: Spring) -> list[str]:
        table = f"springs.{spring.name}"
        lines = [f"[{table}]"]
        if spring.places:
            places = [self.array(table, f"points[{k}]", place) for k, place in enumerate(spring.places)]
            lines.append(f"points = [{', '.join(places)}]")
        rest = "rest" if spring.angle is not None else "length"
        for key, name in zip(("angle", "stiffness", rest, "damping", "preload", "mass"), SPRING_FIELDS):
            value = getattr(spring, name)
            lines += [] if value is None else [f"{key} = {self.value(table, key, value)}"]
        lines += [] if spring.curve is None else [f"curve = {_quoted(spring.curve.table)}"]
        return [*lines, *([f"acts = {_quoted(spring.acts)}"] if spring.acts else [])]

    def state(self, state: State, rate: Rate) -> str:
        derivative = _Written(self.value("states", f"{state.name}.derivative", state.derivative))
        start, guess = _state(self, rate.start, rate.guess, rate.formula)
        guess = guess if start is None else None
        return f"{state.name} = {_table(derivative=derivative, start=start, guess=guess, unit=rate.unit)}"

    def start(self, start: StartConditions) -> Iterator[str]:
        if start.equations:
            yield f"equations = {self.array('start', 'equations', tuple(x.expression for x in start.equations))}"
        yield from ([f"find = {_literal(start.find)}"] if start.find else [])
        if start.is_steady:
            yield f"steady = {_literal(start.everything or start.steady)}"
        yield from ([f"closed = {_literal(start.closed)}"] if start.closed else [])

    def drawing(self, drawing: Drawing) -> list[str]:
        table, kind = f"draw.{drawing.name}", drawing.kind
        vectors = [self.array(table, drawing_key(kind, k), x) for k, x in enumerate(drawing.vectors)]
        return [f"[{table}]", f"{kind} = " + (f"[{', '.join(vectors)}]" if len(vectors) > 1 else vectors[0])]

    def event(self, event: Event) -> list[str]:
        table = f"events.{event.name}"
        then = _quoted(event.action)
        if event.action == "reset":
            names = [f"dot({r.target})" if r.is_rate else r.target for r in event.resets]
            values = [
                self.value(table, f"then.reset.{n}", r.value)
                for n, r in zip(names, event.resets, strict=True)
            ]
            pairs = (f"{_quoted(n)} = {x}" for n, x in zip(names, values, strict=True))
            then = f"{{ reset = {{ {', '.join(pairs)} }} }}"
        when = self.value(table, "when", event.when)
        return [f"[{table}]", f"when = {when}", f"direction = {_quoted(event.direction)}", f"then = {then}"]


def _by_joint(d: Description) -> dict[str, tuple[list[Coordinate], list[Rate]]]:
    """The coordinates that each joint made, and their rates."""
    made: dict[str, tuple[list[Coordinate], list[Rate]]] = {}
    rates = {r.name: r for r in d.rates}
    for c in d.coordinates:
        if c.joint is not None:
            made.setdefault(c.joint, ([], []))[0].append(c)
    for joint in d.joints:
        if joint.name in made:
            own = joint.rates if TYPES[joint.type].quaternion else [c.name for c in made[joint.name][0]]
            made[joint.name][1].extend(rates[name] for name in own)
    return made


def _joint_state(
    writer: _Writer, joint: Joint, made: Sequence[Coordinate], rates: Sequence[Rate]
) -> list[str]:
    """Initial values of the coordinates and rates that a joint made; nothing where they are the defaults."""
    if not made:
        return []
    speeds = [_state(writer, r.start, r.guess, r.formula) for r in rates]
    lines = []
    defaults = tuple(float(c.quaternion is not None and c.name == joint.coordinates[-4]) for c in made)
    for keys, pairs, unmoved in (
        (("start", "guess"), [_state(writer, c.start, c.guess, c.formula) for c in made], defaults),
        (("rate", "rate_guess"), speeds, (0.0,) * len(speeds)),
    ):
        enforced, guesses = zip(*pairs, strict=True)
        if enforced[0] is not None:
            lines.append(f"{keys[0]} = {_one_or_list(enforced)}")
        elif guesses != unmoved:
            lines.append(f"{keys[1]} = {_one_or_list(guesses)}")
    return lines


class _Written(str):
    """A value as it stands in a file."""


def _state(writer: _Writer, start: Any, guess: Any, formula: Formula | None) -> tuple[Any, Any]:
    """What is enforced, and what is guessed, with the formula in the place of its value."""
    if formula is None:
        return start, guess
    text = _Written(writer.value(formula.table, formula.key, formula.expression))
    return (None, text) if start is None else (text, guess)


def _one_or_list(values: tuple[Any, ...]) -> str:
    return _literal(values[0] if len(values) == 1 else values)


def _coordinate(writer: _Writer, c: Coordinate) -> str:
    return f"{c.name} = {_table(unit=c.unit, **_initial(writer, c))}"


def _initial(writer: _Writer, c: Coordinate) -> dict[str, Any]:
    """Initial values of a coordinate, those that are not given left out."""
    start, guess = _state(writer, c.start, c.guess, c.formula)
    rate, rate_guess = _state(writer, c.rate, c.rate_guess, c.rate_formula)
    guesses = {"guess": guess if start is None else 0.0, "rate_guess": rate_guess if rate is None else 0.0}
    enforced = {key: value for key, value in (("start", start), ("rate", rate)) if value is not None}
    return enforced | {key: value for key, value in guesses.items() if value}


def _number(value: float, unit: str | None, doc: str = "") -> str:
    if doc:
        return _table(value=value, unit=unit, doc=doc)
    return _literal(value) if unit is None else _quoted(f"{value!r} {unit}")


def _input(u: Input) -> str:
    return _table(
        unit=u.unit, default=u.default, table=(u.times, u.values) if u.times else None, kind=u.kind or None,
        polynomial=u.polynomial or None,
    )  # fmt: skip


def _table(**values: Any) -> str:
    inside = ", ".join(f"{key} = {_literal(value)}" for key, value in values.items() if value is not None)
    return f"{{ {inside} }}" if inside else "{}"


def _table_of_numbers(table: Table) -> list[str]:
    places = itertools.product(*table.axes)
    columns = (*zip(*places, strict=True), table.values)
    units = [f"units = {_literal(tuple(x or '' for x in table.units))}"] if any(table.units) else []
    return [
        f"[tables.{table.name}]",
        f"columns = {_literal(columns)}",
        f"kind = {_quoted(table.kind)}",
        f"outside = {_quoted(table.outside)}",
        *units,
    ]


def _literal(value: Any) -> str:
    if isinstance(value, _Written):
        return value
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, tuple):
        return "[" + ", ".join(_literal(x) for x in value) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _contact_tables(
    d: Description, writer: _Writer
) -> Iterator[tuple[str, list[tuple[str, algebra.Expr | tuple[str, ...] | _Written]]]]:
    """The tables of a model file that state these elements, with their keys and expressions, or names."""
    for stop in d.stops:
        yield f"stops.{stop.name}", [("gap", stop.gap), ("restitution", stop.restitution)]
    for f in d.frictions:
        table, width = f"friction.{f.name}", ("creep" if f.creeps else "smooth", f.smooth)
        more = [(key, x) for key, x in (width, ("static", f.static)) if x is not None]
        key = "torque" if writer.sources.of(table, "torque") else "force"
        level = [("coefficient", f.level), ("normal", f.normal)] if f.normal else [(key, f.level)]
        yield table, [_sliding(writer, table, f.speeds), *level, *more]
    rates = {r.name: r for r in d.rates}
    for b in d.bristles:
        table, rate = f"bristles.{b.name}", rates[b.name]
        values = ((key, getattr(b, key)) for key in BRISTLE_KEYS)
        start, _ = _state(writer, rate.start, rate.guess, rate.formula)
        given = [("start", start), ("unit", rate.unit)]
        yield (
            table,
            [
                _sliding(writer, table, (b.speed,)),
                *((key, x) for key, x in values if x is not None),
                *((key, _Written(_literal(x))) for key, x in given if x),
            ],
        )
    for c in d.contacts:
        values = ((key, getattr(c, key)) for key in CONTACT_KEYS)
        yield f"contacts.{c.name}", [("gap", c.gap), *((k, x) for k, x in values if x is not None)]


def _sliding(
    writer: _Writer, table: str, speeds: tuple[algebra.Expr, ...]
) -> tuple[str, algebra.Expr | tuple[algebra.Expr, ...] | tuple[str, ...]]:
    """The speeds of a friction, or the coordinates whose rates they are, as they were given."""
    names = tuple(
        x.args[0].name for x in speeds if isinstance(x, dot) and isinstance(x.args[0], algebra.Symbol)
    )
    if len(speeds) == 1:
        return ("coordinate", names) if writer.sources.of(table, "coordinate") else ("speed", speeds[0])
    given = writer.sources.of(table, "coordinates[0]")
    return ("coordinates", names) if given else ("speeds", speeds)
