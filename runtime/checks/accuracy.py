"""How far a run may be off at its end: short parts of it, integrated again with finer steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from runtime.checks.entry import HealthCheck, limited
from runtime.integrate import layout as at
from runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from runtime.integrate.methods import Method
    from runtime.solution import Solution

_PARTS = 4
_COVERED = 0.003  # of the run, by all parts
_FEWEST_STEPS = 4  # in a part
_FINER_RTOL, _SMALLEST_RTOL = 1e-3, 1e-11
_MOST_STEPS = 2000
_LARGEST_ERROR = {
    "adaptive": 0.05,
    "fixed step": 0.25,
}  # the latter: phase errors of steps that the rule allows
_LEAST_SCALE = 1e-3  # of the largest coordinate or rate


def accuracy(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield the estimated error at the end of a run, in parts of what each coordinate and rate goes through.

    Parts of the run are integrated again, with half the step or a tolerance a thousand times tighter. What they
    differ by is the error that such a part adds, and the whole run adds as much of it as it is longer than these parts.
    Errors that die out, or grow, are over- or underestimated by this: it tells digits from garbage, no more.
    """
    if not _applies(solution, method):
        return
    t = solution.t
    again = _Again(solution, method)
    found = [(end - t[first], again.difference(first, end)) for first, end in _parts(solution)]
    found = [(length, error) for length, error in found if error is not None]
    if not found:
        return
    share = sum(length for length, _ in found) / (t[-1] - t[0])
    errors = sum(error for _, error in found) / max(min(share, 1.0), 1e-300) / _scale(solution)
    worst = int(np.argmax(errors))
    from runtime.failures import state_names

    name = state_names(solution.system)[worst]
    text = f"{name} at the end is off by about {errors[worst]:.2g} of its range, as finer steps in parts of the run say"
    remedy = (
        f"a smaller rtol than {solution.rtol:g}"
        if method.adaptive
        else f"a smaller step than {solution.step:g} s"
    )
    limit = _LARGEST_ERROR["adaptive" if method.adaptive else "fixed step"]
    yield limited("accuracy", errors[worst], limit, text, f"{text}: take {remedy}")


def _applies(solution: Solution, method: Method) -> bool:
    if (
        solution.forms is not None
        or solution.system.input_words
        or solution.constraints not in ("none", method.form)
    ):
        return False
    if len(solution.t) < 8 or not len(solution.step_log):
        return False
    return method.adaptive or (method.order > 1 and bool(solution.step))


def _scale(solution: Solution) -> np.ndarray:
    system = solution.system
    range_ = np.ptp(solution.states, axis=0)
    for part in (slice(0, system.nq), slice(system.nq, system.nq + system.nv)):
        range_[part] = np.maximum(range_[part], _LEAST_SCALE * range_[part].max(initial=0.0))
    return np.where(range_ > 0.0, range_, 1.0)


def _parts(solution: Solution) -> Iterator[tuple[int, float]]:
    """Yield first frames and ends [s] of the parts, where no event falls into them; adaptive ones end at frames."""
    t = solution.t
    span = t[-1] - t[0]
    step = solution.step or float(np.median(solution.step_log[:, 1]))
    length = min(max(_COVERED * span / _PARTS, _FEWEST_STEPS * step), span / _PARTS)
    fired = np.array([event.t for event in solution.events])
    for begin in t[0] + span * np.arange(_PARTS) / _PARTS:
        first = int(np.searchsorted(t, begin))
        end = t[first] + length
        if not solution.step:
            end = t[min(max(first + 1, int(np.searchsorted(t, end))), len(t) - 1)]
        if t[first] < end <= t[-1] and not np.any((fired >= t[first]) & (fired <= end)):
            yield first, float(end)


class _Again:
    """Integrates parts of a run again: with a tighter tolerance, or with the step and half of it."""

    def __init__(self, solution: Solution, method: Method):
        self._solution, self._method = solution, method
        fine = max(_FINER_RTOL * solution.rtol, _SMALLEST_RTOL)
        self._settings = (
            [(fine, 0.0)]
            if method.adaptive
            else [(solution.rtol, solution.step), (solution.rtol, 0.5 * solution.step)]
        )
        self._arrays: list[LoopArrays] = []

    def difference(self, first: int, end: float) -> np.ndarray | None:
        """Return what a part from a frame on is off by, shape (nq + nv,); None where it cannot be integrated."""
        if not self._arrays:
            self._arrays = [self._made(rtol, step) for rtol, step in self._settings]
        ends = [
            self._end(arrays, step, first, end) for arrays, (_, step) in zip(self._arrays, self._settings)
        ]
        if any(found is None for found in ends):
            return None
        if self._method.adaptive:
            return np.abs(ends[0] - self._solution.states[np.searchsorted(self._solution.t, end)])
        factor = 2.0**self._method.order
        return np.abs(ends[1] - ends[0]) * factor / (factor - 1.0)

    def _made(self, rtol: float, step: float) -> LoopArrays:
        of = self._solution
        return LoopArrays(
            of.system, self._method, of.p, float(of.t[0]), of.states[0], frame_times=np.zeros(0), rtol=rtol,
            atol=of.atol * rtol / of.rtol, step=step, span=float(of.t[-1] - of.t[0]), with_events=False,
        )  # fmt: skip

    def _end(self, arrays: LoopArrays, step: float, first: int, end: float) -> np.ndarray | None:
        t, states = self._solution.t, self._solution.states
        n = states.shape[1]
        # As new, but for what takes long to make.
        arrays.counters[:] = 0
        arrays.work[:], arrays.f[:], arrays.y[n:] = 0.0, 0.0, 0.0
        arrays.y[:n] = states[first]
        for place in (at.T, at.T_GRID, at.T_EVENT):
            arrays.control[place] = t[first]
        arrays.control[at.H] = step
        arrays.restart(state_changed=True)
        reached = arrays.advance(end, _MOST_STEPS) == at.REACHED_STOP
        return arrays.y[:n].copy() if reached and np.all(np.isfinite(arrays.y[:n])) else None
