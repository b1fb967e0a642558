"""Integrate a model: consistent start, method, run, energy and constraints checked."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.inertia import refuse_negative_inertia
from symgen.runtime.choose import EXPLICIT, SERIES, choose_constraints, choose_method, choose_step
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.constraints.start_values import Assembly, start_values
from symgen.runtime.driver import Run
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.options import SMALLEST_RTOL, RunOptions
from symgen.runtime.record import record
from symgen.runtime.remembered import remembered
from symgen.runtime.summary import summarise
from symgen.runtime.timing.timetable import make_timetable

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

constrained = Late("symgen.runtime.constraints.assembly")
drive = Late("symgen.runtime.inputs.drive")
given = Late("symgen.runtime.inputs.given")
schedule = Late("symgen.runtime.inputs.schedule")
start_conditions = Late("symgen.runtime.constraints.start_conditions")
subsystem_runs = Late("symgen.runtime.subsystems.simulate")


@record
class Choice:
    """What a run was left to choose: it can be made once for many runs.

    Attributes
    ----------
    method : Method
    step : float [s]
        Of a method of fixed step, else 0.
    treatment : str
        How constraints are treated.
    notes : list of str
        What was chosen, and why.
    """

    method: Method
    step: float
    treatment: str
    notes: list[str]


def choose(
    system: System,
    p: np.ndarray,
    state: np.ndarray,
    options: RunOptions,
    form: tuple[str, Method | None, list[str]],
) -> Choice:
    """Choose the method and the step of a run that is not split.

    Parameters
    ----------
    state : ndarray, shape (nq + nv,)
        Consistent initial state.
    form : tuple
        From `choose_constraints`.
    """
    treatment, method, notes = form
    if method is None:
        start = options.t_start, p.tobytes(), state.tobytes()
        key = ("method", *start, options.method, options.rtol, options.atol)
        method, more = remembered(system, key, lambda: choose_method(system, p, state, options))
        notes = [*notes, *more]
    step, more = choose_step(method, system, p, state, options)
    return Choice(method, step, treatment, [*notes, *more])


def simulate(system: System, options: RunOptions, choice: Choice | None = None) -> Solution:
    """Integrate `system` as `options` say.

    Parameters
    ----------
    system : System
    options : RunOptions
    choice : Choice, optional
        One that was made before; the run is not split then.

    Returns
    -------
    Solution
        Also where the run failed: see its `status` and `message`.

    Raises
    ------
    RuntimeModelError
        An option does not fit the model, or the initial conditions contradict the constraints.
    """
    options = options.for_model(system)
    moving, constant = split_inputs(system, {**(options.inputs or {})}, options.parameters or {})
    p = system.parameter_values({**(options.parameters or {}), **constant})
    if moving:
        system = drive.drive(system, moving, p, options.t_start, options.t_end)
    form = choose_constraints(options.constraints, system, options.method) if choice is None else None
    began = time.perf_counter()
    p, found = found_parameters(system, p, options)
    assembly = consistent_start(system, p, options)
    state = np.concatenate([assembly.q, assembly.v])
    start = options.t_start, p.tobytes(), state.tobytes()
    remembered(
        system,
        ("inertia", *start),
        lambda: refuse_negative_inertia(system, p, options.t_start, state) or True,
    )
    if moving:
        schedule.first_samples(system, p, options.t_start, state)
    notes = [*found, *_moved_notes(assembly.moved), *assembly.notes]
    if system.balances:
        notes.append(f"without inertia, where the forces on it balance: {', '.join(system.balances)}")
    if moving:
        notes += system.input_notes
    if options.rtol < SMALLEST_RTOL:
        notes.append(f"rtol: {SMALLEST_RTOL:.1e} instead of {options.rtol:.1e}, which is below round-off")
        options = replace(options, rtol=SMALLEST_RTOL)
    if choice is None:
        if options.split is not False and system.subsystems:
            solution = subsystem_runs.simulate_subsystems(
                system,
                p,
                state,
                options,
                form[0],
                redundant=assembly.redundant,
                notes=[*notes, *form[2]],
                began=began,
            )
            if not isinstance(solution, str):
                return solution
            notes.append(f"subsystems: integrated as one, because {solution}")
        choice = choose(system, p, state, options, form)
    method, step, treatment = choice.method, choice.step, choice.treatment
    notes += choice.notes
    timetable = make_timetable(system, p, method, options)
    times, shown = options.frame_times(system.ny)
    if timetable is not None:
        notes += timetable.notes
        times, shown = timetable.with_frames(times, shown)
    wanted = options.energy_scaling
    level = remembered(
        system,
        ("energy level", *start, wanted, method.name, treatment),
        lambda: choose_energy_level(wanted, system, method, p, options.t_start, state),
    )
    arrays, give_back = _arrays(system, method, p, state, times, options, step, level)
    asked = {
        **({"step": step} if step else {}),
        **(timetable.settings if timetable is not None else {}),
        "t_start": options.t_start, "t_end": options.t_end, "fps": options.fps, "at": [float(t) for t in options.at],
        "redundant": assembly.redundant, "notes": notes,
    }  # fmt: skip
    run = Run(
        system, method, arrays, shown, options.stops,
        recorder=options.recorder_for(system, p, method.name, treatment, asked),
        progress=options.progress, max_steps=options.max_steps,
        fallback=METHODS[EXPLICIT] if options.method == "auto" and method.name == SERIES else None,
        inputs=_schedule(system, arrays, method, options.t_start) if moving else None,
        timetable=timetable,
    )  # fmt: skip
    prepared = time.perf_counter()
    arrays.load()
    compiled = time.perf_counter()
    run.go()
    seconds = {"prepare": prepared - began, "compile": compiled - prepared, "run": run.seconds}
    settings = {
        "method": method.name, "constraints": treatment, "rtol": options.rtol, "atol": options.atol,
        "t_start": options.t_start, "t_end": options.t_end, "step": step or None, "redundant": assembly.redundant,
    }  # fmt: skip
    solution = summarise(run, options.at, [*notes, *run.notes], seconds, settings)
    give_back()
    return solution


_MOST_KEPT, _LARGEST_KEPT = 8, 200_000  # kinds of arrays that a model keeps, numbers in their frames


def _arrays(
    system: System,
    method: Method,
    p: np.ndarray,
    state: np.ndarray,
    times: np.ndarray,
    options: RunOptions,
    step: float,
    level: float,
) -> tuple[LoopArrays, Callable[[], None]]:
    """Return the arrays of a run, those of a run before it where that was of the same kind, and what keeps them for
    another one.
    """
    tolerances = {"rtol": options.rtol, "atol": options.atol, "step": step}
    plain = not (system.events or system.input_descriptions) and times.size * system.ny <= _LARGEST_KEPT
    kept: deque[LoopArrays] = deque(maxlen=1)
    if plain:
        key = (id(method), times.tobytes(), *tolerances.values(), np.isfinite(level))
        kinds = vars(system).setdefault("_kept_arrays", {})
        if len(kinds) >= _MOST_KEPT:
            kinds.clear()
        kept = kinds.setdefault(key, kept)
    try:
        arrays = kept.pop()
        arrays.begin_again(system, method, p, options.t_start, state, level)
    except IndexError:
        arrays = LoopArrays(
            system, method, p, options.t_start, state, frame_times=times, energy_level=level, **tolerances
        )

    def give_back() -> None:
        if plain and arrays.generation == 0:
            kept.append(arrays)

    return arrays, give_back


def found_parameters(system: System, p: np.ndarray, options: RunOptions) -> tuple[np.ndarray, list[str]]:
    """Return the parameters with those that the model's start determines, and notes of what they are."""
    if system.start is None:
        return p, []
    given = {*(options.parameters or {})}
    return start_conditions.with_found(system, p, given, options.start, options.rate, options.t_start)


