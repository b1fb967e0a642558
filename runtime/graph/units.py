"""Units in SI base dimensions: from a unit's text to its SI factor and dimension.

Models are read with this table, and so are the quantities that a run is given as text.
"""

from __future__ import annotations

import difflib
import functools
import math
import operator
import re
from dataclasses import dataclass
from fractions import Fraction

BASE = ("m", "kg", "s", "A", "K", "mol", "cd")
Dimension = tuple[int | Fraction, ...]  # exponents of BASE
DIMENSIONLESS: Dimension = (0,) * len(BASE)
LARGEST_EXPONENT = 12
LONGEST_UNIT = 200  # characters


class UnitError(ValueError):
    """A text is no unit.

    Parameters
    ----------
    message : str
    column : int, optional
        Place in the text; the first character is 1.
    hint : str, optional
        What to do about it.
    """

    def __init__(self, message: str, column: int | None = None, hint: str | None = None):
        super().__init__(f"{message}; {hint}" if hint else message)
        self.message, self.column, self.hint = message, column, hint


def dimension(**exponents: int) -> Dimension:
    """A dimension from the exponents of base units: `dimension(kg=1, m=1, s=-2)`."""
    return tuple(exponents.get(base, 0) for base in BASE)


def times(a: Dimension, b: Dimension) -> Dimension:
    """Dimension of a product."""
    return tuple(map(operator.add, a, b))


def over(a: Dimension, b: Dimension) -> Dimension:
    """Dimension of a quotient."""
    return tuple(map(operator.sub, a, b))


def to_power(a: Dimension, exponent: Fraction) -> Dimension:
    """Dimension of a power."""
    # Fractions are slow, and most exponents are whole.
    factor = exponent.numerator if exponent.denominator == 1 else exponent
    return tuple(x * factor for x in a)


LENGTH, MASS, TIME = dimension(m=1), dimension(kg=1), dimension(s=1)
FORCE = dimension(kg=1, m=1, s=-2)
ENERGY = dimension(kg=1, m=2, s=-2)
POWER = dimension(kg=1, m=2, s=-3)
ACCELERATION = dimension(m=1, s=-2)
INERTIA = dimension(kg=1, m=2)
VOLT = dimension(kg=1, m=2, s=-3, A=-1)


@dataclass(frozen=True)
class Unit:
    """A unit: `text` as the user wrote it, and its size factor*pi**pi_power in SI base units.

    `coherent` is the same unit without prefixes and the like (`mm` gives `m`, `deg` gives `rad`): what values
    are in once they are converted.
    """

    text: str
    factor: Fraction
    pi_power: Fraction
    dimension: Dimension
    coherent: str

    def to_si(self, value: Fraction | float | int) -> float:
        """The SI value of `value` of these units; the nearest double where pi is not involved."""
        if isinstance(value, float) and not math.isfinite(value):
            return value
        scaled = Fraction(value) * self.factor
        return float(scaled) * math.pi ** float(self.pi_power) if self.pi_power else float(scaled)


def _atoms() -> dict[str, tuple[Fraction, int, Dimension, str]]:
    """Unit names: factor, power of pi, dimension, coherent unit."""
    one = DIMENSIONLESS
    derived = {
        "N": FORCE,
        "J": ENERGY,
        "W": POWER,
        "Pa": dimension(kg=1, m=-1, s=-2),
        "Hz": dimension(s=-1),
        "C": dimension(A=1, s=1),
        "V": VOLT,
        "ohm": over(VOLT, dimension(A=1)),
        "F": over(dimension(A=1, s=1), VOLT),
        "Wb": times(VOLT, TIME),
        "T": over(times(VOLT, TIME), dimension(m=2)),
        "H": over(times(VOLT, TIME), dimension(A=1)),
    }
    base = {name: dimension(**{name: 1}) for name in BASE}
    atoms = {name: (Fraction(1), 0, size, name) for name, size in (base | derived).items()}
    atoms["rad"] = (Fraction(1), 0, one, "rad")
    prefixes = {"G": 9, "M": 6, "k": 3, "m": -3, "u": -6, "n": -9}
    for name in ("m", "s", "A", "K", "rad", *derived):
        for prefix, exponent in prefixes.items():
            atoms.setdefault(prefix + name, (Fraction(10) ** exponent, *atoms[name][1:]))
    for prefix, exponent in (("M", 3), ("", -3), ("m", -6), ("u", -9)):
        atoms[prefix + "g"] = (Fraction(10) ** exponent, 0, MASS, "kg")
    atoms |= {
        "cm": (Fraction(1, 100), 0, LENGTH, "m"),
        "dm": (Fraction(1, 10), 0, LENGTH, "m"),
        "min": (Fraction(60), 0, TIME, "s"),
        "h": (Fraction(3600), 0, TIME, "s"),
        "bar": (Fraction(100_000), 0, derived["Pa"], "Pa"),
        "mbar": (Fraction(100), 0, derived["Pa"], "Pa"),
        "deg": (Fraction(1, 180), 1, one, "rad"),
        "rev": (Fraction(2), 1, one, "rad"),
        "rpm": (Fraction(1, 30), 1, dimension(s=-1), "(rad/s)"),
    }
    return atoms


