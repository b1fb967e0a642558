"""Joints that close loops, between frames of two bodies that are placed already: as many equations as the joint takes.

What a joint of a type holds is written with the axes of its two frames: the places are one, or one is on a line or in a
plane of the other; two axes are parallel, at right angles, or turn with each other. Every set is independent wherever
the bodies' own motions are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import nearest
from . import algebra
from .closure_types import CLOSURES, ClosureType
from .declared import Declared
from .description import Closure, Constraint, Coordinate, Description, Drawing, Friction
from .elements import Vector, Writer, scalar_product
from .evaluate import Direction, dot_product, perpendiculars
from .functions import dot
from .joints import PARALLEL, direction
from .names import name_fault, reference_fault
from .ready_made import HALF, WORLD
from .sources import Sources
from .unevaluated import difference, inverted, product, squared, total

CLOSURE_KEYS = (
    "type", "frames", "axis", "axis2", "pitch", "coordinate", "guess", "stiffness", "rest", "damping", "friction",
)  # fmt: skip
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def make_closure(model: Declared, name: str, given: Mapping[str, Any]) -> Closure:
    """A closure from the arguments of `Model.closure`; declares its coordinate where it has one."""
    table, sources = f"closures.{name}", model._sources
    given = {key: value for key, value in given.items() if value is not None}

    def error(key: str, message: str, hint: str | None = None):
        return sources.error(table, key, message, hint=hint)

    kind = CLOSURES.get(given.get("type")) if isinstance(given.get("type"), str) else None
    if kind is None:
        what = repr(given["type"])[:60] if "type" in given else None
        message = (
            "the type of the joint is missing" if what is None else f"{what} is no joint that closes a loop"
        )
        raise error("type", message, nearest(str(given.get("type"))[:60], CLOSURES, "types"))
    if "frames" not in given:
        raise error("frames", "the key 'frames' is missing", 'name two frames, bodies or "world"')
    frames = tuple(model._vector(given["frames"], table, "frames", (2,)))
    for k, x in enumerate(frames):
        fault = reference_fault(x)
        if fault is not None:
            raise error(f"frames[{k}]", fault, 'name a frame, a body or "world"')
    _check_keys(given, kind, error)
    axis = direction(model, table, "axis", given["axis"]) if "axis" in given else ()
    axis2 = direction(model, table, "axis2", given["axis2"]) if "axis2" in given else ()
    if axis2 and 1 - dot_product(axis or X, axis2) ** 2 < PARALLEL**2:
        raise error("axis2", "the two axes of a universal joint are parallel", "give two that differ")
    coordinate = given.get("coordinate")
    if coordinate is None and (kind.moves == "screw" or "stiffness" in given):
        coordinate = name
    if coordinate is not None:
        unit = "m" if kind.moves == "slide" else "rad"
        size = sources.unit(unit, table, "coordinate")
        fault = name_fault(coordinate)
        if fault is not None:
            raise error("coordinate", fault, "choose another name")
        values, _ = model._initial(table, "{}", size, {"guess": given.get("guess")})
        model._declare_made(coordinate, "coordinate", table, "closure")
        model._made.append(Coordinate(coordinate, unit, **values, joint=name))
    expressions = {
        key: sources.expression(given[key], table, key)
        for key in ("pitch", "stiffness", "rest", "damping", "friction")
        if key in given
    }
    return Closure(name, given["type"], frames, axis, axis2, coordinate, **expressions)


def _check_keys(given: Mapping[str, Any], kind: ClosureType, error: Callable) -> None:
    """Whether all that is given means something for this type."""
    refused = ["axis"] * (kind.axes < 1) + ["axis2"] * (kind.axes < 2) + ["pitch"] * (kind.moves != "screw")
    refused += ["coordinate", "stiffness", "damping", "friction"] * (not kind.moves)
    article = "an" if given["type"][0] in "aeiou" else "a"
    for key in refused:
        if key in given:
            raise error(key, f"{article} {given['type']} closure has no '{key}'", "leave it out")
    if kind.moves == "screw" and "pitch" not in given:
        raise error("pitch", "a screw needs a 'pitch'", "how far it slides by a whole turn")
    if "rest" in given and "stiffness" not in given:
        raise error("rest", "'rest' has no effect without 'stiffness'", "add it, or leave this out")
    if "guess" in given and kind.moves != "screw" and not {"coordinate", "stiffness"}.intersection(given):
        raise error("guess", "a 'guess' is that of a coordinate", "add 'coordinate', a name for it")


def check_closures(d: Description, sources: Sources) -> None:
    """Whether the frames are there, and fit together."""
    frames = {f.name: f.body for f in d.frames} | {b.name: b.name for b in d.bodies} | {WORLD: WORLD}
    planar = {b.name: b.planar for b in d.bodies}
    for c in d.closures:
        table = f"closures.{c.name}"
        for k, name in enumerate(c.frames):
            if name not in frames:
                hint = nearest(name, frames, "frames and bodies")
                raise sources.error(table, f"frames[{k}]", f"there is no frame or body '{name}'", hint=hint)
        bodies = [frames[name] for name in c.frames]
        if bodies[0] == bodies[1]:
            message = "both frames are fixed in " + ("the world" if bodies[0] == WORLD else f"'{bodies[0]}'")
            raise sources.error(table, "frames", message, hint="choose frames of two bodies")
        flat = [planar[b] for b in bodies if b != WORLD]
        if any(flat) and not all(flat):
            message = "one body is planar, and the other turns in space"
            raise sources.error(table, "frames", message, hint="make both planar, or none")
        if any(flat):
            _check_plane(c, sources)
        elif c.axis:
            sources.refuse_two_components(table, "axis", bodies[0] if bodies[0] != WORLD else bodies[1])


def _check_plane(c: Closure, sources: Sources) -> None:
    table = f"closures.{c.name}"
    if not CLOSURES[c.type].in_plane:
        known = ", ".join(name for name, kind in CLOSURES.items() if kind.in_plane)
        raise sources.error(
            table, "type", f"a {c.type} joint leaves the x-y plane", hint=f"types in the plane: {known}"
        )
    if c.axis and (c.axis[2] == 0) != (c.type == "prismatic"):
        where = "in the plane" if c.type == "prismatic" else "z"
        raise sources.error(table, "axis", f"the axis of a {c.type} joint between planar bodies is {where}")


@dataclass
class _Joined:
    """The two frames of a closure, by the world components of what its equations are made of."""

    writer: Writer
    closure: Closure

    def __post_init__(self) -> None:
        c, w = self.closure, self.writer
        bodies = [w.body_of(name) for name in c.frames]
        self.planar = all(b == WORLD or w.body[b].planar for b in bodies)
        self.kind = CLOSURES[c.type]
        hinge = self.planar and self.kind.moves != "slide"
        self.axis: Direction = c.axis or (Z if hinge else X)
        self.apart = [difference(y, x) for x, y in zip(*(w.origin(name) for name in c.frames), strict=True)]

    def side(self, k: int, numbers: Direction) -> Vector:
        """World components of a direction in a frame."""
        return self.writer.direction(self.closure.frames[k], numbers)

    def held(self) -> list[tuple[str, algebra.Expr]]:
        """Suffixes and expressions of the constraints: of places first."""
        return [*self._places(), *self._turns()]

    def _places(self) -> list[tuple[str, algebra.Expr]]:
        if self.kind.place == "one":
            return list(zip(("_x", "_y", "_z"), self.apart[: 2 if self.planar else 3]))
        if self.kind.place == "plane":
            return [("_off", scalar_product(self.apart, self.side(0, self.axis)))]
        if self.planar:
            x, y, _ = self.axis
            return [("_off", scalar_product(self.apart, self.side(0, (-y, x, 0.0))))]
        across = perpendiculars(self.axis)
        return [(f"_off_{k}", scalar_product(self.apart, self.side(0, n))) for k, n in enumerate(across, 1)]

    def _turns(self) -> list[tuple[str, algebra.Expr]]:
        if self.kind.turn == "" or (self.planar and self.kind.turn == "axis"):
            return []
        if self.planar:
            return [("_turn", scalar_product(self.side(0, (0.0, 1.0, 0.0)), self.side(1, X)))]
        if self.kind.turn == "cross":
            second = self.closure.axis2 or perpendiculars(self.axis)[0]
            return [("_turn", scalar_product(self.side(0, self.axis), self.side(1, second)))]
        first, second = perpendiculars(self.axis)
        along = self.side(1, self.axis)
        rows = [scalar_product(self.side(0, n), along) for n in (first, second)]
        if self.kind.turn == "all":
            rows.append(scalar_product(self.side(0, second), self.side(1, first)))
        return [(f"_turn_{k}", row) for k, row in enumerate(rows, 1)]

    def _cosine_and_sine(self) -> tuple[algebra.Expr, algebra.Expr]:
        """Of the angle by which the second frame is turned against the first one, about the axis."""
        first, second = perpendiculars(self.axis)
        turned = self.side(1, first)
        return scalar_product(self.side(0, first), turned), scalar_product(self.side(0, second), turned)

    def slide(self) -> algebra.Expr:
        """How far the second frame is along the axis of the first."""
        return scalar_product(self.apart, self.side(0, self.axis))

    def speed(self) -> algebra.Expr:
        """How fast it slides or turns, linear in the rates."""
        if self.kind.moves == "slide":
            return dot(self.slide())
        c, s = self._cosine_and_sine()
        return difference(product([c, dot(s)]), product([s, dot(c)]))

    def measured(self) -> list[tuple[str, algebra.Expr]]:
        """The constraints by which a closure's coordinate follows what the bodies do: an angle counts whole turns."""
        if self.closure.coordinate is None:
            return []
        q = algebra.Symbol(self.closure.coordinate)
        made: list[tuple[str, algebra.Expr]] = []
        if self.kind.moves != "slide":
            c, s = self._cosine_and_sine()
            cos, sin = algebra.cos(q, evaluate=False), algebra.sin(q, evaluate=False)
            y = difference(product([s, cos]), product([c, sin]))
            x = total([product([c, cos]), product([s, sin])])
            made.append(("_angle", algebra.atan2(y, x, evaluate=False)))
        else:
            made.append(("_slide", difference(self.slide(), q)))
        if self.kind.moves == "screw":
            lead = product([self.closure.pitch, HALF, inverted(algebra.pi), q])
            made.append(("_lead", difference(self.slide(), lead)))
        return made


