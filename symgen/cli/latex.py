"""Model expressions as LaTeX."""

from __future__ import annotations

import re

import sympy
from sympy.printing.latex import LatexPrinter, translate

_RATE = re.compile(r"dot\((\w+)\)\Z")


class _Printer(LatexPrinter):
    """Prints rates with a dot above, also where they are symbols named `dot(x)`."""

    def _print_Symbol(self, symbol: sympy.Symbol, **options) -> str:
        rate = _RATE.match(symbol.name)
        if rate:
            return rf"\dot{{{self._print(sympy.Symbol(rate.group(1)))}}}"
        name, underscore, index = symbol.name.partition("_")
        if underscore:
            return rf"{translate(name)}_{{\mathrm{{{index}}}}}".replace("_{\\mathrm{}}", "")
        return super()._print_Symbol(symbol, **options)

    def _print_dot(self, rate: sympy.Function, exp: str | None = None) -> str:
        inside = rate.args[0]
        if isinstance(inside, sympy.Symbol):
            return _raised(rf"\dot{{{self._print(inside)}}}", exp)
        text = rf"\frac{{d}}{{dt}}\left({self._print(inside)}\right)"
        return _raised(rf"\left({text}\right)" if exp else text, exp)

    def _print_minimum(self, function: sympy.Function, exp: str | None = None) -> str:
        return _raised(rf"\min\left({', '.join(map(self._print, function.args))}\right)", exp)

    def _print_maximum(self, function: sympy.Function, exp: str | None = None) -> str:
        return _raised(rf"\max\left({', '.join(map(self._print, function.args))}\right)", exp)


def _raised(text: str, exp: str | None) -> str:
    return f"{text}^{{{exp}}}" if exp else text


def to_latex(expression: sympy.Expr) -> str:
    """Return an expression as LaTeX, between dollar signs."""
    return f"${_Printer({'mul_symbol': None}).doprint(expression)}$"
