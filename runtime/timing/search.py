"""Where the terms of time alone jump, bend, and change fast: found by cutting time into cells until each shows it.

Time is looked at in blocks, each as long as all before it, and whole even where the run ends inside: so a run that is
cut short finds what a longer one does, and a step that passes its end keeps to the same.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.graph.carry_out import Arithmetic, NoArrays, carry_out
from symgen.runtime.graph.form import P
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.timing.intervals import INFINITE, Intervals, Range
from symgen.runtime.timing.step_limits import StepLimits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.system import System


NAME = "time_terms"
_MOST_ASSIGNMENTS = 1_000_000


class TimeTerms:
    """What a function of a model makes of time, for one `p`.

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters and inputs.
    name : str
        The function: what the equations have of time alone, if it is not given.
    """

    def __init__(self, system: System, p: np.ndarray, name: str = NAME):
        self._code = system.function_text(name)
        self._p = [float(x) for x in p]
        if sum(max(count, 1) for _, count in self._code.form.statements()) > _MOST_ASSIGNMENTS:
            self._code.refuse(1, "terms of time alone are assignments, a million of them at most")

    def values(self, operations: Arithmetic, y: Sequence[Any] = ()) -> list[Any]:
        """Return all that the function writes for some `y`; what are numbers does not change."""
        try:
            found = carry_out(self._code.form, operations, y.__getitem__, self._p.__getitem__)
            return [value for _, value in found]
        except NoArrays:
            self._code.refuse(1, "solves by loops are no operation on time, parameters and inputs")

    def numbers_read(self) -> tuple[int, ...]:
        """Return the places in `p` of the numbers that the function reads."""
        return tuple(sorted(self._code.form.places_read(P)))


class Samples:
    """The operations at many times at once, with what each choice on the way decided.

    Parameters
    ----------
    t : ndarray [s]

    Attributes
    ----------
    choices : list of ndarray
        Whether each comparison was true, or each argument negative whose sign makes a kink; the values of steps.
    """

    def __init__(self, t: np.ndarray):
        self._t = t
        self.choices: list[np.ndarray] = []

    def time(self) -> np.ndarray:
        return self._t

    def neg(self, x: Any) -> Any:
        return -x

    def add(self, x: Any, y: Any) -> Any:
        return x + y

    def sub(self, x: Any, y: Any) -> Any:
        return x - y

    def mul(self, x: Any, y: Any) -> Any:
        return x * y

    def div(self, x: Any, y: Any) -> Any:
        return np.divide(x, y)

    def call(self, name: str, *args: Any) -> Any:
        if all(isinstance(x, float) for x in args):
            return Intervals(self._t, self._t, []).call(name, *args)
        if name in ("fabs", "sqrt", "log", "copysign"):
            self._chose(np.asarray(args[-1]) < 0.0)
        entry = IN_CODE[name]
        function = getattr(np, entry.numpy) if entry.numpy else np.vectorize(entry.value, otypes=[float])
        value = function(*args)
        if entry.stepped:
            self._chose(value)
        return value

    def select(self, is_strict: bool, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
        is_so = np.less(a, b) if is_strict else np.less_equal(a, b)
        self._chose(is_so)
        return np.where(is_so, then, otherwise)

    def _chose(self, what: np.ndarray) -> None:
        self.choices.append(np.broadcast_to(what, self._t.shape))


def all_times(terms: TimeTerms, t_start: float) -> list[float]:
    """Return the width of the range of every result over all times from the start of a run on."""
    everywhere = Intervals(np.array([t_start]), np.array([math.inf]), [], finding=True)
    terms.values(everywhere)
    return everywhere.widths


def ranges(terms: TimeTerms, begin: np.ndarray, end: np.ndarray, widths: list[float]) -> list[Range]:
    """Return the terms that change, over cells from `begin` to `end` [s]."""
    found = terms.values(Intervals(begin, end, widths))
    return [x for x in found if isinstance(x, Range)]


# A step may take so many times as long as a pulse takes to change by about its height, or radians of an oscillation.
_STEPS_OF_PULSE, _RADIANS = 2.0, 2.0 * math.pi
_OF_CELL = 0.125  # a cell is small enough when nothing in it changes in less than this part of it
_FINEST = 2.0**-49  # of the time: a pulse that is no jump and shorter than this is not resolved
_FINEST_BREAK, _OF_BLOCK = 2.0**-60, 2.0**-6  # of the time from the start to the end of a block
_FIRST_BLOCK, _LEAST_BLOCK = 2.0**-30, 2.0**20  # [s], and in units of the last digit of the time
_PARTS = 8  # that a cell is cut into
_MOST_CELLS = 100_000
_MOST_STEPS = 10_000_000  # that steps held to pulses and oscillations may add up to
_LIKE = 4.0  # neighbouring cells whose limits differ by less share one
_ULPS = 4.0
_NESTED = 8  # so deep do choices stand in what other choices compare; what changes more often is round-off


def find_step_limits(system: System, p: np.ndarray, t_start: float, t_end: float) -> StepLimits:
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
        widths = all_times(terms, t_start)
        *cells, uncut = _cells(terms, widths, *_blocks(t_start, t_end))
        order = np.argsort(cells[0], kind="stable")
        begin, end, reach, limit, breaks = (part[order] for part in cells)
        finest = np.maximum(_FINEST_BREAK * reach, _ULPS * np.spacing(np.abs(t_start) + reach))[breaks]
        before, after = _located(terms, begin[breaks], end[breaks], 2.0 * finest)
        inside = after > t_start
        return _joined(before[inside], after[inside], begin, end - begin, reach, limit, uncut)


def known_step_limits(system: System, p: np.ndarray, t_start: float, t_end: float) -> StepLimits:
    """Return `find_step_limits`, kept for the next run with the same numbers where time alone acts."""
    read = system.__dict__.get("_read_with_time")
    if read is None:
        read = system.__dict__["_read_with_time"] = list(TimeTerms(system, p).numbers_read())
    key = (p[read].tobytes(), t_start, t_end)
    last = system.__dict__.get("_step_limits")
    if last is None or last[0] != key:
        last = system.__dict__["_step_limits"] = (key, find_step_limits(system, p, t_start, t_end))
    return last[1]


def _blocks(t_start: float, t_end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return begins and ends of blocks, and the time from the start to the end of each [s]."""
    least = max(_FIRST_BLOCK, _LEAST_BLOCK * 2.0 ** math.ceil(math.log2(np.spacing(abs(t_start)))))
    n_blocks = max(0, math.ceil(math.log2((t_end - t_start) / least))) + 1
    reach = least * 2.0 ** np.arange(n_blocks)
    return t_start + np.append(0.0, reach[:-1]), t_start + reach, reach


