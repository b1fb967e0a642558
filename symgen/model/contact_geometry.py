"""Shapes that touch, written out as gaps: each is that of one point, and stops, frictions and contact laws do the rest.

A sphere has one such point, its middle, with its radius; a capsule its ends; a box and a mesh their corners, on the
sides of other boxes and meshes as well. Against a
plane their heights are the gaps. Spheres and capsules touch each other, boxes and meshes where they are nearest
to each other (Ericson, Real-Time Collision Detection, 2005, ch. 5).

A surface z = h(x, y) is touched by a point where the point's height over it is zero, and by a sphere at the foot of the
perpendicular from its middle, see `surfaces.py`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from pathlib import Path
from typing import Any

from ..errors import ModelError
from . import algebra
from .boxes import RIGID_SHARE, SOFT_SHARE, Block, Boxes, Meeting, smaller
from .contact_pairs import solids_of
from .convex import MOST_LOOKED_AT, Convex, Solids, looked_at
from .crossing_edges import CrossingEdges
from .description import Body, Contact, ContactPair, Description, Event, Friction, Solid, Stop
from .elements import Vector, Writer, scalar_product
from .functions import dot, smooth_minimum
from .mesh import Hull, hull_of
from .nearest_feature import count_features, nearest_feature
from .orientation import Expressions
from .ready_made import HALF, WORLD
from .rolling import velocity_by_turning
from .segments import SIDES, Nearest, Segment, skew_edges, skew_edges_of_hull
from .solids import together, turned
from .sources import Sources
from .surfaces import Definitions, Surface, define, moved
from .unevaluated import difference, inverted, negated, product, squared, total

MOST_POINTS = 64  # of one contact
MOST_FEATURES = 160  # of a mesh that a sphere touches
# A direction that no axis has, and two at right angles to it.
_POLE = [algebra.Float(x) for x in (0.36, 0.48, 0.8)]
_TANGENTS_OF_POLE = [[algebra.Float(x) for x in e] for e in ((0.8, -0.6, 0.0), (0.48, 0.64, -0.6))]


@dataclass(frozen=True)
class Ball:
    """A point of a body with a radius, which may be zero: its world coordinates."""

    place: Vector
    radius: algebra.Expr


@dataclass(frozen=True)
class Rod:
    """A capsule: the world coordinates of its middle and of its direction, half its length, its radius."""

    place: Vector
    along: Vector
    half: algebra.Expr
    radius: algebra.Expr

    @property
    def ends(self) -> list[Ball]:
        """Its ends."""
        return [
            Ball(
                [total([p, product([side, self.half, a])]) for p, a in zip(self.place, self.along)],
                self.radius,
            )
            for side in (algebra.NEGATIVE_ONE, algebra.ONE)
        ]


@dataclass
class Written:
    """What contacts of shapes become."""

    stops: list[Stop] = field(default_factory=list)
    frictions: list[Friction] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    definitions: Definitions = field(default_factory=Definitions)
    events: list[Event] = field(default_factory=list)


def write_pairs(writer: Writer, d: Description, sources: Sources) -> Written:
    """The stops, frictions and compliant contacts of shapes that touch."""
    made = Written()
    taken = {x.name for x in (*d.stops, *d.frictions, *d.contacts, *d.events, *d.constraints)}
    taken |= {x.name for x in (*d.velocity_constraints, *d.loops)}
    for pair in d.pairs:
        geometry = _Geometry(writer, d, pair, sources, made.definitions)
        touches = geometry.touches()
        for k, crossed in enumerate(geometry.crossed, 1):
            name = f"{pair.name}_edges" + (str(k) if len(geometry.crossed) > 1 else "")
            says = _says_of_crossed(pair, geometry.has_edges)
            made.events.append(Event(name, crossed, "falling", "terminate", says=says))
        for k, touch in enumerate(touches, 1):
            name = pair.name if len(touches) == 1 else f"{pair.name}_{k}"
            if name in taken:
                message = f"the contact makes '{name}', which is taken"
                raise sources.error(f"contacts.{pair.name}", "", message, hint="choose another name")
            taken.add(name)
            _write(writer, pair, name, touch, made)
    return made


def _says_of_crossed(pair: ContactPair, has_edges: bool) -> str:
    """What a run says that ends where bodies are in each other unnoticed, and what to do about it."""
    if pair.other is None:
        where = f"the surface comes up between the places with which {pair.body} touches it"
        return f"{where}, its corners or ends (give the contact a 'shape' of several spheres)"
    remedy = f"(give the contact a 'shape' of capsules along the edges of {pair.body})"
    if has_edges:
        what = f"{pair.body} and {pair.other} are deeper in each other than their corners and edges tell"
        return f"{what}, as where a step goes through: take a smaller rtol or max_step {remedy.replace('(', '(or ')}"
    return f"edges of {pair.body} and {pair.other} cross, which touch with their corners only {remedy}"


def _write(writer: Writer, pair: ContactPair, name: str, touch: Meeting, made: Written) -> None:
    """One point that touches, as a stop with friction, or as a compliant contact."""
    speeds: list[algebra.Expr | None] = [None, None]
    if pair.friction is not None:
        against = pair.other or writer.body_of(pair.plane)
        pairs = zip(*(_velocity(writer, body, touch.place) for body in (pair.body, against)), strict=True)
        apart = [difference(x, y) for x, y in pairs]
        speeds = ([scalar_product(apart, along) for along in touch.tangents] + speeds)[:2]
    if pair.stiffness is not None:
        law = (pair.stiffness, pair.exponent, pair.damping, pair.friction)
        made.contacts.append(Contact(name, touch.gap, *law, speeds[0], pair.smooth, speeds[1]))
        return
    made.stops.append(Stop(name, touch.gap, pair.restitution))
    if pair.friction is not None:
        speed, across = speeds
        rubbing = Friction(f"{name}_friction", speed, pair.friction, pair.smooth, pair.static, (name,))
        made.frictions.append(rubbing if across is None else replace(rubbing, across=across))


def _velocity(writer: Writer, body: str, place: Vector) -> Vector:
    """The velocity of the point of a body that is at a place."""
    if body == WORLD:
        return [algebra.ZERO] * 3
    b, centre = writer.body[body], writer.centre(body)
    moving = [algebra.ZERO if x.is_Number else dot(x) for x in centre]
    if not (body in writer.children or b.angle is not None or b.rotation):
        return moving
    arm = [difference(x, y) for x, y in zip(place, centre, strict=True)]
    turning = velocity_by_turning(writer, body, arm)
    return [total([x, *more]) for x, more in zip(moving, turning, strict=True)]


class _Geometry:
    """The points of one contact that may touch."""

    def __init__(
        self,
        writer: Writer,
        d: Description,
        pair: ContactPair,
        sources: Sources,
        definitions: Definitions,
    ) -> None:
        self.writer, self.d, self.pair, self.sources = writer, d, pair, sources
        self.definitions = definitions
        self.planar = writer.body[pair.body].planar
        self.crossed: list[algebra.Expr] = []  # what falls to zero where bodies are in each other unnoticed
        self.has_edges = False  # whether edges that cross have gaps of their own

    def touches(self) -> list[Meeting]:
        """All of them."""
        pair = self.pair
        own = self._parts(pair.body, pair.shapes, "shape")
        if pair.other is None:
            balls = [ball for part in own for ball in _balls(part)]
            self._bound(len(balls))
            if pair.height is None:
                return [self._on_plane(ball) for ball in balls]
            self.crossed += [self._between_corners(part) for part in own if not isinstance(part, Ball)]
            return [self._on_surface(ball) for ball in balls]
        others = self._parts(pair.other, pair.other_shapes, "other_shape")
        found = [touch for a, b in itertools.product(own, others) for touch in self._between(a, b)]
        self._bound(len(found))
        return found

    def _bound(self, count: int) -> None:
        if count > MOST_POINTS:
            message = (
                f"{count} points would touch, each with an equation of its own; the most are {MOST_POINTS}"
            )
            raise self._error(
                "shape", message, "give the contact a coarser 'shape': fewer corners, or spheres"
            )

    def _error(self, key: str, message: str, hint: str) -> ModelError:
        return self.sources.error(f"contacts.{self.pair.name}", key, message, hint=hint)

    def _parts(self, body: str, own: tuple[Solid, ...], key: str) -> list[Any]:
        b = self.writer.body[body]
        solids = own or solids_of(b)
        shift = (algebra.ZERO,) * 3 if own else _origin_of_shapes(b, body in self.writer.children)
        return [part for solid in solids for part in self._part(body, solid, shift, key)]

    def _part(self, body: str, solid: Solid, shift: Expressions, key: str) -> list[Any]:
        """A solid as a ball, a rod, a block, or a convex one."""
        writer, planar = self.writer, self.planar
        offset = (*solid.offset, *(algebra.ZERO,) * 3)[:3]
        middle = [total([x, y]) for x, y in zip(offset, shift, strict=True)]

        def point(at: Sequence[algebra.Expr]) -> Vector:
            place = writer.point(body, tuple(at))
            return [*place[:2], algebra.ZERO] if planar else place

        if solid.kind == "sphere":
            return [Ball(point(middle), solid.sizes[0])]
        if solid.kind == "mesh":
            axes = [
                self._direction(body, [algebra.ONE if k == i else algebra.ZERO for k in range(3)])
                for i in range(3)
            ]
            return [Convex.of_hull(point(middle), axes, self._hull(solid, key))]
        turn = turned(replace(solid, planar=planar))
        axes = [[row[k] for row in turn] for k in range(3)]  # in the body's frame
        if solid.kind == "capsule":
            radius, length = solid.sizes
            return [Rod(point(middle), self._direction(body, axes[2]), product([HALF, length]), radius)]
        halves = [product([HALF, x]) for x in solid.sizes][: 2 if planar else 3]
        return [Block(point(middle), [self._direction(body, axis) for axis in axes[: len(halves)]], halves)]

    def _direction(self, body: str, numbers: Sequence[algebra.Expr]) -> Vector:
        """World components of a direction in a body's axes."""
        axes = self.writer.directions(body)
        return [total([product([x, e[k]]) for x, e in zip(numbers, axes, strict=True)]) for k in range(3)]

    def _hull(self, solid: Solid, key: str) -> Hull:
        try:
            hull = hull_of(Path(self.d.folder) / solid.mesh)
        except ModelError as error:
            raise self.sources.locate(error, f"contacts.{self.pair.name}", key) from None
        self._bound(len(hull.corners))
        return hull

    def _plane(self) -> tuple[Vector, list[Vector], Vector]:
        """Origin, the directions along the plane, and the normal."""
        x, y, z = self.writer.directions(self.pair.plane)
        origin = self.writer.origin(self.pair.plane)
        return (origin, [x], y) if self.planar else (origin, [x, y], z)

    def _on_plane(self, ball: Ball) -> Meeting:
        origin, tangents, normal = self._plane()
        apart = [difference(p, o) for p, o in zip(ball.place, origin, strict=True)]
        gap = difference(scalar_product(apart, normal), ball.radius)
        return Meeting(gap, moved(ball.place, normal, negated(ball.radius)), tangents)

    def _on_surface(self, ball: Ball) -> Meeting:
        """Over a height field: a point by its height, a sphere by the foot of the perpendicular."""
        pair, table = self.pair, f"contacts.{self.pair.name}"
        given = (table, pair.name, pair.plane, pair.height, self.planar)
        surface = Surface(self.writer, self.sources, self.definitions, *given, self.d.tables)
        if ball.radius.is_zero:
            foot = surface.point(ball.place)
            return Meeting(foot.away, ball.place, foot.tangents)
        foot = surface.ball(ball.place, ball.radius)
        place = moved(ball.place, foot.normal, negated(ball.radius))
        return Meeting(difference(foot.away, ball.radius), place, foot.tangents)

    def _between_corners(self, part: Any) -> algebra.Expr:
        """What falls to zero where a surface comes up between what touches it, by middles of edges and sides."""
        touching, middles = (
            [self._on_surface(ball).gap for ball in find(part)] for find in (_balls, _middles)
        )
        share = RIGID_SHARE if self.pair.stiffness is None else SOFT_SHARE
        pressed = negated(reduce(smaller, touching, algebra.ZERO))
        least = part.radius if isinstance(part, Rod) else part.least
        return total([reduce(smaller, middles), pressed, product([share, least])])

    def _between(self, a: Any, b: Any) -> Iterator[Meeting]:
        """The shapes of two bodies."""
        if isinstance(a, Block) and isinstance(b, Block):
            yield from self._boxes(a, b)
            return
        kinds = {type(a), type(b)}
        if Convex in kinds and kinds <= {Convex, Block}:
            yield from self._solids(*(x if type(x) is Convex else Convex.of_block(x) for x in (a, b)))
            return
        if kinds == {Rod, Convex} or (kinds == {Rod, Block} and not self.planar):
            rod, solid = (a, b) if type(a) is Rod else (b, a)
            on = self._rod_on_solid if Convex in kinds else self._rod_on_block
            for distance, place, other in on(rod, solid):
                places = (place, other) if rod is a else (other, place)
                yield self._apart(*places, a, rod.radius, distance)
            return
        if kinds == {Ball, Convex}:
            ball, solid = (a, b) if type(a) is Ball else (b, a)
            distance, there = self._ball_on_solid(ball, solid)
            places = (ball.place, there) if ball is a else (there, ball.place)
            yield self._apart(*places, a, ball.radius, distance)
            return
        swapped = (type(b), type(a)) in _NEAREST
        nearest = _NEAREST.get((type(b), type(a)) if swapped else (type(a), type(b)))
        if nearest is None:
            what = f"{_named(a)} and {_named(b)}"
            message = f"how {what} of two bodies touch is not known in closed form"
            hint = (
                "touch by spheres at its corners, by a 'shape' of the contact, or a 'plane' of the other body"
            )
            raise self._error("other", message, hint)
        for place, other, radius in nearest(b, a) if swapped else nearest(a, b):
            yield self._apart(*((other, place) if swapped else (place, other)), a, radius)
        if not self.planar and type(a) is Rod and type(b) is Rod:
            one, two = (Segment(rod.place, rod.along, rod.half) for rod in (a, b))
            distance, *places = Nearest(self._define).of(one, two)
            yield self._apart(*places, a, total([a.radius, b.radius]), distance)

    def _ball_on_solid(self, ball: Ball, solid: Convex) -> tuple[algebra.Expr, Vector]:
        """How far a sphere's middle is from the hull of a mesh, and the nearest point of that in the world."""
        count = count_features(solid.hull)
        if count > MOST_FEATURES:
            message = (
                f"the mesh has {count} sides, edges and corners to look at; the most are {MOST_FEATURES}"
            )
            raise self._error("other", message, "give the contact a coarser 'shape', or 'other_shape'")
        apart = [self._define(difference(x, y)) for x, y in zip(ball.place, solid.place, strict=True)]
        seen = [self._define(scalar_product(apart, axis)) for axis in solid.axes]
        distance, there = nearest_feature(solid.hull, seen, self._define)
        return distance, solid.at(there)

    def _rod_on_block(self, rod: Rod, block: Block) -> Iterator[tuple[algebra.Expr, Vector, Vector]]:
        """How near a capsule's core is to a box, and where: its ends to all of it, what is between them to edges.

        Of four times three edges the nearest ones: what lies on a side of a box goes over edges of that side.
        """
        apart = [difference(x, y) for x, y in zip(rod.place, block.place, strict=True)]
        middle, along = (
            [self._define(scalar_product(v, axis)) for axis in block.axes] for v in (apart, rod.along)
        )
        for side, end in zip(SIDES, rod.ends, strict=True):
            here = [self._define(x) for x in moved(middle, along, product([side, rod.half]))]
            inside = [self._define(_within(x, half)) for x, half in zip(here, block.halves)]
            away = total([squared(difference(x, y)) for x, y in zip(here, inside)])
            distance = algebra.Pow(away, HALF, evaluate=False)
            yield distance, end.place, self._from_block(block, inside)
        segment, nearest = Segment(middle, along, rod.half), Nearest(self._define)
        for edges in skew_edges(block.halves):
            distance, *places = nearest.of_several(segment, edges)
            yield distance, *(self._from_block(block, place) for place in places)

    def _rod_on_solid(self, rod: Rod, solid: Convex) -> Iterator[tuple[algebra.Expr, Vector, Vector]]:
        """How near a capsule's core is to the hull of a mesh, and where; as on a box, with as many gaps as it takes."""
        for end in rod.ends:
            distance, there = self._ball_on_solid(end, solid)
            yield distance, end.place, there
        apart = [difference(x, y) for x, y in zip(rod.place, solid.place, strict=True)]
        middle, along = (
            [self._define(scalar_product(v, axis)) for axis in solid.axes] for v in (apart, rod.along)
        )
        segment, nearest = Segment(middle, along, rod.half), Nearest(self._define)
        for edges in skew_edges_of_hull(solid.hull):
            distance, *places = nearest.of_several(segment, edges)
            yield distance, *(solid.at(place) for place in places)

    def _from_block(self, block: Block, place: Vector) -> Vector:
        """The world coordinates of a place in a box's axes."""
        there = block.place
        for x, axis in zip(place, block.axes, strict=True):
            there = moved(there, axis, x)
        return there

    def _boxes(self, a: Block, b: Block) -> Iterator[Meeting]:
        boxes = Boxes(a, b, self._define)
        places = list(boxes.corners())
        share = RIGID_SHARE if self.pair.stiffness is None else SOFT_SHARE
        if not self.planar:
            places += CrossingEdges(boxes, share).meetings()
            self.has_edges = True
        self.crossed.append(boxes.crossed([place.gap for place in places], share))
        yield from places

    def _solids(self, a: Convex, b: Convex) -> Iterator[Meeting]:
        self._bound(len(a.points) + len(b.points))
        count = looked_at(a, b)
        if count > MOST_LOOKED_AT:
            message = (
                f"corners and edges of one on sides of the other are {count}; the most are {MOST_LOOKED_AT}"
            )
            raise self._error(
                "other", message, "give the contact a coarser 'shape', or 'other_shape', or spheres"
            )
        solids = Solids(a, b, self._define, self._tangents)
        corners = list(solids.corners())
        share = RIGID_SHARE if self.pair.stiffness is None else SOFT_SHARE
        self.crossed.append(solids.crossed([corner.gap for corner in corners], share))
        yield from corners

    def _define(self, expression: algebra.Expr) -> algebra.Expr:
        return define(self.writer, self.pair.name, self.definitions, expression)

    def _apart(
        self, place: Vector, other: Vector, a: Any, radius: algebra.Expr, distance: algebra.Expr | None = None
    ) -> Meeting:
        """The gap between the nearest places of the cores of two shapes, less both radii."""
        apart = [difference(x, y) for x, y in zip(place, other, strict=True)]
        if distance is None:
            distance = algebra.Pow(total(map(squared, apart)), HALF, evaluate=False)
        normal = [product([x, inverted(distance)]) for x in apart]
        own = algebra.ZERO if isinstance(a, (Block, Convex)) else a.radius
        touch = moved(place, normal, negated(own))
        return Meeting(difference(distance, radius), touch, self._tangents(normal))

    def _tangents(self, normal: Vector) -> list[Vector]:
        """Directions at right angles to a normal that turns: those of a pole, turned on the shortest way.

        e - (e·n)(n + p)/(1 + p·n) jumps at one normal only, opposite to the pole, which no side of a level box has
        (Frisvad, Building an orthonormal basis from a 3D unit vector without normalization, J. Graph. Tools 16, 2012).
        """
        if self.planar:
            x, y, _ = normal
            return [[y, negated(x), algebra.ZERO]]
        turned = inverted(self._define(total([algebra.ONE, scalar_product(_POLE, normal)])))
        return [
            [
                difference(e, product([turned, scalar_product(tangent, normal), total([n, p])]))
                for e, n, p in zip(tangent, normal, _POLE, strict=True)
            ]
            for tangent in _TANGENTS_OF_POLE
        ]


