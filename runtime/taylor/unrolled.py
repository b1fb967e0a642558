"""The kernel with every order written out: for small models, which spend most of their time between the loops.

Products of series stand side by side in SIMD lanes. A vector of coefficients is put together when it is first read; the
two oldest and the two newest coefficients stay out of vectors, so that nothing waits for one.
"""

from __future__ import annotations

from symgen.runtime.taylor.code import PASSED, Code, Value
from symgen.runtime.taylor.lanes import LONGEST_LEAD, Lanes, LaneTable, fused, values_text, vector
from symgen.runtime.taylor.plan import Plan
from symgen.runtime.taylor.steps import FIRST_STEP, Steps

READ_LAST = """%order.at = load double, ptr %out, align 8
%order = fptosi double %order.at to i64
%last = sub i64 %order, 2"""


_ENDS = 2


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
