"""What slides in a plane under forces that press more and less: each method beside one of another kind, closely.

Particles on a floor that a stop, a constraint or several constraints hold, bodies on two pads, and balls with their
mass off the middle, with friction that sticks or is smooth, and levels that depend on place, time and speed.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from symgen import Model, cos, dot, exp, sin, sqrt, t
from symgen.errors import ModelError
from symgen.runtime.solution import Solution

from .judging import attempt, flag, refusal
from .models import made
from .scenario import DOUBTED, FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

_METHODS = ("taylor", "radau5", "dopri5", "radau9")
_KNOWN = "dop853"
_TOLERANCES = {"rtol": 1e-10, "atol": 1e-12}
_RIGHT, _WRONG = 1e-7, 3e-6  # of the largest number of the run
_CASES = 72
_KINDS = ("particle", "pads", "ball")


def _level(r: np.random.Generator, x, speed) -> dict[str, object]:
    """A coefficient: a number, of the place, of time, or falling with the speed."""
    size = float(r.uniform(0.03, 0.4))
    levels = [
        size,
        size * (1 + 0.4 * sin(float(r.uniform(1, 5)) * x)),
        size * (1 + 0.4 * cos(float(r.uniform(1, 5)) * t)),
        size * (1 + 0.5 * exp(-(speed**2))),
    ]
    which = int(r.integers(4))
    return {"coefficient": levels[which], **({"static": 1.5 * size} if which == 3 else {})}


def _held(r: np.random.Generator, model: Model, z) -> str | list[str]:
    """Hold a height by a stop or by constraints; returns what presses."""
    if r.random() < 0.5:
        model.stop("floor", z)
        return "floor"
    model.constraint("floor", z)
    if r.random() < 0.5:
        return "floor"
    w = model.coordinate("w", guess=0.0)
    model.kinetic(0.3 * dot(w) ** 2)
    model.force(w, float(r.uniform(-3, 3)) * (1 + 0.5 * sin(3 * t)))
    model.constraint("side", w)
    return ["floor", "side"]


def _smooth(r: np.random.Generator) -> dict[str, float]:
    return {"smooth": float(10.0 ** r.uniform(-1.5, 0.0))} if r.random() < 0.3 else {}


def particle(r: np.random.Generator) -> Model:
    """A mass on a floor, in a bowl."""
    model = Model("particle", gravity=(0, 0, "-9.81 m/s^2"))
    x = model.coordinate("x", start=float(r.uniform(-1, 1)), rate=float(r.uniform(-3, 3)))
    y = model.coordinate("y", start=float(r.uniform(-1, 1)), rate=float(r.uniform(-3, 3)))
    z = model.coordinate("z", start=0.0)
    model.body("mass", mass=float(r.uniform(0.5, 3.0)), com=(x, y, z))
    model.potential(
        float(r.uniform(1, 9)) * x**2 + float(r.uniform(1, 9)) * y**2 + float(r.uniform(-1, 1)) * x * y
    )
    model.force(z, -(3 + float(r.uniform(0, 9)) * x**2 + float(r.uniform(0, 2)) * sin(2 * y + 4 * t)))
    speeds = [dot(x) - float(r.uniform(-0.5, 0.5)), dot(y)]
    level = _level(r, x, sqrt(dot(x) ** 2 + dot(y) ** 2 + 0.01))
    model.friction("rub", speeds=speeds, **level, normal=_held(r, model, z), **_smooth(r))
    return model


def pads(r: np.random.Generator) -> Model:
    """A body that slides and turns on two pads."""
    model = Model("pads")
    x = model.coordinate("x", rate=float(r.uniform(-3, 3)))
    y = model.coordinate("y", rate=float(r.uniform(-3, 3)))
    angle = model.coordinate("angle", rate=float(r.uniform(-8, 8)))
    model.body(
        "sled", mass=float(r.uniform(0.5, 3.0)), inertia=float(r.uniform(0.02, 0.3)), com=(x, y), angle=angle
    )
    model.potential(float(r.uniform(0, 5)) * (x**2 + y**2))
    for k in range(2):
        z = model.coordinate(f"z{k}", guess=0.0)
        model.kinetic(0.2 * dot(z) ** 2)
        model.force(z, -float(r.uniform(2, 9)) * (1 + 0.4 * sin(float(r.uniform(1, 4)) * t + k)))
        model.constraint(f"floor{k}", z)
        along, across = (float(v) for v in r.uniform(-0.3, 0.3, 2))
        px, py = (
            dot(x) + dot(angle) * (-along * sin(angle) - across * cos(angle)),
            dot(y) + dot(angle) * (along * cos(angle) - across * sin(angle)),
        )
        level = _level(r, x, sqrt(px**2 + py**2 + 0.01))
        model.friction(f"pad{k}", speeds=[px, py], **level, normal=f"floor{k}", **_smooth(r))
    return model


def ball(r: np.random.Generator) -> Model:
    """A ball on a plane, with its mass off the middle, that spins: a tippe top."""
    radius, tilt = float(r.uniform(0.02, 0.2)), float(r.uniform(0.05, 2.5))
    off, mass = float(r.uniform(0.0, 0.4)) * radius, float(r.uniform(0.1, 2.0))
    model = Model("ball", gravity=(0, 0, "-9.81 m/s^2"))
    inertia = mass * radius**2 * r.uniform(0.3, 0.45, 2)
    model.body(
        "ball", mass=mass, com=(0, 0, -off), inertia=(float(inertia[0]), float(inertia[0]), float(inertia[1])),
        shape={"sphere": [radius]},
    )  # fmt: skip
    spin = float(r.uniform(1, 8)) * np.sqrt(9.81 / radius)
    start = [0, 0, radius, float(np.cos(tilt / 2)), float(np.sin(tilt / 2)), 0, 0]
    pushed = [float(v) for v in r.uniform(-1, 1, 2)]
    model.joint("place", "free", child="ball", start=start, rate=[*pushed, 0, 0, 0, spin])
    model.contact(
        "rub",
        body="ball",
        shape={"sphere": [radius], "offset": [0, 0, 0]},
        friction=float(r.uniform(0.03, 0.4)),
    )
    return model


def slides(number: int, method: str) -> Outcome:
    """Run a case by one method, and judge it by another."""
    r = np.random.default_rng([number, 20261129])
    kind = _KINDS[number % len(_KINDS)]
    try:
        system = made({"particle": particle, "pads": pads, "ball": ball}[kind](r))
    except ModelError as error:
        return refusal(error)
    known = attempt(system, 0.6, method=_KNOWN, **_TOLERANCES)
    if isinstance(known, Outcome) or flag(known):
        return Outcome(REFUSED, f"{_KNOWN} does not vouch for the motion")
    run = attempt(system, 0.6, method=method, **_TOLERANCES)
    if isinstance(run, Outcome):
        return run
    return _judged(run, known, method)


def _judged(run: Solution, known: Solution, method: str) -> Outcome:
    off = float((np.abs(run.states[-1] - known.states[-1]) / np.abs(known.states).max()).max())
    flagged, says = (
        flag(run),
        f"{method} is off by {off:.1e}, {run.stats['steps']} steps, {run.stats['rejected']} rejected",
    )
    if flagged is not None:
        return Outcome(DOUBTED if off <= _RIGHT else FLAGGED, f"{says}; {flagged.says}")
    return Outcome(WRONG if off > _WRONG else RIGHT, says)


def scenarios() -> Iterator[Scenario]:
    """Yield all cases, each by one method."""
    for number in range(_CASES):
        method = _METHODS[number // len(_KINDS) % len(_METHODS)]
        run = functools.partial(slides, number, method)
        yield Scenario("sliding", f"sliding {number}: {method}", run, method, number < 3)
