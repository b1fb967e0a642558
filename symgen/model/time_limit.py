"""What SymPy can do to expressions within a time: it may take for ever, and is called back from outside."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable, Sequence

import sympy


class _TimeIsUp(BaseException):
    """Raised inside SymPy, which catches exceptions of many kinds, but none of this."""


def within(
    seconds: float, work: Callable[[sympy.Expr], sympy.Expr], expressions: Sequence[sympy.Expr]
) -> list[sympy.Expr | None]:
    """Return `work` of each expression, the short ones first; None for those that no time was left for.

    The work is done in a thread, in which CPython raises an exception when the time is over: so it ends wherever it is,
    on all platforms, whatever thread this is called from. An error of SymPy counts as nothing done.

    Parameters
    ----------
    seconds : float
        For all of them together.
    work : callable
    expressions : sequence of sympy.Expr
    """
    found: list[sympy.Expr | None] = [None] * len(expressions)
    finished, may_be_stopped = threading.Event(), threading.Lock()

    def run() -> None:
        try:
            for k in sorted(range(len(expressions)), key=lambda k: expressions[k].count_ops()):
                try:
                    found[k] = work(expressions[k])
                except Exception:  # whatever SymPy stumbles over leaves the expression as it was
                    continue
            with may_be_stopped:
                finished.set()
        except _TimeIsUp:
            pass

    worker = threading.Thread(target=run, daemon=True)
    worker.start()
    worker.join(max(seconds, 0.0))
    while worker.is_alive():
        with may_be_stopped:
            if finished.is_set():
                break
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(worker.ident), ctypes.py_object(_TimeIsUp)
            )
        time.sleep(0.05)  # the exception comes between two of its bytecodes
        worker.join(1.0)
    return found
