"""The method and step that a user means to take: pass, or why not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.advice_record import Advice, Choice
from symgen.runtime.checks.health import health_of, objections_to
from symgen.runtime.checks.stability import stable_step
from symgen.runtime.choose import refuse_unsuitable
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.options import RunOptions
from symgen.runtime.simulate import simulate

if TYPE_CHECKING:
    from symgen.runtime.checks.time_scales import TimeScales
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_MOST_STEPS = 200_000  # of the run that tells; it is judged as far as it comes


def judge_choice(
    system: System,
    advice: Advice,
    scales: list[TimeScales],
    options: RunOptions,
    steps_per_period: int | None,
) -> Choice:
    """Return what is to be said about a method and step: that which the health report of such a run says.

    Parameters
    ----------
    options : RunOptions
        With the method and step that are meant.
    steps_per_period : int, optional
        What the user asks for besides.
    """
    name, step = options.method, options.step
    method = find_method(name)
    try:
        refuse_unsuitable(method, system)
    except RuntimeModelError as error:
        return Choice(name, step, False, (str(error),))
    if not method.adaptive and step is None and steps_per_period is None:
        step = next((entry.step for entry in advice.fixed_steps if entry.method == name), None)
    step = None if method.adaptive else step
    run = simulate(system, replace(options, step=step, at=(), fps=None, max_steps=_MOST_STEPS))
    objections = [
        entry.says for entry in objections_to(run) if entry.check != "status" or not _cut_short(run)
    ]
    notes = [entry.says for entry in health_of(run) if entry.note]
    if method.adaptive:
        said = [f"it keeps its steps stable and accurate itself, to rtol {run.rtol:g}", *notes]
        return Choice(name, None, not objections, tuple([*objections, *notes] if objections else said))
    coarse = _too_few(method, advice, run.step, steps_per_period)
    if objections or coarse:
        return Choice(name, step, False, tuple([*objections, *coarse, *notes]))
    return Choice(name, step, True, (*_about_step(method, advice, scales, run.step), *notes))


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
