"""Which step and method suit a model: its time scales along a short run, and what follows from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.checks.stability import stable_step
from runtime.checks.time_scales import TimeScales, time_scales
from runtime.choose import choose_method
from runtime.integrate.methods import METHODS, Method

if TYPE_CHECKING:
    from runtime.solution import Solution
    from runtime.system import System

_STATES = 20
_SHORT_RUN_STEPS = 2000
# By order: an error of about 1e-3 per radian or better.
_STEPS_PER_PERIOD = {1: 1000, 2: 100, 4: 40, 8: 20, 14: 12}
_SAFETY = 0.5  # of the stability limit


@dataclass(frozen=True)
class FixedStep:
    """A fixed-step method: the step to take, the limit of stability (infinite if there is none) [s], why."""

    method: str
    step: float
    stable: float
    reason: str


@dataclass(frozen=True)
class Advice:
    """What suits a model.

    Attributes
    ----------
    n_states : int
        How many states were looked at.
    t_seen : float [s]
        Up to when.
    fastest, t_fastest : float
        Largest rate of the linearised motion [1/s], and when.
    decay, motion : float
        Fastest decay, and fastest other motion [1/s].
    method, reason : str
        The recommendation.
    fixed_steps : tuple of FixedStep
        For users who want a fixed step.
    """

    n_states: int
    t_seen: float
    fastest: float
    t_fastest: float
    decay: float
    motion: float
    method: str
    reason: str
    fixed_steps: tuple[FixedStep, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the advice as a dictionary."""
        return asdict(self)

    def lines(self) -> list[str]:
        """Return the advice as lines of text."""
        if self.fastest <= 0.0:
            scale = "nothing moves by itself: any step is stable"
        else:
            period = 2.0 * np.pi / self.fastest
            scale = (
                f"{1.0 / self.fastest:.3g} s, a period of {period:.3g} s (rate {self.fastest:.4g} 1/s at "
                f"t = {self.t_fastest:.4g} s)"
            )
        lines = [f"fastest time scale: {scale}"]
        if self.decay > 0.0:
            lines.append(f"fastest decay: {self.decay:.4g} 1/s, fastest other motion: {self.motion:.4g} 1/s")
        lines.append(f"recommended method: {self.method}, because {self.reason}")
        if not METHODS[self.method].adaptive:
            return [*lines, *self._fixed()]
        return [
            *lines,
            "recommended step: none to choose, the method adapts it; with a fixed step instead:",
            *self._fixed(),
        ]

    def _fixed(self) -> list[str]:
        lines = []
        for entry in self.fixed_steps:
            limit = (
                f"stable up to {entry.stable:.3g} s" if np.isfinite(entry.stable) else "no stability limit"
            )
            lines.append(f"  {entry.method}: step {entry.step:.3g} s, {limit}; {entry.reason}")
        return lines


def advise(system: System, arguments: Mapping[str, Any]) -> Advice:
    """Look at a model's time scales and say what suits it.

    Parameters
    ----------
    system : System
    arguments : mapping
        As `runtime.solve.solve` takes them.
    """
    run = _short_run(system, arguments)
    rows = np.unique(np.linspace(0, len(run.t) - 1, _STATES).astype(int))
    scales = [time_scales(system, run.p, run.t[i], run.q[i], run.v[i]) for i in rows]
    fastest = int(np.argmax([scale.fastest for scale in scales]))
    decay = max(scale.decay for scale in scales)
    motion = max(scale.motion for scale in scales)
    method, notes = choose_method(
        "auto",
        system,
        run.p,
        float(run.t[0]),
        run.states[0],
        float(arguments["t_end"]),
        arguments["rtol"],
        arguments["atol"],
    )
    worst = replace(scales[fastest], decay=decay, motion=motion)
    return Advice(
        n_states=len(rows),
        t_seen=float(run.t[-1]),
        fastest=worst.fastest,
        t_fastest=float(run.t[rows[fastest]]),
        decay=decay,
        motion=motion,
        method=method.name,
        reason=_reason(notes, method.name),
        fixed_steps=tuple(_fixed_steps(system, worst, float(arguments["t_end"]))),
    )


def _short_run(system: System, arguments: Mapping[str, Any]) -> Solution:
    from runtime.solve import solve

    # A run that fails, or is cut short, has states to look at, too.
    settings = {**arguments, "method": "dop853", "step": None, "at": (), "fps": None}
    return solve(system, max_steps=_SHORT_RUN_STEPS, **settings)


def _reason(notes: list[str], method: str) -> str:
    text = notes[0].partition(f"{method}, ")[2] if notes else ""
    return text.removeprefix("because ").removeprefix("although ") or "it is the default"


def _fixed_steps(system: System, scales: TimeScales, t_end: float):
    for method in METHODS.values():
        if (
            not method.adaptive
            and method.name != "euler"
            and (system.nq == system.nv or not method.needs_plain_rates)
            and not method.refusal(system)
        ):
            yield _fixed_step(method, scales, t_end)


def _fixed_step(method: Method, scales: TimeScales, t_end: float) -> FixedStep:
    rate = scales.motion if method.stiff else scales.fastest
    stable = stable_step(method, scales.fastest)
    if rate <= 0.0:
        return FixedStep(
            method.name, t_end / 100.0, stable, "a hundredth of the run, as there is no time scale"
        )
    order = max(order for order in _STEPS_PER_PERIOD if order <= method.order)
    per_period = _STEPS_PER_PERIOD[order]
    step = 2.0 * np.pi / rate / per_period
    if _SAFETY * stable < step:
        return FixedStep(method.name, _SAFETY * stable, stable, f"{_SAFETY:g} of the stability limit")
    return FixedStep(
        method.name, step, stable, f"{per_period} steps in the fastest period, for order {method.order}"
    )
