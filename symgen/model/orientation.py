"""Orientations that are known when a model is described: of joints, frames and solids."""

from __future__ import annotations

from typing import Any

from . import algebra
from .declared import Declared
from .evaluate import exact_angle

Expressions = tuple[algebra.Expr, ...]
Matrix = tuple[Expressions, ...]  # by rows


def roll_pitch_yaw(model: Declared, table: str, key: str, angles: Any) -> Expressions:
    """Roll, pitch and yaw; numbers near multiples of pi/2 are these exactly."""
    constants = {c.name: c.value for c in model._constants}
    given = model._vector(angles, table, key, (3,))
    rpy = [model._sources.expression(x, table, f"{key}[{k}]") for k, x in enumerate(given)]
    return tuple(exact_angle(x, constants) for x in rpy)


def rotation(rpy: Expressions) -> Matrix:
    """URDF's rotation Rz(yaw) Ry(pitch) Rx(roll), by rows."""
    (cx, sx), (cy, sy), (cz, sz) = ((algebra.cos(x), algebra.sin(x)) for x in rpy)
    return (
        (cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx),
        (sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx),
        (-sy, cy * sx, cy * cx),
    )
