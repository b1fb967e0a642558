"""Static equilibria: positions where nothing moves, stable or not, with the forces of constraints.

What rows span, and what is left over, from one factorisation: of Gᵀ = Q R by pivots.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.positions import Positions
from symgen.runtime.size import LARGEST_DENSE, is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System


_SINGULAR = 1e-13  # reciprocal condition of the scaled matrix below which it may be singular
_NULL = 1e-10
# Of Newton's method, where friction follows the magnitude of multipliers and the equations are not linear.
_PASSES_WITH_FRICTION = 8


class MotionEquations:
    """M a - f - Gᵀλ = 0 and G a = γ of a system at fixed parameters and time, as NumPy arrays.

    Displacements δ are what rates move: coordinates, and small rotations in body axes of quaternions.

    Parameters
    ----------
    system : System
    p : ndarray, shape (n_p,)
    t : float [s]

    Raises
    ------
    RuntimeModelError
        The model is too large for full matrices.
    """

    def __init__(self, system: System, p: np.ndarray, t: float):
        if is_large(system):
            raise RuntimeModelError(
                f"model {system.name!r} has {system.nv + system.m} rates and multipliers, too many for linear analysis "
                f"with its full matrices of up to {LARGEST_DENSE} rows: choose a smaller one"
            )
        self.system, self.p, self.t = system, np.ascontiguousarray(p, dtype=float), float(t)
        self.positions = Positions(system)

    def residual(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """Return M a - f - Gᵀλ, then G a - γ, shape (nv + m,)."""
        y = np.concatenate([q, v, a, multipliers])
        return self.finite(self.system.kernel("residual")(self.t, y, self.p), "equations of motion", q)

    def jacobian(
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, multipliers: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the derivatives of `residual` by δ, by v, and by (a, λ)."""
        s = self.system
        y = np.concatenate([q, v, a, multipliers])
        full = s.kernel("residual_jacobian")(self.t, y, self.p).reshape(s.nv + s.m, -1)
        full = self.finite(full, "derivatives of the equations of motion", q)
        by_q, by_v, by_unknowns = np.split(full, [s.nq, s.nq + s.nv], axis=1)
        return by_q @ self.kinematics(q), by_v, by_unknowns

    def kinematics(self, q: np.ndarray) -> np.ndarray:
        """Return N of qdot = N v, shape (nq, nv)."""
        s = self.system
        if not s.quaternions:
            return np.eye(s.nv)
        y = np.concatenate([q, np.zeros(s.nv)])
        return s.kernel("kinematics")(self.t, y, self.p)[: s.nq * s.nv].reshape(s.nq, s.nv)

    def turning(self, v: np.ndarray) -> np.ndarray:
        """Return W of δ' = δv + W δ: small rotations in body axes turn along with the body, δ' = δω - ω × δ."""
        nv = self.system.nv
        matrix = np.zeros((nv, nv))
        for _, j in self.positions.quaternions:
            x, y, z = v[j : j + 3]
            matrix[j : j + 3, j : j + 3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return matrix

    def accelerations_and_multipliers(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a, shape (nv,), and λ, shape (m,), of the motion from a state."""
        nv, unknowns = self.system.nv, np.zeros(self.system.nv + self.system.m)
        follows = any(switch.get("normal") for switch in self.system.switches)
        for _ in range(_PASSES_WITH_FRICTION if follows else 1):
            given = q, v, unknowns[:nv], unknowns[nv:]
            unknowns = unknowns + self.solve(self.jacobian(*given)[2], -self.residual(*given))
        return unknowns[:nv], unknowns[nv:]

    def solve(self, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Solve with the derivative by (a, λ); of dependent constraints the multipliers of least norm are taken.

        Raises
        ------
        RuntimeModelError
            The accelerations are not determined.
        """
        nv = self.system.nv
        diagonal = np.sqrt(np.abs(np.diag(matrix)[:nv]))
        diagonal[diagonal == 0.0] = diagonal[diagonal > 0.0].min(initial=1.0)
        rows = np.linalg.norm(matrix[nv:, :nv] / diagonal, axis=1)
        scale = 1.0 / np.concatenate([diagonal, np.where(rows > 0.0, rows, 1.0)])
        scaled = matrix * scale[:, None] * scale
        right = (right.T * scale).T
        if _regular(scaled):
            x = np.linalg.solve(scaled, right)
            x = x + np.linalg.solve(scaled, right - scaled @ x)
            return (x.T * scale).T
        left, values, transposed = np.linalg.svd(scaled)
        kept = values > _NULL * values[0]
        if np.abs(transposed[~kept, :nv]).max(initial=0.0) > np.sqrt(_NULL):
            raise RuntimeModelError(
                f"the motion of model {self.system.name!r} is not determined at this state: some coordinates have "
                "neither mass nor a constraint that moves them"
            )
        x = transposed[kept].T @ ((left[:, kept].T @ right).T / values[kept]).T
        return (x.T * scale).T

    def finite(self, values: np.ndarray, what: str, q: np.ndarray) -> np.ndarray:
        """Return values, or say of what function and where they are not finite."""
        if np.isfinite(values).all():
            return values
        names = [record["name"] for record in self.system.coordinates]
        place = ", ".join(f"{name} = {x:.6g}" for name, x in zip(names[:6], q))
        raise RuntimeModelError(
            f"the {what} of model {self.system.name!r} are not finite at {place}{', …' * (len(names) > 6)}: choose "
            "another start"
        )


def _regular(matrix: np.ndarray) -> bool:
    """Whether a matrix is regular, by an estimate of its condition from its factors."""
    from scipy.linalg.lapack import dgecon, dgetrf

    factors, _, zero_pivot = dgetrf(matrix)
    return not zero_pivot and dgecon(factors, np.linalg.norm(matrix, 1))[0] > _SINGULAR


_RANK_TOLERANCE = 1e-8  # of the first pivot


class RowSpace:
    """The rows of a matrix G, dependent ones allowed.

    Parameters
    ----------
    rows : ndarray, shape (m, n)
    """

    def __init__(self, rows: np.ndarray):
        self._m, self._n = rows.shape
        if not rows.size or not rows.any():
            self.rank, self._q = 0, np.eye(self._n)
            return
        from scipy.linalg import qr

        self._q, triangle, self._order = qr(rows.T, pivoting=True)
        pivots = np.abs(np.diag(triangle))
        self.rank = int(np.sum(pivots > _RANK_TOLERANCE * pivots[0]))
        self._triangle = triangle[: self.rank, : self.rank]

    def null_space(self) -> np.ndarray:
        """Return an orthonormal basis of all x with G x = 0, shape (n, n - rank)."""
        return self._q[:, self.rank :]

    def least_norm(self, values: np.ndarray) -> np.ndarray:
        """Return the smallest x with G x = values, for the independent rows, shape (n,)."""
        if not self.rank:
            return np.zeros(self._n)
        wanted = values[self._order[: self.rank]]
        return self._q[:, : self.rank] @ np.linalg.solve(self._triangle.T, wanted)

    def combination(self, x: np.ndarray) -> np.ndarray:
        """Return factors of the independent rows whose sum is nearest to x, shape (m,)."""
        factors = np.zeros(self._m)
        if self.rank:
            factors[self._order[: self.rank]] = np.linalg.solve(self._triangle, self._q[:, : self.rank].T @ x)
        return factors


_MAX_STEPS = 100
_MAX_DESCENT = 200
_LONGEST_STEP = 0.3  # in characteristic sizes
_FRACTIONS = (1.0, 0.5, 0.25, 0.1, 0.02)
_SETTLED = 1e-12  # of the characteristic sizes: a step that is none
_NEARLY = 1e-8  # the same, where round-off leaves no smaller one; of forces: equilibrium
_NO_STIFFNESS = 1e-13  # of the largest stiffness: a direction in which nothing pulls back
_ROUND_OFF = 1e-14  # of the largest stiffness times size: a force that is none
_UNSTABLE = 1e-11
_NUDGE = 0.01  # in characteristic sizes: off an unstable place
_CLOSED = 1e-12


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rest.

    Attributes
    ----------
    q : ndarray, shape (nq,)
    multipliers : ndarray, shape (m,)
        Forces of constraints; where they are not unique, some that balance.
    residual : float
        The largest force that is left, times the size of its coordinate, in parts of the largest that acts.
    descended : bool
        Whether it was found by going downhill, so that it is a stable one.
    v : ndarray, shape (nv,)
        Zeros, but for the values of first-order states.
    """

    q: np.ndarray
    multipliers: np.ndarray
    residual: float
    descended: bool
    v: np.ndarray


def find_equilibrium(
    system: System,
    p: np.ndarray,
    q: np.ndarray,
    t: float = 0.0,
    stable: bool = False,
    v: np.ndarray | None = None,
) -> Equilibrium:
    """Return a state of rest near a guess.

    Newton's method on f(q, 0) + Gᵀλ = 0, Φ(q) = 0 goes to an equilibrium nearby, stable or not. Where it fails, or
    `stable` is asked for, steps go downhill first: Newton's with the magnitudes of the curvatures (saddle-free Newton:
    Dauphin et al., NeurIPS 2014), within the constraints. Of a continuum of equilibria one near the guess is taken.

    Parameters
    ----------
    system : System
    p : ndarray, shape (n_p,)
        Parameters, then inputs.
    q : ndarray, shape (nq,)
        The guess, with the constraints satisfied.
    t : float [s]
    stable : bool
        Take no unstable one.
    v : ndarray, shape (nv,), optional
        The guess of first-order states, among zeros; their own starts without it.

    Raises
    ------
    RuntimeModelError
        None was found; says which coordinate is not at rest. Or constraints move with time.
    """
    if system.states and stable:
        raise RuntimeModelError(
            f"model {system.name!r} has first-order states, and no energy says which of its equilibria are stable: "
            "look at the modes of the one that is found"
        )
    q = q.copy()
    q[list(system.integrals)] = (system.initial_state(p)[1] if v is None else v)[list(system.states)]
    statics = _Statics(system, p, t, q)
    found = None if stable else statics.newton(q)
    descended = found is None and not system.states
    if found is None and system.states:
        raise RuntimeModelError(statics.why_none(q))
    if descended:
        lowest = statics.descend(q)
        found = statics.newton(lowest)
        if found is None:
            raise RuntimeModelError(statics.why_none(lowest))
    q, multipliers, residual = found
    statics.check_rest(q)
    rest = statics.rest(q)
    q[list(system.integrals)] = 0.0
    return Equilibrium(statics.equations.positions.normalised(q), multipliers, residual, descended, rest)


class _Forces(NamedTuple):
    """Forces at rest, as energies in parts of the largest, `scale` [J]; `left` is what is not balanced, then -Φ."""

    applied: np.ndarray
    held: np.ndarray
    left: np.ndarray
    stiffness: np.ndarray
    jacobian: np.ndarray
    multipliers: np.ndarray
    scale: float
    gain: float


class _Statics:
    """Forces at rest, scaled: displacements by characteristic sizes, forces by the largest, as energies.

    First-order states stand in the places of their integrals in q, which nothing depends on, and their derivatives are
    forces that vanish.
    """

    def __init__(self, system: System, p: np.ndarray, t: float, q: np.ndarray):
        self.system, self.equations = system, MotionEquations(system, p, t)
        self.constraints = Constraints(system, self.equations.p, t)
        self.sizes = self.constraints.characteristic_sizes(q)
        self.position_scales = self.constraints.position_scales(q, self.sizes) if system.nh else np.zeros(0)
        self._states = list(system.states)
        self._balances = [k for k in system.balances.values() if k >= system.nh]
        self._weights = np.ones(system.nv)
        if self._states:
            self._balance(q)

    def _balance(self, q: np.ndarray) -> None:
        """Find the sizes of states, how far they have to go, and bring their derivatives to the size of the forces."""
        multipliers, states = np.zeros(self.system.m), self._states
        change = self.equations.residual(q, self.rest(q), self._still, multipliers)[states]
        by_states = self._stiffness(q, multipliers)[np.ix_(states, states)]
        away = np.maximum(np.abs(np.linalg.pinv(by_states) @ change), np.abs(self.rest(q)[states]))
        self.sizes[states] = np.where(away > 0.0, away, 1.0)
        rows = np.abs(self._stiffness(q, multipliers)) * self.sizes[:, None] * self.sizes
        left = self.equations.residual(q, self.rest(q), self._still, multipliers)[: len(rows)]
        largest = np.maximum(rows.max(axis=1), np.abs(left) * self.sizes)
        others = np.delete(largest, self._states).max(initial=0.0) or 1.0
        known = largest[self._states] > 0.0
        self._weights[np.array(self._states)[known]] = others / largest[self._states][known]

    @property
    def _still(self) -> np.ndarray:
        return np.zeros(self.system.nv)

    def rest(self, q: np.ndarray) -> np.ndarray:
        """Return rates of zero, and the states that q holds."""
        v = self._still
        v[self._states] = q[list(self.system.integrals)]
        return v

    def _stiffness(self, q: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
        """Return the derivatives of the forces that act, times -1, by displacements and states."""
        nv = self.system.nv
        by_q, by_v, _ = self.equations.jacobian(q, self.rest(q), self._still, multipliers)
        by_q[:, self._states] = by_v[:, self._states]
        return by_q[:nv]

    def at(self, q: np.ndarray, multipliers: np.ndarray | None = None) -> _Forces:
        """Return the forces at rest; with the multipliers that balance them best where none are given."""
        nv, m = self.system.nv, self.system.m
        rest, weights = self.rest(q), self._weights * self.sizes
        _, _, unknowns = self.equations.jacobian(q, rest, self._still, np.zeros(m))
        jacobian = -unknowns[:nv, nv:].T * self.sizes
        jacobian[self._balances] = 0.0
        applied = -self.equations.residual(q, rest, self._still, np.zeros(m))[:nv] * weights
        if multipliers is None:
            multipliers = -RowSpace(jacobian).combination(applied)
        held = jacobian.T @ multipliers
        stiffness = self._stiffness(q, multipliers) * weights[:, None] * self.sizes
        scale = max(np.abs(x).max(initial=0.0) for x in (applied, held, stiffness)) or 1.0
        position = self.constraints.position(q) / self.position_scales if self.system.nh else np.zeros(0)
        left = np.concatenate([(applied + held) / scale, -position])
        gain = np.abs(jacobian).max(initial=0.0) or 1.0
        return _Forces(
            applied / scale, held / scale, left, stiffness / scale, jacobian, multipliers, scale, gain
        )

    def newton(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
        """Return q, multipliers and what is left of forces where Newton's method comes to rest; None if it does not.

        A step is shortened until the next one, by the same derivatives, is smaller: a test that stiff springs do not
        distort (Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3).
        """
        multipliers = None
        for _ in range(_MAX_STEPS):
            state = self.at(q, multipliers)
            inverse, missed = _pseudo_inverse(self._derivative(state), state.left)
            step = inverse @ state.left
            size = float(np.abs(step[: self.system.nv]).max(initial=0.0))
            if size <= _SETTLED:
                break
            # Nothing leads downhill where there are states: a step that is cut must not be asked to be a whole one.
            whole = float(np.linalg.norm(step[: self.system.nv])) if self._states else None
            step *= min(1.0, _LONGEST_STEP / size)
            tried = self._first_better(q, state, step, inverse, whole)
            if tried is None:
                break
            q, multipliers = tried
        else:
            return None
        loads = max(np.abs(x).max(initial=0.0) for x in (state.applied, state.held))
        balanced = missed <= _NEARLY * loads + _ROUND_OFF and np.abs(state.left).max(initial=0.0) <= _NEARLY
        return (
            (q, state.multipliers, float(np.abs(state.left).max())) if balanced and size <= _NEARLY else None
        )

    def _derivative(self, state: _Forces) -> np.ndarray:
        """Return the derivative of -left by displacements and multipliers, both scaled."""
        nv, nh = self.system.nv, self.system.nh
        matrix = np.zeros((nv + nh, nv + len(state.jacobian)))
        matrix[:nv, :nv], matrix[:nv, nv:] = state.stiffness, -state.jacobian.T / state.gain
        matrix[nv:, :nv] = state.jacobian[:nh] / self.position_scales[:, None]
        return matrix

    def _first_better(
        self, q: np.ndarray, state: _Forces, step: np.ndarray, inverse: np.ndarray, norm: float | None
    ) -> tuple[np.ndarray, np.ndarray] | None:
        nv = self.system.nv
        norm = np.linalg.norm(step[:nv]) if norm is None else norm
        for fraction in _FRACTIONS:
            trial = self.equations.positions.retract(q, fraction * step[:nv] * self.sizes)
            multipliers = state.multipliers + fraction * step[nv:] * state.scale / state.gain
            try:
                after = self.at(trial, multipliers)
            except RuntimeModelError:  # not finite there
                continue
            left = np.concatenate([after.left[:nv] * after.scale / state.scale, after.left[nv:]])
            if np.linalg.norm((inverse @ left)[:nv]) < norm:
                return trial, multipliers
        return None

    def descend(self, q: np.ndarray) -> np.ndarray:
        """Return where steps downhill come to rest, or as far as they come."""
        for _ in range(_MAX_DESCENT):
            state = self.at(q)
            free = RowSpace(state.jacobian).null_space()
            if not free.shape[1]:
                break
            reduced = free.T @ state.stiffness @ free
            curvatures, directions = np.linalg.eigh(0.5 * (reduced + reduced.T))
            pull = directions.T @ (free.T @ state.left[: self.system.nv])
            step = np.where(np.abs(pull) <= _ROUND_OFF, 0.0, pull) / np.maximum(
                np.abs(curvatures), _NO_STIFFNESS
            )
            if np.abs(step).max() <= _NEARLY:
                if curvatures[0] > -_UNSTABLE:
                    break
                step = np.where(np.arange(len(step)) == 0, _NUDGE, 0.0)
            step *= min(1.0, _LONGEST_STEP / np.abs(step).max())
            q = self._onto_constraints(
                self.equations.positions.retract(q, self.sizes * (free @ (directions @ step)))
            )
        return q

    def _onto_constraints(self, q: np.ndarray) -> np.ndarray:
        for _ in range(_MAX_STEPS if self.system.nh else 0):
            position = (
                self.equations.finite(self.constraints.position(q), "constraints", q) / self.position_scales
            )
            if np.abs(position).max() <= _CLOSED:
                break
            rows = self.equations.finite(self.constraints.position_jacobian(q), "constraints", q)
            rows = rows * self.sizes / self.position_scales[:, None]
            q = self.equations.positions.retract(q, self.sizes * RowSpace(rows).least_norm(-position))
        return q

    def check_rest(self, q: np.ndarray) -> None:
        """Refuse constraints that move with time."""
        if not self.system.m:
            return
        moving = self.constraints.velocity(q, self.rest(q))
        moving[self._balances] = 0.0
        if np.abs(moving).max() > 0.0:
            name = self.constraints.names[int(np.argmax(np.abs(moving)))]
            raise RuntimeModelError(
                f"there is no static equilibrium: the constraint {name!r} moves with time; linearise about the start "
                "or another state of the motion instead"
            )

    def why_none(self, q: np.ndarray) -> str:
        """Say which coordinate is not at rest."""
        state = self.at(q)
        free = RowSpace(state.jacobian).null_space()
        left = free @ (free.T @ state.left[: self.system.nv]) * state.scale / self.sizes
        worst = int(np.argmax(np.abs(left * self.sizes)))
        name = self.system.rates[worst]["name"]
        return (
            f"found no static equilibrium of model {self.system.name!r} near the start: at best, {name!r} is left with "
            f"a force of {left[worst]:.4g}, and nothing that holds it; add what does (a "
            "spring, a constraint, an input), choose another start, or linearise about the start"
        )


def _pseudo_inverse(matrix: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the pseudo-inverse, and how much of `right` it leaves aside.

    Singular values that are round-off of forces of size 1 are zero.
    """
    left, values, transposed = np.linalg.svd(matrix, full_matrices=False)
    kept = values > _NO_STIFFNESS * max(1.0, values.max(initial=0.0))
    seen = left[:, kept].T
    missed = np.abs(right - seen.T @ (seen @ right)).max(initial=0.0)
    return (transposed[kept].T / values[kept]) @ seen, float(missed)
