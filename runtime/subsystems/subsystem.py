"""One subsystem of a scene: where it stands in the whole, the choice of its method and step, and its run.

Those whose time scales are much the same share a choice; one at rest in a stable equilibrium is not integrated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate
from symgen.runtime.checks.time_scales import motion_jacobian, rates_at
from symgen.runtime.choose import EXPLICIT, SERIES, choose_constraints, choose_method, choose_step
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.driver import Run
from symgen.runtime.event_actions import ResetError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.positions import Positions
from symgen.runtime.size import is_large
from symgen.runtime.timing.timetable import Timetable, timetable

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.options import RunOptions
    from symgen.runtime.subsystems.decomposition import Kind
    from symgen.runtime.system import System
    from symgen.runtime.timing.step_limits import StepLimits

_EPS = np.finfo(float).eps
_ROUND_OFF = 4.0 * _EPS  # of a coordinate's size: so near to the equilibrium is at it
_NEAR = 1e-10  # of a coordinate's size: farther from rest nothing need be worked out
_OF_TOLERANCE = 0.1
_FAR = 1e3
_GROWTH = 1e-7  # of the fastest rate: central differences tell eigenvalues no better
_SLOWEST = 1e-6  # of the fastest rate: slower motions might as well be free
_LEAST_RATE = 1e-30  # [1/s]: rates are compared by their ratio
_STILL = 1e-10  # rates below this [1/s of a size of 1] are worth a look
_STEPS_LOGGED = 1024  # between two looks at a run


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


def is_at_rest(system: System, p: np.ndarray, t: float, state: np.ndarray, atol: float = 0.0) -> bool:
    """Return whether a model that does not depend on time stays where it is; see `are_at_rest`."""
    return bool(are_at_rest(system, p[None], t, state[None], atol)[0])


def are_at_rest(system: System, p: np.ndarray, t: float, states: np.ndarray, atol: float = 0.0) -> np.ndarray:
    """Return of several states of a model that does not depend on time whether they stay where they are.

    Either nothing moves and nothing pushes, exactly. Or the nearest point of equilibrium is so near that numbers
    hardly tell it from the state, and no motion about it grows or is free; where all motions about it die out, so near
    that tolerances do not tell it. Constrained models are not tried for either.

    Parameters
    ----------
    p : ndarray, shape (n, n_p)
    t : float [s]
    states : ndarray, shape (n, nq + nv)
    atol : float
        Absolute tolerance of the run.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    rest = np.zeros(len(states), dtype=bool)
    if system.structure["time_dependent"]:
        return rest
    q, v = states[:, : system.nq], states[:, system.nq :]
    positions = Positions(system)
    sizes = positions.per_rate(np.maximum(1.0, np.abs(q)), 1.0)
    slow = np.flatnonzero(np.max(np.abs(v) / sizes, axis=1, initial=0.0) <= max(_NEAR, atol))
    a = _accelerations(system, p[slow], t, states[slow])
    still = ~(v[slow].any(axis=1) | a.any(axis=1))
    rest[slow[still]] = True
    if system.m:
        return rest
    tried = ~still & np.isfinite(a).all(axis=1)
    rows, a = slow[tried], a[tried]
    moved = positions.retractions(q[rows], (_NEAR * sizes[rows])[:, None])[:, 0]
    change = np.abs(_accelerations(system, p[rows], t, np.hstack([moved, v[rows]])) - a) if len(rows) else a
    near = np.max(np.abs(a), axis=1, initial=0.0) <= _FAR * np.max(change, axis=1, initial=0.0)
    for k, acceleration in zip(rows[near], a[near]):
        jacobian = motion_jacobian(system, p[k], t, q[k], v[k])
        away = np.concatenate([v[k], acceleration])
        rest[k] = _is_stable_and_near(system, jacobian, away, sizes[k], atol)
    return rest


def _accelerations(system: System, p: np.ndarray, t: float, states: np.ndarray) -> np.ndarray:
    times = np.full(len(states), t)
    if not system.m:
        return accelerations_and_multipliers(system, p, times, states)[0]
    each = zip(p, times[:, None], states[:, None])
    return np.vstack(
        [np.zeros((0, system.nv)), *(accelerations_and_multipliers(system, *x)[0] for x in each)]
    )


def _is_stable_and_near(
    system: System, jacobian: np.ndarray, change: np.ndarray, sizes: np.ndarray, atol: float
) -> bool:
    """Whether the equilibrium of the linearised motion is stable, and near; `change` is the state's by time."""
    eigenvalues = np.linalg.eigvals(jacobian)
    fastest, slowest, growth = np.abs(eigenvalues).max(), np.abs(eigenvalues).min(), eigenvalues.real.max()
    if slowest <= _SLOWEST * fastest or growth > _GROWTH * fastest:
        return False
    away = np.abs(np.linalg.solve(jacobian, change))
    near = _ROUND_OFF * sizes
    if growth < -_GROWTH * fastest:
        near = np.maximum(near, _OF_TOLERANCE * atol)
    return bool(np.all(away[: system.nv] <= near) and np.all(away[system.nv :] <= near * max(1.0, fastest)))


class Choice(NamedTuple):
    """How one subsystem is integrated.

    Attributes
    ----------
    method : Method
    step : float [s]
        0: it chooses its own.
    treatment : str
        How its constraints are treated.
    rate : float [1/s]
        Of the motion that sets its steps.
    notes : tuple of str
        Why.
    """

    method: Method
    step: float
    treatment: str
    rate: float
    notes: tuple[str, ...]


