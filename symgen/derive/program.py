"""What derivation yields: the header of the generated module and, per function, its output nodes on one graph."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from symgen.runtime.graph.layouts import ENERGY, LAYOUTS, POWER, RATIO

from .graph.graph import Graph
from .graph.hoist import count
from .graph.nodes import SparseRows
from .solve.columns import ColumnSolve

Sizes = Mapping[str, int]
Places = Mapping[str, tuple[int, ...]]
# Of numbers that all subsystems make together, where they begin: the ratio is a minimum, the others are sums.
START = {POWER: 0.0, RATIO: 1.0, ENERGY: 0.0}


def write_places(
    function: str, written: Sequence[int], places: Mapping[str, np.ndarray], own: Sizes, whole: Sizes
) -> np.ndarray:
    """Places in the whole model's `out` of what equal subsystems' function writes.

    Parameters
    ----------
    function : str
    written : sequence of int
        Places in a subsystem's own `out`, ascending.
    places : mapping of str to ndarray of int, shape (members, length)
        Indices in the whole model of each subsystem's elements, by the letters of `LAYOUTS`.
    own, whole : mapping of str to int
        The lengths of these vectors in a subsystem and in the whole model; those of POWER and RATIO are 1 where `rhs`
        writes them.

    Returns
    -------
    ndarray of int, shape (members, written)
    """
    found, written = [], np.array(written, dtype=np.int64)
    start = offset = 0
    for block in LAYOUTS[function]:
        if block in START:
            rows = np.zeros((len(places["q"]), own[block]), dtype=np.int64)
            n_rows, letters = whole[block], ""
        else:
            rows, n_rows = _axis(block[0], places, whole)
            letters = block[1]
        columns, n_columns = _axis(letters, places, whole) if letters else (np.zeros_like(rows[:, :1]), 1)
        length = rows.shape[1] * columns.shape[1]
        here = written[(start <= written) & (written < start + length)] - start
        i, j = np.divmod(here, max(1, columns.shape[1]))
        found.append(offset + rows[:, i] * n_columns + columns[:, j])
        start, offset = start + length, offset + n_rows * n_columns
    return np.hstack(found)


def reductions(function: str, whole: Sizes) -> dict[int, str]:
    """Places in the whole model's `out` of numbers that all subsystems make together, and which these are."""
    result: dict[int, str] = {}
    offset = 0
    for block in LAYOUTS[function]:
        if block in START:
            if whole[block]:
                result[offset] = block
            offset += whole[block]
        else:
            offset += _length(block[0], whole) * (_length(block[1], whole) if block[1] else 1)
    return result


def _axis(letters: str, places: Mapping[str, np.ndarray], whole: Sizes) -> tuple[np.ndarray, int]:
    """Places along an axis that joins several vectors, for each member, and its length."""
    found, offset = [], 0
    for letter in letters:
        found.append(offset + places[letter])
        offset += whole[letter]
    return np.hstack(found), offset


def _length(letters: str, whole: Sizes) -> int:
    return sum(whole[letter] for letter in letters)


CLOSED_PREFIX = "closed_"  # of the functions for a model whose stops are closed


@dataclass(frozen=True)
class Function:
    """A straight-line function: `outputs` are the nodes that it writes, at `places` of `out` (in order if None).

    Of the first `copies` entries of `out`, those that are not written so are the entries of `y`. With `columns` they
    are written to an array instead, from which these make all of `out`.
    """

    name: str
    doc: str
    outputs: tuple[int, ...]
    places: tuple[int, ...] | None = None
    copies: int = 0
    columns: ColumnSolve | None = None

    @staticmethod
    def matrix(name: str, doc: str, rows: SparseRows, n_columns: int) -> Function:
        """A function that writes a matrix row by row, but for its structural zeros."""
        entries = {i * n_columns + j: node for i, row in enumerate(rows) for j, node in sorted(row.items())}
        return Function(name, doc, tuple(entries.values()), tuple(entries))

    def written(self) -> list[tuple[int, int]]:
        """Pairs (index in `out`, node) of what the function writes."""
        places = range(len(self.outputs)) if self.places is None else self.places
        return list(zip(places, self.outputs, strict=True))


