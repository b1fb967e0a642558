"""Friction in proportion to reactions in series: its force and the multipliers determine each other at every order.

With x = (a, -λ), K = [M Gᵀ; G 0] and frictions along u whose level is μ N(λ), the coefficients of order k solve

    K x_k - Σ u (wᵀ x_k) = -r_k,   w = μ ∂N/∂λ,

u and w being those of the start of the step. At order 0 the equations are not linear where N is the magnitude of
several multipliers: `rhs` has solved them, and its accelerations and multipliers begin the series.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from symgen.runtime.abi import CLOSED, N_WATCHED
from symgen.runtime.taylor.graph import SeriesGraph

if TYPE_CHECKING:
    from symgen.runtime.system import System

Read = Callable[..., dict[int, int]]


@dataclass(frozen=True)
class Friction:
    """Nodes of u, by the rows of the accelerations, and of w, by constraint."""

    along: dict[int, int]
    weights: dict[int, int]


@dataclass(frozen=True)
class Reactions:
    """What a step of a model with such frictions begins with.

    Attributes
    ----------
    graph : SeriesGraph
        Of the nodes below, of which nothing but their values at the start of a step is asked.
    unknowns : list of int
        The accelerations, then the multipliers.
    frictions : list of Friction
    """

    graph: SeriesGraph
    unknowns: list[int]
    frictions: list[Friction]


def read_reactions(system: System, read: Read) -> Reactions | None:
    """Return what the frictions of this form of a model add; None where none follows a reaction.

    Parameters
    ----------
    system : System
    read : callable
        `read(graph, function, state, wanted, moving=...)` gives the nodes of a function's outputs, see `read_outputs`.

    Raises
    ------
    symgen.runtime.errors.Refusal
        `rhs` is not straight-line code.
    """
    names = [record["name"] for record in system.constraints]
    acting = [switch for switch in system.switches if set(switch.get("normal", ())) & set(names)]
    if not acting:
        return None
    graph = SeriesGraph()
    state = graph.state
    places = [*range(system.nq, system.nq + system.nv), *range(system.ny, system.ny + system.m)]
    rows = read(graph, "rhs", state, set(places))
    unknowns = [rows[place] for place in places]
    watched = read(graph, "switches", state)
    frictions = []
    for switch in acting:
        coefficient, direction = _coefficient_and_direction(system, graph, watched, switch)
        along = _sliding_row(system, graph, read, switch["name"])
        own = [names.index(name) for name in switch["normal"]]
        slopes = _slopes(system, graph, switch, [unknowns[system.nv + k] for k in own])
        weights = {k: graph.mul(coefficient, slope) for k, slope in zip(own, slopes)}
        frictions.append(Friction({i: graph.mul(direction, node) for i, node in along.items()}, weights))
    return Reactions(graph, unknowns, frictions)


def _coefficient_and_direction(
    system: System, graph: SeriesGraph, watched: Mapping[int, int], switch: Mapping[str, Any]
) -> tuple[int, int]:
    """The coefficient of friction, and how much of its force acts against this speed of it."""
    speed, coefficient, width = _watched(system, watched, switch)
    pair = [
        other for other in system.switches if "circle" in switch and other.get("circle") == switch["circle"]
    ]
    speeds = [_watched(system, watched, other)[0] for other in pair or [switch]]
    squares = functools.reduce(graph.add, (graph.mul(s, s) for s in speeds))
    if switch.get("smooth"):
        return coefficient, graph.div(speed, graph.call("sqrt", graph.add(squares, graph.mul(width, width))))
    sense = graph.parameter(_setting(system, "sense", switch["name"]))
    if not pair:
        return coefficient, sense
    turns = graph.parameter(_setting(system, "turns", pair[0]["name"]))
    along = graph.div(speed, graph.call("sqrt", squares))
    return coefficient, graph.select("olt", graph.number(0.5), turns, along, sense)


def _watched(system: System, watched: Mapping[int, int], switch: Mapping[str, Any]) -> list[int]:
    """The speed of a friction, its level and the width of what is smooth."""
    before = system.switches[: system.switches.index(switch)]
    first = sum(N_WATCHED[other["kind"]] for other in before)
    return [watched[first + i] for i in range(N_WATCHED["friction"])]


def _setting(system: System, key: str, name: str) -> int:
    """Where in `p` a setting of a switch is."""
    return system.n_settable + system.settings.index(f"{key}({name})")


def _sliding_row(system: System, graph: SeriesGraph, read: Read, name: str) -> dict[int, int]:
    """The derivatives of a sliding speed by the rates: the row of the friction as a constraint, switched on."""
    closed = system if system.switched else system.closed
    (row,) = (k for k in closed.switched if closed.constraints[k]["name"] == name)
    function = "constraint_jacobian" if system.switched else f"{CLOSED}constraint_jacobian"
    wanted = set(range(row * system.nv, (row + 1) * system.nv))
    on = {closed.switched[row]: graph.number(1.0)}
    found = read(graph, function, graph.state, wanted, moving=on)
    return {place - row * system.nv: node for place, node in found.items()}


def _slopes(
    system: System, graph: SeriesGraph, switch: Mapping[str, Any], multipliers: list[int]
) -> list[int]:
    """The derivatives of the normal force, a stop's multiplier or the magnitude of some, by each of these."""
    if any(other["kind"] == "stop" and other["name"] in switch["normal"] for other in system.switches):
        return [graph.number(1.0)]
    total = graph.number(0.0)
    for multiplier in multipliers:
        total = graph.add(total, graph.mul(multiplier, multiplier))
    magnitude = graph.call("sqrt", total)
    return [graph.div(multiplier, magnitude) for multiplier in multipliers]
