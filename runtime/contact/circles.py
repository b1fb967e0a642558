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

import numpy as np

from symgen.runtime.contact.levels import Levels, NoSolution
from symgen.runtime.contact.local_dynamics import LocalDynamics

_ROUNDS = 40
_SWEEPS = 25  # of a round
_NEWTON_STEPS = 25
_SOLVED = 1e-13  # of the largest force
_REDUNDANT = 1e-12  # singular values below this part of the largest: forces that others can take over
_ROUND_OFF = 1e-15


@dataclass(frozen=True)
class ContactLaw:
    """What `coulomb_forces` is given, whose parameters see."""

    here: LocalDynamics
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

    @property
    def steepness(self) -> np.ndarray:
        """ρ of each force, of two directions the same: one over the compliance."""
        own = np.diag(self.here.compliance).copy()
        for i, j in self.circles + self.n_stops:
            own[i] = own[j] = max(own[i], own[j])
        return 1.0 / np.where(own > 0.0, own, 1.0)

    def defect(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return x - Π(x - ρ u), its derivative by x, and the levels."""
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
        return x - value, np.eye(n) - change, level


def circle_forces(law: ContactLaw) -> tuple[np.ndarray, np.ndarray]:
    """Find the forces of stops and frictions, and the levels of frictions, of a law with circles.

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
    # All that is held shares the load evenly, where no friction is at its limit then.
    x, rows = np.zeros(len(law.free)), np.flatnonzero(law.acting)
    held = law.here.compliance[np.ix_(rows, rows)]
    x[rows] = -np.linalg.lstsq(held, law.free[rows], rcond=_REDUNDANT)[0]
    for _ in range(_ROUNDS):
        found = _newton(law, x)
        if found is not None:
            return found
        for _ in range(_SWEEPS):
            x = _sweep(law, x)
    raise NoSolution


def _newton(law: ContactLaw, x: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return what Newton's method finds from some forces; None where it goes astray."""
    for _ in range(_NEWTON_STEPS):
        defect, slope, level = law.defect(x)
        size = max(np.abs(x).max(initial=0.0), np.abs(law.steepness * law.free)[law.acting].max(initial=0.0))
        if not np.isfinite(defect).all() or size == np.inf:
            return None
        if np.abs(defect).max(initial=0.0) <= _SOLVED * size:
            # One more step leaves nothing but round-off.
            polished = x - np.linalg.lstsq(slope, defect, rcond=_REDUNDANT)[0]
            after, _, its_level = law.defect(polished)
            better = np.abs(after).max(initial=0.0) <= np.abs(defect).max(initial=0.0)
            return (polished, its_level) if better else (x, level)
        x = x - np.linalg.lstsq(slope, defect, rcond=_REDUNDANT)[0]
    return None


def _sweep(law: ContactLaw, x: np.ndarray) -> np.ndarray:
    """One pass over the contacts: each takes the force that its law asks for while the others are as they are."""
    x, seen = x.copy(), np.zeros(len(x), dtype=bool)
    partner = {int(i): int(j) for i, j in law.circles + law.n_stops}
    for i in range(len(x)):
        if not seen[i]:
            rows = [i, partner[i]] if i in partner else [i]
            x[rows] -= law.defect(x)[0][rows]
            seen[rows] = True
    return x
