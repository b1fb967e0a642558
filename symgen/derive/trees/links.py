"""From a description to trees of links with one elementary joint each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from ...errors import ModelError
from ...model.description import Body, Description, Joint
from ...model.evaluate import Z
from ...model.joint_types import TYPES
from ..graph.graph import Graph
from ..graph.nodes import MOTION
from ..graph.vectors import (
    Inertia,
    Matrix,
    Turn,
    Vector,
    identity,
    minus,
    plus,
    product,
    rotation_matrix,
    scaled,
    times,
    transposed,
    transposed_times,
    zeros,
)
from ..load import Loader

Subspace = list[tuple[Vector, Vector]]


@dataclass
class Link:
    """A moving frame and what is fixed in it.

    Its origin is at `offset` in the parent's axes, and further by `slide` along its own third axis; `turn` rotates from
    the parent's axes to its own. `subspace` is the motion subspace S of its joint (Featherstone 2008, section 3.5): for
    each rate what a unit of it adds to the link's angular velocity and to the velocity of its origin. In the link's own
    axes these are constant, and translations are along the third. `rates` are indices in v. `inertia` is what the
    recursive algorithms use, see `carry_inertia`. A base has no parent (-1).
    """

    parent: int
    turn: Turn
    offset: Vector
    slide: int
    subspace: Subspace
    rates: list[int]
    inertia: Inertia


@dataclass(frozen=True)
class Place:
    """A frame fixed in a link: where its origin is in the link's axes, and the rotation from its axes to the link's."""

    link: int
    origin: Vector
    rotation: Matrix


@dataclass
class Links:
    """The links of one tree, parents first; link 0 is the base: the world, or a body that is placed by hand."""

    links: list[Link]
    places: dict[str, Place]


def along(g: Graph, subspace: Subspace, values: list[int]) -> tuple[Vector, Vector]:
    """S times values of its rates: an angular and a linear vector."""
    angular, linear = zeros(g), zeros(g)
    for (turning, sliding), value in zip(subspace, values, strict=True):
        angular = plus(g, angular, scaled(g, value, turning))
        linear = plus(g, linear, scaled(g, value, sliding))
    return angular, linear


def carry_inertia(g: Graph, links: list[Link]) -> None:
    """Move to the parents what a joint's motion does not move, and so leave the links fewer parameters.

    A rod of any mass along the axis of a revolute joint does not feel its turning; so it may as well be fixed to the
    parent. Every body is the sum of such a rod and a rest with seven parameters (base inertial parameters; Gautier and
    Khalil 1990). Likewise go a point mass in the centre of a spherical joint, and behind a prismatic joint all that
    resists turning only. Motion, energies and joint forces stay the same; so do composite bodies as CRBA uses them.
    """
    for link in reversed(links):
        if link.parent < 0:
            continue
        carried = unmoved(g, link)
        link.inertia = link.inertia.minus(g, carried)
        links[link.parent].inertia = links[link.parent].inertia.plus(
            g, carried.turned(link.turn.constant).shifted(g, link.offset)
        )


def unmoved(g: Graph, link: Link) -> Inertia:
    """The part of a link's inertia that its joint's motion leaves as it is, seen from the parent."""
    own, nothing = link.inertia, zeros(g)
    yy = own.tensor[1][1]
    n_turns = sum(any(x != g.zero for x in turning) for turning, _ in link.subspace)
    slides = any(x != g.zero for _, sliding in link.subspace for x in sliding)
    if n_turns == 0:  # all that has no mass stays when it slides
        return Inertia(g.zero, nothing, own.tensor)
    if n_turns > 1:
        return Inertia(own.mass, nothing, Inertia.nothing(g).tensor)
    rod = [[yy, g.zero, g.zero], [g.zero, yy, g.zero], nothing]
    if slides:
        return Inertia(g.zero, nothing, rod)
    return Inertia(own.mass, [g.zero, g.zero, own.first[2]], rod)


# As with Denavit and Hartenberg, the third axis is the joint's own, the origin slides along it to the common normal
# with the next joint's axis, and constant turns about a joint's axis go into its angle or into the bodies that it
# carries. Where all axes are parallel or at right angles already, frames keep their directions, and turning between
# them is free.

Triple = tuple[float, float, float]
Rows = tuple[Triple, Triple, Triple]
UNITY: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Triple = (0.0, 0.0, 0.0)
ROUND_OFF = 2e-15
# Sine of an angle between axes below which their common normal is not looked for: it lies a distance over this away,
# and inertias about it lose the square of that.
PARALLEL = 1e-2


@dataclass(frozen=True)
class JointLine:
    """A joint in the given frame of its parent link: numbers, or None where they depend on parameters.

    `rotation` and `origin` place the link's given frame at zero coordinates; `axis` is in that frame. `turns` tells
    whether the joint rotates about its axis, `slides` whether it moves along it; both: a screw;
    neither: a spherical joint.
    """

    parent: int
    rotation: Rows | None
    origin: Triple | None
    axis: Triple
    turns: bool
    slides: bool


@dataclass
class LinkFrame:
    """A link's chosen frame in its given one; `angle` is to be added to the joint's angle."""

    rotation: Rows = UNITY
    origin: Triple = ORIGIN
    angle: float = 0.0


def choose_frames(joints: Sequence[JointLine | None]) -> list[LinkFrame]:
    """Frames of links in an order with parents first; None stands for a base, whose frame stays.

    Parameters
    ----------
    joints : sequence of JointLine or None

    Returns
    -------
    list of LinkFrame
    """
    frames = [LinkFrame() for _ in joints]
    next_joint = _main_children(joints)
    for i in reversed(range(len(joints))):
        if joints[i] is not None and joints[i].origin is not None and joints[i].rotation is not None:
            frames[i].origin = _origin(joints, frames, i, next_joint[i])
    for i, joint in enumerate(joints):
        if joint is not None and (joint.turns or joint.slides):
            frames[i].rotation = _rotation(joints, frames, i, next_joint[i])
            if joint.rotation is not None:
                _absorb_turn(joint, frames, i, next_joint[i] is None)
    return frames


def split_turn(matrix: Rows) -> tuple[Rows, float]:
    """A rotation as one with an axis in common with its frame, and an angle about the new third axis after it.

    Matrices of zeros and units, and those whose third column has no zero, come back whole.
    """
    normal = tuple(row[2] for row in matrix)
    if _is_permutation(matrix) or 0.0 not in normal:
        return matrix, 0.0
    k = normal.index(0.0)
    first = UNITY[k]
    second = _cross(normal, first)
    rest = [(first[i], second[i], normal[i]) for i in range(3)]
    turned = snapped(multiply(transpose(rest), matrix))
    return tuple(rest), math.atan2(turned[1][0], turned[0][0])


def _main_children(joints: Sequence[JointLine | None]) -> list[int | None]:
    """The child of each link that carries the most links, the first of equals."""
    size = [1] * len(joints)
    main: list[int | None] = [None] * len(joints)
    for i in reversed(range(len(joints))):
        if joints[i] is not None:
            parent = joints[i].parent
            size[parent] += size[i]
            best = main[parent]
            if best is None or size[i] >= size[best]:
                main[parent] = i
    return main


def _origin(joints: Sequence[JointLine | None], frames: list[LinkFrame], i: int, child: int | None) -> Triple:
    """Where the link's frame is put: on its axis, anywhere for a link that only slides."""
    joint = joints[i]
    if child is None:
        return _nearest_to_parent(joints, i)
    after = joints[child]
    if after.origin is None or after.rotation is None or not (joint.turns or joint.slides):
        return ORIGIN
    target = _add(after.origin, apply(after.rotation, frames[child].origin))
    if joint.slides and not joint.turns:
        return target
    along = _dot(joint.axis, target)
    if after.turns:
        along = _foot(joint.axis, after.origin, apply(after.rotation, after.axis), along)
    return tuple(along * x for x in joint.axis)


