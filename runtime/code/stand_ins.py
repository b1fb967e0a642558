"""Code that LLVM makes in a hurry in the place of code that it makes fast, until the latter would have paid.

LLVM needs six to ten times as long for fast code of a step loop or of a long function as for a draft of it, which
takes 1.05 to 2 times as long a call; and three to four times as long again for vector code of a loop, with which a
large model's run is done in 0.5 to 0.95 of the time. All of them give the same bits. So where a machine has no better
code yet, runs begin in a draft, and go over, between two calls, once these have taken a tenth as long as the better
code will take to make (vector code: as long, since its gain is less): what calls have taken so far is the least of what
they will come to, also in later processes, which find the code.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
import warnings
import weakref
from collections.abc import Iterator
from typing import Literal, Protocol

Quality = Literal["draft", "scalar", "vector"]  # of step loops


class StandIn(Protocol):
    """Code that is called until better code takes its place.

    Attributes
    ----------
    seconds : float
        Of processor time, roughly, that the better code takes to make.
    """

    seconds: float

    def go_over(self) -> None:
        """Make the better code, and let it be called from now on."""


#: Whether the best code is made when it is first asked for.
at_once = False
OF_DRAFTS, OF_SCALARS = (
    0.2,
    1.0,
)  # of what better code takes to make: what calls of the other one have to come to
_lock = threading.Lock()
_waiting: list[tuple[float, weakref.ref[StandIn]]] = []
_spent = 0.0


@contextlib.contextmanager
def avoided() -> Iterator[None]:
    """Make the best code of what is first asked for meanwhile: for what must not wait for LLVM later."""
    global at_once
    before, at_once = at_once, True
    try:
        yield
    finally:
        at_once = before


@contextlib.contextmanager
def none() -> Iterator[None]:
    """Do the same, with the best code of all that has stand-ins already: for measurements."""
    with avoided():
        while _waiting:
            _count(math.inf)
        yield


def wait(stand_in: StandIn, part: float = OF_DRAFTS) -> None:
    """Let the calls from now on count for `stand_in`, which goes over when that pays; as long as somebody holds it.

    Parameters
    ----------
    stand_in : StandIn
    part : float
        When that is: of its `seconds`.
    """
    with _lock:
        _waiting.append((_spent + part * stand_in.seconds, weakref.ref(stand_in)))


def any_waits() -> bool:
    """Whether calls are to be counted."""
    return bool(_waiting)


@contextlib.contextmanager
def counted() -> Iterator[None]:
    """Count the processor time of calls within; code for which it is time then goes over."""
    began = time.thread_time()
    yield
    _count(time.thread_time() - began)


def _count(seconds: float) -> None:
    """Add to what calls have taken; with inf, all is due that waits now."""
    global _spent
    with _lock:
        now = _spent + seconds
        _spent = now if math.isfinite(now) else _spent
        known = [(due, held) for due, reference in _waiting if (held := reference()) is not None]
        _waiting[:] = [(due, weakref.ref(held)) for due, held in known if due > now]
    for due, held in known:
        if due <= now:
            try:
                held.go_over()
            except Exception as error:  # what stands in gives the same results
                warnings.warn(
                    f"LLVM did not make faster code ({error}): the run goes on with what it has",
                    RuntimeWarning,
                    stacklevel=2,
                )
