"""The point on a constraint manifold nearest to a guess: damped Gauss-Newton, then slides on the manifold.

The position constraints of a model as a problem for the nearest point, in the unknowns of a chart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.positions import Chart
    from symgen.runtime.system import System


_REFINEMENTS = 3


def rates_after_reset(
    system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray, given: np.ndarray
) -> np.ndarray | None:
    """Return rates that satisfy the constraints and keep the given ones.

    A projection of all rates would undo the reset of a coordinate without mass, such as a slider-crank's
    piston position: moving it back costs nothing in the mass metric.

    Parameters
    ----------
    system : System
        With constraints.
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    q : ndarray, shape (nq,)
        On the constraints.
    v : ndarray, shape (nv,)
        As the reset left them.
    given : ndarray of bool, shape (nv,)
        The rates that the reset gave.

    Returns
    -------
    ndarray, shape (nv,), or None
        None where the constraints do not allow the given rates.
    """
    constraints = Constraints(system, p, t)
    scales = constraints.velocity_scales(q, v, constraints.characteristic_sizes(q))
    free, v = ~given, v.copy()
    jacobian = constraints.jacobian(q, v) / scales[:, None]
    mass = constraints.mass(q)
    if not (np.isfinite(jacobian).all() and np.isfinite(mass).all() and np.isfinite(v).all()):
        return None
    if free.any():
        factor = metric(mass[np.ix_(free, free)])
        reduced = np.linalg.solve(factor, jacobian[:, free].T).T
        # Rows as long as each other: at a dead point one moves at no speed, and coordinates may have no mass.
        lengths = np.sqrt((reduced**2).sum(axis=1))
        lengths[lengths == 0.0] = 1.0
        reduced /= lengths[:, None]
        for _ in range(_REFINEMENTS):
            off = constraints.velocity(q, v) / (scales * lengths)
            v[free] -= np.linalg.solve(factor.T, pseudo_solve(reduced, off))
    return v if worst(constraints.velocity(q, v) / scales) <= SOLVED else None


SOLVED = 1e-11  # scaled residual that counts as a solution
ROUND_OFF = 1e-14  # scaled residual that no further step can improve
_UNEQUAL, _LEAST_ROW = 1e-4, 1e-7  # parts of the largest row: one that is smaller, and how small it may be
RANK_TOLERANCE = 1e-8  # singular values below this part of the largest are zero

_MAX_STEPS = 100
_MAX_SLIDES = 60
_DAMPINGS = (0.0, 1e-4, 1e-2, 1e-1, 1.0, 10.0)  # in parts of the largest singular value
SLOW = 1.0 - 1e-9
LONGEST_STEP = (
    0.5  # in characteristic sizes: a longer one leaves the region where the linear model says anything
)
_LARGEST_HESSIAN = 40  # directions; above this the curvature costs more than the steps it saves
_DIFFERENCE = 1e-5
MASSLESS = 1e-10  # of the largest mass: what coordinates without mass count as
SINGULAR = 1e-12  # ratio of eigenvalues below which a mass matrix counts as singular
_SPREADS = (0.1, 0.3, 1.0, 3.0)  # of the characteristic sizes, for restarts from perturbed guesses


@record
class Problem:
    """Scaled constraints r(z) = 0 over unknowns z, in a metric.

    Attributes
    ----------
    residual : callable
        z -> r, shape (m,), scaled so that 1 is as wrong as can be.
    jacobian : callable
        z -> dr/dz, shape (m, n).
    factor : ndarray, shape (n, n)
        Lower triangular L of the metric W = L Lᵀ: distance² = (z - z0)ᵀ W (z - z0).
    sizes : ndarray, shape (n,)
        Characteristic sizes of the unknowns; infinite where the residual is linear in them.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray], np.ndarray]
    factor: np.ndarray
    sizes: np.ndarray

    def to_step(self, u: np.ndarray) -> np.ndarray:
        """Return dz for du = Lᵀ dz."""
        return np.linalg.solve(self.factor.T, u)

    def reduced_jacobian(self, z: np.ndarray) -> np.ndarray:
        """Return dr/du, where du = Lᵀ dz has the plain norm."""
        return np.linalg.solve(self.factor, self.jacobian(z).T).T

    def distance(self, z: np.ndarray, z0: np.ndarray) -> float:
        """Return the distance between two points in the metric."""
        return float(np.linalg.norm(self.factor.T @ (z - z0)))


def worst(r: np.ndarray) -> float:
    """Return the largest magnitude; infinite where something is not finite."""
    if not r.size:
        return 0.0
    largest = float(np.max(np.abs(r)))
    return largest if np.isfinite(largest) else np.inf


