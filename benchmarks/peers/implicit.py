"""A scene with constraints as F(t, Y, Y') = 0 for solvers of differential-algebraic equations, compiled by Numba."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from job import Job
from numba import njit


@dataclass(frozen=True)
class Equations:
    """Equations of a scene in one form.

    Attributes
    ----------
    residual : callable
        Compiled (t, Y, Y', out) -> None.
    jacobian : callable or None
        Compiled (t, Y, Y', c, out) -> None: ∂F/∂Y + c ∂F/∂Y', shape (n, n); None where it is not at hand.
    start, slope : ndarray, shape (n,)
        Consistent Y and Y'.
    algebraic : ndarray of int
        Which unknowns have no derivative in the equations.
    """

    residual: Callable
    jacobian: Callable | None
    start: np.ndarray
    slope: np.ndarray
    algebraic: np.ndarray


def index_1(job: Job) -> Equations:
    """Return q' = N v, M v' = f + Gᵀλ, G v' = γ for Y = (q, v, λ): constraints hold as accelerations only."""
    system, p = job.system, job.p
    nq, nv, m = system.nq, system.nv, system.m
    n, n_a = nq + nv + m, nv + m
    motion, speed = system.numba("residual"), _speed(job)

    @njit
    def residual(t, y, slope, out):
        state = np.empty(nq + nv + nv + m)
        state[: nq + nv] = y[: nq + nv]
        state[nq + nv : nq + 2 * nv] = slope[nq : nq + nv]
        state[nq + 2 * nv :] = y[nq + nv :]
        speed(t, y, y[nq : nq + nv], out)
        for i in range(nq):
            out[i] = slope[i] - out[i]
        motion(t, state, p, out[nq:])

    if system.quaternions:  # the derivative by a quaternion has a meaning in products with N only
        return _consistent(job, residual, None, m)
    derivatives = system.numba("residual_jacobian")

    @njit
    def jacobian(t, y, slope, c, out):
        state, block = np.empty(nq + nv + nv + m), np.zeros(n_a * (nq + nv + n_a))
        state[: nq + nv] = y[: nq + nv]
        state[nq + nv : nq + 2 * nv] = slope[nq : nq + nv]
        state[nq + 2 * nv :] = y[nq + nv :]
        derivatives(t, state, p, block)
        rows = block.reshape(n_a, nq + nv + n_a)
        out[:] = 0.0
        for i in range(nq):
            out[i, i], out[i, nq + i] = c, -1.0
        out[nq:, : nq + nv] = rows[:, : nq + nv]
        out[nq:, nq : nq + nv] += c * rows[:, nq + nv : nq + 2 * nv]
        out[nq:, nq + nv :] = rows[:, nq + 2 * nv :]

    jacobian(0.0, np.zeros(n), np.zeros(n), 1.0, np.zeros((n, n)))
    return _consistent(job, residual, jacobian, m)


def ggl(job: Job) -> Equations:
    """Return the stabilised index-2 form of Gear, Gupta and Leimkuhler for Y = (q, v, λ, μ).

    q' = N (v + Gᵀμ), M v' = f + Gᵀλ, with the constraints on positions and on velocities; holonomic ones only.
    """
    system, p = job.system, job.p
    nq, nv, m = system.nq, system.nv, system.m
    motion, speed = system.numba("residual"), _speed(job)
    constraints, gradients = system.numba("constraint_residual"), system.numba("constraint_jacobian")

    @njit
    def residual(t, y, slope, out):
        state, moved = np.empty(nq + nv + nv + m), np.empty(nv)
        state[: nq + nv] = y[: nq + nv]
        state[nq + nv : nq + 2 * nv] = slope[nq : nq + nv]
        state[nq + 2 * nv :] = y[nq + nv : nq + nv + m]
        g, row, held = np.zeros(m * nv), np.empty(nv + m), np.empty(2 * m)
        gradients(t, y, p, g)
        for i in range(nv):
            moved[i] = y[nq + i]
            for k in range(m):
                moved[i] += g[k * nv + i] * y[nq + nv + m + k]
        speed(t, y, moved, out)
        for i in range(nq):
            out[i] = slope[i] - out[i]
        motion(t, state, p, row)
        constraints(t, y, p, held)
        out[nq : nq + nv] = row[:nv]
        out[nq + nv : nq + nv + m] = held[m:]
        out[nq + nv + m :] = held[:m]

    return _consistent(job, residual, None, 2 * m)


def _speed(job: Job) -> Callable:
    """Return a compiled (t, y, v, out) -> None that writes N(q) v."""
    nq, nv, p = job.system.nq, job.system.nv, job.p
    if not job.system.quaternions:

        @njit
        def plain(t, y, v, out):
            for i in range(nq):
                out[i] = v[i]

        return plain
    kinematics = job.system.numba("kinematics")

    @njit
    def turned(t, y, v, out):
        n = np.zeros(nq * nv + nq * nq)
        kinematics(t, y, p, n)
        for i in range(nq):
            out[i] = 0.0
            for j in range(nv):
                out[i] += n[i * nv + j] * v[j]

    return turned


def _consistent(job: Job, residual: Callable, jacobian: Callable | None, n_algebraic: int) -> Equations:
    """Compile, and start from the accelerations and multipliers of the model's own `rhs`."""
    system, n = job.system, job.n
    row = np.asarray(system.kernel("rhs")(0.0, job.start, job.p))
    if not np.all(np.isfinite(row)):
        raise ValueError("the constraints depend on each other: there is no unique start")
    multipliers = row[system.ny : system.ny + system.m]
    start = np.concatenate([job.start, multipliers, np.zeros(n_algebraic - system.m)])
    slope = np.concatenate([row[:n], np.zeros(n_algebraic)])
    residual(0.0, start, slope, np.empty(len(start)))
    return Equations(residual, jacobian, start, slope, np.arange(n, n + n_algebraic))
