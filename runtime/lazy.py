"""What is imported when it is first used: names of a package, and modules that most processes do without."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_exports(
    package: str, places: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions `__getattr__` and `__dir__` of a package.

    Parameters
    ----------
    package : str
        Its `__name__`.
    places : mapping of str to str
        Name -> module that has it.
    """

    def get(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(places[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *places})

    return get, names


class Late:
    """A module of ours that is imported when something in it is first used.

    Parameters
    ----------
    module : str
    """

    def __init__(self, module: str):
        self._module, self._imported = module, None

    def __getattr__(self, name: str) -> Any:
        if self._imported is None:
            self._imported = import_module(self._module)
        return getattr(self._imported, name)
