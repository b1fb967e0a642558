"""The equations of motion at one state with the rows of all stops and frictions, as numbers."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.contact.settings import Layout

if TYPE_CHECKING:
    from symgen.runtime.system import System


Normal = tuple[
    int | None, np.ndarray
]  # the number of a stop, or those of constraints; neither if a level is given


def normals_of(system: System) -> list[Normal]:
    """Return what presses for each friction of a model."""
    stops = [switch["name"] for switch in system.switches if switch["kind"] == "stop"]
    constraints = [record["name"] for record in system.constraints]
    normals: list[Normal] = []
    for switch in system.switches:
        if switch["kind"] == "stop":
            continue
        names = switch.get("normal", ())
        on_stop = len(names) == 1 and names[0] in stops
        rows = () if on_stop else [constraints.index(name) for name in names]
        normals.append((stops.index(names[0]) if on_stop else None, np.array(rows, dtype=int)))
    return normals


def smooth_frictions(system: System) -> np.ndarray:
    """Return of each friction of a model whether it never sticks but gives way below some speed."""
    frictions = (switch for switch in system.switches if switch["kind"] == "friction")
    return np.array([switch.get("smooth", False) for switch in frictions], dtype=bool)


def creeping_frictions(system: System) -> np.ndarray:
    """Return of each friction of a model whether it is smooth by creep."""
    frictions = (switch for switch in system.switches if switch["kind"] == "friction")
    return np.array([switch.get("creeps", False) for switch in frictions], dtype=bool)


def smooth_sense(speeds: np.ndarray, sizes: np.ndarray, widths: np.ndarray, creeps: np.ndarray) -> np.ndarray:
    """Return the part of its level that smooth friction has, from -1 to 1.

    It is s / sqrt(|s|² + w²), or where it creeps (1 - (1 - min(|s|/w, 1))³) s/|s|.

    Parameters
    ----------
    speeds, sizes, widths : ndarray, shape (..., number of frictions)
        s, |s| and w.
    creeps : ndarray of bool
    """
    part = np.minimum(sizes / widths, 1.0)
    creeping = speeds * (3.0 - 3.0 * part + part**2) / np.maximum(sizes, widths)
    return np.where(creeps, creeping, speeds / np.hypot(sizes, widths))


def given(normal: Normal) -> bool:
    """Whether a friction's level does not follow from a reaction."""
    return normal[0] is None and len(normal[1]) == 0


