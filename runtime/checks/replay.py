"""Parts of a run integrated again from one of its states, or from one beside it, with other steps or tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.integrate import layout as at
from runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from runtime.integrate.methods import Method
    from runtime.solution import Solution


class Replay:
    """The method of a run, ready to integrate parts of it.

    Parameters
    ----------
    solution : Solution
    method : Method
    rtol : float
        `atol` follows in proportion.
    step : float [s]
        Of methods of fixed step.
    """

    def __init__(self, solution: Solution, method: Method, rtol: float, step: float):
        self._step = step
        self._arrays = LoopArrays(
            solution.system, method, solution.p, float(solution.t[0]), solution.states[0], frame_times=np.zeros(0),
            rtol=rtol, atol=solution.atol * rtol / solution.rtol, step=step,
            span=float(solution.t[-1] - solution.t[0]), with_events=False,
        )  # fmt: skip
        self._n = solution.states.shape[1]

    def begin(self, t: float, state: np.ndarray) -> None:
        """Start as new, but for what takes long to make."""
        arrays = self._arrays
        arrays.counters[:] = 0
        arrays.work[:], arrays.f[:], arrays.y[self._n :] = 0.0, 0.0, 0.0
        for place in (at.T, at.T_GRID, at.T_EVENT):
            arrays.control[place] = t
        arrays.control[at.H] = self._step
        self.move_to(state)

    def move_to(self, state: np.ndarray) -> None:
        """Go on from another state."""
        self._arrays.y[: self._n] = state
        self._arrays.restart(state_changed=True)

    def reach(self, end: float, most_steps: int) -> np.ndarray | None:
        """Integrate up to `end` [s]; returns the state (q, v), or None where that is not to be had."""
        reached = self._arrays.advance(end, most_steps) == at.REACHED_STOP
        y = self._arrays.y[: self._n]
        return y.copy() if reached and np.all(np.isfinite(y)) else None
