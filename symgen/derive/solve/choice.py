"""The form in which accelerations are solved for: by the matrix [M Gᵀ; G 0], or by what it is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..graph.graph import Graph
from ..graph.nodes import SparseRows
from .definite import singular_coordinates
from .factorise import factorise, pairs
from .lifted import factorise_lifted, order_of, tallied
from .lifting import Lifted
from .rows import Factors, solve
from .tally import Tally, TooMuch

FEWEST_RATES = 8  # from which on lifting is looked at
FEWEST_COUPLED = 4.0  # entries of a row of M, on average
# Of operations: those of a lifted system wait for each other more.
GAIN = 1.3


def best_factors(
    g: Graph,
    mass: SparseRows,
    jacobian: SparseRows,
    names: list[str],
    corner: Mapping[int, int],
    lifted: Callable[[], Lifted | None],
    others: list[int],
    by_loops: bool = True,
) -> Factors:
    """Return the factors of [M Gᵀ; G 0] in the form whose solution costs less.

    Parameters
    ----------
    g : Graph
    mass, jacobian, names, corner
        As for `factorise`.
    lifted : callable
        Gives the same system as it is made of velocities, None where that cannot be.
    others : list of int
        What is computed beside the solution, forces: operations that these share with a form are free.
    by_loops : bool
        As for `factorise`.
    """
    if len(mass) >= FEWEST_RATES and sum(map(len, mass)) >= FEWEST_COUPLED * len(mass):
        form = None if jacobian and singular_coordinates(g, mass) else lifted()
        if form is not None:
            known = Tally()
            first, bare = pairs(known, known.rows(g, mass), known.rows(g, jacobian), _known(known, g, corner))
            if not bare:
                tally = Tally()
                order, factors = order_of(tallied(form, g, tally), tally, first)
                solve(tally, factors, _right(tally, form.n + form.m))
                cost = GAIN * (tally.operations + _beside(g, form.weights, others))
                if _matrix_costs_more(g, mass, jacobian, names, corner, others, cost):
                    return factorise_lifted(g, form, order)
    return factorise(g, mass, jacobian, names, corner, by_loops)


def _matrix_costs_more(
    g: Graph,
    mass: SparseRows,
    jacobian: SparseRows,
    names: list[str],
    corner: Mapping[int, int],
    others: list[int],
    cost: float,
) -> bool:
    entries = [entry for row in (*mass, *jacobian) for entry in row.values()]
    tally = Tally(limit=cost - _beside(g, entries, others))
    if tally.limit < 0:
        return True
    try:
        known = _known(tally, g, corner)
        factors = factorise(tally, tally.rows(g, mass), tally.rows(g, jacobian), names, known)
        solve(tally, factors, _right(tally, len(names)))
    except TooMuch:
        return True
    return tally.operations > tally.limit


def _beside(g: Graph, nodes: list[int], others: list[int]) -> int:
    """Operations of nodes that others do not need."""
    return g.count([*nodes, *others]) - g.count(others)


def _known(tally: Tally, g: Graph, corner: Mapping[int, int]) -> dict[int, int]:
    return {k: tally.number(g, node) for k, node in corner.items()}


def _right(tally: Tally, n: int) -> list[int]:
    """A right-hand side that moves."""
    return [tally.moving() for _ in range(n)]
