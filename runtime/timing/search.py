"""Where the terms of time alone jump, bend, and change fast: found by cutting time into cells until each shows it.

Cells are eighths of eighths of powers of eight seconds, whatever the end of a run, so that a run that is cut short and
resumed finds what the whole one does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from runtime.timing.course import Course
from runtime.timing.intervals import INFINITE
from runtime.timing.terms import Samples, TimeTerms, all_times, ranges

if TYPE_CHECKING:
    from runtime.system import System

# A step may take so many times as long as a pulse takes to change by about its height, or radians of an oscillation.
_STEPS_OF_PULSE, _RADIANS = 2.0, 2.0 * math.pi
_OF_CELL = 0.125  # a cell is small enough when nothing in it changes in less than this part of it
_FINEST = 2.0**-49  # of the time: a pulse that is no jump and shorter than this is not resolved
_FINEST_BREAK, _OF_ROOT = 2.0**-60, 2.0**-6  # of the first cells
_LEVEL = 3
_PARTS = 2**_LEVEL  # that a cell is cut into
_MOST_CELLS = 100_000
_MOST_STEPS = 10_000_000  # that steps held to pulses and oscillations may add up to
_LIKE = 4.0  # neighbouring cells whose limits differ by less share one
_ULPS = 4.0


def find_course(system: System, p: np.ndarray, t_start: float, t_end: float) -> Course:
    """Return what time alone does to a model between two times [s].

    Parameters
    ----------
    system : System
        It has the function `time_terms`.
    p : ndarray
        Parameters and inputs.
    """
    terms = TimeTerms(system, p)
    with np.errstate(all="ignore"):
        found = _steady(terms, t_start, t_end)
        if found is not None:
            return found
        widths = all_times(terms, t_start)
        begin, end, limit, breaks, uncut = _cells(terms, widths, t_start, t_end)
        finest = max(
            _FINEST_BREAK * (t_end - t_start), _ULPS * float(np.spacing(max(abs(t_start), abs(t_end))))
        )
        before, after = _located(terms, begin[breaks], end[breaks], 2.0 * finest)
        inside = (after > t_start) & (before < t_end)
        return _joined(before[inside], after[inside], begin, limit, t_end - t_start, uncut)


def known_course(system: System, p: np.ndarray, t_start: float, t_end: float) -> Course:
    """Return `find_course`, kept for the next run with the same numbers where time alone acts."""
    read = system.__dict__.get("_read_with_time")
    if read is None:
        read = system.__dict__["_read_with_time"] = list(TimeTerms(system, p).numbers_read())
    key = (p[read].tobytes(), t_start, t_end)
    last = system.__dict__.get("_course")
    if last is None or last[0] != key:
        last = system.__dict__["_course"] = (key, find_course(system, p, t_start, t_end))
    return last[1]


def _steady(terms: TimeTerms, t_start: float, t_end: float) -> Course | None:
    """Return the course of terms that oscillate steadily, as most do; None where there may be more."""
    begin, end, _ = _roots(t_start, t_end)
    found = ranges(terms, begin, end, [])
    if any((x.breaks > 0).any() or (x.scale < _OF_CELL * (end - begin)).any() for x in found):
        return None
    if not found:
        return Course(*[np.zeros(0)] * 4)
    limit = np.minimum.reduce([np.minimum(_STEPS_OF_PULSE * x.scale, _RADIANS * x.period) for x in found])
    return _joined(np.zeros(0), np.zeros(0), begin, limit, t_end - t_start, 0.0)


def _roots(t_start: float, t_end: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return begins and ends of the cells that a run begins with, and their length [s]."""
    size = 2.0 ** (_LEVEL * math.ceil(math.log2(t_end - t_start) / _LEVEL))
    first = np.arange(math.floor(t_start / size), math.ceil(t_end / size)) * size
    return first, first + size, size


