"""Shafts coupled by gears, racks, belts, planetary sets, differentials and worms, against equations in few numbers.

What the couplings leave is B u: its accelerations follow from Bᵀ M B u' = Bᵀ f. A worm, or another pair with an
efficiency, rubs in its first shaft with (1/efficiency - 1) times the torque of the mesh, sticks there, and lets go; the
reference goes from phase to phase with the signs of speed and mesh force that are consistent.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model, dot
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .models import made
from .scenario import RIGHT, Outcome, Scenario

_CASES = 3  # with each method
_RTOLS = (1e-5, 1e-7, 1e-9)
_LEAST = 1e-2  # of a magnitude that counts as motion
_AT_REST = 1e-9
_MOST_PHASES = 40


@dataclass
class Coupling:
    """A row of the constraints: what the model is told, and the coefficients of the shafts."""

    kind: str
    shafts: tuple[int, ...]
    numbers: tuple
    row: np.ndarray
    efficiency: float | None = None


@dataclass
class Train:
    """Shafts with inertias under springs, dampers and torques that come and go."""

    inertias: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    steady: np.ndarray
    swing: np.ndarray
    speed: np.ndarray
    couplings: list[Coupling]
    rates: np.ndarray  # of what the couplings leave

    def __post_init__(self):
        self.G = np.array([c.row for c in self.couplings])
        _, sizes, V = np.linalg.svd(self.G)
        self.independent = sizes.min() > 1e-2
        self.B = V[len(sizes) :].T
        self.worm = next((k for k, c in enumerate(self.couplings) if c.efficiency is not None), None)
        if self.worm is not None:
            worm = self.couplings[self.worm]
            # of the torque that the mesh takes from the first shaft
            self.rubs = (1.0 / worm.efficiency - 1.0) * abs(worm.row[worm.shafts[0]])

    def forces(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the torques on all shafts."""
        return self.steady + self.swing * np.cos(self.speed * t) - self.stiffness * q - self.damping * v

    def solve(self, t: float, q: np.ndarray, v: np.ndarray, slides: float) -> tuple:
        """Return accelerations, forces in meshes, and the friction.

        `slides` is the way that the first shaft of the worm turns, 0 where it is held.
        """
        n, m = len(q), len(self.G)
        f = self.forces(t, q, v)
        K = np.zeros((n + m, n + m))
        K[:n, :n], K[:n, n:], K[n:, :n] = np.diag(self.inertias), -self.G.T, self.G
        right = np.concatenate([f, np.zeros(m)])
        if self.worm is None:
            found = np.linalg.solve(K, right)
            return found[:n], found[n:], 0.0
        worm = self.couplings[self.worm]
        mu, first = self.rubs, worm.shafts[0]
        if slides == 0.0:
            held = np.zeros((n + m + 1, n + m + 1))
            held[:-1, :-1] = K
            held[first, -1], held[-1, first] = -1.0, 1.0
            found = np.linalg.solve(held, np.concatenate([right, [0.0]]))
            return found[:n], found[n:-1], found[-1]
        good = []
        for sign in (1.0, -1.0):
            rubs = K.copy()
            # J a = f + Gᵀ λ - mu |λ| slides
            rubs[first, n + self.worm] += mu * sign * slides
            found = np.linalg.solve(rubs, right)
            if sign * found[n + self.worm] >= 0.0:
                good.append((found[:n], found[n:], -mu * sign * found[n + self.worm] * slides))
        if not good:
            raise ArithmeticError("no way of the mesh is consistent")
        if len(good) == 2 and abs(good[0][1][self.worm]) > 1e-9:
            raise ArithmeticError("both ways of the mesh are consistent")
        return good[0]

    def integrate(self, t_end: float, rtol: float) -> tuple[np.ndarray, np.ndarray]:
        """Return times and states (q, v), phase by phase."""
        n = len(self.inertias)
        y, t, times, states = np.concatenate([np.zeros(n), self.B @ self.rates]), 0.0, [0.0], []
        states.append(y)
        first = self.couplings[self.worm].shafts[0] if self.worm is not None else 0
        mode = 1.0 if self.worm is None else self._mode(t, y, first)
        for _ in range(_MOST_PHASES):

            def motion(t, y, mode=mode):
                return np.concatenate([y[n:], self.solve(t, y[:n], y[n:], mode)[0]])

            def ends(t, y, mode=mode, start=t):
                if mode == 0.0:
                    return self._spare(t, y)
                return y[n + first] * mode + (1e-13 if t == start else 0.0)

            ends.terminal, ends.direction = True, -1.0
            found = solve_ivp(
                motion, (t, t_end), y, "DOP853", rtol=rtol, atol=rtol * 1e-2, max_step=t_end / 100.0,
                events=[ends] if self.worm is not None else None,
            )  # fmt: skip
            times += list(found.t[1:])
            states += list(found.y.T[1:])
            t, y = found.t[-1], found.y[:, -1].copy()
            if found.status != 1:
                return np.array(times), np.array(states)
            if mode == 0.0:
                mode = self._lets_go(t, y)
            else:
                y[n:] = self._stopped(y[n:], first)
                mode = self._mode(t, y, first)
        raise ArithmeticError("too many phases")

    def _stopped(self, v: np.ndarray, first: int) -> np.ndarray:
        out = v.copy()
        out[first] = 0.0
        kept = np.vstack([self.G, np.eye(len(v))[first]])
        return out - np.linalg.pinv(kept) @ (kept @ out)

    def _spare(self, t: float, y: np.ndarray) -> float:
        n = len(self.inertias)
        _, mesh, friction = self.solve(t, y[:n], y[n:], 0.0)
        return self.rubs * abs(mesh[self.worm]) - abs(friction)

    def _mode(self, t: float, y: np.ndarray, first: int) -> float:
        n = len(self.inertias)
        if abs(y[n + first]) > _AT_REST:
            return float(np.sign(y[n + first]))
        if self._spare(t, y) > 0.0:
            return 0.0
        return self._lets_go(t, y)

    def _lets_go(self, t: float, y: np.ndarray) -> float:
        n = len(self.inertias)
        return float(-np.sign(self.solve(t, y[:n], y[n:], 0.0)[2]))

    def model(self) -> Model:
        """Return it as a model, with the forces in its meshes as outputs."""
        n = len(self.inertias)
        m, rates = Model("train"), self.B @ self.rates
        q = [m.coordinate(f"q{k}", guess=0.0, rate_guess=float(rates[k])) for k in range(n)]
        for k, x in enumerate(q):
            m.kinetic(float(self.inertias[k]) * dot(x) ** 2 / 2)
            m.potential(float(self.stiffness[k]) * x**2 / 2)
            m.force(
                x, f"{float(self.steady[k])!r} + {float(self.swing[k])!r}*cos({float(self.speed[k])!r}*t)"
                f" - {float(self.damping[k])!r}*dot(q{k})",
            )  # fmt: skip
        for i, c in enumerate(self.couplings):
            shafts, name, more = [f"q{k}" for k in c.shafts], f"mesh{i}", {}
            if c.efficiency is not None:
                more["efficiency"] = c.efficiency
            if c.kind == "gear":
                m.gear(name, *shafts, c.numbers[0], **more)
            elif c.kind == "teeth":
                m.gear(name, *shafts, teeth=list(c.numbers), **more)
            elif c.kind == "rack":
                m.rack(name, *shafts, c.numbers[0], **more)
            elif c.kind == "belt":
                m.belt(name, *shafts, list(c.numbers[:2]), crossed=c.numbers[2])
            elif c.kind == "planetary":
                m.planetary(name, *shafts, list(c.numbers))
            else:
                m.differential(name, shafts[0], shafts[1:], c.numbers[0])
            m.output(f"at{i}", f"reaction({name})")
        return m


