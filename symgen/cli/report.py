"""`symgen report`: one HTML file with a model, its equations, a run of it, and how far that can be trusted.

`symgen report RUN.rrd`: the recorded run again, at its settings and from its start.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
import numpy as np

from symgen import runtime
from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.control import with_control
from symgen.cli.failures import exit_status
from symgen.cli.files import CarefulCommand, OutputFile, claim, write_text
from symgen.cli.settings import load_system, options_of, run_options
from symgen.cli.terminal import say
from symgen.runtime.checks.advice import advise
from symgen.runtime.checks.convergence import study
from symgen.runtime.front import Solution
from symgen.runtime.lazy import Late
from symgen.runtime.options import RunOptions
from symgen.runtime.recording.reader import check_fits, read_recording
from symgen.runtime.report.page import report_page
from symgen.runtime.simulate import simulate

if TYPE_CHECKING:
    from symgen.runtime.checks.convergence import Convergence
    from symgen.runtime.recording.recording import Recording
    from symgen.runtime.system import System

ensemble_page = Late("symgen.runtime.report.ensemble_page")
store = Late("symgen.runtime.ensemble.store")
report_equations = Late("symgen.cli.report_equations")

_OPTIONS = ("step", "t_start", "t_end", "fps", "max_step", "breaks")


def repeatable(path: Path, given: dict[str, Any]) -> tuple[System, RunOptions, Recording]:
    """Return the model of a recording, the options that repeat its run, and the recording.

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
    said = {key: recording.options[key] for key in _OPTIONS if recording.options.get(key) is not None}
    asked = RunOptions(
        **{"t_end": float(recording.t[-1]), **said},
        **{key: getattr(recording, key) for key in ("method", "rtol", "atol")},
        constraints=recording.constraints if system.m else "auto",
        parameters={**recording.parameters, **recording.inputs},
        start=_named(system.coordinates, recording.q[0]),
        rate=_named(system.rates, recording.v[0]),
    )
    return system, asked, recording


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


Result = TypeVar("Result")


@click.command("report", cls=CarefulCommand)
@model_argument
@run_options
@click.option(
    "--html", "html_file", type=OutputFile(".html"), help="The report (default: <name>_report.html)."
)
@click.option("--quick", is_flag=True, help="Leave out the convergence study, which takes five more runs.")
@click.pass_context
def command(
    context: click.Context,
    model: str,
    options: tuple[tuple[str, str], ...],
    html_file: Path | None,
    quick: bool,
    **given: Any,
) -> None:
    """Integrate MODEL, and write one HTML file about it that opens without network and prints well.

    In place of MODEL, a recording RUN.rrd: its run is repeated; or members of an ensemble, RUNS.zarr or RUNS.npz: a
    page of their distributions and failures.

    The exit status is that of the run: 1 when it fails, 3 when a check says that its result is not to be trusted.
    """
    recording, derived = None, 0.0
    if model.endswith((".zarr", ".npz")):
        stored = store.open_members(model)
        target = html_file or claim("the report", Path(f"{Path(model).stem}_report.html"))
        write_text(target, ensemble_page.ensemble_page(stored))
        say(f"report: {target}")
        return
    if model.endswith(".rrd"):
        if options:
            raise click.UsageError("--option is for a MODEL; the recording has its model already")
        system, asked, recording = repeatable(Path(model), given)
    else:
        path = find_model(model)
        system, module = load_system(path, as_dict(options, "--option"))
        derived = module.seconds
        asked = with_control(
            path, system, options_of(system, given | {"fps": None})
        )  # fps: that of the model
    solution = Solution.of(simulate(system, asked))
    seconds = {
        "derive": derived,
        "compile": solution.seconds["prepare"],
        "run": solution.seconds["run"],
    }
    regular = solution.status in ("success", "terminated")
    advice = _timed(seconds, "advice", lambda: advise(system, asked))
    study = None if quick or not regular else _timed(seconds, "convergence", lambda: _study(system, asked))
    equations = _timed(seconds, "equations", lambda: report_equations.report_equations(system))
    target = html_file or claim("the report", Path(f"{system.name}_report.html"))
    origin = likeness(recording, solution) if recording is not None else ""
    page = report_page(solution, equations, advice, study, seconds, origin)
    write_text(target, page)
    say(f"report: {target}")
    context.exit(exit_status(solution))


def _study(system: Any, asked: RunOptions) -> Convergence:
    return study(system, asked)


def _timed(seconds: dict[str, float], stage: str, work: Callable[[], Result]) -> Result:
    began = time.perf_counter()
    result = work()
    seconds[stage] = time.perf_counter() - began
    return result
