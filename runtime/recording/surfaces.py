"""Planes and surfaces that something rolls on or touches, as nets of lines where the run has been."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.recording.recording import Quantities

if TYPE_CHECKING:
    from .marks import Mark, Surroundings

_MARGIN, _LEAST = 0.15, 0.04  # beyond where bodies were: of their way, and of the scene's diagonal
_LINES, _ALONG = 13, 49  # of a net in each direction, and places along each of them
_CURVE = 301  # places along the curve of a planar model


class Net:
    """The net of one surface; it grows with the ways of the bodies on it.

    Parameters
    ----------
    mark : Mark
        Of the kind "surface".
    numbers : ndarray, shape (10,)
        Of it at the start: origin [m], directions of x and y, the height [m] over the place (y[0], y[1]).
    """

    def __init__(self, mark: Mark, numbers: np.ndarray) -> None:
        self.mark = mark
        self._origin, self._axes = numbers[:3], numbers[3:9].reshape(2, 3)
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)

    def take(self, around: Surroundings, positions: np.ndarray, rotations: np.ndarray) -> None:
        """Grow with some frames: positions, shape (n, bodies, 3) [m], and rotations (n, bodies, 3, 3) of the bodies."""
        origin, axes = self._origin[None], self._axes[None]
        if self.mark.body:
            own = around.index[self.mark.body]
            origin = positions[:, own] + rotations[:, own] @ self._origin
            axes = np.einsum("nij,kj->nki", rotations[:, own], self._axes)
        for name in self.mark.carries:
            places = np.einsum("nki,ni->nk", axes, positions[:, around.index[name]] - origin)
            places = places[np.isfinite(places).all(axis=1)]
            if len(places):
                self._low = np.minimum(self._low, places.min(axis=0))
                self._high = np.maximum(self._high, places.max(axis=0))

    def lines(
        self, of: Quantities, t: float, y: np.ndarray, planar: bool, diagonal: float
    ) -> list[np.ndarray]:
        """Return the lines, shape (places, 3) each [m], in the body's axes; none where nothing was on it.

        Parameters
        ----------
        of : Quantities
        t, y : float [s], ndarray
            Of any frame.
        """
        if not np.isfinite([self._low, self._high]).all():
            return []
        beyond = np.maximum(_MARGIN * (self._high - self._low), _LEAST * diagonal)
        low, high = self._low - beyond, self._high + beyond
        if planar:
            along = np.linspace(low[0], high[0], _CURVE)
            up = self._axes[1]
            places = np.stack([along, np.zeros_like(along)], axis=1)[None]
        else:
            up = np.cross(*self._axes)
            places = np.concatenate([_rows(low, high), _rows(low[::-1], high[::-1])[:, :, ::-1]])
        heights = self._heights(of, t, y, places.reshape(-1, 2)).reshape(places.shape[:2])
        flat = places[:, :, :1] * self._axes[0]
        if not planar:
            flat = flat + places[:, :, 1:] * self._axes[1]
        net = self._origin + flat + heights[:, :, None] * up
        return [line for line in net if np.isfinite(line).all()]

    def _heights(self, of: Quantities, t: float, y: np.ndarray, places: np.ndarray) -> np.ndarray:
        """The heights [m] over places, shape (n, 2) [m]: the module has them over (y[0], y[1])."""
        states = np.tile(y, (len(places), 1))
        n = min(2, states.shape[1])
        states[:, :n] = places[:, :n]
        return of.evaluate("marks", np.full(len(places), t), states)[:, self.mark.columns][:, 9]


def _rows(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Lines along x, shape (lines, places, 2) [m]."""
    along, across = np.linspace(low[0], high[0], _ALONG), np.linspace(low[1], high[1], _LINES)
    return np.stack(np.broadcast_arrays(along[None, :], across[:, None]), axis=2)
