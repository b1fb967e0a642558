"""A form carried out on values of any kind: numbers with their derivatives, ranges, power series, symbols."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, Protocol

from symgen.runtime.graph.form import (
    ELEMENT,
    HELD,
    OUT,
    Array,
    Form,
    Loop,
    Name,
    P,
    Place,
    Solve,
    Statement,
    T,
    Write,
)

_BINARY = ("add", "sub", "mul", "div")


class Arithmetic(Protocol):
    """What operations do with the values."""

    def time(self) -> Any: ...
    def neg(self, x: Any) -> Any: ...
    def add(self, x: Any, y: Any) -> Any: ...
    def sub(self, x: Any, y: Any) -> Any: ...
    def mul(self, x: Any, y: Any) -> Any: ...
    def div(self, x: Any, y: Any) -> Any: ...
    def call(self, name: str, *args: Any) -> Any: ...
    def select(self, is_strict: bool, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
        """`then` where a < b (a <= b); numbers have `decide(is_strict, a, b)` instead, which says whether it is."""


class NoArrays(Exception):
    """A function works on local arrays, which values of this kind cannot stand in; holds the line."""


def carry_out(
    form: Form,
    do: Arithmetic,
    y: Callable[[int], Any],
    p: Callable[[int], Any],
    *,
    const: Callable[[float], Any] = float,
    wanted: Collection[int] | None = None,
    given: Mapping[int, Any] | None = None,
    solvers: Mapping[str, Callable] | None = None,
) -> Iterator[tuple[int, Any]]:
    """Yield what a form writes to `out`: places and values, in order. Loops are run through, pass by pass.

    Parameters
    ----------
    form : Form
    do : Arithmetic
    y, p : callable
        The values of their elements.
    const : callable
        The value of a number.
    wanted : collection of int, optional
        Places of `out`; what nothing wanted needs is not carried out.
    given : mapping of int to value, optional
        Values of nodes that are known already.
    solvers : mapping of str to callable, optional
        What works on local arrays, as lists.

    Raises
    ------
    NoArrays
        There are local arrays, but no solvers.
    """
    run = _Run(form, do, y, p, const, dict(given or {}), solvers)
    needed = None if wanted is None else _Needed(form, wanted, run.values)
    for statement in form.body:
        if type(statement) is not Loop:
            if needed is None or needed.has(statement, 0):
                yield from run.statement(statement, 0)
            continue
        body = [x for x in statement.body if needed is None or needed.has(x, statement.count)]
        for k in range(statement.count if body else 0):
            run.here = {}
            for inner in body:
                place = run.place(inner.place, k) if type(inner) is Write else -1
                if wanted is None or place in wanted or type(inner) is not Write or inner.array != OUT:
                    yield from run.statement(inner, k)
        run.here = run.values


class _Needed:
    """Which statements some results need; nodes that are given need nothing."""

    def __init__(self, form: Form, wanted: Collection[int], given: Mapping[int, Any]) -> None:
        self.form, self.wanted, self.given = form, wanted, given
        self.nodes: set[int] = set()
        self.names: set[str] = set()  # held names, and local arrays
        before = -1
        while before != len(self.names):  # a loop may need what stands further down in it
            before = len(self.names)
            for statement, count in reversed(list(form.statements())):
                if self._is_root(statement, count):
                    self._add(statement.node)

    def _is_root(self, statement: Statement, count: int) -> bool:
        if type(statement) is Name:
            return statement.held and statement.name in self.names
        if type(statement) is not Write:
            return False
        if statement.array != OUT:
            return statement.array in self.names
        places = statement.place.in_passes(max(count, 1), self.form.tables)
        return any(place in self.wanted for place in places)

    def _add(self, root: int) -> None:
        nodes, pending = self.form.nodes, [root]
        while pending:
            node = pending.pop()
            if node in self.nodes or node in self.given:
                continue
            self.nodes.add(node)
            if nodes.op[node] == "var" and nodes.mask[node] & (HELD | ELEMENT):
                self.names.add(nodes.args[node][1][0])
            pending.extend(nodes.operands(node))

    def has(self, statement: Statement, count: int) -> bool:
        if type(statement) is Name and not statement.held:
            return statement.node in self.nodes
        if type(statement) is Name or type(statement) is Write:
            return self._is_root(statement, count)
        names = (statement.name,) if type(statement) is Array else statement.arrays
        return any(name in self.names for name in names)


class _Run:
    def __init__(self, form: Form, do: Arithmetic, y, p, const, values: dict[int, Any], solvers) -> None:
        self.form, self.nodes, self.do, self.y, self.p, self.const = form, form.nodes, do, y, p, const
        self.values = self.here = values  # of nodes; those in a pass of a loop apart
        self.held: dict[str, Any] = {}
        self.arrays: dict[str, list] = {}
        self.solvers = solvers
        self.k = 0

    def place(self, place: Place, k: int) -> int:
        return self.form.tables[place.table][k] if place.table else place.first + place.step * k

    def statement(self, statement: Statement, k: int) -> Iterator[tuple[int, Any]]:
        """Carry out one statement; yields what it writes to `out`."""
        self.k, kind = k, type(statement)
        if kind is Name:
            value = self.value(statement.node)
            if statement.held:
                self.held[statement.name] = value
        elif kind is Write and statement.array == OUT:
            yield self.place(statement.place, k), self.value(statement.node)
        elif self.solvers is None:
            raise NoArrays(statement.line)
        elif kind is Write:
            self.arrays[statement.array][self.place(statement.place, k)] = self.value(statement.node)
        elif kind is Array:
            self.arrays[statement.name] = [self.const(0.0)] * statement.length
        else:
            self._solve(statement)

    def _solve(self, statement: Solve) -> None:
        table = [self.form.tables[statement.table]] if statement.table else []
        arrays = [self.arrays[name] for name in statement.arrays]
        self.solvers[statement.solver](*arrays, *table, *statement.numbers)

    def value(self, node: int) -> Any:
        """The value of a node, worked out once in each pass."""
        here, values = self.here, self.values
        if node in here:
            return here[node]
        if node in values:
            return values[node]
        op, args = self.nodes.op[node], self.nodes.args[node]
        if op == "var":
            found = self._variable(*args)
        elif op == "const":
            found = self.const(args[0])
        elif op in _BINARY:
            found = self._binary(node)
        elif op == "neg":
            found = self.do.neg(self.value(args[0]))
        elif op in ("select", "select_le"):
            found = self._choice(op == "select", *args)
        else:
            found = self.do.call(op, *map(self.value, args))
        here[node] = found
        return found

    def _variable(self, kind: int, index: Any) -> Any:
        if kind == T:
            return self.do.time()
        if kind == HELD:
            return self.held[index[0]]
        if kind == ELEMENT:
            if self.solvers is None:
                raise NoArrays(0)
            return self.arrays[index[0]][self.place(index[1], self.k)]
        return (self.p if kind == P else self.y)(self.place(index, self.k))

    def _choice(self, is_strict: bool, a: int, b: int, then: int, otherwise: int) -> Any:
        """What cannot be chosen is not worked out, where values of this kind tell: it may have no value."""
        left, right = self.value(a), self.value(b)
        decide = getattr(self.do, "decide", None)
        if decide is not None:
            return self.value(then if decide(is_strict, left, right) else otherwise)
        return self.do.select(is_strict, left, right, self.value(then), self.value(otherwise))

    def _binary(self, node: int) -> Any:
        """Long sums nest to the left: walked down without recursion."""
        op, args = self.nodes.op, self.nodes.args
        spine, left = [node], args[node][0]
        while op[left] in _BINARY and left not in self.here and left not in self.values:
            spine.append(left)
            left = args[left][0]
        value = self.value(left)
        for part in reversed(spine):
            first, second = args[part]
            # A square is one of one value: ranges know that.
            other = value if first == second else self.value(second)
            value = self.here[part] = getattr(self.do, op[part])(value, other)
        return value
