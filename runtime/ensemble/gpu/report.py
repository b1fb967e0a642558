"""What a model's programs need of a graphics processor, without one; and whether they give the bits of the lanes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.gpu.batch import DeviceBatch
from symgen.runtime.ensemble.gpu.choose import DeviceProgram, device_program, program_of, why_too_large
from symgen.runtime.ensemble.gpu.sequential import SequentialKernel
from symgen.runtime.ensemble.machine import ON_DEVICES
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.system import System

METHODS = ON_DEVICES
_CHECKED_STEPS = 100


@record(eq=False)
class ProgramReport:
    """A model's program for one method and architecture.

    Attributes
    ----------
    method, arch : str
    program : DeviceProgram or None
    refusal : str
        Why it is not run; empty where it is.
    """

    method: str
    arch: str
    program: DeviceProgram | None
    refusal: str


def report_program(system: System, method: str, arch: str) -> ProgramReport:
    """Report on a program, as an ensemble without frames has it.

    Raises
    ------
    RuntimeModelError
        There is no assembler, or no such architecture.
    """
    try:
        plan = _plan(system, method)
    except RuntimeModelError as why:
        return ProgramReport(method, arch, None, str(why))
    if plan.settings is None:
        return ProgramReport(method, arch, None, plan.notes[-1])
    program = device_program(system, method, arch, scale_energy=plan.settings.scale_energy, with_frames=False)
    return ProgramReport(method, arch, program, why_too_large(system, method, program))


def same_bits(system: System, method: str, flat: bool) -> bool:
    """Run the program's thread for the model's own start, here, and compare with a lane: ends and verdicts, to the bit.

    Raises
    ------
    RuntimeModelError
        The model has no such program.
    """
    plan = _plan(system, method)
    parameters, varied = plan.members.arrays(plan.p, 0, plan.members.n)
    starts, _ = plan.starts.of(parameters, varied)
    settings = replace(plan.settings, max_steps=_CHECKED_STEPS)
    program = program_of(system, method, scale_energy=settings.scale_energy, with_frames=False, flat=flat)
    threads = DeviceBatch(system, settings, SequentialKernel(program)).run(parameters, starts)
    lanes = LaneBatch(system, replace(settings, lanes=1)).run(parameters, starts)
    known = threads.columns.any(axis=0)
    return np.array_equal(threads.end, lanes.end, equal_nan=True) and np.array_equal(
        threads.columns[:, known], lanes.columns[:, known], equal_nan=True
    )


def _plan(system: System, method: str) -> Plan:
    t_end = None if "t_end" in system.run_defaults else 1.0
    return make_plan(system, EnsembleOptions(t_end=t_end, n=1, method=method))
