"""Expressions from text to trees by a whitelist over Python's `ast`; no text is evaluated."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ..errors import ModelError
from . import algebra, alike_texts, exact
from .evaluate import NotFinite, evaluate
from .functions import (
    ABBREVIATIONS,
    CLASSES,
    CONDITION_CLASSES,
    INTEGRAL,
    VALUE,
    dot,
    nested,
    sensor,
    tabulated,
)
from .names import SENSOR_ARITY
from .tokens import LONGEST_TEXT, Token, check_grammar, tokenise
from .unevaluated import build, inverted, negated, split_product
from .units import Unit, parse_unit

DEEPEST_TREE = 120  # what reads and prints a tree recurses
QUANTITY = re.compile(
    r"(?P<number>[+-]?\s*+(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?+)"
    r"(?P<unit>\s*+[A-Za-z].*|\s++1\s*+/.*)",
    re.ASCII | re.DOTALL,
)
SYMPY_FUNCTIONS = CLASSES | {"dot": dot}


@dataclass(frozen=True)
class Parsed:
    """An expression with what its text said beyond it.

    `unit` is that of a lone quantity (whose value is in SI units); `decimals` are the absolute values of
    numbers that were written with a decimal point or exponent, or come from such: a unit may be meant.
    """

    expression: algebra.Expr
    text: str
    unit: Unit | None = None
    decimals: frozenset[algebra.Rational] = frozenset()


@functools.lru_cache(maxsize=1024)  # a scene of many bodies gives sizes and masses many times
def parse(text: str, tables: tuple[tuple[str, int], ...] = ()) -> Parsed:
    """Parse an expression or a lone quantity.

    Parameters
    ----------
    text : str
        For example `"m*g*l*(1 - cos(theta))"`, `"-5 N"`.
    tables : tuple of (str, int)
        Names of a model's own functions, and how many arguments they take.

    Returns
    -------
    Parsed
        Names become plain `algebra.Symbol`s; whether they are declared is checked elsewhere.

    Raises
    ------
    ModelError
        With the column in the text as written.
    """
    if len(text) <= LONGEST_TEXT and (match := QUANTITY.fullmatch(text.strip())):
        return _parse_quantity(text, match)
    form, names = (None if tables else alike_texts.form(text)) or ("", [])
    if form and (template := alike_texts.known(form)) is not None:
        return Parsed(template.of(names), text, None, template.decimals)
    tokens = tokenise(text)
    check_grammar(tokens, len(text), dict(tables))
    builder = _Builder(tokens, dict(tables))
    expression, decimals = builder.build(), frozenset(builder.decimals)
    if form:
        alike_texts.remember(form, names, expression, decimals)
    return Parsed(expression, text, None, decimals)


def quantity_value(text: str) -> tuple[float, Unit | None]:
    """The SI value of a number or quantity, and its unit.

    Parameters
    ----------
    text : str
        For example `"0.1"`, `"20 mm"`.
    """
    parsed = parse(text)
    value = parsed.expression
    if not value.is_Number:
        raise ModelError(
            f"{text.strip()!r} is not a number", hint='write a number, or "number unit" as in "9.81 m/s^2"'
        )
    return float(value), parsed.unit


def _parse_quantity(text: str, match: re.Match) -> Parsed:
    digits = "".join(match["number"].split())
    margin = len(text) - len(text.lstrip())
    try:
        magnitude = exact.decimal_fraction(digits.lstrip("+-"))
    except ModelError as error:
        raise error.located(column=margin + 1) from None
    try:
        unit = parse_unit(match["unit"])
    except ModelError as error:
        error.column = margin + match.start("unit") + (error.column or 1)
        multiply = f"to multiply, write {digits}*{match['unit'].strip():.40}"
        error.hint = f"{error.hint}; {multiply}" if error.hint else multiply
        raise
    magnitude = -magnitude if digits.startswith("-") else magnitude
    value = magnitude * unit.factor
    result = exact.number(value if unit.pi_power == 0 else unit.to_si(magnitude))
    return Parsed(result, text, unit)


class _Builder:
    """One expression's way from tokens through `ast` to a tree."""

    def __init__(self, tokens: list[Token], tables: Mapping[str, int]) -> None:
        self.tables = tables
        self.decimals: set[algebra.Rational] = set()
        source: list[str] = []
        self.token_at: dict[int, Token] = {}
        position = 0
        for token in tokens:
            # Python gives ^ a lower precedence than +. Values of numbers are read from the tokens, exactly.
            part = "**" if token.text == "^" else "1" if token.kind == "number" else token.text
            self.token_at[position] = token
            source.append(part)
            position += len(part) + 1
        self.source = " ".join(source)

    def build(self) -> algebra.Expr:
        try:
            tree = ast.parse(self.source, mode="eval")
        except (SyntaxError, ValueError) as error:
            column = self._column(getattr(error, "offset", None))
            raise ModelError(
                "the expression is not well formed",
                column=column,
                hint="look for a missing operator or bracket",
            ) from None
        except (RecursionError, MemoryError):
            raise ModelError(
                "the expression has too many operators in a row", hint="name its parts in [definitions]"
            ) from None
        return self._convert(tree.body, 0)

    def _column(self, offset: int | None) -> int | None:
        before = [start for start in self.token_at if offset is not None and start < offset]
        return self.token_at[max(before)].column if before else None

    def _token(self, node: ast.expr) -> Token:
        return self.token_at[node.col_offset]

    def _convert(self, node: ast.expr, depth: int) -> algebra.Expr:
        if depth > DEEPEST_TREE:
            raise ModelError("the expression is nested too deeply", hint="name its parts in [definitions]")
        if isinstance(node, ast.Name):
            return algebra.pi if node.id == "pi" else algebra.Symbol(node.id)
        if isinstance(node, ast.Attribute):
            return algebra.Symbol(_dotted(node))
        if isinstance(node, ast.Constant):
            return self._number(self._token(node))
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, (ast.Name, ast.Attribute))
            and not node.keywords
        ):
            return self._call(node, depth)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            return self._power(node, depth)
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
            return self._product(node, depth)
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
            return self._sum(node, depth)
        if _is_sign(node):
            return self._product(node, depth)
        if _is_condition(node):
            raise ModelError(
                "a condition is no value", column=self._column(node.col_offset + 1),
                hint="conditions stand in where(condition, a, b)",
            )  # fmt: skip
        raise ModelError(
            "this has no place in an expression",
            column=self._column(node.col_offset + 1),
            hint="it takes numbers, names, + - * / ^, parentheses and functions",
        )

    def _number(self, token: Token) -> algebra.Expr:
        try:
            value = exact.number(exact.decimal_fraction(token.text))
        except ModelError as error:
            raise error.located(column=token.column) from None
        if not token.text.isdigit():
            self.decimals.add(abs(value))
        return value

    def _condition(self, node: ast.expr, depth: int) -> algebra.Expr:
        """The condition of `where`."""
        if isinstance(node, ast.BoolOp):
            joined = CONDITION_CLASSES["and" if isinstance(node.op, ast.And) else "or"]
            return nested(joined, [self._condition(x, depth + 1) for x in node.values])
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return CONDITION_CLASSES["not"](self._condition(node.operand, depth + 1), evaluate=False)
        if isinstance(node, ast.Compare):
            sides = [self._convert(x, depth + 1) for x in (node.left, *node.comparators)]
            pairs = zip(node.ops, sides, sides[1:], strict=False)
            return nested(CONDITION_CLASSES["and"], [_comparison(op, a, b) for op, a, b in pairs])
        raise ModelError(
            "where(condition, a, b) needs a condition here",
            column=self._column(node.col_offset + 1),
            hint="a comparison such as x < 0, or several joined by and, or, not",
        )

    def _where(self, node: ast.Call, depth: int) -> algebra.Expr:
        condition = self._condition(node.args[0], depth + 1)
        then, otherwise = (self._convert(a, depth + 1) for a in node.args[1:])
        if then.is_Number and otherwise.is_Number and not condition.free_symbols:
            return then if evaluate(condition, {}) else otherwise
        return CLASSES["where"](condition, then, otherwise, evaluate=False)

    def _call(self, node: ast.Call, depth: int) -> algebra.Expr:
        name = _dotted(node.func)
        if name == "where":
            return self._where(node, depth)
        if name in SENSOR_ARITY and name not in self.tables:
            return sensor(name, *(x.value if isinstance(x, ast.Constant) else _dotted(x) for x in node.args))
        arguments = [self._convert(a, depth + 1) for a in node.args]
        if name in self.tables:
            own = name.removesuffix("_integral")
            own, role = (own, INTEGRAL) if own != name and own in self.tables else (name, VALUE)
            return tabulated(own, role, len(arguments))(*arguments, evaluate=False)
        if name in ABBREVIATIONS:
            return self._abbreviated(name, arguments, self._token(node.func))
        if all(a.is_Number for a in arguments):
            return self._folded(self._token(node.func), lambda: exact.call(name, arguments), arguments)
        if name == "sqrt":
            return algebra.Pow(arguments[0], algebra.HALF, evaluate=False)
        if name in ("min", "max"):
            return nested(CLASSES[name], arguments)
        if name == "dot" and isinstance(arguments[0], dot):
            raise ModelError(
                "dot(dot(…)) is a second derivative: accelerations cannot stand in a model",
                column=self._token(node.func).column,
                hint="write forces and constraints with positions and rates only",
            )
        return SYMPY_FUNCTIONS[name](*arguments, evaluate=False)

    def _abbreviated(self, name: str, arguments: list[algebra.Expr], place: Token) -> algebra.Expr:
        if not all(a.is_Number for a in arguments):
            return ABBREVIATIONS[name](*arguments)
        try:
            return exact.number(evaluate(ABBREVIATIONS[name](*map(algebra.Float, arguments)), {}))
        except NotFinite:
            message, hint = f"'{name}' has no value here", "look for a division by zero"
            raise ModelError(message, column=place.column, hint=hint) from None

    def _power(self, node: ast.BinOp, depth: int) -> algebra.Expr:
        base, exponent = self._convert(node.left, depth + 1), self._convert(node.right, depth + 1)
        place = self._first_token(node.right)
        if base.is_Number and exponent.is_Number:
            return self._folded(place, lambda: exact.power(base, exponent), (base, exponent))
        if exponent.is_Number:
            if abs(exact.python_number(exponent)) > exact.LARGEST_EXPONENT:
                raise ModelError(
                    f"an exponent is at most {exact.LARGEST_EXPONENT}",
                    column=None if place is None else place.column,
                    hint="choose a smaller one",
                )
            if exponent in (0, 1):
                return base if exponent == 1 else algebra.ONE
        return algebra.Pow(base, exponent, evaluate=False)

    def _product(self, node: ast.expr, depth: int) -> algebra.Expr:
        coefficient: algebra.Expr = algebra.ONE
        factors: list[algebra.Expr] = []
        one_written = False
        for operand, inverse, negative in _product_operands(node):
            if negative:
                coefficient = -coefficient
                continue
            one_written |= self._is_decimal_one(operand)
            value = self._convert(operand, depth + 1)
            number, rest = split_product(value)
            if inverse:
                rest = [inverted(x) for x in rest]
                number = self._reciprocal(number, operand)
            coefficient = self._folded(
                self._first_token(operand),
                functools.partial(exact.multiply, coefficient, number),
                (coefficient, number),
            )
            factors += rest
        if one_written and coefficient in (1, -1) and factors:  # as 2.0 would, it may carry a unit
            coefficient = algebra.Float(coefficient)
        return build(algebra.Mul, coefficient, algebra.ONE, factors)

    def _is_decimal_one(self, node: ast.expr) -> bool:
        text = self._token(node).text if isinstance(node, ast.Constant) else "1"
        return not text.isdigit() and float(text) == 1.0

    def _reciprocal(self, number: algebra.Expr, operand: ast.expr) -> algebra.Expr:
        if number is algebra.ONE:
            return number
        return self._folded(
            self._first_token(operand), lambda: exact.power(number, algebra.NEGATIVE_ONE), (number,)
        )

    def _sum(self, node: ast.expr, depth: int) -> algebra.Expr:
        constant: algebra.Expr = algebra.ZERO
        terms: list[algebra.Expr] = []
        for operand, negative in _sum_operands(node):
            value = self._convert(operand, depth + 1)
            parts = value.args if isinstance(value, algebra.Add) else (value,)
            for part in parts:
                part = negated(part) if negative else part
                if part.is_Number:
                    constant = self._folded(
                        self._first_token(operand),
                        functools.partial(exact.add, constant, part),
                        (constant, part),
                    )
                else:
                    terms.append(part)
        return build(algebra.Add, constant, algebra.ZERO, terms)

    def _folded(self, place: Token | None, compute, operands: Iterable[algebra.Expr]) -> algebra.Expr:
        try:
            result = compute()
        except ModelError as error:
            raise error.located(column=place.column if place is not None else None) from None
        if self.decimals and any(abs(x) in self.decimals for x in operands):
            self.decimals.add(abs(result))
        return result

    def _first_token(self, node: ast.expr) -> Token | None:
        return self.token_at.get(node.col_offset)


