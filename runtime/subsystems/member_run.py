"""The run of one subsystem: goes on from window to window of frames, and sleeps once it has come to rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from symgen.runtime.driver import Run
from symgen.runtime.event_actions import ResetError
from symgen.runtime.integrate import layout as at
from symgen.runtime.subsystems.rest import is_at_rest

_STILL = 1e-10  # rates below this [1/s of a size of 1] are worth a look


class MemberRun(Run):
    """A run that can pause when some frames are done.

    Attributes
    ----------
    asleep_from : float [s]
        When it came to rest; inf if it did not.
    tolerance_after : float
        What the method that takes over, where one does, makes of the tolerances.
    """

    tolerance_after = 1.0

    def __init__(self, *arguments: Any, **options: Any):
        super().__init__(*arguments, **options)
        self.asleep_from = np.inf
        self._until = 0
        self._may_sleep = not (self.system.events or self.system.structure["time_dependent"])

    def begin(self) -> None:
        """Take the start as the first frame."""
        self._begin()

    def go_to(self, n_frames: int) -> None:
        """Run until so many frames are written, or to the end."""
        self._until = n_frames
        try:
            if not self.is_over:
                self._loop()
        except ResetError as error:
            self._end("failed", str(error))

    @property
    def is_over(self) -> bool:
        """Whether it has come to its end, regular or not."""
        return not self.stops or self.status != "success"

    @property
    def n_steps(self) -> int:
        """The number of steps taken."""
        return int(self.arrays.counters[at.STEPS])

    @property
    def n_frames(self) -> int:
        """The number of frames written."""
        return int(self.arrays.counters[at.NEXT_FRAME])

    def pauses(self) -> bool:
        """Whether the frames asked for are there; a subsystem at rest has all of them."""
        if self._may_sleep and self._is_at_rest():
            self._sleep()
        return self.n_frames >= self._until

    def _fall_back(self) -> None:
        super()._fall_back()
        self.arrays.control[[at.RTOL, at.ATOL]] *= self.tolerance_after

    def _is_at_rest(self) -> bool:
        arrays, system = self.arrays, self.system
        state = arrays.y[: system.nq + system.nv]
        if arrays.t >= self.stops[-1]:
            return False
        atol = float(arrays.control[at.ATOL]) if self.method.adaptive else 0.0
        if np.abs(state[system.nq :]).max() > max(_STILL, atol) * max(1.0, np.abs(state[: system.nq]).max()):
            return False
        return is_at_rest(system, arrays.p, arrays.t, state.copy(), atol)

    def _sleep(self) -> None:
        """Fill what is left of the run with the present state."""
        arrays = self.arrays
        self.asleep_from = arrays.t
        arrays.frames[self.n_frames :] = arrays.y
        arrays.counters[at.NEXT_FRAME] = len(arrays.frames)
        for stop in self.stops:
            self.samples.append((stop, arrays.y.copy(), self.actions.energy_of_resets, -1))
        arrays.control[at.T] = self.stops[-1]
        self.stops.clear()
