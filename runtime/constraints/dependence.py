"""Which constraints depend on each other at a state: why a run cannot go on there."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.nearest_point import SOLVED, Problem, position_problem, solve, worst
from symgen.runtime.constraints.row_weights import row_weights
from symgen.runtime.positions import Chart
from symgen.runtime.record import record
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System


# The rank that a constraint Jacobian has around a state, and whether it is that of the code derived for the model.

_SPREADS = (0.05, 0.01, 0.2)  # of the characteristic sizes, for each neighbour in turn
_RANK_TOLERANCE = (
    1e-7  # neighbours are on the manifold to 1e-11, and a momentary loss of rank is left by the spread
)
_INVOLVED = 1e-6


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
    with np.errstate(over="ignore"):
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
            involved.update(independent[j] for j in np.flatnonzero(np.abs(share) > _INVOLVED))
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


DEPENDENT = 1e-3  # smallest singular value of G, in parts of the rows' sizes nearby
_TAKES_PART = 0.1  # of the largest share
_GAP = 0.1  # from one singular value to the next, where a rank is lost


def dependent_constraints(
    system: System, p: np.ndarray, t: float, q: np.ndarray, part: float = DEPENDENT
) -> list[str]:
    """Return the names of constraints that nearly depend on each other, or restrict nothing, at a configuration.

    Parameters
    ----------
    p : ndarray
        Parameters, then inputs, and what is held of stops and frictions: what is not is not looked at.
    t : float [s]
    q : ndarray, shape (nq,)
    part : float
        Of the largest singular value of G: what is below counts as nothing.

    Returns
    -------
    list of str
        Empty where all are independent.
    """
    held, left, small, _ = _dependence(system, p, t, q, part)
    if not held:
        return []
    shares = np.abs(left[:, small]).max(axis=1, initial=0.0)
    names = Constraints(system, p, t).names
    return [names[held[i]] for i in np.flatnonzero(shares > _TAKES_PART * max(shares.max(), _TAKES_PART))]


def rank_is_lost(system: System, p: np.ndarray, t: float, q: np.ndarray, part: float = DEPENDENT) -> bool:
    """Whether fewer constraints are independent at a configuration than near it; parameters are those above."""
    held, _, small, values = _dependence(system, p, t, q, part)
    if not held or not small.any():
        return False
    if is_large(system) and not _stand_apart(values, small):
        return False
    if system.switches or is_large(system):
        return True
    return len(held) - small.sum() < usual_rank(system, p, t, q)


def _stand_apart(values: np.ndarray, small: np.ndarray) -> bool:
    """Whether singular values that count as small, of a falling sequence, are far below those before them.

    Those of a chain of n bodies fall evenly to 1/n of the largest at every configuration: none is lost there.
    """
    steps = values[1:] <= _GAP * values[:-1]
    return bool((steps & small[1 : len(values)]).any()) or len(small) > len(values)


def _dependence(
    system: System, p: np.ndarray, t: float, q: np.ndarray, part: float
) -> tuple[list[int], np.ndarray, np.ndarray, np.ndarray]:
    """Return the constraints that are held, combinations of them, which restrict (nearly) nothing, singular values."""
    constraints = Constraints(system, p, t)
    jacobian = constraints.jacobian(q) * constraints.characteristic_sizes(q)
    with np.errstate(over="ignore"):
        norms = np.linalg.norm(jacobian, axis=1)
    weights, _ = row_weights(system, p, t, q)
    if len(weights):
        norms = 1.0 / weights[system.m * system.nv :][: system.m]
    scaled = np.divide(jacobian, norms[:, None], out=np.zeros_like(jacobian), where=norms[:, None] > 0.0)
    held = [row for row in range(system.m) if row not in system.switched or p[system.switched[row]] != 0.0]
    scaled = scaled[held]
    if not held or not np.isfinite(scaled).all():
        return [], np.zeros((0, 0)), np.zeros(0, dtype=bool), np.zeros(0)
    left, values, _ = np.linalg.svd(scaled, full_matrices=True)
    small = np.append(values, np.zeros(len(held) - len(values))) <= part * values[0]
    return held, left, small, values
