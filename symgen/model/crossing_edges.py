"""Edges of boxes that cross: where two planks lie across each other, no corner of one is on a side of the other.

Boxes that touch face each other along the normal by which they are farthest apart (`boxes.py`), each with the side
that is most at right angles to it. Where the outlines of these two sides cross, an edge of one rests on an edge of the
other. Each of the four edges of the first side crosses the other outline twice at most, on the way in and on the way
out: eight gaps. Of each, which edge it meets is found as numbers, and the distance of the two edges, along their cross
product, is written out for that pair alone. So nothing that was compared is differentiated.

Beyond the end of an edge a gap grows as sqrt(r² + x²) - r, with a small r, and so from zero: what slides over the end
of an edge, at no height, does not hit anything there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from . import algebra
from .boxes import Boxes, Meeting
from .elements import Vector
from .ready_made import HALF
from .segments import SIDES, Nearest, Number
from .surfaces import moved
from .unevaluated import difference, inverted, negated, product, squared, total

_PARALLEL = algebra.Float(1e-6)  # square of the sine of the angle between edges that cross nowhere
_STEEP = algebra.Float(
    0.25
)  # square of the cosine from the sides' normal, of which that of two edges has half or more


@dataclass(frozen=True)
class _Side:
    """A box as its facing side sees it: which of its axes are along the side (two), and which is its normal (last).

    `order` are rows of numbers that choose the axes, `sign` says to which end of the last one the side is.
    """

    order: list[list[Number]]
    sign: Number
    halves: list[algebra.Expr]

    @property
    def height(self) -> algebra.Expr:
        """Of the side along the last axis."""
        return product([self.sign, self.halves[2]])


class CrossingEdges:
    """The places where edges of two boxes in space cross.

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
        normal = self._normal()
        self.a = self._side(normal, boxes.a.halves, algebra.ONE)
        seen = [self.define(_dot(normal, column)) for column in zip(*boxes.cosines)]
        self.b = self._side(seen, boxes.b.halves, algebra.NEGATIVE_ONE)
        rows = [self._ordered(self.a, column) for column in zip(*boxes.cosines)]
        # cosines[x][y] of the axis x of the first with the axis y of the second, in the order of the sides
        self.cosines = [self._ordered(self.b, [row[x] for row in rows]) for x in range(3)]
        from_a = [negated(x) for x in self._ordered(self.a, boxes.along_a)]
        self.from_b = [negated(x) for x in self._ordered(self.b, boxes.along_b)]
        self.facing = [
            self.define(total([d, product([self.b.height, row[2]])]))
            for d, row in zip(from_a, self.cosines, strict=True)
        ]
        self.axes = [
            self._ordered(self.a, [axis[k] for axis in boxes.a.axes]) for k in range(3)
        ]  # component, axis

    def meetings(self) -> Iterator[Meeting]:
        """The eight of them."""
        for i in range(2):
            for side in SIDES:
                for turn in SIDES:
                    yield self._meeting(i, side, turn)

    def _normal(self) -> Vector:
        """The direction by which the boxes are farthest apart, from the first to the second in the first one's axes."""
        nearest, boxes = self.nearest, self.boxes
        away = [negated(x) for x in boxes.along_a]
        directions = [[algebra.ONE if k == i else algebra.ZERO for k in range(3)] for i in range(3)]
        directions += [list(column) for column in zip(*boxes.cosines)]
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                n = [algebra.ZERO] * 3
                n[k], n[m] = negated(boxes.cosines[m][j]), boxes.cosines[k][j]
                directions.append(n)
        best, chosen = None, None
        for value, n in zip([*boxes.sides_apart, *boxes.edges_apart], directions, strict=True):
            if best is None:
                best, chosen = value, n
                continue
            less = self.define(difference(best, value))
            chosen = [nearest.number(less, x, y) for x, y in zip(n, chosen, strict=True)]
            best = self.define(nearest.larger(best, value))
        towards = nearest.number(self.define(_dot(chosen, away)), algebra.NEGATIVE_ONE, algebra.ONE)
        return [self.define(product([towards, x])) for x in chosen]

    def _side(self, normal: Vector, halves: Sequence[algebra.Expr], towards: algebra.Expr) -> _Side:
        nearest, sizes = self.nearest, [self._size(x) for x in normal]
        second = nearest.number(difference(sizes[0], sizes[1]), algebra.ONE, algebra.ZERO)
        largest = self.define(nearest.larger(sizes[0], sizes[1]))
        third = nearest.number(difference(largest, sizes[2]), algebra.ONE, algebra.ZERO)
        rest = difference(algebra.ONE, third)
        first = difference(algebra.ONE, second)
        which = [
            nearest.settle(product([rest, first])),
            nearest.settle(product([rest, second])),
            nearest.settle(third),
        ]
        order = [which[-1:] + which[:-1], which[-2:] + which[:-2], which]
        along = self.define(_dot(which, normal))
        sign = nearest.settle(product([towards, nearest.number(along, algebra.NEGATIVE_ONE, algebra.ONE)]))
        made = _Side(order, sign, [])
        return _Side(order, sign, self._ordered(made, halves))

    def _ordered(self, side: _Side, vector: Sequence[algebra.Expr]) -> Vector:
        return [self.define(_dot(row, vector)) for row in side.order]

    def _meeting(self, i: int, side: algebra.Expr, turn: algebra.Expr) -> Meeting:
        """Where an edge of the first goes in (`turn` -1) or out: along its axis `i`, on one of two sides."""
        a, b, c, nearest = self.a, self.b, self.cosines, self.nearest
        k = 1 - i
        place = (
            [algebra.ZERO, product([side, a.halves[1]])]
            if i == 0
            else [product([side, a.halves[0]]), algebra.ZERO]
        )
        start = [self.define(difference(d, p)) for d, p in zip(self.facing, [*place, a.height], strict=True)]
        found = []
        for j in range(2):
            # Which of two edges goes in: the outward direction of the outline there is against that of the edge.
            beta = product([turn, nearest.number(c[i][1 - j], algebra.NEGATIVE_ONE, algebra.ONE)])
            along, other = ([row[x] for row in c] for x in (j, 1 - j))
            reach = product([beta, b.halves[1 - j]])
            apart = [self.define(total([d, product([reach, x])])) for d, x in zip(start, other, strict=True)]
            found.append((*self._looked_at(i, j, along, apart), beta))
        chosen = self._chosen(found)
        return self._of_pair(i, k, start, place, *chosen)

    def _looked_at(
        self, i: int, j: int, along: Vector, apart: Vector
    ) -> tuple[algebra.Expr, Number, Number, Number, Number]:
        """Of a pair of edges as numbers: the gap, whether they are a pair, its sense, and which ends it is beyond."""
        nearest, define, boxes = self.nearest, self.define, self.boxes
        k, up = 1 - i, along[1 - i]
        cosine = along[i]
        square = define(difference(algebra.ONE, squared(cosine)))
        safe = define(inverted(nearest.larger(square, _PARALLEL)))
        lean = product([apart[k], along[2]])
        sense = nearest.number(product([self.a.sign, up]), algebra.NEGATIVE_ONE, algebra.ONE)
        away = define(
            product(
                [sense, difference(product([apart[2], up]), lean), algebra.Pow(safe, HALF, evaluate=False)]
            )
        )
        behind = define(_dot(along, apart))
        s = define(product([safe, difference(apart[i], product([cosine, behind]))]))
        t = define(product([safe, difference(product([cosine, apart[i]]), behind)]))
        ends, near = [], algebra.ONE
        gap = away
        for x, half in ((s, self.a.halves[i]), (t, self.b.halves[j])):
            beyond = define(difference(self._size(x), half))
            past = nearest.number(beyond, algebra.ZERO, algebra.ONE)
            ends.append(product([past, nearest.number(x, algebra.NEGATIVE_ONE, algebra.ONE)]))
            gap = total([gap, product([past, beyond])])
            near = product([near, nearest.number(difference(beyond, boxes.least), algebra.ONE, algebra.ZERO)])
        is_pair = nearest.number(total([away, self.least, self.least]), algebra.ZERO, algebra.ONE)
        steep = difference(squared(up), product([_STEEP, square]))
        for bound in (difference(square, _PARALLEL), steep):
            is_pair = product([is_pair, nearest.number(bound, algebra.ZERO, algebra.ONE)])
        return define(gap), define(product([is_pair, near])), sense, *ends

    def _chosen(self, found: Sequence[tuple]) -> list[Number]:
        """Which of two pairs of edges is nearer: 0 or 1, and what is known of it."""
        (gap, pair, *one), (other_gap, other_pair, *two) = found
        nearest = self.nearest
        far = self._far()
        values = [
            self.define(total([product([is_pair, x]), product([difference(algebra.ONE, is_pair), far])]))
            for is_pair, x in ((pair, gap), (other_pair, other_gap))
        ]
        return nearest.least(values, [[algebra.ZERO, pair, *one], [algebra.ONE, other_pair, *two]])

    def _of_pair(
        self,
        i: int,
        k: int,
        start: Vector,
        place: Vector,
        which: Number,
        is_pair: Number,
        sense: Number,
        end: Number,
        other_end: Number,
        beta: Number,
    ) -> Meeting:
        """The gap of one pair of edges, in closed form."""
        define, b = self.define, self.b
        rest = difference(algebra.ONE, which)

        def mixed(x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
            return define(total([product([rest, x]), product([which, y])]))

        along = [mixed(row[0], row[1]) for row in self.cosines]
        across = [mixed(row[1], row[0]) for row in self.cosines]
        half, reach = (
            mixed(b.halves[0], b.halves[1]),
            define(product([beta, mixed(b.halves[1], b.halves[0])])),
        )
        apart = [define(total([d, product([reach, x])])) for d, x in zip(start, across, strict=True)]
        cosine, up = along[i], along[k]
        none = difference(algebra.ONE, is_pair)
        # Edges that are no pair may be parallel; what is made of them counts for nothing.
        by = define(inverted(total([algebra.ONE, negated(squared(cosine)), none])))
        root = define(algebra.Pow(by, HALF, evaluate=False))
        sine = define(inverted(root))
        away = product([sense, root, difference(product([apart[2], up]), product([apart[k], along[2]]))])
        behind = define(_dot(along, apart))
        s = define(product([by, difference(apart[i], product([cosine, behind]))]))
        t = define(product([by, difference(product([cosine, apart[i]]), behind)]))
        beyond = [
            self._rounded(product([sine, difference(product([e, x]), product([squared(e), h]))]))
            for e, x, h in ((end, s, self.a.halves[i]), (other_end, t, half))
        ]
        gap = total([product([is_pair, total([away, *beyond])]), product([none, self._far()])])
        at = [*place, self.a.height]
        at[i] = s
        there = self.boxes.a.place
        for x in range(3):
            there = moved(there, [row[x] for row in self.axes], at[x])
        side = [product([root, x]) for x in (up, along[2])]
        tangents = [[row[i] for row in self.axes], [_dot(side, (row[k], row[2])) for row in self.axes]]
        return Meeting(define(gap), there, tangents)

    def _rounded(self, x: algebra.Expr) -> algebra.Expr:
        r = self.least
        return difference(algebra.Pow(total([squared(r), squared(x)]), HALF, evaluate=False), r)

    def _far(self) -> algebra.Expr:
        """A gap where there is no pair."""
        return self.define(total([*self.boxes.a.halves, *self.boxes.b.halves]))

    def _size(self, x: algebra.Expr) -> algebra.Expr:
        return self.define(self.nearest.larger(x, negated(x)))


def _dot(u: Sequence[algebra.Expr], v: Sequence[algebra.Expr]) -> algebra.Expr:
    return total([product([x, y]) for x, y in zip(u, v, strict=True)])
