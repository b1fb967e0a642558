"""Test support: comparing numbers to the bit."""

from __future__ import annotations

import numpy as np


def assert_same_bits(a: np.ndarray, b: np.ndarray) -> None:
    """Equal to the bit, signs of zeros included; one nan is as good as another."""
    numbers = ~(np.isnan(a) & np.isnan(b))
    np.testing.assert_array_equal(a[numbers].view(np.int64), b[numbers].view(np.int64))
