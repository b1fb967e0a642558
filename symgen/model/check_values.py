"""Checks of numbers at the parameters' values: finite, masses not negative, planes kept, constraints that hold.

The checks of stops, friction and contacts: names, speeds linear in the rates, values that make sense.

Degrees of expressions in the rates, found on the expression tree without expanding it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from symgen.runtime.graph.bounds import ZERO, is_broken

from ..errors import ModelError
from . import algebra
from .algebra import postorder
from .description import Description, Limit
from .evaluate import NotFinite, Value, evaluate
from .expression_tree import kind
from .items import Item, definition_items, items
from .printing import shortened
from .requirements import Requirement, limits, of_bristles, requirements
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


ROUND_OFF = 1e-9  # of the largest moment of inertia, or value
ORIENTATIONS = ((1.0, 0.0, 0.0, 0.0), (0.8, 0.6, 0.0, 0.0), (0.5, -0.5, 0.5, 0.5), (0.1, 0.1, -0.7, 0.7))


def check_values(d: Description, sources: Sources) -> Callable[[], tuple[Limit, ...]]:
    """Check the numbers of a description, as far as parameters and constants determine them.

    Returns
    -------
    callable
        Gives what has to be checked of them at other parameters.
    """
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
    of_definitions = [*of_bristles(d)]
    for r in of_definitions:  # their laws, which are definitions, divide by what is checked here
        _check(r, values, sources)
    if without_value is not None:
        raise without_value
    _check_quaternion_constraints(d, known, sources)
    required = [*requirements(d)]
    for r in required:
        _check(r, values, sources)
    return lambda: limits(d, others, (*of_definitions, *required))


def _check(r: Requirement, values: Mapping[Address, float | None], sources: Sources) -> None:
    """Refuse numbers that are not what they have to be.

    What parameters do not determine is not looked at; but what is to be zero is not zero then.
    """
    numbers = [values.get((r.table, key)) for key in r.numbers]
    if r.bound == ZERO if None in numbers else is_broken(r.bound, *numbers):
        hint = r.hint and r.hint.format(*numbers)
        raise sources.error(r.table, r.key, r.says.format(*numbers), hint=hint)


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
