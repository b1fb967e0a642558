"""Cuts a function into clusters: trees of operations, each of which ends in one number that is kept.

A number is kept where it is written to an array, where it is a term of a long sum, or where several clusters use it.
Everything else belongs to the only cluster that uses it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

from ..graph import hoist
from ..graph.graph import Graph
from ..graph.nodes import ON_ARRAYS

FEWEST_TERMS = 16  # of a sum that is made in a loop
_CHEAP = frozenset(
    ("add", "sub", "mul", "neg")
)  # repeated rather than kept, when they cost no more than reading
SOLVES = ON_ARRAYS - {"element"}

OUT = "out"
Sink = tuple[str | int, int]  # an array (`OUT`, or the node of a solver), and the place in it


@dataclass
class Clusters:
    """What a function keeps, and where.

    Attributes
    ----------
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
    c = Clusters(hoist.levels(g, nodes))
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
    uses: Counter[int] = Counter()
    for node in nodes:
        uses.update(g.operands(node))
    inner: set[int] = set()
    for node in reversed(nodes):
        if node in inner or g.op[node] not in ("add", "sub") or c.level[node] < hoist.MOTION:
            continue
        terms: list[tuple[int, int]] = []
        within: list[int] = []
        stack = [(1, node)]
        while stack:
            sign, x = stack.pop()
            alone = x == node or (uses[x] == 1 and x not in c.sinks)
            if g.op[x] in ("add", "sub", "neg") and alone and c.level[x] == hoist.MOTION:
                within.append(x)
                signs = {"add": (sign, sign), "sub": (sign, -sign), "neg": (-sign,)}[g.op[x]]
                stack += reversed(list(zip(signs, g.args[x], strict=True)))
            else:
                terms.append((sign, x))
        if len(terms) >= FEWEST_TERMS:
            c.sums[node] = terms
            inner.update(within[1:])
    return inner


def _assign(g: Graph, c: Clusters, nodes: list[int], inner: set[int]) -> None:
    """Give each node to the only cluster that uses it, or make it the root of one."""
    terms = {x for entries in c.sums.values() for _, x in entries}
    owners: dict[int, int | None] = {}  # None: several
    for node in reversed(nodes):
        if node in inner or g.op[node] in SOLVES:
            continue
        is_leaf = c.is_leaf(g, node)
        written = node in c.sinks or node in terms or node in c.sums
        cheap = _is_cheap(g, c, node)
        several = node in owners and owners[node] is None
        if written or (several and not is_leaf and not cheap):
            c.roots.append(node)
            if node in owners and not is_leaf:
                c.shared.add(node)
            owner: int | None = node
        else:
            owner = owners.get(node)
        if is_leaf or node in c.sums:
            continue
        for x in g.operands(node):
            owners[x] = owner if owners.get(x, owner) == owner else None
    c.roots.reverse()


def _is_cheap(g: Graph, c: Clusters, node: int) -> bool:
    """Whether a node is one operation on leaves, or on one number that moves and what does not."""
    if g.op[node] not in _CHEAP:
        return False
    operands = g.operands(node)
    return all(c.is_leaf(g, x) for x in operands) or sum(c.level[x] == hoist.MOTION for x in operands) == 1
