"""What a module has no code for, and why: in words, for the report of a derivation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from symgen.runtime.graph.spelling import RESET

from .graph.graph import Graph
from .graph.nodes import MOTION, Q, V
from .program import POWER, Function, Part, Program

_MATRICES = ("mass_matrix", "residual_jacobian", "constraint_jacobian", "kinematics")


def savings(program: Program) -> Iterator[str]:
    """Sentences on what was left out of a program: functions, structural zeros, work that only some runs ask for."""
    head = program.header
    absent = [
        name for name in ("constraints", "inputs", "events", "outputs", "quaternions") if not head[name]
    ]
    if absent:
        yield f"no code for {', '.join(absent)}: there are none"
    if head["constants"]:
        yield f"{_number(head['constants'], 'constant')} folded into the numbers of the code"
    yield from _zeros(program)
    if _has_constant_jacobian(program):
        yield "constraints are linear in the coordinates: their Jacobian is constant"
    counts = program.operations()
    asked = {name: counts[name] for name in ("outputs", "poses", "energy") if name in counts}
    listed = ", ".join(f"{name} {count}" for name, count in asked.items())
    yield f"operations that rhs is free of, done where they are asked for: {listed}"
    idle = [name for owner in _owners(program) for name in _idle_coordinates(*owner, head)]
    if idle:
        yield (
            f"coordinates that influence nothing else (no other acceleration, no constraint or event reads them or "
            f"their rates): {', '.join(idle)}"
        )


def _number(items: list, name: str) -> str:
    return f"{len(items)} {name}{'s' * (len(items) > 1)}"


def _owners(program: Program) -> Iterator[tuple[Graph, tuple[Function, ...], Part | None]]:
    """Graphs and functions of all parts, then of what looks at the whole."""
    for part in program.parts:
        yield part.graph, part.functions, part
    yield program.graph, program.functions, None


def _zeros(program: Program) -> Iterator[str]:
    """Entries of matrices that are zero for all states and parameters."""
    head = program.header
    nq, nv, m = head["nq"], head["nv"], head["nh"] + head["nn"]
    sizes = (nv * nv, (nv + m) * (nq + 2 * nv + m), m * nv, nq * (nq + nv))
    found = []
    for name, size in zip(_MATRICES, sizes, strict=True):
        written = sum(
            len(f.outputs) * (len(part.members) if part else 1)
            for _, functions, part in _owners(program)
            for f in functions
            if f.name == name
        )
        if written and written < size:
            found.append(f"{name} {size - written} of {size}")
    if found:
        yield f"structural zeros, never written or multiplied: {', '.join(found)}"


def _has_constant_jacobian(program: Program) -> bool:
    found = [
        (g, f) for g, functions, _ in _owners(program) for f in functions if f.name == "constraint_jacobian"
    ]
    return bool(found) and not any(g.mask[node] & MOTION for g, f in found for node in f.outputs)


def _idle_coordinates(
    g: Graph, functions: tuple[Function, ...], part: Part | None, head: dict[str, Any]
) -> Iterator[str]:
    """Names of coordinates that nothing but their own acceleration reads; of equal subsystems, those of the first."""
    by_name = {f.name: f for f in functions}
    n = head["nq"] if part is None else len(part.members[0]["q"])
    # Events of several subsystems look at all of them, and resets write all of the state.
    if "rhs" not in by_name or head["quaternions"] or head.get("switches") or (head["events"] and part):
        return
    if n == 1:  # there is nothing else
        return
    if any(name.startswith(RESET) for name in by_name):
        return
    rhs, nw = by_name["rhs"].outputs, part.sizes[POWER] if part else head["nw"]
    watched = list(rhs[2 * n + nw :])
    for name in ("events", "constraint_residual"):
        watched += by_name[name].outputs if name in by_name else ()
    reads = _reads(g, [*rhs[n : 2 * n], *watched])
    by_others = 0  # bit k: something else than acceleration k reads it
    for node in watched:
        by_others |= reads[node]
    for k, node in enumerate(rhs[n : 2 * n]):
        by_others |= reads[node] & ~(1 << k)
    for k in range(n):
        if not by_others >> k & 1:
            yield head["coordinates"][k if part is None else part.members[0]["q"][k]]["name"]


def _reads(g: Graph, nodes: list[int]) -> dict[int, int]:
    """For each node below some: a number whose bit k says that it depends on coordinate k or its rate."""
    found: dict[int, int] = {}
    for node in g.reachable(nodes):
        bits = 0
        if g.op[node] == "var":
            kind, index = g.args[node]
            bits = 1 << index if kind in (Q, V) else 0
        elif g.op[node] != "const":
            for below in g.args[node]:
                bits |= found[below]
        found[node] = bits
    return found
