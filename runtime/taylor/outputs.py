"""The outputs of a generated function as nodes of a series graph."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from symgen.runtime.graph.carry_out import NoArrays, carry_out
from symgen.runtime.graph.form import Form, Name
from symgen.runtime.taylor.graph import SeriesGraph
from symgen.runtime.taylor.refusal import Refusal


def read_outputs(
    graph: SeriesGraph,
    form: Form,
    state: Callable[[int], int],
    wanted: set[int] | None = None,
    given: Mapping[int, int] | None = None,
    moving: Mapping[int, int] | None = None,
) -> dict[int, int]:
    """Add the operations behind `out[i]` to the graph; returns the node of each index.

    Parameters
    ----------
    graph : SeriesGraph
    form : Form
    state : callable
        Gives the node for `y[i]`.
    wanted : set of int, optional
        Indices of `out` to read; all by default. What nothing wanted needs may be outside of what has series.
    given : mapping of int to int, optional
        Nodes of the form whose series are known, whatever the form says that they are.
    moving : mapping of int to int, optional
        Nodes of what stands in `p` but is not constant: inputs over time.

    Raises
    ------
    Refusal
        An operation has no series, or a statement is none on numbers.
    """
    moving = moving or {}

    def parameter(index: int) -> int:
        return moving[index] if index in moving else graph.parameter(index)

    every = range(form.lengths.out) if wanted is None else wanted
    try:
        found = carry_out(
            form, _Series(graph), state, parameter, const=graph.number, wanted=every, given=given
        )
        return dict(found)
    except NoArrays:
        raise Refusal("a function has arrays, which have no series") from None


class _Series:
    """The operations of a form, on series."""

    def __init__(self, graph: SeriesGraph) -> None:
        self.graph = graph
        for name in ("time", "neg", "add", "sub", "mul", "div", "call"):
            setattr(self, name, getattr(graph, name))

    def select(self, is_strict: bool, a: int, b: int, then: int, otherwise: int) -> int:
        return self.graph.select("olt" if is_strict else "ole", a, b, then, otherwise)


def named_outputs(form: Form) -> dict[int, tuple[int, bool]]:
    """The outputs outside of loops that are a named value or its negative: index -> node, whether negative."""
    nodes = form.nodes
    named = {x.node for x, _ in form.statements() if type(x) is Name and nodes.op[x.node] != "const"}
    found = {}
    for write, count in form.writes():
        negative = nodes.op[write.node] == "neg" and write.node not in named
        node = nodes.args[write.node][0] if negative else write.node
        if not count and node in named:
            found[write.place.first] = (node, negative)
    return found
