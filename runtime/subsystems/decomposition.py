"""Whether a model falls apart into independent subsystems, and the model of each: the whole model's functions, cut up.

A kind of subsystem has a section in every function of the whole (`Sections`), and places in its arrays (`Places`); of
these `kind_of` makes the model of one member. A subsystem that events look at is a kind of its own (`with_events`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.code.printing import place_text
from symgen.runtime.graph.form import (
    HELD,
    OUT,
    Form,
    Loop,
    Name,
    P,
    Place,
    Statement,
    T,
    Write,
    Y,
    copied,
    needed,
)
from symgen.runtime.graph.layouts import ENERGY, LAYOUTS, POWER, RATIO, Lengths
from symgen.runtime.graph.spelling import reset_function
from symgen.runtime.module_check import verified
from symgen.runtime.system import System

if TYPE_CHECKING:
    from collections.abc import Sequence

# A member's own run needs no more: what is drawn is asked of the whole.
CUT = tuple(name for name in LAYOUTS if name not in ("poses", "shapes"))
_EXTENDED = ("residual", "residual_jacobian", "solve")


class Places:
    """Places of all members of one kind.

    Parameters
    ----------
    kind : mapping
        An entry of the header's `subsystems`.
    header : mapping
        Of the whole model.

    Attributes
    ----------
    count : int
        Number of members.
    vectors : dict of str to ndarray, shape (count, length)
        Indices in the whole model by letter.
    """

    def __init__(self, kind: Mapping, header: Mapping):
        self.count = len(kind["rates"])
        as_table = {"q": "coordinates", "v": "rates", "c": "constraints"}
        self.vectors = {
            x: np.array(kind[key], dtype=int).reshape(self.count, -1) for x, key in as_table.items()
        }
        nh, m = header["nh"], header["nh"] + header["nn"]
        holonomic = self.vectors["c"] < nh
        self.vectors["h"] = self.vectors["c"][:, holonomic[0]]
        self._whole = {"q": header["nq"], "v": header["nv"], "h": nh, "c": m}
        self._shared = {POWER: header["nw"], RATIO: int(m > 0), ENERGY: 1}

    def read(self, function: str) -> np.ndarray:
        """Return where the members' own `y` stands in the whole model's, shape (count, length)."""
        return self._axis("qvvc" if function in _EXTENDED else "qv")[0]

    def written(self, function: str, own: Mapping[str, int]) -> np.ndarray:
        """Return where the members' own `out` stands in the whole model's, shape (count, length).

        Parameters
        ----------
        own : mapping of str to int
            Whether a member writes POWER, RATIO and ENERGY by itself: 0 or 1.
        """
        found, offset = [], 0
        for block in LAYOUTS[function]:
            if block in self._shared:
                found += [np.full((self.count, 1), offset)] * own[block]
                offset += self._shared[block]
                continue
            rows, n_rows = self._axis(block[0])
            columns, n_columns = (
                self._axis(block[1]) if block[1] else (np.zeros((self.count, 1), dtype=int), 1)
            )
            places = offset + rows[:, :, None] * n_columns + columns[:, None, :]
            found.append(places.reshape(self.count, -1))
            offset += n_rows * n_columns
        return np.hstack(found) if found else np.zeros((self.count, 0), dtype=int)

    def _axis(self, letters: str) -> tuple[np.ndarray, int]:
        found, offset = [], 0
        for letter in letters:
            found.append(offset + self.vectors[letter])
            offset += self._whole[letter]
        return np.hstack(found), offset


@dataclass(frozen=True)
class Sections:
    """A function that works on each kind of subsystem by itself.

    Attributes
    ----------
    form : Form
    head : list of statements
        What all sections share: parameters, values that follow from them, and the starts of totals.
    sections : list of list of statements
        Those of each kind; those of a loop's body without the loop.
    totals : dict of int to Write
        Numbers that all make together, by place in `out`.
    """

    form: Form
    head: list[Name]
    sections: list[list[Statement]]
    totals: dict[int, Write] = field(default_factory=dict)


def sectioned(form: Form) -> Sections | None:
    """Return the sections of a function; None where it has none, because it looks at all subsystems."""
    starts, body = form.sections, form.body
    if not starts:
        return None
    end, totals = len(body), {}
    while end > starts[-1] and is_total(form, body[end - 1]):
        end -= 1
        totals[body[end].place.first] = body[end]
    sections = [_inside(body[i:j]) for i, j in zip(starts, [*starts[1:], end], strict=True)]
    return Sections(form, body[: starts[0]], sections, totals)


def is_total(form: Form, statement: Statement) -> bool:
    """Whether a statement writes what subsystems have made together: a name that had other values before."""
    is_output = type(statement) is Write and statement.array == OUT
    return is_output and form.nodes.op[statement.node] == "var" and form.nodes.mask[statement.node] == HELD


def total_name(form: Form, write: Write) -> str:
    """Return the name of the number that a total is."""
    return form.nodes.args[write.node][1][0]


def _inside(statements: list[Statement]) -> list[Statement]:
    if statements and type(statements[0]) is Loop:
        return [*statements[0].body, *statements[1:]]
    return statements


class NotDivisible(Exception):
    """A model's text does not tell its subsystems apart; says why."""


