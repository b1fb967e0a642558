"""Joints from the arguments that describe them, and the coordinates and rates that they make."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import nearest
from . import algebra
from .declared import Declared
from .description import Coordinate, Joint, Rate
from .evaluate import Direction, NotFinite, dot_product, evaluate, normalised, perpendicular
from .given import given_name, is_symbol, unpacked
from .joint_types import ANGULAR_VELOCITY, TYPES, JointType, sequence_fault
from .names import name_fault, reference_fault
from .orientation import roll_pitch_yaw
from .units import Unit, parse_unit

IDENTITY = (1.0, 0.0, 0.0, 0.0)
NORM_TOLERANCE = 1e-3  # of a quaternion that is meant to be of unit length
PARALLEL = 1e-6  # sine of the angle between a universal joint's axes
STATE_KEYS = ("start", "rate", "guess", "rate_guess")
ELASTIC_KEYS = ("stiffness", "rest", "armature")
OPTION_HINTS = {
    "pitch": 'what it slides along its axis by a whole turn, for example pitch = "2 mm"',
    "sequence": 'the axes that it turns about, one after another, for example sequence = "zxz"',
}


def make_joint(
    model: Declared, name: str, type: Any, parent: Any, child: Any, options: Mapping[str, Any]
) -> Joint:
    """A joint from the arguments of `Model.joint`; declares its coordinates and rates."""
    table, sources = f"joints.{name}", model._sources
    if not isinstance(type, str) or type not in TYPES:
        message = (
            "the type of the joint is missing" if type is None else f"{type!r:.60} is not a type of joint"
        )
        raise sources.error(table, "type", message, hint=nearest(str(type)[:60], TYPES, "types"))
    given = {key: value for key, value in options.items() if value is not None}
    for key, body in (("parent", parent), ("child", child)):
        if reference_fault(body) is not None:
            raise sources.error(
                table,
                key,
                f"the {key} of a joint is the name of a body, not {body!r:.60}",
                hint="write it in quotes",
            )
    _check_keys(model, table, type, given)
    kind = TYPES[type]
    if isinstance(given.get("origin"), str):
        parent, xyz, rpy = _at_frame(model, table, parent, given["origin"])
    else:
        xyz, rpy = _origin(model, table, given.get("origin", {}))
    axis, axis2 = _axes(model, table, kind, given)
    coordinates = _coordinates(model, table, name, kind, given)
    rates = tuple(r.name for r in model._made_rates.get(name, ())) if kind.quaternion else coordinates
    elements = {
        key: _each(model, table, key, given[key], kind.nv) if key in given else ()
        for key in ("stiffness", "damping", "armature", "rest")
    }
    limits = () if "limits" not in given else model._vector(given["limits"], table, "limits", (2,))
    limits = tuple(sources.expression(x, table, f"limits[{k}]") for k, x in enumerate(limits))
    restitution = given.get("restitution")
    if restitution is not None:
        restitution = sources.expression(restitution, table, "restitution")
        if not limits:
            raise sources.error(
                table,
                "restitution",
                "'restitution' has no effect without 'limits'",
                hint="add them, or leave this out",
            )
    pitch = given.get("pitch")
    return Joint(
        name, type, parent, child, xyz, rpy, axis, axis2, coordinates, rates, **elements, limits=limits,
        restitution=restitution, pitch=None if pitch is None else sources.expression(pitch, table, "pitch"),
        sequence=given_sequence(model, table, given["sequence"]) if "sequence" in given else "",
    )  # fmt: skip


def given_sequence(model: Declared, table: str, given: Any) -> str:
    """The axes of three successive rotations, of which neighbours differ."""
    if sequence_fault(given):
        message = f"a sequence is three letters x, y, z, of which neighbours differ, not {given!r:.60}"
        raise model._sources.error(table, "sequence", message, hint='for example sequence = "zxz", or "zyx"')
    return str(given)


def _check_keys(model: Declared, table: str, type: str, given: Mapping[str, Any]) -> None:
    """Whether all that is given means something for this type of joint."""
    kind, hints = TYPES[type], {}
    refused = []
    if kind.axes == 0:
        refused.append("axis")
    if kind.axes < 2:
        refused.append("axis2")
    if not kind.elastic:
        refused += ELASTIC_KEYS
    if kind.nq == 0:
        refused += ["coordinate", *STATE_KEYS, "damping"]
    if kind.nq != 1:
        refused.append("unit")
    if not kind.limited:
        refused.append("limits")
        hints |= {"limits": "a revolute joint has limits"} if kind.hinge else {}
    refused += [key for other in TYPES.values() for key in other.options if key not in kind.options]
    for key in refused:
        if key in given:
            article = "an" if type[0] in "aeiou" else "a"
            raise model._sources.error(
                table, key, f"{article} {type} joint has no '{key}'", hint=hints.get(key)
            )
    for key in kind.options:
        if key not in given:
            raise model._sources.error(table, key, f"a {type} joint needs a '{key}'", hint=OPTION_HINTS[key])
    if "rest" in given and "stiffness" not in given:
        raise model._sources.error(
            table, "rest", "'rest' has no effect without 'stiffness'", hint="add it, or leave this out"
        )


def _origin(
    model: Declared, table: str, origin: Any
) -> tuple[tuple[algebra.Expr, ...], tuple[algebra.Expr, ...]]:
    sources = model._sources
    if not isinstance(origin, Mapping):
        message = f"an origin is a table of 'xyz' and 'rpy', not {origin!r:.60}"
        raise sources.error(table, "origin", message, hint="origin = { xyz = [0, 0, 1], rpy = [0, 0, 0] }")
    for key in origin:
        if key not in ("xyz", "rpy"):
            hint = nearest(str(key)[:60], ("xyz", "rpy"), "keys")
            raise sources.error(table, f"origin.{key!s:.60}", f"unknown key '{key!s:.60}'", hint=hint)
    xyz = model._components(origin.get("xyz", (0, 0, 0)), table, "origin.xyz")
    return xyz, roll_pitch_yaw(model, table, "origin.rpy", origin.get("rpy", (0, 0, 0)))


def _at_frame(model: Declared, table: str, parent: str, name: str) -> tuple[str, tuple, tuple]:
    """The parent that has a frame, and the frame's place in it."""
    frame = model._frames.get(name)
    if frame is None:
        message = (
            f"there is no frame '{name:.60}'" if name.isidentifier() else f"{name!r:.60} is no frame's name"
        )
        hint = nearest(name[:60], model._frames, "frames") if model._frames else "declare it in [frames]"
        raise model._sources.error(table, "origin", message, hint=hint)
    if parent not in ("world", frame.body):
        message = f"the frame '{name}' is fixed in '{frame.body}', not in the parent '{parent}'"
        raise model._sources.error(table, "origin", message, hint="leave out 'parent', which follows from it")
    return frame.body, frame.at, frame.rpy


