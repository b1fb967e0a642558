"""One member of an ensemble again, in full: the same steps to the last bit, with frames, a log and energies."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import constraint_residuals, evaluate
from symgen.runtime.checks.inertia import refuse_negative_inertia
from symgen.runtime.ensemble.batch import BatchResult, LaneBatch
from symgen.runtime.ensemble.plan import alone
from symgen.runtime.ensemble.single import run_single, runs_alone
from symgen.runtime.ensemble.slots import COLUMN
from symgen.runtime.ensemble.switched import SwitchedBatch, make_batch
from symgen.runtime.ensemble.verdict import CAUSES
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.event_actions import EventLog, end_message
from symgen.runtime.exchange import Exchange, energy_limit
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import plain_events
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.options import SMALLEST_RTOL
from symgen.runtime.solution import ConstraintResidual, Energy, Solution
from symgen.runtime.timing.timetable import make_timetable

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.system import System

work_quadrature = Late("symgen.runtime.work_quadrature")


def member_again(plan: Plan, number: int, t_eval: Sequence[float] | None = None) -> Solution:
    """Run a member again.

    Parameters
    ----------
    plan : Plan
    number : int
    t_eval : sequence of float, optional [s]
        Times of its frames; as in a single run by default, with those of the ensemble among them.

    Raises
    ------
    RuntimeModelError
        There is no such member, or it has no start on the constraints.
    """
    if not 0 <= number < plan.members.n:
        raise RuntimeModelError(f"member {number}: the ensemble has members 0 to {plan.members.n - 1}")
    began = time.perf_counter()
    parameters, varied = plan.members.arrays(plan.p, number, number + 1)
    p, here = parameters[0], {name: float(values[0]) for name, values in varied.items()}
    times = _frames(plan, t_eval)
    if plan.settings is None:
        return run_single(plan, number, p, here, times)
    plan.system.refuse_values(p)
    starts, failures = plan.starts.of(parameters, varied)
    if failures:
        raise RuntimeModelError(failures[0])
    refuse_negative_inertia(plan.system, p, plan.single.t_start, starts[0])
    batch = make_batch(plan.system, alone(plan, times))
    result = batch.run(parameters, starts, np.array([number]))
    status = int(result.columns[0, COLUMN["status"]])
    if status in runs_alone(plan):
        return run_single(plan, number, p, here, times, status)
    seconds = {"prepare": 0.0, "compile": 0.0, "run": time.perf_counter() - began}
    return _solution(plan, plan.system_of(number, p), p, status, times, batch, result, seconds)


def _frames(plan: Plan, t_eval: Sequence[float] | None) -> np.ndarray:
    own = plan.single.frame_times(plan.system.ny)[0] if t_eval is None else np.asarray(t_eval, dtype=float)
    ends = [plan.single.t_start, plan.single.t_end]
    times = np.unique(np.concatenate([own, plan.frame_times, ends]))
    if times[0] < ends[0] or times[-1] > ends[1]:
        raise RuntimeModelError(f"t_eval: the run is from {ends[0]:.9g} s to {ends[1]:.9g} s")
    return times


def _solution(
    plan: Plan, system: System, p: np.ndarray, status: int, times: np.ndarray, batch: LaneBatch | SwitchedBatch,
    result: BatchResult, seconds: dict[str, float],
) -> Solution:  # fmt: skip
    there = np.isfinite(result.frames[0]).all(axis=1) & (times <= result.column("t")[0])
    t, rows, stop = times[there], result.frames[0][there], result.column("t")
    if not len(t):
        t, rows = np.array([plan.single.t_start]), result.end
    if status == at.REACHED_STOP and t[-1] < stop[0]:  # an event has ended it there
        t, rows = np.append(t, stop), np.concatenate([rows, result.end])
    energies = evaluate(system, "energy", p, t, rows)
    n = system.nq + system.nv
    work = rows[:, n] if system.nw else np.zeros(len(t))
    position, velocity = constraint_residuals(system, p, t, rows)
    log, changes = _events(batch, system)
    # Frames show states before an event at their time.
    resets = np.append(0.0, np.cumsum(changes))[np.searchsorted(log.times, t)]
    work = work + resets
    exchange = Exchange(energies, work, holds=bool(system.switches))
    balance = energies.sum(axis=1) - work
    with np.errstate(invalid="ignore", over="ignore"):
        error = float(exchange.relative(np.abs(balance - balance[0]).max()))
        taken = float(exchange.relative(result.column("most_taken")[0]))
    steps, rejected = int(result.column("steps")[0]), int(result.column("rejected")[0])
    message = "" if status == at.REACHED_STOP else (
        f"{CAUSES[status]} at t = {result.column('t')[0]:.9g} s, as this member of the ensemble"
    )  # fmt: skip
    word = "success" if status == at.REACHED_STOP else "failed"
    last = log[-1] if len(log) else None
    if word == "success" and last is not None and last.action == "terminate":
        word, message = "terminated", end_message(system, last.name, last.t)
    if (
        system.nw
        and not len(log)
        and not system.switches
        and status == at.REACHED_STOP
        and error > energy_limit(find_method(plan.method), plan.single.rtol)
    ):
        along = work_quadrature.work_that_balances(
            system, p, t, np.ascontiguousarray(rows[:, :n]), energies, work
        )
        if along is not None:
            work, exchange = along, Exchange(energies, along, holds=bool(system.switches))
            error = float(exchange.relative(np.abs(energies.sum(axis=1) - work - energies[0].sum()).max()))
    forms = lowest_gaps = None
    if isinstance(batch, SwitchedBatch):
        forms, lowest_gaps = batch.forms_at(t), batch.lowest_gaps[0]
    q, v = slice(0, system.nq), slice(system.nq, system.nq + system.nv)
    return Solution(
        system=system, p=p, t=t, q=rows[:, q], v=rows[:, v], w=work, samples=[], events=log,
        energy=Energy(energies[:, 0], energies[:, 1], work, exchange, error, taken),
        constraint_residual=ConstraintResidual(
            position, velocity, float(position.max(initial=0.0)), float(velocity.max(initial=0.0))
        ),
        step_log=batch.step_log[: min(steps, len(batch.step_log))].copy(),
        stats={
            "steps": steps, "rejected": rejected, "rhs": 0, "jacobians": 0, "factorisations": 0, "newton": 0,
            "projections": 0,
        },
        status=word, message=message,
        notes=[*plan.notes, "run in a lane of its own, as a member of an ensemble"], method=plan.method,
        constraints=plan.treatment, rtol=plan.single.rtol, atol=plan.single.atol, step=plan.single.step,
        t_start=plan.single.t_start, t_end=plan.single.t_end, seconds=seconds,
        min_pivot_ratio=float(result.column("pivot")[0]), forms=forms, lowest_gaps=lowest_gaps,
        timetable=make_timetable(plan.system, p, find_method(plan.method), plan.single),
    )  # fmt: skip


def _events(batch: LaneBatch | SwitchedBatch, system: System) -> tuple[EventLog, np.ndarray]:
    """Return the events of a member that ran with a log, and the energy that each has added."""
    log = EventLog()
    if isinstance(batch, SwitchedBatch):
        log.extend(batch.records)
        return log, np.array([record.energy_change for record in batch.records])
    rows = batch.event_log[: batch.n_events_logged].copy()
    log.extend_by_rows(system, rows)
    return log, rows[:, plain_events.CHANGE]


def end_again(plan: Plan, numbers: np.ndarray, finer: float = 1.0) -> np.ndarray:
    """Return the ends, shape (k, ny), of members at so much of their tolerance, or of their fixed step."""
    settings = replace(plan.settings, frame_times=np.zeros(0), step=finer * plan.settings.step)
    if not plan.settings.step:
        rtol = max(plan.single.rtol * finer, min(plan.single.rtol, SMALLEST_RTOL))
        settings = replace(settings, rtol=rtol, atol=plan.single.atol * rtol / plan.single.rtol)
    found = []
    batch = make_batch(plan.system, settings)
    for number in numbers:
        parameters, varied = plan.members.arrays(plan.p, int(number), int(number) + 1)
        starts, _ = plan.starts.of(parameters, varied)
        found.append((parameters[0], starts[0]))
    result = batch.run(
        np.array([p for p, _ in found]), np.array([start for _, start in found]), np.asarray(numbers)
    )
    return np.where(result.column("status")[:, None] == at.REACHED_STOP, result.end, np.nan)
