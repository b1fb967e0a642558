"""A model of several equal subsystems side by side: the functions of one, in loops over all."""

from __future__ import annotations

from typing import Any

import numpy as np

from symgen.runtime.graph.form import Form, Loop, Name, Place, Write
from symgen.runtime.graph.lengths import Lengths
from symgen.runtime.graph.rewrite import copied
from symgen.runtime.module_check import verified
from symgen.runtime.subsystems.places import ENERGY, LAYOUTS, POWER, RATIO, Places
from symgen.runtime.subsystems.sections import is_total, total_name
from symgen.runtime.system import System

_PER_MEMBER = ("coordinates", "rates", "parameters", "inputs")


def can_stand_side_by_side(member: System) -> bool:
    """Whether each statement of a model's functions makes a number: no constraints, events, loops, solves by loops."""
    plain = not (member.m or member.events or member.switches)
    forms = (member.form(name) for name in _functions(member) if plain)
    return plain and all(type(x) is Name or type(x) is Write for form in forms for x in form.body)


def side_by_side(member: System, count: int) -> System:
    """Return the model of several members whose state is all their coordinates, member by member, then all rates.

    Parameters
    ----------
    member : System
        For which `can_stand_side_by_side` is true.
    count : int
        Two or more; `p` is all their parameters, member by member, then all inputs.
    """
    known = member.__dict__.setdefault("_side_by_side", {})
    if count not in known:
        known[count] = _joined(member, count)
    return known[count]


def _joined(member: System, count: int) -> System:
    source, head = member.source, member.source.header
    kind = {
        "coordinates": np.arange(count * member.nq).reshape(count, -1),
        "rates": np.arange(count * member.nv).reshape(count, -1),
        "constraints": np.zeros((count, 0), dtype=int),
    }
    sizes = {"nq": count * member.nq, "nv": count * member.nv, "nh": 0, "nn": 0, "nw": member.nw}
    places = Places(kind, sizes)
    functions = {name: _function(name, member, places, count) for name in _functions(member)}
    header = {
        **head,
        **sizes,
        **{key: [_named(record, k) for k in range(count) for record in head[key]] for key in _PER_MEMBER},
        "quaternions": [k * member.nq + place for k in range(count) for place in member.quaternions],
        "operations": {name: count * head["operations"].get(name, 0) for name in functions},
        "hoisted": {name: count * n for name, n in head.get("hoisted", {}).items() if name in functions},
    }
    return System(verified(source.made(header, functions)))


def _functions(member: System) -> list[str]:
    return [name for name in LAYOUTS if name in member.source.functions and member.has(name)]


def _named(record: dict[str, Any], k: int) -> dict[str, Any]:
    return {**record, "name": f"{record['name']}.{k + 1}"}


def _function(name: str, member: System, places: Places, count: int) -> Form:
    """One function: sums of all members begin before the loop and are written behind it."""
    read = places.read(name)
    written = places.written(name, {POWER: member.nw, RATIO: 0, ENERGY: 1})
    n_parameters, n_inputs = len(member.parameters), len(member.inputs)

    def parameter(k: int) -> np.ndarray:
        first, stride = (k, n_parameters) if k < n_parameters else (k - n_parameters, n_inputs)
        return first + (n_parameters * count if k >= n_parameters else 0) + stride * np.arange(count)

    source = member.form(name)
    form = Form(name, Lengths(read.size, count * source.lengths.p, int(written.max(initial=-1)) + 1))
    body = copied(
        source,
        source.body,
        form,
        y=lambda place: _along(read[:, place.first]),
        p=lambda place: _along(parameter(place.first)),
        out=lambda place: _along(written[:, place.first]),
    )
    totals = [x for x in body if is_total(form, x)]
    names = {total_name(form, x) for x in totals}
    starts = [x for x in body if type(x) is Name and x.name in names and form.nodes.op[x.node] == "const"]
    inside = tuple(x for x in body if x not in totals and x not in starts)
    form.body = [*starts, *([Loop(count, inside, inside[0].line)] if inside else []), *totals]
    return form


def _along(places: np.ndarray) -> Place:
    """The index of a loop that runs through places at equal distances."""
    return Place(int(places[0]), int(places[1] - places[0]))
