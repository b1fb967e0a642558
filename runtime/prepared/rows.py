"""What machine code reads and writes of prepared runs, as records of arrays."""

from typing import NamedTuple

import numpy as np


class Plan(NamedTuple):
    """What is the same for all runs: code, what is asked, the state of a loop before its first run, scratch.

    Attributes
    ----------
    addresses : ndarray of uint64, shape (N_ADDRESSES,)
    block, result : ndarray, shapes (any,), (1,)
        Of the step loop's `CallBlock`.
    asked : ndarray, shape (N_ASKED,)
    guard : ndarray of int64
        The context of the guard (`constraints/branch.py`); empty without constraints.
    weights : ndarray
        What the guard takes rows of G by; empty without constraints.
    curve : ndarray
        The curve of its branch (`constraints/curve.py`); empty where it is none.
    control, counters, tail : ndarray
        Those of the loop before its first step. `tail` is what methods carry behind the precomputed `p`.
    saved, saved_counters : ndarray
        A copy of what the loop carries from step to step.
    base_p : ndarray, shape (n_p,)
        Parameters and inputs, where rows say nothing else.
    """

    addresses: np.ndarray
    block: np.ndarray
    result: np.ndarray
    asked: np.ndarray
    guard: np.ndarray
    weights: np.ndarray
    curve: np.ndarray
    control: np.ndarray
    counters: np.ndarray
    tail: np.ndarray
    saved: np.ndarray
    saved_counters: np.ndarray
    base_p: np.ndarray


class Look(NamedTuple):
    """What a start is looked at with.

    Attributes
    ----------
    unit_of_rate : ndarray of int64, shape (nv,)
        The number of the unit by which a rate's coordinate is sized; -1 for angles and rotations, -2 without a unit.
    unit_of_value : ndarray of int64, shape (nq + number of parameters and inputs,)
        The numbers of the units of coordinates, then of parameters and inputs.
    is_bare : ndarray of int64, shape (nq,)
        1 for coordinates without a unit.
    largest : ndarray, shape (number of units,)
    quaternions : ndarray of int64
        `row_weights.quaternion_places`.
    steps : ndarray, shape (number of neighbours, nv)
        `row_weights.random_steps`.
    nearby : ndarray, shape (nv,)
        From a start to a state near it.
    turning : ndarray, shape (3, nv)
        Rates at which powers and kinetic energies are compared: `energy_level`.
    places : ndarray, shape (3, nq)
        How far from the start other places are, for the same.
    y, row : ndarray, shapes (ny,), (n_row,)
    rows, squares, gamma, residual : ndarray, shapes (m * nv,), (m,), (m,), (nh + m,)
    gram, mass : ndarray, shapes (m * m,), (nv * nv,)
    energy : ndarray, shape (2,)
    resets : ndarray
        What resets have done to the energy before each frame [J].
    """

    unit_of_rate: np.ndarray
    unit_of_value: np.ndarray
    is_bare: np.ndarray
    largest: np.ndarray
    quaternions: np.ndarray
    steps: np.ndarray
    nearby: np.ndarray
    turning: np.ndarray
    places: np.ndarray
    y: np.ndarray
    row: np.ndarray
    rows: np.ndarray
    squares: np.ndarray
    gamma: np.ndarray
    residual: np.ndarray
    gram: np.ndarray
    mass: np.ndarray
    energy: np.ndarray
    resets: np.ndarray


class Rows(NamedTuple):
    """The runs of one call, and what became of them.

    Attributes
    ----------
    places : ndarray of int64, shape (N_PLACES,)
    p_at : ndarray of int64, shape (k,)
        Where in `p` the values of rows belong.
    p, y : ndarray, shapes (n, k), (n, nq + nv)
    is_assembled : ndarray of int64, shape (n,)
        1 where a start is known to meet the constraints.
    sizes : ndarray, shape (n * nv,)
        Characteristic sizes, row by row, where machine code cannot find them; else empty.
    wanted : ndarray of int64
        Which frames are wanted; none: the end.
    out : ndarray, shape (n, nq + nv) or (n, len(wanted) * (nq + nv))
    status, steps : ndarray of int64, shape (n,)
    t : ndarray, shape (n,) [s]
        Where the runs ended.
    """

    places: np.ndarray
    p_at: np.ndarray
    p: np.ndarray
    y: np.ndarray
    is_assembled: np.ndarray
    sizes: np.ndarray
    wanted: np.ndarray
    out: np.ndarray
    status: np.ndarray
    steps: np.ndarray
    t: np.ndarray
