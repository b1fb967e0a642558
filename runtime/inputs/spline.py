"""The cubic spline through a table's values: twice continuously differentiable, not-a-knot at its ends."""

from __future__ import annotations

import numpy as np


def cubic_spline(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the coefficients of each piece in powers of t - t[k], shape (n - 1, 4).

    Slopes at the times from the continuity of second derivatives, and of the third at the second and the last but one
    time (not-a-knot): de Boor, A Practical Guide to Splines (1978), ch. IV. Three times give a parabola, two a line.

    Parameters
    ----------
    t, x : ndarray, shape (n,), n ≥ 2
    """
    h = np.diff(t)
    chord = np.diff(x) / h
    if len(t) == 2:
        slopes = np.repeat(chord, 2)
    elif len(t) == 3:
        curve = (chord[1] - chord[0]) / (t[2] - t[0])
        slopes = np.array([chord[0] - h[0] * curve, chord[0] + h[0] * curve, chord[1] + h[1] * curve])
    else:
        slopes = _slopes(t, h, chord)
    rise = (slopes[:-1] + slopes[1:] - 2.0 * chord) / h
    return np.column_stack([x[:-1], slopes[:-1], (chord - slopes[:-1]) / h - rise, rise / h])


def _slopes(t: np.ndarray, h: np.ndarray, chord: np.ndarray) -> np.ndarray:
    """The slopes at all times, by a tridiagonal system."""
    n = len(t)
    below, diagonal, above, right = (np.zeros(n) for _ in range(4))
    below[1:-1], diagonal[1:-1], above[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * (h[1:] * chord[:-1] + h[:-1] * chord[1:])
    diagonal[0], above[0] = h[1], t[2] - t[0]
    right[0] = ((h[0] + 2.0 * above[0]) * h[1] * chord[0] + h[0] ** 2 * chord[1]) / above[0]
    diagonal[-1], below[-1] = h[-2], t[-1] - t[-3]
    right[-1] = (h[-1] ** 2 * chord[-2] + (2.0 * below[-1] + h[-1]) * h[-2] * chord[-1]) / below[-1]
    for i in range(1, n):  # diagonally dominant but for the ends, where elimination keeps its pivots too
        factor = below[i] / diagonal[i - 1]
        diagonal[i] -= factor * above[i - 1]
        right[i] -= factor * right[i - 1]
    for i in range(n - 1, -1, -1):
        right[i] = (right[i] - (above[i] * right[i + 1] if i < n - 1 else 0.0)) / diagonal[i]
    return right
