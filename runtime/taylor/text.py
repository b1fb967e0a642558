"""Read the text of a generated function into a series graph. The grammar is that of `symgen.runtime.code.lower`."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping

from symgen.runtime.taylor.graph import SeriesGraph
from symgen.runtime.taylor.refusal import Refusal

Tables = Mapping[str, tuple[int, ...]]

_OPERATIONS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_COMPARISONS = {ast.Lt: "olt", ast.LtE: "ole"}


def read_outputs(
    graph: SeriesGraph,
    text: str,
    state: Callable[[int], int],
    wanted: set[int] | None = None,
    given: dict[str, int] | None = None,
    tables: Tables | None = None,
    moving: Mapping[int, int] | None = None,
) -> dict[int, int]:
    """Add the operations behind `out[i]` to the graph; returns the node of each index.

    Parameters
    ----------
    graph : SeriesGraph
    text : str
        A function's text that `lower_function` accepts.
    state : callable
        Gives the node for `y[i]`.
    wanted : set of int, optional
        Indices of `out` to read; all by default. What nothing wanted needs may be outside of what has series.
    given : dict of str to int, optional
        Names whose nodes are known, whatever the text says that they are.
    tables : mapping, optional
        The module's tables of indices.
    moving : mapping of int to int, optional
        Nodes of what stands in `p` but is not constant: inputs over time.

    Raises
    ------
    Refusal
        An operation has no series, or a statement is none on numbers.
    """
    given, tables = given or {}, tables or {}

    def is_wanted(statement: Statement) -> bool:
        target, _, variables = statement
        return wanted is None or _whole(target.slice, variables, tables) in wanted

    reader = _Reader(graph, state, tables, moving or {})
    reader.names.update(given)
    outputs: dict[int, int] = {}
    for target, expression, variables in _needed(
        list(_straight(ast.parse(text).body[0].body)), is_wanted, given
    ):
        reader.variables = variables
        value = reader.value(expression)
        if isinstance(target, ast.Name):
            reader.names[target.id] = value
        else:
            outputs[_whole(target.slice, variables, tables)] = value
    return outputs


def named_outputs(text: str) -> dict[int, tuple[str, bool]]:
    """The outputs that are a name or its negative: index -> name, whether negative."""
    found = {}
    for statement in ast.parse(text).body[0].body:
        target = statement.targets[0] if isinstance(statement, ast.Assign) else None
        if not isinstance(target, ast.Subscript) or not isinstance(target.slice, ast.Constant):
            continue
        value = statement.value
        negative = isinstance(value, ast.UnaryOp)
        value = value.operand if negative else value
        if isinstance(value, ast.Name):
            found[target.slice.value] = (value.id, negative)
    return found


Statement = tuple[ast.expr, ast.expr, dict[str, int]]  # target, expression, the loop's variable


def _straight(body: list[ast.stmt]) -> Iterator[Statement]:
    """The assignments of a function, those in loops over equal subsystems once for each of these."""
    for statement in body:
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            continue
        if isinstance(statement, ast.For):
            for k in range(statement.iter.args[0].value):
                for target, expression, _ in _straight(statement.body):
                    yield target, expression, {statement.target.id: k}
        elif isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            yield statement.targets[0], statement.value, {}
        else:
            # The call of a solver that works by loops: it writes the arrays that it is given.
            for array in statement.value.args[:2]:
                if isinstance(array, ast.Name):
                    yield array, statement.value, {}


def _needed(
    statements: list[Statement], wanted: Callable[[Statement], bool], given: dict[str, int]
) -> list[Statement]:
    """The statements behind the wanted outputs, in order."""
    used: set[str] = set()
    kept = []
    for statement in reversed(statements):
        target, expression, _ = statement
        if isinstance(target, ast.Name):
            if target.id not in used or target.id in given:
                continue
        elif target.value.id != "out":
            if target.value.id in used:
                raise Refusal(f"line {target.lineno} of a function has arrays, which have no series")
            continue
        elif not wanted(statement):
            continue
        kept.append(statement)
        used.update(node.id for node in ast.walk(expression) if isinstance(node, ast.Name))
    return kept[::-1]


def _whole(node: ast.expr, variables: dict[str, int], tables: Tables) -> int:
    """The value of an index: a number, a + b*k, or an entry of a table."""
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Name):
        return variables[node.id]
    if isinstance(node, ast.BinOp):
        left, right = (_whole(side, variables, tables) for side in (node.left, node.right))
        return left * right if isinstance(node.op, ast.Mult) else left + right
    if isinstance(node, ast.Subscript):
        return tables[node.value.id][_whole(node.slice, variables, tables)]
    raise Refusal(f"line {node.lineno} of a function has an index that is no number")


class _Reader:
    def __init__(
        self, graph: SeriesGraph, state: Callable[[int], int], tables: Tables, moving: Mapping[int, int]
    ) -> None:
        self.graph, self.state, self.tables, self.moving = graph, state, tables, moving
        self.names: dict[str, int] = {}
        self.variables: dict[str, int] = {}

    def value(self, node: ast.expr) -> int:
        g = self.graph
        if isinstance(node, ast.Name):
            return g.time() if node.id == "t" and "t" not in self.names else self.names[node.id]
        if isinstance(node, ast.Constant):
            return g.number(float(node.value))
        if isinstance(node, ast.Subscript):
            index = _whole(node.slice, self.variables, self.tables)
            if node.value.id == "y":
                return self.state(index)
            if node.value.id != "p":
                raise Refusal(f"line {node.lineno} of a function has arrays, which have no series")
            return self.moving[index] if index in self.moving else g.parameter(index)
        if isinstance(node, ast.UnaryOp):
            if isinstance(node.operand, ast.Constant):
                return g.number(-float(node.operand.value))
            return g.neg(self.value(node.operand))
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        if isinstance(node, ast.Call):
            return g.call(node.func.id, *(self.value(a) for a in node.args))
        if isinstance(node, ast.IfExp):
            left, right = self.value(node.test.left), self.value(node.test.comparators[0])
            comparison = _COMPARISONS[type(node.test.ops[0])]
            return g.select(comparison, left, right, self.value(node.body), self.value(node.orelse))
        raise Refusal(f"line {node.lineno} of a function is outside of what has series")

    def _binary(self, node: ast.BinOp) -> int:
        # Long sums nest to the left: walk down that side without recursion, as `lower.py` does.
        spine = [node]
        while isinstance(spine[-1].left, ast.BinOp):
            spine.append(spine[-1].left)
        value = self.value(spine[-1].left)
        for part in reversed(spine):
            value = getattr(self.graph, _OPERATIONS[type(part.op)])(value, self.value(part.right))
        return value
