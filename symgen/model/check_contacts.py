"""The checks of stops, friction and contacts: names, speeds linear in the rates, values that make sense."""

from __future__ import annotations

from collections.abc import Mapping

from .description import Description
from .linearity import NONLINEAR, rate_degree
from .sources import Address, Sources


def check_contacts(d: Description, sources: Sources) -> None:
    """Whether names are free, and sliding speeds linear in the rates."""
    events = {e.name for e in d.events}
    held = {c.name for c in (*d.constraints, *d.velocity_constraints)} | {x.name for x in d.loops}
    for table, elements in (("stops", d.stops), ("friction", d.frictions)):
        for x in elements:
            taken = "event" if x.name in events else "constraint" if x.name in held else None
            if taken is not None:
                message = f"the name '{x.name}' is taken by {'an' if taken == 'event' else 'a'} {taken}"
                raise sources.error(f"{table}.{x.name}", "", message, hint="choose another name")
    degrees = {r.name: 1 for r in d.rates if r.coordinate != r.name}
    for name, expression in d.definitions:
        degrees[name] = rate_degree(expression, degrees)
    speeds = [(f"friction.{f.name}", "speed", f.speed) for f in d.frictions]
    speeds += [(f"contacts.{c.name}", "slip", c.slip) for c in d.contacts if c.slip is not None]
    for table, key, speed in speeds:
        degree = rate_degree(speed, degrees)
        if degree == 0 or degree >= NONLINEAR:
            fault = "contains no rate" if degree == 0 else "is not linear in the rates"
            raise sources.error(
                table, key, f"the sliding speed {fault}", hint='for example "dot(x) - belt_speed"'
            )


def check_contact_values(d: Description, values: Mapping[Address, float | None], sources: Sources) -> None:
    """Check what parameters and constants determine."""
    restituting = [(f"stops.{s.name}", "restitution") for s in d.stops]
    restituting += [(f"joints.{j.name}", "restitution") for j in d.joints if j.restitution is not None]
    for table, key in restituting:
        value = values.get((table, key))
        if value is not None and not 0.0 <= value <= 1.0:
            message = f"the restitution is {value:g} at the parameters' values, not from 0 to 1"
            raise sources.error(table, key, message)
    for c in d.contacts:
        table = f"contacts.{c.name}"
        exponent = values.get((table, "exponent"))
        if exponent is not None and exponent < 1.0:
            raise sources.error(table, "exponent", f"the exponent is {exponent:g}: it is at least 1")
        for key in ("stiffness", "damping", "friction"):
            value = values.get((table, key))
            if value is not None and value < 0.0:
                raise sources.error(table, key, f"the {key} is negative at the parameters' values: {value:g}")
    for f in d.frictions:
        for key in ("coefficient", "static") if f.normal else ():
            value = values.get((f"friction.{f.name}", key))
            if value is not None and value < 0.0:
                message = f"the coefficient is negative at the parameters' values: {value:g}"
                raise sources.error(f"friction.{f.name}", key, message)
    smooth = [(f"friction.{f.name}", f.smooth) for f in d.frictions] + [
        (f"contacts.{c.name}", c.smooth) for c in d.contacts
    ]
    for table, width in smooth:
        value = None if width is None else values.get((table, "smooth"))
        if value is not None and value <= 0.0:
            message = f"the speed is not positive at the parameters' values: {value:g}"
            raise sources.error(table, "smooth", message, hint="leave 'smooth' out for friction that sticks")
