"""The events of a scene, found before all of it is integrated: when they are, and when they end the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.subsystems.settings import Settings
    from symgen.runtime.subsystems.subsystem import Subsystem

_MOST_NUMBERS = 20_000_000  # states of the whole at the times of events


@dataclass(frozen=True)
class Course:
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


def find_course(found: Sequence[Subsystem], settings: Settings, n_numbers: int) -> Course | None:
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
    return Course(events, t_end, ended_by, times, shown)
