"""One run: calls the step loop, acts on events, hands frames on, and takes states at times that are wanted.

The steps are those of a run without an end that nobody watches. A state that is wanted between two of them is reached
by a step beside the run, of the method's own order, from the last one before; and so is the end. A checkpoint at the
end is of that last one, and a run that goes on from it takes the steps of a run that was never cut.
"""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.constraints.start_values import moved_notes
from symgen.runtime.errors import ContactError
from symgen.runtime.event_actions import EventRecord, ResetError, end_message, tell
from symgen.runtime.exchange import energy_error_so_far
from symgen.runtime.failures import failure_message
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import plain_events
from symgen.runtime.lazy import Late
from symgen.runtime.options import SAME_TICKS, time_resolution
from symgen.runtime.run_state import RunState
from symgen.runtime.stall import StallWatch
from symgen.runtime.uninterrupted import uninterrupted

if TYPE_CHECKING:
    from symgen.runtime.checkpoint_bytes import Checkpoint

runtime_checkpoint = Late("symgen.runtime.checkpoint")
events_in_code = Late("symgen.runtime.events_in_code")
frictions_in_code = Late("symgen.runtime.frictions_in_code")
jumps_in_code = Late("symgen.runtime.jumps_in_code")

_FRAMES_AT_ONCE = 1000
_FEW_FORMS = 2  # of a model with stops; the arrays of both cost what two events do
_FIRST_STEPS = 200
_SECONDS_PER_CALL = 0.1
_STIFF_SIGNS = 15
_STEPS_ASIDE = 256


