"""What users hold in their hands: a model and a result, with doors to all that is done with them.

Nothing that runs inside imports this: it passes `symgen.runtime.system.System` and `symgen.runtime.solution.Solution`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from symgen.runtime.lazy import Late
from symgen.runtime.module import read_module
from symgen.runtime.options import Quantity, RunOptions
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

    def run(
        self,
        t_end: Quantity | None = None,
        *,
        method: str = "auto",
        rtol: float = 1e-8,
        atol: float = 1e-10,
        step: Quantity | None = None,
        constraints: str = "auto",
        parameters: Mapping[str, Quantity] | None = None,
        start: Mapping[str, Quantity] | None = None,
        rate: Mapping[str, Quantity] | None = None,
        inputs: Mapping[Any, Any] | None = None,
        at: Sequence[Quantity] = (),
        fps: float | None = None,
        t_eval: Sequence[Quantity] | None = None,
        t_start: Quantity = 0.0,
        progress: Callable[[float, int], None] | None = None,
        recorder: Any = None,
        max_steps: int | None = None,
        energy_scaling: bool | None = None,
        split: bool | None = None,
        max_step: Quantity | None = None,
        breaks: Sequence[Quantity] = (),
    ) -> Solution:
        """Integrate the model from `t_start` to `t_end`; what each option says: `symgen.runtime.RunOptions`.

        Returns
        -------
        Solution
            Also where the run failed: see its `status` and `message`.

        Raises
        ------
        RuntimeModelError
            An option does not fit, or the initial conditions contradict the constraints.

        Examples
        --------
        >>> solution = system.run("10 s", parameters={"L": "50 cm"}, start={"theta": "20 deg"}, method="dop853")
        """
        return solve(
            self,
            t_end=t_end,
            method=method,
            rtol=rtol,
            atol=atol,
            step=step,
            constraints=constraints,
            parameters=parameters,
            start=start,
            rate=rate,
            inputs=inputs,
            at=at,
            fps=fps,
            t_eval=t_eval,
            t_start=t_start,
            progress=progress,
            recorder=recorder,
            max_steps=max_steps,
            energy_scaling=energy_scaling,
            split=split,
            max_step=max_step,
            breaks=breaks,
        )

    def linearise(
        self,
        at: str | tuple[Sequence[float], Sequence[float]] = "equilibrium",
        *,
        parameters: Mapping[str, Quantity] | None = None,
        start: Mapping[str, Quantity] | None = None,
        rate: Mapping[str, Quantity] | None = None,
        t: float = 0.0,
        stable: bool = False,
        outputs: Sequence[str] | None = None,
    ) -> LinearModel:
        """Return the linear model about a state: A, B, C, D on independent coordinates.

        Parameters
        ----------
        at : {"equilibrium", "start"} or (q, v)
            Where: a state of rest near the start; the start itself, moving or not; or a state.
        parameters : mapping of str to float or str, optional
            Values of parameters and inputs. An input over time has its value at `t`.
        start, rate : mapping of str to float or str, optional
            Start values of coordinates and rates.
        t : float [s]
        stable : bool
            Whether an equilibrium must be a stable one.
        outputs : sequence of str, optional
            What y is: names of coordinates and outputs, `dot(x)`, `dot(dot(x))`. All coordinates and outputs by
            default.

        Raises
        ------
        RuntimeModelError
            There is no equilibrium, derivatives are not finite there, or a name is unknown.
        """
        return linear.linearise(
            self, at, parameters=parameters, start=start, rate=rate, t=t, stable=stable, outputs=outputs
        )

    def modes(
        self,
        at: str | tuple[Sequence[float], Sequence[float]] = "equilibrium",
        *,
        parameters: Mapping[str, Quantity] | None = None,
        start: Mapping[str, Quantity] | None = None,
        rate: Mapping[str, Quantity] | None = None,
        t: float = 0.0,
        stable: bool = False,
        outputs: Sequence[str] | None = None,
    ) -> Modes:
        """Return frequencies, damping and shapes of small motions; arguments are those of `linearise`."""
        return self.linearise(
            at, parameters=parameters, start=start, rate=rate, t=t, stable=stable, outputs=outputs
        ).modes()


class Solution(SolutionData):
    __doc__ = SolutionData.__doc__

    @classmethod
    def of(cls, plain: SolutionData, asked: RunOptions | None = None) -> Solution:
        """Return a result with doors.

        Parameters
        ----------
        plain : symgen.runtime.solution.Solution
        asked : RunOptions, optional
            What the run was asked; without it, `solution(t)` cannot be had.
        """
        made = cls(**{name: getattr(plain, name) for name in plain.__dataclass_fields__})
        made.asked = asked
        return made

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

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        model_text: str = "",
        title: str = "",
        mesh_folder: str | os.PathLike[str] | None = None,
    ) -> None:
        """Write a recording (`.rrd`), for `symgen play` and `symgen verify`.

        Parameters
        ----------
        path : path-like
        model_text : str, optional
            The model as its author wrote it.
        title : str, optional
            The model's name otherwise.
        mesh_folder : path-like, optional
            The model's folder, below which its meshes lie.
        """
        saving.save_solution(self, path, model_text=model_text, title=title, mesh_folder=mesh_folder)


def solve(
    system: SystemData,
    t_end: Quantity | None = None,
    *,
    method: str = "auto",
    rtol: float = 1e-8,
    atol: float = 1e-10,
    step: Quantity | None = None,
    constraints: str = "auto",
    parameters: Mapping[str, Quantity] | None = None,
    start: Mapping[str, Quantity] | None = None,
    rate: Mapping[str, Quantity] | None = None,
    inputs: Mapping[Any, Any] | None = None,
    at: Sequence[Quantity] = (),
    fps: float | None = None,
    t_eval: Sequence[Quantity] | None = None,
    t_start: Quantity = 0.0,
    progress: Callable[[float, int], None] | None = None,
    recorder: Any = None,
    max_steps: int | None = None,
    energy_scaling: bool | None = None,
    split: bool | None = None,
    max_step: Quantity | None = None,
    breaks: Sequence[Quantity] = (),
) -> Solution:
    """Integrate a model from `t_start` to `t_end`, as `System.run` does."""
    asked = RunOptions(
        t_end=t_end,
        method=method,
        rtol=rtol,
        atol=atol,
        step=step,
        constraints=constraints,
        parameters=parameters,
        start=start,
        rate=rate,
        inputs=inputs,
        at=at,
        fps=fps,
        t_eval=t_eval,
        t_start=t_start,
        progress=progress,
        recorder=recorder,
        max_steps=max_steps,
        energy_scaling=energy_scaling,
        split=split,
        max_step=max_step,
        breaks=breaks,
    )
    return Solution.of(simulation.simulate(system, asked), asked)
