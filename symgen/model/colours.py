"""The colour of a body, which stands beside its shape: `color = "#b03020"`, or one of the names below."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import nearest
from .sources import Sources

NAMED = {
    "black": "#202020", "white": "#f4f4f4", "grey": "#808890", "silver": "#c0c4c8", "red": "#d04040",
    "green": "#40a050", "blue": "#4070c0", "yellow": "#e0c040", "orange": "#f08030", "purple": "#9060b0",
    "brown": "#8a6a50", "pink": "#f090a0", "cyan": "#40b0c0", "steel": "#78889a", "brass": "#b8a050",
}  # fmt: skip
KEY = "color"


def without_colour(shape: Any, sources: Sources, table: str) -> tuple[Any, str]:
    """Return what the key `shape` says besides the colour, and the colour as `#rrggbb`, empty where there is none.

    Parameters
    ----------
    shape : Any
        A mapping or a sequence of mappings; what is neither stays as it is.
    sources : Sources
    table : str
        Of the body.

    Raises
    ------
    ModelError
        For what is no colour, and for two colours of one body.
    """
    several = isinstance(shape, Sequence) and not isinstance(shape, str)
    parts = list(shape) if several else [shape]
    found: list[str] = []
    for k, part in enumerate(parts):
        if isinstance(part, Mapping) and KEY in part:
            place = f"shape[{k}].{KEY}" if several else f"shape.{KEY}"
            found.append(_colour(part[KEY], sources, table, place))
            parts[k] = {key: value for key, value in part.items() if key != KEY}
            if found[-1] != found[0]:
                message = f"the body is {found[0]} already, and here {found[-1]}"
                raise sources.error(table, place, message, hint="a body has one colour: make two bodies")
    return (parts if several else parts[0]), (found[0] if found else "")


def _colour(value: Any, sources: Sources, table: str, place: str) -> str:
    if isinstance(value, str) and re.fullmatch(r"#[0-9a-fA-F]{6}", value, re.ASCII):
        return value.lower()
    if isinstance(value, str) and value in NAMED:
        return NAMED[value]
    hint = nearest(value[:30], [*NAMED], "colours") if isinstance(value, str) else None
    raise sources.error(
        table,
        place,
        f"{value!r:.60} is no colour: it is '#rrggbb' or a name",
        hint=hint or f"one of {', '.join(NAMED)}",
    )
