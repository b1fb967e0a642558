"""Which of `taylor` and `dop853` needs less time for the same error: from what a model's functions are like.

A count of operations alone does not tell. Some functions are one long chain in which each operation waits for the one
before, as of linked bodies; others keep all units of a processor busy, as those of an arm. Both methods wait for that
chain: series once for each order, `dop853` once for each stage.

Constants are nanoseconds on one machine, of which ratios alone matter, fitted to the scenes of the benchmark.
For 20 other models, which had no part in that, the ratio of the times of two steps comes out within a factor of 0.78
to 1.25, but where one method is ahead by far.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.system import System

series = Late("symgen.runtime.integrate.taylor")
kernel = Late("symgen.runtime.taylor.kernel")

_STAGES = 12
_CYCLE, _OPERATION, _OPERATION_OF_SERIES = 0.23, 0.16, 0.105
_STAGE, _STAGE_BY_STATE = 6.0, 1.2  # of the step loop, beside `rhs`
_CACHED = 3e5  # operations of a series that cost twice as much each: it no longer fits the nearest cache
_PROJECTION_OF_SERIES, _PROJECTION = 1.1, 0.6  # by operations of `project`, on average over steps
# Before there is a series: of order p it has (a + b p) p operations for each of the residual, about.
_BY_ORDER, _BY_SQUARE = 4.6, 0.05
# Steps of `taylor` for one of `dop853`, both with the same error at the end: exp(a - b x - c x²), x = -lg rtol - 2.
_MORE_STEPS = 0.18, 0.10, 0.012

Costs = tuple[float, float, float]


@functools.lru_cache(maxsize=256)
def order_of(costs: Costs, rtol: float) -> int:
    """Return the order that needs the least time for a tolerance, as `taylor.order_for`, for a series of `costs`."""
    left_out = math.log(series.ERROR_FACTOR) - 0.7
    left_out += series.ERROR_EXPONENT * math.log(max(rtol, series.EPS))

    def time(order: int) -> float:
        return (series.COST_OF_STEP + _operations(costs, order)) * math.exp(-left_out / (order - 1))

    return min(orders(), key=time)


def orders() -> range:
    """Return the orders that series can have."""
    return range(series.LOWEST_ORDER, kernel.N_ROWS - 1)


def time_ratio(system: System, rtol: float, costs: Costs | None = None) -> float:
    """Return the run time of `taylor` for one of `dop853` that ends with the same error, about.

    Parameters
    ----------
    rtol : float
    costs : tuple of float, optional
        c0, c1, c2 of a series of c0 + c1 p + c2 p² operations, from `taylor_addresses`. By default they are guessed
        from the residual, which needs no series; the ratio may be wrong by a factor of 1.6 then.
    """
    rhs = system.source.facts("rhs")
    if costs is None:
        residual = system.operations.get("residual", 0)
        costs = 0.0, _BY_ORDER * residual, _BY_SQUARE * residual
    order = order_of(costs, rtol)
    operations = _operations(costs, order)
    projection = system.operations.get("project", 0) if system.m else 0
    of_series = math.hypot(
        _CYCLE * rhs.latency * order, _OPERATION_OF_SERIES * operations * (1.0 + operations / _CACHED)
    )
    stage = _STAGE + _STAGE_BY_STATE * system.ny + math.hypot(_CYCLE * rhs.latency, _OPERATION * rhs.work)
    step_time = (of_series + _PROJECTION_OF_SERIES * projection) / (
        _STAGES * stage + _PROJECTION * projection
    )
    return step_time * step_ratio(rtol)


def step_ratio(rtol: float) -> float:
    """Return the steps of `taylor` for one of `dop853`, both with the same error at the end, as models have on average.

    Parameters
    ----------
    rtol : float
    """
    x = -math.log10(max(rtol, series.EPS)) - 2.0
    a, b, c = _MORE_STEPS
    return math.exp(a - x * (b + c * x))


def _operations(costs: Costs, order: int) -> float:
    return costs[0] + order * (costs[1] + order * costs[2])
