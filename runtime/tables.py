"""A run as a table: a column for the time and one for each series, with units; CSV, Parquet, pandas, xarray."""

from __future__ import annotations

import csv
import importlib.util
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.names import acceleration_labels, motion_records, rate_labels
from symgen.runtime.solution import series_of

if TYPE_CHECKING:
    import pandas
    import xarray

    from symgen.runtime.recording.recording import Recording
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

TIME = "t"
_ENERGIES = ("kinetic_energy", "potential_energy", "work")


class MissingPackage(RuntimeModelError, ImportError):
    """A package of an extra is not installed."""


def need(package: str, extra: str, what: str) -> None:
    """Refuse to begin with what cannot be done.

    Raises
    ------
    MissingPackage
        Names the command that installs what is missing.
    """
    if importlib.util.find_spec(package) is None:
        raise MissingPackage(f"{what} needs {package}, which is not installed: pip install 'symgen[{extra}]'")


@dataclass(frozen=True)
class Columns:
    """Series over time.

    Attributes
    ----------
    names, units : tuple of str
        The time first; a unit is empty where the model states none.
    values : ndarray, shape (n_frames, number of columns)
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray

    def write_csv(self, path: str | os.PathLike[str]) -> None:
        """Write a line of names, then a line for each frame; numbers read back bit for bit."""
        with Path(path).open("w", encoding="utf-8", newline="") as file:
            self.write_text(file)

    def write_text(self, file: Any) -> None:
        """Write what `write_csv` does to an open text file."""
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(self.names)
        lines.writerows([f"{value:.17g}" for value in row] for row in self.values.tolist())

    def write_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write a Parquet file; each field's metadata have its unit."""
        import pyarrow
        from pyarrow import parquet  # takes a fifth of a second

        fields = [
            pyarrow.field(name, pyarrow.float64(), metadata={"unit": unit})
            for name, unit in zip(self.names, self.units)
        ]
        columns = [np.ascontiguousarray(column) for column in self.values.T]
        parquet.write_table(pyarrow.table(columns, schema=pyarrow.schema(fields)), os.fspath(path))

    def to_dataframe(self) -> pandas.DataFrame:
        """Return a pandas DataFrame over the time; `attrs["units"]` has the units by name."""
        need("pandas", "tables", "a data frame")
        import pandas

        index = pandas.Index(self.values[:, 0], name=TIME)
        frame = pandas.DataFrame(self.values[:, 1:], index=index, columns=list(self.names[1:]))
        frame.attrs["units"] = dict(zip(self.names, self.units))
        return frame

    def to_xarray(self, **attributes: Any) -> xarray.Dataset:
        """Return an xarray Dataset over the time; each variable's attributes have its unit."""
        need("xarray", "tables", "a Dataset")
        import xarray

        variables = {
            name: (TIME, self.values[:, k], {"units": self.units[k]})
            for k, name in enumerate(self.names)
            if k
        }
        return xarray.Dataset(
            variables, coords={TIME: (TIME, self.values[:, 0], {"units": "s"})}, attrs=attributes
        )


def columns_of(solution: Solution) -> Columns:
    """Return all series of a run, and its energies."""
    energy = solution.energy
    energies = dict(zip(_ENERGIES, (energy.kinetic, energy.potential, energy.work)))
    names = names_of(solution.system)
    series = [solution.t] + [
        energies[name] if name in energies and name not in solution.names() else solution[name]
        for name in names[1:]
    ]
    units = _units(solution.system)
    units |= {name: "J" for name in _ENERGIES if name not in solution.names()}
    return Columns(names, ("s", *(units.get(name, "") for name in names[1:])), np.column_stack(series))


def names_of(system: System) -> tuple[str, ...]:
    """Return the names of the columns of a model's runs."""
    own = list(series_of(system))
    return (TIME, *own, *(name for name in _ENERGIES if name not in own))


def _units(system: System) -> dict[str, str]:
    """The units of series by name, as far as the model states them."""
    units = {
        record["name"]: record.get("unit", "")
        for record in (*system.coordinates, *system.outputs, *system.inputs)
    }
    rates, accelerations = (
        labels(system.coordinates, system.rates) for labels in (rate_labels, acceleration_labels)
    )
    for rate, acceleration, record in zip(rates, accelerations, system.rates):
        units.setdefault(rate, record["unit"])
        units.setdefault(acceleration, _per_second(record["unit"]))
    units |= {f"lambda({c['name']})": c.get("multiplier", "") for c in system.constraints}
    return units


def _per_second(unit: str) -> str:
    """The unit of a derivative: m/s becomes m/s^2."""
    if not unit:
        return ""
    return f"{unit}^2" if unit.endswith("/s") and unit.count("/") == 1 else f"({unit})/s"


def columns_in(path: str | os.PathLike[str]) -> Sequence[str]:
    """Return the names of the columns of a CSV or Parquet file; nothing where it is neither."""
    try:
        with Path(path).open("rb") as file:
            begin = file.read(1 << 16)
        if begin.startswith(b"PAR1"):
            from pyarrow import parquet

            return parquet.read_schema(os.fspath(path)).names
        return next(csv.reader([begin.partition(b"\n")[0].decode("utf-8")]), [])
    except (OSError, ValueError, csv.Error):
        return []


def columns_of_recording(recording: Recording, system: System) -> Columns:
    """Return what a recording holds: states, multipliers and energies, as they were written.

    Parameters
    ----------
    recording : Recording
    system : System
        Of the recording's own module.
    """
    shown = motion_records(system.coordinates, system.integrals)
    labels = [record["name"] for _, record in shown]
    labels += rate_labels(system.coordinates, system.rates)
    labels += [f"lambda({record['name']})" for record in system.constraints]
    q = recording.q[:, [place for place, _ in shown]]
    parts = [recording.t[:, None], q, recording.v, recording.multipliers]
    if len(recording.energy) == len(recording.t):  # a run that was cut off may lack those of its last frames
        energies = [name for name in _ENERGIES[:2] if name not in labels]
        labels += energies
        parts.append(recording.energy[:, : len(energies)])
    units = {**_units(system), **dict.fromkeys(_ENERGIES, "J")}
    return Columns((TIME, *labels), ("s", *(units.get(name, "") for name in labels)), np.hstack(parts))
