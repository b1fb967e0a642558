"""Expressions of a model: numbers, names, sums, products, powers and functions, as frozen trees.

What models are read into, so that reading and deriving one needs no computer algebra system (importing SymPy takes
longer than most models). Interface, automatic simplification and order of arguments are those of SymPy's core for
commutative expressions without assumptions; `from_sympy.py` converts both ways.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping
from fractions import Fraction
from functools import cache, cached_property
from typing import Any, ClassVar

from ..errors import TOO_LARGE, ModelError

LARGEST_SQUARE_FACTOR = 2**15  # prime factors up to this are looked for under a square root

# Classes in the order in which arguments of sums and products stand; others come behind, by name.
_RANKS = {
    name: rank
    for rank, name in enumerate(
        ("Zero", "One", "Half", "NegativeOne", "Integer", "Rational", "Float", "Exp1", "Pi", "Symbol", "Pow", "Mul",
         "Add", "Abs")
    )
}  # fmt: skip
_OTHERS = len(_RANKS)


class Expr:
    """An expression; equal ones compare equal. Arithmetic simplifies as SymPy's does.

    Attributes
    ----------
    args : tuple of Expr
    """

    is_Number: ClassVar[bool] = False
    is_Integer: ClassVar[bool] = False
    is_NumberSymbol: ClassVar[bool] = False
    args: tuple[Expr, ...] = ()

    @property
    def func(self) -> type[Expr]:
        """The class, which makes the same of the same arguments."""
        return type(self)

    @cached_property
    def sort_key(self) -> tuple:
        """What arguments are ordered by: class, number of arguments, then these from left to right."""
        waiting: list[Expr] = [self]  # those of arguments first, which most have; trees can be deep
        while True:
            x = waiting[-1]
            unknown = [a for a in x.args if a.args and "sort_key" not in a.__dict__]
            if unknown:
                waiting += unknown
            elif x is self:
                return _key_of(self)
            else:
                waiting.pop().sort_key = _key_of(x)

    @classmethod
    def _made(cls, args: tuple[Expr, ...]) -> Expr:
        """One of arguments as they are; its hash is known at once, as trees can be deep."""
        made = object.__new__(cls)
        made.args = args
        made._hash = hash((cls, args))
        return made

    def __hash__(self) -> int:
        return self._hash

    def __reduce__(self) -> tuple[Any, ...] | str:
        return _remade, (type(self), self.args)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            other = _expression(other)
            if not isinstance(other, Expr):
                return NotImplemented  # SymPy's objects say it themselves
        return type(self) is type(other) and self._hash == other._hash and self._same(other)

    def _same(self, other: Any) -> bool:
        if self.args is not other.args:
            if self.args != other.args:
                return False
            other.args = self.args  # what was found equal once is not compared to its depth again
        return True

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(map(repr, self.args))})"

    def __add__(self, other: Any) -> Expr:
        return _operate(Add, self, other)

    def __radd__(self, other: Any) -> Expr:
        return _operate(Add, other, self)

    def __sub__(self, other: Any) -> Expr:
        return _operate(_difference, self, other)

    def __rsub__(self, other: Any) -> Expr:
        return _operate(_difference, other, self)

    def __mul__(self, other: Any) -> Expr:
        return _operate(Mul, self, other)

    def __rmul__(self, other: Any) -> Expr:
        return _operate(Mul, other, self)

    def __truediv__(self, other: Any) -> Expr:
        return _operate(_quotient, self, other)

    def __rtruediv__(self, other: Any) -> Expr:
        return _operate(_quotient, other, self)

    def __pow__(self, other: Any) -> Expr:
        return _operate(Pow, self, other)

    def __rpow__(self, other: Any) -> Expr:
        return _operate(Pow, other, self)

    def __neg__(self) -> Expr:
        return Mul._of((NEGATIVE_ONE, self))

    @cached_property
    def free_symbols(self) -> frozenset[Symbol]:
        """The names in it."""
        return frozenset(x for x in postorder([self]) if isinstance(x, Symbol))

    @property
    def is_number(self) -> bool:
        """Whether no name is in it."""
        return not self.free_symbols

    def __float__(self) -> float:
        """The value of an expression without names; where it is made of sums, products and pi, rounded once."""
        found = _exact_value(self)
        return self._double(*map(float, self.args)) if found is None else float(found)

    def _double(self, *args: float) -> float:
        raise TypeError(f"{self!r} has no value")

    def atoms(self, kind: type[Expr]) -> set[Expr]:
        """All parts that are of a class, each once."""
        return {x for x in postorder([self]) if isinstance(x, kind)}

    def xreplace(self, replaced: Mapping[Expr, Expr]) -> Expr:
        """The expression with others in place of some of its parts."""
        done: dict[int, Expr] = {}
        for x in postorder([self]):
            args = [done[id(a)] for a in x.args]
            same = all(a is b for a, b in zip(args, x.args, strict=True))
            done[id(x)] = replaced[x] if x in replaced else x if same else x.func(*args)
        return done[id(self)]

    def could_extract_minus_sign(self) -> bool:
        """Whether more of it is negative than positive: f(-x) is written by f(x) then."""
        return False

    @property
    def is_zero(self) -> bool:
        """Whether it is zero whatever its names stand for, as far as that is plain."""
        return False

    def coefficient_and_rest(self) -> tuple[Number, Expr]:
        """A number and what it multiplies."""
        return ONE, self

    def base_and_exponent(self) -> tuple[Expr, Expr]:
        """Of a power; else the expression and one."""
        return self, ONE

    def _to_power(self, exponent: Expr) -> Expr | None:
        """This to an exponent where there is a shorter form; None elsewhere."""
        return None


def postorder(roots: Iterable[Any], seen: set[int] | None = None, known: Container[int] = ()) -> list[Any]:
    """Every object below the roots once, arguments before what they are arguments of; SymPy's trees, too.

    By identity, as much is shared, and in a loop, as trees can be deep.

    Parameters
    ----------
    roots : iterable of Expr
    seen : set of int, optional
        Identities that are left out; grows by those returned.
    known : container of int
        Others that are left out.
    """
    seen = set() if seen is None else seen
    order: list[Any] = []
    stack: list[Any] = list(roots)
    stack.reverse()
    while stack:
        node = stack.pop()
        if node is None:  # all below the one under it is done
            order.append(stack.pop())
        elif id(node) not in seen and id(node) not in known:
            seen.add(id(node))
            arguments = node.args
            if arguments:
                stack += (node, None, *arguments[::-1])
            else:
                order.append(node)
    return order


_PI = Fraction("3.14159265358979323846264338327950288419716939937510")


def _exact_value(x: Expr) -> Fraction | None:
    """The value of sums, products and whole powers of rational numbers, doubles and pi; None of others."""
    if x.is_Number:
        return Fraction(x._value) if x.is_finite else None
    if x is pi:
        return _PI
    if isinstance(x, Pow):
        base = _exact_value(x.base)
        return base**x.exp.p if base and x.exp.is_Integer else None
    parts = [_exact_value(a) for a in x.args] if isinstance(x, (Add, Mul)) else [None]
    if None in parts:
        return None
    return sum(parts) if isinstance(x, Add) else math.prod(parts, start=Fraction(1))


def _remade(cls: type[Expr], args: tuple[Expr, ...]) -> Expr:
    """A copy, or what was pickled."""
    return cls._made(args)


def _key_of(x: Expr) -> tuple:
    return (*_rank(type(x).__name__), len(x.args), *(y.sort_key for y in x.args))


@cache
def _rank(name: str) -> tuple[int, str]:
    rank = _RANKS.get(name, _OTHERS)
    return rank, name if rank == _OTHERS else ""


def _expression(value: Any) -> Any:
    """A number as an expression; anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, (int, float, Fraction)):
        return value
    return Float(value) if isinstance(value, float) else Rational(value)


