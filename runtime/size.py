"""Whether a model is large: what full matrices serve, and what only sparse ones do."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from symgen.runtime.system import System

LARGEST_DENSE = 600  # rates and multipliers


def is_large(system: System) -> bool:
    """Whether a model has more unknowns than full matrices suit."""
    return system.nv + system.m > LARGEST_DENSE
