"""Segments that are nearest to each other: rods, and edges of boxes and meshes.

Which places are nearest is found as a number: two clamps (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
What is kept of that is only where each place lies, at an end or between the ends, and the distance is written out anew
for such a pair of features, in closed form. So derivatives are those of the features, of any order, and nothing that
was compared is differentiated. The distance itself goes over from one pair to another without a kink.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from . import algebra
from .elements import Vector, scalar_product
from .functions import branch, settled, smooth_minimum
from .mesh import Hull
from .ready_made import HALF
from .surfaces import moved
from .unevaluated import difference, inverted, negated, product, squared, total

Define = Callable[[algebra.Expr], algebra.Expr]
Number = algebra.Expr  # one that is chosen by the motion among numbers: its derivative is zero

_PARALLEL = algebra.Float(1e-12)  # square of the sine of the angle from which on lines have one nearest place
_LEAST = algebra.Float(1e-300)  # is not zero
_AT_END = algebra.Float(1e-9)  # in half lengths
SIDES = (algebra.NEGATIVE_ONE, algebra.ONE)


@dataclass(frozen=True)
class Segment:
    """Its middle, its direction, and half its length."""

    middle: Vector
    along: Vector
    half: algebra.Expr


@dataclass(frozen=True)
class Features:
    """What is nearest on a segment: an end, or a place between the ends.

    `end` is -1 or 1, and 0 where the place is between the ends; `between` is 1 there, else 0.
    """

    end: Number
    between: Number


class Nearest:
    """Where two segments are nearest to each other.

    Parameters
    ----------
    define : callable
        Gives an expression a name.
    """

    def __init__(self, define: Define) -> None:
        self.define = define

    def of(self, a: Segment, b: Segment) -> tuple[algebra.Expr, Vector, Vector]:
        """The distance, and the nearest places of both."""
        _, *found = self.found(a, b)
        own, other = (Features(self.settle(x.end), self.settle(x.between)) for x in found)
        return self.distance(a, b, own, other), *self.on(a, b, own, other)

    def of_several(self, a: Segment, others: Sequence[Segment]) -> tuple[algebra.Expr, Vector, Vector]:
        """The same of a segment and that of some others which is nearest."""
        values, numbers = [], []
        for k, b in enumerate(others):
            square, own, other = self.found(a, b)
            values.append(square)
            which = [algebra.ONE if i == k else algebra.ZERO for i in range(len(others))]
            numbers.append([*which, own.end, own.between, other.end, other.between])
        *which, end, between, other_end, other_between = self.least(values, numbers)
        half = total([product([k, b.half]) for k, b in zip(which, others, strict=True)])
        place, along = (_chosen(which, vectors) for vectors in zip(*((b.middle, b.along) for b in others)))
        found = a, Segment(place, along, half), Features(end, between), Features(other_end, other_between)
        return self.distance(*found), *self.on(*found)

    def found(self, a: Segment, b: Segment) -> tuple[algebra.Expr, Features, Features]:
        """The square of the distance as a number, and the features that are nearest."""
        define = self.define
        apart = [define(difference(x, y)) for x, y in zip(b.middle, a.middle, strict=True)]
        cosine = define(scalar_product(a.along, b.along))
        ahead, behind = (define(scalar_product(x.along, apart)) for x in (a, b))
        square = define(difference(algebra.ONE, squared(cosine)))
        # With lines that are parallel any place will do to begin with.
        bent = define(total([self.larger(square, _PARALLEL), _LEAST]))
        first = define(product([difference(ahead, product([cosine, behind])), inverted(bent)]))
        s = self.within(first, a.half)
        t = self.within(define(difference(product([cosine, s]), behind)), b.half)
        s = self.within(define(total([ahead, product([cosine, t])])), a.half)
        away = [
            define(total([x, product([t, f]), negated(product([s, e]))]))
            for x, e, f in zip(apart, a.along, b.along, strict=True)
        ]
        own, other = self.features(s, a.half), self.features(t, b.half)
        own, other = self._of_parallels(a, b, cosine, behind, square, own, other)
        return define(total(map(squared, away))), own, other

    def _of_parallels(
        self,
        a: Segment,
        b: Segment,
        cosine: algebra.Expr,
        behind: algebra.Expr,
        square: algebra.Expr,
        own: Features,
        other: Features,
    ) -> tuple[Features, Features]:
        """The features, where segments that lie beside each other are nearest at an end of one of the two."""
        define = self.define
        both = define(product([own.between, other.between]))
        flat = define(product([both, self.number(difference(square, _PARALLEL), algebra.ONE, algebra.ZERO)]))
        beside = []
        for side in SIDES:
            t = define(difference(product([side, cosine, a.half]), behind))
            beyond = difference(self.larger(t, negated(t)), b.half)
            beside.append(self.number(beyond, algebra.ONE, algebra.ZERO))
        low, high = beside
        low = define(product([low, difference(algebra.ONE, high)]))
        of_a, end = define(total([low, high])), define(difference(high, low))
        of_b = define(difference(algebra.ONE, of_a))
        return (
            Features(
                define(total([own.end, product([flat, end])])),
                define(difference(own.between, product([flat, of_a]))),
            ),
            Features(
                define(total([other.end, product([flat, of_b])])),
                define(difference(other.between, product([flat, of_b]))),
            ),
        )

    def distance(self, a: Segment, b: Segment, own: Features, other: Features) -> algebra.Expr:
        """The distance of two features: its square is r² - (p² - 2 B p q + q²)/(1 - B²) with p = u·r and q = w·r.

        What is not free has no part in it. So the distance costs a third of what the places do.
        """
        apart, cosine, ahead, behind, by = self._between(a, b, own, other)
        p, q = product([own.between, ahead]), product([other.between, behind])
        twice = product([algebra.Integer(-2), cosine, p, q])
        less = product([algebra.NEGATIVE_ONE, by, total([squared(p), twice, squared(q)])])
        return self.define(algebra.Pow(total([*map(squared, apart), less]), HALF, evaluate=False))

    def on(self, a: Segment, b: Segment, own: Features, other: Features) -> tuple[Vector, Vector]:
        """The nearest places of two features: of lines both are free, s - B t = u·r and t - B s = -w·r."""
        define = self.define
        _, cosine, ahead, behind, by = self._between(a, b, own, other)
        start, goal = _held(a, own), _held(b, other)
        s = define(product([own.between, by, difference(ahead, product([cosine, behind]))]))
        t = define(product([other.between, by, difference(product([cosine, ahead]), behind)]))
        return moved(start, a.along, s), moved(goal, b.along, t)

    def _between(
        self, a: Segment, b: Segment, own: Features, other: Features
    ) -> tuple[Vector, *tuple[Any, ...]]:
        """From one held place to the other: r, B, u·r, w·r, 1/(1 - B²)."""
        define = self.define
        apart = [define(difference(x, y)) for x, y in zip(_held(b, other), _held(a, own), strict=True)]
        cosine = define(product([own.between, other.between, scalar_product(a.along, b.along)]))
        ahead, behind = (define(scalar_product(x.along, apart)) for x in (a, b))
        return apart, cosine, ahead, behind, define(inverted(difference(algebra.ONE, squared(cosine))))

    def features(self, place: algebra.Expr, half: algebra.Expr) -> Features:
        """At which end a place of a segment is."""
        bound = product([half, difference(algebra.ONE, _AT_END)])
        end = self.number(
            total([place, bound]),
            algebra.NEGATIVE_ONE,
            self.number(difference(bound, place), algebra.ONE, algebra.ZERO),
        )
        return Features(end, self.define(difference(algebra.ONE, squared(end))))

    def settle(self, number: Number) -> Number:
        """A whole number whose making is no concern of any derivative."""
        return number if number.is_Number else self.define(settled(total([number, HALF]), evaluate=False))

    def least(self, values: Sequence[algebra.Expr], of: Sequence[Sequence[Number]]) -> list[Number]:
        """What belongs to the least of some values; `of` has for each the same number of whole numbers."""
        least, chosen = values[0], list(of[0])
        for value, numbers in zip(values[1:], of[1:], strict=True):
            less = self.define(difference(value, least))
            chosen = [self.number(less, x, y) for x, y in zip(numbers, chosen, strict=True)]
            least = self.define(smooth_minimum(least, value, evaluate=False))
        return [self.settle(x) for x in chosen]

    def number(self, x: algebra.Expr, below: Number, above: Number) -> Number:
        """One of two numbers, by the sign of something."""
        return below if below == above else self.define(branch(x, below, above, evaluate=False))

    def larger(self, x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
        return negated(smooth_minimum(negated(x), negated(y), evaluate=False))

    def within(self, x: algebra.Expr, half: algebra.Expr) -> algebra.Expr:
        """A number, or the nearest one from -half to half."""
        upper = smooth_minimum(x, half, evaluate=False)
        return self.define(negated(smooth_minimum(negated(upper), half, evaluate=False)))


def _held(segment: Segment, features: Features) -> Vector:
    """The end that is nearest, or the middle where it is between the ends."""
    return moved(segment.middle, segment.along, product([features.end, segment.half]))


def _sides_of_skew_edges() -> Iterator[tuple[Vector, Vector, Vector]]:
    for a, b in itertools.product(SIDES, repeat=2):
        c, none = product([a, b]), algebra.ZERO
        yield (none, a, b), (c, none, negated(b)), (negated(c), negated(a), none)


# The twelve edges of a box as four times three, one along each axis, of which no two are in one side: the middle of
# each in half edges. What is flat touches edges of one side, and so each of the four at one place at most.
SIDES_OF_SKEW_EDGES = tuple(_sides_of_skew_edges())


def skew_edges(halves: Sequence[algebra.Expr]) -> Iterator[list[Segment]]:
    """The twelve edges of a box as four times three."""
    axes = [[algebra.ONE if i == k else algebra.ZERO for i in range(3)] for k in range(3)]
    for three in SIDES_OF_SKEW_EDGES:
        middles = (
            [product([side, half]) for side, half in zip(sides, halves, strict=True)] for sides in three
        )
        yield [Segment(*edge) for edge in zip(middles, axes, halves, strict=True)]


def skew_edges_of_hull(hull: Hull) -> list[list[Segment]]:
    """The edges of a convex solid in its axes, in groups of which no two edges are in one side."""
    groups: list[tuple[set[int], list[Segment]]] = []
    for edge, sides in zip(hull.edges, hull.sides_of_edges(), strict=True):
        a, b = (hull.corners[k] for k in edge)
        half = float(np.linalg.norm(b - a)) / 2
        vectors = ([algebra.Float(float(x)) for x in v] for v in ((a + b) / 2, (b - a) / (2 * half)))
        of_group = next((group for group in groups if not group[0] & sides), None)
        if of_group is None:
            groups.append(of_group := (set(), []))
        of_group[0].update(sides)
        of_group[1].append(Segment(*vectors, algebra.Float(half)))
    return [edges for _, edges in groups]


def _chosen(numbers: Sequence[Number], vectors: Sequence[Vector]) -> Vector:
    """The sum of vectors, of which numbers choose one."""
    return [
        reduce(lambda x, y: total([x, y]), [product([k, v[i]]) for k, v in zip(numbers, vectors)])
        for i in range(3)
    ]
