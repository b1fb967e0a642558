"""Coefficients of the numerical differentiation formulas, the backward differentiation formulas of `bdf`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from symgen.runtime.integrate.nested_basis import rows_of

MAX_ORDER = 5


class Formulas(NamedTuple):
    """Numerical differentiation formulas of orders 1 to 5; index k of an array belongs to order k, 0 is not used.

    With backward differences ∇ⁱ and y_p = Σ ∇ⁱ y_n, i = 0..k, a step solves for d = y_{n+1} - y_p

        α_k d + Σ γ_i ∇ⁱ y_n = h f(t_{n+1}, y_p + d),   i = 1..k.

    Attributes
    ----------
    gamma : ndarray, shape (6,)
        γ_k = 1 + 1/2 + … + 1/k.
    alpha : ndarray, shape (6,)
        (1 - κ_k) γ_k.
    error : ndarray, shape (6,)
        The local error is about error_k d, as d is about ∇ᵏ⁺¹ y_{n+1}.
    rows : ndarray, shape (6, 6)
        From backward differences at the end of a step to the rows of its dense output.
    """

    gamma: np.ndarray
    alpha: np.ndarray
    error: np.ndarray
    rows: np.ndarray


def ndf() -> Formulas:
    """Return the numerical differentiation formulas.

    Shampine, Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1, section 2.1 and table 1, with the
    κ of their ode15s: 0 at order 5, which is the backward differentiation formula itself.
    """
    kappa = np.array([0.0, -0.1850, -1.0 / 9.0, -0.0823, -0.0415, 0.0])
    gamma = np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, MAX_ORDER + 1))])
    error = kappa * gamma + 1.0 / np.arange(1, MAX_ORDER + 2)
    return Formulas(gamma, (1.0 - kappa) * gamma, error, rows_of(newton_basis(), MAX_ORDER + 1))


def newton_basis() -> list[Polynomial]:
    """Return the polynomials s (s+1) … (s+j-1) / j!, s = θ - 1: Newton's, backwards from θ = 1."""
    basis = [Polynomial([1.0])]
    for j in range(MAX_ORDER):
        basis.append(basis[-1] * Polynomial([j - 1.0, 1.0]) / (j + 1.0))
    return basis
