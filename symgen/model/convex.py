"""Convex solids that touch each other: corners of each on the sides of the other.

A corner is outside of a convex solid by the largest of its distances from the planes of the sides, as with boxes. Which
side that is is found as numbers, and the distance is that from the chosen plane: no choice is differentiated.

Where edges cross, no corner says so. An edge that goes through the other solid is found by clipping (Cyrus, Beck,
Generalized two- and three-dimensional clipping, Comput. Graph. 3 (1978)), and a run ends with that reason.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from . import algebra
from .boxes import Block, Meeting
from .elements import Vector, scalar_product
from .functions import branch, smooth_minimum
from .mesh import Hull
from .surfaces import moved
from .unevaluated import difference, inverted, negated, product, total

MOST_LOOKED_AT = 1200  # places and edges on one side, times the sides of the other

_LEVEL = algebra.Float(1e-12)  # an edge [m] that is as level over a side goes through its plane nowhere

Define = Callable[[algebra.Expr], algebra.Expr]


@dataclass(frozen=True)
class Convex:
    """A convex solid: world coordinates of its origin and axes; what it is made of is in these axes.

    `sides` are normals and how far the planes are from the origin, `edges` the numbers of two corners each, `least` is
    how deep its middle lies; `hull` is the mesh's, in numbers, None of a box.
    """

    place: Vector
    axes: list[Vector]
    points: list[Vector]
    sides: list[tuple[Vector, algebra.Expr]]
    edges: list[tuple[int, int]]
    least: algebra.Expr
    hull: Hull | None = None

    @classmethod
    def of_hull(cls, place: Vector, axes: list[Vector], hull: Hull) -> Convex:
        """The hull of a mesh."""
        points = [list(map(algebra.Float, map(float, corner))) for corner in hull.corners]
        sides = [(list(map(algebra.Float, map(float, n))), algebra.Float(float(d))) for n, d in hull.sides]
        middle = hull.corners.mean(axis=0)
        least = algebra.Float(float(min(d - n @ middle for n, d in hull.sides)))
        return cls(place, axes, points, sides, hull.edges, least, hull)

    @classmethod
    def of_block(cls, block: Block) -> Convex:
        """A box in space."""
        signs = list(itertools.product((-1, 1), repeat=3))
        points = [[product([algebra.Integer(s), h]) for s, h in zip(of, block.halves)] for of in signs]
        sides = [
            ([algebra.Integer(s if k == i else 0) for k in range(3)], half)
            for i, half in enumerate(block.halves)
            for s in (-1, 1)
        ]
        pairs = itertools.combinations(range(8), 2)
        edges = [(j, k) for j, k in pairs if np.count_nonzero(np.subtract(signs[j], signs[k])) == 1]
        return cls(block.place, block.axes, points, sides, edges, reduce(_smaller, block.halves))

    def corners(self) -> list[Vector]:
        """World coordinates of its corners."""
        return [self.at(point) for point in self.points]

    def at(self, point: Vector) -> Vector:
        """World coordinates of a point in its axes."""
        place = self.place
        for axis, x in zip(self.axes, point, strict=True):
            place = moved(place, axis, x)
        return place


def looked_at(a: Convex, b: Convex) -> int:
    """How many distances from planes two solids take, and how many clips."""
    return (len(a.points) + len(a.edges)) * len(b.sides) + len(b.points) * len(a.sides)


class Solids:
    """Two convex solids.

    Parameters
    ----------
    a, b : Convex
    define : callable
        Gives an expression a name.
    tangents : callable
        Gives two directions at right angles to a normal.
    """

    def __init__(
        self, a: Convex, b: Convex, define: Define, tangents: Callable[[Vector], list[Vector]]
    ) -> None:
        self.a, self.b, self.define, self.tangents = a, b, define, tangents
        apart = [define(difference(x, y)) for x, y in zip(a.place, b.place, strict=True)]
        cosines = [[define(scalar_product(e, f)) for f in b.axes] for e in a.axes]
        along_a = [define(negated(scalar_product(apart, e))) for e in a.axes]  # of the second, from the first
        along_b = [define(scalar_product(apart, f)) for f in b.axes]
        columns = [list(column) for column in zip(*cosines)]
        self.a_in_b = [self._seen(point, along_b, columns) for point in a.points]
        self.b_in_a = [self._seen(point, along_a, cosines) for point in b.points]
        self.a_from_b = [self._distances(place, b) for place in self.a_in_b]

    def corners(self) -> Iterator[Meeting]:
        """Those of each on the sides of the other."""
        for own, other, places in ((self.a, self.b, self.a_in_b), (self.b, self.a, self.b_in_a)):
            for point, place in zip(own.points, places, strict=True):
                *normal, offset = self._nearest_side(self._distances(place, other), other)
                gap = self.define(difference(scalar_product(place, normal), offset))
                towards = [scalar_product(normal, column) for column in zip(*other.axes)]
                yield Meeting(gap, own.at(point), self.tangents(towards))

    def crossed(self, gaps: Sequence[algebra.Expr], share: algebra.Expr) -> algebra.Expr:
        """What falls below zero where an edge of the first goes through the second, deeper than corners are in it.

        `gaps` are those of the corners; the depth is a `share` of the least half thickness.
        """
        pressed = negated(reduce(_smaller, gaps, algebra.ZERO))
        depth = self.define(total([pressed, product([share, _smaller(self.a.least, self.b.least)])]))
        sunk = [[self.define(total([x, depth])) for x in distances] for distances in self.a_from_b]
        return reduce(_smaller, [self._clipped(sunk[j], sunk[k]) for j, k in self.a.edges])

    def _clipped(self, start: Sequence[algebra.Expr], end: Sequence[algebra.Expr]) -> algebra.Expr:
        """Where an edge goes in less where it goes out, in parts of it; negative as far as it is inside."""
        into, out = algebra.ZERO, algebra.ONE
        for x, y in zip(start, end, strict=True):
            rise = self.define(difference(y, x))
            at = self.define(product([x, inverted(_larger(_larger(rise, negated(rise)), _LEVEL))]))
            into = self.define(_larger(into, branch(rise, at, algebra.ZERO, evaluate=False)))
            out = self.define(_smaller(out, branch(rise, algebra.ONE, negated(at), evaluate=False)))
        return self.define(difference(into, out))

    def _seen(self, point: Vector, middle: Vector, rows: Sequence[Vector]) -> Vector:
        """A point of one solid in the axes of the other."""
        return [
            self.define(total([m, scalar_product(point, row)])) for m, row in zip(middle, rows, strict=True)
        ]

    def _distances(self, place: Vector, of: Convex) -> list[algebra.Expr]:
        return [self.define(difference(scalar_product(place, normal), d)) for normal, d in of.sides]

    def _nearest_side(self, distances: Sequence[algebra.Expr], of: Convex) -> list[algebra.Expr]:
        """The normal and the offset of the side that a place is farthest outside of."""
        (normal, offset), largest = of.sides[0], distances[0]
        chosen = [*normal, offset]
        for (normal, offset), distance in zip(of.sides[1:], distances[1:], strict=True):
            more = self.define(difference(largest, distance))
            chosen = [
                x if x == y else self.define(branch(more, x, y, evaluate=False))
                for x, y in zip([*normal, offset], chosen, strict=True)
            ]
            largest = self.define(_larger(largest, distance))
        return chosen


def _smaller(x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
    return smooth_minimum(x, y, evaluate=False)


def _larger(x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
    return negated(_smaller(negated(x), negated(y)))
