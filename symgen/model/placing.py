"""Where something stands in the world: a shift and a rotation, of numbers or of expressions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from . import algebra
from .evaluate import NotFinite, evaluate, exact_angle, normalised
from .orientation import Expressions, Matrix, rotation
from .unevaluated import difference, product, total

ZERO = (algebra.ZERO,) * 3
Vector = Sequence[algebra.Expr]


@dataclass(frozen=True)
class Placing:
    """A place in the world [m], and roll, pitch and yaw [rad] there."""

    shift: Expressions
    rpy: Expressions

    @classmethod
    def of(cls, given: Mapping[str, algebra.Expr], constants: Mapping[str, float]) -> Placing | None:
        """The place that `offset`, `angle`, `xyz`, `rpy` (their components by keys) say; None where none is given."""
        if not given:
            return None
        parts = {
            key: [given.get(f"{key}[{k}]", algebra.ZERO) for k in range(3)]
            for key in ("offset", "xyz", "rpy")
        }
        shift = tuple(a if b.is_zero else b for a, b in zip(parts["offset"], parts["xyz"], strict=True))
        yaw = given.get("angle", parts["rpy"][2])
        return cls(shift, tuple(exact_angle(x, constants) for x in (*parts["rpy"][:2], yaw)))

    @property
    def in_plane(self) -> bool:
        """Whether the x-y plane stays where it is."""
        return bool(self.rpy[0].is_zero and self.rpy[1].is_zero and self.shift[2].is_zero)

    def vector(self, v: Vector) -> list[algebra.Expr]:
        """World components of a vector."""
        return [_scalar_product(row, v) for row in self._rows()]

    def vector_back(self, v: Vector) -> list[algebra.Expr]:
        """Own components of a vector in world axes."""
        return [_scalar_product(column, v) for column in zip(*self._rows(), strict=True)]

    def point(self, v: Vector) -> list[algebra.Expr]:
        """World coordinates of a point."""
        return [total([a, b]) for a, b in zip(self.shift, self.vector(v), strict=True)]

    def point_back(self, v: Vector) -> list[algebra.Expr]:
        """Own coordinates of a point by those in the world."""
        return self.vector_back([difference(a, b) for a, b in zip(v, self.shift, strict=True)])

    def yaw_more(self, angle: algebra.Expr | None) -> algebra.Expr:
        """The angle about z of what is turned by an angle here."""
        return total([self.rpy[2], algebra.ZERO if angle is None else angle])

    def _rows(self) -> Matrix:
        return rotation(self.rpy)


def _scalar_product(a: Vector, b: Vector) -> algebra.Expr:
    return total([product(pair) for pair in zip(a, b, strict=True)])


def composed_angles(
    outer: Expressions, inner: Expressions, constants: Mapping[str, float]
) -> Expressions | None:
    """Roll, pitch and yaw of one rotation after another; None where parameters leave no formula."""
    if all(x.is_zero for x in inner):
        return outer
    if outer[0].is_zero and outer[1].is_zero:  # both yaws add
        return (*inner[:2], exact_angle(outer[2] + inner[2], constants))
    if inner[1].is_zero and inner[2].is_zero:  # both rolls add
        return (exact_angle(outer[0] + inner[0], constants), *outer[1:])
    matrices = [_matrix(rpy, constants) for rpy in (outer, inner)]
    if any(x is None for x in matrices):
        return None
    made = angles_of(matrices[0] @ matrices[1])
    return tuple(exact_angle(algebra.Float(x), constants) for x in made)


def turned_numbers(
    place: Placing, direction: Sequence[float], constants: Mapping[str, float]
) -> tuple[float, ...] | None:
    """World components of a direction of numbers; None where parameters turn it."""
    matrix = _matrix(place.rpy, constants)
    return None if matrix is None else normalised((matrix @ np.array(direction)).tolist())


def _matrix(rpy: Expressions, constants: Mapping[str, float]) -> np.ndarray | None:
    try:
        rows = [[evaluate(x, constants) for x in row] for row in rotation(rpy)]
    except NotFinite:
        return None
    return None if any(x is None for row in rows for x in row) else np.array(rows, float)


def angles_of(matrix: np.ndarray) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a rotation matrix."""
    level = math.hypot(matrix[0, 0], matrix[1, 0])
    pitch = math.atan2(-matrix[2, 0], level)
    if level < 1e-9:  # roll and yaw turn about one axis
        up = math.copysign(1.0, pitch)
        return math.atan2(up * matrix[0, 1], matrix[1, 1]), up * math.pi / 2, 0.0
    return math.atan2(matrix[2, 1], matrix[2, 2]), pitch, math.atan2(matrix[1, 0], matrix[0, 0])
