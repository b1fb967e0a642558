"""Hold back Ctrl-C, and what else ends a program, while something is written that must not be written by half."""

from __future__ import annotations

import _signal  # what `signal` wraps: looking up the names of numbers takes longer than what is held back
import signal
import threading
from typing import Any

ENDING = tuple(
    int(getattr(signal, name)) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
_writing = 0
_holding = False  # in the main thread


class uninterrupted:
    """Hold signals that end the program back within the block, and hand the first to whoever had it before at the end.

    Only signals with a handler in Python are held. Blocks may be nested.

    Parameters
    ----------
    writing : bool
        The block writes a file: it ends by itself, so it is worth waiting for; see `is_writing`.
    """

    def __init__(self, *, writing: bool = False):
        self._writing = writing
        self._before: dict[int, Any] | None = None  # handlers; None where nothing is held here
        self._pressed: list[tuple] = []

    def __enter__(self) -> None:
        global _writing, _holding
        if threading.current_thread() is not threading.main_thread():  # only that one gets signals
            self._writing = False
            return
        if not _holding:  # else they are handed back at the end of the block around this one
            self._before = {
                number: handler for number in ENDING if callable(handler := _signal.getsignal(number))
            }
            for number in self._before:
                _signal.signal(number, self._hold)
            _holding = True
        _writing += self._writing

    def __exit__(self, *_: object) -> None:
        global _writing, _holding
        _writing -= self._writing
        if self._before is None:
            return
        _holding = False
        for number, handler in self._before.items():
            _signal.signal(number, handler)
        if self._pressed:
            self._before[self._pressed[0][0]](*self._pressed[0])

    def _hold(self, *signal_and_frame: object) -> None:
        self._pressed.append(signal_and_frame)


def is_writing() -> bool:
    """Whether the main thread is in a block that writes a file."""
    return _writing > 0
