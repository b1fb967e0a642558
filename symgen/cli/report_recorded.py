"""`symgen report RUN.rrd`: the recorded run again, at its settings and from its start."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.recording.reader import Recording
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_OPTIONS = ("step", "t_start", "t_end", "fps", "max_step", "breaks")


def repeatable(path: Path, given: dict[str, Any]) -> tuple[System, dict[str, Any], Recording]:
    """Return the model of a recording, the arguments of `solve` that repeat its run, and the recording.

    Parameters
    ----------
    path : Path
    given : dict
        Options of the command line; they belong to a MODEL.

    Raises
    ------
    click.UsageError
        Options are given, or the run had inputs over time.
    """
    from symgen import runtime
    from symgen.runtime.recording.reader import read_recording
    from symgen.runtime.recording.trusted import check_fits

    said = sorted(
        key.removesuffix("_values") for key, value in given.items() if value and key != "input_kind_values"
    )
    if said:
        raise click.UsageError(
            f"--{said[0].replace('_', '-')}: a recorded run is repeated as it was; give the MODEL"
        )
    recording = read_recording(path)
    if recording.inputs_over_time:
        names = ", ".join(recording.inputs_over_time)
        raise click.UsageError(
            f"{path}: the run had inputs over time ({names}); give the MODEL and the inputs"
        )
    if recording.settings.shape[1] and recording.settings[0].any():
        raise click.UsageError(
            f"{path}: the run began with closed stops or sticking friction; give the MODEL"
        )
    system = runtime.load(recording.module_text)
    check_fits(recording, system)
    arguments: dict[str, Any] = {
        key: recording.options[key] for key in _OPTIONS if recording.options.get(key) is not None
    }
    arguments.setdefault("t_end", float(recording.t[-1]))
    for key in ("method", "constraints", "rtol", "atol"):
        arguments[key] = getattr(recording, key)
    if not system.m:
        arguments["constraints"] = "auto"
    arguments["parameters"] = {**recording.parameters, **recording.inputs}
    arguments["start"] = _named(system.coordinates, recording.q[0])
    arguments["rate"] = _named(system.rates, recording.v[0])
    return system, arguments, recording


def likeness(recording: Recording, solution: Solution) -> str:
    """Say how far the repeated run ends from the recorded one."""
    end = np.concatenate([solution.q[-1], solution.v[-1]])
    recorded = np.concatenate([recording.q[-1], recording.v[-1]])
    head = f"The run recorded in {recording.path.name}, repeated"
    if abs(solution.t[-1] - recording.t[-1]) > 1e-9 * max(1.0, abs(solution.t[-1])):
        return f"{head}; it ends at t = {solution.t[-1]:.9g} s, the recording at t = {recording.t[-1]:.9g} s."
    return (
        f"{head}: its last state differs from the recorded one by at most {np.abs(end - recorded).max():.2g}."
    )


def _named(records: Any, values: np.ndarray) -> dict[str, float]:
    return {record["name"]: float(value) for record, value in zip(records, values)}
