"""Record a run that is over."""

from __future__ import annotations

import hashlib
import math
import pprint
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.health import health_of
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.module import DECORATOR
from symgen.runtime.recording import schema

from .recorder import RunRecorder

if TYPE_CHECKING:
    import os

    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System


def save_solution(
    solution: Solution,
    path: str | os.PathLike[str],
    *,
    model_text: str = "",
    title: str = "",
    mesh_folder=None,
    content: str = schema.ALL,
) -> None:
    """Write a solution as a recording.

    Parameters
    ----------
    solution : Solution
    path : path-like
    model_text : str, optional
        The model as its author wrote it.
    title : str, optional
        The model's name otherwise.
    mesh_folder : path-like, optional
        The model's folder, below which its meshes lie.
    content : {"all", "states"}
        As of `RunRecorder`.
    """
    system = solution.system
    recorder = RunRecorder(
        path,
        system,
        solution.p,
        method=solution.method,
        constraints=solution.constraints,
        rtol=solution.rtol,
        atol=solution.atol,
        module_text=module_text(system),
        model_text=model_text,
        title=title,
        options={"step": solution.step} if solution.step else {},
        mesh_folder=mesh_folder,
        content=content,
    )
    places = [_frames_before(solution, event) for event in solution.events]
    states = np.hstack([solution.q, solution.v, _work(solution, places)[:, : system.nw]])
    with recorder:
        if solution.forms is not None:
            recorder.settings(solution.forms.settings[solution.forms.index[0]])
        recorder.start(solution.t[0], states[0])
        recorder.steps(solution.step_log)
        first = 1
        for place, event in zip(places, solution.events):
            _record_frames(recorder, solution, states, first, place)
            recorder.event(event.name, event.t, energy_change=event.energy_change)
            first = max(first, place)
        _record_frames(recorder, solution, states, first, len(states))
        recorder.finish(solution.status, [check.to_dict() for check in health_of(solution)], solution.stats)


def _record_frames(
    recorder: RunRecorder, solution: Solution, states: np.ndarray, first: int, end: int
) -> None:
    """Record frames from `first` to `end`, with the settings of stops and frictions that hold at each."""
    forms, marks = solution.forms, [first]
    if forms is not None:
        marks += (np.flatnonzero(np.diff(forms.index[first:end])) + first + 1).tolist()
    for begin, stop in pairwise([*marks, end]):
        if forms is not None and begin < stop:
            recorder.settings(forms.settings[forms.index[begin]])
        recorder.frames(solution.t[begin:stop], states[begin:stop])


def module_text(system: System) -> str:
    """Return the text of a system's module: its file's where that is unchanged, else put together again."""
    try:
        text = Path(system.file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        text = ""
    if hashlib.sha256(text.encode()).hexdigest() == system.source.text_hash:
        return text
    source = system.source.whole_if_possible()
    header = pprint.pformat(source.header, sort_dicts=False, width=110)
    of_math = [name for name in sorted(IN_CODE) if IN_CODE[name].value is getattr(math, name, None)]
    of_numpy = sorted(set(IN_CODE) - set(of_math))
    imports = [f"from math import {', '.join(of_math)}", f"from numpy import {', '.join(of_numpy)}"]
    functions = [f"{DECORATOR}\n{function}" for function in source.functions.values()]
    start = "\n\n".join([f'"""{system.name}"""', *imports, "from numba import njit", f"MODEL = {header}\n"])
    return "\n\n".join([start, *functions])


def _frames_before(solution: Solution, event: EventRecord) -> int:
    """Return how many frames come before an event; one at its very time may show the state after it."""
    place = int(np.searchsorted(solution.t, event.t, side="left"))
    while place < len(solution.t) and solution.t[place] == event.t:
        after = np.array_equal(solution.q[place], event.q_after) and np.array_equal(
            solution.v[place], event.v_after
        )
        if after and event.action == "reset":
            break
        place += 1
    return place


def _work(solution: Solution, places: list[int]) -> np.ndarray:
    """Return the work without that of resets, shape (n, 1)."""
    work = solution.w.copy()
    for place, event in zip(places, solution.events):
        work[place:] -= event.energy_change
    return work[:, None]
