"""Crossings of zero that event functions have between the frames, there and back, however short.

A run looks at each step in some places, and its report at some between frames: a well that is passed in a thousandth
of a step shows in none of them. On ranges over cells of the recorded path (`symgen.runtime.timing`) it does: cells in
which a function may be zero, and is not monotone, are cut until they show that it is not, or where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.jumped_over import Path
from symgen.runtime.errors import ModuleError
from symgen.runtime.inputs.driven import DrivenSystem
from symgen.runtime.timing.intervals import Range

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_POLYNOMIAL = frozenset(("const", "var", "neg", "add", "sub", "mul"))
_PARTS, _MOST_CELLS = 8, 4000
_FINEST = 2.0**-36  # of the run
# Of the function beside it: how far beyond zero it has to come. The path between frames is interpolated, and what
# touches zero is for the looks of the steps themselves, on the motion that they computed.
_DEPTH = 0.05


def hidden_crossings(solution: Solution, which: Sequence[int], quiet: np.ndarray) -> list[tuple[float, int]]:
    """Return times at which event functions are on the other side of zero than at the frames around them.

    Between two frames it is one for each event.

    Parameters
    ----------
    which : sequence of int
        The events.
    quiet : ndarray of bool, shape (frames - 1,)
        Intervals between frames that no event is near to.

    Returns
    -------
    list of (float, int)
        Time [s] and event.
    """
    system, t = solution.system, solution.t
    if isinstance(system, DrivenSystem) or not quiet.any() or not len(which) or _only_polynomials(solution):
        return []
    try:
        with np.errstate(all="ignore"):
            path = Path(solution, "events", 0)
            found = [(when, e) for e in which for when in _of_event(path, e, t[:-1][quiet], t[1:][quiet])]
    except ModuleError:  # loops with arrays, of large models
        return []
    first = {(int(np.searchsorted(t, when)), e): when for when, e in sorted(found, reverse=True)}
    return [(when, e) for (_, e), when in first.items()]


def _only_polynomials(solution: Solution) -> bool:
    """Whether dips of the functions are as wide as those of the motion, so that the steps see them."""
    form = solution.system.function_text("events").form
    return all(form.nodes.op[node] in _POLYNOMIAL for node in form.nodes.reachable(form.roots()))


def _of_event(path: Path, e: int, begin: np.ndarray, end: np.ndarray) -> list[float]:
    longer = end > begin
    begin, end = begin[longer], end[longer]
    side = np.zeros(0)
    finest = _FINEST * (end[-1] - begin[0]) if len(begin) else 0.0
    found: list[float] = []
    looked = 0
    while len(begin) and looked < _MOST_CELLS:
        g = path.ranges(begin, end)[e]
        if not isinstance(g, Range):
            return []
        looked += len(begin)
        if not looked > len(begin):  # at the frames: points are the shortest of cells
            edges = [path.ranges(at, at)[e] for at in (begin, end)]
            first, last = (edge.middle for edge in edges)
            side = np.where(first * last > 0.0, np.minimum(np.abs(first), np.abs(last)) * np.sign(first), 0.0)
        beyond = (np.sign(side) * g.middle < -_DEPTH * np.abs(side)) & (side != 0.0)
        found += (0.5 * (begin + end)[beyond]).tolist()
        monotone = (g.slow >= 0.0) | (g.fast <= 0.0)
        open_ones = (side != 0.0) & ~beyond & (g.low <= 0.0) & (g.high >= 0.0) & ~(monotone & (g.breaks == 0))
        open_ones &= end - begin > finest
        begin, end, side = begin[open_ones], end[open_ones], side[open_ones]
        cuts = begin + (end - begin) * np.arange(_PARTS + 1)[:, None] / _PARTS
        begin, end, side = cuts[:-1].ravel(), cuts[1:].ravel(), np.tile(side, _PARTS)
    return found
