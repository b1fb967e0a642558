"""Coefficients of the Gauss collocation methods, computed in decimal arithmetic and rounded once."""

from __future__ import annotations

import decimal
import functools
import math
from decimal import Decimal
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from symgen.runtime.integrate.nested_basis import N_ROWS, fit_rows, rows_of

_DIGITS = 50
# Where a polynomial of too high a degree for dense output is interpolated, besides both ends and the slopes there.
_PLACES = (0.2, 0.4, 0.6, 0.8)


class Gauss(NamedTuple):
    """The Gauss collocation method with s stages, of order 2 s.

    Attributes
    ----------
    b, c : ndarray, shape (s,)
    mu : ndarray, shape (s, s)
        a_ij / b_j in row j, column i. mu_ij + mu_ji = 1 holds exactly, so the method is symplectic whatever rounding
        did to it and to b (Antoñana, Makazaga, Murua, Numer. Algorithms 76 (2017) 861).
    barycentric : ndarray, shape (s,)
        1 / Π (c_j - c_k) over k other than j: weights of the interpolation at the nodes.
    eigenvalues : ndarray of complex, shape (k,)
        Those of a that are real or above the real axis.
    to_stages, from_stages : ndarray of complex, shapes (s, k), (k, s)
        x = Re(to_stages diag(λ) from_stages) x' is a times x'; columns that stand for a pair are doubled.
    dense_v, dense_q : ndarray, shape (6, s)
        From the accelerations of the stages, times h and h², to rows 2 to 7 of the dense output of v and of q.
    """

    b: np.ndarray
    c: np.ndarray
    mu: np.ndarray
    barycentric: np.ndarray
    eigenvalues: np.ndarray
    to_stages: np.ndarray
    from_stages: np.ndarray
    dense_v: np.ndarray
    dense_q: np.ndarray


@functools.cache
def gauss(n_stages: int) -> Gauss:
    """Return the Gauss method with `n_stages` stages, 2 to 8.

    Hairer, Nørsett, Wanner, Solving ODEs I (1993), II.7. With shifted Legendre polynomials P_n, a_ij is b_j times
    Σ_n P_n(c_j) (P_{n+1}(c_i) - P_{n-1}(c_i)) over n < s; every sum is of terms of like size.
    """
    with decimal.localcontext() as context:
        context.prec = _DIGITS
        nodes = [_root(n_stages, Decimal(float(x))) for x in np.polynomial.legendre.leggauss(n_stages)[0]]
        table = [_legendre(n_stages, x) for x in nodes]
        slopes = [n_stages * p[n_stages - 1] / (1 - x * x) for x, p in zip(nodes, table, strict=True)]
        b = [1 / ((1 - x * x) * slope * slope) for x, slope in zip(nodes, slopes, strict=True)]
        mu = [[_mu(n_stages, table[i], table[j], nodes[i]) for j in range(n_stages)] for i in range(n_stages)]
        c = [(1 + x) / 2 for x in nodes]
        barycentric = [1 / math.prod(x - other for other in c if other != x) for x in c]
        a = np.array([[float(mu[i][j] * b[j]) for j in range(n_stages)] for i in range(n_stages)])
    exact = np.ascontiguousarray(_symplectic(np.array(mu, dtype=float)).T)
    c, b = np.array(c, dtype=float), np.array(b, dtype=float)
    return Gauss(b, c, exact, np.array(barycentric, dtype=float), *_uncouple(a), *_dense(c))


def _legendre(n: int, x: Decimal) -> list[Decimal]:
    """P_0(x) to P_n(x)."""
    values = [Decimal(1), x]
    for k in range(1, n):
        values.append(((2 * k + 1) * x * values[k] - k * values[k - 1]) / (k + 1))
    return values


def _root(n: int, x: Decimal) -> Decimal:
    """Improve a root of P_n by Newton's method."""
    for _ in range(3):
        p = _legendre(n, x)
        slope = n * (x * p[n] - p[n - 1]) / (x * x - 1)
        x -= p[n] / slope
    return x


def _mu(n: int, at_i: list[Decimal], at_j: list[Decimal], x_i: Decimal) -> Decimal:
    total = 1 + x_i
    for k in range(1, n):
        above = at_i[k + 1] if k + 1 < n else Decimal(0)  # P_n vanishes at the nodes
        total += at_j[k] * (above - at_i[k - 1])
    return total / 2


def _symplectic(mu: np.ndarray) -> np.ndarray:
    """Round so that mu_ij + mu_ji = 1 exactly: 1 - x is exact for x from 1/2 to 2."""
    for i in range(len(mu)):
        mu[i, i] = 0.5
        for j in range(i):
            large, small = ((i, j), (j, i)) if mu[i, j] > mu[j, i] else ((j, i), (i, j))
            if not 0.5 <= mu[large] <= 2.0:
                raise ValueError(f"mu is {mu[large]}, out of the range in which 1 - mu is exact")
            mu[small] = 1.0 - mu[large]
    return mu


def _uncouple(a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    eigenvalues, vectors = np.linalg.eig(a)
    inverse = np.linalg.inv(vectors)
    upper = np.flatnonzero(eigenvalues.imag > -1e-12)
    upper = upper[np.argsort(-eigenvalues[upper].imag, kind="stable")]
    twice = np.where(eigenvalues[upper].imag > 1e-12, 2.0, 1.0)
    to_stages = np.ascontiguousarray((vectors[:, upper] * twice).astype(complex))
    return eigenvalues[upper].astype(complex), to_stages, np.ascontiguousarray(inverse[upper].astype(complex))


def _dense(c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    by_v, by_q = [], []
    for j, node in enumerate(c):
        factors = [Polynomial([-other, 1.0]) / (node - other) for other in np.delete(c, j)]
        once = np.prod([Polynomial([1.0]), *factors]).integ()
        twice = once.integ()
        by_v.append(once - Polynomial([0.0, once(1.0)]))
        by_q.append(twice - Polynomial([0.0, twice(1.0)]))
    return _rows(by_v), _rows(by_q)


def _rows(bumps: list[Polynomial]) -> np.ndarray:
    """Rows 2 to 7 of polynomials that vanish at 0 and 1, or of others of degree 7 close to them."""
    if bumps[0].degree() < N_ROWS:
        return np.ascontiguousarray(rows_of(bumps)[2:])
    data = [[u.deriv()(0.0), u.deriv()(1.0), *(u(x) for x in _PLACES)] for u in bumps]
    return np.ascontiguousarray(fit_rows([(1, 0.0), (1, 1.0), *((0, x) for x in _PLACES)]) @ np.array(data).T)
