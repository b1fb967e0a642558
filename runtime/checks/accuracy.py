"""How far a run may be off at its end: short parts of it, integrated again with finer steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from runtime.checks.entry import HealthCheck, limited
from runtime.checks.error_growth import error_growth, typical_step
from runtime.checks.replay import Replay
from runtime.failures import state_names
from runtime.spread import spread_rows

if TYPE_CHECKING:
    from runtime.integrate.methods import Method
    from runtime.solution import Solution

_ACCURATE_RTOL = 1e-6  # tighter tolerances need no estimate of the error at the end, unless errors grow
_PARTS = 4
_COVERED = 0.003  # of the run, by all parts
_FEWEST_STEPS = 4  # in a part
_FINER_RTOL, _SMALLEST_RTOL = 1e-3, 1e-11
_LEAST_FINER = 0.1  # times rtol
_MOST_STEPS = 2000
LARGEST_ERROR = {
    "adaptive": 0.05,
    "fixed step": 0.25,
}  # the latter: phase errors of steps that the rule allows
_MOST_FRAMES = 1000  # tell a range
_LEAST_SCALE = 1e-3  # of the largest coordinate or rate
_FULL_RANGE = 1.0  # errors grow no further
_MOST_GROWTH = 500.0  # exponent that exp can take


def accuracy(
    solution: Solution, method: Method, resolution: float = 0.0, chaos: bool = True
) -> Iterator[HealthCheck]:
    """Yield the estimated error at the end of a run, in parts of what each coordinate and rate goes through.

    Parts of the run are integrated again, with half the step or a tolerance a thousand times tighter. What they
    differ by is the error that such a part adds, and the whole run adds as much of it as it is longer than these parts.
    Where small errors grow exponentially, at a rate k, those of a run of length T have grown by (exp(k T) - 1) / (k T)
    in the mean. Errors that die out are overestimated by this: it tells digits from garbage, no more.

    Parameters
    ----------
    solution : Solution
    method : Method
    resolution : float
        Steps in the fastest period of a run of fixed step; 0 if unknown.
    chaos : bool
        Whether errors may grow exponentially.
    """
    if not _applies(solution, method):
        return
    scale = _scale(solution)
    tight = method.adaptive and solution.rtol <= _ACCURATE_RTOL
    followed = chaos and _without_resets(solution)
    rate = error_growth(solution, method, scale, resolution) if followed else 0.0
    if tight and rate == 0.0:
        return
    t = solution.t
    again = _Again(solution, method)
    found = [(end - t[first], again.difference(first, end)) for first, end in _parts(solution)]
    found = [(length, error) for length, error in found if error is not None]
    if not found:
        return
    share = sum(length for length, _ in found) / (t[-1] - t[0])
    errors = sum(error for _, error in found) / max(min(share, 1.0), 1e-300) / scale
    # Of errors that grow, each soon has a part of the worst.
    worst, grown = int(np.argmax(errors)), _grown(rate, float(t[-1] - t[0]))
    error = min(errors[worst] * grown, _FULL_RANGE) if rate else errors[worst]
    limit = LARGEST_ERROR["adaptive" if method.adaptive else "fixed step"]
    yield _entry(solution, method, state_names(solution.system)[worst], float(error), limit, rate)


def _entry(
    solution: Solution, method: Method, name: str, error: float, limit: float, rate: float
) -> HealthCheck:
    off = f"{name} at the end is off by about {error:.2g} of its range"
    text = f"{off}, as finer steps in parts of the run say"
    tighter = (
        f"a smaller rtol than {solution.rtol:g}"
        if method.adaptive
        else f"a smaller step than {solution.step:g} s"
    )
    if rate == 0.0:
        return limited("accuracy", error, limit, text, f"{text}: take {tighter}")
    text += f", and errors grow tenfold every {np.log(10.0) / rate:.2g} s: the motion is chaotic or unstable"
    remedy = f"end the run where `symgen check` says that digits are lost, or take {tighter}"
    return limited("accuracy", error, limit, text, f"{text}; {remedy}")


def _grown(rate: float, span: float) -> float:
    """Return by how much the errors of a run have grown in the mean."""
    exponent = min(rate * span, _MOST_GROWTH)
    return float(np.expm1(exponent) / exponent) if exponent > 0.0 else 1.0


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


def _without_resets(solution: Solution) -> bool:
    return solution.parts is None and all(event.action == "record" for event in solution.events)


def _scale(solution: Solution) -> np.ndarray:
    system = solution.system
    some = solution.states[spread_rows(len(solution.t), _MOST_FRAMES)]
    range_ = some.max(axis=0) - some.min(axis=0)
    for part in (slice(0, system.nq), slice(system.nq, system.nq + system.nv)):
        range_[part] = np.maximum(range_[part], _LEAST_SCALE * range_[part].max(initial=0.0))
    return np.where(range_ > 0.0, range_, 1.0)


def _parts(solution: Solution) -> Iterator[tuple[int, float]]:
    """Yield first frames and ends [s] of the parts, where no event falls into them; adaptive ones end at frames."""
    t = solution.t
    span = t[-1] - t[0]
    step = solution.step or typical_step(solution)
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
        fine = max(_FINER_RTOL * solution.rtol, min(_SMALLEST_RTOL, _LEAST_FINER * solution.rtol))
        self._settings = (
            [(fine, 0.0)]
            if method.adaptive
            else [(solution.rtol, solution.step), (solution.rtol, 0.5 * solution.step)]
        )
        self._replays: list[Replay] = []

    def difference(self, first: int, end: float) -> np.ndarray | None:
        """Return what a part from a frame on is off by, shape (nq + nv,); None where it cannot be integrated."""
        of = self._solution
        if not self._replays:
            self._replays = [Replay(of, self._method, rtol, step) for rtol, step in self._settings]
        ends = []
        for replay in self._replays:
            replay.begin(float(of.t[first]), of.states[first])
            ends.append(replay.reach(end, _MOST_STEPS))
        if any(found is None for found in ends):
            return None
        if self._method.adaptive:
            return np.abs(ends[0] - of.states[np.searchsorted(of.t, end)])
        factor = 2.0**self._method.order
        return np.abs(ends[1] - ends[0]) * factor / (factor - 1.0)
