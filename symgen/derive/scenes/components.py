"""Splits a description into subsystems that do not act on each other, and finds which of them are equal.

Coordinates belong together when a body, a joint, a term of an energy, a force, a load, a constraint or a reset
mentions them together. Gravity, parameters, inputs and time are shared; outputs and events only look.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

from symgen.model.algebra import postorder

from ...model import algebra
from ...model.description import Constant, Description, Parameter
from ...model.expression_tree import names_in
from ..program import Places

ENERGIES = ("kinetic", "potential", "dissipation")
WORLD = "world"


class Canonical:
    """Signatures of descriptions: equal where descriptions differ in names, units and start values only.

    Parameters
    ----------
    constants : mapping of str to float
        Names that stand for their values; other constants of a description differ in names, as its parameters do.
    """

    def __init__(self, constants: Mapping[str, float]) -> None:
        self._constants = constants
        self._numbers: dict[tuple, int] = {}  # each structure of an expression has a number
        # Those of numbers, by identity; they are kept, lest it be reused.
        self._literals: dict[int, tuple[algebra.Expr, int]] = {}

    def signature(self, d: Description) -> tuple:
        """What a description says, its names replaced by the places where they are declared."""
        names: dict[str, str] = {name: repr(value) for name, value in self._constants.items()}
        names["t"] = "t"
        groups = {
            "u": [x.name for x in d.inputs], "p": [x.name for x in d.parameters],
            "q": [x.name for x in d.coordinates], "d": [name for name, _ in d.definitions],
            "k": [x.name for x in d.constants if x.name not in self._constants],
        }  # fmt: skip
        for letter, members in groups.items():
            names |= {name: f"{letter}{k}" for k, name in enumerate(members)}
        rates = {r.name: f"v{k}" for k, r in enumerate(d.rates)}
        names |= {name: place for name, place in rates.items() if name not in names}
        for letter, items in (("P", d.points), ("X", d.axes)):
            names |= {f"{x.name}_{axis}": f"{letter}{k}{axis}" for k, x in enumerate(items) for axis in "xyz"}
        bodies = {"world": -1, **{b.name: k for k, b in enumerate(d.bodies)}}
        number = _Numbering(self._numbers, self._literals, names).of

        def all_of(expressions: Iterable[algebra.Expr]) -> tuple[int, ...]:
            return tuple(number(x) for x in expressions)

        def one(expression: algebra.Expr | None) -> int | None:
            return None if expression is None else number(expression)

        return (
            tuple((c.quaternion is not None) for c in d.coordinates),
            tuple((names.get(r.coordinate), r.state) for r in d.rates),
            all_of(expression for _, expression in d.definitions),
            tuple(_canonical_body(b, all_of, one) for b in d.bodies),
            tuple(
                (*_joint(j, bodies), all_of(j.xyz), all_of(j.rpy), *map(names.get, j.coordinates))
                for j in d.joints
            ),
            tuple((bodies[p.body], all_of(p.at)) for p in d.points),
            tuple((bodies[a.body], all_of(a.direction)) for a in d.axes),
            all_of(d.gravity or ()),
            one(d.kinetic),
            one(d.potential),
            one(d.dissipation),
            tuple((rates[name], number(force)) for name, force in d.forces),
            tuple((all_of(x.point), all_of(x.force), bodies.get(x.body), all_of(x.torque)) for x in d.loads),
            all_of(c.expression for c in d.constraints),
            all_of(c.expression for c in d.velocity_constraints),
        )


def _canonical_body(b: Any, all_of: Any, one: Any) -> tuple:
    steps = tuple((axis, one(angle)) for axis, angle in b.rotation)
    shape = (b.shape.kind, b.shape.parts, all_of(b.shape.sizes)) if b.shape else None
    return (all_of(b.com), one(b.mass), all_of(b.inertia), one(b.angle), steps, shape)


def _joint(j: Any, bodies: Mapping[str, int]) -> tuple:
    return (j.type, bodies[j.parent], bodies[j.child], j.axis, j.axis2, j.sequence)


class _Numbering:
    """Numbers of expressions, the same for two that differ in names and in the order of terms and factors only."""

    def __init__(
        self,
        numbers: dict[tuple, int],
        literals: dict[int, tuple[algebra.Expr, int]],
        names: Mapping[str, str],
    ) -> None:
        self._numbers, self._literals, self._names = numbers, literals, names
        self._memo: dict[int, int] = {}  # by identity, as the walk goes by it

    def of(self, expression: algebra.Expr) -> int:
        """The number of an expression."""
        memo = self._memo
        if id(expression) not in memo:
            for node in postorder([expression], known=memo):
                memo[id(node)] = self._number(node)
        return memo[id(expression)]

    def _number(self, node: algebra.Expr) -> int:
        if isinstance(node, algebra.Symbol):
            return self._numbered(("name", self._names[node.name]))
        if not node.args:
            known = self._literals.get(id(node))
            if known is None:
                number = self._numbered((type(node).__name__, repr(node)))
                known = self._literals[id(node)] = node, number
            return known[1]
        parts = [self._memo[id(x)] for x in node.args]
        if isinstance(node, (algebra.Add, algebra.Mul)):
            parts.sort()
        return self._numbered((type(node).__name__, *parts))

    def _numbered(self, key: tuple) -> int:
        return self._numbers.setdefault(key, len(self._numbers))


@dataclass(frozen=True)
class Component:
    """One subsystem: its description, with all names as in the whole model, and where its elements stand there."""

    description: Description
    places: Places
    signature: tuple


@dataclass(frozen=True)
class _Element:
    """A part of a description that belongs to one subsystem: which table, which entry, and what it mentions."""

    table: str
    index: int
    item: Any
    owners: tuple[str, ...]  # coordinates and bodies, beyond those in its expressions
    expressions: tuple[algebra.Expr, ...]


def split(d: Description) -> list[list[Component]]:
    """The subsystems of a description, equal ones together, in the order of their first coordinates.

    Two are equal when they differ in names only (of coordinates, parameters, bodies, …) and in start values.
    """
    return _kinds(d, Canonical({c.name: c.value for c in d.constants}))


def with_free_places(d: Description) -> Description:
    """The same, with parameters for the numbers by which places alone tell equal subsystems apart."""
    if not any(c.of_place for c in d.constants):
        return d
    free: set[str] = set()
    for kind in _kinds(d, Canonical({c.name: c.value for c in d.constants if not c.of_place})):
        for same in zip(*([c for c in x.description.constants if c.of_place] for x in kind), strict=True):
            if len({c.value for c in same}) > 1:
                free |= {c.name for c in same}
    return replace(
        d,
        parameters=(*d.parameters, *(_as_parameter(c) for c in d.constants if c.name in free)),
        constants=tuple(c for c in d.constants if c.name not in free),
    )


def _as_parameter(c: Constant) -> Parameter:
    return Parameter(c.name, c.value, c.unit, "where the use stands")


def _kinds(d: Description, canonical: Canonical) -> list[list[Component]]:
    """The subsystems, those of one signature together."""
    names = _Names(d)
    elements = [*_elements(d)]
    joined = _Union([c.name for c in d.coordinates] + [_body(b.name) for b in d.bodies])
    mentioned = [[*e.owners, *names.owners(e.expressions)] for e in elements]
    for owners in (*mentioned, *_resets(d, names)):
        joined.join(owners)
    roots = list(dict.fromkeys(joined.root(c.name) for c in d.coordinates))
    if len(roots) == 1:
        return [[Component(d, {}, ())]]
    belonging: dict[str, list[_Element]] = {root: [] for root in roots}
    for element, owners in zip(elements, mentioned, strict=True):
        # What mentions no coordinate goes with the first subsystem.
        root = joined.root(owners[0]) if owners else roots[0]
        belonging[root if root in belonging else roots[0]].append(element)
    parts = [_Part(d, names, belonging[root]) for root in roots]
    by_root = dict(zip(roots, parts, strict=True))
    for k, c in enumerate(d.coordinates):
        by_root[joined.root(c.name)].coordinates.append(k)
    for k, r in enumerate(d.rates):
        by_root[joined.root(names.rates[r.name][0])].rates.append(k)
    uses = Counter(name for part in parts for name in part.used)
    classes: dict[tuple, list[Component]] = defaultdict(list)
    for part in parts:
        component = part.component(uses, canonical)
        classes[component.signature].append(component)
    return list(classes.values())


def _body(name: str) -> str:
    """A body's key beside those of coordinates, whose names have no blanks."""
    return f"body {name}"


