"""The kernel of a series: every order written out for small models, a loop over the orders for others.

Small models spend most of their time between the loops of a kernel that is short. In the loop over the orders products
of series stand side by side in SIMD lanes.
"""

from __future__ import annotations

from symgen.runtime.code.llvm_text import constant
from symgen.runtime.taylor.code import ONE, PASSED, Code, Value
from symgen.runtime.taylor.lanes import (
    LONGEST_LEAD,
    Lanes,
    LaneTable,
    fused,
    sum_function,
    values_text,
    vector,
)
from symgen.runtime.taylor.plan import Plan
from symgen.runtime.taylor.steps import FIRST_STEP, Steps

READ_LAST = """%order.at = load double, ptr %out, align 8
%order = fptosi double %order.at to i64
%last = sub i64 %order, 2"""


_ENDS = 2
FIRST_IN_LOOP = (
    3  # from here on the two oldest and the two newest coefficients of a factor are four different ones
)
_ANY = 1 << 20  # stands for the loop's order where orders are numbers
_FEW_PRODUCTS = 36
_FEWEST_SQUARES = 8
_LANES_TERM = 4  # operations for a term of a sum of lanes


class _Unrolled(Steps):
    def __init__(self, code: Code, plan: Plan, n_y: int, max_order: int, n_rows: int) -> None:
        super().__init__(code, plan, n_y, n_rows)
        self.table = LaneTable(code, plan, max_order + LONGEST_LEAD + 1, 1)
        self._rows: dict[tuple[int, tuple[int, ...], int], Value] = {}
        self._sums: dict[tuple[int, int], list[Value]] = {}

    def inner_sum(self, node: int, n: int, terms: list[int]) -> tuple[Value, list[int]]:
        item, lane = self.table.place[node]
        inner = [j for j in terms if _ENDS <= j <= n - _ENDS]
        if item.width == 1 or not inner:
            return super().inner_sum(node, n, terms)
        if (id(item), n) not in self._sums:
            self._sums[id(item), n] = self._summed(item, n, inner)
        return self._sums[id(item), n][lane], [j for j in terms if j not in inner]

    def _summed(self, item: Lanes, n: int, terms: list[int]) -> list[Value]:
        """The sums of all lanes, over the same terms."""
        code, kind, width = self.code, vector(item.width), item.width
        total: Value = None
        for j in terms:
            a, b = self._row(item.width, item.xs, j), self._row(item.width, item.ys, n - j)
            if a is None or b is None:
                continue
            if item.kind == "power":
                weights = values_text(item.width, [j * (e + 1.0) / n - 1.0 for e in item.exponents])
                a = code.vector(f"fmul {kind} {weights}, {code.use(a)}", kind, width)
            if total is None:
                total = code.vector(f"fmul {kind} {code.use(a)}, {code.use(b)}", kind, width)
            else:
                total = code.vector(
                    fused(code, width, code.use(a), code.use(b), code.use(total)), kind, width
                )
        if total is None:
            return [None] * len(item.nodes)
        return [
            code.value(f"extractelement {kind} {code.use(total)}, i32 {lane}")
            for lane in range(len(item.nodes))
        ]

    def _row(self, width: int, series: tuple[int, ...], j: int) -> Value:
        """Coefficients j of some series as a vector; None where all are zero."""
        if (width, series, j) not in self._rows:
            code, kind, total = self.code, vector(width), "zeroinitializer"
            parts = [self.at(node, j) for node in series]
            for lane, part in enumerate(parts):
                if part is not None:
                    total = code.vector(
                        f"insertelement {kind} {total}, double {code.use(part)}, i32 {lane}", kind, width
                    )
            self._rows[width, series, j] = None if total == "zeroinitializer" else total
        return self._rows[width, series, j]

    def finished(self, k: int) -> None:
        """Return from the kernel where this was the last order wanted."""
        if k >= 0:
            label = f"order{k}"
            self.code.line(f"%last{k} = icmp sle i64 %k, {k}")
            self.code.line(f"br i1 %last{k}, label %done, label %{label}")
            self.code.line(f"{label}:")


