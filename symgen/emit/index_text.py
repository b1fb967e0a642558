"""The text of an index table: long ones by what repeats in them (`docs/abi.md`, "Loops")."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SHORTEST = 64  # entries of a table in which repetition is looked for
LONGEST_PERIOD = 8
# Characters of a piece: of `*range(a, b, s)`, and of one that goes on with a period, and for each entry of that.
_OF_RANGE, _OF_PERIOD, _OF_ENTRY = 24, 52, 12

Run = tuple[int, int, int]  # first entry, end, period


def table_text(entries: Sequence[int]) -> str:
    """The entries as a tuple, which Python and `runtime.index_tables` read."""
    if len(entries) < SHORTEST:
        return f"({', '.join(map(str, entries))})"
    values = np.array(entries, dtype=np.int64)
    pieces: list[str] = []
    done = 0
    for first, end, period in _taken(_runs(values), len(values)):
        pieces += map(str, entries[done:first])
        pieces.append(_piece(values[first:end], period))
        done = end
    pieces += map(str, entries[done:])
    return f"({', '.join(pieces)}{',' * (len(pieces) == 1)})"


def _runs(values: np.ndarray) -> list[tuple[int, Run]]:
    """Where each entry is as far from the one a period before as that from its own; with what is spared."""
    found = []
    length = len(str(int(values.max()))) + 2
    for period in range(1, LONGEST_PERIOD + 1):
        change = values[period:] - values[:-period]
        breaks = np.flatnonzero(change[period:] != change[:-period])
        begins = np.concatenate(([0], breaks + 1))
        ends = np.concatenate((breaks, [len(values) - 2 * period])) + 2 * period
        cost = _OF_RANGE if period == 1 else _OF_PERIOD + _OF_ENTRY * period
        spared = (ends - begins) * length - cost
        for k in np.flatnonzero((spared > 0) & (ends - begins >= 3 * period)).tolist():
            found.append((int(spared[k]), (int(begins[k]), int(ends[k]), period)))
    return found


def _taken(runs: list[tuple[int, Run]], n: int) -> list[Run]:
    """Those that spare most, in order, cut where they overlap, to whole periods."""
    free = np.ones(n, dtype=bool)
    taken = []
    for _, (begin, end, period) in sorted(runs, key=lambda run: (-run[0], run[1])):
        inside = np.flatnonzero(free[begin:end])
        if not len(inside):
            continue
        first = begin + int(inside[0])
        beyond = np.flatnonzero(~free[first:end])
        end = first + int(beyond[0]) if len(beyond) else end
        end -= (end - first) % period
        if end - first >= 3 * period and end - first >= 8:
            free[first:end] = False
            taken.append((first, end, period))
    return sorted(taken)


def _piece(values: np.ndarray, period: int) -> str:
    begin, step = values[:period].tolist(), (values[period : 2 * period] - values[:period]).tolist()
    n = len(values) // period
    if not any(step):
        return f"*({', '.join(map(str, begin))}{',' * (period == 1)})*{n}"
    if period == 1:
        end = begin[0] + n * step[0]
        return f"*range({begin[0]}, {end}{f', {step[0]}' * (step[0] != 1)})"
    pairs = ", ".join(f"({a}, {b})" for a, b in zip(begin, step, strict=True))
    return f"*(a + b*k for k in range({n}) for a, b in ({pairs}))"