def _axes(
    model: Declared, table: str, kind: JointType, given: Mapping[str, Any]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The axes as they are given; where none is, the default of `axis` depends on the child."""
    axis = direction(model, table, "axis", given["axis"]) if "axis" in given else ()
    axis2: tuple[float, ...] = ()
    if "axis2" in given:
        axis2 = direction(model, table, "axis2", given["axis2"])
        along = dot_product(axis or (1.0, 0.0, 0.0), axis2)
        if 1 - along * along < PARALLEL**2:
            raise model._sources.error(
                table, "axis2", "the two axes of a universal joint are parallel", hint="give two that differ"
            )
    elif kind.axes == 2 and axis:
        axis2 = perpendicular(axis)
    return axis, axis2


def direction(model: Declared, table: str, key: str, values: Any) -> Direction:
    """A unit vector of numbers and constants."""
    sources = model._sources
    constants = {c.name: c.value for c in model._constants}
    numbers = []
    for k, x in enumerate(model._vector(values, table, key, (2, 3))):
        expression = sources.expression(x, table, f"{key}[{k}]")
        try:
            value = evaluate(expression, constants)
        except NotFinite:
            value = None
        if value is None:
            message = "the components of a direction are numbers, or made of the constants declared so far"
            raise sources.error(table, f"{key}[{k}]", message, hint="for example [0, 0, 1]")
        numbers.append(value)
    if len(numbers) == 2:
        sources.note_two_components(table, key)
    unit = normalised([*numbers, 0.0][:3])
    if unit is None:
        raise sources.error(table, key, "a direction cannot be of zero length", hint="for example [0, 0, 1]")
    return unit


def _each(model: Declared, table: str, key: str, value: Any, count: int) -> tuple[algebra.Expr, ...]:
    """One expression for all coordinates of a joint, or one for each."""
    value = unpacked(value)
    if isinstance(value, (str, algebra.Expr)) or not isinstance(value, Sequence):
        return (model._sources.expression(value, table, key),)
    if len(value) != count:
        message = f"one number, or {count} of them, are expected here; {len(value)} are given"
        raise model._sources.error(table, key, message)
    if count == 1:
        return (model._sources.expression(value[0], table, key),)
    return tuple(model._sources.expression(x, table, f"{key}[{k}]") for k, x in enumerate(value))


def _coordinates(
    model: Declared, table: str, joint: str, kind: JointType, given: Mapping[str, Any]
) -> tuple[str, ...]:
    names = _coordinate_names(model, table, joint, kind, given.get("coordinate"))
    declared = {}
    if not model._kinds.keys().isdisjoint(names):
        declared = {c.name: c for c in model._coordinates}
    for k, name in enumerate(names):
        if name in model._jointed:
            message = f"the coordinate '{name}' belongs to the joint '{model._jointed[name]}' already"
            hint = "to couple two joints, give each a coordinate and a 'gear' constraint"
            raise model._sources.error(table, "coordinate", message, hint=hint)
        if name in declared:
            _check_declared(model, table, declared[name], kind, k, given)
        model._jointed[name] = joint
    unit = model._sources.unit(given.get("unit"), table, "unit")
    if unit is not None and unit.dimension != parse_unit(kind.units[0]).dimension:
        message = f"the unit '{unit.text}' does not fit a coordinate in {kind.units[0]}"
        raise model._sources.error(table, "unit", message)
    state = _state_numbers(model, table, kind, given)
    made = [k for k, name in enumerate(names) if name not in declared]
    for k in made:
        model._declare_made(names[k], "coordinate", table, "joint")
    _make_plain(model, table, joint, kind, unit, names, state, [k for k in made if k < len(kind.suffixes)])
    if kind.quaternion:
        _make_quaternion(model, table, joint, kind, names[-4:], state)
    return names


def _coordinate_names(
    model: Declared, table: str, joint: str, kind: JointType, given: Any
) -> tuple[str, ...]:
    if given is None:
        return kind.coordinate_names(joint)
    given = unpacked(given)
    if isinstance(given, str) or is_symbol(given):
        given = (given,)
    if not isinstance(given, Sequence) or len(given) != kind.nq:
        count = len(given) if isinstance(given, Sequence) else 0
        message = f"the joint has {kind.nq} coordinate{'s' * (kind.nq != 1)}; {count} names are given"
        hint = f"by default they are {', '.join(kind.coordinate_names(joint))}"
        raise model._sources.error(table, "coordinate", message, hint=hint)
    names = tuple(map(given_name, given))
    for k, name in enumerate(names):
        of_a_use = isinstance(name, str) and "." in name and name in model._kinds
        fault = None if of_a_use else name_fault(name)
        if fault is not None:
            raise model._sources.error(
                table, "coordinate" + f"[{k}]" * (kind.nq > 1), fault, hint="choose another name"
            )
    return names


def _check_declared(
    model: Declared, table: str, c: Coordinate, kind: JointType, k: int, given: Mapping[str, Any]
) -> None:
    """Whether a coordinate that the user declared can be the k-th one of a joint."""
    if kind.quaternion:
        message = f"the coordinate '{c.name}' of a joint with a quaternion is made by the joint"
        raise model._sources.error(table, "coordinate", message, hint="leave it out of [coordinates]")
    for key in (*STATE_KEYS, "unit"):
        if key in given:
            message = f"'{key}' of the coordinate '{c.name}' is given where it is declared"
            raise model._sources.error(
                table, key, message, hint="give it in [coordinates] only, or leave it out there"
            )
    if c.unit is not None and parse_unit(c.unit).dimension != parse_unit(kind.units[k]).dimension:
        message = (
            f"the coordinate '{c.name}' of this joint is in {kind.units[k]}, but it is declared in {c.unit}"
        )
        raise model._sources.error(table, "coordinate", message)


def _state_numbers(
    model: Declared, table: str, kind: JointType, given: Mapping[str, Any]
) -> dict[str, list[Any]]:
    """Initial values as they are given, one list for each key."""
    state = {}
    for key in STATE_KEYS:
        if key not in given:
            continue
        count, values = kind.nv if key.startswith("rate") else kind.nq, unpacked(given[key])
        if count == 1 and (isinstance(values, (str, algebra.Expr)) or not isinstance(values, Sequence)):
            values = [values]
        state[key] = model._vector(values, table, key, (count,))
    return state


def _make_plain(
    model: Declared,
    table: str,
    joint: str,
    kind: JointType,
    unit: Unit | None,
    names: Sequence[str],
    state: Mapping[str, list[Any]],
    made: Sequence[int],
) -> None:
    """Coordinates with a rate of their own, and the rates of a free joint's position."""
    single = kind.nq == 1
    for k in made:
        size = unit or parse_unit(kind.units[k])
        place = "{}" if single else f"{{}}[{k}]"
        values, _ = model._initial(table, place, size, {key: numbers[k] for key, numbers in state.items()})
        model._made.append(Coordinate(names[k], kind.units[k], **values, joint=joint))
    if kind.velocities:
        for c, suffix in zip(model._made[-len(made) :], kind.velocities, strict=True):
            made_rate = Rate(joint + suffix, "m/s", c.rate, c.rate_guess, c.name, c.rate_formula)
            _make_rate(model, table, joint, made_rate)


def _make_quaternion(
    model: Declared,
    table: str,
    joint: str,
    kind: JointType,
    names: Sequence[str],
    state: Mapping[str, list[Any]],
) -> None:
    first = len(kind.suffixes)
    if "start" in state and "guess" in state:
        raise model._sources.error(
            table, "guess", "'start' and 'guess' are both given", hint="leave one of the two out"
        )
    key = "guess" if "guess" in state else "start"
    values = IDENTITY if key not in state else _unit_quaternion(model, table, key, state[key][first:], first)
    for name, value in zip(names, values, strict=True):
        enforced = {"start": value} if "start" in state else {"guess": value}
        model._made.append(Coordinate(name, None, **enforced, quaternion=joint, joint=joint))
    speed = parse_unit("rad")
    for k, suffix in enumerate(ANGULAR_VELOCITY, first):
        numbers = {key: state[key][k] for key in ("rate", "rate_guess") if key in state}
        initial, _ = model._initial(table, f"{{}}[{k}]", speed, numbers)
        rate = Rate(
            joint + suffix,
            "rad/s",
            initial.get("rate"),
            initial.get("rate_guess", 0.0),
            formula=initial.get("rate_formula"),
        )
        _make_rate(model, table, joint, rate)


def _unit_quaternion(
    model: Declared, table: str, key: str, given: Sequence[Any], first: int
) -> tuple[float, ...]:
    values = [model._sources.number(x, None, table, f"{key}[{first + k}]")[0] for k, x in enumerate(given)]
    length = math.hypot(*values)
    if abs(length - 1) > NORM_TOLERANCE:
        message = f"the quaternion (w, x, y, z) is of length {length:g}, not 1"
        raise model._sources.error(table, key, message, hint="[1, 0, 0, 0] is no rotation")
    return normalised(values)


def _make_rate(model: Declared, table: str, joint: str, rate: Rate) -> None:
    model._declare_made(rate.name, "rate", table, "joint")
    model._made_rates.setdefault(joint, []).append(rate)
