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
from dataclasses import dataclass

import numpy as np

from symgen import Model, dot, runtime
from symgen.link import derive_text
from symgen.runtime import System
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from .judging import MOST_STEPS, attempt, flag, refusal
from .scenario import FLAGGED, RIGHT, WRONG, Outcome, Scenario

_CASES, _MOST, _TURNS = 6, 3, 24  # cases of each method, masses, half periods of the fastest at most
_MEMBERS, _IN_LANES = 8, ("taylor", "dop853", "rk4", "verlet", "radau5", "dopri5")
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


@dataclass(frozen=True)
class _Case:
    """Masses let go at `x`, of frequencies `w`, each held at up to `shift`; what a model and a run of it are given."""

    system: System
    related: bool
    x: np.ndarray
    w: np.ndarray
    shift: np.ndarray
    parameters: dict[str, float]
    start: dict[str, float]
    says: str

    def error(self, found: np.ndarray, t_end: float) -> float:
        """Return how far coordinates are off, in parts of the amplitudes."""
        places = found.copy()
        for i in range(1, len(places)) if self.related else ():
            places[i] += places[i - 1] / 2.0
        expected = [_place(t_end, *of) for of in zip(self.x, self.w, self.shift, strict=True)]
        return float((np.abs(places - expected) / np.abs(self.x)).max())


def _case(r: np.random.Generator, n: int, related: bool, weighed: bool, fastest: float) -> _Case:
    mass, w = 10.0 ** r.uniform(-3.0, 3.0, n), fastest * 10.0 ** r.uniform(-1.0, 0.0, n)
    x = r.choice([-1.0, 1.0], n) * r.uniform(0.2, 2.0, n)
    near, weak = r.uniform(-1.5, 0.2, n), r.uniform(-14.0, 0.0, n)
    shift = np.abs(x) * 10.0 ** np.where(r.random(n) < 0.3, near, weak)
    k = mass * w * w
    level = k * shift / (mass * _G if weighed else 1.0)
    q = x - 0.5 * np.append(0.0, x[:-1]) if related else x
    values = {
        f"{name}{i}": row[i] for name, row in zip("mkl", (mass, k, level), strict=True) for i in range(n)
    }
    says = f"friction of {(shift / np.abs(x)).round(17)}{', weighed' * weighed}{', related' * related}"
    start = {f"q{i}": q[i] for i in range(n)}
    return _Case(_system(n, related, weighed), related, x, w, shift, values, start, says)


def _model(r: np.random.Generator) -> tuple[int, bool, bool, float]:
    n, related, weighed = int(r.integers(1, _MOST + 1)), bool(r.integers(2)), bool(r.integers(2))
    return n, related, weighed, 10.0 ** r.uniform(-2.0, 4.0)


def _judged(off: float, method: str, says: str) -> Outcome:
    allowed = _ALLOWED if METHODS[method].adaptive else _ALLOWED_FIXED
    return Outcome(RIGHT if off <= allowed else WRONG, f"off by {off:.1e}, {says}")


def weak(number: int, method: str) -> Outcome:
    """Run one case."""
    r = np.random.default_rng([number, 53])
    model = _model(r)
    case = _case(r, *model)
    t_end = float(r.uniform(2.0, _TURNS)) * math.pi / case.w.max()
    run = attempt(case.system, t_end, method=method, parameters=case.parameters, start=case.start)
    flagged = flag(run)
    if flagged is not None:
        return flagged
    found = np.array([run[name][-1] for name in case.start])
    return _judged(case.error(found, t_end), method, case.says)


def weak_members(number: int, method: str) -> Outcome:
    """Run several cases as members of an ensemble."""
    r = np.random.default_rng([number, 59])
    model = _model(r)
    cases = [_case(r, *model) for _ in range(_MEMBERS)]
    t_end = float(r.uniform(2.0, _TURNS)) * math.pi / model[-1]
    given = {
        kind: {
            name: np.array([getattr(case, kind)[name] for case in cases]) for name in getattr(cases[0], kind)
        }
        for kind in ("parameters", "start")
    }
    try:
        found = cases[0].system.ensemble(t_end, method=method, max_steps=MOST_STEPS, **given)
    except RuntimeModelError as error:
        return refusal(error)
    trusted = [k for k in range(_MEMBERS) if found.verdicts.ok[k]]
    if not trusted:
        return Outcome(FLAGGED, f"{_MEMBERS} members failed: {found.messages}")
    ends = np.array([found[name].reshape(_MEMBERS, -1)[:, -1] for name in cases[0].start]).T
    errors = {k: cases[k].error(ends[k], t_end) for k in trusted}
    worst = max(errors, key=lambda k: errors[k])
    return _judged(errors[worst], method, f"member {worst} of {len(trusted)}: {cases[worst].says}")


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each method."""
    for k, method in enumerate(METHODS):
        for number in range(_CASES):
            run = functools.partial(weak, number * len(METHODS) + k, method)
            short = number == 0 and method in ("dop853", "taylor", "radau5", "gauss8")
            yield Scenario("weak friction", f"weak friction {number}: {method}", run, method, short)
            members = functools.partial(weak_members, number * len(METHODS) + k, method)
            if method in _IN_LANES:
                yield Scenario("weak friction", f"weak friction, members {number}: {method}", members, method)
