"""How a run is judged: refusals and flags first, then its end against an independent reference."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.errors import ModelError
from symgen.runtime import solve
from symgen.runtime.errors import RuntimeModelError

from .scenario import DOUBTED, FLAGGED, REFUSED, RIGHT, WRONG, Outcome, admits

if TYPE_CHECKING:
    from symgen.runtime import Solution, System

MOST_STEPS = 300_000
RIGHT_END, WRONG_END = 1e-4, 0.05  # of what a quantity does
_SMALL = 1e-5  # of the motion: an error that says nothing about the order of a method any more
_ROUNDED = 1e-9
_MISSING_ORDER = 0.7
_SHORTER = (0.5, 0.61, 0.37)
_CHANGE_POINT = r"depend on each other at"


def attempt(system: System, t_end: float | None = None, **options: Any) -> Solution | Outcome:
    """Run, or return the refusal."""
    options.setdefault("max_steps", MOST_STEPS)
    try:
        return solve(system, t_end, **options)
    except (RuntimeModelError, ModelError) as error:
        return refusal(error)


def refusal(error: Exception) -> Outcome:
    """Return the outcome of an error that the user gets: it has to say something."""
    return Outcome(REFUSED if len(str(error)) > 10 else WRONG, str(error))


def flag(run: Solution | Outcome) -> Outcome | None:
    """Return why a run is refused or flagged, None where it claims to be right."""
    if isinstance(run, Outcome):
        return run
    if run.status not in ("success", "terminated"):
        return Outcome(FLAGGED if len(run.message) > 10 else WRONG, f"{run.status}: {run.message}")
    if not run.objections:
        return None
    # Notes stand beside objections, and may name their cause.
    said = [*run.objections, *run.advice]
    return Outcome(FLAGGED, "; ".join(f"{check.check}: {check.says}" for check in said))


def judge(run: Solution | Outcome, error: Callable[[Solution], float], allowed: float) -> Outcome:
    """Return the outcome of a run that is right if `error(run)` is at most `allowed`."""
    flagged = flag(run)
    if flagged is not None:
        return flagged
    value = float(error(run))
    return Outcome(RIGHT if value <= allowed else WRONG, f"error {value:.1e}, allowed {allowed:.1e}")


def judge_convergence(
    system: System, t_end: float, error: Callable[[Solution], float], order: int, **options: Any
) -> Outcome:
    """Judge a method of fixed step: its error is small, or falls with the step as its order says."""
    run = attempt(system, t_end, **options)
    flagged = flag(run)
    if flagged is not None:
        return flagged
    for part in _SHORTER:
        shorter = attempt(system, t_end, **{**options, "step": part * run.step})
        flagged = flag(shorter)
        if flagged is None:
            break
        # Steps pass a change point, or end in it, as they fall.
        if not re.search(_CHANGE_POINT, flagged.says):
            return Outcome(WRONG, f"{part} of the step: {flagged.says}")
    else:
        return Outcome(WRONG, f"no shorter step: {flagged.says}")
    coarse, fine = float(error(run)), float(error(shorter))
    found = math.log(coarse / fine) / -math.log(part) if fine > 0.0 and coarse > 0.0 else math.inf
    says = f"error {coarse:.1e}, with {part} of the step {fine:.1e}, order {order}"
    good = coarse <= _SMALL or fine <= _ROUNDED or (found >= order - _MISSING_ORDER and fine < 0.5)
    return Outcome(RIGHT if good else WRONG, says)


def judge_end(
    run: Solution, off: float, said: str, *, right: float = RIGHT_END, wrong: float = WRONG_END
) -> Outcome:
    """Return the outcome of a run whose end is off by so much, in parts of what its quantities do.

    Parameters
    ----------
    off : float
    said : str
        What was run, and how.
    right, wrong : float
        Up to where a flag is one of a right run, and from where on silence is wrong.
    """
    said, flagged = f"error {off:.1e}, {said}", flag(run)
    if flagged is not None:
        ended = run.status in ("success", "terminated")
        return Outcome(DOUBTED if ended and off < right else FLAGGED, f"{said}: {flagged.says}")
    if off <= wrong:
        return Outcome(RIGHT, said)
    return Outcome(FLAGGED if admits(run, off) else WRONG, said)


def end_error(q: np.ndarray, v: np.ndarray) -> Callable[[Solution], float]:
    """Return the error of a run's end against coordinates and rates, in parts of the largest of the run."""

    def error(run: Solution) -> float:
        parts = [
            np.abs(found[-1] - expected).max() / max(np.abs(expected).max(), np.abs(found).max(), 1e-300)
            for found, expected in ((run.q, q), (run.v, v))
        ]
        return max(parts) if np.all(np.isfinite(parts)) else np.inf

    return error


def demand(outcome: Outcome, verdicts: tuple[str, ...] | str, pattern: str = "") -> Outcome:
    """Return WRONG where an outcome is not of the verdicts that theory allows, or does not say why.

    Parameters
    ----------
    pattern : str
        A regular expression; a refusal or flag has to match it: its true reason.
    """
    verdicts = (verdicts,) if isinstance(verdicts, str) else verdicts
    if outcome.verdict not in verdicts:
        return Outcome(WRONG, f"should be {' or '.join(verdicts)}, is {outcome.verdict}: {outcome.says}")
    if outcome.verdict != RIGHT and not re.search(pattern, outcome.says, re.IGNORECASE):
        return Outcome(WRONG, f"does not say {pattern!r}: {outcome.says}")
    return outcome
