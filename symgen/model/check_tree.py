"""Checks of joints, points, axes and ready-made constraints: names, the tree, and the x-y plane.

Checks of ready-made constraints: whether points, bodies and coordinates exist, and hold something apart.
"""

from __future__ import annotations

from collections.abc import Collection

from ..errors import ModelError, nearest
from .description import Body, Description, Joint, Loop
from .joint_tree import WORLD, with_axes
from .joint_types import TYPES
from .sources import Sources

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
    framed = {f.name for f in d.frames}
    for what, elements in (("points", d.points), ("axes", d.axes)):
        for x in elements:
            table = "frames" if x.name in framed and what == "points" else what
            _check_body(x.body, f"{table}.{x.name}", "body", bodies, sources)
    for p in d.points:
        if p.body != WORLD and bodies[p.body].planar and not p.at[2].is_zero:
            message = f"a point of the planar body '{p.body}' has no z component"
            raise sources.error(
                f"{'frames' if p.name in framed else 'points'}.{p.name}",
                "at[2]",
                message,
                hint="leave it out",
            )


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
    heavy = [solid for solid in body.solids if solid.density is not None]
    if heavy and not body.centred and any(solid.offset for solid in body.solids):
        message = "the centre of mass follows from where the shapes are in the body's frame"
        raise sources.error(f"bodies.{body.name}", "com", message, hint="leave out 'com', or every 'offset'")


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
        if not value.is_zero:
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
    if not body.com or body.centred:
        hint = 'for example com = ["x", "0"], or a joint whose child it is'
        raise sources.error(table, "com", "the centre of mass 'com' is missing", hint=hint)
    if body.solids:  # a point mass with a shape, where it does not turn
        return
    if body.inertia and body.planar and body.angle is None:
        message, hint = "an inertia needs the angle that the body turns through", 'give "angle"'
        raise sources.error(table, "angle", message, hint=hint)
    if body.inertia and not body.planar and not body.rotation:
        message = "the inertia has no effect: without 'rotation' the body does not turn"
        raise sources.error(table, "inertia", message, hint='give "rotation"')


