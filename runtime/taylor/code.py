"""Write LLVM IR for arithmetic on coefficients; long code in pieces that share a scratch array.

A value is the text of a constant or of an SSA name, or None: zero, of which nothing is written.
"""

from __future__ import annotations

from symgen.runtime.code.llvm_text import constant, math_declaration, math_symbol

# The angle is reduced by multiples of pi/2 in two parts (Cody and Waite), exactly, since a fused multiply-add does not
# round the product; the sums are ordered as in fdlibm (k_sin.c, k_cos.c). The error is below one unit in the last place
# (near zeros, below 1e-32 of the angle). Angles beyond LARGEST go to the C library.
#
# What grows in a long run is not that error but its mean over neighbouring angles: steps through the same angles add it
# up, and rounding does not. So polynomials (least squares at Chebyshev points, one coefficient rounded after another),
# their first coefficients in two parts and the effect of the reduction's remainder are good to 1e-19.

LARGEST = 1e9
_TWO_OVER_PI = 0.6366197723675814
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
# sin r = r + r^3 (-1/6 + low + z (...)), cos r = 1 - z / 2 + z^2 (1/24 + low + z (...)), z = r^2.
_SIXTH, _TWENTY_FOURTH = -1.0 / 6.0, 1.0 / 24.0
_SINE = (
    -9.25185853854297e-18, 8.333333333333326e-03, -1.9841269841256514e-04, 2.7557319214276e-06,
    -2.5052104836656676e-08, 1.6058349582757788e-10, -7.577615464024097e-13,
)  # fmt: skip
_COSINE = (
    2.3129646346357427e-18, -1.3888888888888883e-03, 2.480158730157719e-05, -2.755731921723773e-07,
    2.0876754691387034e-09, -1.1470322202837172e-11, 4.739136935687501e-14,
)  # fmt: skip

DECLARATIONS = (
    "declare double @llvm.fma.f64(double, double, double)",
    "declare double @llvm.rint.f64(double)",
    "declare double @llvm.fabs.f64(double)",
    "declare double @llvm.sin.f64(double)",
    "declare double @llvm.cos.f64(double)",
    "declare double @llvm.fmuladd.f64(double, double, double)",
)


def sincos_function(name: str) -> str:
    """Return the LLVM IR of `void name(double x, ptr pair)`, which writes the sine and the cosine."""
    high, low = (constant(value) for value in _HALF_PI)
    sixth, twenty_fourth = constant(_SIXTH), constant(_TWENTY_FOURTH)
    return f"""define internal void @{name}(double %x, ptr noalias %pair) noinline nounwind {{
entry:
%second = getelementptr inbounds double, ptr %pair, i64 1
%size = call double @llvm.fabs.f64(double %x)
%near = fcmp ole double %size, {constant(LARGEST)}
br i1 %near, label %reduce, label %library
library:
%s.library = call double @llvm.sin.f64(double %x)
%c.library = call double @llvm.cos.f64(double %x)
store double %s.library, ptr %pair, align 8
store double %c.library, ptr %second, align 8
ret void
reduce:
%turns = fmul double %x, {constant(_TWO_OVER_PI)}
%n = call double @llvm.rint.f64(double %turns)
%m = fneg double %n
%rest = call double @llvm.fma.f64(double %m, double {high}, double %x)
%r = call double @llvm.fma.f64(double %m, double {low}, double %rest)
%gone = fsub double %rest, %r
%tail = call double @llvm.fma.f64(double %m, double {low}, double %gone)
%z = fmul double %r, %r
%zz = fmul double %z, %z
%v = fmul double %z, %r
{_polynomial("sp", _SINE)}
{_polynomial("cp", _COSINE)}
%hz = fmul double %z, 0.5
%w = fsub double 1.0, %hz
%cosine.near = call double @llvm.fmuladd.f64(double %zz, double {twenty_fourth}, double %w)
%sp.near = call double @llvm.fmuladd.f64(double %z, double {constant(_SINE[1])}, double {sixth})
%sine.near = call double @llvm.fmuladd.f64(double %v, double %sp.near, double %r)
%s1 = fmul double %tail, %cosine.near
%s2 = call double @llvm.fmuladd.f64(double %v, double %sp, double %s1)
%s3 = call double @llvm.fmuladd.f64(double %v, double {sixth}, double %s2)
%sine = fadd double %r, %s3
%w1 = fsub double 1.0, %w
%w2 = fsub double %w1, %hz
%c1 = fmul double %tail, %sine.near
%c2 = fsub double %w2, %c1
%c3 = call double @llvm.fmuladd.f64(double %zz, double %cp, double %c2)
%c4 = call double @llvm.fmuladd.f64(double %zz, double {twenty_fourth}, double %c3)
%cosine = fadd double %w, %c4
%quadrant = fptosi double %n to i64
%odd.bit = and i64 %quadrant, 1
%odd = icmp ne i64 %odd.bit, 0
%s.size = select i1 %odd, double %cosine, double %sine
%c.size = select i1 %odd, double %sine, double %cosine
%s.sign = shl i64 %quadrant, 62
%up = add i64 %quadrant, 1
%c.sign = shl i64 %up, 62
%s.bit = and i64 %s.sign, -9223372036854775808
%c.bit = and i64 %c.sign, -9223372036854775808
%s.bits = bitcast double %s.size to i64
%c.bits = bitcast double %c.size to i64
%s.signed = xor i64 %s.bits, %s.bit
%c.signed = xor i64 %c.bits, %c.bit
store i64 %s.signed, ptr %pair, align 8
store i64 %c.signed, ptr %second, align 8
ret void
}}
"""


