"""Derivatives of model expressions by one name, tables included: what a surface that is given by its height needs."""

from __future__ import annotations

import sympy

from ..errors import ModelError
from . import algebra
from .from_sympy import taken_over, to_sympy
from .functions import SLOPE, VALUE, Tabulated, tabulated
from .printing import shortened
from .unevaluated import product, total


def slope(expression: algebra.Expr, name: algebra.Symbol) -> algebra.Expr:
    """The partial derivative of an expression by a name.

    Raises
    ------
    ModelError
        A function in it has a kink, or no derivative that is known here.
    """
    tables = sorted((x for x in expression.atoms(Tabulated) if name in x.free_symbols), key=algebra.sort_key)
    stand_ins = {x: algebra.Symbol(f"table {k}") for k, x in enumerate(tables)}
    plain = expression.xreplace(stand_ins)
    terms = [_derivative(plain, name)]
    for table, stand_in in stand_ins.items():
        outer = _derivative(plain, stand_in)
        for axis, argument in enumerate(table.args):
            terms.append(product([outer, _of_table(table, axis), slope(argument, name)]))
    if None in terms:
        message = f"how '{shortened(expression)}' changes with '{name}' is not known"
        raise ModelError(message, hint="a surface is smooth: write it without min, max, abs, where and steps")
    return total(terms).xreplace({stand_in: x for x, stand_in in stand_ins.items()})


def _derivative(expression: algebra.Expr, name: algebra.Symbol) -> algebra.Expr | None:
    """The derivative by SymPy; None where it has none."""
    found = sympy.diff(to_sympy(expression), sympy.Symbol(name.name))
    return None if found.has(sympy.Derivative, sympy.Subs, sympy.DiracDelta) else taken_over(found)


def _of_table(table: Tabulated, axis: int) -> algebra.Expr:
    """The derivative of a table, or of a derivative of one, by an argument."""
    function = table.func
    before = function.role.removeprefix(SLOPE) if function.role.startswith(SLOPE) else ""
    if function.role != VALUE and not function.role.startswith(SLOPE):
        raise ModelError(f"the slope of '{shortened(table)}' is not known")
    axes = "".join(sorted(f"{before}{axis}"))
    return tabulated(function.table, SLOPE + axes, len(table.args))(*table.args)
