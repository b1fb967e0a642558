"""Rows and numbers evenly spread, without the parts of NumPy that take longer to load than a short run takes."""

from __future__ import annotations

import functools

import numpy as np

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
_SHORT_ROW = 50  # numbers


@functools.lru_cache(maxsize=16)
def sample_rows(n: int, most: int) -> np.ndarray:
    """Return at most `most` of the indices 0 to n - 1, the first and the last among them, in ascending order.

    The array is kept for the next who asks: it is not writeable.
    """
    return _constant(np.linspace(0, n - 1, min(n, most)).astype(int))


@functools.lru_cache(maxsize=32)
def quasi_random(n: int) -> np.ndarray:
    """Return n numbers between -1 and 1, the same each time and without a pattern that a model could have.

    Weyl's sequence of the golden ratio: multiples of an irrational number modulo one. The array is not writeable.
    """
    return _constant(2.0 * ((np.arange(1, n + 1) * _GOLDEN) % 1.0) - 1.0)


def _constant(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


def upper_median(values: np.ndarray) -> float:
    """Return the median; of an even number of values the upper one of the two in the middle."""
    return float(np.sort(values)[len(values) // 2])


def row_maxima(values: np.ndarray) -> np.ndarray:
    """Return the largest of each row of numbers that are not negative.

    It goes column by column, as NumPy takes longest over rows that are short.
    """
    if not 0 < values.shape[1] <= _SHORT_ROW:
        return values.max(axis=1, initial=0.0)
    return functools.reduce(np.maximum, values.T)
