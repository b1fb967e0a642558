"""A kind of subsystem in a generated function as text: straight-line code, in a loop where there are several."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from typing import Any

from symgen.runtime.graph.functions import IN_CODE

from ..derive.graph import hoist
from ..derive.graph.graph import Graph, depth_first
from ..derive.graph.nodes import INPUT, LAM, PARAM, VIRTUAL, A, Q, T, V
from ..derive.program import RATIO, Function, Part
from ..derive.rolling import OUT
from ..derive.solve.dense_solve import FACTOR, TEXT


class Tables:
    """The module's index tables, for places in loops that are no affine function of k."""

    def __init__(self) -> None:
        self.names: dict[tuple[int, ...], str] = {}

    def index(self, places: Sequence[int]) -> str:
        """The text of an index that runs through `places`."""
        first, step = places[0], places[1] - places[0] if len(places) > 1 else 0
        if step < 0 or any(b - a != step for a, b in pairwise(places)):
            return f"{self.name(places)}[k]"
        if not step:
            return str(first)
        multiple = "k" if step == 1 else f"{step}*k"
        return f"{first} + {multiple}" if first else multiple

    def name(self, entries: Sequence[int]) -> str:
        """The name of the table with these entries."""
        return self.names.setdefault(tuple(entries), f"I{len(self.names)}")


LONGEST_INLINE = 60  # characters of an expression that is written where it is used instead of getting a name
# The same of one that follows from parameters: sums of hundreds would nest deeper than Python reads.
LONGEST_HOISTED = 400
SHORTEST_COPY_LOOP = 8  # entries of the state that a reset leaves as they are
VECTORS = {Q: "q", V: "v", A: "v", LAM: "c", PARAM: "parameters", INPUT: "inputs"}

# Binding strength of printed expressions.
_CONDITIONAL, _SUM, _PRODUCT, _SIGN, _ATOM = range(5)


class Shared:
    """What the sections of a function share.

    Attributes
    ----------
    head : dict
        The module's header.
    names : dict of (int, int) to str
        Of variables.
    tables : Tables
    calls : set of str
        Mathematical functions in it.
    solvers : set of str
        Solvers by loops that it calls.
    n_hoisted : int
        Values that are worked out from parameters alone.
    totals, kinds : dict of int to str
        Names of the numbers that all subsystems make together, and how they make them, by their places.
    target : str
        The array that results are written to.
    """

    def __init__(self, head: dict[str, Any], names: dict[tuple[int, int], str], tables: Tables) -> None:
        self.head, self.names, self.tables = head, names, tables
        self.calls: set[str] = set()
        self.solvers: set[str] = set()
        self.n_hoisted = 0
        self.totals: dict[int, str] = {}
        self.kinds: dict[int, str] = {}
        self.target = OUT
        self.read_once: set[tuple[int, int]] = set()  # parameters that stand before all sections
        self._n_names: Counter[str] = Counter()

    def new_name(self, letter: str) -> str:
        """The next name of a kind: `c` for hoisted values, `x` for others."""
        self._n_names[letter] += 1
        return f"{letter}{self._n_names[letter] - 1}"


