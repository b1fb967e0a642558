"""Lower the form of a function to LLVM IR.

The translation is one to one, in the order in which Python evaluates: no reassociation, no fused multiply-
add. A function is lowered whole, or in two: what its hoisted assignments compute from `p` alone (setup), and the
rest, which finds those values in an array (body).
"""

from __future__ import annotations

from collections.abc import Iterator

from symgen.runtime.code import dense_ldl, front_ldl
from symgen.runtime.code.expressions import ExpressionLowering
from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.code.parse import LARGEST
from symgen.runtime.code.straight_line import StraightLine
from symgen.runtime.graph.form import OUT, Array, Loop, Name, P, Place, Solve, Statement, T


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
    """

    def __init__(self, function: FunctionText, part: str = "whole"):
        super().__init__(function, part)
        self._extra: dict[str, str] = {} if part == "whole" else {"h": "ptr"}
        self._step = 0  # hoisted values for each k of the loop that is being lowered
        self._n_loops = 0
        self.work_size = 0  # values in all local arrays
        self.n_hoisted = 0

    def lower(self, symbol: str) -> None:
        """Lower the function's statements; `code` holds the result."""
        form = self._function.form
        body = list(self._setup(form.body) if self._part == "setup" else form.body)
        if any(type(statement) is Loop for statement in body):
            self._extra["frame"] = "ptr"
        if self._part != "setup" and any(type(statement) is Array for statement, _ in form.statements()):
            self._extra["work"] = "ptr"
        self.code = StraightLine(self._extra)
        for statement in body:
            if type(statement) is Loop:
                self._loop(statement, symbol)
            else:
                self._statement(statement)
            self.code.end_statement()

    def _setup(self, body: list[Statement]) -> Iterator[Statement]:
        """What `p` alone decides: reads of `p`, hoisted assignments, and loops with these."""
        for statement in body:
            if type(statement) is Loop:
                kept = tuple(self._setup(statement.body))
                if kept:
                    yield statement._replace(body=kept)
            elif type(statement) is Name and (statement.hoisted or self._reads_p(statement.node)):
                yield statement

    def _reads_p(self, node: int) -> bool:
        return self._nodes.op[node] == "var" and self._nodes.mask[node] == P

    @property
    def spaces(self) -> dict[str, int]:
        """Arrays that the code takes besides, and their lengths: what loops exchange, and what solvers work on."""
        lengths = {"frame": max(1, len(self._frame)), "work": self.work_size}
        return {name: length for name, length in lengths.items() if name in self._extra}

    def _statement(self, statement: Statement) -> None:
        """Lower a statement, as far as it belongs to this part."""
        kind = type(statement)
        if kind is Name:
            self._name(statement)
        elif kind is Array:
            self._array(statement)
        elif kind is Solve:
            self._solve(statement)
        elif statement.array == OUT:
            self.code.store(statement.place, self._lower(statement.node))
        else:
            place = self._local_place(statement.array, statement.place)
            self.code.store(place, self._lower(statement.node), "work")

    def _name(self, statement: Name) -> None:
        what = statement.name if statement.held else statement.node
        if self._part == "whole" or not statement.hoisted:
            self._values[what] = self._lower(statement.node)
            return
        place = self._hoisted_place()
        if self._part == "setup":
            self._check_depends_on_p(statement)
            self._values[what] = self._lower(statement.node)
            self.code.store(place, self._values[what], "h")
        else:
            self._values[what] = self.code.later_load("h", place)

    def _check_depends_on_p(self, statement: Name) -> None:
        nodes = self._nodes
        for node in nodes.reachable((statement.node,), ~P):
            if nodes.op[node] == "var":
                name = "t" if nodes.mask[node] == T else nodes.args[node][1][0]
                if type(name) is int:
                    self._refuse(statement.line, "only p[i] can be read here")
                self._refuse(statement.line, f"{name!r} has no value here that follows from p alone")

    def _array(self, statement: Array) -> None:
        first, _ = self._arrays.setdefault(statement.name, (self.work_size, statement.length))
        self.work_size = max(self.work_size, first + statement.length)
        if self.work_size > LARGEST:
            self._refuse(statement.line, f"its arrays have {self.work_size} values, more than {LARGEST}")
        self.code.clear("work", first, statement.length)

    def _solve(self, statement: Solve) -> None:
        solver, given = statement.solver, [self._arrays[name] for name in statement.arrays]
        firsts, lengths = [first for first, _ in given], [length for _, length in given]
        if statement.table:
            table, (n,) = self._function.tables[statement.table], statement.numbers
            wrong = front_ldl.check(table, n, *lengths)
            if wrong:
                self._refuse(statement.line, f"the table {statement.table} describes no elimination: {wrong}")
            self.code.solve_fronts(solver, firsts, (statement.table, table), n)
            return
        sizes = list(statement.numbers)
        if lengths != dense_ldl.array_lengths(solver, sizes) or not 0 <= min(sizes) <= max(sizes) == sizes[0]:
            self._refuse(statement.line, f"{solver} is called with local arrays that do not fit its sizes")
        self.code.solve(solver, firsts, sizes)

    def _hoisted_place(self) -> Place:
        """The place in `h` of the next hoisted value; a loop's values for one `k` stand side by side."""
        place = Place(self.n_hoisted, self._step)
        self.n_hoisted += 1
        return place

    def _loop(self, loop: Loop, symbol: str) -> None:
        """Lower a loop to a function of its own, which shares values with this code through a frame."""
        symbol = f"{symbol}.loop{self._n_loops}"
        self._n_loops += 1
        hoisted = 0 if self._part == "whole" else sum(type(x) is Name and x.hoisted for x in loop.body)
        assigned = dict.fromkeys(x.name for x in loop.body if type(x) is Name)
        self._carried = [name for name in assigned if name in self._values]
        self._outer_code, self.code = self.code, StraightLine({**self._extra, "k": "i64"})
        self._outer, self._values = self._values, {}
        before, self._step = self.n_hoisted, hoisted
        for inner in loop.body:
            self._statement(inner)
            self.code.end_statement()
        body = self.code
        # All values before the first is stored: they may come from places that are written here.
        for value, name in [(body.reuse(self._values[name]), name) for name in self._carried]:
            body.store(Place(self._slot(name)), value, "frame")
        self.code, self._values = self._outer_code, self._outer
        self._outer_code, self._outer, self._step = None, {}, 0
        self.n_hoisted = before + hoisted * loop.count
        for what in self._entering:
            self.code.store(Place(self._slot(what)), self.code.reuse(self._values[what]), "frame")
        self._entering.clear()
        self.code.run_loop(symbol, loop.count, body)
        for name in self._carried:
            self._values[name] = self.code.fresh_load("frame", Place(self._slot(name)))
