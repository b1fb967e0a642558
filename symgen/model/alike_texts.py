"""Expressions of texts that differ in names alone: what one was read into serves for the others.

A model of many equal bodies says the same of each of them. To read a text takes several times as long as to put other
names into its tree, in which sums and products then stand in another order.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Sequence
from dataclasses import dataclass

from . import algebra
from .functions import ABBREVIATIONS, CLASSES, dot
from .names import FUNCTION_ARITY, LONGEST_NAME, SENSOR_ARITY
from .tokens import LONGEST_TEXT, TOKEN, WORDS

_MOST = 512  # texts that are known at a time
_OF_ONE = {name for name, arity in FUNCTION_ARITY.items() if arity == (1, 1)} - ABBREVIATIONS.keys()
_LEFT_ALONE = _OF_ONE | {"pi"}
_MEANS_MORE = {*FUNCTION_ARITY, *SENSOR_ARITY, *WORDS, *keyword.kwlist} - _LEFT_ALONE
_SORTED = (algebra.Add, algebra.Mul)
_KINDS = {*_SORTED, algebra.Pow, dot, *(CLASSES[name] for name in _OF_ONE & CLASSES.keys())}
_SEEN: dict[str, Template | None] = {}


@dataclass(frozen=True)
class Template:
    """How an expression is put together from its names.

    Attributes
    ----------
    leaves : tuple of (Expr or int)
        Numbers, and which of the names.
    steps : tuple of (type, tuple of int)
        Operands are leaves, then what former steps have made.
    decimals : frozenset of Rational
        As `expressions.Parsed` has them.
    """

    leaves: tuple[algebra.Expr | int, ...]
    steps: tuple[tuple[type[algebra.Expr], tuple[int, ...]], ...]
    decimals: frozenset[algebra.Rational]

    def of(self, names: Sequence[str]) -> algebra.Expr:
        """Return the expression of some names."""
        symbols = [algebra.Symbol(name) for name in names]
        values = [symbols[leaf] if isinstance(leaf, int) else leaf for leaf in self.leaves]
        for kind, operands in self.steps:
            args = [values[k] for k in operands]
            if kind in _SORTED:
                first = int(args[0].is_Number)
                args[first:] = sorted(args[first:], key=algebra.sort_key)
            values.append(kind._made(tuple(args)))
        return values[-1]


def form(text: str) -> tuple[str, list[str]] | None:
    """Return a text with numbers in the place of its names, and these; None where one of them may mean more."""
    if len(text) > LONGEST_TEXT or "$" in text:
        return None
    names: dict[str, str] = {}
    is_plain = True

    def place(match: re.Match[str]) -> str:
        nonlocal is_plain
        name = match[0]
        if match.lastgroup != "name" or name in _LEFT_ALONE:
            return name
        is_plain &= name not in _MEANS_MORE and len(name) <= LONGEST_NAME
        return names.setdefault(name, f"${len(names)}")

    found = TOKEN.sub(place, text)
    return (found, list(names)) if is_plain and names else None


def known(form: str) -> Template | None:
    """Return what texts of a form are read into, if that is known."""
    return _SEEN.get(form)


def remember(
    form: str, names: Sequence[str], expression: algebra.Expr, decimals: frozenset[algebra.Rational]
) -> None:
    """Take in what a text was read into; of a form that has been met before it is kept how that is put together."""
    if form not in _SEEN:
        if len(_SEEN) >= _MOST:
            del _SEEN[next(iter(_SEEN))]
        _SEEN[form] = None
    elif (template := _template(names, expression, decimals)) is not None:
        _SEEN[form] = template


def _template(
    names: Sequence[str], root: algebra.Expr, decimals: frozenset[algebra.Rational]
) -> Template | None:
    """Return how an expression is put together; None where it is by more than its names."""
    leaves: list[algebra.Expr | int] = []
    inner: list[algebra.Expr] = []
    for x in algebra.postorder([root]):
        if x.args and type(x) in _KINDS:
            inner.append(x)
        elif isinstance(x, algebra.Symbol) and x.name in names:
            leaves.append(names.index(x.name))
        elif isinstance(x, (algebra.Number, algebra.NumberSymbol)):
            leaves.append(x)
        else:
            return None
    if not inner:
        return None
    place_of = {names[leaf] if isinstance(leaf, int) else leaf: k for k, leaf in enumerate(leaves)}
    place_of |= {id(x): len(leaves) + k for k, x in enumerate(inner)}

    def place(x: algebra.Expr) -> int:
        if x.args:
            return place_of[id(x)]
        return place_of[x.name if isinstance(x, algebra.Symbol) else x]

    steps = tuple((type(x), tuple(place(a) for a in x.args)) for x in inner)
    template = Template(tuple(leaves), steps, decimals)
    return template if template.of(names) == root else None
