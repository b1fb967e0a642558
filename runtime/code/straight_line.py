"""Straight-line LLVM IR, written operation by operation; long functions in pieces that share a scratch array."""

from __future__ import annotations

from symgen.runtime.code import dense_ldl, front_ldl
from symgen.runtime.code.llvm_text import call_arguments, function, loop, math_symbol
from symgen.runtime.graph.form import Place

# LLVM's time per line, be it an operation, a load or a store, grows with the length of a function.
PIECE_LINES = 600

_KERNEL = {"t": "double", "y": "ptr", "p": "ptr", "out": "ptr"}


class StraightLine:
    """The body of one kernel, or of a loop in it, while it is written.

    Values are the strings that stand for them in the IR: a constant, `%t`, `%y3`, `%p0`, or `%v17`.

    Parameters
    ----------
    extra : dict of str to str
        Arguments beyond `t, y, p, out`, with their types: arrays (`ptr`), and in loops `k` (`i64`).
    """

    def __init__(self, extra: dict[str, str] | None = None) -> None:
        self.operations = 0
        self.definitions: list[str] = []  # of functions that this code calls
        self.solvers: dict[str, str] = {}  # definitions of solvers, and what they need, by name
        self._arguments = {**_KERNEL, **(extra or {})}
        self._pieces: list[list[str]] = [[]]
        self._lines = self._pieces[0]
        self._n_values = 0
        self._local: set[str] = set()  # what this piece has computed or loaded
        self._loaded: dict[str, tuple[str, Place]] = {}  # values that stand in an array
        self._home: dict[str, int] = {}  # the piece that computes a value which later pieces need
        self._spans: dict[str, list[int]] = {}  # crossing value: the pieces that store and load it
        self.called: set[str] = set()
        self.tables: set[str] = set()

    def operation(self, instruction: str, left: str, right: str) -> str:
        """Write `instruction` (fadd, fsub, fmul, fdiv) and return its value."""
        return self._value(f"{instruction} double {left}, {right}")

    def negative(self, value: str) -> str:
        """Write the change of sign, which also turns 0 to -0."""
        return self._value(f"fneg double {value}")

    def call(self, function: str, arguments: list[str]) -> str:
        """Write the call of a mathematical function."""
        self.called.add(function)
        passed = ", ".join(f"double {argument}" for argument in arguments)
        return self._value(f"call double @{math_symbol(function)}({passed})")

    def select(self, comparison: str, left: str, right: str, chosen: str, other: str) -> str:
        """Write `chosen if left < right else other`; comparison is olt or ole."""
        condition = f"%c{self._n_values}"
        self._lines.append(f"{condition} = fcmp {comparison} double {left}, {right}")
        return self._value(f"select i1 {condition}, double {chosen}, double {other}")

    def load(self, array: str, index: Place) -> str:
        """Return the value at a place in `y`, `p` or an array that is passed besides, loaded once in each piece."""
        value = f"%{array}{index.label()}"
        if value not in self._local:
            self._local.add(value)
            self._loaded[value] = (array, index)
            address = f"%a{value[1:]}"
            self._address(address, array, index)
            self._lines.append(f"{value} = load double, ptr {address}, align 8")
        return value

    def later_load(self, array: str, index: Place) -> str:
        """Return the name of a value that `reuse` loads where it is used."""
        value = f"%{array}{index.label()}"
        self._loaded[value] = (array, index)
        return value

    def fresh_load(self, array: str, index: Place) -> str:
        """Return what stands in an array now, even if it was loaded before."""
        place = f"%f{self._n_values}"
        self._address(place, array, index)
        return self._value(f"load double, ptr {place}, align 8", free=True)

    def store(self, index: Place, value: str, array: str = "out") -> None:
        """Write `out[index] = value`."""
        place = f"%o{self._n_values}.{len(self._lines)}"
        self._address(place, array, index)
        self._lines.append(f"store double {value}, ptr {place}, align 8")

    def clear(self, array: str, first: int, length: int) -> None:
        """Fill a part of an array with zeros."""
        place = f"%o{self._n_values}.{len(self._lines)}"
        self._address(place, array, Place(first))
        self.solvers["memset"] = "declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)\n"
        self._lines.append(f"call void @llvm.memset.p0.i64(ptr {place}, i8 0, i64 {8 * length}, i1 false)")

    def solve(self, solver: str, arrays: list[int], sizes: list[int]) -> None:
        """Call a solver with parts of the array `work`, which begin at the places `arrays`."""
        symbol, definition = dense_ldl.definition(solver, sizes)
        self._call_solver(symbol, definition, arrays)
        self.operations += dense_ldl.operations(solver, sizes)

    def solve_fronts(
        self, solver: str, arrays: list[int], table: tuple[str, tuple[int, ...]], n: int
    ) -> None:
        """Call a solver by `n` fronts that a table describes, given by its name and entries."""
        symbol, definition = front_ldl.definition(solver, table[1], n)
        self.tables.add(table[0])
        self._call_solver(symbol, definition, arrays, f", ptr @{table[0]}")

    def _call_solver(self, symbol: str, definition: str, arrays: list[int], more: str = "") -> None:
        self.solvers[symbol] = definition
        places = [f"%o{self._n_values}.{len(self._lines)}.{k}" for k in range(len(arrays))]
        for place, first in zip(places, arrays, strict=True):
            self._address(place, "work", Place(first))
        self._lines.append(f"call void @{symbol}({', '.join(f'ptr {place}' for place in places)}{more})")

    def _address(self, name: str, array: str, index: Place) -> None:
        write = self._lines.append
        offset = str(index.first)
        if index.table:
            self.tables.add(index.table)
            write(f"{name}.t = getelementptr inbounds i64, ptr @{index.table}, i64 %k")
            write(f"{name}.i = load i64, ptr {name}.t, align 8")
            offset = f"{name}.i"
            if index.first:
                write(f"{name}.s = add nuw nsw i64 {offset}, {index.first}")
                offset = f"{name}.s"
        elif index.step:
            write(f"{name}.m = mul nuw nsw i64 %k, {index.step}")
            write(f"{name}.i = add nuw nsw i64 {name}.m, {index.first}")
            offset = f"{name}.i"
        write(f"{name} = getelementptr inbounds double, ptr %{array}, i64 {offset}")

    def reuse(self, value: str) -> str:
        """Return a value that an earlier statement named; it may come from an earlier piece."""
        if value in self._local or value[0] != "%" or value == "%t":
            return value
        if value in self._loaded:
            return self.load(*self._loaded[value])
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

    def stands_in(self, value: str) -> tuple[str, Place] | None:
        """Where a value was loaded from; None if it was computed."""
        return self._loaded.get(value)

    def run_loop(self, symbol: str, count: int, body: StraightLine) -> None:
        """Write a loop over `k` from 0 to `count` around `body`, as a function of its own, and call it here."""
        passed = dict(body._arguments)
        del passed["k"]
        entry, lines = body.block(symbol)
        self.definitions += [*body.definitions, loop(symbol, passed, count, entry, lines)]
        self.called |= body.called
        self.tables |= body.tables
        self.solvers |= body.solvers
        self.operations += body.operations
        self._lines.append(f"call void @{symbol}({call_arguments(passed)})")

    def end_statement(self) -> None:
        """Begin a new piece when this one is long enough."""
        if len(self._lines) < PIECE_LINES:
            return
        home = len(self._pieces) - 1
        for value in self._local:
            if value[1] == "v":
                self._home.setdefault(value, home)
        self._lines = []
        self._pieces.append(self._lines)
        self._local = set()

    def block(self, symbol: str) -> tuple[list[str], list[str]]:
        """Return what stands once at a function's beginning, and this code itself.

        Long code calls its pieces, whose definitions are added to `definitions`.
        """
        if not self._lines and len(self._pieces) > 1:
            self._pieces.pop()
        if len(self._pieces) == 1:
            return [], self._pieces[0]
        slots, n_slots = self._slots()
        addresses: list[list[str]] = [[] for _ in self._pieces]
        for value, span in self._spans.items():
            for piece in span:
                addresses[piece].append(
                    f"%s{value[1:]} = getelementptr inbounds double, ptr %scratch, i64 {slots[value]}"
                )
        arguments = {**self._arguments, "scratch": "ptr"}
        for number, lines in enumerate(self._pieces):
            name = f"{symbol}.{number}"
            self.definitions.append(
                function(name, arguments, [*addresses[number], *lines], "internal", "noinline ")
            )
        calls = [
            f"call void @{symbol}.{number}({call_arguments(arguments)})"
            for number in range(len(self._pieces))
        ]
        return [f"%scratch = alloca double, i64 {n_slots}, align 64"], calls

    def text(self, symbol: str, linkage: str = "") -> str:
        """Return the IR of the function `symbol` and of those that it calls, without declarations."""
        entry, lines = self.block(symbol)
        whole = function(symbol, self._arguments, [*entry, *lines], linkage)
        return "".join((*self.definitions, whole))

    def _value(self, right_side: str, *, free: bool = False) -> str:
        value = f"%v{self._n_values}"
        self._n_values += 1
        if not free:
            self.operations += 1
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