class Section:
    """The part of a function that belongs to one kind of subsystem, or all of it."""

    def __init__(
        self,
        whole: Shared,
        g: Graph,
        function: Function,
        part: Part | None = None,
        places: Mapping[int, tuple[int, ...]] | None = None,
    ) -> None:
        self.whole, self.g, self.function, self.part, self.places = whole, g, function, part, places
        self.count = len(part.members) if part else 1
        self.written = function.written()
        self.uses = Counter(node for _, node in self.written)
        self.nodes = g.reachable(node for _, node in self.written)
        self.uses.update(chain.from_iterable(map(g.operands, self.nodes)))
        self.levels = hoist.levels(g, self.nodes, part.own_parameters if part else ())
        self.needed = self._needed_beyond()
        self.printed: dict[int, tuple[str, int]] = {}  # expression and its binding strength
        self.hoisted: list[str] = []  # depends on parameters that all members share
        self.own: list[str] = []  # depends on parameters of one member
        self.lines: list[str] = []

    def _copies(self) -> Iterator[str]:
        """What a reset leaves as it is, long runs in loops."""
        changed = [k for k, _ in self.written]
        for first, end in zip([0, *(k + 1 for k in changed)], [*changed, self.function.copies], strict=True):
            if end - first < SHORTEST_COPY_LOOP:
                yield from (f"out[{k}] = y[{k}]" for k in range(first, end))
            else:
                place = self.whole.tables.index((first, first + 1))
                yield from (f"for k in range({end - first}):", f"    out[{place}] = y[{place}]")

    def _needed_beyond(self) -> set[int]:
        """Hoistable nodes that something less hoistable, or `out`, uses."""
        found = {node for _, node in self.written}
        for node in self.nodes:
            found.update(x for x in self.g.operands(node) if self.levels[x] < self.levels[node])
        return found

    def print(self) -> None:
        """Print all operations in the order in which they are needed."""
        for node in self._schedule():
            self._print(node)

    def shared_parameters(self) -> list[tuple[int, int]]:
        """Parameters that every member finds at the same place."""
        own = self.part.own_parameters if self.part else ()
        used = (self.g.args[n] for n in self.nodes if self.g.op[n] == "var")
        return [(kind, self._indices(kind, k)[0]) for kind, k in used if kind == PARAM and k not in own]

    def text(self) -> Iterator[str]:
        """The lines of this section; the hoisted ones that it shares with others stand before."""
        results = [*self._results()]
        inside = [
            *self._inputs(hoistable=True),
            *self.own,
            *self._inputs(hoistable=False),
            *self.lines,
            *results,
        ]
        if self.function.copies:
            yield from self._copies()
        if self.part:
            yield f"# {self.part.title}"
        if self.count == 1:
            yield from inside
            return
        yield f"for k in range({self.count}):"
        yield from (f"    {line}" for line in inside)

    def _results(self) -> Iterator[str]:
        for k, node in self.written:
            places = self.places[k] if self.places else [k]
            total = self.whole.totals.get(places[0])
            text, strength = self.printed[node]
            if total is None:
                yield f"{self.whole.target}[{self.whole.tables.index(places)}] = {text}"
            elif self.whole.kinds[places[0]] == RATIO:
                yield f"{total} = ({text} if {text} < {total} else {total})"
            else:
                yield f"{total} = {total} + {text if strength > _SUM else f'({text})'}"

    def _inputs(self, *, hoistable: bool) -> Iterator[str]:
        """Reads of variables: parameters of one's own, or those that change during a run."""
        for args in sorted(self.g.args[n] for n in self.nodes if self.g.op[n] == "var"):
            if args[0] == T or (
                args[0] == PARAM and (not self.part or args[1] not in self.part.own_parameters)
            ):
                continue
            if (args[0] == PARAM) == hoistable:
                yield f"{self._name(*args)} = {self._place(*args)}"

    def _indices(self, kind: int, index: int) -> list[int]:
        """The variable's indices in the whole model, for each member."""
        if self.part is None or kind == T:
            return [index]
        return self.part.indices[VECTORS[kind]][:, index].tolist()

    def _name(self, kind: int, index: int) -> str:
        args = kind, self._indices(kind, index)[0]
        name = self.whole.names[args]
        # What is read once for all, and in a loop as one of its members', has two names.
        of_members = args in self.whole.read_once and self.part and index in self.part.own_parameters
        return f"pk{name[1:]}" if of_members else name

    def _place(self, kind: int, index: int) -> str:
        head = self.whole.head
        behind = head["nq"] + head["nv"]  # what robots' functions take in the place of accelerations: forces
        starts = {Q: 0, V: head["nq"], A: behind, VIRTUAL: behind, LAM: behind + head["nv"]}
        start = starts.get(kind, len(head["parameters"]) if kind == INPUT else 0)
        places = [start + k for k in self._indices(kind, index)]
        return f"{'p' if kind in (PARAM, INPUT) else 'y'}[{self.whole.tables.index(places)}]"

    def _schedule(self) -> list[int]:
        return depth_first(self.g, (output for _, output in self.written))

    def _print(self, node: int) -> None:
        g = self.g
        op, args = g.op[node], g.args[node]
        if op == "var":
            self.printed[node] = (self._name(*args) if args[0] != T else "t", _ATOM)
            return
        if op == "const":
            self.printed[node] = (repr(args[0]), _SIGN if args[0] < 0.0 else _ATOM)
            return
        if op in TEXT:
            self.printed[node] = (self._solver(op, args), _ATOM)
            return
        text, strength = self._expression(op, args)
        level = self.levels[node]
        if level < hoist.MOTION:
            if self.uses[node] > 1 or node in self.needed or len(text) > LONGEST_HOISTED:
                text, strength = self._hoist(text, level), _ATOM
        elif self.uses[node] > 1 or len(text) > LONGEST_INLINE or self._is_compared(node):
            name = self.whole.new_name("x")
            self.lines.append(f"{name} = {text}")
            text, strength = name, _ATOM
        self.printed[node] = (text, strength)

    def _solver(self, op: str, args: tuple[int, ...]) -> str:
        """Fill an array and call a solver on it; the array's name."""
        g = self.g
        self.whole.solvers.add(op)
        if op == FACTOR:
            n, n_coordinates = (int(g.args[x][0]) for x in args[:2])
            name, values = self.whole.new_name("w"), args[2:]
            call = f"{op}({name}, {n}, {n_coordinates})"
        else:
            name, values = self.whole.new_name("b"), args[1:]
            call = f"{op}({self.printed[args[0]][0]}, {name}, {len(values)})"
        self.lines.append(f"{name} = [0.0]*{len(values)}")
        entries = ((k, x) for k, x in enumerate(values) if x != g.zero)
        self.lines += [f"{name}[{k}] = {self.printed[x][0]}" for k, x in entries]
        self.lines.append(call)
        return name

    def _hoist(self, text: str, level: int) -> str:
        name = self.whole.new_name("c")
        self.whole.n_hoisted += 1 if level == hoist.SHARED else self.count
        (self.hoisted if level == hoist.SHARED else self.own).append(f"{name} = {text}")
        return name

    def _is_compared(self, node: int) -> bool:
        """Whether a node is an output that enters a minimum over subsystems."""
        whole = self.whole
        return bool(whole.totals) and any(
            n == node and whole.kinds.get(self.places[k][0]) == RATIO for k, n in self.written
        )

    def _expression(self, op: str, args: tuple[int, ...]) -> tuple[str, int]:
        at = self._at
        match op:
            case "add":
                return f"{at(args[0], _SUM)} + {at(args[1], _PRODUCT)}", _SUM
            case "sub":
                return f"{at(args[0], _SUM)} - {at(args[1], _PRODUCT)}", _SUM
            case "mul":
                return f"{at(args[0], _PRODUCT)}*{at(args[1], _SIGN)}", _PRODUCT
            case "div":
                return f"{at(args[0], _PRODUCT)}/{at(args[1], _SIGN)}", _PRODUCT
            case "neg":
                return f"-{at(args[0], _ATOM)}", _SIGN
            case "select":
                a, b, then, otherwise = (at(x, _SUM) for x in args)
                return f"({then} if {a} < {b} else {otherwise})", _ATOM
        if op == "element":
            return f"{at(args[0], _ATOM)}[{int(self.g.args[args[1]][0])}]", _ATOM
        self.whole.calls.add(op)
        assert op in IN_CODE, op
        return f"{op}({', '.join(at(x, _CONDITIONAL) for x in args)})", _ATOM

    def _at(self, node: int, strength: int) -> str:
        text, own = self.printed[node]
        return text if own >= strength else f"({text})"
