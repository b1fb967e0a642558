"""One run: calls the step loop from stop to stop, acts on events, and hands frames on while it goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.event_actions import EventActions, ResetError, arm_events
from runtime.failures import failure_message
from runtime.integrate import layout as at
from runtime.uninterrupted import uninterrupted

if TYPE_CHECKING:
    from runtime.integrate.methods import Method
    from runtime.loop_arrays import LoopArrays
    from runtime.solution import EventRecord
    from runtime.system import System

_FRAMES_AT_ONCE = 1000
_FIRST_STEPS = 200
_SECONDS_PER_CALL = 0.1
_LONGEST_STEP_LOG = 200_000
_STIFF_SIGNS = 15


class Run:
    """The state of a run, and what it has collected.

    Parameters
    ----------
    system : System
    method : Method
    arrays : LoopArrays
        Their frames include the start and the end; `shown` marks those that the user asked for.
    shown : ndarray of bool
    stops : sequence of float [s]
        Times to land on; the last is the end of the run.
    recorder : object, optional
        Has `start(t, y)`, `frames(times, states)`, `steps(log)` and `event(name, t, energy_change=...)`.
    progress : callable, optional
        Called with (t, steps) now and then.
    max_steps : int, optional
    fallback : Method, optional
        Takes over where `method` cannot go on.
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
    ):
        self.fallback = fallback
        self.system, self.method, self.arrays, self.shown = system, method, arrays, shown
        self.stops = list(stops)
        self.recorder, self.progress, self.max_steps = recorder, progress, max_steps
        self.actions = EventActions(system, arrays)
        self.status, self.message = "success", ""
        self.notes: list[str] = []
        self.samples: list[tuple[float, np.ndarray, float]] = []
        self.last: tuple[float, np.ndarray] | None = None
        self.reset_energy_at_frames = np.zeros(len(arrays.frame_times))
        self.step_log = StepLog()
        self.seconds = 0.0
        self._handed = 0
        self._stiff_noted = False

    def go(self) -> None:
        """Run to the end, to a terminating event, to a failure, or until Ctrl-C."""
        began = time.perf_counter()
        try:
            self._begin()
            self._loop()
        except KeyboardInterrupt:
            self._end("interrupted", f"Interrupted at t = {self.arrays.t:.9g} s; all up to there is kept.")
        except ResetError as error:
            self._end("failed", str(error))
        self._hand_on_frames()
        self._finish_frames()
        self.seconds = time.perf_counter() - began

    def _begin(self) -> None:
        arrays = self.arrays
        arrays.frames[0] = arrays.y
        arrays.counters[at.NEXT_FRAME] = 1
        if arrays.n_events:
            arm_events(self.system, arrays)
        if self.recorder is not None:
            self.recorder.start(arrays.t, arrays.y.copy())

    def _loop(self) -> None:
        arrays, n_steps, running = self.arrays, _FIRST_STEPS, True
        while running and self.stops:
            if self.stops[0] <= arrays.t:
                self._take_sample()
                continue
            before = time.perf_counter()
            status = arrays.advance(self.stops[0], self._allowed(n_steps))
            took = time.perf_counter() - before
            if took < 0.5 * _SECONDS_PER_CALL:
                n_steps = min(2 * n_steps, len(arrays.step_log))
            elif took > 2.0 * _SECONDS_PER_CALL:
                n_steps = max(1, n_steps // 2)
            with uninterrupted():
                running = self._after_call(status)

    def _after_call(self, status: int) -> bool:
        """Collect what a call of the step loop has left, act on its status; returns whether to go on."""
        self._collect()
        if status < 0 and self.fallback is not None:
            self._fall_back()
            return True
        if status < 0:
            self._end("failed", failure_message(status, self.system, self.method, self.arrays))
            return False
        if status == at.EVENT:
            return self._on_event()
        return not (status == at.RUNNING and self._steps_used_up())

    def _fall_back(self) -> None:
        before, self.method, self.fallback = self.method, self.fallback, None
        self.notes.append(
            f"method auto: {self.method.name} from t = {self.arrays.t:.9g} s on, where {before.name} cannot go on"
        )
        self.arrays.change_method(self.system, self.method)

    def _allowed(self, n_steps: int) -> int:
        if self.max_steps is None:
            return n_steps
        return max(1, min(n_steps, self.max_steps - int(self.arrays.counters[at.STEPS])))

    def _steps_used_up(self) -> bool:
        if self.max_steps is None or self.arrays.counters[at.STEPS] < self.max_steps:
            return False
        self._end(
            "failed",
            f"All {self.max_steps} steps allowed were used up at t = {self.arrays.t:.9g} s, with steps of "
            f"{self.arrays.h_last:.1e} s: allow more, or loosen --rtol.",
        )
        return True

    def _take_sample(self) -> None:
        arrays = self.arrays
        self.samples.append((arrays.t, arrays.y.copy(), self.actions.energy_of_resets))
        self.stops.pop(0)

    def _collect(self) -> None:
        arrays = self.arrays
        self.step_log.add(arrays.new_steps)
        if self.recorder is not None:
            self.recorder.steps(arrays.new_steps)
        self._hand_on_frames()
        if arrays.counters[at.STIFF_COUNT] >= _STIFF_SIGNS and not self._stiff_noted:
            self._stiff_noted = True
            self.notes.append(
                f"from about t = {arrays.t:.3g} s stability, not accuracy, limits the step of {self.method.name} "
                f"({arrays.h_last:.1e} s): method radau5 may be faster"
            )
        if self.progress is not None:
            self.progress(arrays.t, int(arrays.counters[at.STEPS]))

    def _hand_on_frames(self) -> None:
        arrays, end = self.arrays, int(self.arrays.counters[at.NEXT_FRAME])
        new = slice(self._handed, end)
        self.reset_energy_at_frames[new] = self.actions.energy_of_resets
        if self.recorder is not None:
            rows = np.flatnonzero(self.shown[new]) + self._handed
            rows = rows[rows > 0]  # the recorder has had the start
            for first in range(0, len(rows), _FRAMES_AT_ONCE):
                chunk = rows[first : first + _FRAMES_AT_ONCE]
                self.recorder.frames(arrays.frame_times[chunk], arrays.frames[chunk])
        self._handed = end

    def _on_event(self) -> bool:
        arrays = self.arrays
        records, terminate, accumulation = self.actions.act()
        changed = any(record.action == "reset" for record in records)
        if changed and self.method.adaptive:
            arrays.choose_step_anew()
        self._report_events(records)
        if terminate:
            ended_by = next(record.name for record in records if record.action == "terminate")
            self._end("terminated", f"Event {ended_by!r} ended the run at t = {arrays.t:.9g} s.")
            return False
        if accumulation is not None:
            self._end(
                "zeno",
                f"Event {records[0].name!r} repeats at ever shorter intervals, which pile up at "
                f"t = {accumulation:.9g} s: the model needs a state of rest there, such as an event that terminates "
                "the run below some speed.",
            )
            return False
        return True

    def _report_events(self, records: list[EventRecord]) -> None:
        if self.recorder is not None:
            for record in records:
                self.recorder.event(record.name, record.t, energy_change=record.energy_change)

    def _end(self, status: str, message: str) -> None:
        self.status, self.message = status, message

    def _finish_frames(self) -> None:
        """Keep the state at which the run stopped, where that is not a frame already."""
        arrays, n = self.arrays, self._handed
        if n and arrays.frame_times[n - 1] == arrays.t and np.array_equal(arrays.frames[n - 1], arrays.y):
            return
        self.last = (arrays.t, arrays.y.copy())
        if self.recorder is not None:
            self.recorder.frames(np.array([arrays.t]), arrays.y[None].copy())


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
        return np.concatenate(self._chunks) if self._chunks else np.zeros((0, 2))
