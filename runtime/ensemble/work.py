"""Some members at once: their starts, their runs in lanes or one after another, and what is wanted of them."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble import beside, member, wound
from symgen.runtime.ensemble.batch import RESULTS, BatchResult, LaneBatch
from symgen.runtime.ensemble.evaluate import evaluate_members
from symgen.runtime.ensemble.single import UNSUITED, give_up, run_single, runs_alone
from symgen.runtime.ensemble.starts import no_models, without_inertia
from symgen.runtime.ensemble.switched import SwitchedBatch, make_batch
from symgen.runtime.ensemble.verdict import NO_START, RUN_FAILED, Verdicts, verdicts_of
from symgen.runtime.errors import RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late
from symgen.runtime.prepared import layout as prepared_runs
from symgen.runtime.record import record
from symgen.runtime.solution import series_of

if TYPE_CHECKING:
    from symgen.runtime.ensemble.gpu.batch import DeviceBatch
    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.prepared.prepared import PreparedRun
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

device = Late("symgen.runtime.ensemble.gpu.device")
health = Late("symgen.runtime.checks.health")
preparing = Late("symgen.runtime.prepared.prepared")

ENERGY = "energy"
_FUNCTIONS = {"outputs": "outputs", "accelerations": "rhs", "multipliers": "rhs", ENERGY: "energy"}
_LOOKED_AT_AGAIN = 8
_JUDGED = ("energy", "finite", "constraint position", "stops", "windings")
_FRAMES_JUDGED = 65  # of a member that a second run beside it judges
_HELD = 2  # plans that a thread keeps lanes of
_own = threading.local()
# Lanes, and the plan whose ensemble they run for: several ensembles may run at the same time, in threads of their own.
_running: weakref.WeakKeyDictionary[LaneBatch | SwitchedBatch | DeviceBatch, Plan] = (
    weakref.WeakKeyDictionary()
)
_of_all = threading.Lock()  # for what is added while another thread goes through them


@record(eq=False)
class Part:
    """Some members after their runs.

    Attributes
    ----------
    first : int
        The number of the first one.
    series : dict of str to ndarray, shape (k, F), or (k,) where only the end counts
    verdicts : Verdicts
    messages : dict of int to str
        Why members failed that could not begin, or ran by themselves; by number.
    """

    first: int
    series: dict[str, np.ndarray]
    verdicts: Verdicts
    messages: dict[int, str]


def run_part(plan: Plan, names: Sequence[str], first: int, last: int) -> Part:
    """Run members from `first` up to, not including, `last`, and return series by name; failed ones have no numbers."""
    states, parameters, verdicts, messages = run_members(plan, first, last)
    states = np.where((verdicts.status == at.REACHED_STOP)[:, None, None], states, np.nan)
    times = plan.frame_times if len(plan.frame_times) else np.array([plan.single.t_end])
    found = _series_over_inputs(plan, names, first, parameters, times, states)
    if not len(plan.frame_times):
        found = {name: values[:, 0] for name, values in found.items()}
    return Part(first, found, verdicts, messages)


def _series_over_inputs(
    plan: Plan, names: Sequence[str], first: int, parameters: np.ndarray, times: np.ndarray, states: np.ndarray
) -> dict[str, np.ndarray]:  # fmt: skip
    """Return `series` with the inputs of each instant, where lanes have them over time."""
    breaks = plan.settings.breaks if plan.settings is not None else None
    if breaks is None or breaks.places is None or all(is_state(plan.system, name) for name in names):
        return series(plan.system, names, parameters, times, states)
    numbers = np.arange(first, first + len(parameters))
    found = [
        series(
            plan.system,
            names,
            breaks.values_at(t, numbers, parameters),
            times[k : k + 1],
            states[:, k : k + 1],
        )
        for k, t in enumerate(times)
    ]
    return {name: np.concatenate([part[name] for part in found], axis=1) for name in names}


def run_members(plan: Plan, first: int, last: int) -> tuple[np.ndarray, np.ndarray, Verdicts, dict[int, str]]:
    """Return states, shape (k, F, ny), parameters, verdicts and messages of members."""
    parameters, varied = plan.members.arrays(plan.p, first, last)
    states, verdicts, messages = _run(plan, first, parameters, varied)
    if beside.has_companion(plan):
        sound = np.flatnonzero((verdicts.status == at.REACHED_STOP) & verdicts.ok)
        wrong = beside.wrong_members(
            plan, first, parameters, varied, states, verdicts.steps, sound, _states_and_ends, _is_off
        )
        verdicts.ok[wrong] = False
    return states, parameters, verdicts, messages


def _is_off(plan: Plan, number: int) -> bool:
    """Whether the health report of a member says that its motion is off."""
    return any(entry.check == "accuracy" for entry in health.objections_to(member.member_again(plan, number)))


def _states_and_ends(plan: Plan, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Return states of members of another plan, shape (k, F, ny), and which of them came to the end."""
    states, verdicts, _ = _run(plan, first, *plan.members.arrays(plan.p, first, last))
    return states, verdicts.status == at.REACHED_STOP


