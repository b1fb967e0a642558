"""Closed surfaces from STL files: volume, centre and second moments by tetrahedra from the origin.

Eberly, Polyhedral mass properties (2002): a polyhedron is the sum of the signed tetrahedra that its triangles make with
any point; those of one are polynomials of its corners.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import ModelError

LARGEST = 1 << 28  # bytes
HEADER, RECORD = 84, 50  # bytes of a binary file: head, and of each triangle: normal, corners, attribute


@dataclass(frozen=True)
class Volume:
    """What a closed surface holds: volume [m^3], centre [m], and second moments about it per density [m^5]."""

    volume: float
    centre: tuple[float, ...]
    inertia: tuple[float, ...]  # xx, yy, zz, xy, xz, yz


def volume_of(file: Path) -> Volume:
    """The volume inside the surface of an STL file, in metres.

    Raises
    ------
    ModelError
        The file is no STL, or its surface is not closed.
    """
    corners = _corners(file)
    _check_closed(corners, file)
    determinants = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    volume = determinants.sum() / 6
    if not volume > 0:
        hint = "turn its triangles round: seen from outside, corners go counterclockwise"
        raise ModelError(
            f"the surface of the mesh {file.name!r:.100} holds no volume: {volume:.3g} m^3", hint=hint
        )
    sums = corners.sum(axis=1)
    centre = np.einsum("n,ni->i", determinants, sums) / 24 / volume
    squares = np.einsum("n,ni,nj->ij", determinants, sums, sums)
    squares += np.einsum("n,nki,nkj->ij", determinants, corners, corners)
    moments = squares / 120 - volume * np.outer(centre, centre)
    tensor = np.trace(moments) * np.eye(3) - moments
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return Volume(float(volume), tuple(map(float, centre)), tuple(float(tensor[place]) for place in places))


@dataclass(frozen=True)
class Hull:
    """The least convex solid around a mesh.

    Attributes
    ----------
    corners : ndarray, shape (n, 3)
        In metres.
    sides : list of (ndarray, float)
        Normals that point outwards, and how far the planes are from the origin.
    edges : list of (int, int)
        Two corners each.
    """

    corners: np.ndarray
    sides: list[tuple[np.ndarray, float]]
    edges: list[tuple[int, int]]

    def on_side(self, number: int) -> np.ndarray:
        """Return which corners are in a side."""
        normal, offset = self.sides[number]
        size = np.ptp(self.corners, axis=0).max()
        return np.abs(self.corners @ normal - offset) <= _SAME_PLANE * size

    def sides_of_edges(self) -> list[set[int]]:
        """Return the two sides of each edge."""
        on = [self.on_side(k) for k in range(len(self.sides))]
        return [{k for k, corners in enumerate(on) if corners[a] and corners[b]} for a, b in self.edges]


_SAME_PLANE = 1e-6  # of two triangles of one side; coordinates of STL files have seven digits


def hull_of(file: Path) -> Hull:
    """The least convex solid around a mesh.

    Raises
    ------
    ModelError
        The file is no STL, or its corners lie in a plane.
    """
    from scipy.spatial import ConvexHull, QhullError

    corners = np.unique(_corners(file).reshape(-1, 3), axis=0)
    try:
        hull = ConvexHull(corners)
    except QhullError:
        message = f"the mesh {file.name!r:.100} is flat: its corners lie in a plane"
        raise ModelError(message, hint="take a solid, or spheres at its corners") from None
    used = np.sort(hull.vertices)
    number = {int(k): n for n, k in enumerate(used)}
    size = np.ptp(corners, axis=0).max()
    sides: list[tuple[np.ndarray, float]] = []
    side_of, edges = [], []
    for *normal, offset in hull.equations:
        plane = np.array([*normal, offset / size])
        known = [np.abs(plane - [*n, -d / size]).max() < _SAME_PLANE for n, d in sides]
        side_of.append(known.index(True) if True in known else len(sides))
        if True not in known:
            sides.append((plane[:3], float(-offset)))
    for k, (triangle, beside) in enumerate(zip(hull.simplices, hull.neighbors, strict=True)):
        for opposite, other in enumerate(beside):
            if k < other and side_of[k] != side_of[other]:
                j, i = (number[int(x)] for x in np.delete(triangle, opposite))
                edges.append((j, i))
    return Hull(corners[used], sides, edges)


def _corners(file: Path) -> np.ndarray:
    """Corners of the triangles, shape (n, 3, 3)."""
    wrong = ModelError(f"the mesh {file.name!r:.100} is no STL file", hint="save it as STL, in metres")
    if file.suffix.lower() != ".stl" or file.stat().st_size > LARGEST:
        raise wrong
    data = file.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) == HEADER + RECORD * count and count:
        rows = np.frombuffer(data, dtype=np.uint8, offset=HEADER).reshape(count, RECORD)[:, 12:48]
        corners = np.ascontiguousarray(rows).view("<f4").astype(float).reshape(count, 3, 3)
    else:
        words = data.split()
        places = [k for k, word in enumerate(words) if word.lower() == b"vertex"]
        try:
            corners = np.array([[float(x) for x in words[k + 1 : k + 4]] for k in places]).reshape(-1, 3, 3)
        except ValueError:
            raise wrong from None
    if not len(corners) or not np.isfinite(corners).all():
        raise wrong
    return corners


def _check_closed(corners: np.ndarray, file: Path) -> None:
    """Whether every edge is one of two triangles, which go along it in opposite directions."""
    _, which = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = which.reshape(-1, 3)
    edges: Counter[tuple[int, int]] = Counter()
    for a, b in ((0, 1), (1, 2), (2, 0)):
        for p, q in zip(triangles[:, a].tolist(), triangles[:, b].tolist(), strict=True):
            if p != q:
                edges[min(p, q), max(p, q)] += 1 if p < q else -1
    open_edges = sum(count != 0 for count in edges.values())
    if open_edges:
        message = (
            f"the surface of the mesh {file.name!r:.100} is not closed: {open_edges} edges have no other side"
        )
        raise ModelError(message, hint="close it, or state mass and inertia of the body")
