"""Second derivatives on the graph by edge pushing (Gower and Mello 2012, Algorithm 3): M from T, and mixed ones."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from .differentiate import (
    depends_on,
    forward,
    is_guarded,
    is_not_clamped,
    partials,
    reverse,
    slope_needs_care,
    slope_of_power,
)
from .graph import Graph
from .nodes import LOCAL, SparseRows

# Edge pushing through every single operation multiplies each of the many edges of a node by the partials of sin(x),
# l sin(x) and so on, one after another. Multiplying those with each other first is cheaper (preaccumulation; Griewank
# and Walther, Evaluating Derivatives, 2008, section 10.2).


@dataclass(frozen=True)
class Statement:
    """First and second derivatives of a node by the statements below it; pairs of the second are in order."""

    gradient: dict[int, int]
    curvature: dict[tuple[int, int], int]


def condense(g: Graph, output: int, mask: int, largest: int) -> dict[int, Statement]:
    """The statements below `output` that depend on the kinds in `mask`, in topological order, with variables.

    An operation is merged into those that use it if it is a nonlinear function of a single statement, or if it has a
    single user and at most `largest` inputs. A sum onto a statement never is: chains along bodies remain chains.
    Nothing is merged if `largest` is 0.
    """
    nodes = g.moved([output], mask)
    active = set(nodes)
    users = Counter(x for node in nodes for x in set(depends_on(g, node)))
    result: dict[int, Statement] = {}
    merged: dict[int, Statement] = {}
    for node in nodes:
        if g.op[node] == "var":
            result[node] = Statement({node: g.one}, {})
            continue
        if is_guarded(g, node):
            result[node] = _by_variables(g, node, mask)
            continue
        below = {x: merged.get(x) or Statement({x: g.one}, {}) for x in depends_on(g, node) if x in active}
        statement = _compose(g, node, below)
        onto_statement = g.op[node] in ("add", "sub") and any(x in result for x in below)
        if node == output or onto_statement or not _merges(statement, users[node], largest):
            result[node] = statement
        else:
            merged[node] = statement
    return result


def _merges(statement: Statement, n_users: int, largest: int) -> bool:
    """Whether a statement disappears into its users; edges meet at a linear one with several, so that it stays."""
    n_inputs = len(statement.gradient)
    return n_inputs <= largest if n_users == 1 else n_inputs <= min(1, largest) and bool(statement.curvature)


def _compose(g: Graph, node: int, below: dict[int, Statement]) -> Statement:
    """Chain rule of first and second order for one operation."""
    gradient: dict[int, int] = {}
    curvature: dict[tuple[int, int], int] = {}

    def add(table: dict, key: int | tuple[int, int], value: int) -> None:
        if value != g.zero:
            table[key] = g.add(table.get(key, g.zero), value)

    for operand, partial in partials(g, node):
        if operand in below and partial != g.zero:
            for x, slope in below[operand].gradient.items():
                add(gradient, x, g.mul(partial, slope))
            for pair, bend in below[operand].curvature.items():
                add(curvature, pair, g.mul(partial, bend))
    for a, b, second in _second_partials(g, node, list(below)):
        for x, slope in below[a].gradient.items():
            for y, other in below[b].gradient.items():
                if a == b and y < x:
                    continue
                value = g.mul(second, g.mul(slope, other))
                twice = a != b and x == y
                add(curvature, (min(x, y), max(x, y)), g.mul(g.const(2.0), value) if twice else value)
    return Statement(
        {x: d for x, d in gradient.items() if d != g.zero},
        {pair: d for pair, d in curvature.items() if d != g.zero},
    )


def _by_variables(g: Graph, node: int, mask: int) -> Statement:
    """Derivatives of a choice by variables, not by what it is made of: see `differentiate.is_guarded`."""
    gradient = reverse(g, [(node, g.one)], mask)
    variables = sorted(gradient)
    curvature = {}
    for k, x in enumerate(variables):
        seconds = forward(g, [gradient[y] for y in variables[k:]], {x: g.one})
        curvature |= {(x, y): s for y, s in zip(variables[k:], seconds, strict=True) if s != g.zero}
    return Statement({x: d for x, d in gradient.items() if d != g.zero}, curvature)


def _second_partials(g: Graph, node: int, moving: list[int]) -> Iterator[tuple[int, int, int]]:
    """Second derivatives of one operation by each pair of the operands in `moving`."""
    op, args = g.op[node], g.args[node]
    if op in ("add", "sub", "neg"):
        return
    power = g.root_power(node)
    if power is not None and (op != "sqrt" or slope_needs_care(g, args[0])):
        base, exponent = power
        yield base, base, g.mul(g.const(exponent), slope_of_power(g, base, exponent - 1.0))
        return
    if op == "mul":
        a, b = args
        if a == b:
            yield a, a, g.const(2.0)
        elif len(moving) == 2:
            yield a, b, g.one
        return
    yield from _by_stand_ins(g, node, moving)


def _by_stand_ins(g: Graph, node: int, moving: list[int]) -> Iterator[tuple[int, int, int]]:
    """Second derivatives of any operation.

    Variables of their own stand in for the operands meanwhile: on the operands themselves, sign rules and
    identities could carry a derivative past them to what they are made of.
    """
    stand_in = {x: g.var(LOCAL, k) for k, x in enumerate(moving)}
    operands = {variable: x for x, variable in stand_in.items()}
    local = g.rebuild(node, [stand_in.get(x, x) for x in g.operands(node)])
    gradient = reverse(g, [(local, g.one)], LOCAL)
    moves = is_not_clamped(g, g.args[node][0]) if g.op[node] == "pow" else g.one
    operands = {variable: g.choose(moves, x, g.one) for variable, x in operands.items()}
    for k, x in enumerate(moving):
        up_to_x = [gradient.get(stand_in[y], g.zero) for y in moving[: k + 1]]
        second = g.substitute(forward(g, up_to_x, {stand_in[x]: g.one}), operands)
        yield from ((x, y, g.choose(moves, s, g.zero)) for y, s in zip(moving, second, strict=False))


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
    mul, add, one, zero = g.mul, g.add, g.one, g.zero
    local = [(x, d, edges.setdefault(x, {})) for x, d in statement.gradient.items()]
    for other, weight in own.items():
        if other == node:
            for k, (x, dx, _) in enumerate(local):
                for y, dy, _ in local[k:]:
                    if wanted(x, y):
                        _accumulate(g, edges, x, y, mul(mul(dx, dy), weight))
            continue
        row = edges[other]
        row.pop(node, None)
        for x, d, beside in local:
            if wanted(x, other):
                push = weight if d == one else mul(d, weight)
                if x == other:
                    push = mul(g.const(2.0), push)
                if push != zero:
                    total = beside.get(other)
                    beside[other] = row[x] = push if total is None else add(total, push)