def _run(
    plan: Plan, first: int, parameters: np.ndarray, varied: dict[str, np.ndarray]
) -> tuple[np.ndarray, Verdicts, dict[int, str]]:
    """Return states, shape (k, F, ny), verdicts by what the runs themselves tell, and messages."""
    if plan.settings is None:
        return _one_by_one(plan, first, parameters, varied)
    starts, failures = plan.starts.of(parameters, varied)
    if plan.members.vary_parameters:
        sound = plan.first_parameters, plan.first_state
        massless = without_inertia(plan.system, plan.single.t_start, parameters, starts, sound)
        refused = {**massless, **no_models(plan.system, parameters)}
        failures = {**refused, **failures}
        starts[list(refused)] = np.nan
    result = _run_in_lanes(plan, first, parameters, starts)
    verdicts = verdicts_of(plan, result.columns)
    suspected = wound.suspected(plan, first, parameters, result.frames)
    states = wound.frames_of(plan, result.frames) if len(plan.frame_times) else result.end[:, None]
    messages = {first + k: message for k, message in failures.items()}
    for k in failures:
        verdicts.status[k], verdicts.ok[k] = NO_START, False
    _look_again(plan, first, verdicts)
    for k in suspected:
        verdicts.ok[k] = bool(verdicts.ok[k]) and not wound.jumps(plan, first + int(k))
    for_single_runs = runs_alone(plan)
    if for_single_runs:
        for k in np.flatnonzero(np.isin(verdicts.status, for_single_runs)):
            here = {name: float(values[k]) for name, values in varied.items()}
            messages |= _take_single(plan, first + int(k), parameters[k], here, states[k], verdicts, int(k))
    return states, verdicts, messages


def _run_in_lanes(plan: Plan, first: int, parameters: np.ndarray, starts: np.ndarray) -> BatchResult:
    batch, numbers = _batch(plan), np.arange(first, first + len(starts))
    breaks = plan.settings.breaks
    if breaks is None or plan.options.device != "cpu":
        return batch.run(parameters, starts)
    at_once = breaks.most_at_once
    parts = [
        batch.run(parameters[k : k + at_once], starts[k : k + at_once], numbers[k : k + at_once])
        for k in range(0, len(starts), at_once)
    ]
    return BatchResult(*(np.concatenate([getattr(part, name) for part in parts]) for name in RESULTS))


def _look_again(plan: Plan, first: int, verdicts: Verdicts) -> None:
    """Judge members again whose work may be what is off, not their motion: steps are not chosen for the work.

    So it is with gaps of stops that have come near to what is allowed below zero.

    Single runs integrate it along their frames then. Where that acquits the first ones of a part, it does all of them.
    """
    if not (plan.system.nw or plan.system.switches):
        return
    doubtful = np.flatnonzero((verdicts.status == at.REACHED_STOP) & ~verdicts.ok)
    acquitted = 0
    for k in doubtful[:_LOOKED_AT_AGAIN]:
        if _objects(member.member_again(plan, first + int(k))):
            continue
        verdicts.ok[k] = True
        acquitted += 1
    if acquitted == _LOOKED_AT_AGAIN:
        verdicts.ok[doubtful] = True


def _objects(solution: Solution) -> bool:
    """Whether the health report of a run objects to what verdicts are about."""
    return any(entry.check in _JUDGED for entry in health.objections_without_companions(solution))


