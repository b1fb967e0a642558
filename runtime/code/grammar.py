"""The grammar of a generated function: how its text is read, and the forms that an index may have."""

from __future__ import annotations

import ast
import gc
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NoReturn

from symgen.runtime.code.llvm_text import Index
from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.functions import IN_CODE

MATH_FUNCTIONS = frozenset(IN_CODE)
ARGUMENTS = ("t", "y", "p", "out")
# A module may come from anybody: what it asks for must end, and have room.
LARGEST = 1 << 26  # values of a local array, passes of a loop
MOST_STATEMENTS = 1 << 30  # that a call of a function carries out

_HOISTED = re.compile(r"c[0-9]+")
_SETUP_LINE = re.compile(r"(?:    ){1,2}(?:\w+ = p\[.*\]|c[0-9]+ = .*|for .*:)")


def _as_it_is(function: Callable) -> Callable:
    return function


@dataclass(frozen=True)
class Lengths:
    """How many values a kernel may read and write: an index beyond them is refused, not compiled."""

    y: int
    p: int
    out: int


@dataclass(frozen=True)
class FunctionText:
    """The text of one function, from its `def` line on.

    Attributes
    ----------
    name : str
    text : str
    lengths : Lengths
        Of its arrays.
    tables : mapping of str to tuple of int
        The module's index tables.
    file, first_line
        Where the text came from, for messages.
    """

    name: str
    text: str
    lengths: Lengths
    tables: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    file: str = "<text>"
    first_line: int = 1

    def refuse(self, node: ast.AST | None, cause: str) -> NoReturn:
        """Raise the error that says what is wrong, and where."""
        line = self.first_line + getattr(node, "lineno", 1) - 1
        raise ModuleError(self.file, f"line {line}, function {self.name!r}", cause)

    def statements(self) -> list[ast.stmt]:
        """Return the function's statements, without the docstring."""
        return self._parsed(self.text)

    def setup_statements(self) -> list[ast.stmt]:
        """Return only what `p` alone decides: reads of `p`, hoisted assignments, and loops with these.

        They are found by lines, as parsing all of a long function takes most of the time of a start.
        """
        head, *lines = self.text.split("\n")
        kept: list[str] = ["    h = 0.0"]  # a function needs a statement
        after = ""
        for line in reversed(lines):
            found = _SETUP_LINE.fullmatch(line) and (not line.endswith(":") or after.startswith(" " * 8))
            kept.append(line if found else "")  # an empty line, so that messages count lines rightly
            after = line if found else after
        return self._parsed("\n".join((head, *reversed(kept))))[:-1]

    def _parsed(self, text: str) -> list[ast.stmt]:
        collecting = gc.isenabled()
        gc.disable()  # a quarter of the parser's time, for objects that all survive
        try:
            module = ast.parse(text)
        except SyntaxError as error:
            at = ast.Pass(lineno=error.lineno or 1)
            self.refuse(at, f"not Python ({error.msg})")
        except (ValueError, MemoryError, RecursionError):
            self.refuse(None, "an expression is nested too deeply to be read, or the text has a null byte")
        finally:
            if collecting:
                gc.enable()
        function = module.body[0] if len(module.body) == 1 else None
        if not isinstance(function, ast.FunctionDef) or function.decorator_list or function.returns:
            self.refuse(function, "expected one function 'def name(t, y, p, out):'")
        a = function.args
        special = (a.posonlyargs, a.kwonlyargs, a.defaults, a.kw_defaults, a.vararg, a.kwarg)
        if tuple(x.arg for x in a.args) != ARGUMENTS or any(special) or any(x.annotation for x in a.args):
            self.refuse(function, "a function's arguments must be (t, y, p, out)")
        statements = function.body
        first = statements[0]
        is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
        return statements[1:] if is_docstring and isinstance(first.value.value, str) else statements

    def python_function(
        self,
        decorate: Callable[[Callable], Callable] = _as_it_is,
        mathematics: Mapping[str, Callable] | None = None,
    ) -> Callable:
        """Return the function as plain Python. Only for text that lowering has accepted.

        The names of the grammar are all that it can see. `decorate` is applied to it and to the solvers that it calls;
        `mathematics` takes the place of `math`, for arguments that are no floats.
        """
        from symgen.runtime.code import dense_ldl, front_ldl

        tree = ast.parse(self.text)
        ast.increment_lineno(tree, self.first_line - 1)
        functions = {key: function.value for key, function in IN_CODE.items()} | dict(mathematics or {})
        for solvers in (dense_ldl, front_ldl):
            functions |= {key: decorate(getattr(solvers, key)) for key in solvers.SOLVERS if key in self.text}
        namespace = {"__builtins__": {}, "__name__": self.name, "range": range, **self.tables, **functions}
        exec(compile(tree, self.file, "exec"), namespace)
        return decorate(namespace[self.name])


def hoisted_name(statement: ast.stmt) -> str | None:
    """The name `c0`, `c1`, … that a hoisted assignment gives a value; None for other statements."""
    target = statement.targets[0] if type(statement) is ast.Assign and statement.targets else None
    return target.id if type(target) is ast.Name and _HOISTED.fullmatch(target.id) else None


def reads_p(node: ast.expr) -> bool:
    """Whether an expression is an element of `p`."""
    return type(node) is ast.Subscript and type(node.value) is ast.Name and node.value.id == "p"


def affine(node: ast.expr, in_loop: bool) -> Index | None:
    """The index `a`, in a loop also `k`, `b*k`, `a + k` or `a + b*k`; None for any other."""
    if type(node) is ast.BinOp and type(node.op) is ast.Add:
        first, step = _whole_number(node.left), _multiple(node.right)
        return Index(first, step) if in_loop and first is not None and step is not None else None
    first = _whole_number(node)
    if first is not None:
        return Index(first)
    step = _multiple(node)
    return Index(0, step) if in_loop and step is not None else None


def _multiple(node: ast.expr) -> int | None:
    """b of `b*k`, 1 of `k`."""
    if type(node) is ast.Name and node.id == "k":
        return 1
    is_product = type(node) is ast.BinOp and type(node.op) is ast.Mult
    if is_product and type(node.right) is ast.Name and node.right.id == "k":
        return _whole_number(node.left) or None
    return None


def _whole_number(node: ast.expr) -> int | None:
    return node.value if type(node) is ast.Constant and type(node.value) is int else None


def array_length(statement: ast.stmt) -> int | None:
    """N of `name = [0.0]*N`; None for any other statement."""
    product = statement.value if type(statement) is ast.Assign else None
    if (
        type(product) is not ast.BinOp
        or type(product.op) is not ast.Mult
        or type(product.left) is not ast.List
    ):
        return None
    zeros = product.left.elts
    is_zero = len(zeros) == 1 and type(zeros[0]) is ast.Constant and zeros[0].value == 0.0
    return _whole_number(product.right) if is_zero else None


def table_name(node: ast.expr) -> str | None:
    """`I0` of the index `I0[k]`."""
    named = type(node) is ast.Subscript and type(node.value) is ast.Name and type(node.slice) is ast.Name
    return node.value.id if named and node.slice.id == "k" else None


def loop_count(statement: ast.For) -> int | None:
    """N of `for k in range(N):`; None for any other loop."""
    call = statement.iter
    is_range = type(call) is ast.Call and type(call.func) is ast.Name and call.func.id == "range"
    if not is_range or len(call.args) != 1 or call.keywords or statement.orelse:
        return None
    if type(statement.target) is not ast.Name or statement.target.id != "k":
        return None
    return _whole_number(call.args[0])
