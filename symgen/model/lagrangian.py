"""Models from Lagrangians of SymPy's functions of time (`dynamicsymbols`), and from its classes of mechanics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import sympy
from sympy.core.function import AppliedUndef

from ..errors import ModelError
from .from_sympy import to_sympy
from .kane import Mechanics
from .model import Model
from .names import name_fault
from .sources import read
from .sympy_functions import dot, t

Make = Callable[[str], Model]
_NONE: Mapping[Any, Any] = MappingProxyType({})


class Given(NamedTuple):
    """What belongs to a Lagrangian besides its coordinates; see `Model.from_lagrangian`."""

    parameters: Mapping[sympy.Symbol, Any] = _NONE
    forces: Mapping[sympy.Expr, Any] = _NONE
    constraints: Mapping[str, Any] = _NONE
    velocity_constraints: Mapping[str, Any] = _NONE
    start: Mapping[sympy.Expr, Any] = _NONE
    rate: Mapping[sympy.Expr, Any] = _NONE
    inputs: Mapping[sympy.Expr, Any] = _NONE


def from_lagrangian(
    make: Make,
    name: str,
    lagrangian: sympy.Expr,
    coordinates: Sequence[sympy.Expr],
    given: Given,
) -> Model:
    """The model of a Lagrangian; see `Model.from_lagrangian`."""
    names = _Names(coordinates, given.inputs)
    held = [*given.constraints.values(), *given.velocity_constraints.values()]
    expressions = [lagrangian, *given.forces.values(), *held]
    kinetic, potential = _split(lagrangian, names)
    m = make(name)
    for q in coordinates:
        begins = {"start": given.start, "rate": given.rate}
        m.coordinate(
            names.symbols[q].name, **{key: values[q] for key, values in begins.items() if q in values}
        )
    for symbol in names.parameters(expressions):
        if symbol not in given.parameters:
            raise ModelError(
                f"the parameter '{symbol}' of the model '{name}' has no value",
                hint=f"give all: parameters={{{symbol}: 1.0, …}}",
            )
        m.parameter(symbol.name, given.parameters[symbol])
    for x, value in given.inputs.items():
        m.input(names.inputs[x].name, default=value)
    m.kinetic(names.taken_over(kinetic))
    m.potential(names.taken_over(potential))
    for q, force in given.forces.items():
        m.force(names.symbols[q], names.taken_over(force))
    for key, x in given.constraints.items():
        m.constraint(key, names.taken_over(x))
    for key, x in given.velocity_constraints.items():
        m.velocity_constraint(key, names.taken_over(x))
    return m


def from_sympy(make: Make, name: str, problem: Any, **given: Mapping[sympy.Expr, Any]) -> Model:
    """The model of a problem of `sympy.physics.mechanics`; see `Model.from_sympy`."""
    kind = type(problem).__name__
    if kind == "System" and type(getattr(problem, "_eom_method", None)).__name__ == "LagrangesMethod":
        problem, kind = problem._eom_method, "LagrangesMethod"
    if kind == "LagrangesMethod":
        return _from_lagranges_method(make, name, problem, **given)
    if kind == "KanesMethod":
        return _from_mechanics(make, name, Mechanics.of_kane(problem), **given)
    if kind == "System" and hasattr(problem, "kdes"):
        return _from_mechanics(make, name, Mechanics.of_system(problem), **given)
    raise ModelError(
        f"a model is made of a LagrangesMethod, a KanesMethod or a System of SymPy, not of a {kind}",
        hint="or write its Lagrangian: Model.from_lagrangian(name, L, coordinates, …)",
    )


def _from_mechanics(make: Make, name: str, made_of: Mechanics, **given: Mapping[sympy.Expr, Any]) -> Model:
    kinetic, forces, velocity = made_of.in_rates()
    return from_lagrangian(
        make,
        name,
        kinetic,
        made_of.q,
        Given(
            forces=forces,
            constraints=_numbered("position", made_of.holonomic),
            velocity_constraints=_numbered("velocity", made_of.independent(velocity)),
            **given,
        ),
    )


def _from_lagranges_method(make: Make, name: str, method: Any, **given: Mapping[sympy.Expr, Any]) -> Model:
    if not method.eom:
        method.form_lagranges_equations()
    work = method._term4
    n_positions = len(method._hol_coneqs)
    return from_lagrangian(
        make,
        name,
        method._L[0],
        list(method.q),
        Given(
            forces={q: f for q, f in zip(method.q, work, strict=True) if f != 0},
            constraints=_numbered("position", method._hol_coneqs),
            velocity_constraints=_numbered("velocity", list(method.coneqs)[n_positions:]),
            **given,
        ),
    )


def _numbered(stem: str, expressions: Iterable[sympy.Expr]) -> dict[str, sympy.Expr]:
    return {f"{stem}_{k}": x for k, x in enumerate(expressions, 1)}


def _split(lagrangian: sympy.Expr, names: _Names) -> tuple[sympy.Expr, sympy.Expr]:
    """T and V: V is minus what is left of L at rest."""
    at_rest = lagrangian.doit().subs(dict.fromkeys(names.rates, 0))
    return lagrangian - at_rest, -at_rest


class _Names:
    """What functions of time, their derivatives and other symbols are called in a model."""

    def __init__(self, coordinates: Sequence[sympy.Expr], inputs: Iterable[sympy.Expr] = ()) -> None:
        self.symbols = {q: self._named("coordinate", q) for q in coordinates}
        if not self.symbols:
            raise ModelError("a Lagrangian needs coordinates", hint="give its dynamicsymbols")
        self.time = next(iter(self.symbols)).args[0]
        self.inputs = {given: self._named("input", given) for given in inputs}
        self.rates = {q.diff(self.time): dot(symbol) for q, symbol in self.symbols.items()}

    @staticmethod
    def _named(what: str, x: sympy.Expr) -> sympy.Symbol:
        if not isinstance(x, AppliedUndef) or len(x.args) != 1 or not isinstance(x.args[0], sympy.Symbol):
            raise ModelError(
                f"the {what} '{x!s:.60}' is no function of time",
                hint="write sympy.physics.mechanics.dynamicsymbols('q')",
            )
        fault = name_fault(x.func.__name__)
        if fault is not None:
            raise ModelError(fault, hint="give the dynamicsymbol another name")
        return sympy.Symbol(x.func.__name__)

    def parameters(self, expressions: Iterable[Any]) -> list[sympy.Symbol]:
        """The symbols of expressions, by name, without the time."""
        found = set().union(*(_in_sympy(x).free_symbols for x in expressions)) - {self.time}
        return sorted(found, key=lambda symbol: symbol.name)

    def taken_over(self, expression: sympy.Expr) -> sympy.Expr:
        """An expression of symbols and of `dot`.

        Raises
        ------
        ModelError
            It has a function of time that is no coordinate, or a second derivative.
        """
        plain = {x: sympy.Symbol(x.name) for x in self.parameters([expression])}
        known = {**self.rates, **self.symbols, **self.inputs, self.time: t, **plain}
        own = _in_sympy(expression).doit().xreplace(known)
        left = own.atoms(AppliedUndef, sympy.Derivative) - own.atoms(dot)
        left = {x for x in left if isinstance(x, sympy.Derivative) or x.args == (t,)}
        if left:
            raise ModelError(
                f"'{min(left, key=str)!s:.60}' is neither a coordinate nor the rate of one",
                hint="name all dynamicsymbols as coordinates or inputs; accelerations cannot stand in a model",
            )
        return own


def _in_sympy(value: Any) -> sympy.Expr:
    """What the user gave, an expression, a number or text, in SymPy, with its functions of time."""
    return value if isinstance(value, sympy.Expr) else to_sympy(read(value).expression)
