"""Runs of a study, compared, and up to when digits can be trusted: chaotic errors grow until none is left."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checks.growth import growth_rate, is_exponential, running_maximum

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

DIGITS = (3, 6)
_ROWS = 8  # of the table
MOST_TIMES = 400
_LEAST_RATIO = 1.5  # of two differences; where finer runs are no better, little is gained by extrapolation
_MOST_RATIO = 1e3
_LEAST_SIZE = 1e-6  # of the largest variable's


@dataclass(frozen=True)
class Comparison:
    """States of all runs at common times.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
    states : ndarray, shape (number of runs, n, nq + nv)
        (q, v), coarsest run first.
    asked : int
        Which of the runs has the step or tolerances that were asked for.
    """

    t: np.ndarray
    states: np.ndarray
    asked: int

    @cached_property
    def size(self) -> np.ndarray:
        """The largest magnitude of each variable in the finest run; what stays at zero has a part of the largest."""
        size = np.abs(self.states[-1]).max(axis=0)
        size = np.maximum(size, _LEAST_SIZE * size.max(initial=0.0))
        return np.where(size > 0.0, size, 1.0)

    @cached_property
    def largest(self) -> np.ndarray:
        """Largest difference of each variable from the next finer run, shape (number of runs - 1, nq + nv)."""
        return np.array([np.abs(fine - coarse).max(axis=0) for coarse, fine in self._pairs()])

    @cached_property
    def relative(self) -> np.ndarray:
        """Largest difference of all variables in parts of their sizes, over time: shape (number of runs - 1, n)."""
        return np.array([(np.abs(fine - coarse) / self.size).max(axis=1) for coarse, fine in self._pairs()])

    @cached_property
    def errors(self) -> np.ndarray:
        """Estimated error of the run that was asked for, shape (n, nq + nv), each variable in its own unit.

        It is held against the finest runs extrapolated (Richardson 1911): with differences that shrink by a factor r
        from run to run, what is left of them is the last one over r - 1. The factor is that of the largest differences
        up to each time, for where motion is chaotic finer runs gain nothing in the end.
        """
        before, last = (np.maximum.accumulate(np.abs(fine - coarse)) for coarse, fine in self._pairs()[-2:])
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.nan_to_num(before / last, nan=_LEAST_RATIO)
        ratio = np.clip(ratio, _LEAST_RATIO, _MOST_RATIO)
        limit = self.states[-1] + (self.states[-1] - self.states[-2]) / (ratio - 1.0)
        return np.abs(self.states[self.asked] - limit) + np.finfo(float).eps * np.abs(limit)

    @property
    def relative_error(self) -> np.ndarray:
        """The largest of `errors` in parts of the variables' sizes, over time: shape (n,)."""
        return (self.errors / self.size).max(axis=1)

    def _pairs(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return list(zip(self.states[:-1], self.states[1:]))


def compare_runs(runs: list[Solution], asked: int) -> Comparison:
    """Return runs at their common times.

    Methods of fixed step are compared at their samples, where all have a state without interpolation. To land on common
    times would shorten the steps of adaptive ones: these are compared at common frames.
    """
    if runs[0].step:
        n = min(len(run.samples) for run in runs)
        t = np.array([sample.t for sample in runs[0].samples[:n]])
        rows = [np.array([np.concatenate([s.q, s.v]) for s in run.samples[:n]]) for run in runs]
        return Comparison(t, np.array(rows), asked)
    n = min(len(run.t) for run in runs)
    n -= any(run.t[n - 1] != runs[0].t[n - 1] for run in runs)  # events that end runs have times of their own
    n = max(n, 1)
    chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_TIMES + 1)).astype(int))
    return Comparison(runs[0].t[chosen], np.array([run.states[chosen] for run in runs]), asked)


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
