"""Integrate a model: consistent start, method, run, energy and constraints checked."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.inertia import refuse_negative_inertia
from symgen.runtime.choose import (
    EXPLICIT,
    SERIES,
    choose_constraints,
    choose_method,
    choose_step,
    time_resolution,
)
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.driver import Run
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.summary import summarise
from symgen.runtime.timing.timetable import course_of, make_timetable

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_FPS = 60.0
_LEAST_FRAMES, _MOST_FRAMES = 200, 20_000
_FRAMES_IN_MEMORY = 1_000_000_000
_SHORTEST_RUN = 1e-150  # [s]: squares of the steps must not underflow
_LEAST_TICKS = 1000  # of floating-point time in a run
SMALLEST_RTOL = 1e-15  # a few units of the last digit


def solve(
    system: System,
    t_end: float | None = None,
    *,
    method: str = "auto",
    rtol: float = 1e-8,
    atol: float = 1e-10,
    step: float | None = None,
    constraints: str = "auto",
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    rate: Mapping[str, float] | None = None,
    inputs: Mapping[Any, Any] | None = None,
    at: Sequence[float] = (),
    fps: float | None = None,
    t_start: float = 0.0,
    progress: Callable[[float, int], None] | None = None,
    recorder: Any = None,
    max_steps: int | None = None,
    energy_scaling: bool | None = None,
    split: bool | None = None,
    max_step: float | None = None,
    breaks: Sequence[float] = (),
) -> Solution:
    """Integrate `system` from `t_start` to `t_end`.

    Parameters
    ----------
    system : System
    t_end : float, optional [s]
        The model's own `[run]` table by default.
    method : str
        One of `symgen.runtime.integrate.methods.METHODS`, or "auto".
    rtol, atol : float
        Tolerances of adaptive methods, per step and component.
    step : float, optional [s]
        Of fixed-step methods; 1/50 of the fastest period at the start by default, up to 1/14 with high orders.
    constraints : str
        "projection", another form of `symgen.runtime.integrate.forms.FORMS` that the method has, or "auto".
    parameters : mapping of str to float, optional
        Values other than the model's.
    inputs : mapping, optional
        By name: a number, a pair (times, values), or a `symgen.runtime.inputs` Table, Polynomial or Controller; the
        latter also by a tuple of names, for several inputs at once. The model's own otherwise.
    start, rate : mapping of str to float, optional
        Initial values of coordinates and rates, enforced.
    at : sequence of float [s]
        Times at which states are kept as samples; they change no step.
    fps : float, optional
        Frames per second of simulated time; by default 60, but at least 200 and at most 20 000 frames in all.
    progress : callable, optional
        Called with (t, steps) now and then.
    recorder : object, optional
        `symgen.runtime.recording.recorder.RunRecorder`, or a callable that makes one: it is called with `system`, `p`,
        `method`, `constraints`, `rtol`, `atol` and `options` once these are settled.
    max_steps : int, optional
        Fail after this many steps.
    energy_scaling : bool, optional
        Whether rates are scaled after each step so that a conservative model with constraints keeps its energy; by
        default where that suits model and method. Health checks count the errors that it takes away.
    max_step : float, optional [s]
        The longest step of an adaptive method.
    breaks : sequence of float [s]
        Times that steps land on, and behind which the step is chosen anew: where something changes that no error
        estimate can see before. What the model does at times of its own is found without being named.

    Returns
    -------
    Solution
        Also where the run failed: see its `status` and `message`.

    Raises
    ------
    RuntimeModelError
        An option does not fit, or the initial conditions contradict the constraints.
    """
    t_start, t_end = run_interval(system, t_start, t_end)
    rtol, atol = _tolerance("rtol", rtol), _tolerance("atol", atol)
    if max_steps is not None and max_steps < 1:
        raise RuntimeModelError(f"max_steps is {max_steps}: allow at least one step, or leave it out")
    moving, constant = _split_inputs(system, {**(inputs or {})}, parameters or {})
    p = system.parameter_values({**(parameters or {}), **constant})
    if moving:
        from symgen.runtime.inputs.drive import drive

        system = drive(system, moving, p, t_start, t_end)
    treatment, formed, form_notes = choose_constraints(constraints, system, method)
    began = time.perf_counter()
    assembly = assemble(system, p, start, rate, t_start)
    state = np.concatenate([assembly.q, assembly.v])
    refuse_negative_inertia(system, p, t_start, state)
    if moving:
        from symgen.runtime.inputs.schedule import first_samples

        first_samples(system, p, t_start, state)
    notes = [*_moved_notes(assembly.moved), *assembly.notes]
    rtol, more = _usable_rtol(rtol)
    notes += more
    notes += form_notes
    if split is not False and system.subsystems:
        from symgen.runtime.subsystems.division import divide

        kinds, why_not = divide(system)
        if kinds:
            from symgen.runtime.subsystems.apart import solve_apart
            from symgen.runtime.subsystems.settings import Settings

            times, shown = frame_times(t_start, t_end, fps)
            settings = Settings(
                method, constraints, treatment, assembly.redundant, rtol, atol, step, t_start, t_end, times, shown,
                stop_times(at, t_start, t_end), at, recorder, progress, max_steps, energy_scaling, fps, split,
                max_step, breaks, course_of(system, p, t_start, t_end),
            )  # fmt: skip
            solution = solve_apart(system, kinds, p, state, settings, notes, began)
            if not isinstance(solution, str):
                return solution
            why_not = solution
        notes.append(f"subsystems: integrated as one, because {why_not}")
    chosen, more = (
        (formed, []) if formed else choose_method(method, system, p, t_start, state, t_end, rtol, atol)
    )
    notes += more
    chosen_step, more = choose_step(chosen, step, system, p, t_start, state, t_end)
    notes += more
    timetable = make_timetable(system, p, chosen, t_start, t_end, max_step, breaks)
    notes += timetable.notes if timetable is not None else []
    times, shown = frame_times(t_start, t_end, fps)
    if timetable is not None:
        times, shown = timetable.with_frames(times, shown)
    arrays = LoopArrays(
        system, chosen, p, t_start, state, frame_times=times, rtol=rtol, atol=atol, step=chosen_step,
        energy_level=choose_energy_level(energy_scaling, system, chosen, p, t_start, state),
    )  # fmt: skip
    if recorder is not None and not hasattr(recorder, "frames"):
        recorder = recorder(
            system=system, p=p, method=chosen.name, constraints=treatment, rtol=rtol, atol=atol,
            options={
                **({"step": chosen_step} if chosen_step else {}),
                **(timetable.settings if timetable is not None else {}),
                "t_start": t_start, "t_end": t_end, "fps": fps, "at": [float(t) for t in at],
                "redundant": assembly.redundant, "notes": notes,
            },
        )  # fmt: skip
    run = Run(
        system, chosen, arrays, shown, stop_times(at, t_start, t_end),
        recorder=recorder, progress=progress, max_steps=max_steps,
        fallback=METHODS[EXPLICIT] if method == "auto" and chosen.name == SERIES else None,
        inputs=_schedule(system, arrays, chosen, t_start) if moving else None,
        timetable=timetable,
    )  # fmt: skip
    prepared = time.perf_counter()
    # No steps: the loop is compiled, or read from the cache, before the run is timed.
    arrays.advance(t_end, 0)
    compiled = time.perf_counter()
    run.go()
    seconds = {"prepare": prepared - began, "compile": compiled - prepared, "run": run.seconds}
    settings = {
        "method": chosen.name, "constraints": treatment, "rtol": rtol, "atol": atol, "t_start": t_start, "t_end": t_end,
        "step": chosen_step or None, "redundant": assembly.redundant,
    }  # fmt: skip
    return summarise(run, at, [*notes, *run.notes], seconds, settings)


def frame_times(t_start: float, t_end: float, fps: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the times of all frames, from start to end, and which of them the user asked for.

    Few frames are filled up to 200, for checks of energy and constraints.
    """
    span = t_end - t_start
    filled = np.linspace(t_start, t_end, _LEAST_FRAMES + 1)
    if fps is None:
        n = int(np.clip(np.ceil(_FPS * span), _LEAST_FRAMES, _MOST_FRAMES))
        return np.linspace(t_start, t_end, n + 1), np.ones(n + 1, dtype=bool)
    if not (np.isfinite(fps) and fps > 0.0):
        raise RuntimeModelError(f"fps is {fps}: give a positive number of frames per second")
    if span * fps > _FRAMES_IN_MEMORY:
        raise RuntimeModelError(
            f"fps is {fps:g}: {span:g} s make {span * fps:.1e} frames, more than {_FRAMES_IN_MEMORY:.0e}: "
            "give a smaller fps"
        )
    wanted = t_start + np.arange(int(np.floor(span * fps * (1.0 + 1e-12))) + 1) / fps
    wanted = np.append(wanted[wanted < t_end - 1e-9 * span], t_end)
    if len(wanted) > _LEAST_FRAMES:
        return wanted, np.ones(len(wanted), dtype=bool)
    times = np.sort(np.concatenate([wanted, filled]))
    times = times[np.append(True, np.diff(times) > 0.0)]
    shown = np.zeros(len(times), dtype=bool)
    shown[np.searchsorted(times, wanted)] = True
    return times, shown


