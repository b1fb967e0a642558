"""A friction of given size that sticks, slips or turns while all stops are open and all other frictions slide.

Its force is one that is clipped: what `switching.py` finds by a complementarity problem for many, to the same bits of
the state, in a fifth of the time.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.contact.instant import BALANCED, LIMIT_ROUNDED, UNDECIDED, Instant

if TYPE_CHECKING:
    from symgen.runtime.contact.local_dynamics import LocalDynamics


class LoneFriction(Instant):
    """Finds what becomes of a friction that is the only one of stops and frictions which is held, touched or at rest.

    Parameters
    ----------
    *args
        As of `Instant`.
    """

    def __init__(self, *args: Any):
        super().__init__(*args)
        self._follow_nothing = not (self._coupled.any() or self._smooth.any() or len(self.layout.circles))

    def _settle_alone(self, i: int) -> str | None:
        """Settle the friction whose event has fired, if it is alone; returns what became of it, else None.

        Parameters
        ----------
        i : int
            Its number among stops and frictions.
        """
        if i < self.n_stops or not self._follow_nothing or self.resting.any() or not self._is_alone(i):
            return None
        k, senses, was_stuck = i - self.n_stops, np.sign(self._here().speeds[self.n_stops :]), self.stuck
        before, senses[k] = self.senses, 0.0
        self.senses, self.stuck = senses, np.zeros_like(was_stuck)
        here = self._here()
        onset = self._onset(i, here)
        if onset is None:
            self.senses, self.stuck = before, was_stuck
            return None
        self.senses = senses = senses.copy()
        senses[k], self.stuck[k] = onset, onset == 0.0
        impulses = np.zeros(self.n)
        if onset == 0.0:
            impulses[i] = -(here.speeds[i] * (1.0 / here.compliance[i, i]))
        nq, n = self.system.nq, self.system.nq + self.system.nv
        self.arrays.y[nq:n] += here.change(impulses)
        if was_stuck[k]:
            return "slip"
        return "stick" if self.stuck[k] else "turn"

    def _is_alone(self, i: int) -> bool:
        """Whether no other is held, touched or at rest, within the tolerances of the run."""
        here = self._here()
        if self.n > 1:
            at_rest = np.abs(here.speeds) <= self._speed_tolerances(here)
            at_rest[: self.n_stops] = False
            at_rest |= self.held
            at_rest[i] = False
            if at_rest.any():
                return False
        if self.n_stops and not (self._watched()[0] > self._gap_tolerances(here)).all():
            return False
        return bool(np.isfinite(here.speeds).all())

    def _onset(self, i: int, here: LocalDynamics) -> float | None:
        """In which direction the friction begins to slide, 0 where it sticks: see `Holding._sticking`.

        None where that does not follow from it alone: constraints prescribe its speed, or something is not finite.
        """
        free, compliance, force, most = self._clipped(i, here)
        if not math.isfinite(force) or here.led[i]:
            return None
        pulled = free + compliance * force
        small = UNDECIDED * float(here.sizes_of_free[i])
        balanced = BALANCED * (abs(free) + compliance * (abs(force) + most))
        if abs(pulled) <= max(small, balanced) and abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most:
            return 0.0
        if abs(pulled) <= small:  # at its limit, which it may be about to leave on either side
            forces = np.zeros(self.n)
            forces[i] = force
            _, _, force, most = self._clipped(i, self._later(here, forces))
            if not math.isfinite(force):
                return None
            if abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most:
                return 0.0
        return -math.copysign(1.0, force) if force != 0.0 else float(np.sign(pulled))

    def _clipped(self, i: int, here: LocalDynamics) -> tuple[float, float, float, float]:
        """Acceleration of the sliding without the friction, by a unit of it, the force that holds, and the largest."""
        free, compliance = float(here.free[i]), float(here.compliance[i, i])
        most = max(float(self._watched(here)[3][i - self.n_stops]), 0.0)
        if not compliance > 0.0:
            return free, compliance, math.nan, most
        return free, compliance, min(max(-free / compliance, -most), most), most
