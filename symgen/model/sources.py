"""Where each expression of a model came from: its text, its lone unit, and the place that an error names."""

from __future__ import annotations

import math
import numbers
import re
from dataclasses import dataclass
from typing import Any

import sympy

from ..errors import ModelError
from .evaluate import NotFinite, evaluate
from .expressions import parse, quantity_value
from .from_sympy import taken_over
from .printing import shortened
from .units import Unit, parse_unit

Address = tuple[str, str]  # TOML table and key, in Python models too
CALLS = {  # table: method of the Python interface; the name that follows is its first argument
    "parameters": "parameter",
    "constants": "constant",
    "coordinates": "coordinate",
    "states": "state",
    "tables": "table",
    "inputs": "input",
    "definitions": "definition",
    "bodies": "body",
    "forces": "force",
    "joints": "joint",
    "points": "point",
    "axes": "axis",
    "frames": "frame",
    "springs": "spring",
    "bushings": "bushing",
    "rolling": "rolling",
    "closures": "closure",
    "rotors": "rotor",
    "loads": "load",
    "constraints": "constraint",
    "velocity_constraints": "velocity_constraint",
    "outputs": "output",
    "events": "event",
    "stops": "stop",
    "friction": "friction",
    "bristles": "bristle",
    "contacts": "contact",
    "draw": "draw",
}


@dataclass(frozen=True)
class Source:
    """An expression as the user gave it; see `expressions.Parsed` for `text`, `unit` and `decimals`."""

    expression: sympy.Expr
    text: str | None = None
    unit: Unit | None = None
    decimals: frozenset[sympy.Rational] = frozenset()


class Sources:
    """The expressions of one model by address, and errors that name the place as its author knows it.

    Parameters
    ----------
    name : str
        Of the model file, or of the model where there is no file.
    is_file : bool
        Whether the places are tables and keys of a TOML file; calls of the Python interface otherwise.
    """

    def __init__(self, name: str, is_file: bool) -> None:
        self.name = name
        self.is_file = is_file
        self._sources: dict[Address, list[Source]] = {}
        self.tables: dict[
            str, int
        ] = {}  # functions that the model has tables for, and how many arguments they take
        self._in_plane: set[Address] = set()

    def of(self, table: str, key: str) -> list[Source]:
        """What was given at an address: one source, or several that add up."""
        return self._sources.get((table, key), [])

    def note_two_components(self, table: str, key: str) -> None:
        """Note that a direction was given with two components, as in the plane."""
        self._in_plane.add((table, key))

    def refuse_two_components(self, table: str, key: str, body: str) -> None:
        """Raise the error of a direction with two components on a body in space, if there is one at the address."""
        if (table, key) in self._in_plane:
            message = f"a direction has three components here, as the body '{body}' is 3-D"
            raise self.error(table, key, message, hint="for example [0, 1, 0]")

    def error(self, table: str, key: str, message: str, **fields: Any) -> ModelError:
        """An error at an address."""
        return self.locate(ModelError(message, **fields), table, key)

    def locate(self, error: ModelError, table: str, key: str) -> ModelError:
        """Tell an error where it happened."""
        if not self.is_file:
            table, key = _call(table, key)
        shown = re.sub(r"\[(\d+)\]\Z", lambda m: f", element {int(m[1]) + 1}", key).removeprefix(", ")
        return error.located(
            file=self.name if self.is_file else f"model '{self.name}'", table=table or None, key=shown or None
        )

    def name_error(
        self, table: str, key: str, name: str, message: str, hint: str | None = None
    ) -> ModelError:
        """An error about a name in the expression at an address; finds its column."""
        column = None
        for source in self.of(table, key):
            if source.text is not None and (
                match := re.search(rf"(?<![A-Za-z0-9_.]){re.escape(name)}(?!\w)", source.text)
            ):
                column = match.start() + 1
                break
        return self.error(table, key, message, column=column, hint=hint)

    def expression(self, value: Any, table: str, key: str) -> sympy.Expr:
        """Take an expression (SymPy object, number, text) for an address; adds to what is there already."""
        try:
            source = read(value, tuple(self.tables.items()))
        except ModelError as error:
            raise self.locate(error, table, key) from None
        self._sources.setdefault((table, key), []).append(source)
        return source.expression

    def is_formula(self, value: Any) -> bool:
        """Whether a value names something: text or an expression that is no number and no quantity."""
        if isinstance(value, str):
            try:
                value = parse(value, tuple(self.tables.items())).expression
            except ModelError:  # the reader of numbers says what is wrong
                return False
        return isinstance(value, sympy.Expr) and bool(value.free_symbols)

    def number(self, value: Any, unit: Unit | None, table: str, key: str) -> tuple[float, Unit | None]:
        """Take a number (in `unit`) or a quantity (which must fit `unit`); returns its SI value and unit."""
        try:
            result, found = read_number(value)
        except ModelError as error:
            raise self.locate(error, table, key) from None
        if found is None:
            return (result if unit is None else _to_si(unit, result)), unit
        if unit is not None and found.dimension != unit.dimension:
            raise self.error(
                table,
                key,
                f"{value!r:.60} does not fit the unit '{unit.text}'",
                hint="give it in that unit, or change the unit",
            )
        return result, unit or found

    def unit(self, value: Any, table: str, key: str) -> Unit | None:
        """Take the text of a unit."""
        if value is None or value == "":
            return None
        if not isinstance(value, str):
            raise self.error(
                table, key, f"a unit is text such as 'N/m', not {value!r:.60}", hint="write it in quotes"
            )
        try:
            return parse_unit(value)
        except ModelError as error:
            raise self.locate(error, table, key) from None


