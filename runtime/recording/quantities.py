"""What a recording shows besides the states, for many frames at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.batches import accelerations_and_multipliers, constraint_residuals, evaluate

if TYPE_CHECKING:
    from runtime.system import System


class Quantities:
    """A system's functions over batches of states (q, v, w), shape (n, ny), at fixed parameters.

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters, then inputs.
    """

    def __init__(self, system: System, p: np.ndarray):
        self.system = system
        self.p = np.ascontiguousarray(p, dtype=float)

    def evaluate(self, function: str, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return a function's results, shape (n, width); no columns for one that the model does not have."""
        return evaluate(self.system, function, self.p, t, y)

    def balance(self, energies: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return T + V − w, shape (n,): constant between resets."""
        work = y[:, self.system.nq + self.system.nv] if self.system.nw else 0.0
        return energies[:, 0] + energies[:, 1] - work

    def shape_sizes(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the bodies' sizes at one state [m]."""
        return self.evaluate("shapes", np.array([t]), y[None])[0]

    def residuals(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the largest position and velocity residual of the constraints, shape (n, 2)."""
        return np.column_stack(constraint_residuals(self.system, self.p, t, y))

    def accelerations_and_multipliers(self, t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return vdot, shape (n, nv), and the multipliers, shape (n, m)."""
        return accelerations_and_multipliers(self.system, self.p, t, y)
