"""Hundreds to tens of thousands of periods, with every method, beside motions in closed form.

Pendulums and hardening springs (elliptic functions), planets in the plane and along a line (Kepler's equation), and a
damped and driven mass. What a run is off by is looked at over all its frames.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .scenario import Outcome, Scenario

_CASES = 3  # of each kind with each method
_RIGHT = 0.01  # of a range, over all frames: what a run is doubted for in vain
_FRAMES = 1871.3  # no multiple of the periods
_MOST_STEPS = 6_000_000
_LOW_ORDER = 3  # up to which runs are a tenth as long

Truth = Callable[[np.ndarray], np.ndarray]


class Long(NamedTuple):
    """A model, its period [s], and its states over time, shape (n, nq + nv)."""

    model: Model
    period: float
    truth: Truth


def swing(r: np.random.Generator) -> Long:
    """A pendulum of 1 m that is let go at an angle."""
    from scipy.special import ellipj, ellipk

    start = float(r.uniform(0.02, 2.95))
    m = Model("swing")
    m.coordinate("angle", start=start)
    m.kinetic("dot(angle)^2/2")
    m.potential("-9.81*cos(angle)")
    k, w = np.sin(start / 2.0), np.sqrt(9.81)
    quarter = ellipk(k * k)

    def truth(t: np.ndarray) -> np.ndarray:
        sn, cn, _, _ = ellipj(quarter - w * t, k * k)
        return np.stack([2.0 * np.arcsin(k * sn), -2.0 * k * w * cn], axis=1)

    return Long(m, 4.0 * quarter / w, truth)


def hardening(r: np.random.Generator) -> Long:
    """A mass on a spring of x + b x^3."""
    from scipy.special import ellipj, ellipk

    a, b = float(10.0 ** r.uniform(-1.0, 0.5)), float(10.0 ** r.uniform(-2.0, 1.0))
    m = Model("hardening")
    m.coordinate("x", start=a)
    m.kinetic("dot(x)^2/2")
    m.potential(f"x^2/2 + {b!r}*x^4/4")
    w = np.sqrt(1.0 + b * a * a)
    part = b * a * a / (2.0 * w * w)

    def truth(t: np.ndarray) -> np.ndarray:
        sn, cn, dn, _ = ellipj(w * t, part)
        return np.stack([a * cn, -a * w * sn * dn], axis=1)

    return Long(m, 4.0 * ellipk(part) / w, truth)


def anomaly(t: np.ndarray, e: float) -> np.ndarray:
    """E of Kepler's equation E - e sin E = t, by Newton's method from E = pi."""
    mean = np.mod(t, 2.0 * np.pi)
    found = np.full_like(mean, np.pi)
    for _ in range(60):
        found -= (found - e * np.sin(found) - mean) / (1.0 - e * np.cos(found))
    return found


def planet(r: np.random.Generator) -> Long:
    """A planet in x and y, from its perihelion."""
    e = float(r.uniform(0.0, 0.8))
    m = Model("planet")
    m.coordinate("x", start=1.0 - e)
    m.coordinate("y", rate=float(np.sqrt((1.0 + e) / (1.0 - e))))
    m.kinetic("(dot(x)^2 + dot(y)^2)/2")
    m.potential("-1/sqrt(x^2 + y^2)")
    minor = np.sqrt(1.0 - e * e)

    def truth(t: np.ndarray) -> np.ndarray:
        angle = anomaly(t, e)
        far = 1.0 - e * np.cos(angle)
        return np.stack(
            [np.cos(angle) - e, minor * np.sin(angle), -np.sin(angle) / far, minor * np.cos(angle) / far],
            axis=1,
        )

    return Long(m, 2.0 * np.pi, truth)


def radial(r: np.random.Generator) -> Long:
    """The distance of a planet from its star alone: one freedom."""
    e = float(r.uniform(0.05, 0.8))
    m = Model("radial")
    m.coordinate("x", start=1.0 - e)
    m.kinetic("dot(x)^2/2")
    m.potential(f"-1/x + {1.0 - e * e!r}/(2*x^2)")

    def truth(t: np.ndarray) -> np.ndarray:
        angle = anomaly(t, e)
        far = 1.0 - e * np.cos(angle)
        return np.stack([far, e * np.sin(angle) / far], axis=1)

    return Long(m, 2.0 * np.pi, truth)


def driven(r: np.random.Generator) -> Long:
    """A mass on a spring with some damping, driven at a frequency of its own."""
    c, w = float(10.0 ** r.uniform(-4.0, -0.5)), float(10.0 ** r.uniform(-0.5, 0.5))
    start = float(r.normal(0.0, 3.0))
    m = Model("driven")
    m.coordinate("x", start=start)
    m.kinetic("dot(x)^2/2")
    m.potential("x^2/2")
    m.force("x", f"-{2.0 * c!r}*dot(x) + cos({w!r}*t)")
    steady = 1.0 / (1.0 - w * w + 2j * c * w)
    root = -c + 1j * np.sqrt(1.0 - c * c)
    rest = start - steady.real, -(1j * w * steady).real
    decays = complex(rest[0], (root.real * rest[0] - rest[1]) / root.imag)

    def truth(t: np.ndarray) -> np.ndarray:
        moved, free = steady * np.exp(1j * w * t), decays * np.exp(root * t)
        return np.stack([(moved + free).real, (1j * w * moved + root * free).real], axis=1)

    return Long(m, 2.0 * np.pi / max(w, 1.0), truth)


KINDS = {"swing": swing, "hardening": hardening, "planet": planet, "radial": radial, "driven": driven}


def drift(kind: str, number: int, method: str) -> Outcome:
    """Run a case and judge it."""
    r = np.random.default_rng([number, *kind.encode()])
    case = KINDS[kind](r)
    system = runtime.load(derive_text(case.model).text)
    record = find_method(method)
    periods = float(10.0 ** r.uniform(2.0, 3.3 if record.order <= _LOW_ORDER else 4.3))
    rtol, in_a_period = float(10.0 ** r.uniform(-9.5, -4.0)), float(10.0 ** r.uniform(1.0, 2.3))
    given = {"rtol": rtol, "atol": 0.01 * rtol} if record.adaptive else {"step": case.period / in_a_period}
    t_end = periods * case.period
    if r.random() < 0.5:
        given["fps"] = _FRAMES / t_end
    run = attempt(system, t_end, method=method, max_steps=_MOST_STEPS, **given)
    if isinstance(run, Outcome):
        return run
    truth = case.truth(run.t)
    with np.errstate(over="ignore", invalid="ignore"):
        off = float(np.nan_to_num((np.abs(run.states - truth) / np.ptp(truth, axis=0)).max(), nan=np.inf))
    return judge_end(run, off, f"{method}, {given}, {periods:.1f} periods", right=_RIGHT)


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each kind with each method."""
    for kind in KINDS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(drift, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("taylor", "radau9", "verlet")
                yield Scenario(f"long: {kind}", f"long: {kind} {number}: {method}", run, method, short)
