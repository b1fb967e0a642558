"""Events of a scene: which subsystem each looks at, and that subsystem's model with its events and resets."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.graph.form import Form, Loop, Name, Place, Statement, Write, Y
from symgen.runtime.graph.lengths import Lengths
from symgen.runtime.graph.rewrite import copied, needed
from symgen.runtime.module_check import verified
from symgen.runtime.system import System

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.subsystems.member_model import Kind


class Shared(Exception):
    """An event looks at several subsystems, or cannot be told apart; says which."""


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
    places = _read(whole, "events", _slice(whole, "events", {number}))
    if event["action"] == "reset":
        name = f"reset_{event['name']}"
        changed = _changed(whole, name)
        places |= changed | _read(whole, name, _slice(whole, name, changed))
    found = {tuple(owner[place].tolist()) for place in places}
    if len(found) > 1:
        raise Shared(f"event {event['name']!r} looks at several subsystems")
    return found.pop() if found else (0, 0)


def _assignments(whole: System, function: str) -> tuple[list[Name], dict[int, Write]]:
    """What a function gives names to, and what it writes to `out` outside of loops, by place."""
    form = whole.form(function)
    named, written = [], {}
    for statement in form.body:
        if type(statement) is Name:
            named.append(statement)
        elif type(statement) is Write:
            written[statement.place.first] = statement
        elif not (type(statement) is Loop and all(_copies(form, x) for x in statement.body)):
            raise Shared(f"its function {function!r} has loops")
    return named, written


def _copies(form: Form, statement: Statement) -> bool:
    """Whether a statement leaves an entry of the state as it is."""
    nodes = form.nodes
    if type(statement) is not Write or nodes.op[statement.node] != "var":
        return False
    return nodes.args[statement.node] == (Y, statement.place)


def _changed(whole: System, reset: str) -> set[int]:
    """Places of the state that a reset does not copy."""
    form = whole.form(reset)
    return {k for k, write in _assignments(whole, reset)[1].items() if not _copies(form, write)}


def _slice(whole: System, function: str, places: set[int]) -> list[Statement]:
    """The statements of a function that write some places of `out`, and all that these need."""
    named, written = _assignments(whole, function)
    results = [written[k] for k in sorted(places)]
    return [*needed(whole.form(function), named, results), *results]


def _read(whole: System, function: str, statements: Sequence[Statement]) -> set[int]:
    nodes = whole.form(function).nodes
    below = nodes.reachable((x.node for x in statements), Y)
    return {nodes.args[node][1].first for node in below if nodes.op[node] == "var"}


def _watched(whole: System, kind: Kind, numbers: Sequence[int]) -> Kind:
    """The only member of a kind with its events: more functions, and what more these read of `p`."""
    state = np.concatenate([kind.q[0], whole.nq + kind.v[0]]).tolist()
    at_state = {place: k for k, place in enumerate(state)}
    p = kind.p[0].tolist()
    made = {
        "events": _moved(whole, "events", set(numbers), at_state, p, {n: k for k, n in enumerate(numbers)})
    }
    for n in numbers:
        name = f"reset_{whole.events[n]['name']}"
        if whole.events[n]["action"] == "reset":
            changed = _changed(whole, name)
            form = made[name] = _moved(whole, name, changed, at_state, p, at_state)
            form.body += [
                Write("out", Place(k), form.nodes.var(Y, Place(k)), 1)
                for place, k in at_state.items()
                if place not in changed
            ]
    source, header = kind.system.source, kind.system.source.header
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
        "operations": header["operations"] | {name: form.operations() for name, form in made.items()},
        "hoisted": header["hoisted"] | {name: n for name, form in made.items() if (n := form.n_hoisted)},
    }
    return replace(kind, system=System(verified(source.made(header, source.forms | made))), p=np.array([p]))


def _moved(
    whole: System, function: str, places: set[int], y: dict[int, int], p: list[int], out: dict[int, int]
) -> Form:
    """Some results of a function in one subsystem's places; what is read of the whole `p` joins the list `p`."""

    def parameter(place: Place) -> Place:
        if place.first not in p:
            p.append(place.first)
        return Place(p.index(place.first))

    source = whole.form(function)
    form = Form(function, Lengths(len(y), 0, len(out)))
    form.body = copied(
        source,
        _slice(whole, function, places),
        form,
        y=lambda place: Place(y[place.first]),
        p=parameter,
        out=lambda place: Place(out[place.first]),
    )
    return form
