"""Checks of numbers at the parameters' values: finite, masses not negative, planes kept, constraints that hold."""

from __future__ import annotations

from collections.abc import Mapping

from .check_contacts import check_contact_values
from .description import Body, Description, Joint
from .evaluate import NotFinite, evaluate
from .items import Item, definition_items, items
from .printing import shortened
from .sources import Address, Sources

ROUND_OFF = 1e-9  # of the largest moment of inertia, or value
ORIENTATIONS = ((1.0, 0.0, 0.0, 0.0), (0.8, 0.6, 0.0, 0.0), (0.5, -0.5, 0.5, 0.5), (0.1, 0.1, -0.7, 0.7))


def check_values(d: Description, sources: Sources) -> None:
    """Check the numbers of a description, as far as parameters and constants determine them."""
    known: dict[str, float | None] = {p.name: p.value for p in (*d.parameters, *d.constants)}
    values: dict[Address, float | None] = {}
    for item in definition_items(d):
        known[item.key] = values[item.table, item.key] = _value(item, known, sources)
    for item in items(d):
        values[item.table, item.key] = _value(item, known, sources)
    _check_quaternion_constraints(d, known, sources)
    for body in d.bodies:
        _check_mass(body, values, sources)
        _check_inertia(body, values, sources)
    for joint in d.joints:
        _check_joint(joint, values, sources)
    for loop in d.loops:
        length = values.get((f"constraints.{loop.name}", "distance.length"))
        if length is not None and length <= 0:
            message = f"the length is not positive at the parameters' values: {length:g} m"
            hint = "hold points at one place by 'coincident'" if length == 0 else None
            raise sources.error(f"constraints.{loop.name}", "distance.length", message, hint=hint)
    check_contact_values(d, values, sources)
    _check_plane(d, values, sources)


def is_massless(body: Body) -> bool:
    """Whether a body is drawn only: mass and inertia are zero, whatever the parameters are set to."""
    parts = [x for x in (body.mass, *body.inertia) if x is not None]
    return all(x.is_Number and x == 0 for x in parts)


def _value(item: Item, known: Mapping[str, float | None], sources: Sources) -> float | None:
    try:
        return evaluate(item.expression, known)
    except NotFinite as error:
        raise sources.error(
            item.table,
            item.key,
            f"'{shortened(error.node)}' has no finite value at the parameters' values",
            hint="look for a division by zero, or the root or logarithm of a negative number",
        ) from None


def _check_mass(body: Body, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"bodies.{body.name}"
    mass = values.get((table, "mass"))
    if mass is not None and mass < 0:
        raise sources.error(table, "mass", f"the mass is negative at the parameters' values: {mass:g} kg")


def _check_inertia(body: Body, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"bodies.{body.name}"
    if len(body.inertia) == 1:
        moment = values[table, "inertia"]
        if moment is not None and moment < 0:
            raise sources.error(
                table, "inertia", f"the inertia is negative at the parameters' values: {moment:g} kg m^2"
            )
    elif body.inertia:
        entries = [values[table, f"inertia[{k}]"] for k in range(len(body.inertia))]
        xx, yy, zz, xy, xz, yz = [*entries, 0.0, 0.0, 0.0][:6]
        for k, moment in enumerate((xx, yy, zz)):
            if moment < 0:
                message = f"the inertia is negative at the parameters' values: {moment:g} kg m^2"
                raise sources.error(table, f"inertia[{k}]", message)
        minors = (xx * yy - xy * xy, xx * zz - xz * xz, yy * zz - yz * yz)
        determinant = xx * minors[2] - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
        largest = max(xx, yy, zz)
        if min(minors) < -ROUND_OFF * largest**2 or determinant < -ROUND_OFF * largest**3:
            message = "the inertia tensor has a negative principal moment at the parameters' values"
            raise sources.error(table, "inertia", message, hint="its elements are signed as in URDF")


def _check_joint(joint: Joint, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"joints.{joint.name}"
    for k, _ in enumerate(joint.armature):
        key = "armature" if len(joint.armature) == 1 else f"armature[{k}]"
        if values[table, key] < 0:
            message = f"the armature is negative at the parameters' values: {values[table, key]:g}"
            raise sources.error(table, key, message)
    if joint.limits:
        lower, upper = (values[table, f"limits[{k}]"] for k in (0, 1))
        if lower >= upper:
            message = (
                f"the lower limit {lower:g} is not below the upper one {upper:g} at the parameters' values"
            )
            raise sources.error(table, "limits", message)


def _check_quaternion_constraints(
    d: Description, known: Mapping[str, float | None], sources: Sources
) -> None:
    """A constraint on the length of a quaternion restricts nothing that rates can change."""
    elements: dict[str, list[str]] = {}
    for c in d.coordinates:
        if c.quaternion is not None:
            elements.setdefault(c.quaternion, []).append(c.name)
    for c in d.constraints:
        named = {symbol.name for symbol in c.expression.free_symbols}
        for joint, names in elements.items():
            if not named.intersection(names):
                continue
            try:
                values = [
                    evaluate(c.expression, {**known, **dict(zip(names, q, strict=True))})
                    for q in ORIENTATIONS
                ]
            except NotFinite:
                continue
            if None not in values and max(values) - min(values) <= ROUND_OFF * max(map(abs, (1.0, *values))):
                message = f"the constraint holds nothing: it has one value in all orientations of '{joint}'"
                hint = "quaternions are kept at unit length without constraints: leave it out"
                raise sources.error("constraints", c.name, message, hint=hint)


def _check_plane(d: Description, values: Mapping[Address, float | None], sources: Sources) -> None:
    """Gravity along z would do nothing to bodies in the x-y plane: more likely it was meant as y."""
    if d.gravity is None or values["gravity", "z"] == 0:
        return
    for body in d.bodies:
        if body.planar and not is_massless(body):
            raise sources.error(
                "gravity",
                "z",
                f"gravity along z does not move the planar body '{body.name}'",
                hint="planar bodies move in the x-y plane: use y, or give 'com' a third component",
            )
