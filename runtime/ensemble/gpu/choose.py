"""Which program a device runs: in registers or in memory, by the model's size; or none, by what the assembler says."""

from __future__ import annotations

import functools
import hashlib
import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.runtime.choose import SERIES
from symgen.runtime.code import cache, engine
from symgen.runtime.code.lower import NoLanes
from symgen.runtime.ensemble.gpu.assembler import Assembled, assemble, assembler_version, check_arch
from symgen.runtime.ensemble.gpu.program import Program, make_program
from symgen.runtime.errors import Refusal, RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.system import System

nvptx = Late("symgen.runtime.code.nvptx")

# Operations of the right-hand side up to which a method's arrays are registers. On an H100 that takes a quarter to two
# thirds of the time of arrays in memory, spilled or not; with dop853 it comes to the same from 200 operations on, for
# four times the work of the assembler.
_IN_REGISTERS = {"rk4": 1500, "verlet": 1500, "dop853": 700}
# Bytes of memory for a thread: drivers reserve it for all threads that a processor holds, 270 000 on an H100.
LARGEST_STACK = 65_536
_KEPT = 500


@record
class DeviceProgram:
    """A program as a device runs it.

    Attributes
    ----------
    operations : int
        Of the right-hand side, or of a series.
    flat : bool
        Whether it is one function whose arrays are registers; otherwise arrays are in memory.
    seconds : float
        That LLVM took.
    assembled : Assembled
    """

    operations: int
    flat: bool
    seconds: float
    assembled: Assembled


def device_program(
    system: System, method: str, arch: str, *, scale_energy: bool, with_frames: bool
) -> DeviceProgram:
    """Return the program of a model and method for an architecture.

    Raises
    ------
    RuntimeModelError
        The model has none; there is no assembler, or no such architecture.
    """
    check_arch(arch)
    about = _sources(), _model(system), method, arch, scale_energy, with_frames, assembler_version()
    folder, key = cache.cache_folder("gpu"), engine.cache_key(repr(about))
    content = cache.fetch(folder / key)
    if content is not None:
        return _unpacked(content)
    found = _made(system, method, arch, scale_energy, with_frames)
    if cache.store(folder / key, _packed(found)):
        cache.prune(folder, _KEPT)
    return found


def why_too_large(system: System, method: str, program: DeviceProgram) -> str:
    """Say why a program is not run; an empty string where it is."""
    stack = program.assembled.stack
    if stack <= LARGEST_STACK:
        return ""
    better = "dop853 takes less" if method == SERIES else "split the model"
    return (
        f"method {method} of model {system.name!r} takes {stack} bytes of memory for each thread, more than the "
        f"{LARGEST_STACK} that a graphics processor has for each of its many threads: {better}, or leave out the device"
    )


def _made(system: System, method: str, arch: str, scale_energy: bool, with_frames: bool) -> DeviceProgram:
    began = time.perf_counter()
    made = functools.partial(program_of, system, method, scale_energy=scale_energy, with_frames=with_frames)
    program = made(flat=method in _IN_REGISTERS)
    if program.flat and program.operations > _IN_REGISTERS[method]:
        program = made(flat=False)
    ptx = nvptx.ptx_of(program.whole(device=True), arch)
    seconds = time.perf_counter() - began
    return DeviceProgram(program.operations, program.flat, seconds, assemble(ptx, arch))


def program_of(system: System, method: str, **options: Any) -> Program:
    """As `program.make_program`; what a device cannot do is an error that says so.

    Raises
    ------
    RuntimeModelError
    """
    try:
        return make_program(system, method, **options)
    except (NoLanes, Refusal) as why:
        raise RuntimeModelError(
            f"device='cuda': model {system.name!r} cannot run there: {why}; leave out the device"
        ) from None


def _model(system: System) -> tuple:
    """All of a model that decides what its program is."""
    sizes = (
        system.nq,
        system.nv,
        system.nh,
        system.m,
        system.nw,
        system.n_p,
        system.n_precomputed,
        tuple(system.quaternions),
    )
    functions = sorted(system.source.functions.items())
    return sizes, functions, sorted(system.input_polynomials.items()), sorted(system.switched.items())


def _packed(found: DeviceProgram) -> bytes:
    numbers = asdict(found)
    code = numbers["assembled"].pop("code")
    return json.dumps(numbers).encode() + b"\n" + code


def _unpacked(content: bytes) -> DeviceProgram:
    about, _, code = content.partition(b"\n")
    numbers = json.loads(about)
    return DeviceProgram(**{**numbers, "assembled": Assembled(code=code, **numbers["assembled"])})


@functools.lru_cache(maxsize=1)
def _sources() -> str:
    """Hash of the sources that decide what a program is."""
    digest = hashlib.sha256()
    runtime = Path(__file__).parents[2]
    for folder in ("ensemble", "ensemble/gpu", "taylor", "graph", "integrate", "integrate/explicit"):
        for path in sorted((runtime / folder).glob("*.py")):
            digest.update(path.read_bytes())
    digest.update((runtime / "code" / "nvptx.py").read_bytes())
    return digest.hexdigest()
