"""`symgen advise`: the fastest time scale, stability limits, the step and method that fit, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from symgen.cli.arguments import OutputFile, as_dict, find_model, model_argument
from symgen.cli.settings import load_system, run_options, solve_arguments


@click.command("advise")
@model_argument
@run_options
@click.option("--json", "json_file", type=OutputFile(), help="Write the advice to a file.")
def command(model: str, options: tuple[tuple[str, str], ...], json_file: Path | None, **given: Any) -> None:
    """Say which step and method suit MODEL, from its time scales at the start and along a short run."""
    system, _ = load_system(find_model(model), as_dict(options, "--option"))
    arguments = solve_arguments(system, given)
    from runtime.checks.advice import advise

    advice = advise(system, arguments)
    if json_file is not None:
        from runtime.result_json import to_json

        json_file.write_text(to_json(advice.to_dict()) + "\n", encoding="utf-8")
    click.echo(f"{system.name}: time scales at {advice.n_states} states up to t = {advice.t_seen:.4g} s")
    for line in advice.lines():
        click.echo(f"  {line}")
