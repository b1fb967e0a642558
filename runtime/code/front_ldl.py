"""Sparse LDLᵀ solves of generated functions by fronts: as Python, as it stands in generated modules, and as LLVM IR.

A table describes the elimination (see `check`). Both forms do the same operations on each number in the same order,
so their results agree to the bit. The IR has straight-line code for each kind of small front that the table has.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from symgen.runtime.code.dense_ldl import BLOCK, Writer, subtract_rows
from symgen.runtime.graph.form import OUT, Name, Solve, Statement, Write

FACTOR_FORWARD, BACKWARD = "factor_and_forward", "backward"
SOLVERS = {"factor_fronts": 1, "solve_fronts": 2}  # and how many arrays their calls begin with
LARGEST_WRITTEN_OUT = 8  # rows of a front
RECORD = 6  # numbers of a front's record before its rows


def factor_fronts(a, s, n):
    """Factorise a sparse symmetric matrix by n fronts: U^T D of the rows that each eliminates, 1/d on the diagonal.

    s begins with the place of each front's record: place in a, rows, how many of these it eliminates, place and rows
    of the front that takes what is left, how many times its pivots count, the number of each row, and the rows that
    what is left has there. Behind each front, a has the diagonal of its pivots as it was; behind all, it gets the
    smallest pivot relative to that.
    """
    ratio = 1.0
    end = 0
    for k in range(n):
        r = s[k]
        f = s[r]
        size = s[r + 1]
        pivots = s[r + 2]
        for p in range(pivots):
            row = f + p * size
            q = s[r + 5] * (a[row + p] / a[f + size * size + p])
            if q < ratio or q != q:
                ratio = q
            d = 1.0 / a[row + p]
            a[row + p] = d
            for i in range(p + 1, size):
                c = d * a[row + i]
                for j in range(i, size):
                    a[f + i * size + j] = a[f + i * size + j] - c * a[row + j]
        m = r + 6 + size
        for i in range(pivots, size):
            row = s[r + 3] + s[m + i - pivots] * s[r + 4]
            for j in range(i, size):
                place = row + s[m + j - pivots]
                a[place] = a[place] + a[f + i * size + j]
        end = f + size * size + pivots
    a[end] = ratio


def solve_fronts(a, b, s, n):
    """Solve in place with the fronts in a: b becomes the solution."""
    for k in range(n):
        r = s[k]
        size = s[r + 1]
        for p in range(s[r + 2]):
            row = s[r] + p * size
            z = a[row + p] * b[s[r + 6 + p]]
            b[s[r + 6 + p]] = z
            for i in range(p + 1, size):
                b[s[r + 6 + i]] = b[s[r + 6 + i]] - a[row + i] * z
    for k in range(n - 1, -1, -1):
        r = s[k]
        size = s[r + 1]
        for p in range(s[r + 2] - 1, -1, -1):
            row = s[r] + p * size
            z = 0.0
            for i in range(size - 1, p, -1):
                z = z + a[row + i] * b[s[r + 6 + i]]
            b[s[r + 6 + p]] = b[s[r + 6 + p]] - a[row + p] * z


def is_known(text: str) -> bool:
    """Whether the text of a function, from its `def` line on, is that of one of these."""
    return text.rstrip() + "\n" in Path(__file__).read_text(encoding="utf-8")


def check(table: Sequence[int], n: int, n_values: int, n_rows: int | None = None) -> str:
    """What is wrong with a table, or "".

    Parameters
    ----------
    table : sequence of int
        First the place of each front's record; then the records: place in the fronts' array, rows, how many of these
        the front eliminates, place and rows of the front that takes the rest, how many times its pivots count, the
        number of each row, and the place of each of the rest among the rows of that front.
    n : int
        Number of fronts.
    n_values : int
        Length of the fronts' array.
    n_rows : int, optional
        Length of a right-hand side.
    """
    if not 1 <= n <= len(table):
        return f"it has no {n} fronts"
    for k in range(n):
        record = table[table[k] : table[k] + RECORD]
        if len(record) < RECORD:
            return f"the record of front {k} does not lie in it"
        place, size, pivots, parent, width, times = record
        rest = size - pivots
        rows = table[table[k] + RECORD : table[k] + RECORD + size + rest]
        if not 1 <= pivots <= size or len(rows) != size + rest:
            return f"the record of front {k} is not complete"
        if times < 1:
            return f"the pivots of front {k} do not count"
        if place + size * size + pivots >= n_values or (rest and parent + width * width > n_values):
            return f"front {k} does not lie in the array"
        if any(x >= width for x in rows[size:]) or any(a >= b for a, b in zip(rows[size:], rows[size + 1 :])):
            return f"what is left of front {k} does not fit the next"
        if n_rows is not None and any(x >= n_rows for x in rows[:size]):
            return f"front {k} has a row that the right-hand side has not"
    return ""


def shapes(table: Sequence[int], n: int) -> list[tuple[int, int]]:
    """Rows and pivots of each front."""
    return [(table[r + 1], table[r + 2]) for r in table[:n]]


def with_early_solves(body: Sequence[Statement]) -> list[Statement]:
    """Statements in which right-hand sides that are there by then are eliminated with the matrix.

    That is where `factor_fronts` and `solve_fronts` have nothing between them that writes to a local array or reads
    the right-hand side.
    """
    result = list(body)
    for i, statement in enumerate(result):
        if type(statement) is not Solve or statement.solver != "factor_fronts":
            continue
        j = _solve_behind(result, i)
        if j is not None:
            arrays = result[j].arrays
            result[i] = statement._replace(solver=FACTOR_FORWARD, arrays=arrays)
            result[j] = result[j]._replace(solver=BACKWARD)
    return result


def _solve_behind(body: Sequence[Statement], i: int) -> int | None:
    """Where the solve stands that statement `i`, a factorisation, can begin; None where there is none."""
    factor, read = body[i], set()
    for j in range(i + 1, len(body)):
        statement = body[j]
        kind = type(statement)
        if kind is Solve:
            wanted = ("solve_fronts", *factor.arrays, factor.table, factor.numbers)
            found = (statement.solver, statement.arrays[0], statement.table, statement.numbers)
            return j if found == wanted and statement.arrays[1] not in read else None
        if kind is not Name and not (kind is Write and statement.array == OUT):
            return None
        read.update(array for array, _ in statement.reads)
    return None


def definition(name: str, table: Sequence[int], n: int) -> tuple[str, str]:
    """The symbol of a solver for the fronts of a table, and LLVM IR that defines it.

    It is called with its arrays and the table. What `factor_fronts` and a `solve_fronts` behind it do may also be split
    between FACTOR_FORWARD, which takes the arrays of both, and BACKWARD: a right-hand side is eliminated while the next
    pivot waits for the last one, and its factors are at hand. Each number goes through the same operations.
    """
    kinds = sorted({shape for shape in shapes(table, n) if shape[0] <= LARGEST_WRITTEN_OUT})
    digest = hashlib.sha256(repr((kinds, n)).encode()).hexdigest()[:12]
    symbol = f"symgen.{name}.{digest}"
    passes = _PASSES[name]
    arrays = ", ".join(f"ptr noalias %{array}" for array in passes[0].arrays)
    w, parts = Writer(), []
    for one in passes:
        parts += [one.front(f"{symbol}{one.suffix}", kind) for kind in (*kinds, None)]
        one.run(w, f"{symbol}{one.suffix}", kinds, n)
    return symbol, "".join(parts) + w.text(f"@{symbol}({arrays}, ptr noalias %s)")


class _Pass:
    """One run over the fronts: a function for each kind of front, and a loop that calls them.

    Such a function takes the arrays, the front's record, and a number that goes from front to front.
    """

    arrays: tuple[str, ...]
    suffix = ""
    forward = True

    def front(self, symbol: str, kind: tuple[int, int] | None) -> str:
        """The function for fronts of one kind, or of any."""
        w = Writer()
        result = self.any_front(w) if kind is None else self.small_front(w, *kind)
        arrays = ", ".join(f"ptr %{array}" for array in self.arrays)
        body = "\n".join(w.lines)
        head = f"define internal double @{symbol}{_label(kind)}({arrays}, ptr %r, double %carried)"
        return f"{head} noinline nounwind {{\nentry:\n{body}\nret double {result}\n}}\n"

    def run(self, w: Writer, symbol: str, kinds: list[tuple[int, int]], n: int) -> None:
        """Write the loop."""
        passed = ", ".join(f"ptr %{array}" for array in self.arrays)

        def body(k: str, sums: list[str]) -> list[str]:
            record = w.place("%s", w.load("%s", k, "i64"))
            kind = w.add(w.new(f"mul i64 {_at(w, record, 1)}, {LARGEST_WRITTEN_OUT + 1}"), _at(w, record, 2))
            name = record[1:]
            cases = [f"i64 {size * (LARGEST_WRITTEN_OUT + 1) + pivots}" for size, pivots in kinds]
            # A large front must not be taken for a small one of the same number.
            small = w.new(f"icmp ule i64 {_at(w, record, 1)}, {LARGEST_WRITTEN_OUT}")
            kind = w.new(f"select i1 {small}, i64 {kind}, i64 -1")
            targets = " ".join(
                f"{case}, label %{name}{_label(k)}" for case, k in zip(cases, kinds, strict=True)
            )
            w.lines.append(f"switch i64 {kind}, label %{name}{_label(None)} [ {targets} ]")
            results = []
            for one in (*kinds, None):
                w.lines.append(f"{name}{_label(one)}:")
                call = f"call double @{symbol}{_label(one)}({passed}, ptr {record}, double {sums[0]})"
                results.append(f"[ {w.new(call)}, %{name}{_label(one)} ]")
                w.lines.append(f"br label %{name}.done")
            w.lines.append(f"{name}.done:")
            w.block = f"{name}.done"
            return [w.new(f"phi double {', '.join(results)}")]

        result = (
            w.loop(0, n, 1, body, (self.start,))
            if self.forward
            else w.loop(n - 1, -1, -1, body, (self.start,))
        )
        self.end(w, n, result[0])

    start = "0.0"

    def end(self, w: Writer, n: int, result: str) -> None:
        """Write what comes after the loop."""

    def small_front(self, w: Writer, size: int, pivots: int) -> str:
        raise NotImplementedError

    def any_front(self, w: Writer) -> str:
        raise NotImplementedError


def _label(kind: tuple[int, int] | None) -> str:
    return ".any" if kind is None else f".{kind[0]}.{kind[1]}"


def _at(w: Writer, record: str, k: int) -> str:
    return w.load(record, str(k), "i64")


def _times(w: Writer, a: str, b: str) -> str:
    return w.new(f"mul nsw i64 {a}, {b}")


def _times_counted(w: Writer) -> str:
    """How many times the pivots of the front with the record %r count, as a number."""
    return w.new(f"sitofp i64 {_at(w, '%r', 5)} to double")


def _smaller(w: Writer, q: str, ratio: str) -> str:
    """q where it is smaller, or no number, else the ratio."""
    less, none = w.new(f"fcmp olt double {q}, {ratio}"), w.new(f"fcmp uno double {q}, {q}")
    return w.new(f"select i1 {w.new(f'or i1 {less}, {none}')}, double {q}, double {ratio}")


class _RightHandSide:
    """The numbers of a right-hand side that belong to the rows of a small front."""

    def __init__(self, w: Writer, size: int) -> None:
        self.places = [w.place("%b", _at(w, "%r", RECORD + i)) for i in range(size)]
        self.values = [w.load(place, "0") for place in self.places]

    def eliminate(self, w: Writer, p: int, inverse: str, row: Sequence[str]) -> None:
        """Subtract multiples of number `p` from those below, given the row of factors behind its pivot."""
        self.values[p] = w.fmul(inverse, self.values[p])
        for i, factor in enumerate(row, p + 1):
            self.values[i] = w.fsub(self.values[i], w.fmul(factor, self.values[p]))

    def store(self, w: Writer) -> None:
        for place, value in zip(self.places, self.values, strict=True):
            w.store(value, place, "0")


class _NoRightHandSide(_RightHandSide):
    def __init__(self) -> None:
        self.places, self.values = [], []

    def eliminate(self, w: Writer, p: int, inverse: str, row: Sequence[str]) -> None:
        pass


class _Factor(_Pass):
    arrays: tuple[str, ...] = ("a",)
    start = "1.0"

    def right_hand_side(self, w: Writer, size: int) -> _RightHandSide:
        """What is eliminated with a small front."""
        return _NoRightHandSide()

    def small_front(self, w: Writer, size: int, pivots: int) -> str:
        front = w.place("%a", _at(w, "%r", 0))
        v = {(i, j): w.load(front, str(i * size + j)) for i in range(size) for j in range(i, size)}
        right = self.right_hand_side(w, size)
        ratio, times = "%carried", _times_counted(w)
        for p in range(pivots):
            reference = w.load(front, str(size * size + p))
            ratio = _smaller(w, w.fmul(times, w.new(f"fdiv double {v[p, p]}, {reference}")), ratio)
            d = w.new(f"fdiv double 1.0, {v[p, p]}")
            w.store(d, front, str(p * size + p))
            for i in range(p + 1, size):
                c = w.fmul(d, v[p, i])
                for j in range(i, size):
                    v[i, j] = w.fsub(v[i, j], w.fmul(c, v[p, j]))
            right.eliminate(w, p, d, [v[p, i] for i in range(p + 1, size)])
            for i in range(p + 1, size if p else 0):
                w.store(v[p, i], front, str(p * size + i))
        right.store(w)
        if pivots < size:
            above, width = w.place("%a", _at(w, "%r", 3)), _at(w, "%r", 4)
            numbers = [_at(w, "%r", RECORD + size + i) for i in range(size - pivots)]
            for i in range(pivots, size):
                row = w.place(above, _times(w, numbers[i - pivots], width))
                for j in range(i, size):
                    place = w.place(row, numbers[j - pivots])
                    w.store(w.new(f"fadd double {w.load(place, '0')}, {v[i, j]}"), place, "0")
        return ratio

    def any_front(self, w: Writer) -> str:
        f, size, pivots = (_at(w, "%r", k) for k in range(3))
        references, times = w.add(f, _times(w, size, size)), _times_counted(w)

        def eliminate(width: int):
            """Pivots p, p + 1, …: each row below them is loaded and stored once for all."""

            def body(p: str, sums: list[str]) -> list[str]:
                ratio, inverses = sums[0], []
                rows = [w.add(f, _times(w, w.add(p, r), size)) for r in range(width)]
                for r, row in enumerate(rows):
                    column = w.add(p, r)
                    pivot = w.load("%a", w.add(row, column))
                    reference = w.load("%a", w.add(references, column))
                    ratio = _smaller(w, w.fmul(times, w.new(f"fdiv double {pivot}, {reference}")), ratio)
                    inverses.append(w.new(f"fdiv double 1.0, {pivot}"))
                    w.store(inverses[r], "%a", w.add(row, column))
                    for s in range(r + 1, width):
                        first = w.add(p, s)
                        c = w.fmul(inverses[r], w.load("%a", w.add(row, first)))
                        subtract_rows(w, "%a", rows[s], [row], [c], size, first)

                def below(i: str, _sums: list[str]) -> None:
                    factors = [
                        w.fmul(d, w.load("%a", w.add(row, i))) for d, row in zip(inverses, rows, strict=True)
                    ]
                    subtract_rows(w, "%a", w.add(f, _times(w, i, size)), rows, factors, size, i)

                w.loop(w.add(p, width), size, 1, below)
                return [ratio]

            return body

        blocked = w.new(f"and i64 {pivots}, {-BLOCK}")
        ratio = w.loop(0, blocked, BLOCK, eliminate(BLOCK), ("%carried",))[0]
        ratio = w.loop(blocked, pivots, 1, eliminate(1), (ratio,))[0]
        above, width = (_at(w, "%r", k) for k in (3, 4))
        numbers = w.place("%r", w.add(w.sub(size, pivots), RECORD))

        def add_row(i: str, _sums: list[str]) -> None:
            row = w.add(above, _times(w, w.load(numbers, i, "i64"), width))
            own = w.add(f, _times(w, i, size))

            def add(j: str, _sums: list[str]) -> None:
                place = w.add(row, w.load(numbers, j, "i64"))
                total = w.new(f"fadd double {w.load('%a', place)}, {w.load('%a', w.add(own, j))}")
                w.store(total, "%a", place)

            w.loop(i, size, 1, add)

        w.loop(pivots, size, 1, add_row)
        return ratio

    def end(self, w: Writer, n: int, result: str) -> None:
        record = w.place("%s", w.load("%s", str(n - 1), "i64"))
        f, size, pivots = (_at(w, record, k) for k in range(3))
        w.store(result, "%a", w.add(w.add(f, _times(w, size, size)), pivots))


class _Forward(_Pass):
    arrays = ("a", "b")
    suffix = ".forward"

    def small_front(self, w: Writer, size: int, pivots: int) -> str:
        front = w.place("%a", _at(w, "%r", 0))
        right = _RightHandSide(w, size)
        for p in range(pivots):
            inverse, *row = (w.load(front, str(p * size + i)) for i in range(p, size))
            right.eliminate(w, p, inverse, row)
        right.store(w)
        return "%carried"

    def any_front(self, w: Writer) -> str:
        f, size, pivots = (_at(w, "%r", k) for k in range(3))
        numbers = w.place("%r", str(RECORD))

        def eliminate(p: str, _sums: list[str]) -> None:
            row = w.add(f, _times(w, p, size))
            here = w.load(numbers, p, "i64")
            z = w.fmul(w.load("%a", w.add(row, p)), w.load("%b", here))
            w.store(z, "%b", here)

            def update(i: str, _sums: list[str]) -> None:
                place = w.load(numbers, i, "i64")
                change = w.fmul(w.load("%a", w.add(row, i)), z)
                w.store(w.fsub(w.load("%b", place), change), "%b", place)

            w.loop(w.add(p, 1), size, 1, update)

        w.loop(0, pivots, 1, eliminate)
        return "%carried"


class _Backward(_Pass):
    arrays = ("a", "b")
    suffix = ".backward"
    forward = False

    def small_front(self, w: Writer, size: int, pivots: int) -> str:
        front = w.place("%a", _at(w, "%r", 0))
        rows = [w.place("%b", _at(w, "%r", RECORD + i)) for i in range(size)]
        b = [w.load(row, "0") for row in rows]
        for p in range(pivots - 1, -1, -1):
            z = "0.0"
            for i in range(size - 1, p, -1):
                z = w.new(f"fadd double {z}, {w.fmul(w.load(front, str(p * size + i)), b[i])}")
            b[p] = w.fsub(b[p], w.fmul(w.load(front, str(p * size + p)), z))
            w.store(b[p], rows[p], "0")
        return "%carried"

    def any_front(self, w: Writer) -> str:
        f, size, pivots = (_at(w, "%r", k) for k in range(3))
        numbers = w.place("%r", str(RECORD))

        def substitute(p: str, _sums: list[str]) -> None:
            row = w.add(f, _times(w, p, size))

            def add(i: str, sums: list[str]) -> list[str]:
                term = w.fmul(w.load("%a", w.add(row, i)), w.load("%b", w.load(numbers, i, "i64")))
                return [w.new(f"fadd double {sums[0]}, {term}")]

            z = w.loop(w.sub(size, 1), p, -1, add, ("0.0",))[0]
            here = w.load(numbers, p, "i64")
            w.store(w.fsub(w.load("%b", here), w.fmul(w.load("%a", w.add(row, p)), z)), "%b", here)

        w.loop(w.sub(pivots, 1), -1, -1, substitute)
        return "%carried"


class _FactorForward(_Factor):
    arrays = ("a", "b")

    def right_hand_side(self, w: Writer, size: int) -> _RightHandSide:
        return _RightHandSide(w, size)

    def any_front(self, w: Writer) -> str:
        ratio = super().any_front(w)
        _FORWARD.any_front(w)
        return ratio


_FORWARD = _Forward()
_PASSES: dict[str, tuple[_Pass, ...]] = {
    "factor_fronts": (_Factor(),),
    "solve_fronts": (_FORWARD, _Backward()),
    FACTOR_FORWARD: (_FactorForward(),),
    BACKWARD: (_Backward(),),
}
