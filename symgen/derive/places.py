"""Where the values of one subsystem stand in the arrays of the whole model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

# What the functions of the ABI write, in order, as (rows, columns): an axis joins vectors over coordinates (q), rates
# (v), holonomic constraints (h), all constraints (c), entries of poses (p) and shapes (s); a vector has one column.
# SUM and MIN are one number that all subsystems make together.
SUM, MIN = "sum", "min"
LAYOUTS: dict[str, tuple] = {
    "rhs": (("q", ""), ("v", ""), SUM, ("c", ""), MIN),
    "kinematics": (("q", "v"), ("q", "q")),
    "mass_matrix": (("v", "v"),),
    "forces": (("v", ""),),
    "energy": (SUM, SUM),
    "residual": (("vc", ""),),
    "residual_jacobian": (("vc", "qvvc"),),
    "constraint_residual": (("hc", ""),),
    "constraint_jacobian": (("c", "v"),),
    "gamma": (("c", ""),),
    "project": (("qvhc", ""),),
    "poses": (("p", ""),),
    "shapes": (("s", ""),),
}
Sizes = Mapping[str, int]
Places = Mapping[str, tuple[int, ...]]
START = {SUM: 0.0, MIN: 1.0}


def write_places(
    function: str, written: Iterable[int], places: Places, own: Sizes, whole: Sizes
) -> list[int]:
    """Places in the whole model's `out` of what a subsystem's function writes.

    Parameters
    ----------
    function : str
    written : iterable of int
        Places in the subsystem's own `out`, ascending.
    places : mapping of str to tuple of int
        Indices in the whole model of the subsystem's elements, by the letters of `LAYOUTS`.
    own, whole : mapping of str to int
        The lengths of these vectors in the subsystem and in the whole model; `"sum"` and `"min"` are 1 where
        `rhs` writes a power and a pivot ratio.
    """
    result: list[int] = []
    blocks = _blocks(function, places, own, whole)
    start, (length, place) = 0, next(blocks)
    for k in written:
        while k >= start + length:
            start += length
            length, place = next(blocks)
        result.append(place(k - start))
    return result


def _blocks(
    function: str, places: Places, own: Sizes, whole: Sizes
) -> Iterator[tuple[int, Callable[[int], int]]]:
    """For each block of a function's `out`: its length in a subsystem, and the place in the whole of its entry k."""
    offset = 0
    for block in LAYOUTS[function]:
        if block in (SUM, MIN):
            yield _present(function, block, own), lambda k, offset=offset: offset
            offset += _present(function, block, whole)
            continue
        rows, n_rows = _axis(block[0], places, whole)
        columns, n_columns = _axis(block[1], places, whole) if block[1] else ([0], 1)

        def place(k, offset=offset, rows=rows, columns=columns, n_columns=n_columns):
            i, j = divmod(k, len(columns))
            return offset + rows[i] * n_columns + columns[j]

        yield len(rows) * len(columns), place
        offset += n_rows * n_columns


def reductions(function: str, whole: Sizes) -> dict[int, str]:
    """Places in the whole model's `out` of numbers that all subsystems make together: their sum or minimum."""
    result: dict[int, str] = {}
    offset = 0
    for block in LAYOUTS[function]:
        if block in (SUM, MIN):
            if _present(function, block, whole):
                result[offset] = block
            offset += _present(function, block, whole)
        else:
            offset += _length(block[0], whole) * (_length(block[1], whole) if block[1] else 1)
    return result


def _present(function: str, block: str, sizes: Sizes) -> int:
    """Whether a function writes a common number: `rhs` only where there is power, or a constraint."""
    return 1 if function != "rhs" else sizes[block]


def _axis(letters: str, places: Places, whole: Sizes) -> tuple[list[int], int]:
    """Places along an axis that joins several vectors, and its length."""
    found: list[int] = []
    offset = 0
    for letter in letters:
        found += [offset + place for place in places[letter]]
        offset += whole[letter]
    return found, offset


def _length(letters: str, whole: Sizes) -> int:
    return sum(whole[letter] for letter in letters)
