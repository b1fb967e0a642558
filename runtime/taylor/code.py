"""Write LLVM IR for arithmetic on coefficients; long code in pieces that share a scratch array.

A value is the text of a constant or of an SSA name, or None: zero, of which nothing is written.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from symgen.runtime.code.llvm_text import (
    VECTOR_INTRINSICS,
    constant,
    lanes_call,
    lanes_constant,
    lanes_suffix,
    lanes_type,
    math_declaration,
    math_symbol,
)
from symgen.runtime.code.sincos import DECLARATIONS, inlined_where_few, lanes_sincos, sincos_function

PIECE_OPERATIONS = 400
_SHORT = 1000  # operations of a kernel
_PRODUCT = re.compile(r"^(%\w+) = fmul contract ")
_STORED = re.compile(r"^store \S+ (%\w+), ")
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


@dataclass(frozen=True)
class Registers:
    """How many numbers a register of the processor holds, and how many of these registers there are."""

    length: int
    number: int


class Code:
    """The functions of one kernel while they are written.

    Parameters
    ----------
    symbol : str
    lanes : int
        Members of an ensemble that stand side by side in the arrays; 0: there is one, of plain numbers.
    is_one_function : bool
        Whether pieces are inlined however long they are.
    registers : Registers, optional
        Members that do not fit into one are computed one part after another: their values would leave registers all
        the time, and their series the first-level cache.

    Attributes
    ----------
    lanes : int
        Members that are computed at once.
    registers : int
        How many of them there are.
    rounded : set of str
        Values that are not to be made one operation with a sum that they are a term of.
    """

    def __init__(
        self,
        symbol: str,
        lanes: int = 0,
        registers: Registers | None = None,
        *,
        is_one_function: bool = False,
    ) -> None:
        registers = registers or Registers(max(lanes, 1), 32)
        self.symbol, self.lanes, self.registers = symbol, min(lanes, registers.length), registers.number
        self.number = lanes_type(self.lanes)
        self._rows = lanes  # members side by side in `y`, `p` and `out`
        # Which products and sums LLVM makes one of may differ between vectors and numbers; members must not.
        self._loose = "" if lanes else "contract "
        self._helpers: dict[str, str] = {}  # further functions, by name
        self.pieces: list[Piece] = []
        self.piece: Piece
        self.operations = 0
        self.is_one_function = is_one_function
        self.rounded: set[str] = set()
        self.n_slots = 0
        self._n_names = 0
        self._home: dict[str, Piece] = {}
        self._slots: dict[str, int | str] = {}
        self._indexes: dict[tuple[str, str], str] = {}
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
        if value[0] != "%":
            return f"splat (double {value})" if self.lanes else value
        if value in self.piece.local or value not in self._home:
            return value
        kind, width = self._kinds.get(value, (self.number, 1))
        if value not in self._slots:
            self._slots[value] = self.reserve(width, width)
            home = self._home[value]
            address = f"{value}.to"
            home.lines.append(
                f"{address} = getelementptr inbounds {self.number}, ptr %scratch, i64 {self._slots[value]}"
            )
            home.lines.append(f"store {kind} {value}, ptr {address}, align {8 * width}")
        self.piece.local.add(value)
        place = self.index(self._slots[value])
        self.line(f"{value}.at = getelementptr inbounds {self.number}, ptr %scratch, i64 {place}")
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
        return self.value(f"fadd {self._loose}{self.number} {self.use(a)}, {self.use(b)}")

    def sub(self, a: Value, b: Value) -> Value:
        if b is None:
            return a
        if a is None:
            return self.neg(b)
        return self.value(f"fsub {self._loose}{self.number} {self.use(a)}, {self.use(b)}")

    def neg(self, a: Value) -> Value:
        return None if a is None else self.value(f"fneg {self.number} {self.use(a)}")

    def mul(self, a: Value, b: Value) -> Value:
        if a is None or b is None:
            return None
        if ONE in (a, b):
            return b if a == ONE else a
        return self.value(f"fmul {self._loose}{self.number} {self.use(a)}, {self.use(b)}")

    def div(self, a: Value, b: str) -> Value:
        return None if a is None else self.value(f"fdiv {self.number} {self.use(a)}, {self.use(b)}")

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
        kind, symbol = self.number, f"llvm.fmuladd.{lanes_suffix(self.lanes)}"
        self._called.add(f"declare {kind} @{symbol}({kind}, {kind}, {kind})")
        return self.value(
            f"call {kind} @{symbol}({kind} {self.use(a)}, {kind} {self.use(b)}, {kind} {self.use(c)})"
        )

    def call(self, function: str, arguments: list[str]) -> str:
        """A mathematical function, as `symgen.runtime.code.llvm_text` calls it."""
        passed = ", ".join(f"{self.number} {self.use(a)}" for a in arguments)
        if self.lanes:
            symbol, definition = lanes_call(function, len(arguments), self.lanes)
            if function in VECTOR_INTRINSICS:
                self._called.add(definition.rstrip())  # sine and cosine may declare the same
            else:
                self._helpers[symbol] = definition
                self._called.add(math_declaration(function))
            return self.value(f"call {self.number} @{symbol}({passed})")
        self._called.add(math_declaration(function))
        return self.value(f"call double @{math_symbol(function)}({passed})")

    def sincos(self, angle: str) -> tuple[str, str]:
        """Sine and cosine of an angle."""
        if self.lanes:
            kind, symbol, pair = self.number, f"{self.symbol}.sincos", self.name()
            self._helpers[symbol], declared = lanes_sincos(symbol, self.lanes)
            self._called |= declared
            self.line(f"{pair} = call {{{kind}, {kind}}} @{symbol}({kind} {self.use(angle)})")
            first, second = (self.value(f"extractvalue {{{kind}, {kind}}} {pair}, {k}") for k in (0, 1))
            return first, second
        self._called.update(DECLARATIONS)
        first = self.reserve(2)
        pair = self.integer(f"getelementptr inbounds double, ptr %scratch, i64 {first}")
        self.line(f"call void @{self.symbol}.sincos(double {self.use(angle)}, ptr {pair})")
        return self.load("scratch", first), self.load("scratch", first + 1)

    def select(self, comparison: str, left: str, right: str, chosen: str, other: str) -> str:
        test = self.name()
        kind, flag = self.number, f"<{self.lanes} x i1>" if self.lanes else "i1"
        self.line(f"{test} = fcmp {comparison} {kind} {self.use(left)}, {self.use(right)}")
        return self.value(f"select {flag} {test}, {kind} {self.use(chosen)}, {kind} {self.use(other)}")

    def kept(self, is_taken: str, a: Value) -> Value:
        """A value where a number is 1, zero where it is 0."""
        zero = constant(0.0)
        return None if a is None else self.select("olt", zero, is_taken, a, zero)

    def load(self, array: str, index: int | str) -> str:
        """Load from an argument's array at a fixed place, or at an i64 value."""
        address = self.name()
        self.line(f"{address} = getelementptr inbounds {self._row_of(array)}, ptr %{array}, i64 {index}")
        return self.value(f"load {self.number}, ptr {address}, align {self.align}")

    def _row_of(self, array: str) -> str:
        return self.number if array == "scratch" else lanes_type(self._rows)

    def in_all_lanes(self, table: str, index: int | str) -> str:
        """Load a number of a constant table, for all lanes."""
        address, one, first = self.name(), self.name(), self.name()
        self.line(f"{address} = getelementptr inbounds double, ptr @{table}, i64 {index}")
        self.line(f"{one} = load double, ptr {address}, align 8")
        self.line(f"{first} = insertelement {self.number} poison, double {one}, i32 0")
        zeros = f"<{self.lanes} x i32> zeroinitializer"
        return self.value(f"shufflevector {self.number} {first}, {self.number} poison, {zeros}")

    def index(self, place: int | str) -> int | str:
        """A place, or the value of one that is given as "factor * k + offset"."""
        if isinstance(place, int):
            return place
        key = (self.piece.name, place)
        if key not in self._indexes:
            factor, offset = place.split(" * k + ")
            scaled = self.integer(f"mul i64 %k, {factor}")
            self._indexes[key] = self.integer(f"add i64 {scaled}, {offset}")
        return self._indexes[key]

    def keep(self, place: int | str, value: Value) -> None:
        """Store to the scratch array what stays there: later pieces load it from this place."""
        self.store("scratch", self.index(place), value)
        if self.lanes and value is not None and value[0] == "%":
            self._slots.setdefault(value, place)

    def store(self, array: str, index: int | str, value: Value) -> None:
        address = self.name()
        known = self.use(constant(0.0) if value is None else value)
        self.line(f"{address} = getelementptr inbounds {self._row_of(array)}, ptr %{array}, i64 {index}")
        self.line(f"store {self.number} {known}, ptr {address}, align {self.align}")
        self.piece.operations += 1
        if self.lanes and array == "scratch" and type(index) is int:
            self._slots.setdefault(known, index)  # later pieces find it there

    def integer(self, right_side: str) -> str:
        """An integer, for addresses; it is known in this piece only."""
        name = self.name()
        self.line(f"{name} = {right_side}")
        return name

    def declare(self, declaration: str) -> None:
        self._called.add(declaration)

    def define(self, name: str, text: str) -> None:
        """Add a function to the module."""
        self._helpers[name] = text

    def take_declarations(self, other: Code) -> None:
        """Declare what another part of the module calls."""
        self._called |= other._called

    def vector_type(self, width: int) -> str:
        """The type of so many products side by side."""
        return f"<{width} x double>" if width > 1 else self.number

    @property
    def align(self) -> int:
        """Bytes that a number's place is a multiple of."""
        return 8 * max(self.lanes, 1)

    @property
    def calling(self) -> str:
        """How pieces are called: short kernels are one function, which spares up to a third of their time."""
        return "alwaysinline" if self.is_one_function or self.written < _SHORT else "noinline"

    @property
    def passed(self) -> str:
        """The arguments that pieces are called with, but for `k`."""
        return PASSED.replace("double", self.number)

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
        text += self._helpers.values()
        if not self.lanes and DECLARATIONS[0] in self._called:
            text.append(sincos_function(f"{self.symbol}.sincos"))
        calling = self.calling
        for piece in self.pieces:
            given = ARGUMENTS.replace("double", self.number)
            head = f"define internal void @{piece.name}({given}) {calling} nounwind"
            body = "\n".join(_closed(piece.lines, self.rounded) if calling == "alwaysinline" else piece.lines)
            text.append(f"{head} {{\nentry:\n{body}\nbr label %done\ndone:\nret void\n}}\n")
        arguments = f"{self.number} %t, ptr noalias %y, ptr noalias %p, ptr noalias %out"
        scratch = f"%scratch = alloca {self.number}, i64 {max(self.n_slots, 1)}, align {max(64, self.align)}"
        text.append(self._whole(f"({arguments}) nounwind", f"{scratch}\n{main}"))
        whole = "".join(text)
        return inlined_where_few(whole) if self.lanes else whole

    def _whole(self, head: str, body: str) -> str:
        """The kernel; where a register does not hold all members, a function of as many as it does, and its calls."""
        if self._rows == self.lanes:
            return f"define void @{self.symbol}{head} {{\nentry:\n{body}\n}}\n"
        part, all_lanes = f"{self.symbol}.part", lanes_type(self._rows)
        lines = [
            f"define internal void @{part}{head.replace('nounwind', 'noinline nounwind')} {{\nentry:\n{body}\n}}"
        ]
        lines += [
            f"define void @{self.symbol}({all_lanes} %t, ptr noalias %y, ptr noalias %p, ptr noalias %out) nounwind {{",
            "%order = load double, ptr %out, align 8",
        ]
        for first in range(0, self._rows, self.lanes):
            places = ", ".join(f"i32 {lane}" for lane in range(first, first + self.lanes))
            lines += [
                f"%t.{first} = shufflevector {all_lanes} %t, {all_lanes} poison, <{self.lanes} x i32> <{places}>",
                *(
                    f"%{array}.{first} = getelementptr inbounds double, ptr %{array}, i64 {first}"
                    for array in ("y", "p", "out")
                ),
                f"store double %order, ptr %out.{first}, align 8",
                f"call void @{part}({self.number} %t.{first}, ptr %y.{first}, ptr %p.{first}, ptr %out.{first})",
            ]
        return "\n".join([*lines, "ret void", "}", ""])