def _polynomial(name: str, coefficients: tuple[float, ...]) -> str:
    """A polynomial in z: its even and odd powers apart, which halves the time."""
    lines = []
    for start, part in enumerate((f"{name}.even", f"{name}.odd")):
        own = coefficients[start::2]
        before = constant(own[-1])
        for number in range(len(own) - 2, -1, -1):
            to = f"%{part}{number}"
            lines.append(
                f"{to} = call double @llvm.fmuladd.f64(double {before}, double %zz, double {constant(own[number])})"
            )
            before = to
    even, odd = f"%{name}.even0", f"%{name}.odd0"
    lines.append(f"%{name} = call double @llvm.fmuladd.f64(double {odd}, double %z, double {even})")
    return "\n".join(lines)


PIECE_OPERATIONS = 400
ARGUMENTS = "double %t, ptr noalias %y, ptr noalias %p, ptr noalias %out, ptr noalias %scratch, i64 %k"
PASSED = "double %t, ptr %y, ptr %p, ptr %out, ptr %scratch"
ONE = constant(1.0)

Value = str | None


class Piece:
    """One internal function; loads and stores count as operations, since compiling them takes as long."""

    def __init__(self, name: str, first_order: int | None) -> None:
        self.name, self.first_order = name, first_order
        self.lines: list[str] = []
        self.local: set[str] = set()
        self.operations = 0


