"""Check a generated function against the grammar of ABI 1, and lower it to LLVM IR.

The translation is one to one, in the order in which Python evaluates: no reassociation, no fused multiply-
add. A function is lowered whole, or in two: what its hoisted assignments compute from `p` alone (setup), and the
rest, which finds those values in an array (body).
"""

from __future__ import annotations

import ast

from symgen.runtime.code import dense_ldl, front_ldl
from symgen.runtime.code.expressions import ExpressionLowering
from symgen.runtime.code.grammar import (
    ARGUMENTS,
    LARGEST,
    MATH_FUNCTIONS,
    MOST_STATEMENTS,
    FunctionText,
    array_length,
    hoisted_name,
    loop_count,
    reads_p,
)
from symgen.runtime.code.llvm_text import Index
from symgen.runtime.code.straight_line import StraightLine

_RESERVED = MATH_FUNCTIONS.union(ARGUMENTS)


class Lowering(ExpressionLowering):
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
    has_loops : bool
    """

    def __init__(self, function: FunctionText, part: str = "whole"):
        super().__init__(function, part)
        self._extra: dict[str, str] = {} if part == "whole" else {"h": "ptr"}
        self._step = 0  # hoisted values for each k of the loop that is being lowered
        self._n_loops = self._n_statements = 0
        self.work_size = 0  # values in all local arrays
        self.n_hoisted = 0
        self.has_loops = False

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
        if self.work_size > LARGEST:
            self._refuse(statement, f"its arrays have {self.work_size} values, more than {LARGEST}")
        self.code.clear("work", first, length)

    def _solve(self, statement: ast.Expr) -> None:
        """Lower `solver(array, …, number, …)`."""
        call = statement.value
        name = call.func.id if type(call) is ast.Call and type(call.func) is ast.Name else ""
        if name in front_ldl.SOLVERS and not call.keywords:
            self._solve_fronts(statement, name, call.args)
            return
        if name not in dense_ldl.SOLVERS or call.keywords:
            known = ", ".join((*dense_ldl.SOLVERS, *front_ldl.SOLVERS))
            self._refuse(statement, f"the only statements that are calls are those of {known}")
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

    def _solve_fronts(self, statement: ast.Expr, name: str, args: list[ast.expr]) -> None:
        """Lower `solver(array, …, table, number of fronts)`."""
        arrays = [self._arrays.get(x.id) if type(x) is ast.Name else None for x in args[:-2]]
        names = [x.id if type(x) is ast.Name else "" for x in args[-2:-1]]
        table = self._function.tables.get(names[0]) if names else None
        last = args[-1] if args else None
        n = last.value if type(last) is ast.Constant and type(last.value) is int else 0
        fits = None not in arrays and len(set(arrays)) == len(arrays) == front_ldl.SOLVERS[name]
        if not fits or table is None:
            self._refuse(statement, f"{name} is called with local arrays, a table, and the number of fronts")
        wrong = front_ldl.check(table, n, *(length for _, length in arrays))
        if wrong:
            self._refuse(statement, f"the table {names[0]} describes no elimination: {wrong}")
        self.used_tables.add(names[0])
        if self._part != "setup":
            self.code.solve_fronts(name, [first for first, _ in arrays], (names[0], table), n)

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
            self._values[name] = self.code.fresh_load("frame", Index(self._slot(name)))

    def _loop_count(self, statement: ast.For) -> int:
        count = loop_count(statement)
        if count is None:
            self._refuse(statement, "the only loop is 'for k in range(N):' with a number N")
        if count < 1:
            self._refuse(statement, f"a loop runs at least once, not {count} times")
        self._n_statements += count * len(statement.body)
        if count > LARGEST or self._n_statements > MOST_STATEMENTS:
            self._refuse(statement, f"a loop runs {count} times: that is more than a function may do")
        return count


def _with_loops(statements: list[ast.stmt]) -> list[ast.stmt]:
    """Statements, and those in loops."""
    return [inner for x in statements for inner in ([x, *x.body] if type(x) is ast.For else [x])]


def _assigned_names(statement: ast.stmt) -> list[str]:
    targets = statement.targets if type(statement) is ast.Assign else []
    return [target.id for target in targets if type(target) is ast.Name]
