"""The equations of motion and the state-space form of a report, in MathML.

Model expressions as presentation MathML, which browsers and printers show without help.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from itertools import zip_longest
from typing import TYPE_CHECKING
from xml.dom import minidom

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

from symgen.cli.formula_lines import lines
from symgen.equations import (
    Choices,
    Element,
    accelerations_if_diagonal,
    equations_by_elements,
    rates_of_coordinates,
    shortened,
    symbolic,
)
from symgen.model.from_sympy import as_piecewise
from symgen.runtime.names import acceleration_labels, rate_labels
from symgen.runtime.report.html import Markup
from symgen.runtime.report.page import Equations

if TYPE_CHECKING:
    from symgen.runtime.system import System


_RATE = re.compile(r"dot\((\w+)\)\Z")
_ACCELERATED = re.compile(r"dot\(dot\((\w+)\)\)\Z")
_MULTIPLIER = re.compile(r"lambda\((\w+)\)\Z")
_GREEK = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
).split()
_LETTERS = dict(zip(_GREEK, "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ"))
_TIMES = "<mo>\u2009</mo>"
_TAG = re.compile(r"<[^>]*>")
_ENTITIES = {"&amp;pi;": "π", "<mo>-</mo>": "<mo>−</mo>"}
_RELATIONS = {"<": "&lt;", "<=": "≤", ">": "&gt;", ">=": "≥", "==": "=", "!=": "≠"}


def to_mathml(expression: sympy.Expr) -> str:
    """Return an expression as the inside of a `math` element."""
    return _Printer().text(_plain(expression))


def name(text: str) -> str:
    """Return a name as MathML: the part behind the first underscore as an index, `dot(x)` with a dot above."""
    rate, accelerated = _RATE.match(text), _ACCELERATED.match(text)
    if rate:
        return dotted(name(rate.group(1)))
    if accelerated:
        return dotted(name(accelerated.group(1)), "¨")
    use, of, own = text.rpartition(".")
    if of:  # of an assembly
        return f"<mrow>{name(use)}<mo>.</mo>{name(own)}</mrow>"
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
    # An index of an index is too small to be read.
    inside = "<mo>,</mo>".join(f"<mi>{escape(x)}</mi>" if "_" in x else name(x) for x in indices)
    return f"<msub><mi>{matrix}</mi><mrow>{inside}</mrow></msub>"


def equation(left: str, right: str) -> str:
    """Return two sides as an element of its own line."""
    return f'<div class="wide"><math display="block">{left}<mo>=</mo>{right}</math></div>'


def equation_of(left: str, right: sympy.Expr) -> str:
    """Return an equation for an expression; a long one is broken over lines, a sum at least at each of its terms."""
    rows = lines(_plain(right), MATHML)
    if len(rows) == len(rows[0]) == 1:
        return equation(left, rows[0][0])
    rows[0].insert(0, f"{left}<mo>=</mo>")
    shown = "".join(f"<div>{' '.join(map(_inline, row))}</div>" for row in rows)
    return f'<div class="formula">{shown}</div>'


def _plain(expression: sympy.Expr) -> sympy.Expr:
    return expression.xreplace({sympy.Float(1.0): sympy.S.One})  # 1.0 is no factor to be read


def _wrapped(text: str) -> str:
    return f"<mrow>{text}</mrow>"


def _inline(piece: str) -> str:
    return f'<math displaystyle="true">{_wrapped(piece)}</math>'


class _MathML:
    """The notation of MathML."""

    plus, minus, times, stroke = "<mo>+</mo>", "<mo>−</mo>", _TIMES, "<mo>/</mo>"
    opening, closing = "<mo>(</mo>", "<mo>)</mo>"

    def text(self, expression: sympy.Basic) -> str:
        return to_mathml(expression)

    def letters(self, text: str) -> int:
        """How many letters a formula has, of a fraction those of both parts."""
        return len(_TAG.sub("", text))

    def power(self, base: str, exponent: sympy.Expr) -> str:
        return f"<msup><mrow>{base}</mrow>{_wrapped(to_mathml(exponent))}</msup>"

    def function(self, name: str) -> str:
        return f"<mi>{escape(name)}</mi>"


MATHML = _MathML()


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

    def _print_where(self, choice: sympy.Function) -> minidom.Element:
        return self._print(as_piecewise(choice))

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


_MOST_OPERATIONS = 400  # longer equations are not read by people
_MOST_STATES = 24  # and multipliers
_ACCELERATION, _LAMBDA = "<mi>a</mi>", "<mi>λ</mi>"


def report_equations(system: System) -> Equations:
    """Return the equations of a model as a report shows them; of long ones their form alone, with a note."""
    functions = ("mass_matrix", "forces", "constraint_jacobian", "gamma")
    operations = sum(system.operations.get(function, 0) for function in functions)
    if operations > _MOST_OPERATIONS:
        note = f"{operations} operations: too long to be read; `symgen derive` writes them to a file."
        return Equations([*map(Markup, _form(system))], [*map(Markup, _general(system))], note)
    choices = Choices(system)
    found = {f: shortened(symbolic(system, f, choices)) for f in functions if system.has(f)}
    first_order = [*_first_order(system, choices)]
    chosen = (equation_of(name(symbol.name), value) for symbol, value in choices.named)
    motion = [*_form(system), *_entries(system, found), *chosen]
    return Equations([*map(Markup, motion)], [*map(Markup, first_order)])


def _form(system: System) -> Iterator[str]:
    pull = f"<mo>+</mo><msup><mi>G</mi><mi>T</mi></msup>{_LAMBDA}" if system.m else ""
    yield equation(f"<mi>M</mi>{_ACCELERATION}", f"<mi>f</mi>{pull}")
    if system.m:
        yield equation(f"<mi>G</mi>{_ACCELERATION}", "<mi>γ</mi>")


def _entries(system: System, found: dict[str, dict[int, sympy.Expr]]) -> Iterator[str]:
    """Yield the elements that are not zero, of the symmetric M those on and above its diagonal."""
    rates = [record["name"] for record in system.rates]
    constraints = [record["name"] for record in system.constraints]
    for index, value in sorted(found["mass_matrix"].items()):
        i, j = divmod(index, system.nv)
        if j >= i:
            yield equation_of(entry("M", rates[i], rates[j]), value)
    for i, value in sorted(found["forces"].items()):
        yield equation_of(entry("f", rates[i]), value)
    for index, value in sorted(found.get("constraint_jacobian", {}).items()):
        i, j = divmod(index, system.nv)
        yield equation_of(entry("G", constraints[i], rates[j]), value)
    for i, value in sorted(found.get("gamma", {}).items()):
        yield equation_of(entry("γ", constraints[i]), value)


def _general(system: System) -> Iterator[str]:
    """Yield x' = F(t, x) of x = (q, v), in matrices."""
    plain = system.nq == system.nv
    yield equation("<mi>x</mi>", "<mrow><mo>(</mo><mi>q</mi><mo>,</mo><mi>v</mi><mo>)</mo></mrow>")
    turned = "<mi>v</mi>" if plain else "<mi>S</mi><mo>(</mo><mi>q</mi><mo>)</mo><mi>v</mi>"
    yield equation(dotted("<mi>q</mi>"), f"<mrow>{turned}</mrow>")
    if not system.m:
        inverse = "<msup><mi>M</mi><mrow><mo>−</mo><mn>1</mn></mrow></msup>"
        yield equation(dotted("<mi>v</mi>"), f"<mrow>{inverse}<mi>f</mi></mrow>")
        return
    transposed = "<mrow><mo>−</mo><msup><mi>G</mi><mi>T</mi></msup></mrow>"
    unknown = _column(dotted("<mi>v</mi>"), "<mi>λ</mi>")
    known = _column("<mi>f</mi>", "<mi>γ</mi>")
    matrix = _rows(("<mi>M</mi>", transposed), ("<mi>G</mi>", "<mn>0</mn>"))
    yield equation(f"<mrow>{matrix}{unknown}</mrow>", known)


