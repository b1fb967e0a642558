"""Index tables: places in arrays that a loop runs through."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise


class Tables:
    """The module's index tables, for places in loops that are no affine function of k."""

    def __init__(self) -> None:
        self.names: dict[tuple[int, ...], str] = {}

    def index(self, places: Sequence[int]) -> str:
        """The text of an index that runs through `places`."""
        first, step = places[0], places[1] - places[0] if len(places) > 1 else 0
        if step < 0 or any(b - a != step for a, b in pairwise(places)):
            return f"{self.name(places)}[k]"
        if not step:
            return str(first)
        multiple = "k" if step == 1 else f"{step}*k"
        return f"{first} + {multiple}" if first else multiple

    def name(self, entries: Sequence[int]) -> str:
        """The name of the table with these entries."""
        return self.names.setdefault(tuple(entries), f"I{len(self.names)}")
