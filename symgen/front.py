"""What users hold in their hands: the builder of models, with doors to all that is done with one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from . import link
from .model import model, toml_reader
from .robots.build import EARTH, import_urdf

if TYPE_CHECKING:
    from symgen.runtime import System


class Model(model.Model):
    __doc__ = model.Model.__doc__

    def derive(self) -> System:
        """Derive the equations of motion and load them, ready to run."""
        return link.derive(self)

    @classmethod
    def from_toml(cls, source: str | Path, folder: str | Path | None = None) -> Model:
        """Read a model from a TOML file, or from its text.

        Parameters
        ----------
        source : path or str
            A `Path`, a path's text ending in `.toml`, or TOML text.
        folder : path, optional
            Where the meshes of a model given as text are.
        """
        if isinstance(source, Path) or (source.endswith(".toml") and "\n" not in source):
            return toml_reader.read_file(Path(source), cls)
        return toml_reader.read_text(source, folder=None if folder is None else Path(folder), make=cls)

    @classmethod
    def from_urdf(
        cls,
        path: str | Path,
        base: str = "fixed",
        expose: Iterable[str] | None = None,
        motors: bool = True,
        gravity: Sequence[float | str] = EARTH,
    ) -> Model:
        """Read a robot from a URDF file.

        Parameters
        ----------
        path : path-like
        base : {"fixed", "free"}
            Whether the first link is fixed to the world or moves freely (coordinates `root_x`, …, a quaternion).
        expose : iterable of str, optional
            Patterns of the numbers that become parameters, as `"wrist_*.mass"`: of links `mass`, `com_x`, `com_y`,
            `com_z`, `Ixx` … `Iyz`, of joints `damping`, `friction`, `armature`. All that are not zero by default; the
            others are folded into the code.
        motors : bool
            Whether joints that a motor may move (not those that mimic another) get an input, a force [N] or
            torque [N m].
        gravity : sequence of 3
            Acceleration [m/s^2].

        Returns
        -------
        Model

        Raises
        ------
        ModelError
            Names the file, the line and the element.
        """
        return import_urdf(path, base, expose, motors, gravity, cls).model
