"""Lagrangians with metrics, gyroscopic terms, damping and drives, in units of 1e-9 to 1e9, seen at many frames or few.

Energies are drawn in units of their own; the reference integrates Lagrange's equations as SymPy has them of that,
the model is the same in metres, seconds and kilograms. So whatever a check has for an absolute size is found.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import sympy
from scipy.integrate import solve_ivp

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .scenario import RIGHT, Outcome, Scenario

_CASES = 4  # of each method
_UNITS = (1.0, 1.0, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9)
_MASSES = (1.0, 1.0, 1e-27, 1e-9, 1e9, 1e24)
_SPANS = (3.0, 12.0, 40.0)
_FEW = (1, 3, 6)
_RIGHT, _KNOWN = 1e-3, 1e-4  # errors of a run that is right, and of a reference
_MOST_STEPS = 100_000


class Motion(NamedTuple):
    """Energies and forces in units of their own, and a start."""

    kinetic: sympy.Expr
    potential: sympy.Expr
    forces: list[sympy.Expr]
    start: np.ndarray

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return len(self.forces)


_T = sympy.Symbol("t")


def _symbols(n: int) -> tuple[tuple[sympy.Symbol, ...], tuple[sympy.Symbol, ...]]:
    return sympy.symbols(f"x0:{n}"), sympy.symbols(f"u0:{n}")


def drawn(r: np.random.Generator) -> Motion:
    """Return a motion with one to three coordinates that stays bounded."""
    n = int(r.integers(1, 4))
    q, v = _symbols(n)

    def c() -> float:
        return round(float(r.uniform(0.2, 1.5)) * float(r.choice([1.0, 1.0, -1.0])), 3)

    def one() -> sympy.Symbol:
        return q[int(r.integers(n))]

    def entry(i: int, j: int) -> sympy.Expr:
        if i == j:
            return 1.5 + 0.25 * c() * sympy.sin(one() + c())
        return c() / 3.0 * sympy.cos(one()) if r.random() < 0.6 else sympy.Integer(0)

    root = sympy.Matrix(n, n, entry) * sympy.Matrix(v)
    kinetic = (root.T * root)[0] / 2
    if r.random() < 0.5:
        kinetic += sum(c() * v[i] * sympy.sin(q[(i + 1) % n]) for i in range(n))
    potential = sum(0.5 * c() ** 2 * x**2 for x in q)
    for _ in range(int(r.integers(0, 4))):
        x, y = one(), one()
        terms = (
            c() * sympy.cos(c() * x + y),
            0.25 * c() ** 2 * (x**2 + y**2) ** 2,
            -(c() ** 2) * sympy.exp(-(x**2) - y**2),
        )
        potential += terms[int(r.integers(len(terms)))]
    forces = [sympy.Integer(0)] * n
    if r.random() < 0.4:
        forces = [-0.2 * c() ** 2 * u * (sympy.sqrt(u**2 + 0.01) if r.random() < 0.5 else u**2) for u in v]
    if r.random() < 0.4:
        forces[-1] += c() * sympy.cos(round(float(r.uniform(0.3, 5.0)), 2) * _T)
    return Motion(kinetic, potential, forces, r.uniform(-1.0, 1.0, 2 * n).round(3))


def equations(motion: Motion) -> Callable[[float, np.ndarray], np.ndarray]:
    """Return the derivative of (q, v), as Lagrange's equations have it."""
    n = motion.n
    q, v = _symbols(n)
    lagrangian = motion.kinetic - motion.potential
    momenta = [sympy.diff(lagrangian, u) for u in v]
    mass = sympy.Matrix(n, n, lambda i, j: sympy.diff(momenta[i], v[j]))
    rest = [
        sympy.diff(lagrangian, q[i])
        + motion.forces[i]
        - sum(sympy.diff(momenta[i], q[j]) * v[j] for j in range(n))
        for i in range(n)
    ]
    matrix, vector = (sympy.lambdify((_T, *q, *v), x, "numpy") for x in (mass, sympy.Matrix(rest)))

    def derivative(t: float, y: np.ndarray) -> np.ndarray:
        a = np.linalg.solve(np.array(matrix(t, *y), float), np.array(vector(t, *y), float).ravel())
        return np.concatenate([y[n:], a])

    return derivative