def _cells(
    terms: TimeTerms, widths: list[float], begin: np.ndarray, end: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Return what some blocks are made of: begins and ends of cells, how far their blocks reach, and what is in them.

    That is the longest step in each, and where something breaks. The last number is the length of the longest cell [s]
    that may have more than one break; 0 if there is none.
    """
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
        finest = _FINEST * np.maximum(size_of_t, _OF_BLOCK * size)
        shown = (scale >= _OF_CELL * width) | (width <= finest)
        ready = ((breaks < 2) & shown) | as_fine
        if evaluated > _MOST_CELLS and not ready.all():
            uncut = float(width[~ready & (breaks > 1)].max(initial=0.0))
            ready[:] = True
        limit = np.minimum(_STEPS_OF_PULSE * scale, _RADIANS * period)
        limit = np.where(width <= finest, INFINITE, limit)
        done.append((begin[ready], end[ready], size[ready], limit[ready], breaks[ready] > 0))
        cuts = begin[~ready] + (end - begin)[~ready] * np.arange(_PARTS + 1)[:, None] / _PARTS
        begin, end, size = cuts[:-1].ravel(), cuts[1:].ravel(), np.tile(size[~ready], _PARTS)
        kept = begin < end
        begin, end, size = begin[kept], end[kept], size[kept]
    return (*(np.concatenate(parts) for parts in zip(*done, strict=True)), uncut)


def _located(
    terms: TimeTerms, begin: np.ndarray, end: np.ndarray, finest: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the breaks in some cells, each as the two neighbouring times between which something is decided anew.

    A cell in which nothing changes its sign has a break of its own where it is at most `finest` long [s].
    """
    if not len(begin):
        return np.zeros(0), np.zeros(0)
    pieces, cell = (begin, end), np.arange(len(begin))
    lows, highs, changing = [], [], []
    for _ in range(_NESTED):
        low, high, which = _first_changes(terms, *pieces)
        cell = cell[which]
        lows.append(low)
        highs.append(high)
        changing.append(cell)
        # What is compared may have jumped there: before and behind it the choice may change again.
        pieces = np.append(pieces[0][which], high), np.append(low, pieces[1][which])
        cell = np.append(cell, cell)
        if not len(cell):
            break
    low, high, cell = (np.concatenate(parts) for parts in (lows, highs, changing))
    # Where a function only touches the place of its kink, the cell is all that is known, and as small as can be.
    touched = np.setdiff1d(np.arange(len(begin)), cell)
    tiny = touched[(end - begin)[touched] <= finest[touched]]
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


def _first_changes(
    terms: TimeTerms, begin: np.ndarray, end: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the first change of what is decided in some cells, as two neighbouring times, and in which cells one is.

    Of each choice one change is looked for.
    """
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
    order = np.lexsort((low, cell))
    cells, first = np.unique(cell[order], return_index=True)
    return low[order][first], high[order][first], cells


def _choices(terms: TimeTerms, t: np.ndarray) -> np.ndarray:
    """Return what every choice decides at some times, shape (choices, times)."""
    samples = Samples(t)
    terms.values(samples)
    return np.array(samples.choices, dtype=float).reshape(len(samples.choices), len(t))


def _joined(
    before: np.ndarray,
    after: np.ndarray,
    begin: np.ndarray,
    length: np.ndarray,
    reach: np.ndarray,
    limit: np.ndarray,
    uncut: float,
) -> StepLimits:
    """Join neighbouring cells of like limits, and give up what would take more steps than any run.

    What a block shows must not change what holds before it.
    """
    hopeless = limit < reach / _MOST_STEPS
    for block in np.unique(reach[hopeless]):
        mine = reach == block
        if (length[mine] / limit[mine]).sum() <= _MOST_STEPS:
            hopeless[mine] = False
    missed = float(limit[hopeless].min()) if hopeless.any() else uncut
    limit = np.where(hopeless, INFINITE, limit)
    starts: list[float] = []
    longest: list[float] = []
    most, block = 0.0, 0.0
    for t, h, dt, own in zip(begin.tolist(), limit.tolist(), length.tolist(), reach.tolist(), strict=True):
        is_like = starts and (longest[-1] == h or max(most, h) <= _LIKE * min(longest[-1], h))
        if is_like and (own == block or h >= longest[-1]):
            longest[-1], most = min(longest[-1], h), max(most, h)
        elif not (starts and h > longest[-1] and dt <= _LIKE * longest[-1]):  # a short time of freedom
            starts.append(t)
            longest.append(h)
            most, block = h, own
    return StepLimits(before, after, np.array(starts), np.array(longest), missed)