@dataclass(frozen=True)
class Kind:
    """Equal subsystems and the model of one of them.

    Attributes
    ----------
    system : System
        Has the parameters and start values of the first member.
    q, v, c : ndarray of int, shape (members, length)
        Each member's coordinates, rates and constraints among those of the whole model.
    p : ndarray of int, shape (members, n_p)
        Each member's parameters and inputs in the whole model's `p`.
    """

    system: System
    q: np.ndarray
    v: np.ndarray
    c: np.ndarray
    p: np.ndarray


def kind_of(number: int, whole: System, texts: Mapping[str, Sections]) -> Kind:
    """Return a kind of subsystem.

    Parameters
    ----------
    number : int
        In `whole.subsystems`.
    texts : mapping of str to Sections
        The whole model's functions.

    Raises
    ------
    NotDivisible
        The text has other places than the header says, or none for this kind.
    """
    header = whole.source.header
    return _Cut(Places(whole.subsystems[number], header), whole, texts).kind()


class _Cut:
    def __init__(self, places: Places, whole: System, texts: Mapping[str, Sections]):
        self.places, self.whole, self.tables = places, whole, whole.source.tables
        vectors = places.vectors
        self.first = {letter: [int(k) for k in vectors[letter][0]] for letter in "qvhc"}
        quaternions = set(whole.quaternions)
        self.quaternions = [k for k, place in enumerate(self.first["q"]) if place in quaternions]
        self.own = {POWER: 0, RATIO: int(len(self.first["c"]) > 0), ENERGY: 1}
        own = {name: self._section(name, text) for name, text in texts.items() if self._needs(name)}
        power = texts["rhs"].totals.get(whole.nq + whole.nv) if whole.nw else None
        name = total_name(texts["rhs"].form, power) if power else ""
        self.own[POWER] = int(any(type(x) is Name and x.name == name for x in own["rhs"]))
        self.texts = {name: texts[name] for name in own}
        self.statements = {name: self._joined(name, section) for name, section in own.items()}

    def _needs(self, name: str) -> bool:
        if name in ("constraint_residual", "constraint_jacobian", "gamma"):
            return bool(self.first["c"])
        if name == "project":
            return bool(self.first["c"] or self.quaternions)
        return name in CUT and (name != "kinematics" or bool(self.quaternions))

    def _section(self, name: str, text: Sections) -> list[Statement]:
        """The kind's section of a function: it begins with places of the kind's first member."""
        read = set(self.places.read(name)[0].tolist())
        written = set(self.places.written(name, {POWER: 0, RATIO: 0, ENERGY: 0})[0].tolist())
        for section in text.sections:
            array, place = _first_place(text.form, section)
            if place is not None and self._where(place)[0] in (read if array == "y" else written):
                return section
        if name == "energy" or not self.places.written(name, self.own).size:
            return []  # energies that do not depend on the state belong to no section
        raise NotDivisible(f"its function {name!r} has no section for {self._name()}")

    def _name(self) -> str:
        return f"the subsystem of {self.whole.coordinates[self.first['q'][0]]['name']!r}"

    def _where(self, place: Place) -> list[int]:
        """What an index stands for with each member."""
        return place.in_passes(self.places.count, self.tables)

    def _joined(self, name: str, section: list[Statement]) -> list[Statement]:
        """A function's statements for this kind alone, with the whole model's places."""
        text = self.texts[name]
        places = set(self.places.written(name, self.own)[0].tolist())
        totals = [write for place, write in text.totals.items() if place in places]
        dropped = {total_name(text.form, write) for write in text.totals.values()}
        dropped -= {total_name(text.form, write) for write in totals}
        body = [x for x in section if not (type(x) is Name and x.name in dropped)]
        return [*needed(text.form, text.head, [*body, *totals]), *body, *totals]

    def kind(self) -> Kind:
        p = self._parameters()
        of_place = {key: k for k, key in enumerate(p)}
        forms = {name: self._form(name, of_place) for name in self.statements}
        header = self._header([key[0] for key in p], forms)
        system = System(verified(self.whole.source.made(header, forms)))
        vectors = self.places.vectors
        gathered = np.array(p, dtype=int).reshape(len(p), self.places.count).T
        return Kind(system, vectors["q"], vectors["v"], vectors["c"], np.ascontiguousarray(gathered))

    def _parameters(self) -> list[tuple[int, ...]]:
        """Places of parameters and inputs that the kind reads, for all members, in the order of the first's."""
        met = set()
        for name, statements in self.statements.items():
            nodes = self.texts[name].form.nodes
            for node in nodes.reachable((x.node for x in statements), P):
                if nodes.op[node] == "var":
                    met.add(tuple(self._where(nodes.args[node][1])))
        return sorted(met)

    def _form(self, name: str, of_place: Mapping[tuple[int, ...], int]) -> Form:
        """The function of one member, with places of its own."""
        source = self.texts[name].form
        read, written = self.places.read(name), self.places.written(name, self.own)
        form = Form(name, Lengths(read.shape[1], len(of_place), written.shape[1]))
        form.body = copied(
            source,
            self.statements[name],
            form,
            y=lambda place: self._own_place(name, read, place, "y"),
            p=lambda place: Place(of_place[tuple(self._where(place))]),
            out=lambda place: self._own_place(name, written, place, OUT),
        )
        return form

    def _own_place(self, name: str, places: np.ndarray, place: Place, array: str) -> Place:
        where = self._where(place)
        found = np.flatnonzero(places[0] == where[0])
        if len(found) != 1 or not np.array_equal(places[:, found[0]], where):
            text = f"{array}[{place_text(place)}]"
            raise NotDivisible(f"its function {name!r} has {text} in the section of {self._name()}")
        return Place(int(found[0]))

    def _header(self, p: list[int], forms: Mapping[str, Form]) -> dict[str, Any]:
        whole, first, own = self.whole.source.header, self.first, self.own
        n_parameters = len(whole["parameters"])
        # Inputs stand behind all parameters, and so they do here: places are in ascending order.
        parameters = [whole["parameters"][k] for k in p if k < n_parameters]
        inputs = [whole["inputs"][k - n_parameters] for k in p if k >= n_parameters]
        hoisted = {name: form.n_hoisted for name, form in forms.items()}
        nh, m = len(first["h"]), len(first["c"])
        states = [i for i, k in enumerate(first["v"]) if k in self.whole.states]
        names = [whole["constraints"][k]["name"] for k in first["c"]]
        moved = [name for name in names if name in self.whole.constraints_of_states]
        timed = any(form.nodes.mask[node] & T for form in forms.values() for node in form.roots())
        flags = {**whole["structure"], "conservative": not own[POWER], "time_dependent": timed}
        return {
            **{key: value for key, value in whole.items() if key not in ("states", "constraints_of_states")},
            "nq": len(first["q"]), "nv": len(first["v"]), "nh": nh, "nn": m - nh, "nw": own[POWER],
            "coordinates": [whole["coordinates"][k] for k in first["q"]],
            "rates": [whole["rates"][k] for k in first["v"]],
            "constraints": [whole["constraints"][k] for k in first["c"]],
            "quaternions": self.quaternions,
            **({"states": states} if states else {}),
            **({"constraints_of_states": moved} if moved else {}),
            "dependent": [i for i, k in enumerate(first["c"]) if k in self.whole.dependent],
            "parameters": parameters, "inputs": inputs,
            "outputs": [], "events": [], "bodies": [], "marks": [], "windings": [], "subsystems": [],
            "structure": flags,
            "operations": {name: form.operations() for name, form in forms.items()},
            "hoisted": {name: count for name, count in hoisted.items() if count},
        }  # fmt: skip


