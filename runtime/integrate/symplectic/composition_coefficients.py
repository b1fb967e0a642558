"""Coefficients of the symmetric compositions of Verlet steps, and of their dense output."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symgen.runtime.integrate.nested_basis import fit_rows, rows_of_derivative, values

# The first half of each palindrome and its middle: steps of Verlet, in units of the whole step.
# Order 4, 5 stages: Suzuki, Phys. Lett. A 146 (1990) 319. Orders 6 and 8, 9 and 17 stages: Kahan, Li, Math. Comp. 66
# (1997) 1089, with the digits of Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), V.3.2, (3.12), (3.14).
_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
HALVES = {
    4: (_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI),
    6: (
        0.39216144400731413927925056,
        0.33259913678935943859974864,
        -0.70624617255763935980996482,
        0.08221359629355080023149045,
        0.79854399093482996339895035,
    ),
    8: (
        0.13020248308889008087881763,
        0.56116298177510838456196441,
        -0.38947496264484728640807860,
        0.15884190655515560089621075,
        -0.39590389413323757733623154,
        0.18453964097831570709183254,
        0.25837438768632204729397911,
        0.29501172360931029887096624,
        -0.60550853383003451169892108,
    ),
}

# Where dense output takes two more accelerations.
PLACES = (1.0 / 3.0, 2.0 / 3.0)
_ENDS = [(1, 0.0), (1, 1.0)]
_POSITIONS = [*_ENDS, (2, 0.0), (2, 1.0)]
_BETWEEN = [(0, place) for place in PLACES] + [(1, place) for place in PLACES]


class Composition(NamedTuple):
    """A symmetric composition of velocity Verlet steps.

    Attributes
    ----------
    drifts : ndarray, shape (s,)
        Lengths of the Verlet steps, in units of h; positions and time move with these.
    kicks : ndarray, shape (s + 1,)
        Velocities move with these, before, between and after the drifts.
    times : ndarray, shape (s + 1,)
        Of the kicks, from 0 to 1.
    bends : ndarray, shape (6, 6)
        From (h v0 - Δq, h v1 - Δq, h² a0, h² a1, h² a(1/3), h² a(2/3)) to rows 2 to 7 of the positions' dense output.
    between : ndarray, shape (4, 4)
        From the first four of these to q - q0 - θ Δq at 1/3 and 2/3, then its derivatives by θ there.
    rates : ndarray, shape (5, 6)
        From rows 2 to 7 of the positions to rows 2 to 6 of h times the velocities.
    work : ndarray, shape (4, 4)
        From h P - Δw at 0, 1, 1/3 and 2/3 to rows 2 to 5 of the work.
    """

    drifts: np.ndarray
    kicks: np.ndarray
    times: np.ndarray
    bends: np.ndarray
    between: np.ndarray
    rates: np.ndarray
    work: np.ndarray


def composition(order: int) -> Composition:
    """Return the composition of order 4, 6 or 8.

    Raises
    ------
    ValueError
        Where the coefficients do not sum to 1.
    """
    drifts = np.array(parts(order))
    if abs(drifts.sum() - 1.0) > 1e-14:
        raise ValueError(f"the steps of a composition must sum to 1, not to {drifts.sum()!r}")
    kicks = 0.5 * (np.append(0.0, drifts) + np.append(drifts, 0.0))
    times = np.append(0.0, np.cumsum(drifts))
    times[-1] = 1.0
    between = values(_BETWEEN, 6)[:, 2:] @ fit_rows(_POSITIONS)
    return Composition(
        drifts,
        kicks,
        times,
        bends=fit_rows([*_POSITIONS, (2, PLACES[0]), (2, PLACES[1])]),
        between=between,
        rates=np.ascontiguousarray(rows_of_derivative()[2:7, 2:]),
        work=fit_rows([*_ENDS, (1, PLACES[0]), (1, PLACES[1])]),
    )


def parts(order: int) -> tuple[float, ...]:
    """Return the lengths of the Verlet steps that one step of order 2, 4, 6 or 8 is made of, in parts of it."""
    if order == 2:
        return (1.0,)
    return (*HALVES[order], *HALVES[order][-2::-1])
