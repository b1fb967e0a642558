"""From a description to trees of links with one elementary joint each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from symgen.model.evaluate import Z

from ...errors import ModelError
from ...model.description import Body, Description, Joint
from ...model.joint_types import TYPES
from ..graph.kinds import MOTION
from ..graph.quaternions import rotation_matrix
from ..graph.vectors import (
    Inertia,
    Matrix,
    Turn,
    Vector,
    identity,
    minus,
    plus,
    product,
    scaled,
    times,
    transposed,
    transposed_times,
    zeros,
)
from ..load import Loader
from .link_frames import JointLine, LinkFrame, choose_frames, snap, split_turn
from .links import Link, Links, Place, Subspace, carry_inertia

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
        rotation = self._snapped(product(g, parent.rotation, _roll_pitch_yaw(g, rpy)))
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


def _roll_pitch_yaw(g, rpy: Vector) -> Matrix:
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
