"""Solutions of one symmetric matrix for many right-hand sides at once, by loops over these.

The factors and the right-hand sides are written out, into one array; then each row is one loop over all columns, whose
numbers lie side by side as registers for several numbers take them. Where columns are many this is shorter, and faster,
than operations that know which of their numbers are zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..graph.nodes import SparseRows
from .rows import Factors, Pivot


@dataclass(frozen=True)
class Row:
    """One row of a solve.

    Attributes
    ----------
    row : int
    pivot : int
        Where the inverse of its pivot stands in the array.
    before, after : tuple of (int, int)
        The rows that are eliminated before and after it and have an entry of L with it, and where that stands.
    """

    row: int
    pivot: int
    before: tuple[tuple[int, int], ...]
    after: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class ColumnSolve:
    """How solutions follow from factors and right-hand sides that stand in an array, rows of these behind the factors.

    Attributes
    ----------
    n_columns, n_results : int
        Of the right-hand sides; how many rows of the solution are results: the first ones.
    n_factors : int
        Where right-hand sides begin.
    rows : tuple of Row
        In the order of elimination.
    """

    n_columns: int
    n_results: int
    n_factors: int
    rows: tuple[Row, ...]

    @property
    def operations(self) -> int:
        """Of all columns."""
        return self.n_columns * sum(1 + 2 * len(row.before) + 2 * len(row.after) for row in self.rows)

    def beginning(self, array: str) -> Iterator[str]:
        """The lines before factors and right-hand sides are written."""
        n = len(self.rows) * self.n_columns
        yield f"{array} = [0.0]*{self.n_factors + n}"
        yield f"for k in range({n}):"
        yield f"    {array}[{self.n_factors} + k] = 0.0"

    def end(self, array: str, out: str) -> Iterator[str]:
        """The lines behind these, which write the results row by row."""
        loop = f"for k in range({self.n_columns}):"
        for row in self.rows:
            if row.before:
                yield loop
                yield f"    {self._at(array, row.row)} = {self._at(array, row.row)}{self._terms(array, row.before)}"
        for row in reversed(self.rows):
            yield loop
            x = f"{array}[{row.pivot}]*{self._at(array, row.row)}{self._terms(array, row.after)}"
            if row.row >= self.n_results:
                yield f"    {self._at(array, row.row)} = {x}"
                continue
            yield f"    x = {x}"
            yield f"    {self._at(array, row.row)} = x"
            yield f"    {self._index(out, row.row * self.n_columns)} = x"

    def _terms(self, array: str, entries: tuple[tuple[int, int], ...]) -> str:
        return "".join(f" - {array}[{place}]*{self._at(array, row)}" for row, place in entries)

    def _at(self, array: str, row: int) -> str:
        return self._index(array, self.n_factors + row * self.n_columns)

    @staticmethod
    def _index(array: str, first: int) -> str:
        return f"{array}[{first} + k]" if first else f"{array}[k]"


def solve_columns(
    factors: Factors, right: SparseRows, n_columns: int, n_results: int
) -> tuple[ColumnSolve, dict[int, int]] | None:
    """Return how all columns are solved for, and what stands where in the array; None for factors that are by loops.

    Parameters
    ----------
    factors : Factors
    right : sequence of dict of int to int
        Rows of right-hand sides, nodes by columns.
    n_columns, n_results : int
        See `ColumnSolve`.

    Returns
    -------
    ColumnSolve
    dict of int to int
        Nodes by places.
    """
    steps = [step for step in factors.pivots if isinstance(step, Pivot) and len(step.rows) == 1]
    if len(steps) < len(right) or len(steps) < len(factors.pivots):
        return None
    values: list[int] = []
    before: dict[int, list[tuple[int, int]]] = {i: [] for i in range(len(right))}
    found = []
    for step in steps:
        (row,) = step.rows
        pivot, after = len(values), []
        values.append(step.inverse[0][0])
        for i, (entry,) in step.lower.items():
            before[i].append((row, len(values)))
            after.append((i, len(values)))
            values.append(entry)
        found.append((row, pivot, tuple(after)))
    rows = tuple(Row(row, pivot, tuple(before[row]), after) for row, pivot, after in found)
    written = dict(enumerate(values))
    for i, entries in enumerate(right):
        written |= {len(values) + i * n_columns + j: node for j, node in sorted(entries.items())}
    return ColumnSolve(n_columns, n_results, len(values), rows), written
