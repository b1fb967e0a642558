"""`symgen play`: show a recording in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path

import click

from symgen.cli.failures import FAILED
from symgen.cli.terminal import complain
from symgen.runtime.recording.play import play


@click.command("play")
@click.argument("recording", metavar="RUN.rrd", type=click.Path(path_type=Path))
@click.option("--web", is_flag=True, help="Show it in the browser.")
@click.pass_context
def command(context: click.Context, recording: Path, web: bool) -> None:
    """Show RUN.rrd in the Rerun viewer until it is closed."""
    status = play(recording, web=web)
    if status:
        complain(f"Error: the Rerun viewer ended with status {status}")
        context.exit(FAILED)
