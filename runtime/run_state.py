"""A run as data: what it integrates, where it is, and what it has collected; `symgen.runtime.driver` moves it on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.event_actions import EventActions

if TYPE_CHECKING:
    from symgen.runtime.checkpoint_bytes import Checkpoint
    from symgen.runtime.frame_window import FrameWindow
    from symgen.runtime.inputs.schedule import InputSchedule
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System
    from symgen.runtime.timing.timetable import Timetable

_LONGEST_STEP_LOG = 200_000


class RunState:
    """A run as data: what it integrates with what, where it is, and what it has collected.

    Parameters
    ----------
    system : System
    method : Method
    arrays : LoopArrays
        Their frames include the start and the end; `shown` marks those that the user asked for.
    shown : ndarray of bool
    stops : sequence of float [s]
        Times at which states are wanted; the last is the end of the run.
    recorder : object, optional
        Has `start(t, y)`, `frames(times, states)`, `steps(log)` and `event(name, t, energy_change=...)`; and
        `checkpoint(make, final=...)` if it keeps checkpoints, `settings(values)` if it records stops and frictions,
        `next_event(record)` if it takes their events whole.
    progress : callable, optional
        Called with (t, steps) now and then; where it has a method `watch`, that gets the run before it begins.
    max_steps : int, optional
    fallback : Method, optional
        Takes over where `method` cannot go on.
    inputs : symgen.runtime.inputs.schedule.InputSchedule, optional
        Keeps inputs over time.
    timetable : symgen.runtime.timing.timetable.Timetable, optional
        Other times to land on, and limits of the step.
    window : symgen.runtime.frame_window.FrameWindow, optional
        Moves the frames of `arrays` on, where these are not all of the run.
    """

    def __init__(
        self,
        system: System,
        method: Method,
        arrays: LoopArrays,
        shown: np.ndarray,
        stops: Sequence[float],
        *,
        recorder: Any = None,
        progress: Callable[[float, int], None] | None = None,
        max_steps: int | None = None,
        fallback: Method | None = None,
        inputs: InputSchedule | None = None,
        timetable: Timetable | None = None,
        window: FrameWindow | None = None,
    ):
        self.window = window
        self.fallback, self.inputs, self.timetable = fallback, inputs, timetable
        self.system, self.method, self.arrays, self.shown = system, method, arrays, shown
        self.stops = list(stops)
        self.t_start, self.t_end = arrays.t, self.stops[-1]
        self.recorder, self.progress, self.max_steps = recorder, progress, max_steps
        self.actions = EventActions(system, arrays)
        self.status, self.message = "success", ""
        self.notes: list[str] = []
        self.samples: list[tuple[float, np.ndarray, float, int]] = []
        self.last: tuple[float, np.ndarray] | None = None
        self.reset_energy_at_frames = np.zeros(len(arrays.frame_times))
        self.forms = FormLog()
        self.form_at_frames = np.zeros(len(arrays.frame_times), dtype=int)
        self.step_log = StepLog()
        self.seconds = 0.0
        self.handed = 0  # frames that were handed on
        self.stiff_noted = False
        self.is_resumed = self.forces_jumped = False
        self.at_last_step: Checkpoint | None = None  # before the step that passed the end


class FormLog:
    """Settings of stops and frictions, one after another, as rows of an array that grows.

    Parameters
    ----------
    rows : ndarray, shape (n, number of settings)
    """

    def __init__(self, rows: np.ndarray | None = None):
        self._rows = np.zeros((0, 0)) if rows is None else np.array(rows)
        self._n = len(self._rows)

    def append(self, settings: np.ndarray) -> None:
        """Add settings."""
        self.extend(settings[None])

    def extend(self, rows: np.ndarray) -> None:
        """Add settings, row by row."""
        n = self._n + len(rows)
        if n > len(self._rows):
            longer = np.zeros((n + n // 4 + 1, rows.shape[1]))
            if self._n:
                longer[: self._n] = self._rows[: self._n]
            self._rows = longer
        self._rows[self._n : n] = rows
        self._n = n

    def __len__(self) -> int:
        return self._n

    def __getitem__(self, k: int) -> np.ndarray:
        return self.array()[k]

    def array(self) -> np.ndarray:
        """Return a view of all of them, shape (n, number of settings)."""
        return self._rows[: self._n] if self._n else np.zeros(0)


class StepLog:
    """Accepted steps; a log that grows too long keeps every second, fourth, ... step."""

    def __init__(self):
        self._chunks: list[np.ndarray] = []
        self._rows = 0
        self._stride = 1
        self._seen = 0

    def add(self, rows: np.ndarray) -> None:
        """Append rows of t and h."""
        first = -self._seen % self._stride
        self._seen += len(rows)
        self._chunks.append(rows[first :: self._stride].copy())
        self._rows += len(self._chunks[-1])
        if self._rows > _LONGEST_STEP_LOG:
            self._chunks = [self.array()[::2].copy()]
            self._rows = len(self._chunks[0])
            self._stride *= 2

    def array(self) -> np.ndarray:
        """Return the log, shape (n, 2)."""
        if len(self._chunks) == 1:
            return self._chunks[0]
        return np.concatenate(self._chunks) if self._chunks else np.zeros((0, 2))
