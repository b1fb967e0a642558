"""The text of a function worked out on numbers of another kind: ranges over cells of time, or many times at once."""

from __future__ import annotations

import ast
import math
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symgen.runtime.code.grammar import MATH_FUNCTIONS, affine, loop_count, table_name
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.timing.intervals import Intervals, Range

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from symgen.runtime.code.grammar import FunctionText
    from symgen.runtime.system import System

NAME = "time_terms"
_BINARY = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_MOST_ASSIGNMENTS = 1_000_000


class Operations(Protocol):
    """What the text's operations do: `Intervals` or `Samples`."""

    def time(self) -> Any: ...
    def neg(self, x: Any) -> Any: ...
    def add(self, x: Any, y: Any) -> Any: ...
    def sub(self, x: Any, y: Any) -> Any: ...
    def mul(self, x: Any, y: Any) -> Any: ...
    def div(self, x: Any, y: Any) -> Any: ...
    def call(self, name: str, *args: Any) -> Any: ...
    def select(self, is_strict: bool, a: Any, b: Any, then: Any, otherwise: Any) -> Any: ...


class TimeTerms:
    """What a function of a model makes of time, for one `p`.

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters and inputs.
    name : str
        The function: what the equations have of time alone, if it is not given.
    """

    def __init__(self, system: System, p: np.ndarray, name: str = NAME):
        self._code: FunctionText = system.function_text(name)
        self._p = [float(x) for x in p]
        known = system.__dict__.setdefault("_statements", {})  # parsed once for all runs
        if name not in known:
            known[name] = list(self._straight(self._code.statements()))
        self._statements: list[tuple[ast.expr, ast.expr, int]] = known[name]

    def values(self, operations: Operations, y: Sequence[Any] = ()) -> list[Any]:
        """Return all that the function writes for some `y`; what are numbers does not change."""
        names: dict[str, Any] = {"t": operations.time()}
        self._y = y
        found: list[Any] = []
        for target, expression, k in self._statements:
            value = self._value(expression, names, operations, k)
            if isinstance(target, ast.Name):
                names[target.id] = value
            else:
                found.append(value)
        return found

    def numbers_read(self) -> tuple[int, ...]:
        """Return the places in `p` of the numbers that the function reads."""
        return tuple(
            sorted(
                {
                    self._index(node, k, len(self._p))
                    for _, expression, k in self._statements
                    for node in ast.walk(expression)
                    if type(node) is ast.Subscript and node.value.id == "p"
                }
            )
        )

    def _straight(self, body: list[ast.stmt]) -> Iterator[tuple[ast.expr, ast.expr, int]]:
        """The assignments, those in loops once for each pass."""
        passed = 0
        for statement in body:
            n = loop_count(statement) if isinstance(statement, ast.For) else None
            inner = statement.body if n is not None else [statement]
            for k in range(n or 1):
                for one in inner:
                    passed += 1
                    if type(one) is not ast.Assign or len(one.targets) != 1 or passed > _MOST_ASSIGNMENTS:
                        self._code.refuse(
                            one, "terms of time alone are assignments, a million of them at most"
                        )
                    if type(one.targets[0]) not in (ast.Name, ast.Subscript):
                        self._code.refuse(one, "an assignment is to a name, or to an element of out")
                    yield one.targets[0], one.value, k

    def _value(self, node: ast.expr, names: dict[str, Any], do: Operations, k: int) -> Any:
        kind = type(node)
        if kind is ast.Constant and type(node.value) in (int, float):
            return float(node.value)
        if kind is ast.Name and node.id in names:
            return names[node.id]
        if kind is ast.Subscript and type(node.value) is ast.Name and node.value.id == "p":
            return self._p[self._index(node, k, len(self._p))]
        if kind is ast.Subscript and type(node.value) is ast.Name and node.value.id == "y":
            return self._y[self._index(node, k, len(self._y))]
        if kind is ast.UnaryOp and type(node.op) is ast.USub:
            return do.neg(self._value(node.operand, names, do, k))
        if kind is ast.BinOp and type(node.op) in _BINARY:
            return self._binary(node, names, do, k)
        if kind is ast.Call and type(node.func) is ast.Name and node.func.id in MATH_FUNCTIONS:
            return do.call(node.func.id, *(self._value(x, names, do, k) for x in node.args))
        if (
            kind is ast.IfExp
            and type(node.test) is ast.Compare
            and type(node.test.ops[0]) in (ast.Lt, ast.LtE)
        ):
            a, b = (self._value(x, names, do, k) for x in (node.test.left, node.test.comparators[0]))
            then, otherwise = (self._value(x, names, do, k) for x in (node.body, node.orelse))
            return do.select(type(node.test.ops[0]) is ast.Lt, a, b, then, otherwise)
        return self._code.refuse(node, "this is no operation on time, parameters and inputs")

    def _binary(self, node: ast.BinOp, names: dict[str, Any], do: Operations, k: int) -> Any:
        spine = [node]  # long sums nest to the left
        while type(spine[-1].left) is ast.BinOp and type(spine[-1].left.op) in _BINARY:
            spine.append(spine[-1].left)
        value = self._value(spine[-1].left, names, do, k)
        for part in reversed(spine):
            is_square = (
                type(part.right) is ast.Name and type(part.left) is ast.Name and part.left.id == part.right.id
            )
            right = value if is_square else self._value(part.right, names, do, k)
            value = getattr(do, _BINARY[type(part.op)])(value, right)
        return value

    def _index(self, node: ast.Subscript, k: int, length: int) -> int:
        name = table_name(node.slice)
        if name is not None:
            place = self._code.tables[name][k]
        else:
            index = affine(node.slice, in_loop=True)
            if index is None:
                self._code.refuse(node, "an index is a number, or one that a loop counts")
            place = index.first + index.step * k
        if not 0 <= place < length:
            self._code.refuse(node, f"the index {place} is outside of an array of {length} numbers")
        return place


