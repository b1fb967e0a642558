"""The method and order of an ensemble, chosen once for all its members: by steps and operations of a sample.

Some members, spread evenly over the ensemble, run the first part of their time with each method that lanes have. What
a method costs a member is its steps times what one step takes, which follows from operations that are counted. So a
choice is the same on every machine, for any number of threads, and again; processor time enters nowhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.time_scales import change_rate, time_scales
from symgen.runtime.choose import (
    EXPLICIT,
    EXPLICIT_BELOW,
    FOLLOWED,
    LIMITS,
    SERIES,
    STIFFNESS_RATIO,
    choose_method,
    misfit_of_series,
    stiff_method,
)
from symgen.runtime.ensemble.batch import BatchSettings, LaneBatch
from symgen.runtime.ensemble.events import PLACES
from symgen.runtime.ensemble.machine import IN_LANES, lane_series
from symgen.runtime.ensemble.slots import TOO_MANY_STEPS
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.record import record
from symgen.runtime.step_costs import orders

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System

_FEWEST = 64  # members from which on a sample is worth its runs
_SAMPLE = 8  # members: those of one turn of the lanes
_SHARE = 0.05  # of the ensemble's work, for all trials together
_TRIALS = 3
_LONGEST_TRIAL = 20_000  # steps of a member
_TELLING_STEPS = 100  # of a trial: of fewer, those with which a run begins, which are shorter, are too many
_ORDERS_APART = 4
_CLEARLY = 1.05  # times less work before the explicit method gives way to a series, which has to be compiled
# A member that takes so many times the steps of the sample's mean, and so many at least, is another kind of motion.
_TOO_LONG, _LONG_AT_LEAST = 100, 20_000
_MOST_LEFT_LANES = 1 << 52
# Nanoseconds of a step on one core, fitted to a dozen models of 4 to 36 numbers and 4 to 1068 operations within a fifth
# (AMD Zen 4); only their ratios count. What a series needs grows faster than its operations, as it leaves the caches.
_OF_OPERATION, _OF_NUMBER, _OF_STEP = 0.039, 10.3, 3.3
_OF_SERIES, _GROWS, _OF_SQUARES = 4.3e-4, 1.44, 0.27
_BESIDE_SERIES, _NUMBER_BESIDE_SERIES = 0.217, 8.6
_PROJECTIONS = 1.5  # of a step
_OF_EVENTS, _OF_LOOKING = 200.0, 4.0  # and by numbers of dense output
_STAGES, _DENSE = 12, 8  # of dop853
# Of a step of a Radau method in lanes, and of each evaluation in it, which comes with a part of a linear system.
_LANES_STEP, _LANES_CALL, _LANES_NUMBER = 55.0, 7.0, 1.5
_ORDERS_OF_STIFF = ("radau5", "radau9", "radau13")
# Of a step of an implicit method that runs by itself, and of its parts; and what a run takes besides.
_ALONE_OPERATION, _ALONE_STEP, _ALONE_RUN, _ELIMINATION = 0.3, 750.0, 5e4, 0.6
_LANES_GAIN = 4.5
_MEMBERS_FOR_A_LOOK = 40  # a look at a member takes as long as two run


@record
class Choice:
    """How all members of an ensemble are integrated.

    Attributes
    ----------
    method : str
    order : int
        Of series; 0: by the tolerance.
    most_steps : int
        A member that takes more in lanes is left to a run of its own, which chooses for itself; 0: there is no limit.
    notes : tuple of str
        Why.
    """

    method: str
    order: int = 0
    most_steps: int = 0
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return what a file keeps of it."""
        return {
            "method": self.method,
            "order": self.order,
            "most_steps": self.most_steps,
            "notes": list(self.notes),
        }

    @classmethod
    def from_json(cls, stored: Any) -> Choice | None:
        """Return what a file says was chosen; None where it says nothing that makes sense."""
        if not isinstance(stored, Mapping):
            return None
        method, order, most = (stored.get(key) for key in ("method", "order", "most_steps"))
        notes = stored.get("notes")
        said = isinstance(notes, list) and all(isinstance(x, str) and len(x) < 1000 for x in notes[:9])
        whole = all(type(x) is int and x >= 0 for x in (order, most))
        named = isinstance(method, str) and method in METHODS
        if not (named and said and whole) or order not in (0, *orders()):
            return None
        return cls(method, order, min(most, _MOST_LEFT_LANES), tuple(notes[:9]))


