"""Sizes far apart: mass ratios to 1e8, spins to 1e5 rad/s, tiny and huge units and steps."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np

from symgen.runtime.checks.error_estimate import LARGEST_ERROR
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, demand, end_error, flag, judge
from .models import bundled, described, point
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

RATIOS = (1e-8, 1e-4, 1e4, 1e8)
SPINS = (1e2, 1e3, 1e4, 1e5)

_TOP = """
name = "symmetric_body"
[parameters]
A = "2 kg*m^2"
C = "3 kg*m^2"
[bodies.body]
mass = "1 kg"
com = [0, 0, 0]
inertia = ["A", "A", "C"]
[joints.turn]
type = "spherical"
parent = "world"
child = "body"
rate = [0.0, 0.0, 1.0]
[run]
t_end = 1.0
"""


def two_methods(model: str, t_end: float, allowed: float, parameters: dict[str, float]) -> Outcome:
    """What `auto` finds agrees with an implicit method at tight tolerance, or is flagged."""
    system = bundled(model)
    run = attempt(system, t_end, parameters=parameters, rtol=1e-9, atol=1e-11)
    other = attempt(system, t_end, parameters=parameters, method="radau9", rtol=1e-11, atol=1e-13)
    if flag(other) is not None:
        return flag(run) or Outcome(WRONG, f"no reference: {flag(other).says}")
    return judge(run, end_error(other.q[-1], other.v[-1]), allowed)


def spinning(spin: float, method: str) -> Outcome:
    """A free symmetric body: its spin stays, the rates across precess at (1 - C/A) times the spin."""
    system = described(_TOP)
    t = 200.0 / spin
    rates = {"turn_wx": 0.01 * spin, "turn_wy": 0.0, "turn_wz": spin}
    run = attempt(system, t, rate=rates, method=method, rtol=1e-9, atol=1e-11)
    angle = (1.5 - 1.0) * spin * t
    v = spin * np.array([0.01 * math.cos(angle), 0.01 * math.sin(angle), 1.0])
    momentum = np.array([2.0, 2.0, 3.0]) * rates_of(spin)
    return judge(run, lambda s: max(np.abs(s.v[-1] - v).max() / (0.01 * spin), _turned(s, momentum)), 1e-5)


def rates_of(spin: float) -> np.ndarray:
    """Return the body rates at the start."""
    return spin * np.array([0.01, 0.0, 1.0])


def _turned(solution, momentum: np.ndarray) -> float:
    """Return how far the angular momentum in world axes has moved, in parts of its size."""
    w, x, y, z = solution.q[-1]
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    now = rotation @ (np.array([2.0, 2.0, 3.0]) * solution.v[-1])
    return float(np.abs(now - momentum).max() / np.abs(momentum).max())


def scaled(length: float, seconds: float, method: str) -> Outcome:
    """A vibration in other units, x = length cos(t / seconds), tolerances in the same units."""
    system = point("scaled", "-k*x", k=1.0)
    k, t_end = seconds**-2, 5.0 * seconds
    run = attempt(
        system, t_end, parameters={"k": k}, start={"x": length}, method=method, rtol=1e-8, atol=1e-10 * length
    )
    return judge(run, lambda s: abs(s.q[-1, 0] / length - math.cos(5.0)), 1e-4)


def step_of(step: float, method: str) -> Outcome:
    """A given step far below or above what the run can use: refused, flagged, or cut to the length of the run."""
    run = attempt(point("steps", "-x"), 1.0, method=method, step=step, max_steps=1000)
    outcome = judge(run, lambda s: abs(s.q[-1, 0] - math.cos(1.0)), LARGEST_ERROR)
    return demand(outcome, (RIGHT, REFUSED, FLAGGED), "step|energy|converge|infinite")


def start_of(start: float, method: str) -> Outcome:
    """Coordinates at the ends of floating point; what is below the absolute tolerance need not be right."""
    run = attempt(point("far", "-x"), 1.0, start={"x": start}, method=method)
    allowed = (RIGHT, REFUSED, FLAGGED)

    def error(solution):
        return abs(solution.q[-1, 0] - start * math.cos(1.0)) / max(start, 1e-10)

    return demand(judge(run, error, 2e-2), allowed)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for ratio in RATIOS:
        run = functools.partial(two_methods, "double_pendulum", 0.5, 1e-4, {"m1": 1.0, "m2": ratio})
        yield Scenario("mass ratio", f"double pendulum, lower mass {ratio:.0e} times the upper", run)
        run = functools.partial(two_methods, "slider_crank", 0.5, 1e-4, {"mp": ratio})
        yield Scenario("mass ratio", f"slider-crank, piston of {ratio:.0e} kg", run)
        run = functools.partial(two_methods, "four_bar", 0.5, 1e-4, {"mb": ratio})
        yield Scenario("mass ratio", f"four-bar, coupler of {ratio:.0e} kg", run)
    adaptive = ["auto", *(name for name, method in METHODS.items() if method.adaptive)]
    for spin in SPINS:
        for method in adaptive:
            run = functools.partial(spinning, spin, method)
            yield Scenario("spin", f"spin of {spin:.0e} rad/s: {method}", run, method, short=spin == 1e5)
    for length, seconds in ((1e-9, 1.0), (1e9, 1.0), (1.0, 1e-9), (1.0, 1e9), (1e-12, 1e-12), (1e12, 1e12)):
        for method in ("auto", "dop853", "radau5"):
            run = functools.partial(scaled, length, seconds, method)
            yield Scenario(
                "units", f"unit of length {length:.0e}, of time {seconds:.0e}: {method}", run, method
            )
    for method in (name for name, method in METHODS.items() if not method.adaptive):
        for step in (1e-300, 1e-18, 1e300):
            run = functools.partial(step_of, step, method)
            yield Scenario("step size", f"step of {step:.0e}: {method}", run, method, short=step != 1e-18)
    for start in (1e300, 1e-300, 1.7e308):
        for method in METHODS:
            run = functools.partial(start_of, start, method)
            yield Scenario(
                "start size",
                f"start at {start:.1e}: {method}",
                run,
                method,
                short=method in ("rk4", "dop853", "taylor", "radau5"),
            )
