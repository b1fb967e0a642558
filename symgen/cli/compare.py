"""`symgen compare`: where and by how much two recorded runs differ."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import Positive
from symgen.cli.failures import FAILED
from symgen.cli.files import CarefulCommand, OutputFile, write_text
from symgen.cli.terminal import complain, say
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.recording.compare import compare

if TYPE_CHECKING:
    from collections.abc import Iterator

    from symgen.runtime.recording.compare import Comparison

_MOST_LINES = 40
_CANNOT_COMPARE = 2  # as diff and cmp have it


@click.command("compare", cls=CarefulCommand)
@click.argument("first", metavar="A.rrd", type=click.Path(path_type=Path))
@click.argument("second", metavar="B.rrd", type=click.Path(path_type=Path))
@click.option(
    "--tolerance",
    type=Positive(or_zero=True),
    default=1e-6,
    help="Largest difference, in parts of a quantity's largest value (default 1e-6).",
)
@click.option("--json", "json_file", type=OutputFile(".json"), help="Write the comparison to a file.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@click.pass_context
def command(
    context: click.Context, first: Path, second: Path, tolerance: float, json_file: Path | None, quiet: bool
) -> None:
    """Compare two recordings: settings, coordinates, rates and energy at common times.

    The exit status is 1 when they differ by more than the tolerance, 2 when they cannot be compared.
    """
    try:
        comparison = compare(first, second, tolerance=tolerance)
    except (RuntimeModelError, OSError) as error:
        complain(f"Error: {error}")
        context.exit(_CANNOT_COMPARE)
    if json_file is not None:
        write_text(json_file, json.dumps(comparison.to_dict(), indent=1) + "\n")
    if not quiet:
        for line in _report(comparison):
            say(line)
    if not comparison.equal:
        complain(f"Error: {first} and {second}: {comparison.summary}")
        context.exit(FAILED)


def _report(comparison: Comparison) -> Iterator[str]:
    yield f"{comparison.first} and {comparison.second}: {comparison.summary}"
    for setting in comparison.settings:
        yield f"  {setting.name}: {_value(setting.first)} and {_value(setting.second)}"
    rows = sorted(comparison.differences, key=lambda d: -d.relative)
    width = max(len(row.name) for row in rows)
    yield f"  {'':{width}}  largest difference     of its size  at t [s]   above tolerance from"
    for row in rows[:_MOST_LINES]:
        above = "-" if row.t_first is None else f"{row.t_first:.6g} s"
        yield f"  {row.name:{width}}  {row.largest:<10.3g} {row.unit:<11} {row.relative:<12.3g} {row.t:<10.6g} {above}"
    if len(rows) > _MOST_LINES:
        yield f"  … and {len(rows) - _MOST_LINES} more with smaller differences"
    if comparison.growth is not None:
        doubling = f", doubling every {0.693147 / comparison.growth:.3g} s" if comparison.growth > 0.0 else ""
        yield f"  the largest difference grows like exp({comparison.growth:.3g} t / s){doubling}"


def _value(value: Any) -> str:
    return "nothing" if value is None else f"{value:.12g}" if isinstance(value, float) else str(value)
