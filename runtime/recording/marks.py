"""Marks in the moving picture: pins, axes, supports, springs and force arrows, from the function `marks`.

How marks are drawn: pins, hinges, gears, supports and springs, sized by the scene and by the rods they sit in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.recording.recording import Quantities

from . import floors, schema, symbols
from .geometry import quaternions
from .layout import eye_axes
from .mark_records import ARROWS, FOLDERS, HINGES, STRETCHED, Mark, read_marks
from .surroundings import Surroundings

if TYPE_CHECKING:
    from symgen.runtime.recording.rrd.write import MarkWriter


# Sizes are of the scene's diagonal, where they are not of the rod that a joint sits in.
_PIN, _PIN_IN_ROD = 0.011, 0.55  # radius of a pin
_ACROSS = (0.62, 1.25)  # radius and half the length of a hinge in space whose axis is across the rod
_ALONG = (1.1, 0.3)  # the same for an axis along it
_BALL = 1.15
_AXIS, _AXIS_OF_ROD = 0.09, 2.5  # half the length of a joint's axis
_POINT = 0.006
_LINK = 0.006
GROUND_SIZE, _RAIL = 0.08, 0.025  # a support; how deep a rail's hatching is
_WIDER = 1.5  # a support in space than the body that stands on it
_POST = 4.0  # a support reaches down to the ground from so many times its size
_SPRING, _SLENDER = 0.03, 0.16  # radius of a spring, but at most so much of its length
_GEAR, _MODULE = 0.008, 0.008  # half the width of a gear, half the depth of its teeth
_CEILING = -0.02  # a mechanism whose middle is this much below a support hangs from it


def reach_of(mark: Mark, numbers: np.ndarray, around: Surroundings) -> float:
    """Return how far the symbol of a mark reaches from its place [m]; 0 for those that reach no farther than bodies."""
    if mark.kind == "gear":
        return float(numbers[6]) if _fits(numbers[6], around) else 0.0
    return GROUND_SIZE * around.diagonal if mark.kind == "ground" and not mark.moves else 0.0


def draw(writer: MarkWriter, mark: Mark, numbers: np.ndarray, around: Surroundings) -> None:
    """Draw a mark that is no arrow, fixed to its body; what moves by itself is drawn about the origin.

    Parameters
    ----------
    writer : MarkWriter
    mark : Mark
    numbers : ndarray
        What the function `marks` writes of it at the start.
    around : Surroundings
    """
    place = np.zeros(3) if mark.moves else numbers[:3]
    colour = schema.MARK_COLOURS[mark.kind]
    match mark.kind:
        case "spring" | "damper" | "link" | "rail":
            _stretched(writer, mark, numbers, around)
        case "ground":
            _ground(writer, mark, place, around)
        case "gear":
            _gear(writer, mark, numbers, around)
        case "point":
            writer.ball(mark.path, place, _POINT * around.diagonal, colour, mark.body)
        case "ball":
            rod = around.rod(mark.body)
            radius = max(_BALL * rod.sizes[0] if rod else 0.0, _PIN * around.diagonal)
            writer.ball(mark.path, place, radius, colour, mark.body)
        case "pin" | "slide":
            _hinge(writer, mark, place, numbers[3:], around)


def hangs_from(place: np.ndarray, middle: np.ndarray, planar: bool, diagonal: float) -> bool:
    """Return whether a mechanism with this middle hangs from a place, shape (3,) each [m], and does not stand on it."""
    up = 1 if planar else 2
    return bool(middle[up] - place[up] < _CEILING * diagonal)


def _ground(writer: MarkWriter, mark: Mark, place: np.ndarray, around: Surroundings) -> None:
    """Draw a support; one in space that stands a little above z = 0 reaches down to there."""
    hangs = hangs_from(place, around.middle, around.planar, around.diagonal)
    size, depth = GROUND_SIZE * around.diagonal, None
    if not around.planar:
        size = max(size, _WIDER * around.width_at(place) / symbols.SUPPORT_HALF)
        if not hangs and 0.0 < place[2] < _POST * size:
            depth = float(place[2])
    writer.lines(
        mark.path, symbols.support(place, size, around.planar, hangs, depth), schema.MARK_COLOURS["ground"]
    )


def _stretched(writer: MarkWriter, mark: Mark, numbers: np.ndarray, around: Surroundings) -> None:
    """Draw what lies between two places: from 0 to 1 along z, to be stretched."""
    colour, a, b = schema.MARK_COLOURS[mark.kind], numbers[None, :3], numbers[None, 3:]
    length = float(np.linalg.norm(b - a)) or around.diagonal
    radius = min(_SPRING * around.diagonal, _SLENDER * length)
    if mark.kind == "link":
        writer.rod(mark.path, np.zeros(3), np.array([0.0, 0.0, 1.0]), _LINK * around.diagonal, colour)
    elif mark.kind == "rail":
        depth = _RAIL * around.diagonal
        writer.lines(mark.path, symbols.rail(depth, depth / length), colour)
    else:
        make = symbols.coil if mark.kind == "spring" else symbols.dashpot
        writer.lines(mark.path, make(radius), colour, width=2.2)
    if not mark.moves:
        writer.place(mark.path, *(part[0] for part in between(a, b)))


def _hinge(writer: MarkWriter, mark: Mark, place: np.ndarray, axis: np.ndarray, around: Surroundings) -> None:
    """Draw a pin along its axis, and in space the axis; of a guide only the axis."""
    rod, pin = around.rod(mark.body), _PIN * around.diagonal
    thick, colour = rod.sizes[0] if rod else 0.0, schema.MARK_COLOURS[mark.kind]
    length = np.linalg.norm(axis)
    if not length > 0.0:
        writer.ball(mark.path, place, pin, colour, mark.body)
        return
    along = axis / length
    if not around.planar:
        reach = max(_AXIS * around.diagonal, _AXIS_OF_ROD * thick) * along
        lines = symbols.centre_line(place - reach, place + reach)
        writer.lines(f"{schema.JOINT_AXES}/{mark.name}", lines, schema.AXIS_COLOUR, body=mark.body)
    if mark.kind == "slide":
        return
    if around.planar:
        half = around.thickness_at(around.in_world(mark.body, place)) + 0.3 * pin
        radius = _PIN_IN_ROD * thick or pin
    else:
        lies_along = rod is not None and abs(along[0 if rod.along_x else 2]) > 0.7
        wide, long = _ALONG if lies_along else _ACROSS
        radius, half = wide * thick or pin, long * thick or 2.0 * pin
    writer.rod(mark.path, place - half * along, place + half * along, radius, colour, mark.body)


def _gear(writer: MarkWriter, mark: Mark, numbers: np.ndarray, around: Surroundings) -> None:
    """Draw a gear, as a disc with an outline on either side."""
    place, axis, radius = numbers[:3], numbers[3:6], float(numbers[6])
    if not _fits(radius, around):
        return
    module, half = _MODULE * around.diagonal, _GEAR * around.diagonal * axis
    lines = [line @ symbols.frames_along(axis[None])[0].T for line in symbols.gear(radius, module)]
    sides = [place + sign * 1.02 * half + line for sign in (-1.0, 1.0) for line in lines]
    writer.lines(mark.path, sides, schema.MARK_COLOURS["gear"], body=mark.body)
    colour = around.colours[around.index[mark.body]]
    writer.rod(f"{mark.path}/disc", place - half, place + half, radius - module, colour, mark.body)


def _fits(radius: float, around: Surroundings) -> bool:
    """Whether a gear is of the scene's size: ratios near 1 have hardly any."""
    return _MODULE * around.diagonal < radius < around.diagonal


