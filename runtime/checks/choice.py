"""The method and step that a user means to take: pass, or why not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.stability import stable_step
from symgen.runtime.choose import refuse_unsuitable
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import find_method

if TYPE_CHECKING:
    from symgen.runtime.checks.advice import Advice
    from symgen.runtime.checks.time_scales import TimeScales
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_MOST_STEPS = 200_000  # of the run that tells; it is judged as far as it comes


@dataclass(frozen=True)
class Choice:
    """What is to be said about a choice of method and step [s]: `reasons` are objections where it is not ok."""

    method: str
    step: float | None
    ok: bool
    reasons: tuple[str, ...]


def judge_choice(
    system: System,
    advice: Advice,
    scales: list[TimeScales],
    arguments: Mapping[str, Any],
    name: str,
    step: float | None,
    steps_per_period: int | None,
) -> Choice:
    """Return what is to be said about a method and step: that which the health report of such a run says.

    Parameters
    ----------
    arguments : mapping
        As `symgen.runtime.solve.solve` takes them.
    step : float or None [s]
    steps_per_period : int, optional
        What the user asks for besides.
    """
    method = find_method(name)
    try:
        refuse_unsuitable(method, system)
    except RuntimeModelError as error:
        return Choice(name, step, False, (str(error),))
    if not method.adaptive and step is None and steps_per_period is None:
        step = next((entry.step for entry in advice.fixed_steps if entry.method == name), None)
    run = _run(system, {**arguments, "method": name, "step": None if method.adaptive else step})
    objections = [entry.says for entry in run.objections if entry.check != "status" or not _cut_short(run)]
    notes = [entry.says for entry in run.advice]
    if method.adaptive:
        said = [f"it keeps its steps stable and accurate itself, to rtol {run.rtol:g}", *notes]
        return Choice(name, None, not objections, tuple([*objections, *notes] if objections else said))
    coarse = _too_few(method, advice, run.step, steps_per_period)
    if objections or coarse:
        return Choice(name, step, False, tuple([*objections, *coarse, *notes]))
    return Choice(name, step, True, (*_about_step(method, advice, scales, run.step), *notes))


def _run(system: System, arguments: Mapping[str, Any]) -> Solution:
    from symgen.runtime.solve import solve

    return solve(system, max_steps=_MOST_STEPS, **{**arguments, "at": (), "fps": None})


def _cut_short(run: Solution) -> bool:
    return run.status == "failed" and run.stats["steps"] >= _MOST_STEPS


def _too_few(method: Method, advice: Advice, step: float, steps_per_period: int | None) -> list[str]:
    rate = advice.motion if method.stiff else advice.rate
    if steps_per_period is None or rate <= 0.0:
        return []
    period = 2.0 * np.pi / rate
    if period / step >= steps_per_period * (1.0 - 1e-6):
        return []
    return [
        f"only {period / step:.3g} steps in the fastest period, {period:.3g} s: at least {steps_per_period:g} are "
        f"asked for, a step of {period / steps_per_period:.3g} s"
    ]


def _about_step(method: Method, advice: Advice, scales: list[TimeScales], step: float) -> Iterator[str]:
    """Yield what is known of a step that nothing is said against."""
    stable = min((stable_step(method, scale.eigenvalues) for scale in scales), default=np.inf)
    if np.isfinite(stable) and step <= stable:
        yield f"the step is {step / stable:.0%} of the stability limit, {stable:.3g} s"
    rate = advice.motion if method.stiff else advice.rate
    if rate > 0.0:
        yield f"{2.0 * np.pi / rate / step:.3g} steps in the fastest period, {2.0 * np.pi / rate:.3g} s"
    yield f"{round((advice.t_end - advice.t_first) / step)} steps in all"
