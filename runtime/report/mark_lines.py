"""What a picture shows besides bodies as lines in the world: springs, supports, axes and pins of one state."""

from __future__ import annotations

import numpy as np

from symgen.runtime.recording import schema
from symgen.runtime.recording.mark_shapes import Surroundings
from symgen.runtime.recording.marks import Marks

_HIDDEN = (schema.JOINT_AXES, schema.REACTIONS, schema.FORCES)
_ROUND = 16  # corners of a circle


class LineCollector:
    """Takes what `Marks` draws, in place of the writer of a recording.

    Parameters
    ----------
    around : Surroundings
        Poses of the bodies.
    """

    def __init__(self, around: Surroundings):
        self._around = around
        self._lines: dict[str, list[np.ndarray]] = {}

    def collected(self) -> list[np.ndarray]:
        """Return the lines, shape (k, 3) each [m]."""
        return [line for path, lines in self._lines.items() if not path.startswith(_HIDDEN) for line in lines]

    def lines(self, path, lines, colour, width=1.4, body="") -> None:
        """Take lines that are fixed to a body, or to the world."""
        placed = [np.array([self._around.in_world(body, point) for point in line]) for line in lines]
        self._lines.setdefault(path, []).extend(placed)

    def rod(self, path, a, b, radius, colour, body="") -> None:
        """Take a rod as its axis, and a pin that points at the reader as a circle."""
        self.lines(path, [np.stack([a, b]), *_circle(b, b - a, radius)], colour, body=body)

    def ball(self, path, place, radius, colour, body="") -> None:
        """Take a ball as a circle in the plane."""
        self.lines(path, _circle(place, np.array([0.0, 0.0, 1.0]), radius), colour, body=body)

    def place(self, path, position, quaternion, scale) -> None:
        """Put what stands still in its place."""
        turned = _matrix(quaternion)
        self._lines[path] = [position + (line * scale) @ turned.T for line in self._lines.get(path, [])]

    def moves(self, path, positions, turned=None, scales=None) -> None:
        """Put what moves to where it is first."""
        quaternion = np.array([0.0, 0.0, 0.0, 1.0]) if turned is None else turned[0]
        self.place(path, positions[0], quaternion, np.ones(3) if scales is None else scales[0])

    def arrow_style(self, path, colour) -> None:
        """Leave out arrows."""

    def arrows(self, path, places, vectors) -> None:
        """Leave out arrows."""

    def scale(self, path, factor) -> None:
        """Leave out arrows."""


def mark_lines(marks: Marks, around: Surroundings, t: np.ndarray, y: np.ndarray) -> list[np.ndarray]:
    """Return the lines of marks in one state.

    Parameters
    ----------
    marks : Marks
        Prepared for this state.
    around : Surroundings
    t, y : ndarray, shape (1,) [s], (1, nq + nv)
    """
    collector = LineCollector(around)
    marks.open(collector, around)
    marks.moved(collector, t, y)
    return collector.collected()


def _circle(centre: np.ndarray, axis: np.ndarray, radius: float) -> list[np.ndarray]:
    """A circle about an axis along z; none about others, of which the side is seen."""
    if abs(axis[2]) < 0.99 * np.linalg.norm(axis):
        return []
    angle = np.linspace(0.0, 2.0 * np.pi, _ROUND + 1)
    return [centre + radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)]


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    """The rotation matrix of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
