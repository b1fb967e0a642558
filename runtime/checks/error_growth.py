"""How fast errors grow along a run: parts of it, integrated again beside it.

Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980) 9: two runs from states close to each other, the second
brought back to the first distance after each of many short times; the logarithms of the distances before that add up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.checks.choice import least_steps_per_period
from runtime.checks.replay import Replay
from runtime.positions import Positions
from runtime.spread import middle, spread_numbers

if TYPE_CHECKING:
    from runtime.integrate.methods import Method
    from runtime.solution import Solution

_SHARE = 0.008  # of the run's operations, by each of the two runs
_CHEAP, _LONG = 3e6, 4e7  # operations that no user waits for, fewer the nearer a run comes to so many
_BEGIN = 0.25  # of the run: what dies out has gone
_SERIES = 20.0  # operations of a step of `taylor` for one of rhs
_OF_CALL, _OF_NEWTON = 100.0, 800.0  # operations that evaluations and iterations cost besides
_SEGMENTS = 12
_LEAST_STEPS = 8  # in a segment
_SHORTER, _SHORTENINGS = 0.5, 12  # of a time in which the distance grows too far
_DISTANCE, _SATURATED = 1e-4, 0.1  # of the variables' ranges
# What two runs differ by for their steps' sake must be small beside their distance.
_RTOL, _RTOL_OF_MULTISTEP = 1e-7, 1e-9
_RESOLVED = 3.0  # times the fewest steps in a period
_MORE_THAN_POWERS = 5.0 * np.log(2.0)  # in the second half of a time: see `growth.py`
_MANY = 1000  # steps tell the typical one
# Times as much in the first half: some motions pass a state once from which everything moves away.
_LEAST_BEFORE = 0.5


def error_growth(solution: Solution, method: Method, scale: np.ndarray, resolution: float) -> float:
    """Return the rate [1/s] of exponential growth of small errors, 0 where they grow as in regular motion.

    Where the whole run can be followed at small cost it is, elsewhere a part of it.

    Parameters
    ----------
    solution : Solution
        Of a run without resets.
    method : Method
    scale : ndarray, shape (nq + nv,)
        What each variable is measured by.
    resolution : float
        Steps in the fastest period of a run of fixed step; 0 if unknown.
    """
    t_first, span = float(solution.t[0]), float(solution.t[-1] - solution.t[0])
    step, typical = _step(solution, method, resolution)
    of_step = _operations(solution, method)
    in_all = solution.stats["steps"] * of_step
    n_steps = int(max(_SHARE * in_all, _CHEAP * (1.0 - in_all / _LONG)) / of_step)
    whole = n_steps * typical >= span
    if not whole and n_steps < _SEGMENTS * _LEAST_STEPS:
        return 0.0
    length = span if whole else n_steps * typical
    if step:
        length = max(int(length / (_SEGMENTS * step)), 1) * _SEGMENTS * step
    begin = min(_BEGIN * span, span - length)
    return _Beside(solution, method, scale, step).rate(t_first + max(begin, 0.0), length)


def _step(solution: Solution, method: Method, resolution: float) -> tuple[float, float]:
    """Return the step of a method of fixed step [s], 0 for others, and the typical one.

    Steps much finer than motion demands tell no more about growth than coarser ones.
    """
    if method.adaptive:
        shorter = min(_rtol(method) / solution.rtol, 1.0) ** (1.0 / (method.order + 1))
        return 0.0, typical_step(solution) * shorter
    coarser = max(int(resolution / (_RESOLVED * least_steps_per_period(method))), 1)
    return coarser * solution.step, coarser * solution.step


def _rtol(method: Method) -> float:
    return _RTOL_OF_MULTISTEP if method.multistep else _RTOL


def typical_step(solution: Solution) -> float:
    """Return the median of the steps [s], of some of them where there are many."""
    return middle(solution.step_log[:: max(len(solution.step_log) // _MANY, 1), 1])


def _operations(solution: Solution, method: Method) -> float:
    """Return about how many operations a step takes."""
    stats, operations = solution.stats, solution.system.operations
    steps = max(stats["steps"], 1)
    calls = _SERIES if method.name == "taylor" else stats["rhs"] / steps
    solved = stats["factorisations"] / steps * (solution.system.nv + solution.system.m) ** 3
    derived = stats["jacobians"] / steps * operations.get("residual_jacobian", 0)
    iterations = stats["newton"] / steps * _OF_NEWTON
    return calls * operations.get("rhs", 0) + max(calls, 1.0) * _OF_CALL + derived + solved + iterations


class _Beside:
    """Two runs close to each other."""

    def __init__(self, solution: Solution, method: Method, scale: np.ndarray, step: float):
        self._solution, self._scale = solution, scale
        self._positions, self._nq = Positions(solution.system), solution.system.nq
        self._runs = [Replay(solution, method, _rtol(method), step) for _ in range(2)]
        towards = spread_numbers(len(scale))
        self._first = scale * towards / np.abs(towards).max()

    def rate(self, begin: float, length: float, shortenings: int = 0) -> float:
        """Return the rate of exponential growth from the frame at `begin` [s] on; 0 where there is none to be seen."""
        of = self._solution
        frame = min(int(np.searchsorted(of.t, begin)), len(of.t) - 1)
        t = float(of.t[frame]) + length * np.arange(1, _SEGMENTS + 1) / _SEGMENTS
        here, apart = of.states[frame], _DISTANCE * self._first
        for run, state in zip(self._runs, (here, self._displaced(here, apart)), strict=True):
            run.begin(float(of.t[frame]), state)
        most = max(100, 20 * of.stats["steps"] // _SEGMENTS)
        logarithms = []
        for end in t:
            ends = [run.reach(float(end), most) for run in self._runs]
            if ends[0] is None or ends[1] is None:
                return 0.0
            apart = ends[1] - ends[0]
            distance = float(np.abs(apart / self._scale).max())
            if distance > _SATURATED and shortenings < _SHORTENINGS:
                return self.rate(begin, _SHORTER * length, shortenings + 1)
            if not 0.0 < distance <= _SATURATED:
                return 0.0
            logarithms.append(np.log(distance / _DISTANCE))
            self._runs[1].move_to(self._displaced(ends[0], apart * (_DISTANCE / distance)))
        grown = np.cumsum(logarithms)
        half = _SEGMENTS // 2 - 1
        late = grown[-1] - grown[half]
        if late < _MORE_THAN_POWERS or grown[half] < _LEAST_BEFORE * _MORE_THAN_POWERS:
            return 0.0
        return float(grown[-1] / length)

    def _displaced(self, state: np.ndarray, apart: np.ndarray) -> np.ndarray:
        moved = state + apart
        moved[: self._nq] = self._positions.normalised(moved[: self._nq])
        return moved
