"""Tables in text files: times in the first column, values in the others, a line of names above them if there is one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..errors import ModelError
from .files import LARGEST_TABLE, read_plain

_SEPARATORS = (",", ";", "\t")


@dataclass(frozen=True)
class TableFile:
    """What stands in a file.

    Attributes
    ----------
    names : tuple of str
        Of the columns, the first included; empty where the file has none.
    times : tuple of float [s]
        Ascending.
    columns : tuple of tuple of float
        The values of each further column.
    """

    names: tuple[str, ...]
    times: tuple[float, ...]
    columns: tuple[tuple[float, ...], ...]


def read_table_file(path: Path) -> TableFile:
    """Read a table; columns are separated by commas, semicolons, tabs or blanks, and # begins a comment.

    Raises
    ------
    ModelError
        Names the file, the line and what is wrong there.
    """
    names: tuple[str, ...] = ()
    rows: list[list[float]] = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        line = line.partition("#")[0].strip()
        if not line:
            continue
        cells = _cells(line)
        if not rows and not names and not any(map(_is_number, cells)):
            names = tuple(cell.strip('"') for cell in cells)
            continue
        rows.append(_row(path, number, cells, len(rows[0]) if rows else len(names) or len(cells)))
        if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
            message = f"times must ascend, but {rows[-1][0]:.9g} s follows {rows[-2][0]:.9g} s"
            raise ModelError(message, file=str(path), line=number, hint="sort the rows, each time once")
    if not rows:
        raise ModelError("the table has no rows of numbers", file=str(path), hint="two columns: time, value")
    times, *columns = zip(*rows)
    return TableFile(names, times, tuple(columns))


def read_columns(path: Path, most: int) -> list[tuple[float, ...]]:
    """Read the columns of a table of so many rows at most, as `read_table_file` does, in whatever order they are.

    Raises
    ------
    ModelError
        Names the file, the line and what is wrong there.
    """
    rows: list[list[float]] = []
    named = False
    for number, line in enumerate(_text(path).splitlines(), 1):
        line = line.partition("#")[0].strip()
        if not line:
            continue
        cells = _cells(line)
        if not rows and not named and not any(map(_is_number, cells)):
            named = True
            continue
        rows.append(
            _row(path, number, cells, len(rows[0]) if rows else len(cells), "arguments first, then the value")
        )
        if len(rows) > most:
            message = f"the table has more than {most} rows"
            raise ModelError(
                message, file=str(path), line=number, hint="take fewer places: between them it is a curve"
            )
    if not rows:
        raise ModelError(
            "the table has no rows of numbers", file=str(path), hint="arguments first, then the value"
        )
    return list(zip(*rows, strict=True))


def _text(path: Path) -> str:
    try:
        return read_plain(path, LARGEST_TABLE, "table").decode("utf-8-sig")
    except UnicodeDecodeError as error:
        message = f"the table is not UTF-8 text: byte {error.start} does not fit"
        raise ModelError(message, file=str(path), hint="save it as UTF-8") from None


def _cells(line: str) -> list[str]:
    for separator in _SEPARATORS:
        if separator in line:
            return [cell.strip() for cell in line.split(separator)]
    return line.split()


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell  # Python reads 1_0 as ten; a damaged table has it


def _row(
    path: Path, number: int, cells: list[str], n_columns: int, order: str = "time first, then the values"
) -> list[float]:
    if len(cells) < 2 or len(cells) != n_columns:
        wanted = max(n_columns, 2)
        message = f"{len(cells)} column{'s' * (len(cells) != 1)}, where {wanted} are expected"
        raise ModelError(message, file=str(path), line=number, hint=order)
    for column, cell in enumerate(cells, 1):
        if not _is_number(cell) or not math.isfinite(float(cell)):
            message = f"column {column} holds {cell!r:.40}, which is no finite number"
            raise ModelError(message, file=str(path), line=number, hint="write a number there")
    return [float(cell) for cell in cells]
