"""Balls, wheels and knife edges that roll on planes and surfaces, written out as constraints.

The point of a body that touches, momentarily fixed in it, has the plane's velocity: with the body's axes b_i and the
arm r from its centre c, v = dc/dt + sum (b_i . r) db_i/dt, which is linear in the rates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..errors import nearest
from . import algebra
from .declared import Declared
from .description import Body, Constraint, Description, Rolling, Shape, Solid, Table
from .elements import Vector, Writer, cross, scalar_product
from .expression_tree import names_in
from .functions import dot
from .gravity import HERE
from .joints import direction
from .names import reference_fault
from .ready_made import HALF, WORLD
from .solids import picture
from .sources import Sources
from .surfaces import Definitions, Surface
from .unevaluated import difference, inverted, negated, product, squared, total

ROLLING_KEYS = ("body", "ball", "wheel", "knife", "axis", "at", "plane", "height", "holds")
KINDS = ("ball", "wheel", "knife")
HELD = ("gap", "along", "across")  # what stays off or on the plane; along the way and across it
TREAD = algebra.Rational(1, 5)  # width of a wheel without a shape, in radii


def make_rolling(model: Declared, name: str, given: Mapping[str, Any]) -> Rolling:
    """A rolling contact from the arguments of `Model.rolling`."""
    table, sources = f"rolling.{name}", model._sources
    given = {key: value for key, value in given.items() if value is not None}

    def error(key: str, message: str, hint: str | None = None):
        return sources.error(table, key, message, hint=hint)

    kinds = [kind for kind in KINDS if kind in given]
    if len(kinds) != 1:
        raise error(
            "", f"what rolls is one of {', '.join(KINDS)}; {len(kinds)} are given", 'such as wheel = "0.3 m"'
        )
    (kind,) = kinds
    for key in ("body", "plane"):
        fault = reference_fault(given.get(key, "world" if key == "plane" else None))
        if fault is not None:
            what = "a body" if key == "body" else "a frame, whose x-y plane it is"
            raise error(key, f"the name of {what} is expected here; {fault}", 'for example body = "rim"')
    if kind == "ball" and "axis" in given:
        raise error("axis", "a ball has no 'axis'", "leave it out")
    axis: tuple[float, ...] = ()
    if kind == "knife":
        axis = direction(model, table, "knife", given["knife"])
        if "axis" in given:
            raise error("axis", "the direction of a blade is the value of 'knife'", "leave 'axis' out")
    elif "axis" in given:
        axis = direction(model, table, "axis", given["axis"])
    if kind == "knife" and "height" in given:
        raise error("height", "a blade glides on a plane", "leave 'height' out")
    default = held_by(kind)
    holds = given.get("holds", default)
    for k, word in enumerate(model._vector(holds, table, "holds", (1, 2, 3))):
        if word not in default:
            message = f"{word!r:.60} is not one of {', '.join(default)}"
            raise error(f"holds[{k}]", message, nearest(str(word)[:60], default))
    return Rolling(
        name=name,
        body=given["body"],
        kind=kind,
        radius=None if kind == "knife" else sources.expression(given[kind], table, kind),
        axis=axis,
        at=model._components(given["at"], table, "at") if "at" in given else (),
        plane=given.get("plane", WORLD),
        holds=tuple(x for x in HELD if x in holds),
        height=sources.expression(given["height"], table, "height") if "height" in given else None,
    )


def held_by(kind: str) -> tuple[str, ...]:
    """What is held by default; a blade glides along itself."""
    return tuple(x for x in HELD if kind != "knife" or x != "along")


def check_rolling(d: Description, sources: Sources) -> None:
    """Whether bodies and planes are there, and fit together."""
    bodies = {b.name: b for b in d.bodies}
    frames = {f.name: f.body for f in d.frames} | {b.name: b.name for b in d.bodies} | {WORLD: WORLD}
    children = {j.child for j in d.joints}
    for r in d.rolling:
        table = f"rolling.{r.name}"
        if r.body not in bodies:
            hint = nearest(r.body, bodies, "bodies")
            raise sources.error(table, "body", f"there is no body '{r.body}'", hint=hint)
        if r.plane not in frames:
            hint = nearest(r.plane, frames, "frames and bodies")
            raise sources.error(table, "plane", f"there is no frame '{r.plane}'", hint=hint)
        body = bodies[r.body]
        if frames[r.plane] == r.body:
            message = f"the plane is fixed in '{r.body}', which rolls"
            raise sources.error(
                table, "plane", message, hint="choose a frame of another body, or of the world"
            )
        if body.name not in children and body.angle is None and not body.rotation:
            what = "angle" if body.planar else "rotation"
            raise sources.error(table, "body", f"the body '{r.body}' does not turn", hint=f"give it '{what}'")
        if body.planar and not (frames[r.plane] == WORLD or bodies[frames[r.plane]].planar):
            message = f"'{r.body}' is planar, and the plane turns in space"
            raise sources.error(table, "plane", message, hint="make both planar, or none")
        for name in HERE[1 if body.planar else 2 :]:
            if r.height is not None and name in names_in(r.height):
                message = f"the height of a surface does not depend on '{name}'"
                hint = "it is one of here_x" + ("" if body.planar else " and here_y")
                raise sources.name_error(table, "height", name, message, hint)
        if body.planar and r.kind != "knife" and r.axis:
            message = "what rolls in the x-y plane turns about z"
            raise sources.error(table, "axis", message, hint="leave 'axis' out")
        if not body.planar and r.axis:
            sources.refuse_two_components(table, "knife" if r.kind == "knife" else "axis", r.body)


def drawn(d: Description) -> tuple[Body, ...]:
    """The bodies, with a picture of what rolls where they have no shape."""
    rolls = {r.body: r for r in d.rolling if r.radius is not None and not r.at}
    result = []
    for b in d.bodies:
        r = rolls.get(b.name)
        if r is None or b.shape is not None or b.solids:
            result.append(b)
        elif r.kind == "ball" or b.planar:
            result.append(replace(b, shape=Shape("sphere", (r.radius,))))
        else:
            axis = r.axis or (0.0, 0.0, 1.0)
            disc = Solid("cylinder", (r.radius, product([TREAD, r.radius])), False, "", axis=axis)
            result.append(replace(b, shape=picture((disc,), (algebra.ZERO,) * 3)))
    return tuple(result)


def write_rolling(
    writer: Writer, r: Rolling, sources: Sources, definitions: Definitions, tables: Sequence[Table]
) -> list[Constraint]:
    """The constraints of something that rolls; `definitions` grow by the definitions of a surface."""
    body = writer.body[r.body]
    origin, plane = writer.origin(r.plane), writer.directions(r.plane)
    if body.planar and r.kind == "knife":  # seen from above: the plane is that of the model
        origin, normal, first = None, [algebra.ZERO, algebra.ZERO, algebra.ONE], plane[0]
    else:
        first, normal = plane[0], plane[1 if body.planar else 2]
    centre = writer.point(r.body, r.at) if r.at else writer.centre(r.body)
    made: dict[str, Constraint] = {}

    def hold(which: str, expression: algebra.Expr, kind: str = "velocity") -> None:
        made[which] = Constraint(f"{r.name}_{which}", expression, kind)

    height = (
        None if origin is None else scalar_product([difference(x, y) for x, y in zip(centre, origin)], normal)
    )
    if r.kind == "knife":
        blade = writer.direction(r.body, r.axis)
        side = cross(normal, blade)
        speed = [difference(dot(x), v) for x, v in zip(centre, _of_plane(writer, r.plane, centre, origin))]
        hold("across", product([scalar_product(speed, side), inverted(_length(side))]))
        if height is not None:
            hold("gap", height, "holonomic")
    else:
        along, across, down, reach = _tread(writer, r, body, normal, first)
        arm = [product([r.radius, x]) for x in down]
        gap = difference(height, product([r.radius, reach]))
        if r.height is not None:
            given = (f"rolling.{r.name}", r.name, r.plane, r.height, body.planar, tables)
            surface = Surface(writer, sources, definitions, *given)
            gap, arm, along, across = _on_surface(writer, r, body, surface, centre, down, along)
        touch = [total([x, y]) for x, y in zip(centre, arm)]
        hold("gap", gap, "holonomic")
        speed = [
            total([dot(x), *turning, negated(v)])
            for x, turning, v in zip(
                centre, velocity_by_turning(writer, r.body, arm), _of_plane(writer, r.plane, touch, origin)
            )
        ]
        hold("along", scalar_product(speed, along))
        if not body.planar:
            hold("across", scalar_product(speed, across))
    return [made[which] for which in HELD if which in r.holds and which in made]


def _tread(
    writer: Writer, r: Rolling, body: Body, normal: Vector, first: Vector
) -> tuple[Vector, Vector, Vector, algebra.Expr]:
    """The directions along the way and across it, that from the centre to what touches, and how far down it reaches."""
    if r.kind == "ball" or body.planar:
        return first, cross(normal, first), [negated(x) for x in normal], algebra.ONE
    axle = writer.direction(r.body, r.axis or (0.0, 0.0, 1.0))
    upright = scalar_product(normal, axle)  # sine of the lean; 1 for a wheel that lies flat
    reach = algebra.Pow(difference(algebra.ONE, squared(upright)), HALF, evaluate=False)
    along = [product([x, inverted(reach)]) for x in cross(axle, normal)]
    down = [
        product([difference(product([upright, a]), n), inverted(reach)])
        for a, n in zip(axle, normal, strict=True)
    ]
    return along, cross(normal, along), down, reach


def _on_surface(
    writer: Writer, r: Rolling, body: Body, surface: Surface, centre: Vector, down: Vector, side: Vector
) -> tuple[algebra.Expr, Vector, Vector, Vector]:
    """The gap, the arm from the centre to what touches, the directions along the way and across it."""
    if r.kind == "ball" or body.planar:
        foot = surface.ball(centre, r.radius, signed=True)
        arm = [negated(product([r.radius, x])) for x in foot.normal]
        return difference(foot.away, r.radius), arm, foot.tangents[0], foot.tangents[-1]
    arm, foot = surface.rim(centre, r.radius, down, side)
    along, across, *_ = _tread(writer, r, body, foot.normal, side)
    return foot.away, arm, along, across


def velocity_by_turning(writer: Writer, body: str, arm: Vector) -> list[list[algebra.Expr]]:
    """What the turning of a body adds to the velocity at the end of an arm, by components, as terms."""
    terms: list[list[algebra.Expr]] = [[], [], []]
    for axis in writer.directions(body):
        reach = scalar_product(axis, arm)
        for k, x in enumerate(axis):
            if not x.is_Number:
                terms[k].append(product([reach, dot(x)]))
    return terms


def _of_plane(writer: Writer, plane: str, place: Vector, origin: Vector | None) -> Vector:
    """The velocity of the point of a plane that is at a place."""
    if origin is None or writer.body_of(plane) == WORLD:
        return [algebra.ZERO] * 3
    apart = [difference(x, y) for x, y in zip(place, origin, strict=True)]
    turning = velocity_by_turning(writer, plane, apart)
    return [
        total([algebra.ZERO if x.is_Number else dot(x), *more])
        for x, more in zip(origin, turning, strict=True)
    ]


def _length(a: Vector) -> algebra.Expr:
    return algebra.Pow(total([squared(x) for x in a]), HALF, evaluate=False)
