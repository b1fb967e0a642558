"""A model of several equal subsystems side by side: the functions of one, in loops over all."""

from __future__ import annotations

import hashlib
import re
from typing import Any

import numpy as np

from symgen.runtime.module_check import verified
from symgen.runtime.module_source import ModuleSource
from symgen.runtime.subsystems.places import ENERGY, LAYOUTS, POWER, RATIO, Places
from symgen.runtime.subsystems.sections import PLACE
from symgen.runtime.system import System

_START, _TOTAL = re.compile(r"    (e\d+) = 0\.0"), re.compile(r"    out\[(\d+)\] = (e\d+)")
_SIMPLE = re.compile(r"    (?:[A-Za-z_]\w*|out\[\d+\]) = (?!\[)")
_PER_MEMBER = ("coordinates", "rates", "parameters", "inputs")


def can_stand_side_by_side(member: System) -> bool:
    """Whether each line of a model's functions makes a number of its own: no constraints, events, solves by loops."""
    plain = not (member.m or member.events or member.switches)
    return plain and all(
        _SIMPLE.match(line) for name in _functions(member) for line in _lines(member.source.functions[name])
    )


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
    digest = hashlib.sha256("".join(functions.values()).encode()).hexdigest()
    lines = {name: source.lines[name] for name in functions}
    return System(verified(ModuleSource(source.file, header, functions, lines, {}, digest)))


def _functions(member: System) -> list[str]:
    return [name for name in LAYOUTS if name in member.source.functions and member.has(name)]


def _lines(text: str) -> list[str]:
    return text.rstrip().split("\n")[1:]


def _named(record: dict[str, Any], k: int) -> dict[str, Any]:
    return {**record, "name": f"{record['name']}.{k + 1}"}


def _function(name: str, member: System, places: Places, count: int) -> str:
    """One function: sums of all members begin before the loop and are written behind it."""
    read = places.read(name)
    written = places.written(name, {POWER: member.nw, RATIO: 0, ENERGY: 1})
    n_parameters, n_inputs = len(member.parameters), len(member.inputs)

    def parameter(k: int) -> np.ndarray:
        first, stride = (k, n_parameters) if k < n_parameters else (k - n_parameters, n_inputs)
        return first + (n_parameters * count if k >= n_parameters else 0) + stride * np.arange(count)

    def moved(found: re.Match[str]) -> str:
        array, k = found[1], int(found[2])
        where = parameter(k) if array == "p" else (read if array == "y" else written)[:, k]
        return f"{array}[{_index(where)}]"

    lines = _lines(member.source.functions[name])
    totals = [line for line in lines if _TOTAL.fullmatch(line)]
    starts = [line for line in lines if _START.fullmatch(line)]
    inside = [line for line in lines if line not in totals and line not in starts]
    loop = [f"    for k in range({count}):", *(f"    {PLACE.sub(moved, line)}" for line in inside)]
    body = [*starts, *(loop if inside else []), *(PLACE.sub(moved, line) for line in totals)]
    return "\n".join((f"def {name}(t, y, p, out):", *body)) + "\n"


def _index(places: np.ndarray) -> str:
    """The index of a loop that runs through places at equal distances."""
    first, step = int(places[0]), int(places[1] - places[0])
    if not step:
        return str(first)
    multiple = "k" if step == 1 else f"{step}*k"
    return f"{first} + {multiple}" if first else multiple
