"""Constraints on the graph: positions, velocities, accelerations, Jacobian and constraint forces.

Constraints that follow from others wherever all hold, found by numbers: the equations are solved without them.

A mechanism that counting says is rigid (Bricard's; any planar one in three dimensions) moves because some of its
constraints follow from the others. No expression shows that, for it is so on the constraints only. So the model is put
together at its start values, and moved along its freedoms: what depends on others at all these places is left out of
the factorisation, and the rows that stay are those whose directions, in the metric of the mass matrix, stay farthest
apart. The run time looks whether the same holds for the parameters and the start of a run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.description import Coordinate, Description
from .graph.differentiate import forward, reverse, sparse_jacobian
from .graph.evaluate import evaluate
from .graph.graph import Graph
from .graph.nodes import INPUT, PARAM, SparseRows, T, V
from .kinematics import time_derivative
from .load import Loader
from .variables import Variables


@dataclass(frozen=True)
class Constraints:
    """Holonomic constraints Φ(q, t) = 0 first, then velocity constraints c(q, v, t) = 0."""

    position: list[int]  # Φ
    velocity: list[int]  # dΦ/dt, then c
    jacobian: SparseRows  # G
    gamma: list[int]  # G a = γ


def constraints(loader: Loader, description: Description, x: Variables) -> Constraints:
    """All levels of the constraints of a description."""
    g = loader.g
    position = [loader.load(c.expression) for c in description.constraints]
    nonholonomic = [loader.load(c.expression) for c in description.velocity_constraints]
    velocity = [*time_derivative(loader, position), *nonholonomic]
    if x.marks or x.quaternions:
        G = sparse_jacobian(g, velocity, x.v)
    else:
        G = sparse_jacobian(g, position, x.q) + sparse_jacobian(g, nonholonomic, x.v)
    G = [x.without_states(row) for row in G]
    bias = acceleration(loader, velocity, x, [g.zero] * len(x.v))
    return Constraints(position, velocity, G, [g.neg(b) for b in bias])


def acceleration(loader: Loader, velocity: list[int], x: Variables, accelerations: list[int]) -> list[int]:
    """Time derivatives of velocity-level constraints for given accelerations: G a - γ."""
    return forward(loader.g, velocity, x.motion(x.changing(accelerations)))


def constraint_forces(loader: Loader, c: Constraints, x: Variables) -> list[int]:
    """Gᵀ λ, by one reverse sweep: no products with the elements of G."""
    g = loader.g
    if x.marks or x.quaternions:
        by_rate = reverse(g, list(zip(c.velocity, x.lam, strict=True)), g.mask[x.v[0]])
        return x.along_rates(by_rate)
    from_position = reverse(g, list(zip(c.position, x.lam, strict=False)), g.mask[x.q[0]])
    rest = list(zip(c.velocity[len(c.position) :], x.lam[len(c.position) :], strict=True))
    from_velocity = reverse(g, rest, g.mask[x.v[0]])
    along = x.along_rates(from_velocity)
    return [g.add(from_position.get(q, g.zero), node) for q, node in zip(x.q, along, strict=True)]


def rheonomic_power(loader: Loader, c: Constraints, x: Variables, multipliers: list[int]) -> int:
    """Power of the constraint forces, λᵀ G v = -λᵀ (what is left of the velocity level at v = 0) where that is linear.

    Forces of a constraint that is not linear in the rates act along its derivatives by them (Chetaev), and do work.
    """
    g = loader.g
    drift = g.substitute(c.velocity, x.of_motion([g.zero] * len(x.v)))
    speeds = [g.neg(node) for node in drift]
    for k, row in enumerate(c.jacobian):
        if any(g.mask[entry] & V for entry in row.values()):
            speeds[k] = g.dot(row.values(), [x.v[i] for i in row])
    return g.dot(multipliers, speeds)


LARGEST = 80  # constraints; the search takes time as their third power
_PLACES, _FEWEST = 16, 4
_STRIDE = 0.3  # from place to place: in radians, or in parts of the largest coordinate of a unit
_WANDERS = 0.3  # how much of a new direction is in each stride
_MOST_STEPS, _MOST_HALVINGS = 30, 8
_CLOSED = 1e-10  # what assembly leaves, relative
_RANK_TOLERANCE = 1e-7  # as the run time's
_ALMOST_BEST = 0.7  # of the best: of rows about as good, the first in the file stays


def dependent_constraints(
    g: Graph, d: Description, x: Variables, c: Constraints, mass: SparseRows
) -> tuple[int, ...]:
    """Return the numbers of the constraints to leave out, in order; none where the model cannot be put together.

    Parameters
    ----------
    g : Graph
    d : Description
        With its rates.
    x : Variables
    c : Constraints
    mass : n rows
    """
    m = len(c.jacobian)
    if not 1 < m <= LARGEST:
        return ()
    rows, nh = _Mechanism(g, d, x, c, mass).places(), len(c.position)
    if not rows or _rank(rows[-1]) == m:
        return ()
    ranks = [(_rank(r[:nh]), _rank(r)) for r in rows]
    highest = max(ranks, key=lambda pair: pair[::-1])
    regular = [r for r, rank in zip(rows, ranks, strict=True) if rank == highest]
    kept = _well_apart(regular, nh, *highest)
    return tuple(k for k in range(m) if k not in kept)


@dataclass(frozen=True)
class _Mechanism:
    """A model at numbers: its default parameters and inputs."""

    g: Graph
    d: Description
    x: Variables
    c: Constraints
    mass: SparseRows

    def places(self) -> list[np.ndarray]:
        """Return G at places on the constraints, as unit rows in the metric of M where that is regular.

        It ends after the first one where nothing depends on anything. None, if the model can be put together
        at its start but not elsewhere: what holds for one value of an input only is a contradiction.
        """
        random = np.random.default_rng(20240229)
        q, drive, found = np.array([_start(c) for c in self.d.coordinates]), 0.0, list[np.ndarray]()
        sizes, direction = self._sizes(q), np.zeros(len(self.x.v))
        equations = [*self.c.position, *self.c.velocity]
        driven = any(self.g.mask[node] & (T | INPUT) for node in equations)
        for _ in range(_PLACES):
            assembled = self._assembled(q, drive)
            if assembled is None:
                return found if len(found) >= _FEWEST else []
            q, jacobian = assembled
            found.append(self._unit_rows(q, drive, jacobian))
            free = _null_space(jacobian * sizes)
            if _rank(found[-1]) == len(jacobian) or not (free.shape[1] or driven):
                break
            direction = direction + _WANDERS * random.standard_normal(len(direction))
            direction = free @ (free.T @ direction)
            direction /= max(np.abs(direction).max(), 1e-300)
            q = self._moved(q, _STRIDE * sizes * direction)
            drive += _STRIDE * driven
        return found

    def _values(self, q: np.ndarray, v: np.ndarray, drive: float) -> dict[int, float]:
        """Values of all variables; time and inputs are `drive` away from their start."""
        g, x, d = self.g, self.x, self.d
        values = dict(zip(x.q, q.tolist(), strict=True)) | dict(zip(x.v, v.tolist(), strict=True))
        values |= {g.var(PARAM, k): float(p.value) for k, p in enumerate(d.parameters)}
        values |= {g.var(INPUT, k): float(u.default) + drive for k, u in enumerate(d.inputs)}
        return values | {x.t: drive}

    def _evaluated(
        self, nodes: list[int], q: np.ndarray, drive: float, v: np.ndarray | None = None
    ) -> np.ndarray:
        values = self._values(q, np.zeros(len(self.x.v)) if v is None else v, drive)
        return np.array(evaluate(self.g, nodes, values), dtype=float)

    def _matrix(
        self, rows: SparseRows, q: np.ndarray, drive: float, v: np.ndarray | None = None
    ) -> np.ndarray:
        places = [(i, k) for i, row in enumerate(rows) for k in row]
        matrix = np.zeros((len(rows), len(self.x.v)))
        if places:
            nodes = [node for row in rows for node in row.values()]
            matrix[tuple(zip(*places, strict=True))] = self._evaluated(nodes, q, drive, v)
        return matrix

    def _jacobian(self, q: np.ndarray, drive: float) -> np.ndarray:
        """Return G, at rates that are none in particular where it depends on them: at rest rows may vanish."""
        nodes = [node for row in self.c.jacobian for node in row.values()]
        v = None
        if any(self.g.mask[node] & V for node in nodes):
            v = self._sizes(q) * np.random.default_rng(20240229).uniform(0.5, 1.5, len(self.x.v))
        return self._matrix(self.c.jacobian, q, drive, v)

    def _unit_rows(self, q: np.ndarray, drive: float, jacobian: np.ndarray) -> np.ndarray:
        try:
            rows = np.linalg.solve(np.linalg.cholesky(self._matrix(self.mass, q, drive)), jacobian.T).T
        except np.linalg.LinAlgError:
            rows = jacobian
        if not np.isfinite(rows).all():
            rows = jacobian
        norms = np.linalg.norm(rows, axis=1, keepdims=True)
        return np.divide(rows, norms, out=np.zeros_like(rows), where=norms > 0.0)

    def _sizes(self, q: np.ndarray) -> np.ndarray:
        """How far each rate moves something by much: a radian, or the largest coordinate of its unit."""
        largest: dict[str | None, float] = {}
        for c, value in zip(self.d.coordinates, q, strict=True):
            largest[c.unit] = max(largest.get(c.unit, 0.0), abs(value))
        sizes = np.ones(len(self.x.v))
        for k, i in self.x.plain:
            unit = self.d.coordinates[k].unit
            sizes[i] = 1.0 if unit == "rad" else largest[unit] or 1.0
        return sizes

    def _moved(self, q: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return q + N change, quaternions made unit ones."""
        q = q + self._evaluated(self.x.qdot, q, 0.0, change)
        for k, _ in self.x.quaternions:
            q[k : k + 4] /= np.linalg.norm(q[k : k + 4])
        return q

    def _assembled(self, q: np.ndarray, drive: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the place on the constraints that Newton's method finds from q, and G; None if there is none."""
        nh, left = len(self.c.position), np.inf
        change = np.zeros(len(self.x.v))
        for _ in range(_MOST_STEPS):
            moved = self._moved(q, change)
            for _ in range(_MOST_HALVINGS):
                residual = self._evaluated(self.c.position, moved, drive)
                if not np.abs(residual).max(initial=0.0) > left:
                    break
                change = 0.5 * change
                moved = self._moved(q, change)
            q, left = moved, np.abs(residual).max(initial=0.0)
            jacobian = self._jacobian(q, drive)
            if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
                return None
            reach = np.abs(jacobian[:nh]) @ self._sizes(q)
            if np.all(np.abs(residual) <= _CLOSED * reach):
                return q, jacobian
            change = np.linalg.lstsq(jacobian[:nh], -residual, rcond=_CLOSED)[0]
        return None


def _start(c: Coordinate) -> float:
    return c.guess if c.start is None else c.start


def _null_space(matrix: np.ndarray) -> np.ndarray:
    """An orthonormal basis, in columns."""
    _, values, directions = np.linalg.svd(matrix)
    return directions[int(np.sum(values > _RANK_TOLERANCE * values.max(initial=0.0))) :].T


def _rank(rows: np.ndarray) -> int:
    values = np.linalg.svd(rows, compute_uv=False)
    return int(np.sum(values > _RANK_TOLERANCE * values.max(initial=0.0)))


def _well_apart(places: list[np.ndarray], nh: int, rank_h: int, rank: int) -> list[int]:
    """Choose rows one by one, always one that is far from all chosen ones at every place; holonomic ones first."""
    left, kept = [rows.copy() for rows in places], list[int]()
    for number in range(rank):
        candidates = range(nh) if number < rank_h else range(nh, len(places[0]))
        distances = {
            k: min(float(np.linalg.norm(rows[k])) for rows in left) for k in candidates if k not in kept
        }
        enough = _ALMOST_BEST * max(distances.values())
        chosen = next(k for k, distance in distances.items() if distance >= enough)
        kept.append(chosen)
        for rows in left:
            along = rows[chosen] / np.linalg.norm(rows[chosen])
            rows -= np.outer(rows @ along, along)
    return kept
