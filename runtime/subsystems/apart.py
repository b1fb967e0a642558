"""Integrate a model by its independent subsystems: each with its own step and method."""

from __future__ import annotations

import contextlib
import gc
import time
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.subsystems.course import find_course
from symgen.runtime.subsystems.division import divide
from symgen.runtime.subsystems.gain import pays
from symgen.runtime.subsystems.groups import in_groups
from symgen.runtime.subsystems.joined import Joined
from symgen.runtime.subsystems.report import Parts
from symgen.runtime.subsystems.settings import Settings
from symgen.runtime.subsystems.subsystem import subsystems
from symgen.runtime.subsystems.words import say
from symgen.runtime.summary import summarise
from symgen.runtime.timing.timetable import step_limits_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy as np

    from symgen.runtime.options import RunOptions
    from symgen.runtime.solution import Solution
    from symgen.runtime.subsystems.course import Course
    from symgen.runtime.subsystems.subsystem import Subsystem
    from symgen.runtime.system import System

_ASKED = ("method", "constraints", "rtol", "atol", "step", "energy_scaling", "split", "max_step")
ASKED = "asked"  # among a recording's options: the settings as they were asked for
_FIRST_WINDOW = 1 / 32  # of the frames
_SECONDS_PER_WINDOW, _SECONDS_UNWATCHED = 0.5, 3.0  # where somebody waits for frames, and else
_MOST_GROWTH = 64.0


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
def simulate_apart(
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
    settings = Settings(options, treatment, redundant, *options.frame_times(), step_limits)
    found = in_groups(subsystems(system, kinds, p, state, settings))
    if options.split is None and not pays(found):
        return "common steps cost less, as none is much faster than all others"
    method = Counter(s.choice.method.name for s in found for _ in s.titles).most_common(1)[0][0]
    step = min(s.choice.step for s in found if s.choice.method.name == method)
    prepared = time.perf_counter()
    course = find_course(found, settings, system.ny)
    if course is None:
        return "its events are too many to keep the states of all subsystems at each"
    settings = _with_recorder(system, p, settings, method, step, notes)
    for subsystem in found:
        subsystem.prepare(course.times, course.shown, course.stops(subsystem, settings), settings)
    for run in {s.choice.method.name + s.system.name: s.run for s in found}.values():
        run.arrays.load()
    compiled = time.perf_counter()
    joined = Joined(system, p, found, course, settings)
    joined.timetable = settings.timetable_of(system, METHODS[method])
    _go(found, joined, course, settings)
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
    said_of_them = [*notes, *say(found, len(system.subsystems)), *kept]
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


def _go(found: Sequence[Subsystem], joined: Joined, course: Course, settings: Settings) -> None:
    """Run all, window after window of frames, so that those that are there can be recorded."""
    n = len(course.times)
    done, window = 1, max(1, int(_FIRST_WINDOW * n))
    is_watched = settings.options.recorder is not None or settings.options.progress is not None
    wanted = _SECONDS_PER_WINDOW if is_watched else _SECONDS_UNWATCHED
    while done < n and joined.status == "success":
        began, end = time.perf_counter(), min(n, done + window)
        try:
            _go_to(end if end < n else n + 1, found, joined, course, settings)
        except KeyboardInterrupt:
            joined.interrupt()
        done = end
        joined.take_frames(min(s.run.n_frames for s in found))
        if settings.options.progress is not None:
            settings.options.progress(
                float(course.times[joined.n_frames - 1]), sum(s.run.n_steps for s in found)
            )
        took = time.perf_counter() - began
        window = max(1, int(window * min(_MOST_GROWTH, wanted / max(took, 1e-6))))


def _go_to(end: int, found: Sequence[Subsystem], joined: Joined, course: Course, settings: Settings) -> None:
    """Run all to some frame, or to the end of one that ends before its time."""
    used = sum(s.run.n_steps for s in found)
    for subsystem in found:
        run, before = subsystem.run, subsystem.run.n_steps
        if settings.options.max_steps is not None:
            run.max_steps = settings.options.max_steps - (used - before)
        run.go_to(end)
        used += run.n_steps - before
        if run.status != "success" and subsystem is not course.ended_by:
            joined.end(subsystem)
            return
