"""A recorded run as a `Solution`: energies and residuals computed again, the rest as it was recorded."""

from __future__ import annotations

import numpy as np

from symgen.runtime.batches import constraint_residuals
from symgen.runtime.exchange import Exchange
from symgen.runtime.solution import ConstraintResidual, Energy, Solution
from symgen.runtime.system import System
from symgen.runtime.work_along import work_that_balances

from .recording import Recording

_COUNTED = ("steps", "rejected", "rhs", "jacobians", "factorisations", "newton", "projections")


def replay(system: System, recording: Recording, energies: np.ndarray) -> Solution:
    """Return the run as a solution, without samples, states around events, and step log.

    Parameters
    ----------
    system : System
        Loaded from the recorded module.
    recording : Recording
    energies : ndarray, shape (n, 2)
        T and V, computed again.
    """
    # Compiled code takes writable arrays only; the recording's own are not.
    t, p, states = recording.t.copy(), system.with_settings(recording.p), recording.states
    work = recording.w[:, 0].copy() if system.nw else np.zeros(len(t))
    for event in recording.events:
        work[event.frame :] += event.energy_change
    if system.nw and recording.settings.shape[1] == 0 and not any(e.energy_change for e in recording.events):
        along = work_that_balances(system, p, t, states[:, : system.nq + system.nv], energies, work)
        work = work if along is None else along
    balance = energies.sum(axis=1) - work
    exchange = Exchange(energies, work)
    error = float(exchange.relative(np.abs(balance - balance[0]).max()))
    position, velocity = constraint_residuals(system, p, t, states)
    return Solution(
        system=system,
        p=p,
        t=t,
        q=recording.q,
        v=recording.v,
        w=work,
        samples=[],
        events=[],
        energy=Energy(energies[:, 0], energies[:, 1], work, exchange, error),
        constraint_residual=ConstraintResidual(position, velocity, position.max(), velocity.max()),
        step_log=np.zeros((0, 2)),
        stats={name: int(recording.stats.get(name, 0)) for name in _COUNTED},
        status=recording.status,
        message="",
        notes=[],
        method=recording.method,
        constraints=recording.constraints,
        rtol=recording.rtol,
        atol=recording.atol,
        step=recording.options.get("step"),
        t_start=float(t[0]),
        t_end=float(t[-1]),
    )
