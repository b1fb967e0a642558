"""The method and step that a user means to take: pass, or why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from runtime.checks.stability import stable_step
from runtime.choose import refuse_unsuitable
from runtime.errors import RuntimeModelError
from runtime.integrate.methods import find_method

if TYPE_CHECKING:
    from runtime.checks.advice import Advice
    from runtime.checks.time_scales import TimeScales
    from runtime.integrate.methods import Method
    from runtime.solution import Solution
    from runtime.system import System

_LOOSEST = 1e-3  # rtol
LEAST_PER_PERIOD = 20.0


@dataclass(frozen=True)
class Choice:
    """What is to be said about a choice of method and step [s]: `reasons` are objections where it is not ok."""

    method: str
    step: float | None
    ok: bool
    reasons: tuple[str, ...]


def least_steps_per_period(method: Method) -> float:
    """Return the steps in the fastest period below which a run with a fixed step is not trusted."""
    return min(LEAST_PER_PERIOD, 0.7 * method.steps_per_period)


def judge_choice(
    system: System,
    advice: Advice,
    scales: list[TimeScales],
    name: str,
    step: float | None,
    run: Solution,
    steps_per_period: int | None,
) -> Choice:
    """Return what is to be said about a method and step.

    Parameters
    ----------
    steps_per_period : int, optional
        Asked for by the user; otherwise fewer than the rule's 50 will do, but not fewer than health checks ask for.
    """
    method = find_method(name)
    try:
        refuse_unsuitable(method, system)
    except RuntimeModelError as error:
        return Choice(name, step, False, (str(error),))
    if method.adaptive:
        return _adaptive(method, run)
    if step is None:
        return Choice(
            name, None, True, (f"its step will be {advice.rule_step:.3g} s, from the fastest period",)
        )
    bad, good = [], []
    stable = min((stable_step(method, scale.eigenvalues) for scale in scales), default=np.inf)
    if stable <= 0.0:
        bad.append(
            f"{name} is unstable on undamped motion at every step: take semi_implicit_euler, verlet or rk4"
        )
    elif step > stable:
        what = f": {advice.origin.spring} makes the motion fast" if advice.origin else ""
        bad.append(
            f"the step is above the stability limit, {stable:.3g} s{what}; take a shorter step or a stiff method"
        )
    elif np.isfinite(stable):
        good.append(f"the step is {step / stable:.0%} of the stability limit, {stable:.3g} s")
    rate = advice.motion if method.stiff else advice.rate
    if rate > 0.0:
        per_period = 2.0 * np.pi / rate / step
        needed = steps_per_period or least_steps_per_period(method)
        found = f"{per_period:.3g} steps in the fastest period, {2.0 * np.pi / rate:.3g} s"
        if per_period < needed * (1.0 - 1e-6):
            bad.append(
                f"only {found}: at least {needed:g} are needed, a step of {2.0 * np.pi / rate / needed:.3g} s"
            )
        else:
            good.append(found)
    good.append(f"{round((advice.t_end - advice.t_first) / step)} steps in all")
    return Choice(name, step, not bad, tuple(bad or good))


def _adaptive(method: Method, run: Solution) -> Choice:
    recommended = find_method(run.method)
    if recommended.stiff and not method.stiff:
        why = next(
            (note.partition("because ")[2] for note in run.notes if note.startswith("method auto")), ""
        )
        return Choice(method.name, None, False, (f"the motion is stiff: {why}; take {recommended.name}",))
    if run.rtol > _LOOSEST:
        return Choice(
            method.name, None, False, (f"rtol {run.rtol:g} is too loose to be trusted: take 1e-6 or less",)
        )
    return Choice(
        method.name, None, True, (f"it keeps its steps stable and accurate itself, to rtol {run.rtol:g}",)
    )
