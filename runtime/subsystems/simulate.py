"""Integrate a model by its independent subsystems: each with its own step and method, and what the run says of them."""

from __future__ import annotations

import contextlib
import gc
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.subsystems.decomposition import divide
from symgen.runtime.subsystems.groups import grouped, pays
from symgen.runtime.subsystems.joined import Joined, locate_events
from symgen.runtime.subsystems.report import Parts
from symgen.runtime.subsystems.subsystem import Settings, subsystems
from symgen.runtime.summary import summarise
from symgen.runtime.timing.timetable import step_limits_of

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.solution import Solution
    from symgen.runtime.subsystems.joined import EventSchedule
    from symgen.runtime.subsystems.subsystem import Subsystem
    from symgen.runtime.system import System

_ASKED = ("method", "constraints", "rtol", "atol", "step", "energy_scaling", "split", "max_step")
ASKED = "asked"  # among a recording's options: the settings as they were asked for
_FIRST_WINDOW = 1 / 32  # of the frames
_SECONDS_PER_WINDOW, _SECONDS_UNWATCHED = 0.5, 3.0  # where somebody waits for frames, and else
_MOST_GROWTH = 64.0
_MOST_NOTES = 5


@contextlib.contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """The many objects of runs all survive, and looking through them takes as long as short runs do."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


@_without_garbage_collection()
def simulate_subsystems(
    system: System,
    p: np.ndarray,
    state: np.ndarray,
    options: RunOptions,
    treatment: str,
    *,
    redundant: list[str],
    notes: list[str],
    began: float,
) -> Solution | str:
    """Return the solution of a model whose subsystems are integrated by themselves.

    Parameters
    ----------
    system : System
        The whole model.
    p : ndarray
        Parameters and inputs of the whole.
    state : ndarray, shape (nq + nv,)
        Consistent initial state.
    treatment : str
        How its constraints are treated.
    redundant : list of str
        Those of them that follow from the others.
    notes : list of str
        What was said so far.
    began : float [s]
        When the preparations did, on `time.perf_counter`.

    Returns
    -------
    Solution or str
        Why the model is better integrated as one.
    """
    kinds, why_not = divide(system)
    if not kinds:
        return why_not
    step_limits = step_limits_of(system, p, options.t_start, options.t_end)
    settings = Settings(options, treatment, redundant, *options.frame_times(system.ny), step_limits)
    found = grouped(subsystems(system, kinds, p, state, settings), settings)
    if options.split is None and not pays(system, found, options.rtol):
        return "common steps cost less, as none is much faster than all others"
    method = Counter(s.choice.method.name for s in found for _ in s.titles).most_common(1)[0][0]
    step = min(s.choice.step for s in found if s.choice.method.name == method)
    prepared = time.perf_counter()
    schedule = locate_events(found, settings, system.ny)
    if schedule is None:
        return "its events are too many to keep the states of all subsystems at each"
    settings = _with_recorder(system, p, settings, method, step, notes)
    for subsystem in found:
        subsystem.prepare(schedule.times, schedule.shown, schedule.stops(subsystem, settings), settings)
    for run in {s.choice.method.name + s.system.name: s.run for s in found}.values():
        run.arrays.load()
    compiled = time.perf_counter()
    joined = Joined(system, p, found, schedule, settings)
    joined.timetable = settings.timetable_of(system, METHODS[method])
    _run_all(found, joined, schedule, settings)
    joined.finish()
    seconds = {
        "prepare": prepared - began,
        "compile": compiled - prepared,
        "run": time.perf_counter() - compiled,
    }
    said = {
        "method": method, "constraints": treatment, "rtol": options.rtol, "atol": options.atol,
        "t_start": options.t_start, "t_end": options.t_end, "step": step or None, "redundant": redundant,
    }  # fmt: skip
    kept = joined.timetable.notes if joined.timetable is not None else []
    said_of_them = [*notes, *notes_on(found, len(system.subsystems)), *kept]
    solution = summarise(joined, options.at, said_of_them, seconds, said)
    solution.parts = Parts(found)
    return solution


def _with_recorder(
    system: System, p: np.ndarray, settings: Settings, method: str, step: float, notes: list[str]
) -> Settings:
    """The settings with a recorder in the place of what makes one."""
    options = settings.options
    asked = {
        **({"step": step} if step else {}),
        **{key: getattr(options, key) for key in ("t_start", "t_end", "fps")},
        "redundant": settings.redundant,
        "at": [float(t) for t in options.at],
        "notes": notes,
        ASKED: {
            **{key: getattr(options, key) for key in _ASKED},
            "breaks": [float(t) for t in options.breaks],
        },
    }
    recorder = options.recorder_for(system, p, method, settings.treatment, asked)
    return replace(settings, options=replace(options, recorder=recorder))


def _run_all(found: Sequence[Subsystem], joined: Joined, schedule: EventSchedule, settings: Settings) -> None:
    """Run all, window after window of frames, so that those that are there can be recorded."""
    n = len(schedule.times)
    done, window = 1, max(1, int(_FIRST_WINDOW * n))
    is_watched = settings.options.recorder is not None or settings.options.progress is not None
    wanted = _SECONDS_PER_WINDOW if is_watched else _SECONDS_UNWATCHED
    while done < n and joined.status == "success":
        began, end = time.perf_counter(), min(n, done + window)
        try:
            _run_all_to(end if end < n else n + 1, found, joined, schedule, settings)
        except KeyboardInterrupt:
            joined.interrupt()
        done = end
        joined.take_frames(min(s.run.n_frames for s in found))
        if settings.options.progress is not None:
            settings.options.progress(
                float(schedule.times[joined.n_frames - 1]), sum(s.run.n_steps for s in found)
            )
        took = time.perf_counter() - began
        window = max(1, int(window * min(_MOST_GROWTH, wanted / max(took, 1e-6))))


def _run_all_to(
    end: int, found: Sequence[Subsystem], joined: Joined, schedule: EventSchedule, settings: Settings
) -> None:
    """Run all to some frame, or to the end of one that ends before its time."""
    used = sum(s.run.n_steps for s in found)
    for subsystem in found:
        run, before = subsystem.run, subsystem.run.n_steps
        if settings.options.max_steps is not None:
            run.max_steps = settings.options.max_steps - (used - before)
        run.go_to(end)
        used += run.n_steps - before
        if run.status != "success" and subsystem is not schedule.ended_by:
            joined.end(subsystem)
            return


def notes_on(found: Sequence[Subsystem], n_kinds: int) -> Iterator[str]:
    """Yield the notes on a run of `n_kinds` kinds of subsystems."""
    n, steps = sum(len(s.titles) for s in found), [n for s in found for n in s.steps_of_each()]
    yield (
        f"subsystems: {n} of {n_kinds} kind{'s' * (n_kinds > 1)}, each integrated by itself with its own steps, "
        f"{min(steps)} to {max(steps)} of them"
    )
    yield from _choices(found, n)
    twins = sum(len(s.columns) - 1 for s in found)
    if twins:
        yield f"subsystems: {twins} of {n} start and move as others do, and took no steps of their own"
    in_lanes = sum(len(s.titles) for s in found if len(s.titles) > len(s.columns))
    if in_lanes:
        yield f"subsystems: {in_lanes} of {n} in lanes of vector registers, as members of an ensemble"
    asleep = [t for s in found for t in s.rests_from() if np.isfinite(t)]
    if asleep:
        yield f"asleep: {len(asleep)} of {n} subsystems at rest, the first from t = {min(asleep):.6g} s on"
    own = [f"{s.name}: {note}" for s in found for note in s.run.notes]
    yield from own[:_MOST_NOTES]
    if len(own) > _MOST_NOTES:
        yield f"and {len(own) - _MOST_NOTES} notes more about subsystems"


def _choices(found: Sequence[Subsystem], n: int) -> Iterator[str]:
    """What was chosen, once for all subsystems of which the same is said but for numbers."""
    groups: dict[tuple[str, str], list[tuple[str, Subsystem]]] = {}
    for subsystem in found:
        for note in subsystem.choice.notes:
            groups.setdefault((note.split(":")[0], subsystem.choice.method.name), []).append(
                (note, subsystem)
            )
    for group in groups.values():
        note, first = group[0]
        count = sum(len(subsystem.titles) for _, subsystem in group)
        yield (
            note if count == n else f"{note} ({count} of {n} subsystems, the first is the {first.titles[0]})"
        )
