"""Where the settings of stops and frictions are, and how friction with two directions acts by them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.graph.layouts import settings_of

if TYPE_CHECKING:
    from symgen.runtime.system import System

_NO_SPEED = 1e-140
_OPPOSITE = 0.57  # as in symgen/derive/contacts.py


def without_turning(system: System, p: np.ndarray) -> np.ndarray:
    """Return `p` with frictions of two directions that keep their direction.

    How fast these turn has no bound near rest; fixed steps aim them there, until one step turns them only a little.
    """
    if not any("circle" in switch for switch in system.switches):
        return p
    settings = p.copy()
    settings[system.settings_of_switches][Layout(system).turns] = 0.0
    return settings


class Layout:
    """The stops and frictions of a model, and the places of their settings among all of these.

    Attributes
    ----------
    n_stops, n_frictions : int
        A friction with two directions counts twice.
    closed, stuck, sense : ndarray of int
        Places, by stop, and by friction twice.
    circles : ndarray of int, shape (n, 2)
        The numbers, among the frictions, of both directions of those that have two.
    turns, aimed, angle, bound : ndarray of int, shape (n,)
        Places, by circle.
    """

    def __init__(self, system: System):
        places: dict[str, list[int]] = {}
        count = 0
        for switch in system.switches:
            for key in settings_of(switch):
                places.setdefault(key, []).append(count)
                count += 1
        for key in ("closed", "stuck", "sense", "turns", "aimed", "angle", "bound"):
            setattr(self, key, np.array(places.get(key, ()), dtype=int))
        frictions = [switch for switch in system.switches if switch["kind"] == "friction"]
        self.n_stops, self.n_frictions, self.n_settings = len(self.closed), len(frictions), count
        first = [k for k, switch in enumerate(frictions) if switch.get("axis") == 1]
        self.circles = np.array([(k, k + 1) for k in first], dtype=int).reshape(-1, 2)

    def turning(self, settings: np.ndarray) -> np.ndarray:
        """Which frictions, by direction, turn with the motion."""
        return self._of_both(settings[..., self.turns] != 0.0)

    def aiming(self, settings: np.ndarray) -> np.ndarray:
        """Which frictions, by direction, are aimed."""
        return self._of_both(settings[..., self.aimed] != 0.0)

    def _of_both(self, of_circles: np.ndarray) -> np.ndarray:
        found = np.zeros((*of_circles.shape[:-1], self.n_frictions), dtype=bool)
        for axis in range(2):
            found[..., self.circles[:, axis]] = of_circles
        return found

    def together(self, values: np.ndarray) -> np.ndarray:
        """Return values by friction, shape (..., n_frictions), with the length of the vector where there are two."""
        if not len(self.circles):
            return values
        sizes = values.copy()
        for i, j in self.circles:
            sizes[..., i] = sizes[..., j] = np.hypot(values[..., i], values[..., j])
        return sizes

    def directions(self, speeds: np.ndarray, senses: np.ndarray, turning: np.ndarray) -> np.ndarray:
        """Return the part of its size with which each friction acts against its speed, shape (..., n_frictions).

        What turns acts against the sliding velocity; beyond rest, on the other side of the senses, as it did before.

        Parameters
        ----------
        speeds, senses : ndarray, shape (..., n_frictions)
        turning : ndarray of bool, shape (n_frictions,)
        """
        if not turning.any():
            return senses
        found = np.broadcast_to(senses, speeds.shape).copy()
        for i, j in self.circles[turning[self.circles[:, 0]]]:
            e1, e2 = senses[..., i], senses[..., j]
            s1, s2 = speeds[..., i] + _NO_SPEED * e1, speeds[..., j] + _NO_SPEED * e2
            size = np.sqrt(s1 * s1 + s2 * s2 + _NO_SPEED**2)
            onward = np.sign(e1 * s1 + e2 * s2 + _OPPOSITE * size)
            found[..., i], found[..., j] = onward * s1 / size, onward * s2 / size
        return found

    def turned(self, senses: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Return the rotation of rows of stops and frictions, shape (n, n), into axes along and across some senses."""
        n = self.n_stops + self.n_frictions
        rotation = np.eye(n)
        for i, j in self.circles[which[self.circles[:, 0]]] + self.n_stops:
            e1, e2 = senses[[i - self.n_stops, j - self.n_stops]]
            rotation[np.ix_([i, j], [i, j])] = [[e1, e2], [-e2, e1]]
        return rotation
