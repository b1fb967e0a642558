"""From what is asked for to what can be run: members, method, settings, and what lanes cannot do."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.inertia import refuse_negative_inertia
from symgen.runtime.choose import EXPLICIT, SERIES, choose_constraints, choose_method, choose_step
from symgen.runtime.code.lower import NoLanes
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.ensemble.batch import BatchSettings, lanes_for
from symgen.runtime.ensemble.intervals import Breaks
from symgen.runtime.ensemble.machine import IMPLICIT, IN_LANES, ON_DEVICES, OVER_EVENTS
from symgen.runtime.ensemble.method_choice import (
    Choice,
    Sample,
    choose_by_looks,
    choose_once,
    numbers_of_sample,
)
from symgen.runtime.ensemble.noises import is_noise
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.sampling import Column, Grid, Members, Sampler, as_mapping
from symgen.runtime.ensemble.settling import has_plain_switches
from symgen.runtime.ensemble.starts import Starts, not_numbers
from symgen.runtime.ensemble.switched import make_batch
from symgen.runtime.errors import Refusal, RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.events_in_code import ACTIONS, has_plain_events
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.large_models import suited_to_size
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.names import inside_dot, rate_indices
from symgen.runtime.options import SMALLEST_RTOL, RunOptions
from symgen.runtime.record import record
from symgen.runtime.timing.timetable import make_timetable

if TYPE_CHECKING:
    from symgen.runtime.inputs.driven import DrivenSystem
    from symgen.runtime.integrate.method import Method
    from symgen.runtime.system import System

device = Late("symgen.runtime.ensemble.gpu.device")
quantities = Late("symgen.runtime.quantities")
drive = Late("symgen.runtime.inputs.drive")
inputs_given = Late("symgen.runtime.inputs.given")
search = Late("symgen.runtime.timing.search")

# Of a constraint's scale, as in `checks/health.py`.
_TRIED = 8  # members that may not be able to begin
_DRIFT_PER_RTOL, _LEAST_DRIFT, _LARGEST_DRIFT = 1e2, 1e-8, 1e-4
_MANY_STEPS = 1 << 21  # of a member: whether more of them get on is for a run of its own to tell
_LOG = 1 << 20  # steps that are kept of a member that is run again


@record(eq=False)
class Plan:
    """An ensemble before it runs.

    Attributes
    ----------
    system : System
    options : EnsembleOptions
    members : Members
    p : ndarray, shape (n_p,)
        What all members go from.
    starts : Starts
    single : RunOptions
        How a member is run by itself, but for what varies.
    method : str
    treatment : str
        Of constraints.
    settings : BatchSettings or None
        For lanes; None where members run one after another.
    frame_times : ndarray, shape (F,) [s]
        Empty where only the end counts.
    residual_limit : float
        Of the constraints, as they are.
    notes : list of str
    first_parameters, first_state : ndarray
        Of the first member.
    inputs : dict
        Inputs over time that are not the model's own, `Noise` among them, with plain numbers.
    own_inputs : frozenset of str
        Inputs over time that the model says.
    choice : Choice or None
        What was chosen for all members by a sample of them; None where the method was given, or the first member told.
    """

    system: System
    options: EnsembleOptions
    members: Members
    p: np.ndarray
    starts: Starts
    single: RunOptions
    method: str
    treatment: str
    settings: BatchSettings | None
    frame_times: np.ndarray
    residual_limit: float
    notes: list[str]
    first_parameters: np.ndarray
    first_state: np.ndarray
    inputs: dict[Any, Any]
    own_inputs: frozenset[str]
    choice: Choice | None = None

    @property
    def inputs_differ(self) -> bool:
        """Whether members have inputs over time of their own."""
        return any(map(is_noise, self.inputs.values()))

    def system_of(self, number: int, p: np.ndarray) -> System:
        """Return the model with the inputs over time of a member."""
        given = self.inputs_of(number) or {}
        over_time = given | _said_by_model(self.system, self.own_inputs - {*given})
        if not over_time:
            return self.system
        return drive.drive(self.system, over_time, p, self.single.t_start, self.single.t_end)

    def inputs_of(self, number: int) -> dict[Any, Any] | None:
        """Return the inputs over time of a member that the model does not say."""
        return (
            _inputs_of(self.inputs, self.options.seed, number, self.single.t_start, self.single.t_end) or None
        )

    def single_parameters(self, p: np.ndarray) -> dict[str, float]:
        """Return the parameters and inputs of a member by name."""
        names = [record["name"] for record in (*self.system.parameters, *self.system.inputs)]
        left_out = self.own_inputs.union(*(key if isinstance(key, tuple) else (key,) for key in self.inputs))
        left_out = left_out.union(self.starts.sought)
        return {name: float(x) for name, x in zip(names, p, strict=False) if name not in left_out}


@record(eq=False)
class _Asked:
    """What an ensemble goes from, once names and values are looked at.

    Attributes
    ----------
    system : System
    options : EnsembleOptions
    columns : list of Column
        What varies.
    moving : dict
        Inputs over time that are not the model's own.
    own : frozenset of str
        Inputs over time that the model says.
    members : Members
    p : ndarray, shape (n_p,)
        What all members go from.
    single : RunOptions
        How a member is run by itself, but for what varies.
    rows, state : ndarray, shape (1, n_p) and (NY,)
        Parameters and start of the first member that can begin.
    starts : Starts
    """

    system: System
    options: EnsembleOptions
    columns: list[Column]
    moving: dict[Any, Any]
    own: frozenset[str]
    members: Members
    p: np.ndarray
    single: RunOptions
    rows: np.ndarray
    starts: Starts
    state: np.ndarray

    @functools.cached_property
    def driven(self) -> DrivenSystem | None:
        """The model with the inputs over time of the first member; None where it has none."""
        return self._driven(0)

    @functools.cached_property
    def driven_as(self) -> Callable[[int], System]:
        """The model with the inputs over time of a member, by its number."""
        if any(map(is_noise, self.moving.values())):
            return functools.cache(lambda number: self._driven(number) or self.system)
        return lambda number: self.driven or self.system

    def _driven(self, number: int) -> DrivenSystem | None:
        single = self.single
        over_time = _inputs_of(self.moving, self.options.seed, number, single.t_start, single.t_end)
        over_time |= _said_by_model(self.system, self.own - {*self.moving})
        if not over_time:
            return None
        return drive.drive(self.system, over_time, self.rows[0], single.t_start, single.t_end)

    @functools.cached_property
    def objection(self) -> str:
        """What neither lanes nor devices can do of it; an empty string where there is nothing."""
        found = _objection(self.system, self.driven)
        if not found and self.system.switches and self.options.device != "cpu":
            return "stops and friction are for processors"
        return found

    def settings(
        self, p: np.ndarray, state: np.ndarray, method: Method, frame_times: np.ndarray, choice: Choice | None
    ) -> tuple[BatchSettings | None, Method, str, list[str]]:
        """Return settings for lanes by a member, the method that they are for, why there are none, and notes."""
        model = self.driven or self.system
        return _settings(
            model, self.system, p, state, self.single, method, frame_times, self.members.n, choice
        )

    def with_breaks(
        self, p: np.ndarray, method: Method, settings: BatchSettings
    ) -> tuple[BatchSettings | None, str]:
        """Return the settings with what steps land on, or why there are none."""
        breaks, objection = _breaks(
            self.system, self.driven, p, self.columns, self.starts, self.moving, self.single, method, settings,
            self.options,
        )  # fmt: skip
        return (None, objection) if objection else (replace(settings, breaks=breaks), "")


def make_plan(system: System, options: EnsembleOptions, choice: Choice | None = None) -> Plan:
    """Check what is asked for, and choose how to do it.

    Parameters
    ----------
    choice : Choice, optional
        What was chosen for this ensemble before, by another process or for what a store holds.

    Raises
    ------
    RuntimeModelError
        An option does not fit the model; none of the first members can begin.
    """
    asked = _look_at(system, options)
    treatment, _, notes = choose_constraints("auto", system, options.method)
    method, choice, more = _method(asked, choice)
    notes = [*notes, *more]
    frame_times = _frame_times(options, asked.single)
    settings, method, objection, more = _how_in_lanes(asked, method, frame_times, choice)
    notes = [*notes, *more]
    if objection:
        notes.append(f"members run one after another, not in lanes: {objection}")
    if options.device != "cpu":
        device.check(system, settings, objection)
    single = replace(asked.single, method=method.name)
    if settings is not None:
        single = replace(single, step=settings.step or None)
    drift = min(_LARGEST_DRIFT, max(_LEAST_DRIFT, _DRIFT_PER_RTOL * single.rtol))
    return Plan(
        system, options, asked.members, asked.p, asked.starts, single, method.name, treatment, settings,
        frame_times, drift * asked.starts.smallest_scale, notes, asked.rows[0], asked.state, asked.moving,
        asked.own, choice,
    )  # fmt: skip


def _look_at(system: System, options: EnsembleOptions) -> _Asked:
    """Check names and values, and find a member that can begin."""
    columns, fixed, moving = _columns(system, options)
    noisy = any(map(is_noise, moving.values()))
    members = Members(columns, options.n, options.seed, options.design, noisy=noisy)
    single = RunOptions(
        t_end=options.t_end, method=options.method, rtol=max(float(options.rtol), SMALLEST_RTOL),
        atol=options.atol, step=options.step, parameters=fixed["parameters"], start=fixed["start"],
        rate=fixed["rate"], t_start=options.t_start, max_steps=options.max_steps,
        energy_scaling=options.energy_scaling,
    ).for_model(system)  # fmt: skip
    p = system.parameter_values(fixed["parameters"])
    rows, starts, state = _first_that_begins(system, members, p, single.t_start, fixed, columns)
    constant = {*fixed["parameters"], *(c.name for c in columns)}
    own = frozenset(
        r["name"] for r in system.inputs if ("table" in r or "polynomial" in r) and r["name"] not in constant
    )
    return _Asked(system, options, columns, moving, own, members, p, single, rows, starts, state)


def _method(asked: _Asked, choice: Choice | None) -> tuple[Method, Choice | None, list[str]]:
    """Return the method that is asked for or chosen, the choice for all members, and notes."""
    options, system = asked.options, asked.system
    if options.method != "auto":
        method, notes = choose_method(asked.driven or system, asked.rows[0], asked.state, asked.single)
        return method, None, notes
    choice = choice or _choose(asked)
    method, notes = METHODS[choice.method], list(choice.notes)
    if options.device != "cpu" and method.name == SERIES:
        method = METHODS[EXPLICIT]
        notes.append(
            f"{EXPLICIT} on the device: series keep much in memory, and take several times as long there"
        )
    return method, choice, notes


def _how_in_lanes(
    asked: _Asked, method: Method, frame_times: np.ndarray, choice: Choice | None
) -> tuple[BatchSettings | None, Method, str, list[str]]:
    """Return settings for lanes, the method that they are for, why there are none, and notes."""
    if asked.objection:
        return None, method, asked.objection, []
    p, system = asked.rows[0], asked.system
    settings, method, objection, notes = asked.settings(p, asked.state, method, frame_times, choice)
    if settings is not None:
        settings, objection = asked.with_breaks(p, method, settings)
    if len(asked.starts.redundant) > len(system.dependent) and not objection:
        settings, objection = None, "constraints follow from others at the start"
    if asked.options.device != "cpu" and not objection:
        if method.name not in ON_DEVICES:
            settings, objection = None, f"method {method.name} is for processors"
        elif settings.breaks is not None:
            settings, objection = None, "inputs over time, and what steps have to land on, are for processors"
    return settings, method, objection, notes


def _choose(asked: _Asked) -> Choice:
    """Choose method and order for all members by a sample of them."""
    system, members = asked.system, asked.members
    rows, varied = [], {}
    numbers = numbers_of_sample(members.n)
    for number in numbers:
        parameters, values = members.arrays(asked.p, number, number + 1)
        rows.append(parameters[0])
        varied = {name: [*varied.get(name, []), *found] for name, found in values.items()}
    rows = np.array(rows)
    states, failures = asked.starts.of(rows, {name: np.array(found) for name, found in varied.items()})
    sound = [k for k in range(len(rows)) if k not in failures and np.isfinite(states[k]).all()]
    chosen = np.array(numbers)[sound]
    sample = Sample(rows[sound], states[sound], members.n, chosen, lambda k: asked.driven_as(int(chosen[k])))
    found = None
    in_lanes = not asked.objection and asked.options.device == "cpu" and not system.switches
    if in_lanes and sample.tells:

        def settings_for(name: str) -> BatchSettings | None:
            first, state = sample.parameters[0], sample.starts[0]
            settings, method, *_ = asked.settings(first, state, METHODS[name], np.zeros(0), None)
            if settings is None or asked.driven is None:
                return settings
            return asked.with_breaks(first, method, settings)[0]

        found = choose_once(system, sample, asked.single, settings_for)
    return found or choose_by_looks(sample, asked.single)


def _inputs_of(
    inputs: Mapping[Any, Any], seed: int, number: int, t_start: float, t_end: float
) -> dict[Any, Any]:
    """Return the inputs over time of a member: its own course of noise."""
    return {
        name: value.table(name, seed, number, t_start, t_end) if is_noise(value) else value
        for name, value in inputs.items()
    }


def _first_that_begins(
    system: System,
    members: Members,
    p: np.ndarray,
    t: float,
    fixed: Mapping[str, dict[str, Any]],
    columns: Sequence[Column],
) -> tuple[np.ndarray, Starts, np.ndarray]:
    """Return the parameters, shape (1, n_p), of the first member that can begin, the starts of all, and its own.

    Choices for all are made by it: one that cannot begin, at the end of a grid, say, is no reason to run none.

    Raises
    ------
    RuntimeModelError
        The first ones cannot; why the very first one cannot.
    """
    given = {*fixed["parameters"], *(c.name for c in columns if c.place == "parameters")}
    refused: RuntimeModelError | None = None
    for number in range(min(members.n, _TRIED)):
        rows, varied = members.arrays(p, number, number + 1)
        own = {name: values[0] for name, values in varied.items()}
        try:
            for wrong in not_numbers(system, rows).values():
                raise RuntimeModelError(wrong)
            system.refuse_values(rows[0])
            starts = Starts(system, t, rows[0], fixed["start"], fixed["rate"], own, given)
            rows[0] = starts.with_found(rows[0], own)
            state = starts.one(rows[0], own)
            refuse_negative_inertia(system, rows[0], t, state)
        except RuntimeModelError as error:
            if refused is not None and str(error) == str(refused):
                break  # it is no matter of this member
            refused = refused or error
            continue
        return rows, starts, state
    raise refused


def _split_inputs(system: System, options: EnsembleOptions) -> tuple[dict[str, Any], dict[Any, Any]]:
    """Return inputs that are constant over a run, whatever members have, and those over time."""
    constant, moving, units = {}, {}, {r["name"]: r["unit"] for r in system.inputs}
    for name, value in as_mapping(options.inputs).items():
        if not isinstance(name, tuple) and name not in units:
            raise UnknownNameError(
                f"inputs: model {system.name!r} has no input {name!r}: {nearest(str(name), units)}"
            )
        if is_noise(value):
            if isinstance(name, tuple):
                raise RuntimeModelError("inputs: give each input noise of its own")
            moving[name] = value.in_si(name, units[name])
        elif inputs_given.is_constant(value) or isinstance(value, (Sampler, Grid, np.ndarray)):
            constant[name] = value
        else:
            moving[name] = value
    return constant, moving


def _columns(
    system: System, options: EnsembleOptions
) -> tuple[list[Column], dict[str, dict[str, Any]], dict[Any, Any]]:
    """Return what varies, and what all members have, by place; inputs over time."""
    constant, moving = _split_inputs(system, options)
    rates = rate_indices(system.coordinates, system.rates, system.quaternions)
    starts = [*system.coordinates, *(system.rates[k] for k in system.states)]
    places = {
        "parameters": (system._p_index, [*system.parameters, *system.inputs]),
        "start": ({r["name"]: k for k, r in enumerate(starts)}, starts),
        "rate": (rates, system.rates),
    }
    columns: list[Column] = []
    fixed: dict[str, dict[str, Any]] = {}
    for place, (index, records) in places.items():
        said = as_mapping(getattr(options, place))
        if not isinstance(said, Mapping):
            raise RuntimeModelError(f"{place}: give a mapping of names to values, or a DataFrame")
        fixed[place] = {}
        if place == "parameters" and (twice := {*said} & {*constant, *moving}):
            raise RuntimeModelError(
                f"{sorted(twice)[0]!r} stands among the parameters and among the inputs: leave one out"
            )
        for name, value in {**said, **(constant if place == "parameters" else {})}.items():
            inner = inside_dot(name) if place == "rate" else name
            if inner not in index:
                if place == "parameters":
                    system.parameter_values({name: 0.0})  # says what is wrong
                raise UnknownNameError(
                    f"{place}: model {system.name!r} has no {'coordinate' if place == 'start' else 'rate'} {name!r}: "
                    f"{nearest(name, index)}"
                )
            unit = records[index[inner]]["unit"]
            varied = _varied(name, value, unit)
            if varied is None:
                fixed[place][name if place != "rate" else inner] = value
                continue
            label = f"dot({inner})" if place == "rate" else name
            columns.append(Column(label, place, index[inner], varied))
    return columns, fixed, moving


def _varied(name: str, value: Any, unit: str) -> Any:
    """Return how a value varies, in SI; None where it does not."""

    def convert(number: float | str) -> float:
        if isinstance(number, str):
            return float(quantities.in_si(number, unit, name))
        return float(number)

    if isinstance(value, (Sampler, Grid)):
        return value.in_si(name, convert)
    if isinstance(value, (str, int, float, np.number)):
        return None
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros((0, 0))
    if array.ndim == 0:
        return None
    if array.ndim != 1 or not len(array):
        raise RuntimeModelError(
            f"{name}: give a number, a sampler such as normal(1, 0.1), a grid such as linspace(0, 1, 11), or an array "
            "with a number for each member"
        )
    return array


def _frame_times(options: EnsembleOptions, single: RunOptions) -> np.ndarray:
    if options.frames is None:
        return np.zeros(0)
    if isinstance(options.frames, int):
        return np.linspace(single.t_start, single.t_end, options.frames)
    times = np.asarray(options.frames, dtype=float)
    rising = times.ndim == 1 and len(times) and bool(np.all(np.diff(times) > 0.0))
    if not rising or not single.t_start <= times[0] <= times[-1] <= single.t_end:
        raise RuntimeModelError(
            f"frames: give a number, or times that rise from {single.t_start} s to {single.t_end} s at most"
        )
    return times


def _said_by_model(system: System, names: Iterable[str]) -> dict[str, Any]:
    """Return inputs over time that the model says."""
    return {r["name"]: inputs_given.from_record(r) for r in system.inputs if r["name"] in names}


def _objection(system: System, driven: DrivenSystem | None) -> str:
    """Return what a model has that lanes cannot do; an empty string where there is nothing."""
    if driven is not None and driven.controllers:
        return "controllers are for single runs"
    if system.switches:
        if has_plain_switches(system):
            return ""
        return (
            "stops and frictions of models with constraints or events of their own, frictions in planes, smooth ones, "
            "and those that follow a reaction are for single runs"
        )
    if system.events and not (
        has_plain_events(system) and all(e["action"] in ACTIONS for e in system.events)
    ):
        return "events other than resets, records and ends of free motion are for single runs"
    if system.events_may_jump:
        return "events whose functions have choices or steps are for single runs"
    return ""


def _breaks(
    system: System, driven: DrivenSystem | None, p: np.ndarray, columns: Sequence[Column], starts: Starts,
    moving: Mapping[Any, Any], single: RunOptions, method: Method, settings: BatchSettings, options: EnsembleOptions,
) -> tuple[Breaks | None, str]:  # fmt: skip
    """Return what steps of members land on, and their inputs over time; None where that is nothing; or why not."""
    names = [record["name"] for record in system.inputs]
    places = driven.places if driven is not None else None
    noises = {
        k: (names[place.number], moving[names[place.number]])
        for k, place in enumerate(places.pieces if places else ()) if is_noise(moving.get(names[place.number]))
    }  # fmt: skip
    if noises and any(r.get("rate_of") in {name for name, _ in noises.values()} for r in system.inputs):
        return None, "noise whose rate is an input as well is for single runs"
    inputs = tuple(driven.all_pieces) if driven is not None else ()
    breaks = Breaks(system, method, single, settings.longest[0], options.seed, places, inputs, noises)
    table = make_timetable(system, p, method, single)
    if table is not None and (table.stops[0] <= single.t_start).any():
        return None, "something jumps with time where runs begin"
    changing = {c.index for c in columns if c.place == "parameters"}
    changing |= {system.place_of_parameter(name) for name in starts.sought}
    varies = system.has("time_terms") and not changing.isdisjoint(search.TimeTerms(system, p).numbers_read())
    if table is None and driven is None and not varies:
        return None, ""
    if system.switches:
        return None, "stops and frictions with inputs over time, or with jumps at times, are for single runs"
    return breaks, ""


def _settings(
    driven: System,
    system: System,
    p: np.ndarray,
    state: np.ndarray,
    single: RunOptions,
    method: Any,
    frame_times: np.ndarray,
    n: int,
    choice: Choice | None = None,
) -> tuple[BatchSettings | None, Any, str, list[str]]:
    """Return settings for lanes with the method, or with the explicit one where a series cannot be had; or why not."""
    if method.name == SERIES and SERIES not in IN_LANES:
        if single.method != "auto":
            return None, method, f"{method.name} is for single runs", []
        method = METHODS[EXPLICIT]
    if method.name not in IN_LANES or (system.events and method.name not in OVER_EVENTS):
        return None, method, f"method {method.name} is for single runs", []
    for form in (system, system.closed) if system.switches else (system,):
        if method.name in IMPLICIT and (reason := _not_implicit(form, method)):
            return None, method, reason, []
    step, notes = choose_step(method, driven, p, state, single)
    level = choose_energy_level(single.energy_scaling, driven, method, p, single.t_start, state)
    arrays = LoopArrays(
        system, method, p, single.t_start, state, frame_times=np.zeros(0), rtol=single.rtol, atol=single.atol,
        step=step, energy_level=level, log_length=1,
    )  # fmt: skip
    c = arrays.control
    settings = BatchSettings(
        method.name, single.t_start, single.t_end, single.rtol, single.atol, frame_times, step=step,
        projection_tol=float(c[at.PROJECTION_TOL]),
        longest=(float(c[at.H_MAX]), float(c[at.H_BASE]), float(c[at.H_SHARE])),
        scale_energy=bool(np.isfinite(level)), max_steps=single.max_steps or _MANY_STEPS,
        series=driven if driven is not system else None, lanes=lanes_for(system, method.name, n),
    )  # fmt: skip
    if system.switches:
        arrays.limit_steps(method, held=True)
        settings = replace(settings, longest_held=(float(c[at.H_BASE]), float(c[at.H_SHARE])))
    if choice is not None and choice.method == method.name:
        most = min(settings.max_steps, choice.most_steps or settings.max_steps)
        settings = replace(settings, order=choice.order, max_steps=most)
    try:
        make_batch(system, settings)
    except (NoLanes, Refusal) as why:
        return None, method, str(why), []
    return settings, method, "", notes


def _not_implicit(system: System, method: Any) -> str:
    """Return why an implicit method cannot run in lanes; an empty string where it can."""
    if suited_to_size(method, system) is not method:
        return f"method {method.name} with sparse matrices is for single runs"
    return ""


def alone(plan: Plan, frame_times: np.ndarray) -> BatchSettings:
    """Return settings for one member in a lane of its own, with a log of steps."""
    return replace(plan.settings, lanes=1, frame_times=frame_times, log_size=_LOG)
