"""Events that a run passed by: their functions at the frames and between them, against the events that fired.

What happens between frames is seen by the looks that each step takes at a random place of its own, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck
from symgen.runtime.event_actions import event_times
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import DIRECTIONS
from symgen.runtime.options import SAME_TICKS, time_resolution

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

# Interval arithmetic: for models with events of their own.
hidden = Late("symgen.runtime.checks.hidden_crossings")

_BETWEEN = 4  # places in an interval between frames
_ROUND_OFF = 1e-7  # of an event function's range: dips below count as touching
_MOST_NUMBERS = 2_000_000


def missed_events(solution: Solution) -> Iterator[HealthCheck]:
    """Yield one entry: crossings in an event's direction at which the event did not fire."""
    system = solution.system
    # Without a log of steps it is a recording, whose events are kept elsewhere.
    if len(solution.t) < 3 or not len(solution.step_log):
        return
    t, states = _between_frames(solution)
    t = _without_the_end(t)
    values = evaluate(system, "events", solution.p, t, states)
    fired = event_times(solution.events)
    quiet = _without_events(t, fired)
    missed = []
    own = [e for e, event in enumerate(system.events) if event["action"] not in ("stop", "friction", "jump")]
    for e in own:
        event = system.events[e]
        g, direction = values[:, e], DIRECTIONS[event["direction"]]
        floor = _ROUND_OFF * np.ptp(g) if np.isfinite(g).all() else np.inf
        alone = [float(t[k]) for k in _crossings(g, floor, direction) if quiet[k]]
        times = alone or _on_the_wrong_side(solution, e, direction, floor)
        missed += [(when, event["name"]) for when in times]
    if not missed and own:
        missed = [(when, system.events[e]["name"]) for when, e in hidden.hidden_crossings(solution, own)]
    found = f"{len(solution.events)} events fired, none was passed by"
    count = max(len(missed), sum(n for _, n, _ in solution.passed_by))
    missed += [(when, name) for name, _, when in solution.passed_by]
    if not missed:
        yield HealthCheck("missed events", True, 0.0, 0.0, found)
        return
    when, name = min(missed)
    says = (
        f"event {name!r} was passed by at about t = {when:.6g} s, {count} crossings at least: its function changes "
        f"faster than the steps of {solution.method} look; take a smaller step or rtol, or a method of lower order"
    )
    yield HealthCheck("missed events", False, float(count), 0.0, says)


def _on_the_wrong_side(solution: Solution, e: int, direction: int, floor: float) -> list[float]:
    """Return frames before which an event fired too few times for the side that its function is on [s].

    Where events come in crowds no interval is without one. But one that fires in both directions fires an odd number of
    times between two sides, and an even one between frames on the same; one of a direction at least once from the side
    before to the other. Where a reset comes in between, states jump, and no side follows from the last one; nor does
    it at a frame in whose instant the event fires.
    """
    t, name = _without_the_end(solution.t), solution.system.events[e]["name"]
    g = evaluate(solution.system, "events", solution.p, t, solution.states)[:, e]
    own = np.sort([event.t for event in solution.events if event.name == name])
    if not len(own) or not np.isfinite(g).all():
        return []
    jumps = np.array([event.t for event in solution.events if event.action != "record"])
    n, n_jumps = (np.diff(np.searchsorted(times, t, side="right")) for times in (own, jumps))
    at_once = SAME_TICKS * time_resolution(t[0], t[-1])
    told = (np.abs(g) > floor) & (_distance(t, own) > at_once)
    clear = told[:-1] & told[1:] & (n_jumps == 0) & (np.diff(t) > 0.0)
    crossed = g[:-1] * g[1:] < 0.0
    wrong = n % 2 != crossed if direction == 0 else crossed & (direction * g[1:] > 0.0) & (n == 0)
    return t[1:][clear & wrong].tolist()


def _distance(t: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return how far times are from the nearest of others, which are in order [s]."""
    k = np.searchsorted(others, t)
    before, after = others[np.maximum(k - 1, 0)], others[np.minimum(k, len(others) - 1)]
    return np.minimum(np.abs(t - before), np.abs(after - t))


def _without_the_end(t: np.ndarray) -> np.ndarray:
    """Return times of which the last is just before the end: what jumps in that instant has not been passed by."""
    return np.append(t[:-1], np.nextafter(t[-1], t[0]))


def _crossings(g: np.ndarray, floor: float, direction: int) -> Iterator[int]:
    """Yield the intervals in which g changes its sign in a direction, by more than round-off on both sides.

    Of two neighbours the first, where g is at zero at the place between them.
    """
    clear = np.flatnonzero(np.abs(g) > floor)
    signs = np.sign(g[clear])
    for k in np.flatnonzero(signs[1:] != signs[:-1]):
        if clear[k + 1] <= clear[k] + 2 and direction * signs[k + 1] >= 0:
            yield int(clear[k])


def _without_events(t: np.ndarray, fired: np.ndarray) -> np.ndarray:
    """Return which intervals of t, each widened by its neighbours, have no event in them."""
    quiet = np.ones(len(t), dtype=bool)
    for when in fired:
        k = int(np.searchsorted(t, when))
        quiet[max(0, k - 1 - _BETWEEN) : k + 1 + _BETWEEN] = False
    return quiet


def _between_frames(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Return times and states at the frames and between them, by the cubic through q, v and a of neighbouring ones."""
    system, t, q, v = solution.system, solution.t, solution.q, solution.v
    if solution.states.size * _BETWEEN > _MOST_NUMBERS or system.quaternions:
        return t, solution.states
    a = solution.accelerations
    h = np.diff(t)[:, None]
    times, states = [t[:-1]], [solution.states[:-1]]
    for part in np.arange(1, _BETWEEN) / _BETWEEN:
        times.append(t[:-1] + part * h[:, 0])
        states.append(np.hstack([_hermite(part, h, q, v), _hermite(part, h, v, a)]))
    n = len(t) - 1
    order = np.arange(n * _BETWEEN).reshape(_BETWEEN, n).T.ravel()
    at = np.append(np.concatenate(times)[order], t[-1])
    return at, np.vstack([np.vstack(states)[order], solution.states[-1:]])


def _hermite(s: float, h: np.ndarray, x: np.ndarray, dx: np.ndarray) -> np.ndarray:
    before, after = x[:-1], x[1:]
    blend = s * s * (3.0 - 2.0 * s)
    slopes = s * (1.0 - s) ** 2 * dx[:-1] - s * s * (1.0 - s) * dx[1:]
    return before + blend * (after - before) + h * slopes