@record(eq=False)
class Sample:
    """Members on which methods are tried.

    Attributes
    ----------
    parameters, starts : ndarray, shape (k, n_p), (k, nq + nv)
    of : int
        Members of the ensemble.
    numbers : ndarray of int, shape (k,)
        Those of the members: they say what noise they have.
    driven : callable
        `driven(i)` is the model with the inputs over time of the i-th of them.
    """

    parameters: np.ndarray
    starts: np.ndarray
    of: int
    numbers: np.ndarray
    driven: Callable[[int], System]

    @property
    def tells(self) -> bool:
        """Whether trials are worth their time."""
        return self.of >= _FEWEST and len(self.starts) > 0


@record(eq=False)
class _Trial:
    """What a method costs the members of a sample [ns]; not a number where it fails."""

    method: str
    order: int
    steps: np.ndarray  # of a member to the end of its run, by those of the trial
    each: float  # ns of a step

    @property
    def cost(self) -> np.ndarray:
        return self.steps * self.each


def numbers_of_sample(n: int) -> list[int]:
    """Return which members of `n` are a sample: in the middles of parts of equal length."""
    k = min(_SAMPLE, n)
    return sorted({int((i + 0.5) * n / k) for i in range(k)})


def choose_once(
    system: System, sample: Sample, single: RunOptions, settings_of: Callable[[str], BatchSettings | None]
) -> Choice | None:
    """Choose for an ensemble by the members of a sample; None where these do not tell.

    Parameters
    ----------
    system : System
    settings_of : callable
        Settings for lanes with a method; None where lanes cannot have it.
    """
    settings = settings_of(EXPLICIT)
    if settings is None:
        return None
    # All trials together take no more than their share, if trials with other methods take as long as the first one,
    # or some steps that tell.
    span = (single.t_end - single.t_start) * min(1.0, _SHARE * sample.of / (_TRIALS * len(sample.starts)))
    settings = replace(
        settings,
        t_end=single.t_start + span,
        frame_times=np.zeros(0),
        max_steps=min(settings.max_steps, _LONGEST_TRIAL),
    )
    each = _step_of_explicit(system)
    explicit, ends = _tried(system, settings, sample, each, single.t_end)
    longer = _telling_end(settings, explicit, single)
    if longer > settings.t_end:
        settings = replace(settings, t_end=longer)
        explicit, ends = _tried(system, settings, sample, each, single.t_end)
    if not np.isfinite(explicit.cost).any():
        return None
    trials = [explicit, *_series(system, settings, settings_of, sample, single)]
    if single.rtol >= EXPLICIT_BELOW and _looks_stiff(sample, explicit, ends, single):
        trials += _stiff(settings, settings_of, sample, single, explicit)
    return _best(trials, sample.of, single)


