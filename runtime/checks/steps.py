"""How many steps a period takes: as recommended, where it is left open, and below which a step is called coarse.

`symgen advise`, runs whose step is left open, and health reports ask here, so that none contradicts another.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System

# Steps of runs whose step is left open: a run that needs more is not slow without being asked to be.
MOST_IN_A_PERIOD = 250.0
PERIODS = 100.0  # for which they are right: how long the run is has no part in its steps
MOST_RECOMMENDED = 1000.0  # steps: with a method that needs more, nobody follows a motion so long
_FEWEST, _PART = 20.0, 0.7  # of what is recommended for short runs
# What an oscillation may be off by at the end of a run: half of what the checks of accuracy and, at order 1, where the
# energy changes twice as much as the amplitude, of energy allow.
_OFF, _OFF_AT_ORDER_1 = 0.025, 0.005
_OF_ORDER_1 = 0.5  # error per radian and step w
MOST_REJECTED = 0.8  # part of the steps that were tried
_DIES_OUT = 3.0  # decay times


def steps_in_a_period(method: Method, system: System, periods: float) -> float:
    """Return the steps in a period with which an oscillation is right at the end of so many periods."""
    radians = 2.0 * np.pi * max(periods, 1.0)
    off = _OFF_AT_ORDER_1 if method.order == 1 else _OFF
    needed = 2.0 * np.pi * (_error_per_radian(method, system) * radians / off) ** (1.0 / method.order)
    return max(float(method.steps_per_period), needed)


def _error_per_radian(method: Method, system: System) -> float:
    symplectic = system.structure["separable"] and not system.m
    # What adds up to nothing on a plain oscillator does so where T depends on rates and V on positions alone.
    return method.oscillation_error or (0.0 if symplectic else _OF_ORDER_1)


def step_for_phases(
    method: Method,
    system: System,
    eigenvalues: np.ndarray,
    span: float,
    most: float = np.inf,
    periods: float = np.inf,
) -> float:
    """Return the step [s] with which motions of these eigenvalues [1/s] are right at the end of a run; infinite if any.

    Errors of phase and size add up over the run, or until a motion has died out, or so many `periods` have passed. A
    period takes `most` steps at most.
    """
    shortest = np.inf
    for value in np.atleast_1d(np.asarray(eigenvalues, dtype=complex)):
        rate = abs(value) if value.real > 0.0 else abs(value.imag)
        if not rate > 0.0 or rate * span < 1.0:
            continue
        lasts = min(span, _DIES_OUT / -value.real) if value.real < 0.0 else span
        needed = steps_in_a_period(method, system, min(rate * lasts / (2.0 * np.pi), periods))
        shortest = min(shortest, 2.0 * np.pi / rate / min(needed, most))
    return float(shortest)


def least_steps_in_a_period(method: Method) -> float:
    """Return the steps in a period below which a method does not resolve a motion at all."""
    return min(_FEWEST, _PART * method.steps_per_period)
