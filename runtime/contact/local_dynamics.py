"""The equations of motion at one state with the rows of all stops and frictions, as numbers."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.contact.settings import Layout
from symgen.runtime.size import LARGEST_DENSE

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
_RANK = 1e-11  # singular values below this part of the largest belong to redundant constraints


class LocalDynamics:
    """M a = f + Gᵀλ + Wᵀμ, G a = γ at a state, W being the rows of stops, then frictions.

    Parameters
    ----------
    system : System
        With switches.
    p : ndarray
        With the senses in which frictions slide; these forces are in f, but for those in proportion to reactions.
    t : float [s]
    state : ndarray, shape (nq + nv,)

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

    def __init__(self, system: System, p: np.ndarray, t: float, state: np.ndarray):
        self.t, self.state = t, state
        closed, nv = system.closed, system.nv
        everything = p.copy()
        everything[list(closed.switched.values())] = 1.0
        everything[system.n_settable + Layout(system).aimed] = 0.0  # both rows of a circle in fixed axes
        own = list(closed.switched)
        others = [row for row in range(closed.m) if row not in closed.switched]
        jacobian = closed.kernel("constraint_jacobian")(t, state, everything).reshape(closed.m, nv)
        gamma = closed.kernel("gamma")(t, state, everything)
        self.rows = jacobian[own]
        self.speeds = closed.kernel("constraint_residual")(t, state, everything)[closed.nh :][own]
        self._constraints = jacobian[others]
        mass = system.kernel("mass_matrix")(t, state, p).reshape(nv, nv)
        forces = system.kernel("forces")(t, state, p)
        self._solve = _saddle_point_solver(mass, jacobian[others])
        right = np.zeros((nv + len(others), 1 + len(own)))
        right[:nv, 0], right[nv:, 0] = forces, gamma[others]
        right[:nv, 1:] = self.rows.T
        both = self._solve(right)
        solved = both[:nv]
        self.free_multipliers, self.multiplier_responses = -both[nv:, 0], -both[nv:, 1:]
        self._free_rates, self._responses = solved[:, 0], solved[:, 1:]
        self.free = self.rows @ solved[:, 0] - gamma[own]
        self.compliance = self.rows @ self._responses
        self.compliance = 0.5 * (self.compliance + self.compliance.T)
        inertia = np.diag(mass)
        alone = self.rows**2 @ np.divide(1.0, inertia, out=np.zeros(nv), where=inertia > 0.0)
        self.led = np.diag(self.compliance) <= _LED * alone

    @property
    def has_dependent_constraints(self) -> bool:
        """Whether the model's own constraints depend on each other here: their multipliers are not unique."""
        sizes = np.linalg.norm(self._constraints, axis=1, keepdims=True)
        scaled = self._constraints / np.where(sizes > 0.0, sizes, 1.0)
        return np.linalg.matrix_rank(scaled, tol=_DEPENDENT) < len(scaled)

    def accelerations(self, forces: np.ndarray) -> np.ndarray:
        """Return dv/dt, shape (nv,), under forces, shape (n,), of stops and frictions."""
        return self._free_rates + self._responses @ forces

    def change(self, impulses: np.ndarray) -> np.ndarray:
        """Return the change of the rates, shape (nv,), by impulses, shape (n,), on stops and frictions."""
        return self._responses @ impulses

    def turned(self, rotation: np.ndarray) -> LocalDynamics:
        """Return the same with other rows: combinations of these, by an orthogonal matrix of shape (n, n)."""
        other = copy.copy(self)
        other.rotation = rotation
        other.rows, other.speeds, other.free = (
            rotation @ self.rows,
            rotation @ self.speeds,
            rotation @ self.free,
        )
        other.compliance = rotation @ self.compliance @ rotation.T
        other.multiplier_responses = self.multiplier_responses @ rotation.T
        other._responses = self._responses @ rotation.T
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
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((m, m))]])
    scale = np.ones(n + m)
    for _ in range(2):
        largest = np.abs(matrix * np.outer(scale, scale)).max(axis=1)
        scale /= np.sqrt(np.where(largest > 0.0, largest, 1.0))
    scaled = matrix * np.outer(scale, scale)
    solve = _sparse_solver(scaled) if n + m > LARGEST_DENSE else None
    if solve is None:
        return lambda right: scale[:, None] * np.linalg.lstsq(scaled, scale[:, None] * right, rcond=_RANK)[0]
    return lambda right: scale[:, None] * solve(scale[:, None] * right)


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
