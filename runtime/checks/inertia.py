"""Masses and inertias at run-time parameters: the kinetic energy must not become negative."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from runtime.system import System

_ROUND_OFF = 1e-10


def refuse_negative_inertia(system: System, p: np.ndarray, t: float, state: np.ndarray) -> None:
    """Raise RuntimeModelError where the mass matrix at a state has a negative eigenvalue.

    Parameters
    ----------
    p : ndarray
        Parameters and inputs; they may differ from those that the model was checked with.
    state : ndarray, shape (nq + nv,)
    """
    mass = system.kernel("mass_matrix")(t, state, p).reshape(system.nv, system.nv)
    if not np.all(np.isfinite(mass)):
        return  # the run itself says where that comes from
    # Scaled to a unit diagonal: coordinates of different units stay comparable.
    scale = np.sqrt(np.abs(np.diag(mass)))
    scale[scale == 0.0] = 1.0
    lowest, directions = np.linalg.eigh(mass / np.outer(scale, scale))
    if lowest[0] < -_ROUND_OFF:
        name = system.rates[int(np.argmax(np.abs(directions[:, 0])))]["name"]
        raise RuntimeModelError(
            f"model {system.name!r}: the inertia that acts on coordinate {name!r} is negative at these parameters: "
            "masses and inertias must not be negative; see what --set changed"
        )
