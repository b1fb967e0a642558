"""Whether velocity constraints are linear in the rates, found on the expression tree without expanding it."""

from __future__ import annotations

from collections.abc import Mapping

import sympy

from .description import Description
from .sources import Sources
from .tree import kind, postorder

NONLINEAR = 2


def check_velocity_constraints(d: Description, sources: Sources) -> None:
    """Every velocity constraint must contain rates, and be linear in them."""
    if not d.velocity_constraints:
        return
    degrees = {r.name: 1 for r in d.rates if r.coordinate != r.name}
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
        if degree >= NONLINEAR:
            raise sources.error(
                "velocity_constraints", c.name, "a velocity constraint must be linear in the rates"
            )


def rate_degree(root: sympy.Expr, definitions: Mapping[str, int]) -> int:
    """Degree of an expression in the rates: 0 without any, 1 linear, 2 anything else.

    Parameters
    ----------
    root : sympy.Expr
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
