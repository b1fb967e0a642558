"""Forces (or impulses) of stops and dry frictions at one instant: Coulomb's law in the line of each friction.

The forces x of stops are x >= 0, with no acceleration against them where they are not zero; those of frictions lie
between -L and L, with no acceleration there where they lie between. L is given, or in proportion to a normal force that
is one of x, or the magnitude of some constraints' multipliers. The latter is linearised about the last solution.
With z = x for stops, and z = x + L for frictions, this is a linear complementarity problem: Glocker, Pfeiffer,
Multibody Dynamics with Unilateral Contacts, 1996, ch. 5. Where frictions follow forces, its matrix is not symmetric,
and Painlevé's paradox shows in its principal minors. With friction that sticks in two directions it is a nonlinear one,
see `circles.py`.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from symgen.runtime.contact.circles import ContactLaw, circle_forces
from symgen.runtime.contact.levels import Levels, NoSolution, Paradox
from symgen.runtime.contact.local_dynamics import LocalDynamics, parts_of

NO_CIRCLES = np.zeros((0, 2), dtype=int)
_ROUND_OFF = 1e-12  # of the largest number in the tableau
_PIVOTS_PER_ROW = 50


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


_MOST_PASSES = 50
_CONVERGED = 1e-13
_REGULAR = 1e-9  # of a minor without friction
_DEPENDENT = 1e-10  # minors of rows scaled to 1: these stops depend on each other
_MOST_STOPS, _MOST_MINORS = (
    10,
    5000,
)  # up to so many stops, or sets of some that can be independent, all are looked at


def coulomb_forces(
    here: LocalDynamics,
    free: np.ndarray,
    acting: np.ndarray,
    senses: np.ndarray,
    levels: Levels,
    *,
    circles: np.ndarray = NO_CIRCLES,
    driven: bool = True,
    briefly: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Find the forces of stops and frictions, and the levels of frictions.

    Parameters
    ----------
    here : LocalDynamics
    free : ndarray, shape (n,)
        Accelerations of gaps and slidings without these forces (or rates, for impulses).
    acting : ndarray of bool, shape (n,)
        Stops that touch, frictions that do not slide.
    senses : ndarray, shape (k,)
        In which direction the others slide: what follows a normal force is part of x; other levels are in `free`.
    levels : Levels
    circles : ndarray of int, shape (number of frictions with two directions, 2)
        Which of the frictions are the directions of one.
    driven : bool
        Whether constraints have reactions without these forces; impulses have not.
    briefly : bool
        Whether a search in circles gives up soon, where it mostly finds nothing.

    Returns
    -------
    forces : ndarray, shape (n,)
    levels : ndarray, shape (k,)

    Raises
    ------
    symgen.runtime.contact.coulomb.NoSolution
    Paradox
    """
    n, k = len(free), len(levels.fixed)
    if not k:
        return stop_forces(here.compliance, free, acting), np.zeros(0)
    n_stops = n - k
    still = acting[n_stops:]
    if still[circles].any():
        law = ContactLaw(here, free, acting, senses, levels, circles, driven)
        return circle_forces(law, briefly=briefly)
    shift = np.where(still, 1.0, np.where(levels.coefficients > 0.0, senses, 0.0))
    x = np.zeros(n)
    for _ in range(_MOST_PASSES):
        c, slope = levels.linear(here, x, float(driven))
        before = x
        x = _linear_forces(here.compliance, free, acting, shift, c, slope)
        if np.abs(x - before).max(initial=0.0) <= _CONVERGED * np.abs(x).max(initial=0.0):
            break
        if not any(len(rows) for _, rows in levels.normals):
            break
    else:
        raise Paradox
    return x, c + slope @ x


def stop_forces(compliance: np.ndarray, free: np.ndarray, acting: np.ndarray) -> np.ndarray:
    """Return the forces of stops alone, shape (n,): what `_linear_forces` gives without frictions, to the bit."""
    x, places = np.zeros(len(free)), np.flatnonzero(acting)
    if len(places) == 1:
        (i,) = places
        x[i] = _lone(float(compliance[i, i]), float(free[i]))
    elif len(places):
        x[places] = _by_parts(compliance[np.ix_(places, places)], free[places])
    return x


def _lone(own: float, q: float) -> float:
    """Return what `lemke` finds for one row: -q / own in its scale, or 0 where q is not negative."""
    if q >= 0.0 and math.isfinite(q):
        return 0.0
    scale = 1.0 / math.sqrt(own) if own > 0.0 else 1.0
    size, scaled = abs(q * scale), own * (scale * scale)
    if not math.isfinite(size) or not scaled > _ROUND_OFF:
        raise NoSolution
    return 1.0 / scaled * scale * size


