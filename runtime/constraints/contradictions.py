"""What to say when constraints cannot hold at the start: which ones, with which values, what would fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symgen.runtime.errors import RuntimeModelError

_SHOWN = 8


class AssemblyError(RuntimeModelError):
    """The constraints cannot hold at the start; the text names them and the values."""


def with_each_other(
    names: Sequence[str], left: np.ndarray, coordinates: Sequence[str], nearest: np.ndarray
) -> AssemblyError:
    """Return the error for position constraints that no configuration satisfies.

    Parameters
    ----------
    names : sequence of str
        The constraints.
    left : ndarray
        Their residuals at the configuration `nearest`.
    coordinates : sequence of str
    nearest : ndarray
    """
    verdict = "cannot hold" if len(names) == 1 else "contradict each other"
    return AssemblyError(
        f"{_subject(names)} {verdict}: off by {_numbers(left)} at the least bad configuration, "
        f"{listed(coordinates, nearest)}; "
        "check the constraints and the parameters in them, or give guesses nearer to a solution"
    )


def with_enforced_values(
    names: Sequence[str], left: np.ndarray, given: str, fitting: str, what: str, place: str = ""
) -> AssemblyError:
    """Return the error for constraints that enforced values contradict.

    Parameters
    ----------
    names : sequence of str
        The constraints.
    left : ndarray
        Their residuals.
    given, fitting : str
        The enforced values, and values that would fit, from `listed`.
    what : str
        "value" or "rate".
    place : str
        Where, for rates.
    """
    return AssemblyError(
        f"{_subject(names)} cannot hold with the enforced {what}s {given}{place}: off by {_numbers(left)}; "
        f"{what}s that fit are, for example, {fitting}; change one of these, or make it a guess"
    )


def of_rates(names: Sequence[str], place: str) -> AssemblyError:
    """Return the error for constraints that no rates satisfy at the configuration `place`."""
    return AssemblyError(
        f"{_subject(names)} {'cannot hold' if len(names) == 1 else 'contradict each other'} on the velocity "
        f"level at {place}: no rates satisfy them; check their dependence on time, or start elsewhere"
    )


def not_finite(name: str, place: str, remark: str = "") -> AssemblyError:
    """Return the error for a constraint without a finite value at the start; `remark` says where there is none."""
    remedy = (
        f"{remark}: start with other angles" if remark else "choose start values or guesses inside its range"
    )
    return AssemblyError(f"{name} has no finite value at the start ({place}): {remedy}")


def gradient_vanishes(names: Sequence[str], place: str) -> AssemblyError:
    """Return the error for position constraints whose gradient is zero wherever they hold."""
    where = "it holds" if len(names) == 1 else "they hold"
    return AssemblyError(
        f"{_subject(names)} cannot be kept: the gradient is zero wherever {where}, "
        f"as at {place}, so no force acts; write the roots instead, x = 1 and y = 0 rather than (x - 1)^2 + y^2 = 0, "
        "or check the geometry, which may allow this one configuration only"
    )


def listed(names: Sequence[str], values: np.ndarray) -> str:
    """Return 'theta = 0.5, x = 0.4', at most some of them."""
    shown = ", ".join(f"{name} = {value:.10g}" for name, value in list(zip(names, values))[:_SHOWN])
    return shown + (", …" if len(names) > _SHOWN else "")


def joined(names: Sequence[str]) -> str:
    """Return 'a, b, c', at most some of them."""
    return ", ".join(names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")


def _numbers(values: np.ndarray) -> str:
    return joined([f"{value:.3g}" for value in values])


def _subject(names: Sequence[str]) -> str:
    return f"constraint{'s' if len(names) > 1 else ''} {joined([repr(name) for name in names])}"
