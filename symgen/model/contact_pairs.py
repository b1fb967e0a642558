"""Contacts of a body's shape with a plane, a height field or another body's shape, as the user asks for them.

What touches are points of the shape, some of them with a radius: the corners of a box, the middle of a sphere, the ends
of a capsule, the corners of a mesh. Each has a gap of its own; `contact_geometry.py` writes them out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import nearest
from .declared import Declared
from .description import Body, ContactPair, Description, Shape, Solid
from .expression_tree import names_in
from .gravity import HERE
from .names import name_fault
from .parts import make_shapes
from .ready_made import WORLD
from .sources import Sources

PAIR_KEYS = (
    "body", "shape", "plane", "height", "other", "other_shape", "restitution", "friction", "static", "stiffness",
    "exponent", "damping", "smooth",
)  # fmt: skip
COMPLIANT = ("exponent", "damping")  # go with a stiffness
RIGID = ("restitution", "static")  # do not
TOUCHING = ("box", "sphere", "capsule", "mesh")
AGAINST_WORLD = {
    "other": "what stands still is a 'plane', or a 'height' above it: write plane = \"world\" in place of 'other'",
    "body": "name the body that touches; what stands still is the 'plane' that it touches",
}
OWN_SHAPE = "give the contact a 'shape' of its own, such as { box = [1, 1, 1] } or { sphere = [0.5] }"


def make_pair(model: Declared, name: str, given: Mapping[str, Any]) -> ContactPair:
    """A contact of shapes from the arguments of `Model.contact`."""
    table, sources = f"contacts.{name}", model._sources
    given = {key: value for key, value in given.items() if value is not None}
    compliant = "stiffness" in given
    for fault in (*_faults_of_places(given), *_faults_of_laws(given, compliant)):
        key, message, hint = fault
        raise sources.error(table, key, message, hint=hint)
    shapes = {
        key: make_shapes(model, table, key, given[key]) for key in ("shape", "other_shape") if key in given
    }
    values = {
        key: sources.expression(given.get(key, default), table, key)
        for key, default in (
            ("height", None), ("restitution", None if compliant else 0), ("friction", None), ("static", None),
            ("stiffness", None), ("exponent", 1.5 if compliant else None), ("damping", None), ("smooth", None),
        )
        if given.get(key, default) is not None
    }  # fmt: skip
    return ContactPair(
        name,
        given["body"],
        shapes.get("shape", ()),
        given.get("plane", WORLD),
        given.get("other"),
        shapes.get("other_shape", ()),
        **values,
    )


def _faults_of_places(given: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield what is wrong with what touches what: key, message, remedy."""
    for key in ("gap", "slip"):
        if key in given:
            yield key, f"'{key}' follows from the shape of the 'body'", "leave one of the two out"
    for key in ("body", "plane", "other"):
        fault = None if key not in given else name_fault(given[key], element=True)
        if fault is not None:
            what = "a frame, whose x-y plane it is" if key == "plane" else "a body"
            yield key, f"the name of {what} is expected here; {fault}", 'for example body = "die"'
    for key in ("plane", "height"):
        if key in given and "other" in given:
            yield key, f"a body touches a {key} or another body", f"leave out '{key}', or 'other'"
    if "other_shape" in given and "other" not in given:
        yield "other_shape", "'other_shape' is that of an 'other' body", "give 'other', too"


def _faults_of_laws(given: Mapping[str, Any], compliant: bool) -> Iterator[tuple[str, str, str]]:
    """Yield what is wrong with the laws of force and friction: key, message, remedy."""
    for key in RIGID if compliant else COMPLIANT:
        if key in given:
            what = "has no 'stiffness'" if not compliant else "has a 'stiffness'"
            hint = "it is rigid: leave it out" if not compliant else "its losses are those of 'damping'"
            yield key, f"'{key}' has no effect in a contact that {what}", hint
    if "friction" not in given:
        for key in ("static", "smooth"):
            if key in given:
                yield key, f"'{key}' goes with a coefficient of 'friction'", "give it, too"
    elif compliant and "smooth" not in given:
        message = (
            "friction of a contact with a 'stiffness' needs 'smooth', the speed below which it gives way"
        )
        yield "smooth", message, 'for example smooth = "1e-3 m/s"'
    elif "static" in given and "smooth" in given:
        message = "friction with 'smooth' never sticks: 'static' has no effect"
        yield "static", message, "leave one of them out"


def check_pairs(d: Description, sources: Sources) -> None:
    """Whether bodies and planes are there, fit together, and have shapes that can touch."""
    bodies = {b.name: b for b in d.bodies}
    frames = {f.name: f.body for f in d.frames} | {b.name: b.name for b in d.bodies} | {WORLD: WORLD}
    for pair in d.pairs:
        table = f"contacts.{pair.name}"
        for key, name in (("body", pair.body), ("other", pair.other)):
            if name is not None and name not in bodies:
                hint = AGAINST_WORLD[key] if name == WORLD else nearest(name, bodies, "bodies")
                raise sources.error(table, key, f"there is no body '{name}'", hint=hint)
        if pair.other is None and pair.plane not in frames:
            hint = nearest(pair.plane, frames, "frames and bodies")
            raise sources.error(table, "plane", f"there is no frame '{pair.plane}'", hint=hint)
        against = frames[pair.plane] if pair.other is None else pair.other
        key = "plane" if pair.other is None else "other"
        names = names_in(pair.height) if pair.height is not None else frozenset()
        for name in HERE[1 if bodies[pair.body].planar else 2 :]:
            if name in names:
                message = f"the height of a surface does not depend on '{name}'"
                hint = "it is one of here_x" + ("" if bodies[pair.body].planar else " and here_y")
                raise sources.name_error(table, "height", name, message, hint)
        if against == pair.body:
            message = f"'{pair.body}' would touch itself"
            raise sources.error(table, key, message, hint="choose another body, or a frame that it is not in")
        if against != WORLD and bodies[against].planar != bodies[pair.body].planar:
            message = f"one of '{pair.body}' and '{against}' is planar, the other moves in space"
            raise sources.error(table, key, message, hint="make both planar, or none")
        for key, name, own in (
            ("shape", pair.body, pair.shapes),
            ("other_shape", pair.other, pair.other_shapes),
        ):
            if name is not None:
                _check_shapes(bodies[name], own, table, key, sources)


def _check_shapes(body: Body, own: tuple[Solid, ...], table: str, key: str, sources: Sources) -> None:
    """Whether the shapes of a body can touch."""
    solids = own or solids_of(body)
    if not solids:
        message = f"the body '{body.name}' has no shape that could touch"
        raise sources.error(table, key, message, hint=OWN_SHAPE)
    for solid in solids:
        kind = "a hole" if solid.cut else f"a {solid.kind}"
        if solid.cut or solid.kind not in TOUCHING:
            message = f"{kind} of '{body.name}' is no shape that touches: these are {', '.join(TOUCHING)}"
            raise sources.error(table, key, message, hint=OWN_SHAPE)
        if solid.kind == "mesh" and body.planar:
            message = f"the mesh of '{body.name}', which moves in the x-y plane, has no outline to touch with"
            raise sources.error(table, key, message, hint=OWN_SHAPE)


def solids_of(body: Body) -> tuple[Solid, ...]:
    """The shapes of a body; what is drawn alone lies about its centre of mass."""
    if body.solids:
        return body.solids
    shape: Shape | None = body.shape
    if shape is None or shape.kind not in (*TOUCHING, "cylinder"):
        return ()
    return (Solid(shape.kind, () if shape.mesh else shape.sizes, body.planar, "shape", mesh=shape.mesh),)
