"""Events of a scene: which subsystem each looks at, and that subsystem's model with its events and resets."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.module_check import verified
from symgen.runtime.module_source import ModuleSource
from symgen.runtime.subsystems.sections import PLACE, needed_lines, operations
from symgen.runtime.system import System

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.subsystems.member_model import Kind

_WRITTEN = re.compile(r"    out\[(\d+)\] = (.*)")
_HOISTED = re.compile(r"    c\d+ = ")


class Shared(Exception):
    """An event looks at several subsystems, or its text cannot be told apart; says which."""


def with_events(whole: System, kinds: Sequence[Kind]) -> list[Kind]:
    """Return the kinds, with each subsystem that has events as a kind of its own.

    Raises
    ------
    Shared
    """
    if not whole.events:
        return list(kinds)
    owner = _owners(whole, kinds)
    events: dict[tuple[int, int], list[int]] = {}
    for number in range(len(whole.events)):
        events.setdefault(_looked_at(whole, number, owner), []).append(number)
    result = []
    for k, kind in enumerate(kinds):
        watched = [j for (i, j) in events if i == k]
        rest = [j for j in range(len(kind.q)) if j not in watched]
        if rest:
            result.append(replace(kind, q=kind.q[rest], v=kind.v[rest], c=kind.c[rest], p=kind.p[rest]))
        for j in sorted(watched):
            one = replace(kind, q=kind.q[[j]], v=kind.v[[j]], c=kind.c[[j]], p=kind.p[[j]])
            result.append(_watched(whole, one, events[k, j]))
    return result


def _owners(whole: System, kinds: Sequence[Kind]) -> np.ndarray:
    """For each entry of (q, v), the number of the kind and of the member, shape (nq + nv, 2)."""
    owner = np.zeros((whole.nq + whole.nv, 2), dtype=int)
    for k, kind in enumerate(kinds):
        for j in range(len(kind.q)):
            owner[kind.q[j]] = owner[whole.nq + kind.v[j]] = k, j
    return owner


def _looked_at(whole: System, number: int, owner: np.ndarray) -> tuple[int, int]:
    """The subsystem that an event reads, and its reset reads and writes; the first where it reads none."""
    event = whole.events[number]
    lines = _slice(whole, "events", {number})
    places = _read(whole, "events", lines)
    if event["action"] == "reset":
        name = f"reset_{event['name']}"
        changed = _changed(whole, name)
        places |= changed | _read(whole, name, _slice(whole, name, changed))
    found = {tuple(owner[place].tolist()) for place in places}
    if len(found) > 1:
        raise Shared(f"event {event['name']!r} looks at several subsystems")
    return found.pop() if found else (0, 0)


def _assignments(whole: System, function: str) -> tuple[list[str], dict[int, str]]:
    """The lines of a function that give names a value, and those that write `out`, by place."""
    lines = [
        x
        for x in whole.source.functions[function].rstrip().split("\n")[1:]
        if not x.lstrip().startswith(('"', "#"))
    ]
    named, written = [], {}
    copied = re.compile(r"    for k in range\((\d+)\):")
    for line in lines:
        if found := _WRITTEN.fullmatch(line):
            written[int(found[1])] = line
        elif re.match(r"    \w+ = ", line):
            named.append(line)
        elif not (copied.fullmatch(line) or re.fullmatch(r"        out\[(.*)\] = y\[\1\]", line)):
            raise Shared(f"its function {function!r} has loops")
    return named, written


def _changed(whole: System, reset: str) -> set[int]:
    """Places of the state that a reset does not copy."""
    return {k for k, line in _assignments(whole, reset)[1].items() if line != f"    out[{k}] = y[{k}]"}


def _slice(whole: System, function: str, places: set[int]) -> list[str]:
    """The lines of a function that write some places of `out`, and all that these need."""
    named, written = _assignments(whole, function)
    results = [written[k] for k in sorted(places)]
    return [*needed_lines(named, results), *results]


def _read(whole: System, function: str, lines: Sequence[str]) -> set[int]:
    places = [found for line in lines for found in PLACE.finditer(line) if found[1] == "y"]
    if not all(found[2].isdigit() for found in places):
        raise Shared(f"its function {function!r} has loops")
    return {int(found[2]) for found in places}


def _watched(whole: System, kind: Kind, numbers: Sequence[int]) -> Kind:
    """The only member of a kind with its events: more functions, and what more these read of `p`."""
    state = np.concatenate([kind.q[0], whole.nq + kind.v[0]]).tolist()
    at_state = {place: k for k, place in enumerate(state)}
    p = kind.p[0].tolist()
    texts = {
        "events": _moved(
            _slice(whole, "events", set(numbers)), at_state, p, {n: k for k, n in enumerate(numbers)}
        )
    }
    for n in numbers:
        name = f"reset_{whole.events[n]['name']}"
        if whole.events[n]["action"] == "reset":
            changed = _changed(whole, name)
            lines = _moved(_slice(whole, name, changed), at_state, p, at_state)
            texts[name] = [
                *lines,
                *(f"    out[{k}] = y[{k}]" for place, k in at_state.items() if place not in changed),
            ]
    source, header = kind.system.source, kind.system.source.header
    functions = {
        name: "\n".join((f"def {name}(t, y, p, out):", *lines)) + "\n" for name, lines in texts.items()
    }
    records = [*whole.parameters, *whole.inputs]
    known = len(header["parameters"])
    header = {
        **header,
        # `p` of the kind's own functions stays as it is; what events read besides stands behind its inputs.
        "parameters": [records[k] for k in p[:known]],
        "inputs": [records[k] for k in p[known:]],
        "coordinates": [whole.coordinates[k] for k in kind.q[0]],
        "rates": [whole.rates[k] for k in kind.v[0]],
        "constraints": [whole.constraints[k] for k in kind.c[0]],
        "events": [whole.events[n] for n in numbers],
        "operations": header["operations"] | {name: operations(lines) for name, lines in texts.items()},
        "hoisted": header["hoisted"] | {name: n for name, lines in texts.items() if (n := _n_hoisted(lines))},
    }
    lines = source.lines | {name: whole.source.lines[name] for name in functions}
    system = System(
        verified(ModuleSource(source.file, header, source.functions | functions, lines, {}, source.text_hash))
    )
    return replace(kind, system=system, p=np.array([p]))


def _n_hoisted(lines: Sequence[str]) -> int:
    return sum(_HOISTED.match(line) is not None for line in lines)


def _moved(lines: Sequence[str], y: dict[int, int], p: list[int], out: dict[int, int]) -> list[str]:
    """Lines with the places of one subsystem; what they read of the whole `p` joins the end of the list `p`."""

    def moved(found: re.Match[str]) -> str:
        place = int(found[2])
        if found[1] == "p" and place not in p:
            p.append(place)
        own = p.index(place) if found[1] == "p" else (y if found[1] == "y" else out)[place]
        return f"{found[1]}[{own}]"

    return [PLACE.sub(moved, line) for line in lines]
