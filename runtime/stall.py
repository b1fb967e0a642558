"""Runs that go on without getting on: the pace of some seconds, held against what is left of the run."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.failures import NEARLY_DEPENDENT, failure_message, state_names
from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.run_state import RunState

dependence = Late("symgen.runtime.constraints.dependence")

_WINDOW = 1.0  # [s] of processor time
_WINDOWS = 10  # near a change point some seconds of tiny steps are no stall
_WINDOWS_OF_PARTITION = 3  # where its independent coordinates run out, no more will come
_STEPS, _EVENTS = (
    1000,
    100,
)  # that a window has at least: few steps may be slow ones of a large model, and grow
_MOST_IN_A_STEP = 100  # events of each kind within one fixed step: a step far longer than what goes on
_TOO_LONG = 1e6  # [s] of processor time for the rest of the run
_DAY = 86400.0
_SQUARED = 1e150  # squares of what is larger, as in energies and norms, are beyond the numbers there are


class StallWatch:
    """Notices that a run would take weeks at the pace that it has had for some seconds.

    Parameters
    ----------
    run : symgen.runtime.run_state.RunState
    """

    def __init__(self, run: RunState):
        self._run, self._slow, self._since = run, 0, time.perf_counter()
        self._began: tuple[float, float, int, int] | None = None  # most runs are over before there is one
        self._step_began: tuple[float, int] = -np.inf, 0  # time, and events until then

    def _mark(self) -> tuple[float, float, int, int]:
        actions = self._run.actions
        n_events = len(actions.log) + actions.n_jumps
        return time.thread_time(), self._run.arrays.t, int(self._run.arrays.counters[at.STEPS]), n_events

    def objection(self) -> str:
        """Return why to end the run, '' while it gets on."""
        if time.perf_counter() - self._since < _WINDOW:
            return ""  # nor was more processor time spent, which takes longer to ask for
        now = self._mark()
        if self._events_in_a_step(now[1], now[3]):
            return self._of_events()
        if self._began is None:
            self._began, self._since = now, time.perf_counter()
            return ""
        spent, t, steps, events = (b - a for a, b in zip(self._began, now, strict=True))
        if spent < _WINDOW:
            self._since = time.perf_counter() - spent  # the window is not over before
            return ""
        if steps < _STEPS and events < _EVENTS:
            return ""
        if not self._run.method.adaptive and events < 0.5 * steps:
            return ""  # steps of fixed length get on as they are told to
        self._began, self._since = now, time.perf_counter()
        left = (self._run.t_end - now[1]) * spent
        self._slow = self._slow + 1 if left > _TOO_LONG * t else 0
        if self._slow and (beyond := self._beyond_squares()):
            return beyond
        if self._slow >= _WINDOWS_OF_PARTITION and self._before_dependence():
            return failure_message(
                at.PARTITION_LOST, self._run.actions.form, self._run.method, self._run.arrays
            )
        if self._slow < _WINDOWS:
            return ""
        seconds = left / t if t > 0.0 else np.inf
        return self._of_events() if events >= 0.5 * steps else self._sentence(seconds, t / max(steps, 1))

    def _events_in_a_step(self, t: float, events: int) -> bool:
        """Whether events follow each other so fast that a fixed step goes over hundreds of them."""
        run = self._run
        began, before = self._step_began
        if run.method.adaptive or not t - began < run.arrays.fixed_step:
            self._step_began = t, events
            return False
        return events - before > _MOST_IN_A_STEP * max(1, len(run.system.events))

    def _beyond_squares(self) -> str:
        """The sentence where the state is so large that nothing is computed well of it any more, else ''."""
        arrays, system = self._run.arrays, self._run.actions.form
        y = np.abs(arrays.y[: system.nq + system.nv])
        largest = int(np.argmax(y)) if len(y) else 0
        if not len(y) or y[largest] <= _SQUARED:
            return ""
        return (
            f"The motion grows beyond all numbers: at t = {arrays.t:.9g} s {state_names(system)[largest]!r} is "
            f"{y[largest]:.1e}, and steps no longer get on. Look for what drives it, such as a stiffness or damping "
            "below zero, or end the run before."
        )

    def _of_events(self) -> str:
        """The sentence where each step ends at an event."""
        names = sorted({event.name for event in self._run.actions.log[-_EVENTS:]})
        which = f"events of {', '.join(names)}" if names else "jumps of forces"
        method = self._run.method
        how = "take another --rtol" if method.adaptive else "shorten --step"
        other = "radau5" if method.name == "dop853" else "dop853"
        return (
            f"The run does not get on at t = {self._run.arrays.t:.9g} s: {which} follow each other without end. Where "
            f"something knocks ever faster, give it a state of rest: [stops] have one, and so has dry friction, "
            f"[friction]; else {how}, or another method, such as {other}."
        )

    def _before_dependence(self) -> bool:
        """Whether independent coordinates are running out: constraints nearly depend on each other here."""
        run = self._run
        if run.method.form != "partition":
            return False
        system, arrays = run.actions.form, run.arrays
        return dependence.rank_is_lost(system, arrays.p, arrays.t, arrays.y[: system.nq], NEARLY_DEPENDENT)

    def _sentence(self, seconds: float, step: float) -> str:
        when, days = f"t = {self._run.arrays.t:.9g} s", seconds / _DAY
        rest = "for ever" if days > 1e6 else f"{days:.0f} days"
        return (
            f"The run does not get on at {when}: with steps of {step:.1e} s, as now, the rest would take {rest}. What "
            f"changes most from step to step is the acceleration behind {self._restless()}. Where a force jumps to and "
            "fro, the motion chatters: write friction that comes to rest as dry friction, [friction], hard contacts as "
            "[stops]. Where none does, loosen --rtol, or take a method for stiff systems, such as radau5."
        )

    def _restless(self) -> str:
        """The rate whose acceleration differs most, for its size, between here and a step ahead, quoted."""
        run = self._run
        system, arrays = run.actions.form, run.arrays
        n, nq = system.nq + system.nv, system.nq
        y = arrays.y[:n].copy()
        slope = system.kernel("rhs")(arrays.t, y, arrays.p)[:n]
        ahead = system.kernel("rhs")(arrays.t, y + 4.0 * arrays.h_last * slope, arrays.p)[:n]
        change = np.nan_to_num(np.abs(ahead - slope)[nq:], nan=np.inf)
        return repr(state_names(system)[nq + int(np.argmax(change))])
