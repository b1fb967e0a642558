"""Does a result settle as steps are halved or tolerances tightened? Runs of one model, compared.

What the runs of a convergence study say, in a sentence.

The error of each coordinate and rate, and how fast it shrinks.

Runs of one model, each finer than the one before, at common times: what their differences say about errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.error_estimate import LARGEST_ERROR
from symgen.runtime.checks.health import objections_to
from symgen.runtime.checks.horizon import DIGITS, Comparison, Horizon, compare_runs, horizon
from symgen.runtime.checks.momenta import Momentum, momenta
from symgen.runtime.failures import state_names
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.names import motion_records
from symgen.runtime.options import SMALLEST_RTOL, RunOptions
from symgen.runtime.simulate import simulate

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

_SETTLED = 1e-3  # largest difference between the two finest runs
_NEED_NOT_SHRINK = 1e-11  # differences below this need not shrink further
_ROUNDED = 10 * np.finfo(float).eps  # of a state, by the steps in the time in which errors grow e-fold
_MOST_GROWN = 1e-6  # nor those of round-off that the motion has made larger, up to this
_ORDER_SHORTFALL = 0.7  # part of the method's order that must be seen in the last halving
_MOST_ERRORS = 8

Table = list[list[str]]


def verdict(
    compared: Comparison,
    growth: Horizon,
    errors: Sequence[CoordinateError],
    rtol: float,
    order: int | None,
) -> tuple[bool, str]:
    """Return whether a result is to be trusted up to its end, and why.

    Parameters
    ----------
    compared : Comparison
    growth : Horizon
    errors : sequence of CoordinateError
    rtol : float
        That was asked for.
    order : int or None
        Of a method of fixed step; None for adaptive ones.
    """
    last, before = (float(compared.relative[i].max(initial=0.0)) for i in (-1, -2))
    if not np.isfinite(last):
        return False, "not to be trusted: the runs are not finite; take smaller steps"
    if growth.rate is not None and growth.of(3) < growth.t_end:
        return False, _chaotic(growth, order)
    if last > _SETTLED:
        return False, (
            f"not to be trusted: the two finest runs still differ by {last:.2g}{_until(growth)}; take smaller steps or "
            "tolerances, or a shorter run"
        )
    round_off = _round_off(growth)
    met = order is None and last <= rtol
    if last > round_off and last >= before and not met:
        return (
            False,
            f"not to be trusted: finer steps do not bring the runs together ({before:.2g}, then {last:.2g})",
        )
    worst = max(errors, key=lambda entry: entry.relative)
    if worst.relative > LARGEST_ERROR:
        return False, (
            f"not to be trusted: finer runs settle, to {last:.2g}, but in that asked for {worst.name} is off by "
            f"{worst.relative:.2g} of its size; take {'smaller tolerances' if order is None else 'a smaller step'}"
        )
    off = f"{worst.name} is off most, by {worst.relative:.2g} of its size"
    if last <= round_off and (last <= _NEED_NOT_SHRINK or last >= before):
        return True, f"settled: the two finest runs differ by {last:.2g}, which is round-off; {off}"
    seen = np.log2(before / last)
    if order is not None and seen < _ORDER_SHORTFALL * order and last > 1e-9:
        return True, (
            f"settles, to {last:.2g}, but with order {seen:.1f} instead of {order}: "
            f"the step is long for the motion, or the forces are not smooth; {off}"
        )
    return True, f"settled: the two finest runs differ by {last:.2g}; {off}{_growing(growth)}"


def _round_off(growth: Horizon) -> float:
    """Return how large differences are that come from round-off alone."""
    if growth.rate is None:
        return _NEED_NOT_SHRINK
    grown = _ROUNDED * np.exp(min(growth.rate * (growth.t_end - growth.t[0]), 50.0))
    return float(np.clip(grown, _NEED_NOT_SHRINK, _MOST_GROWN))


def _chaotic(growth: Horizon, order: int | None) -> str:
    tenfold = np.log(10.0) / growth.rate
    gain = "a tolerance ten times tighter gains about as much"
    if order is not None:
        gain = f"half the step gains about {order * np.log(2.0) / growth.rate:.2g} s"
    return (
        f"digits up to t = {growth.of(3):.4g} s (three; six up to {growth.of(6):.4g} s), not to the end: the motion is "
        f"chaotic or unstable, and errors grow tenfold every {tenfold:.2g} s; {gain}. What does not depend on single "
        "states (means, spectra, balances) may still hold"
    )


def _until(growth: Horizon) -> str:
    t = growth.of(3)
    return f", three digits hold up to t = {t:.4g} s" if t > growth.t[0] else ""


def _growing(growth: Horizon) -> str:
    if growth.rate is None or growth.of(6) >= growth.t_end:
        return ""
    return f"; errors grow exponentially, tenfold every {np.log(10.0) / growth.rate:.2g} s"


_ROUND_OFF = 1e-12  # in parts of a variable's size: no order is seen in such differences


@dataclass(frozen=True)
class CoordinateError:
    """The estimated error of one coordinate or rate.

    Attributes
    ----------
    name, unit : str
    error, at_end : float
        The largest over the run, and that at its end, in this unit.
    relative : float
        `error` in parts of the variable's size.
    order : float or None
        Power of the step, or of the tolerance, by which differences shrink; None where they are round-off.
    """

    name: str
    unit: str
    error: float
    at_end: float
    relative: float
    order: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return the entry as a dictionary."""
        return asdict(self)


