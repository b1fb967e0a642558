"""Crossings of zero that event functions have between the frames, there and back, however short.

A run looks at each step in some places, and its report at some between frames: a well that is passed in a thousandth
of a step shows in none of them. On ranges over cells of the recorded path (`symgen.runtime.timing`) it does: cells in
which a function may be zero, and is not monotone, are cut until they show that it is not, or where it is. What crosses
zero more often along the path than its event has fired was passed by.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.jumped_over import Path
from symgen.runtime.errors import ModuleError
from symgen.runtime.inputs.driven import DrivenSystem
from symgen.runtime.loop_arrays import DIRECTIONS
from symgen.runtime.timing.intervals import Range

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_POLYNOMIAL = frozenset(("const", "var", "neg", "add", "sub", "mul"))
_PARTS, _MOST_CELLS = 8, 4000
_FINEST = 2.0**-36  # of the run
# How far beyond zero a function has to come: of what it is at the frames beside it, and of what the path makes of it
# where its event fired. The path between frames is interpolated, and what touches zero is for the looks of the steps
# themselves, on the motion that they computed.
_DEPTH, _OF_PATH = 0.05, 10.0
_ROUND_OFF = 1e-7  # of the function's range
_MOST_JUMPS = 500


def hidden_crossings(solution: Solution, which: Sequence[int]) -> list[tuple[float, int]]:
    """Return times at which event functions cross zero without their event.

    Between two frames it is one for each event.

    Parameters
    ----------
    which : sequence of int
        The events.

    Returns
    -------
    list of (float, int)
        Time [s] and event.
    """
    system, t = solution.system, solution.t
    if isinstance(system, DrivenSystem) or not len(which) or _only_polynomials(solution):
        return []
    jumps = [event for event in solution.events if event.action not in ("record", "terminate")]
    if len(jumps) > _MOST_JUMPS:
        return []
    try:
        with np.errstate(all="ignore"):
            path = Path(solution, "events", 0, jumps)
            found = [(when, e) for e in which for when in _of_event(solution, path, e)]
    except ModuleError:  # loops with arrays, of large models
        return []
    first = {(int(np.searchsorted(t, when)), e): when for when, e in sorted(found, reverse=True)}
    return [(when, e) for (_, e), when in first.items()]


def _only_polynomials(solution: Solution) -> bool:
    """Whether dips of the functions are as wide as those of the motion, so that the steps see them."""
    form = solution.system.function_text("events").form
    return all(form.nodes.op[node] in _POLYNOMIAL for node in form.nodes.reachable(form.roots()))


def _of_event(solution: Solution, path: Path, e: int) -> list[float]:
    event = solution.system.events[e]
    direction, fired = DIRECTIONS[event["direction"]], _times_of(solution, event["name"])
    nodes = _before_the_end(path)
    edges = path.ranges(nodes, nodes)[e]  # points are the shortest of cells
    if not isinstance(edges, Range) or not np.isfinite(edges.middle).all():
        return []
    intervals = np.flatnonzero(path.smooth)
    depth = np.full(len(path.smooth), np.inf)
    depth[intervals] = _depths(edges.middle[intervals], edges.middle[intervals + 1])
    depth = np.maximum(depth, _ROUND_OFF * np.ptp(edges.middle))
    groups = [np.array([k]) for k in intervals]
    if len(fired):
        groups = _groups(path, fired)
        off = np.abs(path.ranges(fired, fired)[e].middle)
        for k, own in zip(np.searchsorted(path.t, fired), off, strict=True):
            near = slice(max(k - 2, 0), k + 1)
            depth[near] = np.maximum(depth[near], _OF_PATH * own)
    t, g, interval = _looks(path, e)
    t, g = np.append(nodes, t), np.append(edges.middle, g)
    # A node stands for the interval before it and the one behind it: it is clear where it is for one of them.
    least = np.minimum(np.append(depth[:1], depth), np.append(depth, depth[-1:]))
    clear = np.abs(g) > np.append(least, depth[interval])
    order = np.flatnonzero(clear)[np.argsort(t[clear], kind="stable")]
    t, sign = t[order], np.sign(g[order])
    found = []
    for group in groups:
        begin, end = path.t[group[0]], path.t[group[-1] + 1]
        first, last = np.searchsorted(t, begin), np.searchsorted(t, end, side="right")
        changes = [
            0.5 * (t[k] + t[k + 1])
            for k in range(first, last - 1)
            if sign[k] != sign[k + 1] and direction * sign[k + 1] >= 0
        ]
        own = fired[(fired >= begin) & (fired <= end)]
        if len(changes) > len(own):
            found.append(_farthest(np.array(changes), own))
    return found


def _before_the_end(path: Path) -> np.ndarray:
    """Return the nodes of a path, of which the last is just before its end: what jumps in that instant is no matter."""
    return np.append(path.t[:-1], np.nextafter(path.t[-1], path.t[0]))


def _times_of(solution: Solution, name: str) -> np.ndarray:
    return np.array([event.t for event in solution.events if event.name == name], dtype=float)


def _depths(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return how far beyond zero a function has to come in intervals at whose ends it has these values."""
    before, after, same = np.abs(before), np.abs(after), before * after > 0.0
    return _DEPTH * np.where(same, np.minimum(before, after), np.maximum(before, after))


def _groups(path: Path, fired: np.ndarray) -> list[np.ndarray]:
    """Return intervals between nodes: alone, or those around events with their neighbours, as far as nothing jumps."""
    near = np.zeros(len(path.smooth), dtype=bool)
    for k in np.searchsorted(path.t, fired):
        near[max(k - 2, 0) : k + 1] = True
    groups: list[list[int]] = []
    for k in np.flatnonzero(path.smooth):
        if groups and near[k] and groups[-1][-1] == k - 1 and near[k - 1]:
            groups[-1].append(k)
        else:
            groups.append([k])
    return [np.array(group) for group in groups]


def _farthest(times: np.ndarray, others: np.ndarray) -> float:
    """Return the time that is farthest from others."""
    if not len(others):
        return float(times[0])
    return float(times[np.argmax(np.abs(times[:, None] - others).min(axis=1))])


def _looks(path: Path, e: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, values of a function there, and the intervals of the path that they lie in.

    There is one on each side of zero that the function comes to, as far as the cells go.
    """
    interval = np.flatnonzero(path.smooth)
    nodes = _before_the_end(path)
    begin, end = nodes[interval], nodes[interval + 1]
    finest = _FINEST * (path.t[-1] - path.t[0])
    found, looked = [], 0
    while len(begin) and looked < _MOST_CELLS:
        g = path.ranges(begin, end)[e]
        looked += len(begin)
        found.append((0.5 * (begin + end), g.middle, interval))
        monotone = ((g.slow >= 0.0) | (g.fast <= 0.0)) & (g.breaks == 0)
        open_ones = (g.low <= 0.0) & (g.high >= 0.0) & ~monotone & (end - begin > finest)
        begin, end, interval = begin[open_ones], end[open_ones], interval[open_ones]
        cuts = begin + (end - begin) * np.arange(_PARTS + 1)[:, None] / _PARTS
        begin, end, interval = cuts[:-1].ravel(), cuts[1:].ravel(), np.tile(interval, _PARTS)
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))
