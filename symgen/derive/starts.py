"""Starts that parameters make: a function that is evaluated again where a run sets them."""

from __future__ import annotations

from collections.abc import Iterator

import sympy

from ..model.description import Description
from .load import Loader
from .program import Function
from .variables import with_rates


def has_formulas(d: Description) -> bool:
    """Whether a start, guess or rate is an expression of parameters."""
    return any(x.formula is not None for x in (*d.coordinates, *with_rates(d).rates))


def formulas(d: Description) -> list[sympy.Expr]:
    """The expressions of starts, guesses and rates that have one."""
    return [x.formula.expression for x in (*d.coordinates, *with_rates(d).rates) if x.formula is not None]


def start_function(loader: Loader, d: Description) -> Iterator[Function]:
    """The function `starts`, if there are formulas: all of q and v, before assembly."""
    if not has_formulas(d):
        return
    nodes = []
    for x in (*d.coordinates, *with_rates(d).rates):
        number = x.guess if x.start is None else x.start
        nodes.append(loader.g.const(number) if x.formula is None else loader.load(x.formula.expression))
    yield Function("starts", "Start values of (q, v), before assembly.", tuple(nodes))
