"""Quantities as text: "20 deg" is 0.349… for an angle, "5 N" for a length is refused; numbers are SI values already."""

from __future__ import annotations

import math
import re

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late

# Numbers without a unit need no unit tables: they take a while to make.
units = Late("symgen.runtime.graph.units")

_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?(?=$|[\s*]|[A-Za-z])", re.ASCII
)


class QuantityError(RuntimeModelError, ValueError):
    """A text is no quantity, or one of another dimension."""


def in_si(value: float | str, unit: str, shown: str) -> float:
    """Return a number, a number as text, or a quantity, in SI.

    Parameters
    ----------
    value : float or str
        "0.2", "20 deg", "5 N/m".
    unit : str
        The unit that a quantity must fit; "" fits all.
    shown : str
        What the user wrote, for messages.

    Raises
    ------
    QuantityError
        It is no quantity, or its unit does not fit.
    """
    if not isinstance(value, str):
        try:
            return float(value)
        except (TypeError, ValueError):
            kind = type(value).__name__
            raise QuantityError(
                f"{shown}: a {kind} is neither a number nor a text such as '0.2 {unit or 'm'}'"
            ) from None
    text = value.strip()
    match = _NUMBER.match(text)
    if match is None:
        raise QuantityError(
            f"{shown}: {value!r} is neither a number nor a quantity such as '0.2 {unit or 'm'}'"
        )
    number, rest = match.group(), text[match.end() :].strip()
    found = float(number)
    if rest:
        found = _converted(number, rest.removeprefix("*").strip(), unit, shown)
    if not math.isfinite(found):
        raise QuantityError(f"{shown}: {number} is outside the range of double precision")
    return found


def _converted(number: str, given: str, unit: str, shown: str) -> float:
    from fractions import Fraction  # brings decimal along, which runs without units can do without

    try:
        parsed = units.parse_unit(given)
    except ValueError as error:
        raise QuantityError(f"{shown}: {error}") from None
    if unit:
        wanted = units.parse_unit(unit)
        if wanted.dimension != parsed.dimension:
            raise QuantityError(
                f"{shown}: the unit {given} does not fit {unit}, in which the model has it: "
                f"{units.dimension_text(parsed.dimension)} against {units.dimension_text(wanted.dimension)}"
            )
    return parsed.to_si(Fraction(number))
