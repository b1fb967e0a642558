"""Formulas that are too long for a line, in pieces between which it may be broken.

Neither browsers nor TeX break what stands in large parentheses or fractions. What is too long for a line is written on
one level: sums in plain parentheses, quotients with a stroke.
"""

from __future__ import annotations

from itertools import islice
from typing import Protocol

import sympy

LONGEST = 60  # letters of a formula that fit a line
_SURELY_LONGER = 4 * LONGEST  # names and numbers, of which a power of -1 or 1/2 may show none


class Notation(Protocol):
    """How formulas are written: in MathML, in LaTeX.

    Attributes
    ----------
    plus, minus, times, stroke, opening, closing : str
    """

    plus: str
    minus: str
    times: str
    stroke: str
    opening: str
    closing: str

    def text(self, expression: sympy.Basic) -> str:
        """Return an expression on one line."""

    def letters(self, text: str) -> int:
        """Return about how many letters wide a text is."""

    def power(self, base: str, exponent: sympy.Expr) -> str:
        """Return a piece, which may end with a parenthesis, to the power of something."""

    def function(self, name: str) -> str:
        """Return the name of a function."""


def lines(expression: sympy.Expr, notation: Notation) -> list[list[str]]:
    """Return an expression as lines of pieces: one line where it fits, a long sum with a line for each term."""
    text = _on_a_line(expression, notation)
    if text:
        return [[text]]
    if isinstance(expression, sympy.Add):
        return [signed(sign, pieces(term, notation)) for sign, term in _signed_terms(expression, notation)]
    return [pieces(expression, notation)]


def pieces(expression: sympy.Expr, notation: Notation) -> list[str]:
    """Return an expression in pieces between which a line may be broken, each hardly longer than a line."""
    text = _on_a_line(expression, notation)
    if text:
        return [text]
    if isinstance(expression, sympy.Add):
        terms = _signed_terms(expression, notation)
        return [piece for sign, term in terms for piece in signed(sign, pieces(term, notation))]
    above, below = sympy.fraction(expression, exact=True)
    if below != 1:
        divisor = _factor(below, notation, of_many=True)
        return [*_factor(above, notation), *signed(notation.stroke, divisor)]
    if isinstance(expression, sympy.Mul):
        factors = expression.as_ordered_factors()
        first, *others = (_factor(x, notation, of_many=True) for x in factors)
        return [*first, *(piece for factor in others for piece in signed(notation.times, factor))]
    if isinstance(expression, sympy.Pow):
        *before, last = _in_parentheses(pieces(expression.base, notation), notation)
        return [*before, notation.power(last, expression.exp)]
    if isinstance(expression, sympy.Function) and len(expression.args) == 1:
        inside = _in_parentheses(pieces(expression.args[0], notation), notation)
        return signed(notation.function(expression.func.__name__), inside)
    return [notation.text(expression)]


def _on_a_line(expression: sympy.Expr, notation: Notation) -> str:
    """Return an expression that fits a line; "" for others, of which those that are far too long are not written."""
    leaves = (node for node in sympy.preorder_traversal(expression) if not node.args)
    if next(islice(leaves, _SURELY_LONGER, None), None) is not None:
        return ""
    text = notation.text(expression)
    return text if notation.letters(text) <= LONGEST else ""


def signed(sign: str, inside: list[str]) -> list[str]:
    """Return pieces with a sign before the first."""
    return [f"{sign}{inside[0]}", *inside[1:]]


def _factor(expression: sympy.Expr, notation: Notation, *, of_many: bool = False) -> list[str]:
    """Return a factor in pieces: a sum, and below a stroke a product, in parentheses."""
    together = isinstance(expression, sympy.Add) or (of_many and isinstance(expression, sympy.Mul))
    negative = of_many and expression.could_extract_minus_sign() and expression.is_number
    inside = pieces(expression, notation)
    return _in_parentheses(inside, notation) if together or negative else inside


def _in_parentheses(inside: list[str], notation: Notation) -> list[str]:
    return signed(notation.opening, [*inside[:-1], f"{inside[-1]}{notation.closing}"])


def _signed_terms(node: sympy.Add, notation: Notation) -> list[tuple[str, sympy.Expr]]:
    """Return the signs and the terms of a sum; the first has none where it is positive."""
    found: list[tuple[str, sympy.Expr]] = []
    for term in node.as_ordered_terms():
        negative = term.could_extract_minus_sign()
        sign = notation.minus if negative else notation.plus if found else ""
        found.append((sign, -term if negative else term))
    return found