def model_of(motion: Motion, length: float, time: float, mass: float) -> Model:
    """Return a motion with these units [m, s, kg] in place of its own."""
    n, energy = motion.n, mass * (length / time) ** 2
    model = Model("scaled")

    def text(expression: sympy.Expr, unit: float) -> str:
        said = re.sub(r"\bu(\d)", lambda m: f"({time / length!r}*dot(y{m[1]}))", sympy.sstr(expression))
        said = re.sub(r"\bx(\d)", lambda m: f"({1.0 / length!r}*y{m[1]})", said)
        said = re.sub(r"\bt\b", f"({1.0 / time!r}*t)", said)
        return f"{unit!r}*({said})"

    names = [
        model.coordinate(
            f"y{i}", start=float(motion.start[i]) * length, rate=float(motion.start[n + i]) * length / time
        )
        for i in range(n)
    ]
    model.kinetic(text(motion.kinetic, energy))
    model.potential(text(motion.potential, energy))
    for name, force in zip(names, motion.forces, strict=True):
        if force != 0:
            model.force(name, text(force, energy / length))
    return model


def scaled(seed: int, method: str) -> Outcome:
    """Judge a run of a motion in some units at its frames, by Lagrange's equations in units of their own."""
    r = np.random.default_rng([seed, 2711])
    motion = drawn(r)
    length, time, mass = float(r.choice(_UNITS)), float(r.choice(_UNITS)), float(r.choice(_MASSES))
    t_end = float(r.choice(_SPANS))
    given: dict[str, Any] = {"method": method}
    if find_method(method).adaptive:
        given["rtol"] = float(10.0 ** r.integers(-12, -1))
        given["atol"] = 0.01 * given["rtol"] * min(length, length / time)
    elif r.random() < 0.7:
        given["step"] = time * float(10.0 ** r.uniform(-2.2, -0.3))
    few = r.random() < 0.4
    if few:
        given["t_eval"] = (time * t_end * r.uniform(0.0, 1.0, int(r.choice(_FEW)))).tolist()
    system = runtime.load(derive_text(model_of(motion, length, time, mass)).text)
    run = attempt(system, t_end * time, max_steps=_MOST_STEPS, **given)
    if isinstance(run, Outcome):
        return run
    sizes = np.repeat([length, length / time], motion.n)
    dense = np.unique(np.concatenate([np.linspace(0.0, t_end, 1000), np.clip(run.t / time, 0.0, t_end)]))
    of_reference = [
        solve_ivp(
            equations(motion),
            (0.0, t_end),
            motion.start,
            "DOP853",
            dense,
            rtol=tolerance,
            atol=1e-2 * tolerance,
        ).y.T
        for tolerance in (1e-12, 1e-10)
    ]
    truth, ranges = of_reference[0], np.ptp(of_reference[0], axis=0)
    if np.abs(truth - of_reference[1]).max() > _KNOWN * ranges.min():
        return Outcome(RIGHT, "the reference is lost")
    at = np.searchsorted(dense, np.clip(run.t / time, 0.0, t_end))
    off = np.abs(run.states / sizes - truth[at]).max(axis=0) / ranges
    says = f"{length:g} m, {time:g} s, {mass:g} kg, {given}"
    return judge_end(run, float(np.nan_to_num(off.max(), nan=np.inf)), says, right=0.0 if few else _RIGHT)


def scenarios() -> Iterator[Scenario]:
    """Yield cases with each method."""
    for k, method in enumerate(METHODS):
        for number in range(_CASES):
            run = functools.partial(scaled, number * len(METHODS) + k, method)
            short = number == 0 and method in ("dop853", "rattle4", "radau5")
            yield Scenario("scaled", f"scaled {number}: {method}", run, method, short)
