"""Coefficients of the Radau IIA methods of order 5, 9 and 13, checked against each other when they are made."""

from __future__ import annotations

import functools
from collections import namedtuple
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from symgen.runtime.integrate.nested_basis import rows_of
from symgen.runtime.integrate.radau.tables import FROM_STAGES, MU, NODES, NU, TO_STAGES

# Tuples, and a type of their own: so compilers know how many stages there are, and unroll loops over them.
_NODES = {s: namedtuple(f"Nodes{s}", [f"c{i}" for i in range(s)]) for s in NODES}


class RadauIIA(NamedTuple):
    """A Radau IIA method with s = 2 k + 1 stages, with the transformation that uncouples its Newton systems.

    Attributes
    ----------
    a : ndarray, shape (s, s)
        Butcher coefficients; the last row is also the weights.
    c : tuple of s floats
        Nodes.
    to_stages, from_stages : ndarray, shape (s, s)
        T and its inverse, where T⁻¹ a⁻¹ T is block diagonal: μ, then [[Re ν, -Im ν], [Im ν, Re ν]] for every ν.
    mu : float
        The real eigenvalue of a⁻¹.
    nu : ndarray of complex, shape (k,)
        One of every complex pair.
    inverse_squares : ndarray, shape (k + 1,)
        1 / μ², 1 / |ν|².
    error, error_a : ndarray, shape (s,)
        Weights e of the error estimate in terms of stage increments, and eᵀa.
    amplification : float
        The largest entry of T⁻¹, which enlarges round-off.
    rows : ndarray, shape (s - 1, s)
        From the stages' increments to rows 2 to s of the dense output.
    """

    a: np.ndarray
    c: tuple[float, ...]
    to_stages: np.ndarray
    from_stages: np.ndarray
    mu: float
    nu: np.ndarray
    inverse_squares: np.ndarray
    error: np.ndarray
    error_a: np.ndarray
    amplification: float
    rows: np.ndarray


@functools.cache
def radau(n_stages: int) -> RadauIIA:
    """Return the Radau IIA method with 3, 5 or 7 stages.

    Hairer, Wanner, Solving ODEs II (1996), IV.5 and IV.8; J. Comput. Appl. Math. 111 (1999) 93. The error estimate
    compares f at the start with the slope there of the collocation polynomial, as theirs does.

    Raises
    ------
    ValueError
        Where the coefficients contradict each other.
    """
    s, c = n_stages, np.array(NODES[n_stages])
    to_stages = np.array(TO_STAGES[s]).reshape(s, s)
    from_stages = np.array(FROM_STAGES[s]).reshape(s, s)
    a = _integrals(c)
    through_zero = [_lagrange(j, np.concatenate([[0.0], c])) for j in range(1, s + 1)]
    error = np.array([-polynomial.deriv()(0.0) for polynomial in through_zero])
    error[-1] = -1.0 / s
    eigenvalues = np.array([MU[s], *NU[s]])
    method = RadauIIA(
        a, _NODES[s](*NODES[s]), to_stages, from_stages, MU[s], eigenvalues[1:].copy(),
        1.0 / np.abs(eigenvalues) ** 2, error, error @ a, float(np.abs(from_stages).max()),
        np.ascontiguousarray(rows_of(through_zero, s + 1)[2:]),
    )  # fmt: skip
    validate(method)
    return method


def _lagrange(j: int, nodes: np.ndarray) -> Polynomial:
    """The polynomial that is 1 at node j and 0 at the others."""
    factors = [Polynomial([-node, 1.0]) / (nodes[j] - node) for node in np.delete(nodes, j)]
    return np.prod([Polynomial([1.0]), *factors])


def _integrals(c: np.ndarray) -> np.ndarray:
    """The integrals from 0 to c_i of the polynomials that are 1 at c_j, by Gauss's rule, which is exact for them."""
    places, weights = np.polynomial.legendre.leggauss(len(c))
    a = np.zeros((len(c), len(c)))
    for i, end in enumerate(c):
        x = 0.5 * end * (1.0 + places)
        for j, node in enumerate(c):
            others = np.delete(c, j)
            values = np.prod((x[:, None] - others) / (node - others), axis=1)
            a[i, j] = 0.5 * end * (weights @ values)
    return a


def validate(method: RadauIIA) -> None:
    """Raise ValueError where the coefficients contradict each other."""
    s, c = len(method.c), np.array(method.c)
    if not np.allclose(c, _radau_nodes(s), rtol=0, atol=1e-13):
        raise ValueError(f"the nodes must be those of Radau IIA, not {c}")
    for k in range(1, s + 1):
        if not np.allclose(method.a @ c ** (k - 1), c**k / k, rtol=0, atol=1e-14):
            raise ValueError(f"the stages must integrate polynomials of degree {k - 1} exactly")
    blocks = np.zeros((s, s))
    blocks[0, 0] = method.mu
    for k, nu in enumerate(method.nu):
        i = 2 * k + 1
        blocks[i : i + 2, i : i + 2] = [[nu.real, -nu.imag], [nu.imag, nu.real]]
    size = np.abs(method.from_stages).max()
    if not np.allclose(method.from_stages @ method.to_stages, np.eye(s), rtol=0, atol=1e-14 * size):
        raise ValueError("the transformation and its inverse contradict each other")
    uncoupled = method.from_stages @ np.linalg.inv(method.a) @ method.to_stages
    if not np.allclose(uncoupled, blocks, rtol=0, atol=1e-12 * size):
        raise ValueError("the transformation does not uncouple the stages")
    for k in range(1, s + 1):
        if abs(method.error @ c**k + (k == 1)) > 1e-12:
            raise ValueError("the error estimate must vanish for polynomials that the stages reproduce")


def _radau_nodes(s: int) -> np.ndarray:
    """The roots of P_s - P_{s-1} in (0, 1]."""
    coefficients = np.zeros(s + 1)
    coefficients[s - 1], coefficients[s] = -1.0, 1.0
    return np.sort(0.5 * (1.0 + np.polynomial.legendre.legroots(coefficients).real))
