"""What a step loop reads and carries on, as one record."""

from typing import NamedTuple

import numpy as np


class Loop(NamedTuple):
    """The arrays of one run, the same for all step loops; `layout.py` has their indexes, docs/architecture.md more.

    Whatever a loop carries from step to step is in `control`, `counters`, `y`, `f`, `work` or `dense`, or resuming
    breaks.

    Attributes
    ----------
    addresses : ndarray of uint64, shape (N_KERNELS,)
        Of kernels; 0 where a run does not need one.
    sizes : ndarray of int64, shape (N_SIZES + NE + number of quaternions + 1,)
    p : ndarray
        Parameters, inputs and what was precomputed from them.
    control : ndarray, shape (N_CONTROL + N_EVENT_BLOCKS * NE,)
    counters : ndarray of int64, shape (N_COUNTERS,)
    y, f : ndarray, shapes (NY,), (N_ROW,)
        The state at `control[T]`, and its rhs row, valid if `counters[F_VALID]`.
    work : ndarray
        As long as the method's `work_size` says.
    frame_times, frames : ndarray, shapes (F,), (F, NY)
    step_log : ndarray, shape (S, 2)
        t and h of accepted steps.
    dense : ndarray, shape (8, NY)
        Dense output of the last accepted step.
    """

    addresses: np.ndarray
    sizes: np.ndarray
    p: np.ndarray
    control: np.ndarray
    counters: np.ndarray
    y: np.ndarray
    f: np.ndarray
    work: np.ndarray
    frame_times: np.ndarray
    frames: np.ndarray
    step_log: np.ndarray
    dense: np.ndarray