def _operate(operation: Any, left: Any, right: Any) -> Any:
    left, right = _expression(left), _expression(right)
    return operation(left, right) if isinstance(left, Expr) and isinstance(right, Expr) else NotImplemented


def _difference(a: Expr, b: Expr) -> Expr:
    return Add(a, -b)


def _quotient(a: Expr, b: Expr) -> Expr:
    if isinstance(a, Float) and isinstance(b, Number) and not b.is_zero:
        return Float(float(a) / float(b))
    inverse = Pow(b, NEGATIVE_ONE)
    return inverse if a is ONE else Mul(a, inverse)


def sort_key(x: Expr) -> tuple:
    """What arguments of sums and products are ordered by."""
    return x.sort_key


class Symbol(Expr):
    """A name."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._hash = hash((Symbol, name))

    def __reduce__(self) -> tuple[Any, ...]:
        return Symbol, (self.name,)

    @cached_property
    def sort_key(self) -> tuple:
        return (*_rank("Symbol"), 1, self.name)

    def _same(self, other: Symbol) -> bool:
        return self.name == other.name

    def __repr__(self) -> str:
        return self.name

    @cached_property
    def free_symbols(self) -> frozenset[Symbol]:
        return frozenset((self,))


class Number(Expr):
    """A rational number or a double."""

    is_Number = True
    free_symbols: frozenset[Symbol] = frozenset()

    def could_extract_minus_sign(self) -> bool:
        return self.is_negative

    def coefficient_and_rest(self) -> tuple[Number, Expr]:
        return self, ONE

    def __bool__(self) -> bool:
        return not self.is_zero

    def __lt__(self, other: Any) -> bool:
        return self._value < _value(other)

    def __le__(self, other: Any) -> bool:
        return self._value <= _value(other)

    def __gt__(self, other: Any) -> bool:
        return self._value > _value(other)

    def __ge__(self, other: Any) -> bool:
        return self._value >= _value(other)

    def __float__(self) -> float:
        return float(self._value)

    def __abs__(self) -> Number:
        return -self if self._value < 0 else self

    @property
    def is_finite(self) -> bool:
        """Whether it is neither infinite nor undefined."""
        return math.isfinite(self._value)

    @property
    def is_zero(self) -> bool:
        """Whether it is zero, exact or not."""
        return self._value == 0

    @property
    def is_negative(self) -> bool:
        """Whether it is below zero."""
        return self._value < 0

    @property
    def is_positive(self) -> bool:
        """Whether it is above zero."""
        return self._value > 0

    def _same(self, other: Number) -> bool:
        return self._value == other._value


def _value(x: Any) -> Fraction | float:
    return x._value if isinstance(x, Number) else x


def _number(value: Fraction | float) -> Number:
    return Float(value) if isinstance(value, float) else Rational(value)


class Float(Number):
    """A double."""

    def __new__(cls, value: Any) -> Float:
        made = object.__new__(cls)
        made._value = float(value)
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return Float, (self._value,)

    @cached_property
    def sort_key(self) -> tuple:
        if not math.isfinite(self._value):
            says = f"a constant part of an expression has the value {self._value:g}"
            raise ModelError(says, hint=TOO_LARGE)
        mantissa, exponent = math.frexp(abs(self._value))
        whole = int(math.ldexp(mantissa, 53))
        trailing = (whole & -whole).bit_length() - 1 if whole else 0
        odd = whole >> trailing
        return (
            *_rank("Float"),
            2,
            (int(self._value < 0), odd, exponent - 53 + trailing if whole else 0, odd.bit_length()),
        )

    @cached_property
    def _hash(self) -> int:
        return hash((Float, self._value))

    def __neg__(self) -> Float:
        return Float(-self._value)

    def __repr__(self) -> str:
        return repr(self._value)

    def _to_power(self, exponent: Expr) -> Expr | None:
        if not exponent.is_Number or (self.is_negative and not exponent.is_Integer):
            return None
        return _float_power(self._value, float(exponent))


def _float_power(base: float, exponent: float) -> Expr | None:
    try:
        found = math.pow(base, exponent)
    except (OverflowError, ValueError):
        return None
    return Float(found)


class Rational(Number):
    """A rational number p/q; whole ones are of the class `Integer`."""

    p: int
    q: int

    def __new__(cls, p: Any, q: int = 1) -> Rational:
        value = Fraction(p) if q == 1 else Fraction(p, q)
        return _rational(value.numerator, value.denominator)

    def __reduce__(self) -> tuple[Any, ...]:
        return Rational, (self.p, self.q)

    @cached_property
    def sort_key(self) -> tuple:
        return (*_rank(self._kind), 2, self.p, self.q)

    @property
    def _kind(self) -> str:
        if self.q == 1:
            return {0: "Zero", 1: "One", -1: "NegativeOne"}.get(self.p, "Integer")
        return "Half" if (self.p, self.q) == (1, 2) else "Rational"

    @cached_property
    def _value(self) -> Fraction:
        return Fraction(self.p, self.q)

    @cached_property
    def _hash(self) -> int:
        return hash(self._value)

    def _same(self, other: Rational) -> bool:
        return self.p == other.p and self.q == other.q

    def __neg__(self) -> Rational:
        return _rational(-self.p, self.q)

    def __repr__(self) -> str:
        return str(self.p) if self.q == 1 else f"{self.p}/{self.q}"

    @property
    def is_zero(self) -> bool:
        return self.p == 0

    @property
    def is_negative(self) -> bool:
        return self.p < 0

    @property
    def is_positive(self) -> bool:
        return self.p > 0

    def _to_power(self, exponent: Expr) -> Expr | None:
        if exponent.is_Integer:
            return None if self.is_zero and exponent.is_negative else Rational(self._value**exponent.p)
        if isinstance(exponent, Float):
            return None if self.is_negative else _float_power(float(self), float(exponent))
        if isinstance(exponent, Rational) and exponent.q == 2 and self.is_positive:
            return _half_power(self, exponent.p)
        return None


class Integer(Rational):
    """A whole number."""

    is_Integer = True

    def __new__(cls, p: Any) -> Integer:
        return _rational(int(p), 1)

    def __int__(self) -> int:
        return self.p


@cache
def _small(p: int, q: int) -> Rational:
    return _made(p, q)


def _made(p: int, q: int) -> Rational:
    made = object.__new__(Integer if q == 1 else Rational)
    made.p, made.q = p, q
    return made


def _rational(p: int, q: int) -> Rational:
    """A rational number in lowest terms; the small ones exist once, so that they can be told by `is`."""
    return _small(p, q) if -64 <= p <= 64 and q <= 64 else _made(p, q)


ZERO, ONE, NEGATIVE_ONE, HALF = _rational(0, 1), _rational(1, 1), _rational(-1, 1), _rational(1, 2)


def _half_power(x: Rational, p: int) -> Expr | None:
    """x^(p/2): sqrt(12) is 2 sqrt(3), 1/sqrt(2) is sqrt(2)/2; None where it stays as it is."""
    outside = x._value ** ((p - 1) // 2)  # and what is left is a square root
    (above, left), (below, under) = _square_factor(x.p), _square_factor(x.q)
    outside *= Fraction(above, below * under)
    inside = left * under
    if inside == 1:
        return Rational(outside)
    root = Pow(Integer(inside), HALF, evaluate=False)
    return None if (outside, p, x.q) == (1, 1, 1) else Mul(Rational(outside), root)


def _square_factor(n: int) -> tuple[int, int]:
    """The numbers a and b of n = a² b with b free of squares, as far as small factors tell."""
    root = math.isqrt(n)
    if root * root == n:
        return root, 1
    outside, divisor = 1, 2
    while divisor * divisor <= n and divisor < LARGEST_SQUARE_FACTOR:
        while n % (divisor * divisor) == 0:
            n //= divisor * divisor
            outside *= divisor
        divisor += 1
    return outside, n


class NumberSymbol(Expr):
    """A number with a name: pi or e."""

    is_NumberSymbol = True
    free_symbols: frozenset[Symbol] = frozenset()
    value = 0.0

    def __float__(self) -> float:
        return self.value


class Pi(NumberSymbol):
    """3.14159…"""

    value = math.pi
    _hash = hash("pi")

    def __reduce__(self) -> str:
        return "pi"

    def __repr__(self) -> str:
        return "pi"


class Exp1(NumberSymbol):
    """2.71828…"""

    value = math.e
    _hash = hash("e")

    def __reduce__(self) -> str:
        return "E"

    def __repr__(self) -> str:
        return "E"


pi, E = Pi(), Exp1()


class _Many(Expr):
    """A sum or a product."""

    neutral: ClassVar[Number]

    def __new__(cls, *args: Any, evaluate: bool = True) -> Expr:
        args = tuple(map(_expression, args))
        if evaluate:
            args = cls._flattened([x for x in args if x is not cls.neutral])
        return cls._of(args)

    @classmethod
    def _of(cls, args: Iterable[Expr]) -> Expr:
        """One of arguments that are in order."""
        args = tuple(args)
        if len(args) < 2:
            return args[0] if args else cls.neutral
        return cls._made(args)

    @classmethod
    def make_args(cls, x: Expr) -> tuple[Expr, ...]:
        """Of one of this class its arguments; of others themselves."""
        return x.args if isinstance(x, cls) else (x,)

    @classmethod
    def _flattened(cls, args: list[Expr]) -> list[Expr]:
        raise NotImplementedError


class Add(_Many):
    """A sum."""

    neutral = ZERO

    def _double(self, *args: float) -> float:
        return math.fsum(args)

    @classmethod
    def _flattened(cls, args: list[Expr]) -> list[Expr]:
        """Terms with numbers and equal ones added up, in order, a number first."""
        if len(args) == 1:
            return args
        if len(args) == 2:
            a, b = reversed(args) if isinstance(args[1], Rational) else args
            if isinstance(a, Rational) and isinstance(b, Mul):
                return [a, b]
        constant: Number = ZERO
        terms: dict[Expr, Number] = {}
        waiting = list(args)
        for x in waiting:  # grows
            if isinstance(x, Add):
                waiting += x.args
            elif x.is_Number:
                constant = _number(_plus(constant, x))
            else:
                number, rest = x.coefficient_and_rest()
                terms[rest] = _number(_plus(terms[rest], number)) if rest in terms else number
        found = [_scaled(number, rest) for rest, number in terms.items() if not number.is_zero]
        found.sort(key=sort_key)
        return found if constant.is_zero else [constant, *found]

    def __neg__(self) -> Expr:
        return Mul(NEGATIVE_ONE, self)

    def could_extract_minus_sign(self) -> bool:
        negative = sum(x.could_extract_minus_sign() for x in self.args)
        if 2 * negative != len(self.args):
            return 2 * negative > len(self.args)
        return self._leading().could_extract_minus_sign()

    def _leading(self) -> Expr:
        """The term that is first in lexicographic order of its powers, as of a polynomial."""
        powers = [_powers(x) for x in self.args]
        bases = sorted(set().union(*powers), key=sort_key)
        order = [tuple(of.get(base, 0) for base in bases) for of in powers]
        return self.args[order.index(max(order))]


def _powers(term: Expr) -> dict[Expr, int]:
    """The exponents of a term's factors by their bases; roots are bases."""
    found: dict[Expr, int] = {}
    for factor in Mul.make_args(term):
        base, exponent = factor.base_and_exponent() if isinstance(factor, Pow) else (factor, ONE)
        if not isinstance(exponent, Rational):
            base, exponent = factor, ONE
        if not factor.is_number:
            found[Pow(base, Rational(1, exponent.q))] = exponent.p
    return found


