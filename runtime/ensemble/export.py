"""An ensemble as a table of other programs: a row for each member; what is a series has a column of lists."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.tables import need

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from symgen.runtime.ensemble.zarr_store import ZarrStore

_BINS = 64


def as_dataframe(columns: dict[str, np.ndarray]) -> pandas.DataFrame:
    """Return a pandas DataFrame over members; of a series over time the last value."""
    need("pandas", "tables", "a data frame")
    import pandas

    rows = {name: values if values.ndim == 1 else values[:, -1] for name, values in columns.items()}
    return pandas.DataFrame(rows, index=pandas.RangeIndex(len(next(iter(rows.values()), [])), name="member"))


def as_dataset(columns: dict[str, np.ndarray], t: np.ndarray, **attributes: Any) -> xarray.Dataset:
    """Return an xarray Dataset over members, and over the time where there are series."""
    need("xarray", "tables", "a Dataset")
    import xarray

    variables = {
        name: (("member",) if values.ndim == 1 else ("member", "t"), values)
        for name, values in columns.items()
    }
    coordinates = {"t": ("t", t, {"units": "s"})} if any(x.ndim > 1 for x in columns.values()) else {}
    return xarray.Dataset(variables, coords=coordinates, attrs=attributes)


def open_dataset(store: ZarrStore) -> xarray.Dataset:
    """Return an xarray Dataset of a store, of which what is used is read when it is used."""
    need("xarray", "tables", "a Dataset")
    import xarray

    found = xarray.open_zarr(store.path, consolidated=False, chunks=None)
    return found.assign_attrs(model=store.about["model"], method=store.about["method"])


def write_parquet(columns: dict[str, np.ndarray], path: str | os.PathLike[str]) -> None:
    """Write a Parquet file with a row for each member; a series is a list in it."""
    import pyarrow
    from pyarrow import parquet  # takes a fifth of a second

    fields = {}
    for name, values in columns.items():
        plain = pyarrow.array(np.ascontiguousarray(values).reshape(-1))
        fields[name] = (
            plain if values.ndim == 1 else pyarrow.FixedSizeListArray.from_arrays(plain, values.shape[1])
        )
    parquet.write_table(pyarrow.table(fields), os.fspath(path))


def distribution(name: str, values: np.ndarray) -> Figure:
    """Return a histogram of a quantity over members."""
    need("matplotlib", "figures", "plot")
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(6.0, 3.6), layout="constrained")
    axes = drawn.subplots()
    axes.hist(values[np.isfinite(values)], bins=_BINS)
    axes.set_xlabel(name)
    axes.set_ylabel("members")
    axes.grid(alpha=0.3)
    return drawn
