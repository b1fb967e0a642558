"""`symgen verify`: re-read a recording and check states, energy, constraints and motion again."""

from __future__ import annotations

import json
from pathlib import Path

import click

from symgen.cli.failures import NOT_TRUSTED
from symgen.cli.files import CarefulCommand, OutputFile, write_text
from symgen.cli.terminal import complain, say
from symgen.runtime.lazy import Late

verify = Late("symgen.runtime.recording.verify")


@click.command("verify", cls=CarefulCommand)
@click.argument("recording", metavar="RUN.rrd", type=click.Path(path_type=Path))
@click.option("--json", "json_file", type=OutputFile(".json"), help="Write the report to a file.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@click.pass_context
def command(context: click.Context, recording: Path, json_file: Path | None, quiet: bool) -> None:
    """Check RUN.rrd by computing everything again from the model in it.

    The exit status is 3 when a check fails.
    """
    report = verify.verify(recording)
    if json_file is not None:
        write_text(json_file, json.dumps(report.to_dict(), indent=1) + "\n")
    if not quiet:
        say(f"{recording}: {report.summary}")
        for check in report.checks:
            state = {True: "ok  ", False: "FAIL", None: "  - "}[check.ok]
            say(f"  {state} {check.name}: {check.says} ({check.value:.3g}, limit {check.limit:.3g})")
    if not report.ok:
        if quiet:
            complain(f"Error: {recording}: {report.summary}")
        context.exit(NOT_TRUSTED)
