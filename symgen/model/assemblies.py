"""Assemblies: models that others use, as often as they like, each time under a name of its own.

A use takes over all that the assembly says. Names get the use's name before them, `c1.piston`; ports become what the
model connects them to; parameters become the model's own of that name, or what the use gives. What the assembly says in
world axes is meant in axes of its own, which the use places in the world: positions are moved, and what expressions
read of points and axes is turned back.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import PurePosixPath
from typing import Any

from ..errors import ModelError, nearest
from . import algebra
from .algebra import postorder
from .curves import TableFunction
from .declared import Declared
from .description import (
    Axis,
    Body,
    Bristle,
    Bushing,
    Closure,
    Constant,
    Constraint,
    Contact,
    ContactPair,
    Coordinate,
    Description,
    Drawing,
    Event,
    Formula,
    Frame,
    Friction,
    Given,
    Input,
    Joint,
    Load,
    Loop,
    Parameter,
    Point,
    Port,
    Rate,
    Reset,
    Rolling,
    Rotor,
    Spring,
    StartConditions,
    State,
    Stop,
    Table,
    Use,
)
from .expression_tree import names_in
from .functions import Tabulated, sensor, tabulated
from .given import is_symbol
from .gravity import HERE
from .items import drawing_key
from .names import LONGEST_NAME, name_fault
from .orientation import Expressions
from .placing import Placing, composed_angles, turned_numbers
from .sensors import sensor_call
from .sources import BY_KEY, Source
from .units import parse_unit

WORLD = "world"
NAMES_OF_VALUES = ("coordinate", "input", "value")  # ports that stand in expressions
PORT_KINDS = (*NAMES_OF_VALUES, "body", "frame", "point")
PORT_KEYS = ("kind", "unit")
PLACE_KEYS = ("offset", "angle", "xyz", "rpy")

# Which fields of a part are names: of elements, and of what stands in expressions.
NAMES: dict[type, tuple[tuple[str, ...], tuple[str, ...]]] = {
    Parameter: ((), ("name",)),
    Constant: ((), ("name",)),
    Coordinate: (("quaternion", "joint"), ("name",)),
    Rate: ((), ("name", "coordinate")),
    State: ((), ("name",)),
    Input: ((), ("name", "rate_of")),
    Table: ((), ("name",)),
    Body: (("name",), ()),
    Joint: (("name", "parent", "child"), ("coordinates", "rates")),
    Point: (("name", "body"), ()),
    Axis: (("name", "body"), ()),
    Frame: (("name", "body"), ()),
    Spring: (("name",), ()),
    Bushing: (("name", "frames"), ()),
    Rolling: (("name", "body", "plane"), ()),
    Closure: (("name", "frames"), ("coordinate",)),
    Rotor: (("name", "body"), ()),
    Load: (("name", "body", "frame", "reaction"), ()),
    Constraint: (("name",), ()),
    Stop: (("name",), ()),
    Friction: (("name", "normal"), ()),
    Bristle: (("name",), ()),
    Contact: (("name",), ()),
    ContactPair: (("name", "body", "plane", "other"), ()),
    Drawing: (("name",), ()),
    Event: (("name",), ()),
    Reset: ((), ("target",)),
}
# The same of the arguments of ready-made constraints; all others are expressions, numbers or words.
ELEMENTS_OF_LOOPS = ("points", "point", "line", "plane", "bodies", "body")
SYMBOLS_OF_LOOPS = ("coordinates", "coordinate", "sun", "ring", "carrier", "input", "outputs")
# The attributes of a model that hold parts: lists, and mappings by name.
LISTS = (
    "_coordinates", "_inputs", "_definitions", "_outputs", "_tables", "_states", "_integrals", "_state_rates", "_made",
)  # fmt: skip
MAPPINGS = {
    "_bodies": "bodies", "_joints": "joints", "_points": "points", "_axes": "axes", "_frames": "frames",
    "_springs": "springs", "_bushings": "bushings", "_rotors": "rotors", "_loads": "loads",
    "_constraints": "constraints", "_loops": "constraints", "_closures": "closures", "_rolling": "rolling",
    "_stops": "stops", "_frictions": "friction", "_bristles": "bristles", "_contacts": "contacts", "_pairs": "contacts",
    "_events": "events", "_drawings": "draw",
}  # fmt: skip


def make_port(model: Declared, name: str, kind: Any, unit: Any) -> Port:
    """A port from the arguments of `Model.port`; what stands in expressions is declared."""
    sources, place = model._sources, "ports"
    if kind not in PORT_KINDS:
        hint = nearest(str(kind)[:60], PORT_KINDS, "kinds of ports")
        raise sources.error(place, str(name)[:60], f"a port is no {kind!r:.60}", hint=hint)
    if name in PLACE_KEYS or name == "assembly":
        message = (
            f"'{name}' says where an assembly stands" if name in PLACE_KEYS else "'assembly' is a key of uses"
        )
        raise sources.error(place, name, message, hint="choose another name for the port")
    size = sources.unit(unit, place, f"{name}.unit")
    if size is not None and kind not in ("coordinate", "input", "value"):
        raise sources.error(place, f"{name}.unit", f"a {kind} has no unit", hint="leave it out")
    if kind in NAMES_OF_VALUES:
        model._declare(name, "port", place)
    else:
        model._new_element(name, place, model._ports)
        if kind != "body":
            for component in "xyz":
                model._declare_made(f"{name}_{component}", "point component", place, "port")
    return Port(name, kind, size and size.coherent)


def use(model: Declared, name: str, key: str, assembly: Declared, given: Mapping[str, Any]) -> Use:
    """Take over what an assembly says under a name; `key` is what the model calls the assembly."""
    table, sources = f"use.{name}", model._sources
    fault = name_fault(name) or model._closed_fault()
    if not fault and (name in model._kinds or name in model._uses):
        fault = f"the name '{name}' is taken"
    if fault:
        raise sources.error("use", str(name)[:60], fault, hint="choose another name")
    if not assembly._closed:
        _check_assembly(key, assembly)
    made = Use(name, key, tuple(_given(model, table, key, assembly, given)))
    count = 1 + len(assembly._kinds) + sum(len(getattr(assembly, x)) for x in MAPPINGS)
    model._shelf.take(count, functools.partial(sources.error, table, ""))
    model._uses[name] = made
    assembly._closed = assembly._closed or name
    _Taken(model, made, assembly).take()
    return made


def _check_assembly(key: str, assembly: Declared) -> None:
    """Whether a model can be an assembly: its gravity, runs and impacts would be those of the model that uses it."""
    for has, what in (
        (assembly._gravity is not None or assembly._field is not None, "gravity"),
        (assembly._gravitation is not None or assembly._attractors, "gravity"),
        (assembly._run, "run"),
        (assembly.impacts != "simultaneous", "impacts"),
    ):
        if has:
            message = f"an assembly has no '{what}': that is said by the model that uses it"
            raise assembly._sources.error(what, "", message, hint="leave it out there")
    for port in assembly._ports.values():
        taken = [x for x in ("_bodies", "_points", "_frames") if port.name in getattr(assembly, x)]
        if taken and port.kind not in NAMES_OF_VALUES:
            message = f"the assembly has a port '{port.name}' and a part of this name"
            raise assembly._sources.error("ports", port.name, message, hint="choose another name")
    known = assembly._kinds.keys() | assembly._aliases.keys() | {"t", *HERE}
    free: dict[str, None] = {}
    for _, source in assembly._sources.everything():
        free |= {x: None for x in sorted(names_in(source.expression) - known) if sensor_call(x) is None}
    assembly._free = tuple(free)


def _given(
    model: Declared, table: str, key: str, assembly: Declared, given: Mapping[str, Any]
) -> Iterator[Given]:
    """What a use gives to ports and parameters, and where it places the assembly."""
    sources = model._sources
    parameters = {p.name: p for p in assembly._parameters if "." not in p.name}
    known = (*assembly._ports, *parameters, *assembly._free, *PLACE_KEYS)
    for name in given:
        if name not in known:
            message = f"the assembly '{key}' has no port and no parameter '{name!s:.60}'"
            if assembly._kinds.get(name) == "constant":
                message, hint = f"'{name}' is a constant of the assembly '{key}'", "make it a parameter there"
            else:
                hint = nearest(str(name)[:60], known, "ports and parameters")
            raise sources.error(table, str(name)[:60], hint=hint, message=message)
    for port in assembly._ports.values():
        said = given.get(port.name)
        found = _connected(model, table, port, port.name if said is None else said)
        yield found if said is not None else replace(found, said=False)
    for p in parameters.values():
        if p.name in PLACE_KEYS or p.name == "assembly":
            raise assembly._sources.error(
                "parameters", p.name, f"'{p.name}' is a key of uses", hint="choose another name"
            )
        value = given.get(p.name)
        if value is None and model._kinds.get(p.name) in ("parameter", "constant"):
            value = algebra.Symbol(p.name)
            sources.take_over(table, p.name, Source(value))
            yield Given(p.name, "parameter", value, p.unit, said=False)
        elif value is not None and sources.is_formula(value):
            yield Given(p.name, "parameter", sources.expression(value, table, p.name), p.unit)
        elif value is not None:
            size = None if p.unit is None else parse_unit(p.unit)
            number, unit = sources.number(value, size, table, p.name)
            yield Given(p.name, "parameter", number, unit and unit.coherent)
    for name in assembly._free:
        value = given.get(name)
        if value is None:
            yield Given(name, "free", algebra.Symbol(name), said=False)
        elif sources.is_formula(value):
            yield Given(name, "parameter", sources.expression(value, table, name))
        else:
            number, unit = sources.number(value, None, table, name)
            yield Given(name, "parameter", number, unit and unit.coherent)
    yield from _places(model, table, given)


def _connected(model: Declared, table: str, port: Port, value: Any) -> Given:
    sources = model._sources
    if port.kind == "value":
        return Given(port.name, port.kind, sources.expression(value, table, port.name), port.unit)
    if isinstance(value, tuple) and len(value) == 3 and all(map(is_symbol, value)):
        value = value[0].name.removesuffix("_x")  # what `point` and `frame` return
    named = model._named_in(value, table, port.name)
    if port.kind not in NAMES_OF_VALUES:
        return Given(port.name, port.kind, named)
    return Given(port.name, port.kind, sources.expression(algebra.Symbol(named), table, port.name), port.unit)


def _places(model: Declared, table: str, given: Mapping[str, Any]) -> Iterator[Given]:
    sources = model._sources
    for plane, space in (("offset", "xyz"), ("angle", "rpy")):
        if given.get(plane) is not None and given.get(space) is not None:
            message = f"'{plane}' is for the plane, '{space}' for space; both are given"
            raise sources.error(table, space, message, hint="leave one of them out")
    for key, lengths in (("offset", (2, 3)), ("xyz", (3,)), ("rpy", (3,))):
        if given.get(key) is not None:
            unit = "rad" if key == "rpy" else "m"
            for k, x in enumerate(model._vector(given[key], table, key, lengths)):
                yield Given(f"{key}[{k}]", "place", sources.expression(x, table, f"{key}[{k}]"), unit)
    if given.get("angle") is not None:
        yield Given("angle", "place", sources.expression(given["angle"], table, "angle"), "rad")


@dataclass
class _Taken:
    """What a use takes over from an assembly, part by part."""

    model: Declared
    use: Use
    assembly: Declared

    def __post_init__(self) -> None:
        prefix = self.use.name
        constants = {c.name: c.value for c in self.model._constants}
        place = {g.key: self._named_number(g) for g in self.use.given if g.kind == "place"}
        self.place = Placing.of(place, constants)
        self.world = WORLD if self.place is None else f"{prefix}.{WORLD}"
        self.elements = {g.key: g.value for g in self.use.given if isinstance(g.value, str)}
        self.names = self.assembly._kinds | dict.fromkeys(self.assembly._free, "parameter")
        self.symbols: dict[str, algebra.Expr] = {
            name: algebra.Symbol(f"{prefix}.{name}") for name in self.names
        }
        for g in self.use.given:
            if g.kind in ("coordinate", "input", "free") or (g.kind == "parameter" and not g.said):
                self.symbols[g.key] = g.value
            elif g.kind in ("frame", "point"):
                for c in "xyz":
                    self.symbols[f"{g.key}_{c}"] = algebra.Symbol(f"{g.value}_{c}")
        for name, symbol in self.assembly._aliases.items():
            self.symbols[name] = self.symbols[symbol.name]
        # In expressions, what is read of points and axes in world axes is turned back.
        self.read = dict(self.symbols)
        self.points: dict[
            int, tuple[list[algebra.Expr], list[algebra.Expr]]
        ] = {}  # turned back, and in the world
        if self.place is not None:
            for name, kind in self.assembly._kinds.items():
                if kind in ("point component", "axis component") and name.endswith("_x"):
                    stem = name.removesuffix("_x")
                    world = [self.symbols[f"{stem}_{c}"] for c in "xyz"]
                    back = self.place.point_back if kind == "point component" else self.place.vector_back
                    made = back(world)
                    self.read |= zip((f"{stem}_{c}" for c in "xyz"), made, strict=True)
                    if kind == "point component":
                        self.points[id(made[0])] = made, world
        self.tables = {x.name for x in self.assembly._tables}
        self.children = {j.child for j in self.assembly._joints.values()}
        # Of expressions, by identity: as they act, and as they are said, which units are checked of.
        self._acting: dict[int, algebra.Expr] = {}
        self._said: dict[int, algebra.Expr] = self._acting if self.place is None else {}

    def take(self) -> None:
        """Take all of it over into the model."""
        model, assembly = self.model, self.assembly
        model._sources.uses[self.use.name] = assembly._sources
        self._take_names()
        self.joined = {j.child for j in model._joints.values()}
        model._placed |= {self._element(body): by for body, by in assembly._placed.items()}
        for attribute in LISTS:
            parts = getattr(assembly, attribute)
            if attribute in ("_coordinates", "_made"):  # those of uses inside come behind
                parts = sorted(parts, key=lambda c: "." in c.name)
            getattr(model, attribute).extend(map(self._part, parts))
        for attribute, table in MAPPINGS.items():
            parts = getattr(model, attribute)
            for part in getattr(assembly, attribute).values():
                made = self._placed(self._part(part))
                fault = model._spelling_fault(table, made.name)
                if fault is not None:
                    raise model._sources.error(f"use.{self.use.name}", "", fault, hint="choose another name")
                parts[made.name] = made
        model._constants.extend(replace(c, name=self._symbol(c.name)) for c in assembly._constants)
        for joint, rates in assembly._made_rates.items():
            model._made_rates[self._element(joint)] = list(map(self._part, rates))
        for coordinate, joint in assembly._jointed.items():
            model._jointed[self._symbol(coordinate)] = self._element(joint)
        for energies in (assembly._energies, assembly._used_energies):
            for key, terms in energies.items():
                model._used_energies.setdefault(key, []).extend(map(self._expression, terms))
        for forces in (assembly._forces, assembly._used_forces):
            for name, terms in forces.items():
                model._used_forces.setdefault(self._symbol(name), []).extend(map(self._expression, terms))
        for inner in (*assembly._uses.values(), *assembly._inner_uses):
            model._inner_uses.append(self._inner(inner))
        for start in (assembly._start, *assembly._used_starts):
            if start is not None:
                model._used_starts.append(self._start(start))
        self._take_sources()

    def _named_number(self, given: Given) -> algebra.Expr:
        """A number that shifts the use, as a constant of the model: equal uses are then told apart by names alone.

        A height of zero stays a number, by which what stays in its plane is known, and so does one whose name is taken.
        """
        key, _, k = given.key.partition("[")
        if key not in ("offset", "xyz") or not given.value.is_Number or (k == "2]" and given.value.is_zero):
            return given.value
        name = f"{self.use.name}.offset_{'xyz'[int(k[0])]}"
        model = self.model
        of_assembly = name.removeprefix(f"{self.use.name}.") in self.assembly._kinds
        if of_assembly or name in model._kinds or len(name) > LONGEST_NAME or model._spelling_fault("", name):
            return given.value
        model._kinds[name] = "constant"
        model._constants.append(Constant(name, float(given.value), "m", of_place=True))
        return algebra.Symbol(name)

    def _take_names(self) -> None:
        """Declare the names that the use makes, parameters with the values that it gives."""
        model, prefix = self.model, self.use.name
        given = {g.key: g for g in self.use.given}
        for name, kind in self.names.items():
            full = f"{prefix}.{name}"
            if self.symbols[name] != algebra.Symbol(full):
                model._aliases[full] = self.symbols[name]
                continue
            what = given.get(name)
            if what is not None and not isinstance(what.value, float):
                kind = "definition"
            fault = (
                f"the name '{full:.60}…' is longer than {LONGEST_NAME}" if len(full) > LONGEST_NAME else None
            )
            fault = fault or model._spelling_fault("", full)
            if fault is not None:
                raise model._sources.error(f"use.{prefix}", "", fault, hint="choose another name")
            model._kinds[full] = kind
            if kind == "definition" and what is not None:
                model._definitions.append((full, what.value))
                given_by = f"use.{prefix}", name
                model._sources.take_over(
                    "definitions", full, model._sources.of(*given_by)[0], said_at=given_by
                )
        for name, symbol in self.assembly._aliases.items():
            model._aliases[f"{prefix}.{name}"] = self.symbols[symbol.name]
        for p in (*self.assembly._parameters, *(Parameter(x, 0.0) for x in self.assembly._free)):
            what = given.get(p.name)
            if what is None:
                model._parameters.append(replace(p, name=f"{prefix}.{p.name}"))
            elif isinstance(what.value, float):
                model._parameters.append(Parameter(f"{prefix}.{p.name}", what.value, what.unit, p.doc))

    def _take_sources(self) -> None:
        """Tell the model's sources what stands where: checks of units read them, and errors name the places."""
        own, taken = self.model._sources, self.assembly._sources
        called = {x for x in taken.tables if not self.tables.isdisjoint((x, x.removesuffix("_integral")))}
        own.tables |= {f"{self.use.name}.{x}": taken.tables[x] for x in sorted(called)}
        own.in_plane |= {self._address(*x) for x in taken.in_plane}
        for address, source in taken.everything():
            said = self._rewritten(source.expression, self.symbols, self._said)
            made = replace(source, expression=said, use=self.use.name)
            own.take_over(*self._address(*address), made)

    def _start(self, start: StartConditions) -> StartConditions:
        """What holds where a run begins, with the model's names; in balance is what the assembly itself has."""
        steady = start.steady
        if start.everything:
            at_rest = (r for r in self.assembly._all_rates() if r.start is None)
            steady = tuple(r.name if r.coordinate is None else r.coordinate for r in at_rest if not r.state)
            steady += tuple(s.name for s in self.assembly._states)
        self._check_start(start)
        equations = (
            replace(
                x,
                expression=self._expression(x.expression),
                text=f"{x.text} of {self.use.name}",
                key=f"{self.use.name}.{x.key}",
            )
            for x in start.equations
        )
        return StartConditions(
            tuple(equations),
            _each(self._symbol, start.find),
            _each(self._symbol, steady),
            closed=_each(self._element, start.closed),
        )

    def _check_start(self, start: StartConditions) -> None:
        """Whether the assembly has what its start names, and the use leaves the parameters to it that are sought."""
        formulas = {g.key for g in self.use.given if g.kind == "parameter" and not isinstance(g.value, float)}
        kinds = self.names
        limited = {
            f"{j.name}_{side}"
            for j in self.assembly._joints.values()
            if j.restitution is not None
            for side in ("lower", "upper")
        }
        moving = {name for name, kind in kinds.items() if kind in ("coordinate", "rate", "state", "port")}
        for key, names, known, what in (
            ("find", start.find, {x for x, kind in kinds.items() if kind == "parameter"}, "parameter"),
            ("steady", start.steady, moving, "coordinate or state"),
            (
                "closed",
                start.closed,
                self.assembly._stops.keys() | limited | self.assembly._pairs.keys(),
                "stop",
            ),
        ):
            for k, name in enumerate(names):
                of_contact = key == "closed" and name.rpartition("_")[0] in self.assembly._pairs
                if name not in known and not of_contact:  # contacts make their stops in the finished model
                    message, hint = (
                        f"there is no {what} '{name:.60}'",
                        nearest(name[:60], sorted(known), f"{what}s"),
                    )
                    raise self.assembly._sources.error("start", f"{key}[{k}]", message, hint=hint)
        for name in start.find:
            if name in formulas and self.symbols[name] == algebra.Symbol(f"{self.use.name}.{name}"):
                message = f"the start of the assembly seeks '{name}', which is given a formula here"
                raise self.model._sources.error(
                    f"use.{self.use.name}", name, message, hint="give it a number, or leave it out"
                )

    def _inner(self, inner: Use) -> Use:
        """A use in the assembly, as one of the model: what it gives has the model's names."""
        given = tuple(
            replace(g, value=self._element(g.value) if isinstance(g.value, str) else self._value(g.value))
            for g in inner.given
        )
        return replace(inner, name=f"{self.use.name}.{inner.name}", given=given)

    # Names.

    def _element(self, name: str) -> str:
        if name in self.elements:
            return self.elements[name]
        return self.world if name == WORLD else f"{self.use.name}.{name}"

    def _symbol(self, name: str) -> str:
        return self.symbols[name].name if name in self.symbols else f"{self.use.name}.{name}"

    def _table(self, name: str) -> str:
        """A table by its name: the assembly's own, or one of the model."""
        return f"{self.use.name}.{name}" if name in self.tables else name

    def _address(self, table: str, key: str) -> tuple[str, str]:
        head, dotted, name = table.partition(".")
        if dotted:
            if key.startswith("then.reset."):
                target = key.removeprefix("then.reset.").removeprefix("dot(").removesuffix(")")
                key = key.replace(target, self._symbol(target))
            return f"{head}.{self.use.name}.{name}", key
        if head == "forces":
            return table, self._symbol(key)
        return table, f"{self.use.name}.{key}" if head in BY_KEY else key

    # Parts and expressions with the model's names.

    def _part(self, part: Any) -> Any:
        if isinstance(part, Loop):
            return self._loop(part)
        if isinstance(part, tuple) and len(part) == 2 and isinstance(part[0], str):  # a definition, an output
            return self._symbol(part[0]), self._expression(part[1])
        elements, symbols = NAMES.get(type(part), ((), ()))
        changed: dict[str, Any] = {}
        for x in fields(part):
            value = getattr(part, x.name)
            if x.name in elements:
                changed[x.name] = _each(self._element, value)
            elif x.name in symbols:
                changed[x.name] = _each(self._symbol, value)
            elif isinstance(part, Frame) and x.name == "said":
                changed[x.name] = ()  # in names of the assembly, and before it was placed
            elif x.name == "mesh" and value:
                changed[x.name] = self._mesh(value)
            elif not isinstance(value, (str, float, bool, type(None))):
                changed[x.name] = self._value(value)
        return replace(part, **changed)

    def _loop(self, loop: Loop) -> Loop:
        arguments = []
        for key, value in loop.arguments:
            if key in ELEMENTS_OF_LOOPS:
                value = _each(self._element, value)
            elif key in SYMBOLS_OF_LOOPS:
                value = _each(self._symbol, value)
            else:
                value = self._value(value)
            arguments.append((key, value))
        return Loop(self._element(loop.name), loop.kind, tuple(arguments))

    def _value(self, value: Any) -> Any:
        if isinstance(value, algebra.Expr):
            return self._expression(value)
        if isinstance(value, tuple):
            return tuple(map(self._value, value))
        if isinstance(value, Formula):
            return Formula(self._expression(value.expression), *self._address(value.table, value.key))
        return self._part(value) if is_dataclass(value) else value

    def _mesh(self, file: str) -> str:
        """A mesh of the assembly, from the model's folder."""
        if self.assembly.folder == self.model.folder:
            return file
        folder = os.path.relpath(self.assembly.folder.resolve(), self.model.folder.resolve())
        return str(PurePosixPath(*PurePosixPath(folder.replace(os.sep, "/")).parts, file))

    def _expression(self, root: algebra.Expr) -> algebra.Expr:
        """An expression as it acts in the model."""
        return self._rewritten(root, self.read, self._acting)

    def _rewritten(
        self, root: algebra.Expr, names: Mapping[str, algebra.Expr], memo: dict[int, algebra.Expr]
    ) -> algebra.Expr:
        """An expression with other names, built as it was: nothing is evaluated."""
        for node in postorder([root]):
            if id(node) in memo:
                continue
            if isinstance(node, algebra.Symbol):
                memo[id(node)] = self._read(node.name, names)
                continue
            args = [memo[id(x)] for x in node.args]
            if isinstance(node, Tabulated):
                kind = node.func
                made = tabulated(self._table(kind.table), kind.role, len(args), kind.axis)
                memo[id(node)] = made(*args, evaluate=False)
            elif all(a is b for a, b in zip(args, node.args, strict=True)):
                memo[id(node)] = node
            else:
                memo[id(node)] = node.func(*args, evaluate=False)
        return memo[id(root)]

    def _read(self, name: str, names: Mapping[str, algebra.Expr]) -> algebra.Expr:
        if name in names:
            return names[name]
        if name == "t" or name in HERE:
            return algebra.Symbol(name)
        call = sensor_call(name)
        return algebra.Symbol(f"{self.use.name}.{name}") if call is None else self._sensor(*call)

    def _sensor(self, kind: str, names: tuple[str, ...]) -> algebra.Symbol:
        """A sensor by the model's names; what is measured along world axes is, along those of the assembly."""
        first, *more = names
        if kind == "acceleration" and not more:
            first = getattr(self.symbols.get(first), "name", first)  # one that is not declared is told later
        else:
            first = self._element(first)
        at = {"distance": 0, "angle": 0}.get(kind, 1)  # where names of frames begin
        more = [x if k < at else self._element(x) for k, x in enumerate(more)]
        if kind == "angle":
            more[1:] = names[2:]
        along = kind not in ("distance", "angle", "reaction", "power")
        if self.place is not None and along and len(more) == 1:
            more.append(self.world)
        if self.world in (first, *more):
            self._need_world()
        return sensor(kind, first, *more)

    # Places.

    def _need_world(self) -> None:
        """Make the frame that stands for the world of the assembly."""
        if self.place is not None and self.world not in self.model._frames:
            self.model._frames[self.world] = Frame(self.world, WORLD, self.place.shift, self.place.rpy)
            self.model._kinds |= {f"{self.world}_{c}": "point component" for c in "xyz"}

    def _placed(self, part: Any) -> Any:
        """A part with the model's names where the use places it."""
        if self.place is None:
            return part
        method: Callable[[Any], Any] | None = getattr(self, f"_placed_{type(part).__name__.lower()}", None)
        return part if method is None else method(part)

    def _error(self, part: Any, table: str, key: str, message: str, hint: str) -> ModelError:
        return self.model._sources.error(f"{table}.{part.name}", key, message, hint=hint)

    def _placed_body(self, body: Body) -> Body:
        if body.name in {self._element(x) for x in self.children} or not body.com:
            return body
        if body.name in self.joined:
            message = f"a joint places the body, and so does '{self.use.name}'"
            raise self._error(body, "bodies", "", message, "give that use no place")
        self.model._placed[body.name] = self.use.name
        if body.planar:
            if not self.place.in_plane:
                message = f"the body is planar, and '{self.use.name}' is placed out of the x-y plane"
                raise self._error(body, "bodies", "", message, "give 'offset' and 'angle'")
            com = self.place.point((*body.com, algebra.ZERO))[:2]
            turns = body.angle is not None or body.shape is not None or bool(body.solids)
            angle = self.place.yaw_more(body.angle) if turns else None
            return replace(body, com=tuple(com), angle=angle)
        steps = tuple(
            (axis, x) for axis, x in zip("zyx", reversed(self.place.rpy), strict=True) if not x.is_zero
        )
        return replace(body, com=tuple(self.place.point(body.com)), rotation=(*steps, *body.rotation))

    def _placed_joint(self, joint: Joint) -> Joint:
        if joint.parent != self.world:
            return joint
        turned = self._composed(joint, "joints", joint.rpy)
        return replace(joint, parent=WORLD, xyz=tuple(self.place.point(joint.xyz)), rpy=turned)

    def _placed_point(self, point: Point) -> Point:
        if point.body != self.world:
            return point
        return replace(point, body=WORLD, at=tuple(self.place.point(point.at)))

    def _placed_axis(self, axis: Axis) -> Axis:
        if axis.body != self.world:
            return axis
        return replace(axis, body=WORLD, direction=tuple(self.place.vector(axis.direction)))

    def _placed_frame(self, frame: Frame) -> Frame:
        if frame.body != self.world:
            return frame
        turned = self._composed(frame, "frames", frame.rpy)
        return replace(frame, body=WORLD, at=tuple(self.place.point(frame.at)), rpy=turned)

    def _composed(self, part: Any, table: str, rpy: Expressions) -> Expressions:
        constants = {c.name: c.value for c in self.model._constants}
        made = composed_angles(self.place.rpy, rpy, constants)
        if made is None:
            message = f"an orientation inside '{self.use.name}', which is turned in space by parameters, has no formula"
            hint = "turn the use by numbers or constants, or about z only"
            raise self._error(part, table, "rpy" if table == "frames" else "origin.rpy", message, hint)
        return made

    def _placed_rotor(self, rotor: Rotor) -> Rotor:
        if rotor.body != self.world:
            return rotor
        at = tuple(self.place.point(rotor.at)) if rotor.at else ()
        return replace(rotor, body=WORLD, at=at)

    def _placed_spring(self, spring: Spring) -> Spring:
        return replace(spring, places=tuple(self._point(x) for x in spring.places))

    def _placed_drawing(self, drawing: Drawing) -> Drawing:
        vectors = []
        for k, x in enumerate(drawing.vectors):
            is_force = drawing_key(drawing.kind, k) == "force[1]"
            vectors.append(tuple(self.place.vector(x)) if is_force else self._point(x))
        return replace(drawing, vectors=tuple(vectors))

    def _point(self, place: Expressions) -> Expressions:
        """A place in the world; what is one of the points is named, not turned back and again."""
        back, world = self.points.get(id(place[0]), ((), ()))
        if back and all(a is b or a.is_zero for a, b in zip(place, back, strict=False)):
            return tuple(world[: len(place)])
        return tuple(self.place.point(place))

    def _placed_load(self, load: Load) -> Load:
        load = replace(load, point=tuple(self._cut(load.point, self._point)))
        if load.reaction == self.world:
            load = replace(load, reaction=WORLD)
        if load.frame not in (None, self.world):
            return load
        turned = self._cut(load.force, self.place.vector), self._cut(load.torque, self.place.vector)
        return replace(load, frame=None, force=tuple(turned[0]), torque=tuple(turned[1]))

    def _cut(self, vector: Expressions, move: Callable) -> Expressions:
        """A vector of two or three components moved; a torque in the plane stays."""
        n = len(vector)
        if n == 2 and not self.place.in_plane:
            message = f"two components are in the plane, and '{self.use.name}' is placed out of it"
            raise self.model._sources.error(f"use.{self.use.name}", "", message, hint="write three there")
        return vector if n < 2 else tuple(move((*vector, algebra.ZERO)[:3])[:n])

    def _placed_closure(self, closure: Closure) -> Closure:
        return self._in_frames(closure, closure.frames)

    def _placed_bushing(self, bushing: Bushing) -> Bushing:
        return self._in_frames(bushing, bushing.frames)

    def _placed_rolling(self, rolling: Rolling) -> Rolling:
        return self._in_frames(rolling, (rolling.plane,))

    def _placed_contactpair(self, pair: ContactPair) -> ContactPair:
        return self._in_frames(pair, (pair.plane,) if pair.other is None else ())

    def _in_frames(self, part: Any, names: tuple[str, ...]) -> Any:
        if self.world in names:
            self._need_world()
        return part

    def _placed_loop(self, loop: Loop) -> Loop:
        arguments = dict(loop.arguments)
        for key in ("direction", "normal"):
            if key in arguments:
                base = arguments["line" if key == "direction" else "plane"]
                if (arguments.get("body") or self._body_of(base)) == self.world:
                    arguments[key] = self._turned(loop, f"{loop.kind}.{key}", arguments[key])
        if "axes" in arguments:
            pairs = zip(arguments["bodies"], arguments["axes"], strict=True)
            arguments["axes"] = tuple(
                self._turned(loop, "parallel.axes", axis) if body == self.world else axis
                for body, axis in pairs
            )
        for key in ("body", "bodies"):
            if key in arguments:
                arguments[key] = _each(lambda x: WORLD if x == self.world else x, arguments[key])
        return replace(loop, arguments=tuple(arguments.items()))

    def _body_of(self, point: str) -> str | None:
        """The body of a point of the assembly; those of the model stay where they are."""
        name = point.removeprefix(f"{self.use.name}.")
        found = self.assembly._points.get(name) or self.assembly._frames.get(name)
        return None if found is None or point in self.elements.values() else self._element(found.body)

    def _turned(self, loop: Loop, key: str, direction: tuple[float, ...]) -> tuple[float, ...]:
        made = turned_numbers(self.place, direction, {c.name: c.value for c in self.model._constants})
        if made is None:
            message = f"a direction of the world inside '{self.use.name}', which is turned by parameters"
            hint = "turn the use by numbers or constants, or hold it by a closure"
            raise self._error(loop, "constraints", key, message, hint)
        return made


