"""Parts of a model from the arguments that describe them: bodies with their shapes, loads, drawings, events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

from ..errors import ModelError, nearest
from . import algebra
from .colours import without_colour
from .declared import Declared
from .description import NOTHING, Body, Drawing, Event, Load, Reset, Shape, Solid
from .functions import dot
from .given import given_expression, is_listed, is_symbol, unpacked
from .items import DRAWINGS, drawing_key
from .mesh import volume_of
from .names import reference_fault
from .solids import FORMS, Inertia, given_sizes, make_solids, together
from .sources import Sources

DRAWN = ("box", "sphere", "cylinder", "capsule")  # what viewers have themselves
SHAPES = (*FORMS, "mesh")

Expressions = tuple[algebra.Expr, ...]
DIRECTIONS = ("rising", "falling", "both")
ACTIONS = ("terminate", "record", "reset")


def make_body(
    model: Declared,
    name: str,
    mass: Any,
    com: Any,
    inertia: Any,
    angle: Any,
    rotation: Any,
    shape: Any,
    density: Any,
) -> Body:
    """A body from the arguments of `Model.body`."""
    table, sources = f"bodies.{name}", model._sources
    if name == "world":
        raise sources.error(
            table, "", "'world' is the fixed frame, and not a body's name", hint="choose another name"
        )
    placed = _given(com)
    position = _expressions(model, com, table, "com", (2, 3)) if placed else ()
    shape, color = without_colour(shape, sources, table)
    drawn, solids = _shapes(model, table, shape, density, planar=len(position) == 2)
    made = _heavy(model, table, solids, mass, inertia)
    turned = _rotation(model, table, rotation)
    if placed:
        planar = len(position) == 2
        _check_orientation(model, table, planar, angle, turned)
    elif made is not None:
        planar = all(solid.planar for solid in solids)
    else:
        planar = inertia is not None and (not is_listed(inertia) or len(inertia) == 1)
    body = Body(
        name=name,
        com=position,
        mass=None if mass is None else sources.expression(mass, table, "mass"),
        inertia=_inertia(model, table, planar, inertia),
        angle=None if angle is None else sources.expression(angle, table, "angle"),
        rotation=turned,
        shape=drawn,
        solids=solids,
        color=color,
    )
    if made is None:
        return body
    return replace(
        body,
        com=body.com or made.centre[: 2 if planar else 3],
        mass=made.mass,
        inertia=made.tensor[2:3] if planar else made.tensor[: 6 if any(made.tensor[3:]) else 3],
        centred=not placed,
    )


def _shapes(
    model: Declared, table: str, shape: Any, density: Any, *, planar: bool
) -> tuple[Shape | None, tuple[Solid, ...]]:
    """The shape that is drawn only, or None, and the solids that touch, weigh or are drawn where they lie."""
    if density is None and _is_drawn_alone(shape):
        return None if shape is None else _shape(model, table, shape), ()
    if density is None and isinstance(shape, Mapping) and {*shape} == {"mesh", "offset"}:
        offset = model._components(shape["offset"], table, "shape.offset")
        mesh = _mesh(model, table, "shape.mesh", shape["mesh"])
        return None, (Solid("mesh", (), False, "shape", offset, mesh=mesh),)
    if isinstance(shape, Mapping) and list(shape) == ["mesh"]:
        return None, (_heavy_mesh(model, table, shape["mesh"], density),)
    return None, make_solids(model, table, {} if shape is None else shape, density, planar)


def _heavy(model: Declared, table: str, solids: tuple[Solid, ...], mass: Any, inertia: Any) -> Inertia | None:
    """What solids with a density weigh together, None without; the mass and inertia that are given must fit that."""
    sources = model._sources
    try:
        made = together(solids)
    except OverflowError:
        message = "the mass or inertia of the shapes is beyond what numbers hold"
        raise sources.error(table, "shape", message, hint="look at their sizes and densities") from None
    if made is not None:
        for key, value in (("mass", mass), ("inertia", inertia)):
            if value is not None:
                message = f"'{key}' follows from the shapes, which have a density"
                raise sources.error(table, key, message, hint=f"leave out '{key}', or 'density'")
    elif mass is None and inertia is None:
        hint = "mass = 0 makes one that is drawn only; a 'density' makes shapes heavy"
        raise sources.error(table, "", "a body needs a mass, an inertia or both", hint=hint)
    return made


def _is_drawn_alone(shape: Any) -> bool:
    """Whether a shape is one that viewers draw about the centre of mass, or none at all."""
    if isinstance(shape, Mapping):
        return len(shape) == 1 and not {*shape}.intersection(FORMS.keys() - set(DRAWN))
    return not isinstance(shape, Sequence) or isinstance(shape, str)


def _check_orientation(
    model: Declared, table: str, planar: bool, angle: Any, rotation: Sequence[Any]
) -> None:
    if planar and rotation:
        raise model._sources.error(
            table,
            "rotation",
            "a body whose 'com' has two components is planar and takes 'angle', not 'rotation'",
            hint="give 'com' a third component to make the body 3-D",
        )
    if not planar and angle is not None:
        raise model._sources.error(
            table,
            "angle",
            "a body whose 'com' has three components takes 'rotation', not 'angle'",
            hint='for example rotation = [["z", "psi"]]; with two components in \'com\' the body is planar',
        )


def _expressions(model: Declared, values: Any, table: str, key: str, lengths: tuple[int, ...]) -> Expressions:
    items = model._vector(values, table, key, lengths)
    return tuple(model._sources.expression(x, table, f"{key}[{k}]") for k, x in enumerate(items))


def _inertia(model: Declared, table: str, planar: bool, inertia: Any) -> Expressions:
    if inertia is None:
        return ()
    is_list = is_listed(inertia)
    if planar:
        if is_list and len(inertia) != 1:
            raise model._sources.error(
                table,
                "inertia",
                f"a planar body has one inertia, about z; {len(inertia)} are given",
                hint="give one number, or make the body 3-D by a 'rotation' or a joint",
            )
        return (model._sources.expression(inertia[0] if is_list else inertia, table, "inertia"),)
    if not is_list:
        raise model._sources.error(
            table,
            "inertia",
            "a 3-D body's inertia is [Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]",
            hint="give three or six elements",
        )
    return _expressions(model, inertia, table, "inertia", (3, 6))


def _rotation(model: Declared, table: str, rotation: Any) -> tuple[tuple[str, algebra.Expr], ...]:
    steps = []
    rotation = () if rotation is None else unpacked(rotation)
    if not is_listed(rotation):
        message = f"a rotation is a list of axes and angles, not {rotation!r:.60}"
        raise model._sources.error(table, "rotation", message, hint='for example rotation = [["z", "psi"]]')
    for k, step in enumerate(rotation):
        if (
            isinstance(step, str)
            or not isinstance(step, Sequence)
            or len(step) != 2
            or step[0] not in ("x", "y", "z")
        ):
            raise model._sources.error(
                table,
                f"rotation[{k}]",
                f'a rotation is an axis and an angle, as ["z", "psi"], not {step!r:.60}',
                hint='for example rotation = [["z", "psi"]]',
            )
        steps.append((step[0], model._sources.expression(step[1], table, f"rotation[{k}]")))
    return tuple(steps)


def _shape(model: Declared, table: str, shape: Any) -> Shape:
    sources = model._sources
    if shape == NOTHING:
        return Shape(NOTHING)
    if isinstance(shape, Shape):
        shape = {shape.kind: shape.mesh or shape.sizes}
    if not isinstance(shape, Mapping) or len(shape) != 1:
        raise sources.error(
            table,
            "shape",
            f"a shape is one of {', '.join(SHAPES)}",
            hint='shape = { sphere = [0.1] }, or shape = "none" for a body that is not drawn',
        )
    ((kind, sizes),) = shape.items()
    key = f"shape.{str(kind)[:60]}"
    if kind not in SHAPES:
        raise sources.error(
            table, key, f"unknown shape {kind!r:.60}", hint=nearest(str(kind)[:60], SHAPES, "shapes")
        )
    if kind == "mesh":
        return Shape("mesh", (), _mesh(model, table, key, sizes))
    return Shape(kind, given_sizes(model, table, key, kind, sizes))


def _mesh(model: Declared, table: str, key: str, file: Any) -> str:
    """A mesh's path, held below the model's own folder: model files come from strangers."""
    sources = model._sources
    if not isinstance(file, str) or not file or not file.isprintable():
        raise sources.error(
            table, key, f"a mesh is the name of a file, not {file!r:.60}", hint='for example mesh = "arm.stl"'
        )
    path = PurePosixPath(file)
    foreign = path.is_absolute() or PureWindowsPath(file).anchor or "\\" in file
    if foreign or ".." in path.parts:
        raise sources.error(
            table,
            key,
            f"the mesh {file!r:.100} is not below the model's own folder",
            hint="put it beside the model",
        )
    if model.folder is None:
        raise sources.error(
            table, key, "the model has no folder to find the mesh in", hint="give Model(…, folder=…)"
        )
    folder = model.folder.resolve()
    found = (folder / path).resolve()
    if not found.is_relative_to(folder):
        raise sources.error(
            table,
            key,
            f"the mesh {file!r:.100} leads out of the model's own folder",
            hint="copy it beside the model",
        )
    if not found.is_file():
        raise sources.error(table, key, f"the mesh {file!r:.100} is not there", hint=f"looked in {folder}")
    return str(path)


def make_shapes(model: Declared, table: str, key: str, given: Any) -> tuple[Solid, ...]:
    """Shapes without a density, or a mesh alone, from a key of another table than a body's."""
    if not (isinstance(given, Mapping) and "mesh" in given and {*given} <= {"mesh", "offset"}):
        solids = make_solids(model, table, given, None, False, key)
        for solid in solids:
            if solid.density is not None:
                message = "shapes that touch have no density of their own"
                raise model._sources.error(table, f"{solid.place}.density", message, hint="leave it out")
        return solids
    offset = model._components(given["offset"], table, f"{key}.offset") if "offset" in given else ()
    return (Solid("mesh", (), False, key, offset, mesh=_mesh(model, table, f"{key}.mesh", given["mesh"])),)


