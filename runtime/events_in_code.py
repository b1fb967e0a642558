"""Events of a run that machine code acts on: its arrays, and what Python's records take over from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.code.call_block import CallBlock, call_block
from symgen.runtime.graph.spelling import reset_function
from symgen.runtime.integrate import plain_events as here
from symgen.runtime.loop_arrays import DIRECTIONS

if TYPE_CHECKING:
    from symgen.runtime.event_actions import EventActions
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

_ROWS = 4096  # of the log
_LARGEST = 200  # rates: mass matrices are factored in full
_OF_CLOSED = (
    (here.JACOBIAN, "constraint_jacobian"), (here.RESIDUAL, "constraint_residual"), (here.GAMMA, "gamma")
)  # fmt: skip
ACTIONS = {"record": here.RECORDS, "reset": here.RESETS, "terminate": here.TERMINATES}


def has_plain_events(system: System, *, beside_jumps: bool = False) -> bool:
    """Whether machine code can act on events of a model: no constraints, quaternions, frictions, jumps of forces.

    Inputs may follow time: gaps read none.

    Parameters
    ----------
    beside_jumps : bool
        Whether there are events but jumps of forces, which are acted on elsewhere.
    """
    if beside_jumps != bool(system.jumps):
        return False
    return (
        len(system.events) > len(system.jumps)
        and not system.m
        and system.nq == system.nv <= _LARGEST
        and all(switch["kind"] == "stop" for switch in system.switches)
    )


def has_impacts_beside_constraints(system: System) -> bool:
    """Whether machine code can act on impacts of a model with constraints: no quaternions, frictions, jumps."""
    return (
        bool(system.m and system.switches)
        and not system.jumps
        and system.nq == system.nv
        and system.nv + system.m <= _LARGEST
        and all(switch["kind"] == "stop" for switch in system.switches)
    )


def has_own_events_on_constraints(system: System) -> bool:
    """Whether machine code can act on events of a model with constraints or quaternions that has own ones alone.

    It acts on those that record, and on those that reset where `_resets`.
    """
    acts_on = {"record", "reset"} if _resets(system) else {"record"}
    return (
        bool(system.events)
        and bool(system.m or system.quaternions)
        and not (system.jumps or system.switches)
        and any(event["action"] in acts_on for event in system.events)
    )


def _resets(system: System) -> bool:
    """Whether machine code can act on resets: no quaternions, and matrices that are factored in full."""
    return not system.quaternions and system.nq == system.nv and system.nv + system.m <= _LARGEST


def make_after(
    system: System, method: Method, arrays: LoopArrays, block: CallBlock
) -> tuple[here.After, object]:
    """Return the arrays of `plain_events`, and what keeps their code alive.

    Parameters
    ----------
    block : CallBlock
        The call of the step loop.
    """
    n_stops = len(system.switches)
    own = system.events[: len(system.events) - n_stops]
    is_free = not (system.m or system.quaternions)
    actions = ACTIONS if _resets(system) else ACTIONS | {"reset": here.BY_PYTHON}
    kinds = [actions.get(event["action"], here.BY_PYTHON) for event in own]
    resets = [reset_function(event["name"]) if kind == here.RESETS else "" for event, kind in zip(own, kinds)]
    addresses = np.zeros(here.FIRST_RESET + len(own), dtype=np.uint64)
    addresses[here.ADVANCE] = block.address
    named = {here.EVENTS: "events", here.RHS: "rhs", here.ENERGY: "energy"}
    named |= {here.FIRST_RESET + k: name for k, name in enumerate(resets) if name}
    named = named if own or n_stops else {}
    if n_stops:
        named |= {here.MASS: "mass_matrix", here.FORCES: "forces", here.SWITCHES: "switches"}
    if system.m and here.RESETS in kinds:
        named |= {here.MASS: "mass_matrix"}
        named |= {here.OWN_JACOBIAN: "constraint_jacobian", here.OWN_RESIDUAL: "constraint_residual"}
    kernels = [system.kernel(name) for name in named.values()]
    for place, kernel in zip(named, kernels):
        addresses[place] = kernel.precomputed_address
    everything, n_rows, n_residual = np.zeros(0), 0, 0
    switches_at, gaps, constraints = (np.zeros(0, dtype=np.int64) for _ in range(3))
    if n_stops:
        closed = system.closed
        for place, name in _OF_CLOSED:
            kernels.append(closed.kernel(name))
            addresses[place] = kernels[-1].address
        switches_at = np.array(list(closed.switched.values()), dtype=np.int64)
        gaps = np.array(list(closed.switched), dtype=np.int64)
        constraints = np.setdiff1d(np.arange(closed.m), gaps)
        everything, n_rows, n_residual = arrays.p.copy(), closed.m, closed.nh + closed.m
        everything[switches_at] = 1.0
    n, nv, ne = system.nq + system.nv, system.nv, len(system.events)
    m = system.m if system.m + nv <= _LARGEST else 0  # others are for Python
    names = [switch["name"] for switch in system.switches]
    one_by_one = system.sequential_impacts or len(set(names)) < n_stops
    noise = here.ROUND_OFF * (1.0 if is_free else here.ON_CONSTRAINTS)
    after = here.After(
        addresses=addresses, block=block.block, result=np.zeros(1),
        actions=np.array(kinds, dtype=np.int64),
        directions=np.array([DIRECTIONS[event["direction"]] for event in own], dtype=np.int64), everything=everything,
        switches_at=switches_at, gaps=gaps, constraints=constraints,
        sums=np.array([0.0, np.nan, 0.0, noise]), intervals=np.zeros(here.MOST_INTERVALS),
        counts=np.array([0, 0, method.adaptive, system.events_may_jump, one_by_one], dtype=np.int64),
        lowest=np.full(n_stops, np.inf),
        log=np.zeros((_ROWS if ne else 0, here.FIRST_STATE + 2 * n + 1)),
        first=np.zeros(n), before=np.zeros(n), slope=np.zeros(n), moved=np.zeros(n), row=np.zeros(system.n_row),
        values=np.zeros(ne), g=np.zeros(ne), floor=np.zeros(ne), other=np.zeros(ne),
        energy=np.zeros(2), switches=np.zeros(2 * n_stops), jacobian=np.zeros(n_rows * nv),
        residual=np.zeros(n_residual), gamma=np.zeros(n_rows), mass=np.zeros(nv * nv), forces=np.zeros(nv),
        struck=np.zeros(here.MOST_STRUCK, dtype=np.int64), response=np.zeros((here.MOST_STRUCK, nv)),
        compliance=np.zeros((here.MOST_STRUCK, here.MOST_STRUCK)), impulses=np.zeros(here.MOST_STRUCK),
        reached=np.zeros(nv), held=np.zeros(m * nv), gram=np.zeros(m * m), multipliers=np.zeros(m),
        own_jacobian=np.zeros(m * nv), own_residual=np.zeros(system.nh + m),
        projected=np.zeros(n + system.nh + m), places=np.zeros(nv, dtype=np.int64),
    )  # fmt: skip
    return after, kernels


Known = tuple[float, np.ndarray, list[float | None]]


def what_is_known(actions: EventActions) -> Known:
    """Return what resets have added to T + V [J], the least gaps, and what is remembered of when resets were."""
    return actions.energy_of_resets, actions.lowest_gaps, actions.zeno.memory


def is_same(known: Known, before: Known | None) -> bool:
    """Whether nothing of that has changed: sums and gaps are replaced where they change."""
    return before is not None and known[0] is before[0] and known[1] is before[1] and known[2] == before[2]


def hand_over_resets(actions: EventActions, after: Any) -> None:
    """Let machine code know what resets have added to T + V, and when they were."""
    last, *intervals = actions.zeno.memory
    after.sums[: here.NOISE] = actions.energy_of_resets, np.nan if last is None else last, np.nan
    after.intervals[: len(intervals)] = intervals
    after.counts[here.N_INTERVALS] = len(intervals)


def take_over_resets(actions: EventActions, after: Any) -> float:
    """Let the actions of Python know the same; returns where resets pile up, if they do [s]."""
    last = after.sums[here.LAST_RESET]
    actions.energy_of_resets = float(after.sums[here.RESET_ENERGY])
    intervals = after.intervals[: after.counts[here.N_INTERVALS]].tolist()
    actions.zeno.memory = [None if np.isnan(last) else float(last), *intervals]
    return float(after.sums[here.ACCUMULATION])


class EventsInCode:
    """Moves a run on over its events, as far as machine code can act on them.

    Parameters
    ----------
    system : System
        `has_plain_events`, `has_impacts_beside_constraints` or `has_own_events_on_constraints` of it.
    method : Method
    arrays : LoopArrays
    """

    in_both_forms = False  # what is held is for Python

    def __init__(self, system: System, method: Method, arrays: LoopArrays):
        self._system, self._method, self._arrays = system, method, arrays
        self._generation = -1
        self._handed: Known | None = None
        self.accumulation = np.nan
        self.changes: list[tuple[float, np.ndarray, np.ndarray]] = []

    def _bind(self) -> None:
        arrays, loop = self._arrays, self._arrays.loop()
        self._block = arrays.block()
        self._after, self._keep = make_after(self._system, self._method, arrays, self._block)
        self._call = call_block(here.advance_over_events, loop, self._after)
        self._generation, self._handed = arrays.generation, None

    def advance(
        self, actions: EventActions, stop: float, max_steps: int, watch: float, *, keep_log: bool
    ) -> int:
        """Run the loop, and act on events, until something is for Python to do; see `LoopArrays.advance`.

        Returns
        -------
        int
            Also `plain_events.ZENO`.
        """
        if self._generation != self._arrays.generation:
            self._bind()
        self._hand_over(actions)
        self._arrays.set_limits(stop, max_steps, watch, keep_log=keep_log)
        status = self._call()
        n = int(self._after.counts[here.N_LOG])
        if n:
            self._take_over(actions, n)
        return status

    def _hand_over(self, actions: EventActions) -> None:
        """Let machine code know what happened; a call that acted on no event has left all as it was.

        Calls end at every piece of an input, mostly without an event. Sums and gaps are replaced where they change, so
        that the same objects hold the same bits.
        """
        known = what_is_known(actions)
        if is_same(known, self._handed):
            return
        hand_over_resets(actions, self._after)
        self._after.counts[here.N_LOG], self._after.lowest[:] = 0, actions.lowest_gaps
        self._handed = known

    def _take_over(self, actions: EventActions, n: int) -> None:
        """Let the actions of Python know what happened."""
        after, self._handed = self._after, None
        rows = after.log[:n].copy()
        before = actions.energy_of_resets
        actions.log.extend_by_rows(self._system, rows)
        self.accumulation = take_over_resets(actions, after)
        actions.lowest_gaps = after.lowest.copy()
        sums = np.cumsum(np.append(before, rows[:, here.CHANGE]))[1:]  # added up one by one
        self.changes.append((before, rows[:, here.NEXT_FRAME].astype(int), sums))

    def take_changes(self) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return what resets had added to T + V [J], then from which frames on they had added how much.

        Behind that the settings of stops and frictions, of which there are none here, and whether they are new.
        """
        changes, self.changes = self.changes, []
        frames, sums = (np.concatenate([c[k] for c in changes]) for k in (1, 2))
        return changes[0][0], frames, sums, np.zeros((len(frames), 0)), np.zeros(len(frames), dtype=bool)
