"""The polynomials of dense output: fitting its rows to data, and the rows of a derivative."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Polynomial

N_ROWS = 8


def nested_basis(n_rows: int = N_ROWS) -> list[Polynomial]:
    """Return the factors of the rows of dense output: 1, θ, θ(1-θ), θ²(1-θ), … (see `dense.evaluate_dense`)."""
    basis = [Polynomial([1.0])]
    for k in range(1, n_rows):
        basis.append(basis[-1] * Polynomial([0.0, 1.0] if k % 2 else [1.0, -1.0]))
    return basis


def values(conditions: Sequence[tuple[int, float]], n_rows: int = N_ROWS) -> np.ndarray:
    """Return what each row contributes to each condition.

    Parameters
    ----------
    conditions : sequence of (int, float)
        Order of a derivative by θ, and θ.
    n_rows : int

    Returns
    -------
    ndarray, shape (len(conditions), n_rows)
    """
    basis = nested_basis(n_rows)
    return np.array(
        [[b.deriv(order)(place) if order else b(place) for b in basis] for order, place in conditions]
    )


def fit_rows(conditions: Sequence[tuple[int, float]]) -> np.ndarray:
    """Return the matrix from as many conditions on y(θ) - (1-θ) y(0) - θ y(1) to the rows from the third on.

    Raises
    ------
    ValueError
        The conditions do not determine the rows.
    """
    matrix = values(conditions, 2 + len(conditions))[:, 2:]
    if np.linalg.cond(matrix) > 1e6:
        raise ValueError(f"dense output is not determined by {conditions}")
    return np.linalg.inv(matrix)


def rows_of(polynomials: Sequence[Polynomial], n_rows: int = N_ROWS) -> np.ndarray:
    """Return the rows of each polynomial, of degree below `n_rows`: shape (n_rows, len(polynomials))."""
    powers = np.zeros((n_rows, n_rows))
    for k, b in enumerate(nested_basis(n_rows)):
        powers[: k + 1, k] = b.coef
    wanted = np.zeros((n_rows, len(polynomials)))
    for j, polynomial in enumerate(polynomials):
        wanted[: len(polynomial.coef), j] = polynomial.coef
    return np.linalg.solve(powers, wanted)


def rows_of_derivative(n_rows: int = N_ROWS) -> np.ndarray:
    """Return the matrix from the rows of a polynomial to those of its derivative by θ."""
    return rows_of([b.deriv() for b in nested_basis(n_rows)], n_rows)
