"""How long the arrays of a generated function are: known before anything of it is read."""

from __future__ import annotations

from typing import NamedTuple


class Lengths(NamedTuple):
    """How many values a function may read and write: an index beyond them is refused, not compiled."""

    y: int
    p: int
    out: int
