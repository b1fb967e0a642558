"""Whether MuJoCo may be given a file: it and all that it names lie in one folder, are plain, and not too large.

MuJoCo's parser reads what a file names, wherever that lies, and loads shared libraries for plugins. So the elements are
read here first, with bounds, and every name of a file is followed as MuJoCo would follow it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from .xml_tree import Element, read_xml

MOST_INCLUDES = 200
DEEPEST_INCLUDES = 16
LARGEST_ASSETS = 512 << 20  # bytes of all of them
_DIRECTORIES = ("meshdir", "texturedir", "assetdir")
_FILES = ("file", "fileright", "fileup", "fileleft", "filedown", "filefront", "fileback")
_REFUSED = {
    "plugin": "plugins are shared libraries, which are not loaded for a file from elsewhere",
    "extension": "plugins are shared libraries, which are not loaded for a file from elsewhere",
}


def check_files(path: Path, within: Path | None = None) -> list[Element]:
    """Return the roots of a file and of those that it includes, if nothing outside a folder is named.

    Parameters
    ----------
    path : Path
    within : Path, optional
        The folder; that of the file by default.

    Raises
    ------
    ModelError
        Names the file, the line and the element.
    """
    return list(_Files(path, within or path.parent).read())


class _Files:
    def __init__(self, path: Path, within: Path) -> None:
        self.path, self.within = path, within.resolve()
        self.n_read, self.bytes = 0, 0
        self.assets: list[tuple[Element, str]] = []
        self.directories = {""}

    def read(self) -> Iterator[Element]:
        roots = [*self._tree(self.path, 0, ())]
        if roots[0].tag != "mujoco":
            raise roots[0].error("the file has no <mujoco> root")
        for element, name in self.assets:
            self._check_asset(element, name)
        return iter(roots)

    def _tree(self, path: Path, depth: int, above: tuple[Path, ...]) -> Iterator[Element]:
        root = read_xml(path)
        self.n_read += 1
        yield root
        stack = [root]
        while stack:
            element = stack.pop()
            stack += reversed(element.children)
            if element.tag in _REFUSED:
                raise element.error(_REFUSED[element.tag])
            if element.tag == "compiler":
                self.directories.update(
                    element.attributes[key] for key in _DIRECTORIES if key in element.attributes
                )
            if element.tag in ("include", "model") and "file" in element.attributes:
                file = self._inside(element, element.attributes["file"], ("",))
                if self.n_read > MOST_INCLUDES or depth >= DEEPEST_INCLUDES or file in above:
                    raise element.error(
                        f"files include each other in a circle, more than {DEEPEST_INCLUDES} deep, or more than "
                        f"{MOST_INCLUDES} of them"
                    )
                yield from self._tree(file, depth + 1, (*above, file))
                continue
            self.assets += [(element, element.attributes[key]) for key in _FILES if key in element.attributes]

    def _inside(self, element: Element, name: str, directories: tuple[str, ...]) -> Path:
        """The file that a name means; every way to follow it must stay in the folder, and one must find it."""
        found = None
        for folder in directories:
            for base in {self.path.parent, Path(element.file).parent}:
                if "\0" in name or "\0" in folder or ":" in name or name.startswith(("\\", "/")):
                    raise element.error(f"the file {name[:60]!r} is not named relative to the model's folder")
                place = (base / folder / name.replace("\\", "/")).resolve()
                if not place.is_relative_to(self.within):
                    raise element.error(
                        f"the file {name[:60]!r} lies outside of {self.within.name!r:.60}",
                        "put all files below one folder, and name that folder (within)",
                    )
                if found is None and place.is_file():
                    found = place
        if found is None:
            raise element.error(f"the file {name[:60]!r} is not there")
        return found

    def _check_asset(self, element: Element, name: str) -> None:
        file = self._inside(element, name, tuple(sorted(self.directories)))
        self.bytes += file.stat().st_size
        if self.bytes > LARGEST_ASSETS:
            raise element.error(f"the files that are named have more than {LARGEST_ASSETS >> 20} MiB")
