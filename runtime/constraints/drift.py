"""How far a run left its constraints, each held against its own scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.constraints.levels import Constraints, kernel_of_jacobian, largest_in_rows
from symgen.runtime.record import record
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

_STATES_FOR_SCALES = 16
_DRIFT_PER_RTOL, _LEAST_DRIFT, _LARGEST_DRIFT = 1e2, 1e-8, 1e-4
_FIXED_STEP_DRIFT = 1e-6


@record
class Drift:
    """The largest residual of a level, in parts of the constraint's scale: which, how much, when."""

    name: str
    relative: float
    t: float


def drift_limit(method: Method, rtol: float) -> float:
    """Return how far a run may leave its constraints, in parts of their scales."""
    if not method.adaptive:
        return _FIXED_STEP_DRIFT
    return min(_LARGEST_DRIFT, max(_LEAST_DRIFT, _DRIFT_PER_RTOL * rtol))


def constraint_drift(solution: Solution) -> dict[str, Drift]:
    """Return the drift for "position" (where there are holonomic constraints) and "velocity".

    The scale of a position is the constraint's change over the coordinates' characteristic sizes; that of a
    velocity its largest term over the run, and at least that of a motion by one size over the whole run.
    """
    system = solution.system
    rows = evaluate(system, "constraint_residual", solution.p, solution.t, solution.states)
    largest = np.maximum(np.abs(rows.max(axis=0)), np.abs(rows.min(axis=0)))
    constraints = Constraints(system, solution.p, float(solution.t[0]))
    sizes = constraints.characteristic_sizes(solution.q[0])
    found = {}
    if system.nh:
        scales = constraints.position_scales(solution.q[0], sizes)
        own = slice(None, system.nh)
        found["position"] = _worst(rows[:, own], largest[own] / scales, constraints.names, solution)
    own = slice(system.nh, None)
    relative = largest[own] / _velocity_scales(solution, sizes)
    found["velocity"] = _worst(rows[:, own], relative, constraints.names, solution)
    return found


def _worst(rows: np.ndarray, relative: np.ndarray, names: list[str], solution: Solution) -> Drift:
    # argmax finds a NaN first.
    which = int(np.argmax(relative))
    frame = int(np.argmax(np.abs(rows[:, which])))
    return Drift(names[which], float(relative[which]), float(solution.t[frame]))


def _velocity_scales(solution: Solution, sizes: np.ndarray) -> np.ndarray:
    duration = float(solution.t[-1] - solution.t[0])
    slow = sizes / duration if duration > 0.0 else np.zeros_like(sizes)
    frames = sample_rows(len(solution.t), _STATES_FOR_SCALES)
    system, p, t, v = solution.system, solution.p, solution.t[frames], solution.v[frames]
    entries = evaluate(system, kernel_of_jacobian(system), p, t, solution.states[frames])
    moving = largest_in_rows(system, entries, np.maximum(np.abs(v), slow))
    still = np.hstack([solution.q[frames], np.zeros_like(v)])
    driven = np.abs(evaluate(system, "constraint_residual", p, t, still))[:, system.nh :]
    scales = np.fmax.reduce(np.fmax(moving, driven))
    return np.where(scales > 0.0, scales, 1.0)
