"""What depends on a model and the start of a run alone: runs that are repeated ask for it again and again."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from symgen.runtime.system import System

_MOST = 32
LARGEST = 1000  # coordinates: work on larger models is not repeated for lack of anything else to do

T = TypeVar("T")


def remembered(system: System, key: Hashable, make: Callable[[], T]) -> T:
    """Return what `make` returns, or returned the last time; it is kept with the system and must not be changed.

    Nothing is kept of controllers: what they say does not stand in `p`.

    Parameters
    ----------
    key : hashable
        All that the result depends on besides the system; arrays by their bytes.
    """
    if not system.is_repeatable or system.nq > LARGEST:
        return make()
    known = vars(system).setdefault("_starts", {})
    found = known.get(key)
    if found is None:
        found = make()
        if len(known) >= _MOST:
            known.clear()
        known[key] = found
    return found
