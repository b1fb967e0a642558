"""Lower expressions of a generated function to LLVM IR, one to one, in the order in which Python evaluates."""

from __future__ import annotations

import ast
from typing import NoReturn

from symgen.runtime.code.grammar import MATH_FUNCTIONS, FunctionText, affine, table_name
from symgen.runtime.code.llvm_text import Index, constant
from symgen.runtime.code.straight_line import StraightLine
from symgen.runtime.graph.functions import IN_CODE

_INSTRUCTIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_COMPARISONS = {ast.Lt: "olt", ast.LtE: "ole"}
_MAX_NESTING = 400
_EXACT_INTEGERS = 2**53


class ExpressionLowering:
    """What expressions and names stand for at the place in a function that is being lowered.

    Parameters
    ----------
    function : FunctionText
    part : {"whole", "setup", "body"}
        See `lower.Lowering`.

    Attributes
    ----------
    used_tables : set of str
    """

    code: StraightLine

    def __init__(self, function: FunctionText, part: str):
        self._function, self._part = function, part
        lengths = function.lengths
        self._limits = {"p": lengths.p} if part == "setup" else {"y": lengths.y, "p": lengths.p}
        self._values: dict[str, str] = {}
        self._outer: dict[str, str] = {}  # values of the code around a loop, while in the loop
        self._outer_code: StraightLine | None = None
        # Names that the loop which is being lowered finds, and gives new values.
        self._carried: list[str] = []
        self._entering: list[str] = []  # names whose values go into that loop
        self._frame: dict[str, int] = {}  # places of the values that go into loops and come out
        self._count = 0  # of the loop that is being lowered
        # Local arrays: their first place in `work`, and their length.
        self._arrays: dict[str, tuple[int, int]] = {}
        self._depth = 0
        self.used_tables: set[str] = set()
        self._kinds = {
            ast.Name: self._variable,
            ast.BinOp: self._binary,
            ast.Constant: self._constant,
            ast.Subscript: self._element,
            ast.UnaryOp: self._unary,
            ast.Call: self._call,
            ast.IfExp: self._choice,
        }

    def _refuse(self, node: ast.AST | None, cause: str) -> NoReturn:
        self._function.refuse(node, cause)

    def _lower(self, node: ast.expr) -> str:
        kind = self._kinds.get(type(node))
        if kind is None:
            self._refuse(node, f"{type(node).__name__} is not allowed in an expression")
        return kind(node)

    def _nested(self, node: ast.expr) -> str:
        self._depth += 1
        if self._depth > _MAX_NESTING:
            self._refuse(node, f"an expression is nested more than {_MAX_NESTING} deep")
        value = self._lower(node)
        self._depth -= 1
        return value

    def _variable(self, node: ast.Name) -> str:
        value = self._values.get(node.id)
        if value is not None:
            return self.code.reuse(value)
        if node.id in self._outer:
            return self._outer_value(node.id)
        if node.id == "t" and self._part != "setup":
            return "%t"
        reason = " that follows from p alone" if self._part == "setup" else ""
        self._refuse(node, f"{node.id!r} has no value here{reason}")

    def _constant(self, node: ast.Constant) -> str:
        return constant(self._number(node))

    def _number(self, node: ast.Constant) -> float:
        value = node.value
        if type(value) is float:
            return value
        if type(value) is int and value <= _EXACT_INTEGERS:
            return float(value)
        self._refuse(node, f"{value!r:.40} is not a number of float64")

    def _element(self, node: ast.Subscript) -> str:
        array = node.value.id if type(node.value) is ast.Name else ""
        if array in self._arrays:
            return self.code.fresh_load("work", self._local_index(node))
        if array not in self._limits:
            self._refuse(node, f"only {' and '.join(f'{name}[i]' for name in self._limits)} can be read here")
        return self.code.load(array, self._index(node, array, self._limits[array]))

    def _index(self, node: ast.Subscript, array: str, length: int) -> Index:
        """The place that an index names: a number; in a loop also `a + b*k` with numbers a, b, or `I0[k]`."""
        index = affine(node.slice, bool(self._count))
        if index is None:
            index = self._table_index(node, array)
            places = self._function.tables[index.table][: self._count]
            low, high = min(places), max(places)
        else:
            low, high = index.first, index.first + index.step * max(self._count - 1, 0)
        if low < 0 or high >= length:
            wrong = high if low >= 0 else low
            whose = "" if array in self._arrays else " by the header's sizes"
            self._refuse(node, f"{array}[{wrong}] is out of range: {array} has {length} values{whose}")
        return index

    def _table_index(self, node: ast.Subscript, array: str) -> Index:
        table = table_name(node.slice)
        if not self._count or len(self._function.tables.get(table, ())) < self._count:
            kinds = "a number, a + b*k, or a table's entry I0[k]" if self._count else "a number"
            self._refuse(node, f"the index of {array} must be {kinds}")
        self.used_tables.add(table)
        return Index(0, 0, table)

    def _unary(self, node: ast.UnaryOp) -> str:
        if type(node.op) is not ast.USub:
            self._refuse(node, f"the operator {type(node.op).__name__} is not allowed")
        operand = node.operand
        if type(operand) is ast.Constant:
            # -0 is 0 in Python, -0.0 is not.
            number = self._number(operand)
            return constant(-number if number or type(operand.value) is float else 0.0)
        return self.code.negative(self._nested(operand))

    def _binary(self, node: ast.BinOp) -> str:
        # Sums and products of many terms nest to the left: walk down that side without recursion.
        spine = [node]
        while type(spine[-1].left) is ast.BinOp:
            spine.append(spine[-1].left)
        value = self._nested(spine[-1].left)
        for part in reversed(spine):
            instruction = _INSTRUCTIONS.get(type(part.op))
            if instruction is None:
                self._refuse(part, f"the operator {type(part.op).__name__} is not allowed")
            value = self.code.operation(instruction, value, self._nested(part.right))
        return value

    def _call(self, node: ast.Call) -> str:
        name = node.func.id if type(node.func) is ast.Name else ""
        if name not in MATH_FUNCTIONS:
            self._refuse(node, f"only these functions can be called: {', '.join(sorted(MATH_FUNCTIONS))}")
        arity = IN_CODE[name].arity[0]
        if node.keywords or len(node.args) != arity:
            self._refuse(node, f"{name} takes {arity} argument{'s' * (arity > 1)}")
        return self.code.call(name, [self._nested(argument) for argument in node.args])

    def _choice(self, node: ast.IfExp) -> str:
        test = node.test
        comparison = _COMPARISONS.get(type(test.ops[0])) if type(test) is ast.Compare else None
        if comparison is None or len(test.ops) != 1:
            self._refuse(node, "the condition must be 'b < c' or 'b <= c'")
        left, right = self._nested(test.left), self._nested(test.comparators[0])
        return self.code.select(comparison, left, right, self._nested(node.body), self._nested(node.orelse))

    def _local_index(self, node: ast.Subscript) -> Index:
        """The place in `work` of an element of a local array."""
        first, length = self._arrays[node.value.id]
        index = self._index(node, node.value.id, length)
        return Index(first + index.first, index.step, index.table)

    def _slot(self, name: str) -> int:
        return self._frame.setdefault(name, len(self._frame))

    def _outer_value(self, name: str) -> str:
        """The value of a name from the code around a loop, in the loop."""
        value = self._outer[name]
        if name not in self._carried:
            if value[0] != "%" or value == "%t":
                return value
            place = self._outer_code.stands_in(value)
            if place is not None:
                return self.code.load(*place)
        if name not in self._entering:
            self._entering.append(name)
        return self.code.load("frame", Index(self._slot(name)))
