"""Whether nothing in a model can act for a short time only: neither time nor an event, nor what the state nears."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.recipe import places_in, values_of
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_MOST_FRAMES = 4000
_MOST_STEPS, _MOST_PARTS = (
    2,
    32,
)  # of the run, between two places that are looked at; of a time between frames
_TRIED, _CHANGE = 1e-3, 0.25  # of the time to the next place; of a value, in that time


def is_smooth_along(solution: Solution) -> bool:
    """Whether the equations of a run are smooth along it, as far as its frames show.

    Sums, products, sines and cosines are smooth as motion itself is. Quotients and roots are where what they are of
    stays away from zero: at no frame would its slope bring it there before the next one, nor long afterwards.
    """
    if "_is_smooth_along" not in solution.__dict__:
        found = may_be_smooth(solution) and parts_between_frames(solution) == 1
        solution.__dict__["_is_smooth_along"] = found and stays_smooth(solution, solution.t, solution.states)
    return solution.__dict__["_is_smooth_along"]


def may_be_smooth(solution: Solution) -> bool:
    """Whether nothing in a model can be sharp but where it divides by coordinates, or takes roots of them."""
    system = solution.system
    if system.events or system.input_descriptions or system.structure["time_dependent"]:
        return False
    facts = system.source.facts("residual")
    # Coordinates alone have slopes that are known without the equations.
    return facts.is_smooth or (bool(facts.smooth_where) and max(places_in(facts.smooth_where)) < system.nq)


def parts_between_frames(solution: Solution) -> int:
    """Return into how many parts the times between frames have to be divided to see what a run went along.

    A motion that turns several times between two frames may look as if it rested.
    """
    if solution.system.source.facts("residual").is_smooth:
        return 1
    steps = np.bincount(np.searchsorted(solution.t, solution.step_log[:, 0])).max(initial=0)
    return max(1, -(-int(steps) // _MOST_STEPS))


def divided(t: np.ndarray, parts: int) -> np.ndarray | None:
    """Return times with so many parts between two neighbours, those themselves to the last bit; None: too many."""
    if parts == 1:
        return t
    if parts > _MOST_PARTS or parts * len(t) > _MOST_PARTS * _MOST_FRAMES:
        return None
    between = t[:-1, None] + np.diff(t)[:, None] * (np.arange(parts) / parts)
    return np.append(between.ravel(), t[-1])


def stays_smooth(solution: Solution, t: np.ndarray, states: np.ndarray) -> bool:
    """Whether what the equations of a run divide by or take roots of is far from zero, for how fast it changes.

    Parameters
    ----------
    t : ndarray, shape (n,) [s]
    states : ndarray, shape (n, nq + nv)
        Of the run, or of a motion beside it.
    """
    system, recipe = solution.system, solution.system.source.facts("residual").smooth_where
    if not recipe:
        return True
    if len(t) < 2:
        return False
    q, v = states[:, : system.nq], states[:, system.nq : system.nq + system.nv]
    between = np.diff(t)
    tried = _TRIED * np.maximum(np.append(between, 0.0), np.append(0.0, between))
    moved = q + tried[:, None] * Positions(system).derivatives(q, v)
    with np.errstate(all="ignore"):
        found = values_of(recipe, np.concatenate([q, moved]), solution.p)
        return all(
            (np.abs(there - here) <= _CHANGE * _TRIED * np.abs(here)).all() and (here != 0.0).all()
            for here, there in (np.split(x, 2) for x in found)
        )
