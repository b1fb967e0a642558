"""Frames of the links of a tree of joints, chosen so that few constants are left between one joint and the next.

As with Denavit and Hartenberg, the third axis is the joint's own, the origin slides along it to the common normal with
the next joint's axis, and constant turns about a joint's axis go into its angle or into the bodies that it carries.
Where all axes are parallel or at right angles already, frames keep their directions, and turning between them is free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

Triple = tuple[float, float, float]
Rows = tuple[Triple, Triple, Triple]
UNITY: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Triple = (0.0, 0.0, 0.0)
ROUND_OFF = 2e-15
PARALLEL = 1e-9  # sine of an angle between axes below which their common normal is not looked for


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
