"""`symgen run --resume`: go on with a recorded run, in place of its recording."""

from __future__ import annotations

import functools
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import find_model
from symgen.cli.control import with_control
from symgen.cli.files import claim
from symgen.cli.quantities import parameter_values
from symgen.cli.recorded import Progress, Recorded, run_recorded
from symgen.link import module_for
from symgen.runtime.options import RunOptions
from symgen.runtime.recording.resume import Resumed

if TYPE_CHECKING:
    from symgen.runtime.recording.recording import Recording
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_RECORDED = ("method", "constraints", "rtol", "atol")


def resume_run(
    file: Path,
    model: str | None,
    build_options: dict[str, str],
    given: dict[str, Any],
    log_file: Path | None,
    log_states: bool,
    no_log: bool,
    show_progress: bool,
) -> tuple[Solution, Recorded | None, float]:
    """Go on with the run in `file`; returns the solution, its recording, and the seconds of deriving.

    The recording is written beside the old one, which it replaces when it is complete.

    Raises
    ------
    click.UsageError
        What is given differs from what was recorded.
    """
    path, seconds = None if model is None else find_model(model), 0.0
    resumed = Resumed(file, None if path is None else functools.partial(_controllers, path))
    recording = resumed.recording
    _refuse_other_settings(resumed, given)
    if path is not None:
        seconds = _refuse_other_model(recording, path, build_options)
    elif build_options:
        raise click.UsageError("--option is for a MODEL; the recording has its model already")
    if recording.options.get("t_end") is None and given["t_end"] is None:
        raise click.UsageError("the recording does not say how long the run was to be: give --t-end")
    t_end = recording.options["t_end"] if given["t_end"] is None else given["t_end"]
    target = claim("the recording", log_file or file, instead_of=file)
    written = None
    if not no_log:
        partial = _unused(target.with_name(f"{target.stem}.resumed{target.suffix}"))
        content = "states" if log_states else recording.content
        written = Recorded(partial, path, recording.module_text, recording.model_text, content)
    progress = Progress(t_end, sys.stderr.isatty()) if show_progress else None
    go_on = functools.partial(resumed.run, given["t_end"], at=given["at"], fps=given["fps"])
    solution = run_recorded(go_on, written, progress)
    if written is not None:
        os.replace(written.path, target)
        written.path = target
    return solution, written, seconds


def _unused(path: Path) -> Path:
    """A name like this one that no file has."""
    number, found = 1, path
    while found.exists() or found.is_symlink():
        number += 1
        found = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return found


def _controllers(path: Path, system: System, parameters: dict[str, float]) -> dict[Any, Any]:
    return with_control(path, system, RunOptions(parameters=parameters)).inputs or {}


def _refuse_other_settings(resumed: Resumed, given: dict[str, Any]) -> None:
    recording = resumed.recording
    for key in _RECORDED:
        value, recorded = given[key], getattr(recording, key)
        if value is not None and value not in (recorded, "auto"):
            raise click.UsageError(
                f"--{key} {value}: the run to resume has {recorded}; leave --{key} out, or start a new run"
            )
    step = recording.options.get("step")
    if given["step"] not in (None, step):
        had = f"a step of {step:g} s" if step else "no fixed step"
        raise click.UsageError(f"--step {given['step']:g}: the run to resume has {had}; leave --step out")
    for key in ("max_step", "breaks"):
        had = recording.options.get(key)
        if given[key] is not None and (list(given[key]) if key == "breaks" else given[key]) != had:
            option = f"--{key.replace('_', '-')}"
            raise click.UsageError(f"{option}: the run to resume has {had or 'none'}; leave {option} out")
    recorded = {**recording.parameters, **recording.inputs}
    for name, value in parameter_values(resumed.system, given["set_values"]).items():
        if value != recorded[name]:
            raise click.UsageError(
                f"--set {name}: the run to resume has {recorded[name]:.17g}, not {value:.17g}; leave it out, or "
                "start a new run"
            )
    others = {"--start": "start_values", "--rate": "rate_values", "--input": "input_values"}
    others |= {"--no-energy-scaling": "--no-energy-scaling", "--no-split": "--no-split"}
    for option, key in others.items():
        if given[key]:
            raise click.UsageError(f"{option}: a resumed run goes on as it was; leave {option} out")


def _refuse_other_model(recording: Recording, path: Path, build_options: dict[str, str]) -> float:
    """Derive the model again and hold its module against the recorded one; returns the seconds that took."""
    module = module_for(path, build_options, None)
    if _functions(module.text) != _functions(recording.module_text):
        raise click.UsageError(
            f"{path}: is not the model of {recording.path}: its equations differ, so it cannot go on with the run; "
            "leave MODEL out to go on with the recorded one"
        )
    return module.seconds


def _functions(module_text: str) -> str:
    """Return what follows the header: descriptions and default values do not matter."""
    return module_text[module_text.index("\n@njit") :]
