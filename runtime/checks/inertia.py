"""Masses and inertias at run-time parameters: no negative kinetic energy, and no freedom without inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from runtime.system import System

_ROUND_OFF = 1e-10
_NONE = 1e-14  # smallest eigenvalue of M, scaled to a unit diagonal, that counts as inertia
_LARGEST_WHOLE = 300  # rates


def refuse_negative_inertia(system: System, p: np.ndarray, t: float, state: np.ndarray) -> None:
    """Raise RuntimeModelError where the mass matrix at a state is negative, or zero for a motion that is free.

    Parameters
    ----------
    p : ndarray
        Parameters and inputs; they may differ from those that the model was checked with.
    state : ndarray, shape (nq + nv,)
    """
    mass = system.kernel("mass_matrix")(t, state, p).reshape(system.nv, system.nv)
    for rates in _coupled(mass) if system.nv > _LARGEST_WHOLE else [np.arange(system.nv)]:
        still = _check(system, mass[np.ix_(rates, rates)], rates)
        if still.shape[1]:
            _refuse_free_motion(system, p, t, state, rates, still)


def _coupled(mass: np.ndarray) -> list[np.ndarray]:
    """Rates that the mass matrix couples, together: eigenvalues of small blocks cost little."""
    if np.count_nonzero(mass - np.diag(np.diag(mass))) == 0:
        return list(np.arange(len(mass))[:, None])  # SciPy takes longer to import than many runs take
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    _, labels = connected_components(csr_matrix(mass), directed=False)
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)


def _refuse_free_motion(
    system: System, p: np.ndarray, t: float, state: np.ndarray, rates: np.ndarray, still: np.ndarray
) -> None:
    """Refuse motions without inertia (columns of `still`) that no constraint determines."""
    jacobian = np.zeros((0, len(rates)))
    if system.m:
        whole = system.kernel("constraint_jacobian")(t, state, p).reshape(system.m, system.nv)
        jacobian = whole[:, rates]
    if not np.isfinite(jacobian).all():
        return
    held = jacobian @ still
    _, values, directions = np.linalg.svd(np.vstack([held, np.zeros((still.shape[1], still.shape[1]))]))
    if values[-1] > _ROUND_OFF * np.abs(jacobian).max(initial=0.0):
        return
    name = system.rates[rates[int(np.argmax(np.abs(still @ directions[-1])))]]["name"]
    raise RuntimeModelError(
        f"model {system.name!r}: nothing determines how coordinate {name!r} accelerates at these parameters: it has no "
        "inertia, and no constraint ties it to what has; give it a mass, or a constraint"
    )


def _check(system: System, mass: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Refuse negative inertia; returns the directions without any as columns."""
    if not np.all(np.isfinite(mass)):
        return np.zeros((len(mass), 0))  # the run itself says where that comes from
    # Scaled to a unit diagonal: coordinates of different units stay comparable.
    scale = np.sqrt(np.abs(np.diag(mass)))
    scale[scale == 0.0] = 1.0
    lowest, directions = np.linalg.eigh(mass / np.outer(scale, scale))
    if lowest[0] < -_ROUND_OFF:
        name = system.rates[rates[int(np.argmax(np.abs(directions[:, 0])))]]["name"]
        raise RuntimeModelError(
            f"model {system.name!r}: the inertia that acts on coordinate {name!r} is negative at these parameters: "
            "masses and inertias must not be negative; see what --set changed"
        )
    return directions[:, lowest <= _NONE] / scale[:, None]
