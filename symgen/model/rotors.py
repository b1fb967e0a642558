"""Rotors: inertias that spin in a body, without a body and a joint of their own.

A rotor is symmetric about its axis, so that its mass and what resists being turned across stay where they are in the
body, which holds them. What is left is J (dφ/dt + ω·n)²/2, with the angle φ in the body and the body's angular velocity
ω; J (dφ/dt)²/2 where gyroscopic effects are left out, and on ground.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import nearest
from . import algebra
from .declared import Declared
from .description import Coordinate, Description, Rotor
from .elements import Writer, scalar_product
from .evaluate import perpendiculars
from .functions import dot
from .joints import STATE_KEYS, direction
from .names import reference_fault
from .ready_made import HALF, WORLD
from .sources import Sources
from .unevaluated import product, squared, total

ROTOR_KEYS = ("inertia", "body", "axis", "at", "angle", "gyroscopic", "unit", *STATE_KEYS)
Z = (0.0, 0.0, 1.0)


def make_rotor(model: Declared, name: str, given: Mapping[str, Any]) -> Rotor:
    """A rotor from the arguments of `Model.rotor`; declares its coordinate unless its angle is given."""
    table, sources = f"rotors.{name}", model._sources
    given = {key: value for key, value in given.items() if value is not None}

    def error(key: str, message: str, hint: str):
        return sources.error(table, key, message, hint=hint)

    if "inertia" not in given:
        raise error("inertia", "the key 'inertia' is missing", "about the rotor's axis [kg m^2]")
    fault = reference_fault(given.get("body", WORLD))
    if fault is not None:
        raise error("body", fault, "name the body in which it spins")
    gyroscopic = given.get("gyroscopic", True)
    if not isinstance(gyroscopic, bool):
        raise error(
            "gyroscopic", f"'gyroscopic' is true or false, not {gyroscopic!r:.60}", "leave out the quotes"
        )
    if "angle" in given:
        for key in (*STATE_KEYS, "unit"):
            if key in given:
                raise error(
                    key,
                    f"'{key}' is that of a coordinate; this rotor has an 'angle'",
                    "leave one of them out",
                )
        angle = sources.expression(given["angle"], table, "angle")
    else:
        size = sources.unit(given.get("unit", "rad"), table, "unit")
        values, _ = model._initial(table, "{}", size, {key: given[key] for key in STATE_KEYS if key in given})
        model._declare_made(name, "coordinate", table, "rotor")
        model._made.append(Coordinate(name, "rad", **values, joint=name))
        angle = None
    return Rotor(
        name=name,
        inertia=sources.expression(given["inertia"], table, "inertia"),
        body=given.get("body", WORLD),
        axis=direction(model, table, "axis", given["axis"]) if "axis" in given else (),
        at=model._components(given["at"], table, "at") if "at" in given else (),
        angle=angle,
        gyroscopic=gyroscopic,
    )


def check_rotors(d: Description, sources: Sources) -> None:
    """Whether the bodies are there, and turn about what the rotors turn about."""
    bodies = {b.name: b for b in d.bodies}
    for r in d.rotors:
        table = f"rotors.{r.name}"
        if r.body == WORLD:
            continue
        if r.body not in bodies:
            hint = nearest(r.body, bodies, "bodies")
            raise sources.error(table, "body", f"there is no body '{r.body}'", hint=hint)
        if bodies[r.body].planar and r.axis and any(r.axis[:2]):
            message = f"the body '{r.body}' is planar, and turns about z"
            raise sources.error(table, "axis", message, hint="leave out 'axis', or make the body 3-D")
        if r.axis and not bodies[r.body].planar:
            sources.refuse_two_components(table, "axis", r.body)


def write_rotor(writer: Writer, r: Rotor) -> algebra.Expr:
    """The kinetic energy of a rotor."""
    angle = algebra.Symbol(r.name) if r.angle is None else r.angle
    speed = [dot(angle)]
    if r.body != WORLD and r.gyroscopic:
        body = writer.body[r.body]
        if body.planar and body.angle is not None:
            speed.append(dot(body.angle))
        else:
            first, second = (writer.direction(r.body, n) for n in perpendiculars(r.axis or Z))
            turning = [algebra.ZERO if x.is_Number else dot(x) for x in first]
            speed.append(scalar_product(second, turning))
    return product([HALF, r.inertia, squared(total(speed))])
