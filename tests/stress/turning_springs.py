"""Masses on chains of very stiff, damped springs that turn: the motion of a chain of rods, for the implicit methods.

What keeps their steps short is not the error: a spring of stiffness k that turns within a step acts across the
direction that Newton's matrix knows. `taylor`, whose steps are as short as the vibrations, gives the ends.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np

from symgen import Model
from symgen.runtime import System

from .judging import attempt, judge_end
from .models import made
from .scenario import Outcome, Scenario

METHODS = ("radau5", "radau9", "radau13", "bdf", "auto")
N_ALL, N_SHORT = 60, 10
_T = 1.0


@functools.lru_cache(maxsize=4)
def chain(seed: int) -> System:
    """Return one to three masses, each on a spring from the one before, in the plane or in space."""
    rng = np.random.default_rng(seed)
    n_axes, n = int(rng.choice([2, 3])), int(rng.integers(1, 4))
    model = Model("turning_springs", gravity=(0, "-9.81 m/s^2"))
    hung, place = (0,) * n_axes, np.zeros(n_axes)
    for k in range(n):
        mass, length = float(rng.uniform(0.5, 2.0)), float(rng.uniform(0.3, 1.0))
        stiffness = float(10.0 ** rng.uniform(5.0, 8.0))
        direction = rng.normal(size=n_axes)
        place = place + length * direction / np.linalg.norm(direction)
        bob = tuple(
            model.coordinate(f"{axis}{k}", start=float(place[i])) for i, axis in enumerate("xyz"[:n_axes])
        )
        model.body(f"bob{k}", mass=mass, com=bob)
        damping = float(rng.uniform(0.2, 1.0)) * 2.0 * math.sqrt(stiffness * mass)
        model.spring(
            f"spring{k}", points=[hung, bob], stiffness=stiffness, length=length, damping=damping
        )  # fmt: skip
        hung = bob
    return made(model)


@functools.lru_cache(maxsize=4)
def end(seed: int) -> np.ndarray:
    """Return the end by series, at a tolerance of 1e-12."""
    run = chain(seed).run(t_end=_T, method="taylor", rtol=1e-12, atol=1e-14, max_steps=5_000_000)
    return np.concatenate([run.q[-1], run.v[-1]])


def turned(seed: int) -> Outcome:
    """A chain by one method and tolerance, against its end by series."""
    rng = np.random.default_rng(seed + 10_000)
    method, rtol = str(rng.choice(METHODS)), float(10.0 ** rng.uniform(-10.0, -4.0))
    run = attempt(chain(seed), _T, method=method, rtol=rtol, atol=rtol * 1e-2)
    if isinstance(run, Outcome):
        return run
    found, expected = np.concatenate([run.q[-1], run.v[-1]]), end(seed)
    off = float(np.abs(found - expected).max() / np.abs(expected).max())
    return judge_end(run, off, f"{method} at rtol {rtol:.0e}")


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for seed in range(N_ALL):
        yield Scenario("turning", f"springs {seed}", functools.partial(turned, seed), short=seed < N_SHORT)
