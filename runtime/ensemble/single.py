"""A member that runs by itself, as `system.run` does it."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.ensemble.machine import MAY_LEAVE
from symgen.runtime.ensemble.slots import LEFT, TOO_MANY_STEPS
from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.solution import Solution

simulation = Late("symgen.runtime.simulate")

# Single runs see singular configurations and change points through.
_SINGULAR = (at.PROJECTION_FAILED, at.SINGULAR_MATRIX)


# So does a method of their own, where the one that suits the ensemble does not suit a member.
UNSUITED = (at.STEP_TOO_SMALL, at.NOT_FINITE)


def runs_alone(plan: Plan) -> tuple[int, ...]:
    """Return the statuses with which members leave lanes, for runs of their own.

    Where users give no limit of steps, very many may be a motion that never gets on: single runs watch for that.
    """
    system, statuses = plan.system, ()
    if system.m:
        statuses += _SINGULAR
    if system.events or plan.method in MAY_LEAVE:
        statuses += (LEFT,)
    if plan.single.max_steps is None:
        statuses += (TOO_MANY_STEPS,)
    return statuses + _for_another_method(plan)


def _for_another_method(plan: Plan) -> tuple[int, ...]:
    """Return the statuses of members whose method was chosen for the ensemble and does not suit them."""
    if plan.choice is None:
        return ()
    most, allowed = plan.choice.most_steps, plan.single.max_steps
    is_limit = most and (allowed is None or most < allowed)
    return (*UNSUITED, TOO_MANY_STEPS) if is_limit else UNSUITED


_given_up: weakref.WeakSet[Plan] = weakref.WeakSet()


def give_up(plan: Plan, *, again: bool = False) -> None:
    """Let members of a plan that run by themselves in threads end where they are; or let them run `again`."""
    if again:
        _given_up.discard(plan)
    else:
        _given_up.add(plan)


def refuse_given_up(plan: Plan) -> None:
    """Keep members from being taken for done that an interrupt has ended on their way.

    Raises
    ------
    KeyboardInterrupt
        Members of the plan were given up.
    """
    if plan in _given_up:
        raise KeyboardInterrupt


def _unless_given_up(plan: Plan) -> Callable[[float, int], None]:
    """What a run calls while it goes on: only the main thread gets signals."""

    def look(_t: float, _n_steps: int) -> None:
        refuse_given_up(plan)

    return look


def run_single(
    plan: Plan, number: int, p: np.ndarray, varied: dict[str, float], t_eval: Any = None, status: int = 0
) -> Solution:
    """Run a member by itself, by its number, its parameters, and the starts that vary.

    Parameters
    ----------
    status : int
        With which it has left lanes.

    Raises
    ------
    RuntimeModelError
        It has no start on the constraints.
    """
    system = plan.system
    start, rate = plan.starts.given(varied)
    times = plan.frame_times if t_eval is None else t_eval
    chosen = plan.single
    if status in _for_another_method(plan):
        chosen = replace(chosen, method="auto", step=None)
    options = replace(
        chosen, parameters=plan.single_parameters(p), start=start, rate=rate,
        inputs=plan.inputs_of(number),
        t_eval=times if len(times) else (plan.single.t_end,), fps=None, progress=_unless_given_up(plan),
    )  # fmt: skip
    return simulation.simulate(system, options)
