"""What happens at events: resets, the energy they change, when an event may fire again, and Zeno behaviour."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.graph.spelling import reset_function
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import plain_events
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import DIRECTIONS
from symgen.runtime.positions import Positions
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.contact.switching import Switching
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

after_reset = Late("symgen.runtime.constraints.nearest_point")
switching = Late("symgen.runtime.contact.switching")

_OF_FRICTIONS = (
    "slip",
    "stick",
    "turn",
    "impact",
    "release",
)  # as `integrate/plain_frictions.py` numbers them
_PERTURBATION = 4.0 * np.finfo(float).eps
_PROJECTION_NOISE = 4.0  # states on constraints carry the round-off of the projection as well
_CLEAR = 8.0  # times round-off: a flight that high is surely seen
_JUMPED = 1e6  # times round-off: no event is located so badly, so that a function that is so far past zero has jumped
_PART_OF_FLIGHT = 1e-2  # over which an event function is nearly straight
_BACK = 1e-6  # of the rate on the other side of a jump: a rate back to it that counts
_PART_OF_RISE = 1e-3  # in a short time: places are found far more exactly, and a rise may have a jump in it
_AHEAD = 1e-6  # of the time in which the coordinates travel their own size
_BEGINNING = (
    32.0 * np.finfo(float).eps
)  # of the time: an event as near to the start of a step is where that begins


def arm_events(
    system: System,
    arrays: LoopArrays,
    fired: np.ndarray | None = None,
    *,
    before: np.ndarray | None = None,
    bands: np.ndarray | None = None,
    jumped: np.ndarray | None = None,
) -> None:
    """Set on which side of zero the event functions are where the state has changed: see `integrate/events.py`.

    A function that is at zero, but for round-off, has no side until it has moved away at the start of a run. After an
    event, one that did not fire keeps the side that it had: its own crossing may be the next. One that fired leans
    to where the rates carry it.

    Parameters
    ----------
    fired : ndarray of int, optional
        Events that have just fired.
    before : ndarray, optional
        The event functions before the state was changed: the side of one that jumped to zero says nothing.
    bands : ndarray, optional
        Of those that are never below zero, as gaps are not, how far below they count as zero; nan for others.
    jumped : ndarray of bool, optional
        Of each event, whether its function has just jumped over zero: see `has_jumped`.
    """
    side = arrays.event_block(at.SIDE)
    lean = np.sign(side)
    g, floor = event_values_and_floor(system, arrays, behind_a_jump=jumped is not None and jumped.any())
    if before is not None:
        lean[np.abs(before) > _CLEAR * floor] = 0.0
    band = floor.copy()
    if fired is not None and len(fired):
        # The state is past the event by less than the last digit of time; that is no side either.
        reset = np.array([system.events[k]["action"] in ("reset", "friction") for k in fired])
        past = past_event(arrays, g, floor)[fired]
        if (
            before is not None
        ):  # a reset, or a load shared anew, may carry its own function away, and it comes again
            past = np.where(reset, np.minimum(past, past_event(arrays, before, floor)[fired]), past)
        if jumped is not None:
            past = np.where(jumped[fired], 0.0, past)
        band[fired] += past
        if bands is None or np.isnan(bands[fired]).any():
            lean[fired] = _heading(system, arrays, g, floor)[fired]
    if bands is not None:
        one_sided = ~np.isnan(bands)
        lean[one_sided] = 1.0
        sunk = np.maximum(0.0, -g)
        if fired is not None:
            sunk[fired] *= 2.0  # what sinks although its rates rise fires a few times, not for ever
        band[one_sided] = np.maximum(floor, bands)[one_sided] + sunk[one_sided]
    band[arrays.jumps] = np.maximum(band[arrays.jumps], _nothing(system, arrays))
    arrays.event_block(at.FLOOR)[:], arrays.event_block(at.BAND)[:] = floor, band
    side[:] = np.where(np.abs(g) > band, np.sign(g), at.LEANING * lean)


def _nothing(system: System, arrays: LoopArrays) -> float:
    """Return what of the argument of a choice is as good as zero: a rate that sticks has no round-off of its own."""
    return plain_events.NOTHING * float(np.abs(arrays.y[: system.nq + system.nv]).max(initial=0.0))


def renew_bands(system: System, arrays: LoopArrays, fired: np.ndarray, jumped: np.ndarray) -> None:
    """Find anew what of the event functions is as good as zero, after events that changed nothing.

    Those that have `jumped` over zero are on the side that they jumped to.
    """
    g, floor = event_values_and_floor(system, arrays, behind_a_jump=jumped.any())
    past = np.where(jumped, 0.0, past_event(arrays, g, floor))
    band = floor.copy()
    band[fired] += past[fired]
    band[arrays.jumps] = np.maximum(band[arrays.jumps], _nothing(system, arrays))
    kept = np.isinf(arrays.event_block(at.BAND))
    arrays.event_block(at.FLOOR)[:], arrays.event_block(at.BAND)[:] = floor, np.where(kept, np.inf, band)
    arrays.event_block(at.SIDE)[jumped] = np.sign(g[jumped])


def has_jumped(system: System, arrays: LoopArrays, fired: np.ndarray) -> np.ndarray:
    """Return of each event whether it is one of those that fired, and its function jumped over zero: `mod(x, 1) - 0.5`.

    What is smooth changes in the last digits behind an event about as much as in those before it. A function that has
    jumped is past zero for good: what it is at is no round-off, and it may come back at once.
    """
    n, relative = system.nq + system.nv, _round_off(system)
    kernel, t, p, y = system.kernel("events"), arrays.t, arrays.p, arrays.y[:n]
    dt = relative * abs(t)
    with np.errstate(over="ignore", invalid="ignore"):
        slope = system.kernel("rhs")(t, y, p)[:n]
        along = dt * slope + relative * np.abs(y) * np.sign(slope)
        before, here, behind = kernel.rows(
            np.array([t - dt, t, t + dt]), np.stack([y - along, y, y + along]), p
        )
        least = np.abs(behind - here) + np.finfo(float).eps * np.abs(here)
        jumped = (before * here < 0.0) & (np.abs(here - before) > plain_events.JUMPED * least)
    return jumped & np.isin(np.arange(len(here)), fired)


def past_event(arrays: LoopArrays, g: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Return by how much event functions that have just fired are past zero, which is as good as zero still.

    One that has jumped there, with an input or with time, is past zero for good: its crossing lies at the very
    beginning of a step, and what it is at is no round-off.
    """
    past = np.abs(g)
    return np.where(past > _CLEAR * floor, 0.0, past) if _begins_a_step(arrays) else past


