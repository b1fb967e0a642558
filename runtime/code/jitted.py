"""Jitted functions that run without Numba once they are compiled: the `jitted` decorator.

Importing Numba and loading its own cached functions takes most of a second. So a function comes as bitcode with the
package (`shipped.py`) or, where that is not of these sources, from Numba; machine code is made of it once per machine
and kept, and later processes call it straight (`native.py`).
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import os
import platform
import threading
import types
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

from symgen.runtime.code import cache, engine, native, stand_ins
from symgen.runtime.code.host import package_version, target
from symgen.runtime.code.stand_ins import Quality
from symgen.runtime.lazy import Late

shipped = Late("symgen.runtime.code.shipped")
compiler = Late("symgen.runtime.code.compiler")
numba_side = Late("symgen.runtime.code.compile_jitted")

DISABLE_JIT = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
_KEPT = 400
_SECONDS_PER_FUNCTION = 0.3  # roughly, to compile; for what the listener is told
_FEW_STATES = 16
_LONG = 5_000  # bytes of bitcode, whose machine code takes 0.05 s and more to make
_SECONDS_PER_BYTE = {
    "scalar": 9e-6,
    "vector": 4e-5,
}  # roughly, of bitcode, to make machine code of each quality
# What `tests/ship_loops.py` sets: whether bitcode of the package is taken, and who is told of what Numba makes
# (function, layout, bitcode).
with_shipped = True
watcher: Callable[[Jitted, str, bytes], None] | None = None
_lock = threading.RLock()  # compiling changes settings of Numba for a while

Variant = tuple[str, bool]  # types of arguments, and whether they ask for vector code


class Follower(Protocol):
    """Who holds the address of code for as long as there is no better."""

    def take(self, code: native.NativeFunction) -> None:
        """Call this code from now on."""


class Jitted:
    """A function of numbers, contiguous arrays and named tuples of these, compiled for the types it is called with.

    It allocates nothing: array views are not reference-counted (counting costs more than the arithmetic of a small
    model), and whatever would allocate is an error when it is compiled. Other such functions may be called from it,
    those among them that it gets as arguments or in a named tuple of constants: it is compiled anew for each of these.

    Attributes
    ----------
    py_func : callable
        The function as it was written.
    title : str
        What is said to be compiled.
    distinct_arrays : bool
        Whether no array that it writes overlaps another of its arguments.
    """

    def __init__(self, function: Callable, *, distinct_arrays: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.distinct_arrays = distinct_arrays
        self.title = f"the step loop {function.__name__} (once per machine)"
        self._loaded: dict[Variant, native.NativeFunction] = {}
        self._stand_ins: dict[Variant, LoopStandIn] = {}

    def __call__(self, *args: Any) -> Any:
        code = self._code(args)
        if not self._stand_ins:
            return code(*args)
        with stand_ins.counted():
            return code(*args)

    def bind(self, *args: Any) -> Callable[[], Any]:
        """Return the call with these arguments; arrays are read and written where they are now."""
        return self._code(args).bind(*args)

    def compiled(self, *args: Any) -> native.NativeFunction:
        """Return the best code for arguments of these types, for callers that are machine code themselves."""
        return self._code(args, at_once=True)

    def variant(self, args: tuple) -> Variant:
        """Return what code for such arguments is of."""
        return _variant(args)

    def follow(self, block: Follower, args: tuple, variant: Variant) -> native.NativeFunction:
        """Return code for arguments of a `variant`; `block` is told when there is better."""
        self._code(args, variant)
        with _lock:
            if variant in self._stand_ins:
                self._stand_ins[variant].followers.add(block)
            return self._loaded[variant]

    def _code(
        self, args: tuple, variant: Variant | None = None, *, at_once: bool = False
    ) -> native.NativeFunction:
        variant, at_once = variant or _variant(args), at_once or stand_ins.at_once
        code = self._loaded.get(variant)
        if code is None or (at_once and variant in self._stand_ins):
            with _lock:
                if variant not in self._loaded:
                    self._loaded[variant] = self._first_code(args, variant, at_once=at_once)
                while at_once and variant in self._stand_ins:
                    self._stand_ins[variant].take_next()
                code = self._loaded[variant]
        return code

    def _first_code(self, args: tuple, variant: Variant, *, at_once: bool) -> native.NativeFunction:
        """Return the best code that there is, and let better code follow where that takes a while to make."""
        layout, kinds = native.layout(args), native.argument_types(args)
        best_first: list[Quality] = ["vector", "scalar"] if variant[1] else ["scalar"]
        if at_once or not self._takes_long(layout, best_first[0]):
            return self.load(layout, kinds, best_first[0], args)
        better = list(itertools.takewhile(lambda quality: not self._is_kept(layout, quality), best_first))
        first = best_first[len(better)] if len(better) < len(best_first) else "draft"
        code = self.load(layout, kinds, first, args)
        seconds = [(quality, code.size * _SECONDS_PER_BYTE[quality]) for quality in better]
        self._stand_ins[variant] = LoopStandIn(self, variant, (layout, kinds), seconds)
        return code

    def _takes_long(self, layout: str, quality: Quality) -> bool:
        """Whether machine code of a quality is still to be made, of so much that it takes a while."""
        if self._is_kept(layout, quality):
            return False
        if self._is_kept(layout, "draft"):  # finding what was shipped takes longer than many runs
            return True
        found = self._shipped(layout)  # what Numba compiles takes so long that LLVM's part does not matter
        return found is not None and len(found) > _LONG

    def take(self, variant: Variant, code: native.NativeFunction, *, is_last: bool) -> None:
        """Let calls with such arguments take this code from now on."""
        self._loaded[variant] = code
        if is_last:
            self._stand_ins.pop(variant, None)

    def load(
        self, layout: str, kinds: list, quality: Quality, args: tuple | None = None
    ) -> native.NativeFunction:
        """Return the code of one quality for arguments of a layout; `args` are some, if they may have to be typed."""

        def machine_code() -> bytes:
            found = self._shipped(layout)
            if found is not None:
                try:
                    return _emit(found, quality)
                except RuntimeError:  # an LLVM that cannot read what another version wrote
                    if args is None and not self._kept_at("bitcode", (layout,)).exists():
                        raise
            made = self._kept("bitcode", (layout,), lambda: self._compile(args))
            if watcher is not None:
                watcher(self, layout, made)
            return _emit(made, quality)

        content = self._kept("loops", _fits(layout, quality), machine_code)
        return native.NativeFunction(self.py_func.__name__, content, kinds)

    def _is_kept(self, layout: str, quality: Quality) -> bool:
        return self._kept_at("loops", _fits(layout, quality)).exists()

    def _shipped(self, layout: str) -> bytes | None:
        """Return the bitcode that came with the package, if it is of these sources and settings."""
        return shipped.find(self, layout) if with_shipped and not any(_numba_settings()) else None

    def _compile(self, args: tuple) -> bytes:
        # Helpers of a few lines are not worth a word.
        seconds = _SECONDS_PER_FUNCTION * max(0, len(self.called()) - 4)
        engine.announce(self.title, 0, seconds)
        return numba_side.compile_jitted(self, args)

    def _kept(self, kind: str, fits: tuple[str, ...], make: Callable[[], bytes]) -> bytes:
        """Return what the cache folder `kind` holds of this function for what it `fits`, made now if it is missing."""
        path = self._kept_at(kind, fits)
        content = cache.fetch(path)
        if content is None:
            content = make()
            if cache.store(path, content):
                cache.prune(path.parent, _KEPT)
        return content

    def _kept_at(self, kind: str, fits: tuple[str, ...]) -> Path:
        key = hashlib.sha256("\0".join((self.fingerprint, *fits)).encode()).hexdigest()[:40]
        return cache.cache_folder(kind) / f"{self.py_func.__name__}-{key}"

    def called(self) -> list[Jitted]:
        """This function and all that it calls, directly or not, in a fixed order."""
        found = [self]
        for function in found:  # grows while it is walked
            names = (name for code in _code_objects(function.py_func.__code__) for name in code.co_names)
            values = (function.py_func.__globals__.get(name) for name in names)
            members = (v for value in values for v in (value if isinstance(value, tuple) else (value,)))
            found += dict.fromkeys(v for v in members if isinstance(v, Jitted) and v not in found)
        return found

    def constants(self) -> Iterator[tuple[str, Any]]:
        """Yield the constants that its code names, with their values."""
        for code in _code_objects(self.py_func.__code__):
            yield from _constants(code, self.py_func.__globals__)

    @functools.cached_property
    def fingerprint(self) -> str:
        """Hash of all that the machine code depends on: the code and constants of every function in it."""
        digest = hashlib.sha256(_compiler().encode())
        for called in self.called():
            function = called.py_func
            digest.update(
                f"{function.__module__}.{function.__qualname__}\0{called.distinct_arrays}\0".encode()
            )
            for code in _code_objects(function.__code__):
                constants = [c for c in code.co_consts if not isinstance(c, types.CodeType)]
                digest.update(repr((code.co_code, constants, code.co_names, code.co_varnames)).encode())
            digest.update("".join(f"{name}={value!r}\0" for name, value in called.constants()).encode())
        return digest.hexdigest()


class LoopStandIn:
    """Code of one variant of a function that is called until better code has been made.

    Parameters
    ----------
    function : Jitted
    variant : tuple
    fits : tuple
        The layout of its arguments, and their types in C.
    better : list of (Quality, float)
        Qualities of code that it has not yet, the best first, with the seconds that they take to make.

    Attributes
    ----------
    followers : set of Follower
        Who is told of better code.
    """

    def __init__(
        self, function: Jitted, variant: Variant, fits: tuple[str, list], better: list[tuple[Quality, float]]
    ) -> None:
        self._function, self._variant, self._fits, self._better = function, variant, fits, better
        self.followers: weakref.WeakSet[Follower] = weakref.WeakSet()
        self._wait()

    def _wait(self) -> None:
        quality, self.seconds = self._better[-1]
        stand_ins.wait(self, stand_ins.OF_SCALARS if quality == "vector" else stand_ins.OF_DRAFTS)

    def go_over(self) -> None:
        """Make the next better code, and let it be called from now on."""
        with _lock:
            if self._better:
                self.take_next()

    def take_next(self) -> None:
        """The same, for who holds the lock."""
        code = self._function.load(*self._fits, self._better[-1][0])
        self._better.pop()
        self._function.take(self._variant, code, is_last=not self._better)
        for follower in list(self.followers):
            follower.take(code)
        if self._better:
            self._wait()


def jitted(function: Callable | None = None, *, distinct_arrays: bool = False) -> Any:
    """Compile `function` on its first call, once for all processes; see `Jitted`.

    With `distinct_arrays` the compiler may take it that no array which the function writes overlaps another of its
    arguments, and so make vector code of short loops without asking each time.

    Division by zero gives inf or nan as in NumPy, so that kernels can report it; the interpreter's lock is released.
    With `NUMBA_DISABLE_JIT=1` the function is returned as it is.
    """
    if function is None:
        return functools.partial(jitted, distinct_arrays=distinct_arrays)
    return function if DISABLE_JIT else Jitted(function, distinct_arrays=distinct_arrays)


def _constants(code: types.CodeType, known: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the constants that code names, in its own module or in one that it names (`at.NQ`)."""
    for name in code.co_names:
        value = known.get(name)
        if isinstance(value, (int, float, str, tuple)):
            yield name, _without_addresses(value)
        elif isinstance(value, types.ModuleType):
            of_module = {key: vars(value)[key] for key in code.co_names if key in vars(value)}
            yield from ((k, v) for k, v in of_module.items() if isinstance(v, (int, float, str, tuple)))


