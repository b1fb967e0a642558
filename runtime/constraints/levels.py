"""A model's constraints at fixed parameters and time, with the scales that errors are held against."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.positions import Positions

if TYPE_CHECKING:
    from runtime.system import System

_ANGLES = ("", "rad", "deg")
_NEAR = 1e-2  # of the characteristic sizes: where else G is looked at, since an entry may vanish at one place
_ROUND_OFF = 1e-13  # of a constraint's value: a change that is none
_SLOWEST = 1e-6  # characteristic sizes per second below which rates are not told from rest


class Constraints:
    """Constraint functions as NumPy arrays.

    Parameters
    ----------
    system : System
        With constraints.
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    """

    def __init__(self, system: System, p: np.ndarray, t: float):
        self._system, self._p, self._t = system, p, t
        self.positions = Positions(system)
        self.names = [record["name"] for record in system.constraints]

    def _call(self, name: str, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self._system.kernel(name)(self._t, np.concatenate([q, v]), self._p)

    def position(self, q: np.ndarray) -> np.ndarray:
        """Return Φ(q, t), shape (nh,)."""
        return self._call("constraint_residual", q, np.zeros(self._system.nv))[: self._system.nh]

    def velocity(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the velocity residual of all constraints, shape (m,)."""
        return self._call("constraint_residual", q, v)[self._system.nh :]

    def jacobian(self, q: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        """Return G, shape (m, nv)."""
        v = np.zeros(self._system.nv) if v is None else v
        return self._call("constraint_jacobian", q, v).reshape(self._system.m, self._system.nv)

    def position_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the derivative of Φ by what rates move, shape (nh, nv): the first rows of G."""
        return self.jacobian(q)[: self._system.nh]

    def mass(self, q: np.ndarray) -> np.ndarray:
        """Return M, shape (nv, nv)."""
        nv = self._system.nv
        return self._call("mass_matrix", q, np.zeros(nv)).reshape(nv, nv)

    def pivot_ratio(self, q: np.ndarray, v: np.ndarray) -> float:
        """Return how independent the constraints are: the smallest pivot relative to that without the others."""
        return float(self._call("rhs", q, v)[-1])

    def characteristic_sizes(self, q: np.ndarray) -> np.ndarray:
        """Return what counts as large for what each rate moves, shape (nv,).

        1 for angles, turns and numbers without a unit, otherwise the largest value among coordinates and
        parameters of the same unit.
        """
        records = [*self._system.coordinates, *self._system.parameters, *self._system.inputs]
        values = np.concatenate([q, self._p])
        largest: dict[str, float] = {}
        for record, value in zip(records, np.abs(values)):
            largest[record["unit"]] = max(largest.get(record["unit"], 0.0), float(value))
        units = [record["unit"] for record in self._system.coordinates]
        bare = max([1.0, *np.abs(q[[unit in _ANGLES for unit in units]])])
        sizes = np.array([bare if unit in _ANGLES else largest[unit] or 1.0 for unit in units])
        return self.positions.per_rate(sizes, 1.0)

    def position_scales(self, q: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return by how much each position constraint changes over the characteristic sizes, shape (nh,).

        One that does not change, but for round-off, is held against its own value.
        """
        random = np.random.default_rng(20240229)
        steps = [_NEAR * sizes * random.uniform(-1.0, 1.0, sizes.size) for _ in range(2)]
        near = [q, *(self.positions.move(q, step) for step in steps)]
        scales = np.zeros(self._system.nh)
        for place in near:
            change = np.abs(self.position_jacobian(place) * sizes).max(axis=1, initial=0.0)
            scales = np.fmax(scales, np.where(np.isfinite(change), change, 0.0))
        values = np.abs(self.position(q))
        scales = np.where(scales > _ROUND_OFF * values, scales, values)
        return np.where(scales > 0.0, scales, 1.0)

    def velocity_scales(self, q: np.ndarray, v: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return the largest term of each velocity residual, shape (m,), or that of a very slow motion."""
        matrix = self.jacobian(q, v)
        terms = np.abs(np.column_stack([matrix * v, self.velocity(q, np.zeros_like(v))]))
        slow = np.abs(matrix * sizes).max(axis=1, initial=0.0) * _SLOWEST
        scales = np.maximum(terms.max(axis=1), slow)
        return np.where(scales > 0.0, scales, 1.0)
