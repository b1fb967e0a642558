"""A scene with constraints as F(t, Y, Y') = 0 for solvers of differential-algebraic equations, compiled by Numba."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from job import Job
from numba import njit

_UNCONTROLLED = 1e6
_RANK = 1e-9  # singular values below it are none, in parts of the largest
_STEP = 2.0**-26  # of differences: half the digits


@dataclass(frozen=True)
class Equations:
    """Equations of a scene in one form.

    Attributes
    ----------
    residual : callable
        Compiled (t, Y, Y', out) -> None.
    jacobian : callable
        Compiled (t, Y, Y', c, out) -> None: ∂F/∂Y + c ∂F/∂Y', shape (n, n).
    start, slope : ndarray, shape (n,)
        Consistent Y and Y'.
    algebraic : ndarray of int
        Which unknowns have no derivative in the equations.
    """

    residual: Callable
    jacobian: Callable
    start: np.ndarray
    slope: np.ndarray
    algebraic: np.ndarray

    def tolerances(self, atol: float) -> np.ndarray:
        """Return the absolute tolerance of each unknown: multipliers are left out of the test of the error.

        Their errors enter no later state, and with them in the test solvers take up to five times as many steps.
        """
        values = np.full(len(self.start), max(atol, 1e-300))
        values[self.algebraic] = _UNCONTROLLED
        return values


def index_1(job: Job) -> Equations:
    """Return q' = N v, M v' = f + Gᵀλ, G v' = γ for Y = (q, v, λ): constraints hold as accelerations only."""
    system, p = job.system, job.p
    nq, nv, m = system.nq, system.nv, system.m
    n, n_a = nq + nv, nv + m
    motion, speed = system.numba("residual"), _speed(job)
    rows, accelerations, multipliers = start_of(job)

    @njit
    def state_of(y, slope):
        state = np.zeros(n + n_a)
        state[:n] = y[:n]
        state[n : n + nv] = slope[nq:n]
        for k, row in enumerate(rows):
            state[n + nv + row] = y[n + k]
        return state

    @njit
    def residual(t, y, slope, out):
        row = np.empty(n_a)
        speed(t, y, y[nq:n], out)
        for i in range(nq):
            out[i] = slope[i] - out[i]
        motion(t, state_of(y, slope), p, row)
        out[nq:n] = row[:nv]
        for k, number in enumerate(rows):
            out[n + k] = row[nv + number]

    parts = accelerations, multipliers, len(rows)
    if system.quaternions:  # the derivative by a quaternion has a meaning in products with N only
        return _consistent(job, residual, _differences(residual), *parts)
    derivatives = system.numba("residual_jacobian")

    @njit
    def jacobian(t, y, slope, c, out):
        block = np.zeros(n_a * (n + n_a))
        derivatives(t, state_of(y, slope), p, block)
        of = block.reshape(n_a, n + n_a)
        out[:] = 0.0
        for i in range(nq):
            out[i, i], out[i, nq + i] = c, -1.0
        for i in range(nv + len(rows)):
            row = i if i < nv else nv + rows[i - nv]
            out[nq + i, :n] = of[row, :n]
            out[nq + i, nq:n] += c * of[row, n : n + nv]
            for k, number in enumerate(rows):
                out[nq + i, n + k] = of[row, n + nv + number]

    return _consistent(job, residual, jacobian, *parts)


def ggl(job: Job) -> Equations:
    """Return the stabilised index-2 form of Gear, Gupta and Leimkuhler for Y = (q, v, λ, μ).

    q' = N (v + Gᵀμ), M v' = f + Gᵀλ, with the constraints on positions and on velocities; holonomic ones only.
    """
    system, p = job.system, job.p
    nq, nv, m = system.nq, system.nv, system.m
    n = nq + nv
    motion, speed = system.numba("residual"), _speed(job)
    constraints, gradients = system.numba("constraint_residual"), system.numba("constraint_jacobian")
    rows, accelerations, multipliers = start_of(job)
    held = len(rows)

    @njit
    def residual(t, y, slope, out):
        state, moved = np.zeros(n + nv + m), y[nq:n].copy()
        g, row, kept = np.zeros(m * nv), np.empty(nv + m), np.empty(2 * m)
        state[:n] = y[:n]
        state[n : n + nv] = slope[nq:n]
        gradients(t, y, p, g)
        constraints(t, y, p, kept)
        for k, number in enumerate(rows):
            state[n + nv + number] = y[n + k]
            for i in range(nv):
                moved[i] += g[number * nv + i] * y[n + held + k]
            out[n + k] = kept[m + number]
            out[n + held + k] = kept[number]
        speed(t, y, moved, out)
        for i in range(nq):
            out[i] = slope[i] - out[i]
        motion(t, state, p, row)
        out[nq:n] = row[:nv]

    return _consistent(job, residual, _differences(residual), accelerations, multipliers, 2 * held)


def start_of(job: Job) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the numbers of constraints that do not depend on each other, v' and their multipliers at the start."""
    system = job.system
    nv, m = system.nv, system.m
    call = lambda name, state: np.asarray(system.kernel(name)(0.0, state, job.p))  # noqa: E731
    gradients = [call("constraint_jacobian", state).reshape(m, nv) for state in (job.start, job.end)]
    rows = _independent(gradients)
    g = gradients[0][rows]
    matrix = np.block(
        [[call("mass_matrix", job.start).reshape(nv, nv), -g.T], [g, np.zeros((len(rows),) * 2)]]
    )
    solution = np.linalg.solve(
        matrix, np.concatenate([call("forces", job.start), call("gamma", job.start)[rows]])
    )
    return rows, solution[:nv], solution[nv:]


def _independent(gradients: list[np.ndarray]) -> np.ndarray:
    """Return the rows that are furthest from depending on each other in all of the matrices.

    At the start alone several choices may look equally good, of which some fail on the way.
    """
    m, rank = len(gradients[0]), np.linalg.matrix_rank(gradients[0], rtol=_RANK)
    if rank == m:
        return np.arange(m)
    distance = lambda rows: min(np.linalg.svd(g[list(rows)], compute_uv=False)[-1] for g in gradients)  # noqa: E731
    return np.array(max(combinations(range(m), rank), key=lambda rows: round(distance(rows), 6)))


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


def _differences(residual: Callable) -> Callable:
    """Return the Jacobian by differences along Y_j and c Y'_j at once: n + 1 residuals."""

    @njit
    def jacobian(t, y, slope, c, out):
        n = len(y)
        at, along, base, moved = y.copy(), slope.copy(), np.empty(n), np.empty(n)
        residual(t, at, along, base)
        for j in range(n):
            step = _STEP * max(1.0, abs(y[j]), abs(slope[j]) / max(1.0, abs(c)))
            at[j] = y[j] + step
            step = at[j] - y[j]  # as it is in binary digits
            along[j] = slope[j] + c * step
            residual(t, at, along, moved)
            at[j], along[j] = y[j], slope[j]
            for i in range(n):
                out[i, j] = (moved[i] - base[i]) / step

    return jacobian


def _consistent(
    job: Job,
    residual: Callable,
    jacobian: Callable,
    accelerations: np.ndarray,
    multipliers: np.ndarray,
    n_algebraic: int,
) -> Equations:
    """Compile, and start from the model's own accelerations and multipliers."""
    n, nq = job.n, job.system.nq
    start = np.concatenate([job.start, multipliers, np.zeros(n_algebraic - len(multipliers))])
    slope = np.concatenate([np.zeros(nq), accelerations, np.zeros(n_algebraic)])
    out = np.empty(len(start))
    residual(0.0, start, slope, out)
    slope[:nq] = -out[:nq]  # N v
    jacobian(0.0, start, slope, 1.0, np.empty((len(start), len(start))))
    return Equations(residual, jacobian, start, slope, np.arange(n, n + n_algebraic))
