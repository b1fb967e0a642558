"""RATTLE steps of a composition, and the rows of its dense output."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symgen.runtime.integrate.nested_basis import fit_rows, rows_of_derivative
from symgen.runtime.integrate.symplectic.composition_coefficients import composition

_ENDS = [(1, 0.0), (1, 1.0), (2, 0.0), (2, 1.0)]


class Rattle(NamedTuple):
    """A symmetric composition of RATTLE steps.

    Attributes
    ----------
    steps : ndarray, shape (s,)
        Their lengths, in units of h.
    times : ndarray, shape (s + 1,)
        Where they begin and end, from 0 to 1.
    constant_mass : int
        1 where M does not depend on positions: momenta then need no derivatives of it.
    bends : ndarray, shape (4, 4)
        From (h v0 - Δq, h v1 - Δq, h² a0, h² a1) to rows 2 to 5 of the positions' dense output.
    rates : ndarray, shape (5, 4)
        From these to rows 2 to 6 of h times the velocities.
    """

    steps: np.ndarray
    times: np.ndarray
    constant_mass: int
    bends: np.ndarray
    rates: np.ndarray


def rattle(order: int, constant_mass: bool) -> Rattle:
    """Return the composition of order 2 (RATTLE itself), 4 or 6."""
    if order == 2:
        steps, times = np.array([1.0]), np.array([0.0, 1.0])
    else:
        steps, _, times = composition(order)[:3]
    rates = np.ascontiguousarray(rows_of_derivative()[2:7, 2:6])
    return Rattle(steps, times, int(constant_mass), np.ascontiguousarray(fit_rows(_ENDS)), rates)
