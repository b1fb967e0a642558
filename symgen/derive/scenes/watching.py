"""Outputs, events, resets and marks of a scene: they look at several subsystems, which do not look at each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import sympy

from symgen.runtime.graph.functions import IN_CODE

from ...model.description import Description
from ...model.tree import postorder
from ..graph.graph import Graph
from ..graph.kinds import INPUT, LAM, PARAM, A, Q, T, V
from ..load import Loader
from ..marks import Mark, mark_function
from ..program import Function
from .components import Component

if TYPE_CHECKING:
    from ..derivation import Derivation

_VECTORS = {Q: "q", V: "v", A: "v", LAM: "c", PARAM: "parameters", INPUT: "inputs"}


def watchers(
    d: Description, kinds: list[list[Component]], derivations: list[Derivation], marks: list[Mark]
) -> tuple[Graph, list[Function]]:
    """The functions that look at a scene, on a graph of their own."""
    g = Graph()
    if not (d.outputs or d.events or marks):
        return g, []
    needed = _needed(d, marks)
    symbols = {"t": g.var(T)}
    symbols |= {r.name: g.var(V, k) for k, r in enumerate(d.rates)}
    symbols |= {c.name: g.var(Q, k) for k, c in enumerate(d.coordinates)}
    symbols |= {p.name: g.var(PARAM, k) for k, p in enumerate(d.parameters)}
    symbols |= {u.name: g.var(INPUT, k) for k, u in enumerate(d.inputs)}
    symbols |= {c.name: g.const(c.value) for c in d.constants}
    rates: dict[int, int] = {symbols["t"]: g.one}
    for kind, derivation in zip(kinds, derivations, strict=True):
        for component in kind:
            names = [name for name in _components(component.description) if name in needed]
            copied = _copied(g, kind[0], derivation, component, names)
            symbols |= dict(zip(names, copied, strict=False))
            moved = copied[len(names) :]
            rates |= {g.var(Q, k): rate for k, rate in zip(component.places["q"], moved, strict=True)}
    loader = Loader(g, symbols, rates)
    for name, expression in d.definitions:
        if name in needed:
            loader.define(name, expression)
    return g, [*_functions(d, loader), *mark_function(loader, marks)]


def _functions(d: Description, loader: Loader) -> Iterator[Function]:
    load = loader.load
    if d.outputs:
        yield Function("outputs", "Outputs.", tuple(load(e) for _, e in d.outputs))
    if d.events:
        yield Function("events", "Event functions.", tuple(load(e.when) for e in d.events))
    q = {c.name: k for k, c in enumerate(d.coordinates)}
    v = {r.name: len(q) + k for k, r in enumerate(d.rates)}
    for event in d.events:
        if event.action == "reset":
            new = {(v if r.is_rate else q)[r.target]: load(r.value) for r in event.resets}
            places = sorted(new)
            doc = f"State after event '{event.name}'."
            outputs = tuple(new[k] for k in places)
            yield Function(f"reset_{event.name}", doc, outputs, tuple(places), copies=len(q) + len(v))


def _needed(d: Description, marks: list[Mark]) -> set[str]:
    """All names that the watchers' expressions mention, through definitions too."""
    roots = [*(expression for _, expression in d.outputs), *(x for mark in marks for x in mark.values)]
    for event in d.events:
        roots += [event.when, *(r.value for r in event.resets)]
    found = _names(roots)
    for name, expression in reversed(d.definitions):
        if name in found:
            found |= _names([expression])
    return found


def _names(roots: Iterable[sympy.Basic]) -> set[str]:
    return {node.name for node in postorder(roots) if isinstance(node, sympy.Symbol)}


def _components(d: Description) -> list[str]:
    """The names of the components of points and axes."""
    return [f"{item.name}_{letter}" for item in (*d.points, *d.axes) for letter in "xyz"]


def _copied(
    g: Graph, first: Component, derivation: Derivation, member: Component, names: list[str]
) -> list[int]:
    """Components of a member's points and axes, then its dq/dt, made from those of the first of its kind."""
    twins = dict(zip(_components(member.description), _components(first.description), strict=True))
    wanted = [derivation.loader.symbols[twins[name]] for name in names] + list(derivation.x.qdot)
    return copied_nodes(g, derivation.g, member, wanted)


def copied_nodes(g: Graph, own: Graph, member: Component, wanted: list[int]) -> list[int]:
    """Nodes of the first of a kind on another graph, with the variables of a member in the place of its own."""
    new: dict[int, int] = {}
    for node in own.reachable(wanted):
        op, args = own.op[node], own.args[node]
        if op == "const":
            new[node] = g.const(args[0])
        elif op == "var":
            kind, k = args
            new[node] = g.var(kind, 0 if kind == T else member.places[_VECTORS[kind]][k])
        else:
            operands = [new[x] for x in args]
            new[node] = g.call(op, *operands) if op in IN_CODE else getattr(g, op)(*operands)
    return [new[node] for node in wanted]
