"""Ready-made constraints written out as scalar ones, of the world coordinates of points and axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import sympy

from .description import Axis, Description, Loop
from .evaluate import Direction, perpendiculars
from .unevaluated import difference, negated, product, squared, total

HALF = sympy.Rational(1, 2)
Named = list[tuple[str, sympy.Expr]]  # what is appended to the constraint's name, and what is held at zero
WORLD = "world"


@dataclass
class Writer:
    """Writes constraints out; `axes` collects the body-fixed vectors that they need."""

    description: Description
    axes: list[Axis] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.planar = {b.name: b.planar for b in self.description.bodies}
        self.body_of = {p.name: p.body for p in self.description.points}

    def write(self, loop: Loop) -> Named:
        """The scalar constraints of a ready-made one."""
        return KINDS[loop.kind](self, loop.name, **dict(loop.arguments))

    def coincident(self, name: str, points: tuple[str, str]) -> Named:
        """Two points are one."""
        return list(zip(("_x", "_y", "_z"), self.between(*points)))

    def distance(self, name: str, points: tuple[str, str], length: sympy.Expr) -> Named:
        """In units of length, so that tolerances mean the same as in other constraints."""
        inverse = sympy.Pow(length, -1, evaluate=False) if not length.is_Number else 1 / length
        excess = total([*map(squared, self.between(*points)), negated(squared(length))])
        return [("", product([HALF, inverse, excess]))]

    def point_on_line(
        self, name: str, point: str, line: str, direction: Direction, body: str | None = None
    ) -> Named:
        """A point stays on a line of a body."""
        body = body or self.body_of[line]
        apart = self.between(point, line)
        if len(apart) == 2 and self.in_plane(body):
            normals = [(-direction[1], direction[0], 0.0)]
        else:
            apart, normals = _components(point, line, 3), perpendiculars(direction)
        return [
            (f"_{k}", _scalar_product(apart, self.fixed(f"{name}_normal{k}", body, normal)))
            for k, normal in enumerate(normals, 1)
        ]

    def point_in_plane(
        self, name: str, point: str, plane: str, normal: Direction, body: str | None = None
    ) -> Named:
        """A point stays in a plane of a body."""
        vector = self.fixed(f"{name}_normal", body or self.body_of[plane], normal)
        return [("", _scalar_product(self.between(point, plane), vector))]

    def parallel(self, name: str, bodies: tuple[str, str], axes: tuple[Direction, Direction]) -> Named:
        """Axes of two bodies stay parallel."""
        first, second = axes
        if all(map(self.in_plane, bodies)):
            normals: tuple[Direction, ...] = ((-second[1], second[0], 0.0),)
        else:
            normals = perpendiculars(second)
        vector = self.fixed(f"{name}_axis", bodies[0], first)
        return [
            (f"_{k}", _scalar_product(vector, self.fixed(f"{name}_normal{k}", bodies[1], normal)))
            for k, normal in enumerate(normals, 1)
        ]

    def gear(self, name: str, coordinates: tuple[str, str], ratio: sympy.Expr, offset: sympy.Expr) -> Named:
        """One coordinate is a multiple of another, and an offset."""
        first, second = map(sympy.Symbol, coordinates)
        return [("", total([first, negated(product([ratio, second])), negated(offset)]))]

    def couple(self, name: str, expression: sympy.Expr) -> Named:
        """An expression is zero."""
        return [("", expression)]

    def motion(self, name: str, coordinate: str, follows: sympy.Expr) -> Named:
        """A coordinate follows a prescribed motion."""
        return [("", difference(sympy.Symbol(coordinate), follows))]

    def in_plane(self, body: str) -> bool:
        """Whether a body stays in the x-y plane."""
        return body == WORLD or self.planar[body]

    def between(self, a: str, b: str) -> list[sympy.Expr]:
        """From point b to point a; two components where both are in the x-y plane."""
        return _components(
            a, b, 2 if self.in_plane(self.body_of[a]) and self.in_plane(self.body_of[b]) else 3
        )

    def fixed(self, name: str, body: str, direction: Direction) -> list[sympy.Expr]:
        """World components of a body-fixed vector: numbers, or the names of a new axis."""
        numbers = tuple(sympy.Integer(int(x)) if x == int(x) else sympy.Float(x) for x in direction)
        if body == WORLD:
            return list(numbers)
        self.axes.append(Axis(name, body, numbers))
        return [sympy.Symbol(f"{name}_{c}") for c in "xyz"]


def _components(a: str, b: str, count: int) -> list[sympy.Expr]:
    return [difference(sympy.Symbol(f"{a}_{c}"), sympy.Symbol(f"{b}_{c}")) for c in "xyz"[:count]]


def _scalar_product(a: list[sympy.Expr], b: list[sympy.Expr]) -> sympy.Expr:
    return total([product(pair) for pair in zip(a, b)])


KINDS: dict[str, Callable[..., Any]] = {
    "coincident": Writer.coincident,
    "point_on_line": Writer.point_on_line,
    "point_in_plane": Writer.point_in_plane,
    "distance": Writer.distance,
    "parallel": Writer.parallel,
    "gear": Writer.gear,
    "couple": Writer.couple,
    "motion": Writer.motion,
}
