"""The state of a recording that is nearest to a time, for a model."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click
import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs.recorded import drive_as_recorded
from symgen.runtime.recording.reader import read_recording

if TYPE_CHECKING:
    from symgen.runtime.recording.reader import Recording
    from symgen.runtime.system import System


class RecordedState(NamedTuple):
    """A frame of a recording; `parameters` are those of the run that the model has, with the inputs at that time."""

    t: float
    q: np.ndarray
    v: np.ndarray
    parameters: dict[str, float]


def place_in_run(text: str) -> tuple[Path, float] | None:
    """Return the file and the time [s] that `RUN.rrd@TIME` names; None if the text is not of this form."""
    path, at, number = text.rpartition("@")
    try:
        t = float(number)
    except ValueError:
        return None
    return (Path(path), t) if at and path and math.isfinite(t) else None


def recorded_state(system: System, path: Path, t: float) -> RecordedState:
    """Return the frame that is nearest to `t` [s].

    Raises
    ------
    click.UsageError
        The recording does not reach to `t`.
    symgen.runtime.errors.RuntimeModelError
        It is of another model.
    """
    recording = read_recording(path)
    if recording.q.shape[1] != system.nq or recording.v.shape[1] != system.nv:
        raise RuntimeModelError(
            f"{path}: a run of {recording.name!r} with {recording.q.shape[1]} coordinates, but model {system.name!r} "
            f"has {system.nq}: name the model that was run"
        )
    first, last = float(recording.t[0]), float(recording.t[-1])
    if not first <= t <= last:
        raise click.UsageError(
            f"--at: {t:g} s is outside the recording, which is from {first:g} to {last:g} s"
        )
    row = int(np.argmin(np.abs(recording.t - t)))
    known = {record["name"] for record in (*system.parameters, *system.inputs)}
    moving = _inputs_at(system, recording, row)
    values = {**recording.parameters, **recording.inputs, **moving}
    parameters = {name: x for name, x in values.items() if name in known and math.isfinite(x)}
    return RecordedState(
        float(recording.t[row]), recording.q[row].copy(), recording.v[row].copy(), parameters
    )


def _inputs_at(system: System, recording: Recording, row: int) -> dict[str, float]:
    """Return the values of inputs over time at a frame, those of controllers included."""
    if not recording.inputs_over_time:
        return {}
    driven, _ = drive_as_recorded(system, recording.inputs_over_time)
    p, rows = system.with_settings(recording.p), slice(row, row + 1)
    values = evaluate(driven, "inputs", p, recording.t[rows].copy(), recording.states[rows].copy())[0]
    return {record["name"]: float(x) for record, x in zip(system.inputs, values)}
