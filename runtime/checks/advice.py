"""Which step and method suit a model, as data and in words: its time scales along a short run, and what follows."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from decimal import ROUND_CEILING, Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.health import health_of, objections_to
from symgen.runtime.checks.mode_origin import Origin, fastest_origin
from symgen.runtime.checks.stability import damping_ratio, stable_radius, stable_step
from symgen.runtime.checks.steps import MOST_RECOMMENDED, step_for_phases
from symgen.runtime.checks.time_scales import TimeScales, time_scales
from symgen.runtime.choose import refuse_unsuitable
from symgen.runtime.code import stand_ins
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS, Method, find_method
from symgen.runtime.options import RunOptions
from symgen.runtime.simulate import simulate
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_REPEATS = 5
_LEAST_ROWS = 1000
_TURNS_FAST = 2.0  # times the fastest eigenvalue: an oscillation's own rate stays below
_NAMED_DAMPING = 1e-3
_NO_TURN = 1e-6  # imaginary part of an eigenvalue, in parts of it: less is round-off of a double root
_MOST_STEPS = 200_000  # of the run that tells; it is judged as far as it comes
STEPS_PER_PERIOD = 50
_STATES = 20
_SHORT_RUN_STEPS = 2000
_SAFETY = 0.5  # of the stability limit
_MANY = 100  # steps: one more or less is within what a recommendation may be off by
_ROUND_OFF = 1e-12
_PERIODS_SEEN, _NO_SCALE = 10, 10.0  # how long a run is thought of where nobody says: periods, else seconds
_STANDS_STILL = 1e-6  # of the fastest eigenvalue: a smaller one is round-off of what does not move by itself
_SLOWEST = (
    1e-3  # of the fastest: eigenvalues below are round-off of the zeros of constraints and free motions
)


@dataclass(frozen=True)
class Cost:
    """Steps and wall time [s] of a whole run; 0 s where no model is there to be timed."""

    steps: int
    seconds: float

    def says(self, number: str = "about") -> str:
        """Return a few words."""
        seconds = f", {self.seconds:.2g} s" if self.seconds else ""
        return f"{number} {self.steps} steps{seconds}".strip()


def seconds_per_evaluation(run: Solution) -> float:
    """Return the least measured wall time of one evaluation of `rhs` [s], at states of a run."""
    repeats = -(-_LEAST_ROWS // len(run.t))
    times, states = np.tile(run.t, repeats), np.tile(run.states, (repeats, 1))
    taken = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        evaluate(run.system, "rhs", run.p, times, states)
        taken.append(time.perf_counter() - began)
    return min(taken) / len(times)


def run_cost(run: Solution, span: float) -> Cost:
    """Return the cost of a run of `span` [s] that begins as this one did."""
    part = span / max(float(run.t[-1] - run.t[0]), 1e-300)
    return Cost(round(run.stats["steps"] * part), run.seconds["run"] * part)


def fixed_step_cost(method: Method, steps: float, evaluation: float) -> Cost:
    """Return the cost of so many steps of a method of fixed step."""
    return Cost(math.ceil(steps), steps * method.evaluations * evaluation)


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
        Fastest period over `steps_per_period`; infinite where nothing moves by itself. Of about as many steps a run is
        made by steps of `whole_step(t_end - t_first, rule_step)`.
    limits : tuple of StabilityLimit
    method, reason : str
        The recommendation.
    constraints, constraints_reason : str
        How constraints are treated best; "none" without constraints.
    rtol : float
    cost : Cost
        Of the recommended method, as far as the short run tells.
    evaluation : float [s]
        Measured time of one evaluation of `rhs`; 0 where no model is there to be timed.
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
    def oscillates(self) -> bool:
        """Whether the fastest motion turns back: decays and growths have a time constant, not a period."""
        if self.origin is None:
            return self.damping_ratio < 1.0 - _NO_TURN
        value = self.origin.eigenvalue
        return abs(value.imag) > _NO_TURN * abs(value)

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
        span = advice.t_end - advice.t_first
        step = whole_step(span, advice.rule_step)
        of = "a period" if advice.oscillates or advice.rate > advice.fastest else "in 2 pi time constants"
        lines.append(
            f"rule: {advice.steps_per_period} steps {of}, a step of {advice.rule_step:.3g} s: "
            f"{math.ceil(span / step)} steps of {step:.10g} s for {span:g} s"
        )
    lines += _limit_lines(advice)
    lines.append(f"recommended method: {advice.method}, because {advice.reason}; {advice.cost.says()}")
    if advice.constraints != "none":
        lines.append(f"recommended constraint form: {advice.constraints}, which {advice.constraints_reason}")
    if METHODS[advice.method].adaptive:
        lines.append(
            f"recommended tolerance: rtol {advice.rtol:g}; run `symgen check` to see what it is worth at the end"
        )
        lines.append("recommended step: none to choose, the method adapts it; with a fixed step instead:")
    lines += _fixed(advice)
    if advice.evaluation:
        lines.append(f"one evaluation of the equations takes {1e9 * advice.evaluation:.3g} ns")
    return [*lines, *_choice(advice)]


def _scale(advice: Advice) -> str:
    if advice.fastest <= 0.0:
        return "nothing moves by itself: any step is stable"
    scale, at = 1.0 / advice.fastest, f"at t = {advice.t_fastest:.4g} s"
    if not advice.oscillates:
        does = "falls" if advice.damping_ratio > 0.0 else "grows"
        return (
            f"{scale:.3g} s, in which a motion {does} by a factor of e (rate {advice.fastest:.4g} 1/s {at})"
        )
    damped = (
        f", damping ratio {advice.damping_ratio:.3g}"
        if advice.damping_ratio > _NAMED_DAMPING
        else ", undamped"
    )
    return (
        f"{scale:.3g} s, a period of {2.0 * np.pi * scale:.3g} s (rate {advice.fastest:.4g} 1/s {at}{damped})"
    )


def _limit_lines(advice: Advice) -> list[str]:
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
            f"  {entry.method}: step {entry.step:.10g} s, {limit}; {entry.reason}; {entry.cost.says('')}"
        )
    return lines


def _choice(advice: Advice) -> list[str]:
    choice = advice.choice
    if choice is None:
        return []
    step = f", step {choice.step:g} s" if choice.step is not None else ""
    verdict = "pass" if choice.ok else "not suited"
    return [f"your choice, {choice.method}{step}: {verdict}: " + "; ".join(choice.reasons)]


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
        step = next((entry.step for entry in advice.fixed_steps if entry.method == method.name), None)
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
    if step <= whole_step(advice.t_end - advice.t_first, period / steps_per_period):
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
    with stand_ins.avoided():  # what is said of seconds is of code that long runs come to
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


def length_to_see(system: System, options: RunOptions) -> float:
    """Return how long a run takes to show the slowest motion at its start [s], for models that name no end.

    Ten of its periods, or times in which it falls e-fold; ten seconds of what neither oscillates nor decays.
    """
    run = _short_run(system, replace(options, t_end=_NO_SCALE))
    scales = time_scales(run.system, run.p, run.t[0], run.q[0], run.v[0])
    magnitudes = np.abs(scales.eigenvalues)
    slow = magnitudes[magnitudes > _STANDS_STILL * scales.fastest]
    slowest = float(slow.min(initial=scales.fastest)) if scales.fastest > 0.0 else 0.0
    return _PERIODS_SEEN * 2.0 * math.pi / slowest if slowest > 0.0 else _NO_SCALE


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
        step = whole_step(span, step)
        yield FixedStep(method.name, step, stable, reason, fixed_step_cost(method, span / step, evaluation))


_COUNTED = 1e15  # steps: a run of more has no whole number of them


def whole_step(span: float, step: float) -> float:
    """Return about `step` [s], of few digits, so that a run of `span` [s] takes a whole number of such steps.

    The number is the nearest, so that a period has hardly fewer steps; of less than a hundred the next higher one.
    """
    if not span / step <= _COUNTED:
        return step
    n = max(1, round(span / step) if span / step >= _MANY else math.ceil(span / step * (1.0 - _ROUND_OFF)))
    exact = span / n
    # Rounded up: of shorter ones it would take one step more, and of so many digits never one less.
    least = Decimal(exact * (1.0 - _ROUND_OFF))
    last_digit = Decimal(1).scaleb(least.adjusted() + 1 - max(4, len(str(n)) + 1))
    return max(exact, float(least.quantize(last_digit, rounding=ROUND_CEILING)))


def _step(rate: float, stable: float, span: float, n: int) -> tuple[float, str]:
    if rate <= 0.0:
        return span / 100.0, "a hundredth of the run, as there is no time scale"
    step = 2.0 * np.pi / rate / n
    if _SAFETY * stable < step:
        return _SAFETY * stable, f"{_SAFETY:g} of the stability limit"
    return step, f"{n} steps in the fastest period"
