"""Where a run begins: starts that parameters make, and conditions that are solved for with the constraints.

Both are evaluated again where a run sets parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from ..errors import ModelError
from ..model import algebra
from ..model.description import Description
from ..model.expression_tree import names_in
from ..model.sensors import acting, late_definitions
from .graph.differentiate import forward, reverse, sparse_jacobian
from .graph.nodes import LAM, PARAM, A, V
from .load import Loader
from .program import Function
from .variables import with_rates

if TYPE_CHECKING:
    from .derivation import Derivation


def has_formulas(d: Description) -> bool:
    """Whether a start, guess or rate is an expression of parameters."""
    return any(x.formula is not None for x in (*d.coordinates, *with_rates(d).rates))


def formulas(d: Description) -> list[algebra.Expr]:
    """The expressions of starts, guesses and rates that have one."""
    return [x.formula.expression for x in (*d.coordinates, *with_rates(d).rates) if x.formula is not None]


def start_function(loader: Loader, d: Description) -> Iterator[Function]:
    """The function `starts`, if there are formulas: all of q and v, before assembly."""
    if not has_formulas(d):
        return
    nodes = []
    for x in (*d.coordinates, *with_rates(d).rates):
        number = x.guess if x.start is None else x.start
        nodes.append(loader.g.const(number) if x.formula is None else loader.load(x.formula.expression))
    yield Function("starts", "Start values of (q, v), before assembly.", tuple(nodes))


# What an equation is about: positions, rates as well, or what the equations of motion tell.
_POSITIONS, _RATES, _BALANCE = range(3)


def start_record(d: Description) -> dict[str, Any]:
    """What the header says of the conditions of a start."""
    start = d.start
    names = {r.name: k for k, r in enumerate(d.rates)}
    names |= {r.coordinate: k for k, r in enumerate(d.rates) if r.coordinate is not None}
    parameters = {p.name: k for k, p in enumerate(d.parameters)}
    return {
        "equations": [equation.text for equation in start.equations],
        "find": [parameters[name] for name in start.find],
        "steady": start.everything or [names[name] for name in start.steady],
        "closed": list(start.closed),
        "balance": needs_balance(d),
    }


def needs_balance(d: Description) -> bool:
    """Whether the conditions of a start have to do with forces."""
    start = d.start
    if start is None:
        return False
    sensed = {s.name for s in d.sensors} | late_definitions(d).keys()
    return start.is_steady or any(not sensed.isdisjoint(names_in(x.expression)) for x in start.equations)


def start_conditions(d: Derivation, residual: Callable[[], list[int]]) -> Iterator[Function]:
    """The conditions of a start that has such, and their derivatives by all that may move.

    Parameters
    ----------
    d : Derivation
        With all stops open and frictions sliding.
    residual : callable
        Returns M a - f - Gᵀλ, then G a - γ. Runs add it to what closed stops make of it, with `residual_jacobian`: here
        are its derivatives by parameters that are sought.
    """
    own = d.own
    if own.start is None:
        return
    g, x, load = d.g, d.x, d.loader.load
    m, n_contacts = len(x.lam), len(own.stops) + len(own.frictions)
    forces = [g.var(LAM, m + k) for k in range(n_contacts)]
    equations = measured(d, [load(e.expression) for e in own.start.equations])
    closed = [k for k, stop in enumerate(own.stops) if stop.name in own.start.closed]
    gaps = [load(own.stops[k].gap) for k in closed]
    closing = forward(g, gaps, d.loader.rates)
    conditions = [*d.constraints.position, *d.constraints.velocity, *equations, *gaps, *closing]
    sought = [g.var(PARAM, k) for k in start_record(own)["find"]]
    first, by_parameters = len(conditions), list[dict[int, int]]()
    if needs_balance(own):
        _refuse_contacts(d)
        pushed = reverse(g, [(u, forces[k]) for u, k in zip(closing, closed, strict=True)], V)
        conditions += [g.neg(push) for push in x.along_rates(pushed)]
        conditions += [*[g.zero] * m, *forward(g, closing, x.motion(x.a))]
        by_parameters = sparse_jacobian(g, residual(), sought) if sought else by_parameters
    doc = "What is zero at the start: constraints, equations, gaps; forces of closed stops, to be added to residual."
    yield Function("start_conditions", doc, tuple(conditions))
    unknowns = [*x.q, *x.v, *x.a, *x.lam, *forces, *sought]
    rows = sparse_jacobian(g, conditions, unknowns)
    for row, more in zip(rows[first:], by_parameters, strict=False):
        row.update({len(unknowns) - len(sought) + k: node for k, node in more.items()})
    doc = "Derivatives of start_conditions by q, v, a, lambda, forces of stops and frictions, parameters."
    yield Function.matrix("start_jacobian", doc, rows, len(unknowns))


def measured(d: Derivation, nodes: list[int]) -> list[int]:
    """Nodes in which sensors that forces follow, too, are functions of (q, v, a, λ)."""
    return nodes if d.sensed is None else d.sensed.observed(nodes)


def _refuse_contacts(d: Derivation) -> None:
    """Refuse balances at the start of a model whose states follow reactions and that has stops or dry friction."""
    for name in acting(d.description) if d.own.stops or d.own.frictions else ():
        raise ModelError(
            f"at a start in balance, stops and dry friction decide what {name} is, which a state follows",
            table="start",
            hint="give the state a start, and leave 'steady' and equations of forces out",
        )


def levels(d: Derivation) -> list[int]:
    """What each equation of a start is about."""
    found = []
    for equation in d.own.start.equations:
        (node,) = measured(d, [d.loader.load(equation.expression)])
        mask = d.g.mask[node]
        found.append(_BALANCE if mask & (A | LAM) else _RATES if mask & V else _POSITIONS)
    return found
