"""The result of a run: states over time, what can be computed from them, and how the run went."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from symgen.runtime.errors import UnknownNameError, nearest
from symgen.runtime.lazy import Late
from symgen.runtime.names import acceleration_labels, rate_indices, rate_labels
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.contact.forms import Forms
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.exchange import Exchange
    from symgen.runtime.subsystems.report import Parts
    from symgen.runtime.system import System
    from symgen.runtime.timing.timetable import Timetable


# Not for those who load a model without running it.
batches = Late("symgen.runtime.batches")


@record
class Sample:
    """A state at a time that the user asked for, hit exactly.

    Attributes
    ----------
    t : float [s]
    q, v : ndarray, shape (nq,), (nv,)
    acceleration, multipliers, outputs : ndarray, shape (nv,), (m,), (number of outputs,)
    energy : float [J]
        T + V.
    contact_forces : ndarray, shape (number of stops and frictions,), or None
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    acceleration: np.ndarray
    multipliers: np.ndarray
    outputs: np.ndarray
    energy: float
    contact_forces: np.ndarray | None = None


class _Later:
    """What is computed when something of it is first read."""

    @classmethod
    def later(cls, make: Callable[[], Self]) -> Self:
        """Return what `make` returns, which is called when an attribute is first read."""
        found = cls.__new__(cls)
        vars(found)["_make"] = make
        return found

    def __getattr__(self, name: str) -> Any:
        make = None if name.startswith("__") else vars(self).pop("_make", None)
        if make is None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        vars(self).update(vars(make()))
        return getattr(self, name)

    def __getstate__(self) -> dict[str, Any]:
        if "_make" in vars(self):
            vars(self).update(vars(vars(self).pop("_make")()))
        return vars(self)


@record
class Energy(_Later):
    """Energies at the frames [J].

    Attributes
    ----------
    kinetic, potential, work : ndarray, shape (n_frames,)
        `work` counts what came from outside, and from resets of events.
    exchange : symgen.runtime.exchange.Exchange
        What the motion exchanges, `exchange.size` [J]: the largest |T| or the range of V, whichever is larger.
    max_error : float
        Largest deviation of T + V - work from its start over all checked states, in parts of what the motion exchanges.
    taken : float
        Largest error that energy scaling has taken away up to some step, in the same parts.
    """

    kinetic: np.ndarray
    potential: np.ndarray
    work: np.ndarray
    exchange: Exchange
    max_error: float
    taken: float = 0.0

    @property
    def unscaled_error(self) -> float:
        """The error that the run has, or would have without energy scaling."""
        return max(self.max_error, self.taken)

    @property
    def total(self) -> np.ndarray:
        """T + V."""
        return self.kinetic + self.potential

    @property
    def balance(self) -> np.ndarray:
        """T + V - work: constant where the run is right."""
        return self.total - self.work

    @property
    def initial(self) -> float:
        """T + V at the start."""
        return float(self.total[0])

    @property
    def final(self) -> float:
        """T + V at the end."""
        return float(self.total[-1])


@record
class ConstraintResidual(_Later):
    """Largest magnitudes of the constraints' residuals at the frames.

    Attributes
    ----------
    position, velocity : ndarray, shape (n_frames,)
    max_position, max_velocity : float
        Over all checked states.
    """

    position: np.ndarray
    velocity: np.ndarray
    max_position: float
    max_velocity: float


