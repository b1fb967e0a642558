"""Linear complementarity by Lemke's method."""

from __future__ import annotations

import numpy as np

_ROUND_OFF = 1e-12  # of the largest number in the tableau
_PIVOTS_PER_ROW = 50


class NoSolution(Exception):
    """The complementarity problem has no solution, or none that pivoting reaches."""


def lemke(matrix: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Find z >= 0 with w = matrix z + q >= 0 and w z = 0.

    Lemke's complementary pivoting: Cottle, Pang, Stone, The Linear Complementarity Problem, algorithm 4.4.5, ties
    broken by the lexicographic rule of 4.9. It ends in a solution for every positive semidefinite matrix for which
    some z >= 0 has w >= 0.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
    q : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    NoSolution
    """
    n = len(q)
    # Rows and columns scaled alike: impulses of masses far apart are compared with each other.
    scale = 1.0 / np.sqrt(np.where(np.diag(matrix) > 0.0, np.diag(matrix), 1.0))
    size = float(np.abs(q * scale).max(initial=0.0))
    if not np.isfinite(size):
        raise NoSolution
    if n == 0 or (q >= 0.0).all():
        return np.zeros(n)
    # Columns: right-hand side, w, z, and z0, which makes all w positive at first.
    tableau = np.hstack(
        [(q * scale / size)[:, None], np.eye(n), -(matrix * np.outer(scale, scale)), -np.ones((n, 1))]
    )
    basis, artificial = np.arange(n), 2 * n
    row, entering = int(np.argmin(tableau[:, 0])), artificial
    for _ in range(_PIVOTS_PER_ROW * (n + 1)):
        tableau[row] /= tableau[row, 1 + entering]
        others = np.arange(n) != row
        tableau[others] -= np.outer(tableau[others, 1 + entering], tableau[row])
        leaving, basis[row] = int(basis[row]), entering
        if leaving == artificial:
            z = np.zeros(2 * n + 1)
            z[basis] = np.maximum(tableau[:, 0], 0.0)
            return z[n : 2 * n] * scale * size
        entering = leaving + n if leaving < n else leaving - n
        row = _leaving_row(tableau, 1 + entering, basis, artificial)
    raise NoSolution


def _leaving_row(tableau: np.ndarray, column: int, basis: np.ndarray, artificial: int) -> int:
    entries = tableau[:, column]
    rows = np.flatnonzero(entries > _ROUND_OFF)
    if len(rows) == 0:
        raise NoSolution
    ratios = tableau[rows, 0] / entries[rows]
    rows = rows[ratios <= ratios.min() + _ROUND_OFF]
    if artificial in basis[rows]:
        return int(rows[basis[rows] == artificial][0])
    for k in range(1, 1 + len(basis)):
        if len(rows) == 1:
            break
        ratios = tableau[rows, k] / entries[rows]
        rows = rows[ratios <= ratios.min() + _ROUND_OFF]
    return int(rows[0])
