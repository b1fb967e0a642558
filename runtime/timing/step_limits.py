"""What steps have to keep to: breaks, and limits of their length over time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property

import numpy as np

from symgen.runtime.record import record


@record
class StepLimits:
    """What steps have to keep to.

    Attributes
    ----------
    before, after : ndarray [s]
        Jumps and kinks: the last time at which what was holds, and the first at which what comes does; neighbouring
        numbers mostly.
    begin : ndarray [s]
        Where another limit of the step begins, ascending.
    longest : ndarray [s]
        These limits; infinite where there is none.
    missed : float [s]
        Changes within such a time are too many to be followed somewhere; 0 where there are none.
    """

    before: np.ndarray
    after: np.ndarray
    begin: np.ndarray
    longest: np.ndarray
    missed: float = 0.0

    def within(self, other: StepLimits) -> StepLimits:
        """Return the limits that keep to both."""
        begin = np.union1d(self.begin, other.begin)
        limits = [
            np.append(np.inf, step_limits.longest)[np.searchsorted(step_limits.begin, begin, side="right")]
            for step_limits in (self, other)
        ]
        before, after = np.append(self.before, other.before), np.append(self.after, other.after)
        order = np.argsort(before, kind="stable")
        return StepLimits(
            before[order], after[order], begin, np.minimum(*limits), max(self.missed, other.missed)
        )

    def pieces(self, t0: float, t1: float) -> Iterator[tuple[float, float, float]]:
        """Yield begin and end [s] of what lies between two times without a break inside, and the longest step there."""
        begin = t0
        for before, after in [*zip(self.before.tolist(), self.after.tolist(), strict=True), (t1, t1)]:
            if before <= begin:
                begin = max(begin, min(after, t1)) if after > begin else begin
                continue
            end = min(before, t1)
            first, last = np.searchsorted(self.begin, [begin, end], side="right")
            yield begin, end, float(self.longest[max(first - 1, 0) : last].min(initial=math.inf))
            if end == t1:
                return
            begin = min(after, t1)

    @cached_property
    def is_empty(self) -> bool:
        """Whether steps are as free as without it."""
        return not len(self.before) and not np.isfinite(self.longest).any() and not self.missed
