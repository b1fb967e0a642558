"""A function that writes few entries of a large matrix, as one that writes these entries alone, one after another.

Generated functions of matrices leave structural zeros out, so the text tells which entries there are.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.code.grammar import FunctionText, affine, loop_count, table_name


def compact(function: FunctionText) -> tuple[FunctionText, np.ndarray]:
    """Return a function that writes only the entries that a text names, and their places.

    Parameters
    ----------
    function : FunctionText
        Of the grammar of ABI 1; text outside of it is refused when the result is lowered.

    Returns
    -------
    function : FunctionText
        Its `out[i]` is what `function` writes to `out[places[i]]`; its name has `ENTRIES` behind it.
    places : ndarray of int64
        In the order in which they are first written.
    """
    entries: dict[int, int] = {}
    tables = dict(function.tables)
    edits = []
    for target, count in _targets(function):
        numbers = [entries.setdefault(place, len(entries)) for place in _places(function, target, count)]
        edits.append((target.slice, _index(numbers, count, tables)))
    lines = function.text.encode().split(b"\n")  # the parser counts columns in bytes
    for index, text in reversed(edits):
        line = lines[index.lineno - 1]
        lines[index.lineno - 1] = line[: index.col_offset] + text.encode() + line[index.end_col_offset :]
    name = function.name + ENTRIES
    text = b"\n".join(lines).decode().replace(f"def {function.name}(", f"def {name}(", 1)
    lengths = replace(function.lengths, out=len(entries))
    result = replace(function, name=name, text=text, lengths=lengths, tables=tables)
    return result, np.fromiter(entries, np.int64, len(entries))


def _targets(function: FunctionText) -> Iterator[tuple[ast.Subscript, int]]:
    """What is written to `out`, in order, with the passes of the loop around it; 0 where there is none."""
    for statement in function.statements():
        inside = type(statement) is ast.For
        count = (loop_count(statement) or 0) if inside else 0
        for inner in statement.body if inside else [statement]:
            target = inner.targets[0] if type(inner) is ast.Assign else None
            if type(target) is ast.Subscript and type(target.value) is ast.Name and target.value.id == "out":
                yield target, count


def _places(function: FunctionText, target: ast.Subscript, count: int) -> list[int]:
    """The places that an assignment writes, pass by pass."""
    index = affine(target.slice, count > 0)
    if index is not None:
        return [index.first + index.step * k for k in range(max(count, 1))]
    places = function.tables.get(table_name(target.slice), ())
    if len(places) < count or not count:
        function.refuse(target, "the index of out must be a number, a + b*k, or a table's entry I0[k]")
    return list(places[:count])


def _index(numbers: list[int], count: int, tables: dict[str, tuple[int, ...]]) -> str:
    """The text of an index that runs through `numbers`; `tables` gets another where these are no progression."""
    first = numbers[0]
    if not count:
        return str(first)
    if numbers == list(range(first, first + count)):
        return f"{first} + k" if first else "k"
    name = next(name for k in range(len(tables) + 1) if (name := f"J{k}") not in tables)
    tables[name] = tuple(numbers)
    return f"{name}[k]"
