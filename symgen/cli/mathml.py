"""Model expressions as presentation MathML, which browsers and printers show without help."""

from __future__ import annotations

import re
from collections.abc import Callable
from html import escape

import sympy

_RATE = re.compile(r"dot\((\w+)\)\Z")
_GREEK = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
).split()
_LETTERS = dict(zip(_GREEK, "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ"))
_SUM, _PRODUCT, _POWER, _ATOM = range(4)  # how tightly the outermost operation binds
_ONE = "<mn>1</mn>"
_MINUS = "<mo>−</mo>"
_TIMES = '<mo lspace="0.12em" rspace="0.12em">&#x2062;</mo>'  # a gap, for names may have many letters
_OPEN, _CLOSE = '<mo stretchy="false">(</mo>', '<mo stretchy="false">)</mo>'
_LONG = 60  # letters of a sum that fit a line
_TAG = re.compile(r"<[^>]*>")
_RELATIONS = {"<": "&lt;", "<=": "≤", ">": "&gt;", ">=": "≥", "==": "=", "!=": "≠"}


def to_mathml(expression: sympy.Expr) -> str:
    """Return an expression as the inside of a `math` element."""
    return _print(expression)[0]


def name(text: str) -> str:
    """Return a name as MathML: the part behind the first underscore as an index, `dot(x)` with a dot above."""
    rate = _RATE.match(text)
    if rate:
        return dotted(name(rate.group(1)))
    stem, underscore, index = text.partition("_")
    letter = f"<mi>{_LETTERS.get(stem) or escape(stem)}</mi>"
    if not (underscore and stem and index):
        return letter if not underscore else f"<mi>{escape(text)}</mi>"
    return f"<msub>{letter}<mi>{_LETTERS.get(index) or escape(index)}</mi></msub>"


def dotted(inside: str, dots: str = "˙") -> str:
    """Return MathML with dots above it, which are large enough to be seen on long names."""
    return f'<mover>{inside}<mo mathsize="160%">{dots}</mo></mover>'


def entry(matrix: str, *indices: str) -> str:
    """Return an element of a matrix or vector by the names of its rows and columns."""
    inside = "<mo>,</mo>".join(map(name, indices))
    return f"<msub><mi>{matrix}</mi><mrow>{inside}</mrow></msub>"


def equation(left: str, right: str) -> str:
    """Return two sides as an element of its own line."""
    return f'<div class="wide"><math display="block">{left}<mo>=</mo>{right}</math></div>'


def equation_of(left: str, right: sympy.Expr) -> str:
    """Return an equation for an expression; long sums have a line for each of their terms."""
    text = to_mathml(right)
    if not isinstance(right, sympy.Add) or len(_TAG.sub("", text)) <= _LONG:
        return equation(left, text)
    terms = _signed_terms(right)
    start = f"{left}<mo>=</mo>"
    rows = "".join(
        f'<mtr><mtd style="text-align:right">{"" if i else start}</mtd>'
        f'<mtd style="text-align:left"><mrow>{sign}{term}</mrow></mtd></mtr>'
        for i, (sign, term) in enumerate(terms)
    )
    return f'<div class="wide"><math display="block"><mtable displaystyle="true">{rows}</mtable></math></div>'


def _print(node: sympy.Basic) -> tuple[str, int]:
    for kind, printer in _PRINTERS:
        if isinstance(node, kind):
            return printer(node)
    if isinstance(node, sympy.Function):
        return _call(node.func.__name__, node.args), _ATOM
    return f"<mtext>{escape(str(node))}</mtext>", _SUM


def _symbol(node: sympy.Symbol) -> tuple[str, int]:
    return name(node.name), _ATOM


def _number(node: sympy.Number) -> tuple[str, int]:
    if node < 0:
        return f"<mrow>{_MINUS}{_number(-node)[0]}</mrow>", _SUM
    if isinstance(node, sympy.Rational) and node.q != 1:
        return f"<mfrac><mn>{node.p}</mn><mn>{node.q}</mn></mfrac>", _POWER
    return f"<mn>{node.p if isinstance(node, sympy.Rational) else format(float(node), '.12g')}</mn>", _ATOM


