"""The times of a run's frames, where they are too many to be held at once."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from symgen.runtime.record import record

_MOST_NUMBERS = 4_000_000  # of frames that are kept: 32 MB
_LEAST_KEPT, MOST_KEPT = 400, 20_000  # frames, however large, or small, the model is
_NEAR_THE_END = 1e-9  # of the run: a frame that is nearer to the end is the one there


@record(eq=False)
class FrameGrid:
    """The times of frames, in order, a few at a time.

    Attributes
    ----------
    t_start, t_end : float [s]
        Both are frames.
    fps : float or None
        Frames per second of simulated time.
    times : ndarray [s]
        The frames, where no `fps` makes them.
    more : ndarray [s]
        Others, which nobody asked for.
    """

    t_start: float
    t_end: float
    fps: float | None
    times: np.ndarray
    more: np.ndarray

    @property
    def spacing(self) -> float:
        """The mean distance of frames that were asked for [s]."""
        span = self.t_end - self.t_start
        return span / (len(self.times) - 1) if self.fps is None else 1.0 / self.fps

    def with_more(self, times: np.ndarray) -> FrameGrid:
        """Return the same frames with others between them, not to be shown."""
        return replace(self, more=np.unique(np.concatenate([self.more, times])))

    def after(self, t: float, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the next frames behind a time, n of them or all that are left, and which of them were asked for."""
        wanted, more = self._wanted_after(t, n), self.more[self.more > t][:n]
        if not len(more):
            return wanted, np.ones(len(wanted), dtype=bool)
        times = np.unique(np.concatenate([wanted, more]))[:n]
        return times, np.isin(times, wanted)

    def _wanted_after(self, t: float, n: int) -> np.ndarray:
        if self.fps is None:
            first = int(np.searchsorted(self.times, t, side="right"))
            return self.times[first : first + n]
        first = max(0, math.floor((t - self.t_start) * self.fps) - 1) if t > self.t_start else 0
        # Two more than are wanted: rounded, the first ones may lie before `t`.
        found = frames_of(self.t_start, self.fps, first, n + 4)
        before_the_end = before_end(found, self.t_start, self.t_end)
        if len(before_the_end) < len(found):
            found = np.append(before_the_end, self.t_end)
        return found[found > t][:n]


def frames_of(t_start: float, fps: float, first: int, n: int) -> np.ndarray:
    """Return the times of n frames from number `first` on [s]."""
    return t_start + np.arange(first, first + n) / fps


def before_end(times: np.ndarray, t_start: float, t_end: float) -> np.ndarray:
    """Return those of some times of frames that come before the one at the end [s]."""
    return times[times < t_end - _NEAR_THE_END * (t_end - t_start)]


def most_kept(ny: int) -> int:
    """Return how many frames of `ny` numbers checks are given at most."""
    return int(np.clip(_MOST_NUMBERS // max(ny, 1), _LEAST_KEPT, MOST_KEPT))