def _nearest_to_parent(joints: Sequence[JointLine | None], i: int) -> Triple:
    """The point of a last joint's axis that is nearest to the axis before it."""
    joint = joints[i]
    before = joints[joint.parent]
    if before is None or not (joint.turns and before.turns):
        return ORIGIN
    back = transpose(joint.rotation)
    origin = apply(back, tuple(-x for x in joint.origin))
    along = _foot(joint.axis, origin, apply(back, before.axis), 0.0)
    return tuple(along * x for x in joint.axis)


def _foot(axis: Triple, point: Triple, other: Triple, parallel: float) -> float:
    """Distance along `axis` through the origin to its common normal with `other` through `point`."""
    normal = _cross(axis, other)
    square = _dot(normal, normal)
    if square < PARALLEL**2:
        return parallel
    return _dot(_cross(point, other), normal) / square


def _rotation(joints: Sequence[JointLine | None], frames: list[LinkFrame], i: int, child: int | None) -> Rows:
    """Directions of the link's frame: as given where that fits the next joint, else along the common normal."""
    axis = joints[i].axis
    given = along_third(axis)
    after = joints[child] if child is not None else None
    if after is None or after.rotation is None or not (after.turns or after.slides):
        return given
    between = multiply(transpose(given), multiply(after.rotation, along_third(after.axis)))
    if _is_permutation(snapped(between)):
        return given
    normal = _cross(axis, apply(after.rotation, after.axis))
    if _dot(normal, normal) < PARALLEL**2:
        if after.origin is None:
            return given
        offset = _add(after.origin, apply(after.rotation, frames[child].origin))
        offset = tuple(x - y for x, y in zip(offset, frames[i].origin, strict=True))
        along = _dot(offset, axis)
        normal = tuple(x - along * u for x, u in zip(offset, axis, strict=True))
        if _dot(normal, normal) < (PARALLEL * max(map(abs, (*offset, 1e-300)))) ** 2:
            return given
    length = math.sqrt(_dot(normal, normal))
    first = tuple(x / length for x in normal)
    return snapped(transpose((first, _cross(axis, first), axis)))


