"""Boxes that touch each other: corners of each on the sides of the other.

In the axes of a box a point is outside by the largest of |x| - h, y and z likewise, which ends at the box's edges,
other than a plane. That is all where boxes touch with a corner. Where edges cross, as of two planks, it is not
(`crossing_edges.py`).

Two boxes are apart by the largest of their distances along 15 directions: the normals of both, and the cross products
of their edges (Gottschalk, Lin, Manocha, OBBTree, SIGGRAPH 1996), but for edges that are all but parallel. Where that
says that they are in each other, and no corner and no edge does, a run ends with that reason.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

from . import algebra
from .elements import Vector, scalar_product
from .functions import branch, smooth_minimum
from .ready_made import HALF
from .segments import SIDES, Nearest, Number
from .surfaces import moved
from .unevaluated import difference, negated, product, squared, total

_PARALLEL = algebra.Float(1e-6)  # square of the sine of the angle between edges that are no pair
# By which part of the least half edge boxes that are rigid may be in each other, and by which those that give way.
RIGID_SHARE, SOFT_SHARE = algebra.Float(1e-3), algebra.Float(0.05)

Define = Callable[[algebra.Expr], algebra.Expr]


@dataclass(frozen=True)
class Block:
    """A box: the world coordinates of its middle and of its axes, half its edges."""

    place: Vector
    axes: list[Vector]
    halves: list[algebra.Expr]

    def corners(self) -> Iterator[tuple[Vector, tuple[algebra.Expr, ...]]]:
        """Its corners, and on which sides they are."""
        for sides in itertools.product(SIDES, repeat=len(self.halves)):
            yield self.at(sides), sides

    def at(self, sides: Sequence[algebra.Expr]) -> Vector:
        """The place that is so many half edges from the middle."""
        place = self.place
        for side, axis, half in zip(sides, self.axes, self.halves, strict=True):
            place = place if side == algebra.ZERO else moved(place, axis, product([side, half]))
        return place

    def middles(self) -> Iterator[Vector]:
        """Those of its edges and sides."""
        for sides in itertools.product(
            (algebra.NEGATIVE_ONE, algebra.ZERO, algebra.ONE), repeat=len(self.halves)
        ):
            if algebra.ZERO in sides and any(side != algebra.ZERO for side in sides):
                yield self.at(sides)

    @property
    def least(self) -> algebra.Expr:
        """The least half edge."""
        return reduce(smaller, self.halves)


@dataclass(frozen=True)
class Meeting:
    """One place where two boxes may touch: the gap, where, and the directions along the surface."""

    gap: algebra.Expr
    place: Vector
    tangents: list[Vector]


class Boxes:
    """Two boxes.

    Parameters
    ----------
    a, b : Block
        Of two edges each in a plane, of three in space.
    define : callable
        Gives an expression a name.
    """

    def __init__(self, a: Block, b: Block, define: Define) -> None:
        self.a, self.b, self.define = a, b, define
        apart = [define(difference(x, y)) for x, y in zip(a.place, b.place, strict=True)]
        self.cosines = [[define(scalar_product(e, f)) for f in b.axes] for e in a.axes]
        self.along_a = [define(scalar_product(apart, e)) for e in a.axes]
        self.along_b = [define(scalar_product(apart, f)) for f in b.axes]

    def corners(self) -> Iterator[Meeting]:
        """Those of each on the sides of the other; in space of two that are opposite to each other the facing one."""
        columns = [list(column) for column in zip(*self.cosines)]
        from_a = [negated(x) for x in self.along_a]
        facing = self.facing if len(self.a.halves) == 3 else (None, None)
        for own, other, middle, cosines, towards in (
            (self.a, self.b, self.along_b, columns, facing[0]),
            (self.b, self.a, from_a, self.cosines, facing[1]),
        ):
            for place, sides in own.corners() if towards is None else self._on_side(own, towards):
                here = [
                    total([x, *(product([s, h, c]) for s, h, c in zip(sides, own.halves, row))])
                    for x, row in zip(middle, cosines, strict=True)
                ]
                outside = [
                    self.define(difference(self._size(x), h)) for x, h in zip(here, other.halves, strict=True)
                ]
                gap = reduce(_larger, outside)
                yield Meeting(gap, place, self._along_sides(outside, other.axes))

    def _on_side(
        self, own: Block, facing: Sequence[Number]
    ) -> Iterator[tuple[Vector, tuple[algebra.Expr, ...]]]:
        """The corners of a side as `Block.corners` has them: each is of two that are opposite to each other."""
        for signs in itertools.product([algebra.ONE], SIDES, SIDES):
            towards = Nearest(self.define).settle(scalar_product(signs, facing))
            sides = tuple(product([towards, sign]) for sign in signs)
            yield own.at(sides), sides

    def crossed(self, gaps: Sequence[algebra.Expr], share: algebra.Expr) -> algebra.Expr:
        """What falls to zero where the boxes are deeper in each other than their corners are.

        `gaps` are those of the corners; what the two may differ by is a `share` of the least half edge.
        """
        apart = reduce(_larger, self.sides_apart)
        if len(self.a.halves) == 3:
            apart = _larger(apart, reduce(_larger, self.edges_apart))
        pressed = negated(reduce(smaller, gaps, algebra.ZERO))
        return total([apart, pressed, product([share, self.least])])

    @cached_property
    def least(self) -> algebra.Expr:
        """The least half edge of both."""
        return self.define(reduce(smaller, (*self.a.halves, *self.b.halves)))

    @cached_property
    def sides_apart(self) -> list[algebra.Expr]:
        """How far the boxes are apart along the normals of the first, and of the second."""
        columns = zip(*self.cosines)
        return [
            self.define(
                total(
                    [
                        self._size(x),
                        negated(own),
                        *(negated(product([h, self._size(c)])) for h, c in zip(halves, row)),
                    ]
                )
            )
            for middle, halves_own, halves, rows in (
                (self.along_a, self.a.halves, self.b.halves, self.cosines),
                (self.along_b, self.b.halves, self.a.halves, columns),
            )
            for x, own, row in zip(middle, halves_own, rows)
        ]

    @cached_property
    def edges_apart(self) -> list[algebra.Expr]:
        """How far the boxes are apart along the cross product of an edge of the first and one of the second."""
        found = []
        for i, j in itertools.product(range(3), repeat=2):
            reach, square = self._between(i, j)
            found.append(self.define(product([reach, algebra.Pow(square, -HALF, evaluate=False)])))
        return found

    @cached_property
    def facing(self) -> tuple[list[Number], list[Number]]:
        """The sides of both that face each other, in space: their outward normals, each in its box's own axes.

        Boxes that touch face each other along the direction by which they are farthest apart, each with the side that
        is most at right angles to it; what touches is on these.
        """
        normal = self._normal()
        seen = [self.define(scalar_product(normal, column)) for column in zip(*self.cosines)]
        return self._facing(normal, algebra.ONE), self._facing(seen, algebra.NEGATIVE_ONE)

    def _normal(self) -> Vector:
        """The direction by which the boxes are farthest apart, from the first to the second."""
        nearest = Nearest(self.define)
        away = [negated(x) for x in self.along_a]
        directions = [[algebra.ONE if k == i else algebra.ZERO for k in range(3)] for i in range(3)]
        directions += [list(column) for column in zip(*self.cosines)]
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                n = [algebra.ZERO] * 3
                n[k], n[m] = negated(self.cosines[m][j]), self.cosines[k][j]
                directions.append(n)
        best, chosen = None, None
        for value, n in zip([*self.sides_apart, *self.edges_apart], directions, strict=True):
            if best is None:
                best, chosen = value, n
                continue
            less = self.define(difference(best, value))
            chosen = [nearest.number(less, x, y) for x, y in zip(n, chosen, strict=True)]
            best = self.define(nearest.larger(best, value))
        towards = nearest.number(self.define(scalar_product(chosen, away)), algebra.NEGATIVE_ONE, algebra.ONE)
        return [self.define(product([towards, x])) for x in chosen]

    def _facing(self, normal: Vector, towards: algebra.Expr) -> list[Number]:
        """The outward normal, in a box's own axes, of its side that is most at right angles to a direction."""
        nearest, sizes = Nearest(self.define), [self._size(x) for x in normal]
        second = nearest.number(difference(sizes[0], sizes[1]), algebra.ONE, algebra.ZERO)
        largest = self.define(nearest.larger(sizes[0], sizes[1]))
        third = nearest.number(difference(largest, sizes[2]), algebra.ONE, algebra.ZERO)
        rest, first = difference(algebra.ONE, third), difference(algebra.ONE, second)
        which = [product([rest, first]), product([rest, second]), third]
        sign = nearest.number(self.define(scalar_product(which, normal)), algebra.NEGATIVE_ONE, algebra.ONE)
        return [nearest.settle(product([towards, sign, x])) for x in which]

    def _between(self, i: int, j: int) -> tuple[algebra.Expr, algebra.Expr]:
        """How far the boxes are apart along the cross product of two edges, times its length, and that squared."""
        (k, m), (l, n) = ([(x + 1) % 3, (x + 2) % 3] for x in (i, j))
        c, a, b = self.cosines, self.a.halves, self.b.halves
        offset = self.define(
            difference(product([c[k][j], self.along_a[m]]), product([c[m][j], self.along_a[k]]))
        )
        reach = [
            product([h, self._size(x)])
            for h, x in ((a[k], c[m][j]), (a[m], c[k][j]), (b[l], c[i][n]), (b[n], c[i][l]))
        ]
        raw = self.define(total([self._size(offset), *map(negated, reach)]))
        square = self.define(difference(algebra.ONE, squared(c[i][j])))
        none = self.define(negated(total([*a, *b])))
        return tuple(self._chosen(difference(square, _PARALLEL), [none, algebra.ONE], [raw, square]))

    def _along_sides(self, outside: Sequence[algebra.Expr], axes: Sequence[Vector]) -> list[Vector]:
        """The directions along the side that is the nearest one."""
        if len(axes) == 2:
            x, y = axes
            return [self._chosen(difference(outside[0], outside[1]), x, y)]
        nearer = [self.define(difference(outside[k], outside[(k + 1) % 3])) for k in range(3)]
        of_side = [[axes[(k + 1) % 3], axes[(k + 2) % 3]] for k in range(3)]
        return [
            self._chosen(
                nearer[0],
                self._chosen(nearer[1], of_side[2][k], of_side[1][k]),
                self._chosen(nearer[2], of_side[0][k], of_side[2][k]),
            )
            for k in range(2)
        ]

    def _chosen(self, x: algebra.Expr, below: Vector, above: Vector) -> Vector:
        return [
            p if p == q else self.define(branch(x, p, q, evaluate=False))
            for p, q in zip(below, above, strict=True)
        ]

    def _sign(self, x: algebra.Expr) -> algebra.Expr:
        return self.define(branch(x, algebra.NEGATIVE_ONE, algebra.ONE, evaluate=False))

    def _size(self, x: algebra.Expr) -> algebra.Expr:
        """The magnitude of a number, at whose kink nothing happens."""
        return self.define(_larger(x, negated(x)))


def smaller(x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
    return smooth_minimum(x, y, evaluate=False)


def _larger(x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
    return negated(smaller(negated(x), negated(y)))
