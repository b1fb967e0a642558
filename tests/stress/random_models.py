"""Random trees and loops: each keeps its energy balance and its constraints, and two methods agree on its end."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterator

import numpy as np

from symgen import Model, cos, dot, sin
from symgen.runtime import System

from .judging import attempt, end_error, flag
from .models import made
from .scenario import FLAGGED, RIGHT, WRONG, Outcome, Scenario

N_ALL = int(os.environ.get("SYMGEN_STRESS_MODELS", "10000"))
N_SHORT = 40
_DRAWS = 20  # starts and parameters of one structure
_T = 1.0
_ALLOWED, _SENSITIVE = 1e-5, 1e3
_RTOLS_OF_GROWTH = (3e-12, 1e-11, 3e-11)
JOINTS = ("revolute", "prismatic", "continuous", "universal", "cylindrical", "planar", "spherical", "free")


@functools.lru_cache(maxsize=4)
def tree(seed: int) -> System:
    """Return a tree of two to five bodies on random joints, with damping and springs in some."""
    rng = np.random.default_rng(seed)
    model = Model("random_tree", gravity=rng.normal(0.0, 5.0, 3).tolist())
    names = ["world"]
    for k in range(int(rng.integers(2, 6))):
        masses, places = rng.uniform(0.2, 1.0, 6), rng.normal(0.0, 0.2, (6, 3))
        com = masses @ places / masses.sum()
        r = places - com
        tensor = np.einsum(
            "k,kij->ij",
            masses,
            np.einsum("k,ij->kij", (r * r).sum(1), np.eye(3)) - r[:, :, None] * r[:, None],
        )
        inertia = [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        model.body(f"b{k}", mass=float(masses.sum()), com=com.tolist(), inertia=inertia)
        kind = str(rng.choice(JOINTS))
        given = (
            {"axis": rng.normal(size=3).tolist()}
            if kind in ("revolute", "prismatic", "continuous", "cylindrical", "planar")
            else {}
        )
        if kind == "prismatic":
            given["stiffness"] = float(rng.uniform(5.0, 50.0))
        if rng.random() < 0.4:
            given["damping"] = float(rng.uniform(0.01, 0.5))
        origin = {"xyz": rng.normal(0.0, 0.3, 3).tolist(), "rpy": rng.uniform(-3, 3, 3).tolist()}
        model.joint(f"j{k}", kind, f"b{k}", names[int(rng.integers(len(names)))], origin, **given)
        names.append(f"b{k}")
    return made(model)


@functools.cache
def loop(n: int, damped: bool) -> System:
    """Return a plane chain of n bars between two fixed points, a loop with the ground; lengths are parameters."""
    model = Model("random_loop", gravity=(0, "-9.81 m/s^2"))
    px, py, c = model.parameters(px=1.0, py=0.0, c=0.0)
    x, y, bars = 0, 0, []
    for k in range(n):
        m, l = model.parameters(**{f"m{k}": 1.0, f"l{k}": 1.0})
        a = model.coordinate(f"a{k}", guess=0.0)
        model.body(
            f"bar{k}", mass=m, inertia=m * l**2 / 12, com=(x + l / 2 * cos(a), y + l / 2 * sin(a)), angle=a
        )
        x, y = x + l * cos(a), y + l * sin(a)
        bars.append(a)
    if damped:
        for a in bars:
            model.force(a, -c * dot(a))
    model.constraint("end_x", x - px)
    model.constraint("end_y", y - py)
    return made(model)


def draw(index: int) -> tuple[System, dict]:
    """Return the model of an index, and the arguments of its run."""
    rng = np.random.default_rng([index, 1])
    if index % 2:
        n, damped = 3 + (index // 2) % 4, bool((index // 8) % 2)
        system = loop(n, damped)
        lengths, angles = rng.uniform(0.3, 1.0, n), rng.uniform(-np.pi, np.pi, n)
        parameters = {
            "px": float(lengths @ np.cos(angles)),
            "py": float(lengths @ np.sin(angles)),
            "c": float(rng.uniform(0, 0.3)),
        }
        for k in range(n):
            parameters |= {f"m{k}": float(10.0 ** rng.uniform(-2, 1)), f"l{k}": float(lengths[k])}
        return system, {
            "parameters": parameters,
            "start": {f"a{k}": float(angles[k]) for k in range(n)},
            "rate": {"a0": float(rng.normal(0, 2))},
        }
    system = tree(index // (2 * _DRAWS))
    start = {
        c["name"]: float(rng.normal(0, 0.7))
        for c in system.coordinates
        if not _in_quaternion(system, c["name"])
    }
    names = [r["name"] for r in system.rates]
    return system, {"start": start, "rate": {name: float(rng.normal(0, 1.5)) for name in names}}


def _in_quaternion(system: System, name: str) -> bool:
    names = [c["name"] for c in system.coordinates]
    return any(place <= names.index(name) < place + 4 for place in system.quaternions)


def random_model(index: int) -> Outcome:
    """Run a random model with `auto` and with another method, both of them checked."""
    system, given = draw(index)
    run = attempt(system, _T, rtol=1e-8, atol=1e-10, **given)
    if flag(run) is not None:
        return flag(run)
    if run.energy.max_error > 1e-5:
        return Outcome(WRONG, f"energy off by {run.energy.max_error:.1e}")
    other_method = "radau9" if index % 3 else "dopri5"
    other = attempt(system, _T, method=other_method, rtol=1e-10, atol=1e-12, **given)
    if flag(other) is not None:
        return Outcome(FLAGGED, f"{other_method}: {flag(other).says}")
    error = end_error(other.q[-1], other.v[-1])(run)
    if error <= _ALLOWED:
        return Outcome(RIGHT, f"{run.method} and {other.method} differ by {error:.1e}")
    # A motion that multiplies every error does so with these too; one of them alone may end near by accident.
    tight = attempt(system, _T, method="dop853", rtol=1e-13, atol=1e-14, **given)
    again = [attempt(system, _T, method="dop853", rtol=r, atol=0.1 * r, **given) for r in _RTOLS_OF_GROWTH]
    bad = [flag(each) for each in (tight, *again) if flag(each) is not None]
    if bad:
        return Outcome(WRONG, f"{run.method} and {other.method} differ by {error:.1e}; {bad[0]}")
    best = end_error(tight.q[-1], tight.v[-1])
    grows = max(best(each) / rtol for each, rtol in zip(again, _RTOLS_OF_GROWTH, strict=True))
    good = max(best(run) / 1e-8, best(other) / 1e-10) <= max(_SENSITIVE, 30.0 * grows)
    says = f"errors {best(run):.1e}, {best(other):.1e}; the motion makes {grows:.1e} of a tolerance of 1"
    return Outcome(RIGHT if good else WRONG, says)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for index in range(N_ALL):
        kind = "random loop" if index % 2 else "random tree"
        yield Scenario(
            kind, f"random model {index}", functools.partial(random_model, index), short=index < N_SHORT
        )
