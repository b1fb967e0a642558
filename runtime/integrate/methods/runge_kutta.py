"""Explicit methods of fixed step: Euler's and the classical one of Runge and Kutta."""

import functools

from symgen.runtime.integrate.explicit.method import explicit_runge_kutta
from symgen.runtime.integrate.explicit.tableau import ErkTableau, erk_tableau


@functools.cache
def euler() -> ErkTableau:
    """Return the explicit Euler method."""
    return erk_tableau([[]], [1.0], 1)


@functools.cache
def rk4() -> ErkTableau:
    """Return the classical Runge-Kutta method of order 4 (Kutta 1901)."""
    return erk_tableau([[], [0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6], 4)


RECORDS = (
    *explicit_runge_kutta(
        "euler",
        euler,
        order=1,
        dense_order=1,
        evaluations=1,
        purpose="teaching",
        adaptive=False,
        oscillation_error=1 / 2,
        # In a step the drift is multiplied by a matrix with the eigenvalues 0.25 ± 0.19i: the gains that do the same as
        # those of other methods (1, 2) would let velocity constraints swing.
        gains=(0.6, 1.5),
        partitioned=False,
    ),
    *explicit_runge_kutta(
        "rk4",
        rk4,
        order=4,
        dense_order=3,
        evaluations=4,
        purpose="comparisons, real-time steps",
        adaptive=False,
        oscillation_error=1 / 120,
    ),
)
