"""Cuts a function into clusters: trees of operations, each of which ends in one number that is kept.

A number is kept where it is written to an array, where it is a term of a long sum, or where several clusters use it.
Everything else belongs to the only cluster that uses it.

Shapes of clusters: two have one shape when they differ only in where their numbers come from.

The order of a function's clusters: those of one shape together, where what they read allows.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from symgen.derive.graph import hoist
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.nodes import INPUT, LAM, ON_ARRAYS, PARAM, VIRTUAL, A, Q, T, V

FEWEST_TERMS = 16  # of a sum that is made in a loop
_CHEAP = frozenset(
    ("add", "sub", "mul", "neg")
)  # repeated rather than kept, when they cost no more than reading
_SUMS = ("add", "sub", "neg")
SOLVES = ON_ARRAYS - {"element"}

OUT = "out"
Sink = tuple[str | int, int]  # an array (`OUT`, or the node of a solver), and the place in it


@dataclass
class Clusters:
    """What a function keeps, and where.

    Attributes
    ----------
    nodes : list of int
        All of the function's, ascending.
    level : dict of int to int
        What each node depends on, see `hoist.levels`.
    roots : list of int
        The clusters' last nodes, ascending.
    sinks : dict of int to list
        Where each root is written, beyond being kept for others.
    shared : set of int
        Roots that other clusters read.
    sums : dict of int to list of (int, int)
        Long sums: sign and node of each term.
    solves : list of int
        Nodes that are calls of solvers, ascending.
    """

    nodes: list[int]
    level: dict[int, int]
    roots: list[int] = field(default_factory=list)
    sinks: dict[int, list[Sink]] = field(default_factory=lambda: defaultdict(list))
    shared: set[int] = field(default_factory=set)
    sums: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    solves: list[int] = field(default_factory=list)

    def is_leaf(self, g: Graph, node: int) -> bool:
        """Whether a node is no operation that a cluster does: a variable, a number, hoisted, or a solver's."""
        return g.op[node] == "var" or self.level[node] < hoist.MOTION or g.op[node] in ON_ARRAYS


def find(g: Graph, written: Iterable[tuple[int, int]]) -> Clusters:
    """Cut the function that writes `written`, pairs (place in `out`, node), into clusters."""
    written = list(written)
    nodes = g.reachable(node for _, node in written)
    c = Clusters(nodes, hoist.levels(g, nodes))
    for place, node in written:
        c.sinks[node].append((OUT, place))
    for node in nodes:
        if g.op[node] in SOLVES:
            c.solves.append(node)
            for place, value in array_entries(g, node):
                c.sinks[value].append((node, place))
    inner = _find_sums(g, c, nodes)
    _assign(g, c, nodes, inner)
    return c


def array_entries(g: Graph, solve: int) -> list[tuple[int, int]]:
    """Places in a solver's array and the nodes that are written there, but for zeros."""
    args = g.args[solve]
    if g.op[solve] == "factor_fronts":
        places = g.front_plans[int(g.args[args[0]][0])].places
        return list(zip(places, args[1:], strict=True))
    first = 2 if g.op[solve] == "factor_ldl" else 1
    return [(k, node) for k, node in enumerate(args[first:]) if node != g.zero]


def _find_sums(g: Graph, c: Clusters, nodes: list[int]) -> set[int]:
    """Find long sums; returns the nodes within them, which nothing else uses."""
    ops, args, level, sinks = g.op, g.args, c.level, c.sinks
    uses = [0] * len(ops)
    for node in nodes:
        for x in g.operands(node):
            uses[x] += 1
    inner: set[int] = set()
    seen: set[int] = set()  # within a sum that was followed: a part of a short one is no longer
    for node in reversed(nodes):
        if ops[node] not in ("add", "sub") or node in seen or level[node] < hoist.MOTION:
            continue
        terms: list[tuple[int, int]] = []
        within: list[int] = []
        stack = [(1, node)]
        while stack:
            sign, x = stack.pop()
            op = ops[x]
            if op not in _SUMS or level[x] != hoist.MOTION or (x != node and (uses[x] != 1 or x in sinks)):
                terms.append((sign, x))
                continue
            within.append(x)
            if op == "neg":
                stack.append((-sign, args[x][0]))
            else:
                first, second = args[x]
                stack += ((sign if op == "add" else -sign, second), (sign, first))
        seen.update(within)
        if len(terms) >= FEWEST_TERMS:
            c.sums[node] = terms
            inner.update(within[1:])
    return inner


