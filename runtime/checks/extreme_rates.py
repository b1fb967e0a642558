"""The fastest motions of a large model: extreme eigenvalues of its linearised motion, without a matrix.

Arnoldi's method (ARPACK: Lehoucq, Sorensen, Yang, 1998) needs products of the Jacobian with vectors only, which are
differences of accelerations.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

_DIFFERENCE = 1e-6  # relative to the size of a coordinate or rate
_N_EIGENVALUES, _N_VECTORS = 4, 24
_MOST_RESTARTS = 40
_ACCURACY = 1e-2
# Largest magnitude, fastest decay, fastest oscillation.
_ENDS = ("LM", "SR", "LI")


def extreme_eigenvalues(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of largest magnitude, smallest real part and largest imaginary part [1/s].

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    q, v : ndarray, shapes (nq,), (nv,)

    Returns
    -------
    ndarray of complex
        A few of each, to about a percent; fewer where the iteration does not find all.
    """
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

    motion = _Motion(system, p, t, q, v)
    start = np.random.default_rng(11).normal(size=2 * system.nv)
    motion.balance(start)
    operator = LinearOperator((2 * system.nv, 2 * system.nv), matvec=motion.derivative, dtype=float)
    found = []
    for which in _ENDS:
        try:
            values = eigs(
                operator, _N_EIGENVALUES, which=which, v0=start, ncv=_N_VECTORS, maxiter=_MOST_RESTARTS, tol=_ACCURACY,
                return_eigenvectors=False,
            )  # fmt: skip
        except ArpackNoConvergence as stopped:
            values = stopped.eigenvalues
        found.append(values)
    values = np.concatenate(found)
    return values[np.isfinite(values)]


class _Motion:
    """The derivative of (positions, rates) by themselves at a state, times vectors; see `motion_jacobian`."""

    def __init__(self, system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray):
        self._positions, self._kernel = Positions(system), system.kernel("rhs")
        self._system, self._p, self._t, self._q, self._v = system, p, t, q, v
        sizes = self._positions.per_rate(np.maximum(1.0, np.abs(q)), 1.0)
        self._sizes = np.concatenate([sizes, np.maximum(1.0, np.abs(v))])
        self._rate = 1.0  # by which rates are divided beside positions, so that both count alike

    def balance(self, vector: np.ndarray) -> None:
        """Set the unit of rates by powers of the Jacobian: its largest eigenvalue, roughly."""
        nv = self._system.nv
        for _ in range(4):
            image = self.derivative(vector)
            size = np.linalg.norm(image[nv:]) / max(np.linalg.norm(vector), np.finfo(float).tiny)
            if np.isfinite(size) and size > 0.0:
                self._rate = max(self._rate, np.sqrt(size * self._rate))
            vector = image / max(np.linalg.norm(image), np.finfo(float).tiny)

    def derivative(self, vector: np.ndarray) -> np.ndarray:
        """Return the Jacobian times a vector, of which rates are in units of `_rate`."""
        nv = self._system.nv
        by_position, by_rate = vector[:nv], self._rate * vector[nv:]
        change = np.concatenate([by_position, by_rate])
        step = _DIFFERENCE / max(np.max(np.abs(change) / self._sizes), np.finfo(float).tiny)
        ahead, behind = (self._accelerations(s * step * change) for s in (1.0, -1.0))
        rates = (ahead - behind) / (2.0 * step)
        turned = by_rate.copy()
        for _, j in self._positions.quaternions:  # δ' = δω - ω × δ
            turned[j : j + 3] -= np.cross(self._v[j : j + 3], by_position[j : j + 3])
        image = np.concatenate([turned, rates / self._rate])
        return np.where(np.isfinite(image), image, 0.0)

    def _accelerations(self, change: np.ndarray) -> np.ndarray:
        nq, nv = self._system.nq, self._system.nv
        state = np.concatenate([self._positions.retract(self._q, change[:nv]), self._v + change[nv:]])
        return self._kernel(self._t, state, self._p)[nq : nq + nv]