def _each(rename: Callable[[str], str], value: Any) -> Any:
    if isinstance(value, str):
        return rename(value) if value else value
    return tuple(map(rename, value)) if isinstance(value, tuple) else value


class Used:
    """What a use of an assembly has, by the names there: `c1.piston` is the model's `c1.piston`."""

    def __init__(self, model: Declared, name: str) -> None:
        self._model, self._name = model, name

    def __getitem__(self, name: str) -> Any:
        """A symbol; the name of an element; a function of a table; or a use inside."""
        model, full = self._model, f"{self._name}.{name}"
        table = next((x for x in model._tables if x.name == full), None)
        if table is not None:
            return TableFunction(table)
        if full in model._kinds or full in model._aliases:
            return model._symbol(full)
        if any(full in getattr(model, attribute) for attribute in MAPPINGS):
            return full
        if any(use.name == full for use in (*model._uses.values(), *model._inner_uses)):
            return Used(model, full)
        raise KeyError(f"'{self._name}' has no '{name}'")

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None


def without_uses(d: Description) -> Description:
    """The description without what uses of assemblies brought: names with dots."""

    def own(x: Any) -> bool:
        return "." not in (x[0] if isinstance(x, tuple) else x.name)

    kept = {}
    for x in fields(d):
        value = getattr(d, x.name)
        if x.name not in ("forces", "uses") and isinstance(value, tuple) and value and x.name != "gravity":
            kept[x.name] = tuple(filter(own, value))
    return replace(d, **kept)


