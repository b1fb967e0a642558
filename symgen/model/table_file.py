"""Tables in text files: times in the first column, values in the others, a line of names above them if there is one.

A name may have a unit behind it, `F [kN]`, `F (kN)` or `F/kN`: the numbers below it are in that unit.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from ..errors import ModelError
from .files import LARGEST_TABLE, read_plain
from .units import TIME, Unit, dimension_text, in_si, parse_unit

_SEPARATORS = (",", ";", "\t")
_WITH_UNIT = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<sure>[^]]*)\]|\((?P<inside>[^)]*)\)|/\s*(?P<behind>\S+))")


@dataclass(frozen=True)
class TableFile:
    """What stands in a file.

    Attributes
    ----------
    path : Path
    names : tuple of str
        Of the columns, the first included, without their units; empty where the file has none.
    units : tuple of (Unit or None)
        Which the first line states of each column; empty where the file has none.
    times : tuple of float [s]
        Ascending.
    columns : tuple of tuple of float
        The values of each further column, in its unit.
    """

    path: Path
    names: tuple[str, ...]
    units: tuple[Unit | None, ...]
    times: tuple[float, ...]
    columns: tuple[tuple[float, ...], ...]

    def in_si(self, k: int, size: Unit | None) -> tuple[float, ...]:
        """Return the values of further column `k` in SI: from the unit that the file states, else from `size`.

        Raises
        ------
        ModelError
            The unit that the file states is one of something else than `size` is.
        """
        stated = self.units[k + 1] if self.units else None
        if stated is not None and size is not None and stated.dimension != size.dimension:
            name = self.names[k + 1]
            message = (
                f"{name!r} is in {stated.text} ({dimension_text(stated.dimension)}), where "
                f"{dimension_text(size.dimension)} is wanted"
            )
            raise ModelError(message, file=str(self.path), hint="take another column, or correct its unit")
        return _located(self.path, self.columns[k], stated or size)


def read_table_file(path: Path) -> TableFile:
    """Read a table; columns are separated by commas, semicolons, tabs or blanks, and # begins a comment.

    Raises
    ------
    ModelError
        Names the file, the line and what is wrong there.
    """
    names: tuple[str, ...] = ()
    units: tuple[Unit | None, ...] = ()
    rows: list[list[float]] = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        line = line.partition("#")[0].strip()
        if not line:
            continue
        cells = _cells(line)
        if not rows and not names and not any(map(_is_number, cells)):
            names, units = _head(path, number, cells)
            continue
        rows.append(_row(path, number, cells, len(rows[0]) if rows else len(names) or len(cells)))
        if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
            message = f"times must ascend, but {rows[-1][0]:.9g} s follows {rows[-2][0]:.9g} s"
            raise ModelError(message, file=str(path), line=number, hint="sort the rows, each time once")
    if not rows:
        raise ModelError("the table has no rows of numbers", file=str(path), hint="two columns: time, value")
    times, *columns = zip(*rows)
    if units and units[0] is not None:
        if units[0].dimension != TIME:
            message = f"the first column, {names[0]!r}, is in {units[0].text}, which is no unit of time"
            raise ModelError(message, file=str(path), hint="time first, then the values")
        times = _located(path, times, units[0])
    return TableFile(path, names, units, times, tuple(columns))


def read_columns(path: Path, most: int) -> tuple[list[tuple[float, ...]], tuple[Unit | None, ...]]:
    """Read the columns of a table of so many rows at most, as `read_table_file` does, in whatever order they are.

    Returns
    -------
    columns : list of tuple of float
    units : tuple of (Unit or None)
        Which the first line states of each column; empty where it states none.

    Raises
    ------
    ModelError
        Names the file, the line and what is wrong there.
    """
    rows: list[list[float]] = []
    units: tuple[Unit | None, ...] | None = None
    for number, line in enumerate(_text(path).splitlines(), 1):
        line = line.partition("#")[0].strip()
        if not line:
            continue
        cells = _cells(line)
        if not rows and units is None and not any(map(_is_number, cells)):
            _, units = _head(path, number, cells)
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
    return list(zip(*rows, strict=True)), units or ()


def _head(path: Path, number: int, cells: list[str]) -> tuple[tuple[str, ...], tuple[Unit | None, ...]]:
    """Return the names of a first line and their units."""
    named = [_name_and_unit(path, number, cell.strip('"')) for cell in cells]
    names = tuple(name for name, _ in named)
    for name in names:
        if name and names.count(name) > 1:
            message = f"two columns are named {name!r}"
            raise ModelError(message, file=str(path), line=number, hint="rename or remove one")
    return names, tuple(unit for _, unit in named)


def _name_and_unit(path: Path, number: int, cell: str) -> tuple[str, Unit | None]:
    found = _WITH_UNIT.fullmatch(cell)
    if found is None:
        return cell, None
    text = found["sure"] or found["inside"] or found["behind"] or ""
    if text.strip() in ("", "-", "1"):
        return found["name"], None
    try:
        return found["name"], parse_unit(text)
    except ModelError as error:
        if found["sure"] is None:  # "road (left)" is a name
            return cell, None
        message = f"the unit of {cell!r:.60} cannot be read: {error.message}"
        raise ModelError(message, file=str(path), line=number, hint=error.hint) from None


def _located(path: Path, values: tuple[float, ...], size: Unit | None) -> tuple[float, ...]:
    try:
        return in_si(values, size)
    except ModelError as error:
        raise error.located(file=str(path)) from None


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
            cut = ";" in cell or "\t" in cell or " " in cell  # where a comma was taken for what parts columns
            hint = "write decimal points: commas part columns" if cut else "write a number there"
            raise ModelError(message, file=str(path), line=number, hint=hint)
    return [float(cell) for cell in cells]