def _assign(g: Graph, c: Clusters, nodes: list[int], inner: set[int]) -> None:
    """Give each node to the only cluster that uses it, or make it the root of one."""
    terms = {x for entries in c.sums.values() for _, x in entries}
    written = terms.union(c.sinks, c.sums)
    owners: dict[int, int | None] = {}  # None: several
    for node in reversed(nodes):
        if node in inner or g.op[node] in SOLVES:
            continue
        is_leaf = c.is_leaf(g, node)
        owner = owners.get(node, node)
        if node in written or (owner is None and not is_leaf and not _is_cheap(g, c, node)):
            c.roots.append(node)
            if not is_leaf and node in owners:
                c.shared.add(node)
            owner = node
        if is_leaf or node in c.sums:
            continue
        for x in g.operands(node):
            if owners.setdefault(x, owner) != owner:
                owners[x] = None
    c.roots.reverse()


def _is_cheap(g: Graph, c: Clusters, node: int) -> bool:
    """Whether a node is one operation on leaves, or on one number that moves and what does not."""
    if g.op[node] not in _CHEAP:
        return False
    operands = g.operands(node)
    return all(c.is_leaf(g, x) for x in operands) or sum(c.level[x] == hoist.MOTION for x in operands) == 1


# Where a cluster's number comes from: a vector that the function is given, what it keeps, a solver's array (its node).
KEPT = "kept"
HOISTED = "hoisted"
_VECTORS = {Q: "q", V: "v", A: "a", LAM: "lam", PARAM: "p", INPUT: "u", VIRTUAL: "tau"}
_COMMUTES = frozenset(("add", "mul"))


class Instance(NamedTuple):
    """One cluster: its root, and the nodes that it reads, in the order in which its shape names them."""

    root: int
    reads: tuple[int, ...]


class Shapes:
    """Finds the shapes of the clusters of one function."""

    def __init__(self, g: Graph, clusters: Clusters) -> None:
        self.g, self.clusters = g, clusters
        self._kept = set(clusters.shared)
        self._colours: dict[tuple, int] = {}
        self._colour: dict[int, int] = {}  # as a reader sees a node: where it comes from, or its operations
        self._time = g.var(T)
        self._seen: dict[int, tuple] = {}  # what `_look` says of nodes below the roots
        self._ordered: dict[int, tuple[int, ...]] = {}
        self._shapes: dict[tuple, int] = {}

    def is_kept(self, node: int) -> bool:
        """Whether a cluster makes this number for others."""
        return node in self._kept

    def source(self, node: int) -> str | int:
        """Where a number that a cluster reads comes from."""
        g = self.g
        if node in self.clusters.sums:
            return f"sum {node}"
        if node in self._kept:
            return KEPT
        if g.op[node] == "element":
            return g.args[node][0]
        if g.op[node] == "var" and g.args[node][0] != T:
            return _VECTORS[g.args[node][0]]
        return HOISTED

    def is_fixed(self, node: int) -> bool:
        """Whether a node is a number, or time: part of a shape."""
        return self.g.op[node] == "const" or node == self._time

    def is_read(self, node: int, root: int) -> bool:
        """Whether the cluster of `root` finds this node's number, instead of computing it."""
        if node in self._kept and node != root:
            return True
        g = self.g
        return g.op[node] != "const" and self.clusters.is_leaf(g, node) and node != self._time

    def ordered(self, node: int) -> tuple[int, ...]:
        """A node's operands; those of a sum or product by their colours, as their own order is an accident."""
        found = self._ordered.get(node)
        if found is None:
            found = self.g.operands(node)
            if self.g.op[node] in _COMMUTES and self.colour(found[0]) > self.colour(found[1]):
                found = found[::-1]
            self._ordered[node] = found
        return found

    def colour(self, node: int) -> int:
        """A number for what a node looks like from outside."""
        known = self._colour
        if node not in known:
            stack = [node]
            while stack:
                x = stack[-1]
                waiting = [] if x in known else [o for o in self._below(x) if o not in known]
                if waiting:
                    stack += waiting
                    continue
                stack.pop()
                if x not in known:
                    known[x] = self._number(x)
        return known[node]

    def _below(self, node: int) -> tuple[int, ...]:
        hidden = node in self._kept or self.g.op[node] in ON_ARRAYS
        return () if hidden else self.g.operands(node)

    def _number(self, node: int) -> int:
        g = self.g
        op = g.op[node]
        if self.is_fixed(node):
            key: tuple = (op, g.args[node])
        elif node in self._kept or op in ("var", "element"):
            key = ("read", self.source(node))
        else:
            below = [self._colour[x] for x in g.operands(node)]
            key = (op, *(sorted(below) if op in _COMMUTES else below))
        return self._colours.setdefault(key, len(self._colours))

    def shape(self, root: int) -> tuple[int, Instance]:
        """The number of the shape of the cluster of a root, and what this one reads.

        A shape lists the cluster's nodes from the root down, each with its operation or, where it was met before, that
        place in the list.
        """
        shape: list = []
        met: dict[int, int] = {}
        reads: list[int] = []
        stack = [root]
        known = self._seen
        look = self._look(root, self.is_read(root, root))
        while stack:
            node = stack.pop()
            if node in met:
                shape.append(met[node])
                continue
            if met:
                look = known.get(node)
                if look is None:
                    look = known[node] = self._look(node, self.is_read(node, root))
            met[node] = len(met)
            entry, below = look
            shape.append(entry)
            if below is None:
                reads.append(node)
            else:
                stack += below
        return self._shapes.setdefault(tuple(shape), len(self._shapes)), Instance(root, tuple(reads))

    def _look(self, node: int, is_read: bool) -> tuple[tuple | str, tuple[int, ...] | None]:
        """What stands in a shape for a node, and its operands, the last first; None where the cluster reads it."""
        g = self.g
        if is_read:
            source = self.source(node)
            return (source, self.colour(node) if source == HOISTED else 0), None
        if self.is_fixed(node):
            return (g.op[node], g.args[node]), ()
        return g.op[node], self.ordered(node)[::-1]


