"""Where a convex solid is nearest to a place: on a side, an edge or a corner.

Which of them it is is found as numbers, by the regions in which each is nearest (Ericson, Real-Time Collision
Detection, 2005, section 5.1.5): a side where the place lies over it, an edge where it lies beside it between its ends.
The distance is then written out for that feature alone, so nothing that was compared is differentiated, and it goes
over from one feature to the next without a kink.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from . import algebra
from .convex import Define
from .elements import Vector, scalar_product
from .functions import branch, smooth_minimum
from .mesh import Hull
from .ready_made import HALF
from .unevaluated import difference, negated, product, squared, total

_FAR = algebra.Float(1e300)  # the square of a distance that counts for nothing


@dataclass(frozen=True)
class _Feature:
    """A side, an edge or a corner: a point of it, its normal or direction (none for a corner), and where it is nearest.

    A place belongs to it where all of `bounds`, normals and offsets, are below zero.
    """

    point: np.ndarray
    along: np.ndarray
    is_side: bool
    bounds: Sequence[tuple[np.ndarray, float]]


def count_features(hull: Hull) -> int:
    """How many sides, edges and corners a hull has."""
    return len(hull.sides) + len(hull.edges) + len(hull.corners)


def nearest_feature(hull: Hull, place: Vector, define: Define) -> tuple[algebra.Expr, Vector]:
    """The distance of a place from a hull, negative inside, and the nearest point; both in the hull's axes.

    Parameters
    ----------
    place : Vector
        In the hull's axes.
    define : callable
        Gives an expression a name.
    """
    chosen, least = None, None
    for feature in _features(hull):
        numbers = list(map(_number, (*feature.point, *feature.along, float(feature.is_side))))
        value = _where_it_is_nearest(feature, place, define)
        if least is None:
            chosen, least = numbers, value
            continue
        less = define(difference(value, least))
        chosen = [
            x if x == y else define(branch(less, x, y, evaluate=False)) for x, y in zip(numbers, chosen)
        ]
        least = define(smooth_minimum(least, value, evaluate=False))
    point, along, is_side = chosen[:3], chosen[3:6], chosen[6]
    other = define(difference(algebra.ONE, is_side))
    apart = [define(difference(x, y)) for x, y in zip(place, point, strict=True)]
    ahead = define(scalar_product(apart, along))
    # Over a side the root is of no use, and must have a derivative all the same.
    beside = total([*map(squared, apart), negated(squared(ahead)), is_side])
    distance = total([product([is_side, ahead]), product([other, algebra.Pow(beside, HALF, evaluate=False)])])
    of_side, of_others = define(product([negated(is_side), ahead])), define(product([other, ahead]))
    step = define(total([of_side, of_others]))
    there = [
        define(total([product([is_side, x]), product([other, a]), product([step, e])]))
        for x, a, e in zip(place, point, along, strict=True)
    ]
    return define(distance), there


def _where_it_is_nearest(feature: _Feature, place: Vector, define: Define) -> algebra.Expr:
    """The square of the distance where a feature is the nearest one, else a large number."""
    apart = [define(difference(x, _number(a))) for x, a in zip(place, feature.point, strict=True)]
    along = define(scalar_product(apart, list(map(_number, feature.along))))
    square = squared(along)
    if not feature.is_side:
        square = difference(total(list(map(squared, apart))), square)
    if not feature.bounds:
        return define(square)
    beyond = [
        define(difference(scalar_product(place, list(map(_number, normal))), _number(offset)))
        for normal, offset in feature.bounds
    ]
    worst = reduce(_larger, beyond)
    return define(branch(define(worst), define(square), _FAR, evaluate=False))


def _features(hull: Hull) -> Iterator[_Feature]:
    corners = hull.corners
    for number, (normal, offset) in enumerate(hull.sides):
        on = hull.on_side(number)
        middle = corners[on].mean(axis=0)
        bounds = []
        for j, k in hull.edges:
            if on[j] and on[k]:
                out = np.cross(normal, corners[k] - corners[j])
                out *= np.sign(out @ (corners[j] - middle)) / np.linalg.norm(out)
                bounds.append((out, float(out @ corners[j])))
        yield _Feature(normal * offset, normal, True, bounds)
    for j, k in hull.edges:
        along = (corners[k] - corners[j]) / np.linalg.norm(corners[k] - corners[j])
        ends = [(-along, float(-along @ corners[j])), (along, float(along @ corners[k]))]
        yield _Feature(corners[j], along, False, ends)
    for corner in corners:
        yield _Feature(corner, np.zeros(3), False, ())


def _number(x: float) -> algebra.Expr:
    return algebra.Integer(int(x)) if x in (-1.0, 0.0, 1.0) else algebra.Float(float(x))


def _larger(x: algebra.Expr, y: algebra.Expr) -> algebra.Expr:
    return negated(smooth_minimum(negated(x), negated(y), evaluate=False))
