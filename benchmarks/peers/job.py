"""What peers share: the job that `symgen bench` sends, the sweep over tolerances, and the lines sent back.

A peer's script measures one scene in a process of its own: a job comes as JSON on standard input, each run goes back
as one line of JSON. A peer gives a function that prepares a run at a tolerance and returns a callable that runs it.
"""

from __future__ import annotations

import gc
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symgen.runtime import System, load

_STALE = 3  # tolerances in a row that gain nothing, once the error is small
_SMALL = 1e-9
_IDLE_RUNS = 20
_LONGEST_FAILURES = 30.0  # [s]: of all failures of a sweep, beyond which it is given up


class TooLong(Exception):
    """A run would take longer than a sweep waits for."""

    def __init__(self, seconds: float):
        super().__init__(f"a run takes longer than {seconds:g} s")


@dataclass(frozen=True)
class Job:
    """A scene to measure.

    Attributes
    ----------
    system : System
    text : str
        Of its module.
    p, start, end, size : ndarray
        Parameters, start (q, v), and what the end is held against.
    t_end : float [s]
    atol_ratio : float
    tolerances : ndarray
        Loosest first.
    effort : dict
        longest_run [s], repeat [s], most_runs.
    """

    system: System
    text: str
    p: np.ndarray
    start: np.ndarray
    end: np.ndarray
    size: np.ndarray
    t_end: float
    atol_ratio: float
    tolerances: np.ndarray
    effort: dict[str, Any]

    @property
    def n(self) -> int:
        """The number of equations: coordinates and rates."""
        return len(self.start)

    def error(self, state: np.ndarray) -> float | None:
        """Return the largest error in parts of the motion's size, None where it is not finite."""
        error = np.max(np.abs(np.asarray(state)[: self.n] - self.end) / self.size)
        return float(error) if np.isfinite(error) else None


def read_job() -> Job:
    """Read the job from standard input."""
    data = json.load(sys.stdin)
    arrays = {key: np.array(data[key]) for key in ("p", "start", "end", "size", "tolerances")}
    rest = {key: data[key] for key in ("t_end", "atol_ratio", "effort")}
    text = Path(data["module"]).read_text(encoding="utf-8")
    return Job(system=load(data["module"]), text=text, **arrays, **rest)


def send(method: str, version: str, **content: Any) -> None:
    """Send one line: `row`, or `says`."""
    print(json.dumps({"method": method, "version": version, **content}), flush=True)


def sweep(
    job: Job, method: str, version: str, prepare: Callable[[float, float], tuple[Callable, Callable]]
) -> None:
    """Measure a method at one tolerance after the other, and send each result.

    Parameters
    ----------
    prepare : callable
        (rtol, atol) -> (run, idle): `run()` integrates from the start and returns the end state and the number of
        evaluations of the right-hand side, 0 where that is not known; `idle()` does the same without integrating,
        its time is taken off.
    """
    errors: list[float] = []
    failing = 0.0
    for rtol in map(float, job.tolerances):
        began = time.perf_counter()
        try:
            run, idle = prepare(rtol, rtol * job.atol_ratio)
            row = {"setting": rtol, **_measure(job, run, idle)}
        except Exception as error:
            send(method, version, says=f"rtol {rtol:.0e}: {type(error).__name__}: {error}")
            failing += time.perf_counter() - began
            # Loose tolerances may get nowhere where tighter ones do; after a run that arrived they only cost more.
            if failing > _LONGEST_FAILURES or (errors and isinstance(error, TooLong)):
                return
            continue
        send(method, version, row=row)
        if row["error"] is not None:
            errors.append(row["error"])
        if 2.0 * row["seconds"] > job.effort["longest_run"]:
            send(method, version, says=f"finer runs take longer than {job.effort['longest_run']:g} s")
            return
        if (
            len(errors) > _STALE
            and min(errors) < _SMALL
            and min(errors[-_STALE:]) > 0.5 * min(errors[:-_STALE])
        ):
            return


def _measure(job: Job, run: Callable, idle: Callable) -> dict[str, Any]:
    best, _ = _timed(run)  # may compile
    idle()
    gc.disable()
    total, runs = 0.0, 0
    while runs == 0 or (total < job.effort["repeat"] and runs < job.effort["most_runs"]):
        took, (state, rhs) = _timed(run)
        best, total, runs = min(best, took), total + took, runs + 1
    nothing = min(_timed(idle)[0] for _ in range(_IDLE_RUNS))
    gc.enable()
    return {"error": job.error(state), "seconds": max(best - nothing, 1e-9), "runs": runs, "rhs": rhs}


def _timed(call: Callable) -> tuple[float, Any]:
    began = time.process_time()
    result = call()
    return time.process_time() - began, result
