"""Integrate a model: consistent start, method, run, energy and constraints checked."""

from __future__ import annotations

import operator
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.inertia import refuse_negative_inertia
from symgen.runtime.choose import EXPLICIT, SERIES, choose_constraints, choose_method, choose_step
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.constraints.start_values import Assembly, moved_notes, start_values
from symgen.runtime.driver import Run
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.kept_arrays import borrow, give_back, load
from symgen.runtime.lazy import Late
from symgen.runtime.options import SMALLEST_RTOL, RunOptions, early_times, with_early_frames
from symgen.runtime.record import record
from symgen.runtime.remembered import LARGEST, remembered
from symgen.runtime.summary import summarise
from symgen.runtime.timing.timetable import make_timetable

if TYPE_CHECKING:
    from symgen.runtime.frame_grid import FrameGrid
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System
    from symgen.runtime.timing.timetable import Timetable

constrained = Late("symgen.runtime.constraints.assembly")
drive = Late("symgen.runtime.inputs.drive")
frame_window = Late("symgen.runtime.frame_window")
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


@record(eq=False)
class _Opening:
    """All that model and options settle before a run begins. Nothing in it is changed.

    Attributes
    ----------
    system : System
        With its inputs over time, where there are any.
    p, state : ndarray, shapes (n_p,), (nq + nv,)
    redundant : list of str
        Constraints that follow from others at the start.
    notes : list of str
    choice : Choice
    rtol : float
        Not below round-off.
    times, shown : ndarray, shape (n,)
        Times of frames [s], and whether the user asked for them; of the first ones, where there is a `grid`.
    grid : FrameGrid or None
        All frames, where they are too many to be held at once.
    timetable : Timetable or None
    level : float [J]
        The energy that rates are scaled to; nan: they are not.
    is_moved : bool
        Whether there are inputs over time.
    """

    system: System
    p: np.ndarray
    state: np.ndarray
    redundant: list[str]
    notes: list[str]
    choice: Choice
    rtol: float
    times: np.ndarray
    shown: np.ndarray
    grid: FrameGrid | None
    timetable: Any
    level: float
    is_moved: bool


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
    began = time.perf_counter()
    opening = _opening_of(system, options, choice, began)
    if not isinstance(opening, _Opening):
        return opening
    if len(options.at) or type(options.t_end) is not float:
        options = options.for_model(system)  # else all that this looks at was looked at when it was opened
    if options.rtol < opening.rtol:
        options = replace(options, rtol=opening.rtol)
    system, choice, timetable = opening.system, opening.choice, opening.timetable
    method, step, notes = choice.method, choice.step, list(opening.notes)
    arrays = borrow(
        system, method, opening.p, options.t_start, opening.state, frame_times=opening.times, rtol=options.rtol,
        atol=options.atol, step=step, energy_level=opening.level, opening=opening,
    )  # fmt: skip
    recorder = options.recorder
    if recorder is not None:
        asked = {
            **({"step": step} if step else {}),
            **(timetable.settings if timetable is not None else {}),
            "t_start": options.t_start, "t_end": options.t_end, "fps": options.fps,
            "at": [float(t) for t in options.at], "redundant": list(opening.redundant), "notes": notes,
        }  # fmt: skip
        recorder = options.recorder_for(system, opening.p, method.name, choice.treatment, asked)
    window = None
    if opening.grid is not None:
        window = frame_window.FrameWindow(system, opening.grid)
        arrays.home = None  # their frames are not those of the next run
    run = Run(
        system, method, arrays, opening.shown if window is None else opening.shown.copy(), options.stops,
        recorder=recorder, progress=options.progress, max_steps=options.max_steps,
        fallback=METHODS[EXPLICIT] if options.method == "auto" and method.name == SERIES else None,
        inputs=_schedule(system, arrays, method, options.t_start) if opening.is_moved else None,
        timetable=timetable, window=window,
    )  # fmt: skip
    prepared = time.perf_counter()
    load(arrays, opening)
    compiled = time.perf_counter()
    run.go()
    seconds = {"prepare": prepared - began, "compile": compiled - prepared, "run": run.seconds}
    settings = {
        "method": method.name, "constraints": choice.treatment, "rtol": options.rtol, "atol": options.atol,
        "t_start": options.t_start, "t_end": options.t_end, "step": step or None,
        "redundant": list(opening.redundant),
    }  # fmt: skip
    solution = summarise(run, options.at, [*notes, *run.notes], seconds, settings)
    give_back(arrays)
    return solution


