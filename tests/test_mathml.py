"""Equations in MathML: read back as they are printed, they have the values of the expressions."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import pytest
import sympy

from symgen.cli.formula_lines import pieces
from symgen.cli.report_equations import MATHML, equation_of, name, to_mathml


def read_back(element: ET.Element) -> str:
    """MathML as Python text, as a reader would take it: only parentheses that are printed bind."""
    inside = [read_back(child) for child in element]
    if element.tag == "mfrac":
        return f"(({inside[0]})/({inside[1]}))"
    if element.tag == "msup":
        return f"{inside[0]}**({inside[1]})"
    if element.tag == "msqrt":
        return f"(({''.join(inside)})**0.5)"
    if element.tag == "mover":
        return f"{inside[0]}dot"
    if element.tag == "msub":
        return "_".join(inside)
    if element.tag == "mrow":
        return "".join(inside)
    return {"\u2009": "*", "θ": "theta", "−": "-"}.get(element.text, element.text)


@pytest.mark.parametrize(
    "text",
    [
        "-m*(a - b)/2 + c_1**2", "a*(b + c_1)*(-b)**3", "(a/b)**2*sin(theta)**2", "-(a - b) - (b - c_1)*thetadot",
        "sqrt(a + b)/(a*b)**1.5", "a**(b - 2)*exp(-a*b)", "1/(a*(1 + b)) - 2.5e-07*a", "(a**2)**b/3", "-a**2*(-2)**3*b",
    ],
)  # fmt: skip
def test_mathml_says_what_the_expression_says(text):
    values = {"m": 1.3, "a": 0.7, "b": 0.4, "c_1": -1.9, "theta": 0.6, "thetadot": -0.8}
    symbols = {name: sympy.Symbol("dot(theta)" if name == "thetadot" else name) for name in values}
    expression = sympy.parse_expr(text, local_dict=symbols)
    tree = ET.fromstring(f"<mrow>{to_mathml(expression)}</mrow>")
    seen = eval(read_back(tree), {"__builtins__": {}, "sin": math.sin, "exp": math.exp, **values})
    expected = expression.subs({symbols[name]: value for name, value in values.items()})
    assert seen == pytest.approx(float(expected), rel=1e-12)


def test_branches_show_their_conditions():
    x = sympy.Symbol("x")
    text = to_mathml(sympy.Piecewise((-x, x < 0), (x**2, True)))
    rows = [["".join(cell.itertext()) for cell in row] for row in ET.fromstring(text).iter("mtr")]
    assert rows == [["−x", "if x<0"], ["x2", "otherwise"]]


def test_names_are_escaped():
    assert name("<b>_&") == "<msub><mi>&lt;b&gt;</mi><mi>&amp;</mi></msub>"
    assert name("_") == "<mi>_</mi>"


def terms(pattern: str, sign: str = "+") -> str:
    return f"({sign.join(pattern.format(k) for k in range(1, 15))})"


LONG = {
    "sum in a product": terms("a*sin(theta)**{}*c_1") + "*b*cos(theta)",
    "quotient": "m*" + terms("a**{}*b") + "/(a*" + terms("b**{}*m") + ")",
    "power": "-b*" + terms("a**{}*m*b", "-") + "**2*" + terms("m**{}*a"),
    "argument": "sin" + terms("a**{}*m*b*theta") + " - a*m*(-2)*b",
}


@pytest.mark.parametrize("text", LONG.values(), ids=LONG)
def test_a_formula_in_pieces_says_what_the_expression_says(text):
    values = {"m": 1.3, "a": 0.7, "b": 0.4, "c_1": -1.9, "theta": 0.6}
    expression = sympy.sympify(text, locals={n: sympy.Symbol(n) for n in values})
    found = pieces(expression, MATHML)
    assert len(found) > 2
    assert max(len("".join(ET.fromstring(f"<math>{piece}</math>").itertext())) for piece in found) < 90
    shown = read_back(ET.fromstring(f"<mrow>{''.join(found)}</mrow>"))
    assert eval(shown, {**values, "sin": math.sin, "cos": math.cos}) == pytest.approx(
        float(expression.subs(values))
    )


def test_long_equations_are_rows_that_text_flow_breaks():
    expression = sympy.sympify(LONG["sum in a product"], locals={"c_1": sympy.Symbol("c_1")})
    html = ET.fromstring(equation_of("<mi>f</mi>", expression))
    assert html.get("class") == "formula" and len(html.findall(".//math")) > 2
    assert "wide" in equation_of("<mi>f</mi>", sympy.Symbol("a"))
