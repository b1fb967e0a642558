"""By what a step of an explicit method makes an oscillation grow: its stability, from its coefficients alone.

A motion x'' = -x - 2 d x' is stepped once; the step is stable while its matrix has no eigenvalue outside the unit
circle. Hairer, Wanner, Solving ODEs II (1996), IV.2; Hairer, Lubich, Wanner, Geometric Numerical Integration (2006),
I.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.integrate.explicit.tableau import ErkTableau


def of_runge_kutta(tableau: ErkTableau, z: np.ndarray, damping: float) -> np.ndarray:
    """Return |R(z λ)|, with R(z) = 1 + z b (1 - z A)^-1 1 and λ = -d + i sqrt(1 - d²)."""
    n = tableau.n_stages
    a, powers, coefficients = tableau.a[:n, :n], np.ones(n), [1.0]
    for _ in range(n):
        coefficients.append(float(tableau.b @ powers))
        powers = a @ powers
    value = -damping + 1j * np.sqrt(1.0 - damping**2)
    return np.abs(np.polynomial.polynomial.polyval(z * value, coefficients))


def of_semi_implicit_euler(z: np.ndarray, damping: float) -> np.ndarray:
    """Return the spectral radius of a step of semi-implicit Euler."""
    h = z[:, None]
    x, v = np.eye(2)
    v = v + h * _force(x, v, damping)
    return _spectral_radius(np.stack([x + h * v, v], axis=1))


def of_verlet(parts: Sequence[float], z: np.ndarray, damping: float) -> np.ndarray:
    """Return the spectral radius of a step that is made of steps of Verlet, `parts` of it long."""
    total = np.eye(2)
    with np.errstate(over="ignore", invalid="ignore"):
        for part in parts:
            total = _verlet(part * z, damping) @ total
    return _spectral_radius(total)


def _verlet(z: np.ndarray, damping: float) -> np.ndarray:
    """Velocity Verlet; forces that depend on rates are taken at v + h a."""
    h = z[:, None]
    x, v = np.eye(2)
    a = _force(x, v, damping)
    x_new = x + h * v + 0.5 * h * h * a
    return np.stack([x_new, v + 0.5 * h * (a + _force(x_new, v + h * a, damping))], axis=1)


def _force(x: np.ndarray, v: np.ndarray, damping: float) -> np.ndarray:
    # A decay without oscillation has no spring: its partner is a position that stays.
    return -v if damping == 1.0 else -x - 2.0 * damping * v


def _spectral_radius(matrices: np.ndarray) -> np.ndarray:
    growth = np.full(len(matrices), np.inf)  # of a step whose matrix has no finite value
    finite = np.isfinite(matrices).all(axis=(1, 2))
    growth[finite] = np.abs(np.linalg.eigvals(matrices[finite])).max(axis=1)
    return growth
