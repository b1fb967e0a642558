"""Where the ends of rods that are placed by hand are pinned: found by comparing places at arbitrary states.

Two places that agree, or differ by two constraints, at arbitrary coordinates and parameters do so always: expressions
of a model are analytic, up to its switches (Schwartz, J. ACM 27, 1980; Zippel, EUROSAM 1979).
"""

from __future__ import annotations

import bisect
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, replace

from ..model import algebra
from ..model.description import Body, Description
from ..model.evaluate import NotFinite, evaluate

RODS = ("capsule", "cylinder")
MOST_RODS = 60  # more would take longer to compare than they help
N_STATES = 3  # two with the same parameters, which tell what stands still, and one with others
AGREE = 1e-9  # relative to the places' size
Vector = tuple[algebra.Expr, ...]
Values = tuple[tuple[float, ...], ...]  # components in each of the states


@dataclass(frozen=True)
class RodEnd:
    """A pinned end: in the body's axes (`local`) and in the world (`place`); `fixed` says that it stands still there.

    `constraints` hold it, in the order of the axes: the components of the force on the rod there are `signs` times
    their multipliers.
    """

    name: str
    body: Body
    local: Vector
    place: Vector
    fixed: bool = False
    constraints: tuple[int, ...] = ()
    signs: tuple[int, ...] = ()


def rod_ends(d: Description) -> list[RodEnd]:
    """The ends of rods that stand still or coincide with another rod's end or a body's centre, each pin once."""
    children = {j.child for j in d.joints}
    by_hand = [b for b in d.bodies if b.name not in children and b.com]
    rods = [b for b in by_hand if b.shape is not None and b.shape.kind in RODS]
    if not 0 < len(rods) <= MOST_RODS:
        return []
    states = _states(d)
    rods = [b for b in rods if _is_steady(_values(b.shape.sizes, states))]
    ends = [(end, _values(end.place, states)) for rod in rods for end in _ends(rod)]
    centres = [(b, _values(_three(b.com), states)) for b in by_hand if b not in rods]
    found = _Comparison(
        [(end, found) for end, found in ends if found],
        [(b, found) for b, found in centres if found],
        [_values((c.expression,), states) for c in d.constraints],
        {b.name: _values((b.angle or algebra.ZERO,), states) for b in by_hand if b.planar},
    ).pinned()
    return [replace(end, place=_without_motion(d, end.place)) if end.fixed else end for end in found]


def _without_motion(d: Description, place: Vector) -> Vector:
    """A place that stands still as an expression of parameters, where expanding shows that it is one."""
    moving = {algebra.Symbol(c.name) for c in d.coordinates}
    result = []
    for component in place:
        plain = component
        for name, expression in reversed(d.definitions):
            plain = plain.xreplace({algebra.Symbol(name): expression})
        plain = algebra.expand(plain)
        result.append(component if plain.free_symbols & moving else plain)
    return tuple(result)


class _Comparison:
    """Compares the values of places.

    Parameters
    ----------
    ends : list of (RodEnd, Values)
    centres : list of (Body, Values)
        Of bodies that are no rods of constant length.
    held : list of Values or None
        The holonomic constraints, one component each; None for one without a value.
    angles : dict of Values or None
        Of planar bodies.
    """

    def __init__(
        self,
        ends: list[tuple[RodEnd, Values]],
        centres: list[tuple[Body, Values]],
        held: list[Values | None],
        angles: dict[str, Values | None],
    ) -> None:
        self.ends, self.centres, self.held, self.angles = ends, centres, held, angles
        sizes = [abs(x) for _, place in (*ends, *centres) for row in place for x in row]
        self.limit = AGREE * max(sizes, default=0.0)
        signed = [(k, sign) for k, values in enumerate(held) if values for sign in (1, -1)]
        self.by_value = sorted((sign * held[k][0][0], k, sign) for k, sign in signed)

    def pinned(self) -> list[RodEnd]:
        """The ends that are pinned to something, one for each pin."""
        taken: list[Values] = []
        result = []
        for end, place in self.ends:
            if any(self.agree(place, other) for other in taken):
                continue
            others = [pair for pair in self.ends if pair[0].body is not end.body]
            found = self.joined(end, place, others)
            if found is not None:
                taken.append(place)
                for used in found.constraints:
                    self.held[used] = None
                result.append(found)
        return result

    def joined(self, end: RodEnd, place: Values, others: list[tuple[RodEnd, Values]]) -> RodEnd | None:
        """The end with what holds it; None where nothing does, or where a ball around it hides the pin."""
        if self.stands(place):
            return replace(end, fixed=True)
        met = [body for body, other in self.centres if self.agree(place, other)]
        if any(body.shape is not None and body.shape.kind == "sphere" for body in met):
            return None
        met += [other_end.body for other_end, other in others if self.agree(place, other)]
        if met:
            return end if any(self.turns(end.body, body) for body in met) else None
        return self.closed(end, place, [other for _, other in (*others, *self.centres)])

    def turns(self, a: Body, b: Body) -> bool:
        """Whether two bodies turn against each other; a rod in space that ends in a body's centre carries it."""
        first, second = self.angles.get(a.name), self.angles.get(b.name)
        if first is None or second is None:
            return b.shape is not None and b.shape.kind in RODS
        apart = [x - y for (x,), (y,) in zip(first, second, strict=True)]
        return abs(apart[0] - apart[1]) > AGREE

    def closed(self, end: RodEnd, place: Values, others: list[Values]) -> RodEnd | None:
        """The end with the constraints that keep it at one of the other places, or at a place of the world."""
        for other in others:
            found = []
            for gap in _differences(place, other):
                found.append(self.constraint(gap))
                if found[-1] is None:
                    break
            else:
                return _held(end, found)
        axes = _differences(place, ((0.0,) * 3,) * N_STATES)
        found = [self.constraint_up_to_a_constant(axis) for axis in axes]
        return None if None in found else replace(_held(end, found), fixed=True)

    def constraint(self, gap: tuple[float, ...]) -> tuple[int, int] | None:
        """The unused constraint that a component of a distance is, and with which sign."""
        first = bisect.bisect_left(self.by_value, (gap[0] - self.limit,))
        last = bisect.bisect_right(self.by_value, (gap[0] + self.limit,), lo=first)
        for _, k, sign in self.by_value[first:last]:
            if self.held[k] and all(
                abs(x - sign * y) <= self.limit for x, (y,) in zip(gap, self.held[k], strict=True)
            ):
                return k, sign
        return None

    def constraint_up_to_a_constant(self, place: tuple[float, ...]) -> tuple[int, int] | None:
        """The unused constraint that holds a component of a place at a constant, and its sign."""
        for k, values in enumerate(self.held):
            for sign in (1, -1) if values else ():
                if self.stands(tuple((x - sign * y,) for x, (y,) in zip(place, values, strict=True))):
                    return k, sign
        return None

    def agree(self, a: Values, b: Values) -> bool:
        """Whether two places are one in all states."""
        return all(math.dist(*pair) <= self.limit for pair in zip(a, b, strict=True))

    def stands(self, values: Values) -> bool:
        """Whether values are the same in the two states with the same parameters."""
        return math.dist(*values[:2]) <= self.limit