def _number(r: np.random.Generator, low: float, high: float) -> float:
    return round(float(r.uniform(low, high)), 3)


def coupling(r: np.random.Generator, kind: str, shafts: tuple[int, ...], n: int) -> Coupling:
    """Draw a coupling of a kind between shafts."""
    row = np.zeros(n)
    sign = float(r.choice([-1.0, 1.0]))
    a, *others = shafts
    if kind == "gear":
        numbers = (sign * _number(r, 0.3, 5),)
        row[a], row[others[0]] = 1.0, -numbers[0]
    elif kind == "teeth":
        numbers = (int(r.integers(12, 60)), int(sign * r.integers(12, 60)))
        row[a], row[others[0]] = 1.0, numbers[1] / numbers[0]
    elif kind == "rack":
        numbers = (sign * _number(r, 0.1, 0.6),)
        row[others[0]], row[a] = 1.0, -numbers[0]
    elif kind == "belt":
        numbers = (_number(r, 0.1, 0.5), _number(r, 0.1, 0.5), bool(sign < 0))
        row[a], row[others[0]] = numbers[0], -sign * numbers[1]
    elif kind == "planetary":
        numbers = (int(r.integers(15, 40)), int(r.integers(45, 90)))
        ratio = numbers[1] / numbers[0]
        row[[a, others[0], others[1]]] = 1.0, ratio, -1.0 - ratio
    else:
        numbers = (_number(r, 0.5, 4),)
        row[[a, others[0], others[1]]] = 1.0, -numbers[0] / 2, -numbers[0] / 2
    return Coupling(kind, shafts, numbers, row)


