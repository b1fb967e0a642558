"""A generated module's functions as SymPy expressions of the model's names: the equations that are solved."""

from __future__ import annotations

import ast
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy

if TYPE_CHECKING:
    from collections.abc import Callable

    from symgen.runtime.system import System

_FUNCTIONS: dict[str, Callable[..., sympy.Expr]] = {
    **{
        name: getattr(sympy, name)
        for name in "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt".split()
    },
    "fabs": sympy.Abs,
    "pow": sympy.Pow,
    "copysign": lambda size, sign: sympy.Abs(size) * sympy.sign(sign),
}
_LARGEST_DENOMINATOR = 1000


def symbolic(system: System, function: str) -> dict[int, sympy.Expr]:
    """Return what `function` writes, by index; structural zeros are missing.

    The straight-line text is carried out with symbols for numbers: rates are symbols named `dot(x)`,
    or by names of their own.
    """
    coordinates = [record["name"] for record in system.coordinates]
    rates = [record["name"] for record in system.rates]
    # The angular velocity of a joint is no coordinate's derivative, and has a name of its own.
    own = set(rates) - set(coordinates)
    names = coordinates + [rate if rate in own else f"dot({rate})" for rate in rates]
    p = [*(record["name"] for record in (*system.parameters, *system.inputs)), *system.settings]
    evaluation = _Evaluation(list(map(sympy.Symbol, names)), list(map(sympy.Symbol, p)), system.source.tables)
    tree = ast.parse(system.source.functions[function])
    evaluation.carry_out(tree.body[0].body)
    return {index: value for index, value in evaluation.out.items() if value != 0}


class _Evaluation:
    """Carries out one function of the grammar in docs/abi.md."""

    def __init__(self, y: list[sympy.Symbol], p: list[sympy.Symbol], tables: dict[str, tuple[int, ...]]):
        self.arrays = {"y": y, "p": p}
        self.names: dict[str, sympy.Expr] = {"t": sympy.Symbol("t")}
        self.out: dict[int, sympy.Expr] = {}
        self.tables = tables
        self.k = 0  # of the loop over equal subsystems that is being carried out

    def carry_out(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            if isinstance(statement, ast.Assign):
                self.assign(statement)
            elif isinstance(statement, ast.For):
                for self.k in range(statement.iter.args[0].value):
                    self.carry_out(statement.body)

    def assign(self, statement: ast.Assign) -> None:
        target, value = statement.targets[0], self.value(statement.value)
        if isinstance(target, ast.Subscript):
            self.out[self.index(target.slice)] = value
        else:
            self.names[target.id] = value

    def value(self, node: ast.expr) -> sympy.Expr:
        if isinstance(node, ast.Constant):
            return _number(node.value)
        if isinstance(node, ast.Name):
            return self.names[node.id]
        if isinstance(node, ast.Subscript):
            return self.arrays[node.value.id][self.index(node.slice)]
        if isinstance(node, ast.UnaryOp):
            return -self.value(node.operand)
        if isinstance(node, ast.Call):
            return _FUNCTIONS[node.func.id](*map(self.value, node.args))
        if isinstance(node, ast.IfExp):
            return self.choice(node)
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(node.op, ast.Add):
            return left + right
        if isinstance(node.op, ast.Sub):
            return left - right
        return left * right if isinstance(node.op, ast.Mult) else left / right

    def index(self, node: ast.expr) -> int:
        """Where an array is read or written: a number, in loops also a + b*k or an element of a table."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name):
            return self.k
        if isinstance(node, ast.Subscript):
            return self.tables[node.value.id][self.k]
        left, right = self.index(node.left), self.index(node.right)
        return left + right if isinstance(node.op, ast.Add) else left * right

    def choice(self, node: ast.IfExp) -> sympy.Expr:
        test = node.test
        left, right = self.value(test.left), self.value(test.comparators[0])
        relation = left < right if isinstance(test.ops[0], ast.Lt) else left <= right
        return sympy.Piecewise((self.value(node.body), relation), (self.value(node.orelse), True))


def _number(value: float) -> sympy.Number:
    exact = Fraction(value)
    # 0.5 is meant as one half; 0.1 is printed as it stands.
    if exact.denominator <= _LARGEST_DENOMINATOR:
        return sympy.Rational(exact.numerator, exact.denominator)
    return sympy.Float(value)
