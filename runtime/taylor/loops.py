"""The kernel of a series: every order written out for small models, a loop over the orders for others.

Small models spend most of their time between the loops of a kernel that is short. In the loop over the orders products
of series stand side by side in SIMD lanes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from symgen.runtime.code.llvm_text import constant, number_table
from symgen.runtime.taylor.code import (
    ONE,
    PASSED,
    Code,
    Piece,
    Registers,
    Value,
    fused,
    load_row,
    splat,
    values_text,
)
from symgen.runtime.taylor.pairs import Lanes, PairedSums
from symgen.runtime.taylor.plan import Plan
from symgen.runtime.taylor.steps import FIRST_STEP, Steps

# Lanes whose factors are the same series in the same order share their arrays of coefficients: fewer stores and loads,
# and more models whose coefficients fit into the first-level cache.

LONGEST_LEAD = 2
_WIDEST = 8
# Where there are fewer products than this, registers of half the width are faster.
_MANY_PRODUCTS = 200
_ACCUMULATORS = 12
_SMALL_ROUND = 4


class LaneTable:
    """All lanes of a kernel.

    Parameters
    ----------
    length : int
        Rows of an array of coefficients.
    widest : int
        Lanes of the widest vector.
    known : mapping of series to int, optional
        Arrays that there are already, and that are filled elsewhere.
    fewest_squares : int
        From how many on squares are summed apart from products, over half the terms. A loop costs a wrong guess of
        the processor at its end.

    Attributes
    ----------
    lanes : list of Lanes
    place : dict of node to (Lanes, int)
        The lane that sums a product.
    uses : dict of series to list of (start, width, lane)
        Where its coefficients have to be stored.
    """

    def __init__(
        self, code: Code, plan: Plan, length: int, widest: int, fewest_squares: int,
        known: Mapping[int, int] | None = None,
    ) -> None:  # fmt: skip
        self.code, self.plan, self.length, self.widest = code, plan, length, widest
        self.fewest_squares = fewest_squares
        self.lanes: list[Lanes] = []
        self.uses: dict[int, list[tuple[int, int, int]]] = {}
        self._arrays: dict[tuple[int, tuple[int, ...]], int] = {
            (1, (node,)): start for node, start in (known or {}).items()
        }
        for lead in range(LONGEST_LEAD + 1):
            self._place([node for node in plan.convolutions if plan.lead[node] == lead], lead)
        self.place = {node: (item, i) for item in self.lanes for i, node in enumerate(item.nodes)}

    def _place(self, nodes: list[int], lead: int) -> None:
        factors, kinds = {node: self.plan.factors(node) for node in nodes}, self.plan.graph.op
        powers = {factors[node]: node for node in nodes if kinds[node] == "power"}
        squares = {factors[node]: node for node in nodes if len(set(factors[node])) == 1}
        if len(squares) < self.fewest_squares:
            squares = {}
        products = [node for node in nodes if node not in {*powers.values(), *squares.values()}]
        if self.code.lanes:  # members of an ensemble stand side by side, products behind each other
            for node in products:
                self._add("product", lead, (node,), [factors[node]])
            for kind, group in (("power", powers), ("square", squares)):
                for pair, node in group.items():
                    self._add(kind, lead, (node,), [pair])
            return
        for chunk in _rounds(products, factors, self.widest):
            pairs = [pair for _, pair in chunk]
            self._add("product", lead, tuple(node for node, _ in chunk), pairs)
        for kind, group in (("power", powers), ("square", squares)):
            for pairs in self._following_arrays(list(group)):
                self._add(kind, lead, tuple(group[pair] for pair in pairs), pairs)

    def _following_arrays(self, pairs: list[tuple[int, int]]) -> Iterator[list[tuple[int, int]]]:
        """Chunks of pairs whose second factors stand in an array already, as it has them; then the rest."""
        by_second = {pair[1]: pair for pair in pairs}
        for _, array in list(self._arrays):
            if len(set(array)) == len(array) and all(node in by_second for node in array):
                yield [by_second.pop(node) for node in array]
        yield from _chunks([pair for pair in pairs if pair[1] in by_second], self.widest)

    def _add(self, kind: str, lead: int, nodes: tuple[int, ...], pairs: list[tuple[int, int]]) -> None:
        width = _width(len(pairs), self.widest)
        xs, ys = zip(*pairs, strict=True)
        x, y = self._array(width, xs), self._array(width, ys)
        data = self.plan.graph.data
        exponents = tuple(data[node][0] for node in nodes) if kind == "power" else ()
        total = self.code.reserve(width, 8)
        self.lanes.append(Lanes(kind, width, lead, nodes, xs, ys, x, y, total, exponents))

    def _array(self, width: int, series: tuple[int, ...]) -> int:
        """Where coefficient 0 of these series begins, side by side."""
        if (width, series) not in self._arrays:
            start = self._arrays[width, series] = self.code.reserve(self.length * width, 8)
            # What happens to stand in memory may be a subnormal number, which slows a whole vector down.
            filled = series + series[-1:] * (width - len(series))
            for lane, node in enumerate(filled):
                self.uses.setdefault(node, []).append((start, width, lane))
        return self._arrays[width, series]


def _width(n: int, widest: int) -> int:
    """The width of the vector for `n` products, some of whose lanes may stay empty."""
    width = widest
    while 2 * n <= width:
        width //= 2
    return width


def _chunks(items: list, widest: int) -> Iterator[list]:
    while items:
        width = _width(len(items), widest)
        yield items[:width]
        items = items[width:]


def _rounds(products: list[int], factors: dict[int, tuple[int, int]], widest: int) -> Iterator[list]:
    """Chunks of (product, its factors): the factors used most come first, each of them once a round."""
    uses = Counter(factor for node in products for factor in factors[node])
    rounds: list[list] = []
    seen: Counter = Counter()
    for node in products:
        pair = tuple(sorted(factors[node], key=lambda factor: (-uses[factor], factor)))
        if seen[pair[0]] == len(rounds):
            rounds.append([])
        rounds[seen[pair[0]]].append((node, pair))
        seen[pair[0]] += 1
    rest: list = []
    for items in rounds:
        items.sort(key=lambda item: item[1])
        if len(items) >= _SMALL_ROUND:
            yield from _chunks(items, widest)
        else:
            rest += items
    yield from _chunks(rest, widest)


def sum_function(code: Code, lanes: list[Lanes], ends: int, name: str, before: Sequence[str] = ()) -> str:
    """The function that sums the products x_j y_{n-j}, j from `ends` to n - `ends`, of all lanes, after `before`."""
    lines = [
        f"define internal void @{name}(ptr noalias %scratch, i64 %k) {code.calling} nounwind {{",
        "entry:",
        *before,
        "br label %rest",
        "rest:",
    ]
    label = "rest"
    for lead in range(LONGEST_LEAD + 1):
        for symmetric in (False, True):
            group = [item for item in lanes if item.lead == lead and (item.kind == "square") == symmetric]
            most = min(_ACCUMULATORS, code.registers // 2)
            for first in range(0, len(group), most):
                part = group[first : first + most]
                loop = _SumLoop(code, part, lead, ends, f"{lead}.{int(symmetric)}.{first}")
                lines += loop.text(label)
                label = loop.after
    return "\n".join([*lines, "ret void", "}", ""])


def first_of_loop(code: Code, ends: int) -> int:
    """The first term that the loop over a sum's terms adds; those before and their mirror images follow at its end.

    They have the newest coefficients, each of which has just been stored: before all numbers of a vector have left
    the processor's store buffer it cannot be loaded, and all terms behind it would wait.
    """
    return ends + 1 if ends == 1 and not code.lanes else ends


class _SumLoop:
    """A loop over the terms of several lanes of one lead; of squares, x_j x_{n-j} for j below n / 2 only."""

    def __init__(self, code: Code, group: list[Lanes], lead: int, ends: int, tag: str) -> None:
        self.code, self.group, self.lead, self.ends, self.tag = code, group, lead, ends, tag
        self.symmetric = group[0].kind == "square"
        self.after = f"after{tag}"
        self._loaded: dict[tuple[int, str], str] = {}
        self.first = first_of_loop(code, ends)
        kinds = dict.fromkeys((item.width, item.exponents) for item in group if item.kind == "power")
        self._weights = {kind: f"{tag}.e{i}" for i, kind in enumerate(kinds)}

    def text(self, before: str) -> list[str]:
        tag, ends = self.tag, self.ends
        last = f"ashr i64 %below{tag}, 1" if self.symmetric else f"sub i64 %n{tag}, {self.first}"
        lines = [
            f"%n{tag} = add i64 %k, {self.lead}",
            f"%below{tag} = sub i64 %n{tag}, 1",
            f"%top{tag} = {last}",
            *self._first_weights(),
            f"br label %head{tag}",
            f"head{tag}:",
            f"%j{tag} = phi i64 [{self.first}, %{before}], [%next{tag}, %body{tag}]",
        ]
        for i, item in enumerate(self.group):
            kind, t = self.code.vector_type(item.width), f"{tag}.{i}"
            zero = "zeroinitializer" if item.width > 1 or self.code.lanes else constant(0.0)
            lines.append(f"%sum{t} = phi {kind} [{zero}, %{before}], [%more{t}, %body{tag}]")
        lines += [
            f"%w{t} = phi {self.code.vector_type(width)} [%first{t}, %{before}], [%wnext{t}, %body{tag}]"
            for (width, _), t in self._weights.items()
        ]
        lines += [
            f"%over{tag} = icmp sgt i64 %j{tag}, %top{tag}",
            f"br i1 %over{tag}, label %{self.after}, label %body{tag}",
            f"body{tag}:",
            f"%m{tag} = sub i64 %n{tag}, %j{tag}",
        ]
        for (width, exponents), t in self._weights.items():
            step = values_text(self.code, width, [e + 1.0 for e in exponents])
            lines.append(f"%wnext{t} = fadd {self.code.vector_type(width)} %w{t}, {step}")
        for i, item in enumerate(self.group):
            lines += self._term(item, f"{tag}.{i}")
        lines += [f"%next{tag} = add i64 %j{tag}, 1", f"br label %head{tag}", f"{self.after}:"]
        if self.first > ends:
            lines += [f"%early{tag} = add i64 {ends}, 0", f"%late{tag} = sub i64 %n{tag}, {ends}"]
        if self.symmetric:
            lines += [
                f"%half{tag} = ashr i64 %n{tag}, 1",
                f"%bit{tag} = trunc i64 %n{tag} to i1",
                f"%once{tag} = select i1 %bit{tag}, double {constant(0.0)}, double {constant(1.0)}",
                # Of an odd order, any place that holds a number.
                f"%h{tag} = select i1 %bit{tag}, i64 {ends}, i64 %half{tag}",
            ]
        for i, item in enumerate(self.group):
            lines += self._store(item, f"{tag}.{i}")
        return lines

    def _first_weights(self) -> list[str]:
        lines = [f"%order{self.tag} = sitofp i64 %n{self.tag} to double"]
        for (width, exponents), t in self._weights.items():
            kind = self.code.vector_type(width)
            lines += splat(self.code, width, f"%order{self.tag}", f"%from{t}")
            for word, j in (("first", self.first), ("early.w", self.ends)):
                factors = values_text(self.code, width, [j * (e + 1.0) for e in exponents])
                lines.append(f"%{word}{t} = fsub {kind} {factors}, %from{t}")
        return lines if self._weights else []

    def _load(self, item: Lanes, start: int, index: str, lines: list[str]) -> str:
        """A vector of coefficients at one of the loop's indexes."""
        if (start, index) not in self._loaded:
            name = self._loaded[start, index] = f"%{index}{self.tag}.at{start}"
            lines += load_row(self.code, item.width, start, f"%{index}{self.tag}", name)
        return self._loaded[start, index]

    def _term(self, item: Lanes, t: str) -> list[str]:
        kind, lines = self.code.vector_type(item.width), []
        x, y = self._load(item, item.x, "j", lines), self._load(item, item.y, "m", lines)
        if item.kind == "power":
            weight = self._weights[item.width, item.exponents]
            lines.append(f"%weighted{t} = fmul {kind} %w{weight}, {x}")
            x = f"%weighted{t}"
        lines.append(f"%more{t} = {fused(self.code, item.width, x, y, f'%sum{t}')}")
        return lines

    def _newest_terms(self, item: Lanes, t: str, lines: list[str]) -> str:
        """The sum with the terms that the loop leaves out."""
        kind, total = self.code.vector_type(item.width), f"%sum{t}"
        for word, other in (("early", "late"), *((("late", "early"),) if not self.symmetric else ())):
            x, y = self._load(item, item.x, word, lines), self._load(item, item.y, other, lines)
            if item.kind == "power":
                weight = self._weights[item.width, item.exponents]
                # Behind the loop its weight is that of the next term, which is the late one.
                known = f"%w{weight}" if word == "late" else f"%early.w{weight}"
                lines.append(f"%{word}{t} = fmul {kind} {known}, {x}")
                x = f"%{word}{t}"
            lines.append(f"%{word}.more{t} = {fused(self.code, item.width, x, y, total)}")
            total = f"%{word}.more{t}"
        return total

    def _store(self, item: Lanes, t: str) -> list[str]:
        kind, lines, total = self.code.vector_type(item.width), [], f"%sum{t}"
        if self.first > self.ends:
            total = self._newest_terms(item, t, lines)
        if self.symmetric:
            middle = self._load(item, item.x, "h", lines)
            lines += splat(self.code, item.width, f"%once{self.tag}", f"%times{t}")
            lines += [
                f"%one{t} = fmul {kind} {middle}, %times{t}",
                f"%twice{t} = fadd {kind} {total}, {total}",
                f"%all{t} = {fused(self.code, item.width, f'%one{t}', middle, f'%twice{t}')}",
            ]
            total = f"%all{t}"
        return [
            *lines,
            f"%to{t} = getelementptr inbounds {self.code.number}, ptr %scratch, i64 {item.total}",
            f"store {kind} {total}, ptr %to{t}, align {self.code.align * item.width}",
        ]


