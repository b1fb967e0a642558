"""What users hold in their hands: a model and a result, with doors to all that is done with them.

Nothing that runs inside imports this: it passes `symgen.runtime.system.System` and `symgen.runtime.solution.Solution`.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import ModuleError, RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.module import read_module
from symgen.runtime.options import Quantity, RunOptions
from symgen.runtime.solution import Solution as SolutionData
from symgen.runtime.system import System as SystemData

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from symgen.runtime.checks.advice import Advice
    from symgen.runtime.checks.entry import HealthCheck
    from symgen.runtime.ensemble.result import Ensemble
    from symgen.runtime.linear.model import LinearModel
    from symgen.runtime.linear.modes import Modes
    from symgen.runtime.prepared.prepared import PreparedRun
    from symgen.runtime.robot import Robot
    from symgen.runtime.stepper import Stepper

# A process that loads a model may do without running it, and one that runs it without checks and recordings.
simulation = Late("symgen.runtime.simulate")
ensembles = Late("symgen.runtime.ensemble.run")
ensemble_options = Late("symgen.runtime.ensemble.options")
preparing = Late("symgen.runtime.prepared.prepared")
health = Late("symgen.runtime.checks.health")
linear = Late("symgen.runtime.linear")
saving = Late("symgen.runtime.recording.save")
stepping = Late("symgen.runtime.stepper")
advising = Late("symgen.runtime.checks.advice")
results = Late("symgen.runtime.result_json")
tables = Late("symgen.runtime.tables")
notebook = Late("symgen.runtime.report.notebook")


def load(path_or_text: str | os.PathLike[str], rest: Callable[[], str] | None = None) -> System:
    """Load a generated module from a file or its text. Nothing in it is executed; nothing is compiled yet.

    Parameters
    ----------
    path_or_text : path-like or str
        A text is told from a path by its line breaks.
    rest : callable, optional
        Gives the text of the whole module where this one leaves functions out until a run asks for them.

    Returns
    -------
    System

    Raises
    ------
    symgen.runtime.errors.ModuleError
        It is not a module of this ABI.
    """
    source = read_module(path_or_text, rest and (lambda: read_module(rest())))
    if "robot" in source.header:
        raise ModuleError(
            source.file,
            "",
            "it has functions for robot programs, not those of a run",
            "use symgen.runtime.load_robot",
        )
    return System(source)


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
    keep: str = "all",
) -> Solution:
    """Integrate a model from `t_start` to `t_end`; what each option says: `symgen.runtime.RunOptions`.

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
        keep=keep,
    )
    return Solution.of(simulation.simulate(system, asked), asked)


