"""`symgen run`: derive if needed, assemble, integrate, check, record."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import (
    OutputFile,
    Positive,
    Times,
    as_dict,
    find_model,
    model_argument,
)
from symgen.cli.failures import FAILED, INTERRUPTED, NOT_TRUSTED
from symgen.cli.settings import load_system, run_options, solve_arguments

if TYPE_CHECKING:
    from runtime.solution import Solution
    from symgen.link import ModuleText

_PROGRESS_AFTER = 1.0  # seconds of wall time
_PROGRESS_EVERY = 0.2


@click.command("run")
@model_argument
@run_options
@click.option("--fps", type=Positive(), help="Frames per second of simulated time in the recording.")
@click.option("--at", type=Times(), help="Times of extra states in the JSON [s].")
@click.option(
    "--log",
    "log_file",
    type=OutputFile(),
    help="The recording (default: <name>.rrd).",
)
@click.option("--no-log", is_flag=True, help="Record nothing.")
@click.option("--json", "json_file", type=OutputFile(), help="Write the result to a file.")
@click.option("--play", is_flag=True, help="Show the recording when the run is over.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@click.pass_context
def command(
    context: click.Context,
    model: str,
    options: tuple[tuple[str, str], ...],
    log_file: Path | None,
    no_log: bool,
    json_file: Path | None,
    play: bool,
    quiet: bool,
    **given: Any,
) -> None:
    """Integrate MODEL, check the result, and record it.

    The exit status is 1 when the run fails, 3 when a check says that its result is not to be trusted.
    """
    if no_log and (log_file or play):
        raise click.UsageError(f"--no-log and {'--log' if log_file else '--play'} contradict each other")
    path = find_model(model)
    system, module = load_system(path, as_dict(options, "--option"), quiet)
    arguments = solve_arguments(system, given)
    recording = None if no_log else _Recording(log_file or Path(f"{system.name}.rrd"), path, module)
    progress = _Progress(arguments["t_end"]) if not quiet and sys.stderr.isatty() else None
    solution = _solve(system, arguments, recording, progress)
    seconds = _seconds(solution, module, recording)
    if json_file is not None:
        from runtime.result_json import write_result

        write_result(solution, json_file, seconds)
    if not quiet:
        for line in _report(solution, seconds, recording):
            click.echo(line)
    status = _exit_status(solution)
    if play and recording is not None:
        from runtime.recording.play import play as show

        show(recording.path)
    context.exit(status)


def _solve(
    system, arguments: dict[str, Any], recording: _Recording | None, progress: _Progress | None
) -> Solution:
    from runtime.solve import solve

    try:
        solution = solve(system, recorder=recording and recording.begin, progress=progress, **arguments)
    except BaseException:
        if recording is not None:
            recording.abort()
        raise
    finally:
        if progress is not None:
            progress.clear()
    if recording is not None:
        recording.finish(solution)
    return solution


def _exit_status(solution: Solution) -> int:
    """Say on standard error what is wrong, and return the exit status."""
    if solution.status == "interrupted":
        click.echo(solution.message, err=True)
        return INTERRUPTED
    if solution.status not in ("success", "terminated"):
        click.echo(f"Error: {solution.message}", err=True)
        return FAILED
    for entry in solution.objections:
        click.echo(f"Not to be trusted: {entry.check}: {entry.says}", err=True)
    return NOT_TRUSTED if solution.objections else 0


def _seconds(solution: Solution, module: ModuleText, recording: _Recording | None) -> dict[str, float]:
    log = recording.seconds if recording is not None else 0.0
    during = recording.seconds_in_run if recording is not None else 0.0
    return {
        "derive": module.seconds,
        "compile": solution.seconds["prepare"],
        "run": max(0.0, solution.seconds["run"] - during),
        "log": log,
    }


def _report(solution: Solution, seconds: dict[str, float], recording: _Recording | None) -> list[str]:
    stats, energy = solution.stats, solution.energy
    treatment = f", constraints: {solution.constraints}" if solution.system.m else ""
    step = f", step {solution.step:.3g} s" if solution.step else f", rtol {solution.rtol:g}"
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
    objections, n = solution.objections, len(solution.health)
    lines.append(f"  health   {n - len(objections)} of {n} checks passed")
    lines += [f"           not ok: {entry.check}: {entry.says}" for entry in objections]
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


class _Recording:
    """Makes the recorder when the run begins, hands everything on, and counts the seconds that it takes."""

    def __init__(self, path: Path, model: Path, module: ModuleText):
        self.path, self._model, self._module = path, model, module
        self._recorder: Any = None
        self.seconds = self.seconds_in_run = 0.0

    def begin(self, **settings: Any) -> _Recording:
        """Make the recorder; this is what `solve` calls once the settings are known."""
        began = time.perf_counter()
        from runtime.recording.recorder import RunRecorder

        model_text = self._model.read_text(encoding="utf-8")
        self._recorder = RunRecorder(
            self.path,
            module_text=self._module.text,
            model_text=model_text,
            mesh_folder=self._model.parent,
            **settings,
        )
        self.seconds += time.perf_counter() - began
        return self

    def _timed(self, method: str, *arguments: Any, **options: Any) -> None:
        began = time.perf_counter()
        getattr(self._recorder, method)(*arguments, **options)
        took = time.perf_counter() - began
        self.seconds += took
        self.seconds_in_run += took

    def start(self, t0: float, state: Any) -> None:
        self._timed("start", t0, state)

    def frames(self, times: Any, states: Any) -> None:
        self._timed("frames", times, states)

    def steps(self, step_log: Any) -> None:
        self._timed("steps", step_log)

    def event(self, name: str, t: float, *, energy_change: float = 0.0) -> None:
        self._timed("event", name, t, energy_change=energy_change)

    def finish(self, solution: Solution) -> None:
        """Close the recording with what is known at the end."""
        health = [entry.to_dict() for entry in solution.health]
        began = time.perf_counter()
        self._recorder.finish(solution.status, health, solution.stats)
        self.seconds += time.perf_counter() - began

    def abort(self) -> None:
        """Close what there is of the recording: it stays readable."""
        if self._recorder is not None:
            self._recorder.abort()


class _Progress:
    """One line on the terminal that says how far the run is; only for runs that take a while."""

    def __init__(self, t_end: float):
        self._t_end = t_end
        self._began = self._shown = time.monotonic()
        self._any = False

    def __call__(self, t: float, steps: int) -> None:
        now = time.monotonic()
        if now - self._began < _PROGRESS_AFTER or now - self._shown < _PROGRESS_EVERY:
            return
        self._shown, self._any = now, True
        click.echo(
            f"\rt = {t:.6g} of {self._t_end:g} s ({t / self._t_end:.0%}), {steps} steps\x1b[K",
            err=True,
            nl=False,
        )

    def clear(self) -> None:
        if self._any:
            click.echo("\r\x1b[K", err=True, nl=False)
