"""`--input`: what inputs do over time, from tables in files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from symgen.model.table_file import TableFile
    from symgen.runtime.inputs.given import Table
    from symgen.runtime.system import System

KINDS = ("linear", "cubic", "hold")


def input_tables(
    system: System, texts: Iterable[str], kind: str, constant: Iterable[str]
) -> dict[str, Table]:
    """Return the tables of `--input`, by the names of inputs.

    Parameters
    ----------
    system : System
    texts : iterable of str
        `NAME=FILE`, a file of two columns or with a column of that name; or `FILE`, whose columns name inputs.
    kind : str
        Of all tables.
    constant : iterable of str
        Names that `--set` gives.
    """
    from symgen.runtime.errors import nearest

    names = [record["name"] for record in system.inputs]
    found: dict[str, Table] = {}
    for text in texts:
        name, equals, file = text.partition("=")
        tables = _columns(*((Path(file), name.strip()) if equals else (Path(text), "")), kind)
        for column, table in tables.items():
            if column not in names:
                raise click.UsageError(
                    f"--input: model {system.name!r} has no input {column!r}: {nearest(column, names)}"
                )
            if column in found or column in constant:
                raise click.UsageError(f"--input gives {column!r}, which is given already")
            found[column] = table
    return found


def _columns(path: Path, name: str, kind: str) -> dict[str, Table]:
    from symgen.model.table_file import read_table_file
    from symgen.runtime.inputs.given import Table

    content = read_table_file(path)
    if not name:
        if not content.names:
            raise click.UsageError(
                f"--input {path}: its first line names no inputs; give NAME={path}, or name the columns"
            )
        return {
            column: Table(content.times, x, kind) for column, x in zip(content.names[1:], content.columns)
        }
    return {name: Table(content.times, _column(path, name, content), kind)}


def _column(path: Path, name: str, content: TableFile) -> tuple[float, ...]:
    if len(content.columns) == 1:
        return content.columns[0]
    if name not in content.names[1:]:
        raise click.UsageError(
            f"--input: {path} has {len(content.columns)} columns of values, none of them {name!r}"
        )
    return content.columns[content.names[1:].index(name)]