def _plus(a: Number, b: Number) -> Fraction | float:
    x, y = a._value, b._value
    return float(x) + float(y) if isinstance(x, float) or isinstance(y, float) else x + y


def _times(a: Number, b: Number) -> Number:
    x, y = a._value, b._value
    is_double = isinstance(x, float) or isinstance(y, float)
    if x == 0 or y == 0:
        return ZERO
    return Float(float(x) * float(y)) if is_double else Rational(x * y)


def _scaled(number: Number, rest: Expr) -> Expr:
    """A number times something without one."""
    if number is ONE:
        return rest
    if isinstance(rest, Mul):
        return Mul._of((number, *rest.args))
    return Mul(number, rest, evaluate=not isinstance(rest, Add))


class Mul(_Many):
    """A product."""

    neutral = ONE

    def _double(self, *args: float) -> float:
        return math.prod(args)

    @classmethod
    def _flattened(cls, args: list[Expr]) -> list[Expr]:
        """Factors with numbers multiplied and powers of equal bases joined, in order, a number first."""
        if len(args) == 1:
            return args
        spread = cls._spread(*args) if len(args) == 2 else None
        if spread is not None:
            return [spread]
        number, powers, roots = cls._collected(args)
        factors: list[Expr] = []
        for base, exponent in [*powers, *roots]:
            made = Pow(base, exponent)
            for x in Mul.make_args(made):
                if x.is_Number:
                    number = _times(number, x)
                elif x is not ONE:
                    factors.append(x)
        if number.is_zero:
            return [ZERO]
        factors.sort(key=sort_key)
        if number is ONE:
            return factors
        if len(factors) == 1 and isinstance(factors[0], Add):  # 2 (a + b) is 2 a + 2 b
            return [Add(*(number * x for x in factors[0].args))]
        return [number, *factors]

    @staticmethod
    def _spread(a: Expr, b: Expr) -> Expr | None:
        """A rational number times a sum."""
        if isinstance(b, Rational):
            a, b = b, a
        if not isinstance(a, Rational) or a.is_zero:
            return None
        number, rest = b.coefficient_and_rest()
        if not isinstance(rest, Add):
            return None
        if number is ONE:
            return Add(*(a * x for x in rest.args))
        product = _times(a, number)
        return rest if product is ONE else Mul._of((product, rest))

    @staticmethod
    def _collected(
        args: Iterable[Expr],
    ) -> tuple[Number, list[tuple[Expr, Expr]], list[tuple[Expr, Expr]]]:
        """The number of a product, its powers by base, and its roots of numbers."""
        number: Number = ONE
        found: dict[Expr, dict[Expr, list[Expr]]] = {}
        roots: dict[Expr, list[Expr]] = {}
        waiting = list(args)
        for x in waiting:  # grows
            if isinstance(x, Mul):
                waiting += x.args
                continue
            if x.is_Number:
                number = _times(number, x)
                continue
            base, exponent = x.base_and_exponent()
            if base.is_Number and exponent.is_Integer and (made := base._to_power(exponent)) is not None:
                number = _times(number, made)
            elif base.is_Number and isinstance(exponent, Rational):
                roots.setdefault(base, []).append(exponent)
            else:
                coefficient, rest = exponent.coefficient_and_rest()
                found.setdefault(base, {}).setdefault(rest, []).append(coefficient)
        powers = [
            (base, Mul(Add(*coefficients), rest))
            for base, exponents in found.items()
            for rest, coefficients in exponents.items()
        ]
        return number, powers, [(base, Add(*exponents)) for base, exponents in roots.items()]

    @property
    def is_zero(self) -> bool:
        return any(x.is_zero for x in self.args)

    def __neg__(self) -> Expr:
        number, rest = self.coefficient_and_rest()
        number = -number
        return rest if number is ONE else Mul._of((number, *Mul.make_args(rest)))

    def could_extract_minus_sign(self) -> bool:
        return self.args[0].is_Number and self.args[0].is_negative

    def coefficient_and_rest(self) -> tuple[Number, Expr]:
        first = self.args[0]
        return (first, Mul._of(self.args[1:])) if first.is_Number else (ONE, self)

    def _to_power(self, exponent: Expr) -> Expr | None:
        if exponent.is_Integer:
            return Mul(*(Pow(x, exponent) for x in self.args))
        if not exponent.is_Number:
            return None
        outside = [x for x in self.args if _is_positive(x)]
        inside = [x for x in self.args if not _is_positive(x)]
        if inside and inside[0].is_Number and inside[0] is not NEGATIVE_ONE:
            outside.append(-inside[0])
            inside[0] = NEGATIVE_ONE
        if not outside:
            return None
        return Mul(*(Pow(x, exponent) for x in outside), Pow(Mul._of(inside), exponent))


