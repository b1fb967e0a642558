"""Numbers of a model at the parameters of a run: the checks of descriptions, made again where a run sets others."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ..errors import ModelError
from . import algebra
from .algebra import postorder
from .check_values import check_values
from .description import Description
from .evaluate import NotFinite, evaluate
from .expression_tree import kind
from .items import definition_items, items
from .rolling import HELD
from .sources import Address, Sources


class ValuesOfRuns:
    """Finds values of parameters at which a model is none: negative sizes, an inner radius beyond the outer one.

    Parameters
    ----------
    d : Description
        Before its elements are written out, its definitions in order.
    sources : Sources
        Where its expressions came from.
    """

    def __init__(self, d: Description, sources: Sources) -> None:
        self._d, self._sources = d, sources

    @property
    def creeping(self) -> list[str]:
        """The names of frictions that creep, of which modules say nothing where their force is given."""
        return [f.name for f in self._d.frictions if f.creeps]

    def remark(self, constraint: str) -> str:
        """Return where a constraint of an element has no meaning; an empty string where nothing is known of that."""
        for r in self._d.rolling:
            if r.kind == "wheel" and constraint in {f"{r.name}_{which}" for which in HELD}:
                return (
                    f"wheel {r.name!r} touches with all of its rim where it lies flat, with its axle along the normal "
                    "of what it rolls on"
                )
        return ""

    def fault(self, values: Mapping[str, float]) -> str:
        """Return what is wrong at values of all parameters, by name, the first of it; an empty string for nothing."""
        parameters = tuple(replace(p, value=float(values[p.name])) for p in self._d.parameters)
        try:
            check_values(replace(self._d, parameters=parameters), self._sources)
        except ModelError as error:
            return str(error)
        return ""

    def of_members(self, values: Mapping[str, np.ndarray]) -> dict[int, str]:
        """Return which of many runs are refused, and why; values by name, shape (n,) where they vary, else ().

        What is checked are bounds of one number, and that of two numbers of one element one is the smaller. So if any
        run is wrong, one of those with the least or the largest of such a number or difference is.
        """
        found: dict[int, str] = {}
        varying = {name for name, x in values.items() if np.ndim(x)}
        n = len(values[next(iter(varying))]) if varying else 0
        quantities = list(self._quantities(values, varying)) if n else []
        left = np.ones(n, dtype=bool)
        while left.any():
            numbers = np.flatnonzero(left)
            extremes = {int(numbers[f(x[numbers])]) for x in quantities for f in (np.argmin, np.argmax)}
            faults = {
                k: self.fault({name: x[k] if np.ndim(x) else x for name, x in values.items()})
                for k in extremes
            }
            wrong = {k: fault for k, fault in faults.items() if fault}
            if not wrong:
                return found
            found |= wrong
            left[list(wrong)] = False
        return found

    def _quantities(self, values: Mapping[str, np.ndarray], varying: set[str]) -> Iterator[np.ndarray]:
        """All numbers that vary, and differences of those that belong to one element, shape (n,) each."""
        d = self._d
        known = {**{c.name: c.value for c in d.constants}, **values}
        moved = set(varying)
        by_table: dict[str, dict[Address, np.ndarray | float]] = {}
        for item in (*definition_items(d), *items(d)):
            value = _of_all(item.expression, known, moved)
            if item.table == "definitions" and value is not None:
                known[item.key] = value
                moved |= {item.key} if np.ndim(value) else set()
            elif value is not None:
                by_table.setdefault(item.table, {})[item.table, item.key] = value
        for numbers in by_table.values():
            distinct = list({id(x) if np.ndim(x) else x: x for x in numbers.values()}.values())
            yield from (x for x in distinct if np.ndim(x))
            if any(np.ndim(x) for x in distinct):
                yield from (x - y for x, y in itertools.combinations(distinct, 2) if np.ndim(x) or np.ndim(y))


_OF_ARRAYS = {
    "sum": sum,
    "product": lambda x: np.prod(np.broadcast_arrays(*x), axis=0),
    "power": lambda x: np.power(*x),
}


def _of_all(
    expression: algebra.Expr, known: Mapping[str, np.ndarray | float], moved: set[str]
) -> np.ndarray | float | None:
    """An expression for all runs; None where it depends on what is no parameter, or has no value."""
    if isinstance(expression, algebra.Symbol):
        return known.get(expression.name)
    names = {x.name for x in expression.free_symbols}
    if not names <= known.keys():
        return None
    if not names & moved:
        return _or_none(expression, known)
    nodes = list(postorder([expression]))
    if all(kind(node) in ("symbol", "number", "constant", *_OF_ARRAYS) for node in nodes):
        memo: dict[int, np.ndarray | float] = {}
        with np.errstate(all="ignore"):
            for node in nodes:
                make = _OF_ARRAYS.get(kind(node))
                own = [memo[id(x)] for x in node.args] if make else []
                memo[id(node)] = (
                    make(own) if make else known[node.name] if kind(node) == "symbol" else float(node)
                )
        return np.nan_to_num(np.asarray(memo[id(expression)], dtype=float))
    n = next(len(known[name]) for name in names & moved)
    rows = ({name: x[k] if np.ndim(x) else x for name, x in known.items()} for k in range(n))
    return np.array([0.0 if (x := _or_none(expression, row)) is None else x for row in rows])


def _or_none(expression: algebra.Expr, known: Mapping[str, float]) -> float | None:
    try:
        return evaluate(expression, known)
    except NotFinite:
        return None
