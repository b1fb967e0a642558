"""Derivation of scenes: each kind of subsystem once, all together one model.

Outputs, events, resets and marks of a scene: they look at several subsystems, which do not look at each other.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace

from symgen.model.algebra import postorder
from symgen.runtime.graph.layouts import LATE
from symgen.runtime.graph.spelling import reset_function

from ...model import algebra
from ...model.description import Description, Point
from .. import pipeline, sensitivity
from ..contacts import has_switches, n_switches
from ..derivation import Derivation
from ..graph.copying import copied
from ..graph.graph import Graph
from ..graph.nodes import INPUT, LAM, PARAM, A, Q, T, V
from ..header import dependence, header
from ..input_rates import inputs_held
from ..jumps import expressions_of_motion, has_jumps
from ..limits import limit_function
from ..load import Loader
from ..marks import Mark, height_function, mark_function, mark_records, marks
from ..pipeline import functions
from ..program import ENERGY, POWER, RATIO, Function, Part, Program, Sizes
from ..savings import savings
from ..starts import formulas, start_function
from ..structure import structure
from ..time_terms import own_terms, term_count, time_function
from ..windings import winding_function
from .components import WORLD, Component, split, with_free_places

_VECTORS = {Q: "q", V: "v", A: "v", LAM: "c", PARAM: "parameters", INPUT: "inputs"}


def watchers(
    d: Description, kinds: list[list[Component]], derivations: list[Derivation], marks: list[Mark]
) -> tuple[Graph, list[Function]]:
    """The functions that look at a scene, on a graph of their own."""
    g = Graph()
    if not (d.outputs or d.events or d.windings or d.limits or marks or formulas(d)):
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
    loader = Loader(g, symbols, rates, d.tables)
    for name, expression in (*_fixed(d), *d.definitions):
        if name in needed and name not in symbols:
            loader.define(name, expression)
    drawn = (*mark_function(loader, marks), *height_function(loader, marks))
    made = (*start_function(loader, d), *limit_function(loader.load, d))
    return g, [*_functions(d, loader), *drawn, *made]


def _functions(d: Description, loader: Loader) -> Iterator[Function]:
    load = loader.load
    if d.outputs:
        yield Function("outputs", "Outputs.", tuple(load(e) for _, e in d.outputs))
    if d.events:
        yield Function("events", "Event functions.", tuple(load(e.when) for e in d.events))
    yield from winding_function(load, d)
    q = {c.name: k for k, c in enumerate(d.coordinates)}
    v = {r.name: len(q) + k for k, r in enumerate(d.rates)}
    for event in d.events:
        if event.action == "reset":
            new = {(v if r.is_rate else q)[r.target]: load(r.value) for r in event.resets}
            places = sorted(new)
            doc = f"State after event '{event.name}'."
            outputs = tuple(new[k] for k in places)
            yield Function(reset_function(event.name), doc, outputs, tuple(places), copies=len(q) + len(v))


def _needed(d: Description, marks: list[Mark]) -> set[str]:
    """All names that the watchers' expressions mention, through definitions too."""
    roots = [*(expression for _, expression in d.outputs), *(x for mark in marks for x in mark.values)]
    roots += [mark.height for mark in marks if mark.height is not None]
    roots += formulas(d)
    roots += (x for limit in d.limits for x in limit.numbers)
    roots += (x for winding in d.windings for x in winding.angles)
    for event in d.events:
        roots += [event.when, *(r.value for r in event.resets)]
    found = _names(roots)
    for name, expression in reversed(d.definitions):
        if name in found:
            found |= _names([expression])
    return found


def _names(roots: Iterable[algebra.Expr]) -> set[str]:
    return {node.name for node in postorder(roots) if isinstance(node, algebra.Symbol)}


def _components(d: Description) -> list[str]:
    """The names of the components of points and axes."""
    return [f"{item.name}_{letter}" for item in (*d.points, *d.axes) for letter in "xyz"]


def _fixed(d: Description) -> Iterator[tuple[str, algebra.Expr]]:
    """The components of points and axes of the world, of which no subsystem may have need."""
    for item in (*d.points, *d.axes):
        if item.body == WORLD:
            vector = item.at if isinstance(item, Point) else item.direction
            yield from zip((f"{item.name}_{letter}" for letter in "xyz"), vector, strict=False)


