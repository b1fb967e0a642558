"""Whether a subsystem is at rest in a stable equilibrium: it stays there, and need not be integrated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.time_scales import motion_jacobian
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

_EPS = np.finfo(float).eps
_ROUND_OFF = 4.0 * _EPS  # of a coordinate's size: so near to the equilibrium is at it
_NEAR = 1e-10  # of a coordinate's size: farther from rest nothing need be worked out
_OF_TOLERANCE = 0.1
_FAR = 1e3
_GROWTH = 1e-7  # of the fastest rate: central differences tell eigenvalues no better
_SLOWEST = 1e-6  # of the fastest rate: slower motions might as well be free


def is_at_rest(system: System, p: np.ndarray, t: float, state: np.ndarray, atol: float = 0.0) -> bool:
    """Return whether a model that does not depend on time stays where it is.

    Either nothing moves and nothing pushes, exactly. Or the nearest point of equilibrium is so near that numbers
    hardly tell it from the state, and no motion about it grows or is free; where all motions about it die out, so near
    that tolerances do not tell it. Constrained models are not tried for either.

    Parameters
    ----------
    p : ndarray
    t : float [s]
    state : ndarray, shape (nq + nv,)
    atol : float
        Absolute tolerance of the run.
    """
    q, v = state[: system.nq], state[system.nq : system.nq + system.nv]
    positions = Positions(system)
    sizes = positions.per_rate(np.maximum(1.0, np.abs(q)), 1.0)
    if np.max(np.abs(v) / sizes, initial=0.0) > max(_NEAR, atol) or system.structure["time_dependent"]:
        return False
    rhs, rates = system.kernel("rhs"), slice(system.nq, system.nq + system.nv)
    a = rhs(t, state, p)[rates]
    if not (v.any() or a.any()):
        return True
    if system.m or not np.all(np.isfinite(a)):
        return False
    moved = np.concatenate([positions.retract(q, _NEAR * sizes), v])
    change = np.abs(rhs(t, moved, p)[rates] - a)
    if np.max(np.abs(a)) > _FAR * np.max(change):
        return False
    return _is_stable_and_near(
        system, motion_jacobian(system, p, t, q, v), np.concatenate([v, a]), sizes, atol
    )


def _is_stable_and_near(
    system: System, jacobian: np.ndarray, change: np.ndarray, sizes: np.ndarray, atol: float
) -> bool:
    """Whether the equilibrium of the linearised motion is stable, and near; `change` is the state's by time."""
    eigenvalues = np.linalg.eigvals(jacobian)
    fastest, slowest, growth = np.abs(eigenvalues).max(), np.abs(eigenvalues).min(), eigenvalues.real.max()
    if slowest <= _SLOWEST * fastest or growth > _GROWTH * fastest:
        return False
    away = np.abs(np.linalg.solve(jacobian, change))
    near = _ROUND_OFF * sizes
    if growth < -_GROWTH * fastest:
        near = np.maximum(near, _OF_TOLERANCE * atol)
    return bool(np.all(away[: system.nv] <= near) and np.all(away[system.nv :] <= near * max(1.0, fastest)))
