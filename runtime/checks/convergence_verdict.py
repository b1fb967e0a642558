"""What the runs of a convergence study say, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.error_estimate import LARGEST_ERROR

if TYPE_CHECKING:
    from symgen.runtime.checks.comparison import Comparison
    from symgen.runtime.checks.coordinate_errors import CoordinateError
    from symgen.runtime.checks.horizon import Horizon

_SETTLED = 1e-3  # largest difference between the two finest runs
_ROUND_OFF = 1e-11  # differences below this need not shrink further
_ROUNDED = 10 * np.finfo(float).eps  # of a state, by the steps in the time in which errors grow e-fold
_MOST_GROWN = 1e-6  # nor those of round-off that the motion has made larger, up to this
_ORDER_SHORTFALL = 0.7  # part of the method's order that must be seen in the last halving


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
    if last <= round_off and (last <= _ROUND_OFF or last >= before):
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
        return _ROUND_OFF
    grown = _ROUNDED * np.exp(min(growth.rate * (growth.t_end - growth.t[0]), 50.0))
    return float(np.clip(grown, _ROUND_OFF, _MOST_GROWN))


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
