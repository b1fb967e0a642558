"""The motion of a run integrated again beside it, more accurately: what the two differ by is the run's error."""

from __future__ import annotations

import math
from dataclasses import field, replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime import step_costs
from symgen.runtime.checks.smoothness import is_smooth_along, may_be_smooth
from symgen.runtime.checks.work import SHORT, operations_of_run
from symgen.runtime.constraints.energy_level import energy
from symgen.runtime.driver import Run
from symgen.runtime.errors import ContactError, RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS, Method
from symgen.runtime.kept_arrays import borrow, give_back
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.options import RunOptions
from symgen.runtime.record import record
from symgen.runtime.timing.timetable import shortest_max_step, timetable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from symgen.runtime.checks.jumped_over import SharpPlaces
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.solution import Solution
    from symgen.runtime.timing.timetable import Timetable

choose = Late("symgen.runtime.choose")
schedule = Late("symgen.runtime.inputs.schedule")
contact_settings = Late("symgen.runtime.contact.settings")
taylor_kernel = Late("symgen.runtime.taylor.kernel")

_EXPLICIT, _SERIES = "dop853", "taylor"
_TIGHTER = 0.01
_LOOSEST, TIGHTEST = 1e-9, 2e-14  # rtol of companions
_OF_FIXED_STEPS = 1e-10
# Steps of a run from which on a companion by series pays; its time, at most, in parts of an explicit one's: where that
# has to confirm it, and where it stands alone.
_FEWEST_BY_SERIES, _QUICKER, _QUICKER_ALONE = 32, 0.75, 0.9
_LOOSE, _OF_LOOSE = 1e-5, 1e-3
# From this rtol and order on no other method is more accurate than the run's own.
_ALIKE, _HIGH_ORDER = 1e-12, 8
_BESIDE, _OF_BESIDE = 4.0, 0.5  # times the run's rtol, and of the difference, where nothing is more accurate
# Of tolerances of one method: so near to each other that errors are alike; how far a companion is from the run then.
_NEAR_RUN, _APART_FROM_RUN = 5.0, 30.0
_ATOL_OF_RANGE = 1e-6  # of the smallest range of a coordinate or rate
# Events that a companion may meet; each takes as long as thousands of steps.
_MOST_EVENTS, _MOST_SWITCHINGS, _SHARE_OF_EVENTS = 60, 20, 0.05
_MOST_UNTOLD = 10.0  # times as many decisions on what is held after which nothing has changed
_OF_LONG_RUNS = 0.5  # of these, where more than a moment is spent
# A companion looks at many places even where steps could be long: what those of the run went over, it meets. Its steps
# are at most this part of the time, as far as they are allowed, times a number that no step of the run is made of.
_LOOKS, _OF_ALLOWED, _UNLIKE = 1000.0, 0.25, 0.9270509831248424
_HOPELESS = (
    4.0  # times the steps allowed: on the way to so many, held back by stability, a companion is given up
)


@record
class Companion:
    """How to integrate the motion again.

    Attributes
    ----------
    method : Method
    rtol, atol : float
    step : float [s]
        Of a method of fixed step, else 0.
    remains : float
        What the difference from the run has to be multiplied by to give the run's error.
    """

    method: Method
    rtol: float
    atol: float
    step: float = 0.0
    remains: float = 1.0

    def with_tolerance(self, rtol: float) -> Companion:
        """Return an adaptive companion with another relative tolerance, and the absolute one in proportion."""
        return replace(self, rtol=rtol, atol=self.atol * rtol / self.rtol)


