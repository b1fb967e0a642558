"""What bodies roll on or touch: a patch of the plane or surface, as far as the run takes them, as lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import schema
from .layout import round_down

if TYPE_CHECKING:
    from symgen.runtime.recording.recording import Quantities
    from symgen.runtime.recording.rrd.write import MarkWriter

    from .mark_records import Mark
    from .surroundings import Surroundings

KINDS = ("plane", "surface")

_BESIDE, _AROUND = 1.3, 0.08  # around what rolls: of its size, of the way
_ACROSS, _ALONG = 8, 60  # cells of the shorter side, at least, and of the longer one, at most
_PER_CELL, _PER_CURVE = 4, 240  # parts of a line over a surface
_HATCH = 0.025  # how deep a hatching is, of the scene's diagonal
_GROWS = 0.5  # by how much more than it needs to a patch grows while the run goes on, of its sides


class Floor:
    """The patch of one mark.

    Parameters
    ----------
    mark : Mark
        Of the kind `plane` or `surface`.
    column : int
        Of its height in what the function `heights` writes.
    of : Quantities
    planar : bool
        A line or curve, with hatching below.
    """

    def __init__(self, mark: Mark, column: int, of: Quantities, planar: bool):
        self.mark, self._column, self._of, self._planar = mark, column, of, planar
        self._frame = np.zeros((3, 3))
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)  # of what is drawn
        self._seen = self._low.copy(), self._high.copy()
        self._margin = self._diagonal = 1.0
        self._on: list[int] = []
        self._home: int | None = None

    def open(self, writer: MarkWriter, numbers: np.ndarray, around: Surroundings) -> None:
        """Draw the patch that the bodies stand on at the start."""
        self._frame, self._diagonal = numbers.reshape(3, 3), around.diagonal
        on = [around.primitives[around.index[name]].half_box() for name in self.mark.carries]
        self._margin = max(_BESIDE * max(float(np.linalg.norm(core)) + thick for core, thick in on), 1e-9)
        self._on = [around.index[name] for name in self.mark.carries]
        self._home = around.index[self.mark.body] if self.mark.body else None
        self._take(around.positions[None], around.rotations[None])
        self.close(writer)

    def frames(self, writer: MarkWriter, positions: np.ndarray, rotations: np.ndarray) -> None:
        """Take frames; the patch grows where they leave it."""
        self._take(positions, rotations)
        low, high = self._wanted()
        if (low < self._low).any() or (high > self._high).any():
            room = _GROWS * (high - low)
            low, high = (
                np.where(low < self._low, low - room, self._low),
                np.where(high > self._high, high + room, self._high),
            )
            self._draw(writer, low, high)

    def close(self, writer: MarkWriter) -> None:
        """Draw the patch that all frames so far need."""
        self._draw(writer, *self._wanted())

    def in_world(self, around: Surroundings) -> np.ndarray:
        """Return points that span the patch at the start, shape (n, 3) [m]."""
        places = self._points(np.concatenate(self._paths()))
        return np.array([around.in_world(self.mark.body, place) for place in places])

    def _take(self, positions: np.ndarray, rotations: np.ndarray) -> None:
        places = positions[:, self._on]
        if self._home is not None:
            apart = places - positions[:, self._home][:, None]
            places = np.einsum("nij,nbi->nbj", rotations[:, self._home], apart)
        origin, *axes = self._frame
        here = ((places - origin) @ np.array(axes).T).reshape(-1, 2)
        here = here[np.isfinite(here).all(axis=1)]
        if len(here):
            low, high = self._seen
            self._seen = np.minimum(low, here.min(axis=0)), np.maximum(high, here.max(axis=0))

    def _wanted(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self._seen
        room = np.maximum(self._margin, _AROUND * float((high - low).max()))
        return low - room, high + room

    def _draw(self, writer: MarkWriter, low: np.ndarray, high: np.ndarray) -> None:
        if not np.isfinite([low, high]).all():
            return
        self._low, self._high = low, high
        lines = [self._points(path) for path in self._paths()]
        if self._planar and len(lines[0]) > 1:
            lines += self._hatching(lines[0])
        colour = schema.MARK_COLOURS[self.mark.kind]
        writer.lines(self.mark.path, [line for line in lines if len(line) > 1], colour, body=self.mark.body)

    def _paths(self) -> list[np.ndarray]:
        """The lines over the plane: places x, y, shape (n, 2) each [m]."""
        low, high = self._low, self._high
        curved = self.mark.kind == "surface"
        if self._planar:
            x = np.linspace(low[0], high[0], _PER_CURVE + 1 if curved else 2)
            return [np.stack([x, 0.0 * x], axis=1)]
        sides = high - low
        cell = round_down(max(float(sides.min()) / _ACROSS, float(sides.max()) / _ALONG))
        marks = [np.unique([a, *_multiples(cell, a, b), b]) for a, b in zip(low, high)]
        found = []
        for k, (along, across) in enumerate((marks, marks[::-1])):
            for fixed in across:
                ends = along[[0, -1]]
                parts = int(np.ceil((ends[1] - ends[0]) / cell)) * _PER_CELL if curved else 1
                line = np.stack([np.linspace(*ends, parts + 1), np.full(parts + 1, fixed)], axis=1)
                found.append(line if k == 0 else line[:, ::-1])
        return found

    def _points(self, here: np.ndarray) -> np.ndarray:
        """Places on the surface in the axes of its body, where it has a height there."""
        origin, first, second = self._frame
        if self._planar:
            points = origin + here[:, :1] * first
            up = second
        else:
            points = origin + here @ np.stack([first, second])
            up = np.cross(first, second)
        if self.mark.kind == "surface":
            over = self._of.evaluate("heights", np.zeros(len(here)), here)[:, self._column]
            points = points + over[:, None] * up
        return points[np.isfinite(points).all(axis=1)]

    def _hatching(self, line: np.ndarray) -> list[np.ndarray]:
        """Short lines below a line of the plane."""
        depth = _HATCH * self._diagonal
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        n = int(np.clip(way[-1] / depth, 3, 200))
        at = (np.arange(n) + 0.5) / n * way[-1]
        feet = np.stack([np.interp(at, way, line[:, k]) for k in range(3)], axis=1)
        below = -self._frame[2] - 0.6 * self._frame[1]
        return [np.stack([foot, foot + depth * below]) for foot in feet]


def _multiples(cell: float, low: float, high: float) -> np.ndarray:
    """The multiples of a length strictly between two places, not too near to either."""
    return cell * np.arange(np.ceil(low / cell + 0.3), np.floor(high / cell - 0.3) + 1.0)
