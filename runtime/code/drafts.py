"""Drafts of functions: machine code that LLVM makes in a tenth of the time, until better code would have paid.

Callers hold an address for as long as they like. So a draft is entered through a jump to where a variable says, and
better code, which gives the same bits, takes its place at any time, between two calls or within a call of a step loop.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Sequence

from symgen.runtime.code import engine, llvm_text, stand_ins

_WORTH = 0.05  # seconds that better code takes, from which on there is a draft first
_SECONDS_PER_CHARACTER = 4e-6  # of a function's text, roughly


def seconds_of(text: str) -> float:
    """Return how long LLVM takes, roughly, for the best code of a function of such a text [s]."""
    return len(text) * _SECONDS_PER_CHARACTER


def is_wanted(key: str, seconds: float) -> bool:
    """Whether a function begins as a draft: its best code is not there yet, and takes a while to make."""
    return seconds > _WORTH and not stand_ins.at_once and not engine.is_kept(key)


class Draft:
    """A draft of a function, and the better code that takes its place.

    Parameters
    ----------
    key, name : str
        As of `engine.object_code`, of the better code.
    symbols : sequence of str
        Functions with the signature of a kernel that the code defines.
    lower : callable
        As of `engine.object_code`.
    seconds : float
        That the better code takes to make, roughly.
    home : MachineCode
        Where the better code belongs.

    Attributes
    ----------
    addresses : tuple of int
        Of the functions, as long as this object and `home` live.
    seconds : float
    """

    def __init__(
        self,
        key: str,
        name: str,
        symbols: Sequence[str],
        lower: Callable[[str], tuple[str, int]],
        seconds: float,
        home: engine.MachineCode,
    ) -> None:
        self.seconds = seconds
        self._key, self._name, self._symbols, self._lower, self._home = key, name, symbols, lower, home
        self._lock, self._is_over = threading.Lock(), False
        self._code = engine.MachineCode()
        content = engine.object_code(
            f"{key}-draft", name, symbols[0], self._lower_with_entries, kind=engine.DRAFT
        )
        self._code.add(content, symbols[0])
        self.addresses = self._addresses(self._code, llvm_text.ENTRY)
        stand_ins.wait(self)

    def _lower_with_entries(self, symbol: str) -> tuple[str, int]:
        ir, operations = self._lower(symbol)
        return ir + "".join(map(llvm_text.entry, self._symbols)), operations

    def _addresses(self, code: engine.MachineCode, ending: str = "") -> tuple[int, ...]:
        return tuple(code.address(symbol + ending) for symbol in self._symbols)

    def go_over(self) -> None:
        """Make the better code, and let it be called from now on."""
        with self._lock:
            if self._is_over:
                return
            code = engine.object_code(self._key, self._name, self._symbols[0], self._lower)
            self._home.add(code, self._symbols[0])
            places = self._addresses(self._code, llvm_text.PLACE)
            for place, address in zip(places, self._addresses(self._home)):
                ctypes.c_uint64.from_address(place).value = address
            self._is_over = True

    def better(self) -> tuple[int, ...] | None:
        """Return the addresses of the functions in the better code; None as long as there is none."""
        return self._addresses(self._home) if self._is_over else None
