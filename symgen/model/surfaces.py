"""Surfaces z = h(x, y) over a plane, and curves y = h(x) over a line: where balls and wheels touch them.

A ball touches at the foot of the perpendicular from its middle. That is found by a fixed number of Newton's steps, from
below the middle: the distance is least there, so that its error is the square of the foot's. Wherever the foot is, the
distance to it is not less than that to the surface, so that what has not converged, far away, makes no contact.

The rim of a wheel touches where its height over the surface is least, an angle from the point that is deepest over the
plane, which is found in the same way.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass

from ..errors import ModelError
from . import algebra
from .description import Table
from .elements import Vector, Writer, cross, scalar_product
from .functions import SLOPE, VALUE, Tabulated, settled, smooth_minimum, tabulated
from .gravity import HERE
from .ready_made import HALF
from .sources import Sources
from .unevaluated import difference, inverted, negated, product, squared, total

NEWTON_STEPS = 4
NEAR = algebra.Integer(2)  # radii over a surface, within which Newton's steps know how it bends


@dataclass(frozen=True)
class Foot:
    """What is nearest on a surface: its distance, the unit normal there, and the directions along the surface."""

    away: algebra.Expr
    normal: Vector
    tangents: list[Vector]


class Surface:
    """A surface over the x-y plane of a frame, of planar models a curve over its x axis.

    Parameters
    ----------
    writer : Writer
    sources : Sources
    made : Definitions
        It grows.
    table, name : str
        Of what is on the surface: where errors are, and what names begin with.
    plane : str
        The frame.
    height : expression
        Of `here_x` and `here_y`.
    planar : bool
    tables : sequence of Table
        Of the model.
    """

    def __init__(
        self,
        writer: Writer,
        sources: Sources,
        made: Definitions,
        table: str,
        name: str,
        plane: str,
        height: algebra.Expr,
        planar: bool,
        tables: Sequence[Table] = (),
    ) -> None:
        self.writer, self.sources, self.made, self.table, self.name = writer, sources, made, table, name
        self.height, self.tables = height, tables
        self._about: tuple[Vector, Series] | None = (
            None  # a place and the power series there that stands for all
        )
        x, y, z = writer.directions(plane)
        self.origin = writer.origin(plane)
        self.axes, self.up = ([x], y) if planar else ([x, y], z)

    def point(self, place: Vector) -> Foot:
        """Below a point; its height, seen along the normal."""
        here, height = self._over(place)
        surface, slopes, _ = self._at(here)
        unit, normal, tangents = self._directions(slopes)
        return Foot(product([unit, difference(height, surface)]), normal, tangents)

    def ball(self, place: Vector, radius: algebra.Expr, signed: bool = False) -> Foot:
        """Below the middle of a ball.

        The distance is that to the foot, which is positive on both sides. Where the ball is held on the surface
        (`signed`) it is that along the normal, and there is no choice in it, which a series could not have.
        """
        here, height = self._over(place)
        if self.height.atoms(Tabulated):
            return self._ball_on_table(here, height, radius, signed)
        foot = self._foot(here, height, radius, signed)
        surface, slopes, _ = self._at(foot)
        above = difference(height, surface)
        aside = [difference(x, f) for x, f in zip(here, foot)]
        return self._away(aside, above, slopes, signed)

    def _away(self, aside: Vector, above: algebra.Expr, slopes: Vector, signed: bool) -> Foot:
        """How far from the foot a place is, that lies beside and above it by so much."""
        unit, normal, tangents = self._directions(slopes)
        if signed:
            along = [negated(product([s, x])) for s, x in zip(slopes, aside)]
            return Foot(product([unit, total([above, *along])]), normal, tangents)
        away = algebra.Pow(total([*map(squared, aside), squared(above)]), HALF, evaluate=False)
        return Foot(away, normal, tangents)

    def _ball_on_table(self, here: Vector, height: algebra.Expr, radius: algebra.Expr, signed: bool) -> Foot:
        """Below the middle of a ball, where the surface is a table.

        Newton's steps through a table would have derivatives as large as many tables. So the foot that they find is
        taken as a number, and the surface as its power series there; two steps of Newton's method from the number on
        that series have the foot's derivatives.
        """
        surface = self._seen_at_numbers()
        start = self._as_numbers(surface._foot(here, height, radius, signed), radius)
        series = surface._series(start)
        moved_by: Vector = [algebra.ZERO] * len(start)
        apart = [self.define(difference(f, x)) for f, x in zip(start, here)]
        for _ in range(2):
            level, slopes, bends = series.at(moved_by)
            below = self.define(difference(level, height))
            left = [
                self.define(total([a, m, product([below, s])])) for a, m, s in zip(apart, moved_by, slopes)
            ]
            matrix = self._bent(below, slopes, bends)
            moved_by = [
                self.define(difference(m, step)) for m, step in zip(moved_by, self._solved(matrix, left))
            ]
        level, slopes, _ = series.at(moved_by)
        aside = [negated(total([a, m])) for a, m in zip(apart, moved_by)]
        return self._away(aside, difference(height, level), slopes, signed)

    def rim(self, centre: Vector, radius: algebra.Expr, down: Vector, side: Vector) -> tuple[Vector, Foot]:
        """The arm from a wheel's centre to what touches, and what is below that.

        `down` and `side` are unit vectors in the wheel's plane: to what is deepest over the plane, and along it.
        """
        if not self.height.atoms(Tabulated):
            angle = self._deepest(centre, radius, down, side, algebra.ZERO, NEWTON_STEPS)
            outward, _ = self._turned(down, side, angle)
            return [product([radius, x]) for x in outward], self.point(self._moved(centre, outward, radius))
        # As of a ball: the angle and the place that are found are numbers, and the surface is its power series there.
        surface = self._seen_at_numbers()
        angle = surface._deepest(centre, radius, down, side, algebra.ZERO, NEWTON_STEPS)
        (angle,) = self._as_numbers([angle], algebra.ONE)
        outward, _ = self._turned(down, side, angle)
        here, _ = self._over(self._moved(centre, outward, radius))
        surface._about = (start := self._as_numbers(here, radius)), surface._series(start)
        angle = surface._deepest(centre, radius, down, side, angle, 2)
        outward, _ = self._turned(down, side, angle)
        return [product([radius, x]) for x in outward], surface.point(self._moved(centre, outward, radius))

    def _deepest(
        self,
        centre: Vector,
        radius: algebra.Expr,
        down: Vector,
        side: Vector,
        angle: algebra.Expr,
        steps: int,
    ) -> algebra.Expr:
        """The angle of the rim's point whose height over the surface is least, by Newton's steps from an angle."""
        for _ in range(steps):
            outward, onward = self._turned(down, side, angle)
            here, _ = self._over(self._moved(centre, outward, radius))
            _, slopes, bends = self._at(here)
            steep = [
                total([u, *(negated(product([s, axis[k]])) for s, axis in zip(slopes, self.axes))])
                for k, u in enumerate(self.up)
            ]
            along = [self.define(scalar_product(onward, axis)) for axis in self.axes]
            pairs = itertools.product(range(2), repeat=2)
            bent = total([product([bends[i][j], along[i], along[j]]) for i, j in pairs])
            rises = scalar_product(onward, steep)
            curves = negated(total([scalar_product(outward, steep), product([radius, bent])]))
            angle = self.define(difference(angle, product([rises, self.define(inverted(curves))])))
        return angle

    def _seen_at_numbers(self) -> Surface:
        """This surface with its tables looked at at numbers."""
        self._refuse_ends()
        surface = copy(self)
        surface.height = _without_pieces(self.height)
        return surface

    def _as_numbers(self, found: Vector, size: algebra.Expr) -> Vector:
        """What has been found, cut off at so small a part of a size that nothing is seen to change."""
        grain = self.define(product([algebra.Float(2.0**-40), size]))
        return [
            self.define(product([grain, settled(product([f, inverted(grain)]), evaluate=False)]))
            for f in found
        ]

    def define(self, expression: algebra.Expr) -> algebra.Expr:
        """An expression by a name, that it may stand in many places."""
        return define(self.writer, self.name, self.made, expression)

    def _over(self, place: Vector) -> tuple[Vector, algebra.Expr]:
        """Where over the plane a place is, and how high."""
        apart = [difference(p, o) for p, o in zip(place, self.origin, strict=True)]
        here = [self.define(scalar_product(apart, axis)) for axis in self.axes]
        return here, self.define(scalar_product(apart, self.up))

    def _at(self, place: Vector) -> tuple[algebra.Expr, Vector, list[Vector]]:
        """The height, its slopes and how they change at a place."""
        if self._about is not None:
            start, series = self._about
            return series.at([self.define(difference(x, s)) for x, s in zip(place, start)])
        from .slopes import slope  # SymPy takes longer to import than most models

        names = [algebra.Symbol(x) for x in HERE[: len(place)]]
        there = dict(zip(names, place, strict=True))

        def at(expression: algebra.Expr) -> algebra.Expr:
            return self.define(expression.xreplace(there))

        try:
            slopes = [slope(self.height, x) for x in names]
            bends = [[slope(s, x) for x in names] for s in slopes]
        except ModelError as error:
            raise self.sources.locate(error, self.table, "height") from None
        return at(self.height), [at(s) for s in slopes], [[at(b) for b in row] for row in bends]

    def _series(self, place: Vector) -> Series:
        """The surface about a place, up to the third power."""
        from .slopes import slope  # SymPy takes longer to import than most models

        names = [algebra.Symbol(x) for x in HERE[: len(place)]]
        there = dict(zip(names, place, strict=True))
        terms: dict[tuple[int, ...], algebra.Expr] = {(): self.height}
        for order in range(1, 4):
            for axes in itertools.combinations_with_replacement(range(len(place)), order):
                terms[axes] = slope(terms[axes[:-1]], names[axes[-1]])
        return Series(
            {axes: self.define(x.xreplace(there)) for axes, x in terms.items()}, len(place), self.define
        )

    def _directions(self, slopes: Vector) -> tuple[algebra.Expr, Vector, list[Vector]]:
        """How much of what is upright is along the normal, the normal, and the tangents."""
        axes, up = self.axes, self.up
        unit = self._upright(slopes)
        normal = [
            product([unit, total([u, *(negated(product([s, axis[k]])) for s, axis in zip(slopes, axes))])])
            for k, u in enumerate(up)
        ]
        tangents = [normalised([total([a, product([slopes[0], u])]) for a, u in zip(axes[0], up)])]
        if len(axes) == 2:
            tangents.append(cross(normal, tangents[0]))
        return unit, normal, tangents

    def _upright(self, slopes: Vector) -> algebra.Expr:
        """How much of the normal is upright."""
        steep = total([algebra.ONE, *map(squared, slopes)])
        return self.define(algebra.Pow(steep, -HALF, evaluate=False))

    def _foot(self, here: Vector, height: algebra.Expr, radius: algebra.Expr, held: bool) -> Vector:
        """Where the perpendicular from a place meets the surface: Newton's method for (f - x) + (h - z) dh/df = 0."""
        foot = here
        for _ in range(NEWTON_STEPS):
            surface, slopes, bends = self._at(foot)
            below = self.define(difference(surface, height))
            if held:  # as far below as it is where the ball touches
                near = self.define(negated(product([radius, self._upright(slopes)])))
            else:
                within = smooth_minimum(negated(below), product([NEAR, radius]), evaluate=False)
                near = self.define(negated(within))
            left = [
                self.define(total([difference(f, x), product([below, s])]))
                for f, x, s in zip(foot, here, slopes)
            ]
            matrix = self._bent(near, slopes, bends)
            foot = [self.define(difference(f, step)) for f, step in zip(foot, self._solved(matrix, left))]
        return foot

    def _bent(self, below: algebra.Expr, slopes: Vector, bends: list[Vector]) -> list[Vector]:
        """The derivative of (f - x) + (h - z) dh/df by f, where h - z is `below`."""
        axes = range(len(slopes))
        return [
            [
                self.define(
                    total([algebra.ONE if i == j else algebra.ZERO, product([slopes[i], slopes[j]]),
                           product([below, bends[i][j]])])
                )
                for j in axes
            ]
            for i in axes
        ]  # fmt: skip

    def _solved(self, matrix: list[Vector], right: Vector) -> Vector:
        """The solution of one or two equations; what divides has a name, so that it is one to all who look at it."""
        if len(right) == 1:
            return [product([right[0], self.define(inverted(matrix[0][0]))])]
        (a, b), (c, e) = matrix
        by = self.define(inverted(difference(product([a, e]), product([b, c]))))
        x, y = right
        return [
            product([by, difference(product([e, x]), product([b, y]))]),
            product([by, difference(product([a, y]), product([c, x]))]),
        ]

    def _refuse_ends(self) -> None:
        """Newton's steps may look where a table has no values."""
        used = {x.func.table for x in self.height.atoms(Tabulated)}
        for table in self.tables:
            if table.name in used and table.outside == "refuse":
                message = f"what touches is looked for beyond the ends of '{table.name}', which refuses that"
                raise self.sources.error(
                    self.table, "height", message, hint='give the table outside = "extend"'
                )

    def _turned(self, down: Vector, side: Vector, angle: algebra.Expr) -> tuple[Vector, Vector]:
        """The direction at an angle from `down` to `side`, and that in which it turns."""
        if angle.is_zero:
            return down, side
        c, s = (self.define(f(angle, evaluate=False)) for f in (algebra.cos, algebra.sin))
        outward = [total([product([c, d]), product([s, x])]) for d, x in zip(down, side)]
        onward = [difference(product([c, x]), product([s, d])) for d, x in zip(down, side)]
        return [self.define(x) for x in outward], [self.define(x) for x in onward]

    def _moved(self, place: Vector, along: Vector, by: algebra.Expr) -> Vector:
        return [self.define(x) for x in moved(place, along, by)]