def _elements(d: Description) -> Iterator[_Element]:
    """All elements of a description that act."""
    for k, b in enumerate(d.bodies):
        steps = [angle for _, angle in b.rotation]
        sizes = b.shape.sizes if b.shape else ()
        single = [x for x in (b.mass, b.angle) if x is not None]
        yield _Element("bodies", k, b, (_body(b.name),), (*b.com, *single, *b.inertia, *steps, *sizes))
    for k, j in enumerate(d.joints):
        bodies = (_body(name) for name in (j.child, j.parent) if name != WORLD)
        yield _Element("joints", k, j, (*j.coordinates, *bodies), (*j.xyz, *j.rpy))
    for table in ENERGIES:
        energy = getattr(d, table)
        for k, term in enumerate(algebra.Add.make_args(energy) if energy is not None else ()):
            yield _Element(table, k, term, (), (term,))
    rates = {r.name: r for r in d.rates}
    for k, (name, force) in enumerate(d.forces):
        yield _Element("forces", k, (name, force), _owners_of_rate(d, rates[name]), (force,))
    for k, load in enumerate(d.loads):
        owners = (_body(load.body),) if load.body else ()
        yield _Element("loads", k, load, owners, (*load.point, *load.force, *load.torque))
    for table in ("constraints", "velocity_constraints"):
        for k, c in enumerate(getattr(d, table)):
            yield _Element(table, k, c, (), (c.expression,))


