"""A run that is prepared once, for calls with other parameters and starts: `System.prepare`."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.choose import SERIES, choose_constraints
from symgen.runtime.errors import RunFailed, RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.names import inside_dot, rate_indices, rate_labels
from symgen.runtime.options import SMALLEST_RTOL, RunOptions
from symgen.runtime.positions import Positions
from symgen.runtime.prepared import layout as here
from symgen.runtime.prepared.machine import ROWS, Machine, Task, objection_to_machine, sizes_need_python
from symgen.runtime.prepared.runs import Runs
from symgen.runtime.simulate import (
    Choice,
    choose,
    consistent_start,
    found_parameters,
    simulate,
    split_inputs,
)
from symgen.runtime.timing.timetable import make_timetable

if TYPE_CHECKING:
    from symgen.runtime.options import Quantity
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

constrained = Late("symgen.runtime.constraints.assembly")
drive = Late("symgen.runtime.inputs.drive")
health = Late("symgen.runtime.checks.health")
levels = Late("symgen.runtime.constraints.levels")
plain_assembly = Late("symgen.runtime.constraints.plain_assembly")
start_values = Late("symgen.runtime.constraints.start_values")

CHECKS = ("none", "end", "full")
OUTPUTS = ("end", "solution")
_PIECES_PER_THREAD = 4
_FINE = 1e-6  # rtol up to which end checks leave the second run out
_FRAMES_CHECKED = {
    False: 16,
    True: 8,
}  # with constraints each takes a projection; they tell what the motion exchanges


class PreparedRun:
    """A run that is called with parameters and a start; `System.prepare` makes it.

    Method, step and form of constraints are chosen once, at the model's own values; all else is that of
    `System.run` with the same options, to the last bit. A prepared run serves one thread at a time, and others wait:
    `clone` it for them.

    Parameters
    ----------
    system : System
    options : RunOptions
        Without parameters, start and rate.
    parameters, start, output, checks
        See `System.prepare`.
    finish : callable, optional
        What is made of a `Solution` and of what was asked for it.

    Attributes
    ----------
    system : System
    parameters : tuple of str
        What `p` holds.
    start : tuple of str
        What `y0` holds: coordinates, and rates as `dot(x)` or by names of their own.
    n_state : int
        nq + nv.
    method, constraints : str
        What was chosen; "auto" where each run chooses for itself, as independent subsystems do.
    step : float or None
        Of methods of fixed step [s].
    t_start, t_end : float [s]
    output, checks : str
    times : ndarray [s]
        Those asked for; empty for other outputs.
    notes : list of str
        What was chosen, and why.
    why_python : str
        Why runs go through Python one by one; an empty string where machine code makes them.
    status, message : str
        Of the last call, as `Solution` has them.
    t : float [s]
        Where that ended.
    steps : int
        How many it took.
    """

    def __init__(
        self,
        system: System,
        options: RunOptions,
        *,
        parameters: Sequence[str] | Mapping[str, Quantity] | None = None,
        start: Sequence[str] | Mapping[str, Quantity] | None = None,
        output: str | Sequence[Quantity] = "end",
        checks: str = "none",
        finish: Callable[[Solution, RunOptions], Solution] | None = None,
    ):
        if checks not in CHECKS:
            raise RuntimeModelError(f"there are no checks {checks!r}: {nearest(str(checks), CHECKS)}")
        options = options.for_model(system)
        self.system, self.checks, self.n_state = system, checks, system.nq + system.nv
        self.output, self.times = _output_and_times(system, output, options)
        values = dict(parameters) if isinstance(parameters, Mapping) else {}
        self._moving, constant = split_inputs(system, dict(options.inputs or {}), values)
        self._finish = finish
        self._base_p = system.parameter_values({**values, **constant})
        self.parameters = _parameter_names(system, parameters, self._moving)
        self._p_at = np.array([system.place_of_parameter(name) for name in self.parameters], dtype=np.int64)
        self.start, self._y_at = _start_names(system, start)
        frames = {"t_eval": tuple(self.times)} if self.output == "times" else {}
        self._options = replace(options, inputs=self._moving or None, **frames)
        self._fixed_inputs = constant
        self._nominal_p = self._base_p[self._p_at]
        self._given = values | dict(zip(self.parameters, map(float, self._nominal_p)))
        self.t_start, self.t_end = options.t_start, options.t_end
        self._choose(dict(start) if isinstance(start, Mapping) else {})
        self._base_y = self._start_of_model(self._base_p)
        self._is_whole = np.array_equal(self._y_at, np.arange(self.n_state))
        self._y_follows_p = len(self.start) < self.n_state and bool(system.source.header.get("starts"))
        self._needs_preparing = self._y_follows_p or bool(system.quaternions) or sizes_need_python(system)
        self._task = None if self.why_python else self._make_task()
        self._machine = Machine(self._task) if self._task is not None else None
        self._last: Runs | None = None
        self._in_use = threading.Lock()

    def _choose(self, start: dict[str, Quantity]) -> None:
        """Choose method, step and form of constraints at the model's own values."""
        system, options, p = self.system, self._options, self._base_p
        if self._moving:
            system = drive.drive(system, self._moving, p, options.t_start, options.t_end)
        form = choose_constraints(options.constraints, system, options.method)
        asked = replace(options, **self._as_options(start), parameters=self._given)
        p, _ = found_parameters(system, p, asked)
        assembly = consistent_start(system, p, asked)
        state = np.concatenate([assembly.q, assembly.v])
        self._nominal_y = state[self._y_at]
        splits = options.split is not False and bool(system.subsystems)
        self._choice: Choice | None = None if splits else choose(system, p, state, options, form)
        has_timetable = False
        if self._choice is not None:
            has_timetable = make_timetable(system, p, self._choice.method, options) is not None
        self.method = self._choice.method.name if self._choice else options.method
        self.constraints = self._choice.treatment if self._choice else options.constraints
        self.step = (self._choice.step or None) if self._choice else options.step
        self.notes = list(self._choice.notes) if self._choice else []
        self.why_python = objection_to_machine(system, options, has_timetable, bool(self._moving))
        if self.checks == "end" and system.switches:
            self.why_python = "what stops and frictions do is checked by the health report"
        elif self.checks == "end" and system.has("windings"):
            self.why_python = "how far bushings and springs are wound up is checked by the health report"
        if self.output == "solution":
            self.why_python = "whole solutions are asked for"
        elif self.checks == "full":
            self.why_python = "the whole health report is asked for"

    def _as_options(self, values: Mapping[str, Quantity]) -> dict[str, dict[str, Quantity]]:
        """Return values of coordinates and rates as the options `start` and `rate`."""
        system = self.system
        coordinates = {record["name"] for record in system.coordinates}
        coordinates |= {system.rates[k]["name"] for k in system.states}
        start = {name: value for name, value in values.items() if name in coordinates}
        return {"start": start, "rate": {name: value for name, value in values.items() if name not in start}}

    def _start_of_model(self, p: np.ndarray) -> np.ndarray:
        """Return the model's start, before assembly."""
        q, v, _, _ = self.system.initial_state(p)
        return np.concatenate([Positions(self.system).normalised(q), v])

    def _make_task(self) -> Task:
        frames = self.times
        if self.checks == "end":
            between = np.linspace(self.t_start, self.t_end, _FRAMES_CHECKED[bool(self.system.m)] + 2)
            frames = np.concatenate([frames, between])
        if len(frames):
            frames = np.unique([self.t_start, *frames, self.t_end])
        options = self._options
        if options.rtol < SMALLEST_RTOL:
            options = replace(options, rtol=SMALLEST_RTOL)
        return Task(
            self.system, options, self._choice, options.method == "auto" and self.method == SERIES,
            self._base_p, self._base_y, self._p_at, frames, np.searchsorted(frames, self.times), self.checks == "end",
        )  # fmt: skip

    @property
    def nominal_start(self) -> np.ndarray:
        """What `start` is in calls without `y0`, in SI."""
        return self._nominal_y.copy()

    def clone(self) -> PreparedRun:
        """Return another one, for another thread: code is shared, arrays are not."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), _last=None, _in_use=threading.Lock())
        other._machine = Machine(self._task) if self._task is not None else None
        return other

    __copy__ = clone  # two that share arrays would write over each other's

    def __deepcopy__(self, memo: dict[int, Any]) -> PreparedRun:
        return self.clone()

    def __reduce__(self) -> Any:
        raise TypeError(
            f"{self!r} holds addresses of machine code, which mean nothing to another process: send the system there, "
            "which can be pickled, and prepare the run anew"
        )

    def __repr__(self) -> str:
        return f"<PreparedRun of {self.system.name!r} to t = {self.t_end:.6g} s by {self.method}>"

    def __call__(
        self, p: Sequence[float] | np.ndarray | None = None, y0: Sequence[float] | np.ndarray | None = None
    ) -> np.ndarray | Solution:
        """Make the run.

        Parameters
        ----------
        p : array_like, shape (len(parameters),), optional
            Values of `parameters`, in SI; those that the run was prepared with by default.
        y0 : array_like, shape (len(start),), optional
            Values of `start`, in SI, likewise. They are enforced, as those of `System.run` are.

        Returns
        -------
        ndarray, shape (nq + nv,) or (n_times, nq + nv), or Solution
            (q, v) at the end or at the times asked for. Where an event has ended the run that is its end; nan at
            times behind it.

        Raises
        ------
        RunFailed
            The run failed, or a check objects; the message says why.
        RuntimeModelError
            A value is not finite, or there are more or fewer than names.
        """
        with self._in_use:
            return self._run(p, y0)

    def _run(
        self, p: Sequence[float] | np.ndarray | None, y0: Sequence[float] | np.ndarray | None
    ) -> np.ndarray | Solution:
        if self.output == "solution":
            return self._solution(self._values("p", p), self._values("y0", y0))
        machine = self._machine
        if machine is not None:
            machine.p[:] = self._nominal_p if p is None else self._values("p", p)
            if self._needs_preparing:
                self._prepare_start(machine, self._values("y0", y0))
            elif self._is_whole:
                machine.y[:] = self._nominal_y if y0 is None else self._values("y0", y0)
            else:
                machine.y[:] = self._base_y
                machine.y[self._y_at] = self._nominal_y if y0 is None else self._values("y0", y0)
            if machine.run_one() == here.SUCCESS:
                self._last = None
                found = machine.out.copy()
                return found.reshape(-1, self.n_state) if self.output == "times" else found
        runs = self._last = self._runs(self._values("p", p)[None], self._values("y0", y0)[None], 1)
        if not runs.ok[0]:
            raise RunFailed(runs.message(0), runs.words[0])
        return runs.y[0]

    def _prepare_start(self, machine: Machine, y0: np.ndarray) -> None:
        """Hand a start over of which machine code alone cannot tell all that it needs."""
        P = machine.p[None]
        states = self._whole_starts(P, y0[None])
        machine.y[:] = states[0]
        sizes = self._sizes(np.zeros(1, dtype=int), P, states)
        if sizes is not None:
            machine.rows.sizes[: sizes.size] = sizes[0]

    def many(self, P: np.ndarray | None = None, Y0: np.ndarray | None = None, *, threads: int = 1) -> Runs:
        """Make many runs: a loop in machine code, which leaves the interpreter's lock to others.

        Parameters
        ----------
        P : array_like, shape (n, len(parameters)), optional
            A row for each run; those that it was prepared with by default.
        Y0 : array_like, shape (n, len(start)), optional
            Likewise.
        threads : int
            Results do not depend on it.

        Returns
        -------
        Runs
            Also of runs that failed: see its `status` and `message`.

        Raises
        ------
        RuntimeModelError
            Shapes do not fit.
        """
        if self.output == "solution":
            raise RuntimeModelError(
                "many gives arrays: prepare with output='end' or times, or call with each row"
            )
        if not isinstance(threads, (int, np.integer)) or threads < 1:
            raise RuntimeModelError(f"threads is {threads!r}: give a whole number, at least 1")
        P, Y0 = self._table("P", P), self._table("Y0", Y0)
        n = max((len(table) for table in (P, Y0) if table is not None), default=1)
        for name, table in (("P", P), ("Y0", Y0)):
            if table is not None and len(table) != n:
                raise RuntimeModelError(
                    f"{name} has {len(table)} rows, but the other table has {n}: one for each run"
                )
        P = np.tile(self._nominal_p, (n, 1)) if P is None else P
        Y0 = np.tile(self._nominal_y, (n, 1)) if Y0 is None else Y0
        with self._in_use:
            return self._runs(P, Y0, int(threads))

    def consistent(
        self, y0: Sequence[float] | np.ndarray | None = None, p: Sequence[float] | None = None
    ) -> bool:
        """Whether a start meets the constraints to the last digit, so that nothing of it is moved."""
        state = self._whole_starts(self._values("p", p)[None], self._values("y0", y0)[None])[0]
        _refuse_not_finite("y0", state)
        if not self.system.m:
            return True
        return constrained.is_consistent(
            self.system, self._parameters(self._values("p", p)), self.t_start, state
        )

    def assemble(
        self, y0: Sequence[float] | np.ndarray | None = None, p: Sequence[float] | None = None
    ) -> np.ndarray:
        """Return the consistent start of a run, (q, v): what `y0` says stays, the rest follows.

        Raises
        ------
        symgen.runtime.constraints.contradictions.AssemblyError
            It contradicts the constraints.
        """
        return self._assembled(self._values("p", p), self._values("y0", y0))

    @property
    def status(self) -> str:
        """Of the last call, as `Solution.status` says it, or doubtful."""
        return "success" if self._last is None else self._last.words[0]

    @property
    def message(self) -> str:
        """Why the last call was no success."""
        return "" if self._last is None else self._last.message(0)

    @property
    def t(self) -> float:
        """Where the last call ended [s]."""
        return self.t_end if self._last is None else float(self._last.t[0])

    @property
    def steps(self) -> int:
        """The steps of the last call."""
        return int(self._machine.rows.steps[0] if self._last is None else self._last.steps[0])

    def _values(self, name: str, values: Sequence[float] | np.ndarray | None) -> np.ndarray:
        """Return the values of one run, or say what is wrong with them."""
        nominal, names = (self._nominal_p, self.parameters) if name == "p" else (self._nominal_y, self.start)
        if values is None:
            return nominal
        if type(values) is np.ndarray and values.dtype == _FLOAT and values.shape == nominal.shape:
            return values
        return _as_numbers(name, values, (len(names),), names)

    def _table(self, name: str, values: Any) -> np.ndarray | None:
        names = self.parameters if name == "P" else self.start
        if values is None:
            return None
        table = np.asarray(values)
        rows = len(table) if table.ndim else 0
        return _as_numbers(name, table, (rows, len(names)), names)

    def _parameters(self, p: np.ndarray) -> np.ndarray:
        """Return the model's `p` with the values of a run."""
        whole = self._base_p.copy()
        whole[self._p_at] = p
        return whole

    def _whole_starts(self, P: np.ndarray, Y0: np.ndarray) -> np.ndarray:
        """Return (q, v) of runs before assembly, with quaternions of unit length."""
        states = np.tile(self._base_y, (len(Y0), 1))
        if self._y_follows_p:
            for state, p in zip(states, P):
                state[:] = self._start_of_model(self._parameters(p))
        states[:, self._y_at] = Y0
        if self.system.quaternions:
            positions, nq = Positions(self.system), self.system.nq
            for state in states:
                state[:nq] = positions.normalised(state[:nq])
        return states

    def _assembled(self, p: np.ndarray, y0: np.ndarray) -> np.ndarray:
        asked = self._asked(p, y0)
        p, _ = found_parameters(self.system, self._parameters(p), asked)
        assembly = consistent_start(self.system, p, asked)
        return np.concatenate([assembly.q, assembly.v])

    def _asked(self, p: np.ndarray, y0: np.ndarray) -> RunOptions:
        """Return what `System.run` would be asked for such a run."""
        parameters = {name: float(value) for name, value in zip(self.parameters, p)}
        values = {name: float(value) for name, value in zip(self.start, y0)}
        inputs = {**(self._options.inputs or {}), **self._fixed_inputs}
        inputs = {name: value for name, value in inputs.items() if name not in parameters}
        return replace(
            self._options, parameters=parameters, inputs=inputs or None, **self._as_options(values)
        )

    def _solution(self, p: np.ndarray, y0: np.ndarray) -> Solution:
        """Make a run as `System.run` does."""
        asked = self._asked(p, y0)
        found = simulate(self.system, asked, self._choice)
        return found if self._finish is None else self._finish(found, asked)

    def _runs(self, P: np.ndarray, Y0: np.ndarray, threads: int) -> Runs:
        """Make the runs of some rows: in machine code where it can, the others one by one as `System.run` does."""
        n = len(P)
        shape = (n, len(self.times), self.n_state) if self.output == "times" else (n, self.n_state)
        runs = Runs(shape, self.t_start, lambda row: self._reason(P[row], Y0[row]))
        try:
            left = np.arange(n)
            if self._task is not None:
                states, assembled = self._whole_starts(P, Y0), np.zeros(n, dtype=np.int64)
                self._by_machine(left, P, states, assembled, runs, threads)
                again = np.flatnonzero(runs.status == here.NEEDS_ASSEMBLY)
                again = again[self._assemble_rows(again, P, Y0, states, runs)]
                assembled[again] = 1
                self._by_machine(again, P, states, assembled, runs, threads)
                left = np.flatnonzero((runs.status == here.NEEDS_PYTHON) | (runs.status == here.DOUBTFUL))
            for i in left:
                self._by_python(i, P[i], Y0[i], runs)
        except KeyboardInterrupt:
            between = (here.NEEDS_ASSEMBLY, here.NEEDS_PYTHON, here.DOUBTFUL)
            runs.status[np.isin(runs.status, between)] = here.INTERRUPTED
        self._name_bad_numbers(P, Y0, runs)
        return runs

    def _assemble_rows(
        self, which: np.ndarray, P: np.ndarray, Y0: np.ndarray, states: np.ndarray, runs: Runs
    ) -> np.ndarray:
        """Bring the starts of runs onto the constraints, all at once where that is plain; returns which are there."""
        done = np.zeros(len(which), dtype=bool)
        # One alone is as fast by itself, and not assembled again where the last one was the same.
        for first in range(0, len(which), ROWS) if len(which) > 1 else ():
            part = slice(first, first + ROWS)
            states[which[part]], done[part] = self._assembled_at_once(
                P[which[part]], Y0[which[part]], states[which[part]]
            )
        for k in np.flatnonzero(~done):
            done[k] = self._assemble_row(which[k], P, Y0, states, runs)
        return done

    def _assembled_at_once(
        self, P: np.ndarray, Y0: np.ndarray, states: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the starts of some rows on the constraints, and which are: others are as they were."""
        asked, p = self._asked(P[0], Y0[0]), np.tile(self._base_p, (len(P), 1))
        p[:, self._p_at] = P
        none = np.zeros(len(P), dtype=bool)
        try:
            given = start_values.start_values(self.system, p[0], asked.start, asked.rate)
        except RuntimeModelError:  # of one row: each is told by itself
            return states, none
        if plain_assembly.objection(self.system, given.q_enforced):
            return states, none
        starts = plain_assembly.Given(p, states, given.q_enforced, given.v_enforced)
        return plain_assembly.assemble_plain(self.system, starts, self.t_start)

    def _assemble_row(self, i: int, P: np.ndarray, Y0: np.ndarray, states: np.ndarray, runs: Runs) -> bool:
        """Bring the start of a run onto the constraints; returns whether that is possible."""
        try:
            states[i] = self._assembled(P[i], Y0[i])
        except RuntimeModelError as error:
            runs.note(i, here.REFUSED_START, str(error))
            return False
        return True

    def _by_machine(
        self,
        which: np.ndarray,
        P: np.ndarray,
        states: np.ndarray,
        assembled: np.ndarray,
        runs: Runs,
        threads: int,
    ) -> None:
        """Make some of the runs in machine code."""
        piece = max(1, min(ROWS, -(-len(which) // (_PIECES_PER_THREAD * threads))))
        pieces = [which[k : k + piece] for k in range(0, len(which), piece)]

        def make(rows: np.ndarray) -> None:
            machine = machines.get()
            try:
                sizes = self._sizes(rows, P, states)
                machine.make(rows, P, states, assembled, sizes, runs)
            finally:
                machines.put(machine)

        machines: queue.SimpleQueue[Machine] = queue.SimpleQueue()
        machines.put(self._machine)
        threads = min(threads, len(pieces))
        if threads <= 1:
            for rows in pieces:
                make(rows)
            return
        for _ in range(threads - 1):
            machines.put(Machine(self._task))
        with ThreadPoolExecutor(threads) as pool:
            try:
                list(pool.map(make, pieces))
            except KeyboardInterrupt:
                pool.shutdown(cancel_futures=True)
                raise

    def _sizes(self, rows: np.ndarray, P: np.ndarray, states: np.ndarray) -> np.ndarray | None:
        """Return characteristic sizes of runs, shape (n, nv), where machine code cannot find them."""
        if not sizes_need_python(self.system):
            return None
        nq = self.system.nq
        return np.array(
            [
                levels.Constraints(self.system, self._parameters(P[i]), self.t_start).characteristic_sizes(
                    states[i, :nq]
                )
                for i in rows
            ]
        )

    def _by_python(self, i: int, p: np.ndarray, y0: np.ndarray, runs: Runs) -> None:
        """Make one run as `System.run` does, and note what became of it."""
        try:
            solution = self._solution(p, y0)
        except RuntimeModelError as error:
            runs.note(i, here.REFUSED_START, str(error))
            return
        runs.t[i], runs.steps[i] = solution.t[-1], solution.stats["steps"]
        code = {"success": here.SUCCESS, "terminated": here.TERMINATED, "zeno": here.ZENO}.get(
            solution.status, here.FAILED
        )
        if solution.status == "interrupted":
            raise KeyboardInterrupt
        runs.note(i, code, solution.message)
        if code < 0 or code == here.ZENO:
            return
        if self.output == "times":
            there = self.times <= solution.t[-1]
            runs.y[i, there] = solution.states[np.searchsorted(solution.t, self.times[there])]
        else:
            runs.y[i] = solution.states[-1]
        if self.checks != "none":
            # Where steps are coarse, a motion may be far off though its energy and equations say nothing.
            fine = find_method(solution.method).adaptive and solution.rtol <= _FINE
            full = self.checks == "full" or not fine
            found = (health.objections_to if full else health.objections_without_companions)(solution)
            if found:
                runs.note(i, here.DOUBTFUL, "; ".join(f"{entry.check}: {entry.says}" for entry in found))

    def _reason(self, p: np.ndarray, y0: np.ndarray) -> str:
        """Return why a run fails."""
        try:
            return self._solution(p, y0).message
        except RuntimeModelError as error:
            return str(error)

    def _name_bad_numbers(self, P: np.ndarray, Y0: np.ndarray, runs: Runs) -> None:
        for i in np.flatnonzero(runs.status == here.NOT_FINITE_INPUT):
            for name, values, names in (("p", P[i], self.parameters), ("y0", Y0[i], self.start)):
                for k in np.flatnonzero(~np.isfinite(values)):
                    runs.note(
                        i, here.NOT_FINITE_INPUT, f"{name}: {names[k]!r} is {values[k]}: give a finite number"
                    )


_FLOAT = np.dtype(float)


def _as_numbers(name: str, values: Any, shape: tuple[int, ...], names: Sequence[str]) -> np.ndarray:
    """Return float64 numbers of a shape, or say what was expected."""
    found = np.asarray(values)
    if found.dtype.kind not in "fiub":
        raise RuntimeModelError(
            f"{name} cannot be read as numbers: it holds {found.dtype}; give values in SI units"
        )
    if found.shape != shape:
        rows = " of each row" if len(shape) == 2 else ""
        few = ", ".join(names[:6]) + (", …" if len(names) > 6 else "")
        raise RuntimeModelError(
            f"{name} has shape {found.shape}, but {len(names)} value{'s' * (len(names) != 1)}{rows} are expected"
            + (f": {few}" if names else "")
        )
    return np.ascontiguousarray(found, dtype=float)


def _output_and_times(
    system: System, output: str | Sequence[Quantity], options: RunOptions
) -> tuple[str, np.ndarray]:
    """Return "end", "solution" or "times", and these."""
    if isinstance(output, str):
        if output not in OUTPUTS:
            raise RuntimeModelError(
                f"output is {output!r}: give 'end', 'solution', or the times of the states wanted"
            )
        return output, np.zeros(0)
    times = np.array(replace(options, t_eval=tuple(output), fps=None).for_model(system).t_eval, dtype=float)
    if not len(times):
        raise RuntimeModelError("output names no times: give some, or 'end'")
    return "times", times


def _parameter_names(
    system: System, asked: Sequence[str] | Mapping[str, Quantity] | None, moving: Mapping[Any, Any]
) -> tuple[str, ...]:
    over_time = {name for key in moving for name in (key if isinstance(key, tuple) else (key,))}
    if asked is None:
        return tuple(
            record["name"]
            for record in (*system.parameters, *system.inputs)
            if record["name"] not in over_time | _sought(system)
        )
    if isinstance(asked, str):
        asked = (asked,)
    names = tuple(asked)
    _refuse_repeated("parameters", names)
    for name in names:
        if name in over_time:
            raise RuntimeModelError(
                f"parameters: {name!r} is an input over time in these runs, and cannot be a number in `p`"
            )
    return names


def _sought(system: System) -> set[str]:
    """The parameters that the model's start looks for."""
    return {system.parameters[k]["name"] for k in (system.start or {}).get("find", ())}


def _start_names(
    system: System, asked: Sequence[str] | Mapping[str, Quantity] | None
) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the names of what starts hold, and where in (q, v) that is."""
    coordinates = {record["name"]: k for k, record in enumerate(system.coordinates)}
    labels = rate_labels(system.coordinates, system.rates)
    if asked is None:
        shown = [name for name, k in coordinates.items() if k not in system.integrals]
        places = [*(coordinates[name] for name in shown), *range(system.nq, system.nq + system.nv)]
        if system.start is None:
            return (*shown, *labels), np.array(places, dtype=np.int64)
        # Guesses follow from what the model says of its start.
        given = np.concatenate(system.initial_state()[2:])
        held = [(name, k) for name, k in zip((*shown, *labels), places) if given[k]]
        return tuple(name for name, _ in held), np.array([k for _, k in held], dtype=np.int64)
    names = (asked,) if isinstance(asked, str) else tuple(asked)
    _refuse_repeated("start", names)
    rates, places = rate_indices(system.coordinates, system.rates, system.quaternions), []
    for name in names:
        if name in coordinates:
            places.append(coordinates[name])
        elif inside_dot(name) in rates:
            places.append(system.nq + rates[inside_dot(name)])
        else:
            known = [*coordinates, *labels]
            raise UnknownNameError(
                f"start: model {system.name!r} has no coordinate or rate {name!r}: {nearest(name, known)}"
            )
    return names, np.array(places, dtype=np.int64)


def _refuse_repeated(option: str, names: tuple[str, ...]) -> None:
    for name in names:
        if not isinstance(name, str):
            raise RuntimeModelError(f"{option}: {name!r} is no name; name what each call gives values of")
        if names.count(name) > 1:
            raise RuntimeModelError(f"{option}: {name!r} is named twice")


def _refuse_not_finite(what: str, values: np.ndarray) -> None:
    if not np.isfinite(values).all():
        raise RuntimeModelError(f"{what} holds a value that is not finite")
