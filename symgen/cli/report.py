"""`symgen report`: one HTML file with a model, its equations, a run of it, and how far that can be trusted."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.control import add_control
from symgen.cli.failures import exit_status
from symgen.cli.files import CarefulCommand, OutputFile, claim, write_text
from symgen.cli.report_recorded import likeness, repeatable
from symgen.cli.settings import load_system, run_options, solve_arguments
from symgen.cli.terminal import say

if TYPE_CHECKING:
    from symgen.runtime.checks.convergence import Convergence

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

    In place of MODEL, a recording RUN.rrd: its run is repeated.

    The exit status is that of the run: 1 when it fails, 3 when a check says that its result is not to be trusted.
    """
    recording, derived = None, 0.0
    if model.endswith(".rrd"):
        if options:
            raise click.UsageError("--option is for a MODEL; the recording has its model already")
        system, arguments, recording = repeatable(Path(model), given)
    else:
        path = find_model(model)
        system, module = load_system(path, as_dict(options, "--option"))
        derived = module.seconds
        arguments = solve_arguments(system, given | {"fps": None})  # that of the model
        add_control(path, system, arguments)
    from symgen.cli.report_equations import report_equations
    from symgen.runtime.checks.advice import advise
    from symgen.runtime.report.page import report_page
    from symgen.runtime.solve import solve

    solution = solve(system, **arguments)
    seconds = {
        "derive": derived,
        "compile": solution.seconds["prepare"],
        "run": solution.seconds["run"],
    }
    regular = solution.status in ("success", "terminated")
    advice = _timed(seconds, "advice", lambda: advise(system, arguments))
    study = (
        None if quick or not regular else _timed(seconds, "convergence", lambda: _study(system, arguments))
    )
    equations = _timed(seconds, "equations", lambda: report_equations(system))
    target = html_file or claim("the report", Path(f"{system.name}_report.html"))
    origin = likeness(recording, solution) if recording is not None else ""
    page = report_page(solution, equations, advice, study, seconds, origin)
    write_text(target, page)
    say(f"report: {target}")
    context.exit(exit_status(solution))


def _study(system: Any, arguments: dict[str, Any]) -> Convergence:
    from symgen.runtime.checks.convergence import study

    return study(system, arguments)


def _timed(seconds: dict[str, float], stage: str, work: Callable[[], Result]) -> Result:
    began = time.perf_counter()
    result = work()
    seconds[stage] = time.perf_counter() - began
    return result
