"""Stiffness up to 1e12: decays and vibrations far faster than the motion, exact solutions known."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np

from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, demand, end_error, judge
from .models import point
from .scenario import FLAGGED, REFUSED, RIGHT, Outcome, Scenario

STIFFNESSES = (1e4, 1e6, 1e8, 1e10, 1e12)
_FORCE = "-k*(x - cos(t)) - c*(dot(x) + sin(t)) - cos(t)"
_T = 3.0
_WITH_EASE = 1e8  # beyond it, bdf may run out of steps or miss the energy balance, and say so


def decaying(k: float, method: str) -> Outcome:
    """A critically damped spring of stiffness k pulls towards cos t, the exact solution (Prothero, Robinson)."""
    system = point("driven_stiffly", _FORCE, k=k, c=2.0 * math.sqrt(k))
    run = attempt(system, _T, method=method, rtol=1e-7, atol=1e-9, max_steps=100_000)
    exact = end_error(np.array([math.cos(_T)]), np.array([-math.sin(_T)]))
    # Velocities that a spring of stiffness k allows are known to the rounding of k x, over c.
    outcome = judge(run, exact, 1e-4 + 1e-15 * k / math.sqrt(k))
    sure = method == "auto" or method.startswith("radau") or (METHODS[method].stiff and k <= _WITH_EASE)
    allowed = (RIGHT,) if sure else (RIGHT, REFUSED, FLAGGED)
    return demand(outcome, allowed, "steps|stab|stiff|resolution|small|energy|infinite|series")


def vibrating(k: float, method: str) -> Outcome:
    """An undamped spring of stiffness k, four periods from rest: x = cos(sqrt(k) t)."""
    w = math.sqrt(k)
    t = 4.25 * 2.0 * math.pi / w
    run = attempt(point("vibrating", "-k*x", k=k), t, method=method, rtol=1e-9, atol=1e-12)

    # Its end is where the position is zero: held against the amplitude, which the rate shows.
    def error(solution):
        return max(abs(solution.q[-1, 0] - math.cos(w * t)), abs(solution.v[-1, 0] / w + math.sin(w * t)))

    return demand(judge(run, error, 1e-4), (RIGHT,))


def scenarios() -> Iterator[Scenario]:
    """Yield all: every adaptive method and `auto`, those of fixed step are among the tables of every method."""
    adaptive = ["auto", *(name for name, method in METHODS.items() if method.adaptive)]
    for k in STIFFNESSES:
        for method in adaptive:
            short = method in ("auto", "radau5", "taylor") or k == 1e12
            yield Scenario(
                "stiffness", f"decay of stiffness {k:.0e}: {method}", functools.partial(decaying, k, method), method,
                short,
            )  # fmt: skip
            yield Scenario(
                "stiffness", f"vibration of stiffness {k:.0e}: {method}", functools.partial(vibrating, k, method),
                method, short=method == "auto",
            )  # fmt: skip
