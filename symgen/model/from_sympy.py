"""What users write with SymPy's own classes: `Max`, `Min`, `Heaviside`, `floor`, `Mod`, `Piecewise`, relations."""

from __future__ import annotations

import numbers
from collections.abc import Callable
from typing import Any

import sympy
from sympy.core.relational import Relational
from sympy.functions.elementary.piecewise import ExprCondPair

from ..errors import ModelError
from . import functions
from .expression_tree import postorder
from .functions import (
    at_most,
    both,
    either,
    floor,
    heaviside,
    is_condition,
    less,
    maximum,
    minimum,
    mod,
    nested,
    opposite,
)


def where(condition: Any, then: Any, otherwise: Any) -> sympy.Expr:
    """`then` where a condition holds, else `otherwise`.

    What is not chosen may be infinite or undefined. Adaptive methods end their steps where a condition of the state or
    of time changes; a derivative is that of the part that is chosen.

    Parameters
    ----------
    condition : sympy.Basic or bool
        A comparison such as `x < 0`, or comparisons joined by `&`, `|`, `~`.
    then, otherwise : sympy.Expr or float
        In the same unit.

    Returns
    -------
    sympy.Expr

    Raises
    ------
    ModelError
        `condition` is none.

    Examples
    --------
    >>> from symgen import Model, where
    >>> m = Model("stop")
    >>> x = m.coordinate("x")
    >>> m.force(x, where(x < 0, -100*x, 0))
    """
    parts = _value(then), _value(otherwise)
    if condition in (True, False):
        return parts[0 if condition else 1]
    return functions.where(as_condition(condition), *parts)


def _value(x: Any) -> sympy.Expr:
    if isinstance(x, sympy.Expr):
        return x
    if isinstance(x, bool) or not isinstance(x, numbers.Real):
        raise ModelError(
            f"where(condition, a, b) chooses between expressions or numbers, not {x!r:.60}",
            hint="text is read as a whole: write the whole expression as text",
        )
    return sympy.Integer(int(x)) if isinstance(x, numbers.Integral) else sympy.Float(float(x))


def as_piecewise(choice: sympy.Function) -> sympy.Piecewise:
    """A `where` as SymPy's own class, for printing."""
    condition, then, otherwise = choice.args
    pairs = (then, _relation(condition)), (otherwise, sympy.true)
    return sympy.Piecewise(*(ExprCondPair(*pair) for pair in pairs), evaluate=False)


def _relation(condition: sympy.Basic) -> sympy.Basic:
    args = [_relation(x) if is_condition(x) else x for x in condition.args]
    return _SYMPY[condition.func](*args, evaluate=False)


def as_condition(x: Any) -> sympy.Basic:
    """A condition of SymPy's relations, or of `functions.py`, in those of `functions.py`.

    Raises
    ------
    ModelError
        It is no condition.
    """
    if isinstance(x, sympy.Basic):
        x = taken_over(x)
    if not is_condition(x):
        raise ModelError(
            f"'{x!s:.60}' is no condition",
            hint="where(condition, a, b) takes comparisons by <, <=, >, >=, joined by and, or, not (&, |, ~ in Python)",
        )
    return x


def _max_or_min(function: type) -> Callable:
    return lambda *values: nested(function, values)


def _heaviside(x: sympy.Expr, at_zero: sympy.Expr = sympy.S.Half) -> sympy.Expr:
    if at_zero != sympy.S.Half:
        raise ModelError(
            f"Heaviside(x, {at_zero}) is not 1/2 at zero, as heaviside is in models",
            hint="write where(x < 0, 0, 1), or Heaviside(x)",
        )
    return heaviside(x)


def _piecewise(*pieces: tuple[sympy.Expr, sympy.Basic]) -> sympy.Expr:
    (*pieces, (value, last)) = pieces
    if last is not sympy.true:
        raise ModelError(
            "a Piecewise has no value where none of its conditions holds", hint="end it with (value, True)"
        )
    for piece, condition in reversed(pieces):
        value = where(condition, piece, value)
    return value


_SYMPY = {
    less: sympy.StrictLessThan, at_most: sympy.LessThan, both: sympy.And, either: sympy.Or, opposite: sympy.Not,
}  # fmt: skip
# What SymPy's own classes are here, made of their arguments.
_RULES: dict[type, Callable] = {
    sympy.Max: _max_or_min(maximum),
    sympy.Min: _max_or_min(minimum),
    sympy.floor: floor,
    sympy.ceiling: lambda x: -floor(-x),
    sympy.Mod: mod,
    sympy.Heaviside: _heaviside,
    sympy.Piecewise: _piecewise,
    ExprCondPair: lambda value, condition: (value, condition),
    sympy.StrictLessThan: less,
    sympy.LessThan: at_most,
    sympy.StrictGreaterThan: lambda x, y: less(y, x),
    sympy.GreaterThan: lambda x, y: at_most(y, x),
    sympy.And: lambda *conditions: nested(both, conditions),
    sympy.Or: lambda *conditions: nested(either, conditions),
    sympy.Not: opposite,
    sympy.ITE: lambda condition, then, otherwise: either(
        both(condition, then), both(opposite(condition), otherwise)
    ),
}


def taken_over(root: sympy.Basic) -> sympy.Basic:
    """An expression with the functions of `functions.py` for those of SymPy that say the same.

    Raises
    ------
    ModelError
        SymPy's function says something that no model can have.
    """
    order = postorder([root])
    if not any(x.func in _RULES for x in order):
        return root
    done: dict[int, Any] = {}
    for x in order:
        args = [done[id(a)] for a in x.args]
        if x.func in _RULES:
            done[id(x)] = _RULES[x.func](*args)
        elif isinstance(x, Relational):
            raise ModelError(
                f"'{x!s:.60}' is no condition of a model", hint="comparisons are by <, <=, > and >="
            )
        else:
            done[id(x)] = x if all(a is b for a, b in zip(args, x.args, strict=True)) else x.func(*args)
    return done[id(root)]
