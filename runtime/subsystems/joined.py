"""The runs of all subsystems as one run of the whole model, with its events in the order of time.

It is what `symgen.runtime.summary` and recorders take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.event_actions import EventLog, EventRecord, tell
from symgen.runtime.exchange import energy_error_so_far
from symgen.runtime.integrate import layout as at

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Settings, Subsystem
    from symgen.runtime.system import System
    from symgen.runtime.timing.timetable import Timetable

_MOST_NUMBERS = 20_000_000  # states of the whole at the times of events
_FRAMES_AT_ONCE = 1000
_STATISTICS = slice(0, at.NEXT_FRAME)


@dataclass(frozen=True)
class EventSchedule:
    """When what happens.

    Attributes
    ----------
    events : list of tuple
        (record, subsystem), in the order of time and then of the model.
    t_end : float [s]
        Of the run, or of what ended it before.
    ended_by : Subsystem or None
        Whose run ended before the others.
    times, shown : ndarray
        Frames, those at events included, and which of them to show.
    """

    events: list[tuple[EventRecord, Subsystem]]
    t_end: float
    ended_by: Subsystem | None
    times: np.ndarray
    shown: np.ndarray

    def stops(self, subsystem: Subsystem, settings: Settings) -> Sequence[float]:
        """Return the times that a subsystem lands on."""
        if self.ended_by in (None, subsystem):
            return settings.options.stops
        return [*(t for t in settings.options.stops if t < self.t_end), self.t_end]


def locate_events(found: Sequence[Subsystem], settings: Settings, n_numbers: int) -> EventSchedule | None:
    """Integrate the subsystems that have events.

    Parameters
    ----------
    n_numbers : int
        In a state of the whole model.

    Returns
    -------
    Course or None
        None where events are so many that the states at all of them would not fit.
    """
    watched = [subsystem for subsystem in found if subsystem.system.events]
    t_end, ended_by = settings.options.t_end, None
    for subsystem in watched:
        subsystem.prepare(settings.times, settings.shown, settings.options.stops, settings)
        run = subsystem.run
        run.max_steps = settings.options.max_steps
        run.go_to(len(settings.times) + 1)
        if run.status != "success" and run.arrays.t < t_end:
            t_end, ended_by = run.arrays.t, subsystem
    events = [(record, s) for s in watched for record in s.run.actions.log if record.t <= t_end]
    events.sort(key=lambda entry: entry[0].t)
    extra = np.array([record.t for record, _ in events] + ([t_end] if ended_by else []))
    before = settings.times <= t_end
    times = np.union1d(settings.times[before], extra)
    if extra.size * n_numbers > _MOST_NUMBERS:
        return None
    shown = np.isin(times, settings.times[settings.shown]) | (times == t_end)
    return EventSchedule(events, t_end, ended_by, times, shown)


class Joined:
    """Collects frames, samples, events and counts; its attributes are those of `symgen.runtime.driver.Run`.

    Parameters
    ----------
    system : System
        The whole model.
    p : ndarray
    found : sequence of Subsystem
        With runs that have begun.
    schedule : EventSchedule
    settings : Settings
    """

    def __init__(
        self,
        system: System,
        p: np.ndarray,
        found: Sequence[Subsystem],
        schedule: EventSchedule,
        settings: Settings,
    ):
        self.system, self.shown, self._found, self._schedule = system, schedule.shown, found, schedule
        self._recorder = settings.options.recorder
        n = len(schedule.times)
        self.arrays = SimpleNamespace(
            p=p, t=settings.options.t_start, frame_times=schedule.times, frames=np.zeros((n, system.ny)),
            counters=np.zeros(at.N_COUNTERS, dtype=np.int64), control=np.zeros(at.N_CONTROL),
        )  # fmt: skip
        self.reset_energy_at_frames = np.zeros(n)
        self.forms: list[np.ndarray] = []
        self.form_at_frames = np.zeros(n, dtype=int)
        self.samples: list[tuple[float, np.ndarray, float, int]] = []
        self.last: tuple[float, np.ndarray] | None = None
        self.actions = SimpleNamespace(
            log=[], energy_of_resets=0.0, note_gaps=lambda: None, lowest_gaps=np.zeros(0),
            passed_by=lambda: [entry for x in found for entry in x.run.actions.passed_by()],
        )  # fmt: skip
        self.step_log: Any = None
        self.timetable: Timetable | None = None
        self.window = None  # all frames are there
        self.status, self.message = "success", ""
        self.n_frames = 0
        self._told = 0  # events that were handed on
        self._join(1)
        if self._recorder is not None:
            self._recorder.start(settings.options.t_start, self.arrays.frames[0].copy())
        if hasattr(settings.options.progress, "watch"):
            settings.options.progress.watch(self)

    def _join(self, n: int) -> None:
        """Put together the rows up to number `n`."""
        frames, rows, work = self.arrays.frames, slice(self.n_frames, n), self.system.nq + self.system.nv
        for subsystem in self._found:
            run = subsystem.run
            own = subsystem.frames(rows)
            for columns in subsystem.columns:
                frames[rows, columns] = own[:, : len(columns)]
                if run.system.nw:
                    frames[rows, work] += own[:, -1]
                if run.actions.log:
                    self.reset_energy_at_frames[rows] += run.reset_energy_at_frames[rows]
        self.n_frames = n
        self.arrays.counters[at.NEXT_FRAME] = n
        self.arrays.t = float(self.arrays.frame_times[n - 1])

    def take_frames(self, n: int) -> None:
        """Put together frames up to number `n`, and hand them on to the recorder with the events between them."""
        first = self.n_frames
        if n <= first:
            return
        self._join(n)
        if self._recorder is None:
            return
        times = self.arrays.frame_times
        for record, _ in self._schedule.events[self._told :]:
            if record.t > times[n - 1]:
                break
            end = int(np.searchsorted(times, record.t, side="right"))
            self._hand_on(first, end)
            first = max(first, end)
            tell(self._recorder, record)
            self._told += 1
        self._hand_on(first, n)

    def _hand_on(self, first: int, end: int) -> None:
        arrays, rows = self.arrays, np.flatnonzero(self.shown[first:end]) + first
        for start in range(0, len(rows), _FRAMES_AT_ONCE):
            chunk = rows[start : start + _FRAMES_AT_ONCE]
            self._recorder.frames(arrays.frame_times[chunk], arrays.frames[chunk])

    def end(self, subsystem: Subsystem) -> None:
        """Say that the run ended as that of a subsystem did."""
        run = subsystem.run
        self.status, self.message = run.status, f"{subsystem.name}: {run.message}"

    def interrupt(self) -> None:
        """Say that the run was interrupted; frames that all subsystems have are kept."""
        self.status = "interrupted"

    def finish(self) -> None:
        """Take what the runs have besides frames: events, samples, counts and the step log."""
        runs = [subsystem.run for subsystem in self._found]
        if self.status == "success" and self._schedule.ended_by is not None:
            self.end(self._schedule.ended_by)
        if self.status == "interrupted":
            self.message = f"Interrupted at t = {self.arrays.t:.9g} s; all up to there is kept."
        self.actions.log = EventLog(
            self._whole(*entry) for entry in self._schedule.events if entry[0].t <= self.arrays.t
        )
        self.actions.energy_of_resets = sum(record.energy_change for record in self.actions.log)
        self._take_samples()
        counters, control = self.arrays.counters, self.arrays.control
        counters[_STATISTICS] = sum(run.arrays.counters[_STATISTICS] for run in runs)
        control[at.MIN_PIVOT_RATIO] = min(run.arrays.control[at.MIN_PIVOT_RATIO] for run in runs)
        control[at.MOST_ENERGY_TAKEN] = max(run.arrays.control[at.MOST_ENERGY_TAKEN] for run in runs)
        levels = np.array([run.arrays.control[at.ENERGY_LEVEL] for run in runs])
        control[at.ENERGY_LEVEL] = levels[np.isfinite(levels)].sum() if np.isfinite(levels).any() else np.nan
        # The steps of one run are a course over time; those of the busiest say what limits the scene.
        self.step_log = max(runs, key=lambda run: run.n_steps).step_log
        if self._recorder is not None:
            self._recorder.steps(self.step_log.array())

    def _whole(self, record: EventRecord, subsystem: Subsystem) -> EventRecord:
        """An event of a subsystem with the states of all at that time."""
        row = int(np.searchsorted(self.arrays.frame_times, record.t))
        nq, n, columns = self.system.nq, self.system.nq + self.system.nv, subsystem.columns[0]
        before, after = self.arrays.frames[row, :n].copy(), self.arrays.frames[row, :n].copy()
        before[columns] = np.concatenate([record.q_before, record.v_before])
        after[columns] = np.concatenate([record.q_after, record.v_after])
        return replace(
            record, q_before=before[:nq], v_before=before[nq:], q_after=after[:nq], v_after=after[nq:]
        )

    def _take_samples(self) -> None:
        """States at the times landed on, as far as all have come."""
        for k in range(min(len(subsystem.run.samples) for subsystem in self._found)):
            row, energy, t = np.zeros(self.system.ny), 0.0, self._found[0].run.samples[k][0]
            for subsystem in self._found:
                own = subsystem.run.samples[k]
                energy += own[2]
                for columns in subsystem.columns:
                    row[columns] = own[1][: len(columns)]
                    if subsystem.system.nw:
                        row[-1] += own[1][-1]
            self.samples.append((t, row, energy, -1))

    def energy_error(self) -> float:
        """Return the present error of T + V - work since the start, in parts of what the motion exchanged so far."""
        arrays, last = self.arrays, self.n_frames - 1
        resets = float(self.reset_energy_at_frames[last] - self.reset_energy_at_frames[0])
        return energy_error_so_far(
            self.system, arrays, last, arrays.frame_times[last], arrays.frames[last], resets
        )
