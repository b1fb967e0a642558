"""From a finished run to its Solution: energies, constraint residuals, samples, statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, constraint_residuals, evaluate
from symgen.runtime.exchange import Exchange, energy_limit
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.solution import ConstraintResidual, Energy, Sample, Solution

if TYPE_CHECKING:
    from symgen.runtime.contact.forms import Forms
    from symgen.runtime.run_state import RunState
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
    system, arrays = run.system, run.arrays
    run.actions.note_gaps()
    times, rows, resets, shown = _collected(run)
    forms = _forms(run, len(times)) if run.forms else None
    energies = evaluate(system, "energy", arrays.p, times, rows)
    work = resets + (rows[:, system.nq + system.nv] if system.nw else 0.0)
    position, velocity = constraint_residuals(system, arrays.p, times, rows)
    sampled = [entry for entry in run.samples if entry[0] in set(map(float, sample_times))]
    extra = _sample_checks(system, arrays.p, run.samples)
    with np.errstate(invalid="ignore", over="ignore"):  # the health report says what is not finite
        initial = energies[0].sum() - work[0]
        balance = np.concatenate([energies.sum(axis=1) - work, extra["balance"]])
        exchange = Exchange(energies, work).take(extra["energies"], extra["work"])
        error = float(exchange.relative(np.abs(balance - initial).max()))
        taken = float(exchange.relative(arrays.control[at.MOST_ENERGY_TAKEN]))
    if (
        system.nw
        and not run.forms
        and error > energy_limit(find_method(settings["method"]), settings["rtol"])
        and not _has_jumped(run)
    ):
        states = rows[:, : system.nq + system.nv]
        along = work_quadrature.work_that_balances(system, arrays.p, times, states, energies, work)
        if along is not None:
            work, notes = along, [*notes, _WORK_ALONG.format(error)]
            exchange = Exchange(energies, work)
            error = float(exchange.relative(np.abs(energies.sum(axis=1) - work - energies[0].sum()).max()))
    if np.isfinite(arrays.control[at.ENERGY_LEVEL]):
        notes = [*notes, _ENERGY_SCALING.format(taken)]
    q, v = slice(0, system.nq), slice(system.nq, system.nq + system.nv)
    return Solution(
        system=system,
        p=arrays.p,
        t=times[shown],
        q=rows[shown, q],
        v=rows[shown, v],
        w=work[shown],
        samples=_samples(system, arrays.p, sampled, run.forms),
        forms=None if forms is None else replace(forms, index=forms.index[shown]),
        events=run.actions.log,
        energy=Energy(energies[shown, 0], energies[shown, 1], work[shown], exchange, error, taken),
        constraint_residual=ConstraintResidual(
            position[shown],
            velocity[shown],
            max(position.max(), extra["position"]),
            max(velocity.max(), extra["velocity"]),
        ),
        step_log=run.step_log.array(),
        stats={name: int(arrays.counters[index]) for name, index in _STATISTICS.items()},
        status=run.status,
        message=run.message,
        notes=notes,
        seconds=seconds,
        min_pivot_ratio=float(arrays.control[at.MIN_PIVOT_RATIO]),
        lowest_gaps=run.actions.lowest_gaps,
        passed_by=run.actions.passed_by(),
        timetable=run.timetable,
        **settings,
    )


def _has_jumped(run: RunState) -> bool:
    """Whether events have changed the state."""
    return any(event.action not in ("record", "terminate") for event in run.actions.log)


def _collected(run: RunState) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return times, states, energy of resets, and whether to show them, of all frames that the run reached."""
    arrays, n = run.arrays, int(run.arrays.counters[at.NEXT_FRAME])
    times, rows, shown = arrays.frame_times[:n], arrays.frames[:n], run.shown[:n]
    resets = run.reset_energy_at_frames[:n]
    if run.last is None:
        return times, rows, resets, shown
    t, y = run.last
    return (
        np.append(times, t),
        np.vstack([rows, y]),
        np.append(resets, run.actions.energy_of_resets),
        np.append(shown, True),
    )


def _forms(run: RunState, n: int) -> Forms:
    index = np.append(run.form_at_frames[: int(run.arrays.counters[at.NEXT_FRAME])], len(run.forms) - 1)
    return contact_forms.Forms(np.array(run.forms), index[:n])


def _samples(
    system: System,
    p: np.ndarray,
    entries: Sequence[tuple[float, np.ndarray, float, int]],
    settings: Sequence[np.ndarray],
) -> list[Sample]:
    if not entries:
        return []
    times = np.array([entry[0] for entry in entries])
    rows = np.vstack([entry[1] for entry in entries])
    forces = None
    if settings:
        forms = contact_forms.Forms(np.array(settings), np.array([entry[3] for entry in entries]))
        accelerations, multipliers, forces = forms.evaluate(system, p, times, rows)
    else:
        accelerations, multipliers = accelerations_and_multipliers(system, p, times, rows)
    outputs = evaluate(system, "outputs", p, times, rows)
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


def _sample_checks(
    system: System, p: np.ndarray, entries: Sequence[tuple[float, np.ndarray, float, int]]
) -> dict[str, Any]:
    if not entries:
        nothing = {"balance": np.zeros(0), "energies": np.zeros((0, 2)), "work": np.zeros(0)}
        return {**nothing, "position": 0.0, "velocity": 0.0}
    times = np.array([entry[0] for entry in entries])
    rows = np.vstack([entry[1] for entry in entries])
    energies = evaluate(system, "energy", p, times, rows)
    work = np.array([entry[2] for entry in entries]) + (rows[:, system.nq + system.nv] if system.nw else 0.0)
    position, velocity = constraint_residuals(system, p, times, rows)
    return {
        "balance": energies.sum(axis=1) - work,
        "energies": energies,
        "work": work,
        "position": position.max(initial=0.0),
        "velocity": velocity.max(initial=0.0),
    }
