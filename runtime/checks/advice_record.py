"""What suits a model, as data and in words."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from symgen.runtime.checks.cost import Cost
from symgen.runtime.checks.mode_origin import Origin
from symgen.runtime.integrate.methods import METHODS

_TURNS_FAST = 2.0  # times the fastest eigenvalue: an oscillation's own rate stays below
_NAMED_DAMPING = 1e-3


@dataclass(frozen=True)
class StabilityLimit:
    """The longest stable steps of an explicit method on the fastest motion [s].

    `undamped` is what it would be without damping; 0 where no step is stable.
    """

    method: str
    undamped: float
    damped: float


@dataclass(frozen=True)
class FixedStep:
    """A method of fixed step: the step, the limit of stability (infinite if there is none) [s], why, what it costs."""

    method: str
    step: float
    stable: float
    reason: str
    cost: Cost


@dataclass(frozen=True)
class Choice:
    """What is to be said about a choice of method and step [s]: `reasons` are objections where it is not ok."""

    method: str
    step: float | None
    ok: bool
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Advice:
    """What suits a model.

    Attributes
    ----------
    n_states : int
        How many states were looked at.
    t_first, t_seen, t_end : float [s]
        From when, up to when; the end of the run that is asked for.
    fastest, t_fastest : float
        Largest rate of the linearised motion [1/s], and when.
    damping_ratio : float
        Of that motion: 0 undamped, 1 a decay without oscillation.
    decay, motion, turning : float
        Fastest decay, fastest other motion, and fastest turn of an angle or body [1/s].
    slowest : float
        Slowest motion at the state of the fastest, at least one per run [1/s]; 0 for large models, where it is not
        looked for.
    origin : Origin or None
        What the fastest motion belongs to.
    steps_per_period : int
    rule_step : float [s]
        Fastest period over `steps_per_period`; infinite where nothing moves by itself.
    limits : tuple of StabilityLimit
    method, reason : str
        The recommendation.
    constraints, constraints_reason : str
        How constraints are treated best; "none" without constraints.
    rtol : float
    cost : Cost
        Of the recommended method, as far as the short run tells.
    evaluation : float [s]
        Measured time of one evaluation of `rhs`.
    fixed_steps : tuple of FixedStep
        For users who want a fixed step.
    choice : Choice or None
        What is to be said about the method and step of the user's choice.
    """

    n_states: int
    t_first: float
    t_seen: float
    t_end: float
    fastest: float
    t_fastest: float
    damping_ratio: float
    decay: float
    motion: float
    turning: float
    slowest: float
    origin: Origin | None
    steps_per_period: int
    rule_step: float
    limits: tuple[StabilityLimit, ...]
    method: str
    reason: str
    constraints: str
    constraints_reason: str
    rtol: float
    cost: Cost
    evaluation: float
    fixed_steps: tuple[FixedStep, ...]
    choice: Choice | None = None

    @property
    def rate(self) -> float:
        """The rate that a step has to follow [1/s]: the fastest motion, or a turn much faster than that."""
        return rate_to_follow(self.fastest, self.turning)

    @property
    def stiffness_ratio(self) -> float:
        """Fastest over slowest motion."""
        return self.fastest / self.slowest if self.slowest > 0.0 else 1.0

    @property
    def ok(self) -> bool:
        """Whether there is nothing against the user's choice."""
        return self.choice is None or self.choice.ok

    def to_dict(self) -> dict[str, Any]:
        """Return the advice as a dictionary."""
        data = asdict(self) | {"stiffness_ratio": self.stiffness_ratio}
        if self.origin is not None:
            value = self.origin.eigenvalue
            data["origin"] |= {"eigenvalue": [value.real, value.imag], "says": self.origin.says()}
        return data

    def lines(self) -> list[str]:
        """Return the advice as lines of text."""
        return _lines(self)


def rate_to_follow(fastest: float, turning: float) -> float:
    """Return the rate that a step has to follow [1/s]: the fastest motion, or a turn much faster than that."""
    return turning if turning > _TURNS_FAST * fastest else fastest


def _lines(advice: Advice) -> list[str]:
    """Return what an advice says, the fastest time scale first."""
    lines = [f"fastest time scale: {_scale(advice)}"]
    if advice.origin is not None:
        lines.append(f"it belongs to: {advice.origin.says()}")
    if advice.turning > advice.fastest:
        period = 2.0 * np.pi / advice.turning
        lines.append(f"fastest turn: {advice.turning:.4g} rad/s, one in {period:.3g} s")
    if advice.decay > 0.0:
        lines.append(f"fastest decay: {advice.decay:.4g} 1/s, fastest other motion: {advice.motion:.4g} 1/s")
    if advice.fastest > 0.0 and advice.slowest > 0.0:
        lines.append(
            f"stiffness ratio: {advice.stiffness_ratio:.3g} (fastest over slowest motion, {advice.slowest:.3g} 1/s)"
        )
    if np.isfinite(advice.rule_step):
        n_steps = round((advice.t_end - advice.t_first) / advice.rule_step)
        lines.append(
            f"rule: {advice.steps_per_period} steps a period, a step of {advice.rule_step:.3g} s, "
            f"{n_steps} steps for {advice.t_end - advice.t_first:g} s"
        )
    lines += _limits(advice)
    lines.append(f"recommended method: {advice.method}, because {advice.reason}; {advice.cost.says()}")
    if advice.constraints != "none":
        lines.append(f"recommended constraint form: {advice.constraints}, which {advice.constraints_reason}")
    if METHODS[advice.method].adaptive:
        lines.append(
            f"recommended tolerance: rtol {advice.rtol:g}; run `symgen check` to see what it is worth at the end"
        )
        lines.append("recommended step: none to choose, the method adapts it; with a fixed step instead:")
    lines += _fixed(advice)
    lines.append(f"one evaluation of the equations takes {1e9 * advice.evaluation:.3g} ns")
    return [*lines, *_choice(advice)]


def _scale(advice: Advice) -> str:
    if advice.fastest <= 0.0:
        return "nothing moves by itself: any step is stable"
    period = 2.0 * np.pi / advice.fastest
    damped = (
        f", damping ratio {advice.damping_ratio:.3g}"
        if advice.damping_ratio > _NAMED_DAMPING
        else ", undamped"
    )
    return (
        f"{1.0 / advice.fastest:.3g} s, a period of {period:.3g} s (rate {advice.fastest:.4g} 1/s at "
        f"t = {advice.t_fastest:.4g} s{damped})"
    )


def _limits(advice: Advice) -> list[str]:
    if not advice.limits:
        return []
    lines = ["stability limits of explicit methods on that motion, undamped and with its damping:"]
    for limit in advice.limits:
        undamped, damped = (
            f"{h:.3g} s" if h > 0.0 else "never stable" for h in (limit.undamped, limit.damped)
        )
        lines.append(f"  {limit.method}: {undamped}, {damped}")
    return lines


def _fixed(advice: Advice) -> list[str]:
    lines = []
    for entry in advice.fixed_steps:
        limit = f"stable up to {entry.stable:.3g} s" if np.isfinite(entry.stable) else "no stability limit"
        lines.append(
            f"  {entry.method}: step {entry.step:.3g} s, {limit}; {entry.reason}; {entry.cost.says()}"
        )
    return lines


def _choice(advice: Advice) -> list[str]:
    choice = advice.choice
    if choice is None:
        return []
    step = f", step {choice.step:g} s" if choice.step is not None else ""
    verdict = "pass" if choice.ok else "not suited"
    return [f"your choice, {choice.method}{step}: {verdict}: " + "; ".join(choice.reasons)]
