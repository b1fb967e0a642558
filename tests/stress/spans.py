"""Odd spans, tolerances, times and values: each refused with a reason, or right."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import Any

from .judging import attempt, demand, judge
from .models import bundled, point
from .scenario import FLAGGED, REFUSED, RIGHT, Outcome, Scenario

_INF, _NAN = math.inf, math.nan
# name -> arguments of a run, verdicts, and what a refusal has to say
ARGUMENTS: dict[str, tuple[dict[str, Any], tuple[str, ...], str]] = {
    "zero length": ({"t_end": 0.0}, (RIGHT, REFUSED), "t_end"),
    "end before start": ({"t_end": -1.0}, (REFUSED,), "t_end"),
    "end at a later start": ({"t_end": 1.0, "t_start": 1.0}, (RIGHT, REFUSED), "t_end"),
    "end is nan": ({"t_end": _NAN}, (REFUSED,), "t_end"),
    "end is infinite": ({"t_end": _INF}, (REFUSED,), "t_end"),
    "start is nan": ({"t_end": 1.0, "t_start": _NAN}, (REFUSED,), "t_start|t_end"),
    "start is minus infinity": ({"t_end": 1.0, "t_start": -_INF}, (REFUSED,), "t_start|t_end"),
    "length of 1e-300": ({"t_end": 1e-300}, (RIGHT, REFUSED, FLAGGED), "t_end|step|small"),
    "length of one rounding": ({"t_end": 1.0 + 2.3e-16, "t_start": 1.0}, (RIGHT, REFUSED, FLAGGED), "t_end|step|small"),
    "length of 4 roundings": ({"t_end": 1.0 + 1e-15, "t_start": 1.0}, (RIGHT, REFUSED, FLAGGED), "t_end|step|small"),
    "start at 1e17": ({"t_end": 1e17 + 1000.0, "t_start": 1e17}, (RIGHT, REFUSED, FLAGGED), "t_end|step|small"),
    "rtol 0, atol 0": ({"t_end": 1.0, "rtol": 0.0, "atol": 0.0}, (RIGHT, REFUSED, FLAGGED), "tol|step|converge"),
    "rtol negative": ({"t_end": 1.0, "rtol": -1e-6}, (REFUSED,), "rtol"),
    "rtol nan": ({"t_end": 1.0, "rtol": _NAN}, (REFUSED,), "rtol"),
    "rtol infinite": ({"t_end": 1.0, "rtol": _INF}, (REFUSED,), "rtol"),
    "rtol 1": ({"t_end": 1.0, "rtol": 1.0}, (RIGHT, REFUSED, FLAGGED), "rtol|energy"),
    "rtol 1e300": ({"t_end": 1.0, "rtol": 1e300, "atol": 1e300}, (RIGHT, REFUSED, FLAGGED), "rtol|energy|tol"),
    "atol negative": ({"t_end": 1.0, "atol": -1.0}, (REFUSED,), "atol"),
    "sample beyond the end": ({"t_end": 1.0, "at": [2.0]}, (REFUSED,), "at"),
    "sample is nan": ({"t_end": 1.0, "at": [_NAN]}, (REFUSED,), "at"),
    "samples a rounding apart": ({"t_end": 1.0, "at": [0.5, 0.5 + 1.2e-16, 1.0 - 1e-16]}, (RIGHT, FLAGGED), "step"),
    "fps 0": ({"t_end": 1.0, "fps": 0.0}, (REFUSED,), "fps"),
    "fps infinite": ({"t_end": 1.0, "fps": _INF}, (REFUSED,), "fps"),
    "fps 1e15": ({"t_end": 1.0, "fps": 1e15}, (REFUSED,), "fps"),
    "no steps allowed": ({"t_end": 1.0, "max_steps": 0}, (REFUSED, FLAGGED), "step"),
    "one step allowed": ({"t_end": 1e3, "max_steps": 1}, (FLAGGED,), "step"),
    "negative steps allowed": ({"t_end": 1.0, "max_steps": -5}, (REFUSED, FLAGGED), "step"),
    "parameter is nan": ({"t_end": 1.0, "parameters": {"k": _NAN}}, (REFUSED,), "k"),
    "parameter is infinite": ({"t_end": 1.0, "parameters": {"k": _INF}}, (REFUSED,), "k"),
    "mass 0": ({"t_end": 1.0, "parameters": {"m": 0.0}}, (REFUSED, FLAGGED), "m"),
    "mass negative": ({"t_end": 1.0, "parameters": {"m": -1.0}}, (REFUSED,), "m"),
    "mass 1e-300": ({"t_end": 1.0, "parameters": {"m": 1e-300}}, (REFUSED, FLAGGED), r"'dot\(x\)'|no series|step"),
    "start value nan": ({"t_end": 1.0, "start": {"x": _NAN}}, (REFUSED,), "x"),
    "start rate infinite": ({"t_end": 1.0, "rate": {"x": _INF}}, (REFUSED,), "x"),
    "unknown parameter": ({"t_end": 1.0, "parameters": {"kk": 1.0}}, (REFUSED,), "kk"),
    "unknown method": ({"t_end": 1.0, "method": "rk5"}, (REFUSED,), "rk5"),
    "unknown constraints": ({"t_end": 1.0, "constraints": "nothing"}, (REFUSED,), "nothing"),
    "negative step": ({"t_end": 1.0, "method": "rk4", "step": -0.1}, (REFUSED,), "step"),
    "step 0": ({"t_end": 1.0, "method": "rk4", "step": 0.0}, (REFUSED,), "step"),
    "step nan": ({"t_end": 1.0, "method": "rk4", "step": _NAN}, (REFUSED,), "step"),
    "step infinite": ({"t_end": 1.0, "method": "rk4", "step": _INF}, (REFUSED,), "step"),
    "step for an adaptive method": ({"t_end": 1.0, "method": "dop853", "step": 0.1}, (REFUSED,), "step"),
}  # fmt: skip
METHODS = ("auto", "dop853", "taylor", "radau5", "bdf", "rk4", "gauss8")


def odd(name: str, method: str) -> Outcome:
    """A vibration x = cos t run with odd arguments; its frames have to be those of cos."""
    given, verdicts, pattern = ARGUMENTS[name]
    given = {"method": method, **given}
    run = attempt(point("vibration", "-k*x", k=1.0), **given)

    def error(solution):
        start = given.get("t_start", 0.0)
        return max(abs(x - math.cos(t - start)) for t, x in zip(solution.t, solution.q[:, 0], strict=True))

    loose = 2e-3 if given.get("rtol", 0.0) < 0.5 else math.inf
    return demand(judge(run, error, loose), verdicts, pattern)


def inconsistent(start: float, verdicts: tuple[str, ...], pattern: str) -> Outcome:
    """A pendulum in x and y that starts off its circle by a little, or by a lot."""
    run = attempt(bundled("pendulum_dae"), 0.5, start={"x": 1.0 + start, "y": 0.0})
    return demand(judge(run, lambda s: abs(math.hypot(*s.q[-1]) - 1.0), 1e-8), verdicts, pattern)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for name, (given, _, _) in ARGUMENTS.items():
        for method in METHODS if "method" not in given else ("auto",):
            run = functools.partial(odd, name, method)
            yield Scenario("arguments", f"{name}: {method}", run, method, short=method in ("auto", "dop853"))
    for off, verdicts, pattern in ((1e-9, (RIGHT,), ""), (1e-2, (REFUSED,), "rod|length|constraint")):
        run = functools.partial(inconsistent, off, verdicts, pattern)
        yield Scenario("arguments", f"start off the constraint by {off:.0e}", run)
