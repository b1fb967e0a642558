"""Stiffness that an explicit method of adaptive step has met: its steps follow what died out long ago."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.entry import HealthCheck, noted
from symgen.runtime.checks.time_scales import TimeScales, time_scales_at
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

mode_origin = Late("symgen.runtime.checks.mode_origin")

_MANY_STEPS = 5000
_STATES = 5
_LARGEST = 200  # rates
_DIES_OUT = 100.0  # decays in the run: what such a motion does is over for most of it
_AT_THE_LIMIT = 0.5  # h |lambda| of what died out: accuracy alone lets it grow on
_MOST_PER_RADIAN = 100.0  # steps per radian of what is left; accuracy asks for about one
_MOST_AT_LIMIT = 0.5  # of the states looked at


def stiffness(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield one entry for runs of many steps: which part of them is as short as motions demand that died out."""
    system = solution.system
    # What `auto` took was the least evil.
    if method.growth is None or any(note.startswith("method auto") for note in solution.notes):
        return
    if system.nv > _LARGEST or solution.stats["steps"] < _MANY_STEPS:
        return
    if not len(solution.step_log) or solution.forms is not None:
        return
    inner = np.linspace(0, len(solution.t) - 1, _STATES + 2).astype(int)[1:-1]
    # One state in the middle tells whether to look at others.
    if not _Found(solution, inner[len(inner) // 2 :][:1]).limited[0]:
        yield HealthCheck(
            "stiffness", True, 0.0, _MOST_AT_LIMIT, "accuracy, not what died out, limits the steps"
        )
        return
    rows = np.unique(inner)
    seen = _Found(solution, rows)
    dead, alive, limited = seen.dead, seen.alive, seen.limited
    share = float(np.mean(limited))
    found = f"motions that died out limit {share:.0%} of the steps"
    if share <= _MOST_AT_LIMIT:
        yield HealthCheck("stiffness", True, share, _MOST_AT_LIMIT, found)
        return
    which = int(np.argmax(limited))
    i = rows[which]
    origin = mode_origin.fastest_origin(system, solution.p, solution.t[i], solution.q[i], solution.v[i])
    says = (
        f"{found}: {dead[which]:.3g} 1/s, {dead[which] / alive[which]:.2g} times as fast as what is left "
        f"({origin.says() if origin else 'of the model'}); steps of {solution.method} are at the limit of stability, "
        "where error estimates are worth little; take radau5 or --method auto"
    )
    yield noted("stiffness", share, _MOST_AT_LIMIT, says)


class _Found:
    """Rates of what died out and of what is left at some frames, and whether the former limit the steps there."""

    def __init__(self, solution: Solution, rows: np.ndarray):
        span = float(solution.t[-1] - solution.t[0])
        scales = time_scales_at(
            solution.system, solution.p, solution.t[rows], solution.q[rows], solution.v[rows]
        )
        steps = np.array([_step_at(solution, solution.t[i]) for i in rows])
        self.dead, self.alive = np.array([_fastest_dead_and_alive(scale, span) for scale in scales]).T
        self.limited = (steps * self.dead > _AT_THE_LIMIT) & (steps * self.alive < 1.0 / _MOST_PER_RADIAN)


def _fastest_dead_and_alive(scales: TimeScales, span: float) -> tuple[float, float]:
    """Return the fastest rate of motions that die out, and of what is left to follow [1/s]."""
    values = scales.eigenvalues
    dies = -values.real * span > _DIES_OUT
    dead = np.abs(values[dies]).max(initial=0.0)
    # Slow decays are followed to their end, too.
    alive = max(np.abs(values[~dies]).max(initial=0.0), scales.turning, 1.0 / span)
    return float(dead), float(alive)


def _step_at(solution: Solution, t: float) -> float:
    log = solution.step_log
    k = int(np.clip(np.searchsorted(log[:, 0], t), 0, len(log) - 1))
    return float(np.median(log[max(0, k - 5) : k + 6, 1]))
