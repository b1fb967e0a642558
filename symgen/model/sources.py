"""Where each expression of a model came from: its text, its lone unit, and the place that an error names."""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import ModelError, nearest
from . import algebra
from .description import StartEquation
from .evaluate import NotFinite, evaluate
from .expressions import parse, quantity_value
from .given import given_expression
from .printing import shortened
from .unevaluated import difference
from .units import Unit, in_si, parse_unit

if TYPE_CHECKING:
    from .from_sympy import Taken

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
    "tyres": "tyre",
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
    "ports": "port",
    "assemblies": "assembly",
    "use": "use",
}
# Tables whose keys are names: of what is declared in them, or acted on; or places, as in `start`.
BY_KEY = (
    "parameters", "constants", "coordinates", "states", "inputs", "definitions", "outputs", "forces", "constraints",
    "velocity_constraints", "start",
)  # fmt: skip
# An equation that ends in a quantity: "tip_x - 0.3 m", "dot(x) = 2 m/s".
_WITH_QUANTITY = re.compile(r"(.+?)(=\s*[-+]?|[-+])\s*(\d[\d.]*(?:[eE][-+]?\d+)?\s+[A-Za-z%].*)", re.DOTALL)


@dataclass(frozen=True)
class Source:
    """An expression as the user gave it; see `expressions.Parsed` for `text`, `unit` and `decimals`."""

    expression: algebra.Expr
    text: str | None = None
    unit: Unit | None = None
    decimals: frozenset[algebra.Rational] = frozenset()
    use: str = ""  # the use of an assembly that it comes through
    point: str = ""  # the point by whose name it was given, of which it is a component


class Sources:
    """The expressions of one model by address, and errors that name the place as its author knows it.

    Parameters
    ----------
    name : str
        Of the model file, or of the model where there is no file.
    is_file : bool
        Whether the places are tables and keys of a TOML file; calls of the Python interface otherwise.
    assembly : str
        The table of the file, or the call, that all of them are in.
    """

    def __init__(self, name: str, is_file: bool, assembly: str = "") -> None:
        self.name = name
        self.is_file = is_file
        self.assembly = assembly
        self.uses: dict[str, Sources] = {}  # of assemblies, by the names of their uses
        self._sources: dict[Address, list[Source]] = {}
        self.tables: dict[
            str, int
        ] = {}  # functions that the model has tables for, and how many arguments they take
        self._said_at: dict[Address, Address] = {}
        self.in_plane: set[Address] = set()
        self._taken: list[Taken] = []

    def of(self, table: str, key: str) -> list[Source]:
        """What was given at an address: one source, or several that add up."""
        return self._sources.get((table, key), [])

    def everything(self) -> Iterator[tuple[Address, Source]]:
        """All that was given, with the addresses."""
        for address, sources in self._sources.items():
            for source in sources:
                yield address, source

    def take_over(self, table: str, key: str, source: Source, said_at: Address | None = None) -> None:
        """Take what a use of an assembly brings to an address; errors name the one where it was said."""
        self._sources.setdefault((table, key), []).append(source)
        if said_at is not None:
            self._said_at[table, key] = said_at

    def note_two_components(self, table: str, key: str) -> None:
        """Note that a direction was given with two components, as in the plane."""
        self.in_plane.add((table, key))

    def refuse_two_components(self, table: str, key: str, body: str) -> None:
        """Raise the error of a direction with two components on a body in space, if there is one at the address."""
        if (table, key) in self.in_plane:
            message = f"a direction has three components here, as the body '{body}' is 3-D"
            raise self.error(table, key, message, hint="for example [0, 1, 0]")

    def error(self, table: str, key: str, message: str, **fields: Any) -> ModelError:
        """An error at an address."""
        return self.locate(ModelError(message, **fields), table, key)

    def locate(self, error: ModelError, table: str, key: str, source: Source | None = None) -> ModelError:
        """Tell an error where it happened: in an assembly, where a use of it (that of `source`) brought it."""
        inside = self._inside(table, key, source)
        if inside is not None:
            use, *address = inside
            if error.file is None:
                error.use = use if error.use is None else f"{error.use}.{use}"
                error.message, error.hint = _own(error.message, use), error.hint and _own(error.hint, use)
            return self.uses[use].locate(error, *address)
        table, key = self._said_at.get((table, key), (table, key))
        if not self.is_file:
            table, key = _call(table, key)
        if self.assembly:
            table = f"{self.assembly}.{table}" if table else self.assembly
        shown = re.sub(r"\[(\d+)\]\Z", lambda m: f", element {int(m[1]) + 1}", key).removeprefix(", ")
        return error.located(
            file=self.name if self.is_file else f"model '{self.name}'", table=table or None, key=shown or None
        )

    def _inside(self, table: str, key: str, source: Source | None) -> tuple[str, str, str] | None:
        """The use that an address is of, and the address in its assembly."""
        if not self.uses:
            return None
        given = [source] if source is not None else self.of(table, key)
        if given and not given[0].use:
            return None
        head, dotted, name = table.partition(".")
        use, inner, rest = (name if dotted else key).partition(".")
        if inner and use in self.uses and (dotted or head in BY_KEY):
            return (use, f"{head}.{rest}", _without(key, use)) if dotted else (use, table, rest)
        return (given[0].use, table, _without(key, given[0].use)) if given else None

    def name_error(
        self, table: str, key: str, name: str, message: str, hint: str | None = None
    ) -> ModelError:
        """An error about a name in the expression at an address; finds its column."""
        for source in self.of(table, key):
            own = name.removeprefix(f"{source.use}.") if source.use else name
            pattern = rf"(?<![A-Za-z0-9_.]){re.escape(own)}(?!\w)"
            if source.text is not None and (match := re.search(pattern, source.text)):
                error = ModelError(message, column=match.start() + 1, hint=hint)
                return self.locate(error, table, key, source)
        return self.error(table, key, message, hint=hint)

    def point_error(
        self, table: str, key: str, point: str, points: Iterable[str], bodies: Iterable[str]
    ) -> ModelError:
        """An error about a point by whose name a place was given, of which the address is a component."""
        key, message, hint = (
            key.rpartition("[")[0],
            f"there is no point '{point}'",
            nearest(point, points, "points"),
        )
        if point in bodies:
            message, hint = message + ", which is a body", f"name a point of it: [points], body = '{point}'"
        return self.error(table, key, message, hint=hint)

    def expression(self, value: Any, table: str, key: str) -> algebra.Expr:
        """Take an expression (one of SymPy too, number, text) for an address; adds to what is there already."""
        try:
            source = read(value, tuple(self.tables.items()), self._taken)
        except ModelError as error:
            raise self.locate(error, table, key) from None
        self._sources.setdefault((table, key), []).append(source)
        return source.expression

    def component(self, point: str, axis: str, table: str, key: str) -> algebra.Expr:
        """Take a component of a point that was given by its name for an address."""
        source = Source(algebra.Symbol(f"{point}_{axis}"), point=point)
        self._sources.setdefault((table, key), []).append(source)
        return source.expression

    def equation(self, value: Any, table: str, key: str) -> StartEquation:
        """Take an equation for an address: an expression that is zero, or text with an equals sign between two.

        Its last term may be a quantity: what it is compared with must have its unit.
        """
        if not isinstance(value, str):
            expression = self.expression(value, table, key)
            return StartEquation(expression, shortened(expression), key)
        tables, text = tuple(self.tables.items()), value.strip()
        ends = _WITH_QUANTITY.fullmatch(text)
        unit = None
        try:
            if ends is not None:
                number, unit = quantity_value(ends[3].strip())
                left = read(ends[1], tables)
                value = algebra.Float(-number if "".join(ends[2].split()) in ("+", "=-") else number)
                expression = difference(left.expression, value)
            elif text.count("=") == 1 and not re.search(r"[<>!]=", text):
                left, right = (read(side, tables) for side in text.split("="))
                unit = right.unit if right.unit is not None else left.unit
                expression = difference(left.expression, right.expression)
            else:
                left = read(text, tables)
                expression = left.expression
        except ModelError as error:
            raise self.locate(error, table, key) from None
        self._sources.setdefault((table, key), []).append(Source(expression, text, None, left.decimals))
        return StartEquation(expression, " ".join(text.split()), key, None if unit is None else unit.coherent)

    def is_formula(self, value: Any) -> bool:
        """Whether a value names something: text or an expression that is no number and no quantity."""
        if isinstance(value, str):
            try:
                value = parse(value, tuple(self.tables.items())).expression
            except ModelError:  # the reader of numbers says what is wrong
                return False
        try:
            expression = given_expression(value)
        except ModelError:  # so does the reader of numbers with this
            return False
        return expression is not None and bool(expression.free_symbols)

    def number(self, value: Any, unit: Unit | None, table: str, key: str) -> tuple[float, Unit | None]:
        """Take a number (in `unit`) or a quantity (which must fit `unit`); returns its SI value and unit."""
        try:
            result, found = read_number(value)
            if found is None:
                return in_si([result], unit)[0], unit
        except ModelError as error:
            raise self.locate(error, table, key) from None
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


