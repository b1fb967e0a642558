"""What bdf allows for near configurations where constraints lose rank."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.bdf.work import FAR_STEP, LEFT_OPEN, PIVOT_RATIO, PREDICTED, SCALE, SPACING

# Pivot ratios, which are d² at the distance d from there. Nearer than the smaller one, accelerations are taken without
# the constraint.
NEAR_SINGULAR, ON_SINGULAR = 1e-4, 1e-8
# How fast it is forgotten from step to step, as are the points of the history, and what is nothing.
FADING, NOTHING = 0.5, 10.0
MET_TO = 1e-12  # of their sizes: what projections leave of constraints


@jitted
def allow_for_singularity(sizes, w):
    """Raise the tolerances of rates to what the projection leaves open of them.

    At the distance d, positions that meet the constraints to ε let rates across their branch vary by ε/d. No step,
    however short, has smaller errors, and shorter ones do not lead away from there. Where the pivot ratio is zero all
    the time, constraints are redundant, and nothing is near.
    """
    if sizes[at.NM] == 0:
        return
    ratio, nq = w.row[sizes[at.N_ROW] - 1], sizes[at.NQ]
    if ratio > 0.0:
        w.numbers[PIVOT_RATIO] = ratio
    if is_near_singular(sizes, w):
        own = MET_TO / math.sqrt(max(ratio, ON_SINGULAR))
        w.numbers[LEFT_OPEN] = max(w.numbers[LEFT_OPEN], own)
    if w.numbers[LEFT_OPEN] == 0.0:
        return
    largest = 0.0
    for i in range(nq, nq + sizes[at.NV]):
        largest = max(largest, abs(w.states[PREDICTED, i]))
    for i in range(nq, nq + sizes[at.NV]):
        w.states[SCALE, i] = max(w.states[SCALE, i], w.numbers[LEFT_OPEN] * largest)


@jitted
def is_near_singular(sizes, w):
    """Whether constraints lose rank near the last state: what the projection does to its rates is noise."""
    ratio = w.row[sizes[at.N_ROW] - 1]
    return sizes[at.NM] > 0 and ratio < NEAR_SINGULAR and w.numbers[PIVOT_RATIO] >= ON_SINGULAR


@jitted
def leave_singularity(control, w):
    """After a step: forget, and keep steps as short as they are elsewhere, as errors along the branch are not seen."""
    if w.numbers[LEFT_OPEN] == 0.0:
        w.numbers[FAR_STEP] = w.numbers[SPACING]
        return
    w.numbers[LEFT_OPEN] *= FADING
    if w.numbers[LEFT_OPEN] < NOTHING * MET_TO:
        w.numbers[LEFT_OPEN] = 0.0
    if w.numbers[FAR_STEP] > 0.0:
        control[at.H] = min(control[at.H], w.numbers[FAR_STEP])