class LoopChecker:
    """Checks one ready-made constraint after the other."""

    def __init__(self, d: Description, sources: Sources) -> None:
        self.sources = sources
        self.body_of = {p.name: p.body for p in d.points}
        self.height = {p.name: p.at[2] for p in d.points}
        self.planar = {b.name: b.planar for b in d.bodies}
        self.coordinates = [c.name for c in d.coordinates if c.quaternion is None]
        self.quaternions = {c.name: c.quaternion for c in d.coordinates if c.quaternion is not None}

    def check(self, loop: Loop) -> None:
        """Raises `ModelError` for the first thing that is wrong."""
        for key, value in loop.arguments:
            if key in ("point", "line", "plane"):
                self.check_point(loop, key, value)
            elif key == "points":
                for k, name in enumerate(value):
                    self.check_point(loop, "" if loop.kind == "coincident" else key, name, f"[{k}]")
            elif key == "body":
                self.check_body(loop, key, value)
            elif key == "bodies":
                for k, name in enumerate(value):
                    self.check_body(loop, f"{key}[{k}]", name)
            elif key in ("coordinate", "input", "sun", "ring", "carrier"):
                self.check_coordinate(loop, key, value)
            elif key in ("coordinates", "outputs"):
                for k, name in enumerate(value):
                    self.check_coordinate(loop, f"{key}[{k}]", name)
        self.check_bodies_differ(loop, dict(loop.arguments))
        self.check_plane(loop, dict(loop.arguments))

    def error(self, loop: Loop, key: str, message: str, hint: str | None = None) -> ModelError:
        """The error for an argument of a ready-made constraint."""
        place = f"{loop.kind}.{key}" if key and not key.startswith("[") else loop.kind + key
        return self.sources.error(f"constraints.{loop.name}", place, message, hint=hint)

    def check_point(self, loop: Loop, key: str, name: str, element: str = "") -> None:
        """Refuse the name of a point that is not there."""
        if name not in self.body_of:
            hint = nearest(name, self.body_of, "points") or "declare it in [points]"
            raise self.error(loop, key + element, f"there is no point '{name}'", hint)

    def check_body(self, loop: Loop, key: str, name: str) -> None:
        """Refuse the name of a body that is not there."""
        known = [*self.planar, WORLD]
        if name not in known:
            raise self.error(loop, key, f"there is no body '{name}'", nearest(name, known, "bodies"))

    def check_coordinate(self, loop: Loop, key: str, name: str) -> None:
        """Refuse the name of a coordinate that is not there, or is an element of a quaternion."""
        if name in self.quaternions:
            message = f"'{name}' is an element of the quaternion of the joint '{self.quaternions[name]}'"
            raise self.error(loop, key, message, "hold points or axes instead, as by coincident or parallel")
        if name not in self.coordinates:
            hint = nearest(name, self.coordinates, "coordinates")
            raise self.error(loop, key, f"there is no coordinate '{name}'", hint)

    def check_bodies_differ(self, loop: Loop, arguments: dict) -> None:
        """Two points of one body, or an axis with itself, hold nothing."""
        shafts = [arguments[key] for key in ("input", "sun", "ring", "carrier") if key in arguments]
        shafts += [*arguments.get("coordinates", ()), *arguments.get("outputs", ())]
        if len(set(shafts)) < len(shafts):
            what = (
                "the two coordinates are the same"
                if len(shafts) == 2
                else "two of the coordinates are the same"
            )
            raise self.error(loop, "coordinates" if "coordinates" in arguments else "", what)
        if "bodies" in arguments:
            bodies = arguments["bodies"]
        else:
            names = arguments.get("points") or [
                arguments[k] for k in ("point", "line", "plane") if k in arguments
            ]
            bodies = [self.body_of[name] for name in names]
        if len(bodies) == 2 and len({*bodies, arguments.get("body", bodies[0])}) == 1:
            what = "the world" if bodies[0] == WORLD else f"the body '{bodies[0]}'"
            message = f"both sides are fixed in {what}, so that this constraint holds nothing"
            raise self.error(loop, "", message, "choose points of two bodies")

    def check_plane(self, loop: Loop, arguments: dict) -> None:
        """Between planar bodies, points of the world and directions are in the x-y plane, too."""
        directions = _directions(loop, arguments, self.body_of)
        points = [arguments[key] for key in ("point", "line", "plane") if key in arguments]
        points += arguments.get("points", ())
        bodies = [body for _, body, _ in directions] + [self.body_of[p] for p in points]
        if not all(b == WORLD or self.planar[b] for b in bodies):
            for key, body, _ in directions:
                if body != WORLD and not self.planar[body]:
                    self.sources.refuse_two_components(f"constraints.{loop.name}", f"{loop.kind}.{key}", body)
            return
        for key, _, direction in directions:
            if direction[2] != 0:
                message = "between planar bodies a direction has no z component"
                raise self.error(loop, key, message, "leave it out, or make one of the bodies 3-D")
        for p in points:
            if self.height[p] != 0:
                message = f"the point '{p}' is not in the x-y plane, in which the other body stays"
                raise self.error(loop, "", message, "leave out its z component, or make the body 3-D")


def _directions(
    loop: Loop, arguments: dict, body_of: dict[str, str]
) -> list[tuple[str, str, tuple[float, ...]]]:
    """The directions of a constraint: key, body in which it is fixed, components."""
    if loop.kind == "parallel":
        pairs = enumerate(zip(arguments["bodies"], arguments["axes"], strict=True))
        return [(f"axes[{k}]", body, axis) for k, (body, axis) in pairs]
    for base, key in (("line", "direction"), ("plane", "normal")):
        if base in arguments:
            return [(key, arguments.get("body", body_of[arguments[base]]), arguments[key])]
    return []
