"""One kind of independent subsystem as a model of its own: the whole model's text, cut down to the kind's sections."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symgen.runtime.module_check import verified
from symgen.runtime.module_source import ModuleSource
from symgen.runtime.subsystems.places import ENERGY, LAYOUTS, POWER, RATIO, Places
from symgen.runtime.subsystems.sections import PLACE, SectionedText, indices, needed_lines, operations
from symgen.runtime.system import System

_HOISTED = re.compile(r"    (?:    )?c\d+ = ")


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


def kind_of(number: int, whole: System, texts: Mapping[str, SectionedText]) -> Kind:
    """Return a kind of subsystem.

    Parameters
    ----------
    number : int
        In `whole.subsystems`.
    texts : mapping of str to SectionedText
        The whole model's functions.

    Raises
    ------
    NotDivisible
        The text has other places than the header says, or none for this kind.
    """
    header = whole.source.header
    return _Cut(Places(whole.subsystems[number], header), whole, texts).kind()


class _Cut:
    def __init__(self, places: Places, whole: System, texts: Mapping[str, SectionedText]):
        self.places, self.whole, self.tables = places, whole, whole.source.tables
        self.lines: dict[str, list[str]] = {}
        vectors = places.vectors
        self.first = {letter: [int(k) for k in vectors[letter][0]] for letter in "qvhc"}
        quaternions = set(whole.quaternions)
        self.quaternions = [k for k, place in enumerate(self.first["q"]) if place in quaternions]
        self.own = {POWER: 0, RATIO: int(len(self.first["c"]) > 0), ENERGY: 1}
        own = {name: self._section(name, text) for name, text in texts.items() if self._needs(name)}
        power = texts["rhs"].totals.get(whole.nq + whole.nv) if whole.nw else None
        self.own[POWER] = int(
            power is not None and any(line.startswith(f"    {power} = ") for line in own["rhs"])
        )
        self.texts = {name: texts[name] for name in own}
        for name, section in own.items():
            self.lines[name] = self._joined(name, section)

    def _needs(self, name: str) -> bool:
        if name in ("constraint_residual", "constraint_jacobian", "gamma"):
            return bool(self.first["c"])
        if name == "project":
            return bool(self.first["c"] or self.quaternions)
        return name in LAYOUTS and (name != "kinematics" or bool(self.quaternions))

    def _section(self, name: str, text: SectionedText) -> list[str]:
        """The kind's section of a function: it begins with places of the kind's first member."""
        read = set(self.places.read(name)[0].tolist())
        written = set(self.places.written(name, {POWER: 0, RATIO: 0, ENERGY: 0})[0].tolist())
        for section in text.sections:
            for line in section:
                found = [m for m in PLACE.finditer(line) if m[1] != "p"]
                if found:
                    array, place = found[0][1], found[0][2]
                    if int(indices(place, 1, self.tables)[0]) in (read if array == "y" else written):
                        return section
                    break
        if name == "energy" or not self.places.written(name, self.own).size:
            return []  # energies that do not depend on the state belong to no section
        raise NotDivisible(f"its function {name!r} has no section for {self._name()}")

    def _name(self) -> str:
        return f"the subsystem of {self.whole.coordinates[self.first['q'][0]]['name']!r}"

    def _joined(self, name: str, section: list[str]) -> list[str]:
        """A function's lines for this kind alone, with the whole model's places but for those of `y` and `out`."""
        text = self.texts[name]
        places = set(self.places.written(name, self.own)[0].tolist())
        totals = [f"    out[{place}] = {total}" for place, total in text.totals.items() if place in places]
        wanted = {line.rpartition(" ")[2] for line in totals}
        dropped = {total for total in text.totals.values() if total not in wanted}
        body = [line for line in section if line.split(" = ")[0].strip() not in dropped]
        lines = [*needed_lines(text.head, [*body, *totals]), *body, *totals]
        read, written = self.places.read(name), self.places.written(name, self.own)

        def moved(found: re.Match[str]) -> str:
            if found[1] == "p":
                return found[0]
            where = indices(found[2], self.places.count, self.tables)
            own = self._own_place(name, read if found[1] == "y" else written, where, found[0])
            return f"{found[1]}[{own}]"

        return [PLACE.sub(moved, line) for line in lines]

    def _own_place(self, name: str, places: np.ndarray, where: np.ndarray, text: str) -> int:
        found = np.flatnonzero(places[0] == where[0])
        if len(found) != 1 or not np.array_equal(places[:, found[0]], where):
            raise NotDivisible(f"its function {name!r} has {text} in the section of {self._name()}")
        return int(found[0])

    def kind(self) -> Kind:
        p = self._parameters()
        of_place = {key: k for k, (key, _) in enumerate(p)}

        def moved(found: re.Match[str]) -> str:
            if found[1] != "p":
                return found[0]
            return f"p[{of_place[tuple(indices(found[2], self.places.count, self.tables).tolist())]}]"

        lines = {name: [PLACE.sub(moved, line) for line in own] for name, own in self.lines.items()}
        functions = {name: self._function(name, own) for name, own in lines.items()}
        header = self._header([key[0] for key, _ in p], lines)
        digest = hashlib.sha256("".join(functions.values()).encode()).hexdigest()
        source = self.whole.source
        first_lines = {name: source.lines[name] for name in functions}
        system = System(verified(ModuleSource(source.file, header, functions, first_lines, {}, digest)))
        vectors = self.places.vectors
        gathered = np.array([key for key, _ in p], dtype=int).reshape(len(p), self.places.count).T
        return Kind(system, vectors["q"], vectors["v"], vectors["c"], np.ascontiguousarray(gathered))

    def _parameters(self) -> list[tuple[tuple[int, ...], None]]:
        """Places of parameters and inputs that the kind reads, for all members, in the order of the first's."""
        met: dict[tuple[int, ...], None] = {}
        for own in self.lines.values():
            for line in own:
                for found in PLACE.finditer(line):
                    if found[1] == "p":
                        met[tuple(indices(found[2], self.places.count, self.tables).tolist())] = None
        return sorted(met.items())

    def _function(self, name: str, lines: list[str]) -> str:
        body = lines or ["    h = 0.0"]  # a function needs a statement
        return "\n".join((f"def {name}(t, y, p, out):", *body)) + "\n"

    def _header(self, p: list[int], lines: Mapping[str, list[str]]) -> dict[str, Any]:
        whole, first, own = self.whole.source.header, self.first, self.own
        n_parameters = len(whole["parameters"])
        # Inputs stand behind all parameters, and so they do here: places are in ascending order.
        parameters = [whole["parameters"][k] for k in p if k < n_parameters]
        inputs = [whole["inputs"][k - n_parameters] for k in p if k >= n_parameters]
        hoisted = {name: sum(_HOISTED.match(line) is not None for line in lines[name]) for name in lines}
        nh, m = len(first["h"]), len(first["c"])
        timed = any(re.search(r"\bt\b", line) for own_lines in lines.values() for line in own_lines)
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
            "operations": {name: operations(own_lines) for name, own_lines in lines.items()},
            "hoisted": {name: count for name, count in hoisted.items() if count},
        }  # fmt: skip