def solve(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Return where damped Gauss-Newton comes to rest: a solution, to round-off, or a least-squares point.

    Steps have the least norm in the metric; Levenberg-Marquardt damping is raised until the residual falls.
    Singular values below RANK_TOLERANCE count as zero, so redundant constraints do no harm.
    """
    r = problem.residual(z)
    for _ in range(_MAX_STEPS):
        if worst(r) <= ROUND_OFF:
            break
        found = _decreasing_step(problem, z, r)
        if found is None:
            break
        slow = worst(r) > SOLVED and np.linalg.norm(found[1]) > SLOW * np.linalg.norm(r)
        z, r = found
        if slow:
            break
    return z


def _decreasing_step(problem: Problem, z: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    jacobian = problem.reduced_jacobian(z)
    if not np.isfinite(jacobian).all() or not jacobian.size:
        return None
    left, values, right = np.linalg.svd(jacobian, full_matrices=False)
    kept = values > RANK_TOLERANCE * values[0]
    left, values, right = left[:, kept], values[kept], right[kept]
    if not values.size:
        return None
    for damping in _DAMPINGS:
        gains = values / (values**2 + (damping * values[0]) ** 2)
        step = _shortened(problem.to_step(-right.T @ (gains * (left.T @ r))), problem.sizes)
        for fraction in (1.0, 0.25) if damping == 0.0 else (1.0,):
            trial = z + fraction * step
            r_trial = problem.residual(trial)
            if np.isfinite(r_trial).all() and np.linalg.norm(r_trial) < np.linalg.norm(r):
                return trial, r_trial
    return None


def _shortened(step: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    longest = worst(step / sizes)
    return step * min(1.0, LONGEST_STEP / longest) if longest else step


def null_space(jacobian: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the rank of a matrix and an orthonormal basis of its null space, shape (n, n - rank)."""
    _, values, right = np.linalg.svd(jacobian, full_matrices=True)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0])) if values.size and values[0] > 0.0 else 0
    return rank, right[rank:].T


def slide_to_nearest(problem: Problem, z: np.ndarray, z0: np.ndarray) -> np.ndarray:
    """Move a solution `z` along the manifold until it is nearest to `z0` (a local minimum of the distance).

    Newton's method on the Lagrangian |u - u0|²/2 - λᵀr in the null space of the Jacobian; the curvature of
    the constraints comes from differences. Each step is brought back onto the manifold and must shorten the
    distance.
    """
    for _ in range(_MAX_SLIDES):
        offset = problem.factor.T @ (z0 - z)
        jacobian = problem.reduced_jacobian(z)
        _, basis = null_space(jacobian)
        gradient = basis.T @ offset
        if np.linalg.norm(gradient) <= 1e-11 * np.linalg.norm(offset):
            break
        shorter = None
        for direction in _directions(problem, z, jacobian, basis, offset, gradient):
            shorter = _shorter(problem, z, z0, _shortened(problem.to_step(direction), problem.sizes))
            if shorter is not None:
                break
        if shorter is None:
            break
        z = shorter
    return z


def _directions(problem: Problem, z, jacobian, basis, offset, gradient):
    if basis.shape[1] <= _LARGEST_HESSIAN:
        hessian = _reduced_hessian(problem, z, jacobian, basis, offset)
        if np.isfinite(hessian).all() and np.linalg.eigvalsh(hessian)[0] > 1e-6:
            yield basis @ np.linalg.solve(hessian, gradient)
    yield basis @ gradient


def _reduced_hessian(problem: Problem, z, jacobian, basis, offset) -> np.ndarray:
    multipliers = np.linalg.lstsq(jacobian.T, -offset, rcond=RANK_TOLERANCE)[0]
    hessian = np.eye(basis.shape[1])
    for column, direction in enumerate(basis.T):
        step = problem.to_step(direction)
        h = _DIFFERENCE / max(worst(step / problem.sizes), 1e-300)
        change = problem.reduced_jacobian(z + h * step) - problem.reduced_jacobian(z - h * step)
        hessian[:, column] -= basis.T @ (change.T @ multipliers) / (2.0 * h)
    return (hessian + hessian.T) / 2.0


def _shorter(problem: Problem, z: np.ndarray, z0: np.ndarray, step: np.ndarray) -> np.ndarray | None:
    before = problem.distance(z, z0)
    for fraction in (1.0, 0.3, 0.1, 0.01):
        trial = solve(problem, z + fraction * step)
        if worst(problem.residual(trial)) <= SOLVED and problem.distance(trial, z0) < before * (1.0 - 1e-14):
            return trial
    return None