def _batch(plan: Plan) -> LaneBatch | SwitchedBatch | DeviceBatch:
    """The thread's own lanes, or its own stream of a device."""

    def made() -> LaneBatch | SwitchedBatch | DeviceBatch:
        make = device.make_batch if plan.options.device != "cpu" else make_batch
        batch = make(plan.system, wound.with_watched(plan))
        with _of_all:
            _running[batch] = _own.__dict__.get("ensemble", plan)
        return batch

    return _of_thread("batches", plan, made)


def _of_thread(kind: str, plan: Plan, make: Callable[[], Any]) -> Any:
    """Return what the thread has made for a plan: of the last ones, as a plan and its half step take turns."""
    held = _own.__dict__.setdefault(kind, [])
    for known, made in held:
        if known is plan:
            return made
    held.insert(0, (plan, make()))
    del held[_HELD:]
    return held[0][1]


def work_for(plan: Plan) -> None:
    """Let a thread run members of a plan, and of what is run beside it, until it ends."""
    _own.ensemble = plan


def stop_all(plan: Plan) -> None:
    """Let all members of a plan that are under way be given up: those in lanes, and those that run by themselves."""
    give_up(plan)
    with _of_all:
        batches = [batch for batch, ensemble in _running.items() if ensemble is plan]
    for batch in batches:
        batch.stop()


def _one_by_one(
    plan: Plan, first: int, parameters: np.ndarray, varied: dict[str, np.ndarray]
) -> tuple[np.ndarray, Verdicts, dict[int, str]]:
    n = len(parameters)
    states = np.full((n, max(len(plan.frame_times), 1), plan.system.ny), np.nan)
    verdicts, messages = Verdicts.empty(n), {}
    verdicts.singly[:] = True
    prepared = None if plan.inputs_differ or beside.judged_alone(plan) else _prepared(plan)
    # What ends before its time stays where it is: frames behind that are for single runs.
    ends = any(event["action"] == "terminate" for event in plan.system.events)
    if prepared is not None and not prepared.why_python and not (ends and len(plan.frame_times)):
        messages = _take_prepared(prepared, first, parameters, varied, states, verdicts)
        return states, verdicts, messages
    for k in range(n):
        here = {name: float(values[k]) for name, values in varied.items()}
        messages |= _take_single(plan, first + k, parameters[k], here, states[k], verdicts, k)
    return states, verdicts, messages


def _prepared(plan: Plan) -> PreparedRun:
    """The thread's own prepared run of the model, by the member that choices are made by, whoever comes first here."""

    def made() -> PreparedRun:
        start, rate = plan.starts.given(plan.starts.of_one)
        known = {record["name"] for record in plan.system.coordinates}
        rates = {name if name not in known else f"dot({name})": value for name, value in rate.items()}
        options = replace(plan.single, parameters=None, start=None, rate=None, inputs=plan.inputs or None)
        return preparing.PreparedRun(
            plan.system, options, parameters=plan.single_parameters(plan.first_parameters), start={**start, **rates},
            output=list(plan.frame_times) if len(plan.frame_times) else "end", checks="end",
        )  # fmt: skip

    return _of_thread("prepared", plan, made)


def _take_prepared(
    prepared: PreparedRun, first: int, parameters: np.ndarray, varied: dict[str, np.ndarray], states: np.ndarray,
    verdicts: Verdicts,
) -> dict[int, str]:  # fmt: skip
    """Run members one after another in machine code; returns why some failed, by their number."""
    system = prepared.system
    rows = parameters[:, [system.place_of_parameter(name) for name in prepared.parameters]]
    starts = np.tile(prepared.nominal_start, (len(rows), 1))
    for name, values in varied.items():
        starts[:, prepared.start.index(name)] = values
    runs = prepared.many(rows, starts)
    n = system.nq + system.nv
    states[:, :, :n] = runs.y.reshape(len(rows), -1, n)
    verdicts.steps[:] = runs.steps
    verdicts.energy_error[:] = np.nan
    failed = ~np.isin(runs.status, (prepared_runs.SUCCESS, prepared_runs.TERMINATED, prepared_runs.DOUBTFUL))
    verdicts.ok[:] = runs.ok & ~failed
    verdicts.status[:] = np.where(failed, RUN_FAILED, at.REACHED_STOP)
    states[failed] = np.nan
    return {first + int(k): runs.message(int(k)) for k in np.flatnonzero(failed)}


