"""Poles that fixed steps went across: places where an acceleration changes its sign by way of infinity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.checks.entry import HealthCheck, noted
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

companion = Late("symgen.runtime.checks.companion")
error_estimate = Late("symgen.runtime.checks.error_estimate")

_STEPS = 1.5  # between frames: over more, states are integrated again
_GROWTH = 1e6  # of an acceleration, from the frames around a pole to the last digits of time
_LEAST_POWER = 0.9  # of 1/|t - t_pole| in an acceleration whose integral is infinite
_MOST_INTERVALS = 20  # with the largest jumps
_BISECTIONS = 60
_MOST_NUMBERS = 2_000_000


def poles(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield one entry where an acceleration becomes infinite between frames; nothing where none does.

    Stages of a Gauss method may all lie beside the pole of a force like 1/(t - 1), whose parts before and after it then
    cancel. Where an acceleration changes its sign from one frame to the next, the change is bisected, with states
    on the cubic through q and v: at a pole its magnitude grows without limit, elsewhere it does not. Rates do not
    outlive a pole like 1/(t - 1): that is an objection. They get across a weaker one, which is a note.
    """
    system = solution.system
    if system.m or system.quaternions or system.input_descriptions or solution.forms is not None:
        return
    if len(solution.t) < 2 or solution.states.size > _MOST_NUMBERS:
        return
    with np.errstate(all="ignore"):
        a, _ = accelerations_and_multipliers(system, solution.p, solution.t, solution.states)
        found = _infinite_frame(solution.t, a) or _pole(
            solution, _Rows(solution.t, solution.q, solution.v), a
        )
    if found is None:
        return
    when, rate, value, power = found
    name = rate_labels(system.coordinates, system.rates)[rate]
    says = f"the derivative of {name} becomes infinite at t = {when:.9g} s, and steps of {method.name} went across it"
    if power < _LEAST_POWER:
        says += f", as 1/|t|^{power:.2g}: rates get across that, but methods lose their order there"
        yield noted("poles", value, _GROWTH, says)
        return
    says += "; the result beyond it means nothing: end the run before it, or keep the force finite there"
    yield HealthCheck("poles", False, value, _GROWTH, says)


def _infinite_frame(t: np.ndarray, a: np.ndarray) -> tuple[float, int, float, float] | None:
    """Return time, rate, magnitude and power where a frame falls on a pole, whose power is unknown."""
    bad = np.argwhere(np.isinf(a))
    return (float(t[bad[0, 0]]), int(bad[0, 1]), float("inf"), float("inf")) if bad.size else None


class _Rows(NamedTuple):
    """States over time, shape (n,), (n, nq), (n, nv)."""

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray


def _pole(solution: Solution, seen: _Rows, a: np.ndarray) -> tuple[float, int, float, float] | None:
    """Return time, rate, growth and power of the first pole between states, of which `a` are the accelerations."""
    frames, rates = _largest_jumps(a)
    if not frames.size:
        return None
    rows, between = np.arange(len(frames)), _Between(seen, frames)
    before = a[frames, rates]
    around = np.maximum(np.abs(before), np.abs(a[frames + 1, rates]))
    left, right = np.zeros(len(frames)), np.ones(len(frames))
    largest, side = np.zeros(len(frames)), np.sign(before)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (left + right)
        t, states = between.at(middle)
        found, _ = accelerations_and_multipliers(solution.system, solution.p, t, states)
        value = found[rows, rates]
        largest = np.fmax(largest, np.abs(value))  # what is undefined tells nothing
        same = np.sign(value) == side
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    growth = largest / around
    grown = np.flatnonzero(growth > _GROWTH)
    if not grown.size:
        return None
    times = between.at(right)[0]
    for first in grown[np.argsort(times[grown], kind="stable")]:
        frame, h = frames[first], float(seen.t[frames[first] + 1] - seen.t[frames[first]])
        if h > _STEPS * solution.step and seen.t is solution.t:
            again = _step_by_step(solution, frame)
            if again is not None:
                found = _pole(solution, *again)
                if found is not None:
                    return found
                continue
        return float(times[first]), int(rates[first]), *_growth(float(times[first]), h, float(growth[first]))
    return None


def _step_by_step(solution: Solution, frame: int) -> tuple[_Rows, np.ndarray] | None:
    """Return states and accelerations from a frame to the next one at each step; None where it does not come there.

    No cubic tells what a motion does between frames a period apart.
    """
    begin, end = solution.t[frame : frame + 2]
    times = np.linspace(begin, end, int(np.ceil((end - begin) / solution.step)) + 1)
    own = companion.Companion(error_estimate.method_of(solution), solution.rtol, solution.atol, solution.step)
    states = companion.follow(
        solution, own, times, solution.states[frame], 2 * len(times), lambda _: False
    ).states
    if len(states) < len(times):
        return None
    nq = solution.q.shape[1]
    a, _ = accelerations_and_multipliers(solution.system, solution.p, times, states)
    return _Rows(times, states[:, :nq], states[:, nq : nq + solution.v.shape[1]]), a


def _growth(when: float, h: float, growth: float) -> tuple[float, float]:
    """Return the growth of an acceleration within an interval around a pole, and the power that this is."""
    # The last places looked at are as near to the pole as time can be told apart.
    nearest = max(h * 0.5**_BISECTIONS, np.finfo(float).eps * abs(when))
    return growth, float(np.log(growth) / np.log(h / nearest))


def _largest_jumps(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return frames before, and rates, of the sign changes with the largest jumps for each rate's accelerations."""
    frames, rates = np.nonzero(a[:-1] * a[1:] < 0.0)
    jumps = np.abs(a[frames + 1, rates] - a[frames, rates]) / np.fmax.reduce(np.abs(a))[rates]
    kept = np.argsort(-jumps, kind="stable")[:_MOST_INTERVALS]
    return frames[kept], rates[kept]


class _Between:
    """The cubics through q and v of neighbouring frames.

    Parameters
    ----------
    frames : ndarray of int, shape (n,)
        The first of each pair.
    """

    def __init__(self, seen: _Rows, frames: np.ndarray):
        t, q, v = seen
        self._t, self._h = t[frames], t[frames + 1] - t[frames]
        self._q, self._dq, self._v, self._next_v = (
            q[frames],
            q[frames + 1] - q[frames],
            v[frames],
            v[frames + 1],
        )
        self._dv = self._next_v - self._v
        self._states = np.empty((len(frames), q.shape[1] + v.shape[1]))

    def at(self, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times and states at a part of each interval; the arrays hold until the next call."""
        h, s, nq = self._h[:, None], parts[:, None], self._q.shape[1]
        squared, rest = s * s, 1.0 - s
        slopes = s * rest**2 * self._v - squared * rest * self._next_v
        self._states[:, :nq] = self._q + squared * (3.0 - 2.0 * s) * self._dq + h * slopes
        self._states[:, nq:] = self._v + s * self._dv
        return self._t + parts * self._h, self._states
