"""Edges of boxes that cross: where two planks lie across each other, no corner of one is on a side of the other.

Boxes that touch face each other along the normal by which they are farthest apart (`boxes.py`), each with the side
that is most at right angles to it. Where the outlines of these two sides cross, an edge of one rests on an edge of the
other: each of four edges may cross each of four, which makes sixteen gaps. A gap is that of the same two edges while
the sides change that face each other, as where a plank tips over an edge by more than 45 degrees: the twelve edges of a
box are taken three by three, no two of which belong to one side, so that each side has one edge of each three. Which
one that is is found as numbers, and the distance of two edges, along their cross product, is written out for that pair
alone. So nothing that was compared is differentiated.

Beyond the end of an edge a gap grows as sqrt(r² + x²) - r, with a small r, and so from zero: what slides over the end
of an edge, at no height, does not hit anything there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from . import algebra
from .boxes import Boxes, Meeting
from .elements import Vector, cross, scalar_product
from .ready_made import HALF
from .segments import SIDES_OF_SKEW_EDGES, Nearest, Number
from .surfaces import moved
from .unevaluated import difference, inverted, negated, product, squared, total

_PARALLEL = algebra.Float(1e-6)  # square of the sine of the angle between edges that cross nowhere
_STEEP = algebra.Float(
    0.25
)  # square of the cosine from the sides' normal, of which that of two edges has half or more


@dataclass(frozen=True)
class _Edge:
    """An edge of the side that faces the other box: its direction and its middle, from that of the first box."""

    along: Vector
    middle: Vector
    half: algebra.Expr


class CrossingEdges:
    """The places where edges of two boxes in space cross.

    Vectors are in the axes of the first box.

    Parameters
    ----------
    boxes : Boxes
    share : Expr
        Edges that are deeper in each other than twice this part of the least half edge are no pair.
    """

    def __init__(self, boxes: Boxes, share: algebra.Expr) -> None:
        self.boxes, self.define = boxes, boxes.define
        self.nearest = Nearest(self.define)
        self.least = self.define(product([share, boxes.least]))
        self.facing, of_other = boxes.facing
        self.own = [_Edge(*edge) for edge in self._edges(self.facing, boxes.a.halves)]
        self.others = [
            _Edge(self._turned(along), self._turned(middle, boxes.along_a), half)
            for along, middle, half in self._edges(of_other, boxes.b.halves)
        ]

    def meetings(self) -> Iterator[Meeting]:
        """The sixteen of them."""
        for own in self.own:
            for other in self.others:
                yield self._meeting(own, other)

    def _edges(
        self, facing: Sequence[Number], halves: Sequence[algebra.Expr]
    ) -> Iterator[tuple[Vector, Vector, algebra.Expr]]:
        """Direction, middle and half length of the four edges of a side, in the box's own axes."""
        for three in SIDES_OF_SKEW_EDGES:
            # Of the two sides of an edge only one can be the facing one, and of the three edges one has it.
            along = [
                self.nearest.settle(
                    total(
                        product([HALF, x, total([x, side])])
                        for x, side in zip(facing, sides, strict=True)
                        if side != algebra.ZERO
                    )
                )
                for sides in three
            ]
            middle = [
                self.define(product([half, scalar_product(along, column)]))
                for half, column in zip(halves, zip(*three), strict=True)
            ]
            yield along, middle, self.define(scalar_product(along, halves))

    def _turned(self, vector: Vector, off: Vector | None = None) -> Vector:
        """A vector in the axes of the second box, seen in those of the first, less another there."""
        found = [scalar_product(row, vector) for row in self.boxes.cosines]
        found = found if off is None else [difference(x, y) for x, y in zip(found, off, strict=True)]
        return [self.define(x) for x in found]

    def _meeting(self, own: _Edge, other: _Edge) -> Meeting:
        """Where an edge of the first crosses one of the second.

        Whether they are a pair, to which side the second is, and which ends the place is beyond are numbers.
        """
        define, nearest, boxes = self.define, self.nearest, self.boxes
        apart = [define(difference(x, y)) for x, y in zip(other.middle, own.middle, strict=True)]
        normal = [define(x) for x in cross(own.along, other.along)]
        cosine, ahead, behind = (
            define(scalar_product(*pair))
            for pair in ((own.along, other.along), (own.along, apart), (other.along, apart))
        )
        square = define(difference(algebra.ONE, squared(cosine)))
        up, height = define(scalar_product(self.facing, normal)), define(scalar_product(normal, apart))
        sense = nearest.number(up, algebra.NEGATIVE_ONE, algebra.ONE)
        first, second = (
            difference(ahead, product([cosine, behind])),
            difference(product([cosine, ahead]), behind),
        )
        lengths = own.half, other.half
        by = define(inverted(nearest.larger(square, _PARALLEL)))
        deep = product([sense, height, algebra.Pow(by, HALF, evaluate=False)])
        bounds = [
            negated(total([deep, self.least, self.least])),
            difference(_PARALLEL, square),
            difference(product([_STEEP, square]), squared(up)),
        ]
        ends, between = [], []
        for x, half in zip((first, second), lengths, strict=True):
            x = define(product([by, x]))
            past = nearest.number(difference(self._size(x), half), algebra.ZERO, algebra.ONE)
            ends.append(nearest.settle(product([past, nearest.number(x, algebra.NEGATIVE_ONE, algebra.ONE)])))
            between.append(difference(algebra.ONE, past))
        # Past an end a line that is lower than the other says nothing.
        counts = nearest.settle(nearest.number(deep, product(between), algebra.ONE))
        is_pair = define(product([nearest.number(x, algebra.ONE, algebra.ZERO) for x in bounds]))
        is_pair = nearest.settle(is_pair)
        none = difference(algebra.ONE, is_pair)
        by = define(inverted(total([square, none])))
        root = define(algebra.Pow(by, HALF, evaluate=False))
        s, t = (define(product([by, x])) for x in (first, second))
        gap = product([counts, sense, root, height])
        for x, end, half in zip((s, t), ends, lengths, strict=True):
            beyond = difference(product([end, x]), product([squared(end), half]))
            gap = total([gap, self._rounded(define(product([inverted(root), beyond])))])
        gap = total([product([is_pair, gap]), product([none, self._far()])])
        along, across = own.along, cross(own.along, [product([root, x]) for x in normal])
        there, tangents = boxes.a.place, [[algebra.ZERO] * 3, [algebra.ZERO] * 3]
        for axis, m, e, f in zip(boxes.a.axes, own.middle, along, across, strict=True):
            there = moved(there, axis, total([m, product([s, e])]))
            tangents = [moved(tangent, axis, x) for tangent, x in zip(tangents, (e, f), strict=True)]
        return Meeting(define(gap), there, tangents)

    def _rounded(self, x: algebra.Expr) -> algebra.Expr:
        r = self.least
        return difference(algebra.Pow(total([squared(r), squared(x)]), HALF, evaluate=False), r)

    def _far(self) -> algebra.Expr:
        """A gap where there is no pair."""
        return self.define(total([*self.boxes.a.halves, *self.boxes.b.halves]))

    def _size(self, x: algebra.Expr) -> algebra.Expr:
        return self.define(self.nearest.larger(x, negated(x)))
