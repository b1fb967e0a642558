"""What a motion does between frames that see little of it: an oscillation with a frame, or a few, in each period.

At 60 frames a second a vibration of 60 Hz stands still: all frames have one state. What a motion exchanges, and how far
each coordinate goes, by which errors are measured, is told by some intervals between frames then, integrated again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import right_hand_sides
from symgen.runtime.checks.companion import Companion, follow
from symgen.runtime.sampling import quasi_random, sample_rows

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

_OF_STEP = 0.25  # between frames, below which they see what there is: a step may hold half a period
_FRAMES = 64  # at which slopes are looked at
_FAR = 10.0  # times what frames see: how far rates at them would lead from one to the next
_INTERVALS, _LOOKS, _MOST_LOOKS = 8, 16, 256  # that are integrated again, looks in a step, and in an interval
_MORE_STEPS = 8


def seen_between(solution: Solution, own: Method) -> np.ndarray:
    """Return states between frames, shape (k, nq + nv); none where frames see what there is.

    Parameters
    ----------
    own : Method
        That of the run, in the run's form of constraints.
    """
    if "_seen_between" not in solution.__dict__:
        with np.errstate(all="ignore"):
            solution.__dict__["_seen_between"] = _looked_at(solution, own)
    return solution.__dict__["_seen_between"]


def _looked_at(solution: Solution, own: Method) -> np.ndarray:
    t, states = solution.t, solution.states
    steps = solution.stats.get("steps", 0) / max(len(t) - 1, 1)
    nothing = np.zeros((0, states.shape[1]))
    if steps < _OF_STEP or not len(solution.step_log) or not _may_miss(solution):
        return nothing
    if getattr(solution.system, "samplers", ()):
        solution = replace(solution, system=solution.system.as_recorded())
    companion = Companion(own, solution.rtol, solution.atol, solution.step or 0.0)
    looks, most_steps = int(min(_LOOKS * steps, _MOST_LOOKS)) + 2, int(_MORE_STEPS * (steps + 100))
    places = np.unique(((0.5 + 0.5 * quasi_random(_INTERVALS)) * (len(t) - 1)).astype(int))
    found = [nothing]
    for k in places[t[places + 1] > t[places]]:
        times = np.linspace(t[k], t[k + 1], looks)
        found.append(follow(solution, companion, times, states[k], most_steps, lambda _: False).states)
    return np.vstack(found)


def _may_miss(solution: Solution) -> bool:
    """Whether slopes at frames would lead much farther from one frame to the next than all frames see."""
    n, t = solution.states.shape[1], solution.t
    rows = sample_rows(len(t), _FRAMES)
    slopes = right_hand_sides(solution.system, solution.p, t[rows], solution.states[rows])[:, :n]
    spacing = (t[-1] - t[0]) / (len(t) - 1)
    return bool((spacing * np.abs(slopes).max(axis=0) > _FAR * np.ptp(solution.states, axis=0)).any())
