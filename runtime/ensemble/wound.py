"""Members whose bushings, or springs over angles of directions, may be wound up until these jump.

Lanes keep their states at some times more, spread without a pattern. Members whose angles come near to where they jump
there are run again by themselves, and looked at as single runs are (`checks/windings.py`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks import windings
from symgen.runtime.ensemble import member
from symgen.runtime.ensemble.evaluate import evaluate_members
from symgen.runtime.sampling import quasi_random

if TYPE_CHECKING:
    from symgen.runtime.ensemble.batch import BatchSettings
    from symgen.runtime.ensemble.plan import Plan

_WATCHED = 96  # times
_NEAR = 0.6  # of where an angle jumps


def watched_times(plan: Plan) -> np.ndarray:
    """Return the times at which lanes keep states: those asked for, and more where angles may jump [s]."""
    if not plan.system.has("windings"):
        return plan.frame_times
    t_start, t_end = plan.single.t_start, plan.single.t_end
    places = (np.arange(_WATCHED) + 0.5 + 0.5 * quasi_random(_WATCHED)) / _WATCHED
    return np.unique(np.concatenate([plan.frame_times, t_start + places * (t_end - t_start), [t_end]]))


def with_watched(plan: Plan) -> BatchSettings:
    """Return what lanes are told, with these times."""
    if not plan.system.has("windings"):
        return plan.settings
    return replace(plan.settings, frame_times=watched_times(plan))


def frames_of(plan: Plan, frames: np.ndarray) -> np.ndarray:
    """Return states at the times asked for alone, shape (k, F, ny)."""
    if not plan.system.has("windings"):
        return frames
    return frames[:, np.searchsorted(watched_times(plan), plan.frame_times)]


def suspected(plan: Plan, first: int, parameters: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the members, counted from `first`, whose angles come near to where they jump, or change far between times.

    Parameters
    ----------
    parameters : ndarray, shape (k, n_p)
    frames : ndarray, shape (k, number of watched times, ny)
    """
    system, times = plan.system, watched_times(plan)
    if not system.has("windings"):
        return np.zeros(0, dtype=int)
    states = np.ascontiguousarray(frames[:, :, : system.nq + system.nv])
    breaks = plan.settings.breaks
    if breaks is None or breaks.places is None:
        angles = evaluate_members(system, "windings", parameters, times, states)
    else:
        numbers = np.arange(first, first + len(parameters))
        angles = np.concatenate(
            [
                evaluate_members(
                    system,
                    "windings",
                    breaks.values_at(t, numbers, parameters),
                    times[k : k + 1],
                    states[:, k : k + 1],
                )
                for k, t in enumerate(times)
            ],
            axis=1,
        )
    bounds = windings.bounds_of(system)
    with np.errstate(invalid="ignore"):
        near = np.abs(angles) > _NEAR * bounds
    return np.flatnonzero(near.any(axis=(1, 2)))


def jumps(plan: Plan, number: int) -> bool:
    """Whether angles of a member jump: it is run again."""
    return not windings.windings(member.member_again(plan, number)).ok
