"""A generated module's functions as SymPy expressions of the model's names: the equations that are solved."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy

from symgen.runtime.graph.carry_out import carry_out
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.names import acceleration_labels, rate_labels

if TYPE_CHECKING:
    from collections.abc import Callable

    from symgen.runtime.system import System

_FUNCTIONS: dict[str, Callable[..., sympy.Expr]] = {
    **{name: getattr(sympy, entry.sympy) for name, entry in IN_CODE.items() if entry.sympy},
    "sqrt": sympy.sqrt,
    "pow": sympy.Pow,
    "copysign": lambda size, sign: sympy.Abs(size) * sympy.sign(sign),
}
_LARGEST_DENOMINATOR = 1000


def symbolic(system: System, function: str) -> dict[int, sympy.Expr]:
    """Return what `function` writes, by index; structural zeros are missing.

    The form is carried out with symbols for numbers: rates are symbols named `dot(x)`,
    or by names of their own.
    """
    coordinates = [record["name"] for record in system.coordinates]
    names = coordinates + rate_labels(system.coordinates, system.rates)
    p = [*(record["name"] for record in (*system.parameters, *system.inputs)), *system.settings]
    symbols_y, symbols_p = list(map(sympy.Symbol, names)), list(map(sympy.Symbol, p))
    written = carry_out(
        system.form(function), _Symbols(), symbols_y.__getitem__, symbols_p.__getitem__, const=_number
    )
    return {index: value for index, value in written if value != 0}


def rates_of_coordinates(system: System) -> list[sympy.Expr]:
    """Return dq/dt: N(q) v where there are quaternions, otherwise the rates themselves."""
    v = list(map(sympy.Symbol, rate_labels(system.coordinates, system.rates)))
    if system.nq == system.nv:
        return v
    written = symbolic(system, "kinematics")
    return [
        sum((written.get(i * system.nv + j, 0) * rate for j, rate in enumerate(v)), sympy.S.Zero)
        for i in range(system.nq)
    ]


def accelerations_if_diagonal(system: System) -> list[sympy.Expr] | None:
    """Return dv/dt = f/M where M is diagonal and nothing is constrained."""
    mass = symbolic(system, "mass_matrix")
    if system.m or any(index % (system.nv + 1) for index in mass):
        return None
    forces = symbolic(system, "forces")
    return [forces.get(i, sympy.S.Zero) / mass[i * (system.nv + 1)] for i in range(system.nv)]


@dataclass(frozen=True)
class Element:
    """A term of an equation: an element of M, f, G or gamma by names, times an unknown if there is one."""

    matrix: str
    names: tuple[str, ...]
    times: str = ""


def equations_by_elements(system: System) -> list[tuple[list[Element], list[Element]]]:
    """Return M v' = f + Gᵀ λ and G v' = γ row by row: both sides, without structural zeros."""
    nv, rates = system.nv, [record["name"] for record in system.rates]
    accelerations = acceleration_labels(system.coordinates, system.rates)
    constraints = [record["name"] for record in system.constraints]
    mass, forces = symbolic(system, "mass_matrix"), symbolic(system, "forces")
    held = system.m > 0
    jacobian = symbolic(system, "constraint_jacobian") if held else {}
    gamma = symbolic(system, "gamma") if held else {}
    rows = []
    for i, name in enumerate(rates):
        left = [Element("M", (name, rates[j]), accelerations[j]) for j in range(nv) if i * nv + j in mass]
        right = [Element("f", (name,))] * (i in forces)
        pulls = [k for k in range(system.m) if k * nv + i in jacobian]
        right += [Element("G", (constraints[k], name), f"lambda({constraints[k]})") for k in pulls]
        rows.append((left, right))
    for k, name in enumerate(constraints):
        left = [Element("G", (name, rates[j]), accelerations[j]) for j in range(nv) if k * nv + j in jacobian]
        rows.append((left, [Element("gamma", (name,))] * (k in gamma)))
    return rows


class _Symbols:
    """The operations of a form, on expressions."""

    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    div = staticmethod(operator.truediv)

    @staticmethod
    def time() -> sympy.Expr:
        return sympy.Symbol("t")

    @staticmethod
    def call(name: str, *args: sympy.Expr) -> sympy.Expr:
        return _FUNCTIONS[name](*args)

    @staticmethod
    def select(
        is_strict: bool, a: sympy.Expr, b: sympy.Expr, then: sympy.Expr, otherwise: sympy.Expr
    ) -> sympy.Expr:
        return sympy.Piecewise((then, a < b if is_strict else a <= b), (otherwise, True))


def _number(value: float) -> sympy.Number:
    exact = Fraction(value)
    # 0.5 is meant as one half; 0.1 is printed as it stands.
    if exact.denominator <= _LARGEST_DENOMINATOR:
        return sympy.Rational(exact.numerator, exact.denominator)
    return sympy.Float(value)
