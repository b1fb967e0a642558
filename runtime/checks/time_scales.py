"""How fast a model moves at a state: eigenvalues of its linearised motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from runtime.batches import accelerations_and_multipliers

if TYPE_CHECKING:
    from runtime.system import System

_DIFFERENCE = 1e-6
_OVERDAMPED = 0.5  # an eigenvalue with -Re above this part of its magnitude decays more than it oscillates


@dataclass(frozen=True)
class TimeScales:
    """Rates of the linearised motion at one state [1/s].

    Attributes
    ----------
    fastest : float
        Largest magnitude of an eigenvalue.
    decay : float
        Fastest decay of a motion that decays more than it oscillates.
    motion : float
        Fastest of the other motions, and of the change of the state itself.
    damping : float
        Decay of the eigenvalue of largest magnitude.
    """

    fastest: float
    decay: float
    motion: float
    damping: float

    @property
    def fastest_period(self) -> float:
        """Period of the fastest motion [s]; infinite where nothing moves."""
        return 2.0 * np.pi / self.fastest if self.fastest > 0.0 else np.inf


def time_scales(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> TimeScales:
    """Return the time scales at a state; the Jacobian is taken by central differences."""
    eigenvalues = np.linalg.eigvals(motion_jacobian(system, p, t, q, v))
    magnitudes = np.abs(eigenvalues)
    overdamped = -eigenvalues.real > _OVERDAMPED * magnitudes
    motion = float(magnitudes[~overdamped].max(initial=0.0))
    # Swings and turns need steps even where the linearised motion is slow: one radian or one size of q.
    motion = max(motion, float(np.max(np.abs(v) / np.maximum(1.0, np.abs(q[: len(v)])), initial=0.0)))
    return TimeScales(
        fastest=float(magnitudes.max(initial=0.0)),
        decay=float(-eigenvalues.real[overdamped].min(initial=0.0)),
        motion=motion,
        damping=float(-eigenvalues.real[np.argmax(magnitudes)]) if len(magnitudes) else 0.0,
    )


def motion_jacobian(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the Jacobian of (dq/dt, dv/dt), shape (nq + nv, nq + nv); zeros where it is not finite."""
    y = np.concatenate([q, v])
    n = len(y)
    steps = _DIFFERENCE * np.maximum(1.0, np.abs(y))
    states = np.vstack([y + np.diag(steps), y - np.diag(steps)])
    f = derivatives(system, p, np.full(2 * n, t), states)
    with np.errstate(invalid="ignore", over="ignore"):
        jacobian = ((f[:n] - f[n:]) / (2.0 * steps[:, None])).T
    return np.where(np.isfinite(jacobian), jacobian, 0.0)


def derivatives(system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return (dq/dt, dv/dt) at many states, shape (n, nq + nv)."""
    accelerations, _ = accelerations_and_multipliers(system, p, times, states)
    if system.nq == system.nv:
        return np.hstack([states[:, system.nq :], accelerations])
    from runtime.batches import evaluate

    return evaluate(system, "rhs", p, times, states)[:, : system.nq + system.nv]
