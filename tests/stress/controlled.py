"""Plants under PID controllers that saturate: at every instant, as states of the model, or sampled with a memory.

The reference integrates plant and controller in SciPy: between samples for those that are sampled, in short steps and
past each bound for the others.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.runtime.inputs import Controller
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .models import made
from .scenario import RIGHT, Outcome, Scenario

_CASES = 2  # of each kind with each method
_KINDS = ("states", "instant", "sampled")
_RTOLS = (1e-4, 1e-6, 1e-9)
_SHORT = 2e-3  # s


class Loop(NamedTuple):
    """A plant and its controller: gains, bound of the force, set point, time constant of the filter, period."""

    m: float
    c: float
    k: float
    cubic: float
    gains: tuple[float, float, float]
    bound: float
    aim: float
    rate: float
    filter: float
    period: float
    t_end: float
    start: tuple[float, float]


def drawn(r: np.random.Generator) -> Loop:
    """Return a loop that mostly is stable, and mostly saturates."""

    def size(low: float, high: float) -> float:
        return float(f"{10.0 ** r.uniform(low, high):.3g}")

    m, k = size(-0.5, 0.7), size(0.0, 1.3)
    return Loop(
        m, size(-1.5, 0.3), k, float(r.choice([0.0, 0.5, 3.0])), (size(0.5, 2.0), size(0.0, 1.2), size(0.0, 1.0)),
        size(0.3, 1.6), float(r.uniform(-1.0, 1.0)), float(r.choice([0.0, 0.0, 0.5, 2.0])), size(-1.7, -0.5),
        float(r.choice([0.002, 0.01, 0.05])), float(r.uniform(1.0, 5.0)),
        (float(r.uniform(-1, 1)), float(r.normal())),
    )  # fmt: skip


def plant(loop: Loop, x: float, v: float, u: float) -> float:
    """Its acceleration."""
    return (u - loop.k * x - loop.cubic * x**3 - loop.c * v) / loop.m


def clipped(loop: Loop, u: float) -> float:
    """A force within what the actuator has."""
    return min(max(u, -loop.bound), loop.bound)


def reference(loop: Loop, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return x and v at the end, and their ranges."""
    p, i, d = loop.gains
    options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "max_step": _SHORT}
    if kind == "sampled":
        y, t, held, seen = np.array(loop.start), 0.0, 0.0, []
        n = 0
        while t < loop.t_end:
            error = loop.aim * np.cos(loop.rate * t) - y[0]
            u = clipped(loop, p * error + i * held - d * y[1])
            held += loop.period * error
            n += 1
            end = min(n * loop.period, loop.t_end)
            found = solve_ivp(lambda t, y, u=u: [y[1], plant(loop, y[0], y[1], u)], (t, end), y, **options)
            y, t = found.y[:, -1], end
            seen.append(found.y)
        rows = np.concatenate(seen, axis=1)
        return y, np.ptp(rows, axis=1)

    def motion(t: float, y: np.ndarray) -> list[float]:
        x, v, integral, slow = y
        error = loop.aim * np.cos(loop.rate * t) - x
        u = p * error + d * (error - slow) / loop.filter
        if kind == "states":
            return [
                v, plant(loop, x, v, clipped(loop, u + i * integral)),
                error if abs(u + i * integral) < loop.bound else 0.0, (error - slow) / loop.filter,
            ]  # fmt: skip
        return [v, plant(loop, x, v, clipped(loop, p * error - d * v)), 0.0, 0.0]

    found = solve_ivp(motion, (0.0, loop.t_end), [*loop.start, 0.0, 0.0], **options)
    return found.y[:2, -1], np.ptp(found.y[:2], axis=1)


def built(loop: Loop, kind: str) -> tuple[Model, dict[str, Any]]:
    """Return the model, and what its run is told."""
    p, i, d = loop.gains
    m = Model("controlled")
    x = m.coordinate("x", start=loop.start[0], rate=loop.start[1])
    m.body("plant", mass=loop.m, com=(x, 0))
    m.force(x, f"-{loop.k!r}*x - {loop.cubic!r}*x^3 - {loop.c!r}*dot(x)")
    error = f"({loop.aim!r}*cos({loop.rate!r}*t) - x)"
    if kind == "states":
        m.definition("missing", error)
        wanted = f"{p!r}*missing + {d!r}*(missing - slow)/{loop.filter!r} + {i!r}*held"
        m.state("slow", f"(missing - slow)/{loop.filter!r}")
        m.state("held", f"where(abs({wanted}) < {loop.bound!r}, missing, 0)")
        m.force(x, f"max(-{loop.bound!r}, min({loop.bound!r}, {wanted}))")
        return m, {}
    m.input("u")
    m.force(x, "u")
    aim, rate, bound, period = loop.aim, loop.rate, loop.bound, loop.period
    if kind == "instant":

        def at_once(t, x):
            return min(max(p * (aim * np.cos(rate * t) - x[0]) - d * x[1], -bound), bound)

        return m, {"u": Controller(at_once)}

    def sampled(t, x, memory):
        missing = aim * np.cos(rate * t) - x[0]
        u = min(max(p * missing + i * memory[0] - d * x[1], -bound), bound)
        memory[0] += period * missing
        return u

    return m, {"u": Controller(sampled, period=period, memory=np.zeros(1))}


def controlled(kind: str, number: int, method: str) -> Outcome:
    """Run a loop and judge its end."""
    r = np.random.default_rng([number, *kind.encode()])
    loop = drawn(r)
    model, inputs = built(loop, kind)
    given = {"rtol": float(r.choice(_RTOLS))} if find_method(method).adaptive else {}
    run = attempt(made(model), loop.t_end, method=method, inputs=inputs, **given)
    if isinstance(run, Outcome):
        return run
    end, ranges = reference(loop, kind)
    if not np.isfinite(end).all():
        return Outcome(RIGHT, "the reference has no end")
    off = float((np.abs(np.array([run["x"][-1], run["dot(x)"][-1]]) - end) / ranges).max())
    return judge_end(run, off, f"{method}, {given}, {loop}")


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each kind with each method."""
    for kind in _KINDS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run: Callable[[], Outcome] = functools.partial(
                    controlled, kind, number * len(METHODS) + k, method
                )
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(
                    f"controlled: {kind}", f"controlled: {kind} {number}: {method}", run, method, short
                )
