"""Does a result settle as steps are halved or tolerances tightened? Runs of one model, compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.integrate.methods import find_method

if TYPE_CHECKING:
    from runtime.solution import Solution
    from runtime.system import System

_LEVELS = 4
_COARSEST = 100.0  # times rtol; each level is ten times tighter, the last ten times tighter than asked for
_TIGHTENING = 10.0
_COMPARED_AT = 20  # times over the run
_SETTLED = 1e-3  # largest difference between the two finest runs
_ROUND_OFF = 1e-11  # differences below this need not shrink further
_ORDER_SHORTFALL = 0.7  # part of the method's order that must be seen in the last halving


@dataclass(frozen=True)
class Level:
    """One run of a study.

    Attributes
    ----------
    setting : float
        Its step [s] or rtol.
    steps : int
    difference : float or None
        Largest difference of coordinates and rates from the next finer run, in parts of their size; None
        for the finest.
    order : float or None
        Observed from this difference and that of the next finer run (methods of fixed step).
    energy_error, position_residual, velocity_residual : float
    times, energy_drift : ndarray
        The error of the energy balance over time, in parts of the largest energy.
    """

    setting: float
    steps: int
    difference: float | None
    order: float | None
    energy_error: float
    position_residual: float
    velocity_residual: float
    times: np.ndarray = field(repr=False)
    energy_drift: np.ndarray = field(repr=False)


@dataclass(frozen=True)
class Convergence:
    """The runs of a study, coarsest first, and what they say.

    Attributes
    ----------
    model, method : str
    quantity : str
        "step" or "rtol".
    constrained : bool
    levels : tuple of Level
    ok : bool
    failed : bool
        A run failed; `says` has its message.
    says : str
    """

    model: str
    method: str
    quantity: str
    constrained: bool
    levels: tuple[Level, ...]
    ok: bool
    failed: bool
    says: str

    def to_dict(self) -> dict[str, Any]:
        """Return the table as a dictionary."""
        left_out = ("times", "energy_drift")
        levels = [{k: v for k, v in vars(level).items() if k not in left_out} for level in self.levels]
        head = {"model": self.model, "method": self.method, "quantity": self.quantity}
        return {**head, "ok": self.ok, "says": self.says, "levels": levels}

    def table(self) -> list[str]:
        """Return the table as lines of text."""
        change = "step halved" if self.quantity == "step" else "tolerances tightened"
        title = f"{self.model}: {self.method}, {change}"
        rows = self.cells()
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        lines = ("  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows)
        return [title, *(f"  {line}" for line in lines)]

    def cells(self) -> list[list[str]]:
        """Return the table's rows, its head first."""
        head = [self.quantity, "steps", "difference", "order", "energy error"]
        head += ["positions", "velocities"] if self.constrained else []
        rows = [head]
        for level in self.levels:
            row = [
                f"{level.setting:.3g}",
                str(level.steps),
                "finest" if level.difference is None else f"{level.difference:.2e}",
                "" if level.order is None else f"{level.order:.2f}",
                f"{level.energy_error:.2e}",
            ]
            if self.constrained:
                row += [f"{level.position_residual:.2e}", f"{level.velocity_residual:.2e}"]
            rows.append(row)
        return rows


def study(system: System, arguments: Mapping[str, Any]) -> Convergence:
    """Run a model four times, each finer than the one before, and compare.

    Methods of fixed step: step, step/2, step/4, step/8. Adaptive ones: tolerances 100, 10, 1 and 1/10 times
    those asked for.

    Parameters
    ----------
    system : System
    arguments : mapping
        As `runtime.solve.solve` takes them.
    """
    from runtime.solve import solve

    plain = {**arguments, "at": (), "fps": None}
    first = solve(system, **plain)
    method = find_method(first.method)
    quantity = "rtol" if method.adaptive else "step"
    plain |= {"method": method.name, "at": _common_times(first) if first.step else ()}
    runs: list[Solution] = []
    for setting in _settings(first):
        runs.append(solve(system, **{**plain, **setting}))
        if runs[-1].status not in ("success", "terminated"):
            message = runs[-1].message
            return Convergence(system.name, method.name, quantity, bool(system.m), (), False, True, message)
    levels = _levels(runs, quantity)
    ok, says = _verdict(levels, None if method.adaptive else method.order)
    return Convergence(system.name, method.name, quantity, bool(system.m), levels, ok, False, says)