def _own(text: str, use: str) -> str:
    """What is said in names of the model, in those of the assembly, of which the error shows the place."""
    return re.sub(rf"(?<![\w.]){re.escape(use)}\.(?=[A-Za-z])", "", text)


def _without(key: str, use: str) -> str:
    """A key with the names in it as in the assembly: `then.reset.dot(c1.x)` is `then.reset.dot(x)`."""
    return key.replace(f"{use}.", "", 1) if key.startswith("then.reset.") else key


def _call(table: str, key: str) -> Address:
    """A TOML address as a call of the Python interface and its argument."""
    head, _, name = table.partition(".")
    if head in ("gravity", "start"):
        return f"{head}(…)", key
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


def read(value: Any, tables: tuple[tuple[str, int], ...] = (), known: list[Taken] | None = None) -> Source:
    """An expression from one, of SymPy too, a number, or text.

    `tables` as of `expressions.parse`, `known` as of `given_expression`.
    """
    if isinstance(value, str):
        parsed = parse(value, tables)
        return Source(parsed.expression, parsed.text, parsed.unit, parsed.decimals)
    expression = given_expression(value, known)
    return Source(_exact_number(value) if expression is None else expression)


def read_number(value: Any) -> tuple[float, Unit | None]:
    """The SI value of a number, a quantity, or a number of SymPy, and its unit."""
    if isinstance(value, str):
        return quantity_value(value)
    expression = given_expression(value)
    return (_double(value) if expression is None else _constant(expression)), None


def _constant(value: algebra.Expr) -> float:
    try:
        result = evaluate(value, {})
    except NotFinite:
        result = None
    if result is None:
        raise ModelError(f"'{shortened(value)}' is not a finite number", hint="give a number")
    return result


def _exact_number(value: Any) -> algebra.Number:
    double = _double(value)
    return algebra.Integer(int(value)) if isinstance(value, numbers.Integral) else algebra.Float(double)


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
    return double + 0.0  # zero has no sign here


def _what(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    names = {list: "a list", tuple: "a list", dict: "a table", str: "text", type(None): "nothing"}
    return names.get(type(value), type(value).__name__)