class System(SystemData):
    __doc__ = SystemData.__doc__

    def __reduce__(self):
        return _with_robot, (self.source, self.__dict__.get("_robot"))

    run = solve

    def prepare(
        self,
        t_end: Quantity | None = None,
        *,
        method: str = "auto",
        rtol: float = 1e-8,
        atol: float = 1e-10,
        step: Quantity | None = None,
        constraints: str = "auto",
        parameters: Sequence[str] | Mapping[str, Quantity] | None = None,
        start: Sequence[str] | Mapping[str, Quantity] | None = None,
        inputs: Mapping[Any, Any] | None = None,
        output: str | Sequence[Quantity] = "end",
        checks: str = "none",
        t_start: Quantity = 0.0,
        max_steps: int | None = None,
        energy_scaling: bool | None = None,
        split: bool | None = None,
        max_step: Quantity | None = None,
        breaks: Sequence[Quantity] = (),
    ) -> PreparedRun:
        """Prepare a run for calls with other parameters and starts: `run(p, y0)`, `run.many(P, Y0)`.

        What is not named here is as in `run`.

        Parameters
        ----------
        parameters : sequence of str, or mapping of str to float or str, optional
            Names of what `p` holds, parameters and inputs; all by default. Values are what is taken in calls
            without `p`, in place of the model's.
        start : sequence of str, or mapping of str to float or str, optional
            Names of what `y0` holds: coordinates, and rates as "dot(x)" or by names of their own. By default the whole
            state: all coordinates, then all rates.
        output : {"end", "solution"} or sequence of float [s]
            What a call returns: the state (q, v) at the end, or at some times; or a whole `Solution`.
        checks : {"none", "end", "full"}
            Nothing beyond what the run itself notices; energy and constraints; the health report.

        Returns
        -------
        symgen.runtime.prepared.prepared.PreparedRun

        Examples
        --------
        >>> run = system.prepare(10.0, parameters=["L"], start=["theta"])
        >>> q_and_v = run([0.5], [0.1])
        >>> runs = run.many(lengths[:, None], angles[:, None], threads=2)
        """
        options = RunOptions(
            t_end=t_end, method=method, rtol=rtol, atol=atol, step=step, constraints=constraints, inputs=inputs,
            t_start=t_start, max_steps=max_steps, energy_scaling=energy_scaling, split=split, max_step=max_step,
            breaks=breaks,
        )  # fmt: skip
        return preparing.PreparedRun(
            self,
            options,
            parameters=parameters,
            start=start,
            output=output,
            checks=checks,
            finish=Solution.of,
        )

    def ensemble(
        self,
        t_end: Quantity | None = None,
        *,
        n: int | None = None,
        seed: int = 0,
        parameters: Any = None,
        start: Any = None,
        rate: Any = None,
        inputs: Any = None,
        design: str = "random",
        method: str = "auto",
        rtol: float = 1e-8,
        atol: float = 1e-10,
        step: Quantity | None = None,
        keep: str | Sequence[str] | None = "end",
        frames: int | Sequence[float] | None = None,
        reduce: Mapping[str, Any] | None = None,
        device: str = "cpu",
        threads: int | None = None,
        executor: Any = None,
        out: str | os.PathLike[str] | None = None,
        resume: bool = False,
        t_start: float = 0.0,
        max_steps: int | None = None,
        progress: Callable[[int, int, int], None] | None = None,
        energy_scaling: bool | None = None,
    ) -> Ensemble:
        """Run the model many times, with parameters and starts that differ; see docs/ensembles.md.

        What each option says: `symgen.runtime.ensemble.options.EnsembleOptions`. Results depend neither on the number
        of threads nor on which other members there are, to the last bit.

        Returns
        -------
        symgen.runtime.ensemble.Ensemble
            `e["theta"]`, `e.failed`, `e.health`, `e.member(17)`.

        Raises
        ------
        RuntimeModelError
            An option does not fit the model, or the first member has no start on the constraints.

        Examples
        --------
        >>> e = system.ensemble(10, n=1000, seed=1, parameters={"L2": normal(1.0, 0.01)}, rtol=1e-9)
        """
        asked = ensemble_options.EnsembleOptions(
            t_end=t_end,
            n=n,
            seed=seed,
            parameters=parameters,
            start=start,
            rate=rate,
            inputs=inputs,
            design=design,
            method=method,
            rtol=rtol,
            atol=atol,
            step=step,
            keep=keep,
            frames=frames,
            reduce=reduce,
            device=device,
            threads=threads,
            executor=executor,
            out=out,
            resume=resume,
            t_start=t_start,
            max_steps=max_steps,
            progress=progress,
            energy_scaling=energy_scaling,
        )
        found = ensembles.run_ensemble(self, asked)
        found.present = Solution.of
        return found

    @property
    def robot(self) -> Robot:
        """What robot programs call, see `symgen.runtime.robot.Robot`: derived where `symgen.load` is asked for it.

        Raises
        ------
        RuntimeModelError
            It was not.
        """
        if "_robot" not in self.__dict__:
            raise RuntimeModelError(
                f"model {self.name!r} was loaded without functions for robot programs: give functions='robot' (and "
                "frames) to symgen.load, or ask symgen.robot for them alone"
            )
        return self.__dict__["_robot"]

    def with_robot(self, robot: Robot) -> System:
        """Return this system with what robot programs call of the same model."""
        made = System(self.source)
        made.__dict__["_robot"] = robot
        return made

    def inverse_dynamics(self, q: Any, v: Any, a: Any, parameters: Any = None) -> np.ndarray:
        """`Robot.inverse_dynamics`."""
        return self.robot.inverse_dynamics(q, v, a, parameters)

    def mass_matrix(self, q: Any, parameters: Any = None) -> np.ndarray:
        """`Robot.mass_matrix`."""
        return self.robot.mass_matrix(q, parameters)

    def coriolis(self, q: Any, v: Any, parameters: Any = None) -> np.ndarray:
        """`Robot.coriolis`."""
        return self.robot.coriolis(q, v, parameters)

    def gravity(self, q: Any, parameters: Any = None) -> np.ndarray:
        """`Robot.gravity`."""
        return self.robot.gravity(q, parameters)

    def forward_kinematics(self, frame: str, q: Any, parameters: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """`Robot.forward_kinematics`."""
        return self.robot.forward_kinematics(frame, q, parameters)

    def jacobian(self, frame: str, q: Any, parameters: Any = None) -> np.ndarray:
        """`Robot.jacobian`."""
        return self.robot.jacobian(frame, q, parameters)

    def stepper(
        self,
        method: str = "dop853",
        *,
        rtol: float = 1e-8,
        atol: float = 1e-10,
        parameters: Mapping[str, Quantity] | None = None,
        t: float = 0.0,
    ) -> Stepper:
        """Return what moves a state on by given times, in arrays that are made once; see `step`.

        Parameters
        ----------
        method : str
            One that chooses its own steps.
        rtol, atol : float
        parameters : mapping of str to float or str, optional
        t : float [s]
            The start, where `Stepper.state` is consistent with the constraints.

        Raises
        ------
        RuntimeModelError
            The model has stops, friction that sticks, or resets, which need `run`.
        """
        return stepping.Stepper(self, method, rtol=rtol, atol=atol, parameters=parameters, t=t)

    def step(
        self,
        state: np.ndarray,
        inputs: Mapping[str, float] | Sequence[float] | None,
        dt: float,
        *,
        t: float = 0.0,
    ) -> np.ndarray:
        """Move a state on by `dt`, in place: for loops that live in Python.

        It is `stepper()` at the model's own parameters; other parameters, methods and tolerances are its.

        Parameters
        ----------
        state : ndarray, shape (nq + nv,)
            (q, v), consistent with the constraints; written in place.
        inputs : sequence of float in the order of the model, mapping by name, or None
            Held during the step; those before it in this thread, at first the model's own, with None.
        dt : float [s]
        t : float [s]
            When the step begins; it matters to models in which time occurs.

        Returns
        -------
        ndarray, shape (nq + nv,)
            `state`.

        Raises
        ------
        RuntimeModelError
            The method cannot go on, or `state` is an array that cannot hold the result.
        """
        if isinstance(state, np.ndarray) and (state.dtype != float or state.shape != (self.nq + self.nv,)):
            raise RuntimeModelError(
                f"state is an array of {state.dtype}, shape {state.shape}, in which the result is to stand: "
                f"give one of float64, shape ({self.nq + self.nv},)"
            )
        of_thread = self.__dict__.setdefault("_steppers", threading.local())
        if "stepper" not in vars(of_thread):
            of_thread.stepper = self.stepper()
        stepper = of_thread.stepper
        stepper.t = t
        stepper.state[:] = state
        state[:] = stepper.step(dt, inputs)
        return state

    def advise(
        self,
        t_end: Quantity | None = None,
        *,
        parameters: Mapping[str, Quantity] | None = None,
        start: Mapping[str, Quantity] | None = None,
        rate: Mapping[str, Quantity] | None = None,
        method: str | None = None,
        step: float | None = None,
        steps_per_period: int | None = None,
    ) -> Advice:
        """Return which step and method suit the model, as data: time scales, limits of stability, costs, reasons.

        Parameters
        ----------
        t_end : float or str, optional [s]
            The model's own `[run]` table by default; ten periods of the slowest motion where that says nothing.
        parameters, start, rate : mapping of str to float or str, optional
        method, step : str, float [s], optional
            A choice to judge: `Advice.ok` says whether it suits.
        steps_per_period : int, optional
            Of the rule that a step is a part of the fastest period; 50 by default.

        Returns
        -------
        symgen.runtime.checks.advice.Advice
            `lines()` are its words, `to_dict()` what `symgen advise --json` writes.
        """
        asked = RunOptions(
            t_end=t_end, parameters=parameters, start=start, rate=rate, method=method or "auto"
        )
        if t_end is None and "t_end" not in self.run_defaults:
            asked = replace(asked, t_end=advising.length_to_see(self, asked))
        chosen = None if method is None and step is None else (asked.method, step)
        return advising.advise(self, asked, steps_per_period=steps_per_period, chosen=chosen)

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


def _with_robot(source: Any, robot: Robot | None) -> System:
    system = System(source)
    return system if robot is None else system.with_robot(robot)


class Solution(SolutionData):
    __doc__ = SolutionData.__doc__

    asked: RunOptions | None = None

    @classmethod
    def of(cls, plain: SolutionData, asked: RunOptions | None = None) -> Solution:
        """Return a result with doors.

        Parameters
        ----------
        plain : symgen.runtime.solution.Solution
        asked : RunOptions, optional
            What the run was asked; without it, `solution(t)` cannot be had.
        """
        made = cls.__new__(cls)
        vars(made).update(vars(plain), asked=asked)
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

    def __call__(self, t: float | Sequence[float] | np.ndarray) -> np.ndarray:
        """Return the state at any time of the run, by dense output of the method.

        Frames change no step, so the run is repeated with these as its frames: states between frames are as
        exact as those at frames, for any method, with constraints and events. Each call takes as long as the run:
        ask for many times at once, or give them to the run as `t_eval`.

        Parameters
        ----------
        t : float or array_like [s]

        Returns
        -------
        ndarray, shape (nq + nv,), or t.shape + (nq + nv,)
            (q, v).

        Raises
        ------
        RuntimeModelError
            A time lies outside the run, or the run cannot be repeated.
        """
        times = np.asarray(t, dtype=float)
        if self.asked is None:
            raise RuntimeModelError(
                "it is not known how this run was asked for, so it cannot be repeated: use t_eval"
            )
        first, last = self.t[0], self.t[-1]
        if not np.all((times >= first) & (times <= last)):
            raise RuntimeModelError(
                f"t: the run is from {first:.9g} s to {last:.9g} s, and knows no state outside"
            )
        asked = replace(self.asked, t_eval=np.unique(times), fps=None, at=(), progress=None, recorder=None)
        again = simulation.simulate(self.system, asked)
        if again.stats["steps"] != self.stats["steps"] or not np.array_equal(
            again.states[-1], self.states[-1]
        ):
            raise RuntimeModelError(
                "the run went another way when it was repeated, as with controllers that remember former runs: "
                "use t_eval"
            )
        return again.states[np.searchsorted(again.t, times)]

    def to_dict(self) -> dict[str, Any]:
        """Return the result as `symgen run --json` writes it: end state, samples, events, statistics, health."""
        return results.result(self)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all series over time as text: a line of names, then numbers that read back bit for bit."""
        tables.columns_of(self).write_csv(path)

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write all series over time as a Parquet file, with units as metadata of its fields."""
        tables.columns_of(self).write_parquet(path)

    def to_dataframe(self) -> pandas.DataFrame:
        """Return all series as a pandas DataFrame over the time; `attrs["units"]` has the units.

        Raises
        ------
        symgen.runtime.tables.MissingPackage
            pandas is not installed.
        """
        tables.need("pandas", "tables", "to_dataframe")
        return tables.columns_of(self).to_dataframe()

    def to_xarray(self) -> xarray.Dataset:
        """Return all series as an xarray Dataset over the time, with units as attributes.

        Raises
        ------
        symgen.runtime.tables.MissingPackage
            xarray is not installed.
        """
        tables.need("xarray", "tables", "to_xarray")
        return tables.columns_of(self).to_xarray(
            model=self.system.name, method=self.method, status=self.status
        )

    def plot(self, *names: str) -> Figure:
        """Draw series over time, those of a unit in one diagram.

        Parameters
        ----------
        *names : str
            What `solution[name]` knows; all coordinates by default.

        Returns
        -------
        matplotlib.figure.Figure
            Notebooks show it; `figure.savefig(path)` writes it.

        Raises
        ------
        symgen.runtime.tables.MissingPackage
            matplotlib is not installed.
        """
        tables.need("matplotlib", "figures", "plot")
        return notebook.plot(self, names)

    def _repr_html_(self) -> str:
        return notebook.html(self)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        model_text: str = "",
        title: str = "",
        mesh_folder: str | os.PathLike[str] | None = None,
        content: str = "all",
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
        content : {"all", "states"}
            All that is shown, or states alone, a tenth of the size: poses and curves are worked out when it is played.
        """
        saving.save_solution(
            self, path, model_text=model_text, title=title, mesh_folder=mesh_folder, content=content
        )
