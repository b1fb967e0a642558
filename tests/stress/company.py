"""Models in company: what another part of a model does, far away and of another size, is nothing to them.

A small model runs alone with a reference method, and beside a part that has nothing to do with it: a mass that is
parked or moves very far away, a swing of huge or of tiny size, forces or masses that are decades larger. Sizes that
are taken over all of a model show here: gaps that count as closed, kinks that pass for round-off, errors that seem
small.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen import Model, dot, runtime, sin
from symgen.link import derive_text
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, flag
from .scenario import RIGHT, WRONG, Outcome, Scenario

if TYPE_CHECKING:
    from symgen.runtime import System

_CASES, _T_END = 6, 2.0  # cases of each method
_ALLOWED, _ALLOWED_FIXED = 1e-3, 0.05  # of what a coordinate does


def _balls(m: Model) -> list[str]:
    y, z = m.coordinate("y", start=1.0), m.coordinate("z", start=0.4)
    m.kinetic(dot(y) ** 2 / 2 + dot(z) ** 2 / 2)
    m.potential(9.81 * y + 9.81 * z)
    m.stop("a", gap=y, restitution=0.8)
    m.stop("b", gap=z, restitution=0.5)
    return ["y", "z"]


def _block(m: Model) -> list[str]:
    x = m.coordinate("u", start=0.3, rate=0.5)
    m.kinetic(dot(x) ** 2 / 2)
    m.potential(20 * x**2)
    m.friction("belt", speed=dot(x) - 0.3, force=2.0, static=3.0)
    return ["u"]


def _pendulum(m: Model) -> list[str]:
    x, y = m.coordinate("x", start=1.0), m.coordinate("y", start=0.0)
    m.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    m.potential(9.81 * y)
    m.constraint("rod", x**2 + y**2 - 1)
    return ["x", "y"]


def _switched(m: Model) -> list[str]:
    x = m.coordinate("x", start=0.7)
    m.kinetic(dot(x) ** 2 / 2)
    m.force(x, "-5*sign(x - 0.2) - x")
    return ["x"]


def _swing(m: Model) -> list[str]:
    a = m.coordinate("a", start=2.5)
    m.kinetic(dot(a) ** 2 / 2)
    m.force(a, -9.81 * sin(a) - 0.1 * dot(a))
    return ["a"]


def _parked(m: Model, size: float) -> None:
    m.kinetic(dot(m.coordinate("far", start=size)) ** 2 / 2)


def _flying(m: Model, size: float) -> None:
    m.kinetic(dot(m.coordinate("far", start=size, rate=0.1 * size)) ** 2 / 2)


def _swinging(m: Model, size: float) -> None:
    x = m.coordinate("far", start=size)
    m.kinetic(dot(x) ** 2 / 2)
    m.potential(2 * x**2)


def _heavy(m: Model, size: float) -> None:
    x = m.coordinate("far", start=0.5)
    m.kinetic(size * dot(x) ** 2 / 2)
    m.potential(2 * size * x**2)


def _pressed(m: Model, size: float) -> None:
    x = m.coordinate("far")
    m.kinetic(dot(x) ** 2 / 2)
    m.potential(size * x)
    m.stop("ground", gap=x)


def _thrown(m: Model, size: float) -> None:
    x = m.coordinate("far", start=size, rate=-size)
    m.kinetic(dot(x) ** 2 / 2)
    m.stop("wall", gap=x, restitution=1)


_MODELS: tuple[Callable[[Model], list[str]], ...] = (_balls, _block, _pendulum, _switched, _swing)
_COMPANY: tuple[Callable[[Model, float], None], ...] = (
    _parked,
    _flying,
    _swinging,
    _heavy,
    _pressed,
    _thrown,
)


@functools.cache
def _alone(of: int) -> tuple[list[str], Any]:
    m = Model("alone")
    names = _MODELS[of](m)
    system = runtime.load(derive_text(m).text)
    run = runtime.solve(system, _T_END, method="radau5", rtol=1e-11, atol=1e-13)
    return names, run


@functools.cache
def _together(of: int, company: int, exponent: int) -> System:
    m = Model("together")
    _MODELS[of](m)
    _COMPANY[company](m, 10.0**exponent)
    return runtime.load(derive_text(m).text)


def company(number: int, method: str) -> Outcome:
    """Run one case."""
    r = np.random.default_rng([number, 71])
    of, beside, exponent = (
        int(r.integers(len(_MODELS))),
        int(r.integers(len(_COMPANY))),
        int(r.integers(-12, 13)),
    )
    names, alone = _alone(of)
    system = _together(of, beside, exponent)
    run = attempt(system, _T_END, method=method)
    flagged = flag(run)
    if flagged is not None:
        return flagged
    off = max(abs(run[name][-1] - alone[name][-1]) / max(np.ptp(alone[name]), 1e-3) for name in names)
    allowed = _ALLOWED if METHODS[method].adaptive else _ALLOWED_FIXED
    says = (
        f"{_MODELS[of].__name__[1:]} beside {_COMPANY[beside].__name__[1:]} of 1e{exponent}: off by {off:.1e}"
    )
    return Outcome(RIGHT if off <= allowed else WRONG, says)


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each method."""
    for k, method in enumerate(METHODS):
        for number in range(_CASES):
            run = functools.partial(company, number * len(METHODS) + k, method)
            short = number == 0 and method in ("dop853", "taylor", "bdf", "rk4")
            yield Scenario("company", f"in company {number}: {method}", run, method, short)
