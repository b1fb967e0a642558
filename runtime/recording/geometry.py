"""Shapes and poses as a viewer wants them: primitives with sizes, quaternions, the extent of a scene."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from symgen.runtime.errors import RuntimeModelError

from .solids import Surface, surfaces

_LARGEST_MESH = 64 << 20  # bytes: a recording takes it along
_PAINTED = (".glb", ".gltf", ".dae")  # these say what colours they have
MESH_SUFFIXES = (".stl", ".obj", ".glb", ".gltf", ".dae")
NOTHING = "none"  # the shape of a body that is not drawn
_POINT_RADIUS = 0.025  # of a body without shape and without rotation, in units of the scene's diagonal
_BLOCK = (0.09, 0.055, 0.035)  # edges of a body without shape that turns, likewise
_BAR, _STOUTEST = 0.009, 0.025  # radius of a bar between joints, likewise: from the one to the other, or
_STOUT = 0.12  # of its length
_FAR = 1.0  # the origin belongs to the scene unless it is this many diagonals away
_ROUNDING = 1e-9  # of what stands still, in parts of how far away it is


@dataclass(frozen=True)
class Primitive:
    """A body's picture, centred on the body's origin.

    Attributes
    ----------
    kind : str
        `box`, `sphere`, `cylinder`, `capsule`, `mesh`, `bars` between joints, or `solids`.
    sizes : tuple of float [m]
        box: the three edges; sphere: radius; cylinder: radius, length; capsule: radius, length between the
        centres of its caps; mesh: none, or where its origin is, from the body's; bars: radius.
    along_x : bool
        The axis of a cylinder or capsule is body x (planar models), else body z.
    mesh : Path, optional
        The mesh's file.
    painted : bool
        The mesh has colours of its own.
    ends : ndarray, shape (n, 2, 3) [m], optional
        Of bars, in body axes.
    surfaces : tuple of Surface
        Of solids, in body axes.
    """

    kind: str
    sizes: tuple[float, ...]
    along_x: bool
    mesh: Path | None = None
    painted: bool = False
    ends: np.ndarray | None = None
    surfaces: tuple[Surface, ...] = ()

    @property
    def is_rod(self) -> bool:
        """Whether it is long and thin, and joints sit in its ends."""
        return self.kind in ("capsule", "cylinder", "bars")

    def scales(self, grown: np.ndarray) -> np.ndarray:
        """Return by how much it is stretched along body axes, shape (n, 3).

        Parameters
        ----------
        grown : ndarray, shape (n, number of sizes)
            The sizes in units of `sizes`.
        """
        if self.kind == "box":
            return grown
        scales = np.repeat(grown[:, :1], 3, axis=1)
        if self.kind in ("capsule", "cylinder"):
            scales[:, 0 if self.along_x else 2] = grown[:, 1]
        return scales

    def half_thickness(self) -> float:
        """Return half its size along body z [m]."""
        core, thickness = self.half_box()
        return float(core[2]) + thickness

    def half_box(self) -> tuple[np.ndarray, float]:
        """Return half the edges of a core in body axes, shape (3,), and the thickness around it [m]."""
        axis = np.array([1.0, 0.0, 0.0] if self.along_x else [0.0, 0.0, 1.0])
        if self.kind == "box":
            return np.array(self.sizes) / 2, 0.0
        if self.kind in ("capsule", "cylinder"):
            return axis * self.sizes[1] / 2, self.sizes[0]
        if self.kind == "bars":
            return np.abs(self.ends).max(axis=(0, 1)), self.sizes[0]
        if self.kind == "solids":
            return np.abs(np.concatenate([s.vertices for s in self.surfaces])).max(axis=0), 0.0
        return np.zeros(3), self.sizes[0] if self.sizes and self.kind != "mesh" else 0.0


def split_poses(rows: np.ndarray, n_bodies: int) -> tuple[np.ndarray, np.ndarray]:
    """Split rows of `poses` into positions, shape (n, bodies, 3), and rotations, shape (n, bodies, 3, 3)."""
    poses = rows.reshape(len(rows), n_bodies, 12)
    return poses[:, :, :3], poses[:, :, 3:].reshape(len(rows), n_bodies, 3, 3)


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """Turn rotation matrices into unit quaternions (x, y, z, w).

    Of the four ways to write a quaternion by a matrix the best conditioned one is taken for each matrix
    (Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1, 1978).

    Parameters
    ----------
    rotations : ndarray, shape (..., 3, 3)
        Body to world.

    Returns
    -------
    ndarray, shape (..., 4)
    """
    shape = np.shape(rotations)[:-2]
    # By component: long contiguous arrays.
    r = np.ascontiguousarray(np.asarray(rotations, dtype=float).reshape(-1, 9).T)
    xx, yy, zz = r[0], r[4], r[8]
    squares = np.stack([1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz])
    best = squares.argmax(axis=0)
    q = np.empty((4, len(best)))
    for which in range(4):
        rows = np.flatnonzero(best == which)
        if len(rows):
            q[:, rows] = _scaled_quaternion(r[:, rows], squares[which, rows], which)
    return (q / np.sqrt((q * q).sum(axis=0))).T.reshape(*shape, 4)


def _scaled_quaternion(r: np.ndarray, square: np.ndarray, which: int) -> tuple[np.ndarray, ...]:
    """Return 4 q_i (x, y, z, w), where i is `which` and `square` is 4 q_i²."""
    _, xy, xz, yx, _, yz, zx, zy, _ = r
    if which == 0:
        return square, xy + yx, xz + zx, zy - yz
    if which == 1:
        return xy + yx, square, yz + zy, xz - zx
    if which == 2:
        return xz + zx, yz + zy, square, yx - xy
    return zy - yz, xz - zx, yx - xy, square


def scene_box(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Widen the box between two corners, shape (3,) [m], to the origin, unless that is far away."""
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return np.full(3, -0.5), np.full(3, 0.5)
    away = np.linalg.norm(np.clip(0.0, low, high))
    diagonal = np.linalg.norm(high - low)
    if diagonal <= _ROUNDING * away or away <= _FAR * diagonal:
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
    return low, high


