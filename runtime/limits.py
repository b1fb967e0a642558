"""Parameters at which a model is none, by the limits in its module: what runs are refused by without a description."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from symgen.runtime.graph.bounds import is_broken, words
from symgen.runtime.graph.layouts import LIMITS

if TYPE_CHECKING:
    import numpy as np


def faults(header: Mapping[str, Any], numbers: np.ndarray) -> dict[int, str]:
    """Return which of many runs have parameters that a model does not allow, and the first that is wrong of each.

    Parameters
    ----------
    header : mapping
        Of the model's module.
    numbers : ndarray, shape (n, how many the function `limits` writes)
        What it writes for each run.

    Returns
    -------
    dict of int to str
        By row.
    """
    said = {k: _fault(header, row) for k, row in enumerate(numbers.tolist())}
    return {k: fault for k, fault in said.items() if fault}


def _fault(header: Mapping[str, Any], row: list[float]) -> str:
    """Return the first thing that is wrong; an empty string for nothing."""
    first = 0
    for record in header[LIMITS]:
        numbers = row[first : first + record.get("numbers", 1)]
        first += len(numbers)
        if not all(map(math.isfinite, numbers)) or is_broken(record["bound"], *numbers):
            return _sentence(f"model {header['name']!r}, {record['name']}", record["bound"], numbers)
    return ""


def _sentence(place: str, bound: str, numbers: Sequence[float]) -> str:
    if not all(map(math.isfinite, numbers)):
        return f"{place}: it has no finite value at the parameters' values"
    values = ", ".join(f"{x:g}" for x in (numbers if len(numbers) > 2 else numbers[:1]))
    return (
        f"{place}: it is {values} at the parameters' values, and has to be {words(bound, numbers)}: look at the "
        "parameters in it"
    )