def _is_positive(x: Expr) -> bool:
    return x.is_NumberSymbol or (x.is_Number and x.is_positive)


class Pow(Expr):
    """A power."""

    def __new__(cls, base: Any, exponent: Any, evaluate: bool = True) -> Expr:
        base, exponent = _expression(base), _expression(exponent)
        if evaluate:
            if exponent is ZERO or base is ONE:
                return ONE
            if exponent is ONE:
                return base
            found = base._to_power(exponent)
            if found is not None:
                return found
            if base is E:
                return exp(exponent)
        return cls._made((base, exponent))

    def _double(self, *args: float) -> float:
        return math.pow(*args)

    @property
    def base(self) -> Expr:
        """What is raised."""
        return self.args[0]

    @property
    def exp(self) -> Expr:
        """The exponent."""
        return self.args[1]

    def base_and_exponent(self) -> tuple[Expr, Expr]:
        base, exponent = self.args
        if isinstance(base, Rational) and not base.is_Integer and base.p == 1:
            return Integer(base.q), -exponent
        return self.args

    def _to_power(self, exponent: Expr) -> Expr | None:
        inner = self.exp
        is_root = inner.is_Number and abs(inner) < 1
        return Pow(self.base, Mul(inner, exponent)) if exponent.is_Integer or is_root else None