class Chooser:
    """Chooses for all members of one kind.

    Parameters
    ----------
    kind : Kind
    settings : symgen.runtime.subsystems.subsystem.Settings
    """

    def __init__(self, kind: Kind, settings: Settings):
        self._system, self._settings = kind.system, settings
        wanted = settings.options.constraints if kind.system.m else "auto"
        self._treatment, self._formed, _ = choose_constraints(wanted, kind.system, settings.options.method)
        self._made: dict[tuple[int, ...], tuple[Method, tuple[str, ...]]] = {}

    def choose(self, p: np.ndarray, states: np.ndarray) -> list[Choice]:
        """Return the choices for members with these parameters and starts, shapes (n, n_p) and (n, nq + nv)."""
        rates = self._rates(p, states)
        keys, of_motion = self._keys(rates), zip(*rates[[0, 2]].tolist())
        return [self._choice(p, states, *member) for member in zip(range(len(p)), keys, of_motion)]

    def _rates(self, p: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Return `fastest`, `decay`, `motion` and `damping` of the members' time scales, shape (4, n); 0 if large."""
        system, start = self._system, self._settings.options.t_start
        if is_large(system):
            return np.zeros((4, len(states)))
        q, v = states[:, : system.nq], states[:, system.nq :]
        if system.m:
            each = (
                rates_at(system, p[k], np.array([start]), q[k : k + 1], v[k : k + 1]) for k in range(len(q))
            )
            return np.hstack(list(each))
        return rates_at(system, p, np.full(len(p), start), q, v)

    def _keys(self, rates: np.ndarray) -> list[tuple[int, ...]]:
        """What members that share a method have in common: their time scales, within a factor of two."""
        if self._formed or self._settings.options.method != "auto" or is_large(self._system):
            return [()] * rates.shape[1]
        powers = np.floor(np.log2(np.maximum(np.abs(rates.T), 1e-30))).astype(int)
        return list(map(tuple, powers.tolist()))

    def _choice(
        self, p: np.ndarray, states: np.ndarray, k: int, key: tuple[int, ...], rates: tuple[float, float]
    ) -> Choice:
        """The choice for member k; members of one key share the method."""
        options = self._settings.options
        if key not in self._made:
            self._made[key] = self._method(p[k], states[k])
        method, notes = self._made[key]
        if method.adaptive and options.step is None:
            return Choice(method, 0.0, self._treatment, max(rates[method.stiff], _LEAST_RATE), notes)
        step, more = choose_step(method, self._system, p[k], states[k], options)
        return Choice(method, step, self._treatment, max(1.0 / step, _LEAST_RATE), (*notes, *more))

    def _method(self, p: np.ndarray, state: np.ndarray) -> tuple[Method, tuple[str, ...]]:
        if self._formed:
            return self._formed, ()
        found, why = choose_method(self._system, p, state, self._settings.options)
        return found, tuple(why)


class MemberRun(Run):
    """A run that can pause when some frames are done.

    Attributes
    ----------
    asleep_from : float [s]
        When it came to rest; inf if it did not.
    """

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
    is_asleep : bool
        Whether it rests from the start on.
    run : MemberRun
        Once it was prepared.
    """

    def __init__(
        self,
        system: System,
        p: np.ndarray,
        t_start: float,
        state: np.ndarray,
        choice: Choice,
        is_asleep: bool,
    ):
        self.system, self.choice, self.p, self.t_start, self.state = system, choice, p, t_start, state
        self.is_asleep = is_asleep
        self.titles: list[str] = []
        self.columns: list[np.ndarray] = []
        self.run: MemberRun

    @property
    def name(self) -> str:
        """What it is called."""
        return self.titles[0]

    def steps_of_each(self) -> list[int]:
        """Return the steps that were taken for it, in a list; those of each of its members where it has some."""
        return [self.run.n_steps]

    def rests_from(self) -> list[float]:
        """Return when it, and each of its twins, came to rest [s]; inf where it did not."""
        return [self.run.asleep_from] * len(self.titles)

    def frames(self, rows: slice) -> np.ndarray:
        """Return its states, and the work done, at some frames."""
        return self.run.arrays.frames[rows]

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
            system, method, self.p, t, self.state, frame_times=times, rtol=settings.options.rtol,
            atol=settings.options.atol, step=self.choice.step, energy_level=level,
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
    found, t_start = [], settings.options.t_start
    for kind in kinds:
        chooser = Chooser(kind, settings)
        columns = np.hstack([kind.q, whole.nq + kind.v])
        own_p, starts = p[kind.p], state[columns]
        members: dict[bytes, list[int]] = {}  # equal ones: the first, and its twins
        for number, row in enumerate(np.hstack([own_p, starts])):
            members.setdefault(row.tobytes(), []).append(number)
        firsts = [equal[0] for equal in members.values()]
        choices = chooser.choose(own_p[firsts], starts[firsts])
        rest = np.zeros(len(firsts), dtype=bool)
        if not kind.system.events:
            rest = are_at_rest(kind.system, own_p[firsts], t_start, starts[firsts])
        for equal, choice, asleep in zip(members.values(), choices, rest.tolist(), strict=True):
            first = equal[0]
            subsystem = Subsystem(kind.system, own_p[first], t_start, starts[first], choice, asleep)
            subsystem.titles += [f"subsystem of {whole.coordinates[kind.q[k, 0]]['name']}" for k in equal]
            subsystem.columns += [columns[k] for k in equal]
            found.append(subsystem)
    return found