ATOMS = _atoms()
# Words of people, without the plural's s: for hints.
_WORDS = {
    "metre": "m", "meter": "m", "millimetre": "mm", "millimeter": "mm", "centimetre": "cm", "centimeter": "cm",
    "kilometre": "km", "kilometer": "km", "second": "s", "sec": "s", "millisecond": "ms", "minute": "min", "hour": "h",
    "hr": "h", "gram": "g", "gramme": "g", "kilogram": "kg", "kilogramme": "kg", "kilo": "kg", "newton": "N",
    "kilonewton": "kN", "joule": "J", "watt": "W", "kilowatt": "kW", "pascal": "Pa", "volt": "V", "ampere": "A",
    "amp": "A", "hertz": "Hz", "degree": "deg", "radian": "rad", "turn": "rev", "revolution": "rev", "kelvin": "K",
    "tonne": "Mg", "ton": "Mg", "t": "Mg",
}  # fmt: skip
TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-z]+)|(?P<number>[0-9]+(?:\.[0-9]+)?)|(?P<operator>\*\*|[-+*/^()]))", re.ASCII
)


@functools.lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """Parse a unit such as `kg*m^2`, `N*s/m`, `1/s`, `m^(1/2)`, `N m`.

    Raises
    ------
    UnitError
        With the column in `text` and the nearest unit.
    """
    if len(text) > LONGEST_UNIT:
        raise UnitError(f"the unit is longer than {LONGEST_UNIT} characters", column=1, hint="shorten it")
    factor, pi_power, size = _Parser(text).parse()
    shown = text.strip()
    plain = factor == 1 and pi_power == 0
    atom = ATOMS.get(shown)
    if atom is not None:
        return Unit(shown, factor, pi_power, size, atom[3].strip("()"))
    coherent = shown if plain else re.sub(r"[A-Za-z]+", lambda m: ATOMS[m.group()][3], shown)
    return Unit(shown, factor, pi_power, size, coherent)


Value = tuple[Fraction, Fraction, Dimension]


