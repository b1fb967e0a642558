"""Dense LDLᵀ solves of generated functions: as Python, as it stands in generated modules, and as LLVM IR.

A matrix is kept by its upper triangle, row by row in a square array, with n reference values behind it. Both forms do
the same operations on each number in the same order, so their results agree to the bit. The IR takes four pivots at a
time, so that each row below is loaded and stored once for four, and works on four columns at once. With this it needs
less time than LAPACK's `dpotrf` and `dpotrs` up to n = 200 at least.
"""

from __future__ import annotations

from pathlib import Path

SOLVERS = {"factor_ldl": 2, "solve_ldl": 1}  # and how many numbers their calls end with
BLOCK = 4  # pivots that are applied together, and columns in a vector


def factor_ldl(a, n, nc):
    """Factorise a symmetric n x n matrix in place: D and U^T D by rows, with 1/d on the diagonal.

    The first nc pivots also change the references a[n*n:] of the later ones, as they change the diagonal.
    """
    for k in range(n):
        d = 1.0 / a[k * n + k]
        a[k * n + k] = d
        for i in range(k + 1, n):
            f = d * a[k * n + i]
            if k < nc <= i:
                a[n * n + i] = a[n * n + i] - f * a[k * n + i]
            for j in range(i, n):
                a[i * n + j] = a[i * n + j] - f * a[k * n + j]


def solve_ldl(a, b, n):
    """Solve in place with the factors in a: b becomes the solution."""
    for k in range(n):
        b[k] = a[k * n + k] * b[k]
        for i in range(k + 1, n):
            b[i] = b[i] - a[k * n + i] * b[k]
    for k in range(n - 2, -1, -1):
        s = 0.0
        for i in range(n - 1, k, -1):
            s = s + a[k * n + i] * b[i]
        b[k] = b[k] - a[k * n + k] * s


def is_known(text: str) -> bool:
    """Whether the text of a function, from its `def` line on, is that of one of these."""
    return text.rstrip() + "\n" in Path(__file__).read_text(encoding="utf-8")


def array_lengths(name: str, sizes: list[int]) -> list[int]:
    """How many values the arrays that a solver is given hold at least, by its numbers."""
    n = sizes[0]
    return [n * n + n] if name == "factor_ldl" else [n * n + n, n]


