"""Drawings from the arguments that describe them: springs, bars, supports and forces that a recording shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy

from ..errors import nearest
from .declared import Declared
from .description import Drawing
from .items import DRAWINGS, drawing_key
from .names import name_fault


def make_drawing(model: Declared, name: str, what: dict[str, Any]) -> Drawing:
    """A drawing from the arguments of `Model.draw`."""
    table, sources = f"draw.{name}", model._sources
    for kind in what:
        if kind not in DRAWINGS:
            hint = nearest(kind[:60], DRAWINGS, "drawings")
            raise sources.error(table, kind[:60], f"unknown drawing '{kind:.60}'", hint=hint)
    if len(what) != 1:
        message = f"a drawing is one of {', '.join(DRAWINGS)}; {len(what)} are given"
        raise sources.error(table, "", message, hint='for example spring = ["hook", "hub"]')
    ((kind, given),) = what.items()
    count = DRAWINGS[kind]
    if count > 1 and (isinstance(given, str) or not isinstance(given, Sequence) or len(given) != count):
        hint = 'a place is a point\'s name, or a list of two or three components such as ["x", "0"]'
        what = "a place and a force" if kind == "force" else f'{count} places, such as ["hook", "hub"]'
        raise sources.error(table, kind, f"a {kind} takes a list of {what}", hint=hint)
    given = given if count > 1 else [given]
    vectors = (_components(model, table, drawing_key(kind, k), value) for k, value in enumerate(given))
    return Drawing(name, kind, tuple(vectors))


def _components(model: Declared, table: str, key: str, value: Any) -> tuple[sympy.Expr, ...]:
    """Three components: those of a point by its name, or two or three expressions in world axes."""
    if isinstance(value, str):
        fault = name_fault(value, element=True)
        if fault is not None:
            message = f"a place is a point's name, or a list of two or three components; {fault}"
            raise model._sources.error(table, key, message, hint="name a point of [points]")
        value = [f"{value}_{component}" for component in "xyz"]
    return model._components(value, table, key)
