"""Can the members be trusted: a verdict for each, by what its steps have shown on the way.

The limits are those of the health report of a single run (`checks/health.py`) for energy, constraints and a regular
end. How far errors grow takes runs beside a run: `beside.py` has them, `Ensemble.member(k).health` the whole report.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.ensemble.slots import COLUMN, TOO_MANY_STEPS
from symgen.runtime.exchange import ROUND_OFF, energy_limit
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan

VERDICTS = ("status", "energy_error", "constraint_residual", "steps", "ok", "singly")
_NEARLY_SUNK = 0.5  # of what gaps may be below zero, roughly: the whole report tells
NO_START, RUN_FAILED, WORKER_LOST = -20, -21, -22
CAUSES = {
    at.STEP_TOO_SMALL: "the step became too small",
    at.NOT_FINITE: "the motion became infinite",
    at.NEWTON_FAILED: "Newton's method failed",
    at.PROJECTION_FAILED: "the constraints could not be held",
    at.SINGULAR_MATRIX: "the constraints came to depend on each other",
    TOO_MANY_STEPS: "it took more steps than allowed",
    NO_START: "it cannot begin: no start fits, or its parameters are none of this model",
    RUN_FAILED: "its run failed",
    WORKER_LOST: "what ran it was lost, several times",
}


@record(eq=False)
class Verdicts:
    """What is known of members, arrays of their length.

    Attributes
    ----------
    status : ndarray of int8
        1 where the end was reached; otherwise a key of `CAUSES`.
    energy_error : ndarray
        Largest error of T + V - work, in parts of what the motion exchanges.
    constraint_residual : ndarray
        Largest residual of a constraint's position at the end, as it is.
    steps : ndarray of int32
    ok : ndarray of bool
    singly : ndarray of bool
        Members that ran by themselves.
    """

    status: np.ndarray
    energy_error: np.ndarray
    constraint_residual: np.ndarray
    steps: np.ndarray
    ok: np.ndarray
    singly: np.ndarray

    @classmethod
    def empty(cls, n: int) -> Verdicts:
        """Return verdicts to be filled in."""
        return cls(
            np.zeros(n, dtype=np.int8), np.zeros(n), np.zeros(n), np.zeros(n, dtype=np.int32),
            np.zeros(n, dtype=bool), np.zeros(n, dtype=bool),
        )  # fmt: skip

    def put(self, first: int, part: Verdicts) -> None:
        """Fill in those of members from `first` on."""
        for name in VERDICTS:
            getattr(self, name)[first : first + len(part.status)] = getattr(part, name)


def verdicts_of(plan: Plan, columns: np.ndarray) -> Verdicts:
    """Return verdicts by what lanes have noted, shape (n, columns of `slots.COLUMNS`)."""

    def column(name: str) -> np.ndarray:
        return columns[:, COLUMN[name]]

    status = column("status").astype(np.int8)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        error = relative_errors(
            np.fmax(column("energy_off"), column("most_taken")), column("kinetic"), column("least_potential"),
            column("most_potential"), column("work"),
        )  # fmt: skip
        residual = np.fmax(column("position_residual"), 0.0)
        limit = energy_limit(find_method(plan.method), plan.single.rtol)
        ok = (status == at.REACHED_STOP) & (error <= limit)
        if plan.system.m:
            ok &= residual <= plan.residual_limit
        if plan.system.switches:
            ok &= column("sunk") <= _NEARLY_SUNK
    steps = column("steps").astype(np.int32)
    return Verdicts(status, error, residual, steps, ok, np.zeros(len(status), dtype=bool))


def relative_errors(
    off: np.ndarray, kinetic: np.ndarray, least: np.ndarray, most: np.ndarray, work: np.ndarray
) -> np.ndarray:
    """Return energy errors in parts of what motions exchange: `exchange.Exchange` for many members at once."""
    size = np.fmax(kinetic, most - least)
    largest = np.fmax.reduce([kinetic, -least, most, work])
    rounded = np.minimum(off, ROUND_OFF * largest)
    parts = rounded / np.fmax(size, largest) + np.where(size > 0.0, (off - rounded) / size, off - rounded)
    return np.where(largest > 0.0, parts, off)
