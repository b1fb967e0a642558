"""Random smooth models with every method: what is right must not be doubted, what is wrong must not pass.

The models have damping and stiffness of either sign, stiffness over five decades, and potentials whose zero lies up to
a million times what the motion exchanges away. References are SciPy's, of equations written here a second time.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model, cos, dot, sin, t
from symgen.runtime import System
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, flag
from .models import made
from .scenario import DOUBTED, FLAGGED, RIGHT, WRONG, Outcome, Scenario

N_ALL = int(os.environ.get("SYMGEN_STRESS_ENERGY", "100"))
N_SHORT = 1
_RIGHT, _WRONG = 0.01, 0.1  # of what a coordinate or rate goes through
_DEFAULT, _OTHER = "default", "other"
_RTOLS = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)


@dataclass(frozen=True)
class Drawn:
    """A model, how it is run, and its equations: (t, y) -> dy/dt with y the coordinates, then the rates."""

    system: System
    parameters: dict[str, float]
    start: np.ndarray
    t_end: float
    fastest: float
    equations: Callable[[float, np.ndarray], np.ndarray]


@functools.cache
def _linear(n: int) -> System:
    model = Model(f"linear{n}")
    q = [model.coordinate(f"q{i}", start=0.0) for i in range(n)]
    v0, drive, omega = model.parameters(v0=0.0, drive=0.0, omega=1.0)
    potential = v0
    for i in range(n):
        for j in range(i + 1):
            k, c = model.parameters(**{f"k{i}{j}": 1.0, f"c{i}{j}": 0.0})
            potential += k * q[i] * q[j] / (2 if i == j else 1)
            model.force(q[i], -c * dot(q[j]))
            if i != j:
                model.force(q[j], -c * dot(q[i]))
    model.kinetic(sum(dot(x) ** 2 for x in q) / 2)
    model.potential(potential)
    model.force(q[0], drive * sin(omega * t))
    return made(model)


def _draw_linear(rng: np.random.Generator, n: int) -> Drawn:
    turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
    rates = 10.0 ** rng.uniform(-0.5, rng.choice([0.5, 1.5, 2.5]), n)
    signs = np.where(rng.random(n) < 0.1, -1.0, 1.0)
    k = turn @ np.diag(signs * rates**2) @ turn.T
    ratios = rng.choice([0.0, 0.02, 0.3, -0.02], n) * rng.uniform(0.0, 1.0, n)
    c = turn @ np.diag(2.0 * ratios * rates) @ turn.T
    drive, omega = rng.choice([0.0, 1.0]) * rng.uniform(0.1, 3.0), float(rng.uniform(0.3, 2.0) * rates.min())
    start = np.concatenate([rng.normal(size=n), rng.normal(size=n) * rates.min()])
    # Slow unstable motions must stay within what numbers hold.
    span = min(rng.uniform(2.0, 15.0) * 2.0 * np.pi / rates.min(), 300.0 * 2.0 * np.pi / rates.max())
    growing = max(np.max(np.where(signs < 0.0, rates, 0.0)), np.max(-ratios * rates))
    if growing > 0.0:
        span = min(span, 15.0 / growing)
    parameters = {f"k{i}{j}": float(k[i, j]) for i in range(n) for j in range(i + 1)}
    parameters |= {f"c{i}{j}": float(c[i, j]) for i in range(n) for j in range(i + 1)}
    parameters |= {
        "drive": float(drive),
        "omega": omega,
        "v0": _offset(rng, float(start[:n] @ np.abs(k) @ start[:n])),
    }

    def equations(time: float, y: np.ndarray) -> np.ndarray:
        a = -k @ y[:n] - c @ y[n:]
        a[0] += drive * np.sin(omega * time)
        return np.concatenate([y[n:], a])

    return Drawn(_linear(n), parameters, start, float(span), float(rates.max()), equations)


@functools.cache
def _swing() -> System:
    model = Model("swing")
    a = model.coordinate("q0", start=0.0)
    w2, v0, c, drive, omega = model.parameters(w2=1.0, v0=0.0, c=0.0, drive=0.0, omega=1.0)
    model.kinetic(dot(a) ** 2 / 2)
    model.potential(v0 - w2 * cos(a))
    model.force(a, drive * sin(omega * t) - c * dot(a))
    return made(model)


def _draw_swing(rng: np.random.Generator) -> Drawn:
    w = 10.0 ** rng.uniform(-0.5, 1.5)
    c = float(rng.choice([0.0, 0.1, -0.02]) * rng.uniform(0.0, 1.0) * w)
    drive, omega = float(rng.choice([0.0, 0.2]) * w * w), float(rng.uniform(0.3, 1.5) * w)
    start = np.array([rng.uniform(-1.5, 1.5), rng.uniform(-0.5, 0.5) * w])
    parameters = {"w2": w * w, "v0": _offset(rng, w * w), "c": c, "drive": drive, "omega": omega}

    def equations(time: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -w * w * np.sin(y[0]) - c * y[1] + drive * np.sin(omega * time)])

    return Drawn(_swing(), parameters, start, float(rng.uniform(2, 20) * 2 * np.pi / w), float(w), equations)


@functools.cache
def _well() -> System:
    model = Model("well")
    x = model.coordinate("q0", start=0.0)
    k, b, v0, c = model.parameters(k=1.0, b=1.0, v0=0.0, c=0.0)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(v0 + k * x**2 / 2 + b * x**4 / 4)
    model.force(x, -c * dot(x))
    return made(model)


def _draw_well(rng: np.random.Generator) -> Drawn:
    k, b = float(rng.choice([1.0, 1.0, -0.5]) * 10.0 ** rng.uniform(-1, 3)), float(10.0 ** rng.uniform(-1, 3))
    start = np.array([rng.uniform(0.3, 2.0), rng.uniform(-1.0, 1.0)])
    w = float(np.sqrt(abs(k) + 3.0 * b * start[0] ** 2))
    c = float(rng.choice([0.0, 0.1, -0.005]) * w)
    parameters = {"k": k, "b": b, "c": c, "v0": _offset(rng, abs(k) * start[0] ** 2 + b * start[0] ** 4)}

    def equations(time: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], -k * y[0] - b * y[0] ** 3 - c * y[1]])

    return Drawn(_well(), parameters, start, float(rng.uniform(2, 20) * 2 * np.pi / w), w, equations)


@functools.cache
def _plain() -> System:
    """Without forces that depend on rates, for the methods that take nothing else."""
    model = Model("plain")
    x, y = model.coordinate("q0", start=0.0), model.coordinate("q1", start=0.0)
    a, b, c, v0 = model.parameters(a=1.0, b=1.0, c=1.0, v0=0.0)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(v0 + a * x**2 / 2 + b * y**2 / 2 + c * (x - y) ** 4 / 4)
    return made(model)


def _draw_plain(rng: np.random.Generator) -> Drawn:
    a, b, c = (float(x) for x in 10.0 ** rng.uniform([0.0, 0.0, -1.0], [1.0, rng.choice([1.0, 4.0]), 1.0]))
    start = np.array([rng.uniform(-1, 1), rng.uniform(-1, 1) / np.sqrt(b), rng.normal(), rng.normal()])
    parameters = {"a": a, "b": b, "c": c, "v0": _offset(rng, a + 1.0)}

    def equations(time: float, y: np.ndarray) -> np.ndarray:
        pull = c * (y[0] - y[1]) ** 3
        return np.array([y[2], y[3], -a * y[0] - pull, -b * y[1] + pull])

    fastest = float(np.sqrt(max(a, b) + 3.0 * c))
    span = min(rng.uniform(2, 15) * 2 * np.pi / np.sqrt(a), 300.0 * 2 * np.pi / fastest)
    return Drawn(_plain(), parameters, start, float(span), fastest, equations)


@functools.cache
def _crank() -> System:
    """A bob on a crank that is driven as a function of time: even motion, uneven power."""
    model = Model("crank", gravity=(0, "-9.81"))
    a = model.coordinate("q0", start=0.0)
    w, b, c, k = model.parameters(w=1.0, b=0.0, c=0.0, k=0.0)
    model.body("bob", mass=1.0, com=(sin(a), -cos(a)))
    model.potential(k * ((sin(a) - 2) ** 2 + cos(a) ** 2) / 2)
    model.force(a, -c * dot(a))
    model.constraint("driven", a - w * t - b * t**2 / 2)
    return made(model)


def _draw_crank(rng: np.random.Generator) -> Drawn:
    w, b = float(10.0 ** rng.uniform(-0.5, 1.0)), float(rng.choice([0.0, 0.0, 0.5]))
    parameters = {
        "w": w,
        "b": b,
        "c": float(rng.choice([0.0, 1.0, -0.5])),
        "k": float(rng.choice([0.0, 20.0])),
    }

    def equations(time: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], b])

    span = rng.uniform(1.0, 20.0) * 2.0 * np.pi / w
    return Drawn(_crank(), parameters, np.array([0.0, w]), float(span), w + b * float(span), equations)


@functools.cache
def _cart() -> System:
    model = Model("cart")
    x, a = model.coordinate("q0", start=0.0), model.coordinate("q1", start=0.0)
    m, k, g, v0, c = model.parameters(m=1.0, k=1.0, g=9.81, v0=0.0, c=0.0)
    vx, va = dot(x), dot(a)
    model.kinetic((1 + m) * vx**2 / 2 + m * cos(a) * vx * va + m * va**2 / 2)
    model.potential(v0 + k * x**2 / 2 - m * g * cos(a))
    model.force(x, -c * vx)
    return made(model)


def _draw_cart(rng: np.random.Generator) -> Drawn:
    m, k = float(rng.uniform(0.1, 2.0)), float(10.0 ** rng.uniform(-1, 4))
    g, c = 9.81, float(rng.choice([0.0, 0.3, 3.0, -0.05]))
    start = np.array([rng.normal() / np.sqrt(1.0 + k), rng.uniform(-0.7, 0.7), 0.0, rng.uniform(-0.5, 0.5)])
    parameters = {"m": m, "k": k, "g": g, "c": c, "v0": _offset(rng, m * g)}

    def equations(time: float, y: np.ndarray) -> np.ndarray:
        x, a, vx, va = y
        mass = np.array([[1.0 + m, m * np.cos(a)], [m * np.cos(a), m]])
        force = np.array([m * np.sin(a) * va * va - k * x - c * vx, -m * g * np.sin(a)])
        return np.array([vx, va, *np.linalg.solve(mass, force)])

    fastest = float(np.sqrt(max(k, g * (1.0 + m))))
    span = min(rng.uniform(2, 8) * 2 * np.pi / np.sqrt(g), 300.0 * 2 * np.pi / fastest)
    return Drawn(_cart(), parameters, start, float(span), fastest, equations)


def _offset(rng: np.random.Generator, exchanged: float) -> float:
    """Return where the zero of V lies: here, or as far as a million times what the motion exchanges."""
    return float(rng.choice([0.0, 0.0, 1.0, -1.0]) * exchanged * 10.0 ** rng.uniform(0.0, 6.0))


_KINDS = (
    functools.partial(_draw_linear, n=1),
    functools.partial(_draw_linear, n=2),
    functools.partial(_draw_linear, n=3),
    _draw_swing,
    _draw_well,
    _draw_cart,
    _draw_plain,
    _draw_crank,
)


@functools.lru_cache(maxsize=2)
def draw(index: int) -> tuple[Drawn, Callable[[np.ndarray], np.ndarray]]:
    """Return the model of an index, and its motion over time, shape (n, 2 nv)."""
    rng = np.random.default_rng([index, 13])
    drawn = _KINDS[index % len(_KINDS)](rng)
    found = solve_ivp(
        drawn.equations,
        (0.0, drawn.t_end),
        drawn.start,
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
        dense_output=True,
    )
    return drawn, lambda times: found.sol(times).T


def settings(drawn: Drawn, index: int, method: str, which: str) -> dict[str, float]:
    """Return the step, or the tolerances, of a run."""
    rng = np.random.default_rng([index, sorted(METHODS).index(method), 17])
    if METHODS[method].adaptive:
        rtol = 1e-8 if which == _DEFAULT else float(rng.choice(_RTOLS))
        return {"rtol": rtol, "atol": 0.01 * rtol}
    if which == _DEFAULT:
        return {}
    step = 2.0 * np.pi / drawn.fastest / 10.0 ** rng.uniform(0.8, 2.6)
    return {"step": float(min(step, drawn.t_end / 10.0))}


def random_run(index: int, method: str, which: str) -> Outcome:
    """Run a random model, and hold what is said of it against what it is worth."""
    drawn, motion = draw(index)
    nv = len(drawn.start) // 2
    names = [record["name"] for record in drawn.system.coordinates]
    run = attempt(
        drawn.system, drawn.t_end, method=method, parameters=drawn.parameters,
        start=dict(zip(names, map(float, drawn.start[:nv]))), rate=dict(zip(names, map(float, drawn.start[nv:]))),
        **settings(drawn, index, method, which),
    )  # fmt: skip
    flagged = flag(run)
    if (flagged is not None and flagged.verdict != FLAGGED) or isinstance(run, Outcome):
        return flagged
    error = _error(run.t, run.states, motion)
    says = f"off by {error:.1e}, energy by {run.energy.max_error:.1e}"
    if flagged is None:
        return Outcome(WRONG if not error <= _WRONG else RIGHT, says)
    return Outcome(DOUBTED if error <= _RIGHT else FLAGGED, f"{says}; {flagged.says}")


def _error(times: np.ndarray, states: np.ndarray, motion: Callable[[np.ndarray], np.ndarray]) -> float:
    """Return the largest error at any frame, in parts of what each coordinate and rate goes through."""
    right = motion(times)
    with np.errstate(all="ignore"):
        off = np.nan_to_num(np.abs(states - right).max(axis=0), nan=np.inf)
    ranges, nv = np.ptp(right, axis=0), right.shape[1] // 2
    for part in (slice(0, nv), slice(nv, None)):
        least = 1e-3 * max(ranges[part].max(), np.abs(right[:, part]).max())
        ranges[part] = np.maximum(ranges[part], least)
    return float((off / ranges).max())


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for index in range(N_ALL):
        for method in METHODS:
            for which in (_DEFAULT, _OTHER):
                name = f"random energy {index}, {method}, {which}"
                run = functools.partial(random_run, index, method, which)
                yield Scenario("energy", name, run, method, short=index < N_SHORT and which == _OTHER)
