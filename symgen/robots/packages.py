"""The files of meshes that a URDF names: found in packages that a person or the system knows, and nowhere else."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from .xml_tree import Element

SCHEME = "package://"
_MARK = "package.xml"  # what makes a folder a package


class MeshFinder:
    """Finds meshes by their names.

    Parameters
    ----------
    robot : Path
        The file that names them: names without a scheme count from its folder.
    folders : iterable of Path
        Packages, or folders of packages; names without a scheme may lie in these, too.
    """

    def __init__(self, robot: Path, folders: Iterable[Path]) -> None:
        self._robot = robot.resolve()
        self._folders = [folder.resolve() for folder in folders]
        self._packages: dict[str, list[Path]] = {}

    def find(self, place: Element, name: str) -> Path:
        """The file of a name, which lies in its package or below the robot's folder.

        Raises
        ------
        ModelError
            The name leads out of there, or there is no such package or file.
        """
        if name.startswith(SCHEME):
            package, _, path = name.removeprefix(SCHEME).partition("/")
            parts = _parts(place, name, path)
            if not package.strip(".") or not package.isprintable() or "\\" in package or ":" in package:
                raise place.error(f"the mesh {name[:100]!r} names no package")
            roots = self._package(package)
            if not roots:
                raise place.error(
                    f"the package {package[:60]!r} of the mesh {name[:100]!r} is not known",
                    "say where it lies with --package-path DIR (package_path)",
                )
        elif "://" in name:
            raise place.error(
                f"the mesh {name[:100]!r} is an address, and only files in packages and beside the robot are read",
                f"name it by {SCHEME}PACKAGE/FILE",
            )
        else:
            parts, roots = _parts(place, name, name), [self._robot.parent, *self._folders]
        for root in roots:
            file = root.joinpath(*parts)
            if os.path.lexists(file):
                return _inside(place, name, file.resolve(), root)
        raise place.error(f"the mesh {name[:100]!r} is not there", f"looked in {roots[0]}")

    def _package(self, name: str) -> list[Path]:
        """Folders of a package of this name, of those that a person named first."""
        if name not in self._packages:
            found = [folder.resolve() for folder in self._candidates(name) if folder.is_dir()]
            self._packages[name] = list(dict.fromkeys(found))
        return self._packages[name]

    def _candidates(self, name: str) -> Iterator[Path]:
        for folder in self._folders:
            if folder.name == name:
                yield folder
            if (folder / name).resolve().is_relative_to(folder):
                yield folder / name
        for above in self._robot.parents:
            if above.name == name and (above / _MARK).is_file():
                yield above
        for folder in _listed("ROS_PACKAGE_PATH"):
            yield from (x for x in (folder, folder / name) if x.name == name and (x / _MARK).is_file())
        for folder in _listed("AMENT_PREFIX_PATH"):
            yield folder / "share" / name
        yield from _installed(name)


def _listed(variable: str) -> list[Path]:
    return [Path(folder) for folder in os.environ.get(variable, "").split(os.pathsep) if folder]


def _installed(name: str) -> Iterator[Path]:
    """The folder `share/NAME` of the Python package of this name; nothing of it is run."""
    import importlib.metadata  # with all that reads mail, which few files ask for

    try:
        files = importlib.metadata.files(name) or []
    except (importlib.metadata.PackageNotFoundError, ValueError):
        return
    for file in files:
        if file.parts[-3:] == ("share", name, _MARK):
            yield Path(str(file.locate())).parent


def _inside(place: Element, name: str, file: Path, root: Path) -> Path:
    if not file.is_relative_to(root):
        raise place.error(
            f"the mesh {name[:100]!r} is a link that leads out of {root.name[:60]!r}",
            "name the folder where it leads to with --package-path DIR (package_path)",
        )
    return file


def _parts(place: Element, name: str, path: str) -> tuple[str, ...]:
    pure = PurePosixPath(path)
    out = pure.is_absolute() or ".." in pure.parts or "\\" in path or ":" in path
    if not path or not path.isprintable() or out:
        raise place.error(
            f"the mesh {name[:100]!r} leads out of its package or folder", f"name it by {SCHEME}PACKAGE/FILE"
        )
    return pure.parts
