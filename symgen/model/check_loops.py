"""Checks of ready-made constraints: whether points, bodies and coordinates exist, and hold something apart."""

from __future__ import annotations

from ..errors import ModelError, nearest
from .description import Description, Loop
from .sources import Sources
from .tree_order import WORLD


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
            elif key == "coordinate":
                self.check_coordinate(loop, key, value)
            elif key == "coordinates":
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
        if "coordinates" in arguments and len(set(arguments["coordinates"])) == 1:
            raise self.error(loop, "coordinates", "the two coordinates are the same")
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
