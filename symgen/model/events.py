"""Events from the arguments that describe them: direction, action, and what a reset sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from ..errors import ModelError, nearest
from .description import Event, Reset
from .functions import dot
from .sources import Sources

DIRECTIONS = ("rising", "falling", "both")
ACTIONS = ("terminate", "record", "reset")


def make_event(sources: Sources, name: str, when: Any, direction: Any, then: Any) -> Event:
    """An event from the arguments of `Model.event`."""
    table = f"events.{name}"
    if direction not in DIRECTIONS:
        raise _choice_error(sources, table, "direction", direction, DIRECTIONS)
    expression = sources.expression(when, table, "when")
    action, resets = _action(sources, table, then)
    return Event(name, expression, direction, action, resets)


def _action(sources: Sources, table: str, then: Any) -> tuple[str, tuple[Reset, ...]]:
    if isinstance(then, Mapping):
        if list(then) != ["reset"]:
            raise sources.error(
                table,
                "then",
                'a table here reads { reset = { "dot(x)" = "…" } }',
                hint='or write "record" or "terminate"',
            )
        if not isinstance(then["reset"], Mapping) or not then["reset"]:
            message = "a reset names coordinates or rates with their new values"
            raise sources.error(table, "then.reset", message, hint='for example { "dot(x)" = "-e*dot(x)" }')
        return "reset", tuple(_reset(sources, table, key, value) for key, value in then["reset"].items())
    if then not in ("terminate", "record"):
        raise _choice_error(sources, table, "then", then, ACTIONS)
    return then, ()


def _reset(sources: Sources, table: str, key: Any, value: Any) -> Reset:
    is_rate = isinstance(key, dot)
    name = key.args[0] if is_rate else key
    name = name.name if isinstance(name, sympy.Symbol) else str(name).strip()
    if name.startswith("dot(") and name.endswith(")"):
        is_rate, name = True, name[4:-1].strip()
    shown = f"dot({name})" if is_rate else name
    address = f"then.reset.{shown[:60]}"
    if sources.of(table, address):
        raise sources.error(table, address, f"'{shown:.60}' is reset twice", hint="leave one of the two out")
    return Reset(name, is_rate, sources.expression(value, table, address))


def _choice_error(sources: Sources, table: str, key: str, value: Any, choices: Sequence[str]) -> ModelError:
    message = f"{value!r:.60} is not one of {', '.join(choices)}"
    return sources.error(table, key, message, hint=nearest(str(value)[:60], choices, "choices"))
