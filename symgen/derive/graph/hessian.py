"""Second derivatives on the graph by edge pushing (Gower and Mello 2012, Algorithm 3): M from T, and mixed ones."""

from __future__ import annotations

from collections.abc import Callable

from .condense import Statement, condense
from .graph import Graph
from .nodes import SparseRows

Edges = dict[int, dict[int, int]]  # edges[a][b] = edges[b][a] = weight
LARGEST_STATEMENT = 3  # inputs of an operation that is merged into its only user


def hessian(g: Graph, output: int, inputs: list[int]) -> list[list[int]]:
    """Second derivatives of `output` by `inputs`.

    One reverse sweep carries the adjoint of each statement and the nonlinear "edges" between pairs of them.
    On the kinetic energy of a tree of bodies the edges gather the inertia of all that hangs below a joint,
    which is the composite-body algorithm.

    Parameters
    ----------
    g : Graph
    output : int
    inputs : list of int
        Variables of one kind.

    Returns
    -------
    list of list of int, n x n, symmetric
    """
    return g.dense(sparse_hessian(g, output, inputs), len(inputs))


def sparse_hessian(g: Graph, output: int, inputs: list[int]) -> SparseRows:
    """The nonzero entries of `hessian`, each row in the order of its columns."""
    mask = _kinds(g, inputs)
    edges = _push_edges(g, condense(g, output, mask, 0), output, mask, lambda a, b: True)
    rows = _by_position(g, edges, inputs, inputs)
    return [dict(sorted(row.items())) for row in rows]


def mixed_hessian(g: Graph, output: int, rows: list[int], columns: list[int]) -> SparseRows:
    """Second derivatives of `output` by each of `rows` and each of `columns`.

    Only the edges between what depends on rows and what depends on columns are carried, and only the adjoints of
    what depends on rows.

    Parameters
    ----------
    g : Graph
    output : int
    rows, columns : list of int
        Variables; no kind may be in both.

    Returns
    -------
    SparseRows
    """
    by_row, by_column = _kinds(g, rows), _kinds(g, columns)
    masks = g.mask

    def couples(a: int, b: int) -> bool:
        one_way = masks[a] & by_row and masks[b] & by_column
        return bool(one_way or (masks[b] & by_row and masks[a] & by_column))

    statements = condense(g, output, by_row | by_column, LARGEST_STATEMENT)
    edges = _push_edges(g, statements, output, by_row, couples)
    return _by_position(g, edges, rows, columns)


def _by_position(g: Graph, edges: Edges, rows: list[int], columns: list[int]) -> SparseRows:
    position = {variable: k for k, variable in enumerate(columns)}
    return [
        {position[x]: w for x, w in sorted(edges.get(row, {}).items()) if x in position and w != g.zero}
        for row in rows
    ]


def _kinds(g: Graph, variables: list[int]) -> int:
    mask = 0
    for variable in variables:
        mask |= g.mask[variable]
    return mask


def _push_edges(
    g: Graph,
    statements: dict[int, Statement],
    output: int,
    linear: int,
    wanted: Callable[[int, int], bool],
) -> Edges:
    """The edges between variables, those that are wanted.

    `linear` are the kinds whose adjoints are carried: all that can meet a wanted edge.
    """
    adjoint = {output: g.one}
    edges: Edges = {}
    for node in _by_height(statements):
        if g.op[node] == "var":
            continue
        statement = statements[node]
        _push(g, edges, node, statement, wanted)
        weight = adjoint.pop(node, g.zero)
        if weight != g.zero:
            for (x, y), second in statement.curvature.items():
                if wanted(x, y):
                    _accumulate(g, edges, x, y, g.mul(weight, second))
            for x, d in statement.gradient.items():
                if g.mask[x] & linear:
                    adjoint[x] = g.add(adjoint.get(x, g.zero), g.mul(weight, d))
    return edges


def _by_height(statements: dict[int, Statement]) -> list[int]:
    """Statements from the highest above the variables down.

    So chains that run beside each other (velocities, accelerations and virtual velocities of a chain of bodies)
    come down together, and edges between far ends of them do not arise.
    """
    height: dict[int, int] = {}
    for node, statement in statements.items():
        height[node] = 1 + max((height[x] for x in statement.gradient if x != node), default=0)
    return sorted(statements, key=lambda node: (-height[node], -node))


def _accumulate(g: Graph, edges: Edges, a: int, b: int, weight: int) -> None:
    if weight == g.zero:
        return
    row = edges.setdefault(a, {})
    total = row.get(b)
    row[b] = edges.setdefault(b, {})[a] = weight if total is None else g.add(total, weight)


def _push(
    g: Graph, edges: Edges, node: int, statement: Statement, wanted: Callable[[int, int], bool]
) -> None:
    """Move the edges of a statement to its inputs (chain rule for second derivatives)."""
    own = edges.pop(node, None)
    if not own:
        return
    local = list(statement.gradient.items())
    for other, weight in own.items():
        if other == node:
            for k, (x, dx) in enumerate(local):
                for y, dy in local[k:]:
                    if wanted(x, y):
                        _accumulate(g, edges, x, y, g.mul(g.mul(dx, dy), weight))
            continue
        edges[other].pop(node, None)
        for x, d in local:
            if wanted(x, other):
                push = g.mul(d, weight)
                _accumulate(g, edges, x, other, g.mul(g.const(2.0), push) if x == other else push)