@dataclass(frozen=True)
class Series:
    """A power series of one or two variables: derivatives by the numbers of the variables, in order."""

    terms: dict[tuple[int, ...], algebra.Expr]
    n: int
    define: Callable[[algebra.Expr], algebra.Expr]

    def at(self, moved_by: Vector) -> tuple[algebra.Expr, Vector, list[Vector]]:
        """The value, its slopes and how they change."""
        axes = range(self.n)
        bends = [[self._derivative((i, j), moved_by) for j in axes] for i in axes]
        return self._derivative((), moved_by), [self._derivative((i,), moved_by) for i in axes], bends

    def _derivative(self, by: tuple[int, ...], moved_by: Vector) -> algebra.Expr:
        parts = []
        for order in range(4 - len(by)):
            share = algebra.Rational(1, math.factorial(order))
            for more in itertools.product(range(self.n), repeat=order):
                parts.append(
                    product([share, self.terms[tuple(sorted((*by, *more)))], *(moved_by[k] for k in more)])
                )
        return self.define(total(parts))


def _without_pieces(height: algebra.Expr) -> algebra.Expr:
    """An expression with tables that steps do not end at the knots of: they are smooth, and looked at at numbers."""
    values = [x for x in height.atoms(Tabulated) if x.func.role == VALUE]
    plain = {x: tabulated(x.func.table, SLOPE, len(x.args))(*x.args, evaluate=False) for x in values}
    return height.xreplace(plain)


