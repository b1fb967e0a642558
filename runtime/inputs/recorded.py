"""Inputs over time in a recording: written as text that says them exactly, and read back to drive the model again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.inputs.driven import DrivenSystem
from symgen.runtime.inputs.given import InputFault, Pieces

if TYPE_CHECKING:
    from symgen.runtime.system import System

UNKNOWN = "unknown"  # the run was cut short before a controller's values were written
AT_FRAMES = (
    "at frames"  # a controller acted at every instant: its values at the frames, which hold there only
)


def recorded_inputs(system: System, times: np.ndarray | None = None, values: np.ndarray | None = None) -> str:
    """Return the inputs over time as JSON; an empty text where all are constants.

    Parameters
    ----------
    system : System
    times, values : ndarray, shapes (n,) and (n, number of inputs), optional
        All inputs at the frames; without them the run goes on, and what controllers say is not known yet.
    """
    if not isinstance(system, DrivenSystem):
        return ""
    names = [record["name"] for record in system.inputs]
    found: dict[str, Any] = {}
    sampled = {number for sampler in system.samplers for number in sampler.inputs}
    for place, pieces in zip(system.places.pieces, system.all_pieces):
        done = times is not None or place.number not in sampled
        found[names[place.number]] = _pieces_record(pieces) if done else UNKNOWN
    for controller in system.feedback:
        for number in controller.inputs:
            if times is None:
                found[names[number]] = UNKNOWN
            else:
                column = Pieces(times, values[:, number : number + 1])
                found[names[number]] = {"known": AT_FRAMES, **_pieces_record(column)}
    return json.dumps(found)


def _pieces_record(pieces: Pieces) -> dict[str, Any]:
    return {"knots": pieces.knots.tolist(), "coefficients": pieces.coefficients.tolist()}


def drive_as_recorded(
    system: System, recorded: Mapping[str, Any], controlled: DrivenSystem | None = None
) -> tuple[System, list[str]]:
    """Return the system as it was driven, and the names of inputs of which nothing is known.

    Parameters
    ----------
    system : System
    recorded : mapping
        What `recorded_inputs` wrote, read from JSON.
    controlled : DrivenSystem, optional
        The same model with the controllers of the run, which go on; what is recorded of their inputs is not read.

    Raises
    ------
    InputFault
        It is not what was written for this model.
    """
    numbers = {record["name"]: k for k, record in enumerate(system.inputs)}
    pieces, unknown = {}, []
    samplers, feedback = (controlled.samplers, controlled.feedback) if controlled is not None else ((), ())
    own = {number for controller in (*samplers, *feedback) for number in controller.inputs}
    for name, record in recorded.items():
        if name not in numbers:
            raise InputFault(f"the recording has an input {name!r} over time, which its model does not have")
        if numbers[name] in own:
            continue
        if record == UNKNOWN:
            unknown.append(name)
            continue
        pieces[numbers[name]] = _read(name, record)
    return DrivenSystem(system, pieces, samplers, feedback), unknown


def _read(name: str, record: Any) -> Pieces:
    try:
        knots = np.array(record["knots"], dtype=float)
        coefficients = np.array(record["coefficients"], dtype=float)
    except (TypeError, ValueError, KeyError):
        raise InputFault(f"the recorded input {name!r} cannot be read") from None
    fits = knots.ndim == 1 and len(knots) and coefficients.ndim == 2 and len(coefficients) == len(knots)
    if not (
        fits and coefficients.shape[1] and np.isfinite(coefficients).all() and (np.diff(knots) >= 0.0).all()
    ):
        raise InputFault(
            f"the recorded input {name!r} is no table: lengths, order of times or numbers are wrong"
        )
    return Pieces(knots, coefficients)