@dataclass(frozen=True)
class Part:
    """Equal subsystems: the functions of one of them, and where each one's elements stand in the whole model.

    Attributes
    ----------
    graph : Graph
    functions : tuple of Function
        Of the first member alone.
    members : tuple of mapping
        Indices in the whole model by the letters of `LAYOUTS`, and of "parameters" and "inputs".
    sizes : mapping
        Lengths of these vectors in one member.
    title : str
        For people.
    """

    graph: Graph
    functions: tuple[Function, ...]
    members: tuple[Places, ...]
    sizes: Sizes
    title: str

    @cached_property
    def indices(self) -> dict[str, np.ndarray]:
        """What `members` say, as arrays of shape (members, length)."""
        n = len(self.members)
        return {
            letter: np.array([member[letter] for member in self.members], dtype=np.int64).reshape(n, -1)
            for letter in self.members[0]
        }

    @cached_property
    def own_parameters(self) -> frozenset[int]:
        """Parameters that stand at different places in different members."""
        places = self.indices["parameters"]
        return frozenset(np.flatnonzero((places != places[0]).any(axis=0)).tolist())

    def function(self, name: str) -> Function | None:
        """The function of this name, if there is one."""
        return next((f for f in self.functions if f.name == name), None)

    def places(self, function: Function, whole: Sizes) -> dict[int, tuple[int, ...]]:
        """For each number that a function writes: its place in the whole model's `out`, for each member."""
        written = [k for k, _ in function.written()]
        columns = write_places(function.name, written, self.indices, self.sizes, whole).T.tolist()
        return dict(zip(written, map(tuple, columns), strict=True))


@dataclass(frozen=True)
class Program:
    """Derived equations: a graph, functions on it, and all that the generated module's header says.

    A model of several subsystems has `parts`; then `functions` are only those that look at all of them. `closed` has
    the functions that differ while stops of a model are closed.
    """

    graph: Graph
    functions: tuple[Function, ...]
    header: dict[str, Any]
    findings: tuple[str, ...] = field(default=())
    parts: tuple[Part, ...] = field(default=())
    sizes: Sizes = field(default_factory=dict)
    closed: Program | None = None

    @cached_property
    def own(self) -> dict[str, Function]:
        """The functions that are not those of parts, by name."""
        return {f.name: f for f in self.functions}

    def names(self) -> Iterator[str]:
        """The functions' names in the order of the generated file."""
        shared = {f.name for part in self.parts for f in part.functions}
        yield from (name for name in LAYOUTS if name in shared)
        yield from (f.name for f in self.functions)

    def operations(self) -> dict[str, int]:
        """Operations that a call of each function does."""
        return {name: sum(counts) for name, counts in self.all_counts().items()}

    def all_counts(self) -> dict[str, tuple[int, int]]:
        """What `counts` says of every function in the module, those of the closed form included."""
        return dict(self._all_counts)

    @cached_property
    def _all_counts(self) -> dict[str, tuple[int, int]]:
        closed = {} if self.closed is None else self.closed.all_counts()
        own = {name: self.counts(name) for name in self.names()}
        return own | {CLOSED_PREFIX + name: counts for name, counts in closed.items()}

    def written_operations(self) -> dict[str, int]:
        """Operations in the text of each function; loops count once."""
        result = dict.fromkeys(self.names(), 0)
        for owner in (self, *self.parts):
            for f in owner.functions:
                result[f.name] += sum(count(owner.graph, (node for _, node in f.written())))
                result[f.name] += f.columns.operations // f.columns.n_columns if f.columns else 0
        closed = {} if self.closed is None else self.closed.written_operations()
        return result | {CLOSED_PREFIX + name: count for name, count in closed.items()}

    def counts(self, name: str) -> tuple[int, int]:
        """Operations of a function that depend on parameters only, and all others; loops count as often as they run."""
        once, always = 0, 0
        if name in self.own:
            shared, own, motion = count(self.graph, (n for _, n in self.own[name].written()))
            columns = self.own[name].columns
            once, always = shared + own, motion + (columns.operations if columns else 0)
        for part in self.parts:
            f = part.function(name)
            if f is None:
                continue
            n = len(part.members)
            nodes = [node for _, node in f.written()]
            totals = reductions(name, self.sizes)
            shared, own, motion = count(part.graph, nodes, part.own_parameters)
            joined = sum(place[0] in totals for place in part.places(f, self.sizes).values())
            once, always = once + shared + n * own, always + n * (motion + joined)
        return once, always
