"""Whether an energy balance is off only by the work that is counted, not by the motion.

A damper of 2e4 N s/m between what is driven and what follows makes forces of each error of a speed, and work of these:
what errors of the states, within the tolerance, make of the work. And steps are chosen for the motion: in a rope whose
damping takes all of its force, work is done that nothing moves by. Then the motion integrated beside the run, with the
same energies, is balanced.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate, right_hand_sides
from symgen.runtime.checks.companion import Companion, follow
from symgen.runtime.checks.work import operations_per_step
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.checks.entry import HealthCheck
    from symgen.runtime.solution import Solution

_SMALL = 1e-3  # error of the motion, in parts of what each variable does
_FRAMES = 200  # at which power is looked at
_FAR_BELOW = 0.1  # of the limit of the balance: errors of a motion that may not be what it is off by
_BESIDE, _TIGHTER, _TIGHTEST = "dop853", 0.01, 1e-13
_OPERATIONS = 4e8  # a tenth of a second
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
    if energy.ok or error > _SMALL or not system.nw:
        return found
    if system.m or system.quaternions or solution.events:
        return _judged_beside(found, solution, energy, error)
    explained = _EXPLAINS * float(solution.energy.exchange.relative(work_of_errors(solution)))
    if not energy.value <= explained:
        return _judged_beside(found, solution, energy, error)
    says = (
        f"the energy balance is off by {energy.value:.2g} of what the motion exchanges: forces are so stiff that "
        f"errors of the states within rtol {solution.rtol:g} make up to {explained:.2g} of it as work; the motion is "
        "right (accuracy)"
    )
    passed = replace(energy, ok=True, note=True, says=says)
    return [passed if entry is energy else entry for entry in found]


def _judged_beside(
    found: list[HealthCheck], solution: Solution, energy: HealthCheck, error: float
) -> list[HealthCheck]:
    """Let an energy balance be a note where it is that of the motion integrated beside the run, which is balanced."""
    if error > _FAR_BELOW * energy.limit or not _balanced_beside(solution, energy.limit):
        return found
    says = (
        f"the energy balance is off by {energy.value:.2g} of what the motion exchanges, by the work alone, for "
        "which steps are not chosen: integrated beside the run, the motion has the same energies, and they are "
        "balanced"
    )
    return [replace(entry, ok=True, note=True, says=says) if entry is energy else entry for entry in found]


def _balanced_beside(solution: Solution, limit: float) -> bool:
    """Whether the motion, integrated beside the run with a tight tolerance, has its energies and balances them."""
    method, t = METHODS[_BESIDE], solution.t
    rtol = max(_TIGHTER * solution.rtol, _TIGHTEST)
    companion = Companion(method, rtol, min(_TIGHTER * solution.atol, rtol))
    most_steps = int(_OPERATIONS / operations_per_step(solution, method))
    if most_steps < 1 or not (np.diff(t) > 0.0).all():
        return False
    beside = follow(solution, companion, t, solution.states[0], most_steps, lambda _: False)
    if len(beside.states) < len(t):
        return False
    energies = evaluate(solution.system, "energy", solution.p, t, beside.states).sum(axis=1)
    balance, exchange = energies - beside.work, solution.energy.exchange
    off = max(np.abs(balance - balance[0]).max(), np.abs(energies - solution.energy.total).max())
    return bool(exchange.relative(off) <= limit)


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
