"""One kind of independent subsystem as a model of its own: the whole model's functions, cut down to its sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symgen.runtime.code.printing import place_text
from symgen.runtime.graph.form import OUT, Form, Name, P, Place, Statement, T, Write, Y
from symgen.runtime.graph.lengths import Lengths
from symgen.runtime.graph.rewrite import copied, needed
from symgen.runtime.module_check import verified
from symgen.runtime.subsystems.places import ENERGY, LAYOUTS, POWER, RATIO, Places
from symgen.runtime.subsystems.sections import Sections, total_name
from symgen.runtime.system import System


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
        return name in LAYOUTS and (name != "kinematics" or bool(self.quaternions))

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
        timed = any(form.nodes.mask[node] & T for form in forms.values() for node in form.roots())
        flags = {**whole["structure"], "conservative": not own[POWER], "time_dependent": timed}
        return {
            **whole,
            "nq": len(first["q"]), "nv": len(first["v"]), "nh": nh, "nn": m - nh, "nw": own[POWER],
            "coordinates": [whole["coordinates"][k] for k in first["q"]],
            "rates": [whole["rates"][k] for k in first["v"]],
            "constraints": [whole["constraints"][k] for k in first["c"]],
            "quaternions": self.quaternions,
            "dependent": [i for i, k in enumerate(first["c"]) if k in self.whole.dependent],
            "parameters": parameters, "inputs": inputs,
            "outputs": [], "events": [], "bodies": [], "marks": [], "subsystems": [],
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
