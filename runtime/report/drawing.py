"""A mechanism as inline SVG: bodies by their poses and shapes, seen along z where planar, otherwise isometrically.

What a picture shows besides bodies as lines in the world: springs, supports, axes and pins of one state.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.recording import geometry, schema
from symgen.runtime.recording.marks import Marks
from symgen.runtime.recording.recording import Quantities
from symgen.runtime.recording.surroundings import Surroundings
from symgen.runtime.recording.tethers import TetherWriter, tethers
from symgen.runtime.report.svg import N_COLOURS

if TYPE_CHECKING:
    from symgen.runtime.recording.geometry import Primitive
    from symgen.runtime.system import System


_HIDDEN = (schema.JOINT_AXES, schema.REACTIONS, schema.FORCES)
_CIRCLE = 16  # corners of a circle


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


def _tether_lines(writer: TetherWriter, around: Surroundings, positions: np.ndarray) -> list[np.ndarray]:
    collector = LineCollector(around)
    writer.open(collector, positions[0])
    writer.frames(collector, positions[:1])
    return collector.collected()


def _circle(centre: np.ndarray, axis: np.ndarray, radius: float) -> list[np.ndarray]:
    """A circle about an axis along z; none about others, of which the side is seen."""
    if abs(axis[2]) < 0.99 * np.linalg.norm(axis):
        return []
    angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE + 1)
    return [centre + radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)]


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    """The rotation matrix of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


_WIDTH, _HIGHEST = 640.0, 420.0
_MARGIN = 30.0
_ROOM = 2.5  # around a single body, of its size
_MOST_BODIES, _MOST_NAMES = 400, 12
_ROUND = 24  # corners of a circle in space
_CROSS = 7.0
_MARK = "fill:none;stroke:var(--soft);stroke-width:1.2"
# Rows: to the right, up, towards the eye. Isometric: x, y and z look equally long, z stands upright.
_PLANAR = np.eye(3)
_ISOMETRIC = np.array(
    [
        np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0),
        np.array([-1.0, -1.0, 2.0]) / np.sqrt(6.0),
        np.array([1.0, 1.0, 1.0]) / np.sqrt(3.0),
    ]
)


def drawing(system: System, p: np.ndarray, t: float, state: np.ndarray) -> str:
    """Return the mechanism in a state as an SVG element; an empty text where the model has no bodies.

    Parameters
    ----------
    p : ndarray, shape (n_p,)
    t : float [s]
    state : ndarray, shape (nq + nv,)
    """
    if not 0 < len(system.bodies) <= _MOST_BODIES:
        return ""
    times, states = np.array([t]), np.ascontiguousarray(state[None, : system.nq + system.nv])
    rows = evaluate(system, "poses", p, times, states)
    if not np.isfinite(rows).all():
        return ""
    positions, rotations = geometry.split_poses(rows, len(system.bodies))
    sizes = evaluate(system, "shapes", p, times, states)[0]
    # Meshes lie in files of their own: a body stands for each.
    bodies = [{**body, "shape": None if body["shape"] == "mesh" else body["shape"]} for body in system.bodies]
    planar = all(body["planar"] for body in bodies)
    marks = Marks(system.source.header, Quantities(system, p), planar)
    if marks:
        marks.prepare(times, states)
    rods = tethers(Quantities(system, p), t, states[0], tuple(marks.bars()))
    ends = np.concatenate([positions[0], *(rod.place[None] for rod in rods)])
    diagonal = geometry.diagonal_of(*geometry.scene_box(ends.min(axis=0), ends.max(axis=0)))
    shapes = geometry.primitives(bodies, sizes, rotations, diagonal, None, marks.bars())
    names = [body["name"] for body in bodies]
    around = Surroundings.of_bodies(names, shapes, positions, rotations, diagonal, planar)
    lines = [
        *(mark_lines(marks, around, times, states) if marks else []),
        *_tether_lines(TetherWriter(rods, names, planar, diagonal), around, positions),
    ]
    view = _PLANAR if planar else _ISOMETRIC
    outlines = [_outlines(shape, positions[0, i], rotations[0, i], view) for i, shape in enumerate(shapes)]
    drawn = [line @ view[:2].T for line in lines]
    colours = [body.get("color", "") for body in bodies]
    return _picture(names, colours, outlines, positions[0] @ view.T, drawn)


Outline = tuple[
    np.ndarray, float
]  # corners in the plane of the picture, shape (n, 2), the thickness around them [m]


def _outlines(
    shape: Primitive, position: np.ndarray, rotation: np.ndarray, view: np.ndarray
) -> list[Outline]:
    """Return the outlines of a body, those of several solids from the farthest to the nearest."""
    if shape.kind == geometry.NOTHING:
        return []
    if shape.kind != "solids":
        return [_outline(shape, position, rotation, view)]
    seen = [(s.vertices @ rotation.T + position) @ view.T for s in shape.surfaces]
    seen.sort(key=lambda corners: corners[:, 2].mean())
    return [(_hull(corners[:, :2]), 0.0) for corners in seen]


