"""The arrays through which Python and a step loop talk, for one run."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.large_models import suited_to_size
from symgen.runtime.integrate.loop import Loop
from symgen.runtime.integrate.projection import (
    LEAST_USUAL,
    MOST_USUAL,
    RESIDUAL_LEFT,
    project_state,
    projection_size,
)
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from collections import deque

    from symgen.runtime.code.call_block import CallBlock
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System

kkt = Late("symgen.runtime.constraints.kkt")
call_blocks = Late("symgen.runtime.code.call_block")

_CARRIED = ("control", "counters", "y", "f", "work", "dense", "tail")  # from step to step
_STEPS_ASIDE = 256
# What another form of the model has others of: a run goes to and fro between two of them at each stick and slip.
_OF_FORM = (
    "sizes", "f", "work", "coefficients", "_with_branches", "_over_choices", "addresses", "_keep", "_advance",
    "branches", "precomputed", "_n_tail", "_bound", "generation",
)  # fmt: skip
DIRECTIONS = {"rising": 1, "falling": -1, "both": 0}
NO_DIRECTION = 2  # of an event that is not looked for
_SHORTEST_STEP = 1e-150  # [s]: squares of the steps must not underflow
# How long steps of adaptive methods may be: a time [s], and a share of what the run has covered. Nothing that depends
# on the end of the run limits them, so that steps are the same for all ends.
_LONGEST = 1e3, 10.0
# A series follows a polynomial over any time, but events are looked for at a limited number of places in a step.
_LONGEST_WITH_EVENTS = 1e-6, 4.0
# While a stop is closed or a friction sticks: a state at rest does not tell how fast the forces on it change.
_LONGEST_HELD = 1e-3, 1.0 / 32.0
_KERNELS = {
    "events": at.EVENTS,
    "residual": at.RESIDUAL,
    "residual_jacobian": at.RESIDUAL_JACOBIAN,
    "residual_jacobian_entries": at.RESIDUAL_JACOBIAN,
    "energy": at.ENERGY,
    "constraint_residual": at.CONSTRAINT_RESIDUAL,
    "constraint_jacobian": at.CONSTRAINT_JACOBIAN,
    "gamma": at.GAMMA,
    "mass_matrix": at.MASS_MATRIX,
    "forces": at.FORCES,
}


class LoopArrays:
    """Arguments of an `advance_*` function, see docs/step-loops.md.

    Parameters
    ----------
    system : System
    method : Method
    p : ndarray
        Parameters, then inputs.
    t : float [s]
        Start.
    state : ndarray, shape (nq + nv,)
    frame_times : ndarray [s]
    rtol, atol : float
    step : float [s]
        Of a fixed-step method; 0 lets an adaptive one choose.
    with_events : bool
        Whether events are looked for.
    energy_level : float [J]
        T + V that the rates are scaled to after each step; nan: they are not.
    log_length : int
        Rows of the step log.
    """

    def __init__(
        self,
        system: System,
        method: Method,
        p: np.ndarray,
        t: float,
        state: np.ndarray,
        *,
        frame_times: np.ndarray,
        rtol: float,
        atol: float,
        step: float = 0.0,
        with_events: bool = True,
        energy_level: float = np.nan,
        log_length: int = 4096,
    ):
        method = suited_to_size(method, system)
        # Fixed steps run over jumps of forces, as they do over everything.
        self.jumps = system.jumps if with_events and method.adaptive else []
        self._take_coefficients(system, method)
        with_events = with_events and (method.adaptive or len(system.jumps) < len(system.events))
        self.n_events = len(system.events) if with_events else 0
        self._with_energy = bool(np.isfinite(energy_level))
        self._take_kernels(system, method)
        self.sizes = self._loop_sizes(system)
        self.p = np.array(p, dtype=float)
        self.control = np.zeros(at.N_CONTROL + at.N_EVENT_BLOCKS * self.n_events)
        self._prepare(system, method)
        self.counters = np.zeros(at.N_COUNTERS, dtype=np.int64)
        self.y = np.concatenate([state, np.zeros(system.nw)])
        self.f = np.zeros(system.n_row)
        self.work = np.zeros(method.work_size(self.coefficients, self.sizes))
        self.frame_times = np.array(frame_times, dtype=float)
        self.frames = np.zeros((len(frame_times), system.ny))
        self.step_log = np.zeros((log_length, 2))
        self.dense = np.zeros((8, system.ny))
        self._advance = method.advance()
        self._bound: Callable[[], int] | None = None
        self.generation = 0  # of the arrays: those of another form, or method, are others
        self._last_generation = 0
        self._form = system, method
        self._other_forms: dict[tuple[int, int], tuple] = {}  # by the identities of what they are of
        # For `kept_arrays`: where these are kept, what the last run with them began with, and their `state` then.
        self.home: deque[LoopArrays] | None = None
        self.opening: object = None
        self.first_state: tuple[np.ndarray, ...] = ()
        self._at_start = rtol, atol, step
        self._first_control: np.ndarray | None = None
        self._set_control(method, t, energy_level)
        self.tell_guard(system)

    def _set_control(self, method: Method, t: float, energy_level: float) -> None:
        c, first = self.control, self._first_control
        if first is not None and first[at.T] == t:
            c[:] = first
            c[at.ATOL], c[at.ENERGY_LEVEL] = self._at_start[1], energy_level
            return
        c[:] = 0.0
        c[at.RTOL], c[at.ATOL], c[at.H] = self._at_start
        self.fixed_step = 0.0 if method.adaptive else self._at_start[2]
        self.aimed_steps = method.aimed_steps
        c[at.H_MAX] = c[at.T_STOP] = c[at.T_WATCH] = np.inf
        c[at.H_MIN] = _SHORTEST_STEP
        c[at.T] = c[at.T_START] = c[at.T_GRID] = c[at.T_EVENT] = t
        self.limit_steps(method)
        c[at.ERROR_OLD] = 1e-4
        c[at.PROJECTION_TOL] = RESIDUAL_LEFT
        c[at.MIN_PIVOT_RATIO] = np.inf
        c[at.ENERGY_LEVEL] = energy_level
        self.event_block(at.LOWEST)[:] = np.inf
        self._first_control = c.copy()

    def begin_again(
        self,
        system: System,
        method: Method,
        p: np.ndarray,
        t: float,
        state: np.ndarray,
        *,
        atol: float,
        energy_level: float,
    ) -> None:
        """Put all back to before the first step, of another start: as made anew, but for frames, which are overwritten.

        Of arrays that were made without events for the same model, method, relative tolerance, step and frames, and
        with an energy level that was as finite.
        """
        method = suited_to_size(method, system)
        self.p[:] = p
        self._work_out(system, method)
        self.counters[:] = 0
        self.y[: len(state)], self.y[len(state) :] = state, 0.0
        for array in (self.f, self.work, self.dense):
            array[:] = 0.0
        self._at_start = self._at_start[0], atol, self._at_start[2]
        self._set_control(method, t, energy_level)
        if system.m:
            self._keep[0].forget()
        self.tell_guard(system)

    def advance(self, stop: float, max_steps: int, *, watch: float = np.inf, keep_log: bool = False) -> int:
        """Run the loop until an event, a failure, or for `max_steps` steps; returns its status.

        Parameters
        ----------
        stop : float [s]
            Where a step has to end, and the loop returns.
        watch : float [s]
            Before a step that may pass this time the loop returns NEAR_WATCH.
        keep_log : bool
            Log steps behind those of the last call.
        """
        self.set_limits(stop, max_steps, watch, keep_log=keep_log)
        self.look_for_choices()
        if self._bound is None:
            self._bound = self.block()
        return self._bound()

    def set_limits(self, stop: float, max_steps: int, watch: float, *, keep_log: bool = False) -> None:
        """Say where the next call of the loop ends; see `advance`."""
        self.control[at.T_STOP], self.control[at.T_WATCH] = stop, watch
        self.counters[at.MAX_STEPS_PER_CALL] = max_steps
        if not keep_log:
            self.counters[at.N_LOGGED_STEPS] = 0

    def block(self) -> CallBlock:
        """Return the call of the step loop as data, for machine code that calls it."""
        return call_blocks.call_block(self._advance, self.coefficients, self.loop())

    def load(self) -> None:
        """Compile the loop, or read it from the cache: it takes no step, but an adaptive method chooses its first one.

        There is no end to look at: where a run is cut must not change how it begins.
        """
        self.advance(np.inf, 0)

    def loop(self) -> Loop:
        """Return the record that the loop takes."""
        return Loop(
            self.addresses, self.sizes, self.precomputed, self.control, self.counters, self.y, self.f,
            self.work, self.frame_times, self.frames, self.step_log, self.dense,
        )  # fmt: skip

    @property
    def t(self) -> float:
        """Current time [s]."""
        return float(self.control[at.T])

    @property
    def h_last(self) -> float:
        """Length of the last accepted step [s]."""
        return float(self.control[at.H_LAST])

    @property
    def new_steps(self) -> np.ndarray:
        """Steps that the last call logged, shape (n, 2)."""
        return self.step_log[: self.counters[at.N_LOGGED_STEPS]]

    def state(self) -> tuple[np.ndarray, ...]:
        """Return a copy of all that the loop carries from step to step."""
        return (*(getattr(self, name).copy() for name in _CARRIED), self.guard_memory())

    def restore(self, state: tuple[np.ndarray, ...]) -> None:
        """Go on from a `state`."""
        for name, values in zip(_CARRIED, state):
            getattr(self, name)[...] = values
        self.recall_guard(state[-1])

    def reach_aside(self, t: float, state: tuple[np.ndarray, ...], stop: float) -> None:
        """Reach a time [s] from a state by steps beside the run: without events, and without frames.

        Parameters
        ----------
        stop : float [s]
            What the step that passes `t` must not pass. Where steps up to `t` fail, its dense output is taken.
        """
        self.restore(state)
        self.control[at.ASIDE] = 1.0
        next_frame, self.counters[at.NEXT_FRAME] = self.counters[at.NEXT_FRAME], len(self.frame_times)
        if self.advance(t, _STEPS_ASIDE) != at.REACHED_STOP:
            self.restore(state)
            self._interpolate(t, stop)
        self.control[at.ASIDE] = 0.0
        self.counters[at.NEXT_FRAME] = next_frame

    def _interpolate(self, t: float, stop: float) -> None:
        """Take one step, and make its dense output at `t` [s] the state."""
        t0, times, frames = self.t, self.frame_times, self.frames
        self.control[at.ASIDE], self.counters[at.NEXT_FRAME] = 1.0, 0
        self.frame_times, self.frames, self._bound = np.array([t]), np.zeros((1, len(self.y))), None
        self.advance(stop, 1)
        self.y[:] = self.frames[0]
        self.frame_times, self.frames, self._bound = times, frames, None
        self.step_log[0] = t, t - t0
        self.control[at.T], self.control[at.H_LAST] = t, t - t0
        self.counters[at.F_VALID] = 0

    def event_block(self, block: int) -> np.ndarray:
        """Return a view of one of the events' blocks, as SIDE or FIRED."""
        first = at.N_CONTROL + block * self.n_events
        return self.control[first : first + self.n_events]

    def project(self) -> int:
        """Project the state onto the constraints, with quaternions of unit length; returns a status."""
        if self.addresses[at.PROJECT] == 0:
            return at.RUNNING
        buffer = np.zeros(projection_size(self.sizes))
        return project_state(self.loop(), self.t, self.y, buffer)

    def restart(self, *, state_changed: bool) -> None:
        """Forget what no longer holds after the state was changed from outside."""
        self.counters[at.F_VALID] = 0
        if state_changed:
            self.control[at.ERROR_OLD] = 1e-4
            self.counters[at.LAST_REJECTED] = 0

    def change_method(self, system: System, method: Method) -> None:
        """Go on from the current state with another method, which chooses its own steps."""
        method = suited_to_size(method, system)
        self._take_coefficients(system, method)
        self._take_kernels(system, method)
        self._last_generation += 1
        self._bound, self.generation, self._form = None, self._last_generation, (system, method)
        self.work = np.zeros(method.work_size(self.coefficients, self.sizes))
        self._advance = method.advance()
        self.counters[at.FAMILY_COUNTERS :] = 0
        self.restart(state_changed=True)
        self.choose_step_anew()
        self.limit_steps(method)
        self.tell_guard(system)

    def change_form(self, system: System, method: Method, *, held: bool) -> None:
        """Go on with another form of the same model, with more constraints or fewer; `p` may have changed too.

        Parameters
        ----------
        held : bool
            A stop is closed, or a friction sticks.
        """
        least, step = self.control[at.MIN_PIVOT_RATIO], self.control[at.H]
        if not self._take_form_again(system, method):
            self.sizes = self._loop_sizes(system)
            self.f = np.zeros(system.n_row)
            self._prepare(system, method)
            self.change_method(system, method)
        self.control[at.MIN_PIVOT_RATIO] = least
        self.limit_steps(method, held=held)
        if not method.adaptive:
            self.control[at.H] = step

    def adopt(self, system: System, method: Method) -> bool:
        """Take up the arrays of a form that the run has had before, as they were left; whether it had."""
        method = suited_to_size(method, system)
        if system is self._form[0] and method is self._form[1]:
            return True
        self._other_forms[id(self._form[0]), id(self._form[1])] = (
            self._form, *(getattr(self, name) for name in _OF_FORM),
        )  # fmt: skip
        known = self._other_forms.pop((id(system), id(method)), None)
        if known is None:
            return False
        self._form = known[0]
        for name, value in zip(_OF_FORM, known[1:]):
            setattr(self, name, value)
        return True

    def visit(self, system: System, method: Method, *, held: bool, look: Callable[[], Any]) -> Any:
        """Return what `look` finds where the run is in a given form, and come back with all as it was."""
        own, kept = self._form, (self.control.copy(), self.counters.copy())
        if not self.adopt(system, method):
            self.change_form(system, method, held=held)
        else:
            self.limit_steps(self._form[1], held=held)
        found = look()
        self.adopt(*own)
        self.control[:], self.counters[:] = kept
        return found

    def _take_form_again(self, system: System, method: Method) -> bool:
        """Go on with the arrays of a form that the run has had before, as with new ones; whether it had."""
        if not self.adopt(system, method):
            return False
        self._work_out(system, self._form[1])
        self.f[:] = self.work[:] = 0.0
        self.counters[at.FAMILY_COUNTERS :] = 0
        self.restart(state_changed=True)
        self.choose_step_anew()
        if system.m:
            self._keep[0].forget()
        self.tell_guard(system)
        return True

    def _work_out(self, system: System, method: Method) -> None:
        """Work out in place what follows from `p`, and what the method carries behind it."""
        if self.precomputed is not self.p:
            found = system.worked_out(self.p)
            self.precomputed[: len(found)] = found
        if self.jumps:
            self.take_branches()
        if self._n_tail:
            self.tail[:] = method.tail(system)

    def _loop_sizes(self, system: System) -> np.ndarray:
        sizes = loop_sizes(system, with_events=self.n_events > 0)
        if self.n_events and not self.jumps:
            sizes[at.N_SIZES + np.array(system.jumps, dtype=int)] = NO_DIRECTION
        return sizes

    def take_branches(self) -> None:
        """Let forces that jump go on along the branches that their events are on the side of."""
        if not self.n_events:
            return
        self.event_block(at.BRANCH)[:] = 0.0
        self.event_block(at.BRANCH)[self.jumps] = np.arange(self.branches.start, self.branches.stop)
        self.precomputed[self.branches] = np.sign(self.event_block(at.SIDE)[self.jumps])

    def _take_coefficients(self, system: System, method: Method) -> None:
        self.coefficients = self._with_branches = method.coefficients(system)
        over = method.over_choices if self.jumps else None
        self._over_choices = None if over is None else over(self.coefficients)

    def look_for_choices(self) -> None:
        """Let steps look for choices while a branch is on neither side, as that of a force that is nothing so far."""
        if self._over_choices is None:
            return
        held = self.precomputed[self.branches].all()
        wanted = self._with_branches if held else self._over_choices
        if wanted is not self.coefficients:
            self.coefficients, self._bound = wanted, None

    @property
    def looks_for_choices(self) -> bool:
        """Whether the method's steps look for choices while a branch is on neither side."""
        return self._over_choices is not None

    def with_branches(self, branches: np.ndarray) -> np.ndarray:
        """Return `p` with other branches of forces that jump."""
        p = self.p.copy()
        p[self.branches] = branches
        return p

    def _prepare(self, system: System, method: Method) -> None:
        self.branches = slice(system.n_p - len(self.jumps), system.n_p)
        self.precomputed, tail = system.precomputed(self.p), np.zeros(0)
        if self.jumps:
            self.precomputed = np.array(self.precomputed)  # `p` itself, where nothing is precomputed
            self.take_branches()
        if method.tail is not None:
            tail = method.tail(system)
            self.precomputed = np.concatenate([self.precomputed, tail])
        self._n_tail = len(tail)

    @property
    def tail(self) -> np.ndarray:
        """A view of what the method carries behind the precomputed `p`."""
        return self.precomputed[len(self.precomputed) - self._n_tail :]

    def _take_kernels(self, system: System, method: Method) -> None:
        with_events = self.n_events > 0
        self.addresses, self._keep = kernel_addresses(
            system, method, with_events=with_events, with_energy=self._with_energy
        )

    def tell_guard(self, system: System) -> None:
        """Tell the guard of a constrained model what to expect of the constraints where the run is now."""
        if system.m:
            self._keep[0].expect(self.p, self.t, self.y[: system.nq])
            size = self._keep[0].residual_size
            usual = LEAST_USUAL <= size <= MOST_USUAL
            self.control[at.PROJECTION_TOL] = RESIDUAL_LEFT * (1.0 if usual else size**2)

    def limit_steps(self, method: Method, *, held: bool = False) -> None:
        """Set how long steps may be; `held`: while a stop is closed, or a friction sticks."""
        base, share = np.inf, 0.0
        if method.adaptive and held:
            base, share = _LONGEST_HELD
        elif method.series and self.n_events:
            base, share = _LONGEST_WITH_EVENTS
        elif method.adaptive:
            base, share = _LONGEST
        least = 1e3 * np.spacing(abs(self.control[at.T_START]))
        self.control[at.H_BASE], self.control[at.H_SHARE] = max(base, least), share

    def limit_longest(self, longest: float) -> None:
        """Set the longest step [s] from here on."""
        self.control[at.H_MAX] = longest

    def move_time(self, t: float) -> None:
        """Go on from a time [s] that differs in the last digits only: where what comes after a jump holds."""
        self.control[at.T] = t
        k = int(self.counters[at.NEXT_FRAME])
        while k < len(self.frame_times) and self.frame_times[k] <= t:
            self.frames[k] = self.y
            k += 1
        self.counters[at.NEXT_FRAME] = k

    def show_frames(self, times: np.ndarray) -> None:
        """Go on with other frames behind the first one, which the run has passed [s]."""
        self.frame_times[1 : 1 + len(times)] = times
        self.frame_times[1 + len(times) :] = np.inf
        self.counters[at.NEXT_FRAME] = 1

    def make_room_for_frames(self, n: int) -> None:
        """Let there be n frames; those that there are stay."""
        more = n - len(self.frame_times)
        self.frame_times = np.append(self.frame_times, np.full(more, np.inf))
        self.frames = np.vstack([self.frames, np.zeros((more, self.frames.shape[1]))])
        # All that machine code has been told of these arrays is told anew.
        self._other_forms.clear()
        self._last_generation += 1
        self._bound, self.generation = None, self._last_generation

    def guard_arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the arrays that the guard of a constrained model reads; without one, empty ones."""
        if not hasattr(self._keep[0], "arrays"):
            return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
        return self._keep[0].arrays

    def guard_memory(self) -> np.ndarray:
        """What the guard of a constrained model has taken note of; without one, an empty array."""
        return self._keep[0].memory if hasattr(self._keep[0], "memory") else np.zeros(0)

    def recall_guard(self, memory: np.ndarray) -> None:
        """Bring the guard into the state of `guard_memory`."""
        if len(memory):
            self._keep[0].memory = memory

    def choose_step_anew(self) -> None:
        """Let an adaptive method choose its next step as at the start of a run."""
        self.control[at.H] = 0.0


def kernel_addresses(
    system: System, method: Method, *, with_events: bool, with_energy: bool = False
) -> tuple[np.ndarray, list[Any]]:
    """Return the addresses of the kernels that a run needs, and what keeps their code; they take a precomputed `p`.

    Constrained models get the guarded versions of `rhs` and `project`, which survive dependent constraints; versions
    of the method's own take the place of either.
    """
    addresses, keep = np.zeros(at.N_KERNELS, dtype=np.uint64), []
    if system.m:
        keep.append(kkt.lease_guard(system))
        addresses[at.RHS], addresses[at.PROJECT] = keep[0].rhs, keep[0].project
    else:
        for index, name in ((at.RHS, "rhs"), *(((at.PROJECT, "project"),) if system.quaternions else ())):
            keep.append(system.kernel(name))
            addresses[index] = keep[-1].precomputed_address
    more = [
        name for name, used in (("events", with_events and system.events), ("energy", with_energy)) if used
    ]
    for name in (*method.kernels, *more):
        keep.append(system.kernel(name))
        addresses[_KERNELS[name]] = keep[-1].precomputed_address
    if method.versions is not None:
        for index, (address, owner) in method.versions(system).items():
            addresses[index] = address
            keep.append(owner)
    return addresses, keep


def loop_sizes(system: System, *, with_events: bool) -> np.ndarray:
    """Return the array `sizes` of the step loops: numbers, the events' directions, the quaternions' places."""
    events = system.events if with_events else ()
    sizes = [system.nq, system.nv, system.nw, system.nh, system.m, len(events), system.ny, system.n_row]
    directions = [DIRECTIONS[event["direction"]] for event in events]
    return np.array([*sizes, *directions, *system.quaternions, system.nq], dtype=np.int64)