def _origin_of_shapes(body: Body, is_child: bool) -> Expressions:
    """Where the origin that the offsets of a body's own shapes count from lies in its frame; see `expand`."""
    none = (algebra.ZERO,) * 3
    made = together(body.solids) if body.solids else None
    com = (*body.com, *none)[:3] if is_child else none
    if made is not None:
        return (
            none if is_child and body.centred else tuple(difference(x, c) for x, c in zip(com, made.centre))
        )
    return none if any(solid.offset for solid in body.solids) else com


def _balls(part: Any) -> list[Ball]:
    """The points of a shape that touch a plane."""
    if isinstance(part, Ball):
        return [part]
    if isinstance(part, Rod):
        return part.ends
    corners = part.corners() if isinstance(part, Convex) else (place for place, _ in part.corners())
    return [Ball(place, algebra.ZERO) for place in corners]


def _middles(part: Any) -> list[Ball]:
    """Points between those that touch a plane, which come first where a surface is curved: of edges and sides."""
    if isinstance(part, Rod):
        return [Ball(part.place, part.radius)]
    if isinstance(part, Block):
        return [Ball(place, algebra.ZERO) for place in part.middles()]
    corners = part.corners()
    pairs = (zip(corners[j], corners[k], strict=True) for j, k in part.edges)
    return [Ball([product([HALF, total([x, y])]) for x, y in pair], algebra.ZERO) for pair in pairs]


