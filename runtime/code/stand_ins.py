"""Scalar code of step loops in the place of vector code, until that would have paid.

LLVM takes three to four times as long for a loop's vector code as for its scalar code (1 to 5 s), and a large model's
run is done in 0.5 to 0.95 of the time with it. So where a machine has no vector code of a loop yet, runs begin in
scalar code, which gives the same bits, and go over between two calls of the loop, once these have taken as long as the
vector code will take to make: a run takes at most twice as long as with either, and the next process finds it.
"""

from __future__ import annotations

import contextlib
import threading
import time
import weakref
from collections.abc import Iterator
from typing import Protocol


class Call(Protocol):
    """A call whose function has scalar code (a `CallBlock`)."""

    def take_vector_code(self) -> None:
        """Call the function's vector code from now on."""


#: Whether vector code is made when it is first asked for.
at_once = False
_PATIENCE = 2.0  # seconds of processor time
_lock = threading.Lock()
_waiting: weakref.WeakSet[Call] = weakref.WeakSet()
_spent = 0.0


@contextlib.contextmanager
def none() -> Iterator[None]:
    """Make vector code when it is first asked for: for measurements."""
    global at_once
    before, at_once = at_once, True
    try:
        yield
    finally:
        at_once = before


def wait(call: Call) -> None:
    """Let calls by a block that has scalar code count; it goes over to vector code when that pays."""
    with _lock:
        _waiting.add(call)


def any_waits() -> bool:
    """Whether calls are to be timed."""
    return bool(_waiting)


def note(since: float) -> None:
    """Count the processor time of a call that began at `since` of `time.thread_time`."""
    global _spent
    with _lock:
        _spent += time.thread_time() - since
        if _spent < _PATIENCE:
            return
        _spent, calls = 0.0, list(_waiting)
        _waiting.clear()
    for call in calls:
        call.take_vector_code()
