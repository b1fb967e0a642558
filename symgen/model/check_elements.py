"""Checks that the coordinates and bodies which forces, loads and events name are there."""

from __future__ import annotations

from ..errors import nearest
from .description import Description
from .sources import Sources


def check_elements(d: Description, sources: Sources) -> None:
    """Whether names of coordinates and bodies in forces, loads and events exist."""
    if not d.coordinates:
        raise sources.error("", "coordinates", "the model has no coordinates")
    _check_forces(d, sources)
    _check_resets(d, sources)
    _check_torques(d, sources)
    moving = [b for b in d.bodies if b.mass is not None or b.inertia]
    if not moving and d.kinetic is None:
        raise sources.error(
            "", "bodies", "nothing has kinetic energy", hint="give bodies, or [energy] kinetic"
        )


def _check_forces(d: Description, sources: Sources) -> None:
    own_name = {r.coordinate: r.name for r in d.rates if r.coordinate is not None}
    taken: dict[str, str] = {}
    for name, _ in d.forces:
        _check_moved(name, d, sources, "forces", name, "for a force to act on", with_rates=True)
        rate = own_name.get(name, name)
        if rate in taken:
            message = f"'{name}' and '{taken[rate]}' are one degree of freedom, and both have a force"
            raise sources.error("forces", name, message, hint="add them up")
        taken[rate] = name


def _check_resets(d: Description, sources: Sources) -> None:
    for event in d.events:
        table = f"events.{event.name}"
        for reset in event.resets:
            shown = f"dot({reset.target:.60})" if reset.is_rate else f"{reset.target:.60}"
            place = f"then.reset.{shown}"
            _check_moved(reset.target, d, sources, table, place, "to reset", with_rates=not reset.is_rate)


def _check_moved(
    name: str, d: Description, sources: Sources, table: str, key: str, purpose: str, with_rates: bool
) -> None:
    """Whether a name is that of a coordinate with a rate, or, `with_rates`, that of a rate."""
    coordinates = {c.name: c for c in d.coordinates}
    rates = {r.name for r in d.rates} if with_rates else set()
    if name in rates or (name in coordinates and coordinates[name].quaternion is None):
        return
    if name in coordinates:
        joint = coordinates[name].quaternion
        message = f"'{name}' is an element of the quaternion of the joint '{joint}'"
        raise sources.error(table, key, message, hint=f"use its angular velocity, such as '{joint}_wx'")
    known = [c for c in coordinates if coordinates[c].quaternion is None]
    known += sorted(rates - coordinates.keys()) if with_rates else []
    message = f"there is no coordinate '{name:.60}' {purpose}"
    raise sources.error(table, key, message, hint=nearest(name[:60], known, "coordinates"))


def _check_torques(d: Description, sources: Sources) -> None:
    bodies = {b.name: b for b in d.bodies}
    children = {j.child for j in d.joints}
    for load in d.loads:
        if not load.torque:
            continue
        table = f"loads.{load.name}"
        body = bodies.get(load.body)
        if body is None:
            message = f"there is no body '{load.body}' for a torque to act on"
            raise sources.error(table, "body", message, hint=nearest(load.body, bodies, "bodies"))
        if body.angle is None and not body.rotation and body.name not in children:
            what = "angle" if body.planar else "rotation"
            raise sources.error(
                table, "body", f"the body '{body.name}' does not turn", hint=f"give it '{what}'"
            )
        if len(load.torque) == 1 and not body.planar:
            message = f"a torque on the 3-D body '{body.name}' has three components"
            raise sources.error(table, "torque", message)
