"""What steps of members land on, and the pieces of their inputs over time: rows that lanes go through, see `breaks`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.ensemble.lanes import DRIVEN, N_INTERVAL
from symgen.runtime.inputs.code import KNOT
from symgen.runtime.inputs.given import SAME_TIME
from symgen.runtime.record import record
from symgen.runtime.timing.timetable import step_limits_of, timetable

if TYPE_CHECKING:
    from symgen.runtime.ensemble.noises import Noise
    from symgen.runtime.inputs.code import Places
    from symgen.runtime.inputs.given import Pieces
    from symgen.runtime.integrate.method import Method
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System
    from symgen.runtime.timing.timetable import Timetable

_MOST_NUMBERS, _LEAST_MEMBERS, _MOST_MEMBERS = 1 << 22, 16, 1024  # of a call
_NONE = np.zeros(0)


@record(eq=False)
class Intervals:
    """Rows of some members.

    Attributes
    ----------
    rows : ndarray, shape (n, width)
        Where an interval ends and where the next one begins [s], 1 where steps begin anew there, the longest step [s];
        for each input over time its knot and coefficients.
    first : ndarray of int64, shape (members,)
        The row in which each member begins; its last row ends nowhere.
    """

    rows: np.ndarray
    first: np.ndarray


def one_interval(n: int, longest: float) -> Intervals:
    """Members that nothing stops."""
    return Intervals(np.array([[np.inf, np.inf, 0.0, longest]]), np.zeros(n, dtype=np.int64))


@record(eq=False)
class Breaks:
    """Where steps of an ensemble's members end.

    Attributes
    ----------
    system : System
        With constant inputs.
    method : Method
    options : RunOptions
    longest : float [s]
        That steps of the method may be.
    seed : int
    places : Places or None
        Of inputs over time.
    inputs : tuple of Pieces
        In the order of `places`, of the first member.
    noises : mapping of int to (str, Noise)
        Which of them are another one for each member, and the name of the input.
    """

    system: System
    method: Method
    options: RunOptions
    longest: float
    seed: int
    places: Places | None = None
    inputs: tuple[Pieces, ...] = ()
    noises: Mapping[int, tuple[str, Noise]] = field(default_factory=dict)

    @property
    def driven(self) -> np.ndarray:
        """What lanes need to know of inputs over time, see `lanes.DRIVEN`."""
        found, first = [], N_INTERVAL
        for place in self.places.pieces if self.places else ():
            found.append([self.places.first_input + place.number, place.block + KNOT, place.width, first])
            first += 1 + place.width
        return np.array(found, dtype=np.int64).reshape(len(found), DRIVEN)

    @property
    def n_long(self) -> int:
        """Numbers of a member's `p` with the pieces of inputs behind it."""
        return self.places.end if self.places else self.system.n_precomputed

    @property
    def most_at_once(self) -> int:
        """How many members there may be in a call, so that their rows do not take much memory."""
        span = self.options.t_end - self.options.t_start
        rows = 1 + sum(span / noise.period for _, noise in self.noises.values())
        return int(min(_MOST_MEMBERS, max(_LEAST_MEMBERS, _MOST_NUMBERS / (rows * (1 + self._width)))))

    @property
    def _width(self) -> int:
        return N_INTERVAL + sum(1 + place.width for place in (self.places.pieces if self.places else ()))

    def pieces_of(self, number: int) -> list[Pieces]:
        """Return a member's inputs over time, in the order of `places`."""
        pieces, o = list(self.inputs), self.options
        for k, (name, noise) in self.noises.items():
            pieces[k] = noise.table(name, self.seed, number, o.t_start, o.t_end).pieces()
        return pieces

    def values_at(self, t: float, numbers: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return members' parameters with the inputs at a time [s] among them."""
        found = parameters.copy()
        for row, number in zip(found, numbers, strict=True):
            for place, pieces in zip(self.places.pieces, self.pieces_of(int(number)), strict=True):
                k = pieces.piece_at(t)
                row[self.places.first_input + place.number] = np.polyval(
                    pieces.coefficients[k][::-1], t - pieces.knots[k]
                )
        return found

    def of(self, numbers: np.ndarray, parameters: np.ndarray) -> Intervals:
        """Return the intervals of members."""
        rows, known, n = [np.zeros((0, self._width))], {}, 0
        first = np.zeros(len(numbers), dtype=np.int64)
        for k, number in enumerate(numbers):
            limits = step_limits_of(self.system, parameters[k], self.options.t_start, self.options.t_end)
            pieces = self.pieces_of(int(number))
            key = (id(limits), *map(id, pieces))
            if key not in known:
                own = self._rows(timetable(limits, self.method, self.options), pieces)
                known[key] = n, limits, pieces  # which live as long as their identities are in use
                rows.append(own)
                n += len(own)
            first[k] = known[key][0]
        return Intervals(np.concatenate(rows), first)

    def _rows(self, table: Timetable | None, pieces: list[Pieces]) -> np.ndarray:
        t_start = self.options.t_start
        breaks = (
            pieces[0].breaks
            if len(pieces) == 1
            else np.unique(np.concatenate([_NONE, *(x.breaks for x in pieces)]))
        )
        stops = np.column_stack([breaks, breaks, np.zeros(len(breaks))])
        if table is not None:
            stops = np.concatenate([np.column_stack(table.stops), stops])
            stops = stops[np.argsort(stops[:, 0], kind="stable")]
        stops = _joined(stops[(stops[:, 1] > t_start) & (stops[:, 0] < self.options.t_end)], t_start)
        rows = np.concatenate([stops[stops[:, 0] > t_start], [[math.inf, math.inf, 0.0]]])
        begins = np.append(t_start, rows[:-1, 1])
        longest = np.full(len(rows), self.longest)
        if table is not None:
            longest = np.minimum(longest, [table.longest(t) for t in begins])
        # The piece that holds in an interval is the one that does in its middle, or a little behind its begin.
        middle = np.where(
            np.isfinite(rows[:, 0]), 0.5 * (begins + rows[:, 0]), begins + _tick(begins, t_start)
        )
        columns = [rows, longest[:, None]]
        for x in pieces:
            held = np.maximum(np.searchsorted(x.knots, middle, side="right") - 1, 0)
            columns += [x.knots[held][:, None], x.coefficients[held]]
        return np.concatenate(columns, axis=1)


def _tick(t: np.ndarray, t_start: float) -> np.ndarray:
    return SAME_TIME * np.maximum(abs(t_start), np.abs(t))


def _joined(stops: np.ndarray, t_start: float) -> np.ndarray:
    """Make one of stops, in their order, that are too near to each other for a step."""
    near = stops[1:, 0] <= stops[:-1, 1] + _tick(stops[1:, 0], t_start)
    if not near.any():
        return stops
    kept = [stops[0]]
    for stop in stops[1:]:
        last = kept[-1]
        if stop[0] <= last[1] + _tick(stop[0], t_start):
            kept[-1] = np.array([last[0], max(last[1], stop[1]), max(last[2], stop[2])])
        else:
            kept.append(stop)
    return np.array(kept)
