"""The checks of a finished description: names, what may depend on what, and that the parts fit together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy

from ..errors import nearest
from . import check_units, check_values
from .check_contacts import check_contacts
from .check_elements import check_elements
from .check_loops import LoopChecker
from .check_mentions import check_mentions
from .check_tree import check_tree
from .description import Description
from .expand import expand
from .items import COORDINATES, INPUTS, PLACES, RATES, TIME_ITSELF, Item, body_items, definition_items, items
from .linearity import check_velocity_constraints
from .printing import shortened
from .sources import Sources
from .tree import Uses, uses
from .tree_order import moved_by

KIND_OF_DEPENDENCE = {
    "coordinate": COORDINATES,
    "input": INPUTS,
    "rate": RATES,
    "point component": PLACES,
    "axis component": PLACES,
}


@dataclass(frozen=True)
class Dependence:
    """What an expression depends on, through definitions too; `via` names one cause of each kind."""

    coordinates: frozenset[str]
    via: Mapping[str, str]


def finished(d: Description, sources: Sources, kinds: Mapping[str, str]) -> Description:
    """Check what the user said, and write out what is said in short.

    Parameters
    ----------
    d : Description
    sources : Sources
        Where its expressions came from.
    kinds : mapping of str to str
        What each declared name is.

    Raises
    ------
    ModelError
        For the first thing that is wrong.
    """
    check_tree(d, sources)
    check_elements(d, sources)
    loops = LoopChecker(d, sources)
    for loop in d.loops:
        loops.check(loop)
    checker = _Checker(d, sources, kinds)
    checker.define()
    if d.points or d.axes or d.loops:
        checker.place()
        checker.define()
    for item in items(d):
        checker.check_role(item, checker.dependence(item))
    check_velocity_constraints(d, sources)
    check_contacts(d, sources)
    check_values.check_values(d, sources)
    full = expand(d, sources, kinds)
    checker.add_axes(full)
    found = [(item, checker.dependence(item).coordinates) for item in items(full)]
    check_mentions(full, sources, found, checker.moved)
    check_units.check_units(d, sources)
    return full


class _Checker:
    """What expressions depend on, through definitions, points and axes."""

    def __init__(self, d: Description, sources: Sources, kinds: Mapping[str, str]) -> None:
        self.description = d
        self.sources = sources
        self.kinds = dict(kinds)
        self.defined: dict[str, Dependence] = {}
        self.moved: dict[str, frozenset[str]] = {}  # name of a point's or axis' body: coordinates
        self.coordinates = _coordinates_of(d)  # of each name that stands for coordinates or their rates
        # Of expressions, by identity; they are kept, lest it be reused.
        self._known: dict[int, tuple[sympy.Expr, Dependence]] = {}

    def define(self) -> None:
        """Find what the definitions depend on."""
        self.defined.clear()
        self._known.clear()
        for item in definition_items(self.description):
            self.defined[item.key] = self.dependence(item)

    def place(self) -> None:
        """Find the coordinates that move points and axes."""
        d, placed = self.description, {}
        children = {j.child for j in d.joints}
        for body in d.bodies:
            if body.name not in children:
                found = []
                for item in body_items(body, False):
                    found.append(self.dependence(item))
                    self.check_role(item, found[-1])
                placed[body.name] = frozenset().union(*(x.coordinates for x in found))
        self.moved = moved_by(d, placed)
        self.add_axes(d)

    def add_axes(self, d: Description) -> None:
        """Take the components of a description's points and axes for names."""
        if d.points or d.axes:
            self._known.clear()
        for kind, elements in (("point component", d.points), ("axis component", d.axes)):
            for x in elements:
                for c in "xyz":
                    self.kinds[f"{x.name}_{c}"] = kind
                    self.coordinates[f"{x.name}_{c}"] = self.moved[x.body]

    def dependence(self, item: Item) -> Dependence:
        """What an expression depends on; its names must be declared, its derivatives first ones."""
        expression = item.expression
        if id(expression) not in self._known:
            self._known[id(expression)] = expression, self._dependence(item)
        return self._known[id(expression)][1]

    def _dependence(self, item: Item) -> Dependence:
        found = uses(item.expression)
        if found.foreign is not None:
            kind = type(found.foreign).__name__
            message = f"'{shortened(found.foreign)}' (SymPy's {kind}) has no place in a model"
            raise self.sources.error(item.table, item.key, message, hint=_foreign_hint(kind))
        for name in sorted(found.names):
            self._check_name(item, name)
        self._check_dots(item, found)
        return self._combined(found)

    def _check_name(self, item: Item, name: str) -> None:
        kind = self.kinds.get(name)
        if name == "t" or name in self.defined or kind not in (None, "definition", "output"):
            return
        if name == item.key and item.table == "definitions":
            message, hint = f"'{name}' refers to itself", None
        elif kind == "definition":
            message, hint = (
                f"'{name}' is defined further down",
                "a definition may use those above it: move it up",
            )
        elif kind == "output":
            message, hint = f"'{name}' is an output, which expressions cannot use", "make it a definition"
        else:
            usable = [n for n, k in self.kinds.items() if k != "output"]
            message, hint = (
                f"the name '{name}' is not declared",
                nearest(name, [*usable, "t"], "declared names"),
            )
        raise self.sources.name_error(item.table, item.key, name, message, hint)

    def _check_dots(self, item: Item, found: Uses) -> None:
        culprit = "dot" if found.nested else None
        for name in sorted(found.dotted):
            via = self.defined[name].via if name in self.defined else {}
            if RATES in via or self.kinds.get(name) == "rate":
                culprit = name
            if self.kinds.get(name) == "input" or INPUTS in via:
                raise self.sources.name_error(
                    item.table,
                    item.key,
                    "dot",
                    f"dot(…) of the input '{name}': how fast inputs change is not known",
                )
        if culprit is not None:
            reason = "is a rate" if self.kinds.get(culprit) == "rate" else "contains a dot already"
            through = "" if culprit == "dot" else f" ('{culprit}' {reason})"
            raise self.sources.name_error(
                item.table,
                item.key,
                "dot",
                f"a dot(…) inside a dot(…){through}: accelerations cannot stand in a model",
            )

    def _combined(self, found: Uses) -> Dependence:
        via: dict[str, str] = {RATES: "dot"} if found.has_dot else {}
        coordinates: set[str] = set()
        for name in sorted(found.names):
            coordinates |= self.coordinates.get(name, frozenset())
            kind = TIME_ITSELF if name == "t" else KIND_OF_DEPENDENCE.get(self.kinds.get(name))
            if kind is not None:
                via.setdefault(kind, name)
            if kind == PLACES and self.coordinates.get(name):
                via.setdefault(COORDINATES, name)
            if name in self.defined:
                coordinates |= self.defined[name].coordinates
                for inherited in self.defined[name].via:
                    via.setdefault(inherited, name)
        return Dependence(frozenset(coordinates), via)

    def check_role(self, item: Item, dependence: Dependence) -> None:
        for kind in item.role.forbidden:
            if kind in dependence.via:
                name = dependence.via[kind]
                through = (
                    f" through '{name}'" if name in self.defined else "" if name == "dot" else f", '{name}'"
                )
                message = f"{item.role.title} cannot depend on {kind}{through}"
                raise self.sources.name_error(item.table, item.key, name, message, item.role.hint)


def _coordinates_of(d: Description) -> dict[str, frozenset[str]]:
    quaternions: dict[str, frozenset[str]] = {}
    for j in d.joints:
        quaternions[j.name] = frozenset(c.name for c in d.coordinates if c.quaternion == j.name)
    found = {c.name: quaternions.get(c.quaternion, frozenset({c.name})) for c in d.coordinates}
    for j in d.joints:
        if quaternions[j.name]:
            found |= dict.fromkeys(j.rates, quaternions[j.name])
    return found | {r.name: frozenset({r.coordinate}) for r in d.rates if r.coordinate is not None}


def _foreign_hint(name: str) -> str | None:
    if name in ("Min", "Max"):
        return f"use symgen.{name.lower()}imum"
    if name == "Derivative":
        return "use symgen.dot"
    if name == "ImaginaryUnit":
        return "all values are real"
    return "an applied function of time is written as a coordinate's symbol" if name.islower() else None
