"""Inputs during a run: where steps must end, which pieces hold until then, and when sampled controllers are called."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import solved_rows
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs.code import COEFFICIENTS, FIXED, KNOT, PiecesPlace
from symgen.runtime.inputs.given import SAME_TIME, Pieces

if TYPE_CHECKING:
    from symgen.runtime.inputs.driven import DrivenSystem
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays

_ORDER_OF_SPLINES = 4  # methods of fixed step up to it keep their order where the third derivative jumps


def needs_all_breaks(method: Method) -> bool:
    """Whether steps of a method must end at breaks where an input and its slope are continuous, too.

    Series are those of one piece, and high orders with fixed steps are lost where a third derivative jumps. Where
    errors are estimated, steps over such breaks reach the tolerance as well, with less work.
    """
    return method.series or (not method.adaptive and method.order > _ORDER_OF_SPLINES)


class InputSchedule:
    """Keeps the inputs of one run.

    Parameters
    ----------
    system : DrivenSystem
    arrays : LoopArrays
        Of the run: the pieces in use are fixed in their `precomputed`.
    method : Method
    t_start : float [s]
    """

    def __init__(self, system: DrivenSystem, arrays: LoopArrays, method: Method, t_start: float):
        self._system, self._arrays = system, arrays
        self._t_start = abs(t_start)
        n = len(system.places.pieces) - sum(len(sampler.inputs) for sampler in system.samplers)
        everywhere = needs_all_breaks(method)
        self._piecewise = [_PiecewiseInput(x, everywhere) for x in system.all_pieces[:n]]
        self._until = -math.inf
        self.changes = 0  # times at which other pieces were put into use
        self._fix(t_start)

    @property
    def next_stop(self) -> float:
        """Where the next call of the step loop is to end [s], since inputs change there; inf where they do not."""
        return self._until

    def follow(self, t: float, state: np.ndarray) -> bool:
        """Bring the inputs up to time `t`; returns whether one of them jumped.

        Parameters
        ----------
        state : ndarray, shape (nq + nv,)
            What sampled controllers see.
        """
        if t < self._until - self._near(t):
            return False
        jumped = False
        for sampler in self._system.samplers:
            if sampler.next_time <= t + self._near(t):
                before = sampler.values[-1]
                seen = read_signals(self._system, sampler.signals.places, t, state, self._arrays.precomputed)
                sampler.call(t, seen)
                jumped = jumped or not np.array_equal(before, sampler.values[-1])
        if self._fix(t):
            jumped = True
            begins = max(given.since for given in self._piecewise)
            if begins > t:  # whoever looks a piece up by the time is to find the one that is in use
                self._arrays.move_time(begins)
        return jumped

    def _near(self, t: float) -> float:
        """Return up to what distance from `t` [s] another time is the same; the end of the run has no part in it."""
        return SAME_TIME * max(self._t_start, abs(t)) if t < math.inf else 0.0

    def take_new_arrays(self, system: DrivenSystem, t: float) -> None:
        """Go on from `t` [s] with another form of the model, and with a `precomputed` that was made anew."""
        self._system = system
        self._fix(t)

    def take_form(self, system: DrivenSystem) -> None:
        """Go on with another form of the model, in whose `precomputed` the same pieces are put into use."""
        self._system = system
        self.write(system, self._arrays.precomputed)

    def write(self, system: DrivenSystem, precomputed: np.ndarray) -> None:
        """Put the pieces in use into a `precomputed` of a form of the model; where they end changes none of it."""
        places, n = system.places.pieces, len(self._piecewise)
        for given, place in zip(self._piecewise, places):
            given.write(place, precomputed)
        values = (value for sampler in system.samplers for value in sampler.values[-1])
        for place, value in zip(places[n:], values):
            precomputed[place.block + FIXED], precomputed[place.block + COEFFICIENTS] = 1.0, value

    def _fix(self, t: float) -> bool:
        """Fix the pieces that hold after `t`, and find out until when; returns whether a value jumps there."""
        jumped, until = False, math.inf
        for given in self._piecewise:
            jumped = given.enter(t + self._near(t)) or jumped
            until = min(until, given.until)
        for sampler in self._system.samplers:
            until = min(until, sampler.next_time)
        self._until = until
        self.changes += 1
        self.write(self._system, self._arrays.precomputed)
        return jumped


class _PiecewiseInput:
    """An input in pieces during a run.

    Attributes
    ----------
    until : float [s]
        The next break at which steps must end.
    since : float [s]
        The last one that was passed.
    """

    def __init__(self, pieces: Pieces, everywhere: bool):
        self._pieces = pieces
        jumps = pieces.jumps()
        self._fixed = everywhere or bool(jumps.any())
        chosen = np.ones(len(jumps), dtype=bool) if self._fixed else pieces.kinks()
        self._stops, self._jumps = pieces.breaks[chosen].tolist(), jumps[chosen].tolist()
        self._next = 0
        self.until, self.since = math.inf, -math.inf

    def enter(self, t: float) -> bool:
        """Go on to the piece that holds at `t`; returns whether the value jumped at a stop since the last call."""
        jumped = False
        while self._next < len(self._stops) and self._stops[self._next] <= t:
            jumped = jumped or self._jumps[self._next]
            self.since = self._stops[self._next]
            self._next += 1
        self.until = self._stops[self._next] if self._next < len(self._stops) else math.inf
        return jumped

    def write(self, place: PiecesPlace, precomputed: np.ndarray) -> None:
        """Put the piece that holds into use."""
        if not self._fixed:
            return  # steps go over breaks, and the piece is searched for
        block, k = place.block, self._next
        precomputed[block + FIXED], precomputed[block + KNOT] = 1.0, self._pieces.knots[k]
        precomputed[block + COEFFICIENTS : block + COEFFICIENTS + place.width] = self._pieces.coefficients[k]


def read_signals(
    system: DrivenSystem, places: tuple[int, ...], t: float, state: np.ndarray, precomputed: np.ndarray
) -> np.ndarray:
    """Return signals by their places, see `controller.Signals`."""
    outputs = np.zeros(len(system.outputs))
    if any(place < 0 for place in places):
        if system.sensed:
            state = _with_solution(system, t, state, precomputed)
        kernel = system.kernel("outputs")
        call_kernel(np.uint64(kernel.precomputed_address), t, state, precomputed, outputs)
    return np.array([state[place] if place >= 0 else outputs[-1 - place] for place in places])


def _with_solution(system: DrivenSystem, t: float, state: np.ndarray, precomputed: np.ndarray) -> np.ndarray:
    """The state with the accelerations and multipliers that outputs read behind it."""
    if system.switches:
        raise RuntimeModelError(
            "controllers cannot read outputs of accelerations or reactions of a model with stops or dry friction: "
            "give 'reads' without outputs"
        )
    nq, nv = system.nq, system.nv
    row = solved_rows(system, precomputed, np.array([t]), state[None, : nq + nv])[0]
    return np.concatenate([state[: nq + nv], row[nq : nq + nv], row[system.ny : system.ny + system.m]])


def first_samples(system: DrivenSystem, p: np.ndarray, t: float, state: np.ndarray) -> None:
    """Call all sampled controllers at the start of a run."""
    for sampler in system.samplers:
        sampler.call(t, read_signals(system, sampler.signals.places, t, state, system.precomputed(p)))
