"""Hold back Ctrl-C, and what else ends a program, while something is written that must not be written by half."""

from __future__ import annotations

import _signal  # what `signal` wraps: looking up the names of numbers takes longer than what is held back
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

ENDING = tuple(
    int(getattr(signal, name)) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
_writing = 0
_holding = False  # in the main thread


@contextmanager
def uninterrupted(*, writing: bool = False) -> Iterator[None]:
    """Hold signals that end the program back within the block, and hand the first to whoever had it before at the end.

    Only signals with a handler in Python are held. Blocks may be nested.

    Parameters
    ----------
    writing : bool
        The block writes a file: it ends by itself, so it is worth waiting for; see `is_writing`.
    """
    global _writing, _holding
    if threading.current_thread() is not threading.main_thread():  # only that one gets signals
        yield
        return
    if _holding:  # signals are handed back at the end of the block around this one
        _writing += writing
        try:
            yield
        finally:
            _writing -= writing
        return
    pressed: list[tuple] = []

    def hold(*signal_and_frame: object) -> None:
        pressed.append(signal_and_frame)

    before = {number: handler for number in ENDING if callable(handler := _signal.getsignal(number))}
    for number in before:
        _signal.signal(number, hold)
    _writing += writing
    _holding = True
    try:
        yield
    finally:
        _writing -= writing
        _holding = False
        for number, handler in before.items():
            _signal.signal(number, handler)
        if pressed:
            before[pressed[0][0]](*pressed[0])


def is_writing() -> bool:
    """Whether the main thread is in a block that writes a file."""
    return _writing > 0
