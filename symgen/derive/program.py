"""What derivation yields: the header of the generated module and, per function, its output nodes on one graph."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .graph import Graph


@dataclass(frozen=True)
class Function:
    """A straight-line function: `outputs` are the nodes of `out`; structural zeros of a matrix are not written."""

    name: str
    doc: str
    outputs: tuple[int, ...]
    sparse: bool = False

    def written(self, g: Graph) -> list[tuple[int, int]]:
        """Pairs (index in `out`, node) of what the function writes."""
        return [(k, n) for k, n in enumerate(self.outputs) if not (self.sparse and n == g.zero)]


@dataclass(frozen=True)
class Program:
    """Derived equations: a graph, functions on it, and all that the generated module's header says."""

    graph: Graph
    functions: tuple[Function, ...]
    header: dict[str, Any]
    findings: tuple[str, ...] = field(default=())

    def operations(self) -> dict[str, int]:
        """Operations per function."""
        return {f.name: self.graph.count(node for _, node in f.written(self.graph)) for f in self.functions}
