"""Marks in the moving picture: pins, axes, supports, springs and force arrows, from the function `marks`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import schema
from .mark_records import ARROWS, FOLDERS, HINGES, STRETCHED, Mark, read_marks
from .mark_shapes import Surroundings, between, draw, reach_of
from .quantities import Quantities

if TYPE_CHECKING:
    from .rrd.mark_writer import MarkWriter

_LONGEST_ARROW = 0.22  # of the scene's diagonal: that of the largest force in the run
_AXES_SHOWN = 16  # more of them hide the mechanism
_FRAMES_FOR_BOX = 100  # of a chunk are enough to place the camera


class Marks:
    """The marks of one run.

    Parameters
    ----------
    header : dict
        `MODEL` of the generated module.
    of : Quantities
    planar : bool
        All bodies move in the x-y plane.

    Attributes
    ----------
    low, high : ndarray, shape (3,) [m]
        Corners of the box that holds the marks of all frames so far.
    """

    def __init__(self, header: dict, of: Quantities, planar: bool):
        self._marks = read_marks(header.get("marks", ()))
        self._of, self._planar = of, planar
        self._moving = any(mark.moves for mark in self._marks)  # whether later frames have to be evaluated
        self._start = np.zeros(0)
        self._around: Surroundings | None = None
        self._largest: dict[str, float] = {}  # of arrows, by their peers
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)

    def __bool__(self) -> bool:
        return bool(self._marks)

    @property
    def grounded(self) -> bool:
        """Whether anything is drawn of the ground."""
        return any(FOLDERS[mark.kind] == schema.GROUND for mark in self._marks)

    @property
    def folders(self) -> dict[str, bool]:
        """The entity folders that there are, and whether each is shown at first."""
        found = {FOLDERS[mark.kind]: FOLDERS[mark.kind] != schema.REACTIONS for mark in self._marks}
        hinges = sum(mark.kind in HINGES for mark in self._marks)
        if hinges and not self._planar:
            found[schema.JOINT_AXES] = hinges <= _AXES_SHOWN
        return found

    def prepare(self, t: np.ndarray, y: np.ndarray) -> None:
        """Take the first frames; nothing is written yet."""
        self._widen(self._of.evaluate("marks", t, y))
        self._start = self._of.evaluate("marks", t[:1], y[:1])[0]

    def bars(self) -> dict[str, list[np.ndarray]]:
        """Return the bars between joints of bodies that have no shape, by body: ends in body axes, shape (2, 3) [m]."""
        found: dict[str, list[np.ndarray]] = {}
        for mark in self._marks:
            if mark.kind == "bar":
                ends = self._start[mark.columns].reshape(2, 3)
                if (ends[0] != ends[1]).any():
                    found.setdefault(mark.body, []).append(ends)
        return found

    def open(self, writer: MarkWriter, around: Surroundings) -> None:
        """Write what is fixed in a body or in the world, and the symbols of what moves by itself."""
        self._around = around
        for mark in self._marks:
            numbers = self._start[mark.columns]
            self._widen_around(around.in_world(mark.body, numbers[:3]), reach_of(mark, numbers, around))
            if mark.kind in ARROWS:
                writer.arrow_style(mark.path, schema.MARK_COLOURS[mark.kind])
            elif mark.kind != "bar":
                draw(writer, mark, numbers, around)
        self.scale(writer)

    def frames(
        self,
        writer: MarkWriter,
        t: np.ndarray,
        y: np.ndarray,
        positions: np.ndarray,
        rotations: np.ndarray,
        multipliers: np.ndarray,
    ) -> None:
        """Write what moves by itself, and arrows of forces and reactions.

        Parameters
        ----------
        writer : MarkWriter
        t, y : ndarray
        positions, rotations : ndarray, shape (n, bodies, 3) [m], (n, bodies, 3, 3)
            The bodies' poses.
        multipliers : ndarray, shape (n, m)
        """
        rows = self.moved(writer, t, y)
        for mark in self._marks:
            numbers = rows[:, mark.columns]
            if mark.kind == "reaction":
                body = self._around.index[mark.body]
                places = positions[:, body] + rotations[:, body] @ self._start[mark.columns]
                self._arrow(writer, mark, places, _held_by(mark, multipliers))
            elif mark.kind == "tension":
                along = numbers[:, :3] - numbers[:, 3:]
                length = np.linalg.norm(along, axis=1, keepdims=True)
                forces = along / np.where(length > 0.0, length, 1.0) * multipliers[:, mark.constraints]
                self._arrow(writer, mark, numbers[:, :3], forces)
            elif mark.kind == "force":
                self._arrow(writer, mark, numbers[:, :3], numbers[:, 3:])
            elif mark.kind == "torque":
                self._arrow(writer, mark, positions[:, self._around.index[mark.body]], numbers)

    def moved(self, writer: MarkWriter, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Write where springs, links and other symbols are that move by themselves.

        Returns
        -------
        ndarray, shape (n, numbers)
            What the function `marks` writes; no rows where nothing moves.
        """
        if not self._moving:
            return np.zeros((0, len(self._start)))
        rows = self._of.evaluate("marks", t, y)
        self._widen(rows[:: max(1, len(t) // _FRAMES_FOR_BOX)])
        for mark in self._marks:
            if mark.moves and mark.kind not in ARROWS:
                numbers = rows[:, mark.columns]
                ends = numbers[:, :3], numbers[:, 3:]
                writer.moves(mark.path, *(between(*ends) if mark.kind in STRETCHED else ends[:1]))
        return rows

    def scale(self, writer: MarkWriter) -> None:
        """Make arrows of all frames as long as they are to be: in proportion, that of the largest force the longest."""
        for mark in self._marks:
            if mark.kind in ARROWS:
                largest = self._largest.get(mark.peers, 0.0)
                writer.scale(
                    mark.path, _LONGEST_ARROW * self._around.diagonal / largest if largest > 0.0 else 1.0
                )

    def _widen_around(self, place: np.ndarray, reach: float) -> None:
        if reach > 0.0:
            sides = np.array([reach, reach, 0.0 if self._planar else reach])
            self.low, self.high = np.minimum(self.low, place - sides), np.maximum(self.high, place + sides)

    def _widen(self, rows: np.ndarray) -> None:
        """Take the places of marks that belong to no body into the box."""
        for mark in self._marks:
            if not mark.body:
                places = rows[:, mark.columns][:, : 6 if mark.kind in STRETCHED else 3].reshape(-1, 3)
                places = places[np.isfinite(places).all(axis=1)]
                if len(places):
                    self.low = np.minimum(self.low, places.min(axis=0))
                    self.high = np.maximum(self.high, places.max(axis=0))

    def _arrow(self, writer: MarkWriter, mark: Mark, places: np.ndarray, vectors: np.ndarray) -> None:
        sizes = np.linalg.norm(vectors, axis=1)
        largest = float(sizes[np.isfinite(sizes)].max(initial=0.0))
        self._largest[mark.peers] = max(self._largest.get(mark.peers, 0.0), largest)
        if self._planar:
            places = places + np.array([0.0, 0.0, self._around.top])
        writer.arrows(mark.path, places, vectors)


def _held_by(mark: Mark, multipliers: np.ndarray) -> np.ndarray:
    """The force [N] of constraints along the axes on the point that they hold, shape (n, 3)."""
    forces = np.zeros((len(multipliers), 3))
    for axis, (k, sign) in enumerate(zip(mark.constraints, mark.signs)):
        forces[:, axis] = sign * multipliers[:, k]
    return forces
