"""LLVM itself: from its IR to object code, what processor it compiles for, and its own loader of object code."""

from __future__ import annotations

import ctypes
import functools
import threading
from typing import TYPE_CHECKING

import llvmlite.binding as llvm

from symgen.runtime.code.llvm_text import LIBRARY

if TYPE_CHECKING:
    from symgen.runtime.code.stand_ins import Quality

OPTIMISATION_LEVEL = 2
_SPEED_LEVEL = 2  # of step loops
lock = threading.RLock()


def compile_draft(ir: str) -> bytes:
    """Compile the text of an LLVM module in a tenth of the time of `compile_ir`, to code that gives the same bits.

    On straight-line code calls take 1.05 to 1.3 times as long, where there are loops up to twice as long.
    """
    with lock:
        initialise()
        module = llvm.parse_assembly(ir)
        module.triple = llvm.get_process_triple()
        module.verify()
        machine = target_machine(is_draft=True)
        module.data_layout = str(machine.target_data)
        if "alwaysinline" in ir:
            _inline(module, machine)
        return machine.emit_object(module)


def compile_ir(ir: str) -> bytes:
    """Compile the text of an LLVM module to object code for this machine. No fast-math, no contraction."""
    with lock:
        initialise()
        module = llvm.parse_assembly(ir)
        module.triple = llvm.get_process_triple()
        module.verify()
        machine = target_machine()
        module.data_layout = str(machine.target_data)
        builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(OPTIMISATION_LEVEL))
        passes = llvm.create_new_function_pass_manager()
        if "alwaysinline" in ir:
            _inline(module, machine)
        # On straight-line code these two give what the whole -O2 pipeline gives, in a fifth of its time.
        passes.add_instruction_combine_pass()
        passes.add_new_gvn_pass()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)
        return machine.emit_object(module)


def _inline(module: llvm.ModuleRef, machine: llvm.TargetMachine) -> None:
    """Put functions that say so in the places where they are called."""
    inlining = llvm.create_new_module_pass_manager()
    inlining.add_always_inliner_pass()
    options = llvm.create_pipeline_tuning_options(OPTIMISATION_LEVEL)
    inlining.run(module, llvm.create_pass_builder(machine, options))


def compile_loops(ir: str) -> bytes:
    """Compile the text of a module of loops, whose variables are in memory; no vectors but its own.

    LLVM's whole pipeline takes four times as long, as it unrolls loops over vectors, and makes twice the code, which
    runs no faster.
    """
    with lock:
        initialise()
        module = llvm.parse_assembly(ir)
        module.triple = llvm.get_process_triple()
        module.verify()
        machine = target_machine()
        module.data_layout = str(machine.target_data)
        builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(_SPEED_LEVEL))
        passes = llvm.create_new_module_pass_manager()
        passes.add_sroa_pass()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        passes.add_loop_simplify_pass()
        passes.add_loop_rotate_pass()
        passes.add_new_gvn_pass()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        passes.run(module, builder)
        return machine.emit_object(module)


def neutral_bitcode(module: llvm.ModuleRef) -> bytes:
    """Run LLVM's pipeline on a module of loops (inlining, hoisting), for no machine in particular; return its bitcode.

    No fast-math and no vectors: those are of a machine. Names of values are dropped, so that the same
    functions give the same bytes.
    """
    with lock:
        machine = llvm.Target.from_triple(module.triple).create_target_machine(opt=_SPEED_LEVEL)
        options = llvm.create_pipeline_tuning_options(_SPEED_LEVEL)
        options.loop_vectorization = options.slp_vectorization = False
        builder = llvm.create_pass_builder(machine, options)
        builder.getModulePassManager().run(module, builder)
        passes = llvm.create_new_module_pass_manager()
        passes.add_strip_symbols_pass()
        passes.run(module, builder)
        module.triple = module.data_layout = ""
        return module.as_bitcode()


