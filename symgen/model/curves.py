"""Tables of the state: curves of one argument and maps of two, from a model or from a file beside it.

They are data from strangers: bounded, finite, sorted and complete, or refused with the place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ..errors import ModelError, nearest
from .description import Table
from .functions import VALUE, tabulated
from .over_time import table_path
from .sources import read
from .table_file import read_columns
from .units import Unit, in_si

if TYPE_CHECKING:
    import sympy

    from .declared import Declared

TABLE_KEYS = ("columns", "file", "kind", "outside", "units")
TABLE_KINDS = ("linear", "pchip", "cubic", "bicubic")
OUTSIDE = ("hold", "extend", "refuse")
LARGEST = 1e75  # whose fourth power is a number still
MOST_ROWS = 512  # of a curve, or of a map: what is chosen among stands in the generated code


class TableFunction:
    """What `Model.table` returns: a function of expressions, with its `integral` where it has one argument."""

    def __init__(self, table: Table) -> None:
        self.name, self.n_arguments = table.name, len(table.axes)

    def __call__(self, *arguments: Any) -> sympy.Expr:
        """The table's value at one argument, or two."""
        return self._applied(VALUE, arguments)

    def integral(self, argument: Any) -> sympy.Expr:
        """The integral over the argument, from the first one of the table on."""
        if self.n_arguments != 1:
            raise TypeError(f"the table {self.name!r} has {self.n_arguments} arguments: it has no integral")
        return self._applied("integral", (argument,))

    def _applied(self, role: str, arguments: Sequence[Any]) -> sympy.Expr:
        from .from_sympy import to_sympy  # who calls this writes with SymPy

        if len(arguments) != self.n_arguments:
            raise TypeError(
                f"the table {self.name!r} takes {self.n_arguments}, not {len(arguments)} arguments"
            )
        table = tabulated(self.name, role, self.n_arguments)
        return to_sympy(table(*(read(x).expression for x in arguments), evaluate=False))


def one_way_fault(table: Table, acts: str) -> str:
    """Say why a curve cannot be the force of a spring that acts by "pull" or "push" only; an empty string if it can.

    Where such a spring is slack its argument is zero, and its force must be none; where it is not, the curve must not
    turn round.
    """
    (x,), sign = table.axes, 1.0 if acts == "pull" else -1.0
    value_at = dict(zip(x, table.values, strict=True))
    held = table.outside == "hold" and not x[0] < 0.0 < x[-1]
    nearest_end = x[0] if x[0] > 0.0 else x[-1]
    at_rest = value_at.get(nearest_end if held and 0.0 not in value_at else 0.0)
    if at_rest is None:
        return "has no point at 0, where it is slack: add [0, 0]"
    if at_rest != 0.0:
        return f"is {at_rest:g} at 0, where it is slack: let it begin at 0"
    if table.kind == "cubic":
        return 'is a spline, which may turn round between its points: take kind = "pchip" or "linear"'
    side = [(sign * a, sign * f) for a, f in value_at.items() if sign * a > 0.0]
    for a, f in side:
        if f < 0.0:
            return f"turns round: it is {sign * f:g} at {sign * a:g}"
    falls = len(side) > 1 and sorted(side)[-1][1] < sorted(side)[-2][1]
    if table.outside == "extend" and falls:
        return 'turns round beyond its end: take outside = "hold" or "refuse"'
    return ""


def make_table(model: Declared, name: str, given: dict[str, Any]) -> Table:
    """A table from the arguments of `Model.table`, in SI units."""
    sources, place = model._sources, f"tables.{name}"

    def error(key: str, message: str, hint: str | None = None) -> ModelError:
        return sources.error(place, key, message, hint=hint)

    columns, file = given.get("columns"), given.get("file")
    if (columns is None) == (file is None):
        raise error("columns", "a table has 'columns' or a 'file', one of them", "add one")
    if file is not None:
        if not isinstance(file, str):
            raise error("file", f"a file is named by text, not {file!r:.60}")
        path = table_path(model, "file", file, place)
        listed, stated = read_columns(path, MOST_ROWS)
        where = str(path)
    else:
        listed, stated, where = _columns(columns, error), (), ""
    kind, outside = given.get("kind") or "linear", given.get("outside") or "refuse"
    for key, value, known in (("kind", kind, TABLE_KINDS), ("outside", outside, OUTSIDE)):
        if value not in known:
            raise error(key, f"'{key}' is not {value!r:.60}", nearest(str(value)[:60], known))
    if len(listed) not in (2, 3):
        raise error(
            "file" if where else "columns",
            f"{_of(where)}{len(listed)} columns, where a curve has two (argument, value) and a map has three",
            "for example columns = [[0, 1, 2], [0.0, 0.5, 0.3]]",
        )
    if len(listed) == 3 and kind == "pchip":
        raise error("kind", "'pchip' is for one argument", "take 'cubic' or 'linear' for two")
    if len(listed) == 2 and kind == "bicubic":
        raise error("kind", "'bicubic' is for two arguments", "take 'cubic'")
    units = _units(model, place, given.get("units"), len(listed))
    units = _with_stated(units, stated or [None] * len(listed), error, where)
    try:
        listed = [in_si(column, size) for column, size in zip(listed, units, strict=True)]
    except ModelError as fault:
        raise sources.locate(fault, place, "file" if where else "columns") from None
    at = (where, place)
    axes, values = _curve(listed, error, at) if len(listed) == 2 else _map(listed, error, at)
    _check_sizes(axes, values, error, where)
    return Table(
        name=name,
        axes=axes,
        values=values,
        kind="cubic" if kind == "bicubic" else kind,
        outside=outside,
        units=tuple(None if size is None else size.coherent for size in units),
    )