FEWEST = 4  # clusters of one shape that make a loop
LONGEST_PERIOD = 40  # heights in a pass of a loop that works through what depends on the pass before
CLUSTERS, SUM, SOLVE = "clusters", "sum", "solve"
INTO = "into"
# What must be there before: a root, the result of a solver, or (`INTO`, a solver or sum) all that enters it.
Need = int | tuple[str, int]
FACTORS = ("factor_ldl", "factor_fronts")


@dataclass
class Group:
    """Clusters of one shape that are written to the same arrays; or one long sum; or one call of a solver.

    Attributes
    ----------
    kind : {"clusters", "sum", "solve"}
    targets : tuple
        Where each member is written: `OUT`, a solver's node, or (`SUM`, the sum's node, a sign).
    members : list of Instance
    places : list of tuple of int
        For each member, its places in the arrays among `targets`.
    needs : list of tuple of Need
        Of each member.
    in_turns : bool
        Whether members take turns with those of other groups, each pass of a loop needing the one before.
    """

    kind: str
    targets: tuple
    members: list[Instance] = field(default_factory=list)
    places: list[tuple[int, ...]] = field(default_factory=list)
    needs: list[tuple[Need, ...]] = field(default_factory=list)
    in_turns: bool = False

    def add(self, member: Instance, sinks: Sequence[Sink], needs: tuple[Need, ...]) -> None:
        """Add a member."""
        self.members.append(member)
        self.places.append(tuple(place for _, place in sinks))
        self.needs.append(needs)

    def upwards(self) -> Group:
        """The same with places that rise, where members do not need each other: an index that falls needs a table."""
        falls = len(self.members) > 1 and self.places[0] > self.places[-1]
        if not falls or any(isinstance(target, tuple) for target in self.targets):
            return self
        own = {member.root for member in self.members}
        if any(not own.isdisjoint(needs) for needs in self.needs):
            return self
        return self.part(list(range(len(self.members) - 1, -1, -1)))

    def part(self, indices: list[int]) -> Group:
        """Some of the members."""
        return Group(
            self.kind,
            self.targets,
            [self.members[k] for k in indices],
            [self.places[k] for k in indices],
            [self.needs[k] for k in indices],
        )


