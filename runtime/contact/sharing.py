"""How frictions in planes share a load that more of them hold than it takes: as far from their limits as can be.

What several hold together is at its limit where no way of sharing it is left, and where that is shows only in the best
one: the forces f with the largest s for which |f_k| <= L_k(f) - s w_k of every friction k, and no stop pulls, among all
f that do the same. It is a second-order cone program with few unknowns; a logarithmic barrier follows its central path
(Nesterov, Nemirovskii, Interior-Point Polynomial Algorithms in Convex Programming, 1994, ch. 5). Where loads grow until
something slides, this is the limit load of plasticity: Drucker, Coulomb friction, plasticity, and limit loads, J. Appl.
Mech. 21 (1954).
"""

from __future__ import annotations

import numpy as np

from symgen.runtime.contact.levels import Levels
from symgen.runtime.contact.local_dynamics import LocalDynamics

NEAR = 0.5  # of what a friction can take: from there on it matters how a load is shared
AT_LIMIT = 1e-8  # of what they can take is left to all that bear a load: it is at its limit
_DEPENDENT = 1e-10  # singular values of what forces do, below this part of the largest: they do nothing
_GAP = 1e-11  # of s
_TIGHTER = 0.1
_NEWTON_STEPS = 40
_CENTRED = 1e-6
_TO_THE_WALL = 0.99
_HALVINGS = 60


class _Barrier:
    """-s/μ - Σ log of how far forces f = f0 + Z z are from the cones of frictions and from stops that pull."""

    def __init__(self, cones: list[tuple[np.ndarray, np.ndarray]], walls: list[np.ndarray]):
        # Each cone as a matrix that takes (1, z, s) to (L - s w, f); each wall as a row.
        self.cones, self.walls = [np.vstack([level, rows]) for level, rows in cones], walls

    def inside(self, x: np.ndarray) -> bool:
        full = np.concatenate([[1.0], x])
        cones = (cone @ full for cone in self.cones)
        return all(u[0] > np.linalg.norm(u[1:]) for u in cones) and all(wall @ full > 0.0 for wall in self.walls)

    def at(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Return the barrier, its gradient and its Hessian."""
        full, n = np.concatenate([[1.0], x]), len(x)
        value, gradient, hessian = 0.0, np.zeros(n), np.zeros((n, n))
        for cone in self.cones:
            u, by = cone @ full, cone[:, 1:]
            sign = np.concatenate([[1.0], -np.ones(len(u) - 1)])
            size, slope = (u[0] - np.linalg.norm(u[1:])) * (u[0] + np.linalg.norm(u[1:])), 2.0 * (sign * u) @ by
            value -= np.log(size)
            gradient -= slope / size
            hessian += np.outer(slope, slope) / size**2 - 2.0 * (by.T * sign) @ by / size
        for wall in self.walls:
            u, by = wall @ full, wall[1:]
            value -= np.log(u)
            gradient -= by / u
            hessian += np.outer(by, by) / u**2
        return value, gradient, hessian

    def most(self, x: np.ndarray) -> np.ndarray:
        """Return where the last of the unknowns is largest, from a point inside."""
        weight, n_walls = 1.0, 2 * len(self.cones) + len(self.walls)
        aim = np.zeros(len(x))
        aim[-1] = -1.0
        while weight * n_walls > _GAP:
            x = self._centre(x, aim / weight)
            weight *= _TIGHTER
        return x

    def _centre(self, x: np.ndarray, aim: np.ndarray) -> np.ndarray:
        for _ in range(_NEWTON_STEPS):
            value, gradient, hessian = self.at(x)
            gradient = gradient + aim
            step = -np.linalg.lstsq(hessian, gradient, rcond=None)[0]
            decrease = -gradient @ step
            if not decrease > _CENTRED:
                return x
            part = 1.0
            for _ in range(_HALVINGS):
                new = x + part * step
                if self.inside(new) and self.at(new)[0] + aim @ new <= value + aim @ x - 0.1 * part * decrease:
                    break
                part *= 0.5
            else:
                return x
            x = x + part * step
        return x


def evened(
    here: LocalDynamics, levels: Levels, forces: np.ndarray, movable: np.ndarray, circles: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Return forces that do the same as some others, shared as far from the limits as can be.

    Parameters
    ----------
    here : LocalDynamics
    levels : Levels
    forces : ndarray, shape (n,)
        Of stops and frictions.
    movable : ndarray of bool, shape (n,)
        Whose forces may be others.
    circles : ndarray of int, shape (m, 2)
        As `Layout.circles`.

    Returns
    -------
    forces : ndarray, shape (n,)
    left : float
        What the most loaded friction is from its limit, in parts of what it can take; negative beyond it.
        None in the place of both where there is one way to share the load only, or none is near a limit.
    """
    n_stops = len(forces) - len(levels.fixed)
    c, slope = levels.linear(here, forces, 1.0)
    most = c + slope @ forces
    groups = [np.array([k]) for k in np.flatnonzero(movable[n_stops:]) if not (circles == k).any()]
    groups += [pair for pair in circles if movable[n_stops + pair].all()]
    groups = [group for group in groups if most[group[0]] > 0.0]
    loads = [np.linalg.norm(forces[n_stops + group]) / most[group[0]] for group in groups]
    if max(loads, default=0.0) < NEAR:
        return None
    stops = np.flatnonzero(movable[:n_stops] & (forces[:n_stops] > 0.0))
    rows = np.concatenate([stops, *(n_stops + group for group in groups)]).astype(int)
    sizes = np.concatenate([forces[stops], *(np.full(len(group), most[group[0]]) for group in groups)])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(here.compliance), 1e-300))
    _, values, vectors = np.linalg.svd(scale[:, None] * here.compliance[:, rows] * sizes)
    idle = vectors[np.count_nonzero(values > _DEPENDENT * values[0]) :]
    if not len(idle):
        return None
    ways = np.zeros((len(forces), len(idle)))
    ways[rows] = sizes[:, None] * idle.T

    def along(row: np.ndarray, constant: float, s: float) -> np.ndarray:
        return np.concatenate([[constant], row @ ways, [s]])

    cones = []
    for group in groups:
        k, own = group[0], most[group[0]]
        level = along(slope[k], most[k], -own) / own
        cones.append((level, np.array([along(np.eye(len(forces))[n_stops + i], forces[n_stops + i], 0.0) / own for i in group])))
    walls = [along(np.eye(len(forces))[i], forces[i], 0.0) / forces[i] for i in stops]
    x = np.zeros(len(idle) + 1)
    x[-1] = 1.0 - max(loads) - 0.5
    x = _Barrier(cones, walls).most(x)
    return forces + ways @ x[:-1], float(x[-1])