class Run(RunState):
    """A run that goes on.

    Its parameters are those of `RunState`.
    """

    def __init__(self, *arguments: Any, **options: Any):
        super().__init__(*arguments, **options)
        if self.timetable is not None:
            self.arrays.limit_longest(self.timetable.longest(self.arrays.t))
        self._tries_both_forms = True
        self._in_code = self._acts_in_code()

    def _acts_in_code(self) -> Any:
        """Return what acts on plain events in machine code, None where nothing does."""
        if not self.arrays.n_events:
            return None
        given = self.system, self.method, self.arrays
        if (
            events_in_code.has_plain_events(self.system)
            or events_in_code.has_impacts_beside_constraints(self.system)
            or events_in_code.has_own_events_on_constraints(self.system)
        ):
            return events_in_code.EventsInCode(*given)
        if jumps_in_code.has_events_beside_jumps(self.system, self.arrays):
            return jumps_in_code.EventsBesideJumps(*given)
        if jumps_in_code.has_plain_jumps(self.system, self.arrays):
            return jumps_in_code.JumpsInCode(*given)
        if frictions_in_code.has_plain_frictions(*given):
            return frictions_in_code.FrictionsInCode(*given, self.inputs)
        return None

    def _act_in_both_forms(self) -> None:
        """Let machine code close and open stops as well, once some have stayed closed, or others were struck then."""
        given, n_events = (self.system, self.method, self.arrays), len(self.forms)
        if self.actions.is_held:
            n_events = max(n_events, len(self.actions.log))
        if self._in_code is None or self._in_code.in_both_forms:
            return
        if n_events <= _FEW_FORMS or not self._tries_both_forms:
            return
        self._tries_both_forms = frictions_in_code.has_plain_frictions(*given)
        if self._tries_both_forms:
            self._in_code = frictions_in_code.FrictionsInCode(*given, self.inputs)

    def go(self) -> None:
        """Run to the end, to a terminating event, to a failure, or until Ctrl-C."""
        began, whole = time.perf_counter(), True
        try:
            if not self.is_resumed:
                with uninterrupted():
                    self._begin()
            self._act_in_both_forms()
            if hasattr(self.progress, "watch"):
                self.progress.watch(self)
            self._loop()
        except KeyboardInterrupt:
            self._end("interrupted", f"Interrupted at t = {self.arrays.t:.9g} s; all up to there is kept.")
        except (ResetError, ContactError) as error:
            whole = False
            self._end("failed", str(error))
        self._hand_on_frames()
        if whole:
            self._keep_checkpoint(final=True)
        self._finish_frames()
        self.seconds = time.perf_counter() - began

    def _begin(self) -> None:
        arrays = self.arrays
        arrays.frames[0] = arrays.y
        arrays.counters[at.NEXT_FRAME] = 1
        self.actions.begin()
        if self.actions.switching is not None:
            self.notes += moved_notes(self.actions.switching.moved, "assembly, out of stops,")
        self._take_form()
        arrays.frames[0] = arrays.y
        if self.recorder is not None:
            self.recorder.start(arrays.t, arrays.y.copy())
        if self.timetable is not None:
            self.timetable.follow(arrays, self.method)

    def _loop(self) -> None:
        arrays, n_steps, running = self.arrays, _FIRST_STEPS, True
        watch = StallWatch(self)
        while running and self.stops and not self.pauses():
            if self._is_there(self.stops[0]):
                self._take_sample()
                continue
            before = time.perf_counter()
            # Ctrl-C before the status is acted on would leave a state that nobody can go on from.
            with uninterrupted():
                if self.inputs is None and self.timetable is None:
                    status = self._advance(np.inf, self._allowed(n_steps))
                else:
                    status = self._advance_over_breaks(n_steps)
                took = time.perf_counter() - before
                running = self._after_call(status)
                self._keep_checkpoint()
            if running and (objection := watch.objection()):
                self._end("failed", objection)
                return
            if took < 0.5 * _SECONDS_PER_CALL:
                n_steps = min(2 * n_steps, len(arrays.step_log))
            elif took > 2.0 * _SECONDS_PER_CALL:
                n_steps = max(1, n_steps // 2)

    def resume(self, checkpoint: Checkpoint, past: np.ndarray) -> None:
        """Take up a run where it was left: `go` then goes on from there.

        Parameters
        ----------
        checkpoint : symgen.runtime.checkpoint.Checkpoint
        past : ndarray, shape (n, ny)
            The frames before it, the first ones of `arrays.frames`.
        """
        runtime_checkpoint.put_back(checkpoint, self, past)
        self.is_resumed = True
        last = self.samples[-1][0] if self.samples else -np.inf
        self.stops = [t for t in self.stops if t > last]

    def _keep_checkpoint(self, *, final: bool = False) -> None:
        """Give a recorder that keeps checkpoints the chance to take one."""
        keep = getattr(self.recorder, "checkpoint", None)
        if keep is not None:
            keep(
                lambda: (self.at_last_step or runtime_checkpoint.take(self)).to_bytes(sealed=True),
                final=final,
            )

    def pauses(self) -> bool:
        """Whether to leave the rest of the run to a later call."""
        return False

    def _after_call(self, status: int) -> bool:
        """Collect what a call of the step loop has left, act on its status; returns whether to go on."""
        self._collect()
        if self.system.has_feedback:
            self.system.refuse_faults()
        if self.forces_jumped and status != at.EVENT:
            self._settle_jump()
        if status < 0 and self.fallback is not None:
            self._fall_back()
            return True
        if status < 0:
            objection = self.actions.switching.objection() if self.actions.switching is not None else ""
            self._end(
                "failed", objection or failure_message(status, self.actions.form, self.method, self.arrays)
            )
            return False
        if status == plain_events.ZENO:
            self._pile_up(self.actions.log[-1].name, self._in_code.accumulation)
            return False
        if status == at.EVENT:
            there = self._is_there(self.stops[0]) if self.stops else True
            goes_on = self._on_event()
            if (
                goes_on and self.forces_jumped
            ):  # an impact of the same instant comes first: it is none any more then
                self._settle_jump()
            return goes_on and (there or not self._steps_used_up())
        return not (status == at.RUNNING and self._steps_used_up())

    def _advance_over_breaks(self, n_steps: int) -> int:
        """Advance by `n_steps` at most, over times that steps land on; collecting at each would take longest."""
        arrays, status, keep_log = self.arrays, at.REACHED_STOP, False
        last = int(arrays.counters[at.STEPS]) + self._allowed(n_steps)
        while status == at.REACHED_STOP and self.stops and not self._is_there(self.stops[0]):
            allowed = last - int(arrays.counters[at.STEPS])
            if allowed < 1 or (keep_log and arrays.counters[at.N_LOGGED_STEPS] >= len(arrays.step_log)):
                return at.RUNNING
            status = self._advance(self._next_stop(), allowed, keep_log=keep_log)
            keep_log = True
            self._follow_time()
            if self.forces_jumped and status == at.REACHED_STOP and self.actions.is_untouched():
                self.forces_jumped = False
            if self.forces_jumped:
                return at.RUNNING if status == at.REACHED_STOP else status
        return status

    def _next_stop(self) -> float:
        """Return where the next call of the step loop ends [s]."""
        stop = np.inf if self.inputs is None else self.inputs.next_stop
        return stop if self.timetable is None else min(stop, self.timetable.next_stop(self.arrays.t))

    def _follow_time(self) -> None:
        """Let what time alone changes go on from here."""
        if self.inputs is not None:
            self._follow_inputs()
        if self.timetable is not None and self.timetable.follow(self.arrays, self.method):
            self.actions.begin_a_piece()
            self.forces_jumped |= self.actions.switching is not None

    def _follow_inputs(self) -> None:
        """Let inputs over time go on from here; accelerations may jump with them."""
        arrays, until = self.arrays, self.inputs.next_stop
        jumped = self.inputs.follow(arrays.t, arrays.y[: self.system.nq + self.system.nv])
        if self.inputs.next_stop != until:
            jumped |= self.actions.begin_a_piece()
        if not jumped:
            return
        arrays.restart(state_changed=False)
        if self.method.multistep:
            arrays.choose_step_anew()  # its history is of the motion before the jump
        self.forces_jumped = self.actions.switching is not None

    def _settle_jump(self) -> None:
        """Let go of what jumping forces no longer hold, which no event function shows."""
        self.forces_jumped = False
        records = self.actions.settle_jump()
        self._take_form()
        self._report_events(records)

    def _fall_back(self) -> None:
        before, self.method, self.fallback = self.method, self.fallback, None
        self.notes.append(
            f"method auto: {self.method.name} from t = {self.arrays.t:.9g} s on, where {before.name} cannot go on"
        )
        self.arrays.change_method(self.actions.form, self.method)
        self.arrays.limit_steps(self.method, held=self.actions.is_held)
        self._in_code, self._tries_both_forms = self._acts_in_code(), True

    def _allowed(self, n_steps: int) -> int:
        if self.max_steps is None:
            return n_steps
        return max(1, min(n_steps, self.max_steps - int(self.arrays.counters[at.STEPS])))

    def _steps_used_up(self) -> bool:
        if self.max_steps is None or self.arrays.counters[at.STEPS] < self.max_steps:
            return False
        remedy = "loosen --rtol" if self.method.adaptive else "lengthen --step"
        self._end(
            "failed",
            f"All {self.max_steps} steps allowed were used up at t = {self.arrays.t:.9g} s, with steps of "
            f"{self.arrays.h_last:.1e} s: allow more, or {remedy}.",
        )
        return True

    def _is_there(self, wanted: float) -> bool:
        return self.arrays.t >= wanted or self._same(self.arrays.t, wanted)

    def _same(self, t: float, wanted: float) -> bool:
        return abs(t - wanted) <= SAME_TICKS * time_resolution(self.t_start, wanted)

    def _advance(self, stop: float, n_steps: int, *, keep_log: bool = False) -> int:
        """Advance to `stop` [s], by `n_steps` at most; returns the status of the loop."""
        wanted = self.stops[0]
        watch = min(wanted if wanted < stop else np.inf, self._end_of_frames)
        if self._code_may_act():
            status = self._in_code.advance(self.actions, stop, n_steps, watch, keep_log=keep_log)
        else:
            status = self.arrays.advance(stop, n_steps, watch=watch, keep_log=keep_log)
        if status != at.NEAR_WATCH:
            return status
        if wanted <= watch:
            return self._step_past(stop)
        self._move_frames()
        return at.RUNNING

    def _code_may_act(self) -> bool:
        """Whether machine code may act on the events of the form that applies."""
        return self._in_code is not None and (self._in_code.in_both_forms or not self.actions.is_held)

    @property
    def _end_of_frames(self) -> float:
        """The last frame that there is room for [s]; inf where that is the last one of the run."""
        return np.inf if self.window is None else self.window.end

    def _move_frames(self) -> None:
        """Make room for the frames to come."""
        self._collect()
        self.window.move(self)

    def _step_past(self, stop: float) -> int:
        """Take one step, and the states that it passes: by steps beside it, since those of the run must not change."""
        arrays = self.arrays
        self._collect_steps()
        self._hand_on()  # samples and checkpoints hold what is done by now
        before, checkpoint = arrays.state(), self._before_the_end()
        status = arrays.advance(stop, 1, watch=self._end_of_frames)
        if status == at.NEAR_WATCH:
            self._move_frames()
            return at.RUNNING
        if status < 0 and self.fallback is None:
            # What the run would meet behind the time that is wanted, or behind its end, is none of its business.
            arrays.restore(before)
            status = arrays.advance(min(stop, self.stops[0]), _STEPS_ASIDE, watch=self._end_of_frames)
            return status if status != at.NEAR_WATCH else at.RUNNING
        t = arrays.t
        passed = list(
            itertools.takewhile(lambda x: t > x and (status == at.EVENT or not self._same(t, x)), self.stops)
        )
        if passed:
            ends = len(passed) == len(self.stops)  # there is nothing to go on to
            after, logged = None if ends else arrays.state(), arrays.step_log[0].copy()
            for wanted in passed:
                arrays.reach_aside(wanted, before, stop)
                if len(self.stops) == 1:
                    self._end_at(wanted, checkpoint)
                    return at.REACHED_STOP
                self._keep_sample(wanted)
            arrays.restore(after)
            arrays.step_log[0] = logged
        if status != at.EVENT and self._same(t, self.stops[0]):
            self._take_sample(checkpoint)
        if status == at.EVENT and self._code_may_act():
            # The step once more, by what acts on events otherwise: Python's impulses have other last digits, and what
            # is wanted beside a run must not change it.
            arrays.restore(before)
            status = self._in_code.advance(self.actions, stop, 1, self._end_of_frames, keep_log=False)
        return status if self.stops else at.REACHED_STOP

    def _before_the_end(self) -> Checkpoint | None:
        """Return a checkpoint where the next step may pass the end."""
        if not hasattr(self.recorder, "checkpoint"):
            return None
        arrays = self.arrays
        near = arrays.t + 1.01 * arrays.control[at.H] >= self.stops[-1]
        return runtime_checkpoint.take(self) if near else None

    def _checkpoint(self) -> Checkpoint | None:
        """Return a checkpoint where somebody keeps it."""
        return runtime_checkpoint.take(self) if hasattr(self.recorder, "checkpoint") else None

    def _take_sample(self, checkpoint: Checkpoint | None = None) -> None:
        """Take the present state as the one that is wanted next; but for ticks of floating-point time, it is there.

        Steps of adaptive methods that nobody watches are projected in passing, and go on like that.
        """
        arrays = self.arrays
        with uninterrupted():
            state = arrays.y.copy()
            checkpoint = checkpoint or (self._checkpoint() if len(self.stops) == 1 else None)
            if self.method.adaptive:
                arrays.project()
            if len(self.stops) == 1:
                self._end_at(self.stops[0], checkpoint)
            else:
                self._keep_sample(self.stops[0])
                arrays.y[:] = state

    def _end_at(self, t: float, checkpoint: Checkpoint | None) -> None:
        """End at `t` [s] with the present state, and the frame there; those before it are written."""
        arrays = self.arrays
        self.at_last_step = checkpoint
        arrays.control[at.T] = t
        n = int(np.searchsorted(arrays.frame_times, t, side="right"))
        if n and arrays.frame_times[n - 1] == t:
            arrays.frames[n - 1] = arrays.y
        arrays.counters[at.NEXT_FRAME] = n
        self._keep_sample(t)

    def _keep_sample(self, t: float) -> None:
        self.samples.append((t, self.arrays.y.copy(), self.actions.energy_of_resets, len(self.forms) - 1))
        self.stops.pop(0)

    def _collect_steps(self) -> None:
        arrays = self.arrays
        self.step_log.add(arrays.new_steps)
        if self.recorder is not None:
            self.recorder.steps(arrays.new_steps)
        arrays.counters[at.N_LOGGED_STEPS] = 0

    def _collect(self) -> None:
        arrays = self.arrays
        self._collect_steps()
        self._hand_on()
        if arrays.counters[at.STIFF_COUNT] >= _STIFF_SIGNS and not self.stiff_noted:
            self.stiff_noted = True
            self.notes.append(
                f"from about t = {arrays.t:.3g} s stability, not accuracy, limits the step of {self.method.name} "
                f"({arrays.h_last:.1e} s): method radau5 may be faster"
            )
        if self.progress is not None:
            self.progress(arrays.t, int(arrays.counters[at.STEPS]))

    def _hand_on(self) -> None:
        """Hand on frames, and what machine code has acted on between them."""
        if self._has_changes():
            self._hand_on_events()
        else:
            self._hand_on_frames()

    def _has_changes(self) -> bool:
        """Whether machine code has acted on events that nobody has been told of."""
        return self._in_code is not None and bool(self._in_code.changes)

    def _hand_on_events(self) -> None:
        """Hand on frames, and report between them the events that machine code has acted on, in their order."""
        first, n_forms = self.handed, len(self.forms)
        before, frames, sums, settings, is_new = self._in_code.take_changes()
        if self.recorder is None:
            if is_new.any():
                self.forms.extend(settings[is_new])
            self._hand_on_frames()
        else:
            records = self.actions.log.latest(len(frames))
            for k, (record, frame) in enumerate(zip(records, frames)):
                self._hand_on_frames(int(frame))
                if is_new[k]:
                    self._note_form(settings[k])
                self._report_events([record])
            self._hand_on_frames()
        known = np.searchsorted(frames, np.arange(first, self.handed), side="right")
        self.reset_energy_at_frames[first : self.handed] = np.append(before, sums)[known]
        since = np.append(0, np.cumsum(is_new))
        self.form_at_frames[first : self.handed] = n_forms - 1 + since[known]

    def _hand_on_frames(self, end: int | None = None) -> None:
        """Hand on frames before `end`; by default all that are written."""
        arrays, end = self.arrays, int(self.arrays.counters[at.NEXT_FRAME]) if end is None else end
        if end == self.handed:
            return
        new = slice(self.handed, end)
        self.reset_energy_at_frames[new] = self.actions.energy_of_resets
        self.form_at_frames[new] = len(self.forms) - 1
        if self.recorder is not None:
            begin = max(self.handed, 1)  # the recorder has had the start
            shown = self.shown[begin:end]
            times, frames = arrays.frame_times[begin:end], arrays.frames[begin:end]
            if not shown.all():
                times, frames = times[shown], frames[shown]
            for first in range(0, len(times), _FRAMES_AT_ONCE):
                chunk = slice(first, first + _FRAMES_AT_ONCE)
                self.recorder.frames(times[chunk], frames[chunk])
        self.handed = end

    def _on_event(self) -> bool:
        arrays = self.arrays
        n_jumps = self.actions.n_jumps
        records, terminate, accumulation = self.actions.act()
        if self.actions.n_jumps > n_jumps and self.method.multistep:
            arrays.choose_step_anew()  # its history is of the motion before the jump
        changed = any(record.action not in ("record", "terminate") for record in records)
        self._take_form()
        if changed and np.isfinite(arrays.control[at.ENERGY_LEVEL]):
            arrays.control[at.ENERGY_LEVEL] = self.actions.energy() - self._work()
        if changed and self.method.adaptive:
            arrays.choose_step_anew()
        self._report_events(records)
        if terminate:
            ended_by = next(record.name for record in records if record.action == "terminate")
            self._end("terminated", end_message(self.system, ended_by, arrays.t))
            return False
        if accumulation is not None:
            self._pile_up(records[0].name, accumulation)
            return False
        return True

    def _pile_up(self, name: str, t: float) -> None:
        """End where events pile up at a time [s]."""
        self._end(
            "zeno",
            f"Event {name!r} repeats at ever shorter intervals, which pile up at t = {t:.9g} s: the model needs a "
            "state of rest there, such as an event that terminates the run below some speed.",
        )

    def energy_error(self) -> float:
        """Return the present error of T + V - work since the start, in parts of what the motion exchanged so far."""
        arrays = self.arrays
        if self.window is None:
            frames, n, at_start = arrays, int(arrays.counters[at.NEXT_FRAME]), self.reset_energy_at_frames[0]
        else:
            frames, n, at_start = self.window.so_far(self)
        resets = self.actions.energy_of_resets - at_start
        return energy_error_so_far(self.system, frames, n, arrays.t, arrays.y, resets)

    def _work(self) -> float:
        n = self.system.nq + self.system.nv
        return float(self.arrays.y[n:].sum())

    def _take_form(self) -> None:
        """Go on with stops and frictions as they are now."""
        switching = self.actions.switching
        if switching is None:
            return
        settings = switching.settings
        if self.forms and np.array_equal(settings, self.forms[-1]):
            self._act_in_both_forms()
            return
        self._note_form(settings)
        self.arrays.p[self.system.settings_of_switches] = settings
        self.arrays.change_form(self.actions.form, self.method, held=switching.any_held)
        self._act_in_both_forms()
        if self.inputs is not None:
            self.inputs.take_form(self.actions.form)

    def _note_form(self, settings: np.ndarray) -> None:
        """Take note of other settings of stops and frictions."""
        self.forms.append(settings)
        if hasattr(self.recorder, "settings"):
            self.recorder.settings(settings)

    def _report_events(self, records: list[EventRecord]) -> None:
        if self.recorder is not None:
            for record in records:
                tell(self.recorder, record)

    def _end(self, status: str, message: str) -> None:
        self.status, self.message = status, message

    def _finish_frames(self) -> None:
        """Keep the state at which the run stopped, where that is not a frame already."""
        arrays, n = self.arrays, self.handed
        if n and arrays.frame_times[n - 1] == arrays.t and arrays.frames[n - 1].tolist() == arrays.y.tolist():
            return
        self.last = (arrays.t, arrays.y.copy())
        if self.recorder is not None:
            self.recorder.frames(np.array([arrays.t]), arrays.y[None].copy())
