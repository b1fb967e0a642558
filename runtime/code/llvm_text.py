"""Write straight-line LLVM IR as text, long functions in pieces that share a scratch array."""

from __future__ import annotations

import struct

INTRINSICS = ("sin", "cos", "exp", "log", "sqrt", "fabs", "pow", "copysign")
LIBM = ("tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh")
BINARY = ("pow", "copysign", "atan2")

# LLVM's time per operation grows above about 4000 operations a function.
PIECE_OPERATIONS = 3000

_DECLARATIONS = {
    **{name: f"llvm.{name}.f64" for name in INTRINSICS},
    **{name: name for name in LIBM},
}
_ARGUMENTS = "double %t, ptr noalias %y, ptr noalias %p, ptr noalias %out"
_PASSED = "double %t, ptr %y, ptr %p, ptr %out"


class StraightLine:
    """The body of one kernel while it is written.

    Values are the strings that stand for them in the IR: a constant, `%t`, `%y3`, `%p0`, or `%v17`.
    """

    def __init__(self) -> None:
        self.operations = 0
        self._pieces: list[list[str]] = [[]]
        self._lines = self._pieces[0]
        self._in_piece = 0  # operations
        self._n_values = 0
        self._local: set[str] = set()  # what this piece has computed or loaded
        self._home: dict[str, int] = {}  # the piece that computes a value which later pieces need
        self._spans: dict[str, list[int]] = {}  # crossing value: the pieces that store and load it
        self._called: set[str] = set()

    def operation(self, instruction: str, left: str, right: str) -> str:
        """Write `instruction` (fadd, fsub, fmul, fdiv) and return its value."""
        return self._value(f"{instruction} double {left}, {right}")

    def negative(self, value: str) -> str:
        """Write the change of sign, which also turns 0 to -0."""
        return self._value(f"fneg double {value}")

    def call(self, function: str, arguments: list[str]) -> str:
        """Write the call of a mathematical function."""
        self._called.add(function)
        passed = ", ".join(f"double {argument}" for argument in arguments)
        return self._value(f"call double @{_DECLARATIONS[function]}({passed})")

    def select(self, comparison: str, left: str, right: str, chosen: str, other: str) -> str:
        """Write `chosen if left < right else other`; comparison is olt or ole."""
        condition = f"%c{self._n_values}"
        self._lines.append(f"{condition} = fcmp {comparison} double {left}, {right}")
        return self._value(f"select i1 {condition}, double {chosen}, double {other}")

    def load(self, array: str, index: int) -> str:
        """Return the value of `y[index]` or `p[index]`, loaded once in each piece."""
        value = f"%{array}{index}"
        if value not in self._local:
            self._local.add(value)
            self._lines.append(f"%a{array}{index} = getelementptr inbounds double, ptr %{array}, i64 {index}")
            self._lines.append(f"{value} = load double, ptr %a{array}{index}, align 8")
        return value

    def store(self, index: int, value: str) -> None:
        """Write `out[index] = value`."""
        place = f"%o{self._n_values}.{len(self._lines)}"
        self._lines.append(f"{place} = getelementptr inbounds double, ptr %out, i64 {index}")
        self._lines.append(f"store double {value}, ptr {place}, align 8")

    def reuse(self, value: str) -> str:
        """Return a value that an earlier statement named; it may come from an earlier piece."""
        if value in self._local or value[0] != "%" or value == "%t":
            return value
        if value[1] in "yp":
            return self.load(value[1], int(value[2:]))
        piece = len(self._pieces) - 1
        span = self._spans.get(value)
        if span is None:
            home = self._home[value]
            self._pieces[home].append(f"store double {value}, ptr %s{value[1:]}, align 8")
            span = self._spans[value] = [home]
        span.append(piece)
        self._local.add(value)
        self._lines.append(f"{value} = load double, ptr %s{value[1:]}, align 8")
        return value

    def end_statement(self) -> None:
        """Begin a new piece when this one is long enough."""
        if self._in_piece < PIECE_OPERATIONS:
            return
        home = len(self._pieces) - 1
        for value in self._local:
            if value[1] == "v":
                self._home.setdefault(value, home)
        self._lines = []
        self._pieces.append(self._lines)
        self._local = set()
        self._in_piece = 0

    def text(self, symbol: str) -> str:
        """Return the whole module's IR; the kernel's name in it is `symbol`."""
        if not self._lines and len(self._pieces) > 1:
            self._pieces.pop()
        declarations = "".join(map(_declaration, sorted(self._called)))
        if len(self._pieces) == 1:
            body = "\n".join(self._lines)
            return f"{declarations}define void @{symbol}({_ARGUMENTS}) nounwind {{\n{body}\nret void\n}}\n"
        slots, n_slots = self._slots()
        addresses: list[list[str]] = [[] for _ in self._pieces]
        for value, span in self._spans.items():
            for piece in span:
                addresses[piece].append(
                    f"%s{value[1:]} = getelementptr inbounds double, ptr %scratch, i64 {slots[value]}"
                )
        text = [declarations]
        for number, lines in enumerate(self._pieces):
            body = "\n".join((*addresses[number], *lines))
            arguments = f"{_ARGUMENTS}, ptr noalias %scratch"
            head = f"define internal void @{symbol}.{number}({arguments}) noinline nounwind"
            text.append(f"{head} {{\n{body}\nret void\n}}\n")
        calls = "\n".join(
            f"call void @{symbol}.{number}({_PASSED}, ptr %scratch)" for number in range(len(self._pieces))
        )
        scratch = f"%scratch = alloca double, i64 {n_slots}, align 64"
        text.append(f"define void @{symbol}({_ARGUMENTS}) nounwind {{\n{scratch}\n{calls}\nret void\n}}\n")
        return "".join(text)

    def _value(self, right_side: str) -> str:
        value = f"%v{self._n_values}"
        self._n_values += 1
        self.operations += 1
        self._in_piece += 1
        self._local.add(value)
        self._lines.append(f"{value} = {right_side}")
        return value

    def _slots(self) -> tuple[dict[str, int], int]:
        """Give each crossing value a place in the scratch array, free again after its last reader."""
        begins: list[list[str]] = [[] for _ in self._pieces]
        ends: list[list[str]] = [[] for _ in self._pieces]
        for value, span in self._spans.items():
            begins[span[0]].append(value)
            ends[span[-1]].append(value)
        slots: dict[str, int] = {}
        free: list[int] = []
        n_slots = 0
        for piece in range(len(self._pieces)):
            for value in begins[piece]:
                if free:
                    slots[value] = free.pop()
                else:
                    slots[value] = n_slots
                    n_slots += 1
            # After this piece's own values have their places: it reads the old and writes the new ones.
            free.extend(slots[value] for value in ends[piece])
        return slots, max(n_slots, 1)


def constant(value: float) -> str:
    """Return a float64 as LLVM writes it, exactly."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def _declaration(function: str) -> str:
    parameters = "double, double" if function in BINARY else "double"
    attributes = "" if function in INTRINSICS else " nounwind willreturn memory(none)"
    return f"declare double @{_DECLARATIONS[function]}({parameters}){attributes}\n"
