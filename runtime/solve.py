"""Integrate a model: consistent start, method, run, energy and constraints checked."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.checks.inertia import refuse_negative_inertia
from runtime.choose import EXPLICIT, SERIES, choose_constraints, choose_method, choose_step
from runtime.constraints.assembly import assemble
from runtime.driver import Run
from runtime.errors import RuntimeModelError
from runtime.integrate.methods import METHODS
from runtime.loop_arrays import LoopArrays
from runtime.summary import summarise

if TYPE_CHECKING:
    from runtime.solution import Solution
    from runtime.system import System

_FPS = 60.0
_LEAST_FRAMES, _MOST_FRAMES = 200, 20_000
_FRAMES_IN_MEMORY = 1_000_000_000
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
    inputs: Mapping[str, float] | None = None,
    at: Sequence[float] = (),
    fps: float | None = None,
    t_start: float = 0.0,
    progress: Callable[[float, int], None] | None = None,
    recorder: Any = None,
    max_steps: int | None = None,
) -> Solution:
    """Integrate `system` from `t_start` to `t_end`.

    Parameters
    ----------
    system : System
    t_end : float, optional [s]
        The model's own `[run]` table by default.
    method : str
        One of `runtime.integrate.methods.METHODS`, or "auto".
    rtol, atol : float
        Tolerances of adaptive methods, per step and component.
    step : float, optional [s]
        Of fixed-step methods; 1/50 of the fastest period at the start by default, up to 1/14 with high orders.
    constraints : str
        "projection" or "auto".
    parameters, inputs : mapping of str to float, optional
        Values other than the model's.
    start, rate : mapping of str to float, optional
        Initial values of coordinates and rates, enforced.
    at : sequence of float [s]
        Times that are landed on exactly and kept as samples.
    fps : float, optional
        Frames per second of simulated time; by default 60, but at least 200 and at most 20 000 frames in all.
    progress : callable, optional
        Called with (t, steps) now and then.
    recorder : object, optional
        `runtime.recording.recorder.RunRecorder`, or a callable that makes one: it is called with `system`, `p`,
        `method`, `constraints`, `rtol`, `atol` and `options` once these are settled.
    max_steps : int, optional
        Fail after this many steps.

    Returns
    -------
    Solution
        Also where the run failed: see its `status` and `message`.

    Raises
    ------
    RuntimeModelError
        An option does not fit, or the initial conditions contradict the constraints.
    """
    t_start, t_end = _interval(system, t_start, t_end)
    rtol, atol = _tolerance("rtol", rtol), _tolerance("atol", atol)
    p = system.parameter_values({**(parameters or {}), **(inputs or {})})
    treatment = choose_constraints(constraints, system)
    began = time.perf_counter()
    assembly = assemble(system, p, start, rate, t_start)
    state = np.concatenate([assembly.q, assembly.v])
    refuse_negative_inertia(system, p, t_start, state)
    notes = [*_moved_notes(assembly.moved), *assembly.notes]
    rtol, more = _usable_rtol(rtol)
    notes += more
    chosen, more = choose_method(method, system, p, t_start, state, t_end, rtol, atol)
    notes += more
    chosen_step, more = choose_step(chosen, step, system, p, t_start, state, t_end)
    notes += more
    times, shown = frame_times(t_start, t_end, fps)
    arrays = LoopArrays(
        system, chosen, p, t_start, state, frame_times=times, rtol=rtol, atol=atol, step=chosen_step,
        span=t_end - t_start,
    )  # fmt: skip
    if recorder is not None and not hasattr(recorder, "frames"):
        recorder = recorder(
            system=system, p=p, method=chosen.name, constraints=treatment, rtol=rtol, atol=atol,
            options={"step": chosen_step} if chosen_step else {},
        )  # fmt: skip
    run = Run(
        system, chosen, arrays, shown, _stops(at, t_start, t_end),
        recorder=recorder, progress=progress, max_steps=max_steps,
        fallback=METHODS[EXPLICIT] if method == "auto" and chosen.name == SERIES else None,
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
    times = np.union1d(wanted, filled)
    return times, np.isin(times, wanted)


def _interval(system: System, t_start: float, t_end: float | None) -> tuple[float, float]:
    if t_end is None:
        t_end = system.run_defaults.get("t_end")
    if t_end is None:
        raise RuntimeModelError(f"model {system.name!r} does not say how long to run: give t_end")
    t_start, t_end = float(t_start), float(t_end)
    if not (np.isfinite(t_start) and np.isfinite(t_end) and t_end > t_start):
        raise RuntimeModelError(f"t_end is {t_end} s: it must lie after t_start = {t_start} s")
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


def _stops(times: Sequence[float], t_start: float, t_end: float) -> list[float]:
    wanted = sorted({float(t) for t in times})
    for t in wanted:
        if not t_start <= t <= t_end:
            raise RuntimeModelError(f"at: {t} s is outside the run, from {t_start} s to {t_end} s")
    return wanted if wanted and wanted[-1] == t_end else [*wanted, t_end]


def _moved_notes(moved: Sequence[tuple[str, float, float]]) -> list[str]:
    return [f"assembly moved {name} from {before:.9g} to {after:.9g}" for name, before, after in moved]