def normal_forces(normals: list[Normal], forces: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
    """Return the normal force of each friction, 0 where its level is given.

    Parameters
    ----------
    normals : list of Normal
    forces : ndarray, shape (..., n)
        Of stops, then of frictions.
    multipliers : ndarray, shape (..., m)

    Returns
    -------
    ndarray, shape (..., number of frictions)
    """
    sizes = [
        np.maximum(forces[..., stop], 0.0)
        if stop is not None
        else np.linalg.norm(multipliers[..., rows], axis=-1)
        for stop, rows in normals
    ]
    return np.stack(sizes, axis=-1) if sizes else np.zeros((*forces.shape[:-1], 0))


_DEPENDENT = 1e-8  # singular value of rows of G of length 1
_LED = 1e-12  # compliance in parts of what it is without constraints
_FEW = 96  # unknowns up to which factors of full matrices are cheap; LAPACK's take all processors beyond
_REGULAR = 1e-6  # least pivot of matrices with ones on the diagonal, to solve with them as they are
_RANK = 1e-11  # singular values below this part of the largest belong to redundant constraints


class Place:
    """M, G and W at one place, and what forces of stops and frictions do there, whatever the rates."""

    def __init__(self, mass: np.ndarray, jacobian: np.ndarray, rows: np.ndarray):
        self.mass, self.constraints, self.rows = mass, jacobian, rows
        self._effects: tuple[bytes, Effects] | None = None

    @functools.cached_property
    def solve(self) -> Callable[[np.ndarray], np.ndarray]:
        """x(right) with [M Gᵀ; G 0] x = right."""
        return _saddle_point_solver(self.mass, self.constraints)

    def effects(self, attended: np.ndarray) -> Effects:
        """What forces in some of the rows do."""
        key = attended.tobytes()
        if self._effects is None or self._effects[0] != key:
            self._effects = (key, self._found(np.flatnonzero(attended)))
        return self._effects[1]

    def _found(self, attended: np.ndarray) -> Effects:
        n, nv = self.rows.shape
        W = self.rows[attended]
        right = np.zeros((nv + len(self.constraints), len(W)))
        right[:nv] = W.T
        both = self.solve(right)
        own = W @ both[:nv]
        inertia = np.diag(self.mass)
        alone = W**2 @ np.divide(1.0, inertia, out=np.zeros(nv), where=inertia > 0.0)
        is_led = np.diag(own) <= _LED * alone
        if len(attended) == n:
            return Effects(both[:nv], -both[nv:], 0.5 * (own + own.T), is_led)
        responses, compliance, led = np.zeros((len(right), n)), np.zeros((n, n)), np.zeros(n, dtype=bool)
        responses[:, attended], led[attended] = both, is_led
        compliance[np.ix_(attended, attended)] = 0.5 * (own + own.T)
        return Effects(responses[:nv], -responses[nv:], compliance, led)


class Effects(NamedTuple):
    """What forces of stops and frictions do, as `LocalDynamics` says."""

    responses: np.ndarray
    multiplier_responses: np.ndarray
    compliance: np.ndarray
    led: np.ndarray


class ContactEquations:
    """The equations of motion with the rows of all stops and frictions; what depends on the last place alone is kept.

    Parameters
    ----------
    system : System
        With switches.

    Attributes
    ----------
    attended : ndarray of bool, shape (n,)
        The stops and frictions that can have forces at the moment; what those of others would do is left out, as 0.
    """

    def __init__(self, system: System):
        closed = system.closed
        self._system = system
        self._own = list(closed.switched)
        self._others = [row for row in range(closed.m) if row not in closed.switched]
        self._switches = list(closed.switched.values())
        self._aimed = system.n_settable + Layout(system).aimed
        self._settings = system.settings_of_switches
        self._last: tuple[tuple, Place] | None = None
        self.attended = np.ones(len(self._own), dtype=bool)

    def at(self, p: np.ndarray, t: float, state: np.ndarray) -> LocalDynamics:
        """Return them at a state.

        Parameters
        ----------
        p : ndarray
            With the senses in which frictions slide; these forces are taken as given, but for those in proportion to
            reactions.
        t : float [s]
        state : ndarray, shape (nq + nv,)
        """
        system, closed = self._system, self._system.closed
        everything = p.copy()
        everything[self._switches] = 1.0
        everything[self._aimed] = 0.0  # both rows of a circle in fixed axes
        gamma = closed.kernel("gamma")(t, state, everything)
        speeds = closed.kernel("constraint_residual")(t, state, everything)[closed.nh :][self._own]
        forces = system.kernel("forces")(t, state, p)
        place = self._place(p, t, state, everything)
        return LocalDynamics(place, self, t, state, speeds, forces, gamma[self._own], gamma[self._others])

    def _place(self, p: np.ndarray, t: float, state: np.ndarray, everything: np.ndarray) -> Place:
        system, closed, nv = self._system, self._system.closed, self._system.nv
        elsewhere = p.copy()
        elsewhere[self._settings] = 0.0
        key = (t, state[: system.nq].tobytes(), elsewhere.tobytes())
        if self._last is None or self._last[0] != key:
            jacobian = closed.kernel("constraint_jacobian")(t, state, everything).reshape(closed.m, nv)
            mass = system.kernel("mass_matrix")(t, state, p).reshape(nv, nv)
            self._last = (key, Place(mass, jacobian[self._others], jacobian[self._own]))
        return self._last[1]


class LocalDynamics:
    """M a = f + Gᵀλ + Wᵀμ, G a = γ at a state, W being the rows of stops, then frictions.

    Attributes
    ----------
    t, state
        As given.
    rows : ndarray, shape (n, nv)
        W.
    speeds : ndarray, shape (n,)
        Rates of the gaps, and sliding speeds.
    compliance : ndarray, shape (n, n)
        W H Wᵀ, where H f are the accelerations that forces f cause.
    led : ndarray of bool, shape (n,)
        Whose gap or sliding the model's constraints prescribe: forces do not change it.
    free : ndarray, shape (n,)
        Accelerations of gaps and slidings with all stops open and no friction sticking.
    free_multipliers : ndarray, shape (m,)
        λ there.
    multiplier_responses : ndarray, shape (m, n)
        What forces μ add to λ.
    """

    def __init__(
        self,
        place: Place,
        equations: ContactEquations,
        t: float,
        state: np.ndarray,
        speeds: np.ndarray,
        forces: np.ndarray,
        gamma: np.ndarray,
        gamma_of_constraints: np.ndarray,
    ):
        self._place, self._equations, self._others_effects = place, equations, None
        self.t, self.state, self.speeds, self.rows = t, state, speeds, place.rows
        solved = place.solve(np.concatenate([forces, gamma_of_constraints])[:, None])[:, 0]
        self._free_rates, self.free_multipliers = solved[: len(forces)], -solved[len(forces) :]
        self.free = self.rows @ self._free_rates - gamma

    @property
    def _effects(self) -> Effects:
        return self._others_effects or self._place.effects(self._equations.attended)

    @property
    def compliance(self) -> np.ndarray:
        """See above."""
        return self._effects.compliance

    @property
    def led(self) -> np.ndarray:
        """See above."""
        return self._effects.led

    @property
    def multiplier_responses(self) -> np.ndarray:
        """See above."""
        return self._effects.multiplier_responses

    @property
    def has_dependent_constraints(self) -> bool:
        """Whether the model's own constraints depend on each other here: their multipliers are not unique."""
        constraints = self._place.constraints
        sizes = np.linalg.norm(constraints, axis=1, keepdims=True)
        scaled = constraints / np.where(sizes > 0.0, sizes, 1.0)
        return np.linalg.matrix_rank(scaled, tol=_DEPENDENT) < len(scaled)

    def accelerations(self, forces: np.ndarray) -> np.ndarray:
        """Return dv/dt, shape (nv,), under forces, shape (n,), of stops and frictions."""
        return self._free_rates + self._effects.responses @ forces

    def change(self, impulses: np.ndarray) -> np.ndarray:
        """Return the change of the rates, shape (nv,), by impulses, shape (n,), on stops and frictions."""
        return self._effects.responses @ impulses

    def turned(self, rotation: np.ndarray) -> LocalDynamics:
        """Return the same with other rows: combinations of these, by an orthogonal matrix of shape (n, n)."""
        other, effects = copy.copy(self), self._effects
        other.rotation = rotation
        other.rows, other.speeds, other.free = (
            rotation @ self.rows,
            rotation @ self.speeds,
            rotation @ self.free,
        )
        other._others_effects = effects._replace(
            compliance=rotation @ effects.compliance @ rotation.T,
            multiplier_responses=effects.multiplier_responses @ rotation.T,
            responses=effects.responses @ rotation.T,
        )
        return other

    def of(self, chosen: np.ndarray) -> LocalDynamics:
        """Return the same with some of the rows alone."""
        other, effects = copy.copy(self), self._effects
        other.rows, other.speeds, other.free = self.rows[chosen], self.speeds[chosen], self.free[chosen]
        other._others_effects = Effects(
            effects.responses[:, chosen],
            effects.multiplier_responses[:, chosen],
            effects.compliance[np.ix_(chosen, chosen)],
            effects.led[chosen],
        )
        return other

    def holding(self, held: np.ndarray, speeds: np.ndarray) -> np.ndarray:
        """Return the change of the rates that takes given speeds from the rows `held`, at the least kinetic energy."""
        impulses = np.zeros(len(self.rows))
        if held.any():
            impulses[held] = -np.linalg.lstsq(self.compliance[np.ix_(held, held)], speeds[held], rcond=_RANK)[
                0
            ]
        return self.change(impulses)


def _saddle_point_solver(mass: np.ndarray, jacobian: np.ndarray):
    """Return x(right) with [M Gᵀ; G 0] x = right; of least norm where constraints are redundant."""
    n, m = len(mass), len(jacobian)
    few = n + m <= _FEW
    scale = _scale_of_regular(mass, jacobian) if few else None
    matrix = np.zeros((n + m, n + m))
    matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = mass, jacobian.T, jacobian
    if scale is not None:
        matrix *= scale
        matrix *= scale[:, None]
        return lambda right: scale[:, None] * np.linalg.solve(matrix, scale[:, None] * right)
    scale = np.ones(n + m)
    for _ in range(2):
        largest = np.abs(matrix * np.outer(scale, scale)).max(axis=1)
        scale /= np.sqrt(np.where(largest > 0.0, largest, 1.0))
    scaled = matrix * np.outer(scale, scale)
    solve = None if few else _sparse_solver(scaled)
    if solve is None:
        return lambda right: scale[:, None] * np.linalg.lstsq(scaled, scale[:, None] * right, rcond=_RANK)[0]
    return lambda right: scale[:, None] * solve(scale[:, None] * right)


def _scale_of_regular(mass: np.ndarray, jacobian: np.ndarray) -> np.ndarray | None:
    """Return factors of rows and columns with which M and G M⁻¹ Gᵀ are far from singular; None where there are none."""
    inertia = np.diag(mass)
    if not (inertia > 0.0).all():
        return None
    scale = 1.0 / np.sqrt(inertia)
    try:
        factor = np.linalg.cholesky(mass * scale * scale[:, None])
        if np.diag(factor).min(initial=1.0) ** 2 <= _REGULAR:
            return None
        if not len(jacobian):
            return scale
        half = np.linalg.solve(factor, (jacobian * scale).T)
        sizes = np.sqrt((half**2).sum(axis=0))
        if not (sizes > 0.0).all():
            return None
        half /= sizes
        if np.diag(np.linalg.cholesky(half.T @ half)).min() ** 2 <= _REGULAR:
            return None
    except np.linalg.LinAlgError:
        return None
    return np.concatenate([scale, 1.0 / sizes])


def _sparse_solver(matrix: np.ndarray) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return x(right) with matrix x = right by sparse factors, None where it is singular."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    try:
        factors = splu(csc_array(matrix))
    except RuntimeError:  # exactly singular
        return None
    pivots = np.abs(factors.U.diagonal())
    return factors.solve if pivots.min() > _DEPENDENT * pivots.max() else None
