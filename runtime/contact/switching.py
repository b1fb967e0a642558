"""Which stops are closed and which frictions stick: found at the start and at each event, written into `p`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.contact.complementarity import NoSolution, bounded
from runtime.contact.local_dynamics import LocalDynamics
from runtime.errors import RuntimeModelError
from runtime.integrate import layout as at

if TYPE_CHECKING:
    from runtime.loop_arrays import LoopArrays
    from runtime.system import System

_VIOLATED = 1e-6  # gap at the start, in parts of the coordinates' sizes, from which on it is an error
_SURELY_SEEN = 64.0  # times round-off: a flight that high is not lost between a rebound and its end
_UNDECIDED = 1e-9  # of the largest acceleration: what presses as little does not tell whether it stays
_AT_LIMIT = 1e-10  # of the range of a friction force
_DEPENDENT = 1e-8  # of a row's compliance that is left once others are held: they hold it as well
_AHEAD = 1e-7  # of the time that the motion takes to change


class Switching:
    """The stops and frictions of one run.

    Parameters
    ----------
    system : System
        With switches.
    arrays : LoopArrays

    Attributes
    ----------
    closed, stuck : ndarray of bool
        Stops that are closed, frictions that stick.
    senses : ndarray
        In which direction each friction slides: 1, -1, or 0 where it sticks.
    """

    def __init__(self, system: System, arrays: LoopArrays):
        self.system, self.arrays = system, arrays
        kinds = [switch["kind"] for switch in system.switches]
        self.names = [switch["name"] for switch in system.switches]
        self.n_stops, self.n = kinds.count("stop"), len(kinds)
        self.closed = np.zeros(self.n_stops, dtype=bool)
        self.stuck = np.zeros(self.n - self.n_stops, dtype=bool)
        self.senses = np.zeros(self.n - self.n_stops)

    @property
    def settings(self) -> np.ndarray:
        """The numbers in `p` that say all this."""
        frictions = np.column_stack([self.stuck, self.senses]).ravel()
        return np.concatenate([self.closed.astype(float), frictions])

    @settings.setter
    def settings(self, values: np.ndarray) -> None:
        self.closed = values[: self.n_stops] != 0.0
        frictions = values[self.n_stops :].reshape(-1, 2)
        self.stuck, self.senses = frictions[:, 0] != 0.0, frictions[:, 1].copy()

    @property
    def any_held(self) -> bool:
        """Whether some stop is closed or some friction sticks: the closed form of the model then applies."""
        return bool(self.held.any())

    @property
    def held(self) -> np.ndarray:
        """Which stops are closed and which frictions stick, one after another."""
        return np.concatenate([self.closed, self.stuck])

    @property
    def held_names(self) -> list[str]:
        """The names of the stops that are closed and of the frictions that stick."""
        return [name for name, held in zip(self.names, self.held, strict=True) if held]

    def start(self) -> None:
        """Find what holds at the start, and act on impacts there.

        Raises
        ------
        RuntimeModelError
            A stop is violated.
        """
        gaps, _, _, _ = self._watched()
        for i in np.flatnonzero(gaps < -_VIOLATED * self._size()):
            raise RuntimeModelError(
                f"stop {self.names[i]!r} is violated at the start: its gap is {gaps[i]:.6g}; give a start at which it "
                "is zero or more"
            )
        self._decide(gaps <= self._gap_tolerances(LocalDynamics(*self._here())), self.stuck)

    def act(self, fired: np.ndarray) -> list[str]:
        """Act on the stops and frictions whose events fired, and on all that they touch.

        Parameters
        ----------
        fired : ndarray of int
            Their indices among the switches.

        Returns
        -------
        list of str
            What became of each: impact, release, stick or slip.
        """
        is_fired = np.zeros(self.n, dtype=bool)
        is_fired[fired] = True
        were_closed, were_stuck = self.closed.copy(), self.stuck.copy()
        gaps, _, _, _ = self._watched()
        here = LocalDynamics(*self._here())
        touching = self.closed | is_fired[: self.n_stops] | (gaps <= self._gap_tolerances(here))
        self._decide(touching, self.stuck | is_fired[self.n_stops :])
        return [
            ("release" if were_closed[i] else "impact")
            if i < self.n_stops
            else (
                "slip"
                if were_stuck[i - self.n_stops]
                else "stick"
                if self.stuck[i - self.n_stops]
                else "turn"
            )
            for i in fired
        ]

    def _decide(self, touching: np.ndarray, slow: np.ndarray) -> None:
        """Settle impacts, then what stays closed or sticks, and in which direction the rest slides."""
        impacted = self._impact(touching)
        _, _, speeds, levels = self._watched()
        here = LocalDynamics(*self._here())
        still = np.abs(speeds) <= self._speed_tolerances(here)[self.n_stops :]
        if not impacted:  # else rates have jumped, and what stuck may slide
            still = still | slow
        self.senses = np.where(still, 0.0, np.sign(speeds))
        here = LocalDynamics(*self._here())
        held, forces, accelerations = self._held(here, touching, still, levels)
        self.closed, self.stuck = held[: self.n_stops], held[self.n_stops :]
        beginning = still & ~self.stuck
        opposed, pulled = forces[self.n_stops :], accelerations[self.n_stops :]
        onset = np.where(opposed != 0.0, -np.sign(opposed), np.sign(pulled))
        self.senses = np.where(beginning, onset, np.where(self.stuck, 0.0, self.senses))
        nq, n = self.system.nq, self.system.nq + self.system.nv
        self.arrays.y[nq:n] += here.holding(held, here.speeds)

    def _impact(self, touching: np.ndarray) -> bool:
        """Change the rates by Newton's law where touching gaps are closing; returns whether they did.

        Moreau's form for several at once: the gap's rate u changes by impulses Λ >= 0 so that u' + e u >= 0, and is
        zero where Λ > 0 (Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; Glocker,
        Set-Valued Force Laws, 2001, ch. 8). Frictions are bounded forces: they take no part.
        """
        here = LocalDynamics(*self._here())
        speeds = here.speeds[: self.n_stops]
        if not (touching & (speeds < 0.0)).any():
            return False
        _, restitutions, _, _ = self._watched()
        i = np.flatnonzero(touching)
        matrix = here.compliance[np.ix_(i, i)]
        impulses = np.zeros(self.n)
        impulses[i] = self._solved(
            matrix, (1.0 + restitutions[i]) * speeds[i], np.zeros(len(i)), np.full(len(i), np.inf)
        )
        nq, n = self.system.nq, self.system.nq + self.system.nv
        self.arrays.y[nq:n] += here.change(impulses)
        return True

    def _held(
        self, here: LocalDynamics, touching: np.ndarray, still: np.ndarray, levels: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Find what is held by forces that are allowed; returns (held, forces, accelerations), shape (n,) each.

        A gap that opens so slowly that its flight would stay below the tolerances of the run is held as well: there
        are no ever smaller rebounds.
        """
        candidates = np.concatenate([touching, still])
        lower = np.concatenate([np.zeros(self.n_stops), -levels])
        upper = np.concatenate([np.full(self.n_stops, np.inf), levels])
        heights = self._gap_tolerances(here)
        while True:
            i = np.flatnonzero(candidates)
            forces = np.zeros(self.n)
            forces[i] = self._solved(here.compliance[np.ix_(i, i)], here.free[i], lower[i], upper[i])
            # Left out alone, a gap that is pressed shut would fall with this acceleration.
            pull = np.diag(here.compliance)[: self.n_stops] * forces[: self.n_stops]
            flight = np.where(touching & (pull > 0.0), np.maximum(here.speeds[: self.n_stops], 0.0) ** 2, 0.0)
            excess = flight - 2.0 * pull * heights
            if not (candidates[: self.n_stops] & (excess > 0.0)).any():
                break
            candidates[int(np.argmax(np.where(candidates[: self.n_stops], excess, -np.inf)))] = False
        accelerations = here.free + here.compliance @ forces
        # A friction that has just begun to slip is at its limit but for round-off.
        margin = np.where(np.isfinite(upper), _AT_LIMIT * (upper - lower), 0.0)
        held = candidates & (forces > lower + margin) & (forces < upper - margin)
        weak = np.zeros(self.n, dtype=bool)
        small = _UNDECIDED * np.abs(here.free).max(initial=0.0)
        weak[: self.n_stops] = candidates[: self.n_stops] & (
            np.abs(np.diag(here.compliance) * forces)[: self.n_stops] <= small
        )
        weak &= (np.abs(accelerations) <= small) & (np.abs(here.speeds) <= self._speed_tolerances(here))
        pressing = weak & self._falls_ahead(here) if weak.any() else weak
        return _independent(here.compliance, [held & ~weak, pressing]), forces, accelerations

    def _falls_ahead(self, here: LocalDynamics) -> np.ndarray:
        """Which gaps that neither press nor open now will press a moment later."""
        system, arrays = self.system, self.arrays
        y = arrays.y[: system.nq + system.nv]
        self.write()
        slope = system.kernel("rhs")(arrays.t, y, arrays.p)[: len(y)]
        speed, size = np.abs(slope).max(), max(1.0, np.abs(y).max())
        ahead = _AHEAD * (size / speed if speed > 0.0 else 1.0)
        later = LocalDynamics(system, arrays.p, arrays.t + ahead, y + ahead * slope)
        return later.free <= here.free

    def _solved(self, matrix: np.ndarray, b: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        try:
            return bounded(matrix, b, lower, upper)
        except NoSolution:
            raise RuntimeModelError(
                f"the stops {', '.join(self.names[: self.n_stops])} cannot all be kept at t = {self.arrays.t:.9g} s: "
                "look for stops that contradict each other or a constraint there"
            ) from None

    def _here(self) -> tuple[System, np.ndarray, float, np.ndarray]:
        arrays = self.arrays
        self.write()
        return self.system, arrays.p, arrays.t, arrays.y[: self.system.nq + self.system.nv].copy()

    def write(self) -> None:
        """Write the settings into `p`."""
        self.arrays.p[self.system.n_settable :] = self.settings

    def _watched(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return gaps, restitutions, sliding speeds, the largest friction forces of what sticks."""
        system, arrays = self.system, self.arrays
        y = arrays.y[: system.nq + system.nv]
        values = system.kernel("switches")(arrays.t, y, arrays.p)
        stops, frictions = (
            values[: 2 * self.n_stops].reshape(-1, 2),
            values[2 * self.n_stops :].reshape(-1, 3),
        )
        return stops[:, 0], stops[:, 1], frictions[:, 0], np.maximum(frictions[:, 2], 0.0)

    def _size(self) -> float:
        return max(1.0, float(np.abs(self.arrays.y[: self.system.nq]).max(initial=0.0)))

    def _gap_tolerances(self, here: LocalDynamics) -> np.ndarray:
        """How much of each gap the tolerances of the run leave open."""
        c, rows = self.arrays.control, np.abs(here.rows[: self.n_stops]).sum(axis=1)
        own = rows * (c[at.ATOL] + c[at.RTOL] * self._size())
        round_off = np.finfo(float).eps * rows * self._size()
        return np.maximum(own, _SURELY_SEEN * round_off)

    def _speed_tolerances(self, here: LocalDynamics) -> np.ndarray:
        c, v = self.arrays.control, self.arrays.y[self.system.nq : self.system.nq + self.system.nv]
        rows = np.abs(here.rows)
        return rows.sum(axis=1) * (c[at.ATOL] + 1e-15) + max(c[at.RTOL], 1e-15) * (rows @ np.abs(v))


def _independent(compliance: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    """Return the rows of some groups, first ones first, that do not follow from those before.

    A table on four feet stands on three of them; the fourth is taken up when one of these lets go.
    """
    kept: list[int] = []
    for group in groups:
        for i in np.flatnonzero(group):
            own, cross = compliance[i, i], compliance[kept, i]
            left = own - cross @ np.linalg.solve(compliance[np.ix_(kept, kept)], cross) if kept else own
            if left > _DEPENDENT * own:
                kept.append(int(i))
    result = np.zeros(len(compliance), dtype=bool)
    result[kept] = True
    return result
