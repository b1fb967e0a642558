"""Lower the form of a function to LLVM IR.

The translation is one to one, in the order in which Python evaluates: no reassociation, no fused multiply-
add. A function is lowered whole, or in two: what its hoisted assignments compute from `p` alone (setup), and the
rest, which finds those values in an array (body).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NoReturn

from symgen.runtime.code import angles, dense_ldl, front_ldl
from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.code.llvm_text import (
    VECTOR_INTRINSICS,
    call_arguments,
    function,
    lanes_call,
    lanes_constant,
    lanes_type,
    loop,
    math_symbol,
)
from symgen.runtime.code.parse import LARGEST
from symgen.runtime.code.reciprocal_root import reciprocal_root
from symgen.runtime.code.sincos import SHARED_SINCOS, lanes_sincos
from symgen.runtime.graph.form import (
    ELEMENT,
    HELD,
    OUT,
    Array,
    Loop,
    Name,
    P,
    Place,
    Solve,
    Statement,
    T,
    Write,
)
from symgen.runtime.graph.nodes import Nodes

# LLVM's time per line, be it an operation, a load or a store, grows with the length of a function.
PIECE_LINES = 600


class NoLanes(Exception):
    """A function cannot be lowered for several members at once; the message says why."""


class StraightLine:
    """The body of one kernel, or of a loop in it, while it is written.

    Values are the strings that stand for them in the IR: a constant, `%t`, `%y3`, `%p0`, or `%v17`.

    Parameters
    ----------
    extra : dict of str to str
        Arguments beyond `t, y, p, out`, with their types: arrays (`ptr`), and in loops `k` (`i64`).
    lanes : int
        For how many members of an ensemble at once: every number is a vector then, in arrays too. 0: for one.
    """

    def __init__(self, extra: dict[str, str] | None = None, lanes: int = 0) -> None:
        self.lanes, self.number = lanes, lanes_type(lanes)
        self._align, self._element = 8 * max(lanes, 1), self.number
        self._pairs: dict[str, tuple[str, str]] = {}  # sine and cosine of an angle, in lanes
        self._reciprocals: dict[str, str] = {}  # of divisors that several quotients have, in lanes
        self._roots: dict[str, str] = {}  # what they are the roots of, in lanes
        self.operations = 0
        self.definitions: list[str] = []  # of functions that this code calls
        self.solvers: dict[str, str] = {}  # definitions of solvers, and what they need, by name
        self._arguments = {"t": self.number, "y": "ptr", "p": "ptr", "out": "ptr", **(extra or {})}
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
        return self._value(f"{instruction} {self.number} {left}, {right}")

    def quotient(self, left: str, divisor: str) -> str:
        """Write a quotient as a product with the reciprocal of its divisor, which is found once."""
        one = self.constant(1.0)
        if divisor in self._roots and divisor not in self._reciprocals:
            self._reciprocals[divisor] = self._reciprocal_root(self.reuse(self._roots[divisor]))
        if divisor not in self._reciprocals:
            self._reciprocals[divisor] = self.operation("fdiv", one, divisor)
        reciprocal = self.reuse(self._reciprocals[divisor])
        return reciprocal if left == one else self.operation("fmul", left, reciprocal)

    def negative(self, value: str) -> str:
        """Write the change of sign, which also turns 0 to -0."""
        return self._value(f"fneg {self.number} {value}")

    def call(self, function: str, arguments: list[str]) -> str:
        """Write the call of a mathematical function."""
        if self.lanes:
            return self._call_in_lanes(function, arguments)
        self.called.add(function)
        passed = ", ".join(f"double {argument}" for argument in arguments)
        return self._value(f"call double @{math_symbol(function)}({passed})")

    def _call_in_lanes(self, function: str, arguments: list[str]) -> str:
        """Write the call for each lane: sine and cosine are our own, others the C library's, one lane after another."""
        kind, lanes = self.number, self.lanes
        passed = ", ".join(f"{kind} {argument}" for argument in arguments)
        if function in ("sin", "cos"):
            return self._sincos(arguments[0])[function == "cos"]
        symbol, definition = lanes_call(function, len(arguments), lanes)
        if function in VECTOR_INTRINSICS:
            self.solvers[definition.rstrip()] = definition  # sine, cosine and roots may declare the same
        else:
            self.solvers[symbol] = definition
            self.called.add(function)
        value = self._value(f"call {kind} @{symbol}({passed})")
        if function == "sqrt":
            self._roots[value] = arguments[0]
        return value

    def _reciprocal_root(self, value: str) -> str:
        text, declared = reciprocal_root("symgen.reciprocal_root", self.lanes)
        self.solvers["symgen.reciprocal_root"] = text
        self.solvers |= {line: f"{line}\n" for line in declared}
        return self._value(f"call {self.number} @symgen.reciprocal_root({self.number} {value})")

    def _sincos(self, angle: str) -> tuple[str, str]:
        """Sine and cosine of an angle, which are found together."""
        if angle not in self._pairs:
            text, declared = lanes_sincos("symgen.sincos", self.lanes)
            self.solvers["symgen.sincos"] = text
            self.solvers |= {line: f"{line}\n" for line in declared}
            kind, pair = self.number, f"%pair{self._n_values}"
            self._lines.append(f"{pair} = call {{{kind}, {kind}}} @symgen.sincos({kind} {angle})")
            first, second = (self._value(f"extractvalue {{{kind}, {kind}}} {pair}, {k}") for k in (0, 1))
            self._pairs[angle] = first, second
        first, second = self._pairs[angle]
        return self.reuse(first), self.reuse(second)

    def sines(self, angles: list[str]) -> list[tuple[str, str]]:
        """Write what finds sines and cosines of several angles at once, and return them."""
        name, width = next((name, width) for name, width in SHARED_SINCOS.items() if width >= len(angles))
        kind, pair = lanes_type(width), f"%pair{self._n_values}"
        self.solvers[name] = f"declare {{{kind}, {kind}}} @{name}({kind}) nounwind willreturn memory(none)\n"
        given = "poison"
        for k in range(width):  # what happens to stand in a register may be an angle that takes long
            angle = angles[min(k, len(angles) - 1)]
            self._lines.append(f"{pair}.{k} = insertelement {kind} {given}, double {angle}, i32 {k}")
            given = f"{pair}.{k}"
        self._lines.append(f"{pair} = call {{{kind}, {kind}}} @{name}({kind} {given})")
        for k, word in enumerate(("sin", "cos")):
            self._lines.append(f"{pair}.{word} = extractvalue {{{kind}, {kind}}} {pair}, {k}")
        return [
            (
                self._value(f"extractelement {kind} {pair}.sin, i32 {k}", free=True),
                self._value(f"extractelement {kind} {pair}.cos, i32 {k}", free=True),
            )
            for k in range(len(angles))
        ]

    def constant(self, value: float) -> str:
        """Return a number as this code writes it."""
        return lanes_constant(value, self.lanes)

    def select(self, comparison: str, left: str, right: str, chosen: str, other: str) -> str:
        """Write `chosen if left < right else other`; comparison is olt or ole."""
        condition = f"%c{self._n_values}"
        kind, flag = self.number, f"<{self.lanes} x i1>" if self.lanes else "i1"
        self._lines.append(f"{condition} = fcmp {comparison} {kind} {left}, {right}")
        return self._value(f"select {flag} {condition}, {kind} {chosen}, {kind} {other}")

    def load(self, array: str, index: Place) -> str:
        """Return the value at a place in `y`, `p` or an array that is passed besides, loaded once in each piece."""
        value = f"%{array}{index.label()}"
        if value not in self._local:
            self._local.add(value)
            self._loaded[value] = (array, index)
            address = f"%a{value[1:]}"
            self._address(address, array, index)
            self._lines.append(f"{value} = {self._loading(address, index)}")
        return value

    def _loading(self, address: str, index: Place) -> str:
        """What loads a number from an address; `index` is where that is."""
        return f"load {self.number}, ptr {address}, align {self._align}"

    def later_load(self, array: str, index: Place) -> str:
        """Return the name of a value that `reuse` loads where it is used."""
        value = f"%{array}{index.label()}"
        self._loaded[value] = (array, index)
        return value

    def fresh_load(self, array: str, index: Place) -> str:
        """Return what stands in an array now, even if it was loaded before."""
        place = f"%f{self._n_values}"
        self._address(place, array, index)
        return self._value(self._loading(place, index), free=True)

    def store(self, index: Place, value: str, array: str = "out") -> None:
        """Write `out[index] = value`."""
        place = f"%o{self._n_values}.{len(self._lines)}"
        self._address(place, array, index)
        self._lines.append(f"store {self.number} {value}, ptr {place}, align {self._align}")

    def clear(self, array: str, first: int, length: int) -> None:
        """Fill a part of an array with zeros."""
        place = f"%o{self._n_values}.{len(self._lines)}"
        self._address(place, array, Place(first))
        self.solvers["memset"] = "declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)\n"
        self._lines.append(
            f"call void @llvm.memset.p0.i64(ptr {place}, i8 0, i64 {self._align * length}, i1 false)"
        )

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
        write(f"{name} = getelementptr inbounds {self._element}, ptr %{array}, i64 {offset}")

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
            self._pieces[home].append(f"store {self.number} {value}, ptr %s{value[1:]}, align {self._align}")
            span = self._spans[value] = [home]
        span.append(piece)
        self._local.add(value)
        self._lines.append(f"{value} = load {self.number}, ptr %s{value[1:]}, align {self._align}")
        return value

    def stands_in(self, value: str) -> tuple[str, Place] | None:
        """Where a value was loaded from; None if it was computed."""
        return self._loaded.get(value)

    def run_loop(self, symbol: str, passes: range, body: StraightLine) -> None:
        """Write a loop over `k` in `passes` around `body`, as a function of its own, and call it here."""
        passed = dict(body._arguments)
        del passed["k"]
        entry, lines = body.block(symbol)
        self.definitions += [
            *body.definitions,
            loop(symbol, passed, passes.stop, entry, lines, passes.start, passes.step),
        ]
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
                    f"%s{value[1:]} = getelementptr inbounds {self.number}, ptr %scratch, i64 {slots[value]}"
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
        return [f"%scratch = alloca {self.number}, i64 {n_slots}, align {max(64, self._align)}"], calls

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