def _take_single(
    plan: Plan, number: int, p: np.ndarray, varied: dict[str, float], states: np.ndarray, verdicts: Verdicts, k: int
) -> dict[int, str]:  # fmt: skip
    """Run a member by itself, and fill in its states and verdict; returns why it failed, by its number."""
    verdicts.singly[k], left_with = True, int(verdicts.status[k])
    wanted = plan.frame_times if len(plan.frame_times) else np.array([plan.single.t_end])
    alone, times = beside.judged_alone(plan), wanted
    if alone:
        times = np.unique(
            np.append(wanted, np.linspace(plan.single.t_start, plan.single.t_end, _FRAMES_JUDGED))
        )
    try:
        solution = run_single(plan, number, p, varied, times, left_with)
    except RuntimeModelError as error:
        verdicts.status[k], verdicts.ok[k] = NO_START, False
        return {number: str(error)}
    p[:] = solution.p  # with what its start looks for
    verdicts.steps[k] = solution.stats["steps"]
    verdicts.energy_error[k] = solution.energy.unscaled_error
    verdicts.constraint_residual[k] = solution.constraint_residual.max_position
    if solution.status not in ("success", "terminated"):
        verdicts.status[k] = left_with if left_with in UNSUITED else RUN_FAILED  # what lanes say is as true
        verdicts.ok[k] = False
        return {number: solution.message}
    verdicts.status[k] = at.REACHED_STOP
    verdicts.ok[k] = not (health.objections_to(solution) if alone else _objects(solution))
    n = plan.system.nq + plan.system.nv
    # A run that its events end stays where it is.
    rows = np.searchsorted(solution.t, np.minimum(wanted, solution.t[-1]))
    states[:, :n] = solution.states[rows]
    if plan.system.nw:
        states[:, n] = solution.w[rows]
    return {}


def check_names(system: System, names: Sequence[str]) -> None:
    """Refuse names of series that are not there.

    Raises
    ------
    UnknownNameError
    """
    known = series_of(system)
    for name in names:
        place = known.get(name, ("",))[0]
        if place == "outputs" and system.sensed and system.switches:
            raise RuntimeModelError(
                f"outputs of model {system.name!r} need reactions, which stops and friction switch: an ensemble keeps "
                "coordinates and rates"
            )
        if place in ("accelerations", "multipliers") and system.switches:
            raise RuntimeModelError(
                f"{name} of model {system.name!r} depends on what stops and friction hold at each instant: an ensemble "
                f"keeps coordinates, rates and energy; member(k)[{name!r}] has it"
            )
        if name != ENERGY and place in ("", "contact_forces", "input_values"):
            raise UnknownNameError(
                f"model {system.name!r} has no series {name!r} that ensembles keep: {nearest(name, [*known, ENERGY])}"
            )


def is_state(system: System, name: str) -> bool:
    """Whether a series is a coordinate or a rate."""
    return series_of(system).get(name, ("",))[0] in ("q", "v")


def series(
    system: System, names: Sequence[str], parameters: np.ndarray, times: np.ndarray, states: np.ndarray
) -> dict[str, np.ndarray]:
    """Return series by name, shape (k, F) each, of states of shape (k, F, ny)."""
    known, found, rows = series_of(system), {}, {}

    def evaluated(function: str) -> np.ndarray:
        if function not in rows:
            read = states[:, :, : system.nq + system.nv]
            if function == "outputs" and system.sensed:
                solved = evaluated("rhs")
                a = solved[:, :, system.nq : system.nq + system.nv]
                read = np.concatenate([read, a, solved[:, :, system.ny : system.ny + system.m]], axis=2)
            rows[function] = evaluate_members(system, function, parameters, times, np.ascontiguousarray(read))
        return rows[function]

    for name in names:
        place, column = known.get(name, (ENERGY, 0))
        if place in ("q", "v"):
            found[name] = states[:, :, column + (system.nq if place == "v" else 0)]
            continue
        evaluated(function := _FUNCTIONS[place])
        if place == ENERGY:
            found[name] = rows[function].sum(axis=2)
        else:
            offset = {"outputs": 0, "accelerations": system.nq, "multipliers": system.ny}[place]
            found[name] = rows[function][:, :, offset + column]
    return found
