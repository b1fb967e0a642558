"""SymPy's expressions as a model's own, and back.

What users write with SymPy's own classes is taken over: `Max`, `Min`, `Heaviside`, `floor`, `Mod`, `Piecewise`,
relations.
"""

from __future__ import annotations

import numbers
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import sympy
from sympy.core.relational import Relational
from sympy.core.sympify import converter
from sympy.functions.elementary.piecewise import ExprCondPair

from ..errors import ModelError
from . import algebra, functions
from . import sympy_functions as own
from .algebra import postorder
from .functions import both, either, floor, heaviside, is_condition, maximum, minimum, nested, opposite

_ELEMENTARY = (
    "sin", "cos", "tan", "cot", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "erf", "Abs",
    "sign", "re", "conjugate",
)  # fmt: skip
_OWN = (
    "dot", "minimum", "maximum", "floor", "heaviside", "less", "at_most", "both", "either", "opposite", "where",
    "branch", "smooth_minimum", "settled",
)  # fmt: skip
# SymPy's class for each of a model's.
_SYMPY: dict[type, type] = {
    algebra.Add: sympy.Add,
    algebra.Mul: sympy.Mul,
    algebra.Pow: sympy.Pow,
    **{getattr(algebra, name): getattr(sympy, name) for name in _ELEMENTARY},
    **{getattr(functions, name): getattr(own, name) for name in _OWN},
}
_MODELS = {theirs: ours for ours, theirs in _SYMPY.items()}
_RELATIONS = {
    own.less: sympy.StrictLessThan, own.at_most: sympy.LessThan, own.both: sympy.And, own.either: sympy.Or,
    own.opposite: sympy.Not,
}  # fmt: skip


class Foreign(algebra.Expr):
    """A SymPy object that no model can have, to be named in an error.

    Attributes
    ----------
    given : sympy.Basic
    kind : str
        The class of what in it is foreign.
    """

    def __init__(self, given: sympy.Basic, inner: Foreign | None = None) -> None:
        self.given = given
        self.kind = type(given).__name__ if inner is None else inner.kind
        self._hash = hash(given)

    def _same(self, other: Foreign) -> bool:
        return self.given == other.given

    @property
    def sort_key(self) -> tuple:
        return (*super().sort_key, str(self.given))

    @property
    def free_symbols(self) -> frozenset[algebra.Symbol]:
        return frozenset(algebra.Symbol(x.name) for x in self.given.free_symbols)


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
    return own.where(to_sympy(as_condition(condition)), *parts)


def mod(x: Any, divisor: Any) -> sympy.Expr:
    """What is left of `x` when as many whole divisors as fit are taken away, with the divisor's sign, as in Python."""
    return _written_with(functions.mod, x, divisor)


def smoothstep(low: Any, high: Any, x: Any) -> sympy.Expr:
    """0 below `low`, 1 above `high`, and s^2 (3 - 2 s) between, where s goes evenly from 0 to 1."""
    return _written_with(functions.smoothstep, low, high, x)


def _written_with(function: Callable[..., algebra.Expr], *arguments: Any) -> sympy.Expr:
    return to_sympy(function(*(taken_over(_value(x)) for x in arguments)))


def _value(x: Any) -> sympy.Expr:
    if isinstance(x, sympy.Expr):
        return x
    if isinstance(x, algebra.Expr):
        return to_sympy(x)
    if isinstance(x, bool) or not isinstance(x, numbers.Real):
        raise ModelError(
            f"an expression or a number is expected here, as in where(condition, a, b), not {x!r:.60}",
            hint="text is read as a whole: write the whole expression as text",
        )
    return sympy.Integer(int(x)) if isinstance(x, numbers.Integral) else sympy.Float(float(x))


def as_piecewise(choice: sympy.Function) -> sympy.Piecewise:
    """A `where` as SymPy's own class, for printing."""
    condition, then, otherwise = choice.args
    pairs = (then, _relation(condition)), (otherwise, sympy.true)
    return sympy.Piecewise(*(ExprCondPair(*pair) for pair in pairs), evaluate=False)


def _relation(condition: sympy.Basic) -> sympy.Basic:
    args = [_relation(x) if x.func in _RELATIONS else x for x in condition.args]
    return _RELATIONS[condition.func](*args, evaluate=False)


def as_condition(x: Any) -> algebra.Expr:
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


def _heaviside(x: algebra.Expr, at_zero: algebra.Expr = algebra.HALF) -> algebra.Expr:
    if at_zero != algebra.HALF:
        raise ModelError(
            f"Heaviside(x, {at_zero}) is not 1/2 at zero, as heaviside is in models",
            hint="write where(x < 0, 0, 1), or Heaviside(x)",
        )
    return heaviside(x)


def _piecewise(*pieces: tuple[algebra.Expr, Any]) -> algebra.Expr:
    (*pieces, (value, last)) = pieces
    if last is not True:
        raise ModelError(
            "a Piecewise has no value where none of its conditions holds", hint="end it with (value, True)"
        )
    for piece, condition in reversed(pieces):
        value = functions.where(_condition(condition), piece, value)
    return value


def _condition(x: Any) -> algebra.Expr:
    if isinstance(x, bool):
        return functions.at_most(algebra.ZERO, algebra.ONE if x else algebra.NEGATIVE_ONE)
    return x


