"""Forces (or impulses) of stops and frictions where some friction sticks in two directions: Coulomb's circle.

The vector x of such a friction is no longer than its level L, and where it is, it is opposite to the acceleration. Laws
of this kind are x = Π(x - ρ u) with the accelerations u = free + A x, the projection Π on what x may be, which depends
on x where L does, and any ρ > 0: Alart, Curnier, A mixed formulation for frictional contact problems prone to Newton
like solution methods, Comput. Methods Appl. Mech. Eng. 92 (1991). Newton's method solves them for all at once; where it
does not, sweeps over the contacts, one after another, bring it near (Jourdan, Alart, Jean, A Gauss-Seidel like
algorithm to solve frictional contact problems, Comput. Methods Appl. Mech. Eng. 155 (1998)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symgen.runtime.contact.levels import Levels, NoSolution
from symgen.runtime.contact.local_dynamics import LocalDynamics

_ROUNDS = 40
_FEW_ROUNDS = 2  # where there is something else to do if no forces are found
_SWEEPS = 25  # of a round
_NEWTON_STEPS = 50  # at the limit of what frictions hold it converges linearly
_SOLVED = 1e-13  # of the largest force
_REDUNDANT = 1e-12  # singular values below this part of the largest: forces that others can take over
_ROUND_OFF = 1e-15


@dataclass(frozen=True)
class ContactLaw:
    """What `coulomb_forces` is given, whose parameters see."""

    here: LocalDynamics | _Touching
    free: np.ndarray
    acting: np.ndarray
    senses: np.ndarray
    levels: Levels
    circles: np.ndarray
    driven: bool

    @property
    def n_stops(self) -> int:
        """How many of the forces are those of stops."""
        return len(self.free) - len(self.levels.fixed)

    @cached_property
    def steepness(self) -> np.ndarray:
        """ρ of each force, of two directions the same: one over the compliance."""
        own = np.diag(self.here.compliance).copy()
        for i, j in self.circles + self.n_stops:
            own[i] = own[j] = max(own[i], own[j])
        return 1.0 / np.where(own > 0.0, own, 1.0)

    def defect(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return x - Π(x - ρ u) and its derivative by x."""
        n, n_stops, A = len(x), self.n_stops, self.here.compliance
        c, slope = self.levels.linear(self.here, x, float(self.driven))
        level, rho = c + slope @ x, self.steepness
        trial = x - rho * (self.free + A @ x)
        by_x = np.eye(n) - rho[:, None] * A
        value, change = np.zeros(n), np.zeros((n, n))
        still = self.acting[n_stops:]
        for i in np.flatnonzero(self.acting[:n_stops] & (trial[:n_stops] > 0.0)):
            value[i], change[i] = trial[i], by_x[i]
        for k in np.flatnonzero(~still & (self.levels.coefficients > 0.0)):
            value[n_stops + k], change[n_stops + k] = -self.senses[k] * level[k], -self.senses[k] * slope[k]
        in_circles = np.zeros(len(still), dtype=bool)
        in_circles[self.circles] = True
        for k in np.flatnonzero(still & ~in_circles):
            i = n_stops + k
            most = max(level[k], 0.0)
            inside = abs(trial[i]) <= most
            side = np.sign(trial[i])
            value[i] = trial[i] if inside else side * most
            change[i] = by_x[i] if inside else side * slope[k] * (level[k] > 0.0)
        for k, other in self.circles[still[self.circles[:, 0]]]:
            rows = np.array([n_stops + k, n_stops + other])
            vector, most = trial[rows], max(level[k], 0.0)
            size = float(np.hypot(*vector))
            if size <= most:
                value[rows], change[rows] = vector, by_x[rows]
            elif size > 0.0:
                unit = vector / size
                value[rows] = most * unit
                across = (np.eye(2) - np.outer(unit, unit)) * (most / size)
                change[rows] = across @ by_x[rows] + np.outer(unit, slope[k]) * (level[k] > 0.0)
        return x - value, np.eye(n) - change


class _Touching:
    """What laws ask of `LocalDynamics`, of some of the forces alone."""

    def __init__(self, here: LocalDynamics, kept: np.ndarray):
        self._here, self._kept, self.compliance = here, kept, here.compliance[np.ix_(kept, kept)]

    @property
    def free_multipliers(self) -> np.ndarray:
        return self._here.free_multipliers

    @property
    def multiplier_responses(self) -> np.ndarray:
        return self._here.multiplier_responses[:, self._kept]