def operations(name: str, sizes: list[int]) -> int:
    """The number of operations of a call."""
    n = sizes[0]
    if name == "solve_ldl":
        return 2 * n * n
    nc = sizes[1]
    below = sum(n - 1 - k for k in range(n))
    references = sum(2 * (n - nc) for _ in range(nc))
    return n + below + references + 2 * sum((n - k) * (n - k - 1) // 2 for k in range(n))


def definition(name: str, sizes: list[int]) -> tuple[str, str]:
    """The symbol of a solver for these sizes, and LLVM IR that defines it."""
    symbol = f"symgen.{name}." + ".".join(map(str, sizes))
    text = _factor_text(symbol, *sizes) if name == "factor_ldl" else _solve_text(symbol, *sizes)
    return symbol, text


class Writer:
    """Lines of IR with counted loops; every value has a name of its own."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._n = 0
        self.block = "entry"

    def new(self, right_side: str) -> str:
        """Define a value."""
        self._n += 1
        self.lines.append(f"%x{self._n} = {right_side}")
        return f"%x{self._n}"

    def add(self, a: str, b: str | int) -> str:
        return self.new(f"add nsw i64 {a}, {b}")

    def sub(self, a: str | int, b: str | int) -> str:
        return self.new(f"sub nsw i64 {a}, {b}")

    def mul(self, a: str, b: int) -> str:
        return self.new(f"mul nsw i64 {a}, {b}")

    def place(self, array: str, index: str) -> str:
        return self.new(f"getelementptr inbounds double, ptr {array}, i64 {index}")

    def load(self, array: str, index: str, kind: str = "double") -> str:
        return self.new(f"load {kind}, ptr {self.place(array, index)}, align 8")

    def store(self, value: str, array: str, index: str, kind: str = "double") -> None:
        self.lines.append(f"store {kind} {value}, ptr {self.place(array, index)}, align 8")

    def fmul(self, a: str, b: str, kind: str = "double") -> str:
        return self.new(f"fmul {kind} {a}, {b}")

    def fsub(self, a: str, b: str, kind: str = "double") -> str:
        return self.new(f"fsub {kind} {a}, {b}")

    def splat(self, value: str) -> str:
        """A vector of equal numbers."""
        one = self.new(f"insertelement <{BLOCK} x double> poison, double {value}, i64 0")
        zeros = f"<{BLOCK} x i32> zeroinitializer"
        return self.new(f"shufflevector <{BLOCK} x double> {one}, <{BLOCK} x double> poison, {zeros}")

    def loop(
        self, start: str | int, end: str | int, step: int, body, sums: tuple[str, ...] = ()
    ) -> list[str]:
        """Write `for i in range(start, end, step)` around `body(i, sums)`, which returns the new sums."""
        self._n += 1
        n = self._n
        head, inside, after, before = f"head{n}", f"body{n}", f"after{n}", self.block
        position = len(self.lines)
        self.lines += ["", f"{head}:", ""] + [""] * len(sums)
        test = "slt" if step > 0 else "sgt"
        self.lines.append(f"%go{n} = icmp {test} i64 %i{n}, {end}")
        self.lines += [f"br i1 %go{n}, label %{inside}, label %{after}", f"{inside}:"]
        self.block = inside
        results = body(f"%i{n}", [f"%s{n}.{k}" for k in range(len(sums))]) or []
        following = self.add(f"%i{n}", step)
        last = self.block
        self.lines += [f"br label %{head}", f"{after}:"]
        self.lines[position] = f"br label %{head}"
        self.lines[position + 2] = f"%i{n} = phi i64 [ {start}, %{before} ], [ {following}, %{last} ]"
        for k, (first, result) in enumerate(zip(sums, results, strict=True)):
            self.lines[position + 3 + k] = (
                f"%s{n}.{k} = phi double [ {first}, %{before} ], [ {result}, %{last} ]"
            )
        self.block = after
        return [f"%s{n}.{k}" for k in range(len(sums))]

    def text(self, head: str) -> str:
        body = "\n".join(self.lines)
        return f"define internal void {head} noinline nounwind {{\nentry:\n{body}\nret void\n}}\n"


def subtract_rows(
    w: Writer, a: str, target: str, rows: list[str], factors: list[str], n: int | str, first: str
) -> None:
    """a[target + j] -= factor * a[row + j] for each row in turn, j from `first` to n."""
    vector = f"<{BLOCK} x double>"
    wide = [w.splat(f) for f in factors]
    length = w.sub(n, first)
    vectors_end = w.add(first, w.new(f"and i64 {length}, {-BLOCK}"))

    def update(kind: str, scale: list[str]):
        def body(j: str, _sums: list[str]) -> None:
            value = w.load(a, w.add(target, j), kind)
            for row, factor in zip(rows, scale, strict=True):
                value = w.fsub(value, w.fmul(factor, w.load(a, w.add(row, j), kind), kind), kind)
            w.store(value, a, w.add(target, j), kind)

        return body

    w.loop(first, vectors_end, BLOCK, update(vector, wide))
    w.loop(vectors_end, n, 1, update("double", factors))


def _factor_text(symbol: str, n: int, nc: int) -> str:
    w, a = Writer(), "%a"

    def pivots(width: int):
        def body(k: str, _sums: list[str]) -> None:
            rows = [w.mul(w.add(k, r), n) for r in range(width)]
            inverses: list[str] = []
            for r in range(width):
                here = w.add(rows[r], w.add(k, r))
                inverses.append(w.new(f"fdiv double 1.0, {w.load(a, here)}"))
                w.store(inverses[r], a, here)
                for s in range(r + 1, width):
                    column = w.add(k, s)
                    f = w.fmul(inverses[r], w.load(a, w.add(rows[r], column)))
                    subtract_rows(w, a, rows[s], [rows[r]], [f], n, column)
                if nc < n:
                    change_references(w.add(k, r), rows[r], inverses[r])

            def below(i: str, _sums: list[str]) -> None:
                factors = [w.fmul(d, w.load(a, w.add(row, i))) for d, row in zip(inverses, rows, strict=True)]
                subtract_rows(w, a, w.mul(i, n), rows, factors, n, i)

            w.loop(w.add(k, width), n, 1, below)

        return body

    def change_references(k: str, row: str, inverse: str) -> None:
        counts = w.new(f"icmp slt i64 {k}, {nc}")
        end = w.new(f"select i1 {counts}, i64 {n}, i64 {nc}")

        def body(i: str, _sums: list[str]) -> None:
            entry = w.load(a, w.add(row, i))
            reference = w.add(i, n * n)
            w.store(w.fsub(w.load(a, reference), w.fmul(w.fmul(inverse, entry), entry)), a, reference)

        w.loop(nc, end, 1, body)

    blocked = n - n % BLOCK
    w.loop(0, blocked, BLOCK, pivots(BLOCK))
    w.loop(blocked, n, 1, pivots(1))
    return w.text(f"@{symbol}(ptr noalias %a)")


def _solve_text(symbol: str, n: int) -> str:
    w, a, b = Writer(), "%a", "%b"
    vector = f"<{BLOCK} x double>"

    def forward(k: str, _sums: list[str]) -> None:
        row, first = w.mul(k, n), w.add(k, 1)
        z = w.fmul(w.load(a, w.add(row, k)), w.load(b, k))
        w.store(z, b, k)
        length = w.sub(n, first)
        vectors_end = w.add(first, w.new(f"and i64 {length}, {-BLOCK}"))

        def update(kind: str, factor: str):
            def body(i: str, _sums: list[str]) -> None:
                change = w.fmul(w.load(a, w.add(row, i), kind), factor, kind)
                w.store(w.fsub(w.load(b, i, kind), change, kind), b, i, kind)

            return body

        w.loop(first, vectors_end, BLOCK, update(vector, w.splat(z)))
        w.loop(vectors_end, n, 1, update("double", z))

    def backward(width: int):
        def body(k: str, _sums: list[str]) -> None:
            """Rows k, k - 1, …: their sums over what they have in common run side by side."""
            ks = [w.sub(k, r) for r in range(width)]
            rows = [w.mul(x, n) for x in ks]

            def common(i: str, sums: list[str]) -> list[str]:
                x = w.load(b, i)
                terms = [w.fmul(w.load(a, w.add(row, i)), x) for row in rows]
                return [w.new(f"fadd double {s}, {term}") for s, term in zip(sums, terms, strict=True)]

            sums = w.loop(n - 1, k, -1, common, ("0.0",) * width)
            for r in range(width):
                for s in range(r):
                    term = w.fmul(w.load(a, w.add(rows[r], ks[s])), w.load(b, ks[s]))
                    sums[r] = w.new(f"fadd double {sums[r]}, {term}")
                scaled = w.fmul(w.load(a, w.add(rows[r], ks[r])), sums[r])
                w.store(w.fsub(w.load(b, ks[r]), scaled), b, ks[r])

        return body

    w.loop(0, n, 1, forward)
    rest = (n - 1) % BLOCK if n > 1 else 0
    w.loop(n - 2, rest - 1, -BLOCK, backward(BLOCK))
    w.loop(rest - 1, -1, -1, backward(1))
    return w.text(f"@{symbol}(ptr noalias %a, ptr noalias %b)")