def _copied(
    g: Graph, first: Component, derivation: Derivation, member: Component, names: list[str]
) -> list[int]:
    """Components of a member's points and axes, then its dq/dt, made from those of the first of its kind."""
    twins = dict(zip(_components(member.description), _components(first.description), strict=True))
    wanted = [derivation.loader.symbols[twins[name]] for name in names] + list(derivation.x.qdot)
    return copied_nodes(g, derivation.g, member, wanted)


def copied_nodes(g: Graph, own: Graph, member: Component, wanted: list[int]) -> list[int]:
    """Nodes of the first of a kind on another graph, with the variables of a member in the place of its own."""
    return copied(
        g, own, wanted, lambda kind, k: g.var(kind, 0 if kind == T else member.places[_VECTORS[kind]][k])
    )


LONGEST_LIST = 4  # names in a comment
MOST_KINDS = 10  # in the findings
# Rates of a model, and rows of stops and frictions, or else operations that its user or its contacts have written, from
# which on functions are left out until a run asks for them: then they are half of the work and more
# (docs/benchmarks.md), and of smaller models a matter of milliseconds.
FEWEST_RATES, FEWEST_OPERATIONS = 20, 1000


def derive(
    description: Description, source: str = "", jacobian: bool = False, on_demand: bool = False
) -> Program:
    """Derive a model by its independent subsystems, equal ones once.

    Parameters
    ----------
    description : Description
        A checked description.
    source : str
        Hash of the model's text, kept in the module's header.
    jacobian : bool
        Whether there are functions for the derivatives of `rhs`; the model is then derived as one.
    on_demand : bool
        Whether what few runs call may be left out of a large model.

    Returns
    -------
    Program
    """
    if jacobian:
        sensitivity.refuse_switches(description)
        return _with_savings(pipeline.derive(description, source, jacobian=True))
    whole = has_switches(description) or has_jumps(description) or description.sensors
    whole = whole or description.start or description.balanced or inputs_held(description)
    split_up = description if whole else with_free_places(description)
    kinds = [] if whole else split(split_up)
    if not kinds or (len(kinds) == 1 and len(kinds[0]) == 1):
        late = LATE if on_demand and _is_large(description) else ()
        return _with_savings(pipeline.derive(description, source, late=late))
    description = split_up
    derivations = [Derivation(kind[0].description) for kind in kinds]
    parts = _parts(kinds, derivations)
    sizes = {letter: sum(len(p.members) * p.sizes[letter] for p in parts) for letter in parts[0].sizes}
    for key in (POWER, RATIO, ENERGY):
        sizes[key] = max(p.sizes[key] for p in parts)
    drawn = marks(description)
    g, watching = watchers(description, kinds, derivations, drawn)
    watching += time_function([*_time_terms(g, kinds, derivations, parts), *own_terms(g, watching)])
    program = Program(g, tuple(watching), {}, parts=parts, sizes=sizes)
    head = header(description, derivations[0], source, program.operations())
    head |= {"nw": sizes[POWER], "quaternions": _quaternions(kinds, derivations)}
    head.pop("dependent", None)
    head |= dependence(_dependent(kinds, derivations))
    head |= {"structure": _flags(derivations), "subsystems": _records(parts)}
    head |= mark_records(drawn) | term_count(watching) | pipeline.solves(program)
    return _with_savings(replace(program, header=head, findings=(*_findings(parts, derivations),)))


def _is_large(d: Description) -> bool:
    """Whether what few runs call is worth leaving out."""
    if len(d.rates) + n_switches(d) >= FEWEST_RATES:
        return True
    return len(postorder(expressions_of_motion(d))) >= FEWEST_OPERATIONS


def derive_whole(description: Description, late: Collection[str], gathered: bool = True) -> Program:
    """Derive a model that is no scene of several subsystems, with findings on what its structure saves.

    Parameters
    ----------
    description : Description
    late, gathered
        As of `pipeline.derive`.
    """
    return _with_savings(pipeline.derive(description, late=late, gathered=gathered))


