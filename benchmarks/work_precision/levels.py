"""Run time at a given error, by interpolation between measured runs, never beyond them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .case import Row

LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
LOST = 1.0  # an error as large as the motion itself
_TRACKED = 1e-2


def label(level: float) -> str:
    """Return the name of a level: "1e-3"."""
    return f"1e{round(math.log10(level))}"


def seconds_at(rows: Sequence[Row], level: float) -> float | None:
    """Return the least run time with an error of at most `level`, None where no run is as accurate.

    Between a run that is too coarse and the next finer one that is not, seconds and error are taken to lie on a
    straight line in logarithms; not from runs that have nothing to do with the motion (an error of 1 or more).
    Where the coarsest run is already accurate enough, its own time counts.

    Parameters
    ----------
    rows : sequence of Row
        Neighbouring settings follow each other; none failed.
    """
    found = [row.seconds for row in rows if row.error <= level]
    found += [_between(a, b, level) for a, b in pairwise(rows) if LOST > a.error > level >= b.error]
    return min(found, default=None)


def _between(coarse: Row, fine: Row, level: float) -> float:
    error = max(fine.error, 1e-300)
    part = math.log(coarse.error / level) / math.log(coarse.error / error)
    return math.exp((1.0 - part) * math.log(coarse.seconds) + part * math.log(fine.seconds))


def all_levels(rows: Sequence[Row]) -> dict[str, float | None]:
    """Return the run time at each level."""
    return {label(level): seconds_at(rows, level) for level in LEVELS}


def best_at(times: Mapping[str, Mapping[str, float | None]], level: str) -> tuple[str, float] | None:
    """Return the name and run time of the fastest at a level; the first name where two are equal."""
    reached = [(at[level], name) for name, at in times.items() if at.get(level) is not None]
    if not reached:
        return None
    seconds, name = min(reached)
    return name, seconds


def lost_again(rows: Sequence[Row]) -> list[float]:
    """Return the settings of runs that lost the motion although a coarser one had followed it."""
    tracked, lost = False, []
    for row in rows:
        if tracked and row.error >= LOST:
            lost.append(row.setting)
        tracked = tracked or row.error <= _TRACKED
    return lost
