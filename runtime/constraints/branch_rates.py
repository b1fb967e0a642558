"""Rates at a singular configuration: along one of the branches that meet there, which velocities alone do not tell.

Where the rows of G depend on each other, G v = 0 leaves out what those rows ask for in the next order: G a = γ(q, v)
has a solution only if uᵀ γ(q, v) = 0 for every u with uᵀ G = 0. The rates of each branch obey that, and rates between
branches do not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .nearest_point import RANK_TOLERANCE, Problem, metric, solve_with_restarts, worst

if TYPE_CHECKING:
    from .levels import Constraints

# Of the speed: a start that is typed in is singular to some digits only.
_ALONG_IT, _NOT_BETWEEN = 1e-6, 1e-3
_DIFFERENCE = 1e-4  # of the speed; γ is of second order in the rates, so that central differences are exact


def branch_rates(
    constraints: Constraints, q: np.ndarray, v: np.ndarray, enforced: np.ndarray, sizes: np.ndarray
) -> np.ndarray | None:
    """Return the rates nearest to `v` that lead on from a singular configuration; None where there are none.

    Parameters
    ----------
    constraints : Constraints
    q : ndarray, shape (nq,)
        The configuration, on the constraints.
    v : ndarray, shape (nv,)
        Rates that meet the constraints on the velocity level.
    enforced : ndarray of bool, shape (nv,)
        Rates that stay.
    sizes : ndarray, shape (nv,)
        Characteristic sizes of what the rates move.
    """
    speed, free = worst(v / sizes), ~enforced
    if speed == 0.0:
        return v
    scales = constraints.velocity_scales(q, v, sizes)
    left, values, _ = np.linalg.svd(constraints.jacobian(q, v) * sizes / scales[:, None] * speed)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0])) if values.size else 0
    dependent = left[:, rank:].T

    def residual(z: np.ndarray) -> np.ndarray:
        rates = v.copy()
        rates[free] = z
        second = dependent @ (constraints.accelerations_asked_for(q, rates) / scales) / speed
        return np.concatenate([constraints.velocity(q, rates) / scales, second])

    def jacobian(z: np.ndarray) -> np.ndarray:
        steps = np.diag(_DIFFERENCE * speed * sizes[free])
        columns = [(residual(z + step) - residual(z - step)) / (2.0 * step.max()) for step in steps]
        return np.array(columns).reshape(len(z), -1).T

    if worst(residual(v[free])) <= _ALONG_IT:
        return v
    if not free.any():
        return None
    mass = constraints.mass(q)[np.ix_(free, free)]
    found = v.copy()
    found[free] = solve_with_restarts(Problem(residual, jacobian, metric(mass), speed * sizes[free]), v[free])
    return found if worst(residual(found[free])) <= _NOT_BETWEEN else None
