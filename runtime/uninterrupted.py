"""Hold back Ctrl-C while something is written that must not be written by half."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back within the block, and hand it to whoever had it before at the end; blocks may be nested."""
    if threading.current_thread() is not threading.main_thread():  # only that one gets signals
        yield
        return
    pressed = []
    before = signal.signal(signal.SIGINT, lambda *signal_and_frame: pressed.append(signal_and_frame))
    try:
        yield
    finally:
        # None: a handler that was not set from Python, and cannot be set again from there.
        signal.signal(signal.SIGINT, signal.default_int_handler if before is None else before)
        if pressed and callable(before):
            before(*pressed[0])
