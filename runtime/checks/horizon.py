"""Up to when digits of a result can be trusted: where motion is chaotic, errors grow until nothing is left of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.growth import growth_rate, is_exponential, running_maximum

if TYPE_CHECKING:
    from symgen.runtime.checks.convergence import Comparison

DIGITS = (3, 6)
_ROWS = 8  # of the table


@dataclass(frozen=True)
class Horizon:
    """How the error of a run grows.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
    error : ndarray, shape (n,)
        Largest estimated error of all coordinates and rates up to t, in parts of their sizes.
    rate : float or None [1/s]
        Where differences of the runs grow exponentially: the rate of that, an estimate of the largest finite-time
        Lyapunov exponent. None where they do not.
    """

    t: np.ndarray
    error: np.ndarray
    rate: float | None

    def digits(self) -> np.ndarray:
        """Return how many leading digits of the largest values are right up to t, at least 0: shape (n,)."""
        with np.errstate(divide="ignore"):
            return np.maximum(-np.log10(self.error), 0.0)

    def of(self, digits: int) -> float:
        """Return the time [s] up to which so many digits can be trusted."""
        lost = np.flatnonzero(~(self.error <= 10.0**-digits))
        return float(self.t[max(lost[0] - 1, 0)] if lost.size else self.t[-1])

    @property
    def t_end(self) -> float:
        """The end of what was compared [s]."""
        return float(self.t[-1])

    def rows(self) -> list[tuple[float, float, float]]:
        """Return times, errors and digits for a table: evenly from the start to where nothing is left, or the end."""
        last = self.of(0)
        places = np.linspace(self.t[0], last, _ROWS + 1)[1:]
        at = np.unique(np.clip(np.searchsorted(self.t, places), 0, len(self.t) - 1))
        digits = self.digits()
        return [(float(self.t[i]), float(self.error[i]), float(digits[i])) for i in at]

    def to_dict(self) -> dict[str, Any]:
        """Return the table, the horizons and the rate as a dictionary."""
        table = [{"t": t, "error": error, "digits": digits} for t, error, digits in self.rows()]
        return {"rate": self.rate, "horizon": {str(k): self.of(k) for k in DIGITS}, "trusted": table}


def horizon(compared: Comparison) -> Horizon:
    """Return how the error of the run that was asked for grows, as differences of neighbouring runs tell."""
    t = compared.t
    # All runs start from one state. Of three pairs, one may have had luck.
    exponential = sum(is_exponential(t, pair) for pair in compared.relative) > len(compared.relative) / 2
    rates = [growth_rate(t, pair) for pair in compared.relative]
    known = [rate for rate in rates if rate is not None]
    rate = float(np.median(known)) if exponential and known else None
    return Horizon(t, running_maximum(compared.relative_error), rate)
