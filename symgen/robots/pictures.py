"""What is drawn of a robot's links: shapes that models know, or a file for each link that has a mesh."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import InitVar, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.description import NOTHING
from .packages import MeshFinder
from .surfaces import Surfaces
from .urdf import Link, Vector, Visual

FAINTEST = 0.25  # opacity below which nothing is drawn


@dataclass(frozen=True)
class Pictures:
    """Whether and where pictures with meshes are made.

    Attributes
    ----------
    folder : Path, optional
        For the files, made when the first one is; the model's folder is the one above. Without it, no meshes.
    packages : tuple of Path
        Where packages of meshes lie.
    strict : bool
        Whether a mesh that cannot be had is refused; otherwise it is said.
    """

    folder: Path | None = None
    packages: tuple[Path, ...] = ()
    strict: bool = False

    @classmethod
    def of(cls, folder: str | Path | None, packages: str | Path | Iterable[str | Path]) -> Pictures:
        """From the arguments of `Model.from_urdf`: who names a folder wants all meshes."""
        given = [packages] if isinstance(packages, (str, Path)) else packages
        return cls(None if folder is None else Path(folder), tuple(map(Path, given)), strict=True)


@dataclass
class Painter:
    """Draws links, one after the other.

    Attributes
    ----------
    pictures : Pictures
    file : Path
        The robot's.
    note : callable
        Gets a sentence about what is left out.
    links : iterable of Link
        All of the robot: where some are drawn, those that show nothing are not drawn either.
    """

    pictures: Pictures
    file: Path
    note: Callable[[str], None]
    links: InitVar[Iterable[Link]]

    def __post_init__(self, links: Iterable[Link]) -> None:
        kinds = {visual.kind for link in links for visual in _visible(link)}
        drawn = kinds if self.pictures.folder is not None else kinds - {"mesh"}
        self._nothing = NOTHING if drawn else None
        self._finder = MeshFinder(self.file, self.pictures.packages)
        self._n_dropped = 0

    def shape(self, link: Link, name: str) -> Any:
        """The `shape` of a link's body, whose name in the model is given."""
        visuals = _visible(link)
        if not visuals:
            return self._nothing
        solids = [v for v in visuals if v.kind != "mesh"]
        if len(solids) < len(visuals) and self.pictures.folder is not None:
            shape = self._file(visuals, name)
            if shape is not None:
                return shape
        elif len(solids) < len(visuals):
            self._n_dropped += 1
        color = next((v.color for v in solids if v.color is not None), None)  # a body has one
        shapes = [solid(v) for v in solids]
        if color is not None:
            shapes[0]["color"] = hexadecimal(color)
        return shapes or None

    def finish(self) -> None:
        """Say how many links go without their meshes."""
        if self._n_dropped:
            self.note(f"the meshes of {self._n_dropped} links are left out of the picture")

    def _file(self, visuals: Sequence[Visual], name: str) -> dict[str, Any] | None:
        """The shape of a file with all that is drawn of a link."""
        try:
            surfaces, n_meshes = Surfaces(), 0
        except ModelError as error:
            if self.pictures.strict:
                raise error.located(file=str(self.file)) from None
            self.note(f"{error}")
            return None
        for visual in visuals:
            try:
                self._add(surfaces, visual)
            except ModelError as error:
                located = _located(error, visual)
                if self.pictures.strict:
                    raise located from None
                self.note(f"not drawn: {located}")
            else:
                n_meshes += visual.kind == "mesh"
        return written(self.pictures.folder, name, surfaces.content()) if n_meshes else None

    def _add(self, surfaces: Surfaces, visual: Visual) -> None:
        place = frame(visual.xyz, visual.rpy)
        if visual.kind == "mesh":
            file = self._finder.find(visual.place, visual.mesh)
            surfaces.add_mesh(file, visual.sizes, place, visual.color)
        else:
            surfaces.add_solid(visual.kind, visual.sizes, place, visual.color)


def _visible(link: Link) -> list[Visual]:
    return [v for v in link.visuals if v.color is None or v.color[3] >= FAINTEST]


def written(folder: Path, name: str, content: bytes) -> dict[str, Any]:
    """The shape of a mesh in the body's frame, whose file is written; nobody's file is written over."""
    stem = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:100]
    file = folder / f"{stem}.glb"
    try:
        folder.mkdir(exist_ok=True)
        with open(file, "xb") as out:
            out.write(content)
    except OSError as error:
        raise ModelError(
            f"the picture of {name!r:.60} cannot be written: {error.strerror}",
            file=str(file),
            hint="name another folder, or take the old one away",
        ) from None
    return {"mesh": f"{folder.name}/{file.name}", "offset": (0, 0, 0)}


def solid(visual: Visual) -> dict[str, Any]:
    """A box, cylinder, sphere or capsule as a shape of a body."""
    shape: dict[str, Any] = {visual.kind: visual.sizes, "offset": visual.xyz}
    if any(visual.rpy):
        shape["rpy"] = visual.rpy
    return shape


def hexadecimal(color: Sequence[float]) -> str:
    """A colour as models write it."""
    return "#" + "".join(f"{round(255 * x):02x}" for x in color[:3])


def frame(xyz: Vector, rpy: Vector) -> np.ndarray:
    """The transformation from a frame to the one in which its place and its roll, pitch and yaw are given."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(rpy), np.sin(rpy)
    result = np.eye(4)
    result[:3, :3] = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    result[:3, 3] = xyz
    return result


def _located(error: ModelError, visual: Visual) -> ModelError:
    """With the line of the robot's file, where the mesh's own says what is wrong with it."""
    if error.file == visual.place.file:
        return error
    return visual.place.error(str(error))
