"""Whether nothing in a model can act for a short time only: neither time nor an event, nor what the state nears."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.recipe import places_in, values_of
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_MOST_FRAMES = 4000
_MOST_STEPS = 2  # of the run, between two of its frames
_TRIED, _CHANGE = 1e-3, 0.25  # of the time to the next frame; of a value, in that time


def is_smooth_along(solution: Solution) -> bool:
    """Whether the equations of a run are smooth along it.

    Sums, products, sines and cosines are smooth as motion itself is. Quotients and roots are where what they are of
    stays away from zero: at no frame would its slope bring it there before the next one, nor long afterwards.
    """
    if "_is_smooth_along" not in solution.__dict__:
        solution.__dict__["_is_smooth_along"] = _is_smooth(solution)
    return solution.__dict__["_is_smooth_along"]


def _is_smooth(solution: Solution) -> bool:
    system = solution.system
    if system.events or system.input_descriptions or system.structure["time_dependent"]:
        return False
    facts = system.source.facts("residual")
    if facts.is_smooth or not facts.smooth_where:
        return facts.is_smooth
    # Coordinates alone have slopes that are known without the equations.
    return max(places_in(facts.smooth_where), default=-1) < system.nq and _stays_apart(
        solution, facts.smooth_where
    )


def _stays_apart(solution: Solution, recipe: str) -> bool:
    """Whether what a recipe gives at frames is far from zero, for how fast it changes there."""
    system, n = solution.system, len(solution.t)
    t, states = solution.t, solution.states
    if n > _MOST_FRAMES:
        rows = np.linspace(0, n - 1, _MOST_FRAMES).astype(int)
        t, states = t[rows], states[rows]
    if len(t) < 2 or np.bincount(np.searchsorted(t, solution.step_log[:, 0])).max(initial=0) > _MOST_STEPS:
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
