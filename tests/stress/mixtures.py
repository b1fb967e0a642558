"""Chains and slides with choices, dry friction, stops, records and an input, beside each other on the same coordinates.

Each alone is tried elsewhere; here what one holds at zero is what another one asks for. Runs at tight tolerances are
held against two methods of other kinds: an event that comes late is no error of the method's order.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
from sympy import Abs

from symgen import Model, cos, dot, maximum, minimum, sin, where
from symgen.errors import ModelError
from symgen.runtime.inputs import Table
from symgen.runtime.solution import Solution

from .judging import attempt, flag, refusal
from .models import made
from .scenario import DOUBTED, FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

_METHODS = ("taylor", "dop853", "dopri5", "radau5", "auto")
_KNOWN_BY = (("dop853", 1e-12), ("radau13", 1e-11))
_RTOLS = (1e-8, 1e-10)
_AGREE, _RIGHT, _WRONG = 1e-5, 1e-6, 1e-4  # of the largest number of the run
_CASES = 40


def draw(r: np.random.Generator) -> Model:
    """One to three coordinates; of each a spring and a damper with choices, of some a stop, a friction, a record."""
    model = Model("mixture", gravity=(0, "-9.81 m/s^2"))
    turns, n = bool(r.random() < 0.5), int(r.integers(1, 4))
    length, effort = ("rad", "N*m") if turns else ("m", "N")
    x, y, coordinates, bar = 0, 0, [], model.parameters(bar="0.5 m")
    for k in range(n):
        q = model.coordinate(
            f"q{k}", unit=length, start=float(r.uniform(-1, 1)), rate=float(r.uniform(-1, 1))
        )
        x, y = (x + bar * sin(q), y - bar * cos(q)) if turns else (x + q, 0)
        model.body(f"b{k}", mass=f"{r.uniform(0.3, 3):.3f} kg", com=(x, y))
        coordinates.append(q)
    one = model.parameters(one=f"1 {length}")
    speed = model.parameters(speed=f"1 {length}/s")
    for k, q in enumerate(coordinates):
        stiffness = model.parameters(**{f"k{k}": f"{r.uniform(2, 60):.3g} {effort}/{length}"})
        damping = model.parameters(**{f"d{k}": f"{r.uniform(0.02, 0.6):.3g} {effort}*s/{length}"})
        forces = (
            -stiffness * q,
            -stiffness * maximum(q - 0.1 * one, 0 * one),
            where(q > 0.2 * one, -stiffness * (q - 0.2 * one), 0 * stiffness * one),
            -stiffness * q * Abs(q) / one,
            -stiffness * minimum(maximum(q, -0.3 * one), 0.3 * one),
            -stiffness * sin(3 * q / one) * one,
        )
        model.force(q, forces[int(r.integers(len(forces)))])
        model.force(q, -damping * dot(q) * (1 if r.random() < 0.5 else Abs(dot(q)) / speed))
    model.force(coordinates[int(r.integers(n))], model.input("push", unit=effort))
    if r.random() < 0.4:
        gap = coordinates[0] + float(r.uniform(1.0, 1.3)) * one
        model.stop("stop", gap=gap, restitution=float(r.choice([0.0, 0.3, 0.8])))
    if r.random() < 0.5:
        size = f"{r.uniform(0.05, 3):.3g} {effort}"
        model.friction("rub", speed=dot(coordinates[-1]), **{"torque" if turns else "force": size})
    if r.random() < 0.3:
        model.event("passes", coordinates[0] - 0.3 * one)
    return model


def _input(r: np.random.Generator) -> Table:
    n = int(r.integers(3, 12))
    times = np.sort(np.round(r.uniform(0, 4, n), 3)) + 0.01 * np.arange(n)
    return Table(times, 3.0 * r.normal(size=n), kind=str(r.choice(["linear", "cubic", "hold"])))


def _off(run: Solution, end: np.ndarray) -> float:
    return float(np.abs(run.states[-1] - end).max() / np.abs(run.states).max())


def mixture(number: int, method: str) -> Outcome:
    """Run a case by one method, and judge it."""
    r = np.random.default_rng([number, 20240229])
    try:
        system = made(draw(r))
    except ModelError as error:
        return refusal(error)
    options = {"inputs": {"push": _input(r)}}
    t_end, rtol = float(np.round(r.uniform(1, 5), 2)), float(r.choice(_RTOLS))
    run = attempt(system, t_end, method=method, rtol=rtol, **options)
    if isinstance(run, Outcome):
        return run
    known = [attempt(system, t_end, method=name, rtol=tight, **options) for name, tight in _KNOWN_BY]
    if any(isinstance(x, Outcome) or flag(x) for x in known) or _off(known[0], known[1].states[-1]) > _AGREE:
        return flag(run) or Outcome(REFUSED, "no two methods agree on the motion")
    off, flagged = _off(run, known[0].states[-1]), flag(run)
    says = f"{method} at {rtol:.0e} to {t_end} s is off by {off:.1e}"
    if flagged is not None:
        return Outcome(DOUBTED if off <= _RIGHT else FLAGGED, f"{says}; {flagged.says}")
    return Outcome(WRONG if off > _WRONG else RIGHT, says)


def scenarios() -> Iterator[Scenario]:
    """Yield all cases, by turns with each method."""
    for number in range(_CASES):
        for method in _METHODS:
            run = functools.partial(mixture, number, method)
            yield Scenario("mixtures", f"mixtures {number}: {method}", run, method, number < 2)
