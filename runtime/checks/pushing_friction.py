"""Whether dry friction came to have a negative force: it drives what slides, and energy and companions agree."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.abi import N_WATCHED
from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_ROUND_OFF = 1e-9  # of the largest force of the run


def pushing_friction(solution: Solution) -> Iterator[HealthCheck]:
    """Yield an entry on a friction whose force (or coefficient) is below zero in a frame, if there is one."""
    system = solution.system
    switches = [switch for kind in N_WATCHED for switch in system.switches if switch["kind"] == kind]
    n_stops = sum(switch["kind"] == "stop" for switch in switches)
    found = evaluate(system, "switches", solution.p, solution.t, solution.states)
    levels = found[:, 2 * n_stops + 1 :: N_WATCHED["friction"]]
    least = levels.min(axis=0) + _ROUND_OFF * np.abs(levels).max(axis=0)
    if not (least < 0.0).any():
        return
    worst = int(np.argmin(least))
    name = switches[n_stops + worst].get("circle", switches[n_stops + worst]["name"])
    t = solution.t[np.argmax(levels[:, worst] < 0.0)]
    lowest = float(levels[:, worst].min())
    says = (
        f"the force of friction {name!r} is negative from t = {t:.6g} s on, down to {lowest:.3g}: it pushes what "
        "slides; bound it, as in max(…, 0), or end the run before"
    )
    yield HealthCheck("friction", False, lowest, 0.0, says)
