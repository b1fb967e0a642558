"""Checks of numbers at the parameters' values: finite, masses not negative, planes kept, constraints that hold.

The checks of stops, friction and contacts: names, speeds linear in the rates, values that make sense.

Degrees of expressions in the rates, found on the expression tree without expanding it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import ModelError
from . import algebra
from .algebra import postorder
from .description import Body, Bristle, Description, Joint, Solid
from .evaluate import NotFinite, Value, evaluate
from .expression_tree import kind
from .items import Item, definition_items, items
from .printing import shortened
from .sources import Address, Sources

NONLINEAR = 2


def check_velocity_constraints(d: Description, sources: Sources) -> None:
    """Every velocity constraint must contain rates."""
    if not d.velocity_constraints:
        return
    degrees = own_degrees(d)
    for name, expression in d.definitions:
        degrees[name] = rate_degree(expression, degrees)
    for c in d.velocity_constraints:
        degree = rate_degree(c.expression, degrees)
        if degree == 0:
            raise sources.error(
                "velocity_constraints",
                c.name,
                "a velocity constraint without a rate",
                hint="put it into [constraints]",
            )


def own_degrees(d: Description) -> dict[str, int]:
    """Degrees in the rates of those that have names of their own; states are no rates of anything."""
    return {r.name: 1 for r in d.rates if r.coordinate != r.name and not r.state}


def rate_degree(root: algebra.Expr, definitions: Mapping[str, int]) -> int:
    """Degree of an expression in the rates: 0 without any, 1 linear, 2 anything else.

    Parameters
    ----------
    root : algebra.Expr
    definitions : mapping of str to int
        Degrees of the names that it may use, where they are not 0: definitions, and rates with names of their own.
    """
    memo: dict[int, int] = {}
    for node in postorder([root]):
        what = kind(node)
        degrees = [memo[id(x)] for x in node.args]
        if what == "symbol":
            degree = definitions.get(node.name, 0)
        elif what == "dot":
            degree = 1
        elif what in ("sum", "real"):
            degree = max(degrees, default=0)
        elif what == "product":
            degree = sum(degrees)
        elif what == "power" and node.exp == 1:
            degree = degrees[0]
        else:
            degree = NONLINEAR if any(degrees) else 0
        memo[id(node)] = min(degree, NONLINEAR)
    return memo[id(root)]


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
    degrees = own_degrees(d)
    for name, expression in d.definitions:
        degrees[name] = rate_degree(expression, degrees)
    keys = [("speed",) if f.across is None else ("speeds[0]", "speeds[1]") for f in d.frictions]
    speeds = [
        (f"friction.{f.name}", key, speed)
        for f, own in zip(d.frictions, keys, strict=True)
        for key, speed in zip(own, f.speeds, strict=True)
    ]
    _check_rows(d, sources)
    speeds += [(f"bristles.{b.name}", "speed", b.speed) for b in d.bristles]
    speeds += [(f"contacts.{c.name}", "slip", c.slip) for c in d.contacts if c.slip is not None]
    for table, key, speed in speeds:
        degree = rate_degree(speed, degrees)
        if degree == 0 or degree >= NONLINEAR:
            fault = "contains no rate" if degree == 0 else "is not linear in the rates"
            raise sources.error(
                table, key, f"the sliding speed {fault}", hint='for example "dot(x) - belt_speed"'
            )


def _check_rows(d: Description, sources: Sources) -> None:
    """Whether the names of both forces of frictions with two directions are free."""
    taken = {x.name for x in (*d.events, *d.stops, *d.constraints, *d.velocity_constraints, *d.loops)}
    taken |= {row for f in d.frictions if f.across is None for row in f.rows}
    for f in d.frictions:
        for row in f.rows if f.across is not None else ():
            if row in taken:
                message = f"its forces are '{f.rows[0]}' and '{f.rows[1]}', and the name '{row}' is taken"
                raise sources.error(f"friction.{f.name}", "", message, hint="choose another name")
            taken.add(row)


def _check_bristle(b: Bristle, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"bristles.{b.name}"
    known = {
        key: values.get((table, key)) for key in ("stiffness", "damping", "viscous", "coulomb", "static")
    }
    for key, value in known.items():
        least = "positive" if key in ("stiffness", "coulomb") else "zero or more"
        if value is not None and (value < 0.0 or (value == 0.0 and least == "positive")):
            hint = None
            if key == "coulomb" and value == 0.0:
                hint = f"bristles bear nothing then: write what is left as a force, such as -c*{shortened(b.speed)}"
            message = f"it is {value:g} at the parameters' values: it is to be {least}"
            raise sources.error(table, key, message, hint=hint)
    if None not in (known["static"], known["coulomb"]) and known["static"] < known["coulomb"]:
        message = f"it is {known['static']:g}, less than what slides, {known['coulomb']:g}"
        raise sources.error(
            table, "static", message, hint="leave it out for friction without Stribeck's fall"
        )


def _check_static(
    table: str, keys: tuple[str, ...], values: Mapping[Address, float | None], sources: Sources
) -> None:
    """Whether what sticks bears no less than what slides has, where both are known."""
    static = values.get((table, "static"))
    sliding = next((x for key in keys if (x := values.get((table, key))) is not None), None)
    if static is not None and sliding is not None and static < sliding:
        message = (
            f"it is {static:g} at the parameters' values, less than while it slides, {sliding:g}: "
            "what has come to rest would slip at once"
        )
        hint = f"give {sliding:g} or more, or leave it out: it is {sliding:g} then"
        raise sources.error(table, "static", message, hint=hint)


def check_contact_values(d: Description, values: Mapping[Address, float | None], sources: Sources) -> None:
    """Check what parameters and constants determine."""
    restituting = [(f"stops.{s.name}", "restitution") for s in d.stops]
    restituting += [(f"joints.{j.name}", "restitution") for j in d.joints if j.restitution is not None]
    restituting += [(f"contacts.{c.name}", "restitution") for c in d.pairs]
    for table, key in restituting:
        value = values.get((table, key))
        if value is not None and not 0.0 <= value <= 1.0:
            message = f"the restitution is {value:g} at the parameters' values, not from 0 to 1"
            raise sources.error(table, key, message)
    for c in (*d.contacts, *d.pairs):
        table = f"contacts.{c.name}"
        exponent = values.get((table, "exponent"))
        if exponent is not None and exponent < 1.0:
            raise sources.error(
                table,
                "exponent",
                f"the exponent is {exponent:g}: it is at least 1",
                hint="choose 1 or more; 1.5 is Hertz's",
            )
        for key in ("stiffness", "damping", "friction", "static"):
            value = values.get((table, key))
            if value is not None and value < 0.0:
                raise sources.error(
                    table,
                    key,
                    f"the {key} is negative at the parameters' values: {value:g}",
                    hint="look at the parameters in it",
                )
        _check_static(table, ("friction",), values, sources)
    for f in d.frictions:
        for key in ("coefficient", "static") if f.normal else ("force", "torque", "static"):
            value = values.get((f"friction.{f.name}", key))
            if value is not None and value < 0.0:
                what = "coefficient" if f.normal else "friction"
                message = f"the {what} is negative at the parameters' values: {value:g}"
                raise sources.error(f"friction.{f.name}", key, message)
        _check_static(
            f"friction.{f.name}", ("coefficient",) if f.normal else ("force", "torque"), values, sources
        )
    smooth = [(f"friction.{f.name}", "creep" if f.creeps else "smooth") for f in d.frictions]
    for table, key in (*smooth, *((f"contacts.{c.name}", "smooth") for c in (*d.contacts, *d.pairs))):
        value = values.get((table, key))
        if value is not None and value <= 0.0:
            message = f"the speed is not positive at the parameters' values: {value:g}"
            raise sources.error(table, key, message, hint=f"leave '{key}' out for friction that sticks")


ROUND_OFF = 1e-9  # of the largest moment of inertia, or value
ORIENTATIONS = ((1.0, 0.0, 0.0, 0.0), (0.8, 0.6, 0.0, 0.0), (0.5, -0.5, 0.5, 0.5), (0.1, 0.1, -0.7, 0.7))


def check_values(d: Description, sources: Sources) -> None:
    """Check the numbers of a description, as far as parameters and constants determine them."""
    known: dict[str, float | None] = {p.name: p.value for p in (*d.parameters, *d.constants)}
    values: dict[Address, float | None] = {}
    without_value: ModelError | None = None
    own, others = [*definition_items(d)], [*items(d)]  # kept, as values are known by identity
    parts: dict[int, Value] = {}
    for item in own:
        try:
            known[item.key] = values[item.table, item.key] = _value(item, known, sources, parts)
        except ModelError as error:
            without_value = without_value or error
            known[item.key] = None
    parts = {}
    for item in others:
        values[item.table, item.key] = _value(item, known, sources, parts)
    for b in d.bristles:  # their laws, which are definitions, divide by what is checked here
        _check_bristle(b, values, sources)
    if without_value is not None:
        raise without_value
    _check_quaternion_constraints(d, known, sources)
    for body in d.bodies:
        _check_solids(body, values, sources)
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
    for s in d.springs:
        given = (("length", s.places), ("stiffness", True), ("damping", True), ("mass", True))
        for key in (key for key, counts in given if counts):
            _check_not_negative(f"springs.{s.name}", key, key, values, sources)
    for b in d.bushings:
        for key, given in (("stiffness", b.stiffness), ("damping", b.damping)):
            for k in range(len(given)):
                _check_not_negative(f"bushings.{b.name}", f"{key}[{k}]", key, values, sources)
    for r in d.rotors:
        _check_not_negative(f"rotors.{r.name}", "inertia", "inertia", values, sources, " kg m^2")
    for c in d.pairs:
        for solid in (*c.shapes, *c.other_shapes):  # a sphere of no size is a point
            for k in range(len(solid.sizes)):
                key = f"{solid.place}.{solid.kind}[{k}]"
                _check_not_negative(f"contacts.{c.name}", key, "size", values, sources, " m")
    for r in d.rolling:
        radius = values.get((f"rolling.{r.name}", r.kind))
        if radius is not None and radius <= 0:
            message = f"the radius is not positive at the parameters' values: {radius:g} m"
            raise sources.error(f"rolling.{r.name}", r.kind, message, hint="look at the parameters in it")
    check_contact_values(d, values, sources)
    _check_plane(d, values, sources)


def is_massless(body: Body) -> bool:
    """Whether a body is drawn only: mass and inertia are zero, whatever the parameters are set to."""
    parts = [x for x in (body.mass, *body.inertia) if x is not None]
    return all(x.is_Number and x.is_zero for x in parts)  # 0.0 is equal to no integer


def _value(
    item: Item, known: Mapping[str, float | None], sources: Sources, parts: dict[int, Value]
) -> float | None:
    try:
        return evaluate(item.expression, known, parts)
    except NotFinite as error:
        raise sources.error(
            item.table,
            item.key,
            f"'{shortened(error.node)}' has no finite value at the parameters' values",
            hint="look for a division by zero, or the root or logarithm of a negative number",
        ) from None


def _check_solids(body: Body, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"bodies.{body.name}"
    _check_sizes(table, body.solids, values, sources)
    for k in range(len(body.shape.sizes) if body.shape is not None else 0):  # drawn alone
        _check_not_negative(table, f"shape.{body.shape.kind}[{k}]", "size", values, sources, " m")
    found = [values.get((table, key)) for key in ("mass", "inertia", *(f"inertia[{k}]" for k in range(3)))]
    if any(solid.cut for solid in body.solids) and any(x is not None and x <= 0 for x in found):
        message = "the holes of the body are larger than its shapes at the parameters' values"
        raise sources.error(table, "shape", message, hint="look at the sizes of those with 'cut'")


def _check_not_negative(
    table: str, key: str, what: str, values: Mapping[Address, float | None], sources: Sources, unit: str = ""
) -> None:
    value = values.get((table, key))
    if value is not None and value < 0:
        message = f"the {what} is negative at the parameters' values: {value:g}{unit}"
        raise sources.error(table, key, message, hint="look at the parameters in it")


def _check_sizes(
    table: str, solids: Sequence[Solid], values: Mapping[Address, float | None], sources: Sources
) -> None:
    for solid in solids:
        key = f"{solid.place}.{solid.kind}"
        sizes = [values[table, f"{key}[{k}]"] for k in range(len(solid.sizes))]
        hollow = solid.kind == "tube" and len(sizes) > 1
        for k, size in enumerate(sizes):
            if size < 0 or (size == 0 and not (hollow and k == 1)):
                message = f"the size is not positive at the parameters' values: {size:g} m"
                raise sources.error(table, f"{key}[{k}]", message, hint="look at the parameters in it")
        if hollow and sizes[1] >= sizes[0]:
            message = f"the inner radius {sizes[1]:g} m is not below the outer one, {sizes[0]:g} m"
            raise sources.error(table, f"{key}[1]", message, hint="the outer radius comes first")


def _check_mass(body: Body, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"bodies.{body.name}"
    mass = values.get((table, "mass"))
    if mass is not None and mass < 0:
        raise sources.error(
            table,
            "mass",
            f"the mass is negative at the parameters' values: {mass:g} kg",
            hint="look at the parameters in it",
        )


def _check_inertia(body: Body, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"bodies.{body.name}"
    if len(body.inertia) == 1:
        moment = values[table, "inertia"]
        if moment is not None and moment < 0:
            raise sources.error(
                table,
                "inertia",
                f"the inertia is negative at the parameters' values: {moment:g} kg m^2",
                hint="look at the parameters in it",
            )
    elif body.inertia:
        entries = [values[table, f"inertia[{k}]"] for k in range(len(body.inertia))]
        xx, yy, zz, xy, xz, yz = [*entries, 0.0, 0.0, 0.0][:6]
        for k, moment in enumerate((xx, yy, zz)):
            if moment < 0:
                message = f"the inertia is negative at the parameters' values: {moment:g} kg m^2"
                raise sources.error(table, f"inertia[{k}]", message)
        # In parts of the largest, whose cube may be out of range.
        largest = max(xx, yy, zz, abs(xy), abs(xz), abs(yz)) or 1.0
        xx, yy, zz, xy, xz, yz = (entry / largest for entry in (xx, yy, zz, xy, xz, yz))
        minors = (xx * yy - xy * xy, xx * zz - xz * xz, yy * zz - yz * yz)
        determinant = xx * minors[2] - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
        if min(minors) < -ROUND_OFF or determinant < -ROUND_OFF:
            message = "the inertia tensor has a negative principal moment at the parameters' values"
            raise sources.error(table, "inertia", message, hint="its elements are signed as in URDF")


def _check_joint(joint: Joint, values: Mapping[Address, float | None], sources: Sources) -> None:
    table = f"joints.{joint.name}"
    for k, _ in enumerate(joint.armature):
        key = "armature" if len(joint.armature) == 1 else f"armature[{k}]"
        if values[table, key] < 0:
            message = f"the armature is negative at the parameters' values: {values[table, key]:g}"
            raise sources.error(table, key, message)
    for key, given in (("stiffness", joint.stiffness), ("damping", joint.damping)):
        for k in range(len(given)):
            _check_not_negative(table, key if len(given) == 1 else f"{key}[{k}]", key, values, sources)
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
