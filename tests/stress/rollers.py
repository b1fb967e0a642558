"""Balls that roll on waves and in bowls, and thin wheels on slopes, by the equations of Newton and Euler written again.

What touches has no velocity; its force follows from both balances. For a ball of radius r on a surface with normal n,
F_t (1 + m r²/I) = m r (ω × n')_t - m g_t; for a wheel with ρ from its centre to where it touches,
(I + m (ρ² - ρ ρᵀ)) ω' = -ω × I ω - m ρ × (ω × ρ' + g).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
import sympy
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .models import made
from .scenario import RIGHT, Outcome, Scenario

_CASES = 2  # of each kind with each method, and one with each form
_RTOLS = (1e-5, 1e-7, 1e-9)
_MOST_CURVED = 0.6  # radius of a ball times the curvature of its surface
_FLAT = 0.15  # a wheel's axis in parts of upright, from which on it lies down
_X, _Y = sympy.symbols("x y")


def _number(r: np.random.Generator, low: float, high: float) -> float:
    return round(float(r.uniform(low, high)), 3)


class Ball:
    """A ball on a drawn surface; its state is where it touches, and how it turns [world axes]."""

    def __init__(self, r: np.random.Generator):
        n = int(r.integers(1, 4))
        self.height = sum(
            (
                _number(r, 0.05, 0.4)
                / k
                * sympy.sin(k * _number(r, -1, 1) * _X + k * _number(r, -1, 1) * _Y + k)
                for k in range(1, n + 1)
            ),
            _number(r, 0.0, 0.4) * _X**2 + _number(r, 0.05, 0.4) * _Y**2 + _number(r, -0.1, 0.1) * _X * _Y,
        )
        self.radius, self.mass = _number(r, 0.05, 0.4), _number(r, 0.2, 5.0)
        self.inertia = self.mass * self.radius**2 * _number(r, 0.2, 0.66)
        self.gravity = np.array([_number(r, -2, 2), _number(r, -2, 2), -9.81]) * float(r.choice([1.0, 0.1]))
        self.start = np.concatenate([r.uniform(-1.0, 1.0, 2), r.normal(0.0, 3.0, 3)])
        slopes = [self.height.diff(_X), self.height.diff(_Y)]
        second = [self.height.diff(a, b) for a, b in ((_X, _X), (_X, _Y), (_Y, _Y))]
        self._of = sympy.lambdify((_X, _Y), [self.height, *slopes, *second], "numpy")
        self.most_curved = 0.0

    def place(self, x: float, y: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the centre, the normal, and what the latter changes by with x and y (two columns)."""
        h, hx, hy, hxx, hxy, hyy = map(float, self._of(x, y))
        raw, size = np.array([-hx, -hy, 1.0]), np.sqrt(1.0 + hx * hx + hy * hy)
        n = raw / size
        turns = np.array([[-hxx, -hxy], [-hxy, -hyy], [0.0, 0.0]])
        turns = (turns - np.outer(n, n @ turns)) / size
        self.most_curved = max(self.most_curved, self.radius * float(np.linalg.norm(turns, 2)))
        return np.array([x, y, h]) + self.radius * n, n, turns

    def motion(self, t: float, s: np.ndarray) -> np.ndarray:
        """Return what the state changes by."""
        hx, hy = map(float, self._of(s[0], s[1])[1:3])
        _, n, turns = self.place(s[0], s[1])
        w = s[2:]
        velocity = self.radius * np.cross(w, n)
        tangents = np.array([[1.0, 0.0], [0.0, 1.0], [hx, hy]]) + self.radius * turns
        moved = np.linalg.lstsq(tangents, velocity, rcond=None)[0]
        pulled = self.radius * np.cross(w, turns @ moved) - self.gravity
        pulled -= n * (n @ pulled)
        force = self.mass * pulled / (1.0 + self.mass * self.radius**2 / self.inertia)
        return np.concatenate([moved, -self.radius / self.inertia * np.cross(n, force)])

    def end(self, s: np.ndarray) -> np.ndarray:
        """Return the centre and how it turns."""
        return np.concatenate([self.place(s[0], s[1])[0], s[2:]])

    def model(self) -> Model:
        """Return it as a model."""
        m = Model("ball", gravity=tuple(self.gravity))
        m.body("ball", mass=self.mass, inertia=(self.inertia,) * 3, com=(0, 0, 0))
        centre, n, _ = self.place(*self.start[:2])
        velocity = self.radius * np.cross(self.start[2:], n)
        m.joint(
            "free", type="free", child="ball", start=[*map(float, centre), 1, 0, 0, 0],
            rate=[*map(float, velocity), *map(float, self.start[2:])],
        )  # fmt: skip
        text = sympy.sstr(self.height).replace("x", "here_x").replace("y", "here_y").replace("**", "^")
        m.rolling("roll", body="ball", ball=self.radius, height=text)
        return m

    def found(self, run: Any) -> np.ndarray:
        """Return the run's end as `end` does: rates of a free body are about its own axes."""
        turned = _matrix(np.array([run[f"free_{k}"][-1] for k in ("qw", "qx", "qy", "qz")]))
        turning = turned @ np.array([run[f"free_w{k}"][-1] for k in "xyz"])
        return np.concatenate([[run[f"free_{k}"][-1] for k in "xyz"], turning])

    def in_bounds(self, s: np.ndarray) -> bool:
        """Whether the surface is never too curved for the ball."""
        return bool(np.isfinite(s).all() and self.most_curved < _MOST_CURVED)


