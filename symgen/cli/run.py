"""`symgen run`: derive if needed, assemble, integrate, check, record.

`symgen run --explain`: what a run skipped, as lines of text.
"""

from __future__ import annotations

import functools
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import Positive, Times, as_dict, find_model, model_argument
from symgen.cli.control import with_control
from symgen.cli.failures import exit_status
from symgen.cli.files import (
    CarefulCommand,
    OutputFile,
    claim,
    refuse_other_table,
    write_tables,
    write_text,
)
from symgen.cli.recorded import Progress, Recorded, run_recorded
from symgen.cli.settings import load_system, options_of, run_options
from symgen.cli.terminal import say
from symgen.runtime.front import Solution
from symgen.runtime.graph.layouts import LATE
from symgen.runtime.integrate.methods import calls
from symgen.runtime.lazy import Late
from symgen.runtime.simulate import simulate

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System

resume = Late("symgen.cli.resume")
runtime_explain = Late("symgen.runtime.explain")
recording_play = Late("symgen.runtime.recording.play")
result_json = Late("symgen.runtime.result_json")
tables = Late("symgen.runtime.tables")


@click.command("run", cls=CarefulCommand)
@functools.partial(model_argument, required=False)
@run_options
@click.option("--fps", type=Positive(), help="Frames per second of simulated time in the recording.")
@click.option("--at", type=Times(), help="Times of extra states in the JSON [s]; they change no step.")
@click.option(
    "--log",
    "log_file",
    type=OutputFile(".rrd"),
    help="The recording (default: <name>.rrd).",
)
@click.option(
    "--no-energy-scaling",
    is_flag=True,
    help="Leave the rates of conservative models with constraints as they are, whatever energy the steps lose.",
)
@click.option("--no-split", is_flag=True, help="Integrate independent subsystems as one, with one step.")
@click.option(
    "--log-states",
    is_flag=True,
    help="Record states alone, at a fraction of the cost: poses and curves are worked out when they are looked at.",
)
@click.option("--no-log", is_flag=True, help="Record nothing.")
@click.option(
    "--resume",
    "resume_file",
    metavar="RUN.rrd",
    type=click.Path(path_type=Path),
    help="Go on with a recorded run as if it had never stopped; MODEL may be left out.",
)
@click.option(
    "--json",
    "json_file",
    type=OutputFile(".json"),
    help="Write the result to a file; - is the standard output.",
)
@click.option("--csv", "csv_file", type=OutputFile(".csv"), help="Write all series over time as text.")
@click.option(
    "--parquet", "parquet_file", type=OutputFile(".parquet"), help="Write all series over time as Parquet."
)
@click.option("--explain", is_flag=True, help="Say what the run skipped, and why.")
@click.option("--play", is_flag=True, help="Show the recording when the run is over.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@click.pass_context
def command(
    context: click.Context,
    model: str | None,
    options: tuple[tuple[str, str], ...],
    log_file: Path | None,
    no_energy_scaling: bool,
    no_split: bool,
    log_states: bool,
    no_log: bool,
    resume_file: Path | None,
    json_file: Path | None,
    csv_file: Path | None,
    parquet_file: Path | None,
    explain: bool,
    play: bool,
    quiet: bool,
    **given: Any,
) -> None:
    """Integrate MODEL, check the result, and record it.

    The exit status is 1 when the run fails, 3 when a check says that its result is not to be trusted.
    """
    if no_log and (log_file or log_states or play):
        other = "--log" if log_file else "--log-states" if log_states else "--play"
        raise click.UsageError(f"--no-log and {other} contradict each other")
    if resume_file is None and model is None:
        raise click.UsageError("Missing argument 'MODEL'.")
    show_progress, build_options = not quiet, as_dict(options, "--option")
    if resume_file is not None:
        given |= {"--no-energy-scaling": no_energy_scaling, "--no-split": no_split}
        solution, recording, derived = resume.resume_run(
            resume_file, model, build_options, given, log_file, log_states, no_log, show_progress
        )
    else:
        path = find_model(model)
        on_demand = no_log and not calls(given["method"], LATE)
        system, module = load_system(path, build_options, quiet, on_demand)
        _refuse_other_tables(system, csv_file, parquet_file)
        asked, derived = with_control(path, system, options_of(system, given)), module.seconds
        if no_energy_scaling:
            asked = replace(asked, energy_scaling=False)
        if csv_file is None and parquet_file is None:
            asked = replace(asked, keep="checked")  # nothing else has a row for each frame
        if no_split:
            asked = replace(asked, split=False)
        target = None if no_log else log_file or claim("the recording", Path(f"{system.name}.rrd"))
        content = "states" if log_states else "all"
        recording = target and Recorded(target, path, module.text, content=content)
        progress = Progress(asked.t_end, sys.stderr.isatty()) if show_progress else None
        solution = run_recorded(functools.partial(_run, system, asked), recording, progress)
    seconds = _seconds(solution, derived, recording)
    if json_file is not None:
        write_text(json_file, result_json.to_json(result_json.result(solution, seconds)) + "\n")
    if csv_file is not None or parquet_file is not None:
        if resume_file is not None:
            _refuse_other_tables(solution.system, csv_file, parquet_file)
        write_tables(tables.columns_of(solution), csv_file, parquet_file)
    if not quiet:
        for line in _report(solution, seconds, recording):
            say(line)
    if explain:
        for line in explanation(solution, recording is not None):
            say(line)
    status = exit_status(solution, is_told=not quiet)
    if play and recording is not None:
        recording_play.play(recording.path)
    context.exit(status)


def _refuse_other_tables(system: System, csv_file: Path | None, parquet_file: Path | None) -> None:
    if csv_file is not None or parquet_file is not None:
        names = tables.names_of(system)
        refuse_other_table("--csv", csv_file, names)
        refuse_other_table("--parquet", parquet_file, names)


def _run(system: System, asked: RunOptions, **watched: Any) -> Solution:
    return Solution.of(simulate(system, replace(asked, **watched)))


def _seconds(solution: Solution, derived: float, recording: Recorded | None) -> dict[str, float]:
    log = recording.seconds if recording is not None else 0.0
    during = recording.seconds_in_run if recording is not None else 0.0
    return {
        "derive": derived,
        "compile": solution.seconds["prepare"] + solution.seconds.get("compile", 0.0),
        "run": max(0.0, solution.seconds["run"] - during),
        "log": log,
    }


def _report(solution: Solution, seconds: dict[str, float], recording: Recorded | None) -> list[str]:
    stats, energy = solution.stats, solution.energy
    treatment = f", constraints: {solution.constraints}" if solution.system.m else ""
    step = f", step {solution.step:.6g} s" if solution.step else f", rtol {solution.rtol:g}"
    lines = [
        f"{solution.system.name}: {solution.status} at t = {solution.t[-1]:.9g} s",
        f"  method   {solution.method}{step}{treatment}",
        f"  steps    {stats['steps']}, {stats['rejected']} rejected, {stats['rhs']} evaluations",
        f"  energy   {energy.initial:.6g} J to {energy.final:.6g} J, largest error {energy.max_error:.2g}",
    ]
    if solution.system.m:
        residual = solution.constraint_residual
        lines.append(
            f"  residual {residual.max_position:.2g} of positions, {residual.max_velocity:.2g} of velocities"
        )
    if solution.events:
        lines.append(f"  events   {_events(solution)}")
    lines += [f"  note     {note}" for note in solution.notes]
    objections, n = solution.objections, sum(not entry.note for entry in solution.health)
    lines.append(f"  health   {n - len(objections)} of {n} checks passed")
    lines += [f"           not ok: {entry.check}: {entry.says}" for entry in objections]
    lines += [f"           note: {entry.check}: {entry.says}" for entry in solution.advice]
    if recording is not None:
        lines.append(f"  recorded {recording.path}")
    return [*lines, "  time     " + ", ".join(f"{stage} {value:.3f} s" for stage, value in seconds.items())]


def _events(solution: Solution) -> str:
    names = dict.fromkeys(event.name for event in solution.events)
    counts = {name: sum(event.name == name for event in solution.events) for name in names}
    last = solution.events[-1]
    return (
        ", ".join(f"{name} {count} times" for name, count in counts.items())
        + f", the last at t = {last.t:.9g} s"
    )


def explanation(solution: Solution, recorded: bool) -> list[str]:
    """Return what a run skipped and why, one line each.

    Parameters
    ----------
    solution : Solution
    recorded : bool
        Whether a recording was written.
    """
    found = runtime_explain.savings(solution, recorded)
    width = max(len(saving.what) for saving in found)
    lines = [f"    {saving.what:<{width}}  {saving.gain}; {saving.why}" for saving in found]
    return ["  skipped", *lines]
