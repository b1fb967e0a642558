"""The estimated error of a run over time: what companions beside it differ by, and how that goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime import step_costs
from symgen.runtime.batches import evaluate, right_hand_sides
from symgen.runtime.checks.amplification import Amplification, Stretch, together
from symgen.runtime.checks.companion import (
    TIGHTEST,
    Companion,
    Followed,
    apart,
    by_series,
    finer,
    follow,
    follow_smooth,
    independent,
    is_jump,
    last_jump,
    loose,
    tighter,
)
from symgen.runtime.checks.growth import (
    LARGEST_POWER,
    SATURATED,
    growth_rate,
    is_exponential,
    power_of_growth,
    running_maximum,
    slope,
)
from symgen.runtime.checks.sharpness import may_be_sharp
from symgen.runtime.checks.smoothness import divided, parts_between_frames, stays_smooth
from symgen.runtime.checks.undersampled import seen_between
from symgen.runtime.checks.work import operations_by_series, operations_of_run, operations_per_step
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.positions import ANGLES, Positions
from symgen.runtime.record import record
from symgen.runtime.sampling import quasi_random, row_maxima, sample_rows

if TYPE_CHECKING:
    from symgen.runtime.checks.energy_drift import Phase
    from symgen.runtime.checks.jumped_over import SharpPlaces
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

energy_drift = Late("symgen.runtime.checks.energy_drift")
jumped_over = Late("symgen.runtime.checks.jumped_over")
forms = Late("symgen.runtime.integrate.forms")

LARGEST_ERROR = 0.05  # of what a coordinate or rate does
LEAST_FRAMES = 8
_LEAST_FOLLOWED, _FINER_STEPS = 3, 2.0  # frames, and how many steps of a companion for one of the run
_MOST_FRAMES, _MOST_NUMBERS = 4000, 400_000  # that are compared
_HELD_BACK = (
    2.0  # times as far: where the run's own method gets so much farther, stability holds explicit ones back
)
_LOST = 0.5  # of a range: from there on an accurate companion tells nothing more
_LOST_FRAMES = 3  # in a row
_AT_REST = 1e-9  # of the largest range: what moves less does not move
_PLAIN, _SAME_SIZES = 1e-6, 0.01  # of the largest range; an error that leaves ranges as they are
_PROBED, _ELSEWHERE = 3, 0.1  # states, and in parts of ranges, for whether that has to do with it
_LEAST_RIPPLE = 1e-3  # of a rate's magnitude: variations that count
_ROUND_OFF = 1e4 * np.finfo(float).eps  # of a variable's magnitude
_OF_ATOL, _LEAST = 10.0, 1e-14  # ranges below so many atol are no motion, and below this with fixed steps
_MORE_FOR_ACCURATE, _GOES_ON = 3.0, 2.0  # times the operations
_TO_THE_END, _SLOWER = 0.08, 1.5  # of the run's operations, for a companion that sees all of it; margin
# rtol of a companion that goes on where errors are known: of these, and the loosest.
_OF_FOUND, _LOOSEST_OF_REST = 1e-4, 1e-6
_OF_DRIFT = (
    100.0  # and of these over the square of its steps, of which a thousandth is what its phase is off by
)
_CLEARLY = 0.1  # of an error that a companion found: what a better one, not at the end yet, finds if the first is off
_OPTIMISTIC = 2.0  # times the way that a companion of the run's own method is expected to come
_MIDDLE = 0.5  # of a long run, where other companions begin
_OF_COMPANION = 5e5  # operations that take as long as what there is to do before its first step
_TINY = np.finfo(float).tiny
_FASTEST_POWER = 2.0  # of time: errors of the energy, which add up, move the phase
_MORE_EVENTS = 20.0  # times as many as a companion meets otherwise
_LATE = 0.25  # of the time that a companion took: from there on a power of time is looked for
_TIMES_BEYOND = 20  # between where companions got and the end, for when errors become large
_NO_GROWTH, _WINDOWS = 0.5, 8  # power of time; parts of a run, over which a loss of energy goes on
_PEAKS, _FITS = 16, 0.1  # of errors, and how far they may be off a line and a square of time
_FEWEST_PEAKS, _STANDS_OUT = 8, 3.0
_SUSPECT = 2.5  # power of time of a growth that may be exponential, where a companion does not come far
_MORE_WHERE_CHAOTIC = 4.0  # times the operations
# A rough companion to the end: its rtol, up to where what it differs by may be its own error, how many times the steps
# expected it may need, and operations that an accurate one may take then (a quarter of a second).
_ROUGH, _TELLS, _UNEVEN, _MOST_TO_DECIDE = 1e-6, 1e-3, 4.0, 1e9
_ROUGH_MAY = 4.0  # times the operations of an accurate one, at least
# Of a run, what an explicit companion confirms of one by series; the most steps for that; what it may find, in parts of
# the error that the other one has found.
_PART_TO_CONFIRM, _STEPS_TO_CONFIRM, _OF_FOUND_BY_SERIES = 1.0 / 16.0, 2000, 0.5
_TO_CONFIRM, _MORE_ACCURATE = (
    0.25,
    0.01,
)  # of the operations allowed; of the tolerance, where it does not confirm
_DENSE = 600  # times at which two motions of other energies are compared
_LEAST_LOOSE = 1e-12  # rtol from which on neighbours are not made tighter
_UNSURE = 1.25  # times an exponent: along some stretches differences grow faster than along others
_MOST_EXPONENT, _WHOLE = 60.0, 1.0  # errors grow no further than to the range


@record
class ErrorEstimate:
    """The estimated error of a run over time.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
    relative : ndarray, shape (n, nq + nv)
        In parts of what each variable does, see `sizes`.
    known : bool
        Whether a companion came to the end of the run, or showed that the run is lost.
    rate : float or None
        The rate of exponential growth [1/s]; None where errors do not grow so.
    sharp : SharpPlaces, optional
        What steps of the run may have gone over.
    states : ndarray, shape (n, nq + nv), optional
        Those of the companion that says so.
    has_drift : bool
        Whether it has, behind what companions have seen, what the drift of the energy makes of the motion.
    is_bound : bool
        Whether it is an upper bound only, as the companion's own error is in it.
    unseen : int
        How many jumps of the run no companion has met.
    """

    t: np.ndarray
    relative: np.ndarray
    known: bool
    rate: float | None
    sharp: SharpPlaces | None = None
    states: np.ndarray | None = None
    has_drift: bool = False
    is_bound: bool = False
    unseen: int = 0

    @property
    def worst(self) -> np.ndarray:
        """The largest error of all variables, over time."""
        return row_maxima(self.relative)

    @property
    def largest(self) -> float:
        """The largest error of all."""
        return float(self.relative.max())

    def until(self, error: float) -> float:
        """Return the time up to which the error is at most so large [s]."""
        return float(self.t[self._last_within(error)])

    def gone_over(self, error: float) -> float | None:
        """Return how short that is which the run went over just where its error exceeds this [s]; None: nothing."""
        last = self._last_within(error)
        if self.sharp is None or last + 1 >= len(self.t):
            return None
        there = (self.sharp.end >= self.t[last]) & (self.sharp.begin <= self.t[last + 1])
        return float(self.sharp.scale[there].min()) if there.any() else None

    def _last_within(self, error: float) -> int:
        beyond = np.flatnonzero(~(running_maximum(self.worst) <= error))
        return max(int(beyond[0]) - 1, 0) if beyond.size else len(self.t) - 1


def estimate(solution: Solution, operations: float) -> ErrorEstimate | None:
    """Return the estimated error of a run; None where no companion gets anywhere.

    Parameters
    ----------
    operations : float
        About how many a companion may take.
    """
    comparison = _Comparison(solution)
    accurate = independent(solution, comparison.own, comparison.least_range)
    if (quick := comparison.by_series(accurate[0], operations)) is not None:
        return quick
    first = comparison.follow(accurate[0], operations)
    found = _estimated(solution, comparison, accurate, first, operations)
    if found is None or found.known or found.largest <= LARGEST_ERROR:
        return found
    for k in range(1, len(accurate)):
        # What is carried on to the end may be what the companion is off by.
        better = comparison.follow(accurate[k], _MORE_FOR_ACCURATE * operations)
        n = min(len(better.t), len(first.t))
        if n < LEAST_FRAMES or better.relative[:n].max() > _CLEARLY * first.relative[:n].max():
            break
        first = better
        found = _estimated(solution, comparison, accurate[k:], first, operations)
    return found


def _estimated(
    solution: Solution,
    comparison: _Comparison,
    accurate: tuple[Companion, ...],
    found: ErrorEstimate,
    operations: float,
) -> ErrorEstimate | None:
    """Return the estimated error, by companions of which the first has found what it did."""
    least, companion = comparison.least_range, accurate[0]
    longer = 0.0
    if companion.method is not comparison.own and _may_be_chaotic(comparison.system):
        # Beside costly methods the whole run may be had: slow exponential growth shows nowhere else. Or a good part
        # of it, from companions that are less accurate.
        longer = _TO_THE_END * operations_of_run(solution)
    allowed = max(operations, longer)
    begun, found = found, comparison.with_rest(found, companion, operations, allowed)
    if found.known and found.largest > LARGEST_ERROR:
        for better in accurate[1:]:
            found = comparison.of_the_better(found, better, _MORE_FOR_ACCURATE * operations, allowed)
    if found.known:
        return found
    if found is not begun or begun.rate is not None:
        longer = 0.0
    neighbour = loose(least)
    neighbour = neighbour.with_tolerance(comparison.unlike(neighbour, neighbour.rtol))
    if companion.method is not comparison.own:
        other = finer(solution, comparison.own, least)
        if comparison.reach(other, operations) > found.t[-1]:
            again = comparison.follow(other, operations)
            if again.t[-1] > found.t[-1]:
                if again.t[-1] - again.t[0] > _HELD_BACK * (found.t[-1] - found.t[0]):
                    neighbour = other
                found, companion = again, other
    if found.known:
        return found
    if len(found.t) < _LEAST_FOLLOWED:
        if not comparison.own.adaptive:
            return None
        found = comparison.begun()
    parts, half = [found], 0.5 * operations
    if comparison.jumps:  # events take longest
        # A burst of them before may be all that a companion has met.
        begin = max(comparison.middle, comparison.frame(found.t[-1]))
        if comparison.frame(comparison.end) - begin >= LEAST_FRAMES:
            seen = 1.0 if not found.rate else _MORE_EVENTS  # what says that errors explode has to be sure
            parts.append(comparison.follow(companion, half, begin, seen))
        # What comes to rest by ever shorter bounces tells its companion apart once, and is not chaotic.
        told = [part.rate or 0.0 for part in parts if len(part.t) >= LEAST_FRAMES]
        carried_on = _extrapolated(solution, parts, Amplification(elsewhere=min(told, default=0.0)))
        return replace(carried_on, unseen=_unseen_jumps(solution, parts))
    if comparison.own.adaptive:
        # Fixed steps may keep an energy of their own, which a part from the middle would count as an error.
        parts.append(comparison.follow(companion, half, comparison.middle))
    seen = comparison.to_the_end(begun, accurate[0], operations, max(allowed, _ROUGH_MAY * operations))
    if seen is not None and seen.largest > LARGEST_ERROR:
        for better in accurate[1:]:
            seen = comparison.of_the_better(seen, better, _MORE_FOR_ACCURATE * operations, allowed)
        if not seen.known:  # a better one that did not come to the end says that the first is off
            seen = None
    if seen is not None and not seen.is_bound:
        return seen
    budgets = (half if comparison.own.adaptive else operations, half)
    grown = _amplification(comparison, neighbour, parts, budgets, longer)
    carried_on = _extrapolated(solution, parts, grown, comparison.drifting(parts[0], companion, half))
    return carried_on if seen is None or carried_on.largest < seen.largest else seen


def _amplification(
    comparison: _Comparison,
    neighbour: Companion,
    parts: list[ErrorEstimate],
    operations: tuple[float, float],
    longer: float,
) -> Amplification:
    """Return how small differences grow where accurate companions have not been: after the first part, and later.

    For the former `longer` operations may be taken, if that is more.
    """
    if not _may_be_chaotic(comparison.system):
        return Amplification()
    begins = [comparison.frame(part.t[-1]) for part in parts]
    begins = [begins[0], max(begins[-1], comparison.middle)]
    seen: list[list[Stretch]] = [[], []]
    for place, begin in enumerate(begins):
        allowed = operations[place] if place else max(operations[0], longer)
        seen[place] = comparison.stretches(neighbour, allowed, begin)
        if place < len(parts) and parts[place].rate:
            seen[place].insert(0, Stretch(parts[place].t[0], parts[place].t[-1], parts[place].rate))
        if seen[place] and seen[place][-1].end == comparison.end:
            break
    ends = (seen[1][0].begin if seen[1] else comparison.end, comparison.end)
    for found, end, allowed in zip(seen, ends, operations, strict=True):
        if found and found[-1].end < end and any(part.rate for part in found):
            # Where motion is chaotic, what none has seen is worth a longer look.
            more = _MORE_WHERE_CHAOTIC * allowed
            found += comparison.stretches(neighbour, more, comparison.frame(found[-1].end))
    return together(*seen)


def followed(solution: Solution, operations: float) -> ErrorEstimate:
    """Return what the most accurate companion says, as far as it gets with so many operations."""
    comparison = _Comparison(solution)
    return comparison.follow(independent(solution, comparison.own, comparison.least_range)[0], operations)


class _Comparison:
    """A run, against which companions are held.

    Attributes
    ----------
    system : System
    own : Method
        Its method, in its form of constraints.
    end : float [s]
    middle : int
        The frame in its middle.
    least_range : float
        Of what moves, the range of the coordinate or rate that moves least.
    jumps : bool
        Whether rates jump at events.
    """

    def __init__(self, solution: Solution):
        rows = _rows(solution)
        whole = len(rows) == len(solution.t)
        self._solution, self._t = solution, solution.t if whole else solution.t[rows]
        self.system, self.end, self.middle = (
            solution.system,
            float(self._t[-1]),
            int(_MIDDLE * (len(self._t) - 1)),
        )
        self._states = solution.states if whole else solution.states[rows]
        self.own = method_of(solution)
        self._least = np.full(
            solution.states.shape[1], _OF_ATOL * solution.atol if self.own.adaptive else _LEAST
        )
        if self.own.adaptive:  # elements of quaternions are parts of one
            turning = [k for first in self.system.quaternions for k in range(first, first + 4)]
            self._least[turning] = _OF_ATOL * max(solution.atol, solution.rtol)
        self._between = seen_between(solution, self.own)
        extent = self._extent(self._states)
        self._rest = _unresolved_rates(self.system, extent, self._t)
        self._apart = _apart(solution, extent, self._t, self._states)
        least, ranges = np.maximum(self._least, self._rest), extent.range
        self._size = np.maximum(extent.sizes(self.system, self._apart), least)
        self._is_plain = _is_plain(self.system, ranges, least)
        self.least_range = float(ranges[ranges >= _AT_REST * ranges.max()].min(initial=1.0))
        # A jump of the rates may come before a frame in one run, and after it in the other.
        self.jumps = any(is_jump(event) for event in solution.events)

    @cached_property
    def _sharp(self) -> SharpPlaces | None:
        """Where companions look closely; most models have nothing that asks for it."""
        if not may_be_sharp(self._solution):
            return None
        return jumped_over.jumped_over(self._solution)

    def reach(self, companion: Companion, operations: float) -> float:
        """Return about how far a companion of the run's own method comes [s]."""
        more = 2.0 if companion.step else (self._solution.rtol / companion.rtol) ** (1.0 / self.own.order)
        part = operations / (more * operations_of_run(self._solution))
        return float(self._t[0] + _OPTIMISTIC * part * (self._t[-1] - self._t[0]))

    def by_series(self, accurate: Companion, operations: float) -> ErrorEstimate | None:
        """Return what a companion by series says of all of a run; None where an explicit one has to say it.

        It does not share the method of an explicit run; that of one by series has to be confirmed.
        """
        companion = by_series(self._solution, accurate)
        if companion is None or self.jumps:
            return None
        more = (self._solution.rtol / companion.rtol) ** (1.0 / companion.method.order)
        # One that stops on the way would go on for as many operations again.
        took = (operations_by_series if self.own.series else operations_of_run)(self._solution)
        if more * took > _GOES_ON * operations:
            return None
        # Where frames see too little of it, what the run went along is looked at beside it.
        parts = parts_between_frames(self._solution)
        times = divided(self._t, parts)
        if times is None or (parts == 1 and not stays_smooth(self._solution, self._t, self._states)):
            return None
        most = int(_UNEVEN * more * self._solution.stats["steps"])
        states = follow_smooth(self._solution, companion, times, self._states[0], most)
        if states is None or (parts > 1 and not stays_smooth(self._solution, times, states)):
            return None
        states = states[::parts]
        found = self._said(companion, 0, Followed(states, 0, self.end, ended=False))
        if found.largest > LARGEST_ERROR:
            return None
        return found if not self.own.series or self._is_confirmed(found, accurate) else None

    def _is_confirmed(self, found: ErrorEstimate, accurate: Companion) -> bool:
        """Whether a companion goes the way of another one where steps of the run were shortest, and where longest.

        What it finds to be off there would have to be harmless, or small beside what the other one has found, if it
        came in all of the run.
        """
        harmless = max(_OF_FOUND_BY_SERIES * found.largest, self._solution.rtol)
        explicit = self._solution.stats["steps"] / step_costs.step_ratio(accurate.rtol)
        most = max(_STEPS_TO_CONFIRM, int(_UNEVEN * _PART_TO_CONFIRM * explicit))
        for first, last in self._places_to_confirm():
            ends = self._t[[first, last]]
            allowed = harmless * float(ends[1] - ends[0]) / (self.end - float(self._t[0]))
            # Without energy scaling, an explicit one may be off by more than what it is to confirm.
            for one in (accurate, accurate.with_tolerance(max(_MORE_ACCURATE * accurate.rtol, TIGHTEST))):
                seen = follow_smooth(self._solution, one, ends, found.states[first], most)
                if seen is None:
                    return False
                off = float(self._off(seen[1:], found.states[last : last + 1], self._size).max())
                if off <= allowed:
                    break
            else:
                return False
        return True

    def _places_to_confirm(self) -> Iterator[tuple[int, int]]:
        """Yield from which frame to which: around some of the shortest steps, and around the longest."""
        ends, lengths = self._solution.step_log[:, 0], self._solution.step_log[:, 1]
        n, last = len(lengths), len(self._t) - 1
        around, shortest = max(1, round(_PART_TO_CONFIRM * n)), int(np.argmin(lengths))
        first = min(max(shortest - around // 2, 0), max(n - around, 0))
        longest = int(np.argmax(lengths))
        for k, many in ((first, around), (longest, 1)):
            begin = float(ends[k] - lengths[k])
            end = float(ends[min(k + many, n) - 1])
            left = max(int(np.searchsorted(self._t, begin, side="right")) - 1, 0)
            right = min(int(np.searchsorted(self._t, end)), last)
            yield min(left, last - 1), max(right, left + 1)

    def frame(self, t: float) -> int:
        """Return the first frame at or after a time [s]."""
        return int(np.searchsorted(self._t, t))

    def follow(
        self, companion: Companion, operations: float, first: int = 0, events: float = 1.0
    ) -> ErrorEstimate:
        """Return what a companion says that begins at some frame of the run; it may meet `events` times as many."""
        return self._said(companion, first, self._beside(companion, operations, first, None, events))

    def with_rest(
        self, begun: ErrorEstimate, companion: Companion, operations: float, allowed: float
    ) -> ErrorEstimate:
        """Return an estimate whose companion stopped on the way, gone on with where the end may be had; else itself.

        An error of hundredths needs no companion that is right to ten digits: for what is left of the run it may be one
        whose own errors are small beside those that were found.

        Parameters
        ----------
        operations, allowed : float
            That the companion took, and may take for the rest.
        """
        came = float(begun.t[-1] - self._t[0])
        if begun.known or came <= 0.0:
            return begun
        # Behind jumps it begins anew: what is closed, held or aimed at is not in the states.
        first = 0 if self.jumps else len(begun.t) - 1
        needed = operations * (self.end - float(self._t[first])) / came
        if companion.method.adaptive and len(begun.t) >= LEAST_FRAMES:
            # What its own steps lose of the energy adds up, and moves the phase with the square of their number.
            steps = needed / operations_per_step(self._solution, companion.method)
            own = _OF_DRIFT * begun.largest / max(steps, 1.0) ** 2
            rtol = max(
                min(_OF_FOUND * begun.largest, self.unlike(companion, _LOOSEST_OF_REST), own), companion.rtol
            )
            needed *= (companion.rtol / rtol) ** (1.0 / companion.method.order)
            companion = companion.with_tolerance(rtol)
        if needed > allowed:
            return begun
        rest = self._beside(companion, _SLOWER * needed, first, begun.states[first])
        seen = replace(rest, states=np.vstack([begun.states[: first + 1], rest.states[1:]]))
        return self._said(companion, 0, seen)

    def to_the_end(
        self, begun: ErrorEstimate, companion: Companion, operations: float, allowed: float
    ) -> ErrorEstimate | None:
        """Return what companions say that see all of the run, the first of them a rough one; None where none may.

        What is carried on from parts of a run knows nothing of a short violent motion in between, nor how fast
        errors grow where companions were too rough, or went too short a way, to show it. A rough companion from start
        to end meets both. Where it differs by much, an accurate one says which of the two is off.

        Parameters
        ----------
        begun : ErrorEstimate
            Of an accurate companion that stopped on the way.
        operations, allowed : float
            That it took, and that a rough one is expected to take at most.
        """
        came, rtol = float(begun.t[-1] - self._t[0]), self.unlike(companion, _ROUGH)
        if companion.remains != 1.0 or not _may_be_chaotic(self.system):
            return None
        if companion.rtol >= rtol or came <= 0.0:
            return None
        fewer = (companion.rtol / rtol) ** (1.0 / companion.method.order)
        span = self.end - float(self._t[0])
        per_step = operations_per_step(self._solution, companion.method)
        needed = fewer * self._most_steps(companion, operations) * per_step * span / came
        if needed > allowed:
            return None
        beside = self._beside(companion.with_tolerance(rtol), _UNEVEN * needed, 0)
        rough = self._said(companion.with_tolerance(rtol), 0, beside)
        if rough.largest <= _TELLS:
            return replace(rough, is_bound=True) if rough.known else None
        needed = _SLOWER * beside.steps * per_step / fewer * span / float(rough.t[-1] - self._t[0])
        accurate = self.follow(companion, min(needed, max(allowed, _MOST_TO_DECIDE)))
        return accurate if accurate.known else None

    def unlike(self, companion: Companion, rtol: float) -> float:
        """Return a tolerance for a companion with errors of its own, where that is of the run's method, too."""
        alike = companion.method.name == self._solution.method and self.own.adaptive
        return apart(rtol, self._solution.rtol) if alike else rtol

    def of_the_better(
        self, found: ErrorEstimate, better: Companion, operations: float, allowed: float
    ) -> ErrorEstimate:
        """Return what a more accurate companion says, where it is the first one that is off; else what that said."""
        again = self.follow(better, operations)
        again = self.with_rest(again, better, operations, allowed)
        if again.known:
            return again if again.largest < found.largest else found
        return again if again.largest < _CLEARLY * found.relative[: len(again.t)].max() else found

    def _beside(
        self,
        companion: Companion,
        operations: float,
        first: int,
        state: np.ndarray | None = None,
        events: float = 1.0,
    ) -> Followed:
        """Follow a companion from some frame on, where it has the state of the run or another one."""
        t, states = self._t[first:], self._states[first:]
        most = self._most_steps(companion, operations)
        return follow(
            self._solution,
            companion,
            t,
            states[0] if state is None else state,
            most,
            lambda seen: self._is_lost(seen, states),
            self._sharp,
            events,
        )

    def _most_steps(self, companion: Companion, operations: float) -> int:
        """Return the steps that a companion may take: at least those that come past a few frames."""
        least = _LEAST_FOLLOWED * _FINER_STEPS * self._solution.stats["steps"] / len(self._t)
        return int(max(operations / operations_per_step(self._solution, companion.method), least))

    def _said(self, companion: Companion, first: int, found: Followed) -> ErrorEstimate:
        """Return the error of the run from some frame on, as the states of a companion tell it."""
        t, states = self._t[first:], self._states[first:]
        n = len(found.states)
        known = n == len(t) or self._is_lost(found.states, states)
        relative = companion.remains * self._off(found.states, states, self._size)
        # What dies out moves little in a part from the middle: that is not what its error is measured by.
        if n == len(self._t) and not (self._is_plain and relative.max() <= _SAME_SIZES):
            relative = companion.remains * self._off(
                found.states, states, self._sizes_seen(found.states, companion)
            )
        if n == len(t) > 1 and max(found.jumped, last_jump(self._solution.events)) > t[-2]:
            # The last frame of one run may stand before a jump that in the other comes just in time.
            nq = self.system.nq
            relative[-1, nq:] = np.minimum(relative[-1, nq:], relative[-2, nq:])
        if found.ended and n < len(t):
            # By an event that the run met later, or not at all.
            relative[-1] = np.maximum(relative[-1], (t[-1] - found.t) / (self._t[-1] - self._t[0]))
            known = True
        if known and first == 0 and relative.max() <= LARGEST_ERROR:  # how small errors came nobody asks
            return ErrorEstimate(t[:n], relative, known, rate=None, states=found.states)
        worst = row_maxima(relative)
        # Where forces have kinks, growth at one of them is no rate.
        grows = is_exponential(t[:n], worst, but_once=bool(self.system.events))
        rate = growth_rate(t[:n], worst) if grows else None
        return ErrorEstimate(t[:n], relative, known, rate, self._sharp, found.states)

    def drifting(self, part: ErrorEstimate, companion: Companion, operations: float) -> Phase | None:
        """Return what the drift of the energy makes of the motion; None where nothing tells.

        Parameters
        ----------
        part : ErrorEstimate
            From the start, by this companion.
        """
        conservative = self.system.structure["conservative"] and not self.system.nw
        if not conservative or part.states is None or _may_be_chaotic(self.system):
            return None
        most = int(0.5 * operations / operations_per_step(self._solution, companion.method))

        def beside(first: int, *begun: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            times = np.linspace(part.t[first], part.t[-1], _DENSE)
            one, other = (
                follow(self._solution, companion, times, y, most, lambda _: False).states for y in begun
            )
            n = min(len(one), len(other))
            return times[:n], one[:n], other[:n]

        drift = energy_drift.EnergyDrift(self._solution)
        return drift.phase_errors(part.t, part.states, self._states[: len(part.t)], self._size, beside)

    def begun(self) -> ErrorEstimate:
        """Return the error of an adaptive run that no companion keeps up with: at first, that of its tolerance."""
        relative = np.zeros((2, self._states.shape[1]))
        relative[1] = self._solution.rtol
        return ErrorEstimate(self._t[:2], relative, known=False, rate=None)

    def stretches(self, companion: Companion, operations: float, first: int) -> list[Stretch]:
        """Return how differences grow from some frame on, as companions say of which each begins where one is lost."""
        found: list[Stretch] = []
        per_step = operations_per_step(self._solution, companion.method)
        while first + LEAST_FRAMES < len(self._t) and operations > per_step:
            t, states = self._t[first:], self._states[first:]

            def off(seen: np.ndarray, states: np.ndarray = states) -> np.ndarray:
                return row_maxima(self._off(seen, states, self._size))

            beside = follow(
                self._solution, companion, t, states[0], int(operations / per_step),
                lambda seen, off=off: bool(off(seen).max() > SATURATED), self._sharp,
            )  # fmt: skip
            operations -= beside.steps * per_step + _OF_COMPANION
            apart = off(beside.states)
            beyond = np.flatnonzero(apart > SATURATED)
            last = int(beyond[0]) if beyond.size else len(apart) - 1
            t, apart = t[: last + 1], apart[: last + 1]
            power, rate = power_of_growth(t, apart), growth_rate(t, apart) or 0.0
            surely = power > LARGEST_POWER
            if not surely and beyond.size and companion.rtol > _LEAST_LOOSE:
                # It was too near to where it is lost from its first frames on to tell how it got there.
                companion = tighter(companion)
                per_step = operations_per_step(self._solution, companion.method)
                continue
            perhaps = power > _SUSPECT and not beyond.size and t[-1] < self.end
            found.append(
                Stretch(float(t[0]), float(t[-1]), rate if surely else 0.0, rate if perhaps else 0.0)
            )
            if not (surely and beyond.size):
                break
            first += last
        return found

    def _extent(self, states: np.ndarray) -> Extent:
        return Extent(np.vstack([states, self._between]) if len(self._between) else states)

    def _sizes_seen(self, states: np.ndarray, companion: Companion) -> np.ndarray:
        """What errors are measured by: where a companion sees more than its own tolerances, that is motion."""
        extent, system = self._extent(states), self._solution.system
        least = self._least.copy()
        # Where lengths balance, an angle about zero has their round-off, not its own.
        largest = np.where(
            np.arange(states.shape[1]) < system.nq, extent.magnitude[: system.nq].max(initial=0.0), 0
        )
        resting = (
            extent.range <= np.maximum(_ROUND_OFF * np.maximum(extent.magnitude, largest), self._rest)
        ).all()
        if companion.method.adaptive and not resting:
            for part in (slice(0, system.nq), slice(system.nq, None)):
                largest = extent.range[part].max(initial=0.0)
                seen = max(
                    _LEAST, _OF_ATOL * max(companion.atol, companion.rtol * largest)
                )  # rest is no motion
                least[part] = np.minimum(least[part], seen)
        return np.maximum(extent.sizes(system, self._apart), np.maximum(least, self._rest))

    def _off(self, found: np.ndarray, states: np.ndarray, size: np.ndarray) -> np.ndarray:
        with np.errstate(over="ignore", invalid="ignore"):
            off = np.abs(found - states[: len(found)]) / size
            finite = np.isfinite(off.sum())
        if not finite:
            off = np.where(np.isfinite(off), off, np.inf)
        if self.system.integrals:  # of states: nobody sees them, and nothing depends on them
            off[:, list(self.system.integrals)] = 0.0
        return np.minimum(off, np.vstack([off[1:], off[-1:]])) if self.jumps else off

    def _is_lost(self, found: np.ndarray, states: np.ndarray) -> bool:
        if len(found) < _LOST_FRAMES:
            return False
        last = slice(len(found) - _LOST_FRAMES, len(found))
        off = self._off(found[last], states[last], self._size)
        return bool((off.max(axis=1) > _LOST).all())


class Extent:
    """How far each coordinate and rate goes.

    Parameters
    ----------
    states : ndarray, shape (..., n, nq + nv)
        Of one motion over time, or of several.

    Attributes
    ----------
    range, magnitude : ndarray, shape (..., nq + nv)
        The largest less the smallest value, and the largest magnitude.
    """

    def __init__(self, states: np.ndarray):
        with np.errstate(over="ignore", invalid="ignore"):
            largest, smallest = states.max(axis=-2), states.min(axis=-2)
            self.range, self.magnitude = largest - smallest, np.maximum(np.abs(largest), np.abs(smallest))

    def is_still(self, system: System) -> np.ndarray:
        """Which of them move by less than a billionth of the largest, as what symmetry keeps in its place."""
        found = np.zeros(len(self.range), dtype=bool)
        for part in (slice(0, system.nq), slice(system.nq, None)):
            size = self.range[part]
            found[part] = size <= _AT_REST * size.max(initial=0.0)
        return found

    def sizes(self, system: System, apart: np.ndarray) -> np.ndarray:
        """Return what errors are measured by, shape (..., nq + nv): what each coordinate and rate does.

        That is its range; of a rate at least a part of its magnitude. What moves by less than a billionth of the
        largest, as what symmetry keeps in its place, is measured by that; of rates also by their magnitude.

        Parameters
        ----------
        apart : ndarray of bool, shape (nq + nv,)
            Those that larger ones have nothing to do with.
        """
        size, magnitude, rates = self.range.copy(), self.magnitude, slice(system.nq, None)
        at_rest = np.zeros(size.shape)
        at_rest[..., rates] = magnitude[..., rates]
        least, angles = _LEAST_RIPPLE * at_rest, _angles(system, size.shape[-1])
        for part in (slice(0, system.nq), rates):
            own, angular = size[..., part], angles[part]
            rippled = np.maximum(own, least[..., part])
            # Angles are small or large by themselves, however far lengths go.
            most = rippled.max(axis=-1, keepdims=True, initial=0.0)
            of_angles = rippled.max(axis=-1, keepdims=True, initial=1.0, where=angular)
            largest = np.maximum(np.where(angular, np.minimum(most, of_angles), most), at_rest[..., part])
            moves = (own > _AT_REST * largest) | (apart[part] & (own > 0.0))
            size[..., part] = np.where(moves, rippled, largest)
        return np.maximum(size, np.maximum(_ROUND_OFF * magnitude, _TINY))


def _is_plain(system: System, ranges: np.ndarray, least: np.ndarray) -> bool:
    """Whether all coordinates and rates move, none by little beside others: then a near motion has the same sizes."""
    if not (ranges > least).all():
        return False
    parts = (ranges[: system.nq], ranges[system.nq :])
    return all(not part.size or part.min() > _PLAIN * part.max() for part in parts)


def _angles(system: System, n: int) -> np.ndarray:
    """Return which coordinates and rates are angles or numbers of quaternions, shape (n,); it must not be changed."""
    kept = vars(system).setdefault("_angles_of_states", {})
    if n in kept:
        return kept[n]
    found, positions = np.zeros(n, dtype=bool), Positions(system)
    of_coordinates = np.array([record["unit"] in ANGLES for record in system.coordinates], dtype=bool)
    for i, _ in positions.quaternions:
        of_coordinates[i : i + 4] = True
    found[: system.nq] = of_coordinates
    found[system.nq : system.nq + system.nv] = positions.per_rate(of_coordinates, True)
    kept[n] = found
    return found


def _apart(solution: Solution, extent: Extent, t: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Which of what moves little is moved by nothing that moves much, shape (nq + nv,): it is small, and not at rest.

    Accelerations there are the same to the bit, where what moves much is elsewhere, and no stop or friction lies
    between the two: balls that strike each other have nothing to do with each other else.
    """
    system = solution.system
    nq, n = system.nq, system.nq + system.nv
    still = extent.is_still(system)[:n]
    apart = np.zeros(states.shape[1], dtype=bool)
    if not (still & (extent.range[:n] > 0.0)).any():
        return apart
    rows = sample_rows(len(states), _PROBED)
    t, here = t[rows], states[rows]
    moved = here.copy()
    moved[:, :n] += np.where(still, 0.0, _ELSEWHERE * quasi_random(n) * extent.range[:n])
    with np.errstate(all="ignore"):
        rates, there = (right_hand_sides(system, solution.p, t, y)[:, nq:n] for y in (here, moved))
    same = (rates == there).all(axis=0)
    if same.any() and system.switches:
        same &= ~_in_touch(solution, t, here[:, :n], still[nq:])
    positions = Positions(system)
    of_rates = same & still[nq:] & positions.per_rate(still[:nq], False)
    apart[:nq], apart[nq:n] = positions.per_coordinate(of_rates), of_rates
    apart[[i + k for i, _ in positions.quaternions for k in range(4)]] = False
    return apart


def _in_touch(solution: Solution, t: np.ndarray, states: np.ndarray, still: np.ndarray) -> np.ndarray:
    """Return which rates a stop or friction has in common with one that is not still, shape (nv,)."""
    closed, p = solution.system.closed, solution.p.copy()
    p[list(closed.switched.values())] = 1.0
    rows = evaluate(closed, "constraint_jacobian", p, t, states).reshape(len(t), closed.m, closed.nv)
    moved = (rows[:, list(closed.switched)] != 0.0).any(axis=0)
    return moved[moved[:, ~still].any(axis=1)].any(axis=0)


def _unresolved_rates(system: System, extent: Extent, t: np.ndarray) -> np.ndarray:
    """Return rates that move coordinates by round-off from frame to frame, shape (nq + nv,): that is rest.

    Where a model rests away from zero, round-off of forces that balance moves it so much.
    """
    found = np.zeros(system.nq + system.nv)
    spacing = (t[-1] - t[0]) / (len(t) - 1)
    moved = Positions(system).per_rate(extent.magnitude[: system.nq], 1.0)
    moved[list(system.states)] = 0.0
    found[system.nq :] = _ROUND_OFF * moved / spacing
    return found


def method_of(solution: Solution) -> Method:
    """Return the method of a run, in the run's form of constraints."""
    method = find_method(solution.method)
    if solution.constraints in ("none", method.form):
        return method
    return forms.FORMS.get(solution.constraints, {}).get(solution.method) or method


def _rows(solution: Solution) -> np.ndarray:
    """Return the frames at which states are compared; no two of them have one time."""
    rises = solution.t[1:] > solution.t[:-1]
    different = np.arange(len(solution.t)) if rises.all() else np.flatnonzero(np.append(True, rises))
    most = max(min(_MOST_FRAMES, _MOST_NUMBERS // solution.states.shape[1]), LEAST_FRAMES)
    return different if len(different) <= most else different[sample_rows(len(different), most)]


def _extrapolated(
    solution: Solution,
    parts: list[ErrorEstimate],
    grown: Amplification,
    phase: Phase | None = None,
) -> ErrorEstimate:
    """Return the error until the end of a long run, as parts of it tell.

    Parameters
    ----------
    parts : list of ErrorEstimate
        The first from the start.
    grown : Amplification
        Where errors grow exponentially; elsewhere they go on by the power of time that they have grown with.
    phase : Phase, optional
        Its errors, by the drift of the energy: they count where they tell all; elsewhere the larger ones do.
    """
    found, end = parts[0], float(solution.t[-1])
    times = np.array([end])
    rows = _at_times(times, solution, parts, grown, phase)
    if rows.max() > LARGEST_ERROR:
        times = np.linspace(found.t[-1], end, _TIMES_BEYOND + 1)[1:]
        rows = _at_times(times, solution, parts, grown, phase)
    return ErrorEstimate(
        np.append(found.t, times), np.vstack([found.relative, rows]), known=False, rate=grown.rate,
        has_drift=phase is not None and phase.whole is not None,
    )  # fmt: skip


def _unseen_jumps(solution: Solution, parts: list[ErrorEstimate]) -> int:
    """Return how many jumps of a run lie in no part of it that a companion went along."""
    jumps = np.array([event.t for event in solution.events if is_jump(event)])
    seen = [(part.t[0] <= jumps) & (jumps <= part.t[-1]) for part in parts]
    return int(np.count_nonzero(~np.any(seen, axis=0)))


def _at_times(
    times: np.ndarray,
    solution: Solution,
    parts: list[ErrorEstimate],
    grown: Amplification,
    phase: Phase | None,
) -> np.ndarray:
    """Return errors beyond what companions have seen: of the part that has the largest at the end."""
    largest = [part.relative.max(axis=0) for part in parts]
    at_end = [
        row.max() * _factor(part, grown, solution, times[-1])
        for part, row in zip(parts, largest, strict=True)
    ]
    worst = int(np.argmax(at_end))
    factors = np.array([_factor(parts[worst], grown, solution, t) for t in times])
    if phase is not None and largest[0].max() > 0.0:
        by_drift = phase.drifted if phase.whole is None else np.maximum(phase.whole, largest[0].max())
        found = np.interp(times, phase.t, by_drift) / largest[0].max()
        if phase.whole is not None:
            return np.minimum(np.outer(found, largest[0]), _WHOLE)
        factors = np.maximum(factors, found * largest[0].max() / largest[worst].max())
    return np.minimum(np.outer(factors, largest[worst]), _WHOLE)


def _may_be_chaotic(system: System) -> bool:
    """Whether there are the three dimensions that chaos needs (Poincaré and Bendixson)."""
    return 2 * (system.nv - system.m) + system.structure["time_dependent"] >= 3


def _factor(part: ErrorEstimate, grown: Amplification, solution: Solution, end: float) -> float:
    """Return by how much the largest error of a part grows until some time.

    Errors that steps make later on grow as those of the part do, so it counts as one from the start.
    """
    begin = float(solution.t[0])
    span, length = end - begin, float(part.t[-1] - part.t[0])
    if not 0.0 < length < span:
        return _share_within(part, span)
    # Of motion that is damped errors die out as well; where energy is kept, they add up.
    least = 1.0 if solution.system.structure["conservative"] else 0.0
    exponent = _UNSURE * grown.exponent(begin + length, end)
    if exponent > 0.0:
        regular = (span / min(max(length, grown.last(end) - begin), span)) ** least
        return float(np.exp(min(exponent, _MOST_EXPONENT)) * regular)
    regular = (span / length) ** np.clip(_power(part), least, _FASTEST_POWER)
    if solution.system.structure["conservative"] and not _may_be_chaotic(solution.system):
        regular = max(regular, _after_turning(part, solution, span))
    return float(regular)


def _share_within(part: ErrorEstimate, span: float) -> float:
    """Return the error that a part has come to within some time of its beginning, in parts of its largest."""
    peak = running_maximum(part.worst)
    last = int(np.searchsorted(part.t - part.t[0], span, side="right")) - 1
    return float(peak[max(last, 0)] / peak[-1]) if peak[-1] > 0.0 else 1.0


def _after_turning(part: ErrorEstimate, solution: Solution, span: float) -> float:
    """Return the factor of the error of a periodic motion whose phase first runs ahead and then falls back, else 0.

    A method that loses energy by and by makes an error a t - b t² of the phase. Near the time at which the two cancel
    a part shows next to no growth, or one by any power, while the energy goes on being lost: a and b tell what follows.
    """
    windows = [float(np.median(part)) for part in np.array_split(solution.energy.balance, _WINDOWS)]
    changes = np.sign(np.diff(windows))
    if abs(changes.sum()) < len(changes):
        return 0.0
    fitted = _linear_and_square(part)
    if fitted is not None:
        return abs(float(fitted @ (span, span**2))) / part.largest
    times = span / float(part.t[-1] - part.t[0])
    # With b/4 times the square of the part's time as its largest error.
    return 4.0 * times * (times - 1.0) if _power(part) <= _NO_GROWTH else 0.0


def _linear_and_square(part: ErrorEstimate) -> np.ndarray | None:
    """Return a and b of errors |a t + b t²| that a part has the peaks of; None where they are not of that form."""
    n_peaks = min(_PEAKS, len(part.t) // LEAST_FRAMES)
    if n_peaks < _FEWEST_PEAKS:
        return None
    chosen = [rows[np.argmax(part.worst[rows])] for rows in np.array_split(np.arange(len(part.t)), n_peaks)]
    passed, peaks = part.t[chosen] - part.t[0], part.worst[chosen]
    powers = np.stack([passed, passed**2], axis=1)
    best, left = None, _FITS * float(np.linalg.norm(peaks))
    for n_before in range(1, n_peaks + 1):
        signed = np.where(np.arange(n_peaks) < n_before, peaks, -peaks)
        fitted = np.linalg.lstsq(powers, signed, rcond=None)[0]
        off = float(np.linalg.norm(powers @ fitted - signed))
        if off < left:
            best, left = fitted, off
    if best is None or n_peaks == _PEAKS:
        return best
    # Of few peaks, what the square is must stand out of what it leaves.
    clear = abs(float(best[1])) * passed[-1] ** 2 > _STANDS_OUT * left / np.sqrt(n_peaks)
    return best if clear else None


def _power(part: ErrorEstimate) -> float:
    """Return the power of time with which errors grow in a part."""
    passed, peak = part.t - part.t[0], running_maximum(part.worst)
    chosen = (passed > _LATE * passed[-1]) & (peak > 0.0)
    if np.count_nonzero(chosen) < LEAST_FRAMES:
        return 1.0
    return slope(np.log(passed[chosen]), np.log(peak[chosen]))
