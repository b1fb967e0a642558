"""How fast a model moves at a state: eigenvalues of its linearised motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.checks.extreme_rates import extreme_eigenvalues
from symgen.runtime.positions import Positions
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

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
    eigenvalues : ndarray of complex
        All of them, of large models the extreme ones; constraints add zeros.
    turning : float
        Fastest rate of an angle or of a body with a quaternion.
    """

    fastest: float
    decay: float
    motion: float
    damping: float
    eigenvalues: np.ndarray = field(
        default_factory=lambda: np.zeros(0, dtype=complex), repr=False, compare=False
    )
    turning: float = 0.0

    @property
    def fastest_period(self) -> float:
        """Period of the fastest motion [s]; infinite where nothing moves."""
        return 2.0 * np.pi / self.fastest if self.fastest > 0.0 else np.inf


def change_rate(system: System, q: np.ndarray, v: np.ndarray) -> float:
    """Return how fast a state changes [1/s]: the fastest of its rates, in radians or sizes of its coordinate."""
    sizes = Positions(system).per_rate(np.maximum(1.0, np.abs(q)), 1.0)
    return float(np.max(np.abs(v) / sizes, initial=0.0))


def time_scales(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> TimeScales:
    """Return the time scales at a state; the Jacobian is taken by central differences.

    Of large models only the extreme eigenvalues are looked for.
    """
    if is_large(system):
        eigenvalues = extreme_eigenvalues(system, p, t, q, v)
    else:
        eigenvalues = _eigenvalues(system, motion_jacobian(system, p, t, q, v))
    magnitudes = np.abs(eigenvalues)
    overdamped = -eigenvalues.real > _OVERDAMPED * magnitudes
    motion = float(magnitudes[~overdamped].max(initial=0.0))
    # Swings and turns need steps even where the linearised motion is slow.
    motion = max(motion, change_rate(system, q, v))
    return TimeScales(
        fastest=float(magnitudes.max(initial=0.0)),
        decay=float(-eigenvalues.real[overdamped].min(initial=0.0)),
        motion=motion,
        damping=float(-eigenvalues.real[np.argmax(magnitudes)]) if len(magnitudes) else 0.0,
        eigenvalues=eigenvalues,
        turning=_turning(system, v),
    )


def _turning(system: System, v: np.ndarray) -> float:
    positions = Positions(system)
    angles = [
        j for i, j in zip(positions.plain_q, positions.plain_v) if system.coordinates[i].get("unit") == "rad"
    ]
    spins = [np.linalg.norm(v[j : j + 3]) for _, j in positions.quaternions]
    return float(max([*np.abs(v[angles]), *spins], default=0.0))


def _eigenvalues(system: System, jacobian: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of the linearised motion, each subsystem's by themselves: cost is cubic in their size."""
    nv = system.nv
    kinds = [np.array(kind["rates"], dtype=int) for kind in system.subsystems] or [np.arange(nv)[None]]
    places = [np.hstack([rates, nv + rates]) for rates in kinds]
    blocks = [jacobian[rows[:, :, None], rows[:, None, :]] for rows in places]
    return np.concatenate([np.linalg.eigvals(block).ravel() for block in blocks])


def motion_jacobian(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the Jacobian of the motion of positions and rates, shape (2 nv, 2 nv); zeros where it is not finite.

    Positions are what rates move: coordinates, and small rotations in body axes of quaternions. Those, turned
    along with the body, follow δ' = δω - ω × δ.
    """
    positions, nv = Positions(system), system.nv
    sizes = [positions.per_rate(np.maximum(1.0, np.abs(q)), 1.0), np.maximum(1.0, np.abs(v))]
    steps = _DIFFERENCE * np.concatenate(sizes)
    changes = np.vstack([np.diag(steps), -np.diag(steps)])
    states = np.array([[*positions.retract(q, change[:nv]), *(v + change[nv:])] for change in changes])
    a, _ = accelerations_and_multipliers(system, p, np.full(4 * nv, t), states)
    jacobian = np.zeros((2 * nv, 2 * nv))
    jacobian[:nv, nv:] = np.eye(nv)
    for _, j in positions.quaternions:
        x, y, z = v[j : j + 3]
        jacobian[j : j + 3, j : j + 3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    with np.errstate(invalid="ignore", over="ignore"):
        jacobian[nv:] = ((a[: 2 * nv] - a[2 * nv :]) / (2.0 * steps[:, None])).T
    return np.where(np.isfinite(jacobian), jacobian, 0.0)
