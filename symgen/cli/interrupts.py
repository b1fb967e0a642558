"""Ctrl-C, and what else asks a program to end: answered within a second, whatever machine code is running.

Python acts on a signal between two of its own instructions, so a step loop that does not return would keep it waiting.
A thread beside it reads the signals' numbers from a pipe; where the main thread has not acted in time, it ends the
process. What a run has recorded until then stays readable.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import threading
import time
from collections.abc import Iterator
from types import FrameType

from symgen.runtime.uninterrupted import ENDING, is_writing

_PATIENCE = 0.6  # seconds until a signal must have been acted on
_PATIENCE_WRITING = 30.0
_LOOK_EVERY = 0.02
_UNANSWERED = b"\ninterrupted: the machine code did not answer; what was recorded so far is kept\n"
_EXIT = 128  # a shell's exit status of a program that a signal ended, less the signal's number


class _Answers:
    """Which signal came, and when the main thread acted on one."""

    def __init__(self) -> None:
        self.number = int(signal.SIGINT)
        self._acted_at = -math.inf

    def act(self, number: int, frame: FrameType | None) -> None:
        self.number, self._acted_at = number, time.monotonic()
        raise KeyboardInterrupt

    def watch(self, pipe: int) -> None:
        """Read numbers of signals from a pipe until it is closed."""
        while numbers := os.read(pipe, 64):
            last = numbers[-1]
            if last in ENDING and not self._acts_in_time():
                with contextlib.suppress(OSError):  # nobody may be there to read it
                    os.write(2, _UNANSWERED)
                os._exit(_EXIT + last)
        os.close(pipe)

    def _acts_in_time(self) -> bool:
        # Several signals may be acted on as one, before all of them are read here.
        began = time.monotonic()
        while self._acted_at < began - _PATIENCE:
            time.sleep(_LOOK_EVERY)
            if time.monotonic() - began > (_PATIENCE_WRITING if is_writing() else _PATIENCE):
                return False
        return True


_answers = _Answers()


def interrupted_status() -> int:
    """Return the exit status after the signal that came: 130 after Ctrl-C, 143 after SIGTERM."""
    return _EXIT + _answers.number


@contextlib.contextmanager
def answered_interrupts() -> Iterator[None]:
    """Turn signals that end the program into `KeyboardInterrupt` within the block, and see that it comes soon.

    Signals that somebody else handles, or that are ignored, are left alone.
    """
    usual = (signal.SIG_DFL, signal.default_int_handler)
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: handler for number in ENDING if (handler := signal.getsignal(number)) in usual}
    read, write = os.pipe()
    os.set_blocking(write, False)
    wakeup = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    for number in before:
        signal.signal(number, _answers.act)
    threading.Thread(target=_answers.watch, args=(read,), name="interrupts", daemon=True).start()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(wakeup)
        os.close(write)