def _first_place(form: Form, section: list[Statement]) -> tuple[str, Place | None]:
    """The first place in `y` or `out` that a section names."""
    nodes = form.nodes
    for statement in section:
        if type(statement) is Write and statement.array == OUT:
            return OUT, statement.place
        if type(statement) is Name and nodes.op[statement.node] == "var" and nodes.mask[statement.node] == Y:
            return "y", nodes.args[statement.node][1]
    return "", None


class LooksAtSeveral(Exception):
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
        name = reset_function(event["name"])
        changed = _changed(whole, name)
        places |= changed | _read(whole, name, _slice(whole, name, changed))
    found = {tuple(owner[place].tolist()) for place in places}
    if len(found) > 1:
        raise LooksAtSeveral(f"event {event['name']!r} looks at several subsystems")
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
            raise LooksAtSeveral(f"its function {function!r} has loops")
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
        name = reset_function(whole.events[n]["name"])
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
    return replace(
        kind,
        system=System(verified(source.made(header, source.forms | made))),
        p=np.array([p], dtype=np.int64),
    )


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


def divide(system: System) -> tuple[list[Kind], str]:
    """Return the kinds of subsystems, each as a model of its own, and what else there is to say.

    Returns
    -------
    kinds : list of Kind
        Empty where the model is integrated as one.
    why_not : str
        Why it is then, a sentence.
    """
    objection = _objection(system)
    if objection:
        return [], objection
    if "_division" not in system.__dict__:
        system.__dict__["_division"] = _divide(system)
    return system.__dict__["_division"]


def _divide(system: System) -> tuple[list[Kind], str]:
    forms = (system.form(name) for name in system.source.functions if system.has(name))
    texts = {form.name: text for form in forms if (text := sectioned(form))}
    try:
        return with_events(system, [kind_of(k, system, texts) for k in range(len(system.subsystems))]), ""
    except (NotDivisible, LooksAtSeveral) as error:
        return [], str(error)


def _objection(system: System) -> str:
    if system.input_descriptions:
        return "inputs over time act on it"
    if system.switches:
        return "it has stops or dry friction"
    return ""
