"""Events whose functions make choices, up to three within each other, along a cosine: all their crossings are known.

Functions are drawn of signs, floors, steps, sizes, choices and products of the place, the rate and time. Those that
come near zero without a crossing, or cross twice at once, are left out.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, flag
from .models import point
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

_CASES = 4  # with each method
_RTOLS = (1e-5, 1e-7, 1e-9)
_T, _STEP, _LOOKS = 6.0, 2e-3, 600_001  # of methods of fixed step [s]; places at which a function is known
_NEAR, _APART, _MOST = 2e-3, 0.02, 60  # of zero; crossings [s]; how many
_LATE, _OF_ERROR = 3e-3, 30.0  # [s]; of what the motion is off by


def drawn(r: np.random.Generator, depth: int) -> str:
    """Return an expression of x, dot(x) and t."""

    def number(low: float = -1.0, high: float = 1.0) -> float:
        return round(float(r.uniform(low, high)), 3)

    def part() -> str:
        return drawn(r, depth - 1)

    kind = int(r.integers(12 if depth > 0 else 3))
    if kind == 0:
        return f"({number(-2, 2)}*x + {number()})"
    if kind == 1:
        return f"({number(-2, 2)}*dot(x) + {number()})"
    if kind == 2:
        return f"({number(0.2)}*sin({number(0.5, 3)}*t) + {number(-0.6, 0.6)})"
    if kind == 3:
        return f"where({part()} < {part()}, {part()}, {part()})"
    if kind in (4, 5):
        return f"{'max' if kind == 4 else 'min'}({part()}, {part()})"
    if kind == 6:
        return f"({part()}*{number(0.3)} + {part()})"
    if kind == 7:
        return f"({part()}*{part()})"
    if kind == 8:
        return f"abs({part()} + {number()})"
    if kind == 9:
        return f"sign({part()})"
    if kind == 10:
        return f"(floor({number(1, 3)}*{part()}) + {number(0.1, 0.9)})"
    return f"({part()} - heaviside({part()}))"


def crossings(told: str, t: np.ndarray, x: np.ndarray, v: np.ndarray) -> np.ndarray | None:
    """Return when a function of a motion crosses zero; None where that is not clear."""
    names = {
        "x": x, "t": t, "dot": lambda _: v, "where": np.where, "abs": np.abs, "max": np.maximum, "min": np.minimum,
        "sin": np.sin, "sign": np.sign, "floor": np.floor, "heaviside": lambda q: np.heaviside(q, 0.5),
    }  # fmt: skip
    g = eval(told, names) * np.ones_like(t)
    sides = np.sign(g)
    if (sides == 0.0).any():
        return None
    found = np.flatnonzero(sides[1:] != sides[:-1])
    size = np.abs(g)
    low = np.flatnonzero((size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:]) & (size[1:-1] < _NEAR)) + 1
    if any(np.abs(found - k).min(initial=10) > 2 for k in low) or len(found) > _MOST:
        return None
    times = t[found]
    if np.diff(np.concatenate([[0.0], times, [_T]])).min() < _APART:
        return None
    return times


def event(number: int, method: str) -> Outcome:
    """Run a cosine with one event, and hold its times against those that are known."""
    r = np.random.default_rng([number, 77])
    w, start = round(float(r.uniform(1, 4)), 3), round(float(r.uniform(0.3, 1.2)), 3)
    told, t = drawn(r, int(r.integers(1, 4))), np.linspace(0.0, _T, _LOOKS)
    expected = crossings(told, t, start * np.cos(w * t), -w * start * np.sin(w * t))
    if expected is None:
        return Outcome(RIGHT, "its crossings are not clear")
    given = {"rtol": float(r.choice(_RTOLS))} if find_method(method).adaptive else {"step": _STEP}
    system = point("event_function", f"-{w * w!r}*x", start=start, rest=f'[events.hit]\nwhen = "{told}"')
    run = attempt(system, _T, method=method, **given)
    flagged = flag(run)
    if flagged is not None and flagged.verdict == REFUSED:
        return flagged
    found = np.array([e.t for e in run.events])
    off = abs(float(run["x"][-1]) - start * np.cos(w * _T))
    alike = len(found) == len(expected)
    late = float(np.abs(found - expected).max(initial=0.0)) if alike else np.inf
    says = f"{told}: {len(found)} of {len(expected)} crossings, off by {late:.1e} s, the motion by {off:.1e}, {given}"
    if flagged is not None:
        return Outcome(FLAGGED, f"{says}: {flagged.says}")
    return Outcome(RIGHT if late <= max(_LATE, _OF_ERROR * off) else WRONG, says)


def scenarios() -> Iterator[Scenario]:
    """Yield events with each method."""
    for k, method in enumerate(METHODS):
        for number in range(_CASES):
            run = functools.partial(event, number * len(METHODS) + k, method)
            short = number == 0 and method in ("dop853", "taylor")
            yield Scenario("event functions", f"event function {number}: {method}", run, method, short)