_MOST_OPENINGS = 32
_PLAIN = {float, int, bool, str, np.float64, type(None)}
# What a run begins with does not depend on the others.
_asked = operator.attrgetter(
    *(
        name
        for name in RunOptions.__dataclass_fields__
        if name not in ("progress", "recorder", "max_steps", "at", "breaks")
    )
)


def _opening_of(
    system: System, options: RunOptions, choice: Choice | None, began: float
) -> _Opening | Solution:
    """Return `_open`, or what it returned the last time that the same was asked of the same model."""
    is_alone = choice is None and (options.split is False or not system.subsystems)
    key = _key(options) if is_alone and system.nq <= LARGEST else None
    known = vars(system).setdefault("_openings", {})
    opening = None if key is None else known.get(key)
    if opening is not None:
        return opening
    opening = _open(system, options, choice, began)
    if key is not None and opening.system.is_repeatable and opening.timetable is None:
        if len(known) >= _MOST_OPENINGS:
            known.clear()
        known[key] = opening
    return opening


def _key(options: RunOptions) -> tuple | None:
    """Return options as a key; None where some are more than numbers, text, or collections of these, or steps keep to
    times.
    """
    if len(options.breaks):
        return None
    values = _asked(options)
    kinds = tuple(map(type, values))
    if not _PLAIN.issuperset(kinds):
        values = tuple(value if type(value) in _PLAIN else _collected(value) for value in values)
        if NotImplemented in values:
            return None
    return kinds, values  # 0 and False are equal, and not the same to some options


def _collected(value: Any) -> Any:
    """Return a collection of numbers and text as text, in which -0.0 is not 0.0; NotImplemented for anything else."""
    if isinstance(value, Mapping):
        parts = [part for item in value.items() for part in item]
    elif type(value) in (tuple, list):
        parts = value
    else:
        return NotImplemented
    return repr(parts) if _PLAIN.issuperset(map(type, parts)) else NotImplemented


def _open(system: System, options: RunOptions, choice: Choice | None, began: float) -> _Opening | Solution:
    """Return what a run begins with; of one that is split the result, as each part begins by itself."""
    options = options.for_model(system)
    moving, constant = split_inputs(system, {**(options.inputs or {})}, options.parameters or {})
    p = system.parameter_values({**(options.parameters or {}), **constant})
    if moving:
        system = drive.drive(system, moving, p, options.t_start, options.t_end)
    form = choose_constraints(options.constraints, system, options.method) if choice is None else None
    remembered(system, ("values", p.tobytes()), lambda: system.refuse_values(p) or True)
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
    notes = [*found, *moved_notes(assembly.moved), *assembly.notes]
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
    notes += choice.notes
    timetable = make_timetable(system, p, choice.method, options)
    if timetable is not None:
        notes += timetable.notes
    times, shown, grid = _frames(system, options, timetable, options.frame_grid(system.ny))
    wanted, method = options.energy_scaling, choice.method
    level = remembered(
        system,
        ("energy level", *start, wanted, method.name, choice.treatment),
        lambda: choose_energy_level(wanted, system, method, p, options.t_start, state),
    )
    return _Opening(
        system, p, state, assembly.redundant, notes, choice, options.rtol, times, shown, grid, timetable, level,
        bool(moving),
    )  # fmt: skip


def _frames(
    system: System, options: RunOptions, timetable: Timetable | None, grid: FrameGrid | None
) -> tuple[np.ndarray, np.ndarray, FrameGrid | None]:
    """Return the frames of a run and which of them were asked for; of a `grid` the first ones, and the whole of it."""
    ends_early = any(event["action"] == "terminate" for event in system.events)
    if grid is None:
        times, shown = options.frame_times(system.ny)
        if timetable is not None:
            times, shown = timetable.with_frames(times, shown)
        return *(with_early_frames(times, shown) if ends_early else (times, shown)), None
    if timetable is not None:
        grid = grid.with_more(timetable.in_pulses(grid.t_start, grid.t_end, grid.spacing))
    if ends_early:
        grid = grid.with_more(early_times(grid.t_start, grid.t_end))
    return *frame_window.first_of(grid, system.ny), grid


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