class SideBySide(StraightLine):
    """The body of a loop for several of its passes at once.

    What these find at one place of an array after the other is one vector, and what all find at one place is the same
    in all of it. Each number comes about by the same operations as in a pass of its own.
    """

    def __init__(self, extra: dict[str, str], width: int) -> None:
        super().__init__(extra, width)
        self._align, self._element = 8, "double"
        self._arguments["t"] = "double"  # which is not read

    def _loading(self, address: str, index: Place) -> str:
        if index.step:
            return super()._loading(address, index)
        self._lines.append(f"{address}.one = load double, ptr {address}, align 8")
        first = f"{address}.first"
        self._lines.append(f"{first} = insertelement {self.number} poison, double {address}.one, i64 0")
        return (
            f"shufflevector {self.number} {first}, {self.number} poison, <{self.lanes} x i32> zeroinitializer"
        )


_WIDTHS = (8, 4)  # passes of a loop that are made at once
_INSTRUCTIONS = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_COMPARISONS = {"select": "olt", "select_le": "ole"}


def _shared_divisors(nodes: Nodes) -> frozenset[int]:
    """Divisors of several quotients: a division of vectors takes as long as a dozen products or more."""
    uses = Counter(args[1] for op, args in zip(nodes.op, nodes.args, strict=True) if op == "div")
    return frozenset(node for node, n in uses.items() if n > 1 and nodes.op[node] != "const")


