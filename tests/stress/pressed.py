"""Frictions in proportion to the forces of stops and constraints, beside stops that bounce and stay closed.

What machine code makes of their events is held against what Python makes of them; states decide, as of several
frictions that hold the same thing any may be told to slip first.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from unittest import mock

import numpy as np

from symgen import Model, dot, sin, t
from symgen.errors import ModelError
from symgen.runtime import frictions_in_code
from symgen.runtime.solution import Solution

from .judging import attempt, flag, refusal
from .models import made
from .scenario import DOUBTED, FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

_METHODS = ("dop853", "taylor", "radau5", "dopri5")
_TOLERANCES = {"rtol": 1e-10, "atol": 1e-12}
_RIGHT, _WRONG = 1e-6, 1e-4  # of the largest number of the run
_T_END = 8.0  # [s]
_CASES = 60


def draw(r: np.random.Generator, *, tied: bool) -> Model:
    """Two to four coordinates with coupled inertia: the first ones above stops, on which frictions of the others press.

    Parameters
    ----------
    tied : bool
        Whether one more coordinate follows the last one by a constraint, which presses as well.
    """
    model, n = Model("pressed"), int(r.integers(2, 5))
    n_stops = int(r.integers(1, min(n - 1, 2) + 1))
    starts = np.where(np.arange(n) < n_stops, r.uniform(0.15, 1.0, n), r.uniform(-1.0, 1.0, n))
    q = [
        model.coordinate(f"q{k}", start=float(starts[k]), rate=float(r.uniform(-1.0, 1.0))) for k in range(n)
    ]
    factor = np.tril(r.uniform(-0.5, 0.5, (n, n)), -1) + np.diag(r.uniform(0.6, 1.5, n))
    mass = factor @ factor.T if r.random() < 0.6 else np.diag(r.uniform(0.4, 2.0, n))
    kinetic = sum(mass[i, j] / 2 * dot(q[i]) * dot(q[j]) for i in range(n) for j in range(n))
    potential = sum(float(r.uniform(3.0, 12.0)) * x for x in q[:n_stops])
    potential += sum(
        float(r.uniform(1.0, 20.0)) * (q[k] - q[(k + 1) % n]) ** 2 / 2 for k in range(n_stops, n)
    )
    for k, x in enumerate(q):
        push = float(r.uniform(0.0, 12.0 if k < n_stops else 6.0))
        model.force(x, push * sin(float(r.uniform(0.5, 3.0)) * t + float(r.uniform(0.0, 6.0))))
        model.force(x, -float(r.uniform(0.0, 0.3)) * dot(x))
    for k in range(n_stops):
        gap = q[k] + (float(r.uniform(-0.1, 0.1)) * sin(q[-1]) if r.random() < 0.5 else 0)
        model.stop(f"s{k}", gap=gap, restitution=float(r.choice([0.0, 0.0, 0.3, 0.6, 0.9])))
    for k in range(n_stops, n):
        belt = float(r.uniform(-0.5, 0.5)) if r.random() < 0.5 else 0.0
        coefficient = float(r.uniform(0.05, 0.6))
        pressed = {"coefficient": coefficient, "normal": f"s{int(r.integers(n_stops))}"}
        given = {"force": float(r.uniform(0.1, 3.0))}
        model.friction(f"f{k}", speed=dot(q[k]) - belt, **(pressed if r.random() < 0.8 else given))
    if tied:
        z = model.coordinate("z", guess=0.0)
        kinetic += float(r.uniform(0.2, 1.0)) / 2 * dot(z) ** 2
        potential += float(r.uniform(0.0, 9.0)) * z
        model.constraint(
            "tie", z - float(r.uniform(0.2, 0.8)) * sin(q[-1]) - float(r.uniform(-0.5, 0.5)) * q[-1]
        )
        level = {"coefficient": float(r.uniform(0.05, 0.5)), "normal": "tie"}
        model.friction(
            "bead", speed=dot(z) + 0.1 * dot(q[0]), **(level if r.random() < 0.6 else {"force": 1.0})
        )
    model.kinetic(kinetic)
    model.potential(potential)
    return model


def by_python(system: object, t_end: float, **options: object) -> Solution | Outcome:
    """Run with all events acted on by Python."""
    with mock.patch.object(frictions_in_code, "has_plain_frictions", lambda *_: False):
        return attempt(system, t_end, **options)


def pressed(number: int, method: str) -> Outcome:
    """Run a case by one method, and judge it."""
    r = np.random.default_rng([number, 20261128])
    try:
        system = made(draw(r, tied=number % 2 == 1))
    except ModelError as error:
        return refusal(error)
    run = attempt(system, _T_END, method=method, **_TOLERANCES)
    if isinstance(run, Outcome):
        return run
    known = by_python(system, _T_END, method=method, **_TOLERANCES)
    if isinstance(known, Outcome) or flag(known):
        return flag(run) or Outcome(REFUSED, "Python does not vouch for the motion")
    off = float(np.abs(run.states[-1] - known.states[-1]).max() / np.abs(known.states).max())
    flagged, says = flag(run), f"{method} is off by {off:.1e}"
    if flagged is not None:
        return Outcome(DOUBTED if off <= _RIGHT else FLAGGED, f"{says}; {flagged.says}")
    return Outcome(WRONG if off > _WRONG else RIGHT, says)


def scenarios() -> Iterator[Scenario]:
    """Yield all cases, each by one method."""
    for number in range(_CASES):
        method = _METHODS[number // 2 % len(_METHODS)]
        run = functools.partial(pressed, number, method)
        yield Scenario("pressed", f"pressed {number}: {method}", run, method, number < 4)
