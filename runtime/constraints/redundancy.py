"""Which constraints follow from the others: the Jacobian's rank, structural or only momentary.

The rank that a constraint Jacobian has around a state, and whether it is that of the code derived for the model.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.nearest_point import SOLVED, Problem, position_problem, solve, worst
from symgen.runtime.positions import Chart
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.system import System


_SPREADS = (0.05, 0.01, 0.2)  # of the characteristic sizes, for each neighbour in turn
_RANK_TOLERANCE = (
    1e-7  # neighbours are on the manifold to 1e-11, and a momentary loss of rank is left by the spread
)
_TAKES_PART = 1e-6


@record
class Redundancy:
    """What the ranks of G say.

    Attributes
    ----------
    rank : int
        At random nearby states on the manifold: what holds in general.
    rank_here : int
        At the state itself; smaller in a singular configuration.
    redundant : list of int
        Constraints that follow from those before them.
    involved : list of int
        All constraints whose multipliers are therefore not unique.
    """

    rank: int
    rank_here: int
    redundant: list[int]
    involved: list[int]


def find_redundancy(
    problem: Problem, q: np.ndarray, scaled_jacobian: Callable[[np.ndarray], np.ndarray]
) -> Redundancy:
    """Compare the rank of G at `q` with that at projected random neighbours (the seed is fixed).

    Parameters
    ----------
    problem : Problem
        The position constraints over all coordinates, by which neighbours are projected.
    q : ndarray
        An assembled configuration.
    scaled_jacobian : callable
        q -> G with rows and columns scaled, shape (m, nv), velocity constraints included.
    """
    here = scaled_jacobian(q)
    rank_here = _rank(here)
    m = here.shape[0]
    if rank_here == m:
        return Redundancy(m, m, [], [])
    best, best_rank = here, rank_here
    random = np.random.default_rng(20240229)
    for spread in _SPREADS:
        neighbour = solve(problem, q + spread * problem.sizes * random.uniform(-1.0, 1.0, q.size))
        if worst(problem.residual(neighbour)) > SOLVED:
            continue
        jacobian = scaled_jacobian(neighbour)
        if np.isfinite(jacobian).all() and _rank(jacobian) > best_rank:
            best, best_rank = jacobian, _rank(jacobian)
    redundant, involved = _dependent_rows(best)
    return Redundancy(best_rank, rank_here, redundant, involved)


def _rank(jacobian: np.ndarray) -> int:
    values = np.linalg.svd(_unit_rows(jacobian), compute_uv=False)
    return int(np.sum(values > _RANK_TOLERANCE * values[0])) if values.size and values[0] > 0.0 else 0


def _unit_rows(matrix: np.ndarray) -> np.ndarray:
    norms = np.linalg.norm(matrix, axis=1, keepdims=True)
    return np.divide(matrix, norms, out=np.zeros_like(matrix), where=norms > 0.0)


def _dependent_rows(jacobian: np.ndarray) -> tuple[list[int], list[int]]:
    """Return rows that depend on those above them, and all rows with a part in a dependency.

    Gram-Schmidt in the order of the file, with re-orthogonalisation: of two equal constraints the later one
    is named.
    """
    rows = _unit_rows(jacobian)
    basis: list[np.ndarray] = []
    independent: list[int] = []
    redundant: list[int] = []
    involved: set[int] = set()
    for i, row in enumerate(rows):
        rest = row.copy()
        for _ in range(2):
            for direction in basis:
                rest = rest - (direction @ rest) * direction
        size = np.linalg.norm(rest)
        if size > _RANK_TOLERANCE:
            basis.append(rest / size)
            independent.append(i)
            continue
        redundant.append(i)
        involved.add(i)
        if independent:
            share = np.linalg.lstsq(rows[independent].T, row, rcond=None)[0]
            involved.update(independent[j] for j in np.flatnonzero(np.abs(share) > _TAKES_PART))
    return redundant, sorted(involved)


_INDEPENDENT = 1e-6  # ratio of pivots from which on constraints are independent


def usual_rank(system: System, p: np.ndarray, t: float, q: np.ndarray) -> int:
    """Return the rank of G at q, on the constraints, or near it where q is a singular configuration."""
    v = np.zeros(system.nv)
    if not system.dependent and system.kernel("rhs")(t, np.concatenate([q, v]), p)[-1] >= _INDEPENDENT:
        return system.m
    constraints = Constraints(system, np.ascontiguousarray(p, dtype=float), t)
    chart, sizes = Chart(constraints.positions, q), constraints.characteristic_sizes(q)
    scales, free = constraints.position_scales(q, sizes), np.ones(len(chart.start), dtype=bool)
    problem = position_problem(constraints, chart, chart.start, free, sizes, scales)
    return ranks_near(problem, constraints, chart, chart.start, v, sizes).rank


def has_dependence(system: System, p: np.ndarray, t: float, q: np.ndarray) -> bool:
    """Whether the constraints that depended on others where the model was derived do so at q, and near it."""
    return not system.dependent or usual_rank(system, p, t, q) == system.m - len(system.dependent)


def ranks_near(
    problem: Problem, constraints: Constraints, chart: Chart, x: np.ndarray, v: np.ndarray, sizes: np.ndarray
) -> Redundancy:
    """Return the ranks of G at `x`, in the unknowns of a chart, and near it."""

    def jacobian(place: np.ndarray) -> np.ndarray:
        return constraints.jacobian(chart.q(place), v) * sizes

    return find_redundancy(problem, x, jacobian)
