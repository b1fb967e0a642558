"""`symgen export`: a recording as a table."""

from __future__ import annotations

from pathlib import Path

import click

from symgen import runtime
from symgen.cli.files import CarefulCommand, OutputFile, refuse_other_table, write_tables
from symgen.cli.terminal import say
from symgen.runtime.recording.reader import check_fits, read_recording
from symgen.runtime.recording.states_alone import with_energies
from symgen.runtime.tables import columns_of_recording


@click.command("export", cls=CarefulCommand)
@click.argument("recording", metavar="RUN.rrd", type=click.Path(path_type=Path))
@click.option(
    "--csv", "csv_file", type=OutputFile(".csv"), help="Text with a line of names; - is standard output."
)
@click.option(
    "--parquet", "parquet_file", type=OutputFile(".parquet"), help="Parquet, with units as metadata."
)
def command(recording: Path, csv_file: Path | None, parquet_file: Path | None) -> None:
    """Write the states, multipliers and energies of RUN.rrd as a table."""
    if csv_file is None and parquet_file is None:
        raise click.UsageError("say which table to write: --csv FILE or --parquet FILE")
    read = read_recording(recording)
    system = runtime.load(read.module_text)
    check_fits(read, system)
    columns = columns_of_recording(with_energies(read, system), system)
    refuse_other_table("--csv", csv_file, columns.names)
    refuse_other_table("--parquet", parquet_file, columns.names)
    write_tables(columns, csv_file, parquet_file)
    for path in filter(None, (csv_file, parquet_file)):
        say(f"wrote {path}: {len(columns.values)} rows, {len(columns.names)} columns")