READ_LAST = """%order.at = load double, ptr %out, align 8
%order = fptosi double %order.at to i64
%last = sub i64 %order, 2"""


# From here on the two oldest and the two newest coefficients of a factor are four different ones.
FIRST_IN_LOOP = 3
_ANY = 1 << 20  # stands for the loop's order where orders are numbers
_FEW_PRODUCTS = 36
_FEWEST_SQUARES = 8
_MOST_WRITTEN_OUT = 2000  # operations, loads and stores
_LANES_TERM = 4  # operations for a term of a sum of lanes


def ends_apart(plan: Plan) -> int:
    """Return how many terms at either end of a sum are added by themselves, in place of in the lanes of a vector.

    The newest coefficients come last. Where few products wait for each other, or all for a solution that waits for
    them, two by themselves make the wait shorter; where there is much else to do meanwhile, vectors are faster.
    """
    n, waits = len(plan.convolutions), max(plan.depth.values(), default=0)
    return 1 if n >= _FEW_PRODUCTS or (n > waits and not plan.motion.unknowns) else 2


class _Unrolled(Steps):
    def __init__(self, code: Code, plan: Plan, n_y: int, max_order: int, n_rows: int) -> None:
        super().__init__(code, plan, n_y, n_rows)
        self.ends = ends_apart(plan)
        self.table = LaneTable(code, plan, max_order + LONGEST_LEAD + 1, _WIDEST, 1)
        self._rows: dict[tuple[int, tuple[int, ...], int], Value] = {}
        self._sums: dict[tuple[int, int], list[Value]] = {}

    def inner_sum(self, node: int, n: int, terms: list[int]) -> tuple[Value, list[int]]:
        item, lane = self.table.place[node]
        inner = [j for j in terms if self.ends <= j <= n - self.ends]
        if item.width == 1 or not inner:
            return super().inner_sum(node, n, terms)
        if (id(item), n) not in self._sums:
            self._sums[id(item), n] = self._summed(item, n, inner)
        return self._sums[id(item), n][lane], [j for j in terms if j not in inner]

    def _summed(self, item: Lanes, n: int, terms: list[int]) -> list[Value]:
        """The sums of all lanes, over the same terms: every other one apart, so that they wait less for each other."""
        code, kind, width = self.code, self.code.vector_type(item.width), item.width
        halves: list[Value] = [None, None]
        for i, j in enumerate(terms):
            a, b = self._row(item.width, item.xs, j), self._row(item.width, item.ys, n - j)
            if a is None or b is None:
                continue
            if item.kind == "power":
                weights = values_text(
                    self.code, item.width, [j * (e + 1.0) / n - 1.0 for e in item.exponents]
                )
                a = code.vector(f"fmul {kind} {weights}, {code.use(a)}", kind, width)
            half = halves[i % 2]
            if half is None:
                text = f"fmul {kind} {code.use(a)}, {code.use(b)}"
            else:
                text = fused(code, width, code.use(a), code.use(b), code.use(half))
            halves[i % 2] = code.vector(text, kind, width)
        parts = [half for half in halves if half is not None]
        if not parts:
            return [None] * len(item.nodes)
        total = parts[0]
        if len(parts) == 2:
            total = code.vector(f"fadd {kind} {code.use(total)}, {code.use(parts[1])}", kind, width)
        return [
            code.value(f"extractelement {kind} {code.use(total)}, i32 {lane}")
            for lane in range(len(item.nodes))
        ]

    def _row(self, width: int, series: tuple[int, ...], j: int) -> Value:
        """Coefficients j of some series as a vector; None where all are zero."""
        if (width, series, j) not in self._rows:
            code, kind, total = self.code, self.code.vector_type(width), "zeroinitializer"
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
            return_after(self.code, k)


