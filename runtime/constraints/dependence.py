"""Which constraints depend on each other at a state: why a run cannot go on there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.constraints.levels import Constraints
from runtime.constraints.row_weights import row_weights

if TYPE_CHECKING:
    from runtime.system import System

_DEPENDENT = 1e-3  # smallest singular value of G, in parts of the rows' sizes nearby
_TAKES_PART = 0.1  # of the largest share


def dependent_constraints(system: System, p: np.ndarray, t: float, q: np.ndarray) -> list[str]:
    """Return the names of constraints that nearly depend on each other, or restrict nothing, at a configuration.

    Parameters
    ----------
    p : ndarray
        Parameters, then inputs, and what is held of stops and frictions: what is not is not looked at.
    t : float [s]
    q : ndarray, shape (nq,)

    Returns
    -------
    list of str
        Empty where all are independent.
    """
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
        return []
    left, values, _ = np.linalg.svd(scaled, full_matrices=True)
    small = np.append(values, np.zeros(len(held) - len(values))) <= _DEPENDENT * values[0]
    shares = np.abs(left[:, small]).max(axis=1, initial=0.0)
    return [
        constraints.names[held[i]]
        for i in np.flatnonzero(shares > _TAKES_PART * max(shares.max(), _TAKES_PART))
    ]
