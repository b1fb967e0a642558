"""The checks of a finished description: names, what may depend on what, and that the parts fit together.

Checks that the coordinates and bodies which forces, loads and events name are there.

The check that every coordinate moves something, or is held by something.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from symgen.model import dimensions

from ..errors import nearest
from . import algebra, check_values
from .check_tree import LoopChecker, check_tree
from .check_values import check_contacts, check_velocity_constraints
from .closures import check_closures
from .contact_pairs import check_pairs
from .curves import one_way_fault
from .description import Body, Coordinate, Description, Joint, Rate, Spring
from .elements import check_force_elements
from .evaluate import NotFinite, evaluate
from .expand import expand
from .expression_tree import Uses, names_in, uses
from .gravity import HERE, check_attractors
from .items import (
    COORDINATES,
    FORCE_ROLE,
    HEIGHT,
    INPUTS,
    KINKS,
    LEVEL,
    PLACES,
    RATES,
    SENSED,
    SOLVED_TABLES,
    STATES,
    TABLES,
    TIME_ITSELF,
    Item,
    body_items,
    definition_items,
    items,
    spring_items,
)
from .joint_tree import coordinates_in, motion_of, moved_by
from .joint_types import TYPES
from .printing import shortened
from .requirements import is_massless
from .rolling import check_rolling
from .rotors import check_rotors
from .sensors import with_sensors
from .sources import Sources
from .starts import check_start


def check_elements(d: Description, sources: Sources) -> None:
    """Whether names of coordinates and bodies in forces, loads and events exist."""
    if not d.coordinates:
        raise sources.error(
            "",
            "coordinates",
            "the model has no coordinates",
            hint="declare them in [coordinates], or let joints make them",
        )
    only_states = all(c.integral for c in d.coordinates)
    _check_forces(d, sources)
    _check_resets(d, sources)
    _check_torques(d, sources)
    moving = [b for b in d.bodies if b.mass is not None or b.inertia]
    held = d.constraints or d.velocity_constraints or d.loops or d.closures or d.rolling
    if not moving and not d.rotors and d.kinetic is None and not only_states and not held:
        raise sources.error(
            "",
            "bodies",
            "nothing has kinetic energy, and no constraint holds anything",
            hint="give bodies, or [energy] kinetic",
        )


def _check_forces(d: Description, sources: Sources) -> None:
    own_name = {r.coordinate: r.name for r in d.rates if r.coordinate is not None}
    states = {s.name for s in d.states}
    taken: dict[str, str] = {}
    for name, _ in d.forces:
        if name in states:
            message = f"'{name}' is a state, which no force acts on"
            raise sources.error("forces", name, message, hint="add the term to its derivative in [states]")
        _check_moved(name, d, sources, "forces", name, "for a force to act on", with_rates=True)
        rate = own_name.get(name, name)
        if rate in taken:
            message = f"'{name}' and '{taken[rate]}' are one degree of freedom, and both have a force"
            raise sources.error("forces", name, message, hint="add them up")
        taken[rate] = name


def _check_resets(d: Description, sources: Sources) -> None:
    for event in d.events:
        table = f"events.{event.name}"
        for reset in event.resets:
            shown = f"dot({reset.target:.60})" if reset.is_rate else f"{reset.target:.60}"
            place = f"then.reset.{shown}"
            _check_moved(reset.target, d, sources, table, place, "to reset", with_rates=not reset.is_rate)


def _check_moved(
    name: str, d: Description, sources: Sources, table: str, key: str, purpose: str, with_rates: bool
) -> None:
    """Whether a name is that of a coordinate with a rate, or, `with_rates`, that of a rate."""
    coordinates = {c.name: c for c in d.coordinates if not c.integral}
    rates = {r.name for r in d.rates} if with_rates else set()
    if name in rates or (name in coordinates and coordinates[name].quaternion is None):
        return
    if name in coordinates:
        joint = coordinates[name].quaternion
        message = f"'{name}' is an element of the quaternion of the joint '{joint}'"
        raise sources.error(table, key, message, hint=f"use its angular velocity, such as '{joint}_wx'")
    known = [c for c in coordinates if coordinates[c].quaternion is None]
    known += sorted(rates - coordinates.keys()) if with_rates else []
    message = f"there is no coordinate '{name:.60}' {purpose}"
    raise sources.error(table, key, message, hint=nearest(name[:60], known, "coordinates"))


def _check_torques(d: Description, sources: Sources) -> None:
    bodies = {b.name: b for b in d.bodies}
    children = {j.child for j in d.joints}
    for load in d.loads:
        if not load.torque:
            continue
        table = f"loads.{load.name}"
        body = bodies.get(load.body)
        if body is None:
            message = f"there is no body '{load.body}' for a torque to act on"
            raise sources.error(table, "body", message, hint=nearest(load.body, bodies, "bodies"))
        if body.angle is None and not body.rotation and body.name not in children:
            what = "angle" if body.planar else "rotation"
            raise sources.error(
                table, "body", f"the body '{body.name}' does not turn", hint=f"give it '{what}'"
            )
        if len(load.torque) == 1 and not body.planar:
            message = f"a torque on the 3-D body '{body.name}' has three components"
            raise sources.error(table, "torque", message)


Found = list[tuple[Item, frozenset[str]]]


def check_mentions(
    d: Description, sources: Sources, found: Found, placed: Mapping[str, frozenset[str]]
) -> tuple[str, ...]:
    """Every coordinate must move something, or be held by something; returns those that forces alone hold in balance.

    Parameters
    ----------
    d : Description
        With all that it says in short written out.
    sources : Sources
    found : list of (Item, frozenset of str)
        Its expressions with the coordinates that each depends on.
    placed : mapping of str to frozenset of str
        The coordinates that bodies which no joint places depend on; needed where points or axes are in use.
    """
    massless = {b.name for b in d.bodies if is_massless(b)}
    drawn_only = {f"bodies.{name}" for name in massless}
    held, pulled = _moved_by_joints(d, massless), set()
    forced = {name for name, _ in d.forces}
    pulled |= {r.coordinate for r in d.rates if r.name in forced}
    for j in d.joints:
        if TYPES[j.type].quaternion and forced.intersection(j.rates[-3:]):
            pulled |= set(j.coordinates[-4:])
    for item, coordinates in found:
        moves = (
            item.table.startswith("bodies.")
            and item.table not in drawn_only
            and not item.key.startswith("shape")
        )
        place = item.table, item.key
        if moves or item.table in ("constraints", "velocity_constraints") or place == ("energy", "kinetic"):
            held |= coordinates
        elif item.table.startswith("loads.") or item.table in ("forces", "energy"):
            pulled |= coordinates
    held = coordinates_in(held, d, placed)
    mentioned = held | coordinates_in(pulled, d, placed)
    joints = {name: j for j in d.joints for name in j.coordinates}
    for c in d.coordinates:
        if c.name in mentioned:
            continue
        if c.name in joints:
            _refuse_idle_joint(joints[c.name], c.name, sources)
        message = f"no kinetic energy, force or constraint mentions the coordinate '{c.name}'"
        raise sources.error("coordinates", c.name, message, hint="use it, or leave it out")
    of_states = {r.coordinate for r in d.rates if r.state}
    return tuple(
        c.name for c in d.coordinates
        if c.name not in held and c.name not in of_states and c.quaternion is None
    )  # fmt: skip


def _refuse_idle_joint(joint: Joint, coordinate: str, sources: Sources) -> None:
    message = (
        f"the coordinate '{coordinate}' of this joint moves nothing that has mass, and no constraint holds it"
    )
    hint = f"give '{joint.child}' an inertia or a centre of mass off the axis, or give the joint an armature"
    raise sources.error(f"joints.{joint.name}", "child", message, hint=hint)


def _moved_by_joints(d: Description, massless: Collection[str]) -> set[str]:
    """The motions of joints' children that have mass."""
    parents = {j.parent for j in d.joints}
    bodies = {b.name: b for b in d.bodies}
    found: set[str] = set()
    for joint in d.joints:
        child = joint.child
        if child in massless:
            continue
        if child not in parents and _is_point(bodies[child]):
            found |= {motion_of(joint.parent), *_translations(joint)}
        else:
            found.add(motion_of(child))
    return found


