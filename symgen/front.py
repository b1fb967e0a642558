"""What users hold in their hands: the builder of models, with doors to all that is done with one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from . import link
from .model import model, toml_reader

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
