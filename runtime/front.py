"""What users hold in their hands: a model and a result, with doors to all that is done with them.

Nothing that runs inside imports this: it passes `symgen.runtime.system.System` and `symgen.runtime.solution.Solution`.
"""

from __future__ import annotations

import os
from functools import cached_property
from typing import TYPE_CHECKING, Any

from symgen.runtime.lazy import Late
from symgen.runtime.module import read_module
from symgen.runtime.options import RunOptions
from symgen.runtime.solution import Solution as SolutionData
from symgen.runtime.system import System as SystemData

if TYPE_CHECKING:
    from symgen.runtime.checks.entry import HealthCheck
    from symgen.runtime.linear.model import LinearModel
    from symgen.runtime.linear.modes import Modes

# A process that loads a model may do without running it, and one that runs it without checks and recordings.
simulation = Late("symgen.runtime.simulate")
health = Late("symgen.runtime.checks.health")
linear = Late("symgen.runtime.linear")
saving = Late("symgen.runtime.recording.save")


def load(path_or_text: str | os.PathLike[str]) -> System:
    """Load a generated module from a file or its text. Nothing in it is executed; nothing is compiled yet.

    Parameters
    ----------
    path_or_text : path-like or str
        A text is told from a path by its line breaks.

    Returns
    -------
    System

    Raises
    ------
    symgen.runtime.errors.ModuleError
        It is not a module of this ABI.
    """
    return System(read_module(path_or_text))


class System(SystemData):
    __doc__ = SystemData.__doc__

    def __reduce__(self):
        return System, (self.source,)

    def run(self, t_end: float | None = None, **options: Any) -> Solution:
        """Integrate the model; the options are those of `solve`."""
        return solve(self, t_end, **options)

    def linearise(self, at: Any = "equilibrium", **options: Any) -> LinearModel:
        """Return the linear model about a state; arguments are those of `symgen.runtime.linear.linearise`."""
        return linear.linearise(self, at, **options)

    def modes(self, at: Any = "equilibrium", **options: Any) -> Modes:
        """Return frequencies, damping and shapes of small motions; arguments are those of `linearise`."""
        return self.linearise(at, **options).modes()


class Solution(SolutionData):
    __doc__ = SolutionData.__doc__

    @classmethod
    def of(cls, plain: SolutionData) -> Solution:
        """Return a result with doors."""
        return cls(**{name: getattr(plain, name) for name in plain.__dataclass_fields__})

    @cached_property
    def health(self) -> list[HealthCheck]:
        """The health report, a list of `symgen.runtime.checks.entry.HealthCheck`."""
        return health.health_of(self)

    @property
    def objections(self) -> list[HealthCheck]:
        """The entries of the health report that are not ok."""
        return [entry for entry in self.health if not entry.ok]

    @property
    def advice(self) -> list[HealthCheck]:
        """The notes of the health report, which by themselves say nothing against the result."""
        return [entry for entry in self.health if entry.note]

    @property
    def ok(self) -> bool:
        """Whether the run came to a regular end and no health check objects."""
        return self.status in ("success", "terminated") and not self.objections

    def save(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Write a recording (`.rrd`); see `symgen.runtime.recording`."""
        saving.save_solution(self, path, **options)


def solve(system: SystemData, t_end: float | None = None, **options: Any) -> Solution:
    """Integrate a model from `t_start` to `t_end`.

    Parameters
    ----------
    system : System
    t_end : float, optional [s]
        The model's own `[run]` table by default.
    **options
        The other attributes of `symgen.runtime.options.RunOptions`.

    Returns
    -------
    Solution
        Also where the run failed: see its `status` and `message`.

    Raises
    ------
    RuntimeModelError
        An option does not fit, or the initial conditions contradict the constraints.
    """
    return Solution.of(simulation.simulate(system, RunOptions(t_end=t_end, **options)))