def _named(part: Any) -> str:
    return {Ball: "a sphere", Rod: "a capsule", Block: "a box", Convex: "a mesh"}[type(part)]


def _within(x: algebra.Expr, half: algebra.Expr) -> algebra.Expr:
    """A number, or the nearest one from -half to half: what is made of it has no kink, nor has its slope one."""
    upper = smooth_minimum(x, half, evaluate=False)
    return negated(smooth_minimum(negated(upper), half, evaluate=False))


Places = Iterator[
    tuple[Vector, Vector, algebra.Expr]
]  # places on the cores of both shapes, and what is around them


def _ball_to_ball(a: Ball, b: Ball) -> Places:
    yield a.place, b.place, total([a.radius, b.radius])


def _ball_to_rod(a: Ball, b: Rod) -> Places:
    apart = [difference(x, y) for x, y in zip(a.place, b.place, strict=True)]
    along = _within(scalar_product(apart, b.along), b.half)
    yield a.place, moved(b.place, b.along, along), total([a.radius, b.radius])


def _ball_to_block(a: Ball, b: Block) -> Places:
    apart = [difference(x, y) for x, y in zip(a.place, b.place, strict=True)]
    nearest = b.place
    for axis, half in zip(b.axes, b.halves, strict=True):
        nearest = moved(nearest, axis, _within(scalar_product(apart, axis), half))
    yield a.place, nearest, a.radius


def _rod_to_rod(a: Rod, b: Rod) -> Places:
    """In a plane, two rods that do not cross are nearest to each other at one of four ends."""
    for end in a.ends:
        yield from _ball_to_rod(end, b)
    for end in b.ends:
        for place, other, radius in _ball_to_rod(end, a):
            yield other, place, radius


def _rod_to_block(a: Rod, b: Block) -> Places:
    """In a plane, a rod that does not cross a box is nearest to it at one of two ends, or at one of four corners."""
    for end in a.ends:
        yield from _ball_to_block(end, b)
    for corner, _ in b.corners():
        for place, other, radius in _ball_to_rod(Ball(corner, algebra.ZERO), a):
            yield other, place, radius


_NEAREST: Mapping[tuple[type, type], Callable[[Any, Any], Places]] = {
    (Ball, Ball): _ball_to_ball,
    (Ball, Rod): _ball_to_rod,
    (Ball, Block): _ball_to_block,
    (Rod, Rod): _rod_to_rod,
    (Rod, Block): _rod_to_block,  # in a plane
}
