"""The equations of motion at one state: their value, and their derivatives by positions, rates and accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.positions import Positions
from symgen.runtime.size import LARGEST_DENSE, is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

_SINGULAR = 1e-13  # reciprocal condition of the scaled matrix below which it may be singular
_RANK_TOLERANCE = 1e-10
# Of Newton's method, where friction follows the magnitude of multipliers and the equations are not linear.
_PASSES_WITH_FRICTION = 8


class MotionEquations:
    """M a - f - Gᵀλ = 0 and G a = γ of a system at fixed parameters and time, as NumPy arrays.

    Displacements δ are what rates move: coordinates, and small rotations in body axes of quaternions.

    Parameters
    ----------
    system : System
    p : ndarray, shape (n_p,)
    t : float [s]

    Raises
    ------
    RuntimeModelError
        The model is too large for full matrices.
    """

    def __init__(self, system: System, p: np.ndarray, t: float):
        if is_large(system):
            raise RuntimeModelError(
                f"model {system.name!r} has {system.nv + system.m} rates and multipliers, too many for linear analysis "
                f"with its full matrices of up to {LARGEST_DENSE} rows: choose a smaller one"
            )
        self.system, self.p, self.t = system, np.ascontiguousarray(p, dtype=float), float(t)
        self.positions = Positions(system)

    def residual(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """Return M a - f - Gᵀλ, then G a - γ, shape (nv + m,)."""
        y = np.concatenate([q, v, a, multipliers])
        return self.finite(self.system.kernel("residual")(self.t, y, self.p), "equations of motion", q)

    def jacobian(
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, multipliers: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the derivatives of `residual` by δ, by v, and by (a, λ)."""
        s = self.system
        y = np.concatenate([q, v, a, multipliers])
        full = s.kernel("residual_jacobian")(self.t, y, self.p).reshape(s.nv + s.m, -1)
        full = self.finite(full, "derivatives of the equations of motion", q)
        by_q, by_v, by_unknowns = np.split(full, [s.nq, s.nq + s.nv], axis=1)
        return by_q @ self.kinematics(q), by_v, by_unknowns

    def kinematics(self, q: np.ndarray) -> np.ndarray:
        """Return N of qdot = N v, shape (nq, nv)."""
        s = self.system
        if not s.quaternions:
            return np.eye(s.nv)
        y = np.concatenate([q, np.zeros(s.nv)])
        return s.kernel("kinematics")(self.t, y, self.p)[: s.nq * s.nv].reshape(s.nq, s.nv)

    def turning(self, v: np.ndarray) -> np.ndarray:
        """Return W of δ' = δv + W δ: small rotations in body axes turn along with the body, δ' = δω - ω × δ."""
        nv = self.system.nv
        matrix = np.zeros((nv, nv))
        for _, j in self.positions.quaternions:
            x, y, z = v[j : j + 3]
            matrix[j : j + 3, j : j + 3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return matrix

    def accelerations_and_multipliers(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a, shape (nv,), and λ, shape (m,), of the motion from a state."""
        nv, unknowns = self.system.nv, np.zeros(self.system.nv + self.system.m)
        follows = any(switch.get("normal") for switch in self.system.switches)
        for _ in range(_PASSES_WITH_FRICTION if follows else 1):
            given = q, v, unknowns[:nv], unknowns[nv:]
            unknowns = unknowns + self.solve(self.jacobian(*given)[2], -self.residual(*given))
        return unknowns[:nv], unknowns[nv:]

    def solve(self, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Solve with the derivative by (a, λ); of dependent constraints the multipliers of least norm are taken.

        Raises
        ------
        RuntimeModelError
            The accelerations are not determined.
        """
        nv = self.system.nv
        diagonal = np.sqrt(np.abs(np.diag(matrix)[:nv]))
        diagonal[diagonal == 0.0] = diagonal[diagonal > 0.0].min(initial=1.0)
        rows = np.linalg.norm(matrix[nv:, :nv] / diagonal, axis=1)
        scale = 1.0 / np.concatenate([diagonal, np.where(rows > 0.0, rows, 1.0)])
        scaled = matrix * scale[:, None] * scale
        right = (right.T * scale).T
        if _regular(scaled):
            x = np.linalg.solve(scaled, right)
            x = x + np.linalg.solve(scaled, right - scaled @ x)
            return (x.T * scale).T
        left, values, transposed = np.linalg.svd(scaled)
        kept = values > _RANK_TOLERANCE * values[0]
        if np.abs(transposed[~kept, :nv]).max(initial=0.0) > np.sqrt(_RANK_TOLERANCE):
            raise RuntimeModelError(
                f"the motion of model {self.system.name!r} is not determined at this state: some coordinates have "
                "neither mass nor a constraint that moves them"
            )
        x = transposed[kept].T @ ((left[:, kept].T @ right).T / values[kept]).T
        return (x.T * scale).T

    def finite(self, values: np.ndarray, what: str, q: np.ndarray) -> np.ndarray:
        """Return values, or say of what function and where they are not finite."""
        if np.isfinite(values).all():
            return values
        names = [record["name"] for record in self.system.coordinates]
        place = ", ".join(f"{name} = {x:.6g}" for name, x in zip(names[:6], q))
        raise RuntimeModelError(
            f"the {what} of model {self.system.name!r} are not finite at {place}{', …' * (len(names) > 6)}: choose "
            "another start"
        )


def _regular(matrix: np.ndarray) -> bool:
    """Whether a matrix is regular, by an estimate of its condition from its factors."""
    from scipy.linalg.lapack import dgecon, dgetrf

    factors, _, zero_pivot = dgetrf(matrix)
    return not zero_pivot and dgecon(factors, np.linalg.norm(matrix, 1))[0] > _SINGULAR
