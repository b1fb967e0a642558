"""Check a generated function against the grammar of ABI 1, and lower it to LLVM IR.

The translation is one to one, in the order in which Python evaluates: no reassociation, no fused multiply-
add.
"""

from __future__ import annotations

import ast
import gc
import math
from dataclasses import dataclass
from typing import NoReturn

from runtime.code.llvm_text import BINARY, INTRINSICS, LIBM, StraightLine, constant
from runtime.errors import ModuleError

MATH_FUNCTIONS = frozenset((*INTRINSICS, *LIBM))
ARGUMENTS = ("t", "y", "p", "out")

_INSTRUCTIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_COMPARISONS = {ast.Lt: "olt", ast.LtE: "ole"}
_RESERVED = MATH_FUNCTIONS.union(ARGUMENTS)
_MAX_NESTING = 400
_EXACT_INTEGERS = 2**53


@dataclass(frozen=True)
class Lengths:
    """How many values a kernel may read and write: an index beyond them is refused, not compiled."""

    y: int
    p: int
    out: int


@dataclass(frozen=True)
class Lowered:
    """A function as LLVM IR, and the number of its operations."""

    ir: str
    operations: int


def lower_function(
    text: str, symbol: str, lengths: Lengths, *, name: str = "", file: str = "<text>", first_line: int = 1
) -> Lowered:
    """Lower the text of one function (from its `def` line on) to LLVM IR.

    Parameters
    ----------
    text : str
        The function's source.
    symbol : str
        The name of the machine-code function `void symbol(double, ptr, ptr, ptr)`.
    lengths : Lengths
        The lengths of its arrays.
    name, file, first_line
        What messages say about where the text came from.

    Raises
    ------
    ModuleError
        The text is outside of the grammar of ABI 1 or indexes beyond its arrays; names the line.
    """
    lowering = _Lowering(name, file, first_line, lengths)
    for statement in lowering.body(text):
        lowering.statement(statement)
        lowering.code.end_statement()
    return Lowered(lowering.code.text(symbol), lowering.code.operations)


class _Lowering:
    def __init__(self, name: str, file: str, first_line: int, lengths: Lengths):
        self.code = StraightLine()
        self._name, self._file, self._first_line = name, file, first_line
        self._limits = {"y": lengths.y, "p": lengths.p}
        self._out_length = lengths.out
        self._values: dict[str, str] = {}
        self._depth = 0
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
        line = self._first_line + getattr(node, "lineno", 1) - 1
        raise ModuleError(self._file, f"line {line}, function {self._name!r}", cause)

    def body(self, text: str) -> list[ast.stmt]:
        """Parse the function and return its statements without the docstring."""
        collecting = gc.isenabled()
        gc.disable()  # a quarter of the parser's time, for objects that all survive
        try:
            module = ast.parse(text)
        except SyntaxError as error:
            at = ast.Pass(lineno=error.lineno or 1)
            self._refuse(at, f"not Python ({error.msg})")
        except (ValueError, MemoryError, RecursionError):
            self._refuse(None, "an expression is nested too deeply to be read, or the text has a null byte")
        finally:
            if collecting:
                gc.enable()
        function = module.body[0] if len(module.body) == 1 else None
        if not isinstance(function, ast.FunctionDef) or function.decorator_list or function.returns:
            self._refuse(function, "expected one function 'def name(t, y, p, out):'")
        a = function.args
        special = (a.posonlyargs, a.kwonlyargs, a.defaults, a.kw_defaults, a.vararg, a.kwarg)
        if tuple(x.arg for x in a.args) != ARGUMENTS or any(special) or any(x.annotation for x in a.args):
            self._refuse(function, "a function's arguments must be (t, y, p, out)")
        statements = function.body
        first = statements[0]
        is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
        return statements[1:] if is_docstring and isinstance(first.value.value, str) else statements

    def statement(self, statement: ast.stmt) -> None:
        """Lower `name = expression` or `out[i] = expression`."""
        if type(statement) is not ast.Assign or len(statement.targets) != 1:
            self._refuse(statement, "only 'name = expression' and 'out[i] = expression' are allowed here")
        value = self._lower(statement.value)
        target = statement.targets[0]
        if type(target) is ast.Name:
            if target.id in _RESERVED:
                self._refuse(statement, f"{target.id!r} cannot be assigned")
            self._values[target.id] = value
        elif type(target) is ast.Subscript and type(target.value) is ast.Name and target.value.id == "out":
            self.code.store(self._index(target, "out", self._out_length), value)
        else:
            self._refuse(statement, "only a name or out[i] can be assigned")

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
        if node.id == "t":
            return "%t"
        self._refuse(node, f"{node.id!r} has no value here")

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
        if array not in self._limits:
            self._refuse(node, "only y[i] and p[i] can be read")
        return self.code.load(array, self._index(node, array, self._limits[array]))

    def _index(self, node: ast.Subscript, array: str, length: int) -> int:
        index = node.slice.value if type(node.slice) is ast.Constant else None
        if type(index) is not int:
            self._refuse(node, f"the index of {array} must be a number")
        if not 0 <= index < length:
            self._refuse(
                node, f"{array}[{index}] is out of range: {array} has {length} values by the header's sizes"
            )
        return index

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
        arity = 2 if name in BINARY else 1
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


def python_function(text: str, name: str, file: str, first_line: int):
    """Return the function as plain Python. Only for text that `lower_function` has accepted.

    The names of the grammar are all that it can see.
    """
    tree = ast.parse(text)
    ast.increment_lineno(tree, first_line - 1)
    namespace = {"__builtins__": {}, "__name__": name, **{key: getattr(math, key) for key in MATH_FUNCTIONS}}
    exec(compile(tree, file, "exec"), namespace)
    return namespace[name]