def _heavy_mesh(model: Declared, table: str, file: Any, density: Any) -> Solid:
    """A closed mesh with a density."""
    name = _mesh(model, table, "shape.mesh", file)
    try:
        held = volume_of(model.folder / name)
    except ModelError as error:
        raise model._sources.locate(error, table, "shape.mesh") from None
    heavy = model._sources.expression(density, table, "density")
    holds = (held.volume, *held.centre, *held.inertia)
    return Solid("mesh", (), False, "shape", density=heavy, mesh=name, holds=holds)


def make_load(
    model: Declared, name: str, point: Any, force: Any, body: Any, torque: Any, frame: Any, reaction: Any
) -> Load:
    """A load from the arguments of `Model.load`."""
    table, sources = f"loads.{name}", model._sources
    for key, value in (("frame", frame), ("reaction", reaction)):
        fault = None if value is None else reference_fault(value)
        if fault is not None:
            raise sources.error(table, key, fault, hint="name a body" + " or a frame" * (key == "frame"))
    has_force, has_torque = _given(force), _given(torque)
    if has_force == has_torque:
        message = "a load is a force or a torque" + (", not both" if has_force else "; neither is given")
        raise sources.error(table, "", message, hint="give point and force, or body and torque")
    if has_force:
        if not _given(point):
            raise sources.error(
                table,
                "point",
                "the point at which the force acts is missing",
                hint='for example point = ["x", "0"]',
            )
        if body is not None:
            raise sources.error(
                table,
                "body",
                "a force acts at a point; 'body' goes with 'torque'",
                hint="leave 'body' out, or give a 'torque'",
            )
        if isinstance(point, str):
            vector = _expressions(model, force, table, "force", (2, 3))
            place = model._place(point, table, "point")[: len(vector)]
        else:
            place = _expressions(model, point, table, "point", (2, 3))
            vector = _expressions(model, force, table, "force", (len(place),))
        return Load(name, place, vector, frame=frame, reaction=reaction)
    if reference_fault(body) is not None:
        raise sources.error(
            table, "body", "the body that the torque acts on is missing", hint='body = "NAME"'
        )
    if _given(point):
        raise sources.error(
            table,
            "point",
            "a torque has no point; 'point' goes with 'force'",
            hint="leave 'point' out, or give a 'force'",
        )
    torque = unpacked(torque)
    if isinstance(torque, str) or not isinstance(torque, Sequence):
        torque = (torque,)
    vector = _expressions(model, torque, table, "torque", (1, 3))
    return Load(name, body=body, torque=vector, frame=frame, reaction=reaction)


