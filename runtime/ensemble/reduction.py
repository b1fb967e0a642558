"""Statistics of an ensemble that are merged as members come in: memory does not grow with their number.

Members are reduced in blocks, wherever they ran; blocks are merged in the order of members. So results do not depend on
threads or machines.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.record import record

_NAMES = ("mean", "std", "min", "max", "count")
_CENTROIDS = 200  # of a digest: quantiles are right to about 1e-3 in the middle, and far better at the ends
_WIDER = 0.5  # of the range of the first members, on both sides of a histogram without bounds


@record
class Quantiles:
    """Quantiles, by their shares from 0 to 1; see `quantiles`."""

    shares: tuple[float, ...]


@record
class Histogram:
    """Counts in bins of equal width; see `histogram`."""

    bins: int
    low: float | None = None
    high: float | None = None


def quantiles(*shares: float) -> Quantiles:
    """Ask for quantiles, such as `quantiles(0.05, 0.5, 0.95)`; they come from a digest of a few hundred numbers.

    T. Dunning, O. Ertl, Computing extremely accurate quantiles using t-digests, 2019 (arXiv:1902.04023).
    """
    if not shares or not all(0.0 <= share <= 1.0 for share in shares):
        raise RuntimeModelError(f"quantiles{shares}: give shares from 0 to 1, such as quantiles(0.05, 0.95)")
    return Quantiles(tuple(map(float, shares)))


def histogram(bins: int, low: float | None = None, high: float | None = None) -> Histogram:
    """Ask for counts in bins of equal width between two bounds.

    Without bounds they lie around what the first members do, with half of their range to spare on both sides. What
    lies outside is counted as `below` and `above`.
    """
    if bins < 1 or (low is None) != (high is None) or (low is not None and not low < high):
        raise RuntimeModelError(
            f"histogram({bins}, {low}, {high}): give a number of bins, and both bounds or none"
        )
    return Histogram(int(bins), low, high)


class Moments:
    """Number, mean, deviation and range of values, at each of several places.

    Chan, Golub, LeVeque, The American Statistician 37 (1983) 242: merging of means and sums of squares.
    """

    def __init__(self) -> None:
        self.count: Any = 0
        self._mean: Any = 0.0
        self._squares: Any = 0.0
        self._least: Any = np.inf
        self._most: Any = -np.inf

    def take(self, values: np.ndarray) -> None:
        """Take values of more members, shape (k, …); what is not a number is left out."""
        there = np.isfinite(values)
        n = there.sum(axis=0)
        known = np.where(there, values, 0.0)
        mean = known.sum(axis=0) / np.maximum(n, 1)
        squares = (np.where(there, values - mean, 0.0) ** 2).sum(axis=0)
        least = np.where(there, values, np.inf).min(axis=0, initial=np.inf)
        self._add(n, mean, squares, least, np.where(there, values, -np.inf).max(axis=0, initial=-np.inf))

    def merge(self, other: Moments) -> None:
        """Take what another has taken."""
        self._add(other.count, other._mean, other._squares, other._least, other._most)

    def _add(self, n: Any, mean: Any, squares: Any, least: Any, most: Any) -> None:
        total = np.maximum(self.count + n, 1)
        apart = mean - self._mean
        self._squares = self._squares + squares + apart * apart * (self.count * n / total)
        self._mean = self._mean + apart * (n / total)
        self.count = self.count + n
        self._least = np.minimum(self._least, least)
        self._most = np.maximum(self._most, most)

    def numbers(self) -> list[np.ndarray]:
        """Return all that it has, for a file; see `set_numbers`."""
        return [
            np.asarray(x, float) for x in (self.count, self._mean, self._squares, self._least, self._most)
        ]

    def set_numbers(self, numbers: Sequence[np.ndarray]) -> None:
        """Take the place of one whose `numbers` these are."""
        count, self._mean, self._squares, self._least, self._most = numbers
        self.count = count.astype(np.int64)

    def get(self, name: str) -> Any:
        if name == "std":
            return np.sqrt(self._squares / np.maximum(np.asarray(self.count) - 1, 1))
        return {"mean": self._mean, "min": self._least, "max": self._most, "count": self.count}[name]


class Digest:
    """A few hundred weighted numbers that stand for many, dense at both ends."""

    def __init__(self) -> None:
        self._means, self._weights = np.zeros(0), np.zeros(0)
        self._least, self._most = np.inf, -np.inf

    def take(self, values: np.ndarray) -> None:
        """Take more values, shape (k,); what is not a number is left out."""
        values = values[np.isfinite(values)]
        if not len(values):
            return
        self._add(values, np.ones(len(values)), float(values.min()), float(values.max()))

    def merge(self, other: Digest) -> None:
        """Take what another has taken."""
        if len(other._means):
            self._add(other._means, other._weights, other._least, other._most)

    def _add(self, means: np.ndarray, weights: np.ndarray, least: float, most: float) -> None:
        self._least, self._most = min(self._least, least), max(self._most, most)
        means, weights = np.concatenate([self._means, means]), np.concatenate([self._weights, weights])
        order = np.argsort(means, kind="stable")
        means, weights = means[order], weights[order]
        ends = np.cumsum(weights)
        # The scale function k1 of the paper: equal steps of the arc sine hold what becomes one.
        shares = np.clip((ends - 0.5 * weights) / ends[-1], 0.0, 1.0)
        cell = np.floor(_CENTROIDS * (np.arcsin(2.0 * shares - 1.0) / np.pi + 0.5)).astype(int)
        first = np.flatnonzero(np.append(True, cell[1:] != cell[:-1]))
        self._weights = np.add.reduceat(weights, first)
        self._means = np.add.reduceat(means * weights, first) / self._weights

    def numbers(self) -> list[np.ndarray]:
        """Return all that it has, for a file; see `set_numbers`."""
        return [self._means, self._weights, np.array([self._least, self._most])]

    def set_numbers(self, numbers: Sequence[np.ndarray]) -> None:
        """Take the place of one whose `numbers` these are."""
        self._means, self._weights, (self._least, self._most) = numbers

    def quantile(self, share: float) -> float:
        """Return a quantile by interpolation between the numbers."""
        if not len(self._means):
            return float("nan")
        middle = np.cumsum(self._weights) - 0.5 * self._weights
        total = self._weights.sum()
        places = np.concatenate([[0.0], middle, [total]])
        known = np.concatenate([[self._least], self._means, [self._most]])
        return float(np.interp(share * total, places, known))


class Counts:
    """A histogram under way."""

    def __init__(self, asked: Histogram) -> None:
        self._asked = asked
        self.edges: np.ndarray | None = None  # none yet where no bounds are asked for
        if asked.low is not None:
            self.edges = np.linspace(asked.low, asked.high, asked.bins + 1)
        self.counts: Any = 0
        self.below: Any = 0
        self.above: Any = 0

    def take(self, values: np.ndarray) -> None:
        """Take values, shape (k,) or (k, F)."""
        values = values.reshape(len(values), -1)
        if self.edges is None:
            self.edges = np.linspace(*self._bounds(values), self._asked.bins + 1)
        low, width = self.edges[0], self.edges[1] - self.edges[0]
        there = np.isfinite(values)
        cell = np.floor((np.where(there, values, low) - low) / width)
        inside = there & (cell >= 0) & ((cell < self._asked.bins) | (values == self.edges[-1]))
        cell = np.clip(cell, 0, self._asked.bins - 1).astype(int)
        columns = np.broadcast_to(np.arange(values.shape[1]), values.shape)
        flat = np.bincount(
            columns[inside] * self._asked.bins + cell[inside], minlength=values.shape[1] * self._asked.bins
        )
        self.counts = self.counts + flat.reshape(values.shape[1], self._asked.bins)
        self.below = self.below + (there & (values < low)).sum(axis=0)
        self.above = self.above + (there & (values > self.edges[-1])).sum(axis=0)

    def merge(self, other: Counts) -> None:
        """Take what another has taken, whose bins are the same ones."""
        self.edges = other.edges if self.edges is None else self.edges
        self.counts = self.counts + other.counts
        self.below, self.above = self.below + other.below, self.above + other.above

    def numbers(self) -> list[np.ndarray]:
        """Return all that it has, for a file; see `set_numbers`."""
        edges = np.zeros(0) if self.edges is None else self.edges
        return [edges, *(np.asarray(x, float) for x in (self.counts, self.below, self.above))]

    def set_numbers(self, numbers: Sequence[np.ndarray]) -> None:
        """Take the place of one whose `numbers` these are."""
        edges, *counts = numbers
        self.edges = edges if len(edges) else None
        self.counts, self.below, self.above = (x.astype(np.int64) for x in counts)

    def _bounds(self, values: np.ndarray) -> tuple[float, float]:
        known = values[np.isfinite(values)]
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
        margin = _WIDER * (high - low) or max(abs(low), 1.0) * 1e-6
        return low - margin, high + margin


class Reduction:
    """All statistics that are wanted of one quantity.

    Parameters
    ----------
    name : str
    wanted : sequence of str, Quantiles, Histogram
    """

    def __init__(self, name: str, wanted: Sequence[Any]) -> None:
        for entry in wanted:
            if not isinstance(entry, (Quantiles, Histogram)) and entry not in _NAMES:
                raise RuntimeModelError(
                    f"reduce: {name}: there is no {entry!r}; there are {', '.join(_NAMES)}, quantiles(…), histogram(…)"
                )
        self.name, self._wanted = name, tuple(wanted)
        self._moments = Moments()
        self._digests: list[Digest] | None = None
        self._counts = [Counts(entry) for entry in wanted if isinstance(entry, Histogram)]
        self._has_quantiles = any(isinstance(entry, Quantiles) for entry in wanted)
        self._is_series = False

    def take(self, values: np.ndarray) -> None:
        """Take values of more members, shape (k,) or (k, F)."""
        self._is_series = values.ndim > 1
        self._moments.take(values)
        for counts in self._counts:
            counts.take(values)
        if self._has_quantiles:
            rows = values.reshape(len(values), -1).T
            if self._digests is None:
                self._digests = [Digest() for _ in rows]
            for digest, row in zip(self._digests, rows, strict=True):
                digest.take(row)

    def merge(self, other: Reduction) -> None:
        """Take what another of the same kind has taken, of the members that come next."""
        self._is_series = self._is_series or other._is_series
        self._moments.merge(other._moments)
        for counts, more in zip(self._counts, other._counts, strict=True):
            counts.merge(more)
        if other._digests is not None:
            if self._digests is None:
                self._digests = [Digest() for _ in other._digests]
            for digest, more in zip(self._digests, other._digests, strict=True):
                digest.merge(more)

    def empty(self) -> Reduction:
        """Return one of the same kind, with the same bins, that has taken nothing."""
        made = Reduction(self.name, self._wanted)
        for counts, own in zip(made._counts, self._counts, strict=True):
            counts.edges = own.edges
        return made

    @property
    def lacks_bins(self) -> bool:
        """Whether bins of a histogram are still to be laid around what the first members do."""
        return any(counts.edges is None for counts in self._counts)

    def numbers(self) -> list[np.ndarray]:
        """Return all that it has, for a file; see `set_numbers`."""
        digests = self._digests or []
        found = [np.array([float(self._is_series), float(len(digests))]), *self._moments.numbers()]
        for part in (*self._counts, *digests):
            found += part.numbers()
        return found

    def set_numbers(self, numbers: Sequence[np.ndarray]) -> None:
        """Take the place of one whose `numbers` these are.

        Raises
        ------
        ValueError
            They are not of one of this kind.
        """
        head, *left = numbers
        self._is_series, n_digests = bool(head[0]), int(head[1])
        if not 0 <= n_digests <= len(left):
            raise ValueError("numbers of a reduction are missing")
        self._moments.set_numbers(left[:5])
        left = left[5:]
        for counts in self._counts:
            counts.set_numbers(left[:4])
            left = left[4:]
        self._digests = [Digest() for _ in range(n_digests)] or None
        for digest in self._digests or ():
            digest.set_numbers(left[:3])
            left = left[3:]
        if left:
            raise ValueError("there are more numbers than a reduction has")

    def result(self) -> dict[str, Any]:
        """Return what was wanted, by name: `mean`, …, `quantiles` by share, `histogram`."""
        found: dict[str, Any] = {}
        histograms = iter(self._counts)
        for entry in self._wanted:
            if isinstance(entry, Quantiles):
                digests = self._digests or [Digest()]
                of_all = {share: np.array([d.quantile(share) for d in digests]) for share in entry.shares}
                found["quantiles"] = {
                    share: values if self._is_series else float(values[0]) for share, values in of_all.items()
                }
            elif isinstance(entry, Histogram):
                counts = next(histograms)
                series = slice(None) if self._is_series else 0
                found["histogram"] = {
                    "edges": counts.edges,
                    **{
                        name: np.asarray(getattr(counts, name))[series]
                        if np.ndim(getattr(counts, name))
                        else 0
                        for name in ("counts", "below", "above")
                    },
                }
            else:
                value = self._moments.get(entry)
                found[entry] = value if self._is_series else np.asarray(value).item()
        return found
