"""Angles over which bushings and springs are wound up: what the health report looks at (docs/abi.md)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from ..model import algebra
from ..model.description import Description
from .program import Function


def winding_function(load: Callable[[algebra.Expr], int], d: Description) -> Iterator[Function]:
    """The function of the angles, if there are any; `load` gives the node of an expression."""
    angles = [load(x) for winding in d.windings for x in winding.angles]
    if angles:
        yield Function("windings", "Angles that jump where bushings and springs are wound up.", tuple(angles))


def _bound(angle: algebra.Expr) -> float:
    return 0.5 * math.pi if isinstance(angle, algebra.asin) else math.pi


def winding_records(d: Description) -> dict[str, list[dict[str, Any]]]:
    """What the header says of them."""
    records = [{"name": w.name, "kind": w.kind, "bounds": [_bound(x) for x in w.angles]} for w in d.windings]
    return {"windings": records} if records else {}
