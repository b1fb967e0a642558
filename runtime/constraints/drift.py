"""How far a run left its constraints, each held against its own scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.frames_code import DRIFT, VELOCITY_SCALES, LookAtFrames
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.kept_arrays import lent
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
    system, t = solution.system, solution.t
    constraints = Constraints(system, solution.p, float(t[0]))
    sizes = constraints.characteristic_sizes(solution.q[0])
    frames = sample_rows(len(t), _STATES_FOR_SCALES)
    duration = float(t[-1] - t[0])
    precomputed = system.precomputed(solution.p)
    with lent(system, LookAtFrames, len(precomputed)) as look:
        look.begin(system, precomputed)
        look.of.slow[:] = sizes / duration if duration > 0.0 else 0.0
        look.see(DRIFT, t, solution.states)
        look.see(VELOCITY_SCALES, t[frames], solution.states[frames])
        largest, at, moving = look.of.largest.copy(), look.of.at.tolist(), look.of.scales.copy()
    found = {}
    if system.nh:
        relative = largest[: system.nh] / constraints.position_scales(solution.q[0], sizes)
        found["position"] = _worst(relative, constraints.names, t[at[: system.nh]])
    relative = largest[system.nh :] / np.where(moving > 0.0, moving, 1.0)
    found["velocity"] = _worst(relative, constraints.names, t[at[system.nh :]])
    return found


def _worst(relative: np.ndarray, names: list[str], times: np.ndarray) -> Drift:
    which = int(np.argmax(relative))  # a NaN first
    return Drift(names[which], float(relative[which]), float(times[which]))