def _given(value: Any) -> bool:
    return value is not None and not (isinstance(value, Sequence) and len(value) == 0)


def make_drawing(model: Declared, name: str, what: dict[str, Any]) -> Drawing:
    """A drawing from the arguments of `Model.draw`."""
    table, sources = f"draw.{name}", model._sources
    for kind in what:
        if kind not in DRAWINGS:
            hint = nearest(kind[:60], DRAWINGS, "drawings")
            raise sources.error(table, kind[:60], f"unknown drawing '{kind:.60}'", hint=hint)
    if len(what) != 1:
        message = f"a drawing is one of {', '.join(DRAWINGS)}; {len(what)} are given"
        raise sources.error(table, "", message, hint='for example spring = ["hook", "hub"]')
    ((kind, given),) = what.items()
    count, given = DRAWINGS[kind], unpacked(given)
    if count > 1 and (isinstance(given, str) or not isinstance(given, Sequence) or len(given) != count):
        hint = 'a place is a point\'s name, or a list of two or three components such as ["x", "0"]'
        what = "a place and a force" if kind == "force" else f'{count} places, such as ["hook", "hub"]'
        raise sources.error(table, kind, f"a {kind} takes a list of {what}", hint=hint)
    given = given if count > 1 else [given]
    vectors = (model._place(value, table, drawing_key(kind, k)) for k, value in enumerate(given))
    return Drawing(name, kind, tuple(vectors))


