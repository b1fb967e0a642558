"""What an input does over time, as a model says it: a table, in the model or in a file beside it, or a polynomial."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ..errors import ModelError, nearest
from .declared import Declared
from .given import unpacked
from .table_file import read_table_file
from .units import Unit, in_si

KINDS = ("linear", "cubic", "hold")


def read_over_time(
    model: Declared, name: str, size: Unit | None, table: Any, kind: str | None, polynomial: Any
) -> dict[str, Any]:
    """Return the fields of `Input` for what was said about its course over time, in SI units.

    Parameters
    ----------
    size : Unit, optional
        The input's unit, in which the values are.
    table : str, pair of sequences, or None
        A file below the model's folder, or times and values.
    kind : str, optional
        Of the table.
    polynomial : sequence of float, or None
        Coefficients of powers of t, from the constant upward.
    """
    sources = model._sources
    if table is not None and polynomial is not None:
        raise sources.error("inputs", name, "a table and a polynomial are given", hint="give one of them")
    if kind is not None and table is None:
        raise sources.error(
            "inputs",
            f"{name}.kind",
            "a kind belongs to a table, of which there is none",
            hint="give a 'table', or leave 'kind' out",
        )
    if kind is not None and kind not in KINDS:
        hint = nearest(str(kind)[:60], KINDS, "kinds")
        raise sources.error("inputs", f"{name}.kind", f"unknown kind of table {kind!r:.60}", hint=hint)
    if polynomial is not None:
        numbers = _numbers(model, f"{name}.polynomial", polynomial)
        if not numbers:
            raise sources.error(
                "inputs",
                f"{name}.polynomial",
                "a polynomial has at least one coefficient",
                hint="for example polynomial = [0.0, 1.0]",
            )
        return {"polynomial": _in_si(model, f"{name}.polynomial", numbers, size)}
    if table is None:
        return {}
    key = f"{name}.table"
    if isinstance(table, str):
        times, values = _from_file(model, name, table, size)
    else:
        times, values = _pair(model, key, table)
        values = _in_si(model, key, values, size)
    return {"times": times, "values": values, "kind": kind or "linear"}


def _in_si(model: Declared, key: str, values: tuple[float, ...], size: Unit | None) -> tuple[float, ...]:
    try:
        return in_si(values, size)
    except ModelError as error:
        raise model._sources.locate(error, "inputs", key) from None


def _pair(model: Declared, key: str, table: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    error, table = model._sources.error, unpacked(table)
    if not isinstance(table, Sequence) or len(table) != 2:
        raise error(
            "inputs", key, "a table is a list of times and a list of values, or the name of a file",
            hint="for example table = [[0, 1, 2], [0.0, 0.5, 0.3]]",
        )  # fmt: skip
    times, values = (_numbers(model, key, numbers) for numbers in table)
    if len(times) != len(values) or not times:
        raise error(
            "inputs", key, f"the table has {len(times)} times and {len(values)} values: give as many of each"
        )
    for before, after in pairwise(times):
        if after <= before:
            raise error("inputs", key, f"times must ascend, but {after:.9g} s follows {before:.9g} s")
    return times, values


def _numbers(model: Declared, key: str, values: Any) -> tuple[float, ...]:
    error = model._sources.error
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, str) or not isinstance(values, Sequence):
        raise error("inputs", key, f"a list of numbers is expected here, not {values!r:.60}")
    for value in values:
        if type(value) not in (int, float) or not math.isfinite(value):
            raise error("inputs", key, f"finite numbers are expected here, not {value!r:.60}")
    return tuple(map(float, values))


def _from_file(
    model: Declared, name: str, file: str, size: Unit | None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The table of a file in SI; of several columns, the one that bears the input's name."""
    key = f"{name}.table"
    content = read_table_file(table_path(model, key, file))
    if len(content.columns) == 1:
        return content.times, content.in_si(0, size)
    if name not in content.names[1:]:
        raise model._sources.error(
            "inputs", key, f"the table {file!r:.100} has {len(content.columns)} columns of values, none is {name!r}",
            hint="name the columns in the first line",
        )  # fmt: skip
    return content.times, content.in_si(content.names[1:].index(name), size)


def table_path(model: Declared, key: str, file: str, table: str = "inputs", what: str = "table") -> Path:
    """Return where a table lies, held below the model's own folder: model files come from strangers."""
    error = model._sources.error
    foreign = PurePosixPath(file).is_absolute() or PureWindowsPath(file).anchor or "\\" in file
    if not file or not file.isprintable() or foreign or ".." in PurePosixPath(file).parts:
        raise error(
            table,
            key,
            f"the {what} {file!r:.100} is not below the model's own folder",
            hint="put it beside the model",
        )
    if model.folder is None:
        raise error(
            table, key, f"the model has no folder to find the {what} in", hint="give Model(…, folder=…)"
        )
    folder = model.folder.resolve()
    found = (folder / file).resolve()
    if not found.is_relative_to(folder):
        raise error(table, key, f"the {what} {file!r:.100} leads out of the model's own folder")
    if not found.is_file():
        raise error(table, key, f"the {what} {file!r:.100} is not there", hint=f"looked in {folder}")
    return found