def _is_point(body: Body) -> bool:
    """Whether a body is a point mass in the origin of its frame, which does not feel the joint turn."""
    return not body.inertia and all(x.is_zero for x in body.com)


def _translations(joint: Joint) -> Iterator[str]:
    """The coordinates that do not turn the child."""
    return (name for name, unit in zip(joint.coordinates, TYPES[joint.type].units) if unit == "m")


KIND_OF_DEPENDENCE = {
    "coordinate": COORDINATES,
    "input": INPUTS,
    "rate": RATES,
    "state": STATES,
    "point component": PLACES,
    "axis component": PLACES,
    "sensor": SENSED,
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
    d = _with_starts(with_definitions_in_order(d, sources))
    check_tree(d, sources)
    check_elements(d, sources)
    check_force_elements(d, sources)
    check_attractors(d, sources)
    check_rolling(d, sources)
    check_pairs(d, sources)
    check_closures(d, sources)
    check_rotors(d, sources)
    check_start(d, sources)
    sensing, kinds = with_sensors(d, sources, kinds)
    d = d if sensing is d else with_definitions_in_order(sensing, sources)
    loops = LoopChecker(d, sources)
    for loop in d.loops:
        loops.check(loop)
    checker = _Checker(d, sources, kinds)
    checker.check_springs()
    checker.define()
    if d.points or d.axes or d.loops or _need_places(d):
        checker.place()
        checker.define()
    for item in items(d):
        checker.check_role(item, checker.dependence(item))
    check_velocity_constraints(d, sources)
    check_contacts(d, sources)
    limits = check_values.check_values(d, sources)
    full = expand(d, sources, kinds)
    checker.add_axes(full)
    found = [(item, checker.written_out(item).coordinates) for item in items(full)]
    balanced = check_mentions(full, sources, found, checker.moved)
    full = replace(full, balanced=balanced, limits=limits())
    return dimensions.with_units_of_results(full, dimensions.check_units(d, sources))


def with_definitions_in_order(d: Description, sources: Sources) -> Description:
    """The description with each definition behind those that it uses, otherwise as they were given.

    Raises
    ------
    ModelError
        For definitions that refer to each other in a circle.
    """
    expressions = dict(d.definitions)
    used = {name: names_in(x) & expressions.keys() for name, x in d.definitions}
    ordered: dict[str, algebra.Expr] = {}
    for first in expressions:
        chain: dict[str, Iterator[str]] = {} if first in ordered else {first: iter(sorted(used[first]))}
        while chain:
            name, waiting = next(reversed(chain.items()))
            other = next(waiting, None)
            if other is None:
                ordered[name] = expressions[name]
                del chain[name]
            elif other in chain:
                names = list(chain)
                through = ", ".join(f"'{x}'" for x in names[names.index(other) + 1 :])
                message = f"'{other}' refers to itself" + (f", through {through}" if through else "")
                hint = (
                    "write it without its own name" if not through else "write one of them without the others"
                )
                place = names[names.index(other) + 1] if through else other
                raise sources.name_error("definitions", other, place, message, hint)
            elif other not in ordered:
                chain[other] = iter(sorted(used[other]))
    return d if list(ordered) == list(expressions) else replace(d, definitions=tuple(ordered.items()))


def _with_starts(d: Description) -> Description:
    """The description with the values of starts that are formulas; those that have none are refused later."""
    if not any(x.formula for x in (*d.coordinates, *d.rates)):
        return d
    values: dict[str, float | None] = {p.name: p.value for p in (*d.parameters, *d.constants)}
    for name, expression in d.definitions:
        values[name] = _value_of(expression, values)

    def valued(x: Coordinate | Rate) -> Coordinate | Rate:
        if x.formula is None:
            return x
        value = _value_of(x.formula.expression, values) or 0.0
        return replace(x, guess=value) if x.start is None else replace(x, start=value)

    rates = {r.name: valued(r) for r in d.rates}
    of = {r.coordinate: r for r in rates.values() if r.coordinate is not None}
    coordinates = [valued(c) for c in d.coordinates]
    coordinates = [
        replace(c, rate=of[c.name].start, rate_guess=of[c.name].guess) if c.rate_formula else c
        for c in coordinates
    ]
    return replace(d, coordinates=tuple(coordinates), rates=tuple(rates.values()))


def _value_of(expression: algebra.Expr, values: Mapping[str, float | None]) -> float | None:
    try:
        return evaluate(expression, values)
    except NotFinite:
        return None


def _need_places(d: Description) -> bool:
    """Whether elements name bodies whose places become names when they are written out."""
    fields = d.field is not None or d.gravitation is not None or d.attractors
    return bool(
        d.bushings
        or d.rolling
        or d.pairs
        or d.closures
        or d.rotors
        or fields
        or any(x.frame or x.reaction for x in d.loads)
    )


class _Checker:
    """What expressions depend on, through definitions, points and axes."""

    def __init__(self, d: Description, sources: Sources, kinds: Mapping[str, str]) -> None:
        self.description = d
        self.sources = sources
        self.kinds = dict(kinds)
        self.tables = {table.name: table for table in d.tables}
        self.defined: dict[str, Dependence] = {}
        self.moved: dict[str, frozenset[str]] = {}  # name of a point's or axis' body: coordinates
        self.coordinates = _coordinates_of(d)  # of each name that stands for coordinates or their rates
        # Of expressions, by identity; they are kept, lest it be reused.
        self._known: dict[int, tuple[algebra.Expr, Dependence]] = {}

    def check_springs(self) -> None:
        """Whether the names that springs use are declared: their definitions have no place in the file."""
        for spring in self.description.springs:
            for item in spring_items(spring):
                for name in sorted(names_in(item.expression)):
                    self._check_name(item, name)
            if spring.curve is not None:
                self._check_curve(spring)

    def _check_curve(self, spring: Spring) -> None:
        """Whether a spring's curve is there; that of one that acts one way must begin at nothing and keep its sign."""
        table, name = f"springs.{spring.name}", spring.curve.table
        found = self.tables.get(name)
        if found is None or len(found.axes) != 1:
            message = f"the model has no table '{name}' of 1 argument"
            curves = [n for n, x in self.tables.items() if len(x.axes) == 1]
            raise self.sources.error(table, "curve", message, hint=nearest(name, curves, "tables"))
        fault = one_way_fault(found, spring.acts) if spring.acts else ""
        if fault:
            raise self.sources.error(table, "curve", f"the curve '{name}' of what acts one way {fault}")

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

    def written_out(self, item: Item) -> Dependence:
        """What an expression of the finished description depends on; nothing is left to check in it."""
        known = self._known.get(id(item.expression))
        return self._combined(uses(item.expression)) if known is None else known[1]

    def _dependence(self, item: Item) -> Dependence:
        found = uses(item.expression)
        if found.foreign is not None:
            kind = found.foreign.kind
            message = f"'{shortened(found.foreign)}' (SymPy's {kind}) has no place in a model"
            raise self.sources.error(item.table, item.key, message, hint=_foreign_hint(kind))
        for name in sorted(found.names):
            self._check_name(item, name)
        for name, count in sorted(found.tables):
            if name not in self.tables or len(self.tables[name].axes) != count:
                message = f"the model has no table '{name}' of {count} argument{'s' * (count > 1)}"
                raise self.sources.name_error(
                    item.table, item.key, name, message, nearest(name, self.tables, "tables")
                )
        self._check_dots(item, found)
        return self._combined(found)

    def _check_name(self, item: Item, name: str) -> None:
        kind = self.kinds.get(name)
        if name in HERE and ((item.table, item.key) == ("gravity", "potential") or item.role is HEIGHT):
            return
        if name == "t" or kind not in (None, "output", "integral", "table"):
            return
        if kind == "output":
            message, hint = f"'{name}' is an output, which expressions cannot use", "make it a definition"
        elif kind == "table":
            message, hint = f"'{name}' is a table", f"write it with its arguments, {name}(…)"
        elif kind == "integral":
            message = f"'{name}' is the integral of a state, which expressions cannot use"
            hint = f'declare a state for it: {{ derivative = "{name.removesuffix("_integral")}" }}'
        elif point := next((x.point for x in self.sources.of(item.table, item.key) if x.point), ""):
            points = {n[:-2] for n, kind in self.kinds.items() if kind == "point component"}
            bodies = {body.name for body in self.description.bodies}
            raise self.sources.point_error(item.table, item.key, point, points, bodies)
        else:
            usable = [n for n, k in self.kinds.items() if k not in ("output", "integral", "table")]
            message, hint = (
                f"the name '{name}' is not declared",
                nearest(name, [*usable, "t"], "declared names"),
            )
        raise self.sources.name_error(item.table, item.key, name, message, hint)

    def _check_dots(self, item: Item, found: Uses) -> None:
        culprit = "dot" if found.nested else None
        for name in sorted(found.dotted):
            via = self.defined[name].via if name in self.defined else {}
            if RATES in via or SENSED in via or self.kinds.get(name) in ("rate", "sensor"):
                culprit = name
            if self.kinds.get(name) == "input" or INPUTS in via:
                raise self.sources.name_error(
                    item.table,
                    item.key,
                    "dot",
                    f"dot(…) of the input '{name}': how fast inputs change is not known",
                )
            if self.kinds.get(name) == "state" or STATES in via:
                raise self.sources.name_error(
                    item.table,
                    item.key,
                    "dot",
                    f"dot(…) of the state '{name}'",
                    "its derivative is an expression: make that a definition, and use it in both places",
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
        for name, _ in sorted(found.tables):
            via.setdefault(TABLES, name)
            table = self.tables[name]
            if table.kind == "linear" or table.outside == "hold":
                via.setdefault(KINKS, name)
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
        if SENSED in dependence.via and item.key.startswith("then.reset"):
            self._check_sensing_reset(item, dependence.via[SENSED])
        elif SENSED in dependence.via and not _may_sense(item):
            name = dependence.via[SENSED]
            message = f"{item.role.title} cannot depend on {SENSED}, {name}: it would determine itself"
            hint = (
                "they may stand in forces, loads, derivatives of states, outputs, events, resets and start equations; "
                "friction takes a reaction as its 'normal'"
            )
            raise self.sources.name_error(item.table, item.key, name, message, hint)
        if item.table == "start":
            self._check_start_equation(item, dependence)
        for kind in item.role.forbidden:
            if kind in dependence.via:
                name = dependence.via[kind]
                through = (
                    f" through '{name}'" if name in self.defined else "" if name == "dot" else f", '{name}'"
                )
                message = f"{item.role.title} cannot depend on {kind}{through}"
                hint = item.role.hint
                if kind == KINKS:
                    hint = "velocities would jump there: take the kind 'cubic', and let it 'extend' or 'refuse' outside"
                raise self.sources.name_error(item.table, item.key, name, message, hint)

    def _check_sensing_reset(self, item: Item, name: str) -> None:
        """Refuse reactions in resets where stops and frictions act, too: a reset does not know what these hold."""
        d = self.description
        if d.stops or d.frictions:
            message = (
                f"a reset cannot depend on {SENSED}, {name}, in a model with stops, contacts or friction"
            )
            hint = (
                'let a state follow it, as in follow = { derivative = "(reaction(…) - follow)/tau" } of [states], and '
                "reset by the state"
            )
            raise self.sources.name_error(item.table, item.key, name, message, hint)

    def _check_start_equation(self, item: Item, dependence: Dependence) -> None:
        """Whether an equation of the start names something that a start may be found for."""
        if dependence.coordinates or not dependence.via.keys().isdisjoint((RATES, STATES, SENSED)):
            return
        found, new = frozenset[str](), names_in(item.expression)
        definitions = dict(self.description.definitions)
        while new:
            found |= new
            new = frozenset().union(*(names_in(definitions[x]) for x in new if x in definitions)) - found
        if found.isdisjoint(self.description.start.find):
            message = "the equation names nothing that may move: no coordinate, rate or sensor, nor what 'find' names"
            raise self.sources.error(
                item.table, item.key, message, hint="leave it out, or name what must fit"
            )


def _may_sense(item: Item) -> bool:
    """Whether an expression is evaluated where the equations of motion are solved."""
    if item.table.startswith("events."):
        return item.key == "when"
    acts = item.table.startswith(("loads.", "bristles.")) and item.role in (FORCE_ROLE, LEVEL)
    return acts or item.table in SOLVED_TABLES


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
    if name == "Derivative":
        return "use symgen.dot"
    if name == "ImaginaryUnit":
        return "all values are real"
    return "an applied function of time is written as a coordinate's symbol" if name.islower() else None
