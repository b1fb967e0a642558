"""Go on with a recorded run from its last checkpoint, bit for bit as if it had never stopped."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime import solution as data
from symgen.runtime.checkpoint_bytes import CheckpointError
from symgen.runtime.checkpoint_check import check_facts, check_form
from symgen.runtime.choose import choose_constraints, choose_step
from symgen.runtime.contact.forms import form_of
from symgen.runtime.driver import Run
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.front import Solution
from symgen.runtime.inputs.controller import Controller
from symgen.runtime.inputs.drive import drive
from symgen.runtime.inputs.recorded import drive_as_recorded
from symgen.runtime.inputs.schedule import InputSchedule
from symgen.runtime.integrate import layout as at_index
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.module import read_module
from symgen.runtime.options import RunOptions
from symgen.runtime.recording.reader import blamed_on, check_fits
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.simulate import simulate
from symgen.runtime.subsystems.simulate import ASKED
from symgen.runtime.summary import summarise
from symgen.runtime.system import System
from symgen.runtime.timing.timetable import make_timetable

from .reader import read_checkpoint, read_recording
from .recording import Recording

if TYPE_CHECKING:
    from symgen.runtime.checkpoint_bytes import Checkpoint
    from symgen.runtime.inputs.driven import DrivenSystem
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.recording.recording import Recording
    from symgen.runtime.solution import Solution

_NO_FURTHER = {
    "terminated": "an event ended the run",
    "zeno": "events of the run pile up at its end",
}


class Resumed:
    """A recorded run that can go on.

    Parameters
    ----------
    path : path-like
    inputs : mapping or callable, optional
        The controllers of the run, as `RunOptions` have them: their code is not in the recording. A
        callable gets the system and the parameters, and returns them; it is called only if they are needed.

    Attributes
    ----------
    recording : Recording
    system : System
        Driven by the inputs that were recorded.
    t : float [s]
        Where the run goes on; frames behind it are computed again.
    n_frames : int
        Frames before that.

    Raises
    ------
    RecordingError
        If the run cannot go on; the text says why.
    """

    def __init__(self, path: str | Path, inputs: Mapping[Any, Any] | Callable[..., Any] | None = None):
        with blamed_on(path):
            self._read(path, inputs)

    def _read(self, path: str | Path, inputs: Mapping[Any, Any] | Callable[..., Any] | None) -> None:
        self.recording = read_recording(path)
        try:
            checkpoint, self._step_log = read_checkpoint(path)
            if checkpoint is not None:
                check_facts(checkpoint.facts)
        except CheckpointError as error:
            raise RecordingError(f"{path}: {error}") from error
        if self.recording.status in _NO_FURTHER:
            raise RecordingError(f"{path}: {_NO_FURTHER[self.recording.status]}; there is nothing to resume")
        self._checkpoint: Checkpoint | None = checkpoint
        module = System(read_module(self.recording.module_text + "\n"))
        check_fits(self.recording, module)
        if checkpoint is None and ASKED in self.recording.options:
            self.system = module
            self.t, self.n_frames = float(self.recording.t[0]), 1
            return
        if checkpoint is None:
            raise RecordingError(
                f"{path}: holds no checkpoint to go on from (the run ended too early, its subsystems were "
                "integrated apart, or its solution was saved afterwards); run the model again"
            )
        self.t, self.n_frames = float(checkpoint.facts["t"]), int(checkpoint.facts["n_frames"])
        if not 0 < self.n_frames <= len(self.recording.t):
            raise RecordingError(
                f"{path}: its checkpoint is of {self.n_frames} frames, but it holds {len(self.recording.t)}"
            )
        self.system = _driven(module, self.recording, checkpoint.facts["controllers"], inputs)

    def run(
        self,
        t_end: float | None = None,
        *,
        at: Sequence[float] | None = None,
        fps: float | None = None,
        recorder: Callable[..., Any] | None = None,
        progress: Callable[[float, int], None] | None = None,
        max_steps: int | None = None,
    ) -> Solution:
        """Go on to `t_end`.

        Parameters
        ----------
        t_end : float, optional [s]
            That of the run before, by default.
        at : sequence of float [s], optional
            Those of the run before that it has not reached, by default.
        fps : float, optional
            Of frames from here on; that of the run before by default.
        recorder : callable, optional
            Makes a recorder, see `RunOptions`; it gets the frames of the run before first.
        progress, max_steps
            As in `RunOptions`; steps of the run before count.

        Returns
        -------
        Solution
            Of the whole run, from its first start.

        Raises
        ------
        RuntimeModelError
            A time lies before that at which the run goes on.
        """
        watched = {"recorder": recorder, "progress": progress, "max_steps": max_steps}
        with blamed_on(self.recording.path):
            if self._checkpoint is None:
                return Solution.of(
                    rerun_from_start(self.recording, self.system, t_end=t_end, at=at, fps=fps, **watched)
                )
            return Solution.of(self._go_on(self._options(t_end, at, fps, watched), more_fps=fps))

    def _options(
        self,
        t_end: float | None,
        at: Sequence[float] | None,
        fps: float | None,
        watched: dict[str, Any],
    ) -> RunOptions:
        """Return the options of the run before, but for what is said now."""
        recording, said, facts = self.recording, self.recording.options, self._checkpoint.facts
        options = RunOptions(
            t_end=said["t_end"] if t_end is None else t_end, t_start=facts["t_start"], method=facts["method"],
            constraints=recording.constraints, rtol=recording.rtol, atol=recording.atol, step=said.get("step"),
            max_step=said.get("max_step"), breaks=said.get("breaks", ()), fps=said["fps"] if fps is None else fps,
            **watched,
        ).for_model(self.system)  # fmt: skip
        t_end = options.t_end
        reached = max(self.t, facts["t_end"] if recording.status == "success" else self.t)
        if t_end <= reached:
            raise RuntimeModelError(
                f"the run has come to t = {reached:.9g} s already: give a later t_end than {t_end:.9g} s"
            )
        known = {sample[0] for sample in facts["samples"]}
        times = [t for t in said["at"] if t <= t_end] if at is None else [float(t) for t in at]
        for t in times:
            if t < self.t and t not in known:
                raise RuntimeModelError(f"at: {t} s lies before t = {self.t:.9g} s, where the run goes on")
        return replace(options, at=times).for_model(self.system)

    def _go_on(self, options: RunOptions, more_fps: float | None) -> data.Solution:
        began = time.perf_counter()
        recording, said, times = self.recording, self.recording.options, list(options.at)
        run = self._prepare(options)
        run.progress, run.max_steps = options.progress, options.max_steps
        settings = {
            "method": recording.method, "constraints": recording.constraints,
            "rtol": options.rtol, "atol": options.atol, "step": options.step,
            "t_start": options.t_start, "t_end": options.t_end, "redundant": said["redundant"],
        }  # fmt: skip
        asked = {
            **said, "t_end": options.t_end, "at": times, **({} if more_fps is None else {"fps": more_fps})
        }  # fmt: skip
        p = self.system.with_settings(recording.p)
        run.recorder = options.recorder_for(self.system, p, recording.method, recording.constraints, asked)
        if run.recorder is not None:
            self.copy_past(run.recorder)
        run.arrays.load()
        prepared = time.perf_counter()
        run.go()
        seconds = {"prepare": prepared - began, "compile": 0.0, "run": run.seconds}
        note = f"resumed at t = {self.t:.9g} s from {recording.path.name}"
        return summarise(run, times, [*said["notes"], note, *run.notes], seconds, settings)

    def copy_past(self, recorder: Any) -> None:
        """Give a recorder all that lies before the checkpoint."""
        past, n = self.recording, self.n_frames
        states, switches = past.states, past.settings.shape[1] > 0
        events = past.events[: len(self._checkpoint.facts["events"])]
        if switches:
            recorder.settings(past.settings[0])
        recorder.start(past.t[0], states[0])
        marks = sorted({1, *_changes(past.settings[:n]), *(max(event.frame, 1) for event in events)})
        for first, end in zip(marks, [*marks[1:], n], strict=True):
            for event in events:
                if max(event.frame, 1) == first:
                    if event.whole is not None:
                        recorder.next_event(event.whole)
                    recorder.event(event.name, event.t, energy_change=event.energy_change)
            if switches and first < n:
                recorder.settings(past.settings[first])
            recorder.frames(past.t[first:end], states[first:end])
        if switches:
            recorder.settings(self._checkpoint.arrays["settings"][-1])
        recorder.steps(
            self._step_log[self._step_log[:, 0] <= self.t + 0.5e-9]
        )  # times of plots have nanoseconds

    def _prepare(self, options: RunOptions) -> Run:
        """Return the run in the state of the checkpoint."""
        recording, facts, n = self.recording, self._checkpoint.facts, self.n_frames
        method = _method(options.method, recording, self.system)
        grid, shown = options.frame_times(self.system.ny)
        later = grid > self.t
        frames = np.concatenate([recording.t[:n], grid[later]])
        try:
            check_form(self._checkpoint, self.system)
        except CheckpointError as error:
            raise RecordingError(f"{recording.path}: {error}") from error
        p, form = self.system.with_settings(recording.p), self.system
        settings = self._checkpoint.arrays["settings"]
        if len(settings):
            p[self.system.settings_of_switches] = settings[-1]
            form = form_of(self.system, settings[-1])
        start = recording.states[0, : self.system.nq + self.system.nv]
        # The step of a fixed-step method is that of the run before, however much shorter what is left may be.
        if not method.adaptive:
            if options.step is None:
                raise RecordingError(
                    f"{recording.path}: {method.name} has fixed steps, and it does not say how long"
                )
            choose_step(method, self.system, p, start, options)
        arrays = LoopArrays(
            form, method, p, options.t_start, start, frame_times=frames,
            rtol=options.rtol, atol=options.atol, step=options.step or 0.0,
            energy_level=float(self._checkpoint.arrays["control"][at_index.ENERGY_LEVEL]),
        )  # fmt: skip
        inputs = None
        if recording.inputs_over_time:
            inputs = InputSchedule(self.system, arrays, method, options.t_start)
        run = Run(
            self.system, method, arrays, np.append(np.ones(n, dtype=bool), shown[later]), options.stops,
            fallback=METHODS[facts["fallback"]] if facts["fallback"] else None, inputs=inputs,
            timetable=make_timetable(self.system, p, method, options),
        )  # fmt: skip
        try:
            run.resume(self._checkpoint, recording.states[:n])
        except CheckpointError as error:
            raise RecordingError(f"{recording.path}: {error}") from error
        return run


def _method(name: str, recording: Recording, system: System) -> Method:
    if name not in METHODS:
        raise RecordingError(
            f"{recording.path}: was made with method {name!r}, which this version does not have"
        )
    _, method, _ = choose_constraints(recording.constraints, system, name)
    return method or METHODS[name]


def _driven(
    system: System,
    recording: Recording,
    controllers: list[dict[str, Any]],
    given: Mapping[Any, Any] | Callable[..., Any] | None,
) -> System:
    """Return the system with its inputs over time; controllers are those given for the same inputs."""
    if not recording.inputs_over_time:
        return system
    controlled = None
    if controllers:
        given = given(system, recording.parameters) if callable(given) else given
        controlled = _controlled(system, recording, [tuple(x["inputs"]) for x in controllers], given or {})
    driven, unknown = drive_as_recorded(system, recording.inputs_over_time, controlled)
    if unknown:
        raise RecordingError(f"{recording.path}: the values of {', '.join(unknown)} are not in the recording")
    return driven


def _controlled(
    system: System, recording: Recording, wanted: list[tuple[str, ...]], given: Mapping[Any, Any]
) -> DrivenSystem:
    found = {key if isinstance(key, tuple) else (key,): value for key, value in given.items()}
    missing = [name for names in wanted if not isinstance(found.get(names), Controller) for name in names]
    if missing:
        raise RecordingError(
            f"{recording.path}: the controllers of {', '.join(missing)} are not in the recording: give them again "
            "(MODEL on the command line, `inputs` in Python), or run the model again"
        )
    wanted_of = {names: found[names] for names in wanted}
    t = recording.t
    return drive(system, wanted_of, recording.p, float(t[0]), float(t[-1]))


def _changes(rows: np.ndarray) -> list[int]:
    return (np.flatnonzero((rows[1:] != rows[:-1]).any(axis=1)) + 1).tolist()


def rerun_from_start(
    recording: Recording,
    system: System,
    *,
    t_end: float | None = None,
    at: Sequence[float] | None = None,
    fps: float | None = None,
    **watched: Any,
) -> Solution:
    """Integrate a recorded run again, to its end or a later one; the steps, and so the bits, are the same.

    Parameters
    ----------
    t_end, at, fps : optional
        Those of the run before by default.
    **watched
        Other options of the run: recorder, progress, max_steps.
    """
    said = recording.options
    t_end = said["t_end"] if t_end is None else t_end
    options = RunOptions(
        t_end=t_end,
        t_start=said["t_start"],
        at=[t for t in said["at"] if t <= t_end] if at is None else at,
        fps=said["fps"] if fps is None else fps,
        start=_by_name(system.coordinates, recording.q[0]),
        rate=_by_name(system.rates, recording.v[0]),
        parameters={**recording.parameters, **recording.inputs},
        **said[ASKED],
        **watched,
    )
    solution = simulate(system, options)
    note = f"resumed from the start of {recording.path.name}: runs of subsystems keep no checkpoints"
    return replace(solution, notes=[*solution.notes, note])


def _by_name(records: Sequence[dict[str, Any]], values: np.ndarray) -> dict[str, float]:
    return {record["name"]: float(x) for record, x in zip(records, values, strict=True)}
