"""What a run's steps may have gone over: where its path passes something far shorter than a step.

Along the recorded path the state is a function of time, so the equations are, too. Worked out on ranges over cells of
it (`symgen.runtime.timing`), they show every barrier, well and edge that the path passes, however thin; and the log
of steps shows how long the steps were there. Whether it mattered is not judged here: a companion of the run is held
to short steps there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import ModuleError
from symgen.runtime.options import SAME_TICKS, time_resolution
from symgen.runtime.sampling import sample_rows
from symgen.runtime.timing.intervals import Intervals, Range
from symgen.runtime.timing.search import TimeTerms
from symgen.runtime.timing.step_limits import StepLimits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.solution import Solution

_CELLS, _MOST_CELLS, _PARTS = 200, 4000, 8
_OF_CELL = 0.125  # a cell is small enough when nothing in it changes in less than this part of it
_MUCH_LONGER = 8.0  # a step than the time in which something changes
_LOOK = 0.5  # of that time: how long the steps of a companion are there
_AROUND = 50.0  # of these steps before and after: the path between frames is interpolated
_FINEST = 2.0**-36  # of the run
_AS_ONE = 1e-6  # of the time between frames


@dataclass(frozen=True)
class SharpPlaces:
    """Where steps of a run were much longer than the time in which something changes.

    Attributes
    ----------
    begin, end, scale : ndarray [s]
        Of cells of time, and the time in which something changes there.
    """

    begin: np.ndarray
    end: np.ndarray
    scale: np.ndarray

    def step_limits(self, most_steps: float) -> StepLimits | None:
        """Return where a companion has to look closely, with steps how long; None where nothing calls for it.

        Parameters
        ----------
        most_steps : float
            How many steps it may take for this.
        """
        return _step_limits(self.begin, self.end, _LOOK * self.scale, most_steps)


def jumped_over(solution: Solution) -> SharpPlaces | None:
    """Return what steps of a run may have gone over; None where that cannot be told."""
    try:
        with np.errstate(all="ignore"):
            n_more = solution.system.nv + solution.system.m
            return SharpPlaces(*Path(solution, "residual", n_more).sharp_places())
    except ModuleError:  # loops with arrays, of large models
        return None


class Path:
    """The recorded path of a run, as functions of time over cells.

    Parameters
    ----------
    solution : Solution
    function : str
        What is worked out along it.
    n_more : int
        How many numbers the function reads behind the state; they are taken as 0.
    jumps : sequence of EventRecord
        Events at which the state jumps, in order: the path has no slope there.

    Attributes
    ----------
    t : ndarray [s]
        Frames, and times just before and behind jumps.
    smooth : ndarray of bool
        Which intervals between them have no jump in them.
    """

    def __init__(self, solution: Solution, function: str, n_more: int, jumps: Sequence[EventRecord] = ()):
        self._equations = TimeTerms(solution.system, solution.p, function)
        # Frames that are round-off apart, as of two grids, would make slopes of round-off.
        least = SAME_TICKS * time_resolution(solution.t[0], solution.t[-1])
        keep = np.append(np.diff(solution.t) > least, True)
        self.t, self._y = solution.t[keep], solution.states[keep]
        self.smooth = np.ones(len(self.t) - 1, dtype=bool)
        if jumps:
            self.t, self._y, self.smooth = _with_jumps(self.t, self._y, jumps)
        nq = solution.system.nq
        pieces = np.split(np.arange(len(self.t)), np.flatnonzero(~self.smooth) + 1)
        slopes = np.zeros(self._y.shape)
        for piece in (piece for piece in pieces if len(piece) > 1):
            slopes[piece] = np.gradient(self._y[piece], self.t[piece], axis=0)
        if nq == solution.system.nv:
            slopes[:, :nq] = self._y[:, nq:]
        self._slopes = slopes
        self._ends, self._lengths = solution.step_log[:, 0], solution.step_log[:, 1]
        self._n_more = n_more
        self._widths = self._all_widths()

    def _all_widths(self) -> list[float]:
        one = np.ones(1)
        everywhere = Intervals(np.full(1, self.t[0]), np.full(1, np.inf), [], finding=True)
        never, none = np.full(1, np.inf), np.zeros(1, dtype=np.int8)
        zero, inf = 0.0 * one, np.inf * one
        free = Range(-inf, inf, -inf, inf, zero, never, never, none, zero)
        self._equations.values(everywhere, [*[free] * self._y.shape[1], *[0.0] * self._n_more])
        return everywhere.widths

    def sharp_places(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return begins and ends of cells in which something changes much faster than steps were, and how fast [s]."""
        marks = self.t[sample_rows(len(self.t), _CELLS + 1)]
        begin, end = marks[:-1], marks[1:]
        found: list[tuple[np.ndarray, ...]] = []
        looked = 0
        while len(begin) and looked < _MOST_CELLS:
            scale = self._scales(begin, end)
            looked += len(begin)
            far = scale * _MUCH_LONGER < self._steps(begin, end)
            small = (scale >= _OF_CELL * (end - begin)) | (end - begin <= _FINEST * (self.t[-1] - self.t[0]))
            there = far & small
            found.append((begin[there], end[there], scale[there]))
            begin, end = begin[far & ~small], end[far & ~small]
            cuts = begin + (end - begin) * np.arange(_PARTS + 1)[:, None] / _PARTS
            begin, end = cuts[:-1].ravel(), cuts[1:].ravel()
        return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))

    def _scales(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """The shortest time in which the equations change in each cell [s]."""
        scales = [x.scale for x in self.ranges(begin, end) if isinstance(x, Range)]
        return np.minimum.reduce(scales) if scales else np.full(len(begin), np.inf)

    def ranges(self, begin: np.ndarray, end: np.ndarray) -> list[Range | float]:
        """Return what the function is over cells from `begin` to `end` [s]."""
        (at_begin, slope), (at_end, later) = self._at(begin), self._at(end)
        middle = self._at(begin + 0.5 * (end - begin))[0]
        never, none = np.full(len(begin), np.inf), np.zeros(len(begin), dtype=np.int8)
        y = [
            Range(
                np.minimum(at_begin[:, i], at_end[:, i]), np.maximum(at_begin[:, i], at_end[:, i]),
                np.minimum(slope[:, i], later[:, i]), np.maximum(slope[:, i], later[:, i]),
                middle[:, i], never, never, none, np.zeros(len(begin)),
            )
            for i in range(self._y.shape[1])
        ]  # fmt: skip
        return self._equations.values(Intervals(begin, end, self._widths), [*y, *[0.0] * self._n_more])

    def _at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The state and its slope between frames, by Hermite's cubic."""
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        h = (self.t[k + 1] - self.t[k])[:, None]
        s = (t - self.t[k])[:, None] / h
        first, last, a, b = self._y[k], self._y[k + 1], self._slopes[k], self._slopes[k + 1]
        change = last - first
        cubic = s * (s - 1.0) * ((s - 1.0) * (h * a - change) + s * (h * b - change))
        return first + s * change + cubic, a + s * (b - a)

    def _steps(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """The longest step that touches each cell [s]."""
        last = len(self._ends) - 1
        first = np.clip(np.searchsorted(self._ends, begin, side="right"), 0, last)
        final = np.clip(np.searchsorted(self._ends, end, side="left"), 0, last)
        pairs = np.column_stack([first, final + 1]).ravel()
        longest = np.maximum.reduceat(np.append(self._lengths, 0.0), pairs)[::2]
        return np.maximum(longest, self._lengths[first])


def _with_jumps(
    t: np.ndarray, y: np.ndarray, jumps: Sequence[EventRecord]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times and states with those just before and behind jumps, and which intervals have no jump in them."""
    times, states, smooth = [t[0]], [y[0]], []
    at = np.unique([jump.t for jump in jumps])
    first = {jump.t: jump for jump in reversed(jumps)}
    last = {jump.t: jump for jump in jumps}
    beside = _AS_ONE * np.diff(t).min()
    # Frames in the instant of a jump have one of its two states.
    k = np.searchsorted(at, t[1:-1])
    nearest = np.minimum(np.abs(at[np.minimum(k, len(at) - 1)] - t[1:-1]), np.abs(at[k - 1] - t[1:-1]))
    nodes = [(when, row) for when, row in zip(t[1:-1], y[1:-1], strict=True)]
    nodes = [node for node, off in zip(nodes, nearest, strict=True) if off > beside]
    nodes += [(when, None) for when in at if t[0] < when < t[-1]]
    for when, row in [*sorted(nodes, key=lambda node: node[0]), (t[-1], y[-1])]:
        if not when > times[-1]:
            continue
        smooth.append(True)
        times.append(when)
        if row is not None:
            states.append(row)
            continue
        before, after = first[when], last[when]
        states += [np.append(before.q_before, before.v_before), np.append(after.q_after, after.v_after)]
        times.append(np.nextafter(when, np.inf))
        smooth.append(False)
    return np.array(times), np.array(states), np.array(smooth)


def _step_limits(
    begin: np.ndarray, end: np.ndarray, longest: np.ndarray, most_steps: float
) -> StepLimits | None:
    """Return limits of the step around some cells, those that cost least first, as far as the steps go."""
    before, after = begin - _AROUND * longest, end + _AROUND * longest
    with np.errstate(divide="ignore"):  # what changes in no time at all costs too much
        cost = (after - before) / longest
    order = np.argsort(cost, kind="stable")
    chosen = order[np.cumsum(cost[order]) <= most_steps]
    if not len(chosen):
        return None
    edges = np.unique(np.concatenate([before[chosen], after[chosen]]))
    limits = np.full(len(edges), np.inf)
    for k in chosen:
        inside = slice(*np.searchsorted(edges, [before[k], after[k]]))
        limits[inside] = np.minimum(limits[inside], longest[k])
    changes = np.append(True, limits[1:] != limits[:-1])
    return StepLimits(np.zeros(0), np.zeros(0), edges[changes], limits[changes])
