"""Model expressions and equations as LaTeX, and a document of them that compiles by itself."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence

import sympy
from sympy.printing.latex import LatexPrinter, translate

from symgen.cli.formula_lines import lines
from symgen.model.from_sympy import as_piecewise

_DOTTED = re.compile(r"dot\((.+)\)\Z")
_MULTIPLIER = re.compile(r"lambda\((.+)\)\Z")
_DIGITS = re.compile(r"(.*?)(\d+)\Z")
_MATHS = re.compile(r"(\$[^$]*\$)")
_COMMAND = re.compile(r"\\[a-zA-Z]+|[{}^_$\\]")
_SPECIAL = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "°": r"\textdegree{}",
    "·": r"$\cdot$", "×": r"$\times$", "−": "$-$", "…": r"\dots{}", "µ": r"$\mu$", "≤": r"$\le$", "≥": r"$\ge$",
    "→": r"$\to$", "∞": r"$\infty$", "<": r"$<$", ">": r"$>$", "|": r"\textbar{}", "²": "$^2$", "³": "$^3$",
    **{c: rf"\{c}" for c in "&%$#_{}"},
}  # fmt: skip
_PRODUCTS = {"v.v": r"v^{T} v", "gravity.r": r"g^{T} r"}
_GREEK = re.compile(r"GREEK (SMALL|CAPITAL) LETTER (\w+)\Z")
_SHORT, _BROAD = 24, 200  # letters of a cell, and of the last in a row, that columns have room for
_LAST_OF_FONT = 0x17F  # Latin letters with accents, which the font encoding T1 has nearly all of
_HEAD = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{amsmath,array,longtable}
\usepackage[margin=2cm]{geometry}
\setlength{\parindent}{0pt}
\renewcommand{\arraystretch}{1.3}
\allowdisplaybreaks
\newcommand{\formula}[1]{{\raggedright\hangindent=2em\hangafter=1 #1\par}\smallskip}
\begin{document}
"""


class Printer(LatexPrinter):
    """Prints names as a person writes them, and rates with a dot above, also where they are symbols `dot(x)`."""

    def __init__(self) -> None:
        super().__init__({"mul_symbol": None})

    def _print_Symbol(self, symbol: sympy.Symbol, **options) -> str:
        return name(symbol.name)

    def _print_Float(self, number: sympy.Float) -> str:
        mantissa, _, exponent = f"{float(number):.10g}".partition("e")
        return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa

    def _print_dot(self, rate: sympy.Function, exp: str | None = None) -> str:
        inside = rate.args[0]
        if isinstance(inside, sympy.Symbol):
            return _raised(rf"\dot{{{self._print(inside)}}}", exp)
        text = rf"\frac{{d}}{{dt}}\left({self._print(inside)}\right)"
        return _raised(rf"\left({text}\right)" if exp else text, exp)

    def _print_where(self, choice: sympy.Function, exp: str | None = None) -> str:
        text = self._print(as_piecewise(choice))
        return _raised(rf"\left({text}\right)" if exp else text, exp)

    def _print_heaviside(self, function: sympy.Function, exp: str | None = None) -> str:
        return self._print_Heaviside(sympy.Heaviside(function.args[0], evaluate=False), exp)

    def _print_minimum(self, function: sympy.Function, exp: str | None = None) -> str:
        return _raised(rf"\min\left({', '.join(map(self._print, function.args))}\right)", exp)

    def _print_maximum(self, function: sympy.Function, exp: str | None = None) -> str:
        return _raised(rf"\max\left({', '.join(map(self._print, function.args))}\right)", exp)


def _raised(text: str, exp: str | None) -> str:
    return f"{text}^{{{exp}}}" if exp else text


def name(text: str) -> str:
    """Return a name in mathematics: Greek letters, words upright, digits and what follows an underscore as index."""
    dotted, multiplier = _DOTTED.match(text), _MULTIPLIER.match(text)
    if dotted:
        twice = _DOTTED.match(dotted.group(1))
        return rf"\ddot{{{name(twice.group(1))}}}" if twice else rf"\dot{{{name(dotted.group(1))}}}"
    if multiplier:
        return rf"\lambda_{{\mathrm{{{_plain(multiplier.group(1))}}}}}"
    if text in _PRODUCTS:
        return _PRODUCTS[text]
    use, of, own = text.rpartition(".")
    if of:  # of an assembly
        return f"{name(use)}.{name(own)}"
    stem, _, index = text.partition("_")
    if not stem:
        return rf"\mathrm{{{_plain(text)}}}"
    numbered = _DIGITS.match(stem)
    if numbered and numbered.group(1):
        stem, index = numbered.group(1), ",".join(x for x in (numbered.group(2), index) if x)
    return _letters(stem) + (f"_{{{_index(index)}}}" if index else "")


