"""A long function as text: what is equal but for places stands in loops, and numbers that loops share in an array."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from symgen.derive.rolling import (
    CLUSTERS,
    FACTORS,
    FEWEST,
    HOISTED,
    KEPT,
    OUT,
    SOLVE,
    SOLVES,
    SUM,
    Group,
    Schedule,
    Sink,
    array_entries,
)

from ..derive.graph import hoist
from ..derive.graph.graph import Graph, depth_first
from ..derive.graph.nodes import INPUT, LAM, PARAM, VIRTUAL, A, Q, V
from ..derive.program import Function
from .section import _ATOM, _SUM, LONGEST_INLINE, Section, Shared


class RolledSection(Section):
    """All of a long function."""

    def __init__(self, whole: Shared, g: Graph, function: Function, schedule: Schedule) -> None:
        self.whole, self.g, self.function, self.part = whole, g, function, None
        self.uses: Counter[int] = Counter()  # in the cluster that is being printed
        self.printed: dict[int, tuple[str, int]] = {}
        self.hoisted: list[str] = []
        self.lines: list[str] = []
        self.schedule, self.shapes = schedule, schedule.shapes
        self.read_parameters: set[tuple[int, int]] = set()
        self.kept: dict[int, int] = {}  # places of what clusters make for others
        self.arrays: dict[int, str] = {}  # of solvers, by their nodes
        self.sums: dict[int, str] = {}
        self.array = ""
        self.hoisted_texts: dict[int, tuple[str, int]] = {}
        self.met: set[int] = set()  # their nodes
        self.loaded: dict[str, str] = {}  # what the loop that is being printed has read
        self.entered: Counter[Sink | tuple[str, int, int]] = Counter()  # what clusters were written to

    def print(self) -> None:
        """Print all groups, stage by stage; each result, entry of a solver and term of a sum once."""
        stages, clusters = self.schedule.stages, self.schedule.clusters
        roots = [m.root for stage in stages for group in stage for m in group.members]
        kept = [root for root in roots if root in clusters.shared and root not in clusters.sums]
        self.kept = {root: k for k, root in enumerate(kept)}
        if kept:
            self.array = self.whole.new_name("w")
            self.lines.append(f"{self.array} = [0.0]*{len(kept)}")
        for solve in clusters.solves:
            self._declare(solve)
        for total in clusters.sums:
            self.sums[total] = self.whole.new_name("e")
            self.lines.append(f"{self.sums[total]} = 0.0")
        for stage in stages:
            self._print_stage(stage)
        self._check_entered()

    def _check_entered(self) -> None:
        """Refuse to have left anything out: what a function writes is known from its nodes, not from their clusters."""
        g, clusters = self.g, self.schedule.clusters
        wanted = Counter((OUT, place) for place, _ in self.function.written())
        for node in g.reachable(node for _, node in self.function.written()):
            if g.op[node] in SOLVES:
                wanted.update((node, place) for place, _ in array_entries(g, node))
        for total, terms in clusters.sums.items():
            wanted.update((SUM, total, node) for _, node in terms)
        if self.entered != wanted:
            lost = next(iter((wanted - self.entered) + (self.entered - wanted)))
            counts = f"{self.entered[lost]} times instead of {wanted[lost]}"
            raise RuntimeError(f"{self.function.name!r} in loops enters {lost} {counts}")

    def shared_parameters(self) -> list[tuple[int, int]]:
        """Parameters that the text names."""
        return sorted(self.read_parameters)

    def text(self) -> Iterator[str]:
        """The lines of this section; the hoisted ones stand before."""
        yield from self.lines

    def _declare(self, solve: int) -> None:
        """Make room for the array of a solver."""
        g = self.g
        self.whole.solvers.add(g.op[solve])
        if g.op[solve] == "factor_fronts":
            plan = g.front_plans[int(g.args[g.args[solve][0]][0])]
            self.arrays[solve], length = self.whole.new_name("w"), plan.n_values
        else:
            is_factor = g.op[solve] in FACTORS
            self.arrays[solve] = self.whole.new_name("w" if is_factor else "b")
            length = len(g.args[solve]) - (2 if is_factor else 1)
        self.lines.append(f"{self.arrays[solve]} = [0.0]*{length}")

    def _print_stage(self, stage: list[Group]) -> None:
        by_count: dict[int, list[Group]] = {}
        for group in stage:
            count = len(group.members) if group.kind == CLUSTERS else 1
            if count < FEWEST:
                for k in range(count):
                    self._print_group(group.part([k]))
            else:
                by_count.setdefault(count, []).append(group)
        for count, groups in by_count.items():
            self.lines.append(f"for k in range({count}):")
            outside, self.lines, self.loaded = self.lines, [], {}
            for group in groups:
                self._print_group(group)
            outside += [f"    {line}" for line in self.lines]
            self.lines = outside
        self.loaded = {}

    def _print_group(self, group: Group) -> None:
        if group.kind == SOLVE:
            self._call(group.members[0].root)
            return
        if len(group.members) == 1:
            self.loaded = {}
        root = group.members[0].root
        if group.kind == SUM:
            self._write(group, root, self.sums[root], _ATOM)
            return
        outside = self.printed
        self.printed = {}
        text, strength = self._cluster(group)
        self.printed = outside
        self._write(group, root, text, strength)

    def _call(self, solve: int) -> None:
        g, array = self.g, self.arrays[solve]
        match g.op[solve]:
            case "factor_fronts":
                plan = g.front_plans[int(g.args[g.args[solve][0]][0])]
                self.lines.append(f"factor_fronts({array}, {self._table(plan.table)}, {plan.n_fronts})")
            case "solve_fronts":
                factors = g.args[solve][0]
                plan = g.front_plans[int(g.args[g.args[factors][0]][0])]
                table = self._table(plan.table)
                self.lines.append(f"solve_fronts({self.arrays[factors]}, {array}, {table}, {plan.n_fronts})")
            case "factor_ldl":
                n, n_coordinates = (int(g.args[x][0]) for x in g.args[solve][:2])
                self.lines.append(f"factor_ldl({array}, {n}, {n_coordinates})")
            case "solve_ldl":
                n = len(g.args[solve]) - 1
                self.lines.append(f"solve_ldl({self.arrays[g.args[solve][0]]}, {array}, {n})")

    def _table(self, entries: tuple[int, ...]) -> str:
        return self.whole.tables.name(entries)

    def _cluster(self, group: Group) -> tuple[str, int]:
        """Print the operations of a group's clusters; the text of what they make."""
        first = group.members[0]
        reads = dict(zip(first.reads, zip(*(m.reads for m in group.members), strict=True), strict=True))
        for node in self._inside(first.root, reads):
            if node in reads:
                self.printed[node] = self._read(reads[node])
            else:
                self._print_inside(node)
        return self.printed[first.root]

    def _inside(self, root: int, reads: dict[int, tuple[int, ...]]) -> list[int]:
        """The nodes of a cluster in the order of writing; counts who uses them."""
        order = depth_first(self.g, (root,), reads)
        self.uses.clear()
        for node in order:
            if node not in reads:
                self.uses.update(self.g.operands(node))
        return order

    def _print_inside(self, node: int) -> None:
        g = self.g
        op, args = g.op[node], g.args[node]
        if op in ("const", "var"):  # the only variable here is t
            self._print(node)
            return
        text, strength = self._expression(op, args)
        if self.uses[node] > 1 or len(text) > LONGEST_INLINE:
            name = self.whole.new_name("x")
            self.lines.append(f"{name} = {text}")
            text, strength = name, _ATOM
        self.printed[node] = (text, strength)

    def _read(self, nodes: tuple[int, ...]) -> tuple[str, int]:
        """The text of a number that each member of a group reads."""
        g, first = self.g, nodes[0]
        source = self.shapes.source(first)
        same = nodes.count(first) == len(nodes)
        if first in self.sums:
            return self.sums[first], _ATOM
        if source == HOISTED:
            return self._hoisted(nodes, same)
        if source == KEPT:
            return self._load(self.array, [self.kept[x] for x in nodes])
        if g.op[first] == "element":
            return self._load(self.arrays[g.args[first][0]], [int(g.args[g.args[x][1]][0]) for x in nodes])
        kind = g.args[first][0]
        if kind == PARAM and same:
            self.read_parameters.add(g.args[first])
            return self._name(*g.args[first]), _ATOM
        array, start = self._start(kind)
        return self._load(array, [start + g.args[x][1] for x in nodes])

    def _load(self, array: str, places: list[int]) -> tuple[str, int]:
        """The name of what a loop finds in an array, read once in a loop."""
        text = f"{array}[{self.whole.tables.index(places)}]"
        if text not in self.loaded:
            self.loaded[text] = self.whole.new_name("x")
            self.lines.append(f"{self.loaded[text]} = {text}")
        return self.loaded[text], _ATOM

    def _hoisted(self, nodes: tuple[int, ...], same: bool) -> tuple[str, int]:
        """What follows from parameters: hoisted where all members have the same, else done in the loop."""
        g, first = self.g, nodes[0]
        if same:
            return self._print_hoisted(first)
        rows = [self.shapes.ordered(x) for x in nodes]
        for operands in zip(*rows, strict=True):
            head = operands[0]
            single = operands.count(head) == len(operands)
            if g.op[head] == "const":
                self._print(head)
            elif g.op[head] == "var":
                self.printed[head] = self._read(operands)
            else:
                self.printed[head] = self._hoisted(operands, single)
        text, _ = self._expression(g.op[first], g.args[first])
        name = self.whole.new_name("x")
        self.lines.append(f"{name} = {text}")
        return name, _ATOM

    def _print_hoisted(self, node: int) -> tuple[str, int]:
        g = self.g
        done = self.hoisted_texts
        for x in g.reachable([node], met=self.met):
            op, args = g.op[x], g.args[x]
            inside, self.printed = self.printed, done
            if op == "var":
                self.read_parameters.add(args)
                done[x] = (self._name(*args), _ATOM)
            elif op == "const":
                self._print(x)
            else:
                done[x] = (self._hoist(self._expression(op, args)[0], hoist.SHARED), _ATOM)
            self.printed = inside
        return done[node]

    def _write(self, group: Group, root: int, text: str, strength: int) -> None:
        """Write what a cluster makes to its places."""
        shared = root in self.kept
        if (shared or len(group.targets) > 1) and strength != _ATOM:
            name = self.whole.new_name("x")
            self.lines.append(f"{name} = {text}")
            text, strength = name, _ATOM
        columns = iter(zip(*group.places, strict=True))
        index = self.whole.tables.index
        for target in group.targets:
            if isinstance(target, tuple):
                self.entered.update((SUM, target[1], member.root) for member in group.members)
                total, sign = self.sums[target[1]], "+" if target[2] > 0 else "-"
                self.lines.append(f"{total} = {total} {sign} {text if strength > _SUM else f'({text})'}")
                continue
            array, places = self.whole.target if target == OUT else self.arrays[target], next(columns)
            self.entered.update((target, place) for place in places)
            self.lines.append(f"{array}[{index(places)}] = {text}")
        if shared:
            self.lines.append(f"{self.array}[{index([self.kept[m.root] for m in group.members])}] = {text}")

    def _start(self, kind: int) -> tuple[str, int]:
        """The array in which variables of a kind stand, and where there."""
        head = self.whole.head
        if kind in (PARAM, INPUT):
            return "p", len(head["parameters"]) if kind == INPUT else 0
        behind = head["nq"] + head["nv"]
        return "y", {Q: 0, V: head["nq"], A: behind, VIRTUAL: behind, LAM: behind + head["nv"]}[kind]
