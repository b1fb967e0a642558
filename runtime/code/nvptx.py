"""Whole programs of several modules of LLVM IR: as PTX, the assembly of NVIDIA's graphics processors, or for here.

No fast-math, no contraction: sums and products are rounded one by one (`add.rn`, `mul.rn`), so the bits are those of
any processor with fused multiply-add.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

import llvmlite.binding as llvm

from symgen.runtime.code import compiler
from symgen.runtime.record import record

TRIPLE = "nvptx64-nvidia-cuda"
_LEVEL = 3
_NUMBER = re.compile(r"\.\d+$")
_INLINE, _APART = "alwaysinline", "noinline"


@record(eq=False)
class Whole:
    """A program of several modules.

    Attributes
    ----------
    parts : sequence of str
        Modules of LLVM IR.
    entry : str
        The function that can be called from outside.
    inlined, apart : sequence of str
        Functions that become part of their callers, and such that do not.
    flat : bool
        Whether all others become part of their callers, and loops over known numbers of passes are unrolled.
    """

    parts: Sequence[str]
    entry: str
    inlined: Sequence[str] = ()
    apart: Sequence[str] = ()
    flat: bool = False


def ptx_of(program: Whole, arch: str) -> str:
    """Return the PTX of a program for an architecture such as sm_90."""
    with compiler.lock:
        machine = _device_machine(arch)
        return machine.emit_assembly(_optimised(program, TRIPLE, machine))


def object_of(program: Whole) -> bytes:
    """Return object code of a program for this machine."""
    with compiler.lock:
        compiler.initialise()
        machine = compiler.target_machine()
        return machine.emit_object(_optimised(program, llvm.get_process_triple(), machine))


def _optimised(program: Whole, triple: str, machine: llvm.TargetMachine) -> llvm.ModuleRef:
    module = _linked(program)
    module.triple, module.data_layout = triple, str(machine.target_data)
    module.verify()
    options = llvm.create_pipeline_tuning_options(_LEVEL)
    options.loop_vectorization = options.slp_vectorization = False
    options.loop_unrolling = program.flat
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return module


def _linked(program: Whole) -> llvm.ModuleRef:
    """One module of all parts, of which only the entry can be seen."""
    # What suits vectors of this machine's processor does not bind a thread.
    texts = (text.replace(f" {_INLINE} ", " ") for text in program.parts)
    texts = (text.replace(f" {_APART} ", " ") if program.flat else text for text in texts)
    whole, *others = (llvm.parse_assembly(text) for text in texts)
    for module in others:
        whole.link_in(module)
    for variable in whole.global_variables:
        variable.linkage = llvm.Linkage.internal
    for function in whole.functions:
        if function.is_declaration or function.name == program.entry:
            continue
        function.linkage = llvm.Linkage.internal
        if _NUMBER.sub("", function.name) in program.apart:  # of two of a name LLVM numbers one
            function.add_function_attribute(_APART)
        elif program.flat or function.name in program.inlined:
            function.add_function_attribute(_INLINE)
    return whole


@functools.lru_cache(maxsize=4)
def _device_machine(arch: str) -> llvm.TargetMachine:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple(TRIPLE).create_target_machine(cpu=arch, opt=_LEVEL)