def _to_si(unit: Unit, value: float) -> float:
    return value if unit.factor == 1 and not unit.pi_power else unit.to_si(value)


def _call(table: str, key: str) -> Address:
    """A TOML address as a call of the Python interface and its argument."""
    head, _, name = table.partition(".")
    if head == "gravity":
        return "gravity(…)", key
    if head in ("energy", "run"):
        return f"{key or head}(…)", ""
    if head not in CALLS:
        return "", key
    if head == "constraints" and name and key:  # a ready-made one, whose kind is the method
        kind, argument = re.match(r"(\w+)\.?(.*)", key).groups()
        return f"{kind}({name!r})", argument
    if not name:
        name, _, key = key.partition(".")
    return f"{CALLS[head]}({name!r})", key


def read(value: Any, tables: tuple[tuple[str, int], ...] = ()) -> Source:
    """An expression from a SymPy object, a number, or text; `tables` as of `expressions.parse`."""
    if isinstance(value, str):
        parsed = parse(value, tables)
        return Source(parsed.expression, parsed.text, parsed.unit, parsed.decimals)
    if isinstance(value, sympy.Expr):
        return Source(taken_over(value))
    return Source(_sympy_number(value))


def read_number(value: Any) -> tuple[float, Unit | None]:
    """The SI value of a number, a quantity, or a SymPy number, and its unit."""
    if isinstance(value, str):
        result, unit = quantity_value(value)
    elif isinstance(value, sympy.Expr):
        result, unit = _constant(taken_over(value)), None
    else:
        result, unit = _double(value), None
    return result, unit


def _constant(value: sympy.Expr) -> float:
    try:
        result = evaluate(value, {})
    except NotFinite:
        result = None
    if result is None:
        raise ModelError(f"'{shortened(value)}' is not a finite number", hint="give a number")
    return result


def _sympy_number(value: Any) -> sympy.Number:
    double = _double(value)
    return sympy.Integer(int(value)) if isinstance(value, numbers.Integral) else sympy.Float(double)


def _double(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ModelError(
            f"a number, a quantity or an expression is expected here, not {_what(value)}",
            hint='for example 0.5, "5 N/m" or "l/2*cos(phi)"',
        )
    try:
        double = float(value)
    except OverflowError:
        double = math.inf
    if not math.isfinite(double):
        raise ModelError(
            "a number here is finite, and within the range of double precision", hint="give a smaller one"
        )
    return double + 0.0  # zero has no sign here, nor in SymPy


def _what(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    names = {list: "a list", tuple: "a list", dict: "a table", str: "text", type(None): "nothing"}
    return names.get(type(value), type(value).__name__)
