"""Consistent initial conditions of large models: sparse Newton steps, and ranks from the pivots of the kernels.

Models of up to `LARGEST_DENSE` unknowns are assembled by full matrices and singular values (`assembly.py`), which also
find nearest points, and name constraints that depend on others. Beyond, that would take minutes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.contradictions import AssemblyError, listed
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.nearest_point import SOLVED, worst
from symgen.runtime.size import LARGEST_DENSE

if TYPE_CHECKING:
    from symgen.runtime.constraints.start_values import StartValues
    from symgen.runtime.system import System

_INDEPENDENT = 1e-6  # smallest pivot relative to its value before other constraints were eliminated
_SATISFIED = 2e-14  # of a constraint's scale
_REPAIRED = 1e-6  # of a constraint's scale: what enforced values may be off
_MAX_STEPS = 50
_FRACTIONS = (1.0, 0.5, 0.25, 0.05)  # of a Newton step


def sparse_start(
    system: System, constraints: Constraints, given: StartValues
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and rates that satisfy the constraints, and note in `given` what was done to enforced values.

    Enforced values stay. Each Newton step moves the others by the least, measured by the mass matrix at the guesses.

    Raises
    ------
    AssemblyError
        Newton's method finds no such start, or constraints depend on each other there.
    """
    start = _Start(system, constraints, given)
    q = start.positions()
    v = start.rates(q, given.v)
    ratio = constraints.pivot_ratio(q, v)
    if not ratio >= _INDEPENDENT:
        raise AssemblyError(
            f"constraints depend on each other at the start: a pivot is {ratio:.2g} of what it is without the others; "
            f"which of them do is found in models of up to {LARGEST_DENSE} rates and constraints only: look for one "
            "that repeats others in a smaller version of the model, and leave it out, or start in another configuration"
        )
    return q, v


class _Start:
    """The start of one model while it is sought."""

    def __init__(self, system: System, constraints: Constraints, given: StartValues):
        self._system, self._constraints, self._given = system, constraints, given
        mass = constraints.sparse_mass(given.q)
        self._mass = mass if mass.diagonal().min() > 0.0 else None
        self._sizes = constraints.characteristic_sizes(given.q)
        self._coordinates = [record["name"] for record in system.coordinates]

    def positions(self) -> np.ndarray:
        """Return coordinates on the position constraints."""
        constraints, given = self._constraints, self._given
        scales = constraints.position_scales(given.q, self._sizes)

        def residual(q: np.ndarray) -> np.ndarray:
            return constraints.position(q) / scales

        def solve(enforced: np.ndarray) -> np.ndarray:
            return self._newton(given.q, constraints.positions.retract, residual, scales, enforced)

        enforced = constraints.positions.held(given.q_enforced)
        q = solve(enforced)
        return self._accepted(q, residual, lambda: solve(np.zeros_like(enforced)), q, "value")

    def rates(self, q: np.ndarray, v0: np.ndarray) -> np.ndarray:
        """Return rates on the velocity level at positions `q`."""
        constraints = self._constraints
        scales = constraints.velocity_scales(q, v0, self._sizes)

        def residual(v: np.ndarray) -> np.ndarray:
            return constraints.velocity(q, v) / scales

        def solve(enforced: np.ndarray) -> np.ndarray:
            return self._newton(v0, np.add, residual, scales, enforced, at=q)

        enforced = self._given.v_enforced
        return self._accepted(solve(enforced), residual, lambda: solve(np.zeros_like(enforced)), q, "rate")

    def _accepted(
        self,
        found: np.ndarray,
        residual: Callable[[np.ndarray], np.ndarray],
        repair: Callable[[], np.ndarray],
        q: np.ndarray,
        what: str,
    ) -> np.ndarray:
        """Return what was found, or with all values free where enforced ones fit nearly."""
        off = residual(found)
        if worst(off) <= SOLVED:
            return found
        if worst(off) <= _REPAIRED:
            found = repair()
            if worst(residual(found)) <= SOLVED:
                self._given.notes.append(
                    f"enforced {what}s fitted the constraints nearly, not to the last digit, and were repaired"
                )
                return found
        name = self._constraints.names[int(np.argmax(np.nan_to_num(np.abs(off), nan=np.inf)))]
        raise AssemblyError(
            f"no start was found on the constraints: {name!r} is the worst, off by {worst(off):.2g} of its scale, at "
            f"{listed(self._coordinates, q)}; give guesses nearer to a solution, or enforce fewer {what}s"
        )

    def _newton(self, x, move, residual, scales, enforced, at=None) -> np.ndarray:
        """Newton's method on a residual; steps are halved until it falls."""
        free = np.flatnonzero(~enforced)
        r = residual(x)
        for _ in range(_MAX_STEPS):
            if worst(r) <= _SATISFIED or not free.size:
                break
            q = x if at is None else at
            step = self._step(q, r * scales, free)
            if step is None:
                break
            for fraction in _FRACTIONS:
                trial = move(x, fraction * step)
                r_trial = residual(trial)
                if np.linalg.norm(r_trial) < np.linalg.norm(r):
                    break
            else:
                break
            x, r = trial, r_trial
        return x

    def _step(self, q: np.ndarray, right: np.ndarray, free: np.ndarray) -> np.ndarray | None:
        """The least step that zeroes the linearised residual, by the free rates; None where there is none."""
        from scipy.sparse import block_array, eye_array
        from scipy.sparse.linalg import splu

        jacobian = self._constraints.sparse_jacobian(q)[: len(right)][:, free]
        metric = eye_array(len(free)) if self._mass is None else self._mass[free][:, free]
        matrix = block_array([[metric, jacobian.T], [jacobian, None]], format="csc")
        try:
            solution = splu(matrix).solve(np.concatenate([np.zeros(len(free)), -right]))
        except RuntimeError:  # exactly singular
            return None
        step = np.zeros(self._system.nv)
        step[free] = solution[: len(free)]
        return step if np.isfinite(step).all() else None