class Definitions(list[tuple[str, algebra.Expr]]):
    """Definitions that stand for parts of expressions, found by these."""

    def __init__(self) -> None:
        super().__init__()
        self._name: dict[algebra.Expr, str] = {}

    def name_of(self, expression: algebra.Expr) -> str | None:
        """The name of an expression that has one."""
        return self._name.get(expression)

    def add(self, name: str, expression: algebra.Expr) -> None:
        """Give an expression a name."""
        self._name[expression] = name
        self.append((name, expression))


def define(writer: Writer, name: str, made: Definitions, expression: algebra.Expr) -> algebra.Expr:
    """An expression by a name that begins with `name`, one of `made`, that it may stand in many places."""
    if expression.is_Number or isinstance(expression, algebra.Symbol):
        return expression
    known = made.name_of(expression)
    if known is None:
        number = itertools.count(len(made) + 1)
        known = next(x for k in number if (x := f"{name}_surface{k}") not in writer.taken)
        writer.taken.add(known)
        made.add(known, expression)
    return algebra.Symbol(known)


def moved(place: Vector, along: Vector, by: algebra.Expr) -> Vector:
    """A place that is moved along a direction."""
    return [total([p, product([by, a])]) for p, a in zip(place, along, strict=True)]


def normalised(vector: Vector) -> Vector:
    """A vector over its length."""
    length = algebra.Pow(total(map(squared, vector)), -HALF, evaluate=False)
    return [product([length, x]) for x in vector]
