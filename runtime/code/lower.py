"""Check a generated function against the grammar of ABI 1, and lower it to LLVM IR.

The translation is one to one, in the order in which Python evaluates: no reassociation, no fused multiply-
add. A function is lowered whole, or in two: what its hoisted assignments compute from `p` alone (setup), and the
rest, which finds those values in an array (body).
"""

from __future__ import annotations

import ast
from typing import NoReturn

from runtime.code import dense_ldl
from runtime.code.grammar import (
    ARGUMENTS,
    MATH_FUNCTIONS,
    FunctionText,
    affine,
    array_length,
    hoisted_name,
    loop_count,
    reads_p,
    table_name,
)
from runtime.code.llvm_text import BINARY, Index, StraightLine, constant

_INSTRUCTIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_COMPARISONS = {ast.Lt: "olt", ast.LtE: "ole"}
_RESERVED = MATH_FUNCTIONS.union(ARGUMENTS)
_MAX_NESTING = 400
_EXACT_INTEGERS = 2**53


class Lowering:
    """One function on its way to LLVM IR.

    Parameters
    ----------
    function : FunctionText
    part : {"whole", "setup", "body"}
        What is lowered: everything; only the hoisted assignments, which are written to an array `h`; or all but
        these, with their values read from `h`.

    Attributes
    ----------
    n_hoisted : int
        Hoisted values that were met, each loop's as often as it runs.
    used_tables : set of str
    has_loops : bool
    """

    def __init__(self, function: FunctionText, part: str = "whole"):
        self._function, self._part = function, part
        lengths = function.lengths
        self._limits = {"p": lengths.p} if part == "setup" else {"y": lengths.y, "p": lengths.p}
        self._extra: dict[str, str] = {} if part == "whole" else {"h": "ptr"}
        self._values: dict[str, str] = {}
        self._outer: dict[str, str] = {}  # values of the code around a loop, while in the loop
        self._outer_code: StraightLine | None = None
        self._carried: list[
            str
        ] = []  # names that the loop which is being lowered finds, and gives new values
        self._entering: list[str] = []  # names whose values go into that loop
        self._frame: dict[str, int] = {}  # places of the values that go into loops and come out
        self._count = 0  # of the loop that is being lowered
        self._step = 0  # hoisted values for each k of that loop
        self._n_loops = 0
        self._arrays: dict[
            str, tuple[int, int]
        ] = {}  # local arrays: their first place in `work`, and their length
        self.work_size = 0  # values in all local arrays
        self._depth = 0
        self.n_hoisted = 0
        self.used_tables: set[str] = set()
        self.has_loops = False
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

    def lower(self, statements: list[ast.stmt], symbol: str) -> None:
        """Lower a function's statements; `code` holds the result."""
        self.has_loops = any(type(statement) is ast.For for statement in statements)
        if self.has_loops:
            self._extra["frame"] = "ptr"
        if self._part != "setup" and any(map(array_length, _with_loops(statements))):
            self._extra["work"] = "ptr"
        self.code = StraightLine(self._extra)
        for statement in statements:
            if type(statement) is ast.For:
                self._loop(statement, symbol)
            else:
                self._assignment(statement)
            self.code.end_statement()

    @property
    def spaces(self) -> dict[str, int]:
        """Arrays that the code takes besides, and their lengths: what loops exchange, and what solvers work on."""
        lengths = {"frame": max(1, len(self._frame)), "work": self.work_size}
        return {name: length for name, length in lengths.items() if name in self._extra}

    def _assignment(self, statement: ast.stmt) -> None:
        """Lower `name = expression` or `out[i] = expression`, as far as it belongs to this part.

        A function that calls a solver also has `name = [0.0]*length`, `name[i] = expression` and the call itself.
        """
        if type(statement) is ast.Expr:
            self._solve(statement)
            return
        if type(statement) is not ast.Assign or len(statement.targets) != 1:
            self._refuse(statement, "only 'name = expression' and 'out[i] = expression' are allowed here")
        target = statement.targets[0]
        length = array_length(statement)
        if length and type(target) is ast.Name:
            self._local_array(statement, target.id, length)
        elif type(target) is ast.Name:
            self._name_value(statement, target.id)
        elif (
            type(target) is ast.Subscript
            and type(target.value) is ast.Name
            and target.value.id in self._arrays
        ):
            value = self._lower(statement.value)
            self.code.store(self._local_index(target), value, "work")
        elif type(target) is ast.Subscript and type(target.value) is ast.Name and target.value.id == "out":
            if self._part != "setup":
                value = self._lower(statement.value)
                self.code.store(self._index(target, "out", self._function.lengths.out), value)
        else:
            self._refuse(statement, "only a name or out[i] can be assigned")

    def _name_value(self, statement: ast.Assign, name: str) -> None:
        if name in _RESERVED or (self.has_loops and name == "k"):
            self._refuse(statement, f"{name!r} cannot be assigned")
        if self._part == "whole" or hoisted_name(statement) is None:
            if self._part != "setup" or reads_p(statement.value):
                self._values[name] = self._lower(statement.value)
            return
        place = self._hoisted_place()
        if self._part == "setup":
            self._values[name] = self._lower(statement.value)
            self.code.store(place, self._values[name], "h")
        else:
            self._values[name] = self.code.later_load("h", place)

    def _local_array(self, statement: ast.stmt, name: str, length: int) -> None:
        if name in _RESERVED or name in self._values or name in self._outer:
            self._refuse(statement, f"{name!r} cannot be an array")
        first, known = self._arrays.setdefault(name, (self.work_size, length))
        if known != length:
            self._refuse(statement, f"{name!r} is an array of {known} values already")
        self.work_size = max(self.work_size, first + length)
        self.code.clear("work", first, length)

    def _local_index(self, node: ast.Subscript) -> Index:
        """The place in `work` of an element of a local array."""
        first, length = self._arrays[node.value.id]
        index = affine(node.slice, False)
        if index is None or index.first >= length:
            self._refuse(node, f"the index of {node.value.id} must be a number below {length}")
        return Index(first + index.first)

    def _solve(self, statement: ast.Expr) -> None:
        """Lower `solver(array, …, number, …)`."""
        call = statement.value
        name = call.func.id if type(call) is ast.Call and type(call.func) is ast.Name else ""
        if name not in dense_ldl.SOLVERS or call.keywords:
            self._refuse(
                statement, f"the only statements that are calls are those of {', '.join(dense_ldl.SOLVERS)}"
            )
        given = [self._arrays.get(x.id) if type(x) is ast.Name else None for x in call.args]
        arrays = [x for x in given if x is not None]
        sizes = [x.value for x in call.args if type(x) is ast.Constant and type(x.value) is int]
        needed = dense_ldl.array_lengths(name, sizes) if len(sizes) == dense_ldl.SOLVERS[name] else []
        in_order = given == [*arrays, *[None] * len(sizes)] and len(set(arrays)) == len(arrays)
        if (
            not in_order
            or [length for _, length in arrays] != needed
            or not 0 <= min(sizes) <= max(sizes) == sizes[0]
        ):
            self._refuse(statement, f"{name} is called with local arrays that do not fit its sizes")
        if self._part != "setup":
            self.code.solve(name, [first for first, _ in arrays], sizes)

    def _hoisted_place(self) -> Index:
        """The place in `h` of the next hoisted value; a loop's values for one `k` stand side by side."""
        place = Index(self.n_hoisted, self._step)
        self.n_hoisted += 1
        return place

    def _loop(self, statement: ast.For, symbol: str) -> None:
        """Lower `for k in range(N):` to a function of its own, which shares values with this code through a frame."""
        count = self._loop_count(statement)
        symbol = f"{symbol}.loop{self._n_loops}"
        self._n_loops += 1
        hoisted = 0 if self._part == "whole" else sum(hoisted_name(x) is not None for x in statement.body)
        assigned = dict.fromkeys(name for inner in statement.body for name in _assigned_names(inner))
        self._carried = [name for name in assigned if name in self._values]
        self._outer_code, self.code = self.code, StraightLine({**self._extra, "k": "i64"})
        self._outer, self._values, self._count = self._values, {}, count
        before, self._step = self.n_hoisted, hoisted
        for inner in statement.body:
            self._assignment(inner)
            self.code.end_statement()
        body = self.code
        # All values before the first is stored: they may come from places that are written here.
        for value, name in [(body.reuse(self._values[name]), name) for name in self._carried]:
            body.store(Index(self._slot(name)), value, "frame")
        self.code, self._values, self._count = self._outer_code, self._outer, 0
        self._outer_code, self._outer, self._step = None, {}, 0
        self.n_hoisted = before + hoisted * count
        for name in self._entering:
            self.code.store(Index(self._slot(name)), self.code.reuse(self._values[name]), "frame")
        self._entering.clear()
        self.code.run_loop(symbol, count, body)
        for name in self._carried:
            self._values[name] = self.code.fresh_load("frame", self._slot(name))

    def _loop_count(self, statement: ast.For) -> int:
        count = loop_count(statement)
        if count is None:
            self._refuse(statement, "the only loop is 'for k in range(N):' with a number N")
        if count < 1:
            self._refuse(statement, f"a loop runs at least once, not {count} times")
        return count

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
            return self.code.fresh_load("work", self._local_index(node).first)
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
            self._refuse(
                node, f"{array}[{wrong}] is out of range: {array} has {length} values by the header's sizes"
            )
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


def _with_loops(statements: list[ast.stmt]) -> list[ast.stmt]:
    """Statements, and those in loops."""
    return [inner for x in statements for inner in ([x, *x.body] if type(x) is ast.For else [x])]


def _assigned_names(statement: ast.stmt) -> list[str]:
    targets = statement.targets if type(statement) is ast.Assign else []
    return [target.id for target in targets if type(target) is ast.Name]