def _linear_forces(
    compliance: np.ndarray,
    free: np.ndarray,
    acting: np.ndarray,
    shift: np.ndarray,
    c: np.ndarray,
    slope: np.ndarray,
) -> np.ndarray:
    """Solve with levels c + slope x: x = E z - shift (c + slope x), and the complementarity problem in z."""
    n, k = len(free), len(c)
    n_stops = n - k
    places = np.flatnonzero(acting)
    spread = np.zeros((n, k))
    spread[n_stops + np.arange(k), np.arange(k)] = shift
    inverse = np.linalg.inv(np.eye(n) + spread @ slope) if slope.any() else np.eye(n)
    by_z, fixed = inverse[:, places], -inverse @ spread @ c
    still = np.flatnonzero(acting[n_stops:])
    of_still = np.flatnonzero(places >= n_stops)
    n_z, n_y = len(places), len(still)
    matrix, right = np.zeros((n_z + n_y, n_z + n_y)), np.zeros(n_z + n_y)
    matrix[:n_z, :n_z] = (compliance @ by_z)[places]
    right[:n_z] = (compliance @ fixed + free)[places]
    matrix[of_still, n_z + np.arange(n_y)] = 1.0
    matrix[n_z:, :n_z] = 2.0 * (slope @ by_z)[still]
    matrix[n_z + np.arange(n_y), of_still] -= 1.0
    right[n_z:] = 2.0 * (c + slope @ fixed)[still]
    z = _by_parts(matrix, right)
    x = by_z @ z[:n_z] + fixed
    # At a limit a friction is exactly that: the round-off of forces that are far larger would leave it within.
    above = places[of_still[z[n_z:] > 0.0]]
    x[above] = (c + slope @ x)[above - n_stops]
    return x


def _by_parts(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve the parts of a complementarity problem that have nothing to do with each other, each in its own size."""
    z = np.zeros(len(right))
    if (right >= 0.0).all() and np.isfinite(right).all():
        return z
    parts = parts_of(matrix)
    if len(parts) == 1:
        return lemke(matrix, right)
    for part in parts:
        z[part] = lemke(matrix[np.ix_(part, part)], right[part])
    return z


def check_unique(
    here: LocalDynamics,
    touching: np.ndarray,
    stuck: np.ndarray,
    senses: np.ndarray,
    levels: Levels,
    x: np.ndarray,
) -> None:
    """Make sure that sliding frictions in proportion to reactions leave one motion.

    All principal minors of the matrix of stops, with what sticks held, must be positive in parts of those without
    friction (Cottle, Pang, Stone, The Linear Complementarity Problem, theorem 3.3.7); of very many stops those of
    `_looked_at`, which is necessary. Frictions that follow multipliers must answer to a change of their level with a
    smaller one.

    Raises
    ------
    Paradox
    """
    n, n_stops = len(x), len(touching)
    sliding = np.where(stuck, 0.0, np.where(levels.coefficients > 0.0, senses, 0.0))
    if not sliding.any():
        return
    _, slope = levels.linear(here, x, 1.0)
    _check_answers(here, sliding, levels, n_stops)
    spread = np.zeros((n, len(sliding)))
    spread[n_stops + np.arange(len(sliding)), np.arange(len(sliding))] = sliding
    with_friction = here.compliance @ np.linalg.inv(np.eye(n) + spread @ slope)
    stops, held = np.flatnonzero(touching), n_stops + np.flatnonzero(stuck)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(here.compliance), 1e-300))
    scaled = [matrix * np.outer(scale, scale) for matrix in (with_friction, here.compliance)]
    for sets in _looked_at(stops, held, scaled[1], x):
        rows = np.hstack([sets, np.tile(held, (len(sets), 1))])
        minors, without = (np.linalg.det(matrix[rows[:, :, None], rows[:, None, :]]) for matrix in scaled)
        if ((without > _DEPENDENT) & (minors <= _REGULAR * without)).any():
            raise Paradox


def _looked_at(stops: np.ndarray, held: np.ndarray, scaled: np.ndarray, x: np.ndarray) -> list[np.ndarray]:
    """Return sets of stops whose minors tell whether motions are unique, by size, each of shape (k, size).

    Of more than a few stops only sets that are not dependent for sure: the least eigenvalue of a part of a matrix is no
    larger than that of the whole which has as many larger ones (Cauchy). Where there are too many of them as well, each
    stop, each two, and all that bear.
    """
    n, sizes = len(stops), range(1, len(stops) + 1)
    bearing = []
    if n > _MOST_STOPS:
        every = np.concatenate([stops, held])
        values = np.linalg.eigvalsh(scaled[np.ix_(every, every)])
        sizes = range(1, 1 + np.count_nonzero(values > _DEPENDENT / math.e) - len(held))
        if sum(math.comb(n, size) for size in sizes) > _MOST_MINORS:
            sizes, bearing = (1, 2), [stops[x[stops] > 0.0][None]]
    return [np.array(list(itertools.combinations(stops, size)), dtype=int) for size in sizes] + bearing


def _check_answers(here: LocalDynamics, sliding: np.ndarray, levels: Levels, n_stops: int) -> None:
    answers = np.zeros((len(sliding), len(sliding)))
    for j, (_, rows) in enumerate(levels.normals):
        if len(rows):
            by_frictions = here.multiplier_responses[rows][:, n_stops:] * sliding
            answers[j] = levels.coefficients[j] * np.linalg.norm(by_frictions, axis=0)
    if np.abs(np.linalg.eigvals(answers)).max(initial=0.0) >= 1.0 - _REGULAR:
        raise Paradox
