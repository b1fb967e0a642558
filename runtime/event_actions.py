"""What happens at events: resets, the energy they change, when an event may fire again, and Zeno behaviour."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.integrate import layout as at
from runtime.solution import EventRecord

if TYPE_CHECKING:
    from runtime.loop_arrays import LoopArrays
    from runtime.system import System

_PERTURBATION = 4.0 * np.finfo(float).eps
_PROJECTION_NOISE = 4.0  # states on constraints carry the round-off of the projection as well
_ZENO_SHRINKAGE = 1e-7
_CLEAR = 8.0  # times round-off: a flight that high is surely seen
_ZENO_EVENTS = 5


def arm_events(system: System, arrays: LoopArrays, fired: np.ndarray | None = None) -> None:
    """Set on which side of zero the event functions are, from the current state alone.

    A function that is at zero, but for round-off, has no side until it has moved away: at the start, and
    after it fired.

    Parameters
    ----------
    fired : ndarray of int, optional
        Events that have just fired.
    """
    g, floor = event_values_and_floor(system, arrays)
    if fired is not None:
        # The state is past the event by less than the last digit of time; that is no side either.
        floor[fired] = np.maximum(floor[fired], 4.0 * np.abs(g[fired]))
    arrays.event_block(at.FLOOR)[:] = floor
    arrays.event_block(at.SIDE)[:] = np.where(np.abs(g) > floor, np.sign(g), 0.0)


def event_values_and_floor(system: System, arrays: LoopArrays) -> tuple[np.ndarray, np.ndarray]:
    """Return the event functions, and what of them is round-off: their change when all they read moves a little."""
    kernel, t, p = system.kernel("events"), arrays.t, arrays.p
    y = arrays.y[: system.nq + system.nv].copy()
    g = kernel(t, y, p)
    relative = _PERTURBATION * (_PROJECTION_NOISE if system.m or system.quaternions else 1.0)
    floor = np.abs(kernel(t + relative * abs(t), y, p) - g)
    for i in range(len(y)):
        kept = y[i]
        y[i] = kept + relative * abs(kept)
        floor += np.abs(kernel(t, y, p) - g)
        y[i] = kept
    # And the way that they go within the last digits of time.
    dt = relative * abs(t)
    floor += np.abs(kernel(t + dt, y + dt * system.kernel("rhs")(t, y, p)[: len(y)], p) - g)
    return g, np.where(np.isfinite(floor), floor, 0.0)


class EventActions:
    """Acts on the events of one run and keeps their log.

    Attributes
    ----------
    log : list of EventRecord
    energy_of_resets : float [J]
        T + V that resets have added so far.
    """

    def __init__(self, system: System, arrays: LoopArrays):
        self.system, self.arrays = system, arrays
        self.log: list[EventRecord] = []
        self.energy_of_resets = 0.0
        self._zeno = ZenoDetector()

    def act(self) -> tuple[list[EventRecord], bool, float | None]:
        """Act on all events of the current instant, in the order of the model file.

        Returns
        -------
        records : list of EventRecord
        terminate : bool
            Whether one of them ends the run.
        accumulation : float or None [s]
            Where events pile up, if they do.
        """
        system, arrays = self.system, self.arrays
        fired = np.flatnonzero(arrays.event_block(at.FIRED) == 1.0)
        records, terminate, reset = [], False, False
        for index in fired:
            event = system.events[index]
            records.append(self._act_on(event))
            terminate = terminate or event["action"] == "terminate"
            reset = reset or event["action"] == "reset"
        self.log.extend(records)
        arrays.restart(state_changed=reset)
        if reset:
            arm_events(system, arrays, fired)
            arrays.event_block(at.SIDE)[fired] = 0.0
        accumulation = self._zeno.look(arrays.t, self._gets_away(fired)) if reset else None
        return records, terminate, accumulation

    def _gets_away(self, fired: np.ndarray) -> bool:
        """Whether the events that fired leave zero by more than round-off before they would fire again."""
        system, arrays, half = self.system, self.arrays, 0.5 * self._zeno.next_interval(self.arrays.t)
        if half == 0.0:
            return True
        y = arrays.y[: system.nq + system.nv].copy()
        slope = system.kernel("rhs")(arrays.t, y, arrays.p)[: len(y)]
        ahead = system.kernel("events")(arrays.t + half, y + half * slope, arrays.p)
        floor = _CLEAR * arrays.event_block(at.FLOOR)
        return bool(np.any(np.abs(ahead)[fired] > floor[fired]))

    def _act_on(self, event: dict) -> EventRecord:
        system, arrays = self.system, self.arrays
        before = arrays.y[: system.nq + system.nv].copy()
        change = 0.0
        if event["action"] == "reset":
            energy_before = self._energy()
            after = system.kernel(f"reset_{event['name']}")(arrays.t, before, arrays.p)
            arrays.y[: system.nq + system.nv] = after
            self._make_consistent(event["name"], before[system.nq :], after[system.nq :])
            change = self._energy() - energy_before
            self.energy_of_resets += change
        after = arrays.y[: system.nq + system.nv].copy()
        q, nq = slice(None, system.nq), system.nq
        return EventRecord(
            event["name"], event["action"], arrays.t, before[q], before[nq:], after[q], after[nq:], change
        )

    def _make_consistent(self, name: str, before: np.ndarray, after: np.ndarray) -> None:
        """Bring the state back onto the constraints; rates that the reset changed stay, where that is possible."""
        system, arrays = self.system, self.arrays
        if not (system.m or system.quaternions):
            return
        from runtime.integrate.projection import project_state, projection_size

        buffer = np.zeros(projection_size(arrays.sizes))
        status = project_state(
            arrays.addresses,
            arrays.sizes,
            arrays.prepared,
            arrays.t,
            arrays.y,
            arrays.control,
            arrays.counters,
            buffer,
        )
        if status != at.RUNNING:
            raise ResetError(
                f"The reset of event {name!r} at t = {arrays.t:.9g} s leaves a state from which the constraints cannot "
                "be met: reset the coordinates to a position that the mechanism can have."
            )
        given = after != before
        if system.m and given.any():
            from runtime.constraints.after_reset import rates_after_reset

            q = arrays.y[: system.nq].copy()
            rates = rates_after_reset(system, arrays.p, arrays.t, q, after, given)
            if rates is not None:
                arrays.y[system.nq : system.nq + system.nv] = rates

    def _energy(self) -> float:
        system, arrays = self.system, self.arrays
        return float(system.kernel("energy")(arrays.t, arrays.y[: system.nq + system.nv], arrays.p).sum())


class ResetError(Exception):
    """A reset led to a state that the constraints do not allow."""


class ZenoDetector:
    """Notices intervals between resets that shrink to nothing."""

    def __init__(self):
        self._last: float | None = None
        self._intervals: list[float] = []

    def next_interval(self, t: float) -> float:
        """Return how long [s] after a reset at `t` the next is to be expected; 0 where intervals do not shrink."""
        if self._last is None or not self._intervals:
            return 0.0
        interval, before = t - self._last, self._intervals[-1]
        return interval * interval / before if 0.0 < interval < before else 0.0

    def look(self, t: float, gets_away: bool = True) -> float | None:
        """Take the time of a reset [s]; returns where resets pile up once they do.

        `gets_away` says whether the event functions will leave zero by more than round-off: a bounce that is
        lower is not seen to fall again.
        """
        if self._last is None:
            self._last = t
            return None
        interval, self._last = t - self._last, t
        # A mechanism with two stops knocks in pairs: what counts is that intervals do not become long again.
        self._intervals = [kept for kept in self._intervals if kept >= interval] + [interval]
        if len(self._intervals) < _ZENO_EVENTS:
            return None
        if gets_away and interval > max(
            _ZENO_SHRINKAGE * self._intervals[0], 64.0 * np.finfo(float).eps * abs(t)
        ):
            return None
        before = self._intervals[-2]
        ratio = interval / before if before > 0.0 else 0.0
        return t + interval * ratio / (1.0 - ratio) if ratio < 1.0 else t
