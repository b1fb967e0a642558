"""Declaring the names of a model: parameters, constants, coordinates, inputs, definitions, outputs."""

from __future__ import annotations

from typing import Any

import sympy

from .declared import Declared
from .description import Constant, Coordinate, Input, Parameter
from .input_courses import course


class Declarations(Declared):
    """Names of numbers and expressions. Each method returns the `sympy.Symbol` that expressions use."""

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


def _one_or_all(symbols: list[sympy.Symbol]) -> Any:
    return symbols[0] if len(symbols) == 1 else tuple(symbols)
