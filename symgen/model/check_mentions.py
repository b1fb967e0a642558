"""The check that every coordinate moves something, or is held by something."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from .check_values import is_massless
from .description import Body, Description, Joint
from .items import Item
from .joint_types import TYPES
from .sources import Sources
from .tree_order import coordinates_in, motion_of

Found = list[tuple[Item, frozenset[str]]]


def check_mentions(
    d: Description, sources: Sources, found: Found, placed: Mapping[str, frozenset[str]]
) -> None:
    """Every coordinate must move something, or be held by something.

    Parameters
    ----------
    d : Description
        With all that it says in short written out.
    sources : Sources
    found : list of (Item, frozenset of str)
        Its expressions with the coordinates that each depends on.
    placed : mapping of str to frozenset of str
        The coordinates that bodies which no joint places depend on; needed where points or axes are in use.
    """
    massless = {b.name for b in d.bodies if is_massless(b)}
    drawn_only = {f"bodies.{name}" for name in massless}
    mentioned = _moved_by_joints(d, massless)
    forced = {name for name, _ in d.forces}
    mentioned |= {r.coordinate for r in d.rates if r.name in forced}
    for j in d.joints:
        if TYPES[j.type].quaternion and forced.intersection(j.rates[-3:]):
            mentioned |= set(j.coordinates[-4:])
    for item, coordinates in found:
        moves = (
            item.table.startswith("bodies.")
            and item.table not in drawn_only
            and not item.key.startswith("shape")
        )
        acts = item.table.startswith("loads.") or item.table in (
            "forces",
            "constraints",
            "velocity_constraints",
        )
        if moves or acts or (item.table, item.key) == ("energy", "kinetic"):
            mentioned |= coordinates
    mentioned = coordinates_in(mentioned, d, placed)
    joints = {name: j for j in d.joints for name in j.coordinates}
    for c in d.coordinates:
        if c.name in mentioned:
            continue
        if c.name in joints:
            _refuse_idle_joint(joints[c.name], c.name, sources)
        message = f"no kinetic energy, force or constraint mentions the coordinate '{c.name}'"
        raise sources.error("coordinates", c.name, message, hint="use it, or leave it out")


def _refuse_idle_joint(joint: Joint, coordinate: str, sources: Sources) -> None:
    message = (
        f"the coordinate '{coordinate}' of this joint moves nothing that has mass, and no constraint holds it"
    )
    hint = f"give '{joint.child}' an inertia or a centre of mass off the axis, or give the joint an armature"
    raise sources.error(f"joints.{joint.name}", "child", message, hint=hint)


def _moved_by_joints(d: Description, massless: Collection[str]) -> set[str]:
    """The motions of joints' children that have mass."""
    parents = {j.parent for j in d.joints}
    bodies = {b.name: b for b in d.bodies}
    found: set[str] = set()
    for joint in d.joints:
        child = joint.child
        if child in massless:
            continue
        if child not in parents and _is_point(bodies[child]):
            found |= {motion_of(joint.parent), *_translations(joint)}
        else:
            found.add(motion_of(child))
    return found


def _is_point(body: Body) -> bool:
    """Whether a body is a point mass in the origin of its frame, which does not feel the joint turn."""
    return not body.inertia and all(x == 0 for x in body.com)


def _translations(joint: Joint) -> Iterator[str]:
    """The coordinates that do not turn the child."""
    return (name for name, unit in zip(joint.coordinates, TYPES[joint.type].units) if unit == "m")
