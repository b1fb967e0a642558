"""Forms made of forms: statements copied, with other places in their arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from symgen.runtime.graph.layouts import Lengths
from symgen.runtime.graph.nodes import Nodes

# `runtime/code/parse.py` makes a form of a text, once; machine code, series, dual numbers, subsystems and all else are
# passes over it. A form is a list of statements whose expressions are nodes of one store (`nodes.py`). A name that is
# given a value once is only a label of that value's node: who reads the name reads the node. What changes while a
# function runs has a version besides: a name that gets another value (a sum that a loop makes), an element of an array.
# Equal nodes therefore have equal values wherever both can be worked out.
#
# Loops stay loops: their statements stand once, with places such as `first + step*k`.

# Kinds of variables, bits of a node's mask: the time, elements of y and p; HELD is a name that gets other values
# (index: name and version), ELEMENT one of a local array (index: array, place and version).
T, Y, P, HELD, ELEMENT = (1 << k for k in range(5))
OUT = "out"


class Place(NamedTuple):
    """A place in an array: `first + step*k`, or the entry `k` of a table where one is named."""

    first: int
    step: int = 0
    table: str = ""

    def label(self) -> str:
        """A text that tells places apart within names."""
        if self.table:
            return f".{self.table}"
        return f"{self.first}.{self.step}" if self.step else str(self.first)

    def in_passes(self, count: int, tables: Mapping[str, tuple[int, ...]]) -> list[int]:
        """Return the numbers that it stands for in `count` passes of a loop."""
        if self.table:
            return list(tables[self.table][:count])
        return [self.first + self.step * k for k in range(count)]


class Name(NamedTuple):
    """`name = …`: a value that others may read.

    `hoisted`: it follows from parameters alone, and its name says so. `held`: it gets other values as well.
    """

    name: str
    node: int
    line: int
    hoisted: bool = False
    held: bool = False
    reads: tuple[tuple[str, Place], ...] = ()  # elements of local arrays that this reads


class Write(NamedTuple):
    """`array[place] = …`, to `out` or to a local array."""

    array: str
    place: Place
    node: int
    line: int
    reads: tuple[tuple[str, Place], ...] = ()


class Array(NamedTuple):
    """`name = [0.0]*length`: a local array, of zeros."""

    name: str
    length: int
    line: int


class Solve(NamedTuple):
    """`solver(array, …, number, …)` or `solver(array, …, table, number)`: works on local arrays in place."""

    solver: str
    arrays: tuple[str, ...]
    table: str
    numbers: tuple[int, ...]
    line: int


class Loop(NamedTuple):
    """`for k in range(count):` around other statements."""

    count: int
    body: tuple[Name | Write | Array | Solve, ...]
    line: int


Statement = Name | Write | Array | Solve | Loop


@dataclass(eq=False)
class Form:
    """One function.

    Attributes
    ----------
    name : str
    lengths : Lengths
    tables : mapping of str to tuple of int
        The index tables that it uses.
    nodes : Nodes
        Its expressions.
    body : list of statements
    sections : list of int
        Where in `body` the section of each kind of subsystem begins; what stands before the first is shared by all.
    doc : str
        What it computes, a line.
    """

    name: str
    lengths: Lengths
    tables: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    nodes: Nodes = field(default_factory=Nodes)
    body: list[Statement] = field(default_factory=list)
    sections: list[int] = field(default_factory=list)
    doc: str = ""

    def statements(self) -> Iterator[tuple[Name | Write | Array | Solve, int]]:
        """Yield all statements, each with the passes of the loop around it, 0 outside of loops."""
        for statement in self.body:
            if type(statement) is Loop:
                for inner in statement.body:
                    yield inner, statement.count
            else:
                yield statement, 0

    def writes(self) -> Iterator[tuple[Write, int]]:
        """Yield what is written to `out`, as `statements` does."""
        for statement, count in self.statements():
            if type(statement) is Write and statement.array == OUT:
                yield statement, count

    def roots(self) -> list[int]:
        """The nodes of all statements."""
        return [s.node for s, _ in self.statements() if type(s) is Name or type(s) is Write]

    def operations(self) -> int:
        """Return the number of operations that stand in it; those in loops count once."""
        nodes = self.nodes
        return sum(nodes.op[node] not in ("const", "var") for node in nodes.reachable(self.roots()))

    @property
    def has_loops(self) -> bool:
        return any(type(statement) is Loop for statement in self.body)

    @property
    def n_hoisted(self) -> int:
        """Hoisted values, those in loops once for each pass."""
        return sum(max(count, 1) for s, count in self.statements() if type(s) is Name and s.hoisted)

    def places_read(self, kind: int) -> set[int]:
        """The places in `y` or `p` that it reads."""
        nodes, found = self.nodes, set()
        by_count: dict[int, list[int]] = {}
        for statement, count in self.statements():
            if type(statement) is Name or type(statement) is Write:
                by_count.setdefault(max(count, 1), []).append(statement.node)
        for count, roots in by_count.items():
            for node in nodes.reachable(roots, kind):
                if nodes.op[node] == "var" and nodes.mask[node] == kind:
                    found.update(nodes.args[node][1].in_passes(count, self.tables))
        return found


Moved = Callable[[Place], Place]


def as_it_is(place: Place) -> Place:
    """The same place."""
    return place


def copied(
    source: Form, statements: Iterable[Statement], target: Form, y: Moved, p: Moved, out: Moved = as_it_is
) -> list[Statement]:
    """Return statements of one form for another, into whose store their operations go.

    Parameters
    ----------
    source, target : Form
    statements : iterable of statements
        Complete: what they read by name stands among them, or was copied before.
    y, p, out : callable
        The new places.
    """
    statements = list(statements)
    nodes, new = source.nodes, {}
    for node in nodes.reachable(_roots(statements)):
        op, args = nodes.op[node], nodes.args[node]
        if op == "const":
            new[node] = target.nodes.const(args[0])
        elif op != "var":
            new[node] = target.nodes.operation(op, *(new[x] for x in args))
        else:
            kind, index = args
            index = y(index) if kind == Y else p(index) if kind == P else index
            new[node] = target.nodes.var(kind, index)

    def copy(statement: Statement) -> Statement:
        if type(statement) is Loop:
            return statement._replace(body=tuple(map(copy, statement.body)))
        if type(statement) is Write and statement.array == OUT:
            return statement._replace(place=out(statement.place), node=new[statement.node])
        if type(statement) is Write or type(statement) is Name:
            return statement._replace(node=new[statement.node])
        return statement

    return list(map(copy, statements))


def needed(source: Form, names: Sequence[Name], statements: Sequence[Statement]) -> list[Name]:
    """Return those of `names`, in their order, whose values or later values `statements` read."""
    nodes, kept = source.nodes, []
    below = set(nodes.reachable(_roots(statements)))
    held = {nodes.args[x][1][0] for x in below if nodes.op[x] == "var" and nodes.mask[x] == HELD}
    for statement in reversed(names):
        if statement.name in held if statement.held else statement.node in below:
            kept.append(statement)
            below.update(nodes.reachable((statement.node,)))
    return kept[::-1]


def _roots(statements: Iterable[Statement]) -> list[int]:
    found = []
    for statement in statements:
        if type(statement) is Loop:
            found += _roots(statement.body)
        elif type(statement) is Name or type(statement) is Write:
            found.append(statement.node)
    return found