def _cells(
    terms: TimeTerms, widths: list[float], t_start: float, t_end: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Return begins and ends of cells, the longest step in each, where something breaks, and how long uncut ones are.

    The last number is the length of the longest cell [s] that may have more than one break; 0 if there is none.
    """
    begin, end, size = _roots(t_start, t_end)
    done: list[tuple[np.ndarray, ...]] = []
    evaluated, uncut = 0, 0.0
    while len(begin):
        found = ranges(terms, begin, end, widths)
        evaluated += len(begin)
        n = len(begin)
        scale = (
            np.minimum.reduce([x.scale for x in found], initial=INFINITE) if found else np.full(n, INFINITE)
        )
        period = np.minimum.reduce([x.period for x in found], initial=INFINITE) if found else scale
        breaks = np.maximum.reduce([x.breaks for x in found]) if found else np.zeros(n, dtype=np.int8)
        width = end - begin
        size_of_t = np.maximum(np.abs(begin), np.abs(end))
        as_fine = width <= np.maximum(_ULPS * np.spacing(size_of_t), _FINEST_BREAK * size)
        finest = _FINEST * np.maximum(size_of_t, _OF_ROOT * size)
        shown = (scale >= _OF_CELL * width) | (width <= finest)
        ready = ((breaks < 2) & shown) | as_fine
        if evaluated > _MOST_CELLS and not ready.all():
            uncut = float(width[~ready & (breaks > 1)].max(initial=0.0))
            ready[:] = True
        limit = np.minimum(_STEPS_OF_PULSE * scale, _RADIANS * period)
        limit = np.where(width <= finest, INFINITE, limit)
        done.append((begin[ready], end[ready], limit[ready], breaks[ready] > 0))
        cuts = begin[~ready] + (end - begin)[~ready] * np.arange(_PARTS + 1)[:, None] / _PARTS
        begin, end = cuts[:-1].ravel(), cuts[1:].ravel()
        kept = (end > t_start) & (begin < t_end) & (begin < end)
        begin, end = begin[kept], end[kept]
    cells = [np.concatenate(parts) for parts in zip(*done, strict=True)]
    order = np.argsort(cells[0], kind="stable")
    return (*(part[order] for part in cells), uncut)


def _located(
    terms: TimeTerms, begin: np.ndarray, end: np.ndarray, finest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the breaks in some cells, each as the two neighbouring times between which something is decided anew.

    A cell in which nothing changes its sign has a break of its own where it is at most `finest` long [s].
    """
    if not len(begin):
        return np.zeros(0), np.zeros(0)
    at_begin, at_end = _choices(terms, begin), _choices(terms, end)
    which, cell = np.nonzero(at_begin != at_end)
    low, high, was = begin[cell], end[cell], at_begin[which, cell]
    open_ = np.arange(len(low))
    while len(open_):
        middle = low[open_] + 0.5 * (high[open_] - low[open_])
        inside = (middle > low[open_]) & (middle < high[open_])
        open_, middle = open_[inside], middle[inside]
        if not len(open_):
            break
        same = _choices(terms, middle)[which[open_], np.arange(len(open_))] == was[open_]
        low[open_[same]], high[open_[~same]] = middle[same], middle[~same]
    # Where a function only touches the place of its kink, the cell is all that is known, and as small as can be.
    touched = np.setdiff1d(np.arange(len(begin)), cell)
    tiny = touched[(end - begin)[touched] <= finest]
    before, after = np.append(low, begin[tiny]), np.append(high, end[tiny])
    order = np.argsort(before, kind="stable")
    before, after = before[order], after[order]
    if not len(before):
        return before, after
    apart = np.append(
        True, before[1:] > np.maximum.accumulate(after)[:-1] + _ULPS * np.spacing(np.abs(after[:-1]))
    )
    first = np.flatnonzero(apart)
    return before[first], np.maximum.reduceat(after, first)


def _choices(terms: TimeTerms, t: np.ndarray) -> np.ndarray:
    """Return what every choice decides at some times, shape (choices, times)."""
    samples = Samples(t)
    terms.values(samples)
    return np.array(samples.choices, dtype=bool).reshape(len(samples.choices), len(t))


def _joined(
    before: np.ndarray, after: np.ndarray, begin: np.ndarray, limit: np.ndarray, span: float, uncut: float
) -> Course:
    """Join neighbouring cells of like limits, and give up what would take more steps than any run."""
    length = np.append(np.diff(begin), span)
    hopeless = limit < span / _MOST_STEPS
    if (length / limit).sum() <= _MOST_STEPS:
        hopeless[:] = False
    missed = float(limit[hopeless].min()) if hopeless.any() else uncut
    limit = np.where(hopeless, INFINITE, limit)
    starts: list[float] = []
    longest: list[float] = []
    most = 0.0
    for t, h, dt in zip(begin.tolist(), limit.tolist(), length.tolist(), strict=True):
        if starts and (longest[-1] == h or max(most, h) <= _LIKE * min(longest[-1], h)):
            longest[-1], most = min(longest[-1], h), max(most, h)
        elif not (starts and h > longest[-1] and dt <= _LIKE * longest[-1]):  # a short time of freedom
            starts.append(t)
            longest.append(h)
            most = h
    return Course(before, after, np.array(starts), np.array(longest), missed)