def metric(mass: np.ndarray) -> np.ndarray:
    """Return the Cholesky factor of the mass matrix, or of the identity where it is singular.

    Coordinates that move no mass at all give way to those that do.
    """
    diagonal = np.diag(mass)
    massless = ~mass.any(axis=0) & ~mass.any(axis=1)
    if massless.any() and not massless.all():
        mass = mass + np.diag(MASSLESS * diagonal.max() * massless)
        diagonal = np.diag(mass)
    if np.isfinite(mass).all() and diagonal.size and diagonal.min() > 0.0:
        root = np.sqrt(diagonal)
        values = np.linalg.eigvalsh(mass / np.outer(root, root))
        if values[0] > SINGULAR * values[-1]:
            return np.linalg.cholesky(mass)
    return np.eye(len(mass))


def _random_ways(n: int) -> Iterator[np.ndarray]:
    """Yield n numbers between -1 and 1 as often as they are asked for; few starts need any."""
    random = np.random.default_rng(20240229)
    while True:
        yield random.uniform(-1.0, 1.0, n)


def solve_with_restarts(problem: Problem, z0: np.ndarray, spread_by: np.ndarray | None = None) -> np.ndarray:
    """Return the solution nearest to `z0`, or the best least-squares point that any start led to.

    Other starts are spread by the characteristic sizes, or by `spread_by`.
    """
    sizes = problem.sizes if spread_by is None else spread_by
    best = solve(problem, z0)
    ways = _random_ways(z0.size)
    for spread in _SPREADS:
        if worst(problem.residual(best)) <= SOLVED:
            return slide_to_nearest(problem, best, z0)
        z = solve(problem, z0 + spread * sizes * next(ways))
        if np.linalg.norm(problem.residual(z)) < np.linalg.norm(problem.residual(best)):
            best = z
    return slide_to_nearest(problem, best, z0) if worst(problem.residual(best)) <= SOLVED else best


def pseudo_solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the least-squares solution of least norm.

    Rows much smaller than others, as of rates with inertia beside one without, count as they would by themselves.
    """
    if matrix.size:
        sizes = np.abs(matrix).max(axis=1)
        if sizes.min() < _UNEQUAL * sizes.max():
            sizes = np.maximum(sizes, _LEAST_ROW * sizes.max())
            matrix, right = matrix / sizes[:, None], right / sizes
    return np.linalg.lstsq(matrix, right, rcond=RANK_TOLERANCE)[0]


def least_repair(jacobian: np.ndarray, residual: np.ndarray, enforced: np.ndarray) -> np.ndarray:
    """Return the step that zeroes the linearised residual and moves enforced values the least."""
    step = np.zeros(jacobian.shape[1])
    left, values, _ = np.linalg.svd(jacobian[:, ~enforced], full_matrices=True)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0])) if values.size and values[0] > 0.0 else 0
    out_of_reach = left[:, rank:].T
    step[enforced] = -pseudo_solve(out_of_reach @ jacobian[:, enforced], out_of_reach @ residual)
    step[~enforced] = -pseudo_solve(jacobian[:, ~enforced], residual + jacobian[:, enforced] @ step[enforced])
    return step


def position_problem(
    constraints: Constraints,
    chart: Chart,
    x: np.ndarray,
    free: np.ndarray,
    sizes: np.ndarray,
    scales: np.ndarray,
) -> Problem:
    """Return the position constraints over the free unknowns of the chart, the others held at `x`.

    Parameters
    ----------
    constraints : Constraints
    chart : Chart
    x : ndarray, shape (nv,)
    free : ndarray of bool, shape (nv,)
    sizes : ndarray, shape (nv,)
        Characteristic sizes of the unknowns.
    scales : ndarray, shape (nh,)
        By which residuals are divided.
    """

    def at(z: np.ndarray) -> np.ndarray:
        full = x.copy()
        full[free] = z
        return chart.q(full)

    def jacobian(z: np.ndarray) -> np.ndarray:
        full = x.copy()
        full[free] = z
        by_unknowns = chart.by_unknowns(full, constraints.position_jacobian(chart.q(full)))
        return by_unknowns[:, free] / scales[:, None]

    return Problem(
        residual=lambda z: constraints.position(at(z)) / scales,
        jacobian=jacobian,
        factor=metric(constraints.mass(chart.q(x))[np.ix_(free, free)]),
        sizes=sizes[free],
    )
