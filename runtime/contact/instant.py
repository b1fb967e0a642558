"""The stops and frictions of a run at one instant: what holds, how large forces can be, what is within tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.contact.coulomb import coulomb_forces
from symgen.runtime.contact.levels import Levels, NoSolution, Paradox
from symgen.runtime.contact.local_dynamics import (
    ContactEquations,
    LocalDynamics,
    creeping_frictions,
    given,
    normals_of,
    smooth_frictions,
    smooth_sense,
)
from symgen.runtime.contact.settings import Layout
from symgen.runtime.errors import ContactError
from symgen.runtime.integrate import layout as at

if TYPE_CHECKING:
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

UNDECIDED = 1e-9  # of the largest acceleration: what presses as little does not tell whether it stays
BALANCED = 1e-6  # of the accelerations that a force balances: more than round-off is left of it
ROUNDED = 1e-13  # of the accelerations that a force balances
LIMIT_ROUNDED = 1e-10  # of the range of a friction force
AHEAD = 1e-7  # of the time that the motion takes to change
_EPS = float(np.finfo(float).eps)
_SURELY_SEEN = 64.0  # times round-off: a flight that high is not lost between a rebound and its end


class Instant:
    """The stops and frictions of one run as they are now.

    Parameters
    ----------
    system : System
        With switches.
    arrays : LoopArrays

    Attributes
    ----------
    closed, stuck : ndarray of bool
        Stops that are closed, frictions that stick.
    senses : ndarray
        In which direction each friction slides: 1, -1, or 0 where it sticks or is smooth. Of one with two directions,
        which counts as two, the components of a unit vector.
    has_frictions : bool
        Whether there are frictions at all.
    turning, aimed : ndarray of bool
        Which frictions with two directions slide against the motion, and which along `senses`, see
        `symgen/derive/contacts.py`.
    """

    def __init__(self, system: System, arrays: LoopArrays):
        self.system, self.arrays = system, arrays
        kinds = [switch["kind"] for switch in system.switches]
        self.names = [switch.get("circle", switch["name"]) for switch in system.switches]
        self.layout = Layout(system)
        self.equations = ContactEquations(system, self.layout)
        self.n_stops, self.n = kinds.count("stop"), len(kinds)
        self.normals, self.has_frictions = normals_of(system), self.n > self.n_stops
        self._smooth, self._creeps = smooth_frictions(system), creeping_frictions(system)
        self._coupled = ~np.array([given(normal) for normal in self.normals], dtype=bool)
        self.closed = np.zeros(self.n_stops, dtype=bool)
        self.stuck = np.zeros(self.n - self.n_stops, dtype=bool)
        self.senses = np.zeros(self.n - self.n_stops)
        self.turning, self.aimed = np.zeros_like(self.stuck), np.zeros_like(self.stuck)
        self._in_circles = np.zeros_like(self.stuck)  # which frictions are directions of one that has two
        self._in_circles[self.layout.circles] = True
        self._aims = np.zeros(
            (len(self.layout.circles), 2)
        )  # how long each is aimed or turns: an angle, a speed
        self._places_of_settings = system.settings_of_switches
        self._unpressed = np.zeros(self.n_stops, dtype=bool)  # closed stops that bear nothing yet
        # Coordinates that were brought out of stops, from where to where.
        self.moved: list[tuple[str, float, float]] = []
        self._last: tuple[tuple, LocalDynamics] | None = None
        # Of the equations and rates for which they were asked last: it is asked a dozen times at an event.
        self._tolerances: tuple[LocalDynamics, tuple, np.ndarray] | None = None
        # Gaps and speeds that are zero within the tolerances, when last asked.
        self._zero: np.ndarray | None = None
        self._far_from_zero: list[float] = []  # what is clearly more
        # Forces that are as good as zero, with the settings for which they were asked last.
        self._last_weak: tuple[bytes, np.ndarray] | None = None

    @property
    def settings(self) -> np.ndarray:
        """The numbers in `p` that say all this."""
        layout, values = self.layout, np.zeros(self.layout.n_settings)
        values[layout.closed] = self.closed
        if self.has_frictions:
            values[layout.stuck], values[layout.sense] = self.stuck, self.senses
        if len(layout.circles):
            first = layout.circles[:, 0]
            values[layout.turns], values[layout.aimed] = self.turning[first], self.aimed[first]
            values[layout.angle], values[layout.bound] = self._aims.T
        return values

    @settings.setter
    def settings(self, values: np.ndarray) -> None:
        layout = self.layout
        self.closed, self.stuck = values[layout.closed] != 0.0, values[layout.stuck] != 0.0
        self._unpressed = np.zeros_like(self.closed)
        self.senses = values[layout.sense].copy()
        self.turning, self.aimed = layout.turning(values), layout.aiming(values)
        self._aims = np.column_stack([values[layout.angle], values[layout.bound]])

    @property
    def phases(self) -> np.ndarray:
        """What each stop and friction does, a row each: held or not, and of two directions in which way it slides."""
        if not len(self.layout.circles):
            return np.concatenate([self.closed, self.stuck])[:, None]
        senses = np.where(self._in_circles, self.senses, 0.0)
        frictions = np.column_stack([self.stuck, self.turning, self.aimed, senses])
        stops = np.zeros((self.n_stops, 4))
        stops[:, 0] = self.closed
        return np.vstack([stops, frictions])

    @property
    def resting(self) -> np.ndarray:
        """Which frictions others hold: they are not `stuck`, as constraints would depend on each other.

        `senses` then says which part of their sliding force they take. Their events are round-off: in `control`, the
        band about zero that these have to leave is infinite.
        """
        return np.isinf(self._events_of_frictions(at.BAND))

    @resting.setter
    def resting(self, which: np.ndarray) -> None:
        bands, sides = self._events_of_frictions(at.BAND), self._events_of_frictions(at.SIDE)
        bands[which], bands[np.isinf(bands) & ~which] = np.inf, 0.0
        sides[which] = 0.0

    @property
    def any_resting(self) -> bool:
        """Whether others hold some friction."""
        return self.has_frictions and math.inf in self._events_of_frictions(at.BAND).tolist()

    def _events_of_frictions(self, block: int) -> np.ndarray:
        events = self.arrays.event_block(block)
        return events[len(events) - len(self.stuck) :]

    @property
    def any_held(self) -> bool:
        """Whether some stop is closed or some friction sticks: the closed form of the model then applies."""
        return True in self.closed.tolist() or True in self.stuck.tolist()  # asked often, of few

    @property
    def held(self) -> np.ndarray:
        """Which stops are closed and which frictions stick, one after another."""
        return np.concatenate([self.closed, self.stuck])

    @property
    def held_names(self) -> list[str]:
        """The names of the stops that are closed and of the frictions that stick."""
        return list(dict.fromkeys(name for name, held in zip(self.names, self.held, strict=True) if held))

    @property
    def _at_rest(self) -> np.ndarray:
        if not self.has_frictions:
            return self.closed
        return np.concatenate([self.closed, (self.stuck & ~self.aimed) | self.resting])

    def bands(self) -> np.ndarray:
        """How far below zero gaps, sliding speeds and forces of closed stops count as zero, nan for frictions held.

        One that begins to move from rest is not known better than to the tolerances of the run; what moves clearly
        is known to round-off, and so is a force: where round-off of a force that falls through zero keeps a stop
        closed, it is asked again behind that. That of a closed stop that bears nothing is zero but for what does not
        tell.
        """
        here = self._here()
        bands = self._bands_of_all(here) if self.has_frictions else self._bands_of_stops(here)
        if (unpressed := self._unpressed & self.closed).any():
            undecided = UNDECIDED * here.sizes_of_free / np.maximum(here.own, 1e-300)
            bands[: self.n_stops][unpressed] = undecided[: self.n_stops][unpressed]
        return bands

    def _bands_of_all(self, here: LocalDynamics) -> np.ndarray:
        tolerances = self._slow(here)
        widths = np.concatenate([self._gap_tolerances(here), tolerances])
        moving = np.concatenate(
            [
                np.abs(here.speeds[: self.n_stops]) > self._speed_tolerances(here)[: self.n_stops],
                self._sliding(here) > tolerances,
            ]
        )
        others = self._smooth.copy()
        others[self.layout.circles[:, 1]] = True
        free = ~self._at_rest & ~np.concatenate([np.zeros(self.n_stops, dtype=bool), others])
        bands = np.where(free, np.where(moving, 0.0, widths), np.nan)
        bands[: self.n_stops][self.closed] = 0.0
        return bands

    def _bands_of_stops(self, here: LocalDynamics) -> np.ndarray:
        moving = np.abs(here.speeds) > self._speed_tolerances(here)
        return np.where(self.closed | moving, 0.0, self._gap_tolerances(here))

    def _sliding(self, here: LocalDynamics) -> np.ndarray:
        """How fast each friction slides; both directions of one that has two say how fast it does."""
        return self.layout.together(np.abs(here.speeds[self.n_stops :]))

    def _slow(self, here: LocalDynamics) -> np.ndarray:
        """Sliding speeds that are zero within the tolerances of the run."""
        return self.layout.together(self._speed_tolerances(here)[self.n_stops :])

    def write(self) -> None:
        """Write the settings into `p`."""
        self.arrays.p[self._places_of_settings] = self.settings

    def _here(self) -> LocalDynamics:
        """The equations at the present state and settings; they are asked for several times."""
        arrays = self.arrays
        self.write()
        y = arrays.y[: self.system.nq + self.system.nv].copy()
        key = (arrays.t, y.tobytes(), arrays.p.tobytes())
        if self._last is None or self._last[0] != key:
            self._last = (key, self.equations.at(arrays.p, arrays.t, y))
        return self._last[1]

    def forget(self) -> None:
        """Ask for the equations afresh: inputs may have other values at the same time."""
        self._last = None

    def _later(
        self, here: LocalDynamics, forces: np.ndarray, ahead: float = AHEAD, *, of_step: bool = False
    ) -> LocalDynamics:
        """The equations a moment later, on the way that some forces lead: a part of the last step, or of the motion."""
        nq = self.system.nq
        q, v, change = here.state[:nq], here.state[nq:], here.accelerations(forces)
        free = np.abs(here.accelerations(np.zeros(self.n))).max(initial=0.0)
        change = np.where(
            np.abs(change) > UNDECIDED * free, change, 0.0
        )  # what is balanced has no time of its own
        # Rates that are zero within the tolerances have no time of their own either.
        rates = np.where(np.abs(v) > float(self.arrays.control[at.ATOL]) + ROUNDED, v, 0.0)
        of_motion, step = here.moment(rates, change), float(self.arrays.control[at.H_LAST])
        ahead = ahead * (step if of_step and step > 0.0 else of_motion)
        state = np.concatenate([self.equations.positions.retract(q, ahead * v), v + ahead * change])
        return self.equations.at(self.arrays.p, here.t + ahead, state)

    def _watched(
        self, here: LocalDynamics | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return gaps, restitutions, and the levels (or coefficients) of frictions, sliding and sticking.

        The last of these of a smooth friction is its width [speed].
        """
        system, arrays = self.system, self.arrays
        t, y = (arrays.t, arrays.y[: system.nq + system.nv]) if here is None else (here.t, here.state)
        values = system.kernel("switches")(t, y, arrays.p)
        stops, frictions = (
            values[: 2 * self.n_stops].reshape(-1, 2),
            values[2 * self.n_stops :].reshape(-1, 3),
        )
        return stops[:, 0], stops[:, 1], frictions[:, 1], frictions[:, 2]

    def _pressed(self, touching: np.ndarray) -> np.ndarray:
        """Which frictions can act: all but those on a stop that is open."""
        if not self.has_frictions:
            return np.zeros(0, dtype=bool)
        return np.array([stop is None or touching[stop] for stop, _ in self.normals], dtype=bool)

    def _levels(self, still: np.ndarray, here: LocalDynamics | None = None) -> Levels:
        """How large frictions can be: those that are `still` before they begin to slide, the others while they do."""
        if not self.has_frictions:
            return Levels(np.zeros(0), np.zeros(0), self.normals)
        _, _, sliding, static = self._watched(here)
        level = np.maximum(np.where(still, static, sliding), 0.0)
        fixed, coefficients = (np.where(which, level, 0.0) for which in (~self._coupled, self._coupled))
        return Levels(fixed, coefficients, self.normals)

    def _directions(self, here: LocalDynamics) -> np.ndarray:
        """Return `senses`, and of smooth frictions which part of their level acts."""
        speeds, smooth = here.speeds[self.n_stops :], self._smooth
        directions = self.layout.directions(speeds, self.senses, self.turning).copy()
        if smooth.any():
            widths = np.where(smooth, self._watched(here)[3], 1.0)
            by_speed = smooth_sense(speeds, self._sliding(here), widths, self._creeps)
            directions[smooth] = by_speed[smooth]
        return directions

    def _forces(
        self, here: LocalDynamics, acting: np.ndarray, levels: Levels, *, briefly: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        directions = self._directions(here) if self.has_frictions else self.senses
        circles = self.layout.circles
        return self._solved(
            lambda: coulomb_forces(
                here, here.free, acting, directions, levels, circles=circles, briefly=briefly
            )
        )

    def _solved(self, find: Callable[[], Any]) -> Any:
        """What `find` finds; where it finds nothing, the error says why."""
        try:
            return find()
        except (Paradox, NoSolution, np.linalg.LinAlgError) as error:
            t = self.arrays.t
            if isinstance(error, NoSolution) and not self._coupled.any():
                raise ContactError(
                    f"the stops {', '.join(self.names[: self.n_stops])} cannot all be kept at t = {t:.9g} s: "
                    "look for stops that contradict each other or a constraint there"
                ) from None
            raise ContactError(
                f"friction in proportion to reactions ({', '.join(self._coupled_names)}) leaves no motion of rigid "
                f"bodies, or more than one, at t = {t:.9g} s (Painlevé's paradox): lower its coefficient, or let the "
                "contact give way with [contacts]"
            ) from None

    @property
    def _coupled_names(self) -> list[str]:
        names = zip(self.names[self.n_stops :], self._coupled, strict=True)
        return list(dict.fromkeys(name for name, follows in names if follows))  # two directions have one name

    def _gap_tolerances(self, here: LocalDynamics) -> np.ndarray:
        """How much of each gap the tolerances of the run leave open."""
        c, n = self.arrays.control, self.n_stops
        left = c[at.ATOL] + c[at.RTOL] * here.sizes[:n]
        return np.maximum(here.row_sums[:n] * left, self._round_off(here))

    def _round_off(self, here: LocalDynamics) -> np.ndarray:
        """How large a gap may be and still be zero but for round-off."""
        return _SURELY_SEEN * _EPS * here.row_sums[: self.n_stops] * here.sizes[: self.n_stops]

    def _speed_tolerances(self, here: LocalDynamics) -> np.ndarray:
        """Rates of gaps and sliding speeds, shape (n,), that are zero within the tolerances of the run."""
        c, v = self.arrays.control, self.arrays.y[self.system.nq : self.system.nq + self.system.nv]
        atol, rtol = float(c[at.ATOL]), float(c[at.RTOL])
        key = (atol, rtol, v.tobytes())
        if self._tolerances is None or self._tolerances[0] is not here or self._tolerances[1] != key:
            moving = max(rtol, 1e-15) * (here.row_sizes @ np.abs(v))
            self._tolerances = here, key, here.row_sums * (atol + 1e-15) + moving
        return self._tolerances[2]