def _columns(columns: Any, error) -> list[tuple[float, ...]]:
    listed = []
    if isinstance(columns, str) or not (isinstance(columns, Sequence) or hasattr(columns, "tolist")):
        raise error("columns", f"a list of columns is expected here, not {columns!r:.60}")
    for k, column in enumerate(columns, 1):
        column = column.tolist() if hasattr(column, "tolist") else column
        if isinstance(column, str) or not isinstance(column, Sequence):
            raise error("columns", f"column {k} is a list of numbers, not {column!r:.60}")
        if len(column) > MOST_ROWS:
            raise error(
                "columns",
                f"column {k} has {len(column)} rows, a table has {MOST_ROWS} at most",
                "take fewer places: between them it is a curve",
            )
        for row, value in enumerate(column, 1):
            if type(value) not in (int, float) or not math.isfinite(value):
                raise error(
                    "columns", f"column {k}, row {row}: {value!r:.40} is no finite number", "give a number"
                )
        listed.append(tuple(map(float, column)))
    if len({len(column) for column in listed}) > 1:
        lengths = ", ".join(str(len(column)) for column in listed)
        raise error("columns", f"the columns have {lengths} rows: give as many in each")
    return listed


def _units(model: Declared, place: str, units: Any, count: int) -> list[Unit | None]:
    if units is None:
        return [None] * count
    if isinstance(units, str) or not isinstance(units, Sequence) or len(units) != count:
        message = f"'units' has one text for each of the {count} columns, \"\" where there is none"
        raise model._sources.error(place, "units", message, hint='for example units = ["m", "N"]')
    return [model._sources.unit(x, place, f"units[{k}]") for k, x in enumerate(units)]


def _check_sizes(axes: tuple[tuple[float, ...], ...], values: tuple[float, ...], error, where: str) -> None:
    """Refuse places too near or too far, and values too large, for the products that polynomials between them take."""
    gaps = [after - before for axis in axes for before, after in pairwise(axis)]
    largest = max(map(abs, (*values, *(x for axis in axes for x in axis))))
    if (
        min(gaps) * LARGEST >= 1.0
        and largest <= LARGEST
        and 2.0 * max(map(abs, values)) <= min(gaps) * LARGEST
    ):
        return
    message = (
        f"{_of(where)}numbers up to {largest:.3g}, at places as near as {min(gaps):.3g}, are beyond what polynomials "
        "between them can be worked out with"
    )
    raise error("file" if where else "columns", message, "look at the exponents and the units")


def _with_stated(
    units: Sequence[Unit | None], stated: Sequence[Unit | None], error, where: str
) -> list[Unit | None]:
    """Return the unit of each column: what the model says, else what the first line of the file states."""
    for column, (own, of_file) in enumerate(zip(units, stated, strict=True), 1):
        if own is None or of_file is None:
            continue
        same = (own.factor, own.pi_power, own.dimension) == (
            of_file.factor,
            of_file.pi_power,
            of_file.dimension,
        )
        if not same:
            message = f"column {column} is in {own.text!r} here, and in {of_file.text!r} by the first line of {where}"
            raise error("units", message, "say the same in both, or in one of them only")
    return [of_file if own is None else own for own, of_file in zip(units, stated, strict=True)]


def _of(file: str) -> str:
    return f"{file}: " if file else ""


def _row(error, at: tuple[str, str], row: int, message: str, hint: str) -> ModelError:
    """An error at a row, which in a file is counted without its names and comments."""
    where = f" of {at[0]}" if at[0] else ""
    return error("columns" if not at[0] else "file", f"row {row}{where}: {message}", hint)


def _curve(listed, error, at) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
    x, values = listed
    if len(x) < 2:
        raise error("columns", f"a curve has two rows at least, this one has {len(x)}")
    for row, (before, after) in enumerate(pairwise(x), 2):
        if not after > before:
            message = f"arguments must ascend, but {after:.9g} follows {before:.9g}"
            raise _row(error, at, row, message, "sort the rows, each argument once")
    return (x,), values


def _map(listed, error, at) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
    """The axes of a map, and its values row by row, from rows in any order."""
    known: dict[tuple[float, float], float] = {}
    for row, (x, y, value) in enumerate(zip(*listed, strict=True), 1):
        if (x, y) in known:
            raise _row(error, at, row, f"({x:.9g}, {y:.9g}) stands there twice", "leave one of the rows out")
        known[x, y] = value
    axes = tuple(tuple(sorted({place[k] for place in known})) for k in (0, 1))
    for k, axis in enumerate(axes):
        if len(axis) < 2:
            raise error(
                "columns", f"argument {k + 1} of a map has two places at least, this one has {len(axis)}"
            )
    missing = [(x, y) for x in axes[0] for y in axes[1] if (x, y) not in known]
    if missing:
        x, y = missing[0]
        of_all = f"{len(missing)} of {len(axes[0]) * len(axes[1])}"
        raise error(
            "file" if at[0] else "columns",
            f"{_of(at[0])}{of_all} values of the map are missing, the first at ({x:.9g}, {y:.9g})",
            "a map has a value for each first argument with each second one",
        )
    return axes, tuple(known[x, y] for x in axes[0] for y in axes[1])