@dataclass(frozen=True)
class Schedule:
    """Groups in stages: what one stage needs, earlier ones have made."""

    clusters: Clusters
    shapes: Shapes
    stages: list[list[Group]]

    def is_short(self, in_turns: bool = True) -> bool:
        """Whether loops leave at most a third of the text; with or without those whose groups take turns."""
        groups = [group for stage in self.stages for group in stage]
        counts = [len(group.members) for group in groups]
        left = [
            1 if count >= FEWEST and (in_turns or not group.in_turns) else count
            for group, count in zip(groups, counts, strict=True)
        ]
        return 3 * sum(left) <= sum(counts)


def schedule(g: Graph, clusters: Clusters) -> Schedule:
    """Order the clusters of a function."""
    shapes = Shapes(g, clusters)
    return Schedule(clusters, shapes, _staged(_groups(g, clusters, shapes)))


def may_be_short(g: Graph, c: Clusters) -> bool:
    """Whether a schedule may be short: looks for fewer differences of clusters than that does, in a third of the time.

    What clusters have in common as trees, in which what they use twice stands twice.
    """
    shapes, ops, operands_of = Shapes(g, c), g.op, g.operands
    kept = {node: hash(shapes.source(node)) for node in c.shared}
    seen: dict[int, int] = {}  # a number for what a reader sees of a node
    made: dict[int, int] = {}  # and for how a kept one is made
    for node in c.nodes:
        op = ops[node]
        if op in _COMMUTES:
            a, b = operands_of(node)
            a, b = seen[a], seen[b]
            found = hash((op, a + b, a ^ b))
        elif op in ("const", "var", "element"):
            found = hash(g.args[node] if shapes.is_fixed(node) else shapes.source(node))
        else:
            found = hash((op, *[seen[x] for x in operands_of(node)]))
        if node in kept:
            made[node], seen[node] = found, kept[node]
        else:
            seen[node] = found
    counts: Counter[tuple] = Counter()
    for root, writings in _writings(g, c):
        own = root if root in c.sums else made.get(root, seen[root])
        counts.update((own, targets, root in c.shared) for targets, _ in writings)
    left = sum(1 if count >= FEWEST else count for count in counts.values())
    return 3 * left <= counts.total()


def _writings(g: Graph, c: Clusters) -> Iterator[tuple[int, list[tuple[tuple, list[Sink]]]]]:
    """For each root what it is written to, and the places there: one group's member each."""
    summed: dict[int, list[tuple]] = defaultdict(list)
    for total, terms in c.sums.items():
        for sign, node in terms:
            summed[node].append((SUM, total, sign))
    for root in c.roots:
        sinks, sums = c.sinks.get(root, []), summed.get(root, [])
        parts = [(sinks, sums)]
        # What no cluster computes, but for instance a 1 in many places of a matrix, is written by as many members.
        if root not in c.sums and c.is_leaf(g, root):
            parts = [([x], []) for x in sinks] + [([], sums)]
        written = [((*(array for array, _ in some), *more), some) for some, more in parts]
        yield root, [(targets, some) for targets, some in written if targets or root in c.shared]


def _groups(g: Graph, c: Clusters, shapes: Shapes) -> list[Group]:
    found: dict[tuple, Group] = {}
    for root, writings in _writings(g, c):
        if root in c.sums:
            ((targets, sinks),) = writings
            group = found[SUM, root] = Group(SUM, targets)
            group.add(Instance(root, ()), sinks, ((INTO, root),))
            continue
        shape, instance = shapes.shape(root)
        needs = _needed(g, shapes, instance)
        for targets, some in writings:
            group = found.setdefault((shape, targets, root in c.shared), Group(CLUSTERS, targets))
            group.add(instance, some, needs)
    for node in c.solves:
        first = g.args[node][0]
        factors = (first,) if g.op[first] in FACTORS else ()
        group = found[SOLVE, node] = Group(SOLVE, ())
        group.add(Instance(node, ()), (), ((INTO, node), *factors))
    return [*found.values()]


def _needed(g: Graph, shapes: Shapes, instance: Instance) -> tuple[Need, ...]:
    kept = [x for x in instance.reads if shapes.is_kept(x) and x != instance.root]
    made = {g.args[x][0] for x in instance.reads if g.op[x] == "element"}
    return (*kept, *made)


