"""What is kept of the frames that a run has passed, where nobody wants all of them.

Checks need no more than some thousand, evenly spread, and those at which something is largest: the energy balance is
then off by as much, and constraints by as much, as over all frames.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

_MOST_AT_EXTREMES = 2_000_000  # numbers of frames at which something is largest


class Frames:
    """Some frames of a run; every run makes one, so it is made quickly.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
    y : ndarray, shape (n, ny)
    resets : ndarray, shape (n,) [J]
        What resets before each frame have added to T + V.
    forms : ndarray of int, shape (n,)
        Which settings of stops and frictions held.
    shown : ndarray of bool, shape (n,)
        Whether they were asked for.
    """

    __slots__ = ("forms", "resets", "shown", "t", "y")

    def __init__(
        self, t: np.ndarray, y: np.ndarray, resets: np.ndarray, forms: np.ndarray, shown: np.ndarray
    ):
        self.t, self.y, self.resets, self.forms, self.shown = t, y, resets, forms, shown

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, rows: slice | np.ndarray) -> Frames:
        """Return a copy of some of them, so that none of the others is kept alive."""
        return Frames(
            self.t[rows].copy(), self.y[rows].copy(), self.resets[rows].copy(), self.forms[rows].copy(),
            self.shown[rows].copy(),
        )  # fmt: skip

    @staticmethod
    def joined(some: list[Frames]) -> Frames:
        """Return all of them, in the order given."""
        parts = zip(*((x.t, x.y, x.resets, x.forms, x.shown) for x in some), strict=True)
        return Frames(*map(np.concatenate, parts))


class PassedFrames:
    """Frames as a run passes them: each k-th of those asked for, all others, and those at which something is largest.

    Parameters
    ----------
    system : System
    most : int
        How many of those asked for are kept.
    """

    def __init__(self, system: System, most: int):
        self._most, self._stride, self._n_shown = most, 1, 0
        self._thinned: list[Frames] = []
        self._others: list[Frames] = []
        self._extremes = _Extremes(system)
        self.n = 0  # that the run has passed

    def take(self, frames: Frames, p: np.ndarray) -> None:
        """Take the next frames of a run with parameters `p`."""
        if not len(frames):
            return
        self.n += len(frames)
        self._extremes.take(frames, p)
        shown = np.flatnonzero(frames.shown)
        if len(shown) < len(frames):
            self._others.append(frames[~frames.shown])
        self._thinned.append(frames[shown[-self._n_shown % self._stride :: self._stride]])
        self._n_shown += len(shown)
        while sum(map(len, self._thinned)) > self._most:  # once, but for windows that have grown
            self._thinned = [Frames.joined(self._thinned)[::2]]
            self._stride *= 2

    def kept(self) -> Frames:
        """Return what is kept, in the order of time."""
        frames = Frames.joined([*self._thinned, *self._others, *self._extremes.frames])
        _, rows = np.unique(frames.t, return_index=True)
        return frames[rows]


class _Extremes:
    """The frames at which energies, residuals and lengths of quaternions are furthest from what they should be."""

    def __init__(self, system: System):
        self._system = system
        self._positions = Positions(system) if len(system.quaternions) else None
        self._at_start: float | None = None  # the energy balance [J]
        self._largest = np.zeros(0)
        self._at: list[Frames | None] = []
        self._not_finite: Frames | None = None  # the first one

    def take(self, frames: Frames, p: np.ndarray) -> None:
        """Look at the next frames."""
        if self._not_finite is None:
            bad = np.flatnonzero(~np.isfinite(frames.y).all(axis=1))
            if len(bad):
                self._not_finite = frames[bad[:1]]
        values = self._values(frames, p)
        values[np.isnan(values)] = -np.inf
        rows = values.argmax(axis=0)
        largest = values[rows, np.arange(values.shape[1])]
        if not self._at:
            self._largest, self._at = np.full(len(largest), -np.inf), [None] * len(largest)
        for k in np.flatnonzero(largest > self._largest):
            self._largest[k], self._at[k] = largest[k], frames[rows[k : k + 1]]

    def _values(self, frames: Frames, p: np.ndarray) -> np.ndarray:
        """Return a column for each thing that is looked at: the larger, the more it is to be kept."""
        system, n = self._system, self._system.nq + self._system.nv
        energies = evaluate(system, "energy", p, frames.t, frames.y)
        with np.errstate(invalid="ignore", over="ignore"):
            work = frames.resets + frames.y[:, n:].sum(axis=1)
            balance = energies[:, 0] + energies[:, 1] - work
            if self._at_start is None:
                self._at_start = float(balance[0])
            off = balance - self._at_start
            numbers = np.column_stack([off, energies, work])
            columns = [numbers, -numbers, self._residuals(frames, p)]
            if self._positions is not None:
                columns.append(np.abs(self._positions.lengths(frames.y[:, : system.nq]) - 1.0))
            return np.hstack(columns)

    def _residuals(self, frames: Frames, p: np.ndarray) -> np.ndarray:
        """Return residuals of constraints; of a large model the largest of each level, as each keeps a frame."""
        system = self._system
        found = np.abs(evaluate(system, "constraint_residual", p, frames.t, frames.y))
        if found.shape[1] * system.ny <= _MOST_AT_EXTREMES:
            return found
        levels = (found[:, : system.nh], found[:, system.nh :])
        return np.column_stack([level.max(axis=1) for level in levels if level.shape[1]])

    @property
    def frames(self) -> list[Frames]:
        """The frames, in any order, some more than once."""
        return [one for one in (*self._at, self._not_finite) if one is not None]