@dataclass(eq=False, repr=False)
class Solution:
    """A run and its result as data; `symgen.runtime.front.Solution` has doors to what is done with it.

    `solution["theta"]`, `solution["dot(theta)"]`, `solution["dot(dot(theta))"]`, `solution["lambda(pin)"]`,
    `solution["force(stop)"]` and the names of outputs give arrays over `solution.t`; so do the names of angular
    velocities, `solution["ball_wx"]` and `solution["dot(ball_wx)"]`.

    Attributes
    ----------
    system : System
    p : ndarray
        Parameters, then inputs.
    t : ndarray, shape (n_frames,) [s]
    q, v : ndarray, shapes (n_frames, nq), (n_frames, nv)
    w : ndarray, shape (n_frames,) [J]
        Work done on the system from outside and by resets.
    samples : list of Sample
        The states at the times of `at`.
    events : list of EventRecord
    energy : Energy
    constraint_residual : ConstraintResidual
    step_log : ndarray, shape (n, 2)
        Time and length of accepted steps; thinned evenly in very long runs.
    stats : dict of str to int
        steps, rejected, rhs, jacobians, factorisations, newton, projections.
    status : str
        success, terminated, zeno, failed, interrupted.
    message : str
        What a status other than success means here: cause, time, and what to do next.
    notes : list of str
        What was chosen, moved, or found on the way.
    method, constraints : str
        What was used.
    rtol, atol : float
    step : float or None
        Of fixed-step methods [s].
    t_start, t_end : float [s]
        What was asked for.
    seconds : dict of str to float
        Wall time of parts of the run.
    min_pivot_ratio : float
        Smallest pivot ratio of the constraints met; near 0 where their rank was in danger.
    redundant : list of str
        Constraints that follow from the others; their multipliers are not unique.
    forms : symgen.runtime.contact.forms.Forms or None
        Which stops were closed and which frictions stuck at each frame.
    parts : symgen.runtime.subsystems.report.Parts or None
        The subsystems, where each was integrated by itself.
    lowest_gaps : ndarray, shape (number of stops,), or None
        The least gap of each stop at the ends of steps while it was open; None where that is not known.
    passed_by : list of (str, int, float)
        Events that steps passed by, as looks at random places inside them tell: name, how often, when last [s].
    timetable : symgen.runtime.timing.timetable.Timetable or None
        What the steps had to keep to; None where they were free.
    whole : Solution or None
        The same run with more frames, which checks look at where few were asked for.
    """

    system: System
    p: np.ndarray
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    w: np.ndarray
    samples: list[Sample]
    events: list[EventRecord]
    energy: Energy
    constraint_residual: ConstraintResidual
    step_log: np.ndarray
    stats: dict[str, int]
    status: str
    message: str
    notes: list[str]
    method: str
    constraints: str
    rtol: float
    atol: float
    step: float | None
    t_start: float
    t_end: float
    seconds: dict[str, float] = field(default_factory=dict)
    min_pivot_ratio: float = np.inf
    redundant: list[str] = field(default_factory=list)
    options: Mapping[str, Any] = field(default_factory=dict)
    forms: Forms | None = None
    parts: Parts | None = None
    lowest_gaps: np.ndarray | None = None
    passed_by: list[tuple[str, int, float]] = field(default_factory=list)
    timetable: Timetable | None = None
    whole: Solution | None = None

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the values of a coordinate, rate, acceleration, multiplier or output at the frames."""
        series = self._series()
        if name not in series:
            raise UnknownNameError(
                f"model {self.system.name!r} has no series {name!r}: {nearest(name, list(series))}"
            )
        attribute, column = series[name]
        return getattr(self, attribute)[:, column]

    def names(self) -> list[str]:
        """Return all names that `solution[name]` knows."""
        return list(self._series())

    keys = names  # with `solution[name]` it makes `dict(solution)`

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __contains__(self, name: object) -> bool:
        return name in self._series()

    def _series(self) -> dict[str, tuple[str, int]]:
        return series_of(self.system)

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters of the run by name, in SI; those that its start found among them."""
        return {record["name"]: float(value) for record, value in zip(self.system.parameters, self.p)}

    @cached_property
    def states(self) -> np.ndarray:
        """(q, v), shape (n_frames, nq + nv)."""
        return np.ascontiguousarray(np.hstack([self.q, self.v]))

    @property
    def y(self) -> np.ndarray:
        """The same as `states`: a row for each frame, (q, v), shape (n_frames, nq + nv)."""
        return self.states

    @cached_property
    def _rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if self.forms is not None:
            return self.forms.evaluate(self.system, self.p, self.t, self.states)
        rows = batches.accelerations_and_multipliers(self.system, self.p, self.t, self.states)
        return *rows, np.zeros((len(self.t), len(self.system.switches)))

    @property
    def accelerations(self) -> np.ndarray:
        """Accelerations at the frames, shape (n_frames, nv)."""
        return self._rows[0]

    @property
    def multipliers(self) -> np.ndarray:
        """Lagrange multipliers at the frames, shape (n_frames, m)."""
        return self._rows[1]

    @property
    def contact_forces(self) -> np.ndarray:
        """Forces of stops (along the gap) and frictions (along the sliding speed), shape (n_frames, number of them)."""
        return self._rows[2]

    @cached_property
    def outputs(self) -> np.ndarray:
        """The model's outputs at the frames, shape (n_frames, number of outputs)."""
        return batches.outputs(self.system, self.p, self.t, self.states, lambda: self._rows)

    @cached_property
    def input_values(self) -> np.ndarray:
        """The model's inputs at the frames, shape (n_frames, number of inputs)."""
        if not self.system.input_descriptions:
            first, n = len(self.system.parameters), len(self.system.inputs)
            return np.tile(self.p[first : first + n], (len(self.t), 1))
        return batches.evaluate(self.system, "inputs", self.p, self.t, self.states)

    def __repr__(self) -> str:
        return (
            f"<Solution of {self.system.name!r}: {self.status} at t = {self.t[-1]:.6g} s by {self.method}, "
            f"{self.stats['steps']} steps>"
        )


def series_of(system: System) -> dict[str, tuple[str, int]]:
    """Return where each series of a run stands: attribute of `Solution`, and column."""
    coordinates, rates = system.coordinates, system.rates
    named = {
        "q": [record["name"] for record in coordinates],
        "v": rate_labels(coordinates, rates),
        "accelerations": acceleration_labels(coordinates, rates),
        "multipliers": [f"lambda({record['name']})" for record in system.constraints],
        "outputs": [record["name"] for record in system.outputs],
        "input_values": [record["name"] for record in system.inputs],
        "contact_forces": [f"force({record['name']})" for record in system.switches],
    }
    series: dict[str, tuple[str, int]] = {}
    hidden = {coordinates[i]["name"] for i in system.integrals}
    for attribute, names in named.items():
        for column, name in enumerate(names):
            if name in hidden:
                continue
            series.setdefault(name, (attribute, column))
    for name, column in rate_indices(coordinates, rates, system.quaternions).items():
        # A rate of another name than its coordinate's, as `ball_vx` of `ball_x`, is its derivative as well.
        if name in series and series[name][0] == "q":
            series.setdefault(f"dot({name})", ("v", column))
            series.setdefault(f"dot(dot({name}))", ("accelerations", column))
    return series