def _sum(node: sympy.Add) -> tuple[str, int]:
    return f"<mrow>{''.join(sign + term for sign, term in _signed_terms(node))}</mrow>", _SUM


def _signed_terms(node: sympy.Add) -> list[tuple[str, str]]:
    """Return the signs and the terms of a sum; the first has none where it is positive."""
    found: list[tuple[str, str]] = []
    for term in node.as_ordered_terms():
        negative = term.could_extract_minus_sign()
        sign = _MINUS if negative else "<mo>+</mo>" if found else ""
        found.append((sign, _within(-term if negative else term, _PRODUCT)))
    return found


def _product(node: sympy.Mul) -> tuple[str, int]:
    if node.could_extract_minus_sign():
        return f"<mrow>{_MINUS}{_within(-node, _PRODUCT)}</mrow>", _SUM
    above, below = sympy.fraction(node)
    if below != 1:
        return f"<mfrac>{_print(above)[0]}{_print(below)[0]}</mfrac>", _PRODUCT
    factors = [_within(factor, _PRODUCT) for factor in node.as_ordered_factors()]
    factors = [factor for factor in factors if factor != _ONE] or [_ONE]  # 1.0 is no factor to be read
    return f"<mrow>{_TIMES.join(factors)}</mrow>", _PRODUCT


def _power(node: sympy.Pow) -> tuple[str, int]:
    base, exponent = node.as_base_exp() if node.exp.is_Rational and node.exp > 0 else (node.base, node.exp)
    if exponent == sympy.Rational(1, 2):
        return f"<msqrt>{_print(base)[0]}</msqrt>", _ATOM
    if exponent.is_Rational and exponent < 0:
        return f"<mfrac><mn>1</mn>{_print(base**-exponent)[0]}</mfrac>", _PRODUCT
    return f"<msup>{_within(base, _ATOM)}{_print(exponent)[0]}</msup>", _POWER


def _absolute(node: sympy.Abs) -> tuple[str, int]:
    return f"<mrow><mo>|</mo>{_print(node.args[0])[0]}<mo>|</mo></mrow>", _ATOM


def _relation(node: sympy.core.relational.Relational) -> tuple[str, int]:
    left, right = (_print(side)[0] for side in node.args)
    return f"<mrow>{left}<mo>{_RELATIONS[node.rel_op]}</mo>{right}</mrow>", _SUM


def _piecewise(node: sympy.Piecewise) -> tuple[str, int]:
    rows = []
    for value, condition in node.args:
        always = isinstance(condition, sympy.logic.boolalg.BooleanTrue)
        when = "<mtext>otherwise</mtext>" if always else f"<mtext>if </mtext>{_print(condition)[0]}"
        rows.append(f"<mtr><mtd>{_print(value)[0]}</mtd><mtd>{when}</mtd></mtr>")
    return f"<mrow><mo>{{</mo><mtable>{''.join(rows)}</mtable></mrow>", _SUM


def _call(function: str, arguments: tuple[sympy.Basic, ...]) -> str:
    inside = "<mo>,</mo>".join(_print(argument)[0] for argument in arguments)
    return f"<mrow><mi>{escape(function)}</mi><mo>&#x2061;</mo>{_OPEN}{inside}{_CLOSE}</mrow>"


def _within(node: sympy.Basic, least: int) -> str:
    """Return a part of an expression, in parentheses where it binds less tightly than what it stands in."""
    text, binds = _print(node)
    return text if binds >= least else f"<mrow><mo>(</mo>{text}<mo>)</mo></mrow>"


_PRINTERS: tuple[tuple[type, Callable[..., tuple[str, int]]], ...] = (
    (sympy.Symbol, _symbol),
    (sympy.Number, _number),
    (sympy.Add, _sum),
    (sympy.Mul, _product),
    (sympy.Abs, _absolute),
    (sympy.Piecewise, _piecewise),
    (sympy.core.relational.Relational, _relation),
    (sympy.Pow, _power),
    (type(sympy.pi), lambda node: ("<mi>π</mi>", _ATOM)),
)
