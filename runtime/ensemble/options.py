"""What an ensemble is asked for: one record, checked where it is made."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.record import record

Quantity = float | str
_MOST_FRAMES = 1 << 24  # of one member: as many as stores take
DESIGNS = ("random", "sobol", "saltelli")


@record
class EnsembleOptions:
    """How to run an ensemble.

    Attributes
    ----------
    t_end : float or str, optional [s]
        The model's own `[run]` table by default.
    n : int, optional
        Members to draw for each point of the grids.
    seed : int
    parameters, start, rate : mapping, optional
        By name: a number or quantity, which all members have; a sampler (`normal`, `uniform`, …); a grid (`linspace`,
        `grid`), of which every value goes with every one of the others; an array, row by row. A DataFrame's columns
        are arrays. Inputs stand among the parameters.
    method : str
        "auto" chooses once for all members, by a sample of them. "dop853", "taylor", "radau5", "radau9", "radau13",
        "rk4", "verlet" run in lanes, all others one member after another.
    rtol, atol : float
    step : float or str, optional [s]
        Of fixed-step methods.
    keep : "end", sequence of str, or None
        What is kept of each member: the state at the end, or some series by name; None: nothing but reductions.
    frames : int or sequence of float [s], optional
        Times at which series are kept and reduced, instead of the end alone: so many from start to end, or these.
    reduce : mapping of str to sequence, optional
        Statistics that are merged as members come in: "mean", "std", "min", "max", "count", `quantiles(…)`,
        `histogram(…)` of series by name, or of what a function of a member's series gives, as (function, statistics).
    device : {"cpu", "cuda"}
        Where members run: in lanes of this machine's processors, or a thread each on a graphics processor of NVIDIA, to
        the same bits; see docs/gpu.md.
    threads : int, optional
        By default as many as processors are free to use.
    executor : concurrent.futures.Executor or distributed.Client, optional
        Where to work instead of threads here.
    out : path, optional
        A Zarr store in which members are kept instead of in memory; workers write it, where they can reach it.
    resume : bool
        Whether to go on with what the store holds.
    inputs : mapping, optional
        Inputs over time, as in `RunOptions`, or `noise(…)`, which is another one for each member.
    design : {"random", "sobol", "saltelli"}
        How draws fill their space: each by itself; evenly; so that `Ensemble.sensitivity` has all indices.
    t_start : float [s]
    max_steps : int, optional
        A member fails after this many.
    progress : callable, optional
        Called with (members done, members, failures so far) now and then.
    energy_scaling : bool, optional
        As in `RunOptions`.
    """

    t_end: Quantity | None = None
    n: int | None = None
    seed: int = 0
    parameters: Any = None
    start: Any = None
    rate: Any = None
    method: str = "auto"
    rtol: float = 1e-8
    atol: float = 1e-10
    step: Quantity | None = None
    keep: str | Sequence[str] | None = "end"
    frames: int | Sequence[float] | None = None
    reduce: Mapping[str, Any] | None = None
    device: str = "cpu"
    threads: int | None = None
    executor: Any = field(default=None, repr=False)
    out: str | os.PathLike[str] | None = None
    resume: bool = False
    inputs: Any = None
    design: str = "random"
    t_start: float = 0.0
    max_steps: int | None = None
    progress: Callable[[int, int, int], None] | None = field(default=None, repr=False)
    energy_scaling: bool | None = None

    def __post_init__(self):
        if isinstance(self.keep, str) and self.keep != "end":
            raise RuntimeModelError(
                f'keep is {self.keep!r}: give "end", a list of names such as ["theta"], or None'
            )
        if self.device not in ("cpu", "cuda"):
            raise RuntimeModelError(
                f'device is {self.device!r}: give "cpu", or "cuda" for a graphics processor of NVIDIA'
            )
        if self.threads is not None and self.threads < 1:
            raise RuntimeModelError(f"threads is {self.threads}: at least one has to work")
        if isinstance(self.frames, int) and self.frames < 2:
            raise RuntimeModelError(
                f"frames is {self.frames}: give at least 2, or leave it out for the end alone"
            )
        if isinstance(self.frames, int) and self.frames > _MOST_FRAMES:
            raise RuntimeModelError(f"frames is {self.frames}: give {_MOST_FRAMES} at most")
        if self.design not in DESIGNS:
            raise RuntimeModelError(f"design is {self.design!r}: {nearest(str(self.design), DESIGNS)}")
        if self.resume and self.out is None:
            raise RuntimeModelError("resume goes on with the store of out: name it")
        if int(self.seed) < 0:
            raise RuntimeModelError(f"seed is {self.seed}: give a whole number that is not negative")
