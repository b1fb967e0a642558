"""Ready-made constraints written out as scalar ones, of the world coordinates of points and axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from . import algebra
from .description import Axis, Description, Friction, Loop
from .evaluate import Direction, perpendiculars
from .functions import dot
from .unevaluated import difference, inverted, negated, product, squared, total

HALF = algebra.Rational(1, 2)
Named = list[tuple[str, algebra.Expr]]  # what is appended to the constraint's name, and what is held at zero
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

    def distance(self, name: str, points: tuple[str, str], length: algebra.Expr) -> Named:
        """In units of length, so that tolerances mean the same as in other constraints."""
        inverse = algebra.Pow(length, -1, evaluate=False) if not length.is_Number else 1 / length
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

    def gear(
        self,
        name: str,
        coordinates: tuple[str, str],
        offset: algebra.Expr = algebra.ZERO,
        ratio: algebra.Expr | None = None,
        teeth: tuple[algebra.Expr, algebra.Expr] | None = None,
        efficiency: algebra.Expr | None = None,
    ) -> Named:
        """One coordinate is a multiple of another, and an offset."""
        first, second = map(algebra.Symbol, coordinates)
        ratio = ratio_of(ratio, teeth)
        return [("", total([first, negated(product([ratio, second])), negated(offset)]))]

    def rack(
        self,
        name: str,
        coordinates: tuple[str, str],
        radius: algebra.Expr,
        offset: algebra.Expr = algebra.ZERO,
        efficiency: algebra.Expr | None = None,
    ) -> Named:
        """A rack moves as the circumference of its pinion does."""
        return self.gear(name, coordinates[::-1], offset, radius)

    def belt(
        self,
        name: str,
        coordinates: tuple[str, str],
        radii: tuple[algebra.Expr, algebra.Expr],
        crossed: bool = False,
        offset: algebra.Expr = algebra.ZERO,
    ) -> Named:
        """The circumferences of two pulleys move alike, or against each other; in units of length."""
        first, second = (product([r, algebra.Symbol(q)]) for r, q in zip(radii, coordinates, strict=True))
        return [("", total([first, second if crossed else negated(second), negated(offset)]))]

    def planetary(
        self, name: str, sun: str, ring: str, carrier: str, teeth: tuple[algebra.Expr, algebra.Expr]
    ) -> Named:
        """As seen from the carrier, sun and ring turn against each other, in proportion to their teeth (Willis)."""
        s, r, c = map(algebra.Symbol, (sun, ring, carrier))
        ratio = product([teeth[1], inverted(teeth[0])]) if not teeth[0].is_Number else teeth[1] / teeth[0]
        return [("", total([difference(s, c), product([ratio, difference(r, c)])]))]

    def differential(
        self, name: str, input: str, outputs: tuple[str, str], ratio: algebra.Expr = algebra.ONE
    ) -> Named:
        """The cage turns as the mean of both outputs, the input by a ratio faster."""
        first, second = map(algebra.Symbol, outputs)
        return [("", difference(algebra.Symbol(input), product([ratio, HALF, total([first, second])])))]

    def couple(self, name: str, expression: algebra.Expr) -> Named:
        """An expression is zero."""
        return [("", expression)]

    def motion(self, name: str, coordinate: str, follows: algebra.Expr) -> Named:
        """A coordinate follows a prescribed motion."""
        return [("", difference(algebra.Symbol(coordinate), follows))]

    def in_plane(self, body: str) -> bool:
        """Whether a body stays in the x-y plane."""
        return body == WORLD or self.planar[body]

    def between(self, a: str, b: str) -> list[algebra.Expr]:
        """From point b to point a; two components where both are in the x-y plane."""
        return _components(
            a, b, 2 if self.in_plane(self.body_of[a]) and self.in_plane(self.body_of[b]) else 3
        )

    def fixed(self, name: str, body: str, direction: Direction) -> list[algebra.Expr]:
        """World components of a body-fixed vector: numbers, or the names of a new axis."""
        numbers = tuple(algebra.Integer(int(x)) if x == int(x) else algebra.Float(x) for x in direction)
        if body == WORLD:
            return list(numbers)
        self.axes.append(Axis(name, body, numbers))
        return [algebra.Symbol(f"{name}_{c}") for c in "xyz"]


def _components(a: str, b: str, count: int) -> list[algebra.Expr]:
    return [difference(algebra.Symbol(f"{a}_{c}"), algebra.Symbol(f"{b}_{c}")) for c in "xyz"[:count]]


def _scalar_product(a: list[algebra.Expr], b: list[algebra.Expr]) -> algebra.Expr:
    return total([product(pair) for pair in zip(a, b)])


def ratio_of(ratio: algebra.Expr | None, teeth: tuple[algebra.Expr, algebra.Expr] | None) -> algebra.Expr:
    """The ratio of a gear, which is given, or follows from teeth of wheels that mesh from outside."""
    if ratio is not None:
        return ratio
    first, second = teeth
    return -second / first if first.is_Number else negated(product([second, inverted(first)]))


def loss_of(loop: Loop) -> Friction | None:
    """The friction in the mesh of a gear that has an efficiency: what the driving side loses, in parts of the force.

    With M the torque that the mesh passes to the first coordinate, driving takes M (1 + mu), so that 1/(1 + mu)
    arrives, and what drives backwards gets M (1 - mu): it is held where the efficiency is below one half.
    """
    arguments = dict(loop.arguments)
    if arguments.get("efficiency") is None:
        return None
    level = difference(inverted(arguments["efficiency"]), algebra.ONE)
    if "radius" in arguments:  # the force of a rack, which is a torque on its pinion, whichever way it moves
        level = product([algebra.Abs(arguments["radius"]), level])
    speed = dot(algebra.Symbol(arguments["coordinates"][0]))
    return Friction(loop.name, speed, level, normal=(loop.name,))


KINDS: dict[str, Callable[..., Any]] = {
    "coincident": Writer.coincident,
    "point_on_line": Writer.point_on_line,
    "point_in_plane": Writer.point_in_plane,
    "distance": Writer.distance,
    "parallel": Writer.parallel,
    "gear": Writer.gear,
    "rack": Writer.rack,
    "belt": Writer.belt,
    "planetary": Writer.planetary,
    "differential": Writer.differential,
    "couple": Writer.couple,
    "motion": Writer.motion,
}
