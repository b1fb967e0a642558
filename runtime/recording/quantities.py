"""What a recording shows besides the states, for many frames at once; and what is known of a run before it begins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, constraint_residuals, evaluate
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.contact.forms import Forms
    from symgen.runtime.system import System

forms = Late("symgen.runtime.contact.forms")


@dataclass(frozen=True)
class Settings:
    """What is known of a run before it begins; see `RunRecorder`."""

    title: str
    method: str
    constraints: str
    rtol: float
    atol: float
    module_text: str
    model_text: str
    options: dict[str, Any]
    mesh_folder: Path | None


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

    def multipliers(self, t: np.ndarray, y: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return the multipliers, shape (n, m); `settings` of stops and frictions have shape (n, …)."""
        if not self.system.m:
            return np.zeros((len(t), 0))
        if not settings.shape[1]:
            return self.accelerations_and_multipliers(t, y)[1]
        return self.forms(settings).evaluate(self.system, self.p, t, y)[1]

    def forms(self, settings: np.ndarray) -> Forms:
        """Return which form of the model holds at each frame, by the settings of stops and frictions."""
        distinct, index = np.unique(settings, axis=0, return_inverse=True)
        return forms.Forms(distinct, index.reshape(-1))

    def in_form(self, settings: np.ndarray) -> Quantities:
        """Return the functions of the form of the model that applies with these settings of stops and frictions."""
        if not len(settings):
            return self
        p = self.p.copy()
        p[self.system.settings_of_switches] = settings
        return Quantities(forms.form_of(self.system, settings), p)

    def accelerations_and_multipliers(self, t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return vdot, shape (n, nv), and the multipliers, shape (n, m)."""
        return accelerations_and_multipliers(self.system, self.p, t, y)
