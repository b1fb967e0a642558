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
_GAP, _NEARLY = 1e-11, 0.05  # of s, and in parts of it
_TIGHTER = 0.05
_NEWTON_STEPS = 40
_CENTRED = 1e-4
_INSIDE = 1e-9  # of a load: more than its round-off
_PARTS = 0.5 ** np.arange(40)  # of a step
_SIGNS = np.array([1.0, -1.0, -1.0])


class _Barrier:
    """-s/μ - Σ log of how far forces f = f0 + Z z are from the cones of frictions and from stops that pull.

    Parameters
    ----------
    cones : ndarray, shape (k, 3, 2 + d)
        Matrices that take (1, z, s) to (L - s w, f), of friction in one direction with a row of zeros.
    walls : ndarray, shape (n, 2 + d)
        Rows that give the forces of stops.
    """

    def __init__(self, cones: np.ndarray, walls: np.ndarray):
        self.cones, self.walls = cones, walls
        self._bends = np.einsum("kri,r,krj->kij", cones[:, :, 1:], _SIGNS, cones[:, :, 1:])

    def at(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray] | None:
        """Return the barrier, its gradient and its Hessian; None outside."""
        full = np.concatenate([[1.0], x])
        u, above = self.cones @ full, self.walls @ full
        length = np.hypot(u[:, 1], u[:, 2])
        size = (u[:, 0] - length) * (u[:, 0] + length)
        if not ((u[:, 0] > length).all() and (above > 0.0).all()):
            return None
        slopes = 2.0 * np.einsum("kr,krj->kj", u * _SIGNS, self.cones[:, :, 1:]) / size[:, None]
        falls = self.walls[:, 1:] / above[:, None]
        hessian = slopes.T @ slopes + falls.T @ falls - 2.0 * np.tensordot(1.0 / size, self._bends, 1)
        return -np.log(size).sum() - np.log(above).sum(), -slopes.sum(axis=0) - falls.sum(axis=0), hessian

    def most(self, x: np.ndarray) -> np.ndarray:
        """Return where the last of the unknowns is largest, from a point inside."""
        weight, n_walls = 1.0, 2 * len(self.cones) + len(self.walls)
        aim = np.zeros(len(x))
        aim[-1] = -1.0
        while True:
            x = self._centre(x, aim / weight)
            if weight * n_walls <= max(_GAP, _NEARLY * x[-1]):
                return x
            weight *= _TIGHTER

    def _centre(self, x: np.ndarray, aim: np.ndarray) -> np.ndarray:
        """Return where the barrier and `aim` are least together: by Newton's method, from a point inside."""
        here = self.at(x)
        for _ in range(_NEWTON_STEPS):
            value, gradient, hessian = here
            gradient = gradient + aim
            step = -np.linalg.lstsq(hessian, gradient, rcond=None)[0]
            decrease = -gradient @ step
            if not decrease > _CENTRED:
                return x
            for part in _PARTS:
                there = self.at(x + part * step)
                if there is not None and there[0] - value + part * (aim @ step) <= -0.1 * part * decrease:
                    break
            else:
                return x
            x, here = x + part * step, there
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

    cones, walls = np.zeros((len(groups), 3, 2 + len(idle))), np.zeros((len(stops), 2 + len(idle)))
    for cone, group in zip(cones, groups, strict=True):
        k, own = group[0], most[group[0]]
        cone[0] = [1.0, *(slope[k] @ ways / own), -1.0]
        cone[1 : 1 + len(group), 0] = forces[n_stops + group] / own
        cone[1 : 1 + len(group), 1:-1] = ways[n_stops + group] / own
    walls[:, 0], walls[:, 1:-1] = 1.0, ways[stops] / forces[stops, None]
    x = np.zeros(len(idle) + 1)
    # Inside, also where a load is that of a foot which bears next to nothing.
    x[-1] = 1.0 - max(loads) - max(0.5, _INSIDE * max(loads))
    x = _Barrier(cones, walls).most(x)
    return _doing_the_same(here, forces, forces + ways @ x[:-1], rows), float(x[-1])


def _doing_the_same(
    here: LocalDynamics, forces: np.ndarray, others: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    """Return other forces without the round-off by which they do not what some forces do."""
    wrong = here.compliance @ (others - forces)
    others = others.copy()
    others[rows] -= np.linalg.lstsq(here.compliance[:, rows], wrong, rcond=_DEPENDENT)[0]
    return others
