"""The model's defaults for a run: which keys there are, and what their values may be."""

from __future__ import annotations

from typing import Any

from ..errors import ModelError, nearest
from .sources import Sources, read_number
from .units import TIME

POSITIVE = ("t_end", "rtol", "atol", "step", "max_step", "fps")
TIMES = ("t_end", "step", "max_step")
LISTS = ("at", "breaks")
FORMULATIONS = ("auto", "projection", "baumgarte", "ggl", "index3", "partition", "none")
KEYS = ("t_end", "method", "constraints", "rtol", "atol", "step", "max_step", "fps", *LISTS)


def checked(sources: Sources, key: str, value: Any) -> Any:
    """The value of a key of `[run]`, in plain numbers and SI units."""
    if key not in KEYS:
        raise sources.error("run", key, f"unknown key '{key:.60}'", hint=nearest(key[:60], KEYS, "keys"))
    if key in POSITIVE:
        return _positive(sources, key, value)
    if key in LISTS:
        if isinstance(value, str) or not hasattr(value, "__iter__"):
            raise sources.error("run", key, f"'{key}' is a list of times [s]", hint="for example [0.5, 1.0]")
        return tuple(_number(sources, key, x) for x in value)
    if not isinstance(value, str):
        raise sources.error("run", key, f"'{key}' is text, not {value!r:.60}", hint="write it in quotes")
    if key == "constraints" and value not in FORMULATIONS:
        raise sources.error(
            "run",
            key,
            f"{value!r:.60} is not a formulation",
            hint=nearest(value[:60], FORMULATIONS, "formulations"),
        )
    return value


def _positive(sources: Sources, key: str, value: Any) -> float:
    number = _number(sources, key, value)
    if number < 0 or (number == 0 and key != "atol"):
        raise sources.error(
            "run", key, f"'{key}' must be positive, not {number:g}", hint="give a number above zero"
        )
    return number


def _number(sources: Sources, key: str, value: Any) -> float:
    try:
        number, unit = read_number(value)
    except ModelError as error:
        raise sources.locate(error, "run", key) from None
    if unit is not None and (key not in (*TIMES, *LISTS) or unit.dimension != TIME):
        raise sources.error(
            "run",
            key,
            f"'{value:.60}' has a unit that does not fit '{key}'",
            hint="give it in its own unit, or as a bare number",
        )
    return number