def _without_addresses(value: Any) -> Any:
    """A constant as the key may hold it: of functions in a tuple their names, since their code is in the key itself."""
    if not isinstance(value, tuple):
        return value
    return tuple(v.py_func.__qualname__ if isinstance(v, Jitted) else _without_addresses(v) for v in value)


def _code_objects(code: types.CodeType) -> list[types.CodeType]:
    """A function's code and that of the functions defined inside it."""
    found = [code]
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            found += _code_objects(constant)
    return found


def _emit(content: bytes, quality: Quality) -> bytes:
    head, bitcode = native.unpack(content)
    return native.pack(compiler.emit(bitcode, quality), **head)


def _fits(layout: str, quality: Quality) -> tuple[str, ...]:
    """Return what machine code is for."""
    return layout, quality, repr(target())


def _variant(args: tuple) -> Variant:
    """Return the types of arguments, and whether they ask for vector code."""
    return native.signature(args), _is_large(args)


def _is_large(args: tuple) -> bool:
    """Whether a loop runs over so many states that vector registers gain more than filling them costs."""
    return any(len(value.y) > _FEW_STATES for value in args if hasattr(value, "y"))


def _numba_settings() -> list[str]:
    """What the user has set that changes what Numba makes of a function."""
    return [os.environ.get(name, "") for name in ("NUMBA_BOUNDSCHECK", "NUMBA_OPT", "NUMBA_CPU_NAME")]


@functools.lru_cache(maxsize=1)
def _compiler() -> str:
    """What compiles: versions, settings, and our own sources that have a part in it."""
    folder = Path(__file__).parent
    own = [
        (folder / name).read_bytes()
        for name in ("compile_jitted.py", "native.py", "bridge_numba.py", "compiler.py")
    ]
    sources = hashlib.sha256(b"\0".join(own)).hexdigest()
    return repr(
        (
            package_version("numba"),
            package_version("llvmlite"),
            platform.python_version(),
            _numba_settings(),
            sources,
        )
    )