def return_after(code: Code, k: int) -> None:
    """Return from a piece where this was the last order wanted."""
    code.line(f"%last{k} = icmp sle i64 %k, {k}")
    code.line(f"br i1 %last{k}, label %done, label %order{k}")
    code.line(f"order{k}:")


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
        self.ends = ends_apart(plan)
        self.reciprocals = 0 if code.lanes else code.reserve(self._length)
        # Of each series: where it is kept to be read by itself.
        self._history: dict[int, tuple[int, int, int]] = {}
        if code.lanes:
            own = {node: code.reserve(self._length) for node in sorted(plan.kept)}
            self.table = LaneTable(code, plan, self._length, 1, 1, own)
        else:
            self.table = LaneTable(code, plan, self._length, self._widest, _FEWEST_SQUARES)
            self._history = {node: places.pop() for node, places in self.table.uses.items()}
            unused = sorted(plan.kept - self._history.keys())
            own = {node: code.reserve(self._length) for node in unused}
        self._history |= {node: (start, 1, 0) for node, start in own.items()}
        self._settled: set[tuple[int, int]] = set()

    @property
    def _widest(self) -> int:
        return _WIDEST if len(self.plan.convolutions) >= _MANY_PRODUCTS else _WIDEST // 2

    def settled(self, node: int) -> None:
        """Keep a coefficient at once: registers are short where each holds that of several members."""
        if self.code.lanes and node in self.plan.kept:
            self._keep(node, self.k + self.plan.lead[node])

    @property
    def _is_first(self) -> bool:
        """Whether the step comes before those of the loop."""
        return self.k < FIRST_IN_LOOP

    def finished(self, k: int) -> None:
        """Keep the coefficients that later orders read."""
        for node in self.plan.order:
            n = k + self.plan.lead[node]
            if n >= 0 and node in self.plan.kept and (node, n) not in self._settled:
                self._breathe()
                self._keep(node, n)

    def _keep(self, node: int, n: int) -> None:
        self._settled.add((node, n))
        value = self.values[node, n]
        self.code.keep(self._place(node, n), value)
        if n >= self.ends:
            for start, width, lane in self.table.uses.get(node, ()):
                self.code.keep(self._row(start + lane, width, n), value)

    def _place(self, node: int, n: int) -> int | str:
        """Where coefficient n of a series is kept."""
        start, width, lane = self._history[node]
        return self._row(start + lane, width, n)

    def _row(self, start: int, width: int, n: int) -> int | str:
        """The place of row n of an array in scratch."""
        if n < _ANY // 2:
            return start + n * width
        return f"{width} * k + {start + (n - _ANY) * width}"

    def at(self, node: int, n: int) -> Value:
        if n < _ANY // 2 or self.graph.is_constant(node) or (node, n) in self.values:
            return super().at(node, n)
        value = self.code.load("scratch", self.code.index(self._place(node, n)))
        self.values[node, n] = value
        return value

    def divided(self, value: Value, n: int, before: Value = None) -> Value:
        if self._is_first:
            return super().divided(value, n, before)
        return self.code.fma(value, self._reciprocal(n), before)

    def _reciprocal(self, n: int) -> str:
        if (-1, n) not in self.values:
            row = self.code.index(self._row(self.reciprocals, 1, n))
            self.values[-1, n] = (
                self.code.in_all_lanes(f"{self.code.symbol}.reciprocals", row)
                if self.code.lanes
                else self.code.load("scratch", row)
            )
        return self.values[-1, n]

    def whole(self, n: int) -> str:
        if n < _ANY // 2:
            return super().whole(n)
        if (-2, n) not in self.values:
            integer = self.code.index(f"1 * k + {n - _ANY}")
            self.values[-2, n] = self._as_number(integer)
        return self.values[-2, n]

    def _as_number(self, integer: str) -> str:
        if not self.code.lanes:
            return self.code.value(f"sitofp i64 {integer} to double")
        plain, to = self.code.integer(f"sitofp i64 {integer} to double"), self.code.name()
        first, last = splat(self.code, 1, plain, to)
        self.code.line(first)
        return self.code.value(last.partition(" = ")[2])

    def corrected(self, before: Value, change: Value, lead: int) -> Value:
        if self._is_first:
            return super().corrected(before, change, lead)
        key = (-3 - lead, self.k)
        if key not in self.values:
            value: Value = ONE
            for i in range(lead):
                value = self.code.mul(value, self._reciprocal(self.k + i + 1))
            self.values[key] = value
        return self.code.fma(change, self.values[key], before)

    def convolution(self, node: int, n: int) -> Value:
        if self._is_first:
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
        if self._is_first:
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
        node, order = (x, i) if i > j else (y, j)
        return (
            self.plan.depth[node] if order == self.k + self.plan.lead[node] else int(node in self.plan.open)
        )

    def put(self, ahead: int, index: int, value: Value) -> None:
        if self.k < _ANY // 2:
            super().put(ahead, index, value)
        else:
            self.code.store("out", self.code.index(f"{self.n_y} * k + {ahead * self.n_y + index}"), value)


