"""What the rest of ensembles knows of devices: whether one can do what is asked for, and a batch on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from symgen.runtime.ensemble.gpu import cuda
from symgen.runtime.ensemble.gpu.batch import DeviceBatch
from symgen.runtime.ensemble.gpu.choose import device_program, why_too_large
from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.ensemble.batch import BatchSettings
    from symgen.runtime.ensemble.gpu.assembler import Assembled
    from symgen.runtime.system import System


def check(system: System, settings: BatchSettings | None, objection: str) -> None:
    """Refuse what a device cannot do.

    Parameters
    ----------
    system : System
    settings : BatchSettings or None
        None where members run one after another.
    objection : str
        Why they do.

    Raises
    ------
    RuntimeModelError
        That, or there is no device, or something that it needs is not there.
    """
    if settings is None:
        raise RuntimeModelError(
            f"device='cuda': members of model {system.name!r} run one after another ({objection}), which a graphics "
            "processor cannot do: leave out the device"
        )
    _assembled(system, settings)


def make_batch(system: System, settings: BatchSettings) -> DeviceBatch:
    """Return a batch on the device; each thread of Python needs its own."""
    return DeviceBatch(system, settings, cuda.CudaKernel(_assembled(system, settings).code))


def _assembled(system: System, settings: BatchSettings) -> Assembled:
    found = device_program(
        system, settings.method, cuda.device_facts().arch, scale_energy=settings.scale_energy,
        with_frames=bool(len(settings.frame_times)),
    )  # fmt: skip
    reason = why_too_large(system, settings.method, found)
    if reason:
        raise RuntimeModelError(f"device='cuda': {reason}")
    return found.assembled