def draw(r: np.random.Generator, worm: bool) -> Train:
    """Draw a train in which each coupling brings at least one shaft."""
    couplings, n = [], 2
    kinds = []
    for _ in range(int(r.integers(1, 4))):
        kinds.append(str(r.choice(["gear", "teeth", "rack", "belt", "planetary", "differential"])))
        n += 2 if kinds[-1] in ("planetary", "differential") else 1
    known = 1
    for kind in kinds:
        old = int(r.integers(known))
        new = [known, known + 1] if kind in ("planetary", "differential") else [known]
        known += len(new)
        shafts = [old, *new]
        r.shuffle(shafts)
        couplings.append(coupling(r, kind, tuple(map(int, shafts)), n))
    # the last shaft, if it is left, is by itself or between others
    if worm:
        fit = [c for c in couplings if c.kind in ("gear", "teeth", "rack")]
        if not fit:
            couplings.append(coupling(r, "gear", (0, n - 1), n))
            fit = couplings[-1:]
        fit[int(r.integers(len(fit)))].efficiency = _number(r, 0.3, 0.95)
    left = n - len(couplings)
    train = Train(
        np.round(r.uniform(0.05, 2.0, n), 3), np.round(r.uniform(0, 20, n) * (r.random(n) < 0.4), 3),
        np.round(r.uniform(0, 1, n) * (r.random(n) < 0.5), 3), np.round(r.normal(0, 3, n), 3),
        np.round(r.normal(0, 6, n), 3), np.round(r.uniform(0.5, 6, n), 3), couplings,
        np.round(r.normal(0.0, 2.0, left), 3) * float(r.random() < 0.7),
    )  # fmt: skip
    return train


def train(kind: str, number: int, method: str) -> Outcome:
    """Run a train, and judge its end."""
    r = np.random.default_rng([number, *kind.encode()])
    case, t_end = draw(r, kind == "worm"), float(r.uniform(0.5, 5.0))
    given = {"rtol": float(r.choice(_RTOLS))} if find_method(method).adaptive else {}
    if not case.independent:
        return Outcome(RIGHT, "couplings depend on each other")
    n = len(case.inertias)
    try:
        _, y = case.integrate(t_end, 1e-11)
        again = case.integrate(t_end, 1e-8)[1][-1]
    except ArithmeticError as error:
        return Outcome(RIGHT, str(error))
    ranges = np.fmax(np.ptp(y, axis=0), _LEAST * np.abs(y).max(axis=0)) + 1e-9
    if (np.abs(again - y[-1]) / ranges).max() > 1e-5:
        return Outcome(RIGHT, "the reference is lost")
    run = attempt(made(case.model()), t_end, method=method, **given)
    if isinstance(run, Outcome):
        return run
    found = np.array([*(run[f"q{k}"][-1] for k in range(n)), *(run[f"dot(q{k})"][-1] for k in range(n))])
    errors = np.abs(found - y[-1]) / ranges
    mode = 1.0
    if case.worm is not None:
        mode = case._mode(t_end, y[-1], case.couplings[case.worm].shafts[0])
    mesh = case.solve(t_end, y[-1, :n], y[-1, n:], mode)[1]
    said = np.array([run[f"at{i}"][-1] for i in range(len(mesh))])
    of_mesh = np.abs(said - mesh) / max(1e-2, np.abs(mesh).max())
    off = float(max(errors.max(), of_mesh.max()))
    where = f"state {errors.argmax()}" if errors.max() >= of_mesh.max() else f"mesh {of_mesh.argmax()}"
    kinds = "-".join(c.kind for c in case.couplings)
    return judge_end(run, off, f"{kinds}, {method}, {given}, to {t_end:.4g} s, worst {where}")


def scenarios() -> Iterator[Scenario]:
    """Yield trains with and without a worm, with each method."""
    for kind in ("train", "worm"):
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(train, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(f"gears: {kind}", f"gears: {kind} {number}: {method}", run, method, short)
