"""A graphics processor of NVIDIA, through cuda-core: memory, copies, launches. The one module that imports it."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from symgen.runtime.ensemble.gpu.program import ENTRY
from symgen.runtime.ensemble.gpu.thread import ARGUMENTS
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.record import record

_BLOCK = 256  # threads; on an H100 as fast as any, and a third faster than 64 for small models
_SHORTEST_WAIT, _LONGEST_WAIT = 2e-5, 2e-3  # seconds
_LEAVE_OUT = "leave out device='cuda', and members run on this machine's processors"


@record
class DeviceFacts:
    """A graphics processor.

    Attributes
    ----------
    name : str
    arch : str
        Such as sm_90.
    """

    name: str
    arch: str


def _core() -> Any:
    try:
        import cuda.core as core
        from cuda.bindings import driver  # noqa: F401 - without it cuda-core says less
    except ImportError:
        raise RuntimeModelError(
            f"device='cuda' needs NVIDIA's package cuda-core: pip install 'symgen[gpu]', or {_LEAVE_OUT}"
        ) from None
    return core


def _device(core: Any) -> Any:
    try:
        device = core.Device(0)
        device.set_current()
    except Exception as error:  # of many kinds: no driver, no device, one that is in use
        said = " ".join(str(error).split())
        raise RuntimeModelError(
            f"device='cuda': no graphics processor of NVIDIA can be used here ({said}): install one with its "
            f"driver, or {_LEAVE_OUT}"
        ) from None
    return device


def device_facts() -> DeviceFacts:
    """Return what the graphics processor is.

    Raises
    ------
    RuntimeModelError
        There is none, or no driver, or no cuda-core.
    """
    device = _device(_core())
    major, minor = device.compute_capability
    return DeviceFacts(str(device.name), f"sm_{major}{minor}")


class CudaKernel:
    """A program on the graphics processor, with a stream and memory of its own.

    Parameters
    ----------
    code : bytes
        Machine code, see `assembler.assemble`.
    """

    def __init__(self, code: bytes) -> None:
        self._core = _core()
        self._device = _device(self._core)
        self._stream = self._device.create_stream()
        self._pinned_memory = self._core.LegacyPinnedMemoryResource()
        # The module has to live as long as its kernel.
        self._module = self._core.ObjectCode.from_cubin(code)
        self._kernel = self._module.get_kernel(ENTRY)
        self._stopped = False
        self._buffers: dict[str, tuple[int, Any, Any]] = {}  # bytes, here (pinned), there

    def run(self, given: Mapping[str, Any], written: Mapping[str, np.ndarray]) -> None:
        """Run members, see `batch.Kernel`.

        Raises
        ------
        RuntimeModelError
            The device fails: out of memory, a fault.
        """
        self._stopped = False
        try:
            self._device.set_current()
            self._launch(given, written)
        except Exception as error:
            said = " ".join(str(error).split())
            raise RuntimeModelError(
                f"device='cuda': {self._device.name} fails ({said}): with too little memory try threads=1 or fewer "
                f"frames, or {_LEAVE_OUT}"
            ) from error

    def _launch(self, given: Mapping[str, Any], written: Mapping[str, np.ndarray]) -> None:
        self._start(self._sent(given, written), int(given["n_members"]))
        for name, array in written.items():
            if array.nbytes:
                here, there = self._buffer(name, array.nbytes)
                there.copy_to(here, stream=self._stream)
        if not self._wait():
            return
        for name, array in written.items():
            if array.nbytes:
                here, _ = self._buffer(name, array.nbytes)
                array.reshape(-1)[:] = _as_array(here, array.nbytes)

    def _sent(self, given: Mapping[str, Any], written: Mapping[str, np.ndarray]) -> list[Any]:
        """Send arrays on their way; returns the program's arguments."""
        arguments = []
        for name, kind in ARGUMENTS.items():
            value = given[name]
            if kind != "ptr":
                arguments.append(float(value) if kind == "double" else int(value))
                continue
            here, there = self._buffer(name, value.nbytes)
            # Frames behind a member's end stay what they are.
            if value.nbytes and (name not in written or name == "frames"):
                _as_array(here, value.nbytes)[:] = value.reshape(-1)
                here.copy_to(there, stream=self._stream)
            arguments.append(there)
        return arguments

    def _start(self, arguments: list[Any], n_members: int) -> None:
        blocks = -(-n_members // _BLOCK)
        config = self._core.LaunchConfig(grid=blocks, block=_BLOCK)
        self._core.launch(self._stream, config, self._kernel, *arguments)

    def _wait(self) -> bool:
        """Wait for the stream, so that Ctrl-C has an answer; returns whether it is done."""
        event, pause = self._stream.record(), _SHORTEST_WAIT
        while not event.is_done:
            if self._stopped:
                return False
            time.sleep(pause)
            pause = min(2.0 * pause, _LONGEST_WAIT)
        return True

    def stop(self) -> None:
        """Let `run`, in another thread, return at once."""
        self._stopped = True

    def _buffer(self, name: str, size: int) -> tuple[Any, Any]:
        """Memory for an array, here and there, of its size in bytes."""
        size = max(size, 8)
        known = self._buffers.get(name)
        if known is None or known[0] != size:
            if known is not None:
                self._stream.sync()  # nothing may be under way to what is given back
                for buffer in known[1:]:
                    buffer.close(self._stream)
            known = size, self._pinned_memory.allocate(size), self._device.allocate(size, stream=self._stream)
            self._buffers[name] = known
        return known[1:]


def _as_array(buffer: Any, size: int) -> np.ndarray:
    return np.frombuffer((ctypes.c_char * size).from_address(int(buffer.handle)), dtype=float)
