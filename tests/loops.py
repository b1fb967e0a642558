"""Records of step loops for tests that call one of their functions."""

from __future__ import annotations

import numpy as np

from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import Loop


def bare_loop(sizes: np.ndarray, p: np.ndarray, addresses: np.ndarray, y: np.ndarray) -> Loop:
    """Return the record of a run at the state `y`, without frames and events."""
    none, rows = np.zeros(0), np.zeros((0, len(y)))
    control, counters = np.zeros(at.N_CONTROL), np.zeros(at.N_COUNTERS, dtype=np.int64)
    return Loop(
        addresses, sizes, p, control, counters, y, np.zeros(sizes[at.N_ROW]), none, none, rows, np.zeros((0, 2)),
        np.zeros((8, len(y))),
    )  # fmt: skip
