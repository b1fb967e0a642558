"""A run and its recording on the command line: the recorder behind it, its time, and how far the run is."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.cli.progress import StatusLine, bar
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

recorder = Late("symgen.runtime.recording.recorder")

_PROGRESS_AFTER = 1.0  # seconds of wall time


def run_recorded(
    run: Callable[..., Solution], recording: Recorded | None, progress: Progress | None
) -> Solution:
    """Call `run(recorder=..., progress=...)` and close the recording, whatever happens."""
    try:
        solution = run(recorder=recording and recording.begin, progress=progress)
    except BaseException:
        if recording is not None:
            recording.abort()
        raise
    finally:
        if progress is not None:
            progress.clear()
    if recording is not None:
        recording.finish(solution)
    return solution


class Recorded:
    """Makes the recorder when the run begins, hands everything on, and counts the seconds that it takes."""

    def __init__(
        self,
        path: Path,
        model: Path | None,
        module_text: str,
        model_text: str | None = None,
        content: str = "all",
    ):
        self._content = content
        self.path, self._model, self._module_text, self._model_text = path, model, module_text, model_text
        self._recorder: Any = None
        self.seconds = self.seconds_in_run = 0.0

    def begin(self, **settings: Any) -> Recorded:
        """Make the recorder; this is what `solve` calls once the settings are known."""
        began = time.perf_counter()
        model_text = self._model_text
        if model_text is None:
            model_text = self._model.read_text(encoding="utf-8")
        self._recorder = recorder.RunRecorder(
            self.path,
            module_text=self._module_text,
            model_text=model_text,
            mesh_folder=None if self._model is None else self._model.parent,
            content=self._content,
            **settings,
        )
        self.seconds += time.perf_counter() - began
        return self

    def _timed(self, method: str, *arguments: Any, **options: Any) -> None:
        began = time.perf_counter()
        getattr(self._recorder, method)(*arguments, **options)
        took = time.perf_counter() - began
        self.seconds += took
        self.seconds_in_run += took

    def start(self, t0: float, state: Any) -> None:
        self._timed("start", t0, state)

    def frames(self, times: Any, states: Any) -> None:
        self._timed("frames", times, states)

    def steps(self, step_log: Any) -> None:
        self._timed("steps", step_log)

    def event(self, name: str, t: float, *, energy_change: float = 0.0) -> None:
        self._timed("event", name, t, energy_change=energy_change)

    def next_event(self, event: Any) -> None:
        self._timed("next_event", event)

    def settings(self, values: Any) -> None:
        self._timed("settings", values)

    def checkpoint(self, make: Callable[[], bytes], *, final: bool = False) -> None:
        self._timed("checkpoint", make, final=final)

    def finish(self, solution: Solution) -> None:
        """Close the recording with what is known at the end."""
        health = [entry.to_dict() for entry in solution.health]
        began = time.perf_counter()
        self._recorder.finish(solution.status, health, solution.stats)
        self.seconds += time.perf_counter() - began

    def abort(self) -> None:
        """Close what there is of the recording: it stays readable."""
        if self._recorder is not None:
            self._recorder.abort()


class Progress(StatusLine):
    """How far the run is, how fast, and how well it keeps its energy; not for short runs.

    Parameters
    ----------
    t_end : float [s]
    in_place : bool
        As of `StatusLine`.
    """

    def __init__(self, t_end: float, in_place: bool = True):
        super().__init__(in_place, _PROGRESS_AFTER)
        self._t_end = t_end
        self._run: Any = None

    def watch(self, run: Any) -> None:
        """Take the run, to ask it for its energy error."""
        self._run = run
        self.begin()

    def __call__(self, t: float, steps: int) -> None:
        if not self.is_due:
            return
        begin = float(self._run.arrays.frame_times[0]) if self._run is not None else 0.0
        error = self._run and self._run.energy_error()
        self.say(progress_line(t, begin, self._t_end, steps, self.seconds, error))


def progress_line(
    t: float, begin: float, end: float, steps: int, seconds: float, energy_error: float | None
) -> str:
    """Return how far a run is, in one line.

    Parameters
    ----------
    t, begin, end : float [s]
        Of simulated time.
    seconds : float [s]
        Wall time since the run began.
    energy_error : float or None
        In parts of what the motion exchanged.
    """
    part = min(1.0, max(0.0, (t - begin) / (end - begin)))
    line = f"{bar(part)} {part:4.0%}  t = {t:.6g} of {end:g} s, {(t - begin) / seconds:.3g} x real time, {steps} steps"
    return line if energy_error is None else f"{line}, energy error {energy_error:.1e}"
