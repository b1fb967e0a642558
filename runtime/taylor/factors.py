"""Take common factors out of sums of products: a b + a c needs one product of series as a (b + c)."""

from __future__ import annotations

from collections import Counter

from symgen.runtime.taylor.graph import SeriesGraph

_LINEAR = ("add", "sub", "neg", "scale")

Term = tuple[int, int]  # a constant factor, and a series


def share_factors(graph: SeriesGraph, roots: list[int]) -> list[int]:
    """Rewrite sums in place, as long as that saves products; returns the roots."""
    while True:
        nodes = graph.reachable(roots)
        uses = Counter(a for node in nodes for a in graph.args[node])
        uses.update(roots)
        inside = {a for node in nodes if graph.op[node] in _LINEAR for a in graph.args[node] if uses[a] == 1}
        replaced = {}
        for node in nodes:
            if graph.op[node] in _LINEAR and not graph.is_constant(node) and node not in inside:
                better = _with_shared_factors(graph, node, uses)
                if better is not None:
                    replaced[node] = better
        if not replaced:
            return roots
        roots = graph.replace(replaced, roots)


def _with_shared_factors(graph: SeriesGraph, node: int, uses: Counter) -> int | None:
    terms = _terms(graph, node, uses)
    changed = False
    while True:
        single = [t for t in terms if graph.op[t[1]] == "mul" and uses[t[1]] == 1]
        counts = Counter(a for _, product in single for a in set(graph.args[product]))
        factor = min(counts, key=lambda a: (-counts[a], a), default=None)
        if factor is None or counts[factor] < 2:
            return _sum(graph, terms) if changed else None
        members = [t for t in single if factor in graph.args[t[1]]]
        rest = [(c, _other(graph.args[product], factor)) for c, product in members]
        one = graph.number(1.0)
        terms = [t for t in terms if t not in members] + [(one, graph.mul(factor, _sum(graph, rest)))]
        changed = True


def _other(args: tuple[int, ...], factor: int) -> int:
    return args[1] if args[0] == factor else args[0]


def _terms(graph: SeriesGraph, node: int, uses: Counter) -> list[Term]:
    """The terms of a sum, through those sums below that nothing else uses."""
    found: list[Term] = []
    pending = [(graph.number(1.0), node)]
    while pending:
        constant, term = pending.pop()
        kind, args = graph.op[term], graph.args[term]
        if graph.is_constant(term) or kind not in _LINEAR or (term != node and uses[term] > 1):
            found.append((constant, term))
        elif kind == "scale":
            pending.append((graph.mul(constant, args[0]), args[1]))
        elif kind == "neg":
            pending.append((graph.neg(constant), args[0]))
        else:
            pending.append((graph.neg(constant) if kind == "sub" else constant, args[1]))
            pending.append((constant, args[0]))
    return found


def _sum(graph: SeriesGraph, terms: list[Term]) -> int:
    total = None
    for constant, term in terms:
        part = graph.mul(constant, term)
        total = part if total is None else graph.add(total, part)
    return total
