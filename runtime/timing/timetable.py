"""Times that a run's steps land on, and how long they may be in between."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.timing.step_limits import StepLimits

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System

search = Late("symgen.runtime.timing.search")

_IN_PULSE, _LONG_PULSE, _MOST_PULSES = 24, 8.0, 200  # frames in pulses; intervals between frames; pulses
_FEW = 3  # breaks in a note
_NEAR = 8.0  # units of the last digit of a time: it is reached

_FREE = StepLimits(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))


class Timetable:
    """Breaks that users name, and what the terms of time alone show, for one run.

    Steps end where something jumps, bends or begins to change fast, and begin again where what comes holds: at a jump
    that is the next number. Nothing here is carried from step to step, so that a run can be taken up anywhere.

    Parameters
    ----------
    step_limits : StepLimits
        What time alone does.
    breaks : sequence of float [s]
        Times that users want steps to land on.
    max_step : float [s]
        The longest step wanted; infinite for none.
    adaptive : bool
        Methods of fixed step land on breaks, and leave the rest to their step.
    t_end : float [s]
        The end of the run, up to which notes go; all else is the same for any end.
    """

    def __init__(
        self,
        step_limits: StepLimits,
        breaks: Sequence[float],
        max_step: float,
        *,
        adaptive: bool,
        t_end: float,
    ):
        self._t_end = t_end
        self.step_limits, self.breaks, self.max_step, self.adaptive = (
            step_limits,
            tuple(breaks),
            max_step,
            adaptive,
        )
        entries = [
            (a, b, True) for a, b in zip(step_limits.before.tolist(), step_limits.after.tolist(), strict=True)
        ]
        entries += [(t, t, True) for t in breaks]
        self._begins = step_limits.begin.tolist() if adaptive else []
        self._longest = step_limits.longest.tolist() if adaptive else []
        entries += [(t, t, False) for t in self._begins[1:]]
        joined: list[tuple[float, float, bool]] = []
        for before, after, anew in sorted(entries):
            if joined and before <= joined[-1][1] + _NEAR * math.ulp(before):
                last = joined.pop()
                before, after, anew = last[0], max(last[1], after), last[2] or anew
            joined.append((before, after, anew))
        self._before = [entry[0] for entry in joined]
        self._after = [entry[1] for entry in joined]
        self._anew = [entry[2] for entry in joined]

    @property
    def notes(self) -> list[str]:
        """What the model's time makes of the steps, in words."""
        step_limits, found = self.step_limits, []
        landed = step_limits.before[step_limits.before < self._t_end]
        if len(landed):
            where = _times(landed)
            found.append(f"time: steps land on {where}, where forces or constraints jump or bend with time")
        longest = step_limits.longest[step_limits.begin < self._t_end]
        if self.adaptive and np.isfinite(longest).any():
            least = int(np.argmin(longest))
            found.append(
                f"time: steps are at most {step_limits.longest[least]:.2g} s from "
                f"t = {max(step_limits.begin[least], 0.0):.9g} s on, as long as what time alone does there demands"
            )
        if self.breaks and not self.adaptive:
            found.append("breaks: steps of fixed length are cut short there")
        return found

    @property
    def settings(self) -> dict[str, object]:
        """What the user asked for."""
        return {
            "max_step": self.max_step if math.isfinite(self.max_step) else None,
            "breaks": list(self.breaks),
        }

    def next_stop(self, t: float) -> float:
        """Return where the next call of the step loop is to end [s]; infinite where nothing comes any more."""
        k = bisect_right(self._before, t + _NEAR * math.ulp(t))
        return self._before[k] if k < len(self._before) else math.inf

    @property
    def stops(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where steps end, where what comes begins [s], and 1 where it is another motion, else 0."""
        return np.array(self._before), np.array(self._after), np.array(self._anew, dtype=float)

    def longest(self, t: float) -> float:
        """Return the longest step from a time on [s]."""
        k = bisect_right(self._begins, t + _NEAR * math.ulp(t)) - 1
        return min(self.max_step, self._longest[k]) if k >= 0 else self.max_step

    def follow(self, arrays: LoopArrays, method: Method) -> bool:
        """Go on behind what was landed on; returns whether the forces may jump there."""
        t = arrays.t
        near = _NEAR * math.ulp(t)
        k = bisect_right(self._before, t + near) - 1
        if k < 0 or t > self._after[k] + near:
            return False
        arrays.limit_longest(self.longest(t))
        if not self._anew[k]:
            return False
        if t < self._after[k]:
            arrays.move_time(self._after[k])
        arrays.restart(state_changed=False)
        if method.adaptive:
            arrays.choose_step_anew()
        return True

    def with_frames(self, times: np.ndarray, shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return frames with some more, not to be shown, in pulses that fall between them.

        What a pulse gives and takes is part of what the motion exchanges: the energy balance is judged by that.
        """
        inside = self.in_pulses(times[0], times[-1], (times[-1] - times[0]) / (len(times) - 1))
        if not len(inside):
            return times, shown
        joined = np.union1d(times, inside)
        return joined, np.isin(joined, times[shown])

    def in_pulses(self, t_start: float, t_end: float, spacing: float) -> np.ndarray:
        """Return times in pulses that fall between frames of a spacing [s]."""
        begin, longest = self.step_limits.begin, self.step_limits.longest
        end = np.append(begin[1:], t_end)
        short = np.isfinite(longest) & (end - begin < _LONG_PULSE * spacing)
        pulses = np.flatnonzero(short)[:_MOST_PULSES]
        inside = begin[pulses] + (end - begin)[pulses] * np.arange(1, _IN_PULSE)[:, None] / _IN_PULSE
        return inside[(inside > t_start) & (inside < t_end)]


def _times(times: np.ndarray) -> str:
    few = ", ".join(f"{t:.9g}" for t in times[:_FEW])
    return f"t = {few} s" if len(times) <= _FEW else f"{len(times)} times from t = {times[0]:.9g} s on"


def make_timetable(system: System, p: np.ndarray, method: Method, options: RunOptions) -> Timetable | None:
    """Return what the steps of a run have to keep to; None where that is nothing.

    Raises
    ------
    RuntimeModelError
        A limit of the step or a break makes no sense, or the method cannot integrate what time alone does.
    """
    if options.max_step is None and not len(options.breaks) and not system.has("time_terms"):
        return None
    return timetable(step_limits_of(system, p, options.t_start, options.t_end), method, options)


def step_limits_of(system: System, p: np.ndarray, t_start: float, t_end: float) -> StepLimits | None:
    """Return what time alone does to a model; None where it does nothing beyond polynomials."""
    if not system.has("time_terms"):
        return None
    return search.known_step_limits(system, p, t_start, t_end)


def timetable(step_limits: StepLimits | None, method: Method, options: RunOptions) -> Timetable | None:
    """Return the timetable of limits; None where nothing is to be kept to."""
    step_limits = step_limits or _FREE
    times = checked_breaks(options.breaks, options.t_start)
    longest = checked_max_step(options.max_step, method, options.t_start, options.t_end)
    if step_limits.is_empty and not times and longest == math.inf:
        return None
    return Timetable(step_limits, times, longest, adaptive=method.adaptive, t_end=options.t_end)


def checked_breaks(breaks: Sequence[float], t_start: float) -> list[float]:
    """Return the breaks of a run in order."""
    times = sorted({float(t) for t in breaks})
    for t in times:
        if not math.isfinite(t):
            raise RuntimeModelError(f"breaks: {t} is no time: give finite numbers of seconds")
    # Those behind the end are kept to as well: a run does not depend on where it ends.
    return [t for t in times if t > t_start]


def shortest_max_step(t_start: float, t_end: float) -> float:
    """Return how long `max_step` must be for times to tell steps apart [s]."""
    return 1e3 * math.ulp(max(abs(t_start), abs(t_end)))


def checked_max_step(max_step: float | None, method: Method | None, t_start: float, t_end: float) -> float:
    """Return the longest step of a run [s]; infinite where none is given."""
    if max_step is None:
        return math.inf
    longest = float(max_step)
    if not longest > 0.0:
        raise RuntimeModelError(f"max_step is {max_step}: give a positive number of seconds")
    if method is not None and not method.adaptive:
        raise RuntimeModelError(
            f"max_step is {longest:g} s, but the steps of method {method.name!r} are all alike: give its --step instead"
        )
    least = shortest_max_step(t_start, t_end)
    if longest < least:
        raise RuntimeModelError(
            f"max_step is {longest:.3g} s: times up to {t_end:g} s are numbers that cannot tell steps below "
            f"{least:.1g} s apart; give a longer one, or end the run earlier"
        )
    return longest