class Function(Expr):
    """A function of expressions; one subclass each, which has the name."""

    def __new__(cls, *args: Any, evaluate: bool = True) -> Expr:
        args = tuple(map(_expression, args))
        if evaluate:
            found = cls._evaluated(*args)
            if found is not None:
                return found
        return cls._made(args)

    @classmethod
    def _evaluated(cls, *args: Expr) -> Expr | None:
        """A shorter form, if there is one."""
        return None


class _OfOne(Function):
    """An elementary function of one argument that is odd, even or neither, with a value at zero."""

    parity: ClassVar[int] = 0
    at_zero: ClassVar[Number | None] = ZERO
    of_double: ClassVar[Any] = None

    def _double(self, *args: float) -> float:
        return type(self).of_double(*args)

    @classmethod
    def _evaluated(cls, x: Expr) -> Expr | None:
        if x.is_Number:
            return cls._of_number(x)
        if cls.parity and x.could_extract_minus_sign():
            return cls(-x) if cls.parity > 0 else -cls(-x)
        return None

    @classmethod
    def _of_number(cls, x: Number) -> Expr | None:
        if x.is_zero and cls.at_zero is not None:
            return cls.at_zero
        if cls.parity and x.is_negative:
            return cls(-x) if cls.parity > 0 else -cls(-x)
        if not isinstance(x, Float) or cls.of_double is None:
            return None
        try:
            return Float(cls.of_double(float(x)))
        except (OverflowError, ValueError):
            return None


