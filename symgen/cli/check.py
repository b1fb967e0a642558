"""`symgen check`: does the result settle as steps are halved or tolerances tightened? Tables and a plot."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.control import with_control
from symgen.cli.failures import FAILED, NOT_TRUSTED
from symgen.cli.files import CarefulCommand, OutputFile, claim, write_text
from symgen.cli.settings import load_system, options_of, run_options
from symgen.cli.terminal import complain, say
from symgen.runtime.checks.convergence import lines, study
from symgen.runtime.lazy import Late
from symgen.runtime.result_json import to_json

if TYPE_CHECKING:
    from symgen.runtime.checks.convergence import Convergence

check_plot = Late("symgen.cli.check_plot")


@click.command("check", cls=CarefulCommand)
@model_argument
@run_options
@click.option(
    "--plot",
    "plot_file",
    type=OutputFile(".png"),
    help="The plot (default: <name>_check.png).",
)
@click.option(
    "--json", "json_file", type=OutputFile(".json"), help="Write the tables to a file, all coordinates."
)
@click.pass_context
def command(
    context: click.Context,
    model: str,
    options: tuple[tuple[str, str], ...],
    plot_file: Path | None,
    json_file: Path | None,
    **given: Any,
) -> None:
    """Run MODEL again and again with finer steps, and compare.

    Shown are convergence, energy balance and constraint drift of each run; the estimated error of each coordinate and
    rate, the worst eight; conserved momenta and their drift; and, where errors grow, up to when digits can be trusted.

    The exit status is 3 when the result does not settle, or digits are lost before the end.
    """
    if plot_file is not None and importlib.util.find_spec("matplotlib") is None:
        raise click.UsageError("--plot needs matplotlib: pip install 'symgen[figures]'")
    path = find_model(model)
    system, _ = load_system(path, as_dict(options, "--option"))
    asked = with_control(path, system, options_of(system, given))
    result = study(system, asked)
    if json_file is not None:
        write_text(json_file, to_json(result.to_dict()) + "\n")
    if result.failed:
        complain(f"Error: {result.says}")
        context.exit(FAILED)
    for line in lines(result):
        say(line)
    _plot(result, plot_file or claim("the plot", Path(f"{system.name}_check.png")))
    say(result.says)
    context.exit(0 if result.ok else NOT_TRUSTED)


def _plot(result: Convergence, path: Path) -> None:
    if importlib.util.find_spec("matplotlib") is not None:
        check_plot.write_plot(result, path)
        say(f"plot: {path}")
