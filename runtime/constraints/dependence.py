"""Which constraints depend on each other at a state: why a run cannot go on there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.redundancy import usual_rank
from symgen.runtime.constraints.row_weights import row_weights
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

DEPENDENT = 1e-3  # smallest singular value of G, in parts of the rows' sizes nearby
_TAKES_PART = 0.1  # of the largest share


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
    held, left, small = _dependence(system, p, t, q, part)
    if not held:
        return []
    shares = np.abs(left[:, small]).max(axis=1, initial=0.0)
    names = Constraints(system, p, t).names
    return [names[held[i]] for i in np.flatnonzero(shares > _TAKES_PART * max(shares.max(), _TAKES_PART))]


def rank_is_lost(system: System, p: np.ndarray, t: float, q: np.ndarray, part: float = DEPENDENT) -> bool:
    """Whether fewer constraints are independent at a configuration than near it; parameters are those above."""
    held, _, small = _dependence(system, p, t, q, part)
    if not held or not small.any():
        return False
    if system.switches or is_large(system):
        return True
    return len(held) - small.sum() < usual_rank(system, p, t, q)


def _dependence(
    system: System, p: np.ndarray, t: float, q: np.ndarray, part: float
) -> tuple[list[int], np.ndarray, np.ndarray]:
    """Return the constraints that are held, combinations of them, and which of these restrict (nearly) nothing."""
    constraints = Constraints(system, p, t)
    jacobian = constraints.jacobian(q) * constraints.characteristic_sizes(q)
    norms = np.linalg.norm(jacobian, axis=1)
    weights, _ = row_weights(system, p, t, q)
    if len(weights):
        norms = 1.0 / weights[system.m * system.nv :][: system.m]
    scaled = np.divide(jacobian, norms[:, None], out=np.zeros_like(jacobian), where=norms[:, None] > 0.0)
    held = [row for row in range(system.m) if row not in system.switched or p[system.switched[row]] != 0.0]
    scaled = scaled[held]
    if not held or not np.isfinite(scaled).all():
        return [], np.zeros((0, 0)), np.zeros(0, dtype=bool)
    left, values, _ = np.linalg.svd(scaled, full_matrices=True)
    small = np.append(values, np.zeros(len(held) - len(values))) <= part * values[0]
    return held, left, small