class _Wave(_OfOne):
    """A sine or cosine."""

    @classmethod
    def _evaluated(cls, x: Expr) -> Expr | None:
        turns, rest = _quarter_turns(x)
        if turns is None:
            return super()._evaluated(x)
        sine, cosine = ((ZERO, ONE), (ONE, ZERO), (ZERO, NEGATIVE_ONE), (NEGATIVE_ONE, ZERO))[turns % 4]
        if cls is sin:
            return sine * cos(rest) + cosine * sin(rest)
        return cosine * cos(rest) - sine * sin(rest)


def _quarter_turns(x: Expr) -> tuple[int | None, Expr]:
    """How many times pi/2 is added to something, and to what; None where it is not."""
    for term in Add.make_args(x):
        number, rest = term.coefficient_and_rest()
        if rest is pi and isinstance(number, Rational) and number.q in (1, 2):
            return int(2 * number._value), x - term
    return None, x


class sin(_Wave):
    """Sine."""

    parity, of_double = -1, math.sin


class cos(_Wave):
    """Cosine."""

    parity, at_zero, of_double = 1, ONE, math.cos


class tan(_OfOne):
    """Tangent."""

    parity, of_double = -1, math.tan


class cot(_OfOne):
    """Cotangent, as SymPy makes one of tan(x + pi/2)."""

    at_zero = None