class _Parser:
    """Recursive descent over a unit's text: products and quotients from the left, powers, parentheses."""

    def __init__(self, text: str) -> None:
        self.tokens: list[tuple[str, str, int]] = []
        position, end = 0, len(text.rstrip())
        while position < end:
            match = TOKEN.match(text, position)
            if match is None:
                column = position + len(text[position:]) - len(text[position:].lstrip()) + 1
                raise UnitError(
                    f"{text[column - 1]!r} has no place in a unit",
                    column=column,
                    hint="a unit is made of names, numbers, * / ^ and parentheses",
                )
            kind = match.lastgroup
            self.tokens.append((kind, match[kind], match.start(kind) + 1))
            position = match.end()
        self.index, self.end, self.depth = 0, end, 0

    def parse(self) -> Value:
        value = self.product()
        if self.index < len(self.tokens):
            _, text, column = self.tokens[self.index]
            raise UnitError(
                f"'{text}' has no place in a unit",
                column=column,
                hint="a unit is made of names, numbers, * / ^ and parentheses",
            )
        return value

    def peek(self) -> tuple[str, str, int]:
        return self.tokens[self.index] if self.index < len(self.tokens) else ("end", "", self.end + 1)

    def take(self) -> tuple[str, str, int]:
        token = self.peek()
        self.index += 1
        return token

    def product(self) -> Value:
        value = self.power()
        while True:
            kind, text, _ = self.peek()
            if text in ("*", "/"):
                self.take()
            elif kind != "name" and text != "(":
                return value
            factor, pi_power, size = self.power()
            sign = -1 if text == "/" else 1
            value = (
                value[0] / factor if text == "/" else value[0] * factor,
                value[1] + sign * pi_power,
                times(value[2], to_power(size, Fraction(sign))),
            )

    def power(self) -> Value:
        kind, text, column = self.take()
        if text == "(":
            self.depth += 1
            if self.depth > 20:
                raise UnitError(
                    "the unit is nested too deeply", column=column, hint="write it without parentheses"
                )
            value = self.product()
            self.close()
        elif kind == "name":
            value = self.atom(text, column)
        elif kind == "number" and text == "1":
            value = (Fraction(1), Fraction(0), DIMENSIONLESS)
        else:
            what = f"'{text}' stands where" if text else "there is nothing where"
            raise UnitError(f"{what} a unit is expected", column=column, hint="for example N/m")
        if self.peek()[1] in ("^", "**"):
            self.take()
            return self.raised(value, self.exponent())
        return value

    def close(self) -> None:
        _, text, column = self.take()
        if text != ")":
            raise UnitError("a ')' is missing in the unit", column=column, hint="close it")

    @staticmethod
    def atom(name: str, column: int) -> Value:
        if name not in ATOMS:
            pairs = [
                f"{name[:k]}*{name[k:]}" for k in range(1, len(name)) if {name[:k], name[k:]} <= ATOMS.keys()
            ]
            word = name.lower().removesuffix("s")
            near = (
                [_WORDS[word]]
                if word in _WORDS
                else pairs or difflib.get_close_matches(name[:40], ATOMS, n=1, cutoff=0.5)
            )
            hint = f"did you mean '{near[0]}'?" if near else "write one such as 'N*s/m', or leave it out"
            raise UnitError(f"'{name:.40}' is not a unit", column=column, hint=hint)
        factor, pi_power, size, _ = ATOMS[name]
        return factor, Fraction(pi_power), size

    def exponent(self) -> Fraction:
        parenthesis = self.peek()[1] == "("
        if parenthesis:
            self.take()
        sign = -1 if self.peek()[1] == "-" else 1
        if self.peek()[1] in ("+", "-"):
            self.take()
        value = self.integer()
        if parenthesis:
            if self.peek()[1] == "/":
                self.take()
                value /= self.integer() or Fraction(1)
            self.close()
        return sign * value

    def integer(self) -> Fraction:
        kind, text, column = self.take()
        if kind != "number" or len(text) > 5 or Fraction(text) > LARGEST_EXPONENT:
            raise UnitError(
                f"the exponent of a unit is a number up to {LARGEST_EXPONENT}",
                column=column,
                hint="for example m^2",
            )
        return Fraction(text)

    @staticmethod
    def raised(value: Value, exponent: Fraction) -> Value:
        factor, pi_power, size = value
        if any(abs(x * exponent) > LARGEST_EXPONENT for x in size):
            raise UnitError(
                f"an exponent in the unit is larger than {LARGEST_EXPONENT}",
                hint="leave out what the model does not need",
            )
        whole = exponent.denominator == 1
        scaled = (
            factor ** int(exponent) if whole or factor == 1 else Fraction(float(factor) ** float(exponent))
        )
        return scaled, pi_power * exponent, to_power(size, exponent)


NAMED = {"N": FORCE, "J": ENERGY, "W": POWER, "Pa": ATOMS["Pa"][2], "V": VOLT}


def dimension_text(size: Dimension) -> str:
    """A dimension for people: `N (kg*m/s^2)`, `m/s`, `1` for a pure number."""
    above = [_factor(base, x) for base, x in zip(BASE, size, strict=True) if x > 0]
    below = [_factor(base, -x) for base, x in zip(BASE, size, strict=True) if x < 0]
    if not above and not below:
        return "1 (a pure number or an angle)"
    text = "*".join(above) or "1"
    if below:
        text += "/" + (below[0] if len(below) == 1 else f"({'*'.join(below)})")
    name = next((n for n, d in NAMED.items() if d == size), None)
    return f"{name} ({text})" if name else text


_FORCES = (("N", FORCE), ("N*s", times(FORCE, TIME)))  # what is in kg, in words of statics and of damping


def unit_text(size: Dimension) -> str:
    """The unit of a dimension as people write it: `N`, `N*m`, `m/s^2`, `N*s/m`; `1` for a pure number."""
    if size in NAMED.values() and size != ENERGY:
        return next(name for name, known in NAMED.items() if known == size)
    for name, force in _FORCES:
        rest = over(size, force)
        if size[BASE.index("kg")] == 1 and not any(rest[1:]):
            return name + (
                ""
                if not rest[0]
                else f"*{_factor('m', rest[0])}"
                if rest[0] > 0
                else f"/{_factor('m', -rest[0])}"
            )
    return "1" if size == DIMENSIONLESS else dimension_text(size)


def _factor(base: str, exponent: Fraction) -> str:
    if exponent == 1:
        return base
    return f"{base}^{exponent}" if exponent.denominator == 1 else f"{base}^({exponent})"
