"""A function of time in pieces, each a polynomial: what tables, polynomials and sampled values become."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SAME_SLOPE = 1e-9  # likewise of slopes, which are differences over short times
_SAME = 1e-12  # a difference at a knot, in parts of the largest value, that is round-off and no jump


@dataclass(frozen=True)
class Pieces:
    """Piece k is the sum of coefficients[k, j] (t - knots[k])^j; it holds from its knot to the next.

    The first piece also holds before its knot, the last one for ever.

    Attributes
    ----------
    knots : ndarray, shape (n,) [s]
        Ascending.
    coefficients : ndarray, shape (n, degree + 1)
    """

    knots: np.ndarray
    coefficients: np.ndarray

    @property
    def degree(self) -> int:
        """Of the polynomials."""
        return self.coefficients.shape[1] - 1

    @property
    def breaks(self) -> np.ndarray:
        """Times [s] at which one piece ends and the next begins."""
        return self.knots[1:]

    def piece_at(self, t: float) -> int:
        """Return the number of the piece that holds at `t`; at a break, the one that begins."""
        return max(0, int(np.searchsorted(self.knots, t, side="right")) - 1)

    def jumps(self) -> np.ndarray:
        """Return at which breaks the value itself jumps, shape (n - 1,)."""
        width, before = np.diff(self.knots), self.coefficients[:-1]
        value = np.zeros(len(width))
        for j in range(self.degree, -1, -1):
            value = value * width + before[:, j]
        largest = np.abs(self.coefficients[:, 0]).max(initial=0.0)
        return np.abs(self.coefficients[1:, 0] - value) > _SAME * largest

    def kinks(self) -> np.ndarray:
        """Return at which breaks the value or its slope jumps, shape (n - 1,)."""
        width, before = np.diff(self.knots), self.coefficients[:-1]
        slope = np.zeros(len(width))
        for j in range(self.degree, 0, -1):
            slope = slope * width + j * before[:, j]
        after = self.coefficients[1:, 1] if self.degree else slope
        largest = max(np.abs(slope).max(initial=0.0), np.abs(after).max(initial=0.0))
        return self.jumps() | (np.abs(after - slope) > _SAME_SLOPE * largest)

    def merged(self) -> Pieces:
        """Return the same function without breaks between pieces that are one constant."""
        flat = ~self.coefficients[:, 1:].any(axis=1)
        same = flat[1:] & flat[:-1] & (self.coefficients[1:, 0] == self.coefficients[:-1, 0])
        kept = np.concatenate([[True], ~same])
        return Pieces(self.knots[kept], self.coefficients[kept])
