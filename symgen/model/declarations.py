"""Declaring the names of a model: parameters, constants, coordinates, inputs, definitions, outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from ..errors import nearest
from .description import Constant, Coordinate, Input, Parameter
from .input_courses import course
from .names import name_fault
from .sources import Sources
from .units import TIME, Unit, over

NUMBER_KEYS = ("value", "unit", "doc")


class Declarations:
    """The one name space of a model. Each method returns the `sympy.Symbol` that expressions use."""

    def __init__(self, sources: Sources) -> None:
        self._sources = sources
        self._kinds: dict[str, str] = {}  # name: what it is
        self._parameters: list[Parameter] = []
        self._constants: list[Constant] = []
        self._coordinates: list[Coordinate] = []
        self._inputs: list[Input] = []
        self._definitions: list[tuple[str, sympy.Expr]] = []
        self._outputs: list[tuple[str, sympy.Expr]] = []

    def coordinate(
        self,
        name: str,
        unit: str | None = None,
        start: Any = None,
        rate: Any = None,
        guess: Any = 0.0,
        rate_guess: Any = 0.0,
    ) -> sympy.Symbol:
        """Declare a generalised coordinate; the order of declaration is the order of q.

        Parameters
        ----------
        name : str
        unit : str, optional
            Numbers among the other arguments are in this unit (rates: per second); equations are in SI units.
        start, rate : float or str, optional
            Initial value and rate, which the assembly of initial conditions keeps.
        guess, rate_guess : float or str
            Initial value and rate that assembly may move; where `start` or `rate` is not given.
        """
        self._declare(name, "coordinate", "coordinates")
        size = self._sources.unit(unit, "coordinates", f"{name}.unit")
        numbers = {"start": start, "guess": guess, "rate": rate, "rate_guess": rate_guess}
        values, size = self._initial("coordinates", f"{name}.{{}}", size, numbers)
        self._coordinates.append(Coordinate(name, None if size is None else size.coherent, **values))
        return sympy.Symbol(name)

    def parameter(self, name: str, value: Any, doc: str = "", unit: str | None = None) -> sympy.Symbol:
        """Declare a number that can be set for each run.

        Parameters
        ----------
        name : str
        value : float, str or dict
            A number, a quantity such as `"9.81 m/s^2"`, or `{"value": 9.81, "unit": "m/s^2", "doc": "…"}`.
        doc : str
            What it is.
        unit : str, optional
            Of a value that is a number.
        """
        self._declare(name, "parameter", "parameters")
        value, unit, doc = self._unpacked("parameters", name, value, unit, doc)
        si, size = self._number("parameters", name, value, unit)
        self._parameters.append(Parameter(name, si, size and size.coherent, doc))
        return sympy.Symbol(name)

    def parameters(self, **values: Any) -> Any:
        """Declare several parameters; returns their symbols in order, or the symbol if there is only one."""
        return _one_or_all([self.parameter(name, value) for name, value in values.items()])

    def constant(self, name: str, value: Any, unit: str | None = None) -> sympy.Symbol:
        """Declare a number that is folded into the derived code: a number, a quantity or a table."""
        self._declare(name, "constant", "constants")
        value, unit, _ = self._unpacked("constants", name, value, unit, "")
        si, size = self._number("constants", name, value, unit)
        self._constants.append(Constant(name, si, size and size.coherent))
        return sympy.Symbol(name)

    def constants(self, **values: Any) -> Any:
        """Declare several constants; returns their symbols in order, or the symbol if there is only one."""
        return _one_or_all([self.constant(name, value) for name, value in values.items()])

    def input(
        self,
        name: str,
        unit: str | None = None,
        default: Any = 0.0,
        *,
        table: Any = None,
        kind: str | None = None,
        polynomial: Any = None,
    ) -> sympy.Symbol:
        """Declare a control input: a constant, unless the model or a run says what it does over time.

        Parameters
        ----------
        name : str
        unit : str, optional
            Numbers for `default`, values of `table` and coefficients are in it.
        default : float or str
            The constant.
        table : pair of sequences, or str, optional
            Times [s] and values; or a file below the model's folder with these as columns.
        kind : {"linear", "cubic", "hold"}, optional
            What the table does between its times; linear by default.
        polynomial : sequence of float, optional
            Coefficients of powers of t, from the constant upward.
        """
        self._declare(name, "input", "inputs")
        size = self._sources.unit(unit, "inputs", f"{name}.unit")
        value, size = self._sources.number(default, size, "inputs", f"{name}.default")
        over_time = course(self, name, size, table, kind, polynomial)
        self._inputs.append(Input(name, size and size.coherent, value, **over_time))
        return sympy.Symbol(name)

    def definition(self, name: str, expression: Any) -> sympy.Symbol:
        """Name an expression; later expressions share it through the symbol."""
        self._declare(name, "definition", "definitions")
        self._definitions.append((name, self._sources.expression(expression, "definitions", name)))
        return sympy.Symbol(name)

    def output(self, name: str, expression: Any) -> None:
        """Declare a sensor: an expression that is computed, logged and plotted."""
        self._declare(name, "output", "outputs")
        self._outputs.append((name, self._sources.expression(expression, "outputs", name)))

    def _declare(self, name: str, kind: str, table: str) -> None:
        fault = name_fault(name)
        if fault is None and name in self._kinds:
            fault = f"the name '{name}' is taken: it is {_article(self._kinds[name])} already"
        if fault is not None:
            raise self._sources.error(table, str(name)[:60], fault, hint="choose another name")
        self._kinds[name] = kind

    def _initial(
        self, table: str, place: str, size: Unit | None, numbers: Mapping[str, Any]
    ) -> tuple[dict[str, float], Unit | None]:
        """Initial values of a coordinate in SI units; `place` is a key with {} where that of `numbers` stands."""
        values: dict[str, float] = {}
        for key in ("start", "guess"):
            if numbers.get(key) is not None:
                values[key], size = self._sources.number(numbers[key], size, table, place.format(key))
        per_second = None if size is None else _per_second(size)
        for key in ("rate", "rate_guess"):
            if numbers.get(key) is not None:
                values[key], _ = self._sources.number(numbers[key], per_second, table, place.format(key))
        for enforced, moved in (("start", "guess"), ("rate", "rate_guess")):
            if numbers.get(enforced) is not None and numbers.get(moved) not in (None, 0.0):
                raise self._sources.error(
                    table,
                    place.format(moved),
                    f"'{enforced}' and '{moved}' are both given",
                    hint=f"'{enforced}' is kept, '{moved}' may be moved by assembly: give one of them",
                )
        return values, size

    def _new_element(self, name: Any, table: str, elements: Mapping[str, Any]) -> None:
        fault = name_fault(name, element=True)
        if fault is None and name in elements:
            fault = f"the name '{name}' is taken"
        if fault is not None:
            raise self._sources.error(table, str(name)[:60], fault, hint="choose another name")

    def _vector(self, values: Any, table: str, key: str, lengths: tuple[int, ...]) -> list[Any]:
        if isinstance(values, str) or not isinstance(values, (Sequence, sympy.MatrixBase)):
            raise self._sources.error(table, key, f"a list of {_either(lengths)} components is expected here")
        if len(values) not in lengths:
            raise self._sources.error(
                table, key, f"{_either(lengths)} components are expected here, {len(values)} are given"
            )
        return list(values)

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
            raise self._sources.error(table, f"{name}.doc", f"'doc' is text, not {doc!r:.60}")
        return value, unit, doc


def _per_second(unit: Unit) -> Unit:
    return Unit(
        f"{unit.text}/s", unit.factor, unit.pi_power, over(unit.dimension, TIME), f"{unit.coherent}/s"
    )


def _one_or_all(symbols: list[sympy.Symbol]) -> Any:
    return symbols[0] if len(symbols) == 1 else tuple(symbols)


def _either(lengths: tuple[int, ...]) -> str:
    return " or ".join(map(str, lengths))


def _article(kind: str) -> str:
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
