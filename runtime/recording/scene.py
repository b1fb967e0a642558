"""The moving picture of a run: shapes, poses and trails of bodies, and where to look at them from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.lazy import Late

from . import geometry, layout, schema
from .marks import Marks, Surroundings
from .quantities import Quantities

if TYPE_CHECKING:
    from .rrd.mark_writer import MarkWriter
    from .rrd.write import RrdWriter

mark_writer = Late("symgen.runtime.recording.rrd.mark_writer")

_TRAIL_PART = 0.15  # of the run's time is what a trail shows, but
_FRAMES_FOR_BOX = 100  # of a chunk are enough to place the camera
_CROSS = 0.03  # arms of the mark at the origin, of the scene's diagonal
_LAYER, _MOST_LAYERS = (
    0.002,
    20,
)  # by how much a planar body is drawn above the one before, of the scene's diagonal
_TRAIL_LONGEST = 1.5  # seconds of playback at most


class Scene:
    """The bodies of one run.

    Parameters
    ----------
    header : dict
        `MODEL` of the generated module.
    of : Quantities
    mesh_folder : Path or None
    """

    def __init__(self, header: dict, of: Quantities, mesh_folder: Path | None):
        self._bodies = header["bodies"]
        self._of = of
        self._mesh_folder = mesh_folder
        self._rows = layout.plot_rows(header)
        self.planar = all(body["planar"] for body in self._bodies)
        self._trails = layout.choose_trails(self._bodies)
        self._colours = layout.choose_colours(self._bodies)
        self._marks = Marks(header if self._bodies else {}, of, self.planar)
        self._primitives: list[geometry.Primitive] = []
        self._diagonal = 1.0
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._t_first = self._t_last = 0.0
        self._last_position: np.ndarray | None = None
        self._mark_writer: MarkWriter | None = None
        self._stretching = [i for i, body in enumerate(self._bodies) if body.get("stretches")]
        self._sizes, self._lifts = np.zeros(0), [0.0] * len(self._bodies)

    def prepare(self, t: np.ndarray, y: np.ndarray) -> None:
        """Choose shapes by the first frames; nothing is written yet."""
        self._t_first = float(t[0])
        if not self._bodies:
            return
        positions, rotations = geometry.split_poses(self._of.evaluate("poses", t, y), len(self._bodies))
        self._sizes = sizes = self._of.shape_sizes(t[0], y[0])
        low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
        if self._marks:
            self._marks.prepare(t, y)
            low, high = np.minimum(low, self._marks.low), np.maximum(high, self._marks.high)
        diagonal = geometry.diagonal_of(*geometry.scene_box(low, high))
        self._diagonal = diagonal
        self._primitives = geometry.primitives(
            self._bodies, sizes, rotations, diagonal, self._mesh_folder, self._marks.bars()
        )
        # Bodies of planar models lie on each other, and would flicker where they overlap.
        n_layers = _MOST_LAYERS if self.planar else 0
        lifts = [i * _LAYER * diagonal if i < n_layers else 0.0 for i in range(len(self._bodies))]
        names = [body["name"] for body in self._bodies]
        drawn = (names, self._primitives, positions, rotations, diagonal, self.planar)
        self._lifts, self._around = lifts, Surroundings.of_bodies(*drawn, self._colours, lifts)
        self._last_position = positions[0]

    def open(self, writer: RrdWriter) -> None:
        """Write what does not move."""
        index = {body["name"]: i for i, body in enumerate(self._bodies)}
        for name, i in index.items():
            lift = 0.0 if i in self._stretching else self._lifts[i]
            writer.body(name, self._primitives[i], self._colours[i], lift)
        for name, _ in self._trails:
            writer.trail_style(name, self._colours[index[name]])
        if self._marks or self._stretching:
            self._mark_writer = self._opened(writer)
        if self._bodies and not self._marks.grounded:
            writer.origin(_CROSS * self._diagonal)

    def _opened(self, writer: RrdWriter) -> MarkWriter:
        marks = mark_writer.MarkWriter(writer)
        if self._marks:
            self._marks.open(marks, self._around)
        return marks

    def frames(self, writer: RrdWriter, t: np.ndarray, y: np.ndarray, multipliers: np.ndarray) -> None:
        """Write poses, pieces of trails, and what moves besides."""
        self._t_last = float(t[-1])
        if not self._bodies:
            return
        positions, rotations = geometry.split_poses(self._of.evaluate("poses", t, y), len(self._bodies))
        some = slice(None, None, max(1, len(t) // _FRAMES_FOR_BOX))
        low, high = geometry.drawn_box(self._primitives, positions[some], rotations[some])
        self._low, self._high = np.minimum(self._low, low), np.maximum(self._high, high)
        path = np.concatenate([self._last_position[None], positions]).astype(np.float32)
        self._last_position = positions[-1]
        turned = geometry.quaternions(rotations).astype(np.float32)
        trailing = {name for name, _ in self._trails}
        for i, body in enumerate(self._bodies):
            writer.poses(body["name"], path[1:, i], turned[:, i])
            if body["name"] in trailing:
                writer.trail(body["name"], np.stack([path[:-1, i], path[1:, i]], axis=1))
        if self._stretching:
            self._stretch(t, y)
        if self._marks:
            self._marks.frames(self._mark_writer, t, y, positions, rotations, multipliers)

    def _stretch(self, t: np.ndarray, y: np.ndarray) -> None:
        """Write how bodies change their sizes."""
        sizes = self._of.evaluate("shapes", t, y)
        ends = np.cumsum([0, *(body["sizes"] for body in self._bodies)])
        for i in self._stretching:
            own = slice(ends[i], ends[i + 1])
            grown = sizes[:, own] / np.where(self._sizes[own] != 0.0, self._sizes[own], 1.0)
            path = f"{schema.BODIES}/{self._bodies[i]['name']}/geometry"
            lift = np.broadcast_to([0.0, 0.0, self._lifts[i]], (len(t), 3))
            self._mark_writer.moves(path, lift, scales=self._primitives[i].scales(grown))

    def close(self) -> None:
        """Write what only the whole run tells: how long arrows are."""
        if self._marks:
            self._marks.scale(self._mark_writer)

    def layout(self, low_of: dict[str, np.ndarray], high_of: dict[str, np.ndarray]) -> layout.Layout:
        """Return the screen for all frames so far.

        Parameters
        ----------
        low_of, high_of : dict of ndarray
            Smallest and largest values of what is plotted, see `layout.readable`.
        """
        low, high = (self._low, self._high) if self._bodies else (np.zeros(3), np.zeros(3))
        low, high = np.minimum(low, self._marks.low), np.maximum(high, self._marks.high)
        seconds = self._t_last - self._t_first
        speed = layout.choose_speed(seconds)
        return layout.Layout(
            planar=self.planar,
            camera=layout.choose_camera(low, high, self.planar) if self._bodies else None,
            grid=layout.round_down(geometry.diagonal_of(low, high) / 8),
            trails=self._trails,
            folders=tuple(self._marks.folders.items()),
            trail_seconds=min(_TRAIL_PART * seconds, _TRAIL_LONGEST * speed),
            rows=layout.readable(self._rows, low_of, high_of),
            speed=speed,
        )
