"""What is held by forces that are allowed: stops that stay closed, frictions that stick."""

from __future__ import annotations

import numpy as np

from symgen.runtime.contact.coulomb import Levels, check_unique
from symgen.runtime.contact.instant import Instant
from symgen.runtime.contact.local_dynamics import LocalDynamics
from symgen.runtime.positions import Positions

_UNDECIDED = 1e-9  # of the largest acceleration: what presses as little does not tell whether it stays
_ROUNDED = 1e-13  # of the accelerations that a force balances
_AT_LIMIT = 1e-10  # of the range of a friction force
_DEPENDENT = 1e-8  # of a row's compliance that is left once others are held: they hold it as well
_AHEAD = 1e-7  # of the time that the motion takes to change


class Holding(Instant):
    """Finds what is held at the present state."""

    def _settle(self, touching: np.ndarray, struck: np.ndarray, still: np.ndarray) -> np.ndarray:
        """Find what is held by forces that are allowed, of `still` frictions those that stick.

        Gaps that are zero but for round-off (`struck`) stay closed without being pressed, too.
        What begins to slide takes its sliding force, and the rest is looked at again. Sets `senses` and `resting`.
        """
        waiting = still
        while True:
            here, levels = self._here(), self._levels(still)
            touching, forces, most = self._landed(here, touching, still, levels)
            acting = np.concatenate([touching, still])
            accelerations = here.free + here.compliance @ forces
            sticks, onset = self._sticking(here, acting, levels, forces, most)
            slipping = still & ~sticks
            if not slipping.any():
                break
            self.senses = np.where(slipping, onset, self.senses)
            still = sticks
        held = np.concatenate([touching & self._press(here, forces), sticks])
        weak = self._weak(here, touching & struck, forces, accelerations)
        pressing = weak & (self._later(here, forces).free <= here.free) if weak.any() else weak
        kept = _independent(here.compliance, [held & ~weak, pressing])
        self.resting = waiting & ~kept[self.n_stops :] & _follow(here.compliance, kept)[self.n_stops :]
        self._share(here, sticks & ~kept[self.n_stops :], forces)
        in_touch = touching & (here.speeds[: self.n_stops] <= self._speed_tolerances(here)[: self.n_stops])
        self._check_unique(here, in_touch, kept[self.n_stops :], levels, forces)
        return kept

    def _press(self, here: LocalDynamics, forces: np.ndarray) -> np.ndarray:
        """Which stops bear a force that is more than round-off of the accelerations which it balances."""
        pull = (np.diag(here.compliance) * forces)[: self.n_stops]
        return (
            pull
            > _ROUNDED * (np.abs(here.rows) @ np.abs(here.accelerations(np.zeros(self.n))))[: self.n_stops]
        )

    def _landed(
        self, here: LocalDynamics, touching: np.ndarray, still: np.ndarray, levels: Levels
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return which of the stops stay in touch, the forces, and the levels of frictions.

        A gap that opens so slowly that its flight would stay below the tolerances of the run stays: there are no ever
        smaller rebounds.
        """
        touching, heights = touching.copy(), self._gap_tolerances(here)
        while True:
            forces, most = self._forces(
                here, np.concatenate([touching, still & self._pressed(touching)]), levels
            )
            # Left out alone, a gap that is pressed shut would fall with this acceleration.
            pull = np.diag(here.compliance)[: self.n_stops] * forces[: self.n_stops]
            flight = np.where(touching & (pull > 0.0), np.maximum(here.speeds[: self.n_stops], 0.0) ** 2, 0.0)
            excess = flight - 2.0 * pull * heights
            if not (touching & (excess > 0.0)).any():
                return touching, forces, most
            touching[int(np.argmax(np.where(touching, excess, -np.inf)))] = False

    def _sticking(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        levels: Levels,
        forces: np.ndarray,
        most: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which of the frictions that act stick, and in which direction the others begin to slide.

        One that is at its limit, but not accelerated, may be about to leave it on either side: it is judged a moment
        later. So is one that nothing presses yet.
        """
        own, pulled = forces[self.n_stops :], (here.free + here.compliance @ forces)[self.n_stops :]
        small = _UNDECIDED * np.abs(here.free).max(initial=0.0)
        waiting = acting[self.n_stops :]
        # A friction that has just begun to slip is at its limit but for round-off.
        sticks = waiting & (np.abs(own) < (1.0 - 2.0 * _AT_LIMIT) * most)
        undecided = waiting & ~sticks & (np.abs(pulled) <= small)
        if undecided.any():
            later = self._later(here, forces)
            forces, most = self._forces(later, acting, self._levels(waiting, later))
            soon = forces[self.n_stops :]
            sticks |= undecided & (np.abs(soon) < (1.0 - 2.0 * _AT_LIMIT) * most)
            own = np.where(undecided, soon, own)
        return sticks, np.where(own != 0.0, -np.sign(own), np.sign(pulled))

    def _weak(
        self, here: LocalDynamics, touching: np.ndarray, forces: np.ndarray, accelerations: np.ndarray
    ) -> np.ndarray:
        """Which stops neither press nor open now."""
        small = _UNDECIDED * np.abs(here.free).max(initial=0.0)
        weak = np.zeros(self.n, dtype=bool)
        weak[: self.n_stops] = touching & (np.abs(np.diag(here.compliance) * forces)[: self.n_stops] <= small)
        return weak & (np.abs(accelerations) <= small) & (np.abs(here.speeds) <= self._speed_tolerances(here))

    def _later(self, here: LocalDynamics, forces: np.ndarray) -> LocalDynamics:
        """The equations a moment later, on the way that some forces lead."""
        system, nq = self.system, self.system.nq
        q, v, change = here.state[:nq], here.state[nq:], here.accelerations(forces)
        speed = max(np.abs(v).max(initial=0.0), np.abs(change).max(initial=0.0))
        size = max(1.0, np.abs(here.state).max(initial=0.0))
        ahead = _AHEAD * (size / speed if speed > 0.0 else 1.0)
        state = np.concatenate([Positions(system).move(q, ahead * v), v + ahead * change])
        return LocalDynamics(system, self.arrays.p, here.t + ahead, state)

    def _share(self, here: LocalDynamics, others: np.ndarray, forces: np.ndarray) -> None:
        """Let frictions whose motion others hold already keep the part of the force that they have."""
        if not others.any():
            return
        c, slope = self._levels(np.zeros_like(others)).linear(here, forces, 1.0)
        sliding = c + slope @ forces
        shares = -forces[self.n_stops :] / np.where(sliding > 0.0, sliding, np.inf)
        self.senses = np.where(others, shares, self.senses)

    def _led_onward(self, here: LocalDynamics) -> np.ndarray:
        """In which direction frictions whose sliding is prescribed leave a place of rest."""
        small = _UNDECIDED * np.abs(here.accelerations(np.zeros(self.n))).max(initial=0.0)
        return np.where(np.abs(here.free) > small, np.sign(here.free), 0.0)[self.n_stops :]

    def _check_unique(
        self, here: LocalDynamics, touching: np.ndarray, stuck: np.ndarray, levels: Levels, forces: np.ndarray
    ) -> None:
        directions = self._directions(here)
        self._solved(lambda: check_unique(here, touching, stuck, directions, levels, forces))


def _independent(compliance: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    """Return the rows of some groups, first ones first, that do not follow from those before.

    A table on four feet stands on three of them; the fourth is taken up when one of these lets go.
    """
    kept = np.zeros(len(compliance), dtype=bool)
    for group in groups:
        for i in np.flatnonzero(group):
            kept[i] = not _follow(compliance, kept)[i]
    return kept


def _follow(compliance: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return which rows do not move where those that are `kept` do not."""
    own, cross = np.diag(compliance), compliance[kept]
    left = own
    if kept.any():
        left = own - (cross * np.linalg.solve(compliance[np.ix_(kept, kept)], cross)).sum(axis=0)
    return left <= _DEPENDENT * own
