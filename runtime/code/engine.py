"""Turn LLVM IR into machine code, and keep the object code on disk.

A kernel's key is the hash of its text and of all that decides what it compiles to, so a hit needs neither
parsing nor lowering.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import threading
from collections.abc import Callable
from pathlib import Path

import llvmlite.binding as llvm

from runtime.code import cache
from runtime.code.llvm_text import LIBM

OPTIMISATION_LEVEL = 2
_KEPT_OBJECTS = 4000
_LONG_COMPILE = 0.3  # seconds
_SECONDS_PER_OPERATION = 6e-5
# The files that decide what a function's machine code is.
_SOURCES = (
    "grammar", "expressions", "lower", "straight_line", "llvm_text",
    "dense_ldl", "front_ldl", "modules", "engine",
)  # fmt: skip

_lock = threading.RLock()
_listener: Callable[[str, int, float], None] | None = None


class MachineCode:
    """A place for machine code, freed with this object: whoever holds an address in it must hold it too."""

    def __init__(self) -> None:
        self._engine: llvm.ExecutionEngine | None = None
        self._symbols: set[str] = set()

    def add(self, object_code: bytes, symbol: str) -> int:
        """Load object code and return the address of `symbol` in it."""
        with _lock:
            initialise()
            if symbol in self._symbols:
                raise ValueError(f"{symbol!r} is already here")
            if self._engine is None:
                module = llvm.parse_assembly("")
                module.triple = llvm.get_process_triple()
                # The execution engine takes the target machine for itself.
                self._engine = llvm.create_mcjit_compiler(module, _new_target_machine())
            self._engine.add_object_file(llvm.ObjectFileRef.from_data(object_code))
            self._engine.finalize_object()
            address = self.address(symbol)
            self._symbols.add(symbol)
            return address

    def address(self, symbol: str) -> int:
        """Return the address of a function of the code added so far."""
        with _lock:
            address = self._engine.get_function_address(symbol) if self._engine else 0
        if not address:
            raise RuntimeError(f"the object code has no symbol {symbol!r}")
        return address

    def data_address(self, name: str) -> int:
        """Return the address of a global variable of the code added so far."""
        with _lock:
            address = self._engine.get_global_value_address(name) if self._engine else 0
        if not address:
            raise RuntimeError(f"the object code has no variable {name!r}")
        return address


def set_compile_listener(listener: Callable[[str, int, float], None] | None) -> None:
    """Let `listener(name, operations, seconds)` be called before a compilation that may take long."""
    global _listener
    _listener = listener


def announce(name: str, operations: int, seconds: float) -> None:
    """Tell the listener that `name` is about to be compiled, if that is expected to take long."""
    if _listener is not None and seconds > _LONG_COMPILE:
        _listener(name, operations, seconds)


def cache_key(text: str) -> str:
    """Return a kernel's key: the hash of `text`, on which its lowering depends, and of the tools."""
    return hashlib.sha256(f"{tools()}\0{text}".encode()).hexdigest()


def object_code(
    key: str, name: str, symbol: str, lower: Callable[[str], tuple[str, int]], folder: Path | None = None
) -> bytes:
    """Return the object code for `key`, from the cache on disk, or compiled now and put there.

    Parameters
    ----------
    key : str
        From `cache_key`.
    name : str
        The kernel's name, for the listener.
    symbol : str
        The function's name in the object code.
    lower : callable
        `lower(symbol)` returns the LLVM IR of a module that defines `symbol`, and its number of operations.
        It is called only when nothing is cached.
    folder : Path, optional
        The cache, instead of the user's.
    """
    folder = folder or cache.cache_folder("kernels")
    path = folder / f"{key}.o"
    code = cache.fetch(path)
    if code is None:
        ir, operations = lower(symbol)
        announce(name, operations, operations * _SECONDS_PER_OPERATION)
        code = compile_ir(ir)
        if cache.store(path, code):
            cache.prune(folder, _KEPT_OBJECTS, "*.o")
    return code


def compile_ir(ir: str) -> bytes:
    """Compile the text of an LLVM module to object code for this machine. No fast-math, no contraction."""
    with _lock:
        initialise()
        module = llvm.parse_assembly(ir)
        module.triple = llvm.get_process_triple()
        module.verify()
        machine = _target_machine()
        module.data_layout = str(machine.target_data)
        builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(OPTIMISATION_LEVEL))
        passes = llvm.create_new_function_pass_manager()
        # On straight-line code these two give what the whole -O2 pipeline gives, in a fifth of its time.
        passes.add_instruction_combine_pass()
        passes.add_new_gvn_pass()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)
        return machine.emit_object(module)


def optimise(module: llvm.ModuleRef, speed_level: int) -> None:
    """Run LLVM's whole pipeline on a module of loops: inlining, hoisting, vectorising. No fast-math."""
    with _lock:
        options = llvm.create_pipeline_tuning_options(speed_level)
        options.loop_vectorization = options.slp_vectorization = True
        builder = llvm.create_pass_builder(_target_machine(), options)
        builder.getModulePassManager().run(module, builder)


def emit(module: llvm.ModuleRef) -> bytes:
    """Return a module's object code for this machine."""
    with _lock:
        initialise()
        return _target_machine().emit_object(module)


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
    missing = [name for name in LIBM if not llvm.address_of_symbol(name)]
    if missing:
        library = ctypes.CDLL("ucrtbase") if hasattr(ctypes, "windll") else ctypes.CDLL(None)
        for name in missing:
            llvm.add_symbol(name, ctypes.cast(getattr(library, name), ctypes.c_void_p).value)


@functools.lru_cache(maxsize=1)
def _host() -> tuple[str, str]:
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


@functools.lru_cache(maxsize=1)
def _target_machine():
    return _new_target_machine()


def _new_target_machine():
    cpu, features = _host()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    # As Numba does: on x86 MCJIT needs static relocation.
    relocation = "static" if target.name.startswith("x86") else "default"
    return target.create_target_machine(
        cpu=cpu, features=features, opt=OPTIMISATION_LEVEL, reloc=relocation, codemodel="jitdefault", jit=True
    )


@functools.lru_cache(maxsize=1)
def tools() -> str:
    """Return what decides how code is compiled here: our lowering, LLVM, the processor."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for name in _SOURCES:
        digest.update((folder / f"{name}.py").read_bytes())
    return repr((digest.hexdigest(), *machine()))


def machine() -> tuple:
    """Return what decides how LLVM IR is compiled here: LLVM, the processor."""
    return (llvm.llvm_version_info, llvm.get_process_triple(), *_host(), OPTIMISATION_LEVEL)
