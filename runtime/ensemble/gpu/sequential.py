"""What threads do, one after another on this processor: the same program, but for where members' numbers come from."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping

import numpy as np

from symgen.runtime.code import engine
from symgen.runtime.ensemble.gpu.program import ENTRY, Program
from symgen.runtime.ensemble.gpu.thread import ARGUMENTS
from symgen.runtime.lazy import Late

nvptx = Late("symgen.runtime.code.nvptx")

_TYPES = {"ptr": ctypes.c_void_p, "i64": ctypes.c_int64, "double": ctypes.c_double}


class SequentialKernel:
    """A program's threads, run one after another.

    Parameters
    ----------
    program : Program
    n_threads : int
        Of the grid that is imagined: member k is the work of thread k modulo this.
    """

    def __init__(self, program: Program, n_threads: int = 1) -> None:
        self._n_threads = n_threads
        self._code = engine.MachineCode()
        address = self._code.add(nvptx.object_of(program.whole(device=False)), ENTRY)
        prototype = ctypes.CFUNCTYPE(
            None, ctypes.c_int64, ctypes.c_int64, *(_TYPES[k] for k in ARGUMENTS.values())
        )
        self._function = prototype(address)

    def run(self, given: Mapping[str, np.ndarray | int | float], _written: Mapping[str, np.ndarray]) -> None:
        """Run all members; see `batch.DeviceBatch`."""
        values = [
            x.ctypes.data if isinstance(x, np.ndarray) else x for x in (given[name] for name in ARGUMENTS)
        ]
        for thread in range(self._n_threads):
            self._function(thread, self._n_threads, *values)

    def stop(self) -> None:
        """Nothing: there is no other thread."""
