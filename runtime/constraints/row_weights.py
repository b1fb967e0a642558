"""How large each constraint's row of G gets near a state: what tells a row that vanishes from one that is small."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints

if TYPE_CHECKING:
    from symgen.runtime.system import System

_LARGEST = 4096  # entries of G; the look at all of them after each step is to stay cheap
_SPREAD = 0.5  # of the characteristic sizes
_NEIGHBOURS = 4


def n_weights(system: System) -> int:
    """Return the length of `row_weights`."""
    n = system.m * system.nv
    return n + system.m + system.nv if n <= _LARGEST else 0


def row_weights(system: System, p: np.ndarray, t: float, q: np.ndarray) -> tuple[np.ndarray, float]:
    """Return by what the squares of the entries of G sum up to 1 for rows as large as they get near `q`.

    Behind them, by what residuals are multiplied to be in parts of the change that the characteristic sizes make, and
    those sizes.

    Parameters
    ----------
    system : System
        With constraints.
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    q : ndarray, shape (nq,)

    Returns
    -------
    ndarray, shape (m * nv + m + nv,)
        Empty for a model that is too large to look at each row.
    float
        The smallest size of a row at `q`.
    """
    if not n_weights(system):
        return np.zeros(0), 1.0
    constraints = Constraints(system, p, t)
    sizes = constraints.characteristic_sizes(q)
    random = np.random.default_rng(20240229)
    places = [q]
    for _ in range(_NEIGHBOURS):
        places.append(
            constraints.positions.retract(q, _SPREAD * sizes * random.uniform(-1.0, 1.0, sizes.size))
        )
    squares = np.array([((constraints.jacobian(place) * sizes) ** 2).sum(axis=1) for place in places])
    largest = np.max(np.where(np.isfinite(squares), squares, 0.0), axis=0)
    scales = np.where(largest > 0.0, largest, 1.0)
    weights = np.concatenate([(sizes**2 / scales[:, None]).ravel(), 1.0 / np.sqrt(scales), sizes])
    at_start = squares[0] / scales
    for row, place in system.switched.items():  # off, its row of zeros says nothing
        at_start[row] += 1.0 - p[place]
    at_start[list(system.dependent)] = 1.0
    return weights, float(np.min(at_start))
