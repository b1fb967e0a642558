"""Machine code and arrays of prepared runs: what one thread runs with."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.call_block import call_block
from symgen.runtime.constraints.drift import drift_limit
from symgen.runtime.constraints.energy_level import may_be_kept
from symgen.runtime.constraints.kkt import nearby_step
from symgen.runtime.constraints.row_weights import n_weights, quaternion_places, random_steps
from symgen.runtime.events_in_code import has_plain_events, make_after
from symgen.runtime.exchange import energy_limit
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.options import SAME_TICKS, time_resolution
from symgen.runtime.positions import ANGLES, Positions
from symgen.runtime.prepared import layout as here
from symgen.runtime.prepared.rows import Look, Plan, Rows
from symgen.runtime.prepared.whole_run import run_rows
from symgen.runtime.record import record
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.prepared.runs import Runs
    from symgen.runtime.simulate import Choice
    from symgen.runtime.system import System

ROWS = 256  # of a call
_FIRST_STEPS, _SECONDS_PER_CALL = 4096, 0.05
_LONGEST_ROW = 2.0  # [s] of processor time: whoever takes longer may not get on at all, which Python watches
_MOST_STEPS = 2**62
_BARE, _ROTATION = -2, -1


@record(eq=False)
class Task:
    """What all machines of a prepared run have in common.

    Attributes
    ----------
    system : System
    options : RunOptions
        With an end; rtol is not below round-off.
    choice : Choice
    has_fallback : bool
        Whether another method takes over where that of the choice cannot go on.
    base_p, base_y : ndarray, shapes (n_p,), (nq + nv,)
    p_at : ndarray of int64
        Where in `p` the values of rows belong.
    frames : ndarray [s]
        Times of frames, the start and the end among them; or none.
    wanted : ndarray of int64
        Which of them are the result; none: the end.
    checks : bool
        Whether energy and constraints are looked at.
    """

    system: System
    options: RunOptions
    choice: Choice
    has_fallback: bool
    base_p: np.ndarray
    base_y: np.ndarray
    p_at: np.ndarray
    frames: np.ndarray
    wanted: np.ndarray
    checks: bool


def objection_to_machine(system: System, options: RunOptions, has_timetable: bool, is_moved: bool) -> str:
    """Return why machine code alone does not make the runs of a model; an empty string where it does."""
    if system.events and not has_plain_events(system):
        return "it has events that machine code does not act on"
    if is_moved:
        return "it has inputs over time"
    if has_timetable or system.has("time_terms"):
        return "steps keep to times"
    if system.subsystems and options.split is not False:
        return "it has independent subsystems"
    if system.dependent:
        return "it has constraints that follow from others"
    if system.start is not None:
        return "its start is solved for"
    if is_large(system) or (system.m and not n_weights(system)):  # the look at starts writes row weights
        return "it is large"
    if options.progress is not None or options.recorder is not None:
        return "somebody watches"
    return ""


class Machine:
    """Makes runs of one task, one after another; it serves one thread at a time."""

    def __init__(self, task: Task):
        self.task = task
        system, options, choice = task.system, task.options, task.choice
        keeps = 0.0
        if options.energy_scaling is not False and may_be_kept(system, choice.method):
            keeps = 2.0 if options.energy_scaling else 1.0
        arrays = LoopArrays(
            system, choice.method, task.base_p, options.t_start, task.base_y, frame_times=task.frames,
            rtol=options.rtol, atol=options.atol, step=choice.step, energy_level=0.0 if keeps else np.nan,
        )  # fmt: skip
        self._arrays = arrays
        self._loop = arrays.loop()
        self._plan_block = arrays.block()
        self._plan = self._make_plan(keeps)
        self._look = _make_look(system, len(task.frames))
        self.rows = self._make_rows()
        self.p, self.y, self.out = self.rows.p[0], self.rows.y[0], self.rows.out[0]
        after, self._kernels_of_events = make_after(system, choice.method, arrays, self._plan_block)
        self._call = call_block(run_rows, self._loop, self._plan, self._look, after, self.rows)
        self._budget = _FIRST_STEPS

    def _make_plan(self, keeps: float) -> Plan:
        task, arrays, loop = self.task, self._arrays, self._loop
        system, options, method = task.system, task.options, task.choice.method
        names = ["rhs", "mass_matrix"]
        if system.m:
            names += ["constraint_residual", "constraint_jacobian", "gamma"]
        if keeps or task.checks:
            names.append("energy")
        addresses = np.zeros(here.N_ADDRESSES, dtype=np.uint64)
        self._kernels = {name: system.kernel(name) for name in names}
        for name, kernel in self._kernels.items():
            addresses[_ADDRESS[name]] = kernel.precomputed_address
        addresses[here.ADVANCE] = self._plan_block.address
        addresses[here.SETUP] = system.setup_address
        guard, weights, curve = arrays.guard_arrays()
        tail = np.array(arrays.tail)
        asked = np.zeros(here.N_ASKED)
        asked[here.T_END] = options.t_end
        asked[here.SAME_WITHIN] = SAME_TICKS * time_resolution(options.t_start, options.t_end)
        asked[here.ADAPTIVE], asked[here.HAS_FALLBACK] = method.adaptive, task.has_fallback
        asked[here.MAX_STEPS] = _MOST_STEPS if options.max_steps is None else options.max_steps
        asked[here.SCALES_ENERGY], asked[here.HAS_HOISTED] = keeps, addresses[here.SETUP] != 0
        asked[here.CHECKS], asked[here.ENERGY_LIMIT] = task.checks, energy_limit(method, options.rtol)
        asked[here.DRIFT_LIMIT] = drift_limit(method, options.rtol)
        size = sum(array.size for array in (loop.control, loop.y, loop.f, loop.work, tail, loop.dense, curve))
        return Plan(
            addresses=addresses, block=self._plan_block.block, result=np.zeros(1), asked=asked, guard=guard,
            weights=weights, curve=curve, control=loop.control.copy(), counters=loop.counters.copy(), tail=tail,
            saved=np.zeros(size), saved_counters=np.zeros(len(loop.counters) + 1, dtype=np.int64),
            base_p=task.base_p,
        )  # fmt: skip

    def _make_rows(self) -> Rows:
        task = self.task
        n, system = len(task.base_y), task.system
        return Rows(
            places=np.zeros(here.N_PLACES, dtype=np.int64), p_at=task.p_at,
            p=np.zeros((ROWS, len(task.p_at))), y=np.zeros((ROWS, n)),
            is_assembled=np.zeros(ROWS, dtype=np.int64),
            sizes=np.zeros(ROWS * system.nv if sizes_need_python(system) else 0), wanted=task.wanted,
            out=np.zeros((ROWS, n * max(1, len(task.wanted)))), status=np.zeros(ROWS, dtype=np.int64),
            steps=np.zeros(ROWS, dtype=np.int64), t=np.zeros(ROWS),
        )  # fmt: skip

    def run_one(self) -> int:
        """Make the run of `p` and `y`, which writes `out`; returns its status."""
        self.rows.is_assembled[0] = 0
        self.run(1)
        return int(self.rows.status[0])

    def make(
        self,
        which: np.ndarray,
        P: np.ndarray,
        states: np.ndarray,
        assembled: np.ndarray,
        sizes: np.ndarray | None,
        runs: Runs,
    ) -> None:
        """Make the runs of some rows, `ROWS` at most, and note what became of them.

        Parameters
        ----------
        which : ndarray of int
        P, states : ndarray, shapes (n, k), (n, nq + nv)
        assembled : ndarray of int, shape (n,)
            1 where a start is known to meet the constraints.
        sizes : ndarray, shape (len(which), nv), or None
            Characteristic sizes.
        """
        rows, n = self.rows, len(which)
        rows.p[:n], rows.y[:n], rows.is_assembled[:n] = P[which], states[which], assembled[which]
        if sizes is not None:
            rows.sizes[: sizes.size] = sizes.ravel()
        self.run(n)
        runs.y[which] = rows.out[:n].reshape(n, *runs.y.shape[1:])
        runs.t[which], runs.status[which], runs.steps[which] = rows.t[:n], rows.status[:n], rows.steps[:n]

    def run(self, n: int) -> None:
        """Make the runs of the first `n` rows of `rows`."""
        places = self.rows.places
        places[:] = 0, 0, n, self._budget
        if self._call() == here.SUCCESS:
            return
        began, row, last = time.thread_time(), int(places[here.ROW]), time.thread_time()
        while places[here.ROW] < n:
            places[here.STEPS_TO_GO] = self._budget
            self._call()
            now = time.thread_time()
            if now - last < 0.5 * _SECONDS_PER_CALL:
                self._budget *= 2
            elif now - last > 2.0 * _SECONDS_PER_CALL:
                self._budget = max(1, self._budget // 2)
            last = now
            if places[here.ROW] != row:
                began, row = now, int(places[here.ROW])
            elif now - began > _LONGEST_ROW and places[here.UNDER_WAY]:
                self.rows.status[row] = here.NEEDS_PYTHON
                places[here.ROW], places[here.UNDER_WAY] = row + 1, 0


_ADDRESS = {
    "rhs": here.STRAIGHT_RHS,
    "mass_matrix": here.MASS,
    "constraint_residual": here.RESIDUAL,
    "constraint_jacobian": here.JACOBIAN,
    "gamma": here.GAMMA,
    "energy": here.ENERGY,
}


def sizes_need_python(system: System) -> bool:
    """Whether characteristic sizes are found by trials (`levels._fit`), which only Python makes."""
    return bool(system.nh) and _BARE in _units(system)[0]


def _units(system: System) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return the first three arrays of `Look`, and the number of units."""
    records = [*system.coordinates, *system.parameters, *system.inputs]
    numbers = {unit: k for k, unit in enumerate(dict.fromkeys(record["unit"] for record in records))}
    of_value = np.array([numbers[record["unit"]] for record in records], dtype=np.int64)
    turned = {k for i in system.quaternions for k in range(i, i + 4)}
    is_bare = np.array(
        [record["unit"] == "" and k not in turned for k, record in enumerate(system.coordinates)],
        dtype=np.int64,
    )
    of_coordinate = [
        _ROTATION if record["unit"] in ANGLES else _BARE if is_bare[k] else numbers[record["unit"]]
        for k, record in enumerate(system.coordinates)
    ]
    of_rate = Positions(system).per_rate(np.array(of_coordinate, dtype=float), _ROTATION).astype(np.int64)
    return of_rate, of_value, is_bare, len(numbers)


def _make_look(system: System, n_frames: int) -> Look:
    nq, nv, m = system.nq, system.nv, system.m
    of_rate, of_value, is_bare, n_units = _units(system)
    return Look(
        unit_of_rate=of_rate, unit_of_value=of_value, is_bare=is_bare, largest=np.zeros(n_units),
        quaternions=quaternion_places(system), steps=random_steps(nv).copy(), nearby=nearby_step(nv),
        turning=np.cos([np.arange(nv), *(k * np.arange(1.0, nv + 1.0) for k in (1, 2))]),
        places=np.array([0.1 * np.sin(k * np.arange(1, nq + 1)) for k in (1, 2, 3)]),
        y=np.zeros(system.ny), row=np.zeros(system.n_row), rows=np.zeros(m * nv), squares=np.zeros(m),
        gamma=np.zeros(m), residual=np.zeros(system.nh + m), gram=np.zeros(m * m), mass=np.zeros(nv * nv),
        energy=np.zeros(2), resets=np.zeros(n_frames),
    )  # fmt: skip
