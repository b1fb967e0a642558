"""Run time of a step loop, of the processor: the same run again and again from its start, the fastest one counts."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code import stand_ins
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.energy_level import choose_energy_level
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System

    from .case import Case
    from .sweep import Curve

STEPS_PER_CALL = 65_536
OVER_TIME = 100  # status of a run that was given up; those of the loops are smaller
_EMPTY_CALLS = 20
_BATCH_SECONDS = 2e-3
_BATCHES = 10


class TimedLoop:
    """A run without frames, events and logs, which can be repeated.

    What Python spends on a call of the loop is measured with calls that take no step, and taken off.
    """

    def __init__(
        self, system: System, method: Method, p: np.ndarray, state: np.ndarray, t_end: float, rtol: float,
        atol: float, step: float,
    ):  # fmt: skip
        self.t_end = t_end
        self.arrays = LoopArrays(
            system, method, p, 0.0, state, frame_times=np.zeros(0), rtol=rtol, atol=atol, step=step,
            with_events=False, log_length=STEPS_PER_CALL,
            energy_level=choose_energy_level(None, system, method, p, 0.0, state),
        )  # fmt: skip
        carried = (self.arrays.control, self.arrays.counters, self.arrays.y, self.arrays.f, self.arrays.work)
        self._start = [(array, array.copy()) for array in carried]
        with stand_ins.none():
            self.arrays.advance(t_end, 0)  # compiles the loop, or reads it from the cache
        self._empty_call = best_seconds(lambda: self.arrays.advance(t_end, 0), _EMPTY_CALLS, 0.0)

    def run(self, limit: float) -> tuple[int, float]:
        """Run from the start; returns status and seconds, `OVER_TIME` where it took longer than `limit` [s]."""
        for array, start in self._start:
            array[:] = start
        calls = 0
        began = time.thread_time()
        while True:
            status = self.arrays.advance(self.t_end, STEPS_PER_CALL)
            calls += 1
            seconds = time.thread_time() - began
            if status != at.RUNNING:
                return status, max(seconds - calls * self._empty_call, 1e-9)
            if seconds > limit:
                return OVER_TIME, seconds


def best_seconds(run: Callable[[], object], least: int, at_least: float) -> float:
    """Return the seconds of the fastest of several runs: `least` runs, and more until `at_least` seconds passed."""
    best, total, n = np.inf, 0.0, 0
    with no_garbage_collection():
        while n < least or total < at_least:
            began = time.thread_time()
            run()
            took = time.thread_time() - began
            best, total, n = min(best, took), total + took, n + 1
    return best


@contextmanager
def no_garbage_collection():
    """Keep Python from collecting garbage in the middle of a measurement."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@jitted
def call_again(address, t, y, p, out, n):
    """Call a kernel `n` times."""
    for _ in range(n):
        call_kernel(address, t, y, p, out)


def rhs_seconds(case: Case) -> float:
    """Return the seconds of one evaluation of the right-hand side, called from compiled code as loops call it."""
    system, reference = case.system, case.reference
    arrays = LoopArrays(
        system, METHODS["rk4"], reference.p, 0.0, reference.start, frame_times=np.zeros(0), rtol=1e-8, atol=1e-10,
        with_events=False, log_length=1,
    )  # fmt: skip
    arguments = (arrays.addresses[at.RHS], 0.0, arrays.y, arrays.precomputed, arrays.f)
    once = best_seconds(lambda: call_again(*arguments, 10), 3, 0.0) / 10
    n = max(10, int(_BATCH_SECONDS / once))
    return best_seconds(lambda: call_again(*arguments, n), _BATCHES, 0.0) / n


def stage_overhead(curves: Mapping[str, Curve], seconds_per_rhs: float) -> dict[str, float]:
    """Return, for each method that evaluates the right-hand side, seconds per evaluation beyond it.

    Of the run with the most evaluations, so that what is done once per run does not count.
    """
    overhead = {}
    for name, curve in curves.items():
        rows = [row for row in curve.usable() if row.rhs > 0 and row.jacobians == 0]
        if rows:
            longest = max(rows, key=lambda row: row.rhs)
            overhead[name] = longest.seconds / longest.rhs - seconds_per_rhs
    return overhead