def consistent_start(system: System, p: np.ndarray, options: RunOptions) -> Assembly:
    """Return consistent initial conditions."""
    if system.m or system.start is not None:
        return constrained.assemble(system, p, options.start, options.rate, options.t_start)
    given = start_values(system, p, options.start, options.rate)
    return Assembly(given.q, given.v, notes=given.notes)


def split_inputs(
    system: System, inputs: dict[Any, Any], parameters: Mapping[str, float | str]
) -> tuple[dict[Any, Any], dict[Any, float | str]]:
    """Return inputs over time, those of the model included where nothing else is said, and constant ones."""
    own = [record for record in system.inputs if "table" in record or "polynomial" in record]
    if not own and all(type(value) in (int, float) for value in inputs.values()):
        return {}, inputs
    said = {name for key in (*inputs, *parameters) for name in (key if isinstance(key, tuple) else (key,))}
    moving = {record["name"]: given.from_record(record) for record in own if record["name"] not in said}
    moving |= {key: value for key, value in inputs.items() if not given.is_constant(value)}
    return moving, {key: value for key, value in inputs.items() if given.is_constant(value)}


def _schedule(system: System, arrays: LoopArrays, method: Method, t_start: float) -> Any:
    return schedule.InputSchedule(system, arrays, method, t_start)


def _moved_notes(moved: Sequence[tuple[str, float, float]]) -> list[str]:
    notes = []
    for name, before, after in moved:
        digits = next(
            (k for k in (9, 12, 17) if f"{before:.{k}g}" != f"{after:.{k}g}"), 17
        )  # those that differ
        notes.append(f"assembly moved {name} from {before:.{digits}g} to {after:.{digits}g}")
    return notes
