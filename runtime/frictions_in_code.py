"""Frictions and stops of a run that machine code acts on: its arrays, and what Python's records take over from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.call_block import CallBlock, call_block
from symgen.runtime.constraints.kkt import expectation
from symgen.runtime.constraints.row_weights import n_weights, quaternion_places, random_steps
from symgen.runtime.constraints.size_code import make_sizing
from symgen.runtime.contact.local_dynamics import creeping_frictions, normals_of, smooth_frictions
from symgen.runtime.contact.settings import Layout
from symgen.runtime.events_in_code import (
    ACTIONS,
    Known,
    hand_over_resets,
    is_same,
    take_over_resets,
    what_is_known,
)
from symgen.runtime.graph.spelling import reset_function
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import plain_events, plain_frictions, plain_jumps
from symgen.runtime.integrate import plain_instant as here
from symgen.runtime.integrate.plain_coulomb import make_law
from symgen.runtime.jumps_in_code import make_jumps
from symgen.runtime.loop_arrays import DIRECTIONS
from symgen.runtime.positions import ANGLES

if TYPE_CHECKING:
    from symgen.runtime.event_actions import EventActions
    from symgen.runtime.inputs.schedule import InputSchedule
    from symgen.runtime.integrate.loop import Loop
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

_ROWS = 1024  # of the log
_LARGEST = 24  # rates: mass matrices are factored in full
_OF_FREE = (
    (plain_events.EVENTS, "events"), (plain_events.RHS, "rhs"), (plain_events.ENERGY, "energy"),
    (plain_events.MASS, "mass_matrix"), (plain_events.FORCES, "forces"), (plain_events.SWITCHES, "switches"),
)  # fmt: skip
_OF_HELD = ((here.HELD_EVENTS, "events"), (here.HELD_RHS, "rhs"), (here.ROWS, "constraint_jacobian"))
_OF_ALL_ROWS = (
    (plain_events.JACOBIAN, "constraint_jacobian"), (plain_events.RESIDUAL, "constraint_residual"),
    (plain_events.GAMMA, "gamma"),
)  # fmt: skip


def has_plain_frictions(system: System, method: Method, arrays: LoopArrays) -> bool:
    """Whether machine code can act on frictions of a run: those along lines, which stick.

    So it does on stops alone, which may stay closed.
    """
    return (
        bool(system.switches)
        and not (system.quaternions or (system.m and system.jumps))
        and len(system.jumps) == len(system.closed.jumps)
        and system.nq == system.nv
        and system.nv + system.m <= _LARGEST
        and not len(Layout(system).circles)
        and not (smooth_frictions(system) | creeping_frictions(system)).any()
        and method.tail is None
        and method.versions is None
        and bool(np.isnan(arrays.control[at.ENERGY_LEVEL]))
        and _is_let_go_entirely(system)
    )


def _is_let_go_entirely(system: System) -> bool:
    """Whether stops and frictions are all that the held form holds beside constraints, and let go of entirely."""
    held = system.closed
    if (
        held.dependent
        or system.dependent
        or held.nh != system.nh + Layout(system).n_stops
        or held.m != system.m + len(held.switched)
        or not n_weights(held)
    ):
        return False
    y = np.random.default_rng(20240229).uniform(-1.0, 1.0, system.nq + system.nv)
    p = system.parameter_values()
    p[list(held.switched.values())] = 0.0
    rows = held.kernel("constraint_jacobian")(0.0, y, p).reshape(held.m, held.nv)[list(held.switched)]
    return not (rows.any() or held.kernel("gamma")(0.0, y, p)[list(held.switched)].any())


def _groups(system: System, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which coordinates have one unit, and the largest parameter with it: `levels.coordinate_sizes`."""
    units = [record["unit"] for record in system.coordinates]
    names = list(dict.fromkeys(unit for unit in units if unit not in ANGLES))
    groups = np.array(
        [plain_frictions.ANGLE if unit in ANGLES else names.index(unit) for unit in units], dtype=np.int64
    )
    records = [*system.parameters, *system.inputs]
    largest = [
        max((abs(float(x)) for record, x in zip(records, p) if record["unit"] == name), default=0.0)
        if name
        else 1.0
        for name in names
    ]
    return groups, np.array(largest)