def _owners_of_rate(d: Description, rate: Any) -> tuple[str, ...]:
    if rate.coordinate is not None:
        return (rate.coordinate,)
    return next(j.coordinates for j in d.joints if rate.name in j.rates)


def _resets(d: Description, names: _Names) -> Iterator[list[str]]:
    """Coordinates that resets tie together."""
    for event in d.events:
        if event.resets:
            targets = [
                names.rates.get(r.target, (r.target,)) if r.is_rate else (r.target,) for r in event.resets
            ]
            values = names.owners([event.when, *(r.value for r in event.resets)])
            yield [*(owner for group in targets for owner in group), *values]


class _Names:
    """What the names in expressions stand for."""

    def __init__(self, d: Description) -> None:
        self.owner: dict[str, tuple[str, ...]] = {c.name: (c.name,) for c in d.coordinates}
        self.rates = {r.name: _owners_of_rate(d, r) for r in d.rates}
        self.owner |= self.rates
        self.support: dict[str, str] = {}  # component names of points and axes: the point's or axis' own name
        for item in (*d.points, *d.axes):
            for letter in "xyz":
                name = f"{item.name}_{letter}"
                self.owner[name] = () if item.body == WORLD else (_body(item.body),)
                self.support[name] = item.name
        self.size_bounds = [0, *accumulate(len(b.shape.sizes) if b.shape else 0 for b in d.bodies)]
        self._memo: dict[algebra.Expr, frozenset[str]] = {}
        self.definitions = dict(d.definitions)
        self.index = {
            "parameters": {p.name: k for k, p in enumerate(d.parameters)},
            "inputs": {u.name: k for k, u in enumerate(d.inputs)},
            "definitions": {name: k for k, (name, _) in enumerate(d.definitions)},
            "points": {p.name: k for k, p in enumerate(d.points)},
            "axes": {a.name: k for k, a in enumerate(d.axes)},
        }
        for name, expression in d.definitions:
            self.owner[name] = tuple(self.owners([expression]))
        watching = [expression for _, expression in d.outputs]
        watching += [x for drawing in d.drawings for vector in drawing.vectors for x in vector]
        watching += [x for winding in d.windings for x in winding.angles]
        for event in d.events:
            watching += [event.when, *(r.value for r in event.resets)]
        self.watched: dict[str, list[str]] = defaultdict(list)  # by body: points and axes that are looked at
        looked_at = {self.support[name] for name in self.closure(watching) if name in self.support}
        for item in (*d.points, *d.axes):
            if item.name in looked_at:
                self.watched[item.body].append(item.name)

    def places(self, table: str, names: Iterable[str]) -> list[int]:
        """Where the elements of these names stand in a table; others are left out."""
        index = self.index[table]
        return sorted(index[name] for name in names if name in index)

    def mentioned(self, expression: algebra.Expr) -> frozenset[str]:
        """The names in an expression."""
        found = self._memo.get(expression)
        if found is None:
            found = self._memo[expression] = names_in(expression)
        return found

    def owners(self, expressions: Iterable[algebra.Expr]) -> list[str]:
        """The coordinates and bodies that expressions depend on, through definitions too."""
        found: dict[str, None] = {}
        for expression in expressions:
            for name in sorted(self.mentioned(expression)):
                found |= dict.fromkeys(self.owner.get(name, ()))
        return list(found)

    def closure(self, expressions: Iterable[algebra.Expr]) -> set[str]:
        """All names that expressions need, through definitions too."""
        found: set[str] = set()
        waiting = list(expressions)
        while waiting:
            for name in self.mentioned(waiting.pop()) - found:
                found.add(name)
                if name in self.definitions:
                    waiting.append(self.definitions[name])
        return found


