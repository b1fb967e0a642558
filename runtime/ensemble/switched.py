"""Members with stops and dry friction in lanes: lanes from one switch to the next, settling in between.

A member in a lane has one form of the model, with or without something that is held. Where one of its stops or
frictions switches it leaves the lane; what follows is settled for all members that are there, and they go back into
lanes, of the form that applies then.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.contact.forms import Forms
from symgen.runtime.contact.switching import Switching
from symgen.runtime.ensemble.batch import (
    BatchResult,
    BatchSettings,
    Carried,
    LaneBatch,
    new_members,
    repeat_ends,
)
from symgen.runtime.ensemble.settling import Settling
from symgen.runtime.ensemble.slots import COLUMN, LEFT
from symgen.runtime.errors import ContactError, RuntimeModelError
from symgen.runtime.event_actions import EventRecord, ResetError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.system import System

_MOST_AT_ONCE = (
    32  # switches of a member at one instant: behind them a run of its own says what is the matter
)
_SAME_TIME = 1e-13
_TOLERANCES, _ROUND_OFF = 10.0, 1e-13  # of a gap below zero, as in `checks/stops.py`


def make_batch(system: System, settings: BatchSettings) -> LaneBatch | SwitchedBatch:
    """Return what runs members of a model in lanes.

    Raises
    ------
    symgen.runtime.code.lower.NoLanes
        The model's functions can only be had for one member at a time.
    """
    return (SwitchedBatch if system.switches else LaneBatch)(system, settings)


class SwitchedBatch:
    """Runs batches of members of a model with stops or frictions: a `LaneBatch` for these.

    Parameters
    ----------
    system : System
        `settling.has_plain_switches` of it.
    settings : BatchSettings

    Attributes
    ----------
    records : list of EventRecord
        Of a member that is run with a log.
    step_log : ndarray, shape (n, 2)
        Of this one, too.
    lowest_gaps : ndarray, shape (members of the last run, number of stops)
    """

    def __init__(self, system: System, settings: BatchSettings) -> None:
        self.system, self.settings = system, settings
        longest = (settings.longest[0], *settings.longest_held)
        self._lanes = (
            LaneBatch(system, settings),
            LaneBatch(system.closed, replace(settings, longest=longest)),
        )
        self._settling = Settling(system, settings.rtol, settings.atol)
        self._full: _InFull | None = None
        self._stopped = False

    def stop(self) -> None:
        """Let `run`, in another thread, return at once; what it returns is of no use."""
        self._stopped = True
        for lanes in self._lanes:
            lanes.stop()

    def run(
        self, parameters: np.ndarray, start: np.ndarray, numbers: np.ndarray | None = None
    ) -> BatchResult:
        """Run members from their starts to the end, as `LaneBatch.run`."""
        self._stopped, n = False, len(start)
        self.records: list[EventRecord] = []
        self.step_log = np.zeros((0, 2))
        self._p, self._y = np.array(parameters, dtype=float), np.zeros((n, self.system.ny))
        self._y[:, : start.shape[1]] = start
        self._carried = new_members(n, self.system, self.settings)
        self.lowest_gaps = np.full((n, self._settling.n_stops), np.inf)
        self._repeats, self._last = np.zeros(n, dtype=int), np.full(n, -np.inf)
        going = self._begin()
        self._changes = [(-np.inf, self._settings_of(0))] if n else []
        while len(going) and not self._stopped:
            held = self._settling.held(self._p[going]).any(axis=1)
            for lanes, which in zip(self._lanes, (going[~held], going[held]), strict=True):
                if len(which) and not self._stopped:
                    self._advance(lanes, which)
            going = self._act(going)
        result = BatchResult(self._y, self._carried.columns, self._carried.frames)
        self._note_sunk(result)
        repeat_ends(result, self.settings)
        return result

    def forms_at(self, times: np.ndarray) -> Forms:
        """Return which settings a member that is run with a log had at times; at a switch those before it."""
        since = np.array([t for t, _ in self._changes])
        return Forms(
            np.array([own for _, own in self._changes]), np.searchsorted(since, times, side="left") - 1
        )

    def _column(self, name: str) -> np.ndarray:
        return self._carried.columns[:, COLUMN[name]]

    def _settings_of(self, member: int) -> np.ndarray:
        return self._p[member, self.system.settings_of_switches].copy()

    def _begin(self) -> np.ndarray:
        """Settle what holds and slides at the starts; returns the members that go on from there."""
        n = self.system.nq + self.system.nv
        everyone, finite = np.arange(len(self._y)), np.isfinite(self._y).all(axis=1)
        self._column("status")[~finite] = at.NOT_FINITE
        which = everyone[finite]
        if not len(which):
            return which
        times = self._column("t")[which]
        settled = self._settling.start(self._p[which], times, self._y[which, :n])
        self._p[which], self._y[which, :n] = settled.parameters, settled.states
        return self._go_on(self._settle_in_full(which, settled.plain, None))

    def _advance(self, lanes: LaneBatch, which: np.ndarray) -> None:
        """Let members go on, to the end or to their next switch."""
        own, held = self._carried, self._settling.held(self._p[which])[:, : self._settling.n_stops]
        rows = slice(None) if len(which) == len(self._y) else which
        own.lowest[rows] = np.inf
        part = Carried(
            own.columns[rows], own.frames[rows], own.first_frame[rows], own.widths[rows], own.lowest[rows]
        )
        self._y[rows] = lanes.run(self._p[rows], self._y[rows], None, part).end
        own.columns[rows], own.frames[rows], own.lowest[rows] = part.columns, part.frames, part.lowest
        own.first_frame[rows] = np.searchsorted(
            self.settings.frame_times, self._column("t")[rows], side="right"
        )
        lowest = np.where(held, np.inf, own.lowest[rows, : self._settling.n_stops])
        self.lowest_gaps[rows] = np.minimum(self.lowest_gaps[rows], lowest)
        if self.settings.log_size:
            self.step_log = np.concatenate([self.step_log, lanes.step_log[: lanes.table.integer("n_logged")]])

    def _act(self, going: np.ndarray) -> np.ndarray:
        """Act on the switches of members; returns those that go on."""
        n, status, number = (
            self.system.nq + self.system.nv,
            self._column("status"),
            self._column("next_event"),
        )
        which = going[(status[going] == at.REACHED_STOP) & (number[going] > 0.5)]
        if not len(which) or self._stopped:
            return which[:0]
        fired, times = number[which].astype(int) - 1, self._column("t")[which]
        before, held = self._y[which, :n].copy(), self._settling.held(self._p[which])
        energy = self._energy(which)
        settled = self._settling.act(fired, self._p[which], times, self._y[which, :n])
        self._p[which], self._y[which, :n] = settled.parameters, settled.states
        sound = self._settle_in_full(which, settled.plain, fired)
        with np.errstate(all="ignore"):  # of members with numbers beyond the range, which fail
            change = self._energy(which) - energy
        self._column("level")[which] += change
        now, rows = self._settling.held(self._p[which]), np.arange(len(which))
        # The function of what was closed or let go is another one now, and not at its zero.
        same = held[rows, fired] == now[rows, fired]
        self._column("fired")[which] = np.where(same, fired + 1.0, 0.0)
        at_once = times - self._last[which] <= _SAME_TIME * np.abs(times)
        self._repeats[which], self._last[which] = np.where(at_once, self._repeats[which] + 1, 0), times
        if self.settings.log_size and len(sound):
            self._log(int(fired[0]), held[0], now[0], before[0], float(change[0]))
        for_itself = sound[self._repeats[sound] >= _MOST_AT_ONCE]
        status[for_itself] = LEFT
        return self._go_on(sound[self._repeats[sound] < _MOST_AT_ONCE])

    def _go_on(self, which: np.ndarray) -> np.ndarray:
        """Find what members carry into their next lanes; returns those that are not at the end."""
        which = which[self._column("t")[which] < self.settings.t_end]
        n = self.system.nq + self.system.nv
        if len(which):
            times = self._column("t")[which]
            self._carried.widths[which] = self._settling.widths(self._p[which], times, self._y[which, :n])
        return which

    def _energy(self, which: np.ndarray) -> np.ndarray:
        n = self.system.nq + self.system.nv
        return self._settling.energy(self._p[which], self._column("t")[which], self._y[which, :n])

    def _settle_in_full(self, which: np.ndarray, plain: np.ndarray, fired: np.ndarray | None) -> np.ndarray:
        """Settle members that are not plain one after another; returns those with which it went well."""
        n, sound = self.system.nq + self.system.nv, np.ones(len(which), dtype=bool)
        for k in np.flatnonzero(~plain):
            member = which[k]
            self._full = self._full or _InFull(
                self.system, self.settings, self._p[member], self._y[member, :n]
            )
            t, h = self._column("t")[member], self._column("h")[member]
            event = () if fired is None else (int(fired[k]),)
            sound[k] = self._full.settle(event, t, h, self._p[member], self._y[member, :n])
        self._column("status")[which[~sound]] = LEFT
        return which[sound]

    def _log(self, fired: int, held: np.ndarray, now: np.ndarray, before: np.ndarray, change: float) -> None:
        nq, n, t = self.system.nq, self.system.nq + self.system.nv, float(self._column("t")[0])
        if fired < self._settling.n_stops:
            action = "release" if held[fired] else "impact"
        elif held[fired]:
            action = "slip"
        else:
            action = "stick" if now[fired] else "turn"
        after = self._y[0, :n].copy()
        name = self.system.events[fired]["name"]
        self.records.append(
            EventRecord(name, action, t, before[:nq], before[nq:], after[:nq], after[nq:], change)
        )
        self._changes.append((t, self._settings_of(0)))

    def _note_sunk(self, result: BatchResult) -> None:
        """Take note of how far gaps have been below zero, in parts of what the tolerances allow at the end."""
        if not self._settling.n_stops or not len(self._y):
            return
        s, n = self.settings, self.system.nq + self.system.nv
        sums, size = self._settling.sizes_of_gaps(self._p, result.columns[:, COLUMN["t"]], self._y[:, :n])
        allowed = sums * (_TOLERANCES * (s.atol + s.rtol * size) + _ROUND_OFF * size)
        with np.errstate(all="ignore"):
            parts = np.maximum(-self.lowest_gaps, 0.0) / allowed
        result.columns[:, COLUMN["sunk"]] = np.fmax.reduce(parts, axis=1)


class _InFull:
    """The full code for stops and frictions, at an instant of a member."""

    def __init__(self, system: System, settings: BatchSettings, p: np.ndarray, state: np.ndarray) -> None:
        self._system = system
        self._arrays = LoopArrays(
            system, find_method(settings.method), p, settings.t_start, state, frame_times=np.zeros(0),
            rtol=settings.rtol, atol=settings.atol, log_length=1,
        )  # fmt: skip
        self._switching = Switching(system, self._arrays)

    def settle(self, fired: Sequence[int], t: float, h: float, p: np.ndarray, state: np.ndarray) -> bool:
        """Settle what holds and slides at an event, or without one at the start; whether lanes can go on from there.

        Parameters
        ----------
        fired : sequence of int
        t, h : float [s]
            Time, and the step that the method would take next.
        p, state : ndarray
            They are written over.
        """
        system, arrays, switching = self._system, self._arrays, self._switching
        if not np.isfinite(state).all():
            return False
        arrays.p[:], arrays.y[: len(state)] = p, state
        arrays.control[at.T], arrays.control[at.H] = t, h
        for block in (at.SIDE, at.BAND):
            arrays.event_block(block)[:] = 0.0
        switching.settings = p[system.settings_of_switches]
        try:
            if fired:
                switching.act(np.array(fired))
            else:
                switching.start()
        except (ContactError, ResetError, RuntimeModelError, np.linalg.LinAlgError):
            return False
        switching.write()
        form, after = system.closed if switching.any_held else system, arrays.y[: len(state)]
        if switching.resting.any() or not np.isfinite(form.kernel("events")(t, after, arrays.p)).all():
            return False
        p[:], state[:] = arrays.p, after
        return True
