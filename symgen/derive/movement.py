"""Which expressions of a description change during a run, by the names in them."""

from __future__ import annotations

from collections.abc import Iterable

import sympy

from ..model.description import Description
from ..model.tree import postorder

WORLD = "world"


class Movement:
    """Tells what moves.

    Parameters
    ----------
    d : Description
    """

    def __init__(self, d: Description) -> None:
        self._fixed = {x.name for x in (*d.parameters, *d.constants)}
        self._fixed |= {f"{x.name}_{c}" for x in (*d.points, *d.axes) if x.body == WORLD for c in "xyz"}
        for name, expression in d.definitions:
            if not self.of([expression]):
                self._fixed.add(name)

    def of(self, expressions: Iterable[sympy.Expr]) -> bool:
        """Whether one of the expressions depends on more than parameters and constants."""
        nodes = postorder(expressions)
        return any(isinstance(x, sympy.Symbol) and x.name not in self._fixed for x in nodes)
