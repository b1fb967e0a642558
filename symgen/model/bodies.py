"""Bodies, shapes and loads from the arguments that describe them, with checks of lengths and combinations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

import sympy

from ..errors import nearest
from .declared import Declared
from .description import Body, Load, Shape
from .names import name_fault

SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2}
SHAPES = (*SIZES, "mesh")
SIZE_NAMES = {
    "box": "[x, y, z]",
    "sphere": "[radius]",
    "cylinder": "[radius, length]",
    "capsule": "[radius, length]",
}
Expressions = tuple[sympy.Expr, ...]


def make_body(
    model: Declared, name: str, mass: Any, com: Any, inertia: Any, angle: Any, rotation: Any, shape: Any
) -> Body:
    """A body from the arguments of `Model.body`."""
    table, sources = f"bodies.{name}", model._sources
    if name == "world":
        raise sources.error(
            table, "", "'world' is the fixed frame, and not a body's name", hint="choose another name"
        )
    if mass is None and inertia is None:
        raise sources.error(
            table, "", "a body needs a mass, an inertia or both", hint="mass = 0 makes one that is drawn only"
        )
    placed = _given(com)
    position = _expressions(model, com, table, "com", (2, 3)) if placed else ()
    planar = (
        len(position) == 2 if placed else inertia is not None and (not _is_list(inertia) or len(inertia) == 1)
    )
    if placed:
        _check_orientation(model, table, planar, angle, rotation)
    tensor = _inertia(model, table, planar, inertia)
    steps = _rotation(model, table, rotation)
    return Body(
        name=name,
        com=position,
        mass=None if mass is None else sources.expression(mass, table, "mass"),
        inertia=tensor,
        angle=None if angle is None else sources.expression(angle, table, "angle"),
        rotation=steps,
        shape=None if shape is None else _shape(model, table, shape),
    )


def _check_orientation(model: Declared, table: str, planar: bool, angle: Any, rotation: Any) -> None:
    if planar and rotation is not None and len(rotation):
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
    is_list = _is_list(inertia)
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


def _is_list(inertia: Any) -> bool:
    return isinstance(inertia, (Sequence, sympy.MatrixBase)) and not isinstance(inertia, str)


def _rotation(model: Declared, table: str, rotation: Any) -> tuple[tuple[str, sympy.Expr], ...]:
    steps = []
    for k, step in enumerate(() if rotation is None else rotation):
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
    if isinstance(shape, Shape):
        shape = {shape.kind: shape.mesh or shape.sizes}
    if not isinstance(shape, Mapping) or len(shape) != 1:
        raise sources.error(
            table, "shape", f"a shape is one of {', '.join(SHAPES)}", hint="shape = { sphere = [0.1] }"
        )
    ((kind, sizes),) = shape.items()
    key = f"shape.{str(kind)[:60]}"
    if kind not in SHAPES:
        raise sources.error(
            table, key, f"unknown shape {kind!r:.60}", hint=nearest(str(kind)[:60], SHAPES, "shapes")
        )
    if kind == "mesh":
        return Shape("mesh", (), _mesh(model, table, key, sizes))
    if isinstance(sizes, (str, sympy.Expr)) or not isinstance(sizes, Sequence) or len(sizes) != SIZES[kind]:
        raise sources.error(
            table,
            key,
            f"the sizes of a {kind} are {SIZE_NAMES[kind]}",
            hint="give as many numbers above zero",
        )
    return Shape(kind, _expressions(model, sizes, table, key, (SIZES[kind],)))


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


def make_load(model: Declared, name: str, point: Any, force: Any, body: Any, torque: Any) -> Load:
    """A load from the arguments of `Model.load`."""
    table, sources = f"loads.{name}", model._sources
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
        place = _expressions(model, point, table, "point", (2, 3))
        return Load(name, place, _expressions(model, force, table, "force", (len(place),)))
    if name_fault(body, element=True) is not None:
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
    if isinstance(torque, str) or not isinstance(torque, Sequence):
        torque = (torque,)
    return Load(name, body=body, torque=_expressions(model, torque, table, "torque", (1, 3)))


def _given(value: Any) -> bool:
    return value is not None and not (isinstance(value, Sequence) and len(value) == 0)
