"""Whether any gap of a stop fell below zero: at the ends of all steps, and at every state that is kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck, limited

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_TOLERANCES = 10.0  # of the run, in a gap
_ROUND_OFF = 1e-13  # of the coordinates' sizes
_STEP = 1e-6  # of the coordinates' sizes, for derivatives of gaps


def stops(solution: Solution) -> HealthCheck:
    """Return an entry on the gap that was furthest below zero, in parts of what the tolerances of the run allow it."""
    system = solution.system
    names = [switch["name"] for switch in system.switches if switch["kind"] == "stop"]
    t, states = _kept_states(solution)
    gaps = _gaps(solution, len(names), t, states)
    lowest, when = gaps.min(axis=0), t[np.argmin(gaps, axis=0)]
    if solution.lowest_gaps is not None:
        when = np.where(solution.lowest_gaps < lowest, np.nan, when)
        lowest = np.minimum(lowest, solution.lowest_gaps)
    allowed = _allowed(solution, len(names), t, states, gaps)
    worst = int(np.argmax(-lowest / allowed))
    depth, limit = max(0.0, -float(lowest[worst])), float(allowed[worst])
    place = "inside the run" if np.isnan(when[worst]) else f"at t = {when[worst]:.6g} s"
    found = f"gap of stop {names[worst]!r} falls to {lowest[worst]:.3g} {place}"
    objection = (
        f"{found}, more than {limit:.2g} below zero: its impact was passed by; take a smaller rtol or step, and please "
        "report this model"
    )
    fine = found if depth > 0.0 else "no gap of a stop falls below zero"
    return limited("stops", depth, limit, fine, objection)


def _kept_states(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Return times and states of frames, of samples, and before events.

    Of those of one instant before the first: what a reset leaves a hair inside of a stop, the next brings out of it.
    """
    times, rows = [s.t for s in solution.samples], [np.concatenate([s.q, s.v]) for s in solution.samples]
    last = None
    for event in solution.events:
        if event.t != last:
            times.append(event.t)
            rows.append(np.concatenate([event.q_before, event.v_before]))
        last = event.t
    if not rows:
        return solution.t, solution.states
    return np.concatenate([solution.t, times]), np.vstack([solution.states, rows])


def _gaps(solution: Solution, n: int, t: np.ndarray, states: np.ndarray) -> np.ndarray:
    return evaluate(solution.system, "switches", solution.p, t, np.ascontiguousarray(states))[:, : 2 * n : 2]


def _allowed(solution: Solution, n: int, t: np.ndarray, states: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """Return how far below zero each gap may be: the tolerances of coordinates, as its derivatives weigh them."""
    system, nq = solution.system, solution.system.nq
    sizes = np.maximum(1.0, np.abs(states[:, :nq]).max(axis=0))
    if system.m:  # errors of others come to a coordinate by constraints
        sizes[:] = sizes.max()
    own = _TOLERANCES * (solution.atol + solution.rtol * sizes) + _ROUND_OFF * sizes
    allowed = np.zeros(n)
    for stop in range(n):
        row = int(np.argmin(gaps[:, stop]))
        moved = np.repeat(states[row : row + 1], nq, axis=0)
        moved[:, :nq] += _STEP * sizes * np.eye(nq)
        rises = _gaps(solution, n, np.full(nq, t[row]), moved)[:, stop] - gaps[row, stop]
        allowed[stop] = (own * np.abs(rises) / (_STEP * sizes)).sum()
    return np.where(allowed > 0.0, allowed, own.max())