def choose_by_looks(sample: Sample, single: RunOptions) -> Choice:
    """Choose as single runs do, for some members of a sample: what most of them want, the stiffer one of equals."""
    looks = max(1, min(len(sample.starts), sample.of // _MEMBERS_FOR_A_LOOK))
    wanted: dict[str, list[list[str]]] = {}
    for k in range(looks):
        method, why = choose_method(sample.driven(k), sample.parameters[k], sample.starts[k], single)
        wanted.setdefault(method.name, []).append(why)
    name = max(wanted, key=lambda name: (len(wanted[name]), METHODS[name].stiff))
    why = wanted[name][0]
    if len(wanted) > 1:
        why = [f"{why[0]} ({len(wanted[name])} of {looks} members that were looked at)", *why[1:]]
    return Choice(name, notes=tuple(why))


def _best(trials: list[_Trial], n: int, single: RunOptions) -> Choice:
    """Return the method whose sum over the sample is least; a member that one fails costs a run by itself."""
    dearest = np.fmax.reduce([np.where(np.isfinite(t.cost), t.cost, np.nan) for t in trials])
    dearest = np.where(np.isfinite(dearest), dearest, 0.0)
    alone = 2.0 * _LANES_GAIN * dearest + _ALONE_RUN
    sums = [float(np.where(np.isfinite(t.cost), t.cost, alone).sum()) for t in trials]
    best = min(
        range(len(trials)), key=lambda k: sums[k] * (1.0 if trials[k].method == EXPLICIT else _CLEARLY)
    )
    chosen, k = trials[best], len(trials[0].steps)
    said = f"{chosen.method} of order {chosen.order}" if chosen.order else chosen.method
    others = {
        t.method: s / sums[best] for t, s in zip(trials, sums, strict=True) if t.method != chosen.method
    }
    than = ", ".join(f"{name} {ratio:.2g} times as long" for name, ratio in others.items())
    than = " and ".join(than.rsplit(", ", 1))
    reason = f"by steps and operations of {k} of {n} members it takes the least time" + (
        f", {than}" if than else ""
    )
    limit = 0
    if chosen.method in IN_LANES:
        mean = float(np.nanmean(np.where(np.isfinite(chosen.steps), chosen.steps, np.nan)))
        limit = int(max(_LONG_AT_LEAST, _TOO_LONG * mean))
    return Choice(
        chosen.method, chosen.order, limit, (f"method auto: {said} for all members, because {reason}",)
    )


def _tried(
    system: System, settings: BatchSettings, sample: Sample, each: float, t_end: float
) -> tuple[_Trial, np.ndarray]:
    """Run the sample in lanes; returns what it costs, and (t, q, v) where the members came to."""
    result = LaneBatch(system, settings).run(sample.parameters, sample.starts, sample.numbers)
    t, status = result.column("t"), result.column("status")
    steps = result.column("steps") + result.column("rejected")
    went = np.isin(status, (at.REACHED_STOP, TOO_MANY_STEPS)) & (t > settings.t_start)
    with np.errstate(divide="ignore", invalid="ignore"):
        per_second = np.maximum(steps, 1.0) / (t - settings.t_start)
        # An event may have ended the member before the end of the trial, and then for good.
        ended = (status == at.REACHED_STOP) & (t < settings.t_end)
        whole = np.where(ended, np.maximum(steps, 1.0), per_second * (t_end - settings.t_start))
    trial = _Trial(settings.method, settings.order, np.where(went, whole, np.nan), each)
    return trial, np.hstack([t[:, None], result.end])


def _telling_end(settings: BatchSettings, trial: _Trial, single: RunOptions) -> float:
    """Where trials have to end to take steps that tell, if those of this one go on like that."""
    if not np.isfinite(trial.steps).any():
        return settings.t_end
    span = single.t_end - single.t_start
    return single.t_start + span * min(1.0, _TELLING_STEPS / float(np.nanmean(trial.steps)))


def _events_of_step(system: System, numbers: int) -> float:
    """Nanoseconds of a step for what looks for events by so many numbers of dense output."""
    if not system.events:
        return 0.0
    looked = len(PLACES) * (system.operations.get("events", 0) + numbers)
    return _OF_EVENTS + _OF_LOOKING * numbers + _OF_OPERATION * looked


def _beside(system: System) -> float:
    """Operations of a step for energies and constraints."""
    return system.operations.get("energy", 0) + _PROJECTIONS * system.operations.get("project", 0)


def _step_of_explicit(system: System) -> float:
    operations = _STAGES * system.operations.get("rhs", 0) + _beside(system)
    own = _OF_OPERATION * operations + _OF_NUMBER * system.ny + _OF_STEP
    return own + _events_of_step(system, _DENSE * system.ny)


def _step_of_series(system: System, costs: tuple[float, float, float], order: int) -> float:
    start, linear, square = costs
    series = start + order * (linear + _OF_SQUARES * order * square)
    own = _OF_SERIES * series**_GROWS + _BESIDE_SERIES * _beside(system) + _NUMBER_BESIDE_SERIES * system.ny
    return own + _events_of_step(system, order * system.ny)


def _series(
    system: System, explicit: BatchSettings, settings_of: Callable[[str], BatchSettings | None], sample: Sample,
    single: RunOptions,
) -> list[_Trial]:  # fmt: skip
    """Return the trial of series of the best order: two orders tell how steps grow with it."""
    p, state, driven = sample.parameters[0], sample.starts[0], sample.driven(0)
    if misfit_of_series(driven, p, single.t_start, state, single.rtol):
        return []
    settings = settings_of(SERIES)
    if settings is None or settings.method != SERIES:
        return []
    settings = replace(
        settings, t_end=explicit.t_end, frame_times=explicit.frame_times, max_steps=explicit.max_steps
    )
    costs = lane_series(driven, settings.lanes)[1]
    usual = LaneBatch(system, settings).order
    low = max(min(usual, orders()[-1] - _ORDERS_APART), orders()[0])
    pair = [
        _tried(
            system,
            replace(settings, order=order),
            sample,
            _step_of_series(system, costs, order),
            single.t_end,
        )[0]
        for order in (low, low + _ORDERS_APART)
    ]
    means = [float(np.nanmean(trial.steps)) if np.isfinite(trial.steps).any() else np.nan for trial in pair]
    if not np.isfinite(means).all():
        return [trial for trial in pair if np.isfinite(trial.cost).any()]
    # Of steps that are left out h^p is a given share: log(steps) = a + b / (p - 1).
    span = 1.0 / (low - 1) - 1.0 / (low + _ORDERS_APART - 1)
    slope = max(math.log(means[0] / means[1]) / span, 0.0)

    def growth(order: int) -> float:
        return math.exp(slope * (1.0 / (order - 1) - 1.0 / (low - 1)))

    best = min(orders(), key=lambda order: growth(order) * _step_of_series(system, costs, order))
    return [_Trial(SERIES, best, pair[0].steps * growth(best), _step_of_series(system, costs, best))]


def _looks_stiff(sample: Sample, explicit: _Trial, ends: np.ndarray, single: RunOptions) -> bool:
    """Whether the member with most steps, or one in the middle, has motions that limit explicit steps."""
    order = np.argsort(np.where(np.isfinite(explicit.steps), explicit.steps, -1.0))
    for k in {int(order[-1]), int(order[len(order) // 2])}:
        system = sample.driven(k)
        t, steps = ends[k, 0], explicit.steps[k]
        q, v = ends[k, 1 : 1 + system.nq], ends[k, 1 + system.nq : 1 + system.nq + system.nv]
        if not (np.isfinite(steps) and np.isfinite(q).all() and np.isfinite(v).all()):
            continue
        h = (single.t_end - single.t_start) / steps
        scales = time_scales(system, sample.parameters[k], t, q, v)
        slow = max(float(change_rate(system, q, v)), 1.0 / (single.t_end - single.t_start))
        if scales.damping * h >= LIMITS or scales.fastest >= max(STIFFNESS_RATIO * slow, FOLLOWED / h):
            return True
    return False


def _stiff(
    settings: BatchSettings, settings_of: Callable[[str], BatchSettings | None], sample: Sample, single: RunOptions,
    explicit: _Trial,
) -> list[_Trial]:  # fmt: skip
    """Return the trials of methods for stiff motion, member after member, as long as they cost less.

    All members try the one that single runs take. Where lanes have it, its relatives of other orders are tried by two
    members: what their steps are worth differs from single runs, in which a step has costs of its own.
    """
    usual, system = stiff_method(single.rtol), sample.driven(0)
    if METHODS[usual].refusal(system):
        return []
    members = np.arange(len(sample.starts))
    first = _stiff_trial(usual, settings, settings_of, sample, single, explicit.steps, members)
    if first is None:
        return []
    trials, went = [first], np.flatnonzero(np.isfinite(first.steps))
    two = np.unique(went[np.argsort(first.steps[went], kind="stable")[[len(went) // 2, -1]]])
    for other in _ORDERS_OF_STIFF:
        if other == usual or settings_of(other) is None or METHODS[other].refusal(system):
            continue
        # A step of a higher order costs more: more steps than the usual method's never pay.
        most = first.steps if METHODS[other].order > METHODS[usual].order else explicit.steps
        tried = _stiff_trial(other, settings, settings_of, sample, single, most, two)
        if tried is not None and np.isfinite(tried.steps[two]).all():
            per_step = float(tried.steps[two].sum() / first.steps[two].sum())
            trials.append(_Trial(other, 0, per_step * first.steps, tried.each))
    return trials


def _stiff_trial(
    name: str, settings: BatchSettings, settings_of: Callable[[str], BatchSettings | None], sample: Sample,
    single: RunOptions, most_steps: np.ndarray, members: np.ndarray,
) -> _Trial | None:  # fmt: skip
    """Return what some members need with an implicit method, of all the others nothing; None where all fail."""
    start = settings.t_start
    share = (settings.t_end - start) / (single.t_end - start)
    in_lanes = settings_of(name) is not None
    steps, costs = np.full((2, len(sample.starts)), np.nan)
    for k in members:
        # More steps than those of a method that is known do not pay.
        most = share * most_steps[k] if np.isfinite(most_steps[k]) else _LONGEST_TRIAL
        system = sample.driven(k)
        operations = system.operations
        arrays = LoopArrays(
            system, METHODS[name], sample.parameters[k], start, sample.starts[k], frame_times=np.zeros(0),
            rtol=single.rtol, atol=single.atol, with_events=False, log_length=_LONGEST_TRIAL,
        )  # fmt: skip
        status = arrays.advance(settings.t_end, max(int(min(most, _LONGEST_TRIAL)), 1))
        if status < 0 or not arrays.t > start:
            continue
        counts = arrays.counters
        n, calls = counts[at.STEPS] + counts[at.REJECTED], counts[at.RHS_CALLS]
        rhs, jacobian = operations.get("rhs", 0), operations.get("residual_jacobian", 0)
        if in_lanes:
            call = _LANES_CALL + _LANES_NUMBER * system.nv + _OF_OPERATION * rhs
            spent = _LANES_STEP * n + call * calls
        else:
            spent = _ALONE_STEP * n + counts[at.FACTORISATIONS] * _ELIMINATION * (system.nv + system.m) ** 3
            spent += _ALONE_OPERATION * (calls * rhs + counts[at.JACOBIANS] * jacobian)
        longer = (single.t_end - start) / (arrays.t - start)
        steps[k], costs[k] = n * longer, spent * longer + (0.0 if in_lanes else _ALONE_RUN)
    if not np.isfinite(costs).any():
        return None
    return _Trial(name, 0, steps, float(np.nansum(costs) / np.nansum(steps)))