def drawn_boxes(
    shapes: list[Primitive], positions: np.ndarray, rotations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners, shape (n, 3) each [m], of the boxes that hold all that is drawn of the bodies in each frame.

    Parameters
    ----------
    shapes : list of Primitive
    positions : ndarray, shape (n, bodies, 3) [m]
    rotations : ndarray, shape (n, bodies, 3, 3)
        Into the axes of the boxes.
    """
    half = np.stack([core for core, _ in (shape.half_box() for shape in shapes)])
    thickness = np.array([shape.half_box()[1] for shape in shapes])
    reach = np.einsum("nbij,bj->nbi", np.abs(rotations), half) + thickness[:, None]
    return (positions - reach).min(axis=1), (positions + reach).max(axis=1)


def diagonal_of(low: np.ndarray, high: np.ndarray) -> float:
    """Return the length by which default shapes are sized: the diagonal, 1 m where all is in one point."""
    return float(np.linalg.norm(high - low)) or 1.0


def primitives(
    bodies: list[dict],
    sizes: np.ndarray,
    rotations: np.ndarray,
    diagonal: float,
    mesh_folder: Path | None,
    bars: Mapping[str, list[np.ndarray]] | None = None,
) -> list[Primitive]:
    """Return one primitive per body.

    Parameters
    ----------
    bodies : list of dict
        `MODEL["bodies"]`.
    sizes : ndarray
        What the kernel `shapes` wrote [m].
    rotations : ndarray, shape (n, bodies, 3, 3)
        Over some frames; a body without a shape that does not turn in them is drawn as a point mass.
    diagonal : float [m]
        Of the scene; sizes the default shapes.
    mesh_folder : Path or None
        Meshes are taken from below here only.
    bars : mapping of str to list of ndarray, shape (2, 3) [m], optional
        Bars between the joints of bodies that have no shape.

    Raises
    ------
    RuntimeModelError
        For a mesh that is not there, lies elsewhere, or has a format that viewers do not read.
    """
    turns = (rotations != np.eye(3)).any(axis=(0, 2, 3))
    result, offset = [], 0
    for index, body in enumerate(bodies):
        own = tuple(float(s) for s in sizes[offset : offset + body["sizes"]])
        offset += body["sizes"]
        if body["shape"] == "mesh":
            file = _mesh_file(body, mesh_folder)
            painted = file.suffix.lower() in _PAINTED and "color" not in body
            result.append(Primitive("mesh", own, body["planar"], file, painted))
        elif body["shape"] == "solids":
            made = tuple(surfaces(body["parts"], np.array(own)))
            result.append(Primitive("solids", (), body["planar"], surfaces=made))
        elif body["shape"] == NOTHING:
            result.append(Primitive(NOTHING, (), body["planar"]))
        elif body["shape"]:
            result.append(Primitive(body["shape"], own, body["planar"]))
        elif bars and body["name"] in bars:
            ends = np.array(bars[body["name"]])
            longest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max()
            radius = min(max(_BAR * diagonal, _STOUT * longest), _STOUTEST * diagonal)
            result.append(Primitive("bars", (radius,), body["planar"], ends=ends))
        elif turns[index]:
            result.append(Primitive("box", tuple(edge * diagonal for edge in _BLOCK), body["planar"]))
        else:
            result.append(Primitive("sphere", (_POINT_RADIUS * diagonal,), body["planar"]))
    return result


def _names_other_files(file: Path, where: str) -> bool:
    """Whether a glTF file has data elsewhere than in itself."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        parts = [part for key in ("buffers", "images") for part in content.get(key, ())]
        return any(not part.get("uri", "data:").startswith("data:") for part in parts)
    except (ValueError, AttributeError, TypeError, RecursionError) as error:
        raise RuntimeModelError(f"{where}: is no glTF file ({error}); save it anew") from error


def _mesh_file(body: dict, folder: Path | None) -> Path:
    where = f"body {body['name']!r}, shape mesh {body['mesh']!r}"
    if folder is None:
        raise RuntimeModelError(
            f"{where}: the folder of the model is not known; run the model from its own file, or draw a box"
            " instead"
        )
    root = Path(folder).resolve()
    file = (root / body["mesh"]).resolve()
    if not file.is_relative_to(root):
        raise RuntimeModelError(f"{where}: lies outside the model's folder {root}; move it there")
    if not file.is_file():
        raise RuntimeModelError(f"{where}: there is no file {file}; correct the name in the model")
    if file.suffix.lower() not in MESH_SUFFIXES:
        raise RuntimeModelError(f"{where}: must be one of {', '.join(MESH_SUFFIXES)}; convert it")
    if file.stat().st_size > _LARGEST_MESH:
        raise RuntimeModelError(
            f"{where}: has {file.stat().st_size >> 20} MiB, and the most are 64; simplify it"
        )
    if file.suffix.lower() == ".gltf" and _names_other_files(file, where):
        raise RuntimeModelError(
            f"{where}: names other files, which a recording does not take along; save it as .glb, which has all in it"
        )
    return file
