"""Does a result settle as steps are halved or tolerances tightened? Runs of one model, compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.comparison import Comparison, compare_runs
from symgen.runtime.checks.convergence_verdict import verdict
from symgen.runtime.checks.coordinate_errors import CoordinateError, coordinate_errors
from symgen.runtime.checks.horizon import Horizon, horizon
from symgen.runtime.checks.momenta import Momentum, momenta
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.solve import SMALLEST_RTOL

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_LEVELS = 4
_TIGHTENING = 10.0
_TIGHTER = 2  # the run of the tolerances asked for, counted from the coarsest
_LOOKS = 0.2718281828  # of the typical step: the longest of the finest run
_COMPARED_AT = 200  # ends of steps, of methods of fixed step
# Runs of more steps, or of so many times those of the run asked for, are stuck.
_MOST_STEPS, _MORE_STEPS = 5000, 30


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
        Magnitudes of the error of the energy balance over time, in parts of what the motion exchanges.
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

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers of the table as a dictionary."""
        return {key: value for key, value in vars(self).items() if key not in ("times", "energy_drift")}


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
    asked : int
        Which level has the step or tolerances that were asked for; errors are those of its run.
    errors : tuple of CoordinateError
        Of each coordinate and rate, in the model's order.
    momenta : tuple of Momentum
        Those that stay.
    compared : Comparison or None
    horizon : Horizon or None
        Up to when digits can be trusted. None, like `compared`, where a run failed.
    ok : bool
    failed : bool
        A run failed; `says` has its message.
    says : str
    """

    model: str
    method: str
    quantity: str
    constrained: bool
    levels: tuple[Level, ...] = ()
    asked: int = 0
    errors: tuple[CoordinateError, ...] = ()
    momenta: tuple[Momentum, ...] = ()
    compared: Comparison | None = field(default=None, repr=False)
    horizon: Horizon | None = field(default=None, repr=False)
    ok: bool = False
    failed: bool = False
    says: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return all tables as a dictionary."""
        return {
            "model": self.model,
            "method": self.method,
            "quantity": self.quantity,
            "ok": self.ok,
            "says": self.says,
            "levels": [level.to_dict() for level in self.levels],
            "asked": self.asked,
            "errors": [entry.to_dict() for entry in self.errors],
            "momenta": [entry.to_dict() for entry in self.momenta],
            "growth": self.horizon.to_dict() if self.horizon is not None else {},
        }


def study(system: System, arguments: Mapping[str, Any]) -> Convergence:
    """Run a model four times, each finer than the one before, and compare.

    Methods of fixed step: step, step/2, step/4, step/8. Adaptive ones: tolerances 100, 10, 1 and 1/10 times
    those asked for; where 1/10 of rtol is below round-off, 1000, 100, 10 and 1 times. The steps of the finest run are
    bounded besides: what all of them went over would not show in their differences.

    Parameters
    ----------
    system : System
    arguments : mapping
        As `symgen.runtime.solve.solve` takes them.
    """
    from symgen.runtime.solve import solve

    plain = {**arguments, "at": (), "fps": None}
    first = solve(system, **plain)
    method = find_method(first.method)
    quantity = "rtol" if method.adaptive else "step"
    head = (system.name, method.name, quantity, bool(system.m))
    plain |= {"method": method.name, "at": _common_times(first) if first.step else ()}
    if method.adaptive and plain.get("max_steps") is None:
        plain["max_steps"] = max(_MOST_STEPS, _MORE_STEPS * first.stats["steps"])
    asked, settings = _settings(first)
    if method.adaptive:
        settings[-1]["max_step"] = _bound(first, plain.get("max_step"))
    runs: list[Solution] = []
    for setting in settings:
        runs.append(solve(system, **{**plain, **setting}))
        if runs[-1].status not in ("success", "terminated"):
            which = f"with {quantity} {getattr(runs[-1], quantity):.3g}"
            return Convergence(*head, failed=True, says=f"{which}: {runs[-1].message or runs[-1].status}")
    compared = compare_runs(runs, asked)
    levels = _levels(runs, quantity, compared)
    errors = coordinate_errors(system, compared, _TIGHTENING if method.adaptive else 2.0)
    growth = horizon(compared)
    ok, says = verdict(compared, growth, errors, first.rtol, None if method.adaptive else method.order)
    if ok and (objections := runs[asked].objections):
        # What is wrong with all of them alike does not show in their differences.
        ok, says = False, f"not to be trusted: {objections[0].check}: {objections[0].says}"
    return Convergence(
        *head, levels, asked, errors, momenta(runs, compared), compared, growth, ok=ok, says=says
    )


def _settings(first: Solution) -> tuple[int, list[dict[str, float]]]:
    """Return which run is the one asked for, and the settings of all."""
    if first.step:
        return 0, [{"step": first.step / 2**level} for level in range(_LEVELS)]
    asked = _TIGHTER if first.rtol / _TIGHTENING >= SMALLEST_RTOL else _LEVELS - 1
    factors = [_TIGHTENING ** (asked - level) for level in range(_LEVELS)]
    return asked, [{"rtol": first.rtol * factor, "atol": first.atol * factor} for factor in factors]


def _bound(first: Solution, wanted: float | None) -> float:
    """Return a bound on the step of the finest run [s], so that its steps look where those of the others do not."""
    h = first.step_log[:, 1]
    # As time sees them: many short steps in a pulse are not typical of the run.
    typical = float(h @ h / h.sum()) if len(h) else first.t_end - first.t_start
    return min(_LOOKS * typical, wanted or np.inf)


def _common_times(first: Solution) -> tuple[float, ...]:
    """Return ends of steps of a fixed-step method, at which all runs have a state without interpolation."""
    parts = np.arange(_COMPARED_AT + 1) / _COMPARED_AT
    whole = np.floor((first.t_end - first.t_start) / first.step * (1.0 + 1e-12))
    # A time between the ends of steps would cut one short: the runs would not take the steps that they claim.
    return tuple(np.minimum(first.t_start + np.unique(np.floor(parts * whole)) * first.step, first.t_end))


def _levels(runs: list[Solution], quantity: str, compared: Comparison) -> tuple[Level, ...]:
    differences = [float(pair.max(initial=0.0)) for pair in compared.relative]
    levels = []
    for i, run in enumerate(runs):
        order = None
        if quantity == "step" and i + 1 < len(differences) and min(differences[i : i + 2]) > 0.0:
            order = float(np.log2(differences[i] / differences[i + 1]))
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
                energy_drift=run.energy.exchange.relative(run.energy.balance - run.energy.balance[0]),
            )
        )
    return tuple(levels)
