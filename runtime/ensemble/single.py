"""A member that runs by itself, as `system.run` does it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.ensemble.machine import IMPLICIT
from symgen.runtime.ensemble.slots import LEFT
from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

simulation = Late("symgen.runtime.simulate")

# Single runs see singular configurations and change points through.
_SINGULAR = (at.PROJECTION_FAILED, at.SINGULAR_MATRIX)


def runs_alone(system: System, method: str) -> tuple[int, ...]:
    """Return the statuses with which members of a model leave lanes of a method, for runs of their own."""
    return (_SINGULAR if system.m else ()) + ((LEFT,) if system.events or method in IMPLICIT else ())


def run_single(
    plan: Plan, number: int, p: np.ndarray, varied: dict[str, float], t_eval: Any = None
) -> Solution:
    """Run a member by itself, by its number, its parameters, and the starts that vary.

    Raises
    ------
    RuntimeModelError
        It has no start on the constraints.
    """
    system = plan.system
    start, rate = plan.starts.given(varied)
    times = plan.frame_times if t_eval is None else t_eval
    options = replace(
        plan.single, parameters=plan.single_parameters(p), start=start, rate=rate,
        inputs=plan.inputs_of(number),
        t_eval=times if len(times) else (plan.single.t_end,), fps=None,
    )  # fmt: skip
    return simulation.simulate(system, options)