class asin(_OfOne):
    """Inverse sine."""

    parity, of_double = -1, math.asin


class acos(_OfOne):
    """Inverse cosine."""

    at_zero, of_double = None, math.acos


class atan(_OfOne):
    """Inverse tangent."""

    parity, of_double = -1, math.atan


class atan2(Function):
    """The angle of a point (x, y), from `atan2(y, x)`."""

    def _double(self, *args: float) -> float:
        return math.atan2(*args)


class sinh(_OfOne):
    """Hyperbolic sine."""

    parity, of_double = -1, math.sinh


class cosh(_OfOne):
    """Hyperbolic cosine."""

    parity, at_zero, of_double = 1, ONE, math.cosh


class tanh(_OfOne):
    """Hyperbolic tangent."""

    parity, of_double = -1, math.tanh


class erf(_OfOne):
    """Error function."""

    parity, of_double = -1, math.erf


class log(_OfOne):
    """Natural logarithm."""

    at_zero, of_double = None, math.log

    @classmethod
    def _of_number(cls, x: Number) -> Expr | None:
        return ZERO if x is ONE else super()._of_number(x)


class exp(_OfOne):
    """Exponential function."""

    at_zero, of_double = ONE, math.exp

    @classmethod
    def _of_number(cls, x: Number) -> Expr | None:
        return E if x is ONE else super()._of_number(x)

    def base_and_exponent(self) -> tuple[Expr, Expr]:
        return E, self.args[0]

    def _to_power(self, exponent: Expr) -> Expr | None:
        return exp(self.args[0] * exponent) if exponent.is_Integer else None