def independent(solution: Solution, own: Method, least_range: float) -> tuple[Companion, ...]:
    """Return companions of another method: the second, as accurate as can be, for where the first finds the run wrong.

    An explicit method of high order is cheap and shares none of the run's assumptions: not its form of the constraints,
    nor its iterations. A run of high order with the tightest tolerances is more accurate than any; its companion is
    another one like it.

    Parameters
    ----------
    own : Method
        That of the run, in the run's form of constraints.
    least_range : float
        Of what moves, the range of the coordinate or rate that moves least.
    """
    if own.adaptive and solution.rtol < _ALIKE and own.order >= _HIGH_ORDER:
        rtol, atol = _BESIDE * solution.rtol, _BESIDE * solution.atol
        if atol <= rtol:
            return (Companion(own, rtol, atol, remains=_OF_BESIDE),)
        return (Companion(own, rtol, min(_TIGHTER * rtol, _ATOL_OF_RANGE * least_range)),)
    rtol = min(_TIGHTER * solution.rtol, _LOOSEST) if own.adaptive else _OF_FIXED_STEPS
    return tuple(
        Companion(METHODS[_EXPLICIT], tol, min(_TIGHTER * tol, _ATOL_OF_RANGE * least_range))
        for tol in sorted({max(rtol, TIGHTEST), TIGHTEST}, reverse=True)
    )


def by_series(solution: Solution, accurate: Companion) -> Companion | None:
    """Return a companion by series, as accurate as an explicit one, of a run whose equations may be smooth along it.

    It takes a third of the time or less, and meets nothing in fewer places: there is nothing to meet. Beside a run by
    series, with which it shares the method, the explicit one has to confirm it in places (`error_estimate.py`). Beside
    an explicit one it is where the choice of the method has made the series.
    """
    own, system = METHODS.get(solution.method), solution.system
    if own is None or accurate.method.series or solution.timetable is not None:
        return None
    if not own.series and not choose.has_weighed_series(solution.notes, system, solution.rtol):
        return None
    if solution.stats["steps"] < _FEWEST_BY_SERIES or not may_be_smooth(solution):
        return None
    costs = taylor_kernel.taylor_addresses(system)[2:5]
    if step_costs.time_ratio(system, accurate.rtol, costs) > (_QUICKER if own.series else _QUICKER_ALONE):
        return None
    return replace(accurate, method=METHODS[_SERIES])


def follow_smooth(
    solution: Solution, companion: Companion, times: np.ndarray, state: np.ndarray, most_steps: int
) -> np.ndarray | None:
    """Integrate smooth equations again from a state of a run: nothing happens on the way that Python would act on.

    Parameters
    ----------
    times : ndarray [s]
        Where states are wanted; the first is that of `state`.
    state : ndarray, shape (nq + nv,)
    most_steps : int

    Returns
    -------
    ndarray, shape (n, nq + nv), or None
        Where it does not come to the end, or the last state is not finite.
    """
    n = len(state)
    # Arrays for two states serve all places of a run, as those of companions that begin in it are made of its start.
    arrays = borrow(
        solution.system, companion.method, solution.p, float(solution.t[0]), solution.states[0],
        frame_times=times if len(times) > 2 else np.zeros(0), rtol=companion.rtol, atol=companion.atol,
        energy_level=_level(solution, companion, float(times[0]), state),
    )  # fmt: skip
    arrays.y[:n] = state
    arrays.control[[at.T, at.T_GRID, at.T_EVENT]] = times[0]
    arrays.frames[:1] = arrays.y
    arrays.counters[at.NEXT_FRAME] = min(len(arrays.frames), 1)
    status = at.RUNNING
    while status == at.RUNNING and (left := most_steps - int(arrays.counters[at.STEPS])) > 0:
        status = arrays.advance(float(times[-1]), min(left, len(arrays.step_log)))
    found = None
    if status == at.REACHED_STOP and np.isfinite(arrays.y).all():
        arrays.frames[-1:] = arrays.y
        found = arrays.frames[:, :n].copy() if len(arrays.frames) else np.array([state, arrays.y[:n]])
    give_back(arrays)
    return found


def _level(solution: Solution, companion: Companion, t: float, state: np.ndarray) -> float:
    """Return the energy that a companion keeps [J], nan: none. A run that keeps its own is more accurate than others.

    By series alone: what has to confirm them shares nothing with the run.
    """
    if companion.method.series and solution.energy.taken > 0.0:
        return energy(solution.system, solution.p, t, state)
    return math.nan


