"""Checks of joints, points, axes and ready-made constraints: names, the tree, and the x-y plane."""

from __future__ import annotations

from collections.abc import Collection

from ..errors import ModelError, nearest
from .description import Body, Description, Joint
from .joint_types import TYPES
from .sources import Sources
from .tree_order import WORLD, with_axes

IN_PLANE = tuple(name for name, kind in TYPES.items() if kind.plane)
OFF_AXIS = 1e-12  # components of a unit vector, m, rad


def check_tree(d: Description, sources: Sources) -> None:
    """Check that joints make trees of bodies that exist, and that every body is placed once."""
    bodies = {b.name: b for b in d.bodies}
    above: dict[str, Joint] = {}
    for j in d.joints:
        table = f"joints.{j.name}"
        _check_body(j.parent, table, "parent", bodies, sources)
        if j.child == WORLD:
            raise sources.error(
                table, "child", "the world cannot be the child of a joint", hint="swap parent and child"
            )
        _check_body(j.child, table, "child", bodies, sources, world=False)
        if j.child in above:
            message = f"the body '{j.child}' is the child of the joint '{above[j.child].name}' already"
            hint = "joints make a tree: close loops by [constraints], such as coincident"
            raise sources.error(table, "child", message, hint=hint)
        above[j.child] = j
    _check_cycles(d.joints, above, sources)
    for j in d.joints:
        _check_child(j, bodies[j.child], sources)
        if bodies[j.child].planar:
            _check_plane(with_axes(j, bodies[j.child]), bodies, sources)
        else:
            for key in ("axis", "axis2"):
                sources.refuse_two_components(f"joints.{j.name}", key, j.child)
    for body in d.bodies:
        if body.name not in above:
            _check_placed(body, sources)
    for what, elements in (("points", d.points), ("axes", d.axes)):
        for x in elements:
            _check_body(x.body, f"{what}.{x.name}", "body", bodies, sources)
    for p in d.points:
        if p.body != WORLD and bodies[p.body].planar and p.at[2] != 0:
            message = f"a point of the planar body '{p.body}' has no z component"
            raise sources.error(f"points.{p.name}", "at[2]", message, hint="leave it out")


def _check_body(
    name: str, table: str, key: str, bodies: Collection[str], sources: Sources, world: bool = True
) -> None:
    if name not in bodies and not (world and name == WORLD):
        known = [*bodies, WORLD] if world else list(bodies)
        raise sources.error(table, key, f"there is no body '{name}'", hint=nearest(name, known, "bodies"))


def _check_cycles(joints: tuple[Joint, ...], above: dict[str, Joint], sources: Sources) -> None:
    seen: set[str] = set()  # names of joints whose ways up are known to end
    for joint in joints:
        chain: dict[str, Joint] = {}
        upper: Joint | None = joint
        while upper is not None and upper.name not in seen:
            if upper.name in chain:
                names = list(chain)
                raise _cycle([chain[name] for name in names[names.index(upper.name) :]], joints, sources)
            chain[upper.name] = upper
            upper = above.get(upper.parent)
        seen.update(chain)


def _cycle(cycle: list[Joint], joints: tuple[Joint, ...], sources: Sources) -> ModelError:
    """The error about joints of which each is above the one before it, and the first above the last."""
    first = min(cycle, key=joints.index)
    start = cycle.index(first)
    downwards = [*reversed(cycle[start + 1 :] + cycle[:start]), first]
    bodies = " -> ".join([first.child, *(j.child for j in downwards)])
    message = f"the joints make a cycle of the bodies {bodies}, which hangs on nothing"
    hint = 'joints make a tree from "world": close loops by [constraints], such as coincident'
    return sources.error(f"joints.{first.name}", "parent", message, hint=hint)


def _check_child(joint: Joint, body: Body, sources: Sources) -> None:
    for key, given in (("angle", body.angle is not None), ("rotation", bool(body.rotation))):
        if given:
            message = f"the joint '{joint.name}' places this body, so that it takes no '{key}'"
            hint = "leave it out; 'com' is in the body's own frame, and 'origin' of the joint turns it"
            raise sources.error(f"bodies.{body.name}", key, message, hint=hint)


def _check_plane(joint: Joint, bodies: dict[str, Body], sources: Sources) -> None:
    """Whether a joint keeps its planar child in the x-y plane."""
    table = f"joints.{joint.name}"

    def error(key: str, why: str, hint: str):
        message = f"the planar body '{joint.child}' would leave the x-y plane: {why}"
        return sources.error(table, key, message, hint=hint)

    in_space = "or give 'com' of the body a third component to make it 3-D"
    if joint.parent != WORLD and not bodies[joint.parent].planar:
        raise error("parent", f"its parent '{joint.parent}' is 3-D", f"make both planar, {in_space}")
    if joint.type not in IN_PLANE:
        raise error(
            "type", f"the joint is {joint.type}", f"types in the plane: {', '.join(IN_PLANE)}; {in_space}"
        )
    for key, value in (("rpy[0]", joint.rpy[0]), ("rpy[1]", joint.rpy[1]), ("xyz[2]", joint.xyz[2])):
        if value != 0:
            raise error(f"origin.{key}", "this is not zero", f"set it to zero, {in_space}")
    if TYPES[joint.type].axes:
        x, y, z = map(abs, joint.axis)
        if TYPES[joint.type].plane == "along" and z > OFF_AXIS:
            raise error("axis", "the axis is not in it", f"slide along x and y, {in_space}")
        if TYPES[joint.type].plane == "normal" and max(x, y) > OFF_AXIS:
            raise error("axis", "the axis is not z", f"leave out 'axis', {in_space}")


def _check_placed(body: Body, sources: Sources) -> None:
    """A body that no joint places is placed by `com`, and by `angle` or `rotation` if it turns."""
    table = f"bodies.{body.name}"
    if not body.com:
        hint = 'for example com = ["x", "0"], or a joint whose child it is'
        raise sources.error(table, "com", "the centre of mass 'com' is missing", hint=hint)
    if body.inertia and body.planar and body.angle is None:
        message, hint = "an inertia needs the angle that the body turns through", 'give "angle"'
        raise sources.error(table, "angle", message, hint=hint)
    if body.inertia and not body.planar and not body.rotation:
        message = "the inertia has no effect: without 'rotation' the body does not turn"
        raise sources.error(table, "inertia", message, hint='give "rotation"')
