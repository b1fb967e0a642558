"""Frames fixed in bodies: an origin and an orientation, given in whichever way is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import algebra
from .declared import Declared
from .description import Frame
from .evaluate import NotFinite, X, Y, Z, dot_product, evaluate, exact_angle, normalised
from .evaluate import cross_product as cross
from .joints import direction
from .names import reference_fault
from .orientation import Expressions, roll_pitch_yaw
from .placing import angles_of

WAYS = ("rpy", "axis", "quaternion", "x")  # each by itself; `angle` goes with `axis`, `y` with `x`
PARALLEL = 1e-6  # sine of the angle between two directions that are meant to differ
NORM_TOLERANCE = 1e-3  # of a quaternion that is meant to be of unit length
ZERO = (algebra.ZERO,) * 3


def make_frame(model: Declared, name: str, body: str, at: Expressions, given: dict[str, Any]) -> Frame:
    """A frame from the arguments of `Model.frame`."""
    table, sources = f"frames.{name}", model._sources
    given = {key: value for key, value in given.items() if value is not None}
    ways = [key for key in WAYS if key in given]
    if len(ways) > 1:
        message = f"an orientation is given in one way; here are '{ways[0]}' and '{ways[1]}'"
        raise sources.error(table, ways[1], message, hint="leave one of them out")
    for key, other in (("axis", "angle"), ("x", "y")):
        for has, lacks in ((key, other), (other, key)):
            if has in given and lacks not in given:
                raise sources.error(table, has, f"'{has}' needs '{lacks}'", hint=f"give '{lacks}', too")
    if "rpy" in given:
        rpy = roll_pitch_yaw(model, table, "rpy", given["rpy"])
    elif "axis" in given:
        rpy = _about(model, table, given)
    elif "quaternion" in given:
        rpy = _by_quaternion(model, table, given["quaternion"])
    elif "x" in given:
        rpy = _by_directions(model, table, body, at, given)
    else:
        rpy = ZERO
    said = () if "rpy" in given else tuple((key, _as_said(model, table, key, x)) for key, x in given.items())
    return Frame(name, body, at, rpy, said)


def _as_said(model: Declared, table: str, key: str, value: Any) -> Any:
    """An argument as it was given, as TOML can say it: numbers and text stay, SymPy's become the model's."""
    if isinstance(value, str):
        return value
    if isinstance(value, (Sequence, np.ndarray)):
        return tuple(_as_said(model, table, key, x) for x in value)
    if isinstance(value, (int, float)):
        return value if isinstance(value, int) else float(value)
    return model._sources.expression(value, table, key)


def _about(model: Declared, table: str, given: dict[str, Any]) -> Expressions:
    """The rotation by an angle about an axis: parameters may be in the angle where the axis is x, y or z."""
    axis = direction(model, table, "axis", given["axis"])
    angle = exact_angle(model._sources.expression(given["angle"], table, "angle"), _constants(model))
    for k, unit in enumerate((X, Y, Z)):
        along = dot_product(axis, unit)
        if abs(along) == 1.0:
            return tuple(angle * int(along) if i == k else algebra.ZERO for i in range(3))
    value = _number(model, table, "angle", angle, "about an axis other than x, y and z")
    c, s = math.cos(value), math.sin(value)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return _angles(model, np.eye(3) * c + (1 - c) * np.outer(axis, axis) + s * skew)


def _by_quaternion(model: Declared, table: str, values: Any) -> Expressions:
    """The rotation of a quaternion w, x, y, z."""
    given = model._vector(values, table, "quaternion", (4,))
    numbers = [
        _number(model, table, f"quaternion[{k}]", model._sources.expression(x, table, f"quaternion[{k}]"), "")
        for k, x in enumerate(given)
    ]
    length = math.hypot(*numbers)
    if abs(length - 1) > NORM_TOLERANCE:
        message = f"a unit quaternion w, x, y, z has the length 1, not {length:g}"
        raise model._sources.error(table, "quaternion", message, hint="[1, 0, 0, 0] does not turn")
    w, *vector = (x / length for x in numbers)
    x, y, z = vector
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return _angles(model, np.eye(3) + 2 * w * skew + 2 * skew @ skew)


def _by_directions(
    model: Declared, table: str, body: str, at: Expressions, given: dict[str, Any]
) -> Expressions:
    """The rotation to an x axis, and to a y axis as near to another direction as can be."""
    x, y = (_towards(model, table, key, body, at, given[key]) for key in ("x", "y"))
    z = cross(x, y)
    if math.hypot(*z) < PARALLEL:
        raise model._sources.error(table, "y", "the two directions are parallel", hint="give two that differ")
    z = normalised(z)
    return _angles(model, np.array([x, cross(z, x), z]).T)


def _towards(
    model: Declared, table: str, key: str, body: str, at: Expressions, value: Any
) -> Sequence[float]:
    """A direction by its components, or by a point of the same body that it leads to."""
    if not isinstance(value, str):
        return direction(model, table, key, value)
    sources = model._sources
    fault = reference_fault(value)
    if fault is not None:
        message = f"a direction is the name of a point, or a list of components; {fault}"
        raise sources.error(table, key, message, hint='for example x = "tip", or x = [1, 0, 0]')
    point = model._points.get(value)
    if point is None or point.body != body:
        where = "of the world" if body == "world" else f"of the body '{body}'"
        message = (
            f"there is no point '{value}' {where}" if point is None else f"the point '{value}' is not {where}"
        )
        raise sources.error(table, key, message, hint="name one of [points], or give components")
    apart = [_number(model, table, key, a - b, "towards a point") for a, b in zip(point.at, at, strict=True)]
    unit = normalised(apart)
    if unit is None:
        message = f"the point '{value}' lies at the origin of the frame"
        raise sources.error(table, key, message, hint="choose another point")
    return unit


def _angles(model: Declared, matrix: np.ndarray) -> Expressions:
    """Roll, pitch and yaw of a rotation matrix."""
    return tuple(exact_angle(algebra.Float(x), _constants(model)) for x in angles_of(matrix))


def _number(model: Declared, table: str, key: str, expression: algebra.Expr, where: str) -> float:
    try:
        value = evaluate(expression, _constants(model))
    except NotFinite:
        value = None
    if value is None:
        message = f"an orientation {where} is made of numbers and of the constants declared so far".replace(
            "  ", " "
        )
        raise model._sources.error(table, key, message, hint="make them [constants], or give 'rpy'")
    return value


def _constants(model: Declared) -> dict[str, float]:
    return {c.name: c.value for c in model._constants}
