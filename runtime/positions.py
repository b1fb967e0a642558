"""How rates move the coordinates of a model: plain ones are shifted, unit quaternions are turned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.system import System

ANGLES = ("rad", "deg")  # units of coordinates that turn
_ROUND_OFF = 4.0 * np.finfo(float).eps
_SMALL = 1e-4  # square of an angle below which a series of two terms is exact to round-off


class Positions:
    """The places of plain coordinates and of quaternions in q and v.

    Parameters
    ----------
    system : System

    Attributes
    ----------
    plain_q, plain_v : ndarray of int
        Coordinates whose rates are their derivatives, and those rates.
    quaternions : list of (int, int)
        Where each quaternion begins in q, and its three rates in v: the angular velocity in body axes.
    """

    def __init__(self, system: System):
        self._nq, self._nv = system.nq, system.nv
        self.quaternions = [(place, place - k) for k, place in enumerate(system.quaternions)]
        if not self.quaternions:
            self.plain_q = self.plain_v = np.arange(system.nq)
            return
        plain = np.ones(system.nq, dtype=bool)
        moving = np.ones(system.nv, dtype=bool)
        for i, j in self.quaternions:
            plain[i : i + 4] = False
            moving[j : j + 3] = False
        self.plain_q, self.plain_v = np.flatnonzero(plain), np.flatnonzero(moving)

    def retract(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the retraction of `step`, shape (nv,), at q: rotation vectors in body axes turn quaternions."""
        if not self.quaternions:
            return q + step
        moved = q.copy()
        moved[self.plain_q] += step[self.plain_v]
        for i, j in self.quaternions:
            moved[i : i + 4] = _rotated(q[i : i + 4], step[j : j + 3])
        return moved

    def retractions(self, q: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Return the retractions of small `steps`, shape (n, k, nv), at n places q, shape (n, nq), all at once.

        They are what `retract` gives, but for round-off.
        """
        if not self.quaternions:
            return q[:, None] + steps
        moved = np.repeat(q[:, None], steps.shape[1], axis=1)
        moved[..., self.plain_q] += steps[..., self.plain_v]
        for i, j in self.quaternions:
            moved[..., i : i + 4] = _all_rotated(q[:, None, i : i + 4], steps[..., j : j + 3])
        return moved

    def derivatives(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return dq/dt = N v, shape (..., nq): v itself, and of quaternions half of their product with (0, ω)."""
        if not self.quaternions:
            return v
        result = np.zeros_like(q)
        result[..., self.plain_q] = v[..., self.plain_v]
        for i, j in self.quaternions:
            scalar, vector, omega = q[..., i : i + 1], q[..., i + 1 : i + 4], v[..., j : j + 3]
            result[..., i] = -0.5 * (vector * omega).sum(axis=-1)
            result[..., i + 1 : i + 4] = 0.5 * (scalar * omega + np.cross(vector, omega))
        return result

    def lengths(self, q: np.ndarray) -> np.ndarray:
        """Return the lengths of the quaternions, shape (..., number of them), of coordinates of shape (..., nq)."""
        parts = [np.linalg.norm(q[..., i : i + 4], axis=-1) for i, _ in self.quaternions]
        return np.stack(parts, axis=-1) if parts else np.zeros((*q.shape[:-1], 0))

    def normalised(self, q: np.ndarray) -> np.ndarray:
        """Return q with quaternions of unit length; those that have it, but for round-off, stay to the last bit."""
        q = q.copy()
        for i, _ in self.quaternions:
            length = np.linalg.norm(q[i : i + 4])
            if abs(length - 1.0) > _ROUND_OFF:
                q[i : i + 4] /= length
        return q

    def per_rate(self, values: np.ndarray, of_rotations: float) -> np.ndarray:
        """Return values of coordinates, shape (..., nq), as those of the rates that move them, shape (..., nv).

        Rotations have `of_rotations`.
        """
        result = np.full((*values.shape[:-1], self._nv), of_rotations)
        result[..., self.plain_v] = values[..., self.plain_q]
        return result

    def held(self, enforced: np.ndarray) -> np.ndarray:
        """Return which rates move something enforced; a quaternion is enforced as a whole by any of its four."""
        result = self.per_rate(enforced, False)
        for i, j in self.quaternions:
            result[j : j + 3] = enforced[i : i + 4].any()
        return result

    def per_coordinate(self, values: np.ndarray) -> np.ndarray:
        """Return the values of rates as those of the coordinates that they move: of a rotation the largest one."""
        result = np.zeros(self._nq, dtype=values.dtype)
        result[self.plain_q] = values[self.plain_v]
        for i, j in self.quaternions:
            result[i : i + 4] = values[j : j + 3].max()
        return result


class Chart:
    """Unknowns x, as many as rates, for all positions near a reference: q itself, rotation vectors for quaternions.

    Parameters
    ----------
    positions : Positions
    q : ndarray, shape (nq,)
        The reference; rotation vectors turn its quaternions.
    """

    def __init__(self, positions: Positions, q: np.ndarray):
        self._positions, self._reference = positions, q
        self.start = positions.per_rate(q, 0.0)

    def q(self, x: np.ndarray) -> np.ndarray:
        """Return the coordinates."""
        at = self._positions
        if not at.quaternions:
            return x
        q = self._reference.copy()
        q[at.plain_q] = x[at.plain_v]
        for i, j in at.quaternions:
            q[i : i + 4] = _rotated(self._reference[i : i + 4], x[j : j + 3])
        return q

    def by_unknowns(self, x: np.ndarray, by_rates: np.ndarray) -> np.ndarray:
        """Return derivatives by x from those by what rates move, shape (..., nv)."""
        if not self._positions.quaternions:
            return by_rates
        result = by_rates.copy()
        for _, j in self._positions.quaternions:
            result[..., j : j + 3] = by_rates[..., j : j + 3] @ _variation(x[j : j + 3])
        return result


def _rotated(quaternion: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    half = 0.5 * np.linalg.norm(rotation)
    w, axis = np.cos(half), 0.5 * np.sinc(half / np.pi) * rotation
    scalar, vector = quaternion[0], quaternion[1:]
    return np.array([scalar * w - vector @ axis, *(scalar * axis + w * vector + np.cross(vector, axis))])


def _all_rotated(quaternions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """As `_rotated`, of arrays of them, shapes (..., 4) and (..., 3) that broadcast."""
    half = 0.5 * np.sqrt((rotations * rotations).sum(axis=-1, keepdims=True))
    w, axis = np.cos(half), 0.5 * np.sinc(half / np.pi) * rotations
    scalar, vector = quaternions[..., :1], quaternions[..., 1:]
    turned = scalar * axis + w * vector + np.cross(vector, axis)
    return np.concatenate([scalar * w - (vector * axis).sum(axis=-1, keepdims=True), turned], axis=-1)


def _variation(rotation: np.ndarray) -> np.ndarray:
    """Return the small rotations in body axes that changes of a rotation vector make, shape (3, 3).

    1 - (1 - cos|θ|) / |θ|² [θ×] + (|θ| - sin|θ|) / |θ|³ [θ×]²: Iserles, Munthe-Kaas, Nørsett, Zanna, Acta
    Numerica 9 (2000) 215, appendix B, with body axes in place of space axes.
    """
    squared = float(rotation @ rotation)
    angle = np.sqrt(squared)
    second = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    third = (angle - np.sin(angle)) / (angle * squared) if squared > _SMALL else (1.0 - squared / 20.0) / 6.0
    cross = np.array(
        [[0.0, -rotation[2], rotation[1]], [rotation[2], 0.0, -rotation[0]], [-rotation[1], rotation[0], 0.0]]
    )
    return np.eye(3) - second * cross + third * cross @ cross
