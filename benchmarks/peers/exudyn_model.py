"""What a scene is as a system of Exudyn's."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

sys.exudynFast = True  # its build without range checks
import exudyn  # noqa: E402

State = tuple[np.ndarray, np.ndarray]
CONTAINER = exudyn.SystemContainer()  # outlives its systems


@dataclass(frozen=True)
class Model:
    """An assembled system.

    Attributes
    ----------
    mbs : exudyn.MainSystem
    state : callable
        (coordinates, velocities) of Exudyn -> (q, v) of the scene.
    constrained : bool
        Whether there are algebraic equations, which its explicit methods refuse.
    redundant : bool
        Whether constraints depend on each other, so that only a solver that passes over zero pivots will do.
    """

    mbs: exudyn.MainSystem
    state: Callable[[np.ndarray, np.ndarray], State]
    constrained: bool = False
    redundant: bool = False