def _absorb_turn(joint: JointLine, frames: list[LinkFrame], i: int, last: bool) -> None:
    """Put a constant turn about the joint's axis into its angle, or into what it carries if nothing else follows."""
    frame = frames[i]
    outer = transpose(frames[joint.parent].rotation)
    _, angle = split_turn(snapped(multiply(outer, multiply(joint.rotation, frame.rotation))))
    if angle == 0.0:
        return
    if last:
        c, s = math.cos(angle), math.sin(angle)
        frame.rotation = multiply(frame.rotation, ((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))
    elif joint.turns:
        frame.angle = angle


def along_third(axis: Triple) -> Rows:
    """A rotation whose third column is `axis`; one of zeros and units if that is a coordinate axis."""
    k = max(range(3), key=lambda j: abs(axis[j]))
    if abs(axis[k]) == 1.0:
        first, second = UNITY[(k + 1) % 3], UNITY[(k + 2) % 3]
        if axis[k] < 0.0:
            first, second = second, first
    else:
        helper = UNITY[min(range(3), key=lambda j: abs(axis[j]))]
        second = _cross(axis, helper)
        length = math.sqrt(_dot(second, second))
        second = tuple(x / length for x in second)
        first = _cross(second, axis)
    return transpose((first, second, axis))


def snapped(matrix: Sequence[Sequence[float]]) -> Rows:
    """A rotation with its elements exactly 0 or ±1 where they are within round-off."""
    return tuple(tuple(snap(x) for x in row) for row in matrix)


def snap(x: float) -> float:
    """An element of a rotation, exactly 0 or ±1 where it is within round-off."""
    nearest = round(x)
    return float(nearest) if abs(x - nearest) < ROUND_OFF else x


def multiply(a: Sequence[Triple], b: Sequence[Triple]) -> Rows:
    """Product of matrices."""
    columns = transpose(b)
    return tuple(tuple(_dot(row, column) for column in columns) for row in a)


def transpose(a: Sequence[Triple]) -> Rows:
    """Transposed matrix."""
    return tuple(zip(*a, strict=True))


def apply(a: Sequence[Triple], x: Triple) -> Triple:
    """Matrix times vector."""
    return tuple(_dot(row, x) for row in a)


def _is_permutation(matrix: Rows) -> bool:
    return all(x in (0.0, 1.0, -1.0) for row in matrix for x in row)


def _dot(a: Triple, b: Triple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _add(a: Triple, b: Triple) -> Triple:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _cross(a: Triple, b: Triple) -> Triple:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


NEGLIGIBLE = 1e-14  # of the lengths that an offset is made of: what cancellation leaves


@dataclass
class _Stage:
    """An elementary joint as the description gives it, before frames are chosen.

    `motion` is one of those in `joint_types.Element`, or "base"; `advance` is what a screw slides by a radian [m].
    """

    motion: str
    parent: int
    rotation: Matrix
    origin: Vector
    axis: tuple[float, float, float] = Z
    coordinates: list[int] = field(default_factory=list)
    rates: list[int] = field(default_factory=list)
    advance: int | None = None

    @property
    def turns(self) -> bool:
        """Whether it turns about its axis."""
        return self.motion in ("turn", "screw")

    @property
    def slides(self) -> bool:
        """Whether it slides along its axis."""
        return self.motion in ("slide", "screw")


def joints_by_base(description: Description) -> dict[str, list[Joint]]:
    """The joints of each tree, by the world or the body placed by hand that it stands on."""
    trees: dict[str, list[Joint]] = {}
    base_of: dict[str, str] = {}
    for joint in description.joints:
        base = base_of.get(joint.parent, joint.parent)
        base_of[joint.child] = base
        trees.setdefault(base, []).append(joint)
    return trees


def build_links(
    loader: Loader, description: Description, q: list[int], base: str, joints: list[Joint]
) -> Links:
    """The links of one tree.

    Parameters
    ----------
    loader : Loader
    description : Description
    q : list of int
        Nodes of the coordinates.
    base : str
    joints : list of Joint
        Parents first.

    Raises
    ------
    ModelError
        If a joint's origin or a body in the tree depends on more than parameters.
    """
    gatherer = _Gatherer(loader, description, base)
    for joint in joints:
        gatherer.add(joint)
    return gatherer.links(q)


class _Gatherer:
    """Collects the joints of one tree."""

    def __init__(self, loader: Loader, description: Description, base: str) -> None:
        self.loader, self.g, self.base = loader, loader.g, base
        self.bodies = {b.name: b for b in description.bodies}
        self.coordinate = {c.name: k for k, c in enumerate(description.coordinates)}
        self.rate = {r.name: k for k, r in enumerate(description.rates)}
        self.stages = [_Stage("base", -1, identity(self.g), zeros(self.g))]
        self.given: dict[str, Place] = {base: Place(0, zeros(self.g), identity(self.g))}

    def add(self, joint: Joint) -> None:
        """Append the elementary joints of a joint, and place its child."""
        g, parent = self.g, self.given[joint.parent]
        xyz = [self._constant(x, f"joints.{joint.name}", "origin") for x in joint.xyz]
        rpy = [self._constant(x, f"joints.{joint.name}", "origin") for x in joint.rpy]
        link = parent.link
        origin = plus(g, parent.origin, times(g, parent.rotation, xyz))
        rotation = self._snapped(product(g, parent.rotation, roll_pitch_yaw(g, rpy)))
        q = [self.coordinate[name] for name in joint.coordinates]
        v = [self.rate[name] for name in joint.rates]
        advance = None
        if joint.pitch is not None:
            pitch = self._constant(joint.pitch, f"joints.{joint.name}", "pitch")
            advance = g.div(pitch, g.const(2.0 * math.pi))
        for element in TYPES[joint.type].elements:
            k, ball = element.coordinate, element.motion == "ball"
            axis, coordinates, rates = (
                (Z, q[k:], v[k:]) if ball else (element.direction(joint), [q[k]], [v[k]])
            )
            self.stages.append(
                _Stage(element.motion, link, rotation, origin, axis, coordinates, rates, advance)
            )
            link, rotation, origin = len(self.stages) - 1, identity(g), zeros(g)
        self.given[joint.child] = Place(link, origin, rotation)

    def links(self, q: list[int]) -> Links:
        """The links with their chosen frames and inertia."""
        g = self.g
        frames = choose_frames([self._line(stage) for stage in self.stages])
        links = [self._link(k, frames, q) for k in range(len(self.stages))]
        places = {name: self._place(place, frames[place.link]) for name, place in self.given.items()}
        for name, place in places.items():
            if name != self.base:
                inertia = self._body_inertia(self.bodies[name], place)
                links[place.link].inertia = links[place.link].inertia.plus(g, inertia)
        carry_inertia(g, links)
        return Links(links, places)

    def _line(self, stage: _Stage) -> JointLine | None:
        if stage.parent < 0:
            return None
        rows = [self._numbers(row) for row in stage.rotation]
        return JointLine(
            parent=stage.parent,
            rotation=tuple(rows) if None not in rows else None,
            origin=self._numbers(stage.origin),
            axis=stage.axis,
            turns=stage.turns,
            slides=stage.slides,
        )

    def _link(self, k: int, frames: list[LinkFrame], q: list[int]) -> Link:
        g, stage, frame = self.g, self.stages[k], frames[k]
        if stage.parent < 0:
            return Link(-1, Turn(g, identity(g)), zeros(g), g.zero, [], [], Inertia.nothing(g))
        outer = frames[stage.parent]
        outer_rotation = self._matrix(outer.rotation)
        rotation = product(g, stage.rotation, self._matrix(frame.rotation))
        rotation = self._snapped(product(g, transposed(outer_rotation), rotation))
        lengths = [*map(abs, outer.origin), *map(abs, frame.origin)]
        lengths += [abs(g.value(x) or 0.0) for x in stage.origin]
        offset = plus(g, stage.origin, times(g, stage.rotation, self._vector(frame.origin)))
        offset = minus(g, offset, self._vector(outer.origin))
        offset = [self._cleared(x, max(lengths)) for x in transposed_times(g, outer_rotation, offset)]
        coordinates = [q[i] for i in stage.coordinates]
        slide = g.zero
        if stage.slides:
            slide = g.mul(stage.advance, coordinates[0]) if stage.turns else coordinates[0]
        if stage.turns:
            turn = self._turn_about_axis(rotation, frame, coordinates[0])
        elif stage.slides:
            turn = Turn(g, rotation)
        else:
            turn = Turn(g, product(g, rotation, rotation_matrix(g, coordinates)))
        subspace = self._subspace(stage)
        return Link(stage.parent, turn, offset, slide, subspace, stage.rates, Inertia.nothing(g))

    def _subspace(self, stage: _Stage) -> Subspace:
        g, unit = self.g, identity(self.g)
        if not (stage.turns or stage.slides):
            return [(axis, zeros(g)) for axis in unit]
        turning = unit[2] if stage.turns else zeros(g)
        sliding = scaled(g, stage.advance if stage.turns else g.one, unit[2]) if stage.slides else zeros(g)
        return [(turning, sliding)]

    def _turn_about_axis(self, rotation: Matrix, frame: LinkFrame, angle: int) -> Turn:
        g = self.g
        rows = [self._numbers(row) for row in rotation]
        if frame.angle != 0.0 and None not in rows:
            constant, extra = split_turn(tuple(rows))
            rotation, angle = self._matrix(constant), g.add(angle, g.const(extra))
        return Turn(g, rotation, angle)

    def _place(self, place: Place, frame: LinkFrame) -> Place:
        """A place in the given frame of its link as one in the chosen frame."""
        g = self.g
        chosen = self._matrix(frame.rotation)
        origin = transposed_times(g, chosen, minus(g, place.origin, self._vector(frame.origin)))
        return Place(place.link, origin, self._snapped(product(g, transposed(chosen), place.rotation)))

    def _body_inertia(self, body: Body, place: Place) -> Inertia:
        """A body's ten parameters in its link's frame."""
        g, at = self.g, f"bodies.{body.name}"
        com = [self._constant(x, at, "com") for x in body.com]
        com += [g.zero] * (3 - len(com))
        mass = self._constant(body.mass, at, "mass") if body.mass is not None else g.zero
        tensor = inertia_tensor(self.loader, body)
        turn = Turn(g, place.rotation)
        centred = Inertia(
            mass, zeros(g), turn.up_symmetric(tensor) if tensor else [zeros(g) for _ in range(3)]
        )
        return centred.shifted(g, plus(g, place.origin, times(g, place.rotation, com)))

    def _constant(self, expression, table: str, key: str) -> int:
        node = self.loader.load(expression)
        if self.g.mask[node] & MOTION:
            raise ModelError(
                "this depends on the motion, but what a joint places may depend on parameters and constants only",
                table=table,
                key=key,
                hint="place the body by hand, with `com` and `rotation` in world axes",
            )
        return node

    def _numbers(self, nodes: Vector) -> tuple[float, float, float] | None:
        values = tuple(self.g.value(x) for x in nodes)
        return None if None in values else values

    def _matrix(self, rows) -> Matrix:
        return [self._vector(row) for row in rows]

    def _vector(self, values) -> Vector:
        return [self.g.const(x) for x in values]

    def _snapped(self, matrix: Matrix) -> Matrix:
        g = self.g
        return [[x if g.value(x) is None else g.const(snap(g.value(x))) for x in row] for row in matrix]

    def _cleared(self, node: int, length: float) -> int:
        value = self.g.value(node)
        return self.g.zero if value is not None and abs(value) <= NEGLIGIBLE * length else node


def roll_pitch_yaw(g, rpy: Vector) -> Matrix:
    """URDF's rotation Rz(yaw) Ry(pitch) Rx(roll), applied from the left as turns about fixed axes."""
    roll, pitch, yaw = rpy
    matrix = identity(g)
    for k, angle in ((2, yaw), (1, pitch), (0, roll)):
        i, j = (k + 1) % 3, (k + 2) % 3
        c, s = g.call("cos", angle), g.call("sin", angle)
        turn = identity(g)
        turn[i][i], turn[i][j], turn[j][i], turn[j][j] = c, g.neg(s), s, c
        matrix = product(g, matrix, turn)
    return matrix


def inertia_tensor(loader: Loader, body: Body) -> Matrix | None:
    """A body's inertia tensor about its centre of mass in its own axes; None for a point mass."""
    g = loader.g
    values = [loader.load(x) for x in body.inertia]
    if not values:
        return None
    if len(values) == 1:  # planar: only the rotation about z matters
        return [[g.zero] * 3, [g.zero] * 3, [g.zero, g.zero, values[0]]]
    xx, yy, zz, xy, xz, yz = values + [g.zero] * (6 - len(values))
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
