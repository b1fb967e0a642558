"""One subsystem of a scene: where it stands in the whole, how it is integrated, and its run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.choose import EXPLICIT, SERIES
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.subsystems.choice import Chooser
from symgen.runtime.subsystems.member_run import MemberRun
from symgen.runtime.subsystems.rest import is_at_rest

if TYPE_CHECKING:
    from symgen.runtime.subsystems.choice import Choice
    from symgen.runtime.subsystems.member_model import Kind
    from symgen.runtime.subsystems.settings import Settings
    from symgen.runtime.system import System

_STEPS_LOGGED = 1024  # between two looks at a run


class Subsystem:
    """A subsystem, and others that start and move alike.

    Attributes
    ----------
    titles : list of str
        What it and its twins are called.
    system : System
        Its own model.
    columns : list of ndarray
        Where the coordinates and rates of each twin stand in (q, v) of the whole model.
    choice : Choice
    p, state : ndarray
        Its parameters and inputs, and its start.
    tolerance : float
        What it makes of the tolerances asked for.
    run : MemberRun
        Once it was prepared.
    """

    tolerance = 1.0

    def __init__(self, system: System, p: np.ndarray, t_start: float, state: np.ndarray, choice: Choice):
        self.system, self.choice, self.p, self.t_start, self.state = system, choice, p, t_start, state
        self.titles: list[str] = []
        self.columns: list[np.ndarray] = []
        self.run: MemberRun

    @property
    def name(self) -> str:
        """What it is called."""
        return self.titles[0]

    @cached_property
    def is_asleep(self) -> bool:
        """Whether it rests from the start on."""
        return not self.system.events and is_at_rest(self.system, self.p, self.t_start, self.state)

    def prepare(
        self, times: np.ndarray, shown: np.ndarray, stops: Sequence[float], settings: Settings
    ) -> None:
        """Make a run from the start, for some frames and times to land on."""
        system, method, t = self.system, self.choice.method, settings.options.t_start
        level = np.nan
        if system.m:
            wanted = settings.options.energy_scaling
            level = choose_energy_level(wanted, system, method, self.p, t, self.state)
        arrays = LoopArrays(
            system, method, self.p, t, self.state, frame_times=times, rtol=self.tolerance * settings.options.rtol,
            atol=self.tolerance * settings.options.atol, step=self.choice.step, energy_level=level,
            log_length=_STEPS_LOGGED,
        )  # fmt: skip
        self.run = MemberRun(
            system, method, arrays, shown, stops,
            fallback=METHODS[EXPLICIT] if settings.options.method == "auto" and method.name == SERIES else None,
            timetable=settings.timetable_of(system, method),
        )  # fmt: skip
        self.run.begin()

    def balances(self) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """Yield a title, T and V at the frames, shape (frames, 2), and the work done so far, shape (frames,)."""
        run, n = self.run, self.run.n_frames
        times, rows = run.arrays.frame_times[:n], run.arrays.frames[:n]
        work = run.reset_energy_at_frames[:n] + (rows[:, -1] if self.system.nw else 0.0)
        yield self.name, evaluate(self.system, "energy", run.arrays.p, times, rows), work


def subsystems(
    whole: System, kinds: Sequence[Kind], p: np.ndarray, state: np.ndarray, settings: Settings
) -> list[Subsystem]:
    """Return all subsystems of a scene, those with equal parameters and equal start as one.

    Parameters
    ----------
    p : ndarray
        Parameters and inputs of the whole.
    state : ndarray, shape (nq + nv,)
        Consistent initial state of the whole.
    """
    found = []
    for kind in kinds:
        chooser = Chooser(kind, settings)
        columns = np.hstack([kind.q, whole.nq + kind.v])
        own_p, starts = p[kind.p], state[columns]
        made: dict[bytes, Subsystem] = {}
        for number in range(len(columns)):
            key = own_p[number].tobytes() + starts[number].tobytes()
            if key not in made:
                choice = chooser.choose(own_p[number], starts[number])
                made[key] = Subsystem(
                    kind.system, own_p[number], settings.options.t_start, starts[number], choice
                )
            made[key].titles.append(f"subsystem of {whole.coordinates[kind.q[number, 0]]['name']}")
            made[key].columns.append(columns[number])
        found += made.values()
    return found
