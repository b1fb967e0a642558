"""Numbers that parameters make and that have a bound: what runs with other parameters are checked by (docs/abi.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from symgen.runtime.graph.layouts import LIMITS

from ..model import algebra
from ..model.description import Description
from .program import Function


def limit_function(load: Callable[[algebra.Expr], int], d: Description) -> Iterator[Function]:
    """The function of these numbers, if there are any; `load` gives the node of an expression."""
    numbers = tuple(load(x) for limit in d.limits for x in limit.numbers)
    if numbers:
        yield Function(LIMITS, "Numbers of parameters that have a bound.", numbers)


def limit_records(d: Description) -> dict[str, list[dict[str, Any]]]:
    """What the header says of them."""
    found = [
        {"name": x.name, "bound": x.bound} | ({"numbers": n} if (n := len(x.numbers)) > 1 else {})
        for x in d.limits
    ]
    return {LIMITS: found} if found else {}