def _parts(kinds: list[list[Component]], derivations: list[Derivation]) -> tuple[Part, ...]:
    made = [list(functions(d)) for d in derivations]
    present = {f.name for own in made for f in own}
    result = []
    for kind, d, own in zip(kinds, derivations, made, strict=True):
        sizes = {letter: len(places) for letter, places in kind[0].places.items()}
        sizes |= {POWER: 0 if d.conservative else 1, RATIO: 1 if sizes["c"] else 0, ENERGY: 1}
        own += _trivial(d, present - {f.name for f in own}, sizes)
        members = tuple(component.places for component in kind)
        result.append(Part(d.g, tuple(own), members, sizes, _title(kind)))
    return tuple(result)


def _time_terms(
    g: Graph, kinds: list[list[Component]], derivations: list[Derivation], parts: tuple[Part, ...]
) -> Iterator[int]:
    """What time alone does in each subsystem, on the graph of what looks at all."""
    for kind, d, part in zip(kinds, derivations, parts, strict=True):
        terms = own_terms(d.g, part.functions)
        for component in kind if terms else ():
            yield from copied_nodes(g, d.g, component, terms)


def _trivial(d: Derivation, missing: set[str], sizes: Sizes) -> Iterator[Function]:
    """What a subsystem without constraints or quaternions does where others have them."""
    g: Graph = d.g
    if "project" in missing:
        yield Function("project", "State.", (*d.x.q, *d.x.v))
    if "kinematics" in missing:
        nq, nv = sizes["q"], sizes["v"]
        yield Function.matrix("kinematics", "Matrix N.", [{k: g.one} for k in range(nq)], nv)
    if "solve" in missing:
        yield pipeline.solution(d)


def _title(kind: list[Component]) -> str:
    first = _list([c.name for c in kind[0].description.coordinates])
    if len(kind) == 1:
        return f"subsystem of {first}"
    last = _list([c.name for c in kind[-1].description.coordinates])
    return f"{len(kind)} equal subsystems: {first}; …; {last}"


def _list(names: list[str]) -> str:
    return ", ".join(names if len(names) <= LONGEST_LIST else [*names[: LONGEST_LIST - 1], "…"])


def _flags(derivations: list[Derivation]) -> dict[str, bool]:
    """Flags of the whole: something is there when one has it, something is so when it is so in all."""
    flags = [structure(d).flags for d in derivations]
    there = ("time_dependent", "velocity_dependent")
    return {key: (any if key in there else all)(f[key] for f in flags) for key in flags[0]}


def _quaternions(kinds: list[list[Component]], derivations: list[Derivation]) -> list[int]:
    """Where in q each unit quaternion begins."""
    found: list[int] = []
    for kind, d in zip(kinds, derivations, strict=True):
        found += [component.places["q"][k] for component in kind for k, _ in d.x.quaternions]
    return sorted(found)


def _dependent(kinds: list[list[Component]], derivations: list[Derivation]) -> Iterator[int]:
    for kind, d in zip(kinds, derivations, strict=True):
        yield from (component.places["c"][k] for component in kind for k in d.dependent)


def _records(parts: tuple[Part, ...]) -> list[dict]:
    keys = {"coordinates": "q", "rates": "v", "constraints": "c"}
    return [{key: [list(m[letter]) for m in part.members] for key, letter in keys.items()} for part in parts]


def _findings(parts: tuple[Part, ...], derivations: list[Derivation]) -> Iterator[str]:
    n, kinds = sum(len(part.members) for part in parts), len(parts)
    each = "derived once" if kinds == 1 else "each derived once"
    yield f"{n} subsystems of {kinds} kind{'s' * (kinds > 1)}, {each}"
    for part, d in zip(parts[:MOST_KINDS], derivations, strict=False):
        yield f"{part.title}: {'; '.join(structure(d).findings)}"
    if kinds > MOST_KINDS:
        yield f"and {kinds - MOST_KINDS} kinds more"


def _with_savings(program: Program) -> Program:
    """The program with what its structure saves, in operations."""
    found = list(program.findings)
    once, always = program.counts("rhs")
    if once:
        found.append(
            f"{once} of {once + always} operations of rhs depend on parameters only: done once per run"
        )
    executed, written = sum(program.operations().values()), sum(program.written_operations().values())
    if written < executed:
        found.append(
            f"{written} of {executed} operations of all functions are code: the others repeat it in loops"
        )
    return replace(program, findings=(*found, *savings(program)))
