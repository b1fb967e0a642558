"""Constraints in another form than projection, on random models: against projection at tight tolerances."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS

from .constrained_models import Drawn, draw
from .judging import attempt, flag
from .scenario import FLAGGED, RIGHT, WRONG, Outcome, Scenario, admits

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

N_ALL, N_SHORT = int(os.environ.get("SYMGEN_STRESS_FORMS", "240")), 12
RTOLS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
# An error may be this many times what dop853 makes of a tolerance with projection, or what the method itself makes of
# this one, and never this part of the motion. With Baumgarte's stabilisation it may be the sum of the errors of all
# steps: what projection takes away at once acts on the motion until drift is back (docs/constraints.md).
_TIMES, _TIMES_OWN, _MOST = 100.0, 10.0, 0.1
_ALL, _END = slice(None), slice(-1, None)
_TIGHT, _RTOLS_OF_GROWTH, _AGREE = 1e-13, (1e-9, 1e-11), 1e-7
_MISSING_ORDER, _SMALL, _CHAOTIC = 0.7, 1e-7, 1e4


def _run(drawn: Drawn, **options) -> Solution | Outcome:
    return attempt(drawn.system, drawn.t_end, **drawn.given, **options)


def difference(run: Solution, other: Solution, rows: slice = _ALL) -> float:
    """Return the largest difference of two runs at their frames, in parts of the largest coordinate or rate."""
    if run.q.shape != other.q.shape:
        return math.inf
    parts = [
        np.abs(a - b)[rows].max() / max(np.abs(b).max(), 1e-300)
        for a, b in ((run.q, other.q), (run.v, other.v))
    ]
    return float(max(parts)) if np.all(np.isfinite(parts)) else math.inf


def of_frames(method: str, rtol: float) -> float:
    """Return the tolerance that holds for frames between steps.

    Between the steps of a collocation method with s stages, whose ends have order 2s - 1, there is a polynomial of
    order s (Hairer and Wanner, Solving ODEs II, IV.8). Its error is what the estimate sees, so the estimate is held to
    the power (s + 1)/(2s) of the tolerance, for that of the ends to be the tolerance (`integrate/radau/error.py`).
    """
    order, between = METHODS[method].order, METHODS[method].dense_order
    return rtol ** ((between + 1) / (order + 1)) if between + 1 < order else rtol


@functools.lru_cache(maxsize=2)
def reference(index: int) -> tuple[Drawn, Solution | Outcome, float]:
    """Return the model of an index, its motion, and what projection makes of a tolerance of 1."""
    _, drawn = draw(index)
    tight = _run(drawn, method="dop853", rtol=_TIGHT, atol=0.1 * _TIGHT)
    if flag(tight) is not None:
        return drawn, flag(tight), 0.0
    if drawn.exact is not None:
        end = np.concatenate([tight.q[-1], tight.v[-1]])
        known = drawn.exact(tight.q[0], tight.v[0])
        if max(abs(end[k] - value) for k, value in known.items()) > _AGREE:
            return drawn, Outcome(WRONG, "projection does not end where the closed form does"), 0.0
    grows = 1.0
    for rtol in _RTOLS_OF_GROWTH:
        run = _run(drawn, method="dop853", rtol=rtol, atol=0.1 * rtol)
        grows = max(grows, math.inf if isinstance(run, Outcome) else difference(run, tight) / rtol)
    return drawn, tight, grows


@functools.lru_cache(maxsize=16)
def of_projection(index: int, method: str, rtol: float) -> tuple[float, float]:
    """Return the errors of motion and energy with projection, the latter without what energy scaling takes off."""
    drawn, exact, _ = reference(index)
    run = _run(drawn, method=method, rtol=rtol, atol=0.1 * rtol)
    return (
        (math.nan, math.nan)
        if isinstance(run, Outcome)
        else (difference(run, exact), run.energy.unscaled_error)
    )


def adaptive(index: int, method: str, form: str) -> Outcome:
    """Run one model at every tolerance; one that is wrong decides, else one that is flagged."""
    drawn, exact, grows = reference(index)
    if isinstance(exact, Outcome):
        return Outcome(RIGHT, f"left out, as projection says: {exact.says}")
    outcome, errors, ratios = None, [], []
    # A motion that makes more of an error is beyond its horizon, and nothing of the form is to be seen.
    for rtol in [r for r in RTOLS if _TIMES * r * grows <= 3.0 * _MOST]:
        run = _run(drawn, method=method, constraints=form, rtol=rtol, atol=0.1 * rtol)
        bad = flag(run)
        if bad is not None:
            outcome = outcome or Outcome(bad.verdict, f"at {rtol:.0e}: {bad.says}")
            if bad.verdict == WRONG:
                return outcome
            continue
        errors.append(difference(run, exact))
        own_error, own_energy = of_projection(index, method, rtol)
        ratios.append(run.energy.unscaled_error / max(own_energy, 0.1 * rtol, 1e-14))
        times = max(_TIMES, run.stats["steps"]) if form in ("baumgarte", "none") else _TIMES
        least = min(_TIMES_OWN * own_error, _MOST)
        allowed = [min(max(times * tol * grows, least), _MOST) for tol in (rtol, of_frames(method, rtol))]
        if not (difference(run, exact, _END) <= allowed[0] and errors[-1] <= allowed[1]):
            says = f"at {rtol:.0e}: error {errors[-1]:.1e}, with projection {own_error:.1e}"
            if not admits(run, errors[-1]):
                return Outcome(WRONG, says)
            outcome = outcome or Outcome(FLAGGED, f"{says}, which the report says as well")
    if outcome is not None or not errors:
        return outcome or Outcome(RIGHT, "left out: beyond its horizon")
    shown = ", ".join(f"{error:.0e}" for error in errors)
    return Outcome(RIGHT, f"errors {shown}; energy error at most {max(ratios):.1f} times that of projection")


def fixed(index: int, method: str, form: str) -> Outcome:
    """Run one model with a fixed step, and half of it: the error is small, or falls as the order says."""
    drawn, exact, grows = reference(index)
    if isinstance(exact, Outcome):
        return Outcome(RIGHT, f"left out, as projection says: {exact.says}")
    if grows > _CHAOTIC:
        return Outcome(RIGHT, "left out: beyond its horizon")
    step = drawn.t_end / max(500, 3 * exact.stats["steps"])
    errors = []
    for h in (step, 0.5 * step, 0.25 * step):
        run = _run(drawn, method=method, constraints=form, step=h)
        if flag(run) is not None:
            return Outcome(flag(run).verdict, f"at a step of {h:.2g} s: {flag(run).says}")
        errors.append(difference(run, exact))
        admitted = admits(run, errors[-1])
    order = METHODS[method].order
    found = math.log2(errors[1] / errors[2]) if errors[2] > 0.0 else math.inf
    good = (
        errors[1] <= _SMALL or errors[2] <= _SMALL or (found >= order - _MISSING_ORDER and errors[2] < _MOST)
    )
    return Outcome(
        RIGHT if good else FLAGGED if admitted and errors[2] < _MOST else WRONG,
        f"errors {errors[0]:.1e}, {errors[1]:.1e}, {errors[2]:.1e}, order {order}",
    )


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for index in range(N_ALL):
        for form, methods in FORMS.items():
            for method in methods:
                check = adaptive if METHODS[method].adaptive else fixed
                name = f"constrained model {index}: {method}, {form}"
                short = index < N_SHORT and form == "partition" and method == "dop853"
                run = functools.partial(check, index, method, form)
                yield Scenario(form, name, run, f"{method}, {form}", short)
