"""Four-bar loops that pass close to positions where their constraints depend on each other, against SciPy."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
from scipy.integrate import solve_ivp

from symgen.runtime import Solution

from .judging import attempt, end_error, flag, judge
from .random_models import loop
from .scenario import RIGHT, Outcome, Scenario

N_ALL, N_SHORT = 60, 3
_RTOLS = {
    "taylor": (1e-6, 1e-8, 1e-10),
    "dop853": (1e-6, 1e-8, 1e-10),
    "radau5": (1e-6, 1e-8),
    "gauss8": (1e-8,),
}
_T, _G = 0.5, 9.81
# An energy that is off by 1e4 rtol is nothing that a run has to flag; with the fixed step of gauss8, by 1e-3, or by
# what the run says of itself.
_ALLOWED, _SENSITIVE, _STEPS_IN_A_RUN = 1e-5, 1e4, 100.0
_FIXED_STEP = 1e-3
_DISTURBED = 1e-8  # of the first rate
_TRIES = 200
_FLAT = ("parallelogram", "kite", "folded")


class Bars:
    """A plane chain of three bars between two points: how it moves along the one curve that its lengths allow.

    The curve is smooth where bars are nearly in line, but bends sharply; there are no multipliers in its equations.

    Parameters
    ----------
    masses, lengths : ndarray, shape (3,) [kg], [m]
    """

    def __init__(self, masses: np.ndarray, lengths: np.ndarray):
        self.masses, self.lengths = masses, lengths

    def mass_and_potential(self, angles: np.ndarray, tangent: np.ndarray) -> tuple[complex, complex]:
        """Return twice the kinetic energy at unit speed along `tangent`, and the potential energy; also for complex."""
        moved, height, twice, potential = np.zeros(2, dtype=angles.dtype), 0.0, 0.0, 0.0
        for m, l, a, rate in zip(self.masses, self.lengths, angles, tangent, strict=True):
            turn = l * rate * np.array([-np.sin(a), np.cos(a)])
            middle = moved + 0.5 * turn
            twice = twice + m * (middle @ middle) + m * l**2 / 12.0 * rate**2
            potential = potential + m * _G * (height + 0.5 * l * np.sin(a))
            moved, height = moved + turn, height + l * np.sin(a)
        return twice, potential

    def tangent(self, angles: np.ndarray) -> np.ndarray:
        """Return the rates that the constraints allow, of unit length."""
        across = np.cross(-self.lengths * np.sin(angles), self.lengths * np.cos(angles))
        return across / np.sqrt(across @ across)

    def derivative(self, t: float, state: np.ndarray) -> np.ndarray:
        """Return that of the angles and of the speed along the curve; complex steps give derivatives along it."""
        angles, speed, step = state[:3], state[3], 1e-30
        along = self.tangent(angles)
        ahead = angles + 1j * step * along
        mass, potential = self.mass_and_potential(ahead, self.tangent(ahead))
        change = -(0.5 * mass.imag * speed**2 + potential.imag) / step / mass.real
        return np.append(along * speed, change)

    def end(self, angles: np.ndarray, rate: float) -> np.ndarray:
        """Return angles and rates at the end of a run that begins with this rate of the first bar."""
        start = np.append(angles, rate / self.tangent(angles)[0])
        state = solve_ivp(self.derivative, (0.0, _T), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        return np.append(state[:3], self.tangent(state[:3]) * state[3])


def draw(index: int) -> tuple[Bars, dict]:
    """Return bars and the arguments of their run: lengths are 1e-8 to 1e-3 off those that would fold flat."""
    rng = np.random.default_rng([index, 7])
    while (found := _drawn(index, rng)) is None:
        pass
    return found


def _drawn(index: int, rng: np.random.Generator) -> tuple[Bars, dict] | None:
    """Return the next bars and their run; None where they close in hardly any position but a flat one."""
    kind, off = _FLAT[index % len(_FLAT)], 10.0 ** rng.uniform(-8, -3)
    a, b = rng.uniform(0.3, 1.0, 2)
    if kind == "folded":
        lengths = rng.uniform(0.3, 1.0, 3)
        ground = abs(lengths @ rng.choice([[1, 1, -1], [1, -1, 1], [-1, 1, 1]]))
    else:
        lengths = np.array([a, b, a] if kind == "parallelogram" else [a, b, b])
        ground = b if kind == "parallelogram" else a
    lengths = lengths * (1.0 + off * rng.normal(size=3))
    masses = 10.0 ** rng.uniform(-2, 1, 3)
    angles = _closed(lengths, ground, rng)
    if angles is None:
        return None
    values = {"px": float(ground), "py": 0.0, "c": 0.0}
    for k in range(3):
        values |= {f"m{k}": float(masses[k]), f"l{k}": float(lengths[k])}
    start = {f"a{k}": float(angles[k]) for k in range(3)}
    rate = float(rng.choice([-1.0, 1.0]) * rng.uniform(4, 12))
    return Bars(masses, lengths), {"parameters": values, "start": start, "rate": {"a0": rate}}


def _closed(lengths: np.ndarray, ground: float, rng: np.random.Generator) -> np.ndarray | None:
    """Return the angles of three bars that close the loop, with the first at a random one that lets them."""
    for _ in range(_TRIES):
        first = rng.uniform(-np.pi, np.pi)
        left = ground - lengths[0] * np.exp(1j * first)
        cosine = (lengths[1] ** 2 + abs(left) ** 2 - lengths[2] ** 2) / (2 * lengths[1] * abs(left))
        if abs(cosine) < 0.95:
            second = np.angle(left) + rng.choice([-1.0, 1.0]) * np.arccos(cosine)
            return np.array([first, second, np.angle(left - lengths[1] * np.exp(1j * second))])
    return None


def near_singular(index: int, method: str) -> Outcome:
    """Run a four-bar at every tolerance; one that is wrong decides, else one that is flagged."""
    bars, given = draw(index)
    angles, rate = np.array(list(given["start"].values())), given["rate"]["a0"]
    exact, beside = bars.end(angles, rate), bars.end(angles, rate * (1.0 + _DISTURBED))
    outcome = Outcome(RIGHT, "")
    for rtol in _RTOLS[method]:
        run = attempt(loop(3, False), _T, method=method, rtol=rtol, atol=1e-2 * rtol, **given)
        if (bad := flag(run)) is not None:
            outcome = bad
            continue
        error = end_error(exact[:3], exact[3:])
        scale = np.repeat([np.abs(run.q).max(), np.abs(run.v).max()], 3)
        grows = np.abs((beside - exact) / scale).max() / _DISTURBED
        least = max(_FIXED_STEP, stated(run)) if method == "gauss8" else _ALLOWED
        found = judge(run, error, max(least, rtol * max(_SENSITIVE, _STEPS_IN_A_RUN * grows)))
        if found.verdict != RIGHT:
            return Outcome(found.verdict, f"at {rtol:.0e}: {found.says}")
    return outcome


def stated(run: Solution) -> float:
    """Return how far a run says that it is off: with a fixed step nothing else was promised."""
    return max((entry.value for entry in run.health if entry.check == "accuracy"), default=0.0)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for method in _RTOLS:
        for index in range(N_ALL):
            run = functools.partial(near_singular, index, method)
            name = f"nearly flat four-bar {index}: {method}"
            short = index < N_SHORT and method == "taylor"
            yield Scenario("near singular", name, run, method, short)