def _of_what_touches(law: ContactLaw) -> tuple[ContactLaw, np.ndarray]:
    """Return the law of the forces that can be other than zero, and which ones these are.

    Two boxes have 24 stops and as many frictions in two directions; few of them touch at once.
    """
    n_stops, levels, still = law.n_stops, law.levels, law.acting[law.n_stops :]
    pressed = np.array([stop is None or law.acting[stop] for stop, _ in levels.normals], dtype=bool)
    moves = np.where(still, (levels.fixed > 0.0) | pressed, (levels.coefficients > 0.0) & pressed)
    moves[law.circles] = moves[law.circles].any(axis=1, keepdims=True)
    kept = np.flatnonzero(np.concatenate([law.acting[:n_stops], moves]))
    stops, frictions = kept[kept < n_stops], kept[kept >= n_stops] - n_stops
    normals = [
        (None if stop is None else int(np.searchsorted(stops, stop)), rows)
        for stop, rows in (levels.normals[k] for k in frictions)
    ]
    return ContactLaw(
        _Touching(law.here, kept), law.free[kept], law.acting[kept], law.senses[frictions],
        Levels(levels.fixed[frictions], levels.coefficients[frictions], normals),
        np.searchsorted(frictions, law.circles[moves[law.circles[:, 0]]]), law.driven,
    ), kept  # fmt: skip


def circle_forces(law: ContactLaw, *, briefly: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Find the forces of stops and frictions, and the levels of frictions, of a law with circles.

    Parameters
    ----------
    law : ContactLaw
    briefly : bool
        Whether to give up soon.

    Returns
    -------
    forces : ndarray, shape (n,)
    levels : ndarray, shape (number of frictions,)

    Raises
    ------
    symgen.runtime.contact.levels.NoSolution
    """
    if not np.isfinite(law.free).all():
        raise NoSolution
    x = np.zeros(len(law.free))
    touching, kept = _of_what_touches(law)
    x[kept] = _solved(touching, _FEW_ROUNDS if briefly else _ROUNDS)
    c, slope = law.levels.linear(law.here, x, float(law.driven))
    return x, c + slope @ x


def _solved(law: ContactLaw, rounds: int) -> np.ndarray:
    # All that is held shares the load evenly, where no friction is at its limit then.
    x, rows = np.zeros(len(law.free)), np.flatnonzero(law.acting)
    held = law.here.compliance[np.ix_(rows, rows)]
    x[rows] = -np.linalg.lstsq(held, law.free[rows], rcond=_REDUNDANT)[0]
    for k in range(rounds):
        for _ in range(_SWEEPS if k else 0):
            x = _sweep(law, x)
        found = _newton(law, x)
        if found is not None:
            return found
    raise NoSolution


def _newton(law: ContactLaw, x: np.ndarray) -> np.ndarray | None:
    """Return what Newton's method finds from some forces; None where it goes astray."""
    for _ in range(_NEWTON_STEPS):
        defect, slope = law.defect(x)
        size = max(np.abs(x).max(initial=0.0), np.abs(law.steepness * law.free)[law.acting].max(initial=0.0))
        if not np.isfinite(defect).all() or size == np.inf:
            return None
        if np.abs(defect).max(initial=0.0) <= _SOLVED * size:
            # One more step leaves nothing but round-off.
            polished = x - np.linalg.lstsq(slope, defect, rcond=_REDUNDANT)[0]
            after = law.defect(polished)[0]
            better = np.abs(after).max(initial=0.0) <= np.abs(defect).max(initial=0.0)
            return polished if better else x
        x = x - np.linalg.lstsq(slope, defect, rcond=_REDUNDANT)[0]
    return None


def _sweep(law: ContactLaw, x: np.ndarray) -> np.ndarray:
    """One pass over the contacts: each takes the force that its law asks for while the others are as they are."""
    x, n_stops, A, rho = x.copy(), law.n_stops, law.here.compliance, law.steepness
    c, slope = law.levels.linear(law.here, x, float(law.driven))
    second = {int(i): int(j) for i, j in law.circles + n_stops}
    for i in (i for i in range(len(x)) if i not in second.values()):
        rows, k = [i, second[i]] if i in second else [i], i - n_stops
        trial = x[rows] - rho[rows] * (law.free[rows] + A[rows] @ x)
        if k < 0:
            x[i] = max(trial[0], 0.0) if law.acting[i] else 0.0
            continue
        level, others = c[k] + slope[k] @ x, np.subtract(rows, n_stops)
        if law.acting[i]:
            most, size = max(level, 0.0), np.linalg.norm(trial)
            x[rows] = trial if size <= most else most / size * trial
        else:
            x[rows] = np.where(law.levels.coefficients[others] > 0.0, -law.senses[others] * level, 0.0)
    return x
