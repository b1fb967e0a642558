"""A function that writes few entries of a large matrix, as one that writes these entries alone, one after another.

Generated functions of matrices leave structural zeros out, so their forms tell which entries there are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.graph.form import OUT, Form, Loop, Place, Statement, Write


def compact(function: FunctionText) -> tuple[FunctionText, np.ndarray]:
    """Return a function that writes only the entries that a form names, and their places.

    Returns
    -------
    function : FunctionText
        Its `out[i]` is what `function` writes to `out[places[i]]`; its name has `ENTRIES` behind it.
    places : ndarray of int64
        In the order in which they are first written.
    """
    found = _Entries(function.form)
    return FunctionText.of(found.form, function.file, function.first_line), found.places()


class _Entries:
    """The form that writes entries: the same operations in the same store, other places in `out`."""

    def __init__(self, form: Form) -> None:
        self.entries: dict[int, int] = {}
        self.tables = dict(form.tables)
        body = [self._moved(statement, 0) for statement in form.body]
        lengths = form.lengths._replace(out=len(self.entries))
        self.form = replace(form, name=form.name + ENTRIES, lengths=lengths, tables=self.tables, body=body)

    def places(self) -> np.ndarray:
        return np.fromiter(self.entries, np.int64, len(self.entries))

    def _moved(self, statement: Statement, count: int) -> Statement:
        if type(statement) is Loop:
            inside = tuple(self._moved(inner, statement.count) for inner in statement.body)
            return statement._replace(body=inside)
        if type(statement) is not Write or statement.array != OUT:
            return statement
        places = statement.place.in_passes(max(count, 1), self.tables)
        numbers = [self.entries.setdefault(place, len(self.entries)) for place in places]
        return statement._replace(place=self._place(numbers, count))

    def _place(self, numbers: list[int], count: int) -> Place:
        """A place that runs through `numbers`; there is another table where these are no progression."""
        if not count or numbers == list(range(numbers[0], numbers[0] + count)):
            return Place(numbers[0], int(count > 0))
        name = next(name for k in range(len(self.tables) + 1) if (name := f"J{k}") not in self.tables)
        self.tables[name] = tuple(numbers)
        return Place(0, 0, name)