class re(_OfOne):
    """Real part; what is in a model is real."""

    at_zero = None


class conjugate(_OfOne):
    """Complex conjugate; what is in a model is real."""

    at_zero = None


class _Signed(_OfOne):
    """A function that a positive number in its argument goes through."""

    @classmethod
    def _evaluated(cls, x: Expr) -> Expr | None:
        if not isinstance(x, Mul):
            return super()._evaluated(x)
        known = [y for y in x.args if y.is_Number or y.is_NumberSymbol]
        if not known:
            return None
        rest = Mul._of(y for y in x.args if y not in known)
        return Mul(*map(cls, known), cls(rest))


class Abs(_Signed):
    """Absolute value."""

    parity, of_double = 1, abs

    @classmethod
    def _evaluated(cls, x: Expr) -> Expr | None:
        if isinstance(x, Abs) or x.is_NumberSymbol:
            return x
        is_inverse = isinstance(x, Pow) and x.exp.is_Integer and x.exp.is_negative
        return Pow(cls(x.base), x.exp) if is_inverse else super()._evaluated(x)

    @classmethod
    def _of_number(cls, x: Number) -> Expr:
        return abs(x)


class sign(_Signed):
    """-1, 0 or 1."""

    @classmethod
    def _evaluated(cls, x: Expr) -> Expr | None:
        return ONE if x.is_NumberSymbol else super()._evaluated(x)

    @classmethod
    def _of_number(cls, x: Number) -> Expr:
        return Integer((x._value > 0) - (x._value < 0))


def sqrt(x: Any, evaluate: bool = True) -> Expr:
    """Square root."""
    return Pow(x, HALF, evaluate=evaluate)


def expand(x: Expr) -> Expr:
    """Products of sums, and whole powers of them, as sums of products."""
    if not x.args:
        return x
    args = [expand(a) for a in x.args]
    if isinstance(x, Pow) and isinstance(args[0], Add) and args[1].is_Integer and 1 < args[1].p <= 8:
        return _spread_out([args[0]] * args[1].p)
    if isinstance(x, Mul):
        return _spread_out(args)
    return x.func(*args)


def _spread_out(factors: Iterable[Expr]) -> Expr:
    terms = [ONE]
    for x in factors:
        terms = [Mul(a, b) for a in terms for b in Add.make_args(x)]
    return Add(*terms)


def by_pythagoras(x: Expr) -> Expr:
    """A sum in which sin(a)^2 + cos(a)^2, each with equal factors, are one."""
    terms = Add.make_args(x)
    for i, a in enumerate(terms):
        for sine in (y.base for y in Mul.make_args(a) if isinstance(y, Pow) and y.exp == 2):
            partner = a / sine**2 * cos(sine.args[0]) ** 2 if isinstance(sine, sin) else None
            if partner in terms:
                rest = (y for k, y in enumerate(terms) if k not in (i, terms.index(partner)))
                return by_pythagoras(Add(*rest, a / sine**2))
    return x