class Wheel:
    """A thin wheel on the plane z = 0 under a gravity that leans; its state is centre, quaternion, turning [world]."""

    def __init__(self, r: np.random.Generator):
        self.radius, self.mass = _number(r, 0.1, 0.6), _number(r, 0.2, 5.0)
        across = self.mass * self.radius**2 * _number(r, 0.2, 0.3)
        self.inertia = np.array([across, across, across * _number(r, 1.6, 2.0)])
        self.gravity = np.array([_number(r, -2, 2), _number(r, -2, 2), -9.81])
        q = r.normal(size=4)
        q = np.array([np.cos(0.7), np.sin(0.7), 0.0, 0.0]) * 3.0 + 0.6 * q
        self.q = q / np.linalg.norm(q)
        self.turning = np.array([*r.normal(0.0, 1.0, 2), 0.0]) + _matrix(self.q)[:, 2] * float(
            r.normal(0.0, 12.0)
        )
        axis = _matrix(self.q)[:, 2]
        self.start = np.concatenate([[0.0, 0.0, -self._arm(axis)[2]], self.q, self.turning])
        self.least = 1.0

    def _arm(self, axis: np.ndarray) -> np.ndarray:
        down = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
        return -self.radius * down / np.linalg.norm(down)

    def motion(self, t: float, s: np.ndarray) -> np.ndarray:
        """Return what the state changes by."""
        q, w = s[3:7], s[7:]
        turned = _matrix(q)
        axis = turned[:, 2]
        down = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
        size = np.linalg.norm(down)
        self.least = min(self.least, float(size))
        arm = -self.radius * down / size
        moved = np.cross(w, axis)
        changed = -moved[2] * axis - axis[2] * moved
        of_arm = -self.radius * (changed - down * (down @ changed) / size**2) / size
        tensor = turned @ np.diag(self.inertia) @ turned.T
        left = tensor + self.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        right = -np.cross(w, tensor @ w) - self.mass * np.cross(arm, np.cross(w, of_arm) + self.gravity)
        a, b = q[0], q[1:]
        of_q = 0.5 * np.concatenate([[-w @ b], a * w + np.cross(w, b)])
        return np.concatenate([-np.cross(w, arm), of_q, np.linalg.solve(left, right)])

    def end(self, s: np.ndarray) -> np.ndarray:
        """Return the centre and how it turns."""
        return np.concatenate([s[:3], s[7:]])

    def model(self) -> Model:
        """Return it as a model."""
        m = Model("wheel", gravity=tuple(self.gravity))
        m.body("wheel", mass=self.mass, inertia=tuple(self.inertia), com=(0, 0, 0))
        turned = _matrix(self.q)
        velocity, own = -np.cross(self.turning, self._arm(turned[:, 2])), turned.T @ self.turning
        m.joint(
            "free", type="free", child="wheel", start=[*map(float, self.start[:7])],
            rate=[*map(float, velocity), *map(float, own)],
        )  # fmt: skip
        m.rolling("roll", body="wheel", wheel=self.radius)
        return m

    found = Ball.found

    def in_bounds(self, s: np.ndarray) -> bool:
        """Whether the wheel never lies down."""
        return bool(np.isfinite(s).all() and self.least > _FLAT)


def _matrix(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


KINDS = {"ball": Ball, "wheel": Wheel}


def roller(kind: str, number: int, method: str, form: str = "auto") -> Outcome:
    """Run what rolls, and judge its end."""
    r = np.random.default_rng([number, *kind.encode()])
    case, t_end = KINDS[kind](r), float(r.uniform(0.5, 4.0))
    told = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "dense_output": True}
    known = solve_ivp(case.motion, (0.0, t_end), case.start, **told)
    again = solve_ivp(case.motion, (0.0, t_end), case.start, **{**told, "rtol": 1e-9, "atol": 1e-11})
    if known.status < 0 or not case.in_bounds(known.y):
        return Outcome(RIGHT, "it lies down, or the surface is too curved for it")
    seen = np.array([case.end(s) for s in known.sol(np.linspace(0.0, t_end, 300)).T])
    truth, gone = case.end(known.y[:, -1]), np.ptp(seen, axis=0)
    ranges = np.repeat([gone[:3].max(), gone[3:].max()], 3)
    if (np.abs(truth - case.end(again.y[:, -1])) / ranges).max() > 1e-5:
        return Outcome(RIGHT, "the reference is lost")
    given = {"rtol": float(r.choice(_RTOLS))} if find_method(method).adaptive else {}
    run = attempt(made(case.model()), t_end, method=method, constraints=form, **given)
    if isinstance(run, Outcome):
        return run
    off = float((np.abs(case.found(run) - truth) / ranges).max())
    return judge_end(run, off, f"{kind}, {method}, {form}, {given}, to {t_end:.4g} s")


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each kind with each method and form."""
    for kind in KINDS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(roller, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(f"roller: {kind}", f"roller: {kind} {number}: {method}", run, method, short)
        for form, methods in FORMS.items():
            for k, method in enumerate(methods):
                run = functools.partial(roller, kind, 1000 + k, method, form)
                yield Scenario(f"roller: {kind}", f"roller: {kind}: {method} {form}", run, method, False)
