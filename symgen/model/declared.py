"""What has been said of a model so far, and how its parts are read: what all functions that make parts share."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symgen.runtime.graph.spelling import spelled

from ..errors import nearest
from . import algebra
from .description import (
    Axis,
    Constant,
    Coordinate,
    Formula,
    Frame,
    Input,
    Joint,
    Parameter,
    Point,
    Rate,
    State,
    Table,
    Use,
)
from .given import is_listed, unpacked
from .joint_tree import WORLD
from .names import name_fault, reference_fault
from .sources import Sources
from .units import TIME, Unit, over

NUMBER_KEYS = ("value", "unit", "doc")


class Declared:
    """The one name space of a model with what has been declared in it."""

    folder: Path | None = None  # where meshes and tables are

    def __init__(self, sources: Sources) -> None:
        self._sources = sources
        self._kinds: dict[str, str] = {}  # name: what it is
        self._spelled: dict[tuple[str, str], str] = {}  # table, or nothing, and name in generated code: name
        self._uses: dict[str, Use] = {}
        self._free: tuple[str, ...] = ()  # of a model that is used: names that it does not declare
        self._closed = ""  # the first use of this model as an assembly: nothing is added behind it
        self._parameters: list[Parameter] = []
        self._constants: list[Constant] = []
        self._coordinates: list[Coordinate] = []
        self._inputs: list[Input] = []
        self._definitions: list[tuple[str, algebra.Expr]] = []
        self._outputs: list[tuple[str, algebra.Expr]] = []
        self._tables: list[Table] = []
        self._states: list[State] = []
        self._integrals: list[Coordinate] = []  # of states over time
        self._state_rates: list[Rate] = []
        self._joints: dict[str, Joint] = {}
        self._points: dict[str, Point] = {}
        self._axes: dict[str, Axis] = {}
        self._frames: dict[str, Frame] = {}
        self._made: list[Coordinate] = []  # by joints
        self._made_rates: dict[str, list[Rate]] = {}  # by joint, where they have names of their own
        self._jointed: dict[str, str] = {}  # coordinate: joint

    def _declare(self, name: str, kind: str, table: str) -> None:
        fault = name_fault(name)
        if fault is None and name in self._kinds:
            fault = f"the name '{name}' is taken: it is {_article(self._kinds[name])} already"
        if fault is None and name in self._uses:
            fault = f"the name '{name}' is taken: it is the use of an assembly already"
        fault = fault or self._spelling_fault("", name) or self._closed_fault()
        if fault:
            raise self._sources.error(table, str(name)[:60], fault, hint="choose another name")
        self._kinds[name] = kind

    def _spelling_fault(self, table: str, name: str) -> str | None:
        """Why a name cannot be told from another one in generated code, or None: it is noted then."""
        other = self._spelled.setdefault((table, spelled(name)), name)
        return (
            None
            if other == name
            else f"'{name}' and '{other}' are one name, '{spelled(name)}', in generated code"
        )

    def _closed_fault(self) -> str:
        return self._closed and f"the assembly is used already, as '{self._closed}': say all of it before"

    def _declare_made(self, name: str, kind: str, table: str, maker: str) -> None:
        """Take a name that the user did not choose by itself."""
        if name in self._kinds:
            message = (
                f"the {maker} makes the name '{name}', which is taken: it is a {self._kinds[name]} already"
            )
            raise self._sources.error(
                table, "", message, hint=f"choose another name for the {maker}, or for '{name}'"
            )
        self._declare(name, kind, table)

    def _initial(
        self, table: str, place: str, size: Unit | None, numbers: Mapping[str, Any]
    ) -> tuple[dict[str, float], Unit | None]:
        """Initial values of a coordinate in SI units; `place` is a key with {} where that of `numbers` stands."""
        values: dict[str, Any] = {}
        for key, formula in (("start", "formula"), ("guess", "formula")):
            if numbers.get(key) is not None:
                size = self._one_initial(values, key, formula, numbers[key], size, table, place)
        per_second = None if size is None else _per_second(size)
        for key, formula in (("rate", "rate_formula"), ("rate_guess", "rate_formula")):
            if numbers.get(key) is not None:
                self._one_initial(values, key, formula, numbers[key], per_second, table, place)
        for enforced, moved in (("start", "guess"), ("rate", "rate_guess")):
            if numbers.get(enforced) is not None and numbers.get(moved) not in (None, 0.0):
                raise self._sources.error(
                    table,
                    place.format(moved),
                    f"'{enforced}' and '{moved}' are both given",
                    hint=f"'{enforced}' is kept, '{moved}' may be moved by assembly: give one of them",
                )
        return values, size

    def _one_initial(
        self,
        values: dict[str, Any],
        key: str,
        formula: str,
        given: Any,
        size: Unit | None,
        table: str,
        place: str,
    ) -> Unit | None:
        """Take a number, a quantity or an expression of parameters; returns the unit that is known then."""
        at = place.format(key)
        if not self._sources.is_formula(given):
            values[key], size = self._sources.number(given, size, table, at)
            return size
        values[key] = 0.0  # its value follows when all parameters are known
        values[formula] = Formula(self._sources.expression(given, table, at), table, at)
        return size

    def _new_element(self, name: Any, table: str, elements: Mapping[str, Any]) -> None:
        fault = name_fault(name, element=True)
        if fault is None and name in elements:
            fault = f"the name '{name}' is taken"
        fault = fault or self._spelling_fault(table, name) or self._closed_fault()
        if fault:
            raise self._sources.error(table, str(name)[:60], fault, hint="choose another name")

    def _vector(self, values: Any, table: str, key: str, lengths: tuple[int, ...]) -> list[Any]:
        values = unpacked(values)
        if not is_listed(values):
            raise self._sources.error(
                table,
                key,
                f"a list of {_either(lengths)} components is expected here",
                hint="write it in brackets, as [1, 2, 3]",
            )
        if len(values) not in lengths:
            raise self._sources.error(
                table,
                key,
                f"{_either(lengths)} components are expected here, {len(values)} are given",
                hint="write as many",
            )
        return list(values)

    def _components(self, values: Any, table: str, key: str) -> tuple[algebra.Expr, ...]:
        """Three expressions; the third may be left out, as it is zero in the plane."""
        given = self._vector(values, table, key, (2, 3))
        found = [self._sources.expression(x, table, f"{key}[{k}]") for k, x in enumerate(given)]
        return (*found, algebra.ZERO)[:3]

    def _place(self, value: Any, table: str, key: str) -> tuple[algebra.Expr, ...]:
        """Three components: of a point by its name, of the "world", or two or three expressions in world axes."""
        if isinstance(value, str):
            fault = reference_fault(value)
            if fault is not None:
                message = f"a place is a point's name, or a list of two or three components; {fault}"
                raise self._sources.error(table, key, message, hint="name a point of [points]")
            if value == WORLD:
                return (algebra.ZERO,) * 3
            return tuple(
                self._sources.component(value, axis, table, f"{key}[{k}]") for k, axis in enumerate("xyz")
            )
        return self._components(value, table, key)

    def _number(self, table: str, name: str, value: Any, unit: Any) -> tuple[float, Unit | None]:
        size = self._sources.unit(unit, table, f"{name}.unit")
        if size is not None and isinstance(value, str):
            raise self._sources.error(
                table,
                f"{name}.value",
                "the value is a number where the unit stands beside it",
                hint="leave out 'unit'",
            )
        return self._sources.number(value, size, table, name)

    def _unpacked(self, table: str, name: str, value: Any, unit: Any, doc: Any) -> tuple[Any, Any, str]:
        """Value, unit and doc from a table such as `{ value = 0.1, unit = "m" }`."""
        if isinstance(value, dict):
            for key in value:
                if key not in NUMBER_KEYS:
                    raise self._sources.error(
                        table,
                        f"{name}.{key}",
                        f"unknown key '{key}'",
                        hint=nearest(str(key), NUMBER_KEYS, "keys"),
                    )
            if "value" not in value:
                raise self._sources.error(
                    table, name, "the key 'value' is missing", hint="for example { value = 0.1 }"
                )
            unit, doc, value = value.get("unit", unit), value.get("doc", doc), value["value"]
        if not isinstance(doc, str):
            raise self._sources.error(
                table, f"{name}.doc", f"'doc' is text, not {doc!r:.60}", hint="write it in quotes"
            )
        return value, unit, doc


def _per_second(unit: Unit) -> Unit:
    return Unit(
        f"{unit.text}/s", unit.factor, unit.pi_power, over(unit.dimension, TIME), f"{unit.coherent}/s"
    )


def _either(lengths: tuple[int, ...]) -> str:
    return " or ".join(map(str, lengths))


def _article(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
