"""The tree that joints make of the bodies: its order, and which coordinates move which body."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from .description import Body, Description, Joint
from .evaluate import X, Z, perpendicular
from .joint_types import TYPES

WORLD = "world"


def parents_first(joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """Joints, each after the joint of its parent, otherwise in the order given; none may be part of a cycle."""
    above = {j.child: j for j in joints}
    ordered: dict[str, Joint] = {}
    for joint in joints:
        chain = []
        while joint is not None and joint.name not in ordered:
            chain.append(joint)
            joint = above.get(joint.parent)
        ordered.update((j.name, j) for j in reversed(chain))
    return tuple(ordered.values())


def with_axes(joint: Joint, child: Body) -> Joint:
    """A joint with its default axes: x as in URDF, z where a planar body turns."""
    kind = TYPES[joint.type]
    if kind.axes == 0:
        return joint
    axis = joint.axis or (Z if child.planar and kind.plane == "normal" else X)
    axis2 = joint.axis2 or (perpendicular(axis) if kind.axes == 2 else ())
    return replace(joint, axis=axis, axis2=axis2)


def motion_of(body: str) -> str:
    """Stands for all coordinates that move a joint's child; no coordinate has such a name."""
    return f"motion of {body}"


def moved_by(d: Description, placed: Mapping[str, frozenset[str]]) -> dict[str, frozenset[str]]:
    """The coordinates that each body's motion depends on, in short for the children of joints.

    Parameters
    ----------
    d : Description
        Of a tree.
    placed : mapping of str to frozenset of str
        The coordinates in the expressions that place the other bodies.
    """
    moved = {WORLD: frozenset(), **placed}
    for joint in parents_first(d.joints):
        moves = joint.coordinates or moved[joint.parent]
        moved[joint.child] = frozenset({motion_of(joint.child)} if moves else ())
    return moved


def coordinates_in(names: Collection[str], d: Description, placed: Mapping[str, frozenset[str]]) -> set[str]:
    """The coordinates in `names`, some of which may be the motions of bodies; see `moved_by`."""
    above = {j.child: j for j in d.joints}
    found = set(names)
    pending = [body for body in above if motion_of(body) in found]
    seen: set[str] = set()
    while pending:
        body = pending.pop()
        if body in seen:
            continue
        seen.add(body)
        if body in above:
            found |= set(above[body].coordinates)
            pending.append(above[body].parent)
        else:
            found |= placed.get(body, frozenset())
    return found
