"""How `taylor` and `dop853` do on a model at the same tolerances, by short looks at both.

Counts of operations tell how long steps take, but not how long they are on a model, nor how large an error they leave:
those differ from one model to another by a factor of 0.4 to 1.7 in time. Some steps of either show most of it. The
looks are at the model's own start, whatever a run's is: a choice does not depend on runs before it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime import step_costs
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.constraints.start_values import start_values
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from symgen.runtime.system import System

assembly = Late("symgen.runtime.constraints.assembly")

_SERIES, _EXPLICIT = "taylor", "dop853"
_TOLERANCES, _ATOL, _TIGHTER, _TIGHTEST = (1e-4, 1e-6, 1e-8, 1e-10), 1e-2, 1e-4, 1e-15
_STEPS, _MOST_STEPS = 20, 1000  # of `dop853`; of series in that time
_ORDER = 8.0  # a method that leaves an error e times as large takes e^(1/8) times as long for the same error
_NEAR = 4.0  # powers of ten
_FEWEST, _MOST_APART, _LARGEST = 3, 1e4, 2.0  # looks; ratio of errors; factor
_ROUND_OFF = 10.0 * np.finfo(float).eps


def time_factor(system: System, rtol: float) -> float:
    """Return by how much `taylor` takes longer on a model, for one time of `dop853`, than `step_costs` says.

    It is 1 where nothing can be seen: of models with inputs over time, stops or friction, or without a start.

    Parameters
    ----------
    rtol : float
        Looks at tolerances that are near to this one count most.
    """
    kept = vars(system)
    if "_looks_at_methods" not in kept:
        kept["_looks_at_methods"] = _looks(system)
    found = kept["_looks_at_methods"]
    if len(found) < _FEWEST:
        return 1.0
    weights = [math.exp(-((math.log10(rtol / at_tolerance) / _NEAR) ** 2)) for at_tolerance in found]
    mean = sum(w * math.log(x) for w, x in zip(weights, found.values())) / sum(weights)
    return min(max(math.exp(mean), 1.0 / _LARGEST), _LARGEST)


def _looks(system: System) -> dict[float, float]:
    """Return the factor at each tolerance that tells."""
    if system.input_descriptions or system.switches:
        return {}
    try:
        looks = _Looks(system, *_own_start(system))
        with np.errstate(all="ignore"):
            found = {rtol: looks.factor(rtol) for rtol in _TOLERANCES}
    except RuntimeModelError:
        return {}
    return {rtol: factor for rtol, factor in found.items() if factor is not None}


def _own_start(system: System) -> tuple[np.ndarray, np.ndarray]:
    p = system.parameter_values()
    is_solved = system.m or system.start is not None
    given = assembly.assemble(system, p, {}, {}, 0.0) if is_solved else start_values(system, p, {}, {})
    return p, np.concatenate([given.q, given.v])


class _Looks:
    """Steps of both methods from one state, with energy scaling where runs have it."""

    def __init__(self, system: System, p: np.ndarray, state: np.ndarray):
        self._system, self._state, self._given = system, state, (p, 0.0, state)
        self._level = choose_energy_level(None, system, METHODS[_EXPLICIT], p, 0.0, state)
        self._arrays = {name: self._made(name) for name in (_EXPLICIT, _SERIES)}

    def _made(self, name: str) -> LoopArrays:
        return LoopArrays(
            self._system, METHODS[name], *self._given, frame_times=np.zeros(0), rtol=1.0, atol=1.0, with_events=False,
            energy_level=self._level, log_length=_MOST_STEPS,
        )  # fmt: skip

    def factor(self, rtol: float) -> float | None:
        """Return the factor at a tolerance; None where a method does not get there."""
        explicit = self._go(_EXPLICIT, rtol, math.inf, _STEPS)
        end = self._arrays[_EXPLICIT].t
        series = self._go(_SERIES, rtol, end, _MOST_STEPS)
        exact = self._go(_SERIES, max(_TIGHTER * rtol, _TIGHTEST), end, _MOST_STEPS)
        if explicit is None or series is None or exact is None:
            return None
        off = self._off(explicit[0], exact[0])
        if not off > _ROUND_OFF:
            return None  # nothing moves, or so little that any method follows it
        apart = self._off(series[0], exact[0]) / off
        error = min(max(apart, 1.0 / _MOST_APART), _MOST_APART) ** (1.0 / _ORDER)
        return series[1] / explicit[1] / step_costs.step_ratio(rtol) * error

    def _go(self, name: str, rtol: float, end: float, most: int) -> tuple[np.ndarray, int] | None:
        """Return the state that a method comes to, and its steps, rejected ones among them."""
        arrays, n = self._arrays[name], len(self._state)
        arrays.begin_again(
            self._system, METHODS[name], *self._given, atol=_ATOL * rtol, energy_level=self._level
        )
        arrays.control[at.RTOL] = rtol
        status = arrays.advance(end, most)
        if status not in (at.RUNNING, at.REACHED_STOP) or (status == at.RUNNING) != math.isinf(end):
            return None
        if not np.isfinite(arrays.y).all():
            return None
        return arrays.y[:n].copy(), int(arrays.counters[at.STEPS] + arrays.counters[at.REJECTED])

    def _off(self, found: np.ndarray, exact: np.ndarray) -> float:
        """Return the largest difference, in parts of the largest position or rate there and at the start."""
        nq, off = self._system.nq, np.abs(found - exact)
        largest = np.maximum(np.abs(exact), np.abs(self._state))
        parts = (slice(0, nq), slice(nq, None))
        return max(float(off[x].max(initial=0.0) / max(largest[x].max(initial=0.0), 1e-300)) for x in parts)
