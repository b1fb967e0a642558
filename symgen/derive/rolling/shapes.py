"""Shapes of clusters: two have one shape when they differ only in where their numbers come from."""

from __future__ import annotations

from dataclasses import dataclass

from ..graph.graph import Graph
from ..graph.kinds import INPUT, LAM, PARAM, A, Q, T, V
from ..graph.nodes import ON_ARRAYS
from .clusters import Clusters

# Where a cluster's number comes from: a vector that the function is given, what it keeps, a solver's array (its node).
KEPT = "kept"
HOISTED = "hoisted"
_VECTORS = {Q: "q", V: "v", A: "a", LAM: "lam", PARAM: "p", INPUT: "u"}
_COMMUTES = frozenset(("add", "mul"))


@dataclass(frozen=True)
class Instance:
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

    def is_read(self, node: int, root: int) -> bool:
        """Whether the cluster of `root` finds this node's number, instead of computing it."""
        if node in self._kept and node != root:
            return True
        g = self.g
        return g.op[node] != "const" and self.clusters.is_leaf(g, node) and node != g.var(T)

    def ordered(self, node: int) -> tuple[int, ...]:
        """A node's operands; those of a sum or product by their colours, as their own order is an accident."""
        args = self.g.operands(node)
        if self.g.op[node] in _COMMUTES and self.colour(args[0]) > self.colour(args[1]):
            return args[::-1]
        return args

    def colour(self, node: int) -> int:
        """A number for what a node looks like from outside."""
        if node not in self._colour:
            stack = [node]
            while stack:
                x = stack[-1]
                waiting = [] if x in self._colour else [o for o in self._below(x) if o not in self._colour]
                if waiting:
                    stack += waiting
                    continue
                stack.pop()
                if x not in self._colour:
                    self._colour[x] = self._number(x)
        return self._colour[node]

    def _below(self, node: int) -> tuple[int, ...]:
        hidden = node in self._kept or self.g.op[node] in ON_ARRAYS
        return () if hidden else self.g.operands(node)

    def _number(self, node: int) -> int:
        g = self.g
        op = g.op[node]
        if op == "const" or node == g.var(T):
            key: tuple = (op, g.args[node])
        elif node in self._kept or op in ("var", "element"):
            key = ("read", self.source(node))
        else:
            below = [self._colour[x] for x in g.operands(node)]
            key = (op, *(sorted(below) if op in _COMMUTES else below))
        return self._colours.setdefault(key, len(self._colours))

    def shape(self, root: int) -> tuple[tuple, Instance]:
        """The shape of the cluster of a root, and what this one reads.

        The shape lists the cluster's nodes from the root down, each with its operation or, where it was met before,
        that place in the list.
        """
        g = self.g
        shape: list = []
        met: dict[int, int] = {}
        reads: list[int] = []
        stack = [root]
        while stack:
            node = stack.pop()
            if node in met:
                shape.append(met[node])
                continue
            met[node] = len(met)
            if self.is_read(node, root):
                source = self.source(node)
                shape.append((source, self.colour(node) if source == HOISTED else 0))
                reads.append(node)
            elif g.op[node] == "const" or node == g.var(T):
                shape.append((g.op[node], g.args[node]))
            else:
                shape.append(g.op[node])
                stack += reversed(self.ordered(node))
        return tuple(shape), Instance(root, tuple(reads))
