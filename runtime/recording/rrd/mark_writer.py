"""Draws marks into a recording: lines and solids fixed to bodies, symbols that move, arrows."""

from __future__ import annotations

import numpy as np
import rerun as rr

from .. import schema
from ..geometry import quaternions
from ..symbols import frames_along
from .write import RrdWriter, rows, strict

_ARROW_WIDTH = 2.5  # points on the screen
Colour = tuple[int, int, int]


class MarkWriter:
    """Draws into a file that is being written.

    Parameters
    ----------
    file : RrdWriter
    """

    def __init__(self, file: RrdWriter):
        self._file = file

    def _fixed(self, path: str, body: str, *archetypes) -> None:
        """Draw something that is fixed to a body, whatever folder it lies in; to the world without one."""
        frame = [rr.CoordinateFrame(f"tf#/{schema.BODIES}/{body}")] if body else []
        with strict():
            self._file.static(path, *archetypes, *frame)

    def lines(
        self, path: str, lines: list[np.ndarray], colour: Colour, width: float = 1.4, body: str = ""
    ) -> None:
        """Draw lines, `width` points wide on the screen."""
        self._fixed(path, body, rr.LineStrips3D(lines, colors=colour, radii=rr.Radius.ui_points(width / 2)))

    def rod(
        self, path: str, a: np.ndarray, b: np.ndarray, radius: float, colour: Colour, body: str = ""
    ) -> None:
        """Draw a cylinder between two places [m]."""
        cylinder = rr.Cylinders3D(
            radii=[radius],
            lengths=[float(np.linalg.norm(b - a))],
            centers=[(a + b) / 2],
            quaternions=quaternions(frames_along((b - a)[None])),
            colors=[colour],
            fill_mode=rr.components.FillMode.Solid,
        )
        self._fixed(path, body, cylinder)

    def ball(self, path: str, place: np.ndarray, radius: float, colour: Colour, body: str = "") -> None:
        """Draw a sphere [m]."""
        solid = rr.components.FillMode.Solid
        self._fixed(
            path, body, rr.Ellipsoids3D(centers=[place], radii=[radius], colors=[colour], fill_mode=solid)
        )

    def place(self, path: str, position: np.ndarray, quaternion: np.ndarray, scale: np.ndarray) -> None:
        """Put what stands still in its place."""
        with strict():
            turn = rr.Quaternion(xyzw=quaternion)
            self._file.static(path, rr.Transform3D(translation=position, quaternion=turn, scale=scale))

    def moves(
        self,
        path: str,
        positions: np.ndarray,
        turned: np.ndarray | None = None,
        scales: np.ndarray | None = None,
    ) -> None:
        """Write how something moves: positions (n, 3) [m], quaternions (n, 4) as x, y, z, w, scales (n, 3)."""
        kinds = rr.Transform3D
        parts = [(kinds.descriptor_translation(), rr.components.Translation3DBatch, positions)]
        if turned is not None:
            parts.append((kinds.descriptor_quaternion(), rr.components.RotationQuatBatch, turned))
        if scales is not None:
            parts.append((kinds.descriptor_scale(), rr.components.Scale3DBatch, scales))
        with strict():
            self._file.send(
                path, [rr.ComponentColumn(what, rows(batch, values)) for what, batch, values in parts]
            )

    def arrow_style(self, path: str, colour: Colour) -> None:
        """Colour an arrow; it is equally wide at any distance."""
        with strict():
            style = rr.Arrows3D.from_fields(colors=[colour], radii=[rr.Radius.ui_points(_ARROW_WIDTH)])
            self._file.static(f"{path}/arrow", style)

    def arrows(self, path: str, places: np.ndarray, vectors: np.ndarray) -> None:
        """Write one arrow per frame: places (n, 3) [m], vectors (n, 3) in their own unit; see `scale`."""
        self.moves(path, places)
        with strict():
            batch = rows(rr.components.Vector3DBatch, vectors)
            self._file.send(f"{path}/arrow", [rr.ComponentColumn(rr.Arrows3D.descriptor_vectors(), batch)])

    def scale(self, path: str, factor: float) -> None:
        """Say how long a unit of an arrow's vector is drawn [m]; the last one counts, for all frames."""
        with strict():
            self._file.static(f"{path}/arrow", rr.Transform3D(scale=factor))
