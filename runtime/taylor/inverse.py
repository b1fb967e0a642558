"""The inverse of what each order is solved with: formed once a step, a product of it and a vector for each order.

A solution of a chain of bodies is itself a chain: what a body is left with waits for that of the body before, to the
end and back, some nine operations a body in a row. Each order would wait for all of it, and the processor with it. The
matrix is the same for all orders, and symmetric, so that a column of the inverse is a row; a product with it has more
operations, but they stand side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from symgen.runtime.code.llvm_text import constant, number_table
from symgen.runtime.taylor.code import ONE, Code, Value, splat

_COLUMNS = 16  # that are solved for at a time
_WIDTH, _VECTORS = 8, 3  # numbers of a vector; vectors of a solution that are summed up together
_SUMS = 2  # of every other term, which do not wait for each other

# The inverse is formed up to this size, where a solution has so many operations in a row for each of its numbers.
# Chains of bodies have nine, Andrews' mechanism three; with 1.5 and two there is enough else to do meanwhile.
_LARGEST, _LONG = 32, 2.5

Wait = int | str | None
Solve = Callable[[Any, list[Any]], list[Any]]


class _Columns(Code):
    """Operations on several right-hand sides side by side; what all have in common is loaded from scratch."""

    def __init__(self, beside: Code) -> None:
        super().__init__(beside.symbol, _COLUMNS)
        self._beside, self._loose = beside, "contract "
        self._common: dict[str, str] = {}
        self.begin_piece()

    def name(self) -> str:
        return f"%column{super().name()[1:]}"

    def use(self, value: str) -> str:
        if value[0] != "%" or value.startswith("%column"):
            return super().use(value)
        if value not in self._common:
            place, one, all_ = self._beside.reserve(1), self.name(), self.name()
            self._beside.store("scratch", place, value)
            self.line(f"{one}.at = getelementptr inbounds double, ptr %scratch, i64 {place}")
            self.line(f"{one} = load double, ptr {one}.at, align 8")
            for line in splat(self, 1, one, all_):
                self.line(line)
            self._common[value] = all_
        return self._common[value]


class _Waits:
    """Stands for a `Code` to count how many operations a value waits for, one after the other: what is known, none."""

    lanes = 0

    def add(self, a: Wait, b: Wait) -> Wait:
        return self._after(a, b) if None not in (a, b) else b if a is None else a

    sub = add

    def neg(self, a: Wait) -> Wait:
        return a

    def mul(self, a: Wait, b: Wait) -> Wait:
        return None if None in (a, b) else self._after(a, b)

    def fma(self, a: Wait, b: Wait, c: Wait) -> Wait:
        return c if None in (a, b) else self._after(a, b, c)

    fnma = fma

    def _after(self, *values: Wait) -> Wait:
        moving = [value for value in values if isinstance(value, int)]
        return 1 + max(moving) if moving else ONE


def waits(n: int, solve: Solve) -> int:
    """Return how many operations in a row a solution for a right-hand side of `n` numbers is."""
    return max(value for value in solve(_Waits(), [0] * n) if isinstance(value, int))


class Solutions:
    """Solutions with one symmetric matrix, order after order.

    Parameters
    ----------
    code : Code
    solve : callable
        (code, right-hand side) -> solution: writes the operations on values that `code` has.
    """

    def __init__(self, code: Code, solve: Solve) -> None:
        self._code, self._solve = code, solve
        self._is_first = True
        self._inverse: Inverse | None = None

    def of(self, right: list[Value]) -> list[Value]:
        """Return the solution for a right-hand side."""
        if self._inverse is not None:
            return self._inverse.times(right)
        solution = self._solve(self._code, right)
        if self._is_first and not self._code.lanes and len(right) <= _LARGEST:
            if waits(len(right), self._solve) >= _LONG * len(right):
                self._inverse = Inverse(self._code, len(right), self._solve)
        self._is_first = False
        return solution


class Inverse:
    """The inverse of a symmetric matrix in the scratch array of a kernel.

    Parameters
    ----------
    code : Code
        Where what is known about the matrix is written already.
    n : int
        Its size.
    solve : callable
        As for `Solutions`.
    """

    def __init__(self, code: Code, n: int, solve: Solve) -> None:
        self.code, self.n = code, n
        self._row = -(-n // _COLUMNS) * _COLUMNS
        self._height = -(-n // _SUMS) * _SUMS
        self._matrix = code.reserve(self._height * self._row, _WIDTH)
        self._right = code.reserve(self._height)
        self._solution = code.reserve(self._row, _WIDTH)
        code.define(f"{code.symbol}.inverse", self._forming(solve))
        code.define(f"{code.symbol}.product", self._product())
        code.line(f"call void @{code.symbol}.inverse(ptr %scratch)")
        for i in range(n, self._height):
            code.store("scratch", self._right + i, constant(0.0))
        code.piece.operations += len(self._columns.piece.lines) * (self._row // _WIDTH)

    def times(self, right: list[Value]) -> list[Value]:
        """Return the product with a right-hand side."""
        code = self.code
        for i, value in enumerate(right):
            code.store("scratch", self._right + i, value)
        code.line(f"call void @{code.symbol}.product(ptr %scratch)")
        code.piece.operations += self.n * -(-self.n // _WIDTH)
        return [code.load("scratch", self._solution + i) for i in range(self.n)]

    def _forming(self, solve: Solve) -> str:
        """The function that forms the inverse, some columns at a time."""
        code = self._columns = _Columns(self.code)
        n, kind, table = self.n, code.number, f"{self.code.symbol}.unit"
        # The right-hand side of column c is 1 in row c: a one among zeros, which moves on from row to row.
        ones = [0.0] * (self._height + self._row)
        ones[self._height] = 1.0
        self.code.declare(number_table(table, ones))
        right = []
        for i in range(n):
            at = code.integer(f"add i64 %first, {self._height - i}")
            address = code.integer(f"getelementptr inbounds double, ptr @{table}, i64 {at}")
            right.append(code.value(f"load {kind}, ptr {address}, align 8"))
        zero = constant(0.0)
        solution = [zero if value is None else value for value in solve(code, right)]
        for i, value in enumerate([*solution, *[zero] * (self._height - n)]):
            at = code.integer(f"add i64 %first, {self._matrix + i * self._row}")
            address = code.integer(f"getelementptr inbounds double, ptr %scratch, i64 {at}")
            code.line(f"store {kind} {code.use(value)}, ptr {address}, align {8 * _WIDTH}")
        lines = "\n".join(code.piece.lines)
        self.code.take_declarations(code)
        return f"""define internal void @{self.code.symbol}.inverse(ptr noalias %scratch) noinline nounwind {{
entry:
br label %columns
columns:
%first = phi i64 [0, %entry], [%next, %columns]
{lines}
%next = add i64 %first, {_COLUMNS}
%more = icmp slt i64 %next, {n}
br i1 %more, label %columns, label %done
done:
ret void
}}
"""

    def _product(self) -> str:
        """The function that multiplies the inverse by the right-hand side."""
        code, kind = self.code, f"<{_WIDTH} x double>"
        fused = f"@llvm.fmuladd.v{_WIDTH}f64"
        code.declare(f"declare {kind} {fused}({kind}, {kind}, {kind})")
        lines = []
        vectors = range(0, self.n, _WIDTH)
        before = "entry"
        for start in range(0, len(vectors), _VECTORS):
            group = list(enumerate(vectors[start : start + _VECTORS]))
            sums = [(s, v, first) for s in range(_SUMS) for v, first in group]
            loop = f"rows{start}"
            lines += [f"br label %{loop}", f"{loop}:"]
            lines.append(f"%j{start} = phi i64 [0, %{before}], [%next{start}, %{loop}]")
            for s, v, _ in sums:
                name = f"%t{start}.{s}.{v}"
                lines.append(f"{name} = phi {kind} [zeroinitializer, %{before}], [{name}.n, %{loop}]")
            for s in range(_SUMS):
                r, row = f"%r{start}.{s}", f"%row{start}.{s}"
                lines += [
                    f"{row}.j = add i64 %j{start}, {s}",
                    f"{row}.r = add i64 {row}.j, {self._right}",
                    f"{r}.at = getelementptr inbounds double, ptr %scratch, i64 {row}.r",
                    f"{r}.one = load double, ptr {r}.at, align 8",
                    *splat(code, _WIDTH, f"{r}.one", r),
                    f"{row}.s = mul i64 {row}.j, {self._row}",
                ]
            for s, v, first in sums:
                name, row = f"%t{start}.{s}.{v}", f"%row{start}.{s}"
                lines += [
                    f"{name}.o = add i64 {row}.s, {self._matrix + first}",
                    f"{name}.a = getelementptr inbounds double, ptr %scratch, i64 {name}.o",
                    f"{name}.x = load {kind}, ptr {name}.a, align {8 * _WIDTH}",
                    f"{name}.n = call {kind} {fused}({kind} {name}.x, {kind} %r{start}.{s}, {kind} {name})",
                ]
            lines += [
                f"%next{start} = add i64 %j{start}, {_SUMS}",
                f"%more{start} = icmp slt i64 %next{start}, {self._height}",
                f"br i1 %more{start}, label %{loop}, label %after{start}",
                f"after{start}:",
            ]
            for v, first in group:
                to = f"%x{start}.{v}"
                lines += [
                    f"{to} = fadd {kind} %t{start}.0.{v}.n, %t{start}.1.{v}.n",
                    f"{to}.at = getelementptr inbounds double, ptr %scratch, i64 {self._solution + first}",
                    f"store {kind} {to}, ptr {to}.at, align {8 * _WIDTH}",
                ]
            before = f"after{start}"
        body = "\n".join(lines)
        head = f"define internal void @{code.symbol}.product(ptr noalias %scratch) noinline nounwind"
        return f"{head} {{\nentry:\n{body}\nret void\n}}\n"
