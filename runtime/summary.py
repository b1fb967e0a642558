"""From a finished run to its Solution: energies, constraint residuals, samples, statistics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, constraint_residuals, evaluate
from symgen.runtime.batches import outputs as outputs_at
from symgen.runtime.exchange import Exchange, energy_limit
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.options import checked_frames
from symgen.runtime.passed_frames import Frames
from symgen.runtime.solution import ConstraintResidual, Energy, Sample, Solution

if TYPE_CHECKING:
    from symgen.runtime.contact.forms import Forms
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.run_state import FormLog, RunState
    from symgen.runtime.system import System

contact_forms = Late("symgen.runtime.contact.forms")
work_quadrature = Late("symgen.runtime.work_quadrature")

_STATISTICS = {
    "steps": at.STEPS,
    "rejected": at.REJECTED,
    "rhs": at.RHS_CALLS,
    "jacobians": at.JACOBIANS,
    "factorisations": at.FACTORISATIONS,
    "newton": at.NEWTON_ITERATIONS,
    "projections": at.PROJECTIONS,
}
_ENERGY_SCALING = (
    "energy scaling: on, as forces are conservative or constant and constraints do not move; errors that it took away "
    "add up to {:.2g} of what the motion exchanges"
)

_WORK_ALONG = (
    "work: integrated along the frames, as steps were too long for its power, though not for the motion (with what was "
    "integrated beside the motion, the energy balance would be off by {:.2g} of what the motion exchanges)"
)


def summarise(
    run: RunState,
    sample_times: Sequence[float],
    notes: list[str],
    seconds: dict[str, float],
    settings: dict[str, Any],
) -> Solution:
    """Return the Solution of a run.

    Parameters
    ----------
    run : RunState
        After `go`.
    sample_times : sequence of float [s]
        Those that the user asked for.
    settings : dict
        Method, tolerances and the like, as `Solution` has them.
    """
    system, p = run.system, run.arrays.p.copy()
    run.actions.note_gaps()
    passed = _collected(run)
    times, rows, resets, shown = passed.t, passed.y, passed.resets, passed.shown
    forms = contact_forms.Forms(run.forms.array(), passed.forms) if run.forms else None
    if run.window is not None:
        notes = [*notes, *run.window.note(len(times))]
    work = resets + (rows[:, system.nq + system.nv] if system.nw else 0.0)
    wanted = set(map(float, sample_times))
    sampled = [entry for entry in run.samples if entry[0] in wanted]
    # The end is a frame as well.
    between = [x for x in run.samples if x[0] != times[-1] or x[1].tolist() != rows[-1].tolist()]
    seen = _Seen(system, p, times, rows, between)
    counters = run.arrays.counters.tolist()
    taken, scales = (
        run.arrays.control[at.MOST_ENERGY_TAKEN],
        math.isfinite(run.arrays.control[at.ENERGY_LEVEL]),
    )
    if system.nw or scales:
        energy = _energy(seen, work, taken)
        limit = energy_limit(find_method(settings["method"]), settings["rtol"])
        if system.nw and energy.max_error > limit:
            along = _work_along(seen, work, forms, _jumps(run))
            if along is not None:
                notes = [*notes, _WORK_ALONG.format(energy.max_error)]
                work, energy = along, _energy(seen, along, taken, with_samples=False)
        if scales:
            notes = [*notes, _ENERGY_SCALING.format(energy.taken)]
    else:
        energy = Energy.later(lambda: _energy(seen, work, taken))
    whole = Solution(
        system=system,
        p=p,
        t=times,
        q=rows[:, : system.nq],
        v=rows[:, system.nq : system.nq + system.nv],
        w=work.copy(),
        samples=_samples(system, p, sampled, run.forms),
        forms=forms,
        events=run.actions.log,
        energy=energy,
        constraint_residual=ConstraintResidual.later(lambda: _residual(seen)),
        step_log=run.step_log.array(),
        stats={name: counters[index] for name, index in _STATISTICS.items()},
        status=run.status,
        message=run.message,
        notes=notes,
        seconds=seconds,
        min_pivot_ratio=float(run.arrays.control[at.MIN_PIVOT_RATIO]),
        lowest_gaps=run.actions.lowest_gaps,
        passed_by=run.actions.passed_by(),
        timetable=run.timetable,
        **settings,
    )
    checked = checked_frames(times, shown, settings["t_start"], settings["t_end"])
    if not checked.all():
        whole = _at_some_frames(whole, checked)
    if shown is checked or np.array_equal(shown, checked):
        return whole
    return replace(_at_some_frames(whole, shown[checked]), whole=whole)


def _at_some_frames(whole: Solution, shown: np.ndarray) -> Solution:
    """Return a run with some of its frames; what was found over all of them stays."""
    energy, residual = whole.energy, whole.constraint_residual
    return replace(
        whole,
        t=whole.t[shown],
        q=whole.q[shown],
        v=whole.v[shown],
        w=whole.w[shown],
        forms=None if whole.forms is None else replace(whole.forms, index=whole.forms.index[shown]),
        energy=Energy.later(
            lambda: replace(
                energy,
                kinetic=energy.kinetic[shown],
                potential=energy.potential[shown],
                work=energy.work[shown],
            )
        ),
        constraint_residual=ConstraintResidual.later(
            lambda: replace(residual, position=residual.position[shown], velocity=residual.velocity[shown])
        ),
    )


class _Seen(NamedTuple):
    """The states that are looked at: all frames, and what a user wanted besides."""

    system: System
    p: np.ndarray
    times: np.ndarray
    rows: np.ndarray
    samples: list[tuple[float, np.ndarray, float, int]]


def _energy(seen: _Seen, work: np.ndarray, taken: float, *, with_samples: bool = True) -> Energy:
    """Return the energies at the frames, and what is off: `taken` is what energy scaling took away [J]."""
    system, p, times, rows, samples = seen
    energies = evaluate(system, "energy", p, times, rows)
    extra = _sample_energies(system, p, samples if with_samples else [])
    with np.errstate(invalid="ignore", over="ignore"):  # the health report says what is not finite
        # The same as sums of rows, in a fifth of the time.
        balance = energies[:, 0] + energies[:, 1] - work
        error = np.abs(balance - balance[0]).max()
        exchange = Exchange(energies, work, holds=bool(system.switches))
        if len(extra["balance"]):
            exchange.take(extra["energies"], extra["work"])
            error = np.maximum(error, np.abs(extra["balance"] - balance[0]).max())
        error = float(exchange.relative(error))
        relative = float(exchange.relative(taken))
    return Energy(energies[:, 0], energies[:, 1], work, exchange, error, relative)


def _work_along(
    seen: _Seen, work: np.ndarray, forms: Forms | None, jumps: list[EventRecord]
) -> np.ndarray | None:
    """Return the work integrated along the frames, where that balances the energies better."""
    system, p, times, rows = seen[:4]
    energies = evaluate(system, "energy", p, times, rows)
    states = rows[:, : system.nq + system.nv]
    return work_quadrature.work_that_balances(system, p, times, states, energies, work, forms, jumps)


def _residual(seen: _Seen) -> ConstraintResidual:
    """Return the residuals at the frames, and the largest of all states."""
    position, velocity = constraint_residuals(seen.system, seen.p, seen.times, seen.rows)
    largest = [position.max(), velocity.max()]
    if seen.samples:
        times = np.array([entry[0] for entry in seen.samples])
        rows = np.vstack([entry[1] for entry in seen.samples])
        for k, values in enumerate(constraint_residuals(seen.system, seen.p, times, rows)):
            largest[k] = max(largest[k], values.max(initial=0.0))
    return ConstraintResidual(position, velocity, *largest)


def _jumps(run: RunState) -> list[EventRecord]:
    """Return the events that have changed the state, or what is held."""
    return [event for event in run.actions.log if event.action not in ("record", "terminate")]


def _collected(run: RunState) -> Frames:
    """Return all frames that the run reached, or what is kept of them.

    Times and states are copies, as the arrays serve the next run; what else there is of frames is this run's own.
    """
    if run.window is None:
        n, arrays = int(run.arrays.counters[at.NEXT_FRAME]), run.arrays
        found = Frames(
            arrays.frame_times[:n].copy(), arrays.frames[:n].copy(), run.reset_energy_at_frames[:n],
            run.form_at_frames[:n], run.shown[:n],
        )  # fmt: skip
    else:
        found = run.window.kept(run)
    if run.last is None:
        return found
    t, y = run.last
    resets, form = run.actions.energy_of_resets, max(len(run.forms) - 1, 0)
    last = Frames(np.array([t]), y[None], np.array([resets]), np.array([form]), np.array([True]))
    return Frames.joined([found, last])


def _samples(
    system: System,
    p: np.ndarray,
    entries: Sequence[tuple[float, np.ndarray, float, int]],
    settings: FormLog,
) -> list[Sample]:
    if not entries:
        return []
    times = np.array([entry[0] for entry in entries])
    rows = np.vstack([entry[1] for entry in entries])
    forces = None
    if settings:
        forms = contact_forms.Forms(settings.array(), np.array([entry[3] for entry in entries]))
        accelerations, multipliers, forces = forms.evaluate(system, p, times, rows)
    else:
        accelerations, multipliers = accelerations_and_multipliers(system, p, times, rows)
    solved = accelerations, multipliers, np.zeros((len(times), 0)) if forces is None else forces
    outputs = outputs_at(system, p, times, rows, lambda: solved)
    energies = evaluate(system, "energy", p, times, rows).sum(axis=1)
    nq, n = system.nq, system.nq + system.nv
    return [
        Sample(
            float(times[i]),
            rows[i, :nq],
            rows[i, nq:n],
            accelerations[i],
            multipliers[i],
            outputs[i],
            float(energies[i]),
            None if forces is None else forces[i],
        )
        for i in range(len(times))
    ]


def _sample_energies(
    system: System, p: np.ndarray, entries: Sequence[tuple[float, np.ndarray, float, int]]
) -> dict[str, np.ndarray]:
    if not entries:
        return {"balance": np.zeros(0), "energies": np.zeros((0, 2)), "work": np.zeros(0)}
    times = np.array([entry[0] for entry in entries])
    rows = np.vstack([entry[1] for entry in entries])
    energies = evaluate(system, "energy", p, times, rows)
    work = np.array([entry[2] for entry in entries]) + (rows[:, system.nq + system.nv] if system.nw else 0.0)
    return {"balance": energies.sum(axis=1) - work, "energies": energies, "work": work}
