"""Which coordinates and rates are independent, and how the others follow from them, to first order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_RANK_TOLERANCE = 1e-9  # of a row of unit length
_PREFERENCE = 8.0  # by how much a guess is rather made dependent than a value that the user gave


class Independent(NamedTuple):
    """Independent small motions.

    Attributes
    ----------
    positions, rates : ndarray of int
        Which of what rates move, and which rates, are independent.
    position_basis : ndarray, shape (nv, number of positions)
        All small displacements, from the independent ones.
    rates_by_positions, rates_by_rates : ndarray, shape (nv, …)
        All small changes of rates, from independent displacements and rates.
    """

    positions: np.ndarray
    rates: np.ndarray
    position_basis: np.ndarray
    rates_by_positions: np.ndarray
    rates_by_rates: np.ndarray


def independent_motions(
    jacobian: np.ndarray,
    by_positions: np.ndarray,
    n_holonomic: int,
    sizes: np.ndarray,
    given: tuple[np.ndarray, np.ndarray],
) -> Independent:
    """Choose independent coordinates by pivots, so that each keeps its name, and solve for the others.

    Small motions (δ, ν) satisfy G₁ δ = 0 for the holonomic rows G₁ of G, and G ν + H δ = 0: velocity constraints
    bind rates alone, so there may be more independent positions than rates.

    Parameters
    ----------
    jacobian, by_positions : ndarray, shape (m, nv)
        G and H; holonomic rows first.
    n_holonomic : int
    sizes : ndarray, shape (nv,)
        What counts as large for each coordinate.
    given : pair of ndarray of bool, shape (nv,)
        Positions and rates that the user gave rather than guessed: these stay independent where the choice is free.
    """
    nv = jacobian.shape[1]
    scaled = jacobian * sizes
    bound, rows = _pivots(scaled * np.where(given[0], 1.0, _PREFERENCE), n_holonomic)
    bound_rates, all_rows = _pivots(scaled * np.where(given[1], 1.0, _PREFERENCE), len(scaled))
    positions = np.setdiff1d(np.arange(nv), bound)
    rates = np.setdiff1d(np.arange(nv), bound_rates)
    basis = np.zeros((nv, len(positions)))
    basis[positions] = np.eye(len(positions))
    basis[bound] = _follow(jacobian[rows], bound, -jacobian[rows][:, positions])
    by_rates, by_places = np.zeros((nv, len(rates))), np.zeros((nv, len(positions)))
    by_rates[rates] = np.eye(len(rates))
    by_rates[bound_rates] = _follow(jacobian[all_rows], bound_rates, -jacobian[all_rows][:, rates])
    by_places[bound_rates] = _follow(jacobian[all_rows], bound_rates, -by_positions[all_rows] @ basis)
    return Independent(positions, rates, basis, by_places, by_rates)


def _pivots(matrix: np.ndarray, n_rows: int) -> tuple[list[int], list[int]]:
    """Return columns and rows of a largest regular block in the first rows.

    Gaussian elimination with complete pivoting; of equal candidates the last column becomes dependent.
    """
    work = matrix[:n_rows].copy()
    norms = np.linalg.norm(work, axis=1, keepdims=True)
    work = np.divide(work, norms, out=np.zeros_like(work), where=norms > 0.0)
    columns: list[int] = []
    rows: list[int] = []
    while work.size:
        left = np.abs(work[:, ::-1])
        left[rows] = 0.0
        row, back = np.unravel_index(np.argmax(left >= left.max() * (1.0 - 1e-12)), left.shape)
        if left[row, back] <= _RANK_TOLERANCE:
            break
        rows.append(int(row))
        columns.append(int(work.shape[1] - 1 - back))
        _eliminate(work, rows[-1], columns[-1])
    return columns, rows


def _eliminate(work: np.ndarray, row: int, column: int) -> None:
    factors = work[:, column] / work[row, column]
    factors[row] = 0.0
    work -= np.outer(factors, work[row])
    work[factors != 0.0, column] = 0.0


def _follow(rows: np.ndarray, bound: list[int], right: np.ndarray) -> np.ndarray:
    return np.linalg.solve(rows[:, bound], right) if bound else right