class Code:
    """The functions of one kernel while they are written."""

    def __init__(self, symbol: str) -> None:
        self.symbol = symbol
        self.pieces: list[Piece] = []
        self.piece: Piece
        self.operations = 0
        self.n_slots = 0
        self._n_names = 0
        self._home: dict[str, Piece] = {}
        self._slots: dict[str, int] = {}
        self._loaded: dict[str, str] = {}
        self._called: set[str] = set()
        self._kinds: dict[str, tuple[str, int]] = {}  # of vectors: type, width

    def begin_piece(self, first_order: int | None = None) -> None:
        """Begin a new function; `first_order` is that of a piece which only runs for orders from there on."""
        self.piece = Piece(f"{self.symbol}.{len(self.pieces)}", first_order)
        self.pieces.append(self.piece)

    @property
    def is_full(self) -> bool:
        return self.piece.operations > PIECE_OPERATIONS

    def reserve(self, n: int, multiple: int = 1) -> int:
        """Reserve `n` places of the scratch array, beginning at a multiple; returns the first."""
        first = -(-self.n_slots // multiple) * multiple
        self.n_slots = first + n
        return first

    def line(self, text: str) -> None:
        self.piece.lines.append(text)

    def name(self) -> str:
        self._n_names += 1
        return f"%n{self._n_names}"

    def value(self, right_side: str) -> str:
        """Write an operation and return its value, which later pieces may use as well."""
        name = self.name()
        self.line(f"{name} = {right_side}")
        self.piece.local.add(name)
        self.piece.operations += 1
        self.operations += 1
        self._home[name] = self.piece
        return name

    def use(self, value: str) -> str:
        """Return a value as this piece knows it: loaded from scratch where another piece computed it."""
        if value[0] != "%" or value in self.piece.local or value not in self._home:
            return value
        kind, width = self._kinds.get(value, ("double", 1))
        if value not in self._slots:
            self._slots[value] = self.reserve(width, width)
            home = self._home[value]
            address = f"{value}.to"
            home.lines.append(
                f"{address} = getelementptr inbounds double, ptr %scratch, i64 {self._slots[value]}"
            )
            home.lines.append(f"store {kind} {value}, ptr {address}, align {8 * width}")
        self.piece.local.add(value)
        self.line(f"{value}.at = getelementptr inbounds double, ptr %scratch, i64 {self._slots[value]}")
        self.line(f"{value} = load {kind}, ptr {value}.at, align {8 * width}")
        self.piece.operations += 1
        return value

    def vector(self, right_side: str, kind: str, width: int) -> str:
        """Write an operation on vectors and return its value."""
        name = self.value(right_side)
        self._kinds[name] = kind, width
        return name

    def add(self, a: Value, b: Value) -> Value:
        if a is None or b is None:
            return b if a is None else a
        return self.value(f"fadd contract double {self.use(a)}, {self.use(b)}")

    def sub(self, a: Value, b: Value) -> Value:
        if b is None:
            return a
        if a is None:
            return self.neg(b)
        return self.value(f"fsub contract double {self.use(a)}, {self.use(b)}")

    def neg(self, a: Value) -> Value:
        return None if a is None else self.value(f"fneg double {self.use(a)}")

    def mul(self, a: Value, b: Value) -> Value:
        if a is None or b is None:
            return None
        if ONE in (a, b):
            return b if a == ONE else a
        return self.value(f"fmul contract double {self.use(a)}, {self.use(b)}")

    def div(self, a: Value, b: str) -> Value:
        return None if a is None else self.value(f"fdiv double {self.use(a)}, {self.use(b)}")

    def fma(self, a: Value, b: Value, c: Value) -> Value:
        """a b + c, rounded once where the processor can."""
        if a is None or b is None or c is None or ONE in (a, b):
            return self.add(self.mul(a, b), c)
        return self._fused(a, b, c)

    def fnma(self, a: Value, b: Value, c: Value) -> Value:
        """c - a b."""
        if a is None or b is None:
            return c
        if c is None or ONE in (a, b):
            return self.sub(c, self.mul(a, b))
        return self._fused(self.neg(a), b, c)

    def _fused(self, a: Value, b: Value, c: Value) -> str:
        self._called.add("declare double @llvm.fmuladd.f64(double, double, double)")
        return self.value(
            f"call double @llvm.fmuladd.f64(double {self.use(a)}, double {self.use(b)}, double {self.use(c)})"
        )

    def call(self, function: str, arguments: list[str]) -> str:
        """A mathematical function, as `symgen.runtime.code.llvm_text` calls it."""
        self._called.add(math_declaration(function))
        passed = ", ".join(f"double {self.use(a)}" for a in arguments)
        return self.value(f"call double @{math_symbol(function)}({passed})")

    def sincos(self, angle: str) -> tuple[str, str]:
        """Sine and cosine of an angle."""
        self._called.update(DECLARATIONS)
        first = self.reserve(2)
        pair = self.integer(f"getelementptr inbounds double, ptr %scratch, i64 {first}")
        self.line(f"call void @{self.symbol}.sincos(double {self.use(angle)}, ptr {pair})")
        return self.load("scratch", first), self.load("scratch", first + 1)

    def select(self, comparison: str, left: str, right: str, chosen: str, other: str) -> str:
        test = self.name()
        self.line(f"{test} = fcmp {comparison} double {self.use(left)}, {self.use(right)}")
        return self.value(f"select i1 {test}, double {self.use(chosen)}, double {self.use(other)}")

    def kept(self, is_taken: str, a: Value) -> Value:
        """A value where a number is 1, zero where it is 0."""
        zero = constant(0.0)
        return None if a is None else self.select("olt", zero, is_taken, a, zero)

    def load(self, array: str, index: int | str) -> str:
        """Load from an argument's array at a fixed place, or at an i64 value."""
        address = self.name()
        self.line(f"{address} = getelementptr inbounds double, ptr %{array}, i64 {index}")
        return self.value(f"load double, ptr {address}, align 8")

    def store(self, array: str, index: int | str, value: Value) -> None:
        address = self.name()
        known = constant(0.0) if value is None else self.use(value)
        self.line(f"{address} = getelementptr inbounds double, ptr %{array}, i64 {index}")
        self.line(f"store double {known}, ptr {address}, align 8")
        self.piece.operations += 1

    def integer(self, right_side: str) -> str:
        """An integer, for addresses; it is known in this piece only."""
        name = self.name()
        self.line(f"{name} = {right_side}")
        return name

    def declare(self, declaration: str) -> None:
        self._called.add(declaration)

    @property
    def written(self) -> int:
        """Operations so far, loads and stores among them."""
        return sum(piece.operations for piece in self.pieces)

    def text(self, main: str, costs: tuple[float, float, float], extra: str = "") -> str:
        """The module: declarations, pieces, further functions, and the body of the kernel itself.

        `costs`: the operations of a call to order p are costs[0] + costs[1] p + costs[2] p^2.
        """
        numbers = ", ".join(f"double {constant(cost)}" for cost in costs)
        text = [
            "\n".join(sorted(self._called)) + "\n",
            f"@{self.symbol}.costs = constant [3 x double] [{numbers}]\n",
            extra,
        ]
        if DECLARATIONS[0] in self._called:
            text.append(sincos_function(f"{self.symbol}.sincos"))
        for piece in self.pieces:
            head = f"define internal void @{piece.name}({ARGUMENTS}) noinline nounwind"
            body = "\n".join(piece.lines)
            text.append(f"{head} {{\nentry:\n{body}\nbr label %done\ndone:\nret void\n}}\n")
        arguments = "double %t, ptr noalias %y, ptr noalias %p, ptr noalias %out"
        scratch = f"%scratch = alloca double, i64 {max(self.n_slots, 1)}, align 64"
        text.append(f"define void @{self.symbol}({arguments}) nounwind {{\nentry:\n{scratch}\n{main}\n}}\n")
        return "".join(text)
