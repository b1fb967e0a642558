"""A small language for loops over lanes: Python expressions become LLVM IR.

`Code` writes one function; its values know their type and take part in expressions: vectors of numbers, one for each
member that is under way (`LANES`), flags of lanes, and plain integers, numbers and flags of the loop around them. What
one lane holds never reaches another one, and no operation depends on how many there are, so a member's bits do not.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from symgen.runtime.code.llvm_text import constant, lanes_constant, lanes_suffix, lanes_type
from symgen.runtime.code.sincos import lanes_sincos

# Kinds of values: numbers and flags of all lanes; a number, an integer, a flag, an address.
LANES, FLAGS, NUMBER, INTEGER, FLAG, ADDRESS = "lanes", "flags", "number", "integer", "flag", "address"


@dataclass(frozen=True, eq=False)
class Value:
    """A value of the function that is being written.

    Operators write instructions: arithmetic on LANES, NUMBER and INTEGER, comparisons, `&`, `|`, `~` on flags.
    Numbers beside lanes stand for all of them.
    """

    code: Code
    text: str
    kind: str

    def __add__(self, other: Any) -> Value:
        return self.code.arithmetic("add", self, other)

    def __radd__(self, other: Any) -> Value:
        return self.code.arithmetic("add", other, self)

    def __sub__(self, other: Any) -> Value:
        return self.code.arithmetic("sub", self, other)

    def __rsub__(self, other: Any) -> Value:
        return self.code.arithmetic("sub", other, self)

    def __mul__(self, other: Any) -> Value:
        return self.code.arithmetic("mul", self, other)

    def __rmul__(self, other: Any) -> Value:
        return self.code.arithmetic("mul", other, self)

    def __truediv__(self, other: Any) -> Value:
        return self.code.arithmetic("div", self, other)

    def __rtruediv__(self, other: Any) -> Value:
        return self.code.arithmetic("div", other, self)

    def __neg__(self) -> Value:
        return self.code.new(f"fneg {self.code.type_of(self.kind)} {self.text}", self.kind)

    def __lt__(self, other: Any) -> Value:
        return self.code.compare("lt", self, other)

    def __le__(self, other: Any) -> Value:
        return self.code.compare("le", self, other)

    def __gt__(self, other: Any) -> Value:
        return self.code.compare("gt", self, other)

    def __ge__(self, other: Any) -> Value:
        return self.code.compare("ge", self, other)

    def __and__(self, other: Value) -> Value:
        return self.code.logic("and", self, other)

    def __or__(self, other: Value) -> Value:
        return self.code.logic("or", self, other)

    def __invert__(self) -> Value:
        true = "splat (i1 true)" if self.kind == FLAGS else "true"
        return self.code.new(f"xor {self.code.type_of(self.kind)} {self.text}, {true}", self.kind)


class Variable:
    """What may change while the function runs."""

    def __init__(self, code: Code, start: Value) -> None:
        self._code, self._kind = code, start.kind
        self._place = code.at_entry(f"alloca {code.type_of(start.kind)}, align {code.align_of(start.kind)}")
        self.value = start

    @property
    def value(self) -> Value:
        return self._code.load(self._place, self._kind)

    @value.setter
    def value(self, new: Value) -> None:
        self._code.store(new, self._place)


class Rows:
    """An array in memory with a vector of all lanes in each place, from an address on.

    `rows[i]` reads, `rows[i] = value` writes; `i` may be an integer of either language.
    """

    def __init__(self, code: Code, address: Value, kind: str = LANES) -> None:
        self.code, self.address, self._kind = code, address, kind

    def __getitem__(self, index: int | Value) -> Value:
        return self.code.load(self._place(index), self._kind)

    def __setitem__(self, index: int | Value, value: Value | float) -> None:
        self.code.store(self.code.as_kind(value, self._kind), self._place(index))

    def behind(self, first: int | Value) -> Rows:
        """The rows from `first` on."""
        return Rows(self.code, self._place(first), self._kind)

    def _place(self, index: int | Value) -> Value:
        at = self.code.integer(index)
        element = self.code.type_of(self._kind)
        return self.code.new(
            f"getelementptr inbounds {element}, ptr {self.address.text}, i64 {at.text}", ADDRESS
        )

    def single(self) -> Rows:
        """The same memory as plain numbers: that of lane l in row i is at i * lanes + l."""
        return Rows(self.code, self.address, NUMBER)


class Code:
    """One function `void name(ptr table, …)` while it is written.

    Parameters
    ----------
    name : str
    lanes : int
    arguments : tuple of str
        Names of integers that it takes besides the table.
    """

    def __init__(self, name: str, lanes: int, arguments: tuple[str, ...] = ()) -> None:
        self.name, self.lanes = name, lanes
        self._arguments = arguments
        self._entry: list[str] = []
        self._lines: list[str] = []
        self._n = 0
        self.declared: set[str] = set()

    # Text.

    def _name(self) -> str:
        self._n += 1
        return f"%n{self._n}"

    def new(self, right_side: str, kind: str) -> Value:
        """Write an instruction and return its value."""
        name = self._name()
        self._lines.append(f"{name} = {right_side}")
        return Value(self, name, kind)

    def at_entry(self, right_side: str) -> Value:
        """Write an instruction at the function's beginning."""
        name = self._name()
        self._entry.append(f"{name} = {right_side}")
        return Value(self, name, ADDRESS)

    def text(self) -> str:
        """Return the IR of the function."""
        listed = ", ".join(["ptr %table", *(f"i64 %{name}" for name in self._arguments)])
        body = "\n".join(["entry:", *self._entry, *self._lines, "ret void"])
        return f"define void @{self.name}({listed}) nounwind {{\n{body}\n}}\n"

    def argument(self, name: str) -> Value:
        return Value(self, f"%{name}", INTEGER)

    def type_of(self, kind: str) -> str:
        return {
            LANES: lanes_type(self.lanes),
            FLAGS: f"<{self.lanes} x i1>",
            NUMBER: "double",
            INTEGER: "i64",
            FLAG: "i1",
            ADDRESS: "ptr",
        }[kind]

    def align_of(self, kind: str) -> int:
        return {LANES: 8 * self.lanes, FLAG: 1, FLAGS: max(1, self.lanes // 8)}.get(kind, 8)

    # Values.

    def number(self, value: float) -> Value:
        return Value(self, constant(float(value)), NUMBER)

    def all_lanes(self, value: float) -> Value:
        return Value(self, lanes_constant(float(value), self.lanes), LANES)

    def integer(self, value: int | Value) -> Value:
        return value if isinstance(value, Value) else Value(self, str(value), INTEGER)

    def flags(self, value: bool) -> Value:
        return Value(self, f"splat (i1 {str(value).lower()})", FLAGS)

    def flag(self, value: bool) -> Value:
        return Value(self, str(value).lower(), FLAG)

    def as_kind(self, value: Any, kind: str) -> Value:
        """Return a value as one of this kind: a number beside lanes stands for all of them."""
        if not isinstance(value, Value):
            if kind == INTEGER:
                return self.integer(value)
            return self.all_lanes(value) if kind == LANES else self.number(value)
        if value.kind == kind:
            return value
        if value.kind == NUMBER and kind == LANES:
            if value.text[0] != "%":
                return Value(self, f"splat (double {value.text})", LANES)
            vector, zeros = self.type_of(LANES), f"<{self.lanes} x i32> zeroinitializer"
            one = self.new(f"insertelement {vector} poison, double {value.text}, i32 0", LANES)
            return self.new(f"shufflevector {vector} {one.text}, {vector} poison, {zeros}", LANES)
        raise TypeError(f"{value.kind} cannot be taken as {kind}")

    def _alike(self, a: Any, b: Any) -> tuple[Value, Value, str]:
        kinds = {x.kind for x in (a, b) if isinstance(x, Value)}
        kind = LANES if LANES in kinds else next(iter(kinds))
        return self.as_kind(a, kind), self.as_kind(b, kind), kind

    def arithmetic(self, operation: str, a: Any, b: Any) -> Value:
        first, second, kind = self._alike(a, b)
        instruction = operation if kind == INTEGER else f"f{operation}"
        return self.new(f"{instruction} {self.type_of(kind)} {first.text}, {second.text}", kind)

    def compare(self, relation: str, a: Any, b: Any) -> Value:
        """Write a comparison; with a number that is not one it is false."""
        first, second, kind = self._alike(a, b)
        instruction = f"icmp {'s' * (relation not in ('eq', 'ne'))}" if kind == INTEGER else "fcmp o"
        return self.new(
            f"{instruction}{relation} {self.type_of(kind)} {first.text}, {second.text}",
            FLAGS if kind == LANES else FLAG,
        )

    def equal(self, a: Any, b: Any) -> Value:
        return self.compare("eq", a, b)

    def logic(self, operation: str, a: Value, b: Value) -> Value:
        return self.new(f"{operation} {self.type_of(a.kind)} {a.text}, {b.text}", a.kind)

    def select(self, condition: Value, a: Any, b: Any) -> Value:
        """Return `a` where the condition holds, else `b`."""
        if condition.kind == FLAGS:
            first, second = self.as_kind(a, LANES), self.as_kind(b, LANES)
        else:
            first, second, _ = self._alike(a, b)
        kind = self.type_of(first.kind)
        return self.new(
            f"select {self.type_of(condition.kind)} {condition.text}, {kind} {first.text}, {kind} {second.text}",
            first.kind,
        )

    def larger(self, a: Any, b: Any) -> Value:
        """Return `b` where it is larger than `a`, else `a`: what is not a number stays where it is `a`."""
        first, second, _ = self._alike(a, b)
        return self.select(second > first, second, first)

    def smaller(self, a: Any, b: Any) -> Value:
        first, second, _ = self._alike(a, b)
        return self.select(second < first, second, first)

    def fused(self, a: Any, b: Any, c: Any) -> Value:
        """a b + c, rounded once where the processor can."""
        values = [self.as_kind(x, LANES).text for x in (a, b, c)]
        return self._intrinsic("fmuladd", values)

    def root(self, a: Value) -> Value:
        return self._intrinsic("sqrt", [a.text])

    def size(self, a: Value) -> Value:
        """The absolute value."""
        return self._intrinsic("fabs", [a.text])

    def _intrinsic(self, function: str, values: list[str]) -> Value:
        kind = self.type_of(LANES)
        symbol = f"llvm.{function}.{lanes_suffix(self.lanes)}"
        self.declared.add(f"declare {kind} @{symbol}({', '.join([kind] * len(values))})")
        passed = ", ".join(f"{kind} {value}" for value in values)
        return self.new(f"call {kind} @{symbol}({passed})", LANES)

    def sincos(self, a: Value) -> tuple[Value, Value]:
        """Sine and cosine, as the model's functions have them."""
        text, declared = lanes_sincos("symgen.sincos", self.lanes)
        self.declared |= {text, *declared}
        kind = self.type_of(LANES)
        pair = self.new(f"call {{{kind}, {kind}}} @symgen.sincos({kind} {a.text})", LANES)
        first, second = (self.new(f"extractvalue {{{kind}, {kind}}} {pair.text}, {k}", LANES) for k in (0, 1))
        return first, second

    def lanes_of(self, numbers: list[Value]) -> Value:
        """Numbers, one for each lane."""
        kind, whole = self.type_of(LANES), "poison"
        for lane, number in enumerate(numbers):
            whole = self.new(f"insertelement {kind} {whole}, double {number.text}, i32 {lane}", LANES).text
        return Value(self, whole, LANES)

    def of_lane(self, a: Value, lane: int) -> Value:
        """The number of one lane."""
        return self.new(f"extractelement {self.type_of(LANES)} {a.text}, i32 {lane}", NUMBER)

    def bits_as_number(self, a: Value) -> Value:
        """The bits of numbers, taken for whole numbers."""
        bits = self.new(f"bitcast {self.type_of(LANES)} {a.text} to <{self.lanes} x i64>", LANES)
        return self.new(f"sitofp <{self.lanes} x i64> {bits.text} to {self.type_of(LANES)}", LANES)

    def number_of_bits(self, a: Value) -> Value:
        """The inverse: numbers whose bits are the whole parts of these, which must fit."""
        bits = self.new(f"fptosi {self.type_of(LANES)} {a.text} to <{self.lanes} x i64>", LANES)
        return self.new(f"bitcast <{self.lanes} x i64> {bits.text} to {self.type_of(LANES)}", LANES)

    def all_flags(self, flag: Value) -> Value:
        """A flag for all lanes."""
        kind = self.type_of(FLAGS)
        return self.new(f"select i1 {flag.text}, {kind} splat (i1 true), {kind} splat (i1 false)", FLAGS)

    def finite(self, a: Value) -> Value:
        """Whether numbers are finite."""
        return self.size(a) < float("inf")

    def any(self, flags: Value) -> Value:
        return self.new(f"icmp ne i{self.lanes} {self._bits(flags)}, 0", FLAG)

    def _bits(self, flags: Value) -> str:
        return self.new(f"bitcast {self.type_of(FLAGS)} {flags.text} to i{self.lanes}", INTEGER).text

    def quotient(self, a: Value, b: Value) -> Value:
        return self.new(f"udiv i64 {a.text}, {b.text}", INTEGER)

    def remainder(self, a: Value, b: Value) -> Value:
        return self.new(f"urem i64 {a.text}, {b.text}", INTEGER)

    def mask(self, flags: Value) -> Value:
        """Return flags as the bits of an integer, lane 0 the lowest."""
        bits = self._bits(flags)
        if self.lanes == 64:
            return Value(self, bits, INTEGER)
        return self.new(f"zext i{self.lanes} {bits} to i64", INTEGER)

    def bit(self, mask: Value, lane: Value) -> Value:
        """Whether the bit of a lane is set."""
        moved = self.new(f"lshr i64 {mask.text}, {lane.text}", INTEGER)
        return self.new(f"trunc i64 {moved.text} to i1", FLAG)

    def to_integer(self, number: Value) -> Value:
        return self.new(f"fptosi double {number.text} to i64", INTEGER)

    def to_number(self, integer: Value) -> Value:
        return self.new(f"sitofp i64 {integer.text} to double", NUMBER)

    # Memory.

    def load(self, place: Value, kind: str) -> Value:
        return self.new(f"load {self.type_of(kind)}, ptr {place.text}, align {self.align_of(kind)}", kind)

    def store(self, value: Value, place: Value) -> None:
        kind = value.kind
        self._lines.append(
            f"store {self.type_of(kind)} {value.text}, ptr {place.text}, align {self.align_of(kind)}"
        )

    def slot(self, index: int, kind: str) -> Value:
        """Return what stands in the table that the function is given: an address, an integer or a number."""
        place = self.new(f"getelementptr inbounds i64, ptr %table, i64 {index}", ADDRESS)
        return self.load(place, kind)

    def set_slot(self, index: int, value: Value) -> None:
        self.store(value, self.new(f"getelementptr inbounds i64, ptr %table, i64 {index}", ADDRESS))

    # Calls.

    def call_kernel(self, kernel: Value, t: Value, y: Rows, p: Rows, out: Rows) -> None:
        """Call a function of the model for all lanes."""
        self._lines.append(
            f"call void {kernel.text}({self.type_of(LANES)} {t.text}, ptr {y.address.text}, "
            f"ptr {p.address.text}, ptr {out.address.text})"
        )

    def call_plain(self, kernel: Value, t: Value, y: Rows, p: Rows, out: Rows) -> None:
        """Call a function of the model for one member."""
        self._lines.append(
            f"call void {kernel.text}(double {t.text}, ptr {y.address.text}, ptr {p.address.text}, "
            f"ptr {out.address.text})"
        )

    def call(self, function: str, *arguments: Value) -> None:
        """Call another function of this language."""
        passed = "".join(f", i64 {argument.text}" for argument in arguments)
        self._lines.append(f"call void @{function}(ptr %table{passed})")

    # Control.

    def variable(self, start: Any, kind: str = LANES) -> Variable:
        return Variable(self, start if isinstance(start, Value) else self.as_kind(start, kind))

    @contextmanager
    def each(self, end: int | Value, start: int | Value = 0) -> Iterator[Value]:
        """Run the block for each integer from `start` up to, not including, `end`."""
        counter = Variable(self, self.integer(start))
        head, body, done = (self._label(word) for word in ("head", "body", "done"))
        self._jump(head)
        self._begin(head)
        here = counter.value
        self._branch(here < self.integer(end), body, done)
        self._begin(body)
        yield here
        counter.value = here + 1
        self._jump(head)
        self._begin(done)

    @contextmanager
    def down(self, start: int | Value, last: int | Value) -> Iterator[Value]:
        """Run the block for each integer from `start` down to `last`."""
        counter = Variable(self, self.integer(start))
        head, body, done = (self._label(word) for word in ("head", "body", "done"))
        self._jump(head)
        self._begin(head)
        here = counter.value
        self._branch(here >= self.integer(last), body, done)
        self._begin(body)
        yield here
        counter.value = here - 1
        self._jump(head)
        self._begin(done)

    @contextmanager
    def when(self, condition: Value) -> Iterator[None]:
        """Run the block where a flag is set."""
        body, done = self._label("then"), self._label("done")
        self._branch(condition, body, done)
        self._begin(body)
        yield
        self._jump(done)
        self._begin(done)

    @contextmanager
    def forever(self) -> Iterator[Any]:
        """Run the block again and again; it yields `leave(condition)`."""
        head, done = self._label("head"), self._label("done")

        def leave(condition: Value) -> None:
            go_on = self._label("on")
            self._branch(condition, done, go_on)
            self._begin(go_on)

        self._jump(head)
        self._begin(head)
        yield leave
        self._jump(head)
        self._begin(done)

    def _label(self, word: str) -> str:
        self._n += 1
        return f"{word}{self._n}"

    def _begin(self, label: str) -> None:
        self._lines.append(f"{label}:")

    def _jump(self, label: str) -> None:
        self._lines.append(f"br label %{label}")

    def _branch(self, condition: Value, yes: str, no: str) -> None:
        self._lines.append(f"br i1 {condition.text}, label %{yes}, label %{no}")
