"""The table through which Python and machine code of ensembles talk, and arrays for it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from symgen.runtime.ensemble.slots import AT

_WIDEST = 128  # bytes of a vector of 16 numbers


class Table:
    """Addresses, sizes and numbers by the names in `slots`; it holds the arrays that it has addresses of."""

    def __init__(self) -> None:
        self._slots = np.zeros(len(AT), dtype=np.uint64)
        self._held: dict[str, np.ndarray] = {}

    @property
    def address(self) -> int:
        return self._slots.ctypes.data

    def set_integers(self, **values: int) -> None:
        """Set sizes, or addresses of code."""
        for name, value in values.items():
            self._slots[AT[name]] = value

    def set_numbers(self, **values: float) -> None:
        for name, value in values.items():
            self._slots.view(np.float64)[AT[name]] = value

    def integer(self, name: str) -> int:
        """Return a size that was set, here or by machine code."""
        return int(self._slots[AT[name]])

    def number(self, name: str) -> float:
        """Return a number that was set."""
        return float(self._slots.view(np.float64)[AT[name]])

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        for name, array in arrays.items():
            self._held[name] = array
            self._slots[AT[name]] = array.ctypes.data


def aligned(length: int) -> np.ndarray:
    """Return zeros that begin where vector registers are loaded from."""
    memory = np.zeros(length + _WIDEST // 8)
    first = -memory.ctypes.data % _WIDEST // 8
    return memory[first : first + length]
