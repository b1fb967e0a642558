"""What a run is asked to do: one record, checked where it is made; variations are made with `dataclasses.replace`."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.frame_grid import MOST_KEPT, FrameGrid, before_end, frames_of, most_kept
from symgen.runtime.lazy import Late
from symgen.runtime.record import record
from symgen.runtime.size import more_than_memory

if TYPE_CHECKING:
    from symgen.runtime.system import System

# Most runs are given numbers.
quantities = Late("symgen.runtime.quantities")

Quantity = float | str  # an SI value, or text such as "20 deg"
SMALLEST_RTOL = 1e-15  # a few units of the last digit
_TIMES, _LISTS_OF_TIMES = ("t_end", "t_start", "step", "max_step"), ("at", "breaks", "t_eval")
_FPS = 60.0
_LEAST_FRAMES, _MOST_FRAMES = 200, MOST_KEPT
# Each of these is a projection and a copy: of states of so many numbers every frame, of twice as many every second one,
# and so on to every fifth.
_NUMBERS_OF_ALL, _SPARSEST = 1200, 5
KEEPS = ("all", "checked")
_FEWEST_CHECKED = 16  # where an event has ended a run early
_EARLY = np.ravel(
    0.5 ** np.arange(1, 21)[:, None] * np.arange(9, 17) / 8.0
)  # parts of a run, eight in each half
_BESIDE_FRAMES = 5  # numbers of each: its time, in several arrays on the way, and its energies
_SHORTEST_RUN = 1e-150  # [s]: squares of the steps must not underflow
SAME_TICKS = 4  # of floating-point time: times that are nearer to each other are one
_LEAST_TICKS = 1000  # of floating-point time in a run


@record
class RunOptions:
    """How to integrate a model.

    Attributes
    ----------
    t_end : float or str, optional [s]
        The model's own `[run]` table by default. Times, parameters, starts and inputs may be quantities as text, as
        in model files: "2 min", "50 cm", "20 deg".
    method : str
        One of `symgen.runtime.integrate.methods.METHODS`, or "auto".
    rtol, atol : float
        Tolerances of adaptive methods, per step and component.
    step : float, optional [s]
        Of fixed-step methods; by default a part of the fastest period at the start with which an oscillation is
        right for a hundred of them: 1/14 with high orders, 1/50 at order 4, 1/200 at order 2.
    constraints : str
        "projection", another form of `symgen.runtime.integrate.forms.FORMS` that the method has, or "auto".
    parameters : mapping of str to float or str, optional
        Values other than the model's.
    start, rate : mapping of str to float or str, optional
        Initial values of coordinates and rates, enforced.
    inputs : mapping, optional
        By name: a number, a quantity, a pair (times, values), a function of time (taken as polynomials in pieces; a
        note says how far they are off), or a Table, Polynomial or Controller of `symgen.runtime.inputs`; the latter
        also by a tuple of names, for several inputs at once. The model's own otherwise.
    at : sequence of float [s]
        Times at which states are kept as samples; they change no step.
    fps : float, optional
        Frames per second of simulated time; by default 60, but at least 200 and at most 20 000 frames in all.
    t_eval : sequence of float, optional [s]
        The times of the frames, instead of `fps`; the start and the end of the run are frames in any case. As with
        all frames, states there come from dense output of the method, and change no step.
    t_start : float [s]
    progress : callable, optional
        Called with (t, steps) now and then.
    recorder : object, optional
        `symgen.runtime.recording.recorder.RunRecorder`, or a callable that makes one: it is called with `system`, `p`,
        `method`, `constraints`, `rtol`, `atol` and `options` once these are settled.
    max_steps : int, optional
        Fail after this many steps.
    energy_scaling : bool, optional
        Whether rates are scaled after each step so that a conservative model with constraints keeps its energy; by
        default where that suits model and method. Health checks count the errors that it takes away.
    split : bool, optional
        Whether independent subsystems are integrated by themselves; by default where that pays.
    max_step : float, optional [s]
        The longest step of an adaptive method.
    breaks : sequence of float [s]
        Times that steps land on, and behind which the step is chosen anew: where something changes that no error
        estimate can see before. What the model does at times of its own is found without being named.
    keep : str
        Which frames the solution has: "all", or "checked", which are no more than checks look at, 20 000 at most (fewer
        of large models), evenly thinned, and those at which energies and residuals are largest. The memory of a run
        then does not grow with the number of its frames, all of which a recorder is given; it copies what it keeps,
        as the arrays are used again. Runs that are split into subsystems keep all.

    Raises
    ------
    RuntimeModelError
        An option makes no sense, whatever the model.
    """

    t_end: Quantity | None = None
    method: str = "auto"
    rtol: float = 1e-8
    atol: float = 1e-10
    step: Quantity | None = None
    constraints: str = "auto"
    parameters: Mapping[str, Quantity] | None = None
    start: Mapping[str, Quantity] | None = None
    rate: Mapping[str, Quantity] | None = None
    inputs: Mapping[Any, Any] | None = None
    at: Sequence[Quantity] = ()
    fps: float | None = None
    t_eval: Sequence[Quantity] | None = None
    t_start: Quantity = 0.0
    progress: Callable[[float, int], None] | None = field(default=None, repr=False)
    recorder: Any = field(default=None, repr=False)
    max_steps: int | None = None
    energy_scaling: bool | None = None
    split: bool | None = None
    max_step: Quantity | None = None
    breaks: Sequence[Quantity] = ()
    keep: str = "all"

    def __post_init__(self):
        for name in _TIMES:
            if isinstance(getattr(self, name), str):
                object.__setattr__(self, name, quantities.in_si(getattr(self, name), "s", name))
        for name in _LISTS_OF_TIMES:
            values = getattr(self, name)
            if values is not None and any(isinstance(value, str) for value in values):
                values = tuple(quantities.in_si(value, "s", name) for value in values)
                object.__setattr__(self, name, values)
        for name in ("rtol", "atol"):
            try:
                value = float(getattr(self, name))
            except TypeError:
                raise RuntimeModelError(
                    f"{name} is {getattr(self, name)!r}: give one number, for all coordinates and rates"
                ) from None
            if not (math.isfinite(value) and value >= 0.0):
                raise RuntimeModelError(
                    f"{name} is {value}: give a number that is not negative, such as 1e-8"
                )
            object.__setattr__(self, name, value)
        object.__setattr__(self, "t_start", float(self.t_start))
        if self.max_steps is not None and self.max_steps < 1:
            raise RuntimeModelError(
                f"max_steps is {self.max_steps}: allow at least one step, or leave it out"
            )
        if self.keep not in KEEPS:
            raise RuntimeModelError(f"keep is {self.keep!r}: give one of {', '.join(KEEPS)}")
        if self.fps is not None and self.t_eval is not None:
            raise RuntimeModelError("fps and t_eval both say which frames there are: give one of them")
        if self.fps is not None and not (np.isfinite(self.fps) and self.fps > 0.0):
            raise RuntimeModelError(f"fps is {self.fps}: give a positive number of frames per second")

    def for_model(self, system: System) -> RunOptions:
        """Return the options with the end of the run, which may be the model's.

        Raises
        ------
        RuntimeModelError
            Nobody says how long to run, numbers cannot tell the times of the run apart, or a time of `at` lies outside.
        """
        t_start, t_end = self.t_start, self.t_end
        if t_end is None:
            t_end = system.run_defaults.get("t_end")
        if t_end is None:
            raise RuntimeModelError(f"model {system.name!r} does not say how long to run: give t_end")
        t_end = float(t_end)
        if not (np.isfinite(t_start) and np.isfinite(t_end) and t_end > t_start):
            raise RuntimeModelError(f"t_end is {t_end} s: it must lie after t_start = {t_start} s")
        least = max(_SHORTEST_RUN, _LEAST_TICKS * time_resolution(t_start, t_end))
        if t_end - t_start < least:
            raise RuntimeModelError(
                f"t_end is {t_end!r} s, only {t_end - t_start:.2g} s after t_start = {t_start!r} s: numbers cannot "
                f"tell the times of steps apart in a run shorter than {least:.1g} s there; run longer, or start "
                "nearer to t = 0"
            )
        for t in self.at:
            if not t_start <= t <= t_end:
                raise RuntimeModelError(f"at: {t} s is outside the run, from {t_start} s to {t_end} s")
        if self.t_eval is not None and not all(t_start <= t <= t_end for t in self.t_eval):
            outside = next(t for t in self.t_eval if not t_start <= t <= t_end)
            raise RuntimeModelError(f"t_eval: {outside} s is outside the run, from {t_start} s to {t_end} s")
        return self if type(self.t_end) is float else replace(self, t_end=t_end)

    def recorder_for(
        self, system: System, p: np.ndarray, method: str, treatment: str, asked: dict[str, Any]
    ) -> Any:
        """Return what records a run, made now where the options have what makes one; None where nobody records.

        Parameters
        ----------
        method, treatment : str
            Of the run: neither is "auto".
        asked : dict
            What a recording says of the run besides.
        """
        if self.recorder is None or hasattr(self.recorder, "frames"):
            return self.recorder
        return self.recorder(
            system=system,
            p=p,
            method=method,
            constraints=treatment,
            rtol=self.rtol,
            atol=self.atol,
            options=asked,
        )

    @property
    def span(self) -> float:
        """The length of the run [s]."""
        return self.t_end - self.t_start

    @property
    def stops(self) -> list[float]:
        """The times at which states are wanted, in order, the end of the run last."""
        wanted = sorted({float(t) for t in self.at})
        return wanted if wanted and wanted[-1] == self.t_end else [*wanted, self.t_end]

    def frame_times(self, n_numbers: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Return the times of all frames, from start to end, and which of them the user asked for.

        Few frames are filled up to 200, of large models to 40 to 100, for checks of energy and constraints.

        Parameters
        ----------
        n_numbers : int, optional
            Of a state.

        Raises
        ------
        RuntimeModelError
            Memory cannot hold so many frames.
        """
        t_start, t_end, fps, span = self.t_start, self.t_end, self.fps, self.span
        if fps is None and self.t_eval is None:
            return _even_frames(t_start, t_end)
        filled = _filling(t_start, t_end)[:: min(max(n_numbers // _NUMBERS_OF_ALL, 1), _SPARSEST)]
        if self.t_eval is not None:
            return _filled_up(np.unique([t_start, *self.t_eval, t_end]), filled)
        self._refuse_more_than_memory(n_numbers)
        wanted = frames_of(t_start, fps, 0, int(np.floor(span * fps * (1.0 + 1e-12))) + 1)
        wanted = np.append(before_end(wanted, t_start, t_end), t_end)
        return _filled_up(wanted, filled)

    def frame_grid(self, n_numbers: int) -> FrameGrid | None:
        """Return all frames, where no more of them are kept than checks look at; None where all of them are.

        Raises
        ------
        RuntimeModelError
            Nobody takes them, and memory could not hold them.
        """
        if self.keep == "all":
            return None
        none, ends, most = np.zeros(0), (self.t_start, self.t_end), most_kept(n_numbers)
        if self.fps is None:
            times, _ = self.frame_times(n_numbers)
            return FrameGrid(*ends, None, times, none) if len(times) > most + 1 else None
        if self.recorder is None:
            self._refuse_more_than_memory(n_numbers)  # a slip: nothing is made of so many
        return FrameGrid(*ends, self.fps, none, none) if self.span * self.fps > most else None

    def _refuse_more_than_memory(self, n_numbers: int) -> None:
        span, fps = self.span, self.fps
        if needed := more_than_memory(8.0 * span * fps * (n_numbers + _BESIDE_FRAMES)):
            raise RuntimeModelError(
                f"fps is {fps:g}: {span:g} s make {span * fps:.1e} frames, which {needed}: give a smaller fps, "
                "or a shorter run"
            )


@functools.lru_cache(maxsize=8)
def _even_frames(t_start: float, t_end: float) -> tuple[np.ndarray, np.ndarray]:
    """The frames of a run of which nobody has asked for any; runs that are repeated have the same."""
    n = int(np.clip(np.ceil(_FPS * (t_end - t_start)), _LEAST_FRAMES, _MOST_FRAMES))
    times, shown = np.linspace(t_start, t_end, n + 1), np.ones(n + 1, dtype=bool)
    times.flags.writeable = shown.flags.writeable = False
    return times, shown


def _filled_up(wanted: np.ndarray, more: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the times that are wanted, with others between them where they are few, and which are which."""
    if len(wanted) > _LEAST_FRAMES:
        return wanted, np.ones(len(wanted), dtype=bool)
    times = np.sort(np.concatenate([wanted, more]))
    times = times[np.append(True, np.diff(times) > 0.0)]
    shown = np.zeros(len(times), dtype=bool)
    shown[np.searchsorted(times, wanted)] = True
    return times, shown


def _filling(t_start: float, t_end: float) -> np.ndarray:
    """Return the frames that checks have where few are asked for."""
    return np.linspace(t_start, t_end, _LEAST_FRAMES + 1)


def _among(times: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return which of the times are among others, which ascend: `np.isin` would import masked arrays."""
    return others[np.minimum(np.searchsorted(others, times), len(others) - 1)] == times


def with_early_frames(times: np.ndarray, shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return frames with others, not to be shown, ever more closely towards the start: an event may end a run early."""
    joined = np.sort(np.concatenate([times, early_times(times[0], times[-1])]))
    joined = joined[np.diff(joined, prepend=-np.inf) > 0.0]
    return joined, _among(joined, times[shown])


def early_times(t_start: float, t_end: float) -> np.ndarray:
    """Return times ever more closely towards the start of a run [s]."""
    return t_start + (t_end - t_start) * _EARLY


def checked_frames(times: np.ndarray, shown: np.ndarray, t_start: float, t_end: float) -> np.ndarray:
    """Return which frames the health report looks at: those that are shown, and where these are few, others as well.

    Parameters
    ----------
    times, shown : ndarray, shape (n,)
        Frames that a run has reached [s], and whether they were asked for.
    t_start, t_end : float [s]
        What was asked for.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    if np.count_nonzero(shown) > _LEAST_FRAMES:
        return shown
    more = shown | _among(times, _filling(t_start, t_end))
    if np.count_nonzero(more) < _FEWEST_CHECKED:
        more = np.ones(len(times), dtype=bool)
    return more


def time_resolution(*times: float) -> float:
    """Return the distance of neighbouring floating-point numbers at the largest of some times [s]."""
    return math.ulp(max(map(abs, times)))
