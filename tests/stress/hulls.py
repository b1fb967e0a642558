"""Meshes of convex solids, as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull


def write_hull(file: Path, corners: np.ndarray) -> None:
    """An STL file of the hull of some places, with triangles that point outwards."""
    hull, lines = ConvexHull(corners), ["solid hull"]
    for triangle, equation in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = corners[triangle]
        if np.cross(b - a, c - a) @ equation[:3] < 0:
            b, c = c, b
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:.17g} {y:.17g} {z:.17g}" for x, y, z in (a, b, c)]
        lines += ["endloop", "endfacet"]
    file.write_text("\n".join([*lines, "endsolid"]))
