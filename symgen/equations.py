"""A generated module's functions as SymPy expressions of the model's names: the equations that are solved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import count
from typing import TYPE_CHECKING

import sympy
from sympy.simplify.fu import TR8

from symgen.model.time_limit import within
from symgen.runtime.graph.carry_out import carry_out
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.names import acceleration_labels, rate_labels

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from symgen.runtime.system import System

_FUNCTIONS: dict[str, Callable[..., sympy.Expr]] = {
    **{name: getattr(sympy, entry.sympy) for name, entry in IN_CODE.items() if entry.sympy},
    "sqrt": sympy.sqrt,
    "pow": sympy.Pow,
    "copysign": lambda size, sign: sympy.Abs(size) * sympy.sign(sign),
}
_LARGEST_DENOMINATOR = 1000
_LARGEST_CHOICE = 30  # operations


@dataclass(frozen=True)
class Equations:
    """The equations of motion M v' = f + Gᵀ λ, G v' = γ, Φ = 0, in SymPy.

    Symbols are called as the model calls things; rates `dot(x)`, or by names of their own (angular velocities).
    `sense(belt)` is 1 where the friction `belt` slides forwards, -1 backwards.

    Attributes
    ----------
    t : sympy.Symbol
    q, v, multipliers : sympy.ImmutableMatrix, shapes (nq, 1), (nv, 1), (m, 1)
        Symbols: coordinates, rates, and the forces λ of constraints (`lambda(pin)`).
    M, f : sympy.ImmutableMatrix, shapes (nv, nv), (nv, 1)
        Mass matrix and forces: applied ones, those of V, and what the bodies' rates make.
    qdot : sympy.ImmutableMatrix, shape (nq, 1)
        dq/dt: the rates, and of quaternions what the angular velocity makes.
    Phi, Phi_dot : sympy.ImmutableMatrix, shapes (nh, 1), (m, 1)
        What constraints hold at zero: of positions; of rates, Φ' and velocity constraints.
    G, gamma : sympy.ImmutableMatrix, shapes (m, nv), (m, 1)
    T, V : sympy.Expr
        Kinetic and potential energy [J].
    values : dict of sympy.Symbol to float
        Parameters and inputs, with the model's values in SI.
    shared : tuple of (sympy.Symbol, sympy.Expr)
        Names of shared subexpressions, each made of those before it; empty where they are substituted.
    choices : tuple of (sympy.Symbol, sympy.Expr)
        Names of choices (`where`, curves) too large to stand in place, each made of those before it.
    notes : tuple of str
        What was left undone.
    """

    t: sympy.Symbol
    q: sympy.ImmutableMatrix
    v: sympy.ImmutableMatrix
    multipliers: sympy.ImmutableMatrix
    M: sympy.ImmutableMatrix
    f: sympy.ImmutableMatrix
    qdot: sympy.ImmutableMatrix
    Phi: sympy.ImmutableMatrix
    Phi_dot: sympy.ImmutableMatrix
    G: sympy.ImmutableMatrix
    gamma: sympy.ImmutableMatrix
    T: sympy.Expr
    V: sympy.Expr
    values: dict[sympy.Symbol, float]
    shared: tuple[tuple[sympy.Symbol, sympy.Expr], ...] = ()
    choices: tuple[tuple[sympy.Symbol, sympy.Expr], ...] = ()
    notes: tuple[str, ...] = ()

    def substituted(self) -> Equations:
        """Return the same without names of shared subexpressions."""
        known: dict[sympy.Expr, sympy.Expr] = {}
        for name, value in self.shared:
            known[name] = value.xreplace(known)
        return replace(self._of([x.xreplace(known) for x in self._entries()]), shared=())

    def named(self) -> Equations:
        """Return the same with names for subexpressions that stand in several places, `x0`, `x1`, …"""
        entries = self.substituted()._entries()
        known = (*self.q, *self.v, *self.values, *(x for x, _ in self.choices))
        taken = {x.name for entry in (*entries, *known) for x in entry.free_symbols}
        names = (sympy.Symbol(f"x{k}") for k in count() if f"x{k}" not in taken)
        shared, left = sympy.cse(entries, symbols=names)
        return replace(self._of(left), shared=tuple(shared))

    def simplified(self, time_limit: float = 10.0) -> Equations:
        """Return the same with each element as short as `sympy.simplify` makes it.

        Parameters
        ----------
        time_limit : float [s]
            For all of them, the short ones first; `notes` says how many are left as they were.
        """
        entries = self.substituted()._entries()
        open_ones = list(dict.fromkeys(x for x in entries if not x.is_Atom))
        found = dict(zip(open_ones, within(time_limit, sympy.simplify, open_ones)))
        left = sum(x is None for x in found.values())
        plain = {x: y.xreplace({sympy.Float(1.0): sympy.S.One}) for x, y in found.items() if y is not None}
        shorter = {x: y for x, y in plain.items() if y.count_ops() < x.count_ops()}
        said = f"{left} of {len(open_ones)} expressions are not simplified: {time_limit:g} s were over"
        notes = (*self.notes, said) if left else self.notes
        return replace(self._of([shorter.get(x, x) for x in entries]), shared=(), notes=notes)

    def of_time(self) -> Equations:
        """Return the same with functions of time for coordinates, their derivatives for rates: `dynamicsymbols`."""
        functions = {x: sympy.Function(x.name)(self.t) for x in self.q}
        plain = {f"dot({x.name})": y.diff(self.t) for x, y in functions.items()}
        rates = {x: plain.get(x.name) or sympy.Function(x.name)(self.t) for x in self.v}
        names = {x: sympy.Function(x.name)(self.t) for x in self.multipliers}
        known = functions | rates | names
        moved = self._of([x.xreplace(known) for x in self._entries()])
        sides = {key: getattr(self, key).xreplace(known) for key in ("q", "v", "multipliers")}
        named = {
            key: tuple((x, y.xreplace(known)) for x, y in getattr(self, key)) for key in ("shared", "choices")
        }
        return replace(moved, **named, **sides)

    def _entries(self) -> list[sympy.Expr]:
        return [x for name in _MATRICES for x in getattr(self, name)] + [self.T, self.V]

    def _of(self, entries: Sequence[sympy.Expr]) -> Equations:
        rest, made = list(entries), {}
        for name in _MATRICES:
            shape = getattr(self, name).shape
            size = shape[0] * shape[1]
            made[name], rest = sympy.ImmutableMatrix(*shape, rest[:size]), rest[size:]
        return replace(self, **made, T=rest[0], V=rest[1])


_MATRICES = ("M", "f", "qdot", "Phi", "Phi_dot", "G", "gamma")


def equations_of(system: System) -> Equations:
    """Return the equations of motion of what was derived; those of a model: `Model.equations`.

    Parameters
    ----------
    system : symgen.runtime.System
    """
    nv, m, nh = system.nv, system.m, system.nh
    choices = Choices(system)

    def matrix(function: str, rows: int, columns: int = 1, first: int = 0) -> sympy.ImmutableMatrix:
        written = symbolic(system, function, choices) if rows * columns and system.has(function) else {}
        return sympy.ImmutableMatrix(rows, columns, lambda i, j: written.get(first + i * columns + j, 0))

    def symbols(names: Iterable[str]) -> sympy.ImmutableMatrix:
        found = list(map(sympy.Symbol, names))
        return sympy.ImmutableMatrix(len(found), 1, found)

    energy = matrix("energy", 2)
    known = zip((*system.parameters, *system.inputs), system.parameter_values())
    return Equations(
        t=sympy.Symbol("t"),
        q=symbols(c["name"] for c in system.coordinates),
        v=symbols(rate_labels(system.coordinates, system.rates)),
        multipliers=symbols(f"lambda({c['name']})" for c in system.constraints),
        M=matrix("mass_matrix", nv, nv),
        f=matrix("forces", nv),
        qdot=sympy.ImmutableMatrix(system.nq, 1, rates_of_coordinates(system)),
        Phi=matrix("constraint_residual", nh),
        Phi_dot=matrix("constraint_residual", m, first=nh),
        G=matrix("constraint_jacobian", m, nv),
        gamma=matrix("gamma", m),
        T=energy[0],
        V=energy[1],
        values={sympy.Symbol(record["name"]): float(value) for record, value in known},
        choices=choices.named,
    )


class Choices:
    """Names for choices that are too large to stand in an expression: in place, curves would fill pages."""

    def __init__(self, system: System):
        records = (*system.coordinates, *system.rates, *system.parameters, *system.inputs)
        taken = {record["name"] for record in records}
        self._names = (sympy.Symbol(f"choice{k}") for k in count(1) if f"choice{k}" not in taken)
        self._known: dict[sympy.Expr, sympy.Symbol] = {}

    @property
    def named(self) -> tuple[tuple[sympy.Symbol, sympy.Expr], ...]:
        """Names and what they stand for, each made of those before it."""
        return tuple((name, choice) for choice, name in self._known.items())

    def name(self, choice: sympy.Expr) -> sympy.Symbol:
        """Return the name of a choice, the same for the same one."""
        if choice not in self._known:
            self._known[choice] = next(self._names)
        return self._known[choice]


def symbolic(system: System, function: str, choices: Choices | None = None) -> dict[int, sympy.Expr]:
    """Return what `function` writes, by index; structural zeros are missing.

    The form is carried out with symbols for numbers: rates are symbols named `dot(x)`,
    or by names of their own. Large choices stand there by their names.
    """
    coordinates = [record["name"] for record in system.coordinates]
    names = coordinates + rate_labels(system.coordinates, system.rates)
    p = [*(record["name"] for record in (*system.parameters, *system.inputs)), *system.settings]
    symbols_y = list(map(sympy.Symbol, names))
    # 0 leaves the argument of a jump as it is.
    symbols_p = [sympy.S.Zero if name.startswith("branch(") else sympy.Symbol(name) for name in p]
    do = _Symbols(choices or Choices(system))
    written = carry_out(
        system.form(function), do, symbols_y.__getitem__, symbols_p.__getitem__, const=_number
    )
    return {index: value for index, value in written if value != 0}


def shortened(written: dict[int, sympy.Expr], time_limit: float = 5.0) -> dict[int, sympy.Expr]:
    """Return expressions with identities of sine and cosine applied where that makes them shorter.

    Products of sines and cosines are written as sums of those of sums of angles, in which squares and equal terms
    cancel (`cos(a)^2 + sin(a)^2`, `cos(a)*cos(b) + sin(a)*sin(b)`).

    Parameters
    ----------
    written : dict of int to sympy.Expr
    time_limit : float [s]
        For all of them; what is left stays as it is.
    """
    found = within(time_limit, _in_angle_sums, list(written.values()))
    return {i: value if new is None else new for (i, value), new in zip(written.items(), found)}


def _in_angle_sums(expression: sympy.Expr) -> sympy.Expr:
    flat = sympy.expand(TR8(sympy.expand(expression)))
    return min((expression, flat, sympy.factor_terms(flat)), key=lambda x: x.count_ops())


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


def accelerations_if_diagonal(system: System, choices: Choices) -> list[sympy.Expr] | None:
    """Return dv/dt = f/M where M is diagonal and nothing is constrained."""
    mass = symbolic(system, "mass_matrix", choices)
    if system.m or any(index % (system.nv + 1) for index in mass):
        return None
    forces = symbolic(system, "forces", choices)
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
    """The operations of a form, on expressions; counts operations, as SymPy would do again and again."""

    def __init__(self, choices: Choices):
        self._choices = choices
        self._size: dict[sympy.Expr, int] = {}

    def _sized(self, value: sympy.Expr, *parts: sympy.Expr) -> sympy.Expr:
        self._size[value] = 1 + sum(self._size.get(part, 0) for part in parts)
        return value

    def neg(self, x: sympy.Expr) -> sympy.Expr:
        return self._sized(-x, x)

    def add(self, x: sympy.Expr, y: sympy.Expr) -> sympy.Expr:
        return self._sized(x + y, x, y)

    def sub(self, x: sympy.Expr, y: sympy.Expr) -> sympy.Expr:
        return self._sized(x - y, x, y)

    def mul(self, x: sympy.Expr, y: sympy.Expr) -> sympy.Expr:
        return self._sized(x * y, x, y)

    def div(self, x: sympy.Expr, y: sympy.Expr) -> sympy.Expr:
        return self._sized(x / y, x, y)

    @staticmethod
    def time() -> sympy.Expr:
        return sympy.Symbol("t")

    def call(self, name: str, *args: sympy.Expr) -> sympy.Expr:
        return self._sized(_FUNCTIONS[name](*args), *args)

    def select(
        self, is_strict: bool, a: sympy.Expr, b: sympy.Expr, then: sympy.Expr, otherwise: sympy.Expr
    ) -> sympy.Expr:
        chosen = sympy.Piecewise((then, a < b if is_strict else a <= b), (otherwise, True))
        self._sized(chosen, a, b, then, otherwise)
        if self._size[chosen] > _LARGEST_CHOICE and not chosen.is_Atom:
            return self._choices.name(chosen)
        return chosen


def _number(value: float) -> sympy.Number:
    exact = Fraction(value)
    # 0.5 is meant as one half; 0.1 is printed as it stands.
    if exact.denominator <= _LARGEST_DENOMINATOR:
        return sympy.Rational(exact.numerator, exact.denominator)
    return sympy.Float(value)