def _made(group: Group, member: Instance) -> list[Need]:
    """What others can need of a member: its number, the result of a solver, or an entry of one's array or of a sum."""
    into = [target[1] if isinstance(target, tuple) else target for target in group.targets]
    return [member.root, *((INTO, x) for x in into if x != OUT)]


def _staged(groups: list[Group]) -> list[list[Group]]:
    """Groups in stages.

    A group may need itself: its members stand in the order in which one makes what the next reads. Groups that need
    each other in a circle are taken apart.
    """
    makers: dict[Need, tuple[int, ...]] = {}
    for k, group in enumerate(groups):
        alone = (k,)
        for member in group.members:
            for need in _made(group, member):
                known = makers.setdefault(need, alone)
                if known[-1] != k:
                    makers[need] = known + alone
    waiting = [
        set().union(*(makers.get(x, ()) for x in set().union(*group.needs))) - {k}
        for k, group in enumerate(groups)
    ]
    users: dict[int, list[int]] = defaultdict(list)
    for k, needed in enumerate(waiting):
        for x in sorted(needed):
            users[x].append(k)
    stages: list[list[Group]] = []
    done: set[int] = set()
    ready = [k for k, needed in enumerate(waiting) if not needed]
    while ready:
        stages.append([groups[k].upwards() for k in ready])
        done.update(ready)
        freed: set[int] = set()
        for k in ready:
            for user in users[k]:
                waiting[user].discard(k)
                if not waiting[user]:
                    freed.add(user)
        ready = sorted(freed)
    return stages + _by_height([group for k, group in enumerate(groups) if k not in done])


def _by_height(groups: list[Group]) -> list[list[Group]]:
    """Stages of groups that need each other in a circle: of each group, the members of one height together.

    Where heights repeat, as along a chain whose links are worked through one after another, a stretch of them is one
    stage: a loop that goes through all heights of a period in each pass.
    """
    members = sorted((m.root, k, i) for k, group in enumerate(groups) for i, m in enumerate(group.members))
    height: dict[Need, int] = {}
    parts: dict[int, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))
    for _, k, i in members:
        own = 1 + max((height.get(x, -1) for x in groups[k].needs[i]), default=-1)
        for need in _made(groups[k], groups[k].members[i]):
            height[need] = max(own, height.get(need, -1))
        parts[own][k].append(i)
    levels = [parts[level] for level in sorted(parts)]
    stages: list[list[Group]] = []
    first = 0
    for begin, period, n_passes in _stretches([_pattern(groups, level) for level in levels]):
        stages += ([groups[k].part(own) for k, own in level.items()] for level in levels[first:begin])
        first = begin + period * n_passes
        stages.append(_interleaved(groups, levels[begin:first], period))
    return stages + [[groups[k].part(own) for k, own in level.items()] for level in levels[first:]]


def _pattern(groups: list[Group], level: dict[int, list[int]]) -> tuple | None:
    """Which groups have how many members at a height; None where one is no cluster, or makes a loop by itself."""
    if any(groups[k].kind != CLUSTERS or len(own) >= FEWEST for k, own in level.items()):
        return None
    return tuple((k, len(level[k])) for k in sorted(level))


def _interleaved(groups: list[Group], levels: list[dict[int, list[int]]], period: int) -> list[Group]:
    """The groups of a loop that goes through `period` heights in each pass, in the order of its body."""
    return [
        replace(groups[k].part([level[k][place] for level in levels[offset::period]]), in_turns=True)
        for offset in range(period)
        for k in levels[offset]
        for place in range(len(levels[offset][k]))
    ]


def _stretches(patterns: list[tuple | None]) -> Iterator[tuple[int, int, int]]:
    """Where patterns repeat: the first of a stretch, its period, and how often it is gone through, `FEWEST` or more."""
    begin = 0
    while begin < len(patterns):
        best = (0, 0, 0)  # what a loop spares, then the shorter period
        for period in range(1, LONGEST_PERIOD + 1):
            end = begin
            while (
                end + period < len(patterns)
                and patterns[end] is not None
                and patterns[end] == patterns[end + period]
            ):
                end += 1
            n_passes = (end - begin) // period + 1
            if n_passes >= FEWEST:
                best = max(best, ((n_passes - 1) * period, -period, n_passes))
        spared, period, n_passes = best
        if not spared:
            begin += 1
            continue
        yield begin, -period, n_passes
        begin -= period * n_passes