def drop_unused_arguments(module: llvm.ModuleRef) -> None:
    """Take off arguments, parts of records, that internal functions do not read: LLVM's pipeline looks too early."""
    with lock:
        passes = llvm.create_new_module_pass_manager()
        passes.add_sroa_pass()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        passes.add_dead_arg_elimination_pass()
        passes.run(module, llvm.create_pass_builder(target_machine(), llvm.create_pipeline_tuning_options(2)))


def emit(bitcode: bytes, quality: Quality) -> bytes:
    """Return the object code of `neutral_bitcode` for this machine.

    A draft is made in a sixth of the time of scalar code, and takes 1 to 2 times as long a call. Vector code pays for
    large models, costs small ones a quarter of their time, and takes longer to make. All results are the same to the
    bit.
    """
    with lock:
        initialise()
        machine = target_machine(is_draft=quality == "draft")
        module = llvm.parse_bitcode(bitcode)
        module.triple = llvm.get_process_triple()
        module.data_layout = str(machine.target_data)
        if quality == "vector":
            options = llvm.create_pipeline_tuning_options(_SPEED_LEVEL)
            options.loop_vectorization = options.slp_vectorization = True
            # Copies of bodies take LLVM half as long again, and gain nothing.
            options.loop_interleaving = options.loop_unrolling = False
            builder = llvm.create_pass_builder(machine, options)
            builder.getModulePassManager().run(module, builder)
        return machine.emit_object(module)


class Engine:
    """LLVM's own place for object code, freed with this object."""

    def __init__(self) -> None:
        with lock:
            initialise()
            module = llvm.parse_assembly("")
            module.triple = llvm.get_process_triple()
            # The execution engine takes the target machine for itself.
            self._engine = llvm.create_mcjit_compiler(module, _new_target_machine())

    def add(self, object_code: bytes, symbols: dict[str, int]) -> None:
        """Load object code; `symbols` are addresses of what neither the process nor the code defines."""
        with lock:
            for name, address in symbols.items():
                if not llvm.address_of_symbol(name):
                    llvm.add_symbol(name, address)
            self._engine.add_object_file(llvm.ObjectFileRef.from_data(object_code))
            self._engine.finalize_object()

    def address(self, symbol: str) -> int:
        """Return the address of a function or variable of the code added so far, 0 if there is none."""
        with lock:
            return self._engine.get_function_address(symbol) or self._engine.get_global_value_address(symbol)


@functools.lru_cache(maxsize=1)
def initialise() -> None:
    """Make LLVM ready for this machine."""
    try:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    except RuntimeError:
        # llvmlite 0.45 and later have LLVM initialised and refuse.
        pass
    _provide_libm()


def _provide_libm() -> None:
    """Tell LLVM where libm's functions are, if the process does not export them."""
    missing = [name for name in LIBRARY if not llvm.address_of_symbol(name)]
    if missing:
        library = ctypes.CDLL("ucrtbase") if hasattr(ctypes, "windll") else ctypes.CDLL(None)
        for name in missing:
            llvm.add_symbol(name, ctypes.cast(getattr(library, name), ctypes.c_void_p).value)


def target() -> tuple:
    """Return what decides how LLVM compiles here: its version, the platform, the processor."""
    return (llvm.llvm_version_info, llvm.get_process_triple(), *_host())


@functools.lru_cache(maxsize=1)
def _host() -> tuple[str, str]:
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


@functools.lru_cache(maxsize=2)
def target_machine(*, is_draft: bool = False):
    return _new_target_machine(0 if is_draft else OPTIMISATION_LEVEL)


def _new_target_machine(level: int = OPTIMISATION_LEVEL):
    cpu, features = _host()
    found = llvm.Target.from_triple(llvm.get_process_triple())
    # As Numba does: on x86 MCJIT needs static relocation.
    relocation = "static" if found.name.startswith("x86") else "default"
    return found.create_target_machine(
        cpu=cpu, features=features, opt=level, reloc=relocation, codemodel="jitdefault", jit=True
    )
