"""The checks of a finished description: names, what may depend on what, and that the parts fit together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import nearest
from . import check_units, check_values
from .description import Description
from .items import COORDINATES, INPUTS, RATES, TIME_ITSELF, Item, definition_items, items
from .linearity import check_velocity_constraints
from .printing import shortened
from .sources import Sources
from .tree import Uses, uses

KIND_OF_DEPENDENCE = {"coordinate": COORDINATES, "input": INPUTS}


@dataclass(frozen=True)
class Dependence:
    """What an expression depends on, through definitions too; `via` names one cause of each kind."""

    coordinates: frozenset[str]
    via: Mapping[str, str]


def check(d: Description, sources: Sources, kinds: Mapping[str, str]) -> None:
    """Check a description; raises `ModelError` for the first thing that is wrong.

    Parameters
    ----------
    d : Description
    sources : Sources
        Where its expressions came from.
    kinds : mapping of str to str
        What each declared name is.
    """
    _check_elements(d, sources)
    checker = _Checker(sources, kinds)
    for item in definition_items(d):
        checker.defined[item.key] = checker.dependence(item)
    found = [(item, checker.dependence(item)) for item in items(d)]
    for item, dependence in found:
        checker.check_role(item, dependence)
    check_velocity_constraints(d, sources)
    check_values.check_values(d, sources)
    _check_mentions(d, sources, found)
    check_units.check_units(d, sources)


class _Checker:
    def __init__(self, sources: Sources, kinds: Mapping[str, str]) -> None:
        self.sources = sources
        self.kinds = kinds
        self.defined: dict[str, Dependence] = {}

    def dependence(self, item: Item) -> Dependence:
        """What an expression depends on; its names must be declared, its derivatives first ones."""
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
        if name == "t" or kind in ("parameter", "constant", "coordinate", "input") or name in self.defined:
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
            if RATES in via:
                culprit = name
            if self.kinds.get(name) == "input" or INPUTS in via:
                raise self.sources.name_error(
                    item.table,
                    item.key,
                    "dot",
                    f"dot(…) of the input '{name}': how fast inputs change is not known",
                )
        if culprit is not None:
            through = "" if culprit == "dot" else f" ('{culprit}' contains a dot already)"
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
            if self.kinds.get(name) == "coordinate":
                coordinates.add(name)
            kind = TIME_ITSELF if name == "t" else KIND_OF_DEPENDENCE.get(self.kinds.get(name))
            if kind is not None:
                via.setdefault(kind, name)
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


def _foreign_hint(name: str) -> str | None:
    if name in ("Min", "Max"):
        return f"use symgen.{name.lower()}imum"
    if name == "Derivative":
        return "use symgen.dot"
    if name == "ImaginaryUnit":
        return "all values are real"
    return "an applied function of time is written as a coordinate's symbol" if name.islower() else None


def _check_elements(d: Description, sources: Sources) -> None:
    """Whether names of coordinates and bodies in forces, loads and events exist."""
    coordinates = [c.name for c in d.coordinates]
    if not coordinates:
        raise sources.error("", "coordinates", "the model has no coordinates")
    for name, _ in d.forces:
        if name not in coordinates:
            message = f"there is no coordinate '{name}' for a force to act on"
            raise sources.error("forces", name, message, hint=nearest(name, coordinates, "coordinates"))
    for event in d.events:
        for reset in event.resets:
            if reset.target not in coordinates:
                shown = f"dot({reset.target:.60})" if reset.is_rate else f"{reset.target:.60}"
                message = f"there is no coordinate '{reset.target:.60}' to reset"
                hint = nearest(reset.target[:60], coordinates, "coordinates")
                raise sources.error(f"events.{event.name}", f"then.reset.{shown}", message, hint=hint)
    _check_torques(d, sources)
    moving = [b for b in d.bodies if b.mass is not None or b.inertia]
    if not moving and d.kinetic is None:
        raise sources.error(
            "", "bodies", "nothing has kinetic energy", hint="give bodies, or [energy] kinetic"
        )


def _check_torques(d: Description, sources: Sources) -> None:
    bodies = {b.name: b for b in d.bodies}
    for load in d.loads:
        if not load.torque:
            continue
        table = f"loads.{load.name}"
        body = bodies.get(load.body)
        if body is None:
            message = f"there is no body '{load.body}' for a torque to act on"
            raise sources.error(table, "body", message, hint=nearest(load.body, bodies, "bodies"))
        if body.angle is None and not body.rotation:
            what = "angle" if body.planar else "rotation"
            raise sources.error(
                table, "body", f"the body '{body.name}' does not turn", hint=f"give it '{what}'"
            )
        if len(load.torque) == 1 and not body.planar:
            message = f"a torque on the 3-D body '{body.name}' has three components"
            raise sources.error(table, "torque", message)


def _check_mentions(d: Description, sources: Sources, found: list[tuple[Item, Dependence]]) -> None:
    """Every coordinate must move something, or be held by something."""
    drawn_only = {f"bodies.{b.name}" for b in d.bodies if check_values.is_massless(b)}
    mentioned = {name for name, _ in d.forces}
    for item, dependence in found:
        moves = (
            item.table.startswith("bodies.")
            and item.table not in drawn_only
            and not item.key.startswith("shape")
        )
        acts = item.table.startswith("loads.") or item.table in (
            "forces",
            "constraints",
            "velocity_constraints",
        )
        if moves or acts or (item.table, item.key) == ("energy", "kinetic"):
            mentioned |= dependence.coordinates
    for c in d.coordinates:
        if c.name not in mentioned:
            message = f"no kinetic energy, force or constraint mentions the coordinate '{c.name}'"
            raise sources.error("coordinates", c.name, message, hint="use it, or leave it out")