def check_uses(d: Description, sources: Any, kinds: Mapping[str, str]) -> None:
    """Whether what ports are connected to is there."""
    bodies = {b.name for b in d.bodies} | {WORLD}
    frames = {f.name for f in d.frames}
    elements = {"body": bodies, "frame": bodies | frames, "point": {p.name for p in d.points} | frames}
    placed = bodies | elements["point"]
    for use in d.uses:
        if use.name in placed:
            message = f"the use of an assembly and a body, point or frame are called '{use.name}'"
            raise sources.error("use", use.name, message, hint="choose another name for one of them")
        for g in use.given:
            if g.kind == "free" or (g.kind == "value" and not g.said):
                _check_free(use, g, sources, kinds)
            known, name = elements.get(g.kind), g.value
            if g.kind in ("coordinate", "input"):
                known, name = {x for x, kind in kinds.items() if kind == g.kind}, g.value.name
            if known is not None and name not in known:
                message = f"there is no {g.kind} '{name}' for the port '{g.key}'"
                raise sources.error(
                    f"use.{use.name}", g.key, message, hint=nearest(name, known, f"{g.kind}s")
                )


def _check_free(use: Use, given: Given, sources: Any, kinds: Mapping[str, str]) -> None:
    """Whether the model has what a use does not say."""
    name = given.value.name
    if given.kind == "value" and name not in kinds:
        message = f"the port '{given.key}' is not connected, and the model has no '{name}'"
        raise sources.error(f"use.{use.name}", given.key, message, hint="give it an expression")
    if given.kind == "value" or kinds.get(name) in ("parameter", "constant"):
        return
    for address, source in sources.everything():
        if source.use and f"{use.name}.".startswith(f"{source.use}.") and name in names_in(source.expression):
            known = [x for x, kind in kinds.items() if kind in ("parameter", "constant")]
            if name in kinds:
                message = f"'{name}' is a {kinds[name]} of the model, which comes into an assembly by a port"
                raise sources.name_error(*address, name, message, hint="declare the port")
            if source.point:
                raise sources.point_error(*address, source.point, (), ())
            message = f"the name '{name}' is not declared, and the model has no such parameter"
            raise sources.name_error(*address, name, message, hint=nearest(name, known, "parameters"))
