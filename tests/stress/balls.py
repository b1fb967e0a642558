"""Rows of balls that touch or nearly touch, against a solution blow by blow: `python -m tests.stress.balls`.

Balls on a line, or in a stack that falls on a floor, of unequal masses, with gaps of 1e-12 to 1e-3 or none,
restitutions from 1 to 0, and both laws of impacts. The reference keeps gaps as its variables, so that small ones lose
no digits, and goes from blow to blow; the law of simultaneous impacts is solved by trying every set of impulses. What
hangs on the last digits of gaps, or on whether a gap below 1e-12 of the places is one, is left out, and counted: the
reference finds it by going again with such gaps.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import math
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from .impacts import row
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG

LEFT_OUT = "left out"
LAWS = ("simultaneous", "sequential")
RESTITUTIONS = (1.0, 1.0, 0.999, 0.9, 0.7, 0.5, 0.0)
_GAPS = (0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6, 1e-3)
_MOST_BLOWS = 400
_G = 9.81
_EPS = float(np.finfo(float).eps)
_ROUNDED = 16.0 * _EPS  # of places: gaps that are as good as none
_PROMISED = 0.9e-12  # of places: larger ones pass blows on one by one
_OFF = 1e-5  # of the fastest ball
_COPIES = 3  # of the reference, with gaps off by their last digits


@functools.cache
def model(n: int, law: str, *, floor: bool) -> runtime.System:
    """Return n balls of unit diameter, with a floor or without, and parameters for their masses and restitutions."""
    m = Model(f"balls_{n}", impacts=law, **({"gravity": (0, -_G)} if floor else {}))
    x = [m.coordinate(f"x{k}", start=1.5 * k + 0.5) for k in range(n)]
    for k in range(n):
        m.body(f"ball{k}", mass=m.parameter(f"m{k}", 1.0), com=(0, x[k]) if floor else (x[k], 0))
    if floor:
        m.stop("floor", x[0] - 0.5, m.parameter("e_floor", 1.0))
    for k in range(n - 1):
        m.stop(f"s{k}", x[k + 1] - x[k] - 1.0, m.parameter(f"e{k}", 1.0))
    return runtime.load(derive_text(m).text)


@dataclass
class Row:
    """Balls between blows.

    Attributes
    ----------
    gaps : ndarray
        Of each contact, a floor's first where there is one.
    v : ndarray [m/s]
        Upwards.
    masses : ndarray
    restitutions : ndarray
        Of each contact.
    floor : bool
    law : str
    touches : float
        Gaps below this are none.
    """

    gaps: np.ndarray
    v: np.ndarray
    masses: np.ndarray
    restitutions: np.ndarray
    floor: bool
    law: str
    touches: float

    def rates(self) -> np.ndarray:
        """Of the gaps."""
        return np.diff(np.concatenate([[0.0], self.v])) if self.floor else np.diff(self.v)

    def compliance(self) -> np.ndarray:
        """What unit impulses in the contacts change the rates of the gaps by."""
        n = len(self.v)
        w = np.eye(n) - np.eye(n, k=-1)
        w = w if self.floor else w[1:]
        return w @ np.diag(1.0 / self.masses) @ w.T

    def next_blow(self) -> float:
        """Return how long it is to the next one."""
        times = [math.inf]
        for k, (gap, rate) in enumerate(zip(self.gaps, self.rates(), strict=True)):
            if self.floor and k == 0:
                times.append((rate + math.sqrt(rate * rate + 2.0 * _G * max(gap, 0.0))) / _G)
            elif rate < -1e-9 * np.abs(self.v).max():
                times.append(max(gap, 0.0) / -rate)
        return min(times)

    def go(self, s: float) -> None:
        """Fly for a time."""
        self.gaps = self.gaps + self.rates() * s
        if self.floor:
            self.gaps[0] -= 0.5 * _G * s * s
            self.v = self.v - _G * s

    def strike(self) -> None:
        """Let all that touches and closes strike."""
        touching = self.gaps <= self.touches
        self.gaps = np.where(touching, 0.0, self.gaps)
        law = simultaneous if self.law == "simultaneous" else one_by_one
        impulses = law(self.compliance(), self.rates(), touching, self.restitutions)
        forces = impulses if self.floor else np.concatenate([[0.0], impulses])
        self.v = self.v + (forces - np.append(forces[1:], 0.0)) / self.masses


def simultaneous(a: np.ndarray, u: np.ndarray, touching: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return impulses x >= 0 with u + a x + e u >= 0, zero where x > 0, by trying every set of them."""
    which = np.flatnonzero(touching)
    best, least = np.zeros(len(u)), -math.inf
    for size in range(len(which) + 1):
        for chosen in itertools.combinations(which, size):
            some = list(chosen)
            x = np.zeros(len(u))
            if some:
                x[some] = np.linalg.solve(a[np.ix_(some, some)], -(1.0 + e[some]) * u[some])
            left = (u * (1.0 + e) + a @ x)[which]
            worst = min(x.min(initial=0.0), left.min(initial=0.0))
            if worst > least:
                best, least = x, worst
            if worst > -1e-12 * np.abs(u).max():
                return x
    return best


