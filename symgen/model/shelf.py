"""Where assemblies are found by name: those of a model, then those of the models that it is part of."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..errors import ModelError, nearest
from .declared import Declared

DEEPEST = 30  # assemblies inside each other, and files that name each other
MOST_PARTS = 200_000
Fail = Callable[..., ModelError]


class Shelf:
    """The assemblies of a model by name.

    Parameters
    ----------
    outer : Shelf, optional
        That of the model which this one is part of.
    root : Shelf, optional
        That of the model that is being read, where this one is of a file of its own: it does not see its names.
    """

    def __init__(self, outer: Shelf | None = None, root: Shelf | None = None) -> None:
        self._outer = outer
        above = outer if root is None else root
        self._root = self if above is None else above._root
        self._made: dict[str, Any] = {}
        self._announced: dict[str, Callable[[], Declared]] = {}
        self._open: list[tuple[Any, str]] = []  # of the root: what is being read, and what it is called
        self._files: dict[Path, Declared] = {}  # of the root: those that were read
        self._taken = 0  # of the root: names and elements that uses have brought

    def names(self) -> dict[str, Any]:
        """The names of a model's own assemblies."""
        return self._made | self._announced

    def own(self) -> Iterator[tuple[str, Any]]:
        """A model's own assemblies."""
        yield from self._made.items()

    def put(self, name: str, assembly: Any) -> Any:
        """Add an assembly."""
        self._made[name] = assembly
        return assembly

    def announce(self, name: str, read: Callable[[], Declared]) -> None:
        """Add an assembly that is read when it is needed first."""
        self._announced[name] = read

    def take(self, count: int, fail: Fail) -> None:
        """Count names and elements that a use brings: assemblies of assemblies multiply."""
        self._root._taken += count
        if self._root._taken > MOST_PARTS:
            raise fail(
                f"the uses of assemblies bring more than {MOST_PARTS} names and elements", hint="use fewer"
            )

    def get(self, name: Any, fail: Fail) -> Any:
        """The assembly of a name; `fail` makes errors of messages.

        Raises
        ------
        ModelError
            There is none, or it uses itself.
        """
        if not isinstance(name, str):
            message = (
                "the key 'assembly' is missing" if name is None else f"{name!r:.60} is no assembly's name"
            )
            raise fail(message, hint="name one of [assemblies]")
        found = self.find(name, fail)
        if found is None:
            hint = nearest(name[:60], self._all_names(), "assemblies")
            raise fail(f"there is no assembly '{name:.60}'", hint=hint)
        return found

    def find(self, name: str, fail: Fail) -> Any:
        """The assembly of a name, or None."""
        if name in self._announced:
            made = self.opened((id(self), name), f"'{name}'", self._announced[name], fail)
            del self._announced[name]
            return self.put(name, made)
        if name in self._made:
            return self._made[name]
        return None if self._outer is None else self._outer.find(name, fail)

    def of_file(self, path: Path, read: Callable[[], Declared], fail: Fail) -> Declared:
        """The assembly that a file says, which is read once."""
        files = self._root._files
        if path not in files:
            files[path] = self.opened(path, f"the file '{path.name}'", read, fail)
        return files[path]

    def opened(self, key: Any, shown: str, read: Callable[[], Declared], fail: Fail) -> Declared:
        """What is read, unless it is being read already."""
        waiting = self._root._open
        keys = [x for x, _ in waiting]
        if key in keys:
            through = ", ".join(x for _, x in waiting[keys.index(key) + 1 :])
            message = f"{shown} uses itself" + (f", through {through}" if through else "")
            raise fail(message, hint="an assembly is made of others, never of itself")
        if len(waiting) >= DEEPEST:
            raise fail(f"assemblies are inside each other more than {DEEPEST} deep", hint="use fewer levels")
        waiting.append((key, shown))
        try:
            return read()
        finally:
            waiting.pop()

    def _all_names(self) -> list[str]:
        return [*self.names(), *([] if self._outer is None else self._outer._all_names())]
