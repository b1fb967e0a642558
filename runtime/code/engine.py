"""Object code of kernels: from the cache on disk or compiled now, and in memory, ready to be called.

A kernel's key is the hash of its text and of all that decides what it compiles to, so a hit needs neither parsing nor
lowering, and on x86-64 Linux not even LLVM.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from symgen.runtime.code import cache, elf
from symgen.runtime.code.host import target
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.code.compiler import Engine

compiler = Late("symgen.runtime.code.compiler")
sines = Late("symgen.runtime.code.sincos")

_KEPT_OBJECTS = 4000
_LONG_COMPILE = 0.3  # seconds
_OWN = "symgen.sincos"  # begins the names of functions that all code of a process calls
FAST = "fast"
LOOPS = "loops"
DRAFT = "draft"
# How code of a kind is compiled: the function of `compiler`, and roughly its time for an operation [s].
_COMPILERS = {FAST: ("compile_ir", 6e-5), LOOPS: ("compile_loops", 6e-5), DRAFT: ("compile_draft", 6e-6)}
# The files that decide what a function's machine code is; a test holds the list against their imports.
_SOURCES = (
    "parse", "function_text", "lower", "llvm_text", "printing",
    "dense_ldl", "front_ldl", "modules", "compiler", "sincos", "angles", "reciprocal_root",
    "../graph/form", "../graph/functions", "../graph/layouts", "../graph/nodes",
)  # fmt: skip

_lock = threading.RLock()
_noted: dict[str, Path] | None = None
_listener: Callable[[str, int, float], None] | None = None


class MachineCode:
    """A place for machine code, freed with this object: whoever holds an address in it must hold it too.

    Parameters
    ----------
    outside : dict of str to int, optional
        Addresses of symbols that neither the code nor the process defines.
    """

    def __init__(self, outside: dict[str, int] | None = None) -> None:
        self._outside = dict(outside or {})
        self._images: list[elf.Image] = []
        self._engine: Engine | None = None
        self._symbols: dict[str, int] = {}

    def add(self, object_code: bytes, symbol: str) -> int:
        """Load object code and return the address of `symbol` in it."""
        with _lock:
            if symbol in self._symbols:
                raise ValueError(f"{symbol!r} is already here")
            try:
                self._add_image(object_code)
            except elf.UnsupportedError:
                self._add_by_llvm(object_code)
            self._symbols[symbol] = self.address(symbol)
            return self._symbols[symbol]

    def _add_image(self, object_code: bytes) -> None:
        if sys.platform != "linux" or self._engine is not None:
            raise elf.UnsupportedError("LLVM loads it")
        image = elf.Image(object_code, self._address_outside)
        self._images.append(image)
        self._symbols = {**image.addresses, **self._symbols}

    def _add_by_llvm(self, object_code: bytes) -> None:
        if self._engine is None:
            self._engine = compiler.Engine()
        shared = {name: process_symbol(name) for name in sines.SHARED_SINCOS if name.encode() in object_code}
        self._engine.add(object_code, {**self._symbols, **self._outside, **shared})

    def _address_outside(self, name: str) -> int:
        return self._symbols.get(name) or self._outside.get(name) or process_symbol(name)

    def address(self, symbol: str) -> int:
        """Return the address of a function or variable of the code added so far."""
        with _lock:
            address = self._symbols.get(symbol) or (self._engine.address(symbol) if self._engine else 0)
        if not address:
            raise RuntimeError(f"the object code has no symbol {symbol!r}")
        return address


@functools.lru_cache(maxsize=256)
def process_symbol(name: str) -> int:
    """Return the address of a function of the C libraries in this process, or of ours for all, 0 if there is none."""
    if name.startswith(_OWN):
        return _own_symbol(name)
    try:
        return ctypes.cast(getattr(_c_library(), name), ctypes.c_void_p).value or 0
    except AttributeError:
        return 0


_own_code: dict[str, MachineCode] = {}


def _own_symbol(name: str) -> int:
    with _lock:
        if name not in _own_code:
            code = MachineCode()
            content = object_code(cache_key(name), "sines", name, lambda _: (sines.shared_sincos(name), 0))
            code.add(content, name)
            _own_code[name] = code
        return _own_code[name].address(name)


@functools.lru_cache(maxsize=1)
def _c_library() -> ctypes.CDLL:
    return ctypes.CDLL("ucrtbase") if hasattr(ctypes, "windll") else ctypes.CDLL(None)


def set_compile_listener(listener: Callable[[str, int, float], None] | None) -> None:
    """Let `listener(name, operations, seconds)` be called before a compilation that may take long."""
    global _listener
    _listener = listener


@contextlib.contextmanager
def noted() -> Iterator[dict[str, Path]]:
    """Note which object code is asked for: its keys, and the folders where it is kept."""
    global _noted
    with _lock:
        before, _noted = _noted, {}
        found = _noted
    try:
        yield found
    finally:
        _noted = before


def announce(name: str, operations: int, seconds: float) -> None:
    """Tell the listener that `name` is about to be compiled, if that is expected to take long."""
    if _listener is not None and seconds > _LONG_COMPILE:
        _listener(name, operations, seconds)


def cache_key(text: str) -> str:
    """Return a kernel's key: the hash of `text`, on which its lowering depends, and of the tools."""
    return hashlib.sha256(f"{tools()}\0{text}".encode()).hexdigest()


def object_code(
    key: str,
    name: str,
    symbol: str,
    lower: Callable[[str], tuple[str, int]],
    folder: Path | None = None,
    *,
    kind: str = FAST,
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
    kind : {"fast", "loops", "draft"}
        Which function of `compiler` makes it.
    """
    folder = folder or cache.cache_folder("kernels")
    path = folder / f"{key}.o"
    code = cache.fetch(path)
    if _noted is not None:
        _noted[key] = folder
    if code is None:
        ir, operations = lower(symbol)
        function, seconds = _COMPILERS[kind]
        announce(name, operations, operations * seconds)
        code = getattr(compiler, function)(ir)
        if cache.store(path, code):
            cache.prune(folder, _KEPT_OBJECTS, "*.o")
    return code


def is_kept(key: str) -> bool:
    """Whether the cache on disk has object code for `key`."""
    return (cache.cache_folder("kernels") / f"{key}.o").exists()


@functools.lru_cache(maxsize=1)
def tools() -> str:
    """Return what decides how code is compiled here: our lowering, LLVM, the processor."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for name in _SOURCES:
        digest.update((folder / f"{name}.py").read_bytes())
    return repr((digest.hexdigest(), target()))