def _first_order(system: System, choices: Choices) -> Iterator[str]:
    """Yield x, and x' state by state; where M is to be solved with, equation by equation, by the names of elements."""
    if system.nq + system.nv + system.m > _MOST_STATES:
        yield from _general(system)
        return
    coordinates = [record["name"] for record in system.coordinates]
    rates = rate_labels(system.coordinates, system.rates)
    shown = [x for i, x in enumerate(coordinates) if i not in system.integrals]
    states = "<mo>,</mo>".join(name(x) for x in (*shown, *rates))
    yield equation("<mi>x</mi>", f"<mrow><mo>(</mo>{states}<mo>)</mo></mrow>")
    for coordinate, rate, value in zip_longest(coordinates, rates, rates_of_coordinates(system)):
        if coordinate in shown and (rate != f"dot({coordinate})" or value.name != rate):
            yield equation_of(dotted(name(coordinate)), value)
    accelerations = acceleration_labels(system.coordinates, system.rates)
    solved = accelerations_if_diagonal(system, choices)
    if solved is not None:
        for label, value in zip(accelerations, solved):
            yield equation_of(name(label), value)
        return
    for sides in equations_by_elements(system):
        yield equation(*("<mo>+</mo>".join(map(_term, side)) or "<mn>0</mn>" for side in sides))


def _term(element: Element) -> str:
    factor = entry(_LETTERS.get(element.matrix, element.matrix), *element.names)
    multiplier = _MULTIPLIER.match(element.times)
    if multiplier:
        return f"{factor}<mo>\u2009</mo>{entry('λ', multiplier.group(1))}"
    return f"{factor}<mo>\u2009</mo>{name(element.times)}" if element.times else factor


def _rows(*rows: tuple[str, ...]) -> str:
    inside = "".join(f"<mtr>{''.join(f'<mtd>{x}</mtd>' for x in row)}</mtr>" for row in rows)
    return f"<mrow><mo>[</mo><mtable>{inside}</mtable><mo>]</mo></mrow>"


def _column(*entries: str) -> str:
    return _rows(*((x,) for x in entries))
