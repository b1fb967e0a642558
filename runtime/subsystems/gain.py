"""Whether it pays to integrate subsystems by themselves: many of like speed share steps at less cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Subsystem

# Of what a step costs besides, half a microsecond: some ten evaluations of a nanosecond per operation, and the sums
# over stages that its results enter.
_PER_OPERATION = 0.025
STEPS_PER_RADIAN = 1.5
_PER_RUN = 300.0  # what it costs to prepare a run, in steps of a small model
_PERIODS, _VISIBLE = 10.0, 1e-4  # of the slowest motion; of the fastest rate


def usual_time(found: Sequence[Subsystem]) -> float:
    """Return the time [s] for which costs are compared: some periods of the slowest that moves, however long a run is.

    What is integrated with what decides about the last digits, and these must not depend on where a run ends.
    """
    rates = [s.choice.rate for s in found if not s.is_asleep]
    fastest = max(rates, default=0.0)
    slowest = min((rate for rate in rates if rate > _VISIBLE * fastest), default=0.0)
    return 2.0 * math.pi * _PERIODS / slowest if slowest > 0.0 else 0.0


def pays(found: Sequence[Subsystem]) -> bool:
    """Return whether runs by themselves are estimated to cost less than one run of all.

    The step of one run of all suits the fastest; what a step costs besides evaluations is paid once for all. Where
    some are stiff and others not, no common method suits them. What rests takes no steps by itself.
    """
    if len({subsystem.choice.method.stiff for subsystem in found}) > 1:
        return True
    span = usual_time(found)
    steps = [0.0 if s.is_asleep else STEPS_PER_RADIAN * s.choice.rate * span for s in found]
    work = [_PER_OPERATION * subsystem.system.operations.get("rhs", 0) for subsystem in found]
    of_all = sum(w * len(subsystem.columns) for w, subsystem in zip(work, found, strict=True))
    apart = sum(_PER_RUN + n * (1.0 + w) for n, w in zip(steps, work, strict=True))
    return apart < _PER_RUN + max(steps) * (1.0 + of_all)
