"""Model expressions as presentation MathML, which browsers and printers show without help."""

from __future__ import annotations

import re
from html import escape
from xml.dom import minidom

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

_RATE = re.compile(r"dot\((\w+)\)\Z")
_GREEK = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
).split()
_LETTERS = dict(zip(_GREEK, "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ"))
_LONG = 60  # letters of a sum that fit a line
_TAG = re.compile(r"<[^>]*>")
_ENTITIES = {"&amp;pi;": "π", "<mo>-</mo>": "<mo>−</mo>"}
_RELATIONS = {"<": "&lt;", "<=": "≤", ">": "&gt;", ">=": "≥", "==": "=", "!=": "≠"}


def to_mathml(expression: sympy.Expr) -> str:
    """Return an expression as the inside of a `math` element."""
    return _Printer().text(
        expression.xreplace({sympy.Float(1.0): sympy.S.One})
    )  # 1.0 is no factor to be read


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


def _signed_terms(node: sympy.Add) -> list[tuple[str, str]]:
    """Return the signs and the terms of a sum; the first has none where it is positive."""
    found: list[tuple[str, str]] = []
    for term in node.as_ordered_terms():
        negative = term.could_extract_minus_sign()
        sign = "<mo>−</mo>" if negative else "<mo>+</mo>" if found else ""
        found.append((sign, to_mathml(-term if negative else term)))
    return found


class _Printer(MathMLPresentationPrinter):
    """SymPy's printer, with the names that models give, numbers as short as they are, and branches."""

    def __init__(self) -> None:
        # A gap between factors, for names may have many letters.
        super().__init__({"mul_symbol": "\u2009", "root_notation": True})
        self.dom = minidom.Document()  # SymPy's own writes texts as they stand, also "<"

    def text(self, expression: sympy.Basic) -> str:
        text = self._print(expression).toxml()
        for entity, letter in _ENTITIES.items():
            text = text.replace(entity, letter)
        return text

    def _element(self, text: str) -> minidom.Element:
        return minidom.parseString(text).documentElement

    def _print_Symbol(self, symbol: sympy.Symbol, style: str = "plain") -> minidom.Element:
        return self._element(name(symbol.name))

    def _print_Float(self, number: sympy.Float) -> minidom.Element:
        return self._element(f"<mn>{float(number):.12g}</mn>")

    def _print_Function(self, call: sympy.Function) -> minidom.Element:
        inside = "<mo>,</mo>".join(map(self.text, call.args))
        function = escape(call.func.__name__)
        return self._element(f"<mrow><mi>{function}</mi><mo>(</mo>{inside}<mo>)</mo></mrow>")

    _print_exp = _print_Function  # a model may have a parameter `e`

    def _print_Relational(self, relation: sympy.core.relational.Relational) -> minidom.Element:
        left, right = map(self.text, relation.args)
        return self._element(f"<mrow>{left}<mo>{_RELATIONS[relation.rel_op]}</mo>{right}</mrow>")

    def _print_Piecewise(self, branches: sympy.Piecewise) -> minidom.Element:
        rows = []
        for value, condition in branches.args:
            when = (
                f"<mtext>if </mtext>{self.text(condition)}"
                if condition is not sympy.true
                else "<mtext>otherwise</mtext>"
            )
            rows.append(f"<mtr><mtd>{self.text(value)}</mtd><mtd>{when}</mtd></mtr>")
        return self._element(f"<mrow><mo>{{</mo><mtable>{''.join(rows)}</mtable></mrow>")