class _Union:
    """Sets of names that are joined step by step."""

    def __init__(self, names: Iterable[str]) -> None:
        self._parent = {name: name for name in names}

    def root(self, name: str) -> str:
        parent = self._parent
        while parent[name] != name:
            parent[name] = parent[parent[name]]
            name = parent[name]
        return name

    def join(self, names: Iterable[str]) -> None:
        roots = [self.root(name) for name in names]
        for root in roots[1:]:
            self._parent[self.root(root)] = self.root(roots[0])


class _Part:
    """One subsystem while it is cut out of the whole."""

    def __init__(self, d: Description, names: _Names, elements: list[_Element]) -> None:
        self.d, self.names = d, names
        self.coordinates: list[int] = []
        self.rates: list[int] = []
        self.tables: dict[str, list[_Element]] = defaultdict(list)
        for element in elements:
            self.tables[element.table].append(element)
        self.used = names.closure(x for e in elements for x in e.expressions)
        bodies = {e.item.name for e in self.tables["bodies"]}
        supports = {names.support[name] for name in self.used if name in names.support}
        here = supports.union(*(names.watched.get(name, ()) for name in bodies))
        self.points = [d.points[k] for k in names.places("points", here)]
        self.axes = [d.axes[k] for k in names.places("axes", here)]
        more = [x for p in self.points for x in p.at] + [x for a in self.axes for x in a.direction]
        if bodies and d.gravity is not None:
            more += d.gravity
        self.used |= names.closure(more)

    def component(self, uses: Counter[str], canonical: Canonical) -> Component:
        """The finished subsystem; parameters that several use come first, so that order tells equal ones."""
        d, places = self.d, self.names.places
        parameters = places("parameters", self.used)
        parameters.sort(key=lambda k: uses[d.parameters[k].name] < 2)
        inputs, definitions = places("inputs", self.used), places("definitions", self.used)
        own = replace(
            d,
            coordinates=tuple(d.coordinates[k] for k in self.coordinates),
            rates=tuple(d.rates[k] for k in self.rates),
            parameters=tuple(d.parameters[k] for k in parameters),
            constants=tuple(c for c in d.constants if not c.of_place or c.name in self.used),
            inputs=tuple(d.inputs[k] for k in inputs),
            definitions=tuple(d.definitions[k] for k in definitions),
            points=tuple(self.points),
            axes=tuple(self.axes),
            loops=(),
            drawings=(),
            windings=(),
            gravity=d.gravity if self.tables["bodies"] else None,
            outputs=(),
            events=(),
            **{table: self._items(table) for table in ("bodies", "joints", "forces", "loads")},
            **{table: self._items(table) for table in ("constraints", "velocity_constraints")},
            **{table: algebra.Add(*self._items(table)) if self.tables[table] else None for table in ENERGIES},
        )
        return Component(own, self._places(parameters, inputs), canonical.signature(own))

    def _items(self, table: str) -> tuple:
        return tuple(e.item for e in self.tables[table])

    def _places(self, parameters: list[int], inputs: list[int]) -> Places:
        d = self.d
        holonomic = [e.index for e in self.tables["constraints"]]
        velocity = [len(d.constraints) + e.index for e in self.tables["velocity_constraints"]]
        bodies = [e.index for e in self.tables["bodies"]]
        sizes = [range(*self.names.size_bounds[b : b + 2]) for b in bodies]
        return {
            "q": tuple(self.coordinates),
            "v": tuple(self.rates),
            "h": tuple(holonomic),
            "c": (*holonomic, *velocity),
            "p": tuple(12 * b + k for b in bodies for k in range(12)),
            "s": tuple(k for entries in sizes for k in entries),
            "parameters": tuple(parameters),
            "inputs": tuple(inputs),
        }