@dataclass
class Written:
    """What closures have become: constraints, frictions, and which constraints are the forces of which closure."""

    constraints: list[Constraint]
    frictions: list[Friction]
    parts: dict[str, tuple[str, ...]]


def write_closures(writer: Writer, d: Description, sources: Sources) -> Written:
    """Constraints, frictions and energies of the closures of a description; energies go to the writer."""
    written = Written([], [], {})
    taken = {c.name for c in (*d.constraints, *d.velocity_constraints)}
    rubbing = {x.name for x in (*d.stops, *d.frictions, *d.contacts)}
    for c in d.closures:
        joined = _Joined(writer, c)
        held = joined.held()
        for suffix, expression in (*held, *joined.measured()):
            name = c.name + suffix
            if name in taken:
                message = f"the closure '{c.name}' makes the constraint '{name}', which is taken"
                raise sources.error(f"closures.{c.name}", "", message, hint="choose another name")
            taken.add(name)
            written.constraints.append(Constraint(name, expression))
        forces = [suffix for suffix, _ in held if not suffix.startswith("_turn")]
        written.parts[c.name] = tuple(c.name + suffix for suffix in forces or (s for s, _ in held))
        if c.stiffness is not None:
            q = algebra.Symbol(c.coordinate)
            stretch = q if c.rest is None else difference(q, c.rest)
            writer.terms["potential"].append(product([HALF, c.stiffness, squared(stretch)]))
        if c.damping is not None:
            writer.terms["dissipation"].append(product([HALF, c.damping, squared(joined.speed())]))
        if c.friction is not None:
            if c.name in rubbing:
                message = f"the closure makes the friction '{c.name}', which is taken"
                raise sources.error(f"closures.{c.name}", "friction", message, hint="choose another name")
            written.frictions.append(Friction(c.name, joined.speed(), c.friction))
        writer.drawings.append(Drawing(c.name, "pin", (tuple(writer.origin(c.frames[0])),)))
    return written
