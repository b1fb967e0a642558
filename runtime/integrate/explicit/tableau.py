"""Coefficients of an explicit Runge-Kutta method, validated when they are made."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# How a tableau estimates its error.
NO_ESTIMATE, ONE_ESTIMATE, TWO_ESTIMATES = range(3)

# Hairer has 0.9. On motions of mechanisms, whose error comes and goes, dop853 has every sixth step rejected then; with
# this, the same error takes 7 % fewer evaluations, and 4 % fewer with dopri5 (benchmarks/step_safety.py).
SAFETY = 0.75


class ErkTableau(NamedTuple):
    """An explicit Runge-Kutta method as jitted loops take it.

    Row `n_stages - fsal` of the stage derivatives belongs to the new state; rows after `n_stages` are the further
    stages of the dense output.

    Attributes
    ----------
    a : ndarray, shape (n_rows, n_rows)
        Stage coefficients; strictly lower triangular. Row `n_stages` is `b` where the method is not FSAL.
    b, c : ndarray, shapes (n_stages,), (n_rows,)
    error : ndarray, shape (2, n_stages)
        Error estimates: the first row, or (fifth order, third order) of dop853.
    dense : ndarray, shape (n_dense - 4, n_rows)
        Rows 4 and on of the dense output, as combinations of stage derivatives times h.
    n_stages, n_rows, n_dense, order : int
    estimate : int
        NO_ESTIMATE (fixed step), ONE_ESTIMATE, TWO_ESTIMATES (dop853).
    fsal : int
        1 where the last stage is taken at the new state.
    exponent, beta, shrink, grow, safety : float
        Hairer's step controller: `h_new = h safety / (err^exponent / err_old^beta)`, within [shrink, grow].
    stiff_bound : float
        Radius of the stability region on the negative real axis, as Hairer's stiffness test takes it.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    error: np.ndarray
    dense: np.ndarray
    n_stages: int
    n_rows: int
    n_dense: int
    order: int
    estimate: int
    fsal: int
    exponent: float
    beta: float
    shrink: float
    grow: float
    safety: float
    stiff_bound: float


class Control(NamedTuple):
    """How an adaptive method chooses its steps.

    Attributes
    ----------
    error_order : int
        The controller's exponent is 1 / error_order - 0.75 beta for one estimate, -0.2 beta for two
        (dopri5.f, dop853.f).
    stiff_bound, beta : float
        See `ErkTableau`.
    limits : (float, float)
        By how much a step may shrink and grow.
    """

    error_order: int = 0
    stiff_bound: float = 0.0
    beta: float = 0.0
    limits: tuple[float, float] = (0.2, 10.0)


_FIXED = Control()


def erk_tableau(a, b, order, *, extra=(), error=(), dense=(), control=_FIXED) -> ErkTableau:
    """Return a checked tableau; nodes and FSAL are derived from the coefficients.

    Parameters
    ----------
    a, b : sequence of rows, sequence
        Stage coefficients (row s has s entries) and weights.
    order : int
    extra : sequence of rows
        Further stages of the dense output; they may use the derivative at the new state as entry `n_stages`.
    error : sequence of rows
        None, one or two error estimates.
    dense : sequence of rows
        Beyond cubic Hermite.
    control : Control

    Raises
    ------
    ValueError
        Where shapes, row sums or weights contradict each other.
    """
    n, beta = len(b), control.beta
    b = np.array(b, dtype=float)
    fsal = int(np.array_equal(np.append(np.array(a[-1], dtype=float), 0.0), b) and n > 1)
    n_rows = n + 1 - fsal + len(extra)
    matrix = np.zeros((n_rows, n_rows))
    for s, row in enumerate(a):
        if len(row) != s:
            raise ValueError(f"stage {s} has {len(row)} coefficients; an explicit stage has {s}")
        matrix[s, :s] = row
    if not fsal:
        matrix[n, :n] = b
    for s, row in enumerate(extra, start=n + 1 - fsal):
        matrix[s, : len(row)] = row
    errors = np.zeros((2, n))
    for s, row in enumerate(error):
        errors[s] = row
    tableau = ErkTableau(
        a=matrix,
        b=b,
        c=matrix.sum(axis=1),
        error=errors,
        dense=np.array(dense, dtype=float).reshape(len(dense), n_rows),
        n_stages=n,
        n_rows=n_rows,
        n_dense=4 + len(dense) if order > 1 else 2,  # of order 1: the polygon
        order=order,
        estimate=len(error),
        fsal=fsal,
        exponent=(1.0 / control.error_order - (0.2 if len(error) == 2 else 0.75) * beta) if error else 0.0,
        beta=beta,
        shrink=control.limits[0],
        grow=control.limits[1],
        safety=SAFETY,
        stiff_bound=control.stiff_bound,
    )
    validate(tableau)
    return tableau


def validate(tableau: ErkTableau) -> None:
    """Raise ValueError where a tableau contradicts itself."""
    if np.any(np.triu(tableau.a)):
        raise ValueError("an explicit method's coefficients must be strictly lower triangular")
    if abs(tableau.b.sum() - 1.0) > 1e-14:
        raise ValueError(f"the weights sum to {tableau.b.sum()!r}, not to 1")
    if np.any(np.abs(tableau.error.sum(axis=1)) > 1e-14):
        raise ValueError("the coefficients of an error estimate must sum to 0")
    if np.any(np.abs(tableau.dense.sum(axis=1)) > 1e-11):
        raise ValueError("the coefficients of dense output beyond cubic Hermite must sum to 0")
    if not np.all((tableau.c >= 0) & (tableau.c < 1.0 + 1e-14)):
        raise ValueError(f"nodes must lie in the step, not at {tableau.c}")
