"""The equations of motion at one state with the rows of all stops and frictions, as numbers."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.contact.settings import Layout
from symgen.runtime.positions import Positions

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


def parts_of(matrix: np.ndarray) -> list[np.ndarray]:
    """Return which rows and columns of a square matrix have to do with each other: a mask for each such part."""
    n = len(matrix)
    if n < 2:
        return [np.ones(n, dtype=bool)] * n
    joined = matrix != 0.0
    joined |= joined.T
    np.fill_diagonal(joined, val=True)
    if joined.all():
        return [np.ones(n, dtype=bool)]
    parts, left = [], np.ones(n, dtype=bool)
    while left.any():
        part = joined[np.argmax(left)]
        while (wider := joined[part].any(axis=0)).sum() > part.sum():
            part = wider
        parts.append(part)
        left &= ~part
    return parts


_DEPENDENT = 1e-8  # singular value of rows of G of length 1
_LED = 1e-12  # compliance in parts of what it is without constraints
_RANK = 1e-11  # singular values below this part of the largest belong to redundant constraints
_FEW = 64  # rates and multipliers up to which singular values cost no more than all else at an event


class Solution(NamedTuple):
    """What follows from the equations at one instant, see `LocalDynamics`."""

    free_rates: np.ndarray
    responses: np.ndarray
    free_multipliers: np.ndarray
    multiplier_responses: np.ndarray
    free: np.ndarray
    compliance: np.ndarray


class Place:
    """M, G and W at one place: of large models factors, and what forces of stops and frictions do, are kept.

    Parameters
    ----------
    mass, constraints, rows : ndarray
        M, G, W.
    """

    def __init__(self, mass: np.ndarray, constraints: np.ndarray, rows: np.ndarray):
        self.mass, self.constraints, self.rows = mass, constraints, rows

    def is_of(self, mass: np.ndarray, constraints: np.ndarray, rows: np.ndarray) -> bool:
        """Whether these are M, G and W, to the bit."""
        own, others = (self.rows, self.mass, self.constraints), (rows, mass, constraints)
        pairs = zip(own, others, strict=True)
        if self.is_small:
            return all(one.tobytes() == other.tobytes() for one, other in pairs)
        return all(np.array_equal(one, other) for one, other in pairs)

    def solve(self, forces: np.ndarray, gamma: np.ndarray, gamma_of_rows: np.ndarray) -> Solution:
        """Solve for the accelerations by f and γ, those of the rows among them, and for what forces in the rows do."""
        nv = len(self.mass)
        if self.is_small:  # one call of LAPACK for all
            right = np.zeros((nv + len(gamma), 1 + len(self.rows)))
            right[:nv, 0], right[nv:, 0], right[:nv, 1:] = forces, gamma, self.rows.T
            both = self._solve(right)
            alone, of_rows = both[:, 0], both[:, 1:]
            compliance = _symmetric(self.rows @ of_rows[:nv])
        else:
            alone = self._solve(np.concatenate([forces, gamma])[:, None])[:, 0]
            of_rows, compliance = self._by_rows, self._compliance_of_rows
        free = self.rows @ alone[:nv] - gamma_of_rows
        return Solution(alone[:nv], of_rows[:nv], -alone[nv:], -of_rows[nv:], free, compliance)

    @property
    def is_small(self) -> bool:
        """Whether nothing is gained by factors."""
        return len(self.mass) + len(self.constraints) <= _FEW

    @functools.cached_property
    def _solve(self) -> Callable[[np.ndarray], np.ndarray]:
        return _saddle_point_solver(self.mass, self.constraints)

    @functools.cached_property
    def _by_rows(self) -> np.ndarray:
        return self._solve(np.vstack([self.rows.T, np.zeros((len(self.constraints), len(self.rows)))]))

    @functools.cached_property
    def _compliance_of_rows(self) -> np.ndarray:
        from scipy.sparse import csr_array

        # A gap or a sliding speed reads few of many rates.
        return _symmetric(csr_array(self.rows) @ self._by_rows[: len(self.mass)])


class ContactEquations:
    """The equations of motion of a model with the rows of all its stops and frictions.

    Parameters
    ----------
    system : System
        With switches.
    layout : Layout
        Of the system.
    """

    def __init__(self, system: System, layout: Layout):
        closed = system.closed
        self.system, self.own = system, list(closed.switched)
        self.others = [row for row in range(closed.m) if row not in closed.switched]
        self._switches = list(closed.switched.values())
        self.positions = Positions(system)
        self._aimed = system.n_settable + layout.aimed
        self._place: Place | None = None

    def at(self, p: np.ndarray, t: float, state: np.ndarray) -> LocalDynamics:
        """Return them at a state.

        Parameters
        ----------
        p : ndarray
            With the senses in which frictions slide; these forces are in f, but for those in proportion to reactions.
        t : float [s]
        state : ndarray, shape (nq + nv,)
        """
        return LocalDynamics(self, p.copy(), t, state)

    def with_all_rows(self, p: np.ndarray) -> np.ndarray:
        """Return `p` with all stops closed and all frictions stuck, those with two directions in fixed axes."""
        everything = p.copy()
        everything[self._switches] = 1.0
        everything[self._aimed] = 0.0
        return everything

    def place(self, *matrices: np.ndarray) -> Place:
        """Return the place with M, G and W: the last one, if it has the same, so that its factors serve again."""
        if self._place is None or not self._place.is_of(*matrices):
            self._place = Place(*matrices)
        return self._place


_OF_ROWS = (  # what is kept, but follows from the rows
    "_parts", "sizes_of_free", "reached", "sizes", "row_sizes", "row_sums", "own", "led",
)  # fmt: skip


class LocalDynamics:
    """M a = f + Gᵀλ + Wᵀμ, G a = γ at a state, W being the rows of stops, then frictions.

    They are solved when something is asked that follows from it; many events need rows and speeds alone.

    Parameters
    ----------
    equations : ContactEquations
    p : ndarray
        As of `ContactEquations.at`; it must not be changed any more.
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
    """

    def __init__(self, equations: ContactEquations, p: np.ndarray, t: float, state: np.ndarray):
        self.t, self.state = t, state
        self._equations, self._p, self._all = equations, p, equations.with_all_rows(p)
        system, closed = equations.system, equations.system.closed
        jacobian = closed.kernel("constraint_jacobian")(t, state, self._all).reshape(closed.m, system.nv)
        residual = closed.kernel("constraint_residual")(t, state, self._all)
        self.rows, self._constraints = jacobian[equations.own], jacobian[equations.others]
        self.speeds = residual[closed.nh :][equations.own]

    @functools.cached_property
    def row_sizes(self) -> np.ndarray:
        """The magnitudes of the entries of W, shape (n, nv)."""
        return np.abs(self.rows)

    @functools.cached_property
    def row_sums(self) -> np.ndarray:
        """Their sums, shape (n,)."""
        return self.row_sizes.sum(axis=1)

    @functools.cached_property
    def _mass(self) -> np.ndarray:
        system = self._equations.system
        return system.kernel("mass_matrix")(self.t, self.state, self._p).reshape(system.nv, system.nv)

    @functools.cached_property
    def _solution(self) -> Solution:
        equations, system = self._equations, self._equations.system
        gamma = system.closed.kernel("gamma")(self.t, self.state, self._all)
        forces = system.kernel("forces")(self.t, self.state, self._p)
        place = equations.place(self._mass, self._constraints, self.rows)
        return place.solve(forces, gamma[equations.others], gamma[equations.own])

    @property
    def compliance(self) -> np.ndarray:
        """W H Wᵀ, shape (n, n), where H f are the accelerations that forces f cause."""
        return self._solution.compliance

    @functools.cached_property
    def own(self) -> np.ndarray:
        """The diagonal of `compliance`: what a unit of each force does in its own row."""
        return np.diag(self.compliance)

    @property
    def free(self) -> np.ndarray:
        """Accelerations of gaps and slidings, shape (n,), with all stops open and no friction sticking."""
        return self._solution.free

    @functools.cached_property
    def _parts(self) -> list[np.ndarray]:
        return parts_of(self.compliance)

    @functools.cached_property
    def sizes_of_free(self) -> np.ndarray:
        """The largest of `free` among all rows that each has to do with, shape (n,): what small is small beside."""
        sizes = np.zeros(len(self.rows))
        for part in self._parts:
            sizes[part] = np.abs(self.free[part]).max()
        return sizes

    @functools.cached_property
    def reached(self) -> np.ndarray:
        """Which rates each gap or sliding speed is made of, or forces on it move, shape (n, nv)."""
        return (self.rows != 0.0) | (self._solution.responses.T != 0.0)

    @functools.cached_property
    def sizes(self) -> np.ndarray:
        """What counts as large in each gap, shape (n,): the largest of the coordinates that it is made of, or 1.

        Errors of others come to these by constraints alone; of many of these, all.
        """
        system = self._equations.system
        coordinates = self._equations.positions.per_rate(np.abs(self.state[: system.nq]), 1.0)
        largest = coordinates.max(initial=1.0)
        if largest == 1.0 or len(self._constraints) > _FEW:
            return np.full(len(self.rows), largest)
        made_of, tied = self.rows != 0.0, self._constraints != 0.0
        for _ in self._constraints:
            wider = made_of | (made_of @ tied.T) @ tied
            if (wider == made_of).all():
                break
            made_of = wider
        return np.where(made_of, coordinates, 0.0).max(axis=1, initial=1.0)

    def moment(self, rates: np.ndarray, change: np.ndarray) -> float:
        """Return the time [s] in which some part of the motion changes by its own size, 1 if nothing moves.

        Parameters
        ----------
        rates, change : ndarray, shape (nv,)
            Rates and accelerations; 0 is what does not count.
        """
        system = self._equations.system
        q, v = np.abs(self.state[: system.nq]), np.abs(self.state[system.nq :])
        sizes = np.maximum(np.maximum(1.0, self._equations.positions.per_rate(q, 1.0)), v)
        speeds = np.maximum(np.abs(rates), np.abs(change))
        together = [self.reached[part].any(axis=0) for part in self._parts]
        alone = ~np.any(together, axis=0) & (speeds > 0.0)
        times = [sizes[part].max() / speeds[part].max() for part in together if speeds[part].any()]
        return float(min([*times, *(sizes[alone] / speeds[alone])], default=1.0))

    @property
    def free_multipliers(self) -> np.ndarray:
        """λ there, shape (m,)."""
        return self._solution.free_multipliers

    @property
    def multiplier_responses(self) -> np.ndarray:
        """What forces μ add to λ, shape (m, n)."""
        return self._solution.multiplier_responses

    @functools.cached_property
    def led(self) -> np.ndarray:
        """Whose gap or sliding the model's constraints prescribe, shape (n,): forces do not change it."""
        inertia = self._mass.diagonal()
        alone = self.rows**2 @ np.divide(1.0, inertia, out=np.zeros(len(inertia)), where=inertia > 0.0)
        return self.own <= _LED * alone

    @property
    def has_dependent_constraints(self) -> bool:
        """Whether the model's own constraints depend on each other here: their multipliers are not unique."""
        sizes = np.linalg.norm(self._constraints, axis=1, keepdims=True)
        scaled = self._constraints / np.where(sizes > 0.0, sizes, 1.0)
        return np.linalg.matrix_rank(scaled, tol=_DEPENDENT) < len(scaled)

    def accelerations(self, forces: np.ndarray) -> np.ndarray:
        """Return dv/dt, shape (nv,), under forces, shape (n,), of stops and frictions."""
        return self._solution.free_rates + self._solution.responses @ forces

    def change(self, impulses: np.ndarray) -> np.ndarray:
        """Return the change of the rates, shape (nv,), by impulses, shape (n,), on stops and frictions."""
        return self._solution.responses @ impulses

    def turned(self, rotation: np.ndarray) -> LocalDynamics:
        """Return the same with other rows: combinations of these, by an orthogonal matrix of shape (n, n)."""
        other, own = copy.copy(self), self._solution
        for name in _OF_ROWS:
            vars(other).pop(name, None)
        other.rotation = rotation
        other.rows, other.speeds = rotation @ self.rows, rotation @ self.speeds
        other._solution = own._replace(
            free=rotation @ own.free,
            compliance=rotation @ own.compliance @ rotation.T,
            multiplier_responses=own.multiplier_responses @ rotation.T,
            responses=own.responses @ rotation.T,
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


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + matrix.T)


def _saddle_point_solver(mass: np.ndarray, jacobian: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return x(right) with [M Gᵀ; G 0] x = right; of least norm where constraints are redundant."""
    n, m = len(mass), len(jacobian)
    matrix = np.zeros((n + m, n + m))
    matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = mass, jacobian.T, jacobian
    scale = np.ones(n + m)
    for _ in range(2):
        largest = np.abs(matrix * np.outer(scale, scale)).max(axis=1)
        scale /= np.sqrt(np.where(largest > 0.0, largest, 1.0))
    scaled = matrix * np.outer(scale, scale)
    if n + m <= _FEW:
        return lambda right: scale[:, None] * np.linalg.lstsq(scaled, scale[:, None] * right, rcond=_RANK)[0]
    solve = _sparse_solver(scaled) or _least_norm_solver(scaled)
    return lambda right: scale[:, None] * solve(scale[:, None] * right)


def _least_norm_solver(matrix: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return x(right) of least norm that comes nearest to matrix x = right, by singular values."""
    left, values, right = np.linalg.svd(matrix)
    kept = values > _RANK * values[0]
    left, values, right = left[:, kept].T, values[kept, None], right[kept].T
    return lambda given: right @ ((left @ given) / values)


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