def _outline(shape: Primitive, position: np.ndarray, rotation: np.ndarray, view: np.ndarray) -> Outline:
    """Return the outline of a body that is drawn as one."""
    if shape.kind == "box":
        half = np.array(shape.sizes) / 2
        corners = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T * half
    elif shape.kind == "cylinder":
        radius, length = shape.sizes
        angle = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
        ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        corners = np.vstack(
            [np.insert(ring, 0 if shape.along_x else 2, end, axis=1) for end in (-length / 2, length / 2)]
        )
    elif shape.kind == "bars":
        ends = shape.ends.reshape(-1, 3)
        return (ends @ rotation.T + position) @ view[:2].T, shape.sizes[0]
    else:
        half, radius = shape.half_box()
        corners = np.array([-half, half])
        return (corners @ rotation.T + position) @ view[:2].T, radius
    return _hull((corners @ rotation.T + position) @ view[:2].T), 0.0


def _hull(points: np.ndarray) -> np.ndarray:
    """Return the convex hull of points in a plane, counterclockwise (Andrew's monotone chain, 1979)."""
    points = np.unique(points, axis=0)

    def chain(ordered: np.ndarray) -> list[np.ndarray]:
        kept: list[np.ndarray] = []
        for point in ordered:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], point) <= 0.0:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    return np.array(chain(points) + chain(points[::-1])) if len(points) > 2 else points


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _picture(
    names: list[str],
    colours: list[str],
    outlines: list[list[Outline]],
    centres: np.ndarray,
    lines: list[np.ndarray],
) -> str:
    seen = [*(outline for body in outlines for outline in body), *((line, 0.0) for line in lines)]
    if not seen:
        return ""
    low = np.min([corners.min(axis=0) - thick for corners, thick in seen], axis=0)
    high = np.max([corners.max(axis=0) + thick for corners, thick in seen], axis=0)
    low, high = (corner[:2] for corner in geometry.scene_box(np.append(low, 0.0), np.append(high, 0.0)))
    if len(seen) == 1 and not np.ptp(seen[0][0], axis=0).any():  # a ball with nothing beside it
        low, high = low - _ROOM * (high - low), high + _ROOM * (high - low)
    extent = np.maximum(high - low, 1e-3 * np.max(high - low))
    extent = np.where(extent > 0.0, extent, 1.0)
    scale = float(min((_WIDTH - 2 * _MARGIN) / extent[0], (_HIGHEST - 2 * _MARGIN) / extent[1]))
    height = scale * extent[1] + 2 * _MARGIN
    middle = (low + high) / 2

    def place(points: np.ndarray) -> np.ndarray:
        return (points - middle) * (scale, -scale) + (_WIDTH / 2, height / 2)

    parts = []
    if (low <= 0.0).all() and (high >= 0.0).all():
        x, y = place(np.zeros(2))
        parts.append(
            f'<path class="origin" d="M{x - _CROSS:.1f} {y:.1f}h{2 * _CROSS}M{x:.1f} {y - _CROSS:.1f}v{2 * _CROSS}"/>'
        )
    for i in np.argsort(centres[:, 2], kind="stable"):
        parts += [_body(place(corners), scale * thick, i, colours[i]) for corners, thick in outlines[i]]
    if lines:
        path = "".join("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in place(line)) for line in lines)
        parts.append(f'<path class="mark" style="{_MARK}" d="{path}"/>')
    if len(names) <= _MOST_NAMES:
        for name, outline, (x, y) in zip(names, outlines, place(centres[:, :2])):
            if outline:
                parts.append(f'<text x="{x + 8:.1f}" y="{y - 8:.1f}">{escape(name)}</text>')
    return (
        f'<svg class="drawing" viewBox="0 0 {_WIDTH:g} {height:.0f}" role="img" '
        'aria-label="the mechanism at the start">'
        f"{''.join(parts)}</svg>"
    )


def _body(corners: np.ndarray, thick: float, index: int, own_colour: str) -> str:
    colour = f"c{index % N_COLOURS}"
    style = f"stroke:{own_colour}" if own_colour else ""
    filled = f' style="{style};fill:{own_colour}"' if style else ""
    if thick > 0.0 and np.abs(corners - corners[0]).max() < 0.05:
        x, y = corners[0]
        return f'<circle class="body {colour}"{filled} cx="{x:.1f}" cy="{y:.1f}" r="{max(thick, 1.0):.1f}"/>'
    path = "L".join(f"{x:.1f} {y:.1f}" for x, y in corners)
    if thick > 0.0 or len(corners) < 3:
        width = ";".join(filter(None, (style, f"stroke-width:{max(2 * thick, 2.0):.1f}")))
        return f'<path class="bar {colour}" style="{width}" d="M{path}"/>'
    return f'<path class="body {colour}"{filled} d="M{path}Z"/>'