def _differences(a: Values, b: Values) -> Iterator[tuple[float, ...]]:
    """The components of a distance in all states; in the plane, two."""
    for axis in range(3):
        gap = tuple(x[axis] - y[axis] for x, y in zip(a, b, strict=True))
        if axis < 2 or any(gap):
            yield gap


def _held(end: RodEnd, found: list[tuple[int, int]]) -> RodEnd:
    return replace(end, constraints=tuple(k for k, _ in found), signs=tuple(sign for _, sign in found))


def _is_steady(sizes: Values | None) -> bool:
    return sizes is not None and math.dist(*sizes[:2]) <= AGREE * max(sizes[0])


def _ends(rod: Body) -> Iterator[RodEnd]:
    half = rod.shape.sizes[1] / 2
    for which, sign in enumerate((-1, 1), 1):
        reach = sign * half
        local = (reach, algebra.ZERO, algebra.ZERO) if rod.planar else (algebra.ZERO, algebra.ZERO, reach)
        turned = _turned(rod, local)
        place = tuple(a + b for a, b in zip(_three(rod.com), turned, strict=True))
        yield RodEnd(f"{rod.name}_{which}", rod, local, place)


def _turned(rod: Body, local: Vector) -> Vector:
    """A vector in body axes in world axes."""
    steps = rod.rotation if rod.angle is None else (("z", rod.angle),)
    vector = list(local)
    for axis, angle in reversed(steps):
        i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
        c, s = algebra.cos(angle), algebra.sin(angle)
        vector[i], vector[j] = c * vector[i] - s * vector[j], s * vector[i] + c * vector[j]
    return tuple(vector)


def _three(vector: Vector) -> Vector:
    return (*vector, algebra.ZERO)[:3]


def _states(d: Description) -> list[dict[str, float]]:
    """Arbitrary values of coordinates, parameters and definitions: the same ones for the same description."""
    draw = random.Random(0)
    first = {p.name: p.value * draw.uniform(0.7, 1.3) or draw.uniform(0.1, 1.0) for p in d.parameters}
    second = {p.name: p.value * draw.uniform(0.7, 1.3) or draw.uniform(0.1, 1.0) for p in d.parameters}
    result = []
    for parameters in (first, first, second):
        values = {**parameters, **{c.name: c.value for c in d.constants}, "t": draw.uniform(0.1, 2.0)}
        values |= {c.name: draw.uniform(0.2, 1.2) * draw.choice((-1.0, 1.0)) for c in d.coordinates}
        for name, expression in d.definitions:
            values[name] = _value(expression, values)
        result.append(values)
    return result


def _value(expression: algebra.Expr, values: dict[str, float]) -> float | None:
    try:
        return evaluate(expression, values)
    except NotFinite:
        return None


def _values(place: Vector, states: list[dict[str, float]]) -> Values | None:
    rows = tuple(tuple(_value(x, values) for x in place) for values in states)
    return None if any(x is None for row in rows for x in row) else rows
