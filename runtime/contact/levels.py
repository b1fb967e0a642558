"""How large frictions can be, of a given size or in proportion to reactions, and what becomes of that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symgen.runtime.contact.local_dynamics import LocalDynamics, Normal


class NoSolution(Exception):
    """The complementarity problem has no solution, or none that is found."""


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

    def at(self, here: LocalDynamics, x: np.ndarray) -> np.ndarray:
        """Return the levels, shape (k,), under forces x, shape (n,)."""
        c, slope = self.linear(here, x, 1.0)
        return c + slope @ x