def apart(rtol: float, of_run: float) -> float:
    """Return a tolerance with which a run's own method makes errors of its own: with that of the run it is the run."""
    return of_run / _APART_FROM_RUN if of_run / _NEAR_RUN < rtol < of_run * _NEAR_RUN else rtol


def loose(least_range: float) -> Companion:
    """Return a companion whose own errors are those whose growth is looked at: it takes the longest steps."""
    return Companion(METHODS[_EXPLICIT], _LOOSE, min(_TIGHTER * _LOOSE, _LOOSE * least_range))


def tighter(companion: Companion) -> Companion:
    """Return a companion whose errors are a thousandth of those of another one, or with half its step."""
    if companion.step:
        return replace(companion, step=0.5 * companion.step)
    return companion.with_tolerance(_OF_LOOSE * companion.rtol)


def finer(solution: Solution, own: Method, least_range: float) -> Companion:
    """Return the run's own method, with tighter tolerances or half the step: where stability holds others back."""
    if own.adaptive:
        rtol = max(_TIGHTER * solution.rtol, TIGHTEST)
        return Companion(own, rtol, min(solution.atol * rtol / solution.rtol, _ATOL_OF_RANGE * least_range))
    factor = 2.0**own.order
    return Companion(own, solution.rtol, solution.atol, 0.5 * solution.step, factor / (factor - 1.0))


@record
class Followed:
    """What became of a companion.

    Attributes
    ----------
    states : ndarray, shape (n, nq + nv)
        At the first n of the times asked for.
    steps : int
    t : float [s]
        Where it ended.
    ended : bool
        Whether an event ended it.
    jumped : float [s]
        When rates jumped last.
    work : ndarray, shape (n,) [J]
        Done on the system up to these times, by resets too.
    """

    states: np.ndarray
    steps: int
    t: float
    ended: bool
    jumped: float = -math.inf
    work: np.ndarray = field(default_factory=lambda: np.zeros(1))


def follow(
    solution: Solution,
    companion: Companion,
    times: np.ndarray,
    state: np.ndarray,
    most_steps: int,
    is_lost: Callable[[np.ndarray], bool],
    sharp: SharpPlaces | None = None,
    events: float = 1.0,
) -> Followed:
    """Integrate the motion again from a state of a run, with its events and inputs.

    Parameters
    ----------
    times : ndarray [s]
        Where states are wanted; the first is that of `state`.
    state : ndarray, shape (nq + nv,)
    most_steps : int
    is_lost : callable
        Called with the states so far now and then; the companion is given up where it returns True.
    sharp : SharpPlaces, optional
        Where to look closely.
    events : float
        How many times the usual number of events it may meet.
    """
    t, end = float(times[0]), float(times[-1])
    kept = _timetable(solution, companion, t, end, most_steps, sharp)
    try:
        run = _CompanionRun(solution, companion, times, state, most_steps, is_lost, kept, events)
        run.go()
    except (ContactError, RuntimeModelError):
        return Followed(state[None], 0, float(times[0]), ended=False)
    if run.status == "interrupted":
        raise KeyboardInterrupt
    arrays = run.arrays
    frames = arrays.frames[: arrays.counters[at.NEXT_FRAME]]
    states = frames[:, : len(state)].copy()
    work = frames[:, len(state) :].sum(axis=1) + run.reset_energy_at_frames[: len(frames)]
    give_back(arrays)
    return Followed(
        states,
        int(arrays.counters[at.STEPS]),
        arrays.t,
        run.status == "terminated",
        last_jump(run.actions.log),
        work,
    )


def last_jump(events: Sequence[EventRecord]) -> float:
    """Return when rates jumped last [s]."""
    return next((event.t for event in reversed(events) if is_jump(event)), -math.inf)


def is_jump(event: EventRecord) -> bool:
    """Whether an event is an impact, a reset, or a change of what is held."""
    return event.action not in ("record", "terminate")