class ExpressionLowering:
    """What nodes stand for at the place in a function that is being lowered.

    Parameters
    ----------
    function : FunctionText
    part : {"whole", "setup", "body"}
        See `lower.Lowering`.
    lanes : int
        See `StraightLine`.
    """

    code: StraightLine

    def __init__(self, function: FunctionText, part: str, lanes: int = 0):
        self._function, self._part, self._lanes = function, part, lanes
        self._nodes = function.form.nodes
        self._shared_divisors = _shared_divisors(self._nodes) if lanes else frozenset()
        # In lanes there are several members side by side already; hoisted work is done once.
        alone = not lanes and part != "setup"
        self._side_by_side_angles = angles.side_by_side(function.form) if alone else {}
        self._sines: dict[int, tuple[str, str]] = {}
        self._values: dict[int | str, str] = {}  # of nodes that a name stands for, and of names that are held
        self._outer: dict[int | str, str] = {}  # values of the code around a loop, while in the loop
        self._outer_code: StraightLine | None = None
        # Held names that the loop which is being lowered finds, and gives new values.
        self._carried: list[str] = []
        self._entering: list[int | str] = []  # what goes into that loop
        self._frame: dict[int | str, int] = {}  # places of the values that go into loops and come out
        # Local arrays: their first place in `work`, and their length.
        self._arrays: dict[str, tuple[int, int]] = {}

    def _refuse(self, line: int, cause: str) -> NoReturn:
        self._function.refuse(line, cause)

    def _lower(self, node: int) -> str:
        value = self._values.get(node)
        if value is not None:
            return self.code.reuse(value)
        if node in self._outer:
            return self._outer_value(node)
        op, args = self._nodes.op[node], self._nodes.args[node]
        if op == "var":
            return self._variable(*args)
        if op == "const":
            return self.code.constant(args[0])
        if op in _INSTRUCTIONS:
            return self._binary(node)
        if op == "neg":
            if self._nodes.op[args[0]] == "const":
                return self.code.constant(-self._nodes.args[args[0]][0])
            return self.code.negative(self._lower(args[0]))
        values = [self._lower(x) for x in args]
        if op in ("sin", "cos") and self._outer_code is None and args[0] in self._side_by_side_angles:
            return self._sine(args[0], op)
        if op in _COMPARISONS:
            return self.code.select(_COMPARISONS[op], *values)
        return self.code.call(op, values)

    def _sine(self, angle: int, op: str) -> str:
        """The sine or cosine of an angle that is taken side by side with others."""
        counted = self.code.operations
        if angle not in self._sines:
            group = self._side_by_side_angles[angle]
            found = self.code.sines([self._lower(x) for x in group])
            self._sines |= zip(group, found, strict=True)
        self.code.operations = counted + 1
        return self.code.reuse(self._sines[angle][op == "cos"])

    def _variable(self, kind: int, index: object) -> str:
        if kind == T:
            return "%t"
        if kind == HELD:
            value = self._values.get(index[0])
            return self._outer_value(index[0]) if value is None else self.code.reuse(value)
        if kind == ELEMENT:
            return self.code.fresh_load("work", self._local_place(*index[:2]))
        return self.code.load("p" if kind == P else "y", index)

    def _binary(self, node: int) -> str:
        # Sums and products of many terms nest to the left: walk down that side without recursion.
        op, args = self._nodes.op, self._nodes.args
        spine, left = [node], args[node][0]
        while op[left] in _INSTRUCTIONS and left not in self._values and left not in self._outer:
            spine.append(left)
            left = args[left][0]
        value = self._lower(left)
        for part in reversed(spine):
            right = self._lower(args[part][1])
            if op[part] == "div" and args[part][1] in self._shared_divisors:
                value = self.code.quotient(value, right)
            else:
                value = self.code.operation(_INSTRUCTIONS[op[part]], value, right)
        return value

    def _local_place(self, array: str, place: Place) -> Place:
        """The place in `work` of an element of a local array."""
        return place._replace(first=self._arrays[array][0] + place.first)

    def _slot(self, what: int | str) -> int:
        return self._frame.setdefault(what, len(self._frame))

    def _outer_value(self, what: int | str) -> str:
        """The value of a node or name from the code around a loop, in the loop."""
        value = self._outer[what]
        if what not in self._carried:
            if value[0] != "%" or value == "%t":
                return value
            place = self._outer_code.stands_in(value)
            if place is not None:
                return self.code.load(*place)
        if what not in self._entering:
            self._entering.append(what)
        return self.code.load("frame", Place(self._slot(what)))


