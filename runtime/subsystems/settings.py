"""What a run of subsystems is asked to do; one of them gets the same as the whole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System
    from symgen.runtime.timing.course import Course
    from symgen.runtime.timing.timetable import Timetable


@dataclass(frozen=True)
class Settings:
    """The options of `symgen.runtime.solve.solve`, settled as far as they can be for all subsystems at once.

    Attributes
    ----------
    method, constraints : str
        As asked for, "auto" included.
    treatment : str
        How the whole model's constraints are treated.
    redundant : list of str
        Constraints that follow from the others.
    times, shown : ndarray
        Frames from start to end, and which of them were asked for.
    stops : sequence of float [s]
        Times to land on; the last is the end of the run.
    at : sequence of float [s]
        Those of them that were asked for.
    course : symgen.runtime.timing.course.Course or None
        What time alone does to the whole model.
    """

    method: str
    constraints: str
    treatment: str
    redundant: list[str]
    rtol: float
    atol: float
    step: float | None
    t_start: float
    t_end: float
    times: np.ndarray
    shown: np.ndarray
    stops: Sequence[float]
    at: Sequence[float]
    recorder: Any
    progress: Callable[[float, int], None] | None
    max_steps: int | None
    energy_scaling: bool | None
    fps: float | None
    split: bool | None
    max_step: float | None = None
    breaks: Sequence[float] = ()
    course: Course | None = None

    def timetable_of(self, system: System, method: Method) -> Timetable | None:
        """Return what the steps of a subsystem keep to: what time does to the whole, if it depends on time."""
        course = self.course if system.structure["time_dependent"] else None
        if course is None and self.max_step is None and not len(self.breaks):
            return None
        from symgen.runtime.timing.timetable import timetable

        return timetable(course, method, self.t_start, self.t_end, self.max_step, self.breaks)