def make_event(sources: Sources, name: str, when: Any, direction: Any, then: Any) -> Event:
    """An event from the arguments of `Model.event`."""
    table = f"events.{name}"
    if direction not in DIRECTIONS:
        raise _choice_error(sources, table, "direction", direction, DIRECTIONS)
    expression = sources.expression(when, table, "when")
    action, resets = _action(sources, table, then)
    return Event(name, expression, direction, action, resets)


def _action(sources: Sources, table: str, then: Any) -> tuple[str, tuple[Reset, ...]]:
    if isinstance(then, Mapping):
        if list(then) != ["reset"]:
            raise sources.error(
                table,
                "then",
                'a table here reads { reset = { "dot(x)" = "…" } }',
                hint='or write "record" or "terminate"',
            )
        if not isinstance(then["reset"], Mapping) or not then["reset"]:
            message = "a reset names coordinates or rates with their new values"
            raise sources.error(table, "then.reset", message, hint='for example { "dot(x)" = "-e*dot(x)" }')
        return "reset", tuple(_reset(sources, table, key, value) for key, value in then["reset"].items())
    if then not in ("terminate", "record"):
        raise _choice_error(sources, table, "then", then, ACTIONS)
    return then, ()


def _reset(sources: Sources, table: str, key: Any, value: Any) -> Reset:
    given = given_expression(key)
    is_rate = isinstance(given, dot)
    name = given.args[0] if is_rate else key
    name = name.name if is_symbol(name) else str(name).strip()
    if name.startswith("dot(") and name.endswith(")"):
        is_rate, name = True, name[4:-1].strip()
    shown = f"dot({name})" if is_rate else name
    address = f"then.reset.{shown[:60]}"
    if sources.of(table, address):
        raise sources.error(table, address, f"'{shown:.60}' is reset twice", hint="leave one of the two out")
    return Reset(name, is_rate, sources.expression(value, table, address))


def _choice_error(sources: Sources, table: str, key: str, value: Any, choices: Sequence[str]) -> ModelError:
    message = f"{value!r:.60} is not one of {', '.join(choices)}"
    return sources.error(table, key, message, hint=nearest(str(value)[:60], choices, "choices"))
