"""Forms made of forms: statements copied, with other places in their arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from symgen.runtime.graph.form import HELD, OUT, Form, Loop, Name, P, Place, Statement, Write, Y

Moved = Callable[[Place], Place]


def as_it_is(place: Place) -> Place:
    """The same place."""
    return place


def copied(
    source: Form, statements: Iterable[Statement], target: Form, y: Moved, p: Moved, out: Moved = as_it_is
) -> list[Statement]:
    """Return statements of one form for another, into whose store their operations go.

    Parameters
    ----------
    source, target : Form
    statements : iterable of statements
        Complete: what they read by name stands among them, or was copied before.
    y, p, out : callable
        The new places.
    """
    statements = list(statements)
    nodes, new = source.nodes, {}
    for node in nodes.reachable(_roots(statements)):
        op, args = nodes.op[node], nodes.args[node]
        if op == "const":
            new[node] = target.nodes.const(args[0])
        elif op != "var":
            new[node] = target.nodes.operation(op, *(new[x] for x in args))
        else:
            kind, index = args
            index = y(index) if kind == Y else p(index) if kind == P else index
            new[node] = target.nodes.var(kind, index)

    def copy(statement: Statement) -> Statement:
        if type(statement) is Loop:
            return statement._replace(body=tuple(map(copy, statement.body)))
        if type(statement) is Write and statement.array == OUT:
            return statement._replace(place=out(statement.place), node=new[statement.node])
        if type(statement) is Write or type(statement) is Name:
            return statement._replace(node=new[statement.node])
        return statement

    return list(map(copy, statements))


def needed(source: Form, names: Sequence[Name], statements: Sequence[Statement]) -> list[Name]:
    """Return those of `names`, in their order, whose values or later values `statements` read."""
    nodes, kept = source.nodes, []
    below = set(nodes.reachable(_roots(statements)))
    held = {nodes.args[x][1][0] for x in below if nodes.op[x] == "var" and nodes.mask[x] == HELD}
    for statement in reversed(names):
        if statement.name in held if statement.held else statement.node in below:
            kept.append(statement)
            below.update(nodes.reachable((statement.node,)))
    return kept[::-1]


def _roots(statements: Iterable[Statement]) -> list[int]:
    found = []
    for statement in statements:
        if type(statement) is Loop:
            found += _roots(statement.body)
        elif type(statement) is Name or type(statement) is Write:
            found.append(statement.node)
    return found
