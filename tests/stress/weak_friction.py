"""Dry friction beside forces that are far larger than it: oscillators that turn often before they stick.

Each mass swings on a spring and rubs, by a force of its own or by its weight on the floor. What the friction is of the
spring's force is drawn, from more than all of it to 1e-14. Between its turns the motion is a cosine about a centre that
the friction moves; it sticks where it turns within that. Masses and stiffnesses of one model lie decades apart; where
coordinates are measured from each other, its equations do not come apart into those of single masses.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np

from symgen import Model, dot, runtime
from symgen.link import derive_text
from symgen.runtime import System
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, flag
from .scenario import RIGHT, WRONG, Outcome, Scenario

_CASES, _MOST, _TURNS = 6, 3, 24  # cases of each method, masses, half periods of the fastest at most
_ALLOWED, _ALLOWED_FIXED = 1e-3, 0.05  # of the amplitude
_G = 9.81


@functools.cache
def _system(n: int, related: bool, weighed: bool) -> System:
    m = Model("weak_friction")
    place, rate = 0, 0
    for i in range(n):
        mass, k, level = (m.parameter(f"{name}{i}", 1.0) for name in "mkl")
        q = m.coordinate(f"q{i}")
        place, rate = (q + place / 2, dot(q) + rate / 2) if related else (q, dot(q))
        m.kinetic(mass * rate**2 / 2)
        m.potential(k * place**2 / 2)
        if weighed:
            y = m.coordinate(f"y{i}")
            m.kinetic(mass * dot(y) ** 2 / 2)
            m.potential(mass * _G * y)
            m.stop(f"floor{i}", gap=y)
            m.friction(f"f{i}", speed=rate, coefficient=level, normal=f"floor{i}")
        else:
            m.friction(f"f{i}", speed=rate, force=level)
    return runtime.load(derive_text(m).text)


def _place(t: float, x: float, w: float, shift: float) -> float:
    """Where a mass is at `t`: let go at `x`, of frequency `w`, held by its friction at up to `shift`."""
    half = math.pi / w
    while abs(x) > shift and t > 0.0:
        centre = math.copysign(shift, x)
        if t <= half:
            return centre + (x - centre) * math.cos(w * t)
        x, t = 2.0 * centre - x, t - half
    return x


def weak(number: int, method: str) -> Outcome:
    """Run one case."""
    r = np.random.default_rng([number, 53])
    n, related, weighed = int(r.integers(1, _MOST + 1)), bool(r.integers(2)), bool(r.integers(2))
    system = _system(n, related, weighed)
    mass, w = 10.0 ** r.uniform(-3.0, 3.0, n), 10.0 ** r.uniform(-0.5, 0.5, n) * 10.0 ** r.uniform(-2.0, 4.0)
    x = r.choice([-1.0, 1.0], n) * r.uniform(0.2, 2.0, n)
    shift = np.abs(x) * 10.0 ** np.where(r.random(n) < 0.3, r.uniform(-1.5, 0.2, n), r.uniform(-14.0, 0.0, n))
    k = mass * w * w
    level = k * shift / (mass * _G if weighed else 1.0)
    values = {
        f"{name}{i}": row[i] for name, row in zip("mkl", (mass, k, level), strict=True) for i in range(n)
    }
    t_end = float(r.uniform(2.0, _TURNS)) * math.pi / w.max()
    q = x - 0.5 * np.append(0.0, x[:-1]) if related else x
    start = {f"q{i}": q[i] for i in range(n)}
    run = attempt(system, t_end, method=method, parameters=values, start=start)
    flagged = flag(run)
    if flagged is not None:
        return flagged
    found = np.array([run[f"q{i}"][-1] for i in range(n)])
    if related:
        for i in range(1, n):
            found[i] += found[i - 1] / 2.0
    expected = np.array([_place(t_end, *of) for of in zip(x, w, shift, strict=True)])
    off = float((np.abs(found - expected) / np.abs(x)).max())
    allowed = _ALLOWED if METHODS[method].adaptive else _ALLOWED_FIXED
    says = f"off by {off:.1e} after {t_end * w.max() / math.pi:.1f} turns, friction of {(shift / np.abs(x)).round(17)}"
    return Outcome(
        RIGHT if off <= allowed else WRONG, f"{says}{', weighed' * weighed}{', related' * related}"
    )


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each method."""
    for k, method in enumerate(METHODS):
        for number in range(_CASES):
            run = functools.partial(weak, number * len(METHODS) + k, method)
            short = number == 0 and method in ("dop853", "taylor", "radau5", "gauss8")
            yield Scenario("weak friction", f"weak friction {number}: {method}", run, method, short)
