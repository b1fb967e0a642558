"""Every form that a function's text can have, by models of many sizes: written out, in loops, dense, in fronts.

`rhs` is held against a dense solve of [M Gᵀ; G 0] with what the other functions say, these against the change of the
energy, and `taylor`, which has code of its own, against `dop853`.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator
from unittest import mock

import numpy as np

from symgen import Model, cos, dot, link, runtime, sin, t
from symgen.derive.rolling import Schedule
from symgen.derive.solve import choice, dense_solve, factorise
from symgen.emit import module as function_text
from symgen.emit import rolled as emitted_loops
from symgen.model.library import find, load
from symgen.runtime.taylor.kernel import taylor_refusal

from .scenario import RIGHT, WRONG, Outcome, Scenario

FIBONACCI = (1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233)
EPS = np.finfo(float).eps


def joint_chain(n: int, kind: str = "revolute") -> Model:
    """A tree of joints, whose functions are recursive: links that hang from each other."""
    model = Model(f"{kind}_chain", gravity=("4.0", "2.0", "-9.81"))  # it hangs down at the start, and swings
    parent = "world"
    for k in range(n):
        model.body(f"link{k}", mass=1.0 + 0.1 * k, com=(0, 0, -0.2), inertia=(0.02, 0.03, 0.004))
        axis = {} if kind == "spherical" else {"axis": ((1, 0, 0), (0, 1, 0))[k % 2]}
        origin = {"xyz": (0, 0, -0.4 if k else 0.0)}
        model.joint(f"j{k}", kind, parent=parent, child=f"link{k}", origin=origin, **axis)
        parent = f"link{k}"
    return model


def ring(n: int) -> Model:
    """A loop of links in relative angles, closed by two constraints: full matrices."""
    model = Model("ring", gravity=(0, "-9.81"))
    m, length = model.parameters(m=0.3, l=0.4)
    angle, x, y = 0, 0, 0
    for k in range(n + 2):
        angle = angle + model.coordinate(f"q{k}", guess=2 * math.pi / (n + 3))
        x, y = x + length * cos(angle), y + length * sin(angle)
        model.body(f"bob{k}", mass=m, com=(x, y))
    model.constraint("closes_x", x + length)
    model.constraint("closes_y", y)
    return model


def bars(n: int) -> Model:
    """Masses on springs with parameters of their own, with damping, an input and a force that time moves."""
    model = Model("bars")
    force, before = model.input("f", default=0.3), 0
    for k in range(n):
        m, c, d = model.parameters(**{f"m{k}": 1.0 + 0.1 * k, f"c{k}": 20.0 + k, f"d{k}": 0.1})
        x = model.coordinate(f"x{k}", start=0.1 * k, rate=1.0)
        model.kinetic(m / 2 * dot(x) ** 2)
        model.potential(c / 2 * (x - before) ** 2 + (x - before) ** 4)
        model.dissipation(d**2 / (m * c + 1) * dot(x) ** 2)
        before = x
    model.force(x, force * cos(3 * t))
    return model


def _bundled(name: str, option: str, **more: str) -> Callable[[int], Model]:
    return lambda n: load(find(name), {option: str(n), **more})


MODELS: dict[str, tuple[Callable[[int], Model], int]] = {
    "n_pendulum": (_bundled("n_pendulum", "N"), 233),
    "chain_absolute": (_bundled("chain_absolute", "N"), 233),
    "n_four_bar": (_bundled("n_four_bar", "N"), 144),
    "spring_chain": (_bundled("spring_chain", "N"), 233),
    "pendulum_field": (_bundled("pendulum_field", "n"), 233),
    "pendulum_field of equal ones": (_bundled("pendulum_field", "n", equal="True"), 233),
    "lattice": (_bundled("lattice", "N"), 13),
    "chain of hinges": (joint_chain, 144),
    "chain of balls": (functools.partial(joint_chain, kind="spherical"), 34),
    "ring": (ring, 89),
    "masses on springs": (bars, 233),
}
FORMS = ("as it comes", "rolled", "dense", "fronts", "rolled and dense", "written out", "lifted")


@contextlib.contextmanager
def form(name: str) -> Iterator[None]:
    """Let functions be written in one form, whatever their size."""
    huge = 10**9
    rolled = {(function_text, "SMALLEST_ROLLED"): 0, (function_text, "SMALLEST_WITH_FRONTS"): 0,
              (emitted_loops, "FEWEST"): 2, (Schedule, "is_short"): lambda self, in_turns=True: True}  # fmt: skip
    dense = {(dense_solve, "SMALLEST"): 2, (dense_solve, "LEAST_FULL"): 0.0, (choice, "FEWEST_RATES"): huge}
    fronts = {(factorise, "FEWEST_IN_FRONTS"): 2, (factorise, "LEAST_IN_FRONTS"): 0}
    none = {(function_text, "SMALLEST_ROLLED"): huge, (dense_solve, "SMALLEST"): huge,
            (factorise, "FEWEST_IN_FRONTS"): huge, (choice, "FEWEST_RATES"): huge}  # fmt: skip
    lifted = {(choice, "FEWEST_RATES"): 1, (choice, "FEWEST_COUPLED"): 0.0, (choice, "GAIN"): 0.0}
    changes = {
        "as it comes": {}, "rolled": rolled, "dense": dense, "fronts": rolled | fronts,
        "rolled and dense": rolled | dense, "written out": none, "lifted": lifted,
    }[name]  # fmt: skip
    with contextlib.ExitStack() as stack:
        for (module, constant), value in changes.items():
            stack.enter_context(mock.patch.object(module, constant, value))
        yield


def worst_of_functions(system: runtime.System, seed: int, states: int = 2) -> tuple[float, str]:
    """Return the largest disagreement of a model's functions, in parts of what round-off explains, and where.

    The states are random ones near the start: what `rhs` says of accelerations and multipliers holds in every state.
    """
    rng = np.random.default_rng(seed)
    p, (q0, v0, _, _) = system.parameter_values(), system.initial_state()
    nq, nv, m = system.nq, system.nv, system.m
    worst = (0.0, "")
    for _ in range(states):
        time, y = rng.uniform(0.1, 1.0), np.concatenate([q0, v0])
        y += 0.3 * rng.standard_normal(nq + nv)
        for k in system.quaternions:
            y[k : k + 4] /= np.linalg.norm(y[k : k + 4])
        value = lambda name, z, at=time: system.kernel(name)(at, z, p)  # noqa: E731
        row = value("rhs", y)
        a, lam = row[nq : nq + nv], row[system.ny : system.ny + m]
        M, f = value("mass_matrix", y).reshape(nv, nv), value("forces", y)
        G = value("constraint_jacobian", y).reshape(m, nv) if m else np.zeros((0, nv))
        gamma = value("gamma", y) if m else np.zeros(0)
        whole = np.block([[M, -G.T], [G, np.zeros((m, m))]])
        right = np.concatenate([f, gamma])
        solution, given = np.linalg.solve(whole, right), np.concatenate([a, lam])
        condition = np.linalg.cond(whole / np.abs(whole).max(axis=1, keepdims=True))
        allowed = 1e4 * EPS * condition * np.abs(solution).max()
        left = whole @ given - right
        terms = np.abs(whole) @ np.abs(given) + np.abs(right) + 1e-6 * np.abs(right).max()
        residual = value("residual", np.concatenate([y, a, lam]))
        found = [
            (np.abs(given - solution).max() / allowed, "rhs against a dense solve"),
            ((np.abs(residual - left) / terms).max() / 1e-9, "residual against M, f, G, gamma"),
            (_energy(system, value, time, y, a, row, lam @ (G @ y[nq:])) / 1e-6, "dE/dt against power"),
        ]
        if m and condition < 1e12:
            found.append(((np.abs(left) / terms).max() / 1e-8, "what rhs leaves of the equations"))
        worst = max(worst, *found)
    return worst


def _energy(
    system, value, time: float, y: np.ndarray, a: np.ndarray, row: np.ndarray, reactions: float
) -> float:
    """How far the change of T + V is from the power of all forces, in parts of the terms of the change."""
    nq = system.nq
    moving = np.concatenate([row[:nq], a])
    size = 1e-5 / max(1.0, np.abs(moving).max())
    ends = [value("energy", y + s * size * moving, time + s * size).sum() for s in (-2, -1, 1, 2)]
    change = (8.0 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / (12.0 * size)
    power = row[system.ny - 1] if system.nw else 0.0
    M = value("mass_matrix", y).reshape(system.nv, system.nv)
    terms = np.abs(y[nq:]) @ (np.abs(M) @ np.abs(a)) + np.abs(y[nq:]) @ np.abs(value("forces", y)) + 1e-9
    round_off = 1e3 * EPS * np.abs(value("energy", y)).sum() / size
    return max(abs(change - power - reactions) - round_off, 0.0) / terms


def series_error(system: runtime.System, t_end: float) -> float | None:
    """Return how far `taylor` is from `dop853` after a short time, in parts of the motion; None without a series."""
    if taylor_refusal(system):
        return None
    runs = [system.run(t_end=t_end, method=m, rtol=1e-10, atol=1e-12) for m in ("taylor", "dop853")]
    states = [np.concatenate([run.q[-1], run.v[-1]]) for run in runs]
    travelled = np.abs(states[1] - np.concatenate([runs[1].q[0], runs[1].v[0]])).max()
    return float(np.abs(states[0] - states[1]).max() / max(travelled, 1e-6))


def check(name: str, n: int, how: str, series: bool = True) -> Outcome:
    """Derive a model of one size in one form, and hold its functions against each other."""
    with form(how):
        system = link.derive(MODELS[name][0](n))
    value, where = worst_of_functions(system, seed=n)
    if not value < 1.0:
        return Outcome(WRONG, f"{where}: {value:.2g} times what round-off explains")
    says = f"{value:.1e} of what round-off explains"
    if series:
        error = series_error(system, 0.05)
        if error is not None and not error < 1e-6:
            return Outcome(WRONG, f"taylor is {error:.2g} of the motion from dop853")
        says += "" if error is None else f", series {error:.1e} of the motion"
    return Outcome(RIGHT, says)


def scenarios() -> Iterator[Scenario]:
    """Yield all; the test suite has a part of its own of them (tests/test_sizes.py)."""
    for name, (_, largest) in MODELS.items():
        for n in FIBONACCI:
            for how in FORMS if n <= 8 else FORMS[:1]:
                if n <= largest and (n > 1 or name != "lattice"):
                    run = functools.partial(check, name, n, how)
                    yield Scenario("size", f"{name} of {n}, {how}", run, short=False, limit=900.0)
