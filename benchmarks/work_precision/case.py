"""A scene made ready to run, and one measured run of it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.failures import failure_message
from symgen.runtime.integrate import layout as at

from .timing import OVER_TIME, TimedLoop, no_garbage_collection

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System

    from .reference import Reference
    from .scenes import Scene


@dataclass(frozen=True)
class Case:
    """A scene with its model, the text of the model's module, and its end state."""

    scene: Scene
    system: System
    text: str
    reference: Reference


@dataclass(frozen=True)
class Effort:
    """How long to measure.

    Attributes
    ----------
    longest_run : float [s]
        A setting whose run would take longer ends a sweep.
    repeat : float [s]
        A run is repeated until this time has passed, up to `most_runs` times.
    per_decade : int
        Tolerances to a decade; steps to a halving.
    """

    longest_run: float
    repeat: float
    most_runs: int
    per_decade: int


_LEAST_RUNS = 3  # one of them is not interrupted by something else, it is hoped
FULL = Effort(longest_run=1.0, repeat=0.05, most_runs=40, per_decade=2)
QUICK = Effort(longest_run=0.1, repeat=0.02, most_runs=10, per_decade=1)


@dataclass(frozen=True)
class Row:
    """One setting of one method.

    Attributes
    ----------
    setting : float
        rtol of an adaptive method, step [s] of another.
    error : float or None
        Against the reference; None where the run failed.
    seconds : float
        Of the processor, in the compiled loop; the fastest of `runs` runs.
    rhs, jacobians, steps, rejected : int
        Counted by the loop; evaluations of a residual by implicit methods count as `rhs`.
    says : str
        Why it failed.
    multiplier_error : float or None
        Against the reference; None where there are no constraints, and for peers.
    """

    setting: float
    error: float | None
    seconds: float
    runs: int = 0
    steps: int = 0
    rejected: int = 0
    rhs: int = 0
    jacobians: int = 0
    says: str = ""
    multiplier_error: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the row for JSON."""
        return asdict(self)


def measure(case: Case, method: Method, setting: float, effort: Effort) -> Row:
    """Run a scene with one setting until its fastest time is known.

    Parameters
    ----------
    setting : float
        rtol, or the step [s] of a method of fixed step.
    """
    scene, system, reference = case.scene, case.system, case.reference
    rtol = setting if method.adaptive else 1e-12  # of Newton's iterations where the step is fixed
    loop = TimedLoop(
        system, method, reference.p, reference.start, scene.t_end, rtol, rtol * scene.atol_ratio,
        0.0 if method.adaptive else setting,
    )  # fmt: skip
    with no_garbage_collection():
        status, best = loop.run(effort.longest_run)
        if status != at.REACHED_STOP:
            return Row(setting, None, best, 1, says=_why(status, case, method, loop, effort))
        error = reference.error(loop.arrays.y)
        took = [best]
        while len(took) < _LEAST_RUNS or (sum(took) < effort.repeat and len(took) < effort.most_runs):
            took.append(loop.run(np.inf)[1])
    counted, y = loop.arrays.counters, loop.arrays.y[None]
    _, multipliers = accelerations_and_multipliers(system, reference.p, np.array([scene.t_end]), y)
    return Row(
        setting, error, min(took), len(took), int(counted[at.STEPS]), int(counted[at.REJECTED]),
        int(counted[at.RHS_CALLS]), int(counted[at.JACOBIANS]),
        multiplier_error=reference.multiplier_error(multipliers[0]),
    )  # fmt: skip


def _why(status: int, case: Case, method: Method, loop: TimedLoop, effort: Effort) -> str:
    if status == OVER_TIME:
        return f"takes longer than {effort.longest_run:g} s"
    return failure_message(status, case.system, method, loop.arrays)
