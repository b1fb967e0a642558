"""Coefficients of the Radau IIA method of order 5, checked against each other when they are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class RadauIIA(NamedTuple):
    """The three-stage Radau IIA method, with the transformation that uncouples its Newton systems.

    Attributes
    ----------
    a, c : ndarray, shapes (3, 3), (3,)
        Butcher coefficients; the last row of `a` is also the weights.
    to_stages, from_stages : ndarray, shape (3, 3)
        T and its inverse, where T⁻¹ a⁻¹ T = [[μ, 0, 0], [0, α, β], [0, -β, α]].
    mu : float
        The real eigenvalue of a⁻¹.
    nu_real, nu_imag : float
        α and -β, one of the complex pair.
    error, error_a : ndarray, shape (3,)
        Weights e of the error estimate in terms of stage increments, and eᵀa.
    """

    a: np.ndarray
    c: np.ndarray
    to_stages: np.ndarray
    from_stages: np.ndarray
    mu: float
    nu_real: float
    nu_imag: float
    error: np.ndarray
    error_a: np.ndarray


def radau5() -> RadauIIA:
    """Return the Radau IIA method of order 5.

    Hairer, Wanner, Solving ODEs II (1996), table IV.5.6 and section IV.8; T and its inverse from radau5.f.

    Raises
    ------
    ValueError
        Where the coefficients contradict each other.
    """
    r = np.sqrt(6.0)
    a = np.array(
        [
            [(88 - 7 * r) / 360, (296 - 169 * r) / 1800, (-2 + 3 * r) / 225],
            [(296 + 169 * r) / 1800, (88 + 7 * r) / 360, (-2 - 3 * r) / 225],
            [(16 - r) / 36, (16 + r) / 36, 1 / 9],
        ]
    )
    to_stages = np.array(
        [
            [0.09443876248897524, -0.14125529502095421, 0.03002919410514742],
            [0.25021312296533332, 0.20412935229379994, -0.38294211275726192],
            [1.0, 1.0, 0.0],
        ]
    )
    from_stages = np.array(
        [
            [4.17871859155190428, 0.32768282076106237, 0.52337644549944951],
            [-4.17871859155190428, -0.32768282076106237, 0.47662355450055044],
            [0.50287263494578682, -2.57192694985560522, 0.59603920482822492],
        ]
    )
    mu = 3 + 3 ** (2 / 3) - 3 ** (1 / 3)
    nu_real = 3 + 0.5 * (3 ** (1 / 3) - 3 ** (2 / 3))
    nu_imag = -0.5 * (3 ** (5 / 6) + 3 ** (7 / 6))
    error = np.array([-13 - 7 * r, -13 + 7 * r, -1.0]) / 3
    method = RadauIIA(a, a.sum(axis=1), to_stages, from_stages, mu, nu_real, nu_imag, error, error @ a)
    validate(method)
    return method


def validate(method: RadauIIA) -> None:
    """Raise ValueError where the coefficients contradict each other."""
    r = np.sqrt(6.0)
    if not np.allclose(method.c, [(4 - r) / 10, (4 + r) / 10, 1.0], rtol=0, atol=1e-14):
        raise ValueError(f"the nodes must be those of Radau IIA, not {method.c}")
    for k in range(1, 4):
        if not np.allclose(method.a @ method.c ** (k - 1), method.c**k / k, rtol=0, atol=1e-14):
            raise ValueError(f"the stages must integrate polynomials of degree {k - 1} exactly")
    blocks = np.zeros((3, 3))
    blocks[0, 0] = method.mu
    blocks[1:, 1:] = [[method.nu_real, -method.nu_imag], [method.nu_imag, method.nu_real]]
    if not np.allclose(method.from_stages @ method.to_stages, np.eye(3), rtol=0, atol=1e-14):
        raise ValueError("the transformation and its inverse contradict each other")
    if not np.allclose(
        method.from_stages @ np.linalg.inv(method.a) @ method.to_stages, blocks, rtol=0, atol=1e-13
    ):
        raise ValueError("the transformation does not uncouple the stages")
    if abs(method.error @ method.c + 1.0) > 1e-14:
        raise ValueError("the error estimate must vanish where the solution is a straight line")
