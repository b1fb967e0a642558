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
from symgen.runtime.subsystems.gain import pays
from symgen.runtime.subsystems.groups import in_groups
from symgen.runtime.subsystems.joined import Joined
from symgen.runtime.subsystems.report import Parts
from symgen.runtime.subsystems.subsystem import subsystems
from symgen.runtime.subsystems.words import say
from symgen.runtime.summary import summarise

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy as np

    from symgen.runtime.solution import Solution
    from symgen.runtime.subsystems.course import Course
    from symgen.runtime.subsystems.member_model import Kind
    from symgen.runtime.subsystems.settings import Settings
    from symgen.runtime.subsystems.subsystem import Subsystem
    from symgen.runtime.system import System

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
def solve_apart(
    system: System,
    kinds: Sequence[Kind],
    p: np.ndarray,
    state: np.ndarray,
    settings: Settings,
    notes: list[str],
    began: float,
) -> Solution | str:
    """Return the solution of a model whose subsystems are integrated by themselves.

    Parameters
    ----------
    system : System
        The whole model.
    kinds : sequence of Kind
    p : ndarray
        Parameters and inputs of the whole.
    state : ndarray, shape (nq + nv,)
        Consistent initial state.
    notes : list of str
        What was said so far.
    began : float [s]
        When the preparations did, on `time.perf_counter`.

    Returns
    -------
    Solution or str
        Why the model is better integrated as one.
    """
    span = settings.t_end - settings.t_start
    found = in_groups(subsystems(system, kinds, p, state, settings), span)
    if settings.split is None and not pays(found, span):
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
        run.arrays.advance(settings.t_end, 0)  # no steps: loops are compiled before the run is timed
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
        "method": method, "constraints": settings.treatment, "rtol": settings.rtol, "atol": settings.atol,
        "t_start": settings.t_start, "t_end": settings.t_end, "step": step or None, "redundant": settings.redundant,
    }  # fmt: skip
    kept = joined.timetable.notes if joined.timetable is not None else []
    said_of_them = [*notes, *say(found, len(system.subsystems)), *kept]
    solution = summarise(joined, settings.at, said_of_them, seconds, said)
    solution.parts = Parts(found)
    return solution


def _with_recorder(
    system: System, p: np.ndarray, settings: Settings, method: str, step: float, notes: list[str]
) -> Settings:
    """The settings with a recorder in the place of what makes one."""
    if settings.recorder is None or hasattr(settings.recorder, "frames"):
        return settings
    asked = ("method", "constraints", "rtol", "atol", "step", "energy_scaling", "split", "max_step")
    options = {
        **({"step": step} if step else {}),
        **{key: getattr(settings, key) for key in ("t_start", "t_end", "fps", "redundant")},
        "at": [float(t) for t in settings.at],
        "notes": notes,
        ASKED: {
            **{key: getattr(settings, key) for key in asked},
            "breaks": [float(t) for t in settings.breaks],
        },
    }
    recorder = settings.recorder(
        system=system, p=p, method=method, constraints=settings.treatment, rtol=settings.rtol, atol=settings.atol,
        options=options,
    )  # fmt: skip
    return replace(settings, recorder=recorder)


def _go(found: Sequence[Subsystem], joined: Joined, course: Course, settings: Settings) -> None:
    """Run all, window after window of frames, so that those that are there can be recorded."""
    n = len(course.times)
    done, window = 1, max(1, int(_FIRST_WINDOW * n))
    is_watched = settings.recorder is not None or settings.progress is not None
    wanted = _SECONDS_PER_WINDOW if is_watched else _SECONDS_UNWATCHED
    while done < n and joined.status == "success":
        began, end = time.perf_counter(), min(n, done + window)
        try:
            _go_to(end if end < n else n + 1, found, joined, course, settings)
        except KeyboardInterrupt:
            joined.interrupt()
        done = end
        joined.take_frames(min(s.run.n_frames for s in found))
        if settings.progress is not None:
            settings.progress(float(course.times[joined.n_frames - 1]), sum(s.run.n_steps for s in found))
        took = time.perf_counter() - began
        window = max(1, int(window * min(_MOST_GROWTH, wanted / max(took, 1e-6))))


def _go_to(end: int, found: Sequence[Subsystem], joined: Joined, course: Course, settings: Settings) -> None:
    """Run all to some frame, or to the end of one that ends before its time."""
    used = sum(s.run.n_steps for s in found)
    for subsystem in found:
        run, before = subsystem.run, subsystem.run.n_steps
        if settings.max_steps is not None:
            run.max_steps = settings.max_steps - (used - before)
        run.go_to(end)
        used += run.n_steps - before
        if run.status != "success" and subsystem is not course.ended_by:
            joined.end(subsystem)
            return
