"""Equal subsystems in the lanes of vector registers, as members of an ensemble: each with steps of its own.

Their time goes by in legs, of a length that follows from the model alone. At the end of a leg all stand still: frames
are handed on, what has come to rest sleeps, and what lanes could not bring so far begins again as a run of its own. So
what is recorded, and how long the run is, changes no leg before the last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.choose import EXPLICIT, SERIES
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.run_state import StepLog
from symgen.runtime.subsystems.subsystem import Subsystem, are_at_rest
from symgen.runtime.uninterrupted import uninterrupted

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Settings

batch = Late("symgen.runtime.ensemble.batch")
evaluate = Late("symgen.runtime.ensemble.evaluate")
lower = Late("symgen.runtime.code.lower")
errors = Late("symgen.runtime.errors")

METHODS_IN_LANES = (SERIES, EXPLICIT)
_LEG = 8.0  # times the time for which costs are compared: a leg ends steps that might have been longer
_CALLS = {SERIES: 1, EXPLICIT: 12}  # of the model, for each step
_LOG = 1 << 16


class InLanes(Subsystem):
    """Equal subsystems that lanes integrate.

    Parameters
    ----------
    members : sequence of Subsystem
        Of one system and one method out of `METHODS_IN_LANES`, each without twins.
    leg : float [s]
        After which all are at the same time; inf: at the end of the run only.
    """

    def __init__(self, members: Sequence[Subsystem], leg: float):
        first = members[0]
        fastest = max(members, key=lambda member: member.choice.rate)
        super().__init__(
            first.system, np.array([m.p for m in members]), first.t_start, np.array([m.state for m in members]),
            first.choice._replace(rate=fastest.choice.rate), is_asleep=False,
        )  # fmt: skip
        self.members, self.leg = members, leg
        self.titles = [title for member in members for title in member.titles]
        self.columns = [np.concatenate([member.columns[0] for member in members])]

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{len(self.members)} equal subsystems, the first of them the {self.titles[0]}"

    def steps_of_each(self) -> list[int]:
        """Return the steps that each of its members took."""
        return self.run.steps.astype(int).tolist()

    def rests_from(self) -> list[float]:
        """Return when each of its members came to rest [s]; inf where it did not."""
        return self.run.rests_from.tolist()

    def frames(self, rows: slice) -> np.ndarray:
        """Return the states of all at some frames, in the order of `columns`, and the work of all behind."""
        return self.run.rows(rows)

    def prepare(
        self, times: np.ndarray, shown: np.ndarray, stops: Sequence[float], settings: Settings
    ) -> None:
        """Make a run from the start, for some frames and times to land on."""
        self.run = LaneRun(self, times, shown, stops, settings)

    def balances(self) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """Yield of each member a title, T and V at the frames, shape (frames, 2), and the work done so far."""
        run, n = self.run, self.run.n_frames
        states = run.states(slice(0, n))
        energies = evaluate.evaluate_members(self.system, "energy", self.p, run.times[:n], states)
        for member, own, rows in zip(self.members, energies, states, strict=True):
            yield member.titles[0], own, rows[:, -1] if self.system.nw else np.zeros(n)


def leg_of(usual_time: float) -> float:
    """Return the length of a leg [s], by the time for which costs are compared; inf where nothing moves."""
    return _LEG * usual_time if usual_time > 0.0 else np.inf


def lanes_object_to(member: Subsystem, settings: Settings) -> str:
    """Return why members like this one have runs of their own; an empty string where lanes can take them."""
    options, method = settings.options, member.choice.method
    if member.system.events:
        return "it has events"
    if method.name not in METHODS_IN_LANES or member.choice.treatment not in ("none", "projection"):
        return f"{method.name} is for runs of their own"
    if options.max_steps is not None or settings.timetable_of(member.system, method) is not None:
        return "steps are limited"
    try:
        batch.LaneBatch(member.system, _settings(member, 1, settings))
    except (lower.NoLanes, errors.Refusal) as why:
        return str(why)
    return ""


def _settings(member: Subsystem, n: int, settings: Settings):
    """Return the settings for lanes that `n` such members share, but for the times of a leg."""
    options, method, system = settings.options, member.choice.method, member.system
    level = np.nan
    if system.m:
        level = choose_energy_level(
            options.energy_scaling, system, method, member.p, options.t_start, member.state
        )
    control = LoopArrays(
        system, method, member.p, options.t_start, member.state, frame_times=np.zeros(0), rtol=options.rtol,
        atol=options.atol, energy_level=level, log_length=1,
    ).control  # fmt: skip
    return batch.BatchSettings(
        method.name, options.t_start, options.t_end, options.rtol, options.atol, np.zeros(0),
        projection_tol=float(control[at.PROJECTION_TOL]),
        longest=(float(control[at.H_MAX]), float(control[at.H_BASE]), float(control[at.H_SHARE])),
        scale_energy=bool(np.isfinite(level)), lanes=batch.lanes_for(system, method.name, n),
    )  # fmt: skip


class LaneRun:
    """The run of members in lanes; to others it is what `subsystem.MemberRun` is.

    Attributes
    ----------
    times : ndarray, shape (frames,) [s]
    steps, rejected : ndarray, shape (members,)
    rests_from : ndarray, shape (members,) [s]
    """

    def __init__(
        self, group: InLanes, times: np.ndarray, shown: np.ndarray, stops: Sequence[float], settings: Settings
    ):
        self.system, self.method, self.times = group.system, group.choice.method, times
        self._group, self._shown, self._settings, self.stops = group, shown, settings, list(stops)
        n, system = len(group.members), group.system
        self._lanes = _settings(group.members[0], n, settings)
        self.status, self.message = "success", ""
        self.notes: list[str] = []
        self.samples: list[tuple[float, np.ndarray, float, int]] = []
        self.actions = SimpleNamespace(log=[], passed_by=lambda: [])
        self.steps, self.rejected, self.rests_from = np.zeros(n), np.zeros(n), np.full(n, np.inf)
        self._now = np.hstack([group.state, np.zeros((n, system.nw))])
        self._pieces = [(0, self._now[:, None].copy())]  # of frames, by the number of their first
        self.n_frames = 1
        self._t, self._leg = settings.options.t_start, 0
        self._alone: dict[int, Subsystem] = {}
        self._may_sleep = not system.structure["time_dependent"]
        self.arrays = SimpleNamespace(
            counters=np.zeros(at.N_COUNTERS, dtype=np.int64), control=np.zeros(at.N_CONTROL), t=self._t,
            p=group.p[0], load=lambda: None,
        )  # fmt: skip
        self.arrays.control[[at.MIN_PIVOT_RATIO, at.ENERGY_LEVEL]] = np.inf, np.nan

    @property
    def is_over(self) -> bool:
        """Whether it has come to its end, regular or not."""
        return self.status != "success" or (self.n_frames == len(self.times) and not self.stops)

    @property
    def n_steps(self) -> int:
        """The number of steps taken by all."""
        return int(self.steps.sum())

    @property
    def asleep_from(self) -> float:
        """When the first of them came to rest [s]; inf if none did."""
        return float(self.rests_from.min())

    def states(self, wanted: slice) -> np.ndarray:
        """Return frames of each member, shape (members, frames, ny)."""
        found = [
            piece[:, max(wanted.start - first, 0) : wanted.stop - first]
            for first, piece in self._pieces
            if first < wanted.stop and first + piece.shape[1] > wanted.start
        ]
        return found[0] if len(found) == 1 else np.concatenate(found, axis=1)

    def rows(self, wanted: slice) -> np.ndarray:
        """Return frames as rows over the states of all members, one after another, and the work of all behind."""
        return self._joined(self.states(wanted))

    def _joined(self, states: np.ndarray) -> np.ndarray:
        n = self.system.nq + self.system.nv
        found = np.empty((states.shape[1], len(states), n))
        for k in range(n):  # a fifth of the time of all at once, which copies n numbers at a time
            found[:, :, k] = states[:, :, k].T
        found = found.reshape(len(found), -1)
        return np.hstack([found, states[:, :, n].sum(axis=0)[:, None]]) if self.system.nw else found

    def go_to(self, n_frames: int) -> None:
        """Run until so many frames are written, or to the end; always to the end of a leg."""
        while not self.is_over and self.n_frames < n_frames:
            with uninterrupted():
                self._go_on()

    def _go_on(self) -> None:
        """One leg of all."""
        options = self._settings.options
        end = options.t_start + (self._leg + 1) * self._group.leg if np.isfinite(self._group.leg) else np.inf
        end = min(float(end), max(self.times[-1], *self.stops))
        last = int(np.searchsorted(self.times, end, side="right"))
        frames = self.times[self.n_frames : last]
        stops = [t for t in self.stops if t <= end]
        wanted = np.unique(np.concatenate([frames, stops, [end]]))
        rows = self._lanes_to(end, wanted)
        last = self._alone_to(last, wanted, rows)
        frames = self.times[self.n_frames : last]
        if len(frames):
            is_all = len(frames) == len(wanted)
            piece = rows if is_all else rows[:, np.searchsorted(wanted, frames)]
            self._pieces.append((self.n_frames, piece))
        if self.status != "success":
            self.n_frames = last
            return
        for t in stops:
            row = rows[:, int(np.searchsorted(wanted, t))]
            self.samples.append((t, self._joined(row[:, None])[0], 0.0, -1))
        self.stops = self.stops[len(stops) :]
        self._now, self._t, self.n_frames, self._leg = rows[:, -1].copy(), end, last, self._leg + 1
        self.arrays.t = end
        if self._may_sleep and not self.is_over:
            self._let_sleep()

    def _lanes_to(self, end: float, wanted: np.ndarray) -> np.ndarray:
        """Integrate those that move; returns the states of all at some times, and notes whom lanes could not bring."""
        live = np.array(
            [k for k in np.flatnonzero(np.isinf(self.rests_from)) if k not in self._alone], dtype=int
        )
        if not len(live):
            return np.repeat(self._now[:, None], len(wanted), axis=1)
        settings = replace(self._lanes, t_start=self._t, t_end=end, frame_times=wanted)
        n = self.system.nq + self.system.nv
        result = batch.LaneBatch(self.system, settings).run(self._group.p[live], self._now[live, :n])
        rows = result.frames
        if self.system.nw:  # lanes know the work of a leg
            rows[:, :, n] += self._now[live, n][:, None]
        if len(live) < len(self._now):
            rows = np.repeat(self._now[:, None], len(wanted), axis=1)
            rows[live] = result.frames
        self._take_statistics(live, result)
        for k in live[result.column("status") != at.REACHED_STOP].tolist():
            self._begin_alone(k)
        return rows

    def _take_statistics(self, live: np.ndarray, result) -> None:
        self.steps[live] += result.column("steps")
        self.rejected[live] += result.column("rejected")
        counters, control = self.arrays.counters, self.arrays.control
        counters[at.STEPS], counters[at.REJECTED] = self.steps.sum(), self.rejected.sum()
        counters[at.RHS_CALLS] = _CALLS[self.method.name] * (self.steps + self.rejected).sum()
        control[at.MIN_PIVOT_RATIO] = min(control[at.MIN_PIVOT_RATIO], result.column("pivot").min())
        control[at.MOST_ENERGY_TAKEN] = max(control[at.MOST_ENERGY_TAKEN], result.column("most_taken").max())
        if self._lanes.scale_energy and not self._leg:
            control[at.ENERGY_LEVEL] = result.column("level").sum()

    def _begin_alone(self, k: int) -> None:
        """Let a member begin again by itself: such runs change their method, and say why they fail."""
        member, stops = self._group.members[k], self.stops
        member.prepare(self.times, self._shown, [*stops, self.times[-1]], self._settings)
        self._alone[k] = member

    def _alone_to(self, last: int, wanted: np.ndarray, rows: np.ndarray) -> int:
        """Take those that run by themselves as far; returns up to which frame all have come."""
        for k, member in self._alone.items():
            run = member.run
            run.go_to(last if last < len(self.times) else last + 1)
            own = run.arrays.frames
            rows[k] = own[np.minimum(np.searchsorted(self.times, wanted), len(own) - 1)]
            for t, state, *_ in run.samples:
                if t <= wanted[-1] and t in wanted:
                    rows[k, int(np.searchsorted(wanted, t))] = state
            self.steps[k] = run.n_steps
            if run.status != "success":
                self.status, self.message = run.status, f"{member.name}: {run.message}"
                return max(self.n_frames, min(last, run.n_frames))
        return last

    def _let_sleep(self) -> None:
        """Let those stay where they are that have come to rest."""
        n, atol = self.system.nq + self.system.nv, self._settings.options.atol
        moves = np.flatnonzero(np.isinf(self.rests_from))
        rest = are_at_rest(self.system, self._group.p[moves], self._t, self._now[moves, :n], atol)
        for k in moves[rest].tolist():
            if k not in self._alone:
                self.rests_from[k] = self._t

    @property
    def step_log(self) -> StepLog:
        """The steps of the member that took most, of its first leg."""
        log = StepLog()
        k = int(self.steps.argmax())
        if k not in self._alone:
            end = float(self.times[-1])
            if np.isfinite(self._group.leg):
                end = min(end, self._settings.options.t_start + self._group.leg)
            one = batch.LaneBatch(self.system, replace(self._lanes, t_end=end, lanes=1, log_size=_LOG))
            steps = int(one.run(self._group.p[k : k + 1], self._group.state[k : k + 1]).column("steps")[0])
            log.add(one.step_log[: min(steps, _LOG)])
        return log