def coordinate_errors(system: System, compared: Comparison, refinement: float) -> tuple[CoordinateError, ...]:
    """Return the errors of all coordinates and rates, in the model's order.

    Parameters
    ----------
    refinement : float
        Factor between the steps or tolerances of successive runs.
    """
    units = [record["unit"] for record in (*system.coordinates, *system.rates)]
    errors, order = compared.errors, _orders(compared, refinement)
    found = [
        CoordinateError(name, unit, float(largest), float(last), float(part), power)
        for name, unit, largest, last, part, power in zip(
            state_names(system), units, errors.max(axis=0), errors[-1],
            (errors / compared.size).max(axis=0), order, strict=True,
        )
    ]  # fmt: skip
    return tuple(entry for _, entry in motion_records(found, system.integrals))


def _orders(compared: Comparison, refinement: float) -> list[float | None]:
    """Return the order seen in the two finest differences of each variable that are not round-off."""
    found: list[float | None] = []
    for differences, size in zip(compared.largest.T, compared.size, strict=True):
        seen = np.flatnonzero(differences[1:] > _ROUND_OFF * size)
        if not seen.size:
            found.append(None)
            continue
        coarse, fine = differences[seen[-1] : seen[-1] + 2]
        found.append(float(np.log(coarse / fine) / np.log(refinement)) if coarse > 0.0 else None)
    return found


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


def study(system: System, options: RunOptions) -> Convergence:
    """Run a model four times, each finer than the one before, and compare.

    Methods of fixed step: step, step/2, step/4, step/8. Adaptive ones: tolerances 100, 10, 1 and 1/10 times
    those asked for; where 1/10 of rtol is below round-off, 1000, 100, 10 and 1 times. The steps of the finest run are
    bounded besides: what all of them went over would not show in their differences.

    Parameters
    ----------
    system : System
    options : RunOptions
    """
    options = replace(options, at=(), fps=None)
    first = simulate(system, options)
    if first.status == "interrupted":
        raise KeyboardInterrupt
    method = find_method(first.method)
    quantity = "rtol" if method.adaptive else "step"
    head = (system.name, method.name, quantity, bool(system.m))
    options = replace(options, method=method.name, at=_common_times(first) if first.step else ())
    if method.adaptive and options.max_steps is None:
        options = replace(options, max_steps=max(_MOST_STEPS, _MORE_STEPS * first.stats["steps"]))
    asked, settings = _settings(first)
    if method.adaptive:
        settings[-1]["max_step"] = _bound(first, options.max_step)
    runs: list[Solution] = []
    for setting in settings:
        runs.append(simulate(system, replace(options, **setting)))
        if runs[-1].status == "interrupted":
            raise KeyboardInterrupt
        if runs[-1].status not in ("success", "terminated"):
            which = f"with {quantity} {getattr(runs[-1], quantity):.3g}"
            return Convergence(*head, failed=True, says=f"{which}: {runs[-1].message or runs[-1].status}")
    compared = compare_runs(runs, asked)
    levels = _levels(runs, quantity, compared)
    errors = coordinate_errors(system, compared, _TIGHTENING if method.adaptive else 2.0)
    growth = horizon(compared)
    ok, says = verdict(compared, growth, errors, first.rtol, None if method.adaptive else method.order)
    if ok and (objections := objections_to(runs[asked])):
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