def _make_guard(form: System, found: tuple, arrays: LoopArrays) -> here.Guard:
    """Return what the guard of a form is told with; nothing of a form without constraints.

    Parameters
    ----------
    found : tuple
        From `LoopArrays.visit`.
    """
    addresses, rank = np.zeros(2, dtype=np.uint64), np.zeros(1, dtype=np.int64)
    if form.m:
        addresses[0] = form.kernel("constraint_residual").address
        addresses[1] = form.kernel("constraint_jacobian").precomputed_address
        if not form.switched:
            rank[0] = expectation(form, arrays.p, arrays.t, arrays.y[: form.nq]).rank
    switch = np.array([form.switched.get(row, -1) for row in range(form.m)], dtype=np.int64)
    return here.Guard(
        addresses, *found[4], switch, rank, np.zeros(form.m * form.nv), np.zeros(form.m),
        make_sizing(form, len(arrays.p)),
    )  # fmt: skip


class FrictionsInCode:
    """Moves a run on over its changes of stick and slip, as far as machine code can act on them.

    Parameters
    ----------
    system : System
        `has_plain_frictions` of it.
    method : Method
    arrays : LoopArrays
    inputs : InputSchedule, optional
        Keeps inputs over time, in the arrays of both forms.
    """

    in_both_forms = True

    def __init__(
        self, system: System, method: Method, arrays: LoopArrays, inputs: InputSchedule | None = None
    ):
        self._system, self._method, self._arrays, self._inputs = system, method, arrays, inputs
        self._changes = -1  # of inputs, when both forms had them
        self._handed: Known | None = None
        self._generations: tuple[int, ...] = ()
        self.accumulation = np.nan
        self.changes: list[tuple] = []

    def _bind(self) -> None:
        system, arrays, method = self._system, self._arrays, self._method
        free = arrays.visit(system, method, held=False, look=self._look)
        held = arrays.visit(system.closed, method, held=True, look=self._look)
        self._generations, self._changes = (free[3], held[3]), -1
        self._worked_out, self._handed = (free[0].p, held[0].p), None
        self._own, self._keep = self._make(free, held)
        self._keep += free[1], held[1]
        given = free[0], held[0], self._own
        self._jumps = ()
        if arrays.jumps:
            forms = (system, free), (system.closed, held)
            made = [make_jumps(form, method, arrays, found[1], found[0].p) for form, found in forms]
            self._jumps, kept = zip(*made)
            self._keep += kept
            self._call = call_block(plain_frictions.advance_over_frictions_and_jumps, *given, *self._jumps)
        else:
            self._call = call_block(plain_frictions.advance_over_frictions, *given)

    def _look(self) -> tuple[Loop, CallBlock, np.ndarray, int, tuple[np.ndarray, ...]]:
        """The loop of the form that the arrays have, its call, its limits of steps, its number, its guard's arrays."""
        arrays = self._arrays
        limits = arrays.control[[at.H_BASE, at.H_SHARE]]
        return arrays.loop(), arrays.block(), limits, arrays.generation, arrays.guard_arrays()

    def _make(self, free: tuple, held: tuple) -> tuple[here.Frictions, list]:
        system, arrays, closed, layout = self._system, self._arrays, self._system.closed, Layout(self._system)
        n_own = len(system.events) - len(system.switches)
        kinds = [event["action"] for event in system.events[:n_own]]
        addresses, keep = np.zeros(here.FIRST_RESET + n_own, dtype=np.uint64), []
        if system.m:  # they may be left where a reset leads
            kinds = ["" if kind == "reset" else kind for kind in kinds]
        resets = [
            (here.FIRST_RESET + k, reset_function(event["name"]))
            for k, event in enumerate(system.events[:n_own])
            if kinds[k] == "reset"
        ]
        for form, named in ((system, (*_OF_FREE, *resets)), (closed, _OF_HELD)):
            for place, name in named:
                keep.append(form.kernel(name))
                addresses[place] = keep[-1].precomputed_address
        for place, name in _OF_ALL_ROWS:
            keep.append(closed.kernel(name))
            addresses[place] = keep[-1].address
        addresses[plain_events.ADVANCE], addresses[here.HELD_ADVANCE] = free[1].address, held[1].address
        addresses[here.SETUP], addresses[here.HELD_SETUP] = system.setup_address, closed.setup_address
        counts = np.zeros(here.N_COUNTS, dtype=np.int64)
        counts[here.STRUCK_IN_TURN] = system.sequential_impacts
        counts[plain_events.IS_ADAPTIVE], counts[plain_events.MAY_JUMP] = (
            self._method.adaptive,
            system.events_may_jump,
        )
        nq, nv, n, ne = system.nq, system.nv, len(closed.switched), len(system.events)
        n_stops, first = layout.n_stops, system.n_settable
        groups, largest = _groups(system, arrays.p)
        rows_at = np.array(list(closed.switched), dtype=np.int64)
        constraints = np.setdiff1d(np.arange(closed.m), rows_at)
        m = len(constraints)
        noise = plain_events.ROUND_OFF * (plain_events.ON_CONSTRAINTS if m else 1.0)
        own = here.Frictions(
            addresses=addresses, free_block=free[1].block, held_block=held[1].block, result=np.zeros(1),
            actions=np.array([ACTIONS.get(kind, plain_events.BY_PYTHON) for kind in kinds], dtype=np.int64),
            directions=np.array([DIRECTIONS[event["direction"]] for event in system.events[:n_own]], dtype=np.int64),
            p=arrays.p, everything=arrays.p.copy(), held_p=held[0].p, closed=first + layout.closed,
            stuck=first + layout.stuck, sense=first + layout.sense, counts=counts,
            sums=np.array([0.0, np.nan, 0.0, noise]), intervals=np.zeros(plain_events.MOST_INTERVALS),
            limits=np.array([free[2], held[2]]), groups=groups, largest=largest,
            steps=np.array(random_steps(nv)), places=quaternion_places(system), position=np.zeros(nq + nv),
            sizes=largest.copy(),
            log=np.zeros((_ROWS, plain_events.FIRST_STATE + 2 * (nq + nv) + 2 + 2 * n - n_stops)),
            lowest=np.full(n_stops, np.inf), before=np.zeros(nq + nv), moved=np.zeros(nq + nv), slope=np.zeros(nq + nv),
            row=np.zeros(system.n_row), held_row=np.zeros(closed.n_row),
            kept=np.zeros(2 * n - n_stops),
            values=np.zeros(ne), g=np.zeros(ne), floor=np.zeros(ne), other=np.zeros(ne), energy=np.zeros(2),
            switches=np.zeros(3 * n - n_stops), jacobian=np.zeros(n * nv),
            residual=np.zeros(closed.nh + closed.m), speeds=np.zeros(n), rows_at=rows_at, constraints=constraints,
            all_rows=np.zeros(closed.m * nv), all_gamma=np.zeros(closed.m), tied=np.zeros(m * nv), ties=np.zeros(m * m),
            multipliers=np.zeros(m), reactions=np.zeros(m * (n + 1)), reached=np.zeros(nv, dtype=np.int64),
            mass=np.zeros(nv * nv), inertia=np.zeros(nv), response=np.zeros((n, nv)), compliance=np.zeros((n, n)),
            rates=np.zeros(nv), change=np.zeros(nv), free=np.zeros(n), part=np.zeros(n, dtype=np.int64),
            acting=np.zeros(n, dtype=np.int64), force=np.zeros(n), gram=np.zeros(n * n), right=np.zeros(n),
            law=make_law(normals_of(system), n_stops, sequential=system.sequential_impacts),
            of_free=_make_guard(system, free, arrays), of_held=_make_guard(closed, held, arrays),
        )  # fmt: skip
        return own, keep

    def advance(
        self, actions: EventActions, stop: float, max_steps: int, watch: float, *, keep_log: bool
    ) -> int:
        """Run the loop, and act on frictions, until something is for Python to do; see `LoopArrays.advance`."""
        arrays = self._arrays
        if arrays.jumps:
            arrays.look_for_choices()
            if not arrays.precomputed[arrays.branches].all():
                return arrays.advance(stop, max_steps, watch=watch, keep_log=keep_log)
        at_event = False
        if arrays.generation not in self._generations:
            # The arrays take as long as many runs do that have no event.
            first = int(arrays.counters[at.STEPS])
            status = arrays.advance(stop, max_steps, watch=watch, keep_log=keep_log)
            if status != at.EVENT:
                return status
            max_steps, keep_log, at_event = max_steps - int(arrays.counters[at.STEPS]) + first, True, True
            self._bind()
        own, before, is_held = self._own, actions.energy_of_resets, actions.is_held
        self._write_inputs(is_held=is_held)
        own.counts[plain_events.N_LOG] = own.counts[here.ASKS] = 0
        own.counts[here.IS_HELD], own.counts[here.AT_EVENT] = is_held, at_event
        known = what_is_known(actions)
        if not is_same(known, self._handed):
            hand_over_resets(actions, own)
            own.lowest[:] = actions.lowest_gaps
            self._handed = known
        for jumps in self._jumps:
            jumps.counts[plain_jumps.N_JUMPS] = jumps.counts[plain_jumps.IS_UNDECIDED] = 0
        arrays.set_limits(stop, max_steps, watch, keep_log=keep_log)
        status = self._call()
        n = int(own.counts[plain_events.N_LOG])
        if n:
            self._handed = None
            self._adopt(self._system.closed if own.counts[here.IS_HELD] else self._system)
            self._take_over(actions, own.log[:n].copy(), before)
        if own.counts[here.ASKS]:
            arrays.tell_guard(actions.form)
        for jumps in self._jumps:
            actions.n_jumps += int(jumps.counts[plain_jumps.N_JUMPS])
        if self._jumps and any(jumps.counts[plain_jumps.IS_UNDECIDED] for jumps in self._jumps):
            actions.choose_branches()
        return status

    def _write_inputs(self, *, is_held: bool) -> None:
        """Let the form that does not apply have the inputs that the other has."""
        inputs = self._inputs
        if inputs is not None and inputs.changes != self._changes:
            system = self._system if is_held else self._system.closed
            inputs.write(system, self._worked_out[0 if is_held else 1])
            self._changes = inputs.changes

    def _adopt(self, form: System) -> None:
        """Let Python go on with the arrays of the form that applies."""
        self._arrays.adopt(form, self._method)
        if self._inputs is not None:
            self._inputs.take_form(form)

    def _take_over(self, actions: EventActions, rows: np.ndarray, before: float) -> None:
        """Let the actions of Python know what happened."""
        known = actions.switching.settings
        settings = self._settings(rows)
        is_new = (settings != np.vstack([known, settings[:-1]])).any(axis=1)
        actions.lowest_gaps = self._own.lowest.copy()
        n = (
            plain_events.FIRST_STATE + 2 * (self._system.nq + self._system.nv) + 2
        )  # settings are kept elsewhere
        actions.log.extend_by_rows(self._system, rows[:, :n].copy())
        self.accumulation = take_over_resets(actions, self._own)
        actions.switching.settings = settings[-1]
        sums = np.cumsum(np.append(before, rows[:, plain_events.CHANGE]))[1:]  # added up one by one
        self.changes.append((before, rows[:, plain_events.NEXT_FRAME].astype(int), sums, settings, is_new))

    def _settings(self, rows: np.ndarray) -> np.ndarray:
        """Return the settings behind each event, shape (n, number of settings)."""
        layout, n, n_stops = Layout(self._system), len(self._own.stuck), len(self._own.closed)
        settings = np.zeros((len(rows), layout.n_settings))
        stuck, sense, closed = np.split(rows[:, rows.shape[1] - 2 * n - n_stops :], [n, 2 * n], axis=1)
        settings[:, layout.stuck], settings[:, layout.sense], settings[:, layout.closed] = (
            stuck,
            sense,
            closed,
        )
        return settings

    def take_changes(self) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return what events had added to T + V [J], then from which frames on they had added how much.

        Behind that the settings of stops and frictions, shape (n, number of settings), and whether they are new.
        """
        changes, self.changes = self.changes, []
        return changes[0][0], *(np.concatenate([c[k] for c in changes]) for k in (1, 2, 3, 4))
