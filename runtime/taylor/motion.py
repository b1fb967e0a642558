"""A model's motion as a graph of series: what is integrated, and the equations for accelerations and multipliers."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from symgen.runtime.taylor.derivatives import use_derivatives
from symgen.runtime.taylor.factors import share_factors
from symgen.runtime.taylor.graph import SeriesGraph
from symgen.runtime.taylor.nodes import CONVOLUTIONS
from symgen.runtime.taylor.outputs import named_outputs, read_outputs
from symgen.runtime.taylor.reactions import Reactions, read_reactions
from symgen.runtime.taylor.refusal import Refusal

if TYPE_CHECKING:
    from symgen.runtime.system import System

_POSITIONS = ("constraint_residual", "poses")


@dataclass
class Motion:
    """The series of a model.

    Attributes
    ----------
    graph : SeriesGraph
    coordinates, rates : list of int
        Nodes of q and v.
    unknowns : list of int
        Accelerations, then multipliers of constraints that do not depend on others, which `equations` determine at
        every order; none where the accelerations are given as operations (those of `rhs`).
    equations : list of int
        Nodes of `residual`: M a - f - Gᵀλ, then G a - γ.
    mass : dict of (row, column) to int
        Entries of M that are not zero; needed at the start of a step only, as is G.
    jacobian : dict of (constraint, column) to int
    corner : dict of int to int
        1 - s of each constraint with a switch s, whose multiplier is zero while it is off.
    power : int or None
        The power that the work is the integral of.
    reactions : Reactions or None
        Where friction follows reactions: what it adds to the equations, and the unknowns at the start of a step.
    """

    graph: SeriesGraph
    coordinates: list[int]
    rates: list[int]
    unknowns: list[int] = field(default_factory=list)
    equations: list[int] = field(default_factory=list)
    mass: dict[tuple[int, int], int] = field(default_factory=dict)
    jacobian: dict[tuple[int, int], int] = field(default_factory=dict)
    corner: dict[int, int] = field(default_factory=dict)
    power: int | None = None
    reactions: Reactions | None = None

    @property
    def n_convolutions(self) -> int:
        """The number of products of series, which cost most."""
        g = self.graph
        roots = [
            *self.equations,
            *self.rates,
            *self.coordinates,
            *([] if self.power is None else [self.power]),
        ]
        return sum(g.op[node] in CONVOLUTIONS for node in g.reachable(roots))


def read_motion(system: System) -> Motion:
    """Return the series of a model in the form that needs the fewest products of series.

    Either the accelerations are series of what `rhs` computes, or they are solved for from `residual`, order by
    order. The latter has fewer products, except for the smallest models.

    Raises
    ------
    Refusal
        Something in the model has no Taylor series.
    """
    forms = [_from_residual(system, positions) for positions in (False, True)]
    if not system.m:
        with contextlib.suppress(Refusal):  # its solves may be loops
            forms.insert(0, _from_rhs(system))
    best = min(forms, key=lambda form: form.n_convolutions)
    return replace(best, reactions=read_reactions(system, functools.partial(_outputs, system)))


def _outputs(
    system: System,
    graph: SeriesGraph,
    name: str,
    state: Callable[[int], int],
    wanted: set[int] | None = None,
    given: dict[int, int] | None = None,
    moving: dict[int, int] | None = None,
) -> dict[int, int]:
    moving = dict(moving or {})
    moving |= {index: _polynomial(graph, *place) for index, place in system.input_polynomials.items()}
    return read_outputs(graph, system.form(name), state, wanted, given, moving)


def _polynomial(graph: SeriesGraph, knot: int, first: int, degree: int) -> int:
    """The node of an input over time: a polynomial in t - p[knot], whose coefficients begin at p[first]."""
    value = graph.parameter(first + degree)
    if degree:
        since = graph.sub(graph.time(), graph.parameter(knot))
        for j in range(degree - 1, -1, -1):
            value = graph.add(graph.mul(value, since), graph.parameter(first + j))
    return value


def _states(graph: SeriesGraph, system: System) -> tuple[list[int], list[int], Callable[[int], int]]:
    """The nodes of q and v, their derivatives not yet known, and what reads y in functions of (q, v)."""
    q = [graph.state(i) for i in range(system.nq)]
    v = [graph.state(system.nq + i) for i in range(system.nv)]
    graph.rates.update(v)
    nodes = q + v
    return q, v, nodes.__getitem__


def _from_rhs(system: System) -> Motion:
    graph = SeriesGraph(stops_at_choices=bool(system.source.header.get("time_terms")))
    q, v, state = _states(graph, system)
    rows = _outputs(system, graph, "rhs", state, set(range(system.ny)))
    for i, node in enumerate(q + v):
        graph.integrate(node, rows[i])
    return Motion(graph, q, v, power=rows.get(system.nq + system.nv))


def _from_residual(system: System, positions: bool) -> Motion:
    """`positions`: look for derivatives among positions of bodies and constraints as well."""
    graph = SeriesGraph(stops_at_choices=bool(system.source.header.get("time_terms")))
    q, v, state = _states(graph, system)
    a = [graph.unknown("acceleration", i) for i in range(system.nv)]
    kept = [k for k in range(system.m) if k not in system.dependent]
    solved = [graph.unknown("multiplier", i) for i in range(len(kept))]
    multipliers = [graph.number(0.0)] * system.m
    for k, node in zip(kept, solved):
        multipliers[k] = node
    rows = _outputs(system, graph, "rhs", state, set(range(system.nq)))
    for node, derivative in zip(q + v, [rows[i] for i in range(system.nq)] + a):
        graph.integrate(node, derivative)
    nodes = q + v + a + multipliers
    residual = _outputs(system, graph, "residual", nodes.__getitem__)
    equations = [residual[i] for i in (*range(system.nv), *(system.nv + k for k in kept))]
    mass = _outputs(system, graph, "mass_matrix", state)
    entries = _jacobian(system, graph, state, kept) if kept else {}
    power = [_power(system, graph, state, a, multipliers)] if system.nw else []
    candidates = []
    for name in _POSITIONS:
        if positions and system.has(name):
            with contextlib.suppress(Refusal):  # they only help
                candidates += _outputs(system, graph, name, state).values()
    roots = [*equations, *power, *q, *v, *mass.values(), *entries.values()]
    roots = iter(share_factors(graph, use_derivatives(graph, roots, candidates)))
    return Motion(
        graph, q, v, a + solved,
        equations=[next(roots) for _ in equations],
        power=[*(next(roots) for _ in power), None][0],
        mass=dict(zip((divmod(i, system.nv) for i in mass), _after(roots, len(q + v)))),
        jacobian=dict(zip(entries, roots)),
        corner={row: graph.sub(graph.number(1.0), graph.parameter(k)) for row, k in system.switched.items()},
    )  # fmt: skip


def _jacobian(
    system: System, graph: SeriesGraph, state: Callable[[int], int], kept: list[int]
) -> dict[tuple[int, int], int]:
    """The entries of G by their places, in the rows of the constraints that are solved with."""
    number = {k: i for i, k in enumerate(kept)}
    found = _outputs(system, graph, "constraint_jacobian", state)
    places = {divmod(i, system.nv): node for i, node in found.items()}
    return {(number[row], column): node for (row, column), node in places.items() if row in number}


def _after(values, skipped: int):
    for _ in range(skipped):
        next(values)
    return values


def _power(system: System, graph: SeriesGraph, state, a: list[int], multipliers: list[int]) -> int:
    """The power as `rhs` computes it, with the accelerations and multipliers that it solves for taken as given."""
    first = system.nq
    solved = {first + i: node for i, node in enumerate(a)}
    solved |= {system.ny + i: node for i, node in enumerate(multipliers)}
    given = {
        node: graph.neg(solved[index]) if negative else solved[index]
        for index, (node, negative) in named_outputs(system.form("rhs")).items()
        if index in solved
    }
    index = system.nq + system.nv
    return _outputs(system, graph, "rhs", state, {index}, given)[index]
