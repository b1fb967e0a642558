"""What a stage of a method costs beyond the right-hand side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

from .timing import best_seconds

if TYPE_CHECKING:
    from .case import Case
    from .sweep import Curve

_BATCH_SECONDS = 2e-3
_BATCHES = 10


@jitted
def call_again(address, t, y, p, out, n):
    """Call a kernel `n` times."""
    for _ in range(n):
        call_kernel(address, t, y, p, out)


def rhs_seconds(case: Case) -> float:
    """Return the seconds of one evaluation of the right-hand side, called from compiled code as loops call it."""
    system, reference = case.system, case.reference
    arrays = LoopArrays(
        system, METHODS["rk4"], reference.p, 0.0, reference.start, frame_times=np.zeros(0), rtol=1e-8, atol=1e-10,
        with_events=False, log_length=1,
    )  # fmt: skip
    arguments = (arrays.addresses[at.RHS], 0.0, arrays.y, arrays.precomputed, arrays.f)
    once = best_seconds(lambda: call_again(*arguments, 10), 3, 0.0) / 10
    n = max(10, int(_BATCH_SECONDS / once))
    return best_seconds(lambda: call_again(*arguments, n), _BATCHES, 0.0) / n


def stage_overhead(curves: Mapping[str, Curve], seconds_per_rhs: float) -> dict[str, float]:
    """Return, for each method that evaluates the right-hand side, seconds per evaluation beyond it.

    Of the run with the most evaluations, so that what is done once per run does not count.
    """
    overhead = {}
    for name, curve in curves.items():
        rows = [row for row in curve.usable() if row.rhs > 0 and row.jacobians == 0]
        if rows:
            longest = max(rows, key=lambda row: row.rhs)
            overhead[name] = longest.seconds / longest.rhs - seconds_per_rhs
    return overhead