class Lowering(ExpressionLowering):
    """One function on its way to LLVM IR.

    Parameters
    ----------
    function : FunctionText
    part : {"whole", "setup", "body"}
        What is lowered: everything; only the hoisted assignments, which are written to an array `h`; or all but
        these, with their values read from `h`.
    lanes : int
        See `StraightLine`.

    Attributes
    ----------
    n_hoisted : int
        Hoisted values that were met, each loop's as often as it runs.
    """

    def __init__(self, function: FunctionText, part: str = "whole", lanes: int = 0):
        super().__init__(function, part, lanes)
        self._extra: dict[str, str] = {} if part == "whole" else {"h": "ptr"}
        self._step = 0  # hoisted values for each k of the loop that is being lowered
        self._n_loops = 0
        self.work_size = 0  # values in all local arrays
        self.n_hoisted = 0

    def lower(self, symbol: str) -> None:
        """Lower the function's statements; `code` holds the result."""
        form = self._function.form
        body = (
            list(self._setup(form.body)) if self._part == "setup" else front_ldl.with_early_solves(form.body)
        )
        if any(type(statement) is Loop for statement in body):
            self._extra["frame"] = "ptr"
        if self._part != "setup" and any(type(statement) is Array for statement, _ in form.statements()):
            self._extra["work"] = "ptr"
        self.code = StraightLine(self._extra, self._lanes)
        for statement in body:
            if type(statement) is Loop:
                self._loop(statement, symbol)
            else:
                self._statement(statement)
            self.code.end_statement()

    def _setup(self, body: list[Statement]) -> Iterator[Statement]:
        """What `p` alone decides: reads of `p`, hoisted assignments, and loops with these."""
        for statement in body:
            if type(statement) is Loop:
                kept = tuple(self._setup(statement.body))
                if kept:
                    yield statement._replace(body=kept)
            elif type(statement) is Name and (statement.hoisted or self._reads_p(statement.node)):
                yield statement

    def _reads_p(self, node: int) -> bool:
        return self._nodes.op[node] == "var" and self._nodes.mask[node] == P

    @property
    def spaces(self) -> dict[str, int]:
        """Arrays that the code takes besides, and their lengths: what loops exchange, and what solvers work on."""
        lengths = {"frame": max(1, len(self._frame)), "work": self.work_size}
        return {name: length for name, length in lengths.items() if name in self._extra}

    def _statement(self, statement: Statement) -> None:
        """Lower a statement, as far as it belongs to this part."""
        kind = type(statement)
        if kind is Name:
            self._name(statement)
        elif kind is Array:
            self._array(statement)
        elif kind is Solve:
            self._solve(statement)
        elif statement.array == OUT:
            self.code.store(statement.place, self._lower(statement.node))
        else:
            place = self._local_place(statement.array, statement.place)
            self.code.store(place, self._lower(statement.node), "work")

    def _name(self, statement: Name) -> None:
        what = statement.name if statement.held else statement.node
        if self._part == "whole" or not statement.hoisted:
            self._values[what] = self._lower(statement.node)
            return
        place = self._hoisted_place()
        if self._part == "setup":
            self._check_depends_on_p(statement)
            self._values[what] = self._lower(statement.node)
            self.code.store(place, self._values[what], "h")
        else:
            self._values[what] = self.code.later_load("h", place)

    def _check_depends_on_p(self, statement: Name) -> None:
        nodes = self._nodes
        for node in nodes.reachable((statement.node,), ~P):
            if nodes.op[node] == "var":
                name = "t" if nodes.mask[node] == T else nodes.args[node][1][0]
                if type(name) is int:
                    self._refuse(statement.line, "only p[i] can be read here")
                self._refuse(statement.line, f"{name!r} has no value here that follows from p alone")

    def _array(self, statement: Array) -> None:
        first, _ = self._arrays.setdefault(statement.name, (self.work_size, statement.length))
        self.work_size = max(self.work_size, first + statement.length)
        if self.work_size > LARGEST:
            self._refuse(statement.line, f"its arrays have {self.work_size} values, more than {LARGEST}")
        self.code.clear("work", first, statement.length)

    def _solve(self, statement: Solve) -> None:
        if self._lanes:
            raise NoLanes(f"its equations are solved by {statement.solver}, which takes one member at a time")
        solver, given = statement.solver, [self._arrays[name] for name in statement.arrays]
        firsts, lengths = [first for first, _ in given], [length for _, length in given]
        if statement.table:
            table, (n,) = self._function.tables[statement.table], statement.numbers
            wrong = front_ldl.check(table, n, *lengths)
            if wrong:
                self._refuse(statement.line, f"the table {statement.table} describes no elimination: {wrong}")
            self.code.solve_fronts(solver, firsts, (statement.table, table), n)
            return
        sizes = list(statement.numbers)
        if lengths != dense_ldl.array_lengths(solver, sizes) or not 0 <= min(sizes) <= max(sizes) == sizes[0]:
            self._refuse(statement.line, f"{solver} is called with local arrays that do not fit its sizes")
        self.code.solve(solver, firsts, sizes)

    def _hoisted_place(self) -> Place:
        """The place in `h` of the next hoisted value; a loop's values for one `k` stand side by side."""
        place = Place(self.n_hoisted, self._step)
        self.n_hoisted += 1
        return place

    def _loop(self, loop: Loop, symbol: str) -> None:
        """Lower a loop to a function of its own, which shares values with this code through a frame."""
        symbol = f"{symbol}.loop{self._n_loops}"
        self._n_loops += 1
        hoisted = 0 if self._part == "whole" else sum(type(x) is Name and x.hoisted for x in loop.body)
        assigned = dict.fromkeys(x.name for x in loop.body if type(x) is Name)
        self._carried = [name for name in assigned if name in self._values]
        self._outer_code, self.code = self.code, StraightLine({**self._extra, "k": "i64"}, self._lanes)
        self._outer, self._values = self._values, {}
        before, self._step = self.n_hoisted, hoisted
        if not hoisted and not self._carried and self._may_go_side_by_side(loop):
            self._side_by_side(loop, symbol)
            return
        body = self._body(loop, self.code)
        # All values before the first is stored: they may come from places that are written here.
        for value, name in [(body.reuse(self._values[name]), name) for name in self._carried]:
            body.store(Place(self._slot(name)), value, "frame")
        self.code, self._values = self._outer_code, self._outer
        self._outer_code, self._outer, self._step = None, {}, 0
        self.n_hoisted = before + hoisted * loop.count
        for what in self._entering:
            self.code.store(Place(self._slot(what)), self.code.reuse(self._values[what]), "frame")
        self._entering.clear()
        self.code.run_loop(symbol, range(loop.count), body)
        for name in self._carried:
            self._values[name] = self.code.fresh_load("frame", Place(self._slot(name)))

    def _body(self, loop: Loop, code: StraightLine) -> StraightLine:
        """The statements of a loop, lowered to `code`."""
        self.code, self._values = code, {}
        for inner in loop.body:
            self._statement(inner)
            code.end_statement()
        return code

    def _side_by_side(self, loop: Loop, symbol: str) -> None:
        """Lower a loop whose passes are made several at a time, and those that are left over one by one."""
        outside, values = self._outer_code, self._outer
        start, arguments = 0, {**self._extra, "k": "i64"}
        for width in (*_WIDTHS, 1):
            passes = range(start, loop.count - (loop.count - start) % width, width)
            if passes:
                wide = SideBySide(arguments, width) if width > 1 else StraightLine(arguments)
                body = self._body(loop, wide)
                if start:
                    body.operations = 0  # they are counted already
                outside.run_loop(f"{symbol}.{width}", passes, body)
            start = passes.stop if passes else start
        self.code, self._values = outside, values
        self._outer_code, self._outer, self._step = None, {}, 0

    def _may_go_side_by_side(self, loop: Loop) -> bool:
        """Whether passes of a loop know nothing of each other, and find their numbers side by side or all the same."""
        if self._lanes or loop.count < min(_WIDTHS):
            return False
        if not all(type(x) is Write or (type(x) is Name and not x.held) for x in loop.body):
            return False
        named = {x.node for x in loop.body if type(x) is Name}
        found = self._nodes.reachable([x.node for x in loop.body])
        if not all(self._is_plain(node) and (node in named or node not in self._outer) for node in found):
            return False
        writes = [(x.array, x.place) for x in loop.body if type(x) is Write]
        touched = [*writes, *(read for x in loop.body for read in x.reads)]
        return all(place.step == 1 and not place.table for _, place in writes) and all(
            array != other or _apart(place, written, loop.count)
            for array, place in touched
            for other, written in writes
        )

    def _is_plain(self, node: int) -> bool:
        """Whether a node is a sum or product, a number, or an element whose place goes along with `k` or stays."""
        op, args = self._nodes.op[node], self._nodes.args[node]
        if op != "var":
            return op in ("const", "neg", *_INSTRUCTIONS)
        kind, index = args
        if kind in (T, HELD):
            return False
        place = index[1] if kind == ELEMENT else index
        return not place.table and place.step in (0, 1)


def _apart(place: Place, written: Place, count: int) -> bool:
    """Whether a place is never one that another pass of a loop writes."""
    if not place.step:
        return not written.first <= place.first < written.first + count
    return place.first == written.first or abs(place.first - written.first) >= count
