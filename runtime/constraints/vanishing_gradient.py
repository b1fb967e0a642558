"""Constraints whose gradient is zero wherever they hold: they can be met, but not kept."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from symgen.runtime.constraints.nearest_point import SOLVED, Problem, solve, worst

_SPREADS = (0.05, 0.01, 0.2)  # of the characteristic sizes, for each neighbour in turn
_SMALL_HERE = 1e-3  # of the gradient's size beside the constraint: worth a closer look
# A point that is singular by itself has neighbours on the constraint with gradients like those beside it.
_SMALL_ON_IT = 1e-2


def without_gradient(
    problem: Problem, q: np.ndarray, scaled_gradients: Callable[[np.ndarray], np.ndarray]
) -> list[int]:
    """Return the position constraints whose gradient vanishes at `q` and at all projected random neighbours.

    Such a constraint has no force that could keep it: (x - 1)² + y² = 0 fixes a point as x = 1 and y = 0 do, but all
    its derivatives by the coordinates are zero there. The seed is fixed.

    Parameters
    ----------
    problem : Problem
        The position constraints over all coordinates, by which neighbours are projected.
    q : ndarray
        An assembled configuration.
    scaled_gradients : callable
        q -> rows of G of the position constraints, scaled alike at every place, shape (nh, nv).
    """
    here = _sizes(scaled_gradients(q))
    random = np.random.default_rng(20240229)
    shift = problem.sizes * random.uniform(-1.0, 1.0, q.size)
    beside = _sizes(scaled_gradients(q + _SPREADS[0] * shift))
    suspects = here <= _SMALL_HERE * beside
    suspects &= beside > 0.0
    if not suspects.any():
        return []
    n_projected = 0
    for spread in _SPREADS:
        start = q + spread * shift
        neighbour = solve(problem, start)
        if worst(problem.residual(neighbour)) > SOLVED:
            continue
        n_projected += 1
        suspects &= _sizes(scaled_gradients(neighbour)) <= _SMALL_ON_IT * _sizes(scaled_gradients(start))
        shift = problem.sizes * random.uniform(-1.0, 1.0, q.size)
    return [int(i) for i in np.flatnonzero(suspects)] if n_projected else []


def _sizes(rows: np.ndarray) -> np.ndarray:
    return np.nan_to_num(np.linalg.norm(rows, axis=1), nan=0.0, posinf=0.0)