def tables(study: Convergence) -> Iterator[tuple[str, Table]]:
    """Yield the title and the rows of each table, its head first; those that have nothing to say are left out."""
    change = "step halved" if study.quantity == "step" else "tolerances tightened"
    yield f"{study.model}: {study.method}, {change}", _level_table(study)
    if study.errors:
        asked = f"{study.quantity} {study.levels[study.asked].setting:.3g}{' s' if study.quantity == 'step' else ''}"
        shown, n = min(_MOST_ERRORS, len(study.errors)), len(study.errors)
        which = "" if shown == n else f", the worst {shown} of {n}"
        yield f"estimated errors with {asked}{which}", _errors(study)
    if study.momenta:
        yield f"conserved momenta, their drift with each {study.quantity}", _momenta(study)
    growth = study.horizon
    if growth is not None and (growth.rate is not None or growth.of(DIGITS[0]) < growth.t_end):
        yield "trusted digits", _digits(study)


def lines(study: Convergence) -> Iterator[str]:
    """Yield all tables as text."""
    for title, rows in tables(study):
        yield title
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        for row in rows:
            yield "  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths)).rstrip()


def _level_table(study: Convergence) -> Table:
    head = [study.quantity, "steps", "difference"]
    head += ["order"] if study.quantity == "step" else []
    head += ["energy error"]
    head += ["positions", "velocities"] if study.constrained else []
    rows = [head]
    for level in study.levels:
        row = [
            f"{level.setting:.3g}",
            str(level.steps),
            "finest" if level.difference is None else f"{level.difference:.2e}",
        ]
        if study.quantity == "step":
            row.append("" if level.order is None else f"{level.order:.2f}")
        row.append(f"{level.energy_error:.2e}")
        if study.constrained:
            row += [f"{level.position_residual:.2e}", f"{level.velocity_residual:.2e}"]
        rows.append(row)
    return rows


def _errors(study: Convergence) -> Table:
    order = "order" if study.quantity == "step" else "power of rtol"
    rows = [["", "largest", "at the end", "unit", "of its size", order]]
    worst = sorted(study.errors, key=lambda entry: -entry.relative)[:_MOST_ERRORS]
    for entry in worst:
        power = "" if entry.order is None else f"{entry.order:.2f}"
        rows.append(
            [
                entry.name,
                f"{entry.error:.2e}",
                f"{entry.at_end:.2e}",
                entry.unit,
                f"{entry.relative:.2e}",
                power,
            ]
        )
    return rows


def _momenta(study: Convergence) -> Table:
    rows = [["", "at the start", *(f"{level.setting:.3g}" for level in study.levels)]]
    for entry in study.momenta:
        rows.append([entry.name, f"{entry.start:.6g}", *(f"{drift:.2e}" for drift in entry.drift)])
    return rows


def _digits(study: Convergence) -> Table:
    rows = [["up to t [s]", "error of size", "digits"]]
    for t, error, digits in study.horizon.rows():
        rows.append([f"{t:.4g}", f"{error:.1e}", f"{digits:.1f}"])
    return rows