def unrolled_kernel(plan: Plan, symbol: str, n_y: int, max_order: int, n_rows: int) -> tuple[str, int]:
    """Return the LLVM IR of the kernel for all orders up to `max_order`, and its number of operations."""
    code = Code(symbol)
    code.begin_piece()
    steps = _Unrolled(code, plan, n_y, max_order, n_rows)
    written = {}
    for k in range(FIRST_STEP, max_order - 1):
        steps.step(k)
        written[k + 2] = float(code.written)
    main = [READ_LAST]
    for number, piece in enumerate(code.pieces):
        if piece.first_order is not None:
            main += [
                f"%go{number} = icmp sge i64 %last, {piece.first_order}",
                f"br i1 %go{number}, label %piece{number}, label %done",
                f"piece{number}:",
            ]
        main.append(f"call void @{piece.name}({PASSED}, i64 %last)")
    text = code.text("\n".join([*main, "br label %done", "done:", "ret void"]), _parabola(written, max_order))
    return text, code.operations


def _parabola(values: dict[int, float], last: int) -> tuple[float, float, float]:
    """Coefficients of the parabola through three of the values: the last one, and those at a third and two of it."""
    a, b, c = last // 3, 2 * last // 3, last
    first, second = (values[b] - values[a]) / (b - a), (values[c] - values[b]) / (c - b)
    square = (second - first) / (c - a)
    slope = first - square * (a + b)
    return values[a] - slope * a - square * a * a, slope, square


class _Rolled(Steps):
    def __init__(self, code: Code, plan: Plan, n_y: int, max_order: int, n_rows: int) -> None:
        super().__init__(code, plan, n_y, n_rows)
        self._length = max_order + LONGEST_LEAD + 1
        self.ends = 2 if len(plan.convolutions) < _FEW_PRODUCTS else 1
        self.reciprocals = code.reserve(self._length)
        self.history = {node: code.reserve(self._length) for node in sorted(plan.kept)}
        self.table = LaneTable(code, plan, self._length, _FEWEST_SQUARES)
        self._integers: dict[tuple[str, str], str] = {}

    def finished(self, k: int) -> None:
        """Keep the coefficients that later orders read."""
        for node in self.plan.order:
            n = k + self.plan.lead[node]
            if n < 0 or node not in self.plan.kept:
                continue
            self._breathe()
            value = self.values[node, n]
            self.code.store("scratch", self._row(self.history[node], 1, n), value)
            if n >= self.ends:
                for start, width, lane in self.table.uses.get(node, ()):
                    self.code.store("scratch", self._row(start + lane, width, n), value)

    def _row(self, start: int, width: int, n: int) -> int | str:
        """The place of row n of an array in scratch."""
        if n < _ANY // 2:
            return start + n * width
        return self._integer(f"{width} * k + {start + (n - _ANY) * width}")

    def _integer(self, formula: str) -> str:
        """The value of "factor * k + offset"."""
        key = (self.code.piece.name, formula)
        if key not in self._integers:
            factor, offset = formula.split(" * k + ")
            scaled = self.code.integer(f"mul i64 %k, {factor}")
            self._integers[key] = self.code.integer(f"add i64 {scaled}, {offset}")
        return self._integers[key]

    def at(self, node: int, n: int) -> Value:
        if n < _ANY // 2 or self.graph.is_constant(node) or (node, n) in self.values:
            return super().at(node, n)
        value = self.code.load("scratch", self._row(self.history[node], 1, n))
        self.values[node, n] = value
        return value

    def divided(self, value: Value, n: int, before: Value = None) -> Value:
        if n < _ANY // 2:
            return super().divided(value, n, before)
        return self.code.fma(value, self._reciprocal(n), before)

    def _reciprocal(self, n: int) -> str:
        if (-1, n) not in self.values:
            self.values[-1, n] = self.code.load("scratch", self._row(self.reciprocals, 1, n))
        return self.values[-1, n]

    def whole(self, n: int) -> str:
        if n < _ANY // 2:
            return super().whole(n)
        if (-2, n) not in self.values:
            integer = self._integer(f"1 * k + {n - _ANY}")
            self.values[-2, n] = self.code.value(f"sitofp i64 {integer} to double")
        return self.values[-2, n]

    def corrected(self, before: Value, change: Value, lead: int) -> Value:
        if self.k < _ANY // 2:
            return super().corrected(before, change, lead)
        if (-3, lead) not in self.values:
            value: Value = ONE
            for i in range(lead):
                value = self.code.mul(value, self._reciprocal(self.k + i + 1))
            self.values[-3, lead] = value
        return self.code.fma(change, self.values[-3, lead], before)

    def convolution(self, node: int, n: int) -> Value:
        if n < _ANY // 2:
            return super().convolution(node, n)
        total = self._sum(node)
        x, y = self.plan.factors(node)
        kind, code = self.graph.op[node], self.code
        if x == y:
            if self.ends == 2:
                total = code.fma(code.add(self.at(x, 1), self.at(x, 1)), self.at(x, n - 1), total)
            if kind == "mul":
                total = code.fma(code.add(self.at(x, 0), self.at(x, 0)), self.at(x, n), total)
            return total
        pairs = [(n, 0), *([(0, n)] if kind == "mul" else [])]
        pairs += [(1, n - 1), (n - 1, 1)] if self.ends == 2 else []
        for i, j in sorted(pairs, key=lambda pair: self._lateness(x, y, *pair)):
            total = code.fma(self.at(x, i), self.at(y, j), total)
        return total

    def _sum(self, node: int) -> Value:
        lanes, lane = self.table.place[node]
        return self.code.load("scratch", lanes.total + lane)

    def power_sum(self, node: int, n: int) -> Value:
        if n < _ANY // 2:
            return super().power_sum(node, n)
        (base,), (exponent, _), code = self.graph.args[node], self.graph.data[node], self.code
        total: Value = code.mul(self._sum(node), self._reciprocal(n))
        if self.ends == 2:
            step = code.mul(constant(exponent + 1.0), self._reciprocal(n))
            late = code.mul(code.sub(constant(exponent), step), self.at(base, n - 1))
            total = code.fma(late, self.at(node, 1), total)
            early = code.mul(code.sub(step, ONE), self.at(base, 1))
            total = code.fma(early, self.at(node, n - 1), total)
        return code.fma(code.mul(constant(exponent), self.initial(node)), self.at(base, n), total)

    def _lateness(self, x: int, y: int, i: int, j: int) -> int:
        """How long a product has to wait for its newer factor: those of the last step are there at once."""
        node, order = (x, i) if i >= _ANY // 2 else (y, j)
        return (
            self.plan.depth[node] if order == self.k + self.plan.lead[node] else int(node in self.plan.open)
        )

    def put(self, ahead: int, index: int, value: Value) -> None:
        if self.k < _ANY // 2:
            super().put(ahead, index, value)
        else:
            self.code.store("out", self._integer(f"{self.n_y} * k + {ahead * self.n_y + index}"), value)


