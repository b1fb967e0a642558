"""How long a step explicit methods of fixed step may take: eigenvalues against the region of stability.

A motion x'' = -w^2 x - 2 d w x' is stepped once by each method; its step is stable while the matrix of that step has
no eigenvalue outside the unit circle. With h w = z this depends on z and d only. Hairer, Wanner, Solving ODEs II
(1996), IV.2; Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), I.1.
"""

from __future__ import annotations

import functools
import importlib

import numpy as np

from symgen.runtime.integrate.methods import METHODS, Method

_RUNGE_KUTTA = ("euler", "rk4", "dopri5", "dop853")
_VERLET = ("verlet", "verlet4", "verlet6", "verlet8", "rattle", "rattle4", "rattle6")
_LARGEST = 12.0  # no explicit method here is stable at a longer h |lambda|
_SCANNED = 1200
_ROUNDING = 1e-7  # growth per step below this is round-off of a motion that keeps its size
_UNDAMPED = 1e-5  # of |lambda|: damping below this is round-off of the linearisation
_LEAST_OF_FASTEST = 0.2  # slower motions than this part of the fastest do not limit a step of these methods

EXPLICIT_METHODS = (
    "euler",
    "semi_implicit_euler",
    "verlet",
    "rk4",
    "verlet4",
    "verlet6",
    "verlet8",
    "dopri5",
    "dop853",
)


def stable_radius(method: Method, damping: float = 0.0) -> float | None:
    """Return the largest h |lambda| that is stable; None where a method has no such limit.

    Parameters
    ----------
    damping : float
        -Re(lambda) / |lambda|: 0 undamped, 1 a decay without oscillation. Growing motions count as undamped.

    Returns
    -------
    float or None
        0 where no step is stable, as of explicit Euler on undamped motion.
    """
    if method.stiff or method.name not in (*_RUNGE_KUTTA, "semi_implicit_euler", *_VERLET):
        return None
    if method.name.startswith("rattle"):
        damping = 0.0  # its forces that depend on rates are implicit
    return _radius(method.name, float(np.clip(round(damping, 3), 0.0, 1.0)))


def stable_step(method: Method, eigenvalues: np.ndarray) -> float:
    """Return the longest stable step [s] on motions of these eigenvalues [1/s]; infinite if unlimited.

    Each motion counts along its own ray: undamped, damped, or a decay.
    """
    eigenvalues = np.atleast_1d(np.asarray(eigenvalues, dtype=complex))
    fastest = np.abs(eigenvalues).max(initial=0.0)
    if fastest <= 0.0 or stable_radius(method) is None:
        return np.inf
    fast = eigenvalues[np.abs(eigenvalues) >= _LEAST_OF_FASTEST * fastest]
    return min(stable_radius(method, damping_ratio(value)) / abs(value) for value in fast)


def unstable_rate(method: Method, step: float, eigenvalues: np.ndarray) -> float:
    """Return the rate [1/s] at which steps [s] let the motion of these eigenvalues grow that is least stable."""
    eigenvalues = np.atleast_1d(np.asarray(eigenvalues, dtype=complex))
    fastest, rate = np.abs(eigenvalues).max(initial=0.0), 0.0
    if fastest <= 0.0 or stable_radius(method) is None:
        return 0.0
    for value in eigenvalues[np.abs(eigenvalues) >= _LEAST_OF_FASTEST * fastest]:
        damping = 0.0 if method.name.startswith("rattle") else min(damping_ratio(value), 1.0)
        grown = float(_growth(method.name, np.array([step * abs(value)]), damping)[0])
        rate = max(rate, np.log(max(grown, 1.0)) / step)
    return rate


def damping_ratio(eigenvalue: complex) -> float:
    """Return -Re / |.|, and 0 where that is round-off, or the motion grows."""
    ratio = -eigenvalue.real / abs(eigenvalue) if eigenvalue else 0.0
    return float(ratio) if ratio > _UNDAMPED else 0.0


@functools.cache
def _radius(name: str, damping: float) -> float:
    z = np.linspace(0.0, _LARGEST, _SCANNED + 1)[1:]
    unstable = np.flatnonzero(_growth(name, z, damping) > 1.0 + _ROUNDING)
    if not unstable.size:
        return float(z[-1])
    high = float(z[unstable[0]])
    low = high - float(z[0])
    for _ in range(50):
        middle = 0.5 * (low + high)
        grows = _growth(name, np.array([middle]), damping)[0] > 1.0 + _ROUNDING
        low, high = (low, middle) if grows else (middle, high)
    # What grows in the shortest steps that can be told from round-off grows in all.
    return low if low > 2.0 * float(z[0]) else 0.0


def _growth(name: str, z: np.ndarray, damping: float) -> np.ndarray:
    """Return the spectral radius of one step of length z of x'' = -x - 2 d x', of x'' = -x' for d = 1."""
    if name in _RUNGE_KUTTA:
        value = -damping + 1j * np.sqrt(1.0 - damping**2)
        return np.abs(np.polynomial.polynomial.polyval(z * value, _polynomial(name)))
    step = _semi_implicit if name == "semi_implicit_euler" else functools.partial(_verlets, name)
    with np.errstate(over="ignore", invalid="ignore"):
        matrices = step(z, damping)
    growth = np.full(len(matrices), np.inf)  # of a step whose matrix has no finite value
    finite = np.isfinite(matrices).all(axis=(1, 2))
    growth[finite] = np.abs(np.linalg.eigvals(matrices[finite])).max(axis=1)
    return growth


@functools.cache
def _polynomial(name: str) -> tuple[float, ...]:
    """Coefficients of the stability function R(z) = 1 + z b (1 - z A)^-1 1, by powers of z."""
    tableau = METHODS[name].coefficients(None)
    n = tableau.n_stages
    a, powers, coefficients = tableau.a[:n, :n], np.ones(n), [1.0]
    for _ in range(n):
        coefficients.append(float(tableau.b @ powers))
        powers = a @ powers
    return tuple(coefficients)


def _force(x: np.ndarray, v: np.ndarray, damping: float) -> np.ndarray:
    # A decay without oscillation has no spring: its partner is a position that stays.
    return -v if damping == 1.0 else -x - 2.0 * damping * v


def _semi_implicit(z: np.ndarray, damping: float) -> np.ndarray:
    h = z[:, None]
    x, v = np.eye(2)
    v = v + h * _force(x, v, damping)
    return np.stack([x + h * v, v], axis=1)


def _verlet(z: np.ndarray, damping: float) -> np.ndarray:
    """Velocity Verlet; forces that depend on rates are taken at v + h a."""
    h = z[:, None]
    x, v = np.eye(2)
    a = _force(x, v, damping)
    x_new = x + h * v + 0.5 * h * h * a
    return np.stack([x_new, v + 0.5 * h * (a + _force(x_new, v + h * a, damping))], axis=1)


def _verlets(name: str, z: np.ndarray, damping: float) -> np.ndarray:
    total = np.eye(2)
    for part in _parts(name):
        total = _verlet(part * z, damping) @ total
    return total


@functools.cache
def _parts(name: str) -> tuple[float, ...]:
    order = name.removeprefix("verlet").removeprefix("rattle")
    if not order:
        return (1.0,)
    halves = importlib.import_module("symgen.runtime.integrate.symplectic.composition_coefficients").HALVES[
        int(order)
    ]
    return (*halves, *halves[-2::-1])
