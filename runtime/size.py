"""What is large: models for full matrices, series for a machine's memory."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from symgen.runtime.system import System

LARGEST_DENSE = 600  # rates and multipliers
_OF_MEMORY = 0.5  # of a machine's: for series that are kept in it


def is_large(system: System) -> bool:
    """Whether a model has more unknowns than full matrices suit."""
    return system.nv + system.m > LARGEST_DENSE


def more_than_memory(n_bytes: float) -> str:
    """Return how much series need and this machine has, where it cannot hold them; else nothing.

    Systems end who fills too much, or come to a standstill before.
    """
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not on every system
        return ""
    if n_bytes <= _OF_MEMORY * there:
        return ""
    return f"need {n_bytes / 2**30:.3g} GiB, and this machine has {there / 2**30:.3g}"


def more_than_disk(n_bytes: float, folder: Path) -> str:
    """Return how much a file needs and there is left where it is to lie, if that is less; else nothing."""
    try:
        there = os.statvfs(folder)
    except (AttributeError, OSError):  # not on every system
        return ""
    left = there.f_bavail * there.f_frsize
    return f"need {n_bytes / 2**30:.3g} GiB, and {left / 2**30:.3g} are left there" if n_bytes > left else ""
