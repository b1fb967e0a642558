"""Pictures of links as files of their own: meshes of strangers, read by trimesh (optional), and simple solids.

What trimesh is given are bytes that were read here: it opens nothing by itself, but for the colours of an OBJ file that
lie beside it. What it makes of them is bounded, and must consist of numbers.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.files import read_plain
from .xml_tree import LARGEST_FILE, parse_xml

SUFFIXES = (".stl", ".obj", ".dae")
LARGEST_MESH = 64 << 20  # bytes
MOST_TRIANGLES = 2_000_000  # of a link
_GREY = (0.7, 0.7, 0.7, 1.0)
_ROUND = 32  # sides of a cylinder
_NEEDS = "pip install 'symgen[meshes]'"


class Surfaces:
    """The parts of one link's picture, in its frame."""

    def __init__(self) -> None:
        self._trimesh = _library()
        self._parts: list[Any] = []
        self._n_triangles = 0

    def add_mesh(
        self, file: Path, scale: Sequence[float], place: np.ndarray, color: Sequence[float] | None
    ) -> None:
        """Add the surfaces of a file.

        Parameters
        ----------
        file : Path
        scale : sequence of 3
            Along the file's x, y and z.
        place : ndarray, shape (4, 4)
            From its frame to the link's [m].
        color : sequence of 4, optional
            Red, green, blue, opacity, 0 to 1; that of the file by default.

        Raises
        ------
        ModelError
            It is too large, of a kind that is not read, or no such file in truth.
        """
        for part in _read(self._trimesh, file):
            part.apply_transform(place @ np.diag([*scale, 1.0]))
            self._add(part, color)

    def add_arrays(
        self, vertices: np.ndarray, triangles: np.ndarray, place: np.ndarray, color: Sequence[float]
    ) -> None:
        """Add triangles: corners, shape (n, 3) [m], and their numbers, shape (m, 3)."""
        part = self._trimesh.Trimesh(vertices, triangles, process=False)
        part.apply_transform(place)
        self._add(part, color)

    def add_solid(
        self, kind: str, sizes: Sequence[float], place: np.ndarray, color: Sequence[float] | None
    ) -> None:
        """Add a box, sphere, cylinder, capsule or ellipsoid, with sizes as of shapes of bodies."""
        make = self._trimesh.creation
        if kind == "box":
            part = make.box(extents=sizes)
        elif kind == "cylinder":
            part = make.cylinder(radius=sizes[0], height=sizes[1], sections=_ROUND)
        elif kind == "capsule":
            part = make.capsule(radius=sizes[0], height=sizes[1], count=[_ROUND, _ROUND])
            part.apply_translation(-part.bounds.mean(axis=0))
        else:
            part = make.icosphere(subdivisions=3, radius=1.0)
            part.apply_scale(sizes if len(sizes) == 3 else sizes[0])
        part.apply_transform(place)
        self._add(part, color)

    def _add(self, part: Any, color: Sequence[float] | None) -> None:
        self._n_triangles += len(part.faces)
        if self._n_triangles > MOST_TRIANGLES:
            raise ModelError(
                f"the picture has more than {MOST_TRIANGLES} triangles", hint="simplify its meshes"
            )
        if not np.isfinite(part.vertices).all():
            raise ModelError("the mesh has a corner that is no finite number")
        material = self._trimesh.visual.material.PBRMaterial(
            baseColorFactor=(np.array(color or _color_of(part) or _GREY) * 255).astype(np.uint8),
            metallicFactor=0.1,
            roughnessFactor=0.6,
            doubleSided=True,
        )
        uv = np.zeros((0, 2))
        part.visual = self._trimesh.visual.TextureVisuals(uv=uv, material=material)
        part.merge_vertices()
        part.metadata.clear()
        self._parts.append(part)

    def content(self) -> bytes:
        """A binary glTF file of all parts."""
        scene = self._trimesh.Scene(self._parts)
        return self._trimesh.exchange.gltf.export_glb(scene, include_normals=True)


def _library() -> Any:
    try:
        import trimesh
        import trimesh.exchange.gltf
        import trimesh.visual
    except ImportError:
        raise ModelError("meshes are read by trimesh, which is not installed", hint=_NEEDS) from None
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # what is wrong is said by exceptions
    return trimesh


def _read(trimesh: Any, file: Path) -> list[Any]:
    """The surfaces of a file, in its frame and unit, which are metres but for COLLADA's own."""
    kind = file.suffix.lower()
    if kind not in SUFFIXES:
        raise ModelError(
            f"the mesh {file.name!r:.100} is of a kind that is not read",
            hint=f"save it as one of {', '.join(SUFFIXES)}",
        )
    content = read_plain(file, LARGEST_MESH, "mesh")
    if kind == ".dae":
        parse_xml(content, str(file))
        try:
            import collada  # noqa: F401  (trimesh leaves such files out without it)
        except ImportError:
            raise ModelError("meshes of COLLADA (.dae) are read by pycollada", hint=_NEEDS) from None
    try:
        scene = trimesh.load_scene(
            io.BytesIO(content),
            file_type=kind[1:],
            resolver=_Beside(file) if kind == ".obj" else _Nowhere(),
            process=False,
        )
        if kind == ".dae" and scene.units not in (None, "meters", "meter", "m"):
            scene = scene.convert_units("meters")
        parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    except Exception as error:  # of libraries, about files of strangers: of any type
        raise ModelError(
            f"the mesh {file.name!r:.100} cannot be read: {' '.join(str(error).split())[:100] or type(error).__name__}"
        ) from None
    if not parts:
        raise ModelError(f"the mesh {file.name!r:.100} has no triangles")
    return parts


class _Nowhere:
    """What a mesh names beside itself is not read."""

    def get(self, name: str) -> bytes:
        raise FileNotFoundError(name)

    def keys(self) -> list[str]:
        return []


class _Beside(_Nowhere):
    """The colours of an OBJ file: a file beside it whose name ends in .mtl."""

    def __init__(self, file: Path) -> None:
        self._folder = file.parent

    def get(self, name: str) -> bytes:
        pure = PurePosixPath(name)
        file = self._folder / pure.name
        if len(pure.parts) != 1 or pure.suffix.lower() != ".mtl" or file.is_symlink():
            raise FileNotFoundError(name)
        return read_plain(file, LARGEST_FILE, "list of colours")


def _color_of(part: Any) -> list[float] | None:
    """The one colour of a surface that was read; None where it has none."""
    material = getattr(part.visual, "material", None)
    if material is None:
        return None
    rgba = getattr(material, "baseColorFactor", None)
    rgba = material.main_color if rgba is None else rgba
    return None if rgba is None else (np.array(rgba, dtype=float)[:4] / 255).tolist()
