"""Which stops are closed and which frictions stick: found at the start and at each event, written into `p`."""

from __future__ import annotations

import numpy as np

from symgen.runtime.contact.holding import Holding
from symgen.runtime.contact.impact import impulses
from symgen.runtime.contact.local_dynamics import LocalDynamics
from symgen.runtime.errors import ContactError, RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.positions import Positions

_VIOLATED = 1e-6  # gap at the start, in parts of the coordinates' sizes, from which on it is an error
_WITHIN_STEPS = 2.0  # the pull may grow while a gap opens
_AT_REST = 1e-6  # of what a sliding speed changes by in a step: at its event it is zero but for round-off


class Switching(Holding):
    """Acts on the events of stops and frictions."""

    def start(self) -> None:
        """Find what holds at the start, and act on impacts there.

        Raises
        ------
        RuntimeModelError
            A stop is violated.
        """
        gaps = self._watched()[0]
        for i in np.flatnonzero(gaps < -_VIOLATED * self._size()):
            raise RuntimeModelError(
                f"stop {self.names[i]!r} is violated at the start: its gap is {gaps[i]:.6g}; give a start at which it "
                "is zero or more"
            )
        here = self._here()
        self._decide(gaps <= self._gap_tolerances(here), gaps <= self._round_off(here), self.stuck)

    def act(self, fired: np.ndarray) -> list[tuple[int, str]]:
        """Act on the stops and frictions whose events fired, and on all that they touch.

        Parameters
        ----------
        fired : ndarray of int
            Their indices among the switches. With none of them, forces have jumped: what is held by now follows anew.

        Returns
        -------
        list of (int, str)
            The indices of those that fired, or else of those that changed, and what became of each: impact, release,
            stick, slip or turn.
        """
        if not len(fired):
            self._last = None  # inputs have other values at the same time
        is_fired = np.zeros(self.n, dtype=bool)
        is_fired[fired] = True
        were_held = self._at_rest
        self._end_unseen_flights(is_fired[: self.n_stops])
        gaps = self._watched()[0]
        here = self._here()
        struck = self.closed | is_fired[: self.n_stops] | (gaps <= self._round_off(here))
        near = struck | (gaps <= self._gap_tolerances(here))
        self._decide(near, struck, self.stuck | (is_fired[self.n_stops :] & self._came_to_rest(here)))
        told = fired if len(fired) else np.flatnonzero(were_held != self._at_rest)
        return [(int(i), self._became(i, were_held[i])) for i in told]

    def _end_unseen_flights(self, fired: np.ndarray) -> None:
        """Take the speed from gaps that opened by their rates, but whose next step closes them from its start.

        To a method of order 1 whose step goes where its end moves, a rise that ends within the step is none: it would
        fall on the stop for ever.
        """
        here = self._here()
        rising, pulled = here.speeds[: self.n_stops], -here.free[: self.n_stops]
        unseen = fired & ~self.closed & (rising > self._speed_tolerances(here)[: self.n_stops])
        unseen &= rising < _WITHIN_STEPS * pulled * float(self.arrays.control[at.H])
        if unseen.any():
            nq, n = self.system.nq, self.system.nq + self.system.nv
            rows = np.concatenate([unseen, np.zeros(self.n - self.n_stops, dtype=bool)])
            self.arrays.y[nq:n] += here.holding(rows, here.speeds)

    def _became(self, i: int, was_held: bool) -> str:
        if i < self.n_stops:
            return "release" if was_held else "impact"
        if was_held:
            return "slip"
        return "stick" if self._at_rest[i] else "turn"

    def objection(self) -> str:
        """Why there is no going on from here: reactions are not unique, or friction with them leaves no one motion."""
        if not self._coupled.any():
            return ""
        here = self._here()
        if here.has_dependent_constraints and self._directions(here)[self._coupled].any():
            return (
                f"friction in proportion to reactions ({', '.join(self._coupled_names)}) is not known at "
                f"t = {self.arrays.t:.9g} s: constraints of the model depend on each other there, and their forces are "
                "not unique; leave out the constraints that follow from others"
            )
        for place in (self._here, self._a_step_ahead):
            try:
                here = place()
                levels = self._levels(self.stuck, here)
                forces, _ = self._forces(here, self.held, levels)
                self._check_unique(here, self.closed, self.stuck, levels, forces)
            except ContactError as error:
                return str(error)
            except np.linalg.LinAlgError:  # not a number: another reason to stop
                return ""
        return ""

    def _a_step_ahead(self) -> LocalDynamics:
        """Where the step that failed would have ended, but for accelerations."""
        arrays, nq, n = self.arrays, self.system.nq, self.system.nq + self.system.nv
        h = float(arrays.control[at.H_LAST])
        y = arrays.y[:n].copy()
        y = Positions(self.system).move(y[:nq], h * y[nq:]), y[nq:]
        return LocalDynamics(self.system, arrays.p, arrays.t + h, np.concatenate(y))

    def _came_to_rest(self, here: LocalDynamics) -> np.ndarray:
        """Which frictions have no speed if they fired; those that follow reactions may have come to a paradox."""
        speeds = np.abs(here.speeds[self.n_stops :])
        last = np.abs(here.free[self.n_stops :]) * self.arrays.h_last
        small = np.maximum(self._speed_tolerances(here)[self.n_stops :], _AT_REST * last)
        return ~self._coupled | (speeds <= small)

    def _decide(self, near: np.ndarray, struck: np.ndarray, slow: np.ndarray) -> None:
        """Settle impacts, then what stays closed or sticks, and in which direction the rest slides.

        Parameters
        ----------
        near : ndarray of bool
            Stops whose gaps are zero within the tolerances of the run: they may stay closed.
        struck : ndarray of bool
            Those whose gaps are zero but for round-off. Others have impacts of their own, however soon.
        slow : ndarray of bool
            Frictions that may stick.
        """
        impacted = self._impact(struck)
        here = self._here()
        closing = here.speeds[: self.n_stops] < -self._speed_tolerances(here)[: self.n_stops]
        touching = near & (struck | ~closing)
        speeds = here.speeds[self.n_stops :]
        still = np.abs(speeds) <= self._speed_tolerances(here)[self.n_stops :]
        if not impacted:  # else rates have jumped, and what stuck may slide
            still = still | slow
        led = here.led[self.n_stops :]
        onward = np.where(led & still, self._led_onward(here), np.sign(speeds))
        still = still & ~self._smooth & ~led
        self.stuck, self.senses = np.zeros_like(self.stuck), np.where(still | self._smooth, 0.0, onward)
        held = self._settle(touching, struck, still & self._pressed(touching))
        self.closed, self.stuck = held[: self.n_stops], held[self.n_stops :]
        nq, n = self.system.nq, self.system.nq + self.system.nv
        self.arrays.y[nq:n] += here.holding(held, here.speeds)

    def _impact(self, touching: np.ndarray) -> bool:
        """Change the rates where touching gaps are closing; returns whether they did."""
        here = self._here()
        if not (touching & (here.speeds[: self.n_stops] < 0.0)).any():
            return False
        _, restitutions, coefficients, _ = self._watched()
        rubbing = self._coupled & self._pressed(touching)
        law = {"sequential": self.system.sequential_impacts}
        given = (touching, rubbing, restitutions, coefficients, self.normals)
        found = self._solved(lambda: impulses(here, *given, **law))
        nq, n = self.system.nq, self.system.nq + self.system.nv
        self.arrays.y[nq:n] += here.change(found)
        return True
