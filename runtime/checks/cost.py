"""What a run will cost: steps and seconds, from a short run and the measured time of one evaluation."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

_REPEATS = 5
_LEAST_ROWS = 1000


@dataclass(frozen=True)
class Cost:
    """Steps and wall time [s] of a whole run."""

    steps: int
    seconds: float

    def says(self) -> str:
        """Return a few words."""
        return f"about {self.steps} steps, {self.seconds:.2g} s"


def seconds_per_evaluation(run: Solution) -> float:
    """Return the least measured wall time of one evaluation of `rhs` [s], at states of a run."""
    repeats = -(-_LEAST_ROWS // len(run.t))
    times, states = np.tile(run.t, repeats), np.tile(run.states, (repeats, 1))
    taken = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        evaluate(run.system, "rhs", run.p, times, states)
        taken.append(time.perf_counter() - began)
    return min(taken) / len(times)


def run_cost(run: Solution, span: float) -> Cost:
    """Return the cost of a run of `span` [s] that begins as this one did."""
    part = span / max(float(run.t[-1] - run.t[0]), 1e-300)
    return Cost(round(run.stats["steps"] * part), run.seconds["run"] * part)


def fixed_step_cost(method: Method, steps: float, evaluation: float) -> Cost:
    """Return the cost of so many steps of a method of fixed step."""
    # The end of a run that is no whole number of steps away costs one more; nobody counts it.
    return Cost(max(1, round(steps)), steps * method.evaluations * evaluation)
