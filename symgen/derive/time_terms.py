"""What the equations have of time alone, beyond polynomials: pulses, jumps and oscillations, known before any run."""

from __future__ import annotations

from collections.abc import Iterable

from .graph.graph import Graph
from .graph.nodes import INPUT, PARAM, T
from .program import Function

NAME = "time_terms"
_DOC = "What the equations have of time alone, beyond polynomials."
_KNOWN = T | PARAM | INPUT  # before a run, but for inputs that move
_LINEAR = ("add", "sub", "neg")
_EQUATIONS = ("residual", "constraint_residual", "events")


def time_terms(g: Graph, outputs: Iterable[int]) -> list[int]:
    """The largest parts of some functions that only time, parameters and inputs decide, and no polynomial gives.

    Sums are taken apart, and factors and divisors without time left out: what bends or jumps in a term does so in the
    whole. Where time alone chooses between two expressions, what tells which is a term of its own, a step of 1.

    Parameters
    ----------
    g : Graph
    outputs : iterable of int
        Nodes of the equations.

    Returns
    -------
    list of int
        Nodes, in the order of the graph.
    """
    polynomial: dict[int, bool] = {}
    found: set[int] = set()
    seen: set[int] = set()
    stack = [node for node in outputs if g.mask[node] & T]
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        operands = [x for x in g.operands(node) if g.mask[x] & T]
        op = g.op[node]
        if g.mask[node] & ~_KNOWN:
            a, b = g.operands(node)[:2] if op == "select" else (g.zero, g.zero)
            chooser = g.mask[a] | g.mask[b]
            if chooser & T and not chooser & ~_KNOWN:
                found.add(g.select(a, b, g.one, g.zero))
            stack += _factors(g, node) if op == "mul" else operands
        elif op in _LINEAR or (op == "mul" and len(operands) == 1) or (op == "div" and _over_number(g, node)):
            stack += operands
        elif not _is_polynomial(g, node, polynomial):
            found.add(node)
    return sorted(found)


def _factors(g: Graph, node: int) -> list[int]:
    """The factors of a product that depend on time; those of time alone as one: a window hides what it multiplies."""
    alone, others, pending = g.one, [], [node]
    while pending:
        factor = pending.pop()
        if not g.mask[factor] & ~_KNOWN:
            alone = g.mul(alone, factor)
        elif g.op[factor] in ("mul", "neg"):
            pending += g.operands(factor)
        elif g.mask[factor] & T:
            others.append(factor)
    return [alone, *others] if g.mask[alone] & T else others


def _over_number(g: Graph, node: int) -> bool:
    """Whether time is in the numerator of a quotient alone."""
    return not g.mask[g.operands(node)[1]] & T


def _is_polynomial(g: Graph, node: int, known: dict[int, bool]) -> bool:
    """Whether a node is a polynomial in time."""
    for x in g.reachable([node], T):
        op = g.op[x]
        known[x] = (op in ("var", *_LINEAR, "mul") or (op == "div" and _over_number(g, x))) and all(
            known[y] for y in g.operands(x) if g.mask[y] & T
        )
    return known[node]


def own_terms(g: Graph, functions: Iterable[Function]) -> list[int]:
    """The terms of a model's equations and of what its events look at."""
    return time_terms(g, (node for f in functions if f.name in _EQUATIONS for node in f.outputs))


def time_function(terms: Iterable[int]) -> list[Function]:
    """The function of some terms; none where there are none."""
    outputs = tuple(dict.fromkeys(terms))
    return [Function(NAME, _DOC, outputs)] if outputs else []


def term_count(functions: Iterable[Function]) -> dict[str, int]:
    """How many terms there are, for the header, if any."""
    count = sum(len(f.outputs) for f in functions if f.name == NAME)
    return {NAME: count} if count else {}