# What SymPy's own classes are here, made of their arguments.
_RULES: dict[type, Callable] = {
    sympy.Max: _max_or_min(maximum),
    sympy.Min: _max_or_min(minimum),
    sympy.floor: floor,
    sympy.ceiling: lambda x: -floor(-x),
    sympy.Mod: functions.mod,
    sympy.Heaviside: _heaviside,
    sympy.Piecewise: _piecewise,
    ExprCondPair: lambda value, condition: (value, condition),
    sympy.StrictLessThan: functions.less,
    sympy.LessThan: functions.at_most,
    sympy.StrictGreaterThan: lambda x, y: functions.less(y, x),
    sympy.GreaterThan: lambda x, y: functions.at_most(y, x),
    sympy.And: lambda *conditions: nested(both, conditions),
    sympy.Or: lambda *conditions: nested(either, conditions),
    sympy.Not: opposite,
    sympy.ITE: lambda condition, then, otherwise: either(
        both(condition, then), both(opposite(condition), otherwise)
    ),
}


LARGEST_MEMORY = 50_000  # nodes that a `Taken` keeps alive


class Taken:
    """What was taken over before, by identity of SymPy's objects, which users write into many expressions.

    Equal parts become one object, so that whoever walks many expressions meets them once.
    """

    def __init__(self) -> None:
        self._done: dict[int, Any] = {}
        self._rewritten: set[int] = set()
        self._alive: list[sympy.Basic] = []  # so that identities stay their own
        self._parts: dict[algebra.Expr, algebra.Expr] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Taken, ()  # identities are those of this process and of these objects

    def over(self, root: sympy.Basic) -> algebra.Expr:
        """As `taken_over`."""
        if len(self._done) > LARGEST_MEMORY:
            self.__init__()
        done, rewritten, parts = self._done, self._rewritten, self._parts
        for x in postorder([root], known=done):
            arguments = x.args
            is_rewritten = x.func in _RULES or (rewritten and any(id(a) in rewritten for a in arguments))
            made = _taken_over(x, [done[id(a)] for a in arguments], bool(is_rewritten))
            if arguments and isinstance(made, algebra.Expr) and made.args:
                made = parts.setdefault(made, made)
            self._alive.append(x)  # first: an identity that is known must stay this object's
            done[id(x)] = made
            if is_rewritten:
                rewritten.add(id(x))
        return _apart(done[id(root)])


def taken_over(root: sympy.Basic) -> algebra.Expr:
    """An expression of SymPy as one of a model; what no model can have is `Foreign`.

    Raises
    ------
    ModelError
        SymPy's function says something that no model can have.
    """
    return root if isinstance(root, algebra.Expr) else Taken().over(root)


def _apart(made: Any) -> Any:
    """The same as an object of its own: what is known of an expression of a model is known by its identity."""
    if isinstance(made, algebra.Symbol):
        return algebra.Symbol(made.name)
    return type(made)._made(made.args) if isinstance(made, algebra.Expr) and made.args else made


def _taken_over(x: sympy.Basic, args: list[Any], is_rewritten: bool) -> Any:
    """One node, of arguments that are taken over; it is simplified and put in order where they were rewritten."""
    if isinstance(x, sympy.Symbol):
        return algebra.Symbol(x.name)
    if isinstance(x, sympy.Number) and x.is_finite:
        return algebra.Rational(Fraction(int(x.p), int(x.q))) if x.is_Rational else algebra.Float(float(x))
    if isinstance(x, sympy.NumberSymbol):
        return {sympy.pi: algebra.pi, sympy.E: algebra.E}.get(x) or algebra.Float(float(x))
    if x in (sympy.true, sympy.false):
        return bool(x)
    foreign = next((a for a in args if isinstance(a, Foreign)), None)
    if foreign is not None:
        return Foreign(x, foreign)
    if x.func in _RULES:
        return _RULES[x.func](*args)
    if isinstance(x, Relational):
        raise ModelError(f"'{x!s:.60}' is no condition of a model", hint="comparisons are by <, <=, > and >=")
    kind = x.func.kind if isinstance(x, own.Tabulated) else _MODELS.get(x.func)
    return Foreign(x) if kind is None else kind(*args, evaluate=is_rewritten)


def to_sympy(root: algebra.Expr) -> sympy.Basic:
    """An expression of a model as one of SymPy, which evaluates nothing in it."""
    done: dict[int, sympy.Basic] = {}
    for x in postorder([root]):
        done[id(x)] = _to_sympy(x, [done[id(a)] for a in x.args])
    return done[id(root)]


def _to_sympy(x: algebra.Expr, args: list[sympy.Basic]) -> sympy.Basic:
    if isinstance(x, algebra.Symbol):
        return sympy.Symbol(x.name)
    if isinstance(x, algebra.Float):
        return sympy.Float(float(x))
    if isinstance(x, algebra.Rational):
        return sympy.Rational(x.p, x.q)
    if isinstance(x, algebra.NumberSymbol):
        return sympy.pi if x is algebra.pi else sympy.E
    if isinstance(x, Foreign):
        return x.given
    kind = own.tabulated(x.func, len(args)) if isinstance(x, functions.Tabulated) else _SYMPY[x.func]
    return kind(*args, evaluate=False)


converter[algebra.Expr] = to_sympy  # what SymPy calls where it meets one