class Samples:
    """The operations at many times at once, with what each choice on the way decided.

    Parameters
    ----------
    t : ndarray [s]

    Attributes
    ----------
    choices : list of ndarray of bool
        Whether each comparison was true, or each argument negative whose sign makes a kink.
    """

    def __init__(self, t: np.ndarray):
        self._t = t
        self.choices: list[np.ndarray] = []

    def time(self) -> np.ndarray:
        return self._t

    def neg(self, x: Any) -> Any:
        return -x

    def add(self, x: Any, y: Any) -> Any:
        return x + y

    def sub(self, x: Any, y: Any) -> Any:
        return x - y

    def mul(self, x: Any, y: Any) -> Any:
        return x * y

    def div(self, x: Any, y: Any) -> Any:
        return np.divide(x, y)

    def call(self, name: str, *args: Any) -> Any:
        if all(isinstance(x, float) for x in args):
            return Intervals(self._t, self._t, []).call(name, *args)
        if name in ("fabs", "sqrt", "log", "copysign"):
            self._chose(np.asarray(args[-1]) < 0.0)
        entry = IN_CODE[name]
        function = getattr(np, entry.numpy) if entry.numpy else np.vectorize(entry.value, otypes=[float])
        return function(*args)

    def select(self, is_strict: bool, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
        is_so = np.less(a, b) if is_strict else np.less_equal(a, b)
        self._chose(is_so)
        return np.where(is_so, then, otherwise)

    def _chose(self, is_so: np.ndarray) -> None:
        self.choices.append(np.broadcast_to(is_so, self._t.shape))


def all_times(terms: TimeTerms, t_start: float) -> list[float]:
    """Return the width of the range of every result over all times from the start of a run on."""
    everywhere = Intervals(np.array([t_start]), np.array([math.inf]), [], finding=True)
    terms.values(everywhere)
    return everywhere.widths


def ranges(terms: TimeTerms, begin: np.ndarray, end: np.ndarray, widths: list[float]) -> list[Range]:
    """Return the terms that change, over cells from `begin` to `end` [s]."""
    found = terms.values(Intervals(begin, end, widths))
    return [x for x in found if isinstance(x, Range)]