def run_interval(system: System, t_start: float, t_end: float | None) -> tuple[float, float]:
    """Return start and end of a run [s]; refuse what numbers cannot tell apart."""
    if t_end is None:
        t_end = system.run_defaults.get("t_end")
    if t_end is None:
        raise RuntimeModelError(f"model {system.name!r} does not say how long to run: give t_end")
    t_start, t_end = float(t_start), float(t_end)
    if not (np.isfinite(t_start) and np.isfinite(t_end) and t_end > t_start):
        raise RuntimeModelError(f"t_end is {t_end} s: it must lie after t_start = {t_start} s")
    least = max(_SHORTEST_RUN, _LEAST_TICKS * time_resolution(t_start, t_end))
    if t_end - t_start < least:
        raise RuntimeModelError(
            f"t_end is {t_end!r} s, only {t_end - t_start:.2g} s after t_start = {t_start!r} s: numbers cannot tell "
            f"the times of steps apart in a run shorter than {least:.1g} s there; run longer, or start nearer to t = 0"
        )
    return t_start, t_end


def _tolerance(name: str, value: float) -> float:
    value = float(value)
    if not (np.isfinite(value) and value >= 0.0):
        raise RuntimeModelError(f"{name} is {value}: give a number that is not negative, such as 1e-8")
    return value


