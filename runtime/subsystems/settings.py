"""What a run of subsystems is asked to do; one of them gets the same as the whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.timing.timetable import Timetable, timetable

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System
    from symgen.runtime.timing.step_limits import StepLimits


@dataclass(frozen=True)
class Settings:
    """The options of a run, settled as far as they can be for all subsystems at once.

    Attributes
    ----------
    options : RunOptions
        Method and constraints as asked for, "auto" included.
    treatment : str
        How the whole model's constraints are treated.
    redundant : list of str
        Constraints that follow from the others.
    times, shown : ndarray
        Frames from start to end, and which of them were asked for.
    step_limits : symgen.runtime.timing.step_limits.StepLimits or None
        What time alone does to the whole model.
    """

    options: RunOptions
    treatment: str
    redundant: list[str]
    times: np.ndarray
    shown: np.ndarray
    step_limits: StepLimits | None = None

    def timetable_of(self, system: System, method: Method) -> Timetable | None:
        """Return what the steps of a subsystem keep to: what time does to the whole, if it depends on time."""
        step_limits = self.step_limits if system.structure["time_dependent"] else None
        if step_limits is None and self.options.max_step is None and not len(self.options.breaks):
            return None
        return timetable(step_limits, method, self.options)
