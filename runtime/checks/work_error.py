"""Whether an energy balance is off only by what errors of the states, within the tolerance, make of the work.

A damper of 2e4 N s/m between what is driven and what follows makes forces of each error of a speed, and work of these.
The motion is right to the tolerance then, and the work that is counted is not.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import right_hand_sides
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.checks.entry import HealthCheck
    from symgen.runtime.solution import Solution

_SMALL = 1e-3  # error of the motion, in parts of what each variable does
_FRAMES = 200  # at which power is looked at
_EXPLAINS = 0.5  # times what errors of the states may make of the work: they do not all have one sign


def judged_with_errors_of_work(
    found: list[HealthCheck], solution: Solution, error: float
) -> list[HealthCheck]:
    """Let an energy balance be a note where the motion is right, and its errors explain that of the work.

    Parameters
    ----------
    found : list of HealthCheck
        Of an adaptive run, `energy` among them.
    error : float
        How far the motion is off, in parts of what each variable does.
    """
    (energy,) = [entry for entry in found if entry.check == "energy"]
    system = solution.system
    if energy.ok or error > _SMALL or not system.nw or system.m or system.quaternions or solution.events:
        return found
    explained = _EXPLAINS * float(solution.energy.exchange.relative(work_of_errors(solution)))
    if not energy.value <= explained:
        return found
    says = (
        f"the energy balance is off by {energy.value:.2g} of what the motion exchanges: forces are so stiff that "
        f"errors of the states within rtol {solution.rtol:g} make up to {explained:.2g} of it as work; the motion is "
        "right (accuracy)"
    )
    passed = replace(energy, ok=True, note=True, says=says)
    return [passed if entry is energy else entry for entry in found]


def work_of_errors(solution: Solution) -> float:
    """Return what errors of the states as large as the tolerance make of the work of the run [J]."""
    system, rows = solution.system, sample_rows(len(solution.t), _FRAMES)
    t, states, power = solution.t[rows], solution.states[rows], system.nq + system.nv
    with np.errstate(over="ignore", invalid="ignore"):
        right = right_hand_sides(system, solution.p, t, states)[:, power]
        error = np.zeros(len(t))
        for i in range(states.shape[1]):
            off = states.copy()
            off[:, i] += solution.rtol * np.abs(states[:, i]) + solution.atol
            error += np.abs(right_hand_sides(system, solution.p, t, off)[:, power] - right)
        return float(np.sum(0.5 * np.diff(t) * (error[1:] + error[:-1])))
