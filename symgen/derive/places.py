"""Where the values of one subsystem stand in the arrays of the whole model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from symgen.runtime.graph.layouts import ENERGY, LAYOUTS, POWER, RATIO

Sizes = Mapping[str, int]
Places = Mapping[str, tuple[int, ...]]
# Of numbers that all subsystems make together, where they begin: the ratio is a minimum, the others are sums.
START = {POWER: 0.0, RATIO: 1.0, ENERGY: 0.0}


def write_places(
    function: str, written: Sequence[int], places: Mapping[str, np.ndarray], own: Sizes, whole: Sizes
) -> np.ndarray:
    """Places in the whole model's `out` of what equal subsystems' function writes.

    Parameters
    ----------
    function : str
    written : sequence of int
        Places in a subsystem's own `out`, ascending.
    places : mapping of str to ndarray of int, shape (members, length)
        Indices in the whole model of each subsystem's elements, by the letters of `LAYOUTS`.
    own, whole : mapping of str to int
        The lengths of these vectors in a subsystem and in the whole model; those of POWER and RATIO are 1 where `rhs`
        writes them.

    Returns
    -------
    ndarray of int, shape (members, written)
    """
    found, written = [], np.array(written, dtype=np.int64)
    start = offset = 0
    for block in LAYOUTS[function]:
        if block in START:
            rows = np.zeros((len(places["q"]), own[block]), dtype=np.int64)
            n_rows, letters = whole[block], ""
        else:
            rows, n_rows = _axis(block[0], places, whole)
            letters = block[1]
        columns, n_columns = _axis(letters, places, whole) if letters else (np.zeros_like(rows[:, :1]), 1)
        length = rows.shape[1] * columns.shape[1]
        here = written[(start <= written) & (written < start + length)] - start
        i, j = np.divmod(here, max(1, columns.shape[1]))
        found.append(offset + rows[:, i] * n_columns + columns[:, j])
        start, offset = start + length, offset + n_rows * n_columns
    return np.hstack(found)


def reductions(function: str, whole: Sizes) -> dict[int, str]:
    """Places in the whole model's `out` of numbers that all subsystems make together, and which these are."""
    result: dict[int, str] = {}
    offset = 0
    for block in LAYOUTS[function]:
        if block in START:
            if whole[block]:
                result[offset] = block
            offset += whole[block]
        else:
            offset += _length(block[0], whole) * (_length(block[1], whole) if block[1] else 1)
    return result


def _axis(letters: str, places: Mapping[str, np.ndarray], whole: Sizes) -> tuple[np.ndarray, int]:
    """Places along an axis that joins several vectors, for each member, and its length."""
    found, offset = [], 0
    for letter in letters:
        found.append(offset + places[letter])
        offset += whole[letter]
    return np.hstack(found), offset


def _length(letters: str, whole: Sizes) -> int:
    return sum(whole[letter] for letter in letters)