def _begins_a_step(arrays: LoopArrays) -> bool:
    """Whether what was found last lies where a step began, but for round-off of time."""
    return bool(arrays.h_last <= _BEGINNING * abs(arrays.t))


def _heading(system: System, arrays: LoopArrays, g: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Return the sign of the rates of event functions by the motion of the coordinates; 0 where it is not clear."""
    nq, n = system.nq, system.nq + system.nv
    q, v, t = arrays.y[:nq], arrays.y[nq:n], arrays.t
    positions = Positions(system)
    fastest = (np.abs(v) / np.maximum(1.0, positions.per_rate(np.abs(q), 1.0))).max(initial=0.0)
    if not np.isfinite(fastest) or fastest == 0.0:
        return np.zeros(len(g))
    dt = _AHEAD / fastest
    y = np.concatenate([positions.retract(q, dt * v), v])
    rise = system.kernel("events")(t + dt, y, arrays.p) - g
    return np.where(np.abs(rise) > _CLEAR * floor, np.sign(rise), 0.0)


def _round_off(system: System) -> float:
    """Return what of numbers in a state is round-off, relative."""
    return _PERTURBATION * (_PROJECTION_NOISE if system.m or system.quaternions else 1.0)


def event_values_and_floor(
    system: System, arrays: LoopArrays, behind_a_jump: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return the event functions, and what of them is round-off: their change when all they read moves a little.

    Behind a jump it is the smaller of the changes there and back: the jump itself is no round-off.
    """
    g, floor = _changes(system, arrays, 1.0)
    if behind_a_jump:
        floor = np.minimum(floor, _changes(system, arrays, -1.0)[1])
    floor = floor.sum(axis=0)
    return g, np.where(np.isfinite(floor), floor, 0.0)


def _changes(system: System, arrays: LoopArrays, way: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the event functions, and how far each of n + 2 small moves, up (1) or down (-1), changes them."""
    kernel, t, p = system.kernel("events"), arrays.t, arrays.p
    y = arrays.y[: system.nq + system.nv].copy()
    relative = _round_off(system)
    dt, n = way * relative * abs(t), len(y)
    # As it is; a little later; with each number a little larger; and as far as it goes within the last digits of time.
    times, states = np.full(n + 3, t), np.empty((n + 3, n))
    states[:] = y
    times[[1, -1]] = t + dt
    states[2:-1].flat[:: n + 1] = y + way * relative * np.abs(y)
    with np.errstate(over="ignore", invalid="ignore"):  # where something is not finite, the run says so
        states[-1] = y + dt * system.kernel("rhs")(t, y, p)[:n]
        g, *moved = kernel.rows(times, states, p)
        return g, np.abs(np.array(moved) - g)


@record
class EventRecord:
    """One event that fired.

    Attributes
    ----------
    name, action : str
        The action of a stop is impact or release, that of friction stick, slip or turn.
    t : float [s]
    q_before, v_before, q_after, v_after : ndarray
    energy_change : float [J]
        T + V after less before.
    work : float [J]
        Done on the system before it, as integrated beside the motion, with that of earlier resets; NaN where stops and
        frictions have no part in it.
    """

    name: str
    action: str
    t: float
    q_before: np.ndarray
    v_before: np.ndarray
    q_after: np.ndarray
    v_after: np.ndarray
    energy_change: float = 0.0
    work: float = math.nan


def tell(recorder: Any, event: EventRecord) -> None:
    """Tell a recorder of an event; with its states, where the work about it is integrated once more."""
    if math.isfinite(event.work) and hasattr(recorder, "next_event"):
        recorder.next_event(event)
    recorder.event(event.name, event.t, energy_change=event.energy_change)


_MOST_MADE = 10_000  # events up to which records that somebody has looked at are kept


class EventLog(Sequence):
    """The events of a run; rows that machine code has written become records when somebody looks at them.

    A record takes ten times the memory of its row: in a long log, it is made anew for each look.
    """

    def __init__(self, events: Iterable[EventRecord] = ()):
        self._parts: list[list[EventRecord] | _Rows] = [list(events)]
        self._begins = [0]  # of the parts
        self._n = len(self._parts[0])

    def append(self, event: EventRecord) -> None:
        """Add an event."""
        self.extend([event])

    def extend(self, events: Iterable[EventRecord]) -> None:
        """Add events."""
        if not isinstance(self._parts[-1], list):
            self._begin([])
        before = len(self._parts[-1])
        self._parts[-1].extend(events)
        self._n += len(self._parts[-1]) - before

    def extend_by_rows(self, system: System, rows: np.ndarray) -> None:
        """Add events as `integrate/plain_events.py` and `plain_frictions.py` log them; rows must stay as they are."""
        self._begin(_Rows(system, rows, keeps=self._n < _MOST_MADE))
        self._n += len(rows)

    def _begin(self, part: list[EventRecord] | _Rows) -> None:
        self._parts.append(part)
        self._begins.append(self._n)

    @property
    def times(self) -> np.ndarray:
        """When they were, shape (n,) [s]; no record is made for that."""
        parts = [getattr(part, "times", None) for part in self._parts]
        parts = [[e.t for e in own] if t is None else t for own, t in zip(self._parts, parts)]
        return np.concatenate([np.zeros(0), *parts])

    def __len__(self) -> int:
        return self._n

    def __iter__(self) -> Iterator[EventRecord]:
        return itertools.chain.from_iterable(self._parts)

    def __getitem__(self, which: int | slice) -> EventRecord | list[EventRecord]:
        if isinstance(which, slice):
            return [self[k] for k in range(*which.indices(self._n))]
        k = which + self._n if which < 0 else which
        if not 0 <= k < self._n:
            raise IndexError(f"event {which} of {self._n}")
        part = bisect.bisect_right(self._begins, k) - 1
        return self._parts[part][k - self._begins[part]]

    def latest(self, n: int) -> list[EventRecord]:
        """Return the last `n` events; records that are made for that are not kept."""
        found: list[EventRecord] = []
        for part in reversed(self._parts):
            if len(found) == n:
                break
            of_part = part[-(n - len(found)) :] if isinstance(part, list) else part.latest(n - len(found))
            found = [*of_part, *found]
        return found

    def __eq__(self, other: object) -> bool:
        return list(self) == list(other) if isinstance(other, (EventLog, list, tuple)) else NotImplemented

    __hash__ = None

    def __repr__(self) -> str:
        return f"<EventLog of {self._n} events>" if self._n > 20 else repr(list(self))


def event_times(events: Sequence[EventRecord]) -> np.ndarray:
    """Return when events were [s]."""
    return (
        events.times if isinstance(events, EventLog) else np.array([event.t for event in events], dtype=float)
    )


class _Rows(Sequence):
    """Logged rows as records, which are made once where it `keeps` them."""

    def __init__(self, system: System, rows: np.ndarray, *, keeps: bool):
        self._n_own = n_own = len(system.events) - len(system.switches)
        self._kinds = [
            (event["name"], event["action"] if k < n_own else "impact")
            for k, event in enumerate(system.events)
        ]
        self._nq, self._n, self._rows = system.nq, system.nq + system.nv, rows
        self._made: dict[int, EventRecord] | None = {} if keeps else None

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def times(self) -> np.ndarray:
        return self._rows[:, plain_events.TIME]

    def __getitem__(self, k: int) -> EventRecord:
        if not 0 <= k < len(self._rows):
            raise IndexError(k)
        if self._made is None:
            return self._record(k)
        if k not in self._made:
            self._made[k] = self._record(k)
        return self._made[k]

    def latest(self, n: int) -> list[EventRecord]:
        """Return the last `n` records at most, which are not kept."""
        return [self._record(k) for k in range(max(len(self._rows) - n, 0), len(self._rows))]

    def _record(self, k: int) -> EventRecord:
        row, nq, n = self._rows[k], self._nq, self._n
        event = int(row[plain_events.EVENT])
        name, action = self._kinds[event]
        before = row[plain_events.FIRST_STATE : plain_events.FIRST_STATE + n]
        after = row[plain_events.FIRST_STATE + n : plain_events.FIRST_STATE + 2 * n]
        behind = row[plain_events.FIRST_STATE + 2 * n :].tolist()
        work = behind[0] if behind else math.nan  # members of ensembles have none
        if len(behind) > 1 and event >= self._n_own:
            action = _OF_FRICTIONS[int(behind[1])]
        return EventRecord(
            name, action, float(row[plain_events.TIME]), before[:nq], before[nq:], after[:nq], after[nq:],
            float(row[plain_events.CHANGE]), work,
        )  # fmt: skip


def end_message(system: System, name: str, t: float) -> str:
    """Return what is said of a run that an event ended, with its reason where the event has one."""
    says = next((event.get("says", "") for event in system.events if event["name"] == name), "")
    return f"Event {name!r} ended the run at t = {t:.9g} s" + (f": {says}." if says else ".")


class EventActions:
    """Acts on the events of one run and keeps their log.

    Attributes
    ----------
    log : EventLog
    energy_of_resets : float [J]
        T + V that resets have added so far.
    zeno : ZenoDetector
    lowest_gaps : ndarray, shape (number of stops,)
        The least gap of each stop at the ends of steps, while it was open.
    """

    def __init__(self, system: System, arrays: LoopArrays):
        self.system, self.arrays = system, arrays
        self.log = EventLog()
        self.n_jumps = 0
        self.n_untold = 0  # times that stops and frictions were decided on, with nothing that is told
        self.energy_of_resets = 0.0
        self.zeno = ZenoDetector()
        self.switching: Switching | None = None
        self._may_jump = arrays.n_events > 0 and system.events_may_jump
        n_stops = [switch["kind"] for switch in system.switches].count("stop")
        self.lowest_gaps = np.full(n_stops, np.inf) if n_stops else np.zeros(0)
        if system.switches and arrays.n_events:
            self.switching = switching.Switching(system, arrays)

    def act(self) -> tuple[list[EventRecord], bool, float | None]:
        """Act on all events of the current instant, in the order of the model file.

        Returns
        -------
        records : list of EventRecord
        terminate : bool
            Whether one of them ends the run.
        accumulation : float or None [s]
            Where events pile up, if they do.
        """
        system, arrays = self.system, self.arrays
        self.note_gaps()
        fired = np.flatnonzero(arrays.event_block(at.FIRED) == 1.0)
        if arrays.jumps:
            jumped = np.isin(fired, arrays.jumps)
            self._change_branches(fired[jumped])
            fired = fired[~jumped]
            if not len(fired):
                arrays.restart(state_changed=False)
                return [], False, None
        n_own = len(system.events) - len(system.switches)
        values = self.form.kernel("events")(arrays.t, arrays.y[: system.nq + system.nv], arrays.p)
        jumped = np.zeros(len(values), dtype=bool)
        if self._may_jump:
            jumped = has_jumped(self.form, arrays, fired[fired < n_own])
        resolved = not self._against_direction(fired[fired < n_own])
        records, terminate, reset = [], False, False
        for index in fired[fired < n_own]:
            event = system.events[index]
            records.append(self._act_on(event))
            terminate = terminate or event["action"] == "terminate"
            reset = reset or event["action"] == "reset"
        switched = fired[fired >= n_own] - n_own
        if self.switching is not None and (len(switched) or reset):
            before = self.switching.phases
            actions = self._switch(switched, is_reset=reset)
            records, self.n_untold = records + actions, self.n_untold + (not actions)
            # The event of what was closed or let go is another function now, and not at its zero.
            same = (before == self.switching.phases).all(axis=1)
            fired = fired[(fired < n_own) | same[np.maximum(fired - n_own, 0)]]
        self.log.extend(records)
        arrays.restart(state_changed=reset or len(switched) > 0)
        if reset or len(switched):
            self._arm(fired, values, jumped)
        else:
            renew_bands(self.form, arrays, fired, jumped)
        accumulation = self.zeno.look(arrays.t, resolved and self._gets_away(fired)) if reset else None
        return records, terminate, accumulation

    @property
    def form(self) -> System:
        """The model in the form that applies now: with its stops and frictions as constraints where one is held."""
        return self.system.closed if self.is_held else self.system

    @property
    def is_held(self) -> bool:
        """Whether a stop is closed or a friction sticks."""
        return self.switching is not None and self.switching.any_held

    def note_gaps(self) -> None:
        """Take note of how low gaps have been since the last time, in the form that applied up to here."""
        if self.switching is None:
            return
        n_own, n = len(self.system.events) - len(self.system.switches), len(self.lowest_gaps)
        lowest = self.arrays.event_block(at.LOWEST)
        open_ones = np.where(self.switching.closed, np.inf, lowest[n_own : n_own + n])
        self.lowest_gaps = np.minimum(self.lowest_gaps, open_ones)
        lowest[:] = np.inf

    def passed_by(self) -> list[tuple[str, int, float]]:
        """Return the names of events that steps passed by, as looks at random places tell: how often, when last [s]."""
        arrays = self.arrays
        if not arrays.n_events:
            return []
        counts, times = arrays.event_block(at.PASSED), arrays.event_block(at.T_PASSED)
        return [
            (self.system.events[e]["name"], int(counts[e]), float(times[e])) for e in np.flatnonzero(counts)
        ]

    def begin(self) -> None:
        """Find which stops are closed at the start, and arm the events."""
        if self.switching is not None:
            before = self.energy()
            self.switching.start()
            self._check_forces()
            self.energy_of_resets += self.energy() - before
        if self.arrays.n_events:
            self._refuse_start_outside()
            self._arm()

    def _refuse_start_outside(self) -> None:
        """Refuse a start where a table has no values, or where a force and what it follows have no solution."""
        ends = [k for k, e in enumerate(self.system.events) if e["action"] == "terminate" and e.get("says")]
        if not ends:
            return
        values, floor = event_values_and_floor(self.form, self.arrays)
        for k in ends:
            if values[k] < -floor[k]:
                says = self.system.events[k]["says"]
                remedy = "let the force follow a state that measures with a time constant"
                if " leaves the table " in says:
                    remedy = "begin inside, or let the table hold or extend its values outside"
                elif self.system.events[k]["name"].rstrip("0123456789").endswith("_edges"):
                    remedy = "begin with them apart"
                raise RuntimeModelError(f"model {self.system.name!r} starts where {says}: {remedy}")

    def _arm(
        self,
        fired: np.ndarray | None = None,
        before: np.ndarray | None = None,
        jumped: np.ndarray | None = None,
    ) -> None:
        """Arm the events; those of frictions that others hold stay out of it."""
        if self.switching is None:
            arm_events(self.form, self.arrays, fired, before=before, jumped=jumped)
            self.choose_branches()
            return
        resting = self.switching.resting
        own = np.full(len(self.system.events) - len(self.system.switches), np.nan)
        bands = np.concatenate([own, self.switching.bands()])
        arm_events(self.form, self.arrays, fired, before=before, bands=bands, jumped=jumped)
        self.switching.resting = resting
        self.choose_branches()

    def _rises(self, branches: np.ndarray) -> np.ndarray:
        """Return by how much the arguments of jumps rise in a short time on given branches, shape (n_events,)."""
        form, arrays, n = self.form, self.arrays, self.system.nq + self.system.nv
        p, y = arrays.with_branches(branches), arrays.y[:n].copy()
        slope = form.kernel("rhs")(arrays.t, y, p)[:n]
        sizes = np.maximum(np.abs(y), np.clip(np.abs(y).max(), 1e-3, 1.0))
        fastest = (np.abs(slope) / sizes).max()
        dt = _AHEAD / fastest if 0.0 < fastest < np.inf else _AHEAD
        ahead = y + dt * slope
        if form.nq == form.nv:  # from rest, accelerations tell
            ahead[: form.nq] += 0.5 * dt * dt * slope[form.nq :]
        events = form.kernel("events")
        return events(arrays.t + dt, ahead, arrays.p) - events(arrays.t, y, arrays.p)

    def choose_branches(self) -> None:
        """Choose the branch of each force whose argument is at zero: the one that the motion leads to."""
        arrays = self.arrays
        if not arrays.jumps:
            return
        side = arrays.event_block(at.SIDE)
        undecided = np.array([k for k in arrays.jumps if side[k] == 0.0], dtype=int)
        if len(undecided):
            rises = self._rises(np.sign(side[arrays.jumps]))
            floor = _CLEAR * arrays.event_block(at.FLOOR)
            side[undecided] = np.where(np.abs(rises) > floor, at.LEANING * np.sign(rises), 0.0)[undecided]
            decided = undecided[side[undecided] != 0.0]
            self._refuse_sliding(decided, decided)
        arrays.take_branches()

    def _change_branches(self, which: np.ndarray) -> None:
        """Let forces go over to the other side of their jumps."""
        arrays = self.arrays
        before = arrays.precomputed[arrays.branches].copy()
        chosen = np.isin(arrays.jumps, which)
        # On the branches that hold: a place at which one of them begins may be a hair before it.
        held, n = arrays.with_branches(before), self.system.nq + self.system.nv
        values = self.form.kernel("events")(arrays.t, arrays.y[:n], held)
        floor = arrays.event_block(at.FLOOR)[which]
        after = np.where(chosen, np.where(before != 0.0, -before, np.sign(values[arrays.jumps])), before)
        past, begins = np.abs(values[which]), _begins_a_step(arrays)
        # One that is farther past zero than it comes in a short time has jumped with a choice that it is made of.
        far = past > _JUMPED * floor
        if far.any():
            # Nothing is known of the round-off of what was zero as long as nothing touched: a rise may be made of it.
            size = np.finfo(float).eps * np.abs(arrays.y[:n]).max(initial=0.0)
            is_known = (floor > 0.0) | (past > _JUMPED * size)
            part = np.where(is_known, _PART_OF_RISE, 1.0)
            far &= past > part * np.abs(self._rises(after)[which])
        past[far | (begins & (past > _CLEAR * floor))] = 0.0
        # What jumped exactly to zero is on neither side yet; what its own motion brought there goes on.
        jumped = far | (begins & (past == 0.0))
        arrays.event_block(at.SIDE)[which] = np.where(
            jumped, np.sign(values[which]), at.LEANING * after[chosen]
        )
        arrays.event_block(at.BAND)[which] = np.maximum(floor + past, _nothing(self.system, arrays))
        self._leave_what_stays()
        arrays.take_branches()
        self.n_jumps += len(which)
        self._refuse_sliding(which, which[~far & (arrays.event_block(at.SIDE)[which] != 0.0)])

    def begin_a_piece(self) -> bool:
        """Go on where an input or a force turns with time: choices that have come to zero may stay there.

        Returns
        -------
        bool
            Whether forces are on other branches now.
        """
        arrays = self.arrays
        if not arrays.jumps:
            return False
        side, at_zero = arrays.event_block(at.SIDE), self._jumps_at_zero()
        if not at_zero and all(side[k] for k in arrays.jumps):
            return False
        before = arrays.precomputed[arrays.branches].copy()
        side[at_zero] = 0.0
        self.choose_branches()
        return not np.array_equal(before, arrays.precomputed[arrays.branches])

    def _leave_what_stays(self) -> None:
        """Take off its side what is at zero and stays there, as what a choice holds there does.

        What a force makes of zero is not what it makes of either side (`sign(u)`, `u > 0` beside `u >= 0`).
        """
        side = self.arrays.event_block(at.SIDE)
        at_zero = self._jumps_at_zero()
        if at_zero:
            rises = self._rises(np.sign(side[self.arrays.jumps]))
            side[[k for k in at_zero if rises[k] == 0.0]] = 0.0

    def _jumps_at_zero(self) -> list[int]:
        """Return which jumps are at zero to the last bit."""
        arrays, n = self.arrays, self.system.nq + self.system.nv
        values = self.form.kernel("events")(arrays.t, arrays.y[:n], arrays.p)
        return [k for k in arrays.jumps if values[k] == 0.0]

    def _refuse_sliding(self, which: np.ndarray, at_zero: np.ndarray) -> None:
        """Refuse to go on along a jump to which the force pushes from both sides.

        Parameters
        ----------
        which : ndarray of int
            Jumps of this instant: choices that others are made of go over together with these.
        at_zero : ndarray of int
            Those whose argument is at zero; others have jumped past it, with what they are made of.

        Raises
        ------
        SlidingError
        """
        arrays = self.arrays
        now = np.sign(arrays.event_block(at.SIDE)[arrays.jumps])
        for event in at_zero:
            other = np.where(np.isin(arrays.jumps, which), -now, now)
            here, there = self._rises(now)[event], self._rises(other)[event]
            side = np.sign(arrays.event_block(at.SIDE)[event])
            clear = max(_CLEAR * arrays.event_block(at.FLOOR)[event], _BACK * abs(there))
            if side * here < -clear and side * there > clear:
                name = self.system.events[event]["says"]
                raise SlidingError(
                    f"{name} pushes to where it jumps from both sides at t = {arrays.t:.9g} s: the motion would "
                    "chatter there without end. Where this is friction that brings the motion to rest, write it as dry "
                    "friction, [friction], which sticks; else make the jump steep and smooth, such as tanh(u/width)."
                )

    def settle_jump(self) -> list[EventRecord]:
        """Settle stops and frictions where forces have jumped with an input; returns what changed or was struck."""
        if self.is_untouched():
            return []
        self.note_gaps()
        before = self.switching.settings
        records = self._switch(np.zeros(0, dtype=int))
        self.log.extend(records)
        if records or (self.switching.settings != before).any():
            self._arm()
        return records

    def is_untouched(self) -> bool:
        """Whether jumps of forces change nothing of what stops and frictions do: to find out in full takes longest."""
        self.switching.forget()
        arrays, kernel, values = self.arrays, self.form.kernel("events"), np.zeros(len(self.system.events))
        # With the pieces of inputs that are in use: `p` alone would let all of them be laid out anew.
        call_kernel(np.uint64(kernel.precomputed_address), arrays.t, arrays.y, arrays.precomputed, values)
        return self.switching.is_untouched(values[len(values) - len(self.system.switches) :])

    def _switch(self, switched: np.ndarray, *, is_reset: bool = False) -> list[EventRecord]:
        """Settle stops and frictions; the energy of the instant is noted with the first of them."""
        arrays, nq, n = self.arrays, self.system.nq, self.system.nq + self.system.nv
        before, energy = arrays.y[:n].copy(), self.energy()
        work = arrays.y[n] + self.energy_of_resets if self.system.nw else math.nan
        actions = self.switching.act(switched, is_reset=is_reset)
        after, change = arrays.y[:n].copy(), self.energy() - energy
        self.energy_of_resets += change
        self._check_forces()
        return [
            EventRecord(
                self.switching.names[index], action, arrays.t, before[:nq], before[nq:], after[:nq], after[nq:],
                change if k == 0 else 0.0, float(work),
            )
            for k, (index, action) in enumerate(actions)
        ]  # fmt: skip

    def _check_forces(self) -> None:
        """Refuse to go on where the forces of what is held are not unique: it could not be seen to let go."""
        arrays, n = self.arrays, self.system.nq + self.system.nv
        self.switching.write()
        if (
            self.form is self.system
            or np.isfinite(self.form.kernel("events")(arrays.t, arrays.y[:n], arrays.p)).all()
        ):
            return
        held = ", ".join(repr(name) for name in self.switching.held_names)
        raise ResetError(
            f"{held} cannot be held at t = {arrays.t:.9g} s: constraints of the model depend on each other there, and "
            "forces of stops are not unique; leave out the constraints that follow from others."
        )

    def _against_direction(self, fired: np.ndarray) -> bool:
        """Whether an event that fired moves against the direction it waits for: its flight was below the tolerance."""
        form, arrays, dt = self.form, self.arrays, _PART_OF_FLIGHT * self.zeno.since_last(self.arrays.t)
        if dt == 0.0 or not fired.size:
            return False
        y = arrays.y[: form.nq + form.nv].copy()
        slope = form.kernel("rhs")(arrays.t, y, arrays.p)[: len(y)]
        before, after = (
            form.kernel("events")(arrays.t + shift, y + shift * slope, arrays.p) for shift in (-dt, dt)
        )
        directions = np.array([DIRECTIONS[self.system.events[index]["direction"]] for index in fired])
        return bool(np.any(directions * (after - before)[fired] < 0.0))

    def _gets_away(self, fired: np.ndarray) -> bool:
        """Whether the events that fired leave zero by more than round-off before they would fire again."""
        system, arrays, half = self.system, self.arrays, 0.5 * self.zeno.next_interval(self.arrays.t)
        if half == 0.0:
            return True
        y = arrays.y[: system.nq + system.nv].copy()
        slope = system.kernel("rhs")(arrays.t, y, arrays.p)[: len(y)]
        ahead = system.kernel("events")(arrays.t + half, y + half * slope, arrays.p)
        floor = _CLEAR * arrays.event_block(at.FLOOR)
        return bool(np.any(np.abs(ahead)[fired] > floor[fired]))

    def _act_on(self, event: dict) -> EventRecord:
        system, arrays = self.system, self.arrays
        before = arrays.y[: system.nq + system.nv].copy()
        change = 0.0
        if event["action"] == "reset":
            energy_before = self.energy()
            after = system.kernel(reset_function(event["name"]))(arrays.t, before, arrays.p)
            arrays.y[: system.nq + system.nv] = after
            self._make_consistent(event["name"], before[system.nq :], after[system.nq :])
            change = self.energy() - energy_before
            self.energy_of_resets += change
        after = arrays.y[: system.nq + system.nv].copy()
        q, nq = slice(None, system.nq), system.nq
        return EventRecord(
            event["name"], event["action"], arrays.t, before[q], before[nq:], after[q], after[nq:], change
        )

    def _make_consistent(self, name: str, before: np.ndarray, after: np.ndarray) -> None:
        """Bring the state back onto the constraints; rates that the reset changed stay, where that is possible."""
        system, arrays = self.system, self.arrays
        if not (system.m or system.quaternions):
            return
        status = arrays.project()
        if status != at.RUNNING:
            raise ResetError(
                f"The reset of event {name!r} at t = {arrays.t:.9g} s leaves a state from which the constraints cannot "
                "be met: reset the coordinates to a position that the mechanism can have."
            )
        given = after != before
        if system.m and given.any():
            q = arrays.y[: system.nq].copy()
            rates = after_reset.rates_after_reset(system, arrays.p, arrays.t, q, after, given)
            if rates is not None:
                arrays.y[system.nq : system.nq + system.nv] = rates

    def energy(self) -> float:
        """T + V at the present state [J]."""
        system, arrays = self.system, self.arrays
        return float(system.kernel("energy")(arrays.t, arrays.y[: system.nq + system.nv], arrays.p).sum())


class ResetError(Exception):
    """A reset led to a state that the constraints do not allow."""


class SlidingError(ResetError):
    """A force pushes to where it jumps from both sides."""


class ZenoDetector:
    """Notices intervals between resets that shrink to nothing; `integrate/plain_events.py` does the same."""

    def __init__(self):
        self._last: float | None = None
        self._intervals: list[float] = []

    @property
    def memory(self) -> list[float | None]:
        """What it has seen, as JSON can say it; set it to go on from there."""
        return [self._last, *self._intervals]

    @memory.setter
    def memory(self, values: list[float | None]) -> None:
        self._last, *self._intervals = values

    def since_last(self, t: float) -> float:
        """Return the time [s] since the last reset; 0 before the first."""
        return t - self._last if self._last is not None else 0.0

    def next_interval(self, t: float) -> float:
        """Return how long [s] after a reset at `t` the next is to be expected; 0 where intervals do not shrink."""
        if self._last is None or not self._intervals:
            return 0.0
        interval, before = t - self._last, self._intervals[-1]
        return interval * interval / before if 0.0 < interval < before else 0.0

    def look(self, t: float, gets_away: bool = True) -> float | None:
        """Take the time of a reset [s]; returns where resets pile up once they do.

        `gets_away` says whether the event functions will leave zero by more than round-off: a bounce that is
        lower is not seen to fall again.
        """
        if self._last is None:
            self._last = t
            return None
        interval, self._last, intervals = t - self._last, t, self._intervals
        # A mechanism with two stops knocks in pairs: what counts is that intervals do not become long again.
        while intervals and intervals[-1] < interval:
            intervals.pop()
        if len(intervals) == plain_events.MOST_INTERVALS:
            del intervals[plain_events.MOST_INTERVALS // 2]  # the first and the last ones tell
        intervals.append(interval)
        if len(intervals) < plain_events.ZENO_EVENTS:
            return None
        if gets_away and interval > max(
            plain_events.ZENO_SHRINKAGE * intervals[0], 64.0 * np.finfo(float).eps * abs(t)
        ):
            return None
        before = intervals[-2]
        ratio = interval / before if before > 0.0 else 0.0
        return t + interval * ratio / (1.0 - ratio) if ratio < 1.0 else t