def _usable_rtol(rtol: float) -> tuple[float, list[str]]:
    if rtol >= SMALLEST_RTOL:
        return rtol, []
    return SMALLEST_RTOL, [f"rtol: {SMALLEST_RTOL:.1e} instead of {rtol:.1e}, which is below round-off"]


def stop_times(times: Sequence[float], t_start: float, t_end: float) -> list[float]:
    """Return the times at which states are wanted, in order, the end of the run last."""
    wanted = sorted({float(t) for t in times})
    for t in wanted:
        if not t_start <= t <= t_end:
            raise RuntimeModelError(f"at: {t} s is outside the run, from {t_start} s to {t_end} s")
    return wanted if wanted and wanted[-1] == t_end else [*wanted, t_end]


def _split_inputs(
    system: System, inputs: dict[Any, Any], parameters: Mapping[str, float]
) -> tuple[dict[Any, Any], dict[str, float]]:
    """Return inputs over time, those of the model included where nothing else is said, and constant ones."""
    own = [record for record in system.inputs if "table" in record or "polynomial" in record]
    if not own and all(type(value) in (int, float) for value in inputs.values()):
        return {}, inputs
    from symgen.runtime.inputs.given import from_record, is_constant

    said = {name for key in (*inputs, *parameters) for name in (key if isinstance(key, tuple) else (key,))}
    moving = {record["name"]: from_record(record) for record in own if record["name"] not in said}
    moving |= {key: value for key, value in inputs.items() if not is_constant(value)}
    return moving, {key: float(value) for key, value in inputs.items() if is_constant(value)}


def _schedule(system: System, arrays: LoopArrays, method: Method, t_start: float) -> Any:
    from symgen.runtime.inputs.schedule import InputSchedule

    return InputSchedule(system, arrays, method, t_start)


def _moved_notes(moved: Sequence[tuple[str, float, float]]) -> list[str]:
    return [f"assembly moved {name} from {before:.9g} to {after:.9g}" for name, before, after in moved]