def _dotted(node: ast.expr) -> str:
    """A name, or names joined by dots."""
    return node.id if isinstance(node, ast.Name) else f"{_dotted(node.value)}.{node.attr}"


def _is_sign(node: ast.expr) -> bool:
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub))


def _is_condition(node: ast.expr) -> bool:
    is_not = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)
    return is_not or isinstance(node, (ast.Compare, ast.BoolOp))


def _comparison(op: ast.cmpop, a: algebra.Expr, b: algebra.Expr) -> algebra.Expr:
    if isinstance(op, (ast.Gt, ast.GtE)):
        a, b = b, a
    return CONDITION_CLASSES["<" if isinstance(op, (ast.Lt, ast.Gt)) else "<="](a, b, evaluate=False)


def _sum_operands(node: ast.expr) -> list[tuple[ast.expr, bool]]:
    """Terms of a sum with their signs; sums lean to the left as deep as they are long, so this is a loop."""
    terms: list[tuple[ast.expr, bool]] = []
    while isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        terms.append((node.right, isinstance(node.op, ast.Sub)))
        node = node.left
    return [(node, False), *reversed(terms)]


def _product_operands(node: ast.expr) -> list[tuple[ast.expr, bool, bool]]:
    """Factors of a product: (operand, whether it divides, whether it stands for a minus sign alone)."""
    factors: list[tuple[ast.expr, bool, bool]] = []
    while True:
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
            factors.append((node.right, isinstance(node.op, ast.Div), False))
            node = node.left
        elif _is_sign(node):
            if isinstance(node.op, ast.USub):
                factors.append((node, False, True))
            node = node.operand
        else:
            return [(node, False, False), *reversed(factors)]