class _WrittenOut(_Rolled):
    """The steps of the loop one by one, with its operations: nothing is stored to be loaded by a later order."""

    def __init__(self, code: Code, plan: Plan, n_y: int, max_order: int, n_rows: int) -> None:
        super().__init__(code, plan, n_y, max_order, n_rows)
        self._totals: dict[tuple[int, int], str] = {}
        self._vectors: dict[tuple[int, tuple[int, ...], int], str] = {}

    def _breathe(self) -> None:
        if self._is_first:
            super()._breathe()

    def _keep(self, node: int, n: int) -> None:
        value = self.values[node, n]
        if value is not None:
            self.code.rounded.add(value)
        if self._is_first:
            # Pieces end where those end that store: what crosses from one to the next is rounded.
            self.code.use(constant(0.0) if value is None else value)
            self.code.piece.operations += 1 + (len(self.table.uses.get(node, ())) if n >= self.ends else 0)

    def finished(self, k: int) -> None:
        super().finished(k)
        if k >= FIRST_IN_LOOP:
            return_after(self.code, k)

    def _reciprocal(self, n: int) -> str:
        return constant(1.0 / n)

    def _sum(self, node: int) -> Value:
        lanes, lane = self.table.place[node]
        key = (id(lanes), self.k)
        if key not in self._totals:
            self._totals[key] = self._sum_of(lanes, self.k + lanes.lead)
        total = self._totals[key]
        if lanes.width == 1:
            return total
        return self.code.value(f"extractelement {self.code.vector_type(lanes.width)} {total}, i32 {lane}")

    def _sum_of(self, item: Lanes, n: int) -> Value:
        """The sum of the products of lanes in an order that is written out, to the bits of `_SumLoop`."""
        code, kind, width, ends = self.code, self.code.vector_type(item.width), item.width, self.ends
        symmetric = item.kind == "square"
        total = "zeroinitializer" if width > 1 else constant(0.0)
        first = first_of_loop(code, ends)
        weights = [first * (e + 1.0) - n for e in item.exponents]
        for j in range(first, ((n - 1) // 2 if symmetric else n - first) + 1):
            total = self._with_term(item, n, j, weights, total)
            weights = [w + (e + 1.0) for w, e in zip(weights, item.exponents)]
        if first > ends:
            total = self._with_term(item, n, ends, [ends * (e + 1.0) - n for e in item.exponents], total)
            if not symmetric:
                total = self._with_term(item, n, n - ends, weights, total)
        if not symmetric:
            return total
        twice = code.vector(f"fadd {kind} {total}, {total}", kind, width)
        if n % 2:
            return twice
        middle = self._vector(width, item.xs, n // 2)
        return code.vector(fused(code, width, middle, middle, twice), kind, width)

    def _with_term(self, item: Lanes, n: int, j: int, weights: list[float], total: str) -> str:
        code, width = self.code, item.width
        kind = code.vector_type(width)
        x, y = self._vector(width, item.xs, j), self._vector(width, item.ys, n - j)
        if weights:
            x = code.vector(f"fmul {kind} {values_text(code, width, weights)}, {x}", kind, width)
        return code.vector(fused(code, width, x, y, total), kind, width)

    def _vector(self, width: int, series: tuple[int, ...], j: int) -> str:
        """Coefficients j of some series side by side."""
        key = (width, series, j)
        if key not in self._vectors:
            code, kind = self.code, self.code.vector_type(width)
            parts = [self.at(node, j) for node in series]
            if width == 1:
                self._vectors[key] = constant(0.0) if parts[0] is None else code.use(parts[0])
            else:
                total = "zeroinitializer"
                for lane, part in enumerate(parts):
                    if part is not None:
                        total = code.vector(
                            f"insertelement {kind} {total}, double {code.use(part)}, i32 {lane}", kind, width
                        )
                self._vectors[key] = total
        return self._vectors[key]


def rolled_kernel(
    plan: Plan, symbol: str, n_y: int, max_order: int, n_rows: int, lanes: int = 0,
    registers: Registers | None = None,
) -> tuple[str, int]:  # fmt: skip
    """Return the LLVM IR of the kernel for all orders from 5 to `max_order`, and its number of operations.

    With `lanes`, it is for so many members of an ensemble, of which it computes those together that `registers` hold:
    all of them by default.
    """
    code = Code(symbol, lanes, registers)
    code.begin_piece()
    steps = _Rolled(code, plan, n_y, max_order, n_rows)
    reciprocals = [1.0 / max(i, 1) for i in range(max_order + LONGEST_LEAD + 1)]
    if lanes:
        code.declare(number_table(f"{symbol}.reciprocals", reciprocals))
    else:
        for i in range(1, max_order + 1):
            code.store("scratch", steps.reciprocals + i, constant(reciprocals[i]))
    for k in range(FIRST_STEP, FIRST_IN_LOOP):
        steps.step(k)
    n_before, start = len(code.pieces), code.written
    code.begin_piece()
    steps.step(_ANY)
    each = code.written - start
    calls = [f"call void @{piece.name}({code.passed}, i64 0)" for piece in code.pieces[:n_before]]
    if lanes:
        sums, main = _paired(code, steps, calls, code.pieces[n_before:])
        costs = (
            max(start - (FIRST_IN_LOOP + 1) * each, 0.0),
            each,
            0.5 * _LANES_TERM * len(steps.table.lanes),
        )
        return code.text(main, costs, sums), code.operations
    body = [f"call void @{piece.name}({code.passed}, i64 %k)" for piece in code.pieces[n_before:]]
    is_small = code.calling == "alwaysinline" and len(body) == 1
    few = _orders_written_out(steps, each, max_order) if is_small else 0
    main = [
        READ_LAST,
        *(_call_of_few(symbol, few) if few else ["br label %start"]),
        "start:",
        *calls,
        "br label %loop",
        "loop:",
        f"%k = phi i64 [{FIRST_IN_LOOP}, %start], [%next, %step]",
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
    text = code.text("\n".join(main), costs, sums)
    if not few:
        return text, code.operations
    written, operations = _written_out(plan, _few(symbol), n_y, few, n_rows)
    return _joined(written, text), code.operations + operations


def _orders_written_out(steps: _Rolled, each: int, max_order: int) -> int:
    """Up to which order of the series, if any, all orders written out are faster than the loop over them."""
    operations = 0.0
    for k in range(FIRST_IN_LOOP, max_order - 1):
        terms = sum(
            max(k + item.lead + 1 - 2 * steps.ends, 0) * item.width / _WIDEST for item in steps.table.lanes
        )
        operations += each + terms
        if operations > _MOST_WRITTEN_OUT:
            return k + 1 if k > FIRST_IN_LOOP else 0
    return max_order


def _few(symbol: str) -> str:
    """The kernel for few orders."""
    return f"{symbol}.few"


def _call_of_few(symbol: str, few: int) -> list[str]:
    """Leave series up to order `few` to the kernel in which they are written out."""
    return [
        f"%few = icmp sle i64 %order, {few}",
        "br i1 %few, label %written, label %start",
        "written:",
        f"call void @{_few(symbol)}(double %t, ptr %y, ptr %p, ptr %out)",
        "ret void",
    ]


def _joined(first: str, second: str) -> str:
    """Two modules as one: what both declare is declared once."""
    declared = {line for line in first.splitlines() if line.startswith("declare ")}
    return first + "\n".join(line for line in second.splitlines() if line not in declared)


def _written_out(plan: Plan, symbol: str, n_y: int, last_order: int, n_rows: int) -> tuple[str, int]:
    """`rolled_kernel` with an operation for each of those that the loop carries out, in its order.

    Which products LLVM makes one operation of with a sum is the same in all models tried but one (the quarter car).
    Nothing is stored to be loaded by a later order, which is most of the time of a short series. Long ones leave the
    registers and the cache of decoded instructions.
    """
    code = Code(symbol, is_one_function=True)
    code.begin_piece()
    steps = _WrittenOut(code, plan, n_y, last_order, n_rows)
    code.piece.operations += last_order  # the loop's form stores reciprocals here
    for k in range(FIRST_STEP, FIRST_IN_LOOP):
        steps.step(k)
    code.begin_piece()
    for k in range(FIRST_IN_LOOP, last_order - 1):
        steps.step(k)
    main = [
        READ_LAST,
        *(f"call void @{piece.name}({PASSED}, i64 %last)" for piece in code.pieces),
        "ret void",
    ]
    return code.text("\n".join(main), (0.0, 0.0, 0.0)), code.operations


def _paired(code: Code, steps: _Rolled, calls: list[str], pieces: list[Piece]) -> tuple[str, str]:
    """The functions that sum products, and the kernel's own body, two orders in each pass of its loop."""
    products = [item for item in steps.table.lanes if item.kind == "product"]
    others = [item for item in steps.table.lanes if item.kind != "product"]
    paired, symbol = PairedSums(code, products, steps.ends), code.symbol
    functions = []
    for word, own in (("first", paired.first()), ("second", paired.second())):
        functions.append(sum_function(code, others, steps.ends, f"{symbol}.{word}", own))

    def order(k: str, word: str) -> list[str]:
        return [
            f"call void @{symbol}.{word}(ptr %scratch, i64 {k})",
            *(f"call void @{piece.name}({code.passed}, i64 {k})" for piece in pieces),
        ]

    first = FIRST_IN_LOOP
    main = [
        READ_LAST, *calls,
        f"%none = icmp sgt i64 {first}, %last", "br i1 %none, label %done, label %single", "single:",
        *order(str(first), "first"),
        "br label %loop", "loop:",
        f"%k = phi i64 [{first + 1}, %single], [%next, %two]",
        "%over = icmp sgt i64 %k, %last", "br i1 %over, label %done, label %one", "one:",
        *order("%k", "first"),
        "%k1 = add i64 %k, 1",
        "%end = icmp sgt i64 %k1, %last", "br i1 %end, label %done, label %two", "two:",
        *order("%k1", "second"),
        "%next = add i64 %k, 2",
        "br label %loop", "done:", "ret void",
    ]  # fmt: skip
    return "".join(functions), "\n".join(main)
