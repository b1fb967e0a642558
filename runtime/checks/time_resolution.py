"""Do the steps follow what time alone does: pulses that a fixed step goes over, or changes too many for any?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.entry import HealthCheck, limited
from symgen.runtime.sampling import sample_rows
from symgen.runtime.timing.search import Samples, TimeTerms

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_MOST_LEFT_OUT = 0.1  # of what a term does, by steps that go over it
_MOST_STEPS = 400  # that are looked at
_FINER, _MOST_PARTS = 8.0, 1024  # parts of a step: so many in the time of a change


def time_resolution(solution: Solution) -> Iterator[HealthCheck]:
    """Yield whether what time alone does is resolved, where that can be in doubt.

    A step of fixed length sees a term at its ends and in its middle: the sum over these (Simpson's rule) is held
    against a fine one, step by step, in parts of what the term adds up to. Where changes are too many to be followed,
    nobody knows what the steps saw.
    """
    timetable = solution.timetable
    if timetable is None:
        return
    step_limits = timetable.step_limits
    if step_limits.missed:
        says = (
            f"forces or constraints change with time alone within {step_limits.missed:.2g} s, too often for steps to "
            "follow: take their mean, or a shorter run"
        )
        yield HealthCheck("time terms", False, step_limits.missed, 0.0, says)
    elif solution.step and solution.system.has("time_terms"):
        taken = min(solution.step, float(solution.t[-1]) - solution.t_start)  # the last one ends with the run
        left_out, t = _left_out(solution, taken)
        found = f"steps of {taken:.3g} s leave out {left_out:.2g} of what time alone does at t = {t:.6g} s"
        objection = f"{found}: take shorter ones, or a method that chooses its steps"
        if left_out > 0.0:
            yield limited("time terms", left_out, _MOST_LEFT_OUT, f"at most, {found}", objection)


def _left_out(solution: Solution, step: float) -> tuple[float, float]:
    """Return the largest part of a term that steps do not see, and where [s]."""
    step_limits, t_start, t_end = solution.timetable.step_limits, solution.t_start, float(solution.t[-1])
    ends = np.append(step_limits.begin[1:], np.inf)
    terms = TimeTerms(solution.system, solution.p)
    worst, where = 0.0, t_start
    for begin, end, limit in zip(step_limits.begin, ends, step_limits.longest, strict=True):
        begin, end = max(begin, t_start), min(end, t_end)
        if step <= limit or end <= begin:
            continue
        first, last = np.floor((begin - t_start) / step), np.ceil((end - t_start) / step)
        numbers = first + sample_rows(int(last - first), _MOST_STEPS)
        starts = t_start + step * numbers
        parts = 2 * int(np.clip(_FINER * step / limit, 2, _MOST_PARTS // 2))
        times = starts[:, None] + step * np.arange(parts + 1) / parts
        with np.errstate(all="ignore"):
            found = terms.values(Samples(times.ravel()))
        for values in found:
            if isinstance(values, float):
                continue
            rows = np.asarray(values).reshape(times.shape)
            fine, whole = _simpson(rows), _simpson(np.abs(rows)).sum()
            coarse = _simpson(rows[:, [0, parts // 2, parts]])
            off = np.abs(coarse - fine)
            if whole > 0.0 and off.sum() > worst * whole:
                worst, where = float(off.sum() / whole), float(starts[np.argmax(off)])
    return min(worst, 1.0), where


def _simpson(rows: np.ndarray) -> np.ndarray:
    """Return the mean of each row, by Simpson's rule."""
    weights = np.ones(rows.shape[1])
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return rows @ weights / weights.sum()