def _settings(first: Solution) -> list[dict[str, float]]:
    if first.step:
        return [{"step": first.step / 2**level} for level in range(_LEVELS)]
    factors = [_COARSEST / _TIGHTENING**level for level in range(_LEVELS)]
    return [{"rtol": first.rtol * factor, "atol": first.atol * factor} for factor in factors]


def _common_times(first: Solution) -> tuple[float, ...]:
    """Return ends of steps of a fixed-step method, at which all runs have a state without interpolation."""
    parts = np.arange(_COMPARED_AT + 1) / _COMPARED_AT
    whole = np.floor((first.t_end - first.t_start) / first.step * (1.0 + 1e-12))
    # A time between the ends of steps would cut one short: the runs would not take the steps that they claim.
    return tuple(np.minimum(first.t_start + np.unique(np.floor(parts * whole)) * first.step, first.t_end))


def _levels(runs: list[Solution], quantity: str) -> tuple[Level, ...]:
    differences = [_difference(coarse, fine) for coarse, fine in pairwise(runs)]
    levels = []
    for i, run in enumerate(runs):
        order = None
        if quantity == "step" and i + 1 < len(differences) and min(differences[i : i + 2]) > 0.0:
            order = float(np.log2(differences[i] / differences[i + 1]))
        largest = max(np.abs(run.energy.kinetic).max(), np.abs(run.energy.potential).max()) or 1.0
        levels.append(
            Level(
                setting=float(getattr(run, quantity)),
                steps=run.stats["steps"],
                difference=differences[i] if i < len(differences) else None,
                order=order,
                energy_error=run.energy.unscaled_error,
                position_residual=run.constraint_residual.max_position,
                velocity_residual=run.constraint_residual.max_velocity,
                times=run.t,
                energy_drift=(run.energy.balance - run.energy.balance[0]) / largest,
            )
        )
    return tuple(levels)


def _difference(a: Solution, b: Solution) -> float:
    """Return the largest difference of two runs at common times, in parts of each variable's size."""
    rows = _samples(a, b) if a.step else _frames(a, b)
    size = np.abs(rows[1]).max(axis=0)
    # A variable that stays at zero is held against the largest one.
    size = np.maximum(size, 1e-6 * size.max(initial=0.0))
    return float((np.abs(rows[0] - rows[1]) / np.where(size > 0.0, size, 1.0)).max(initial=0.0))


def _samples(a: Solution, b: Solution) -> list[np.ndarray]:
    n = min(len(a.samples), len(b.samples))
    return [np.array([np.concatenate([s.q, s.v]) for s in run.samples[:n]]) for run in (a, b)]


def _frames(a: Solution, b: Solution) -> list[np.ndarray]:
    """Return states of two adaptive runs at common frames: to land on common times would shorten their steps."""
    n = min(len(a.t), len(b.t))
    n -= a.t[n - 1] != b.t[n - 1]  # events that end runs have times of their own
    chosen = np.unique(np.linspace(0, n - 1, _COMPARED_AT + 1).astype(int))
    return [np.hstack([run.q, run.v])[chosen] for run in (a, b)]


def _verdict(levels: tuple[Level, ...], order: int | None) -> tuple[bool, str]:
    differences = [level.difference for level in levels if level.difference is not None]
    last, before = differences[-1], differences[-2]
    if not np.isfinite(last):
        return False, "not to be trusted: the runs are not finite; take smaller steps"
    if last > _SETTLED:
        return False, (
            f"not to be trusted: the two finest runs still differ by {last:.2g}; take smaller steps or "
            "tolerances, or a shorter run if the motion is chaotic"
        )
    if last <= _ROUND_OFF:
        return True, f"settled: the two finest runs differ by {last:.2g}, which is round-off"
    if last >= before:
        return (
            False,
            f"not to be trusted: finer steps do not bring the runs together ({before:.2g}, then {last:.2g})",
        )
    if order is not None and np.log2(before / last) < _ORDER_SHORTFALL * order and last > 1e-9:
        seen = np.log2(before / last)
        return True, (
            f"settles, to {last:.2g}, but with order {seen:.1f} instead of {order}: "
            "the step is long for the motion, or the forces are not smooth"
        )
    return True, f"settled: the two finest runs differ by {last:.2g}"
