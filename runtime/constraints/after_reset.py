"""Rates after a reset: those that the reset gave stay, the others follow through the constraints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.nearest_point import SOLVED, metric, pseudo_solve, worst

if TYPE_CHECKING:
    from symgen.runtime.system import System

_REFINEMENTS = 3


def rates_after_reset(
    system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray, given: np.ndarray
) -> np.ndarray | None:
    """Return rates that satisfy the constraints and keep the given ones.

    A projection of all rates would undo the reset of a coordinate without mass, such as a slider-crank's
    piston position: moving it back costs nothing in the mass metric.

    Parameters
    ----------
    system : System
        With constraints.
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    q : ndarray, shape (nq,)
        On the constraints.
    v : ndarray, shape (nv,)
        As the reset left them.
    given : ndarray of bool, shape (nv,)
        The rates that the reset gave.

    Returns
    -------
    ndarray, shape (nv,), or None
        None where the constraints do not allow the given rates.
    """
    constraints = Constraints(system, p, t)
    scales = constraints.velocity_scales(q, v, constraints.characteristic_sizes(q))
    free, v = ~given, v.copy()
    jacobian = constraints.jacobian(q, v) / scales[:, None]
    mass = constraints.mass(q)
    if not (np.isfinite(jacobian).all() and np.isfinite(mass).all() and np.isfinite(v).all()):
        return None
    if free.any():
        factor = metric(mass[np.ix_(free, free)])
        reduced = np.linalg.solve(factor, jacobian[:, free].T).T
        for _ in range(_REFINEMENTS):
            off = constraints.velocity(q, v) / scales
            v[free] -= np.linalg.solve(factor.T, pseudo_solve(reduced, off))
    return v if worst(constraints.velocity(q, v) / scales) <= SOLVED else None
