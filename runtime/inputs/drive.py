"""From what a user or a model says about inputs to a system that is driven by them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.inputs.controller import CompiledFeedback, Controller, find_signals
from symgen.runtime.inputs.driven import DrivenSystem, Feedback
from symgen.runtime.inputs.given import InputFault, Pieces, Polynomial, Table, from_pair
from symgen.runtime.inputs.samples import Sampler
from symgen.runtime.lazy import Late
from symgen.runtime.options import time_resolution

if TYPE_CHECKING:
    from symgen.runtime.system import System

function = Late("symgen.runtime.inputs.function")

_LEAST_TICKS = 16  # of floating-point time in a period, as in a step
_ROUGH = 1e-6  # error of a function's pieces, in parts of its largest value
_MOST_SAMPLES = 1e8  # all of them are kept
_MOST_KEPT, _LARGEST_KEPT = 8, 100_000  # systems that are kept with a model, and numbers of their pieces
# What inputs may not stand in: their rates of change are not known there.
_FIXED = ("energy", "mass_matrix", "constraint_residual", "gamma")
_WITH_RATES = (
    "constraint_residual",
    "gamma",
)  # but for those in velocity constraints, whose rates are inputs, too
_JUMP = 1e-6  # of an input's largest value: what is more than the round-off of pieces


def drive(
    system: System, moving: Mapping[Any, Any], p: np.ndarray, t_start: float, t_end: float
) -> DrivenSystem:
    """Return the system with inputs over time.

    Parameters
    ----------
    system : System
    moving : mapping
        Name of an input, or a tuple of names -> Table, Polynomial, Controller, a pair (times, values), or a function of
        time.
    p : ndarray
        Parameters, then inputs: what sampled controllers' inputs are before their first call.
    t_start, t_end : float [s]

    Raises
    ------
    RuntimeModelError
        There is no such input, it is given twice, or what is given for it does not fit.
    """
    numbers = {record["name"]: k for k, record in enumerate(system.inputs)}
    first = len(system.parameters)
    pieces, samplers, feedback, notes = {}, [], [], []
    taken: set[str] = set()
    for key, value in moving.items():
        names = key if isinstance(key, tuple) else (key,)
        for name in names:
            if name not in numbers:
                raise RuntimeModelError(_no_input(system, name, numbers))
            if "rate_of" in system.inputs[numbers[name]]:
                followed = system.inputs[numbers[name]]["rate_of"]
                raise RuntimeModelError(f"input {name!r} is the rate of {followed!r} and follows from it")
            if name in taken:
                raise RuntimeModelError(f"input {name!r} is given twice")
            taken.add(name)
        places = tuple(numbers[name] for name in names)
        try:
            if isinstance(value, Controller):
                signals = find_signals(system, value.reads)
                if value.period is None:
                    _refuse_loop(system, signals, places)
                    feedback.append(
                        Feedback(places, signals, CompiledFeedback(value, len(signals.names), len(places)))
                    )
                else:
                    _refuse_short_period(value.period, t_start, t_end)
                    before = p[[first + k for k in places]]
                    samplers.append(Sampler(value, signals, places, names, t_start, before))
            elif len(names) > 1:
                raise InputFault("only a Controller gives several inputs: give each one its own")
            elif callable(value) and not isinstance(value, type):
                pieces[places[0]], off, when = function.sampled(value, t_start, t_end)
                notes.append(_how_good(names[0], pieces[places[0]], off, when))
            else:
                pieces[places[0]] = (
                    value if isinstance(value, (Table, Polynomial)) else from_pair(value)
                ).pieces()
                _refuse_lost(pieces[places[0]], t_start, t_end)
        except InputFault as fault:
            raise RuntimeModelError(f"input {', '.join(map(repr, names))}: {fault}") from None
    rates = {record["rate_of"]: k for k, record in enumerate(system.inputs) if "rate_of" in record}
    for name in taken & rates.keys():
        try:
            pieces[rates[name]] = _rate(pieces.get(numbers[name]))
        except InputFault as fault:
            raise RuntimeModelError(f"input {name!r}: {fault}") from None
    followed = {numbers[name] for name in rates} | set(rates.values())
    _refuse_rates(system, sorted(numbers[name] for name in taken), followed)
    if samplers or feedback:
        return DrivenSystem(system, pieces, samplers, feedback, notes)
    return _driven_by(system, pieces, notes)


def _driven_by(system: System, pieces: Mapping[int, Pieces], notes: list[str]) -> DrivenSystem:
    """Return the system that such pieces drive: one of a run before, with its code, where these were the same."""
    if sum(x.coefficients.size for x in pieces.values()) > _LARGEST_KEPT:
        return DrivenSystem(system, pieces, notes=notes)
    content = ((k, x.knots.tobytes(), x.coefficients.tobytes(), x.degree) for k, x in sorted(pieces.items()))
    key = *content, *notes
    known = vars(system).setdefault("_driven", {})
    with system._lock:
        driven = known.pop(key, None) or DrivenSystem(system, pieces, notes=notes)
        if len(known) >= _MOST_KEPT:
            del known[next(iter(known))]
        known[key] = driven  # behind those of runs before
    return driven


def _refuse_lost(pieces: Pieces, t_start: float, t_end: float) -> None:
    if lost := pieces.lost(t_start, t_end):
        begins, width, least = lost
        raise InputFault(
            f"what it does at t = {begins:.6g} s lasts {width:.2g} s, which is too short to be told apart there, and "
            f"would be left out: spread it over {least:.1g} s or more"
        )


def _how_good(name: str, pieces: Pieces, off: float, when: float) -> str:
    n, largest = len(pieces.knots), np.abs(pieces.coefficients[:, 0]).max()
    where = f" near t = {when:.6g} s, where it jumps or bends" if off > _ROUGH * largest else ""
    return (
        f"input {name}: a function of time, in {n} polynomial pieces that are off by {off:.1e} at most{where}"
    )


def _no_input(system: System, name: Any, numbers: Mapping[str, int]) -> str:
    if any(record["name"] == name for record in system.parameters):
        return (
            f"{name!r} is a parameter of model {system.name!r}, which is constant over a run; inputs are not"
        )
    return f"model {system.name!r} has no input {name!r}: {nearest(str(name), numbers)}"


def _refuse_loop(system: System, signals: Any, places: tuple[int, ...]) -> None:
    """An output that depends on the input which is made from it is an equation for that input, which nobody solves."""
    if signals.outputs and system.sensed:
        raise InputFault(
            "outputs of this model need accelerations or reactions, which follow from inputs: give the controller a "
            "period, or let it read coordinates and rates"
        )
    if not signals.outputs or not system.inputs_read("outputs") & set(places):
        return
    kernel, p = system.kernel("outputs"), system.parameter_values()
    other = p.copy()
    other[len(system.parameters) + np.array(places)] += 1.0
    for seed in (1.0, 2.0):  # two states that nothing singles out
        y = np.sin(seed + np.arange(system.nq + system.nv))
        moved = kernel(seed, y, p) != kernel(seed, y, other)
        if moved[list(signals.outputs)].any():
            names = ", ".join(repr(name) for name, k in zip(signals.names, signals.places) if k < 0)
            raise InputFault(
                f"the controller reads {names}, which reads this input: give the controller a period"
            )


def _refuse_short_period(period: float, t_start: float, t_end: float) -> None:
    least = max(_LEAST_TICKS * time_resolution(t_start, t_end), (t_end - t_start) / _MOST_SAMPLES)
    if period < least:
        raise InputFault(
            f"the period of the controller is {period:.3g} s: in a run from {t_start:g} to {t_end:g} s give at least "
            f"{least:.1g} s; or leave the period out, then it acts at every instant"
        )


def _rate(pieces: Pieces | None) -> Pieces:
    """Return the time derivative of an input that a velocity constraint has."""
    if pieces is None:
        raise InputFault(
            "it stands in a velocity constraint, and how fast a controller's input changes is not known: give it as "
            "a table, a polynomial or a function of time, or let the controller act by a force"
        )
    steps = np.abs(pieces.coefficients[1:, 0] - pieces.coefficients[:-1, 0])
    largest = np.abs(pieces.coefficients[:, 0]).max(initial=0.0)
    if (pieces.jumps() & (steps > _JUMP * largest)).any():
        raise InputFault(
            "it stands in a velocity constraint, and jumps: velocities cannot; let it be continuous"
        )
    powers = np.arange(1, pieces.degree + 1)
    slopes = pieces.coefficients[:, 1:] * powers if pieces.degree else np.zeros((len(pieces.knots), 1))
    return Pieces(pieces.knots, slopes)


def _refuse_rates(system: System, places: list[int], followed: set[int]) -> None:
    for form in (system, system.closed) if system.switches else (system,):
        for function in _FIXED:
            known = followed if function in _WITH_RATES else set()
            if form.has(function) and form.inputs_read(function) & (set(places) - known):
                raise RuntimeModelError(_in_the_wrong_place(system, function, form is not system))


def _in_the_wrong_place(system: System, function: str, closed: bool) -> str:
    if closed:
        return (
            f"an input stands in a gap or a sliding speed of model {system.name!r}, whose equations take it as "
            "constant: write the course of time into the model, or make the input a force on what moves there"
        )
    return (
        f"an input stands in {function!r} of model {system.name!r}, whose equations take it as constant: "
        "inputs over time act through forces and loads; derive the model again"
    )