def _closed(lines: list[str], rounded: set[str]) -> list[str]:
    """The lines of a piece whose results stay what they are where the piece stands within a longer function.

    LLVM makes one operation of a product and a sum if nothing else has the product. Of what a piece stores, it would
    do so with a sum of another piece once it sees both, and the motion would differ in its last bits.
    """
    stored = rounded | {found[1] for line in lines if (found := _STORED.match(line))}
    return [
        line.replace("fmul contract ", "fmul ", 1)
        if (found := _PRODUCT.match(line)) and found[1] in stored
        else line
        for line in lines
    ]


def fused(code: Code, width: int, a: str, b: str, c: str) -> str:
    """The operation a b + c on vectors."""
    kind = code.vector_type(width)
    suffix = f"v{width}f64" if width > 1 else lanes_suffix(code.lanes)
    code.declare(f"declare {kind} @llvm.fmuladd.{suffix}({kind}, {kind}, {kind})")
    return f"call {kind} @llvm.fmuladd.{suffix}({kind} {a}, {kind} {b}, {kind} {c})"


def values_text(code: Code, width: int, values: list[float]) -> str:
    """Constants, one for each lane; those of empty lanes do not matter."""
    if width == 1:
        return lanes_constant(values[0], code.lanes)
    filled = values + [values[-1]] * (width - len(values))
    return "<" + ", ".join(f"double {constant(value)}" for value in filled) + ">"


def splat(code: Code, width: int, value: str, to: str) -> list[str]:
    """The same number in every lane."""
    if width == 1 and not code.lanes:
        return [f"{to} = fadd double {value}, {constant(-0.0)}"]
    width = max(width, code.lanes)
    kind, zeros = f"<{width} x double>", ", ".join("i32 0" for _ in range(width))
    return [
        f"{to}.i = insertelement {kind} poison, double {value}, i32 0",
        f"{to} = shufflevector {kind} {to}.i, {kind} poison, <{width} x i32> <{zeros}>",
    ]


def load_row(code: Code, width: int, start: int, index: str, to: str) -> list[str]:
    """Load row `index` of an array in scratch."""
    return [
        f"{to}.i = mul i64 {index}, {width}",
        f"{to}.o = add i64 {to}.i, {start}",
        f"{to}.a = getelementptr inbounds {code.number}, ptr %scratch, i64 {to}.o",
        f"{to} = load {code.vector_type(width)}, ptr {to}.a, align {code.align * width}",
    ]