def _index(text: str) -> str:
    return text if text.isdigit() else _letters(text) if text.isalpha() else rf"\mathrm{{{_plain(text)}}}"


def _letters(word: str) -> str:
    found = translate(word)
    if found.startswith("\\") or len(word) == 1:
        return found
    return rf"\mathrm{{{_plain(word)}}}"


def _plain(text: str) -> str:
    return text.replace("_", r"\_")


class _Latex:
    """The notation of LaTeX."""

    plus, minus, times, stroke, opening, closing = "+ ", "- ", r"\, ", "/ ", "(", ")"

    def text(self, expression: sympy.Basic) -> str:
        return Printer().doprint(expression)

    def letters(self, text: str) -> int:
        return len(_COMMAND.sub("", text).replace(" ", ""))

    def power(self, base: str, exponent: sympy.Expr) -> str:
        return f"{base}^{{{self.text(exponent)}}}"

    def function(self, name: str) -> str:
        return rf"\operatorname{{{name}}}"


def to_latex(expression: sympy.Expr) -> str:
    """Return an expression as LaTeX, between dollar signs; a long one in several pieces, between which lines break."""
    plain = expression.xreplace({sympy.Float(1.0): sympy.S.One})  # 1.0 is no factor to be read
    found = [piece for line in lines(plain, _Latex()) for piece in line]
    return " ".join(rf"$\displaystyle {piece}$" for piece in found)


def entry(matrix: str, *names: str) -> str:
    """Return an element of a matrix by the names of its row and column."""
    letter = {"gamma": r"\gamma"}.get(matrix, matrix)
    return f"{letter}_{{{', '.join(map(name, names))}}}"


def escaped(text: str) -> str:
    """Return text as LaTeX prints it; what stands between dollar signs is LaTeX already."""
    parts = _MATHS.split(text)
    return "".join(part if i % 2 else "".join(map(_letter, part)) for i, part in enumerate(parts))


def _letter(c: str) -> str:
    if c in _SPECIAL:
        return _SPECIAL[c]
    greek = _GREEK.match(unicodedata.name(c, ""))
    if greek:
        word = greek.group(2).lower()
        return f"${translate(word.capitalize() if greek.group(1) == 'CAPITAL' else word)}$"
    return c if ord(c) <= _LAST_OF_FONT else f"[U+{ord(c):04X}]"


def formula(left: str, right: str) -> str:
    """Return an equation as a paragraph whose lines break between the pieces of its right side."""
    return rf"\formula{{{left} $=$ {right}}}"


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of cells: in columns of which the last is the widest, as paragraphs where that is too narrow."""
    n = max(map(len, rows))
    cells = [[*map(escaped, row), *[""] * (n - len(row))] for row in rows]
    letters = [[len(_COMMAND.sub("", cell)) for cell in row] for row in cells]
    if any(max(row[:-1], default=0) > _SHORT or row[-1] > _BROAD for row in letters):
        between = r" \quad "
        return "\n".join(rf"\formula{{{between.join(filter(None, row))}}}" for row in cells)
    body = "\n".join(" & ".join(row) + r" \\" for row in cells)
    columns = "l" * (n - 1) + rf">{{\raggedright\arraybackslash}}p{{{0.95 - 0.15 * (n - 1):.2f}\textwidth}}"
    return f"\\begin{{longtable}}[l]{{@{{}}{columns}@{{}}}}\n{body}\n\\end{{longtable}}"


def document(title: str, text: str, sections: Iterable[tuple[str, str]]) -> str:
    """Return a document: its title, a text, and sections by title and body."""
    parts = [f"\\section*{{{escaped(title)}}}\n{escaped(text)}\n"]
    parts += [f"\\subsection*{{{escaped(head)}}}\n{body}\n" if head else body for head, body in sections]
    return _HEAD + "\n".join(parts) + "\\end{document}"
