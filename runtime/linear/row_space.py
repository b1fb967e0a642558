"""What rows span, and what is left over, from one factorisation: of Gᵀ = Q R by pivots."""

from __future__ import annotations

import numpy as np

_RANK_TOLERANCE = 1e-8  # of the first pivot


class RowSpace:
    """The rows of a matrix G, dependent ones allowed.

    Parameters
    ----------
    rows : ndarray, shape (m, n)
    """

    def __init__(self, rows: np.ndarray):
        self._m, self._n = rows.shape
        if not rows.size or not rows.any():
            self.rank, self._q = 0, np.eye(self._n)
            return
        from scipy.linalg import qr

        self._q, triangle, self._order = qr(rows.T, pivoting=True)
        pivots = np.abs(np.diag(triangle))
        self.rank = int(np.sum(pivots > _RANK_TOLERANCE * pivots[0]))
        self._triangle = triangle[: self.rank, : self.rank]

    def null_space(self) -> np.ndarray:
        """Return an orthonormal basis of all x with G x = 0, shape (n, n - rank)."""
        return self._q[:, self.rank :]

    def least_norm(self, values: np.ndarray) -> np.ndarray:
        """Return the smallest x with G x = values, for the independent rows, shape (n,)."""
        if not self.rank:
            return np.zeros(self._n)
        wanted = values[self._order[: self.rank]]
        return self._q[:, : self.rank] @ np.linalg.solve(self._triangle.T, wanted)

    def combination(self, x: np.ndarray) -> np.ndarray:
        """Return factors of the independent rows whose sum is nearest to x, shape (m,)."""
        factors = np.zeros(self._m)
        if self.rank:
            factors[self._order[: self.rank]] = np.linalg.solve(self._triangle, self._q[:, : self.rank].T @ x)
        return factors
