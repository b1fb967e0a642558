"""Which step and method suit a model: its time scales along a short run, and what follows from them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.advice_record import Advice, FixedStep, StabilityLimit, rate_to_follow
from symgen.runtime.checks.choice import judge_choice
from symgen.runtime.checks.cost import fixed_step_cost, run_cost, seconds_per_evaluation
from symgen.runtime.checks.mode_origin import fastest_origin
from symgen.runtime.checks.stability import damping_ratio, stable_radius, stable_step
from symgen.runtime.checks.steps import MOST_RECOMMENDED, step_for_phases
from symgen.runtime.checks.time_scales import TimeScales, time_scales
from symgen.runtime.choose import refuse_unsuitable
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS, Method
from symgen.runtime.options import RunOptions
from symgen.runtime.simulate import simulate
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

STEPS_PER_PERIOD = 50
_STATES = 20
_SHORT_RUN_STEPS = 2000
_SAFETY = 0.5  # of the stability limit
_SLOWEST = (
    1e-3  # of the fastest: eigenvalues below are round-off of the zeros of constraints and free motions
)


def advise(
    system: System,
    options: RunOptions,
    *,
    steps_per_period: int | None = None,
    chosen: tuple[str, float | None] | None = None,
) -> Advice:
    """Look at a model's time scales and say what suits it.

    Parameters
    ----------
    system : System
    options : RunOptions
        Their method and step do not matter.
    steps_per_period : int, optional
        Of the rule h = T / N; 50 by default.
    chosen : tuple of str and float or None, optional
        Method and step [s] of the user's choice, to be checked.
    """
    run, undriven = _short_run(system, options), system
    system = run.system  # with its inputs over time
    rows = np.unique(np.linspace(0, len(run.t) - 1, _STATES).astype(int))
    scales = [time_scales(system, run.p, run.t[i], run.q[i], run.v[i]) for i in rows]
    which = int(np.argmax([scale.fastest for scale in scales]))
    worst, row = scales[which], rows[which]
    # What runs of such length last, whatever ended this one.
    span = float(run.t_end - run.t_start)
    evaluation = seconds_per_evaluation(run)
    n = steps_per_period or STEPS_PER_PERIOD
    turning = max(scale.turning for scale in scales)
    rate = rate_to_follow(worst.fastest, turning)
    motion = max(scale.motion for scale in scales)
    advice = Advice(
        n_states=len(rows),
        t_first=float(run.t_start),
        t_seen=float(run.t[-1]),
        t_end=float(run.t_end),
        fastest=worst.fastest,
        t_fastest=float(run.t[row]),
        damping_ratio=_damping_of_fastest(worst),
        decay=max(scale.decay for scale in scales),
        motion=motion,
        turning=turning,
        slowest=0.0 if is_large(system) else _slowest(worst, span),
        origin=fastest_origin(system, run.p, run.t[row], run.q[row], run.v[row]),
        steps_per_period=n,
        rule_step=2.0 * np.pi / rate / n if rate > 0.0 else np.inf,
        limits=tuple(_limits(system, worst)),
        method=run.method,
        reason=_reason(run),
        constraints=run.constraints,
        constraints_reason=_constraints_reason(run),
        rtol=run.rtol,
        cost=run_cost(run, span),
        evaluation=evaluation,
        fixed_steps=tuple(_fixed_steps(system, scales, rate, motion, span, steps_per_period, evaluation)),
    )
    if chosen is None:
        return advice
    method, step = chosen
    meant = replace(options, method=method, step=step)
    return replace(advice, choice=judge_choice(undriven, advice, scales, meant, steps_per_period))


def _short_run(system: System, options: RunOptions) -> Solution:
    """Return a run of few steps; one that fails, or is cut short, has states to look at, too."""
    n_subsystems = sum(len(kind["rates"]) for kind in system.subsystems)
    most = _SHORT_RUN_STEPS * max(1, n_subsystems)
    free = {"method": "auto", "step": None, "constraints": "auto", "at": (), "fps": None}
    return simulate(system, replace(options, max_steps=most, **free))


def _damping_of_fastest(scales: TimeScales) -> float:
    if not len(scales.eigenvalues):
        return 0.0
    return damping_ratio(complex(scales.eigenvalues[np.argmax(np.abs(scales.eigenvalues))]))


def _slowest(scales: TimeScales, span: float) -> float:
    magnitudes = np.abs(scales.eigenvalues)
    magnitudes = magnitudes[magnitudes > max(_SLOWEST * 1e-3 * scales.fastest, 1.0 / span)]
    return float(magnitudes.min(initial=scales.fastest)) if scales.fastest > 0.0 else 1.0 / span


def _reason(run: Solution) -> str:
    chosen = [note for note in run.notes if note.startswith(f"method auto: {run.method}")]
    text = chosen[-1].partition(f"{run.method}, ")[2] if chosen else ""
    return text.removeprefix("because ").removeprefix("although ") or "it is the default"


def _constraints_reason(run: Solution) -> str:
    return next(
        (note.partition(", which ")[2] for note in run.notes if note.startswith("constraints auto")), ""
    )


def _limits(system: System, scales: TimeScales):
    if scales.fastest <= 0.0:
        return
    for method in METHODS.values():
        if method.growth is not None and method.form == "projection" and _suits(method, system):
            undamped = stable_radius(method) / scales.fastest
            yield StabilityLimit(method.name, undamped, stable_step(method, scales.eigenvalues))


def _suits(method: Method, system: System) -> bool:
    try:
        refuse_unsuitable(method, system)
    except RuntimeModelError:
        return False
    return True


def _fixed_steps(
    system: System, scales: list[TimeScales], rate, motion, span: float, n: int | None, evaluation: float
):
    for method in METHODS.values():
        if (
            method.adaptive
            or stable_radius(method) == 0.0
            or method.form != "projection"
            or not _suits(method, system)
        ):
            continue
        stable = min(stable_step(method, scale.eigenvalues) for scale in scales)
        step, reason = _step(motion if method.stiff else rate, stable, span, n or method.steps_per_period)
        phases, practical = (
            min(step_for_phases(method, system, scale.eigenvalues, span, most) for scale in scales)
            for most in (np.inf, MOST_RECOMMENDED)
        )
        if n is None and phases < practical:
            continue
        if n is None and phases < step:
            step, reason = phases, "what errors of phase and size may add up to over the run"
        yield FixedStep(method.name, step, stable, reason, fixed_step_cost(method, span / step, evaluation))


def _step(rate: float, stable: float, span: float, n: int) -> tuple[float, str]:
    if rate <= 0.0:
        return span / 100.0, "a hundredth of the run, as there is no time scale"
    step = 2.0 * np.pi / rate / n
    if _SAFETY * stable < step:
        return _SAFETY * stable, f"{_SAFETY:g} of the stability limit"
    return step, f"{n} steps in the fastest period"