def one_by_one(a: np.ndarray, u: np.ndarray, touching: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return the impulses of blows one after another, the fastest first."""
    x, now, slow = np.zeros(len(u)), u.copy(), 1e-12 * np.abs(u).max()
    for _ in range(_MOST_BLOWS):
        k = int(np.argmin(np.where(touching, now, 0.0)))
        if not touching[k] or now[k] >= -slow:
            return x
        x[k] -= (1.0 + e[k]) * now[k] / a[k, k]
        now = u + a @ x
    raise EndlessError


class EndlessError(Exception):
    """Blows without an end."""


def settle(row: Row, t_end: float, off: Callable[[int], np.ndarray | float]) -> np.ndarray:
    """Return the speeds at the end; `off(n)` is by how much gaps are off after each flight.

    Raises
    ------
    EndlessError
    """
    t = 0.0
    for _ in range(_MOST_BLOWS):
        s = row.next_blow()
        if t + s >= t_end:
            row.go(t_end - t)
            return row.v
        row.go(s)
        row.gaps = np.maximum(row.gaps + np.where(row.gaps > row.touches, off(len(row.gaps)), 0.0), 0.0)
        t += s
        row.strike()
        if row.floor and row.gaps[0] == 0.0 and row.v[0] < 1e-3:
            raise EndlessError  # it comes to rest
    raise EndlessError


@dataclass
class Case:
    """Balls, where they are, and how long they fly."""

    n: int
    floor: bool
    law: str
    x: np.ndarray
    v: np.ndarray
    masses: np.ndarray
    e: np.ndarray
    t_end: float

    def row(self, touching: float = _ROUNDED) -> Row:
        """Return the reference's state at the start; gaps below `touching` of the places are none in blows."""
        gaps = np.diff(self.x) - 1.0
        gaps = np.concatenate([[self.x[0] - 0.5], gaps]) if self.floor else gaps
        size = max(1.0, float(np.abs(self.x).max()))
        gaps = np.where(gaps <= _ROUNDED * size, 0.0, gaps)
        return Row(gaps, self.v.copy(), self.masses, self.e, self.floor, self.law, touching * size)

    def end(self, random: np.random.Generator) -> np.ndarray | None:
        """Return the speeds at the end, None where these hang on the last digits of gaps or blows have no end."""
        try:
            exact = settle(self.row(), self.t_end, lambda n: 0.0)
            size = np.abs([*exact, *self.v]).max()
            last = 4.0 * _EPS * max(1.0, float(np.abs(self.x).max()) + self.t_end * size)
            others = [settle(self.row(_PROMISED), self.t_end, lambda n: 0.0)]
            for _ in range(_COPIES):
                others.append(settle(self.row(), self.t_end, lambda n: last * random.normal(size=n)))
            if np.abs(np.array(others) - exact).max() > 0.1 * _OFF * size:
                return None
        except EndlessError:
            return None
        return exact


def draw(random: np.random.Generator) -> Case:
    """Draw a case."""
    n, floor, law = int(random.integers(2, 7)), bool(random.random() < 0.3), str(random.choice(LAWS))
    same_gap = random.random() < 0.5
    gap = [float(g) for g in random.choice(_GAPS, size=n)]
    gap = [gap[0]] * n if same_gap else gap
    place = 0.5 + float(random.choice([0.0, 0.0, random.uniform(0.1, 3.0), 100.0]))
    place = place + 0.5 if floor else place
    # What is promised: gaps of 1e-12 of the places.
    gap = [g * max(1.0, place + n) if g else 0.0 for g in gap]
    x = place + np.concatenate([[0.0], np.cumsum(1.0 + np.array(gap[: n - 1]))])
    masses = np.ones(n) if random.random() < 0.4 else 10.0 ** random.uniform(-1.5, 1.5, size=n)
    v = np.zeros(n)
    struck_by = int(random.integers(1, n))
    how = random.integers(4)
    if how == 0:
        v[:struck_by] = 1.0
    elif how == 1:
        v[0], v[-1] = 1.0, -float(random.choice([1.0, 0.5]))
    elif how == 2:
        v = random.normal(size=n)
    else:
        v[int(random.integers(n))] = float(random.choice([-1.0, 1.0]))
    if floor:
        v = v * float(random.choice([0.0, 0.0, 0.1]))
    contacts = n if floor else n - 1
    e = (
        random.choice(RESTITUTIONS, size=contacts)
        if random.random() < 0.5
        else np.full(contacts, random.choice(RESTITUTIONS))
    )
    e = np.maximum(e, 0.5) if floor else e
    t_end = 1.0
    if floor:
        t_end = math.sqrt(2.0 * (x[0] - 0.5) / _G) * float(random.uniform(1.01, 1.4))
    return Case(n, floor, law, x, v, masses, np.asarray(e, dtype=float), t_end)


def judge(case: Case, method: str, random: np.random.Generator) -> tuple[str, str]:
    """Run a case and return verdict and reason."""
    expected = case.end(random)
    if expected is None:
        return LEFT_OUT, ""
    names = [f"m{k}" for k in range(case.n)]
    contacts = [*(["e_floor"] if case.floor else []), *(f"e{k}" for k in range(case.n - 1))]
    values = dict(zip([*names, *contacts], [*case.masses, *case.e], strict=True))
    places = {f"x{k}": float(x) for k, x in enumerate(case.x)}
    rates = {f"x{k}": float(v) for k, v in enumerate(case.v)}
    step = None if METHODS[method].adaptive else case.t_end / 37.0
    try:
        run = solve(
            model(case.n, case.law, floor=case.floor), case.t_end, method=method, step=step, parameters=values,
            start=places, rate=rates, max_steps=100_000,
        )  # fmt: skip
    except RuntimeModelError as error:
        return REFUSED, str(error)
    size = np.abs([*expected, *case.v]).max()
    off = float(np.abs(run.v[-1] - expected).max() / size) if run.t[-1] == case.t_end else math.inf
    if not run.ok:
        return FLAGGED, run.message or "; ".join(check.check for check in run.objections)
    allowed = _OFF if METHODS[method].order > 1 or not case.floor else 0.2
    return (RIGHT, "") if off <= allowed else (WRONG, f"{run.v[-1]}, not {expected}: {case}")


def try_many(method: str, count: int, seed: int, show: int = 0) -> Counter[str]:
    """Try cases with one method; returns how many had each verdict."""
    counts: Counter[str] = Counter()
    for number in range(count):
        random = np.random.default_rng([seed, number])
        verdict, why = judge(draw(random), method, random)
        counts[verdict] += 1
        if verdict == WRONG or (verdict in (FLAGGED, REFUSED) and counts[verdict] <= show):
            print(f"{verdict} {method} number {number}: {why}", file=sys.stderr)
    return counts


def main() -> int:
    """Run as a command."""
    parser = argparse.ArgumentParser(prog="python -m tests.stress.balls", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="cases for each method (1000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--methods", nargs="*", default=list(METHODS))
    parser.add_argument(
        "--show", type=int, default=3, help="flagged and refused cases to show of each method"
    )
    chosen = parser.parse_args()
    print("| method | tried | right | refused | flagged | wrong | left out |\n|---|---|---|---|---|---|---|")
    total: Counter[str] = Counter()
    for method in chosen.methods:
        counts = try_many(method, chosen.count, chosen.seed, chosen.show)
        total += counts
        print(f"{row(method, counts)} {counts[LEFT_OUT]} |", flush=True)
    print(f"{row('all', total)} {total[LEFT_OUT]} |")
    return int(total[WRONG] > 0)


if __name__ == "__main__":
    sys.exit(main())
