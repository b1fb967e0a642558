"""A member that runs by itself, as `system.run` does it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.ensemble.machine import IMPLICIT
from symgen.runtime.ensemble.slots import LEFT, TOO_MANY_STEPS
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


def runs_alone(system: System, method: str, max_steps: int | None = None) -> tuple[int, ...]:
    """Return the statuses with which members of a model leave lanes of a method, for runs of their own.

    Where users give no limit of steps, very many may be a motion that never gets on: single runs watch for that.
    """
    leaving = (LEFT,) if system.events or method in IMPLICIT else ()
    return (_SINGULAR if system.m else ()) + leaving + ((TOO_MANY_STEPS,) if max_steps is None else ())


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