def between(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how a symbol comes to lie between places, shape (n, 3) each: positions, quaternions, scales."""
    along = b - a
    length = np.linalg.norm(along, axis=1)
    scales = np.stack([np.ones(len(a)), np.ones(len(a)), length], axis=1)
    return a, quaternions(symbols.frames_along(along)), scales


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
        Corners of the box, along the axes of the eye, that holds the marks of all frames so far.
    """

    def __init__(self, header: dict, of: Quantities, planar: bool):
        self._marks = read_marks(header.get("marks", ()))
        self._of, self._planar, self._axes = of, planar, eye_axes(planar)
        self._moving = any(mark.moves for mark in self._marks)  # whether later frames have to be evaluated
        self._start = np.zeros(0)
        surfaces = [mark for mark in self._marks if mark.kind == "surface"]
        self._floors = [
            floors.Floor(mark, surfaces.index(mark) if mark in surfaces else 0, of, planar)
            for mark in self._marks
            if mark.kind in floors.KINDS
        ]
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
    def held(self) -> bool:
        """Whether the mechanism has a support."""
        return any(mark.kind == "ground" for mark in self._marks)

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
            if reach := reach_of(mark, numbers, around):
                self.widen(around.in_world(mark.body, numbers[:3]), reach)
            if mark.kind in ARROWS:
                writer.arrow_style(mark.path, schema.MARK_COLOURS[mark.kind])
            elif mark.kind != "bar" and mark.kind not in floors.KINDS:
                draw(writer, mark, numbers, around)
        for floor in self._floors:
            floor.open(writer, self._start[floor.mark.columns], around)
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
        for floor in self._floors:
            floor.frames(writer, positions, rotations)
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

    def close(self, writer: MarkWriter) -> None:
        """Write what only the whole run tells: how long arrows are, and how far floors reach."""
        self.scale(writer)
        for floor in self._floors:
            floor.close(writer)
            places = floor.in_world(self._around) @ self._axes.T
            if len(places) and floor.mark.kind == "surface":  # planes may go on beyond the picture
                self.low = np.minimum(self.low, places.min(axis=0))
                self.high = np.maximum(self.high, places.max(axis=0))

    def scale(self, writer: MarkWriter) -> None:
        """Make arrows of all frames as long as they are to be: in proportion, that of the largest force the longest."""
        for mark in self._marks:
            if mark.kind in ARROWS:
                largest = self._largest.get(mark.peers, 0.0)
                writer.scale(
                    mark.path, _LONGEST_ARROW * self._around.diagonal / largest if largest > 0.0 else 1.0
                )

    def widen(self, place: np.ndarray, reach: float) -> None:
        """Take a place, shape (3,) [m], and what is within reach of it [m] into the box."""
        place, sides = self._axes @ place, np.array([reach, reach, 0.0 if self._planar else reach])
        self.low, self.high = np.minimum(self.low, place - sides), np.maximum(self.high, place + sides)

    def _widen(self, rows: np.ndarray) -> None:
        """Take the places of marks that belong to no body into the box."""
        for mark in self._marks:
            if not mark.body and mark.kind not in floors.KINDS:
                places = rows[:, mark.columns][:, : 6 if mark.kind in STRETCHED else 3].reshape(-1, 3)
                places = places[np.isfinite(places).all(axis=1)] @ self._axes.T
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
