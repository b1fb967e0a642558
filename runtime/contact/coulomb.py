"""Forces (or impulses) of stops and dry frictions at one instant: Coulomb's law in the plane of each friction.

The forces x of stops are x >= 0, with no acceleration against them where they are not zero; those of frictions lie
between -L and L, with no acceleration there where they lie between. L is given, or in proportion to a normal force that
is one of x, or the magnitude of some constraints' multipliers. The latter is linearised about the last solution.
With z = x for stops, and z = x + L for frictions, this is a linear complementarity problem: Glocker, Pfeiffer,
Multibody Dynamics with Unilateral Contacts, 1996, ch. 5. Where frictions follow forces, its matrix is not symmetric,
and Painlevé's paradox shows in its principal minors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symgen.runtime.contact.complementarity import lemke
from symgen.runtime.contact.local_dynamics import LocalDynamics
from symgen.runtime.contact.normals import Normal

_MOST_PASSES = 50
_CONVERGED = 1e-13
_REGULAR = 1e-9  # of a minor without friction
_DEPENDENT = 1e-10  # minors of rows scaled to 1: these stops depend on each other
_MOST_STOPS = 10  # 2^n minors are looked at


class Paradox(Exception):
    """Friction in proportion to reactions leaves no motion, or several (Painlevé's paradox)."""


@dataclass(frozen=True)
class Levels:
    """How large frictions can be.

    Attributes
    ----------
    fixed : ndarray, shape (k,)
        Of each friction; zero for those that follow a normal force.
    coefficients : ndarray, shape (k,)
        Of the normal force; zero for the others.
    normals : list of Normal
        What presses, of each friction.
    """

    fixed: np.ndarray
    coefficients: np.ndarray
    normals: list[Normal]

    def linear(self, here: LocalDynamics, x: np.ndarray, driven: float) -> tuple[np.ndarray, np.ndarray]:
        """Return c, shape (k,), and C, shape (k, n), of the levels c + C x' about forces x.

        `driven` is 1, or 0 for impulses, which nothing but they cause.
        """
        c, slope = self.fixed.copy(), np.zeros((len(self.fixed), len(x)))
        for j, (stop, rows) in enumerate(self.normals):
            if stop is not None:
                slope[j, stop] = self.coefficients[j]
            elif len(rows):
                reaction = driven * here.free_multipliers[rows] + here.multiplier_responses[rows] @ x
                size = np.linalg.norm(reaction)
                if size > 0.0:
                    slope[j] = self.coefficients[j] * (reaction / size) @ here.multiplier_responses[rows]
                    c[j] += self.coefficients[j] * size - slope[j] @ x
        return c, slope


def coulomb_forces(
    here: LocalDynamics,
    free: np.ndarray,
    acting: np.ndarray,
    senses: np.ndarray,
    levels: Levels,
    *,
    driven: bool = True,
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
    driven : bool
        Whether constraints have reactions without these forces; impulses have not.

    Returns
    -------
    forces : ndarray, shape (n,)
    levels : ndarray, shape (k,)

    Raises
    ------
    symgen.runtime.contact.complementarity.NoSolution
    Paradox
    """
    n, k = len(free), len(levels.fixed)
    n_stops = n - k
    still = acting[n_stops:]
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
    return by_z @ lemke(matrix, right)[:n_z] + fixed


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
    friction (Cottle, Pang, Stone, The Linear Complementarity Problem, theorem 3.3.7). Frictions that follow multipliers
    must answer to a change of their level with a smaller one.

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
    if len(stops) > _MOST_STOPS:
        raise Paradox
    scale = 1.0 / np.sqrt(np.maximum(np.diag(here.compliance), 1e-300))
    scaled = [matrix * np.outer(scale, scale) for matrix in (with_friction, here.compliance)]
    for chosen in range(1, 1 << len(stops)):
        rows = np.concatenate([stops[[bool(chosen >> b & 1) for b in range(len(stops))]], held])
        minor, without = (np.linalg.det(matrix[np.ix_(rows, rows)]) for matrix in scaled)
        if without > _DEPENDENT and minor <= _REGULAR * without:
            raise Paradox


def _check_answers(here: LocalDynamics, sliding: np.ndarray, levels: Levels, n_stops: int) -> None:
    answers = np.zeros((len(sliding), len(sliding)))
    for j, (_, rows) in enumerate(levels.normals):
        if len(rows):
            by_frictions = here.multiplier_responses[rows][:, n_stops:] * sliding
            answers[j] = levels.coefficients[j] * np.linalg.norm(by_frictions, axis=0)
    if np.abs(np.linalg.eigvals(answers)).max(initial=0.0) >= 1.0 - _REGULAR:
        raise Paradox
