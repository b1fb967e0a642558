"""Energy over a million periods, and a four-bar over a thousand seconds."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np

from .judging import attempt, demand, flag
from .models import bundled
from .scenario import FLAGGED, RIGHT, WRONG, Outcome, Scenario

_FEW, _MANY = 1e3, 1e6
# Methods for long runs, steps in a period, the energy error that each may have, in parts of the largest energy:
# symplectic ones bound it at any length, the others add up rounding or tolerance.
METHODS = {
    "verlet": (100, 2e-3), "verlet4": (60, 1e-4), "verlet6": (40, 1e-5), "verlet8": (40, 1e-7),
    "gauss8": (50, 1e-7), "gauss12": (40, 1e-9), "implicit_midpoint": (60, 1e-2),
    "taylor": (0, 1e-6), "dop853": (0, 1e-4),
}  # fmt: skip


def pendulum(method: str, periods: float) -> Outcome:
    """A pendulum that swings to 86 degrees: neither jumps nor a trend in its energy."""
    steps, allowed = METHODS[method]
    system = bundled("pendulum")
    period = _period(system)
    given = {"step": period / steps} if steps else {"rtol": 1e-13, "atol": 1e-14}
    # Frames at all phases of the swing: a number of them that is no multiple of the periods.
    run = attempt(
        system, periods * period, method=method, start={"theta": 1.5}, fps=1871.3 / (periods * period),
        max_steps=int(3e9), **given,
    )  # fmt: skip
    flagged = flag(run)
    if flagged is not None:  # that the phase is lost after so many swings is the truth with low orders
        return demand(flagged, (RIGHT, FLAGGED), "^accuracy[^;]*$")
    balance = run.energy.balance - run.energy.balance[0]
    size = np.abs(run.energy.kinetic).max()
    trend = abs(np.polyfit(run.t / run.t[-1], balance / size, 1)[0])
    says = f"energy off by {np.abs(balance).max() / size:.1e}, trend {trend:.1e} over the run"
    return Outcome(RIGHT if np.abs(balance).max() / size <= allowed and trend <= allowed else WRONG, says)


def _period(system) -> float:
    """Of the swing to 1.5 rad: 4 sqrt(L/g) K(sin(0.75))."""
    from scipy.special import ellipk

    values = {entry["name"]: entry["value"] for entry in system.parameters}
    return 4.0 * math.sqrt(values["L"] / values["g"]) * ellipk(math.sin(0.75) ** 2)


def four_bar(method: str, seconds: float, given: dict) -> Outcome:
    """A four-bar that turns: its energy stays within 1e-10 of the largest kinetic energy."""
    run = attempt(
        bundled("four_bar"), seconds, method=method, fps=2000 / seconds, max_steps=int(1e9), **given
    )
    flagged = flag(run)
    if flagged is not None:
        return demand(flagged, (RIGHT,))
    balance = (run.energy.balance - run.energy.balance[0]) / np.abs(run.energy.kinetic).max()
    trend = abs(np.polyfit(run.t / run.t[-1], balance, 1)[0])
    drift = run.constraint_residual.max_position
    says = f"energy off by {np.abs(balance).max():.1e}, trend {trend:.1e}, constraints {drift:.1e}"
    return Outcome(RIGHT if np.abs(balance).max() <= 1e-10 and drift <= 1e-12 else WRONG, says)


def scenarios() -> Iterator[Scenario]:
    """Yield all: a thousand periods in the short part, a million in the long one."""
    for method in METHODS:
        yield Scenario(
            "long run", f"1e3 periods: {method}", functools.partial(pendulum, method, _FEW), method
        )
        run = functools.partial(pendulum, method, _MANY)
        yield Scenario("long run", f"1e6 periods: {method}", run, method, short=False, limit=900.0)
    for method, given in (
        ("gauss12", {"step": 2e-3}),
        ("dop853", {"rtol": 1e-12, "atol": 1e-13}),
        ("taylor", {"rtol": 1e-12, "atol": 1e-13}),
    ):
        run = functools.partial(four_bar, method, 1000.0, given)
        yield Scenario("long run", f"four-bar for 1000 s: {method}", run, method, short=False, limit=900.0)
