"""Whether a bushing, or a spring over an angle of directions, is wound up so far that its torque jumps.

Such angles forget whole turns. Where they jump is seen by looking closely: 16 times in each step, by the cubic through
neighbouring frames where a step has several, else along the motion integrated again from the first of two frames. Of
long runs that is done for the intervals in which most happens; the others are passed over where these stay far from a
jump.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.companion import Companion, follow
from symgen.runtime.checks.entry import HealthCheck, limited
from symgen.runtime.checks.error_estimate import method_of
from symgen.runtime.checks.work import SHORT, operations_of_run
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.positions import Positions
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_LOOKS = 16  # in a step
_OF_STEP = 0.25  # between frames, up to which the cubic through them tells what is there: a step may hold half a period
_JUMP = (
    2.0  # [rad] from one look to the next: less than half a turn, more than a motion does in a 16th of a step
)
_TURNED_BACK = 0.7  # of the changes around it: what turns back from one look to the next, at a bound
_SAMPLED = 32  # intervals of each kind that are looked into first
_MARGIN = 6.0  # times what those do between frames, for all the others
_STEPS_OF_RECORDINGS = 4.0  # between frames: they have no log of steps
_AT_ONCE = 20_000  # looks in one integration
_MORE_STEPS = 8  # times those of the run, plus some
_OTHERWISE = "dop853"


def windings(solution: Solution) -> HealthCheck:
    """Return an entry on the angles of bushings and of springs over angles of directions.

    Of bushings in space these are the angles of successive rotations about x, y and z. About x and z they end at half a
    turn, where they go on from minus that; about y at a quarter turn, where the other two jump.
    """
    if getattr(solution.system, "samplers", ()):
        solution = replace(solution, system=solution.system.as_recorded())
    found = _Search(solution).run()
    if found is None:
        says = "bushings and springs over angles of directions stay below the angles at which these jump"
        return limited("windings", 0.0, 0.0, says, "")
    return limited("windings", 1.0, 0.0, "", found)


class _Search:
    """Looks for a jump in the angles of a run."""

    def __init__(self, solution: Solution):
        self._solution = solution
        records = solution.system.source.header["windings"]
        self._records = [record for record in records for _ in record["bounds"]]
        self._bounds = bounds_of(solution.system)
        self._of_springs = np.array([record["kind"] == "spring" for record in self._records])
        self._steps = _steps_between_frames(solution)
        self._resets = np.array([event.t for event in solution.events if event.action == "reset"])

    def run(self) -> str | None:
        """Return what jumps, in words; None where nothing does."""
        seen = np.flatnonzero(self._steps <= _OF_STEP)
        for t, states in _interpolated(self._solution, seen):
            if (says := self._jump(t, self._angles(t, states))) is not None:
                return says
        unseen = np.flatnonzero(self._steps > _OF_STEP)
        if operations_of_run(self._solution) <= SHORT:
            return self._looked_into(unseen)[0]
        first = self._busiest(unseen)
        says, reach, most = self._looked_into(first)
        if says is not None:
            return says
        at_frames = np.abs(self._angles(self._solution.t, self._solution.states)).max(axis=0)
        if (np.maximum(most, at_frames) + _MARGIN * reach < self._bounds).all():
            return None
        return self._looked_into(np.setdiff1d(unseen, first))[0]

    def _angles(self, t: np.ndarray, states: np.ndarray) -> np.ndarray:
        return evaluate(self._solution.system, "windings", self._solution.p, t, np.ascontiguousarray(states))

    def _busiest(self, unseen: np.ndarray) -> np.ndarray:
        """Return intervals in which most steps were taken, those over which angles change most, and some of all."""
        angles = self._angles(self._solution.t, self._solution.states)
        changes = np.abs(np.diff(angles, axis=0)).max(axis=1)
        kinds = (
            unseen[np.argsort(self._steps[unseen], kind="stable")[-_SAMPLED:]],
            unseen[np.argsort(changes[unseen], kind="stable")[-_SAMPLED:]],
            unseen[sample_rows(len(unseen), _SAMPLED)],
        )
        return np.unique(np.concatenate(kinds))

    def _looked_into(self, intervals: np.ndarray) -> tuple[str | None, np.ndarray, np.ndarray]:
        """Return what jumps in some intervals between frames, how far angles go in one, and how large they are."""
        reach, most = np.zeros(len(self._bounds)), np.zeros(len(self._bounds))
        for t, states, starts in self._integrated(intervals):
            angles = self._angles(t, states)
            if (says := self._jump(t, angles)) is not None:
                return says, reach, most
            for part in np.split(angles, starts[1:]):
                reach = np.maximum(reach, np.ptp(part, axis=0))
            most = np.maximum(most, np.abs(angles).max(axis=0))
        return None, reach, most

    def _integrated(self, intervals: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Yield times and states of the motion along neighbouring intervals, and where each of these begins."""
        solution, own = self._solution, method_of(self._solution)
        companion = Companion(own, solution.rtol, solution.atol, solution.step or 0.0)
        other = Companion(METHODS[_OTHERWISE], min(solution.rtol, 1e-9), min(solution.atol, 1e-12))
        looks = np.maximum(np.ceil(_LOOKS * self._steps), 2).astype(int)
        for block in _neighbours(intervals, looks):
            times, starts = _times(solution.t, block, looks)
            state, steps = solution.states[block[0]], int(self._steps[block].sum())
            most_steps = _MORE_STEPS * (steps + 100)
            states = state[None]
            for way in (companion, other):
                if len(states) < len(times):
                    found = follow(
                        solution, way, times, state, most_steps, lambda _: False, events=np.inf
                    ).states
                    states = max(states, found, key=len)
            n = len(states)
            yield times[:n], states, starts[starts < n]
            # Where a motion ends, as at a pole, the cubic is what there is.
            for t, between in _interpolated(solution, block[np.append(starts[1:], len(times) - 1) >= n]):
                yield t, between, np.zeros(1, dtype=int)

    def _jump(self, t: np.ndarray, angles: np.ndarray) -> str | None:
        changes = np.diff(angles, axis=0)
        jumps = np.abs(changes) > _JUMP
        if len(angles) > 4:
            jumps[1:-2] |= self._turned_back(angles, changes)
        jumps[_hits(t, self._resets)] = False
        if not jumps.any():
            return None
        look, column = (int(k[0]) for k in np.nonzero(jumps))
        record = self._records[column]
        when, name = t[look + 1], record["name"]
        if record["kind"] == "spring":
            return (
                f"the angle of spring {name!r}, which is made of directions, jumps or turns back at t = {when:.6g} s, "
                "and its torque goes to the other side: use the angle of a joint's coordinate, which counts turns, or "
                "hold it by stops"
            )
        return (
            f"bushing {name!r} turns beyond half a turn about x or z, or 90 degrees about y, before t = {when:.6g} s, "
            "where its torque jumps to the other side: use a spring of an angle, or hold it by stops"
        )

    def _turned_back(self, angles: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Whether angles of springs turn back at a bound from one look to the next, as nothing with inertia does.

        Where they turn by themselves, they are slow before and after.
        """
        sizes = np.abs(changes)
        there = np.maximum(sizes[1:-2], sizes[2:-1])
        sharply = there > _TURNED_BACK * np.maximum(sizes[:-3], sizes[3:])
        near = self._bounds - np.abs(angles[2:-2]) < there
        return near & sharply & (changes[1:-2] * changes[2:-1] < 0.0) & self._of_springs


def bounds_of(system: System) -> np.ndarray:
    """Return where the angles that the function `windings` writes jump or turn back [rad]."""
    return np.array(
        [bound for record in system.source.header.get("windings", ()) for bound in record["bounds"]]
    )


def _hits(t: np.ndarray, instants: np.ndarray) -> np.ndarray:
    """Return between which neighbouring times any of some instants lie, or where no time passes: resets jump."""
    counts = np.searchsorted(instants, t, side="right") - np.searchsorted(instants, t[0], side="left")
    return (np.diff(counts) > 0) | (np.diff(t) <= 0.0) | np.isin(t[:-1], instants)


def _steps_between_frames(solution: Solution) -> np.ndarray:
    """Return how many steps, or parts of one, lie between each frame and the next; many where nobody knows."""
    log = solution.step_log
    if not len(log):
        return np.full(len(solution.t) - 1, _STEPS_OF_RECORDINGS)
    ends = np.sort(log[:, 0])
    begun = np.append(min(solution.t[0], ends[0] - log[0, 1]), ends)
    thinned = max(1.0, solution.stats["steps"] / len(log))
    return thinned * np.diff(np.interp(solution.t, begun, np.arange(len(begun))))


def _neighbours(intervals: np.ndarray, looks: np.ndarray) -> Iterator[np.ndarray]:
    """Yield runs of intervals that follow each other, with not too many looks at once."""
    for run in np.split(intervals, np.flatnonzero(np.diff(intervals) != 1) + 1):
        if len(run):
            so_far = np.cumsum(looks[run])
            yield from np.split(run, np.flatnonzero(np.diff(so_far // _AT_ONCE)) + 1)


def _times(t: np.ndarray, block: np.ndarray, looks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times from the begin of the first interval to the end of the last, and where each interval begins."""
    parts = [np.linspace(t[k], t[k + 1], looks[k] + 1)[:-1] for k in block]
    starts = np.cumsum([0, *map(len, parts[:-1])])
    return np.append(np.concatenate(parts), t[block[-1] + 1]), starts


def _interpolated(solution: Solution, intervals: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield times and states along neighbouring intervals, by the cubic through q, v and a of both frames."""
    nq, positions = solution.system.nq, Positions(solution.system)
    parts = int(_LOOKS * _OF_STEP)
    for block in _neighbours(intervals, np.full(len(solution.t) - 1, parts)):
        rows = slice(block[0], block[-1] + 2)
        t, y = solution.t[rows], solution.states[rows]
        slopes = np.hstack([positions.derivatives(y[:, :nq], y[:, nq:]), solution.accelerations[rows]])
        s = np.arange(parts)[:, None, None] / parts
        h, change = np.diff(t)[:, None], np.diff(y, axis=0)
        a, b = h * slopes[:-1], h * slopes[1:]
        between = y[:-1] + s * change + s * (s - 1.0) * ((s - 1.0) * (a - change) + s * (b - change))
        states = np.vstack([between.transpose(1, 0, 2).reshape(-1, y.shape[1]), y[-1]])
        times = np.append((t[:-1] + s[:, :, 0] * h[:, 0]).T.ravel(), t[-1])
        states[:, :nq] = positions.normalised(states[:, :nq])
        yield times, states