def _timetable(
    solution: Solution,
    companion: Companion,
    t: float,
    end: float,
    most_steps: int,
    sharp: SharpPlaces | None,
) -> Timetable | None:
    """Return what the steps of a companion keep to: what those of the run do, and a limit of their own."""
    own = solution.timetable
    step_limits, breaks = (own.step_limits, own.breaks) if own is not None else (None, ())
    looks = min(_LOOKS, _OF_ALLOWED * most_steps)
    adaptive = companion.method.adaptive
    limited = adaptive and companion.rtol < _LOOSE and looks >= 1.0 and not is_smooth_along(solution)
    longest = _UNLIKE * (end - t) / looks if limited else None
    if longest is not None and longest < shortest_max_step(t, end):
        longest = None  # frames may be as near to each other as round-off
    closely = sharp.step_limits(_OF_ALLOWED * most_steps) if adaptive and sharp is not None else None
    if closely is not None:
        step_limits = closely if step_limits is None else step_limits.within(closely)
    return timetable(
        step_limits, companion.method, RunOptions(t_start=t, t_end=end, max_step=longest, breaks=breaks)
    )


def tell_closed(solution: Solution, t: float, p: np.ndarray) -> None:
    """Write into `p` which stops were closed at a time of a run.

    Rigid bodies leave open how many stops share a load, and friction tells which of them do: another choice would be
    another motion, not an error.
    """
    if solution.forms is None:
        return
    system, frame = solution.system, int(np.searchsorted(solution.t, t))
    if frame < len(solution.t) and solution.t[frame] == t:
        closed = contact_settings.Layout(system).closed
        settings = p[system.settings_of_switches]  # a view
        settings[closed] = solution.forms.settings[solution.forms.index[frame]][closed]


class _CompanionRun(Run):
    """A run that gives up where it has lost the run beside it, or would take too long."""

    def __init__(
        self,
        solution: Solution,
        companion: Companion,
        times: np.ndarray,
        state: np.ndarray,
        most_steps: int,
        is_lost: Callable[[np.ndarray], bool],
        kept: Timetable | None,
        events: float,
    ):
        system, method, p = solution.system, companion.method, solution.p.copy()
        t, end = float(times[0]), float(times[-1])
        p[system.n_settable :] = 0.0  # stops and frictions are found to be held, or not, at the start
        tell_closed(solution, t, p)
        # What is usual of the constraints is found where the run began: angles that have turned far count as large.
        make = borrow if t == solution.t[0] else LoopArrays  # others begin at all sorts of places
        arrays = make(
            system, method, p, float(solution.t[0]), solution.states[0], frame_times=times, rtol=companion.rtol,
            atol=companion.atol, step=companion.step,
        )  # fmt: skip
        arrays.y[: len(state)] = state
        arrays.control[[at.T, at.T_GRID, at.T_EVENT]] = t
        inputs = None
        if system.input_descriptions:
            inputs = schedule.InputSchedule(system, arrays, method, t)
        super().__init__(
            system, method, arrays, np.zeros(len(times), dtype=bool), [end], max_steps=most_steps, inputs=inputs,
            timetable=kept,
        )  # fmt: skip
        self._n, self._most, self._is_lost, self._seen = solution.states.shape[1], most_steps, is_lost, 0
        least = _MOST_SWITCHINGS if solution.system.switches else _MOST_EVENTS
        if operations_of_run(solution) > SHORT:
            least *= _OF_LONG_RUNS
        self._most_events = events * max(_SHARE_OF_EVENTS * len(solution.events), least)

    def pauses(self) -> bool:
        """Whether to go no further."""
        arrays = self.arrays
        steps, reached = int(arrays.counters[at.STEPS]), int(arrays.counters[at.NEXT_FRAME])
        if len(self.actions.log) + self.actions.n_untold / _MOST_UNTOLD > self._most_events:
            return True
        if self.stiff_noted:
            share = (arrays.t - self.t_start) / (self.t_end - self.t_start)
            if steps > _HOPELESS * self._most * share:
                return True
        if reached <= self._seen:
            return False
        self._seen = reached
        return self._is_lost(arrays.frames[:reached, : self._n])
