"""A batch of members on a graphics processor: the arrays that threads read and write, and what they come to."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from symgen.runtime.code import engine
from symgen.runtime.ensemble.arrays import Table
from symgen.runtime.ensemble.batch import BatchResult, BatchSettings, LaneBatch, repeat_ends
from symgen.runtime.ensemble.gpu.thread import KEPT
from symgen.runtime.ensemble.lanes import ALL, Lanes, precompute
from symgen.runtime.ensemble.slots import COLUMNS, NUMBERS
from symgen.runtime.ensemble.writer import Code
from symgen.runtime.system import System

_PREPARE = "symgen_prepare"


class Kernel(Protocol):
    """A program that is ready to run."""

    def run(self, given: Mapping[str, Any], written: Mapping[str, np.ndarray]) -> None:
        """Run members.

        Parameters
        ----------
        given : mapping
            Arguments by the names in `thread.ARGUMENTS`: arrays here, integers, numbers.
        written : mapping of str to ndarray
            Those of the arrays that threads write.
        """

    def stop(self) -> None:
        """Let `run`, in another thread, return as soon as it can."""


class DeviceBatch:
    """Runs batches of members of one model, a thread for each; each thread of Python needs its own.

    Parameters
    ----------
    system : System
    settings : BatchSettings
    kernel : Kernel
    """

    def __init__(self, system: System, settings: BatchSettings, kernel: Kernel) -> None:
        self.system, self.settings, self._kernel = system, settings, kernel
        # What a lane that is alone is told, threads are told.
        told = LaneBatch(system, replace(settings, lanes=1, log_size=0)).table
        self._told = {name: told.number(name) for name in NUMBERS}
        self._told |= {name: told.integer(name) for name in ("max_steps", "order", "n_frames")}

    def stop(self) -> None:
        """Let `run`, in another thread, return at once; what it returns is of no use."""
        self._kernel.stop()

    def run(self, parameters: np.ndarray, start: np.ndarray) -> BatchResult:
        """Run members from their starts to the end, see `batch.LaneBatch.run`."""
        system, n, n_frames = self.system, len(start), len(self.settings.frame_times)
        if not n:
            return BatchResult(
                np.zeros((0, system.ny)), np.zeros((0, len(COLUMNS))), np.zeros((0, n_frames, system.ny))
            )
        states = np.zeros((n, system.ny))
        states[:, : start.shape[1]] = start
        given, common = self._precomputed(np.ascontiguousarray(parameters, dtype=float))
        written = {
            "end": np.zeros((n, system.ny)), "results": np.zeros((n, len(KEPT))),
            "frames": np.full((n, n_frames, system.ny), np.nan),
        }  # fmt: skip
        self._kernel.run(
            {
                "start": states, "parameters": given, **written, "n_members": n, **self._told,
                "frame_times": np.ascontiguousarray(self.settings.frame_times, dtype=float),
                "p_step": 0 if common else system.n_precomputed,
            },
            written,
        )  # fmt: skip
        columns = np.zeros((n, len(COLUMNS)))
        columns[:, : len(KEPT)] = written["results"]
        result = BatchResult(written["end"], columns, written["frames"])
        repeat_ends(result, self.settings)
        return result

    def _precomputed(self, parameters: np.ndarray) -> tuple[np.ndarray, bool]:
        """What depends on parameters alone, shape (n, n_precomputed), or (n_precomputed,) where all have the same."""
        if (parameters == parameters[0]).all():
            return np.array(self.system.precomputed(parameters[0])), True
        rows = np.zeros((len(parameters), self.system.n_precomputed))
        table = Table()
        table.set_arrays({"parameters": parameters, "precomputed": rows})
        table.set_integers(
            setup=self.system.setup_address, n_members=len(rows), n_p=self.system.n_p,
            n_precomputed=self.system.n_precomputed,
        )  # fmt: skip
        _preparation()[0](table.address)
        return rows, False


@functools.lru_cache(maxsize=1)
def _preparation() -> tuple[Callable[[int], None], engine.MachineCode]:
    """What works out what depends on parameters alone, for all members; and what holds its code."""
    code = Code(_PREPARE, 1)
    lanes = Lanes(code)
    lanes.read(*ALL)
    with code.each(lanes.n_members) as member:
        precompute(lanes, member)
    text, machine = "\n".join([*sorted(code.declared), code.text()]), engine.MachineCode()
    content = engine.object_code(
        engine.cache_key(text), "preparation", _PREPARE, lambda _: (text, 0), kind=engine.LOOPS
    )
    return ctypes.CFUNCTYPE(None, ctypes.c_void_p)(machine.add(content, _PREPARE)), machine