def rolled_kernel(plan: Plan, symbol: str, n_y: int, max_order: int, n_rows: int) -> tuple[str, int]:
    """Return the LLVM IR of the kernel for all orders from 5 to `max_order`, and its number of operations."""
    code = Code(symbol)
    code.begin_piece()
    steps = _Rolled(code, plan, n_y, max_order, n_rows)
    for i in range(1, max_order + 1):
        code.store("scratch", steps.reciprocals + i, constant(1.0 / i))
    for k in range(FIRST_STEP, FIRST_IN_LOOP):
        steps.step(k)
    n_before, start = len(code.pieces), code.written
    code.begin_piece()
    steps.step(_ANY)
    each = code.written - start
    calls = [f"call void @{piece.name}({PASSED}, i64 0)" for piece in code.pieces[:n_before]]
    body = [f"call void @{piece.name}({PASSED}, i64 %k)" for piece in code.pieces[n_before:]]
    main = [
        READ_LAST,
        *calls,
        "br label %loop",
        "loop:",
        f"%k = phi i64 [{FIRST_IN_LOOP}, %entry], [%next, %step]",
        "%over = icmp sgt i64 %k, %last",
        "br i1 %over, label %done, label %step",
        "step:",
        f"call void @{symbol}.sums(ptr %scratch, i64 %k)",
        *body,
        "%next = add i64 %k, 1",
        "br label %loop",
        "done:",
        "ret void",
    ]
    sums = sum_function(code, steps.table.lanes, steps.ends, f"{symbol}.sums")
    costs = (max(start - (FIRST_IN_LOOP + 1) * each, 0.0), each, 0.5 * _LANES_TERM * len(steps.table.lanes))
    return code.text("\n".join(main), costs, sums), code.operations
