"""Accelerations so close to a singular configuration that round-off would decide them: interpolated along the branch.

At the distance d from such a configuration, round-off of the positions makes accelerations uncertain by 1e-16/d³. On
the branch itself they are a smooth function of the way along it, through the configuration and beyond. So they are
taken at places before and behind, with the velocity that the state's becomes there, and interpolated.
"""

from __future__ import annotations

import math

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.branch import (
    FORCES,
    GAMMA,
    NQ,
    NV,
    RHS,
    USUAL_RANK,
    M,
    fill,
    make_unit,
    move_to_branch,
    solve,
)
from symgen.runtime.constraints.rank_revealing import least_pivot
from symgen.runtime.integrate.copying import copy

# Ratios of pivots are (c d)²: at the first distance interpolation begins, at the second its nearest place is.
BESIDE, _CLEAR = 6e-3, 6e-3
_TRIAL = 0.05  # of characteristic sizes: how far c is looked for
_ROUND_OFF = (
    2e-15  # what it makes of accelerations at a distance of 1, in parts of size times speed squared, at most
)
_FARTHEST = 0.1  # of characteristic sizes: the distance between places at most
_SAME_SIDE = 0.1  # by how much a distance may differ from the mean of its neighbours if all lie on one side
# Lagrange's, for the middle of ten places: -5 to -1 and 1 to 5.
_WEIGHTS = (5.0 / 6.0, -10.0 / 21.0, 5.0 / 28.0, -5.0 / 126.0, 1.0 / 252.0)


@jitted
def accelerations_beside(context, t, b, p, weights, rank):
    """Write the accelerations at `b.place`, on the branch, to `b.total`; False where none are found.

    A mechanism that nearly has a change point turns off just before it, in a curve that no interpolation follows: what
    round-off does not explain is not interpolated.

    Parameters
    ----------
    rank : int
        Of the factor, which is that of this place at the tolerance ON_BRANCH.
    """
    nq, nv, m = context[NQ], context[NV], context[M]
    if weights.shape[0] == 0 or context[USUAL_RANK] == 0:
        return False
    copy(b.place, b.centre)
    call_kernel(np.uint64(context[RHS]), t, b.centre, p, b.row)
    copy(b.row[:nq], b.along)
    speed, sizes = 0.0, weights[m * nv + m :]
    for i in range(nv):
        speed = max(speed, abs(b.centre[nq + i]) / sizes[i])
    if not (speed > 0.0 and math.isfinite(speed)):
        return False
    here = math.sqrt(least_pivot(b.lower, rank, b.solver)) if rank == context[USUAL_RANK] else 0.0
    if here > 0.0:
        _accelerations_here(context, t, b, p, rank)
        copy(b.step, b.direct)
    spacing = _spacing(context, t, b, p, weights, _TRIAL / speed, here)
    if not 0.0 < spacing * speed <= _FARTHEST:
        return False
    fill(b.total, 0.0)
    for k, weight in enumerate(_WEIGHTS):
        for shift in ((k + 1) * spacing, -(k + 1) * spacing):
            if not _accelerations_at(context, t, b, p, weights, shift):
                return False
            for i in range(nv):
                b.total[i] += weight * b.step[i]
    if here > 0.0:
        explained = _ROUND_OFF * speed**2 / here**3
        for i in range(nv):
            if abs(b.total[i] - b.direct[i]) > explained * sizes[i]:
                copy(b.direct, b.total)
                break
    return True


@jitted
def _spacing(context, t, b, p, weights, trial, here):
    """Return how far places are from each other [s of the motion] that are all clear of the configuration; or 0."""
    rank = context[USUAL_RANK]
    ahead = behind = 0.0
    if _accelerations_at(context, t, b, p, weights, trial):
        ahead = math.sqrt(least_pivot(b.lower, rank, b.solver))
    if _accelerations_at(context, t, b, p, weights, -trial):
        behind = math.sqrt(least_pivot(b.lower, rank, b.solver))
    if not (ahead > 0.0 and behind > 0.0):
        return 0.0
    mean = 0.5 * (ahead + behind)
    slope = (0.5 * abs(ahead - behind) if abs(mean - here) <= _SAME_SIDE * mean else mean) / trial
    return (_CLEAR + here) / slope if slope > 0.0 else 0.0


@jitted
def _accelerations_at(context, t, b, p, weights, shift):
    """Write the accelerations `shift` [s] from the centre to `b.step`; False where the branch or the rank is lost."""
    nq = context[NQ]
    copy(b.centre, b.place)
    for i in range(nq):
        b.place[i] += shift * b.along[i]
    make_unit(context, b.place)
    rank = move_to_branch(context, t + shift, b, p, weights)
    if rank < context[USUAL_RANK]:
        return False
    _accelerations_here(context, t + shift, b, p, rank)
    return True


@jitted
def _accelerations_here(context, t, b, p, rank):
    """Write the accelerations at `b.place` to `b.step`, with the factor as it is."""
    call_kernel(np.uint64(context[FORCES]), t, b.place, p, b.forces)
    call_kernel(np.uint64(context[GAMMA]), t, b.place, p, b.target)
    solve(b, rank)
