"""One function of a model as machine code that Python can call."""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any, Protocol

import numpy as np

from symgen.runtime.code import stand_ins
from symgen.runtime.code.bridge import address_of, evaluate_rows
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.llvm_text import PRECOMPUTED
from symgen.runtime.errors import ModuleError
from symgen.runtime.lazy import Late
from symgen.runtime.module_source import ModuleSource
from symgen.runtime.record import record

drafts = Late("symgen.runtime.code.drafts")
engine = Late("symgen.runtime.code.engine")
modules = Late("symgen.runtime.code.modules")

_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
_FLOAT = np.dtype(np.float64)


class SlowCompileWarning(UserWarning):
    """The fast back end failed; Numba compiles the function instead, many times slower."""


class Owner(Protocol):
    """What a kernel asks of the model that it belongs to."""

    name: str
    operations: Mapping[str, int]
    source: ModuleSource

    def machine_code(self) -> Any:
        """Return the place of the model's machine code."""

    def describe_y(self, function: str) -> str:
        """Say what `function` reads as `y`."""

    def describe_p(self) -> str:
        """Say what `p` holds."""


@record
class KernelSource:
    """A function of a model, and where its hoisted values stand in a precomputed `p`."""

    code: FunctionText
    n_hoisted: int
    offset: int
    system: Owner

    @property
    def name(self) -> str:
        """The function's name."""
        return self.code.name

    @property
    def lengths(self) -> Lengths:
        """How many values the function reads and writes."""
        return self.code.lengths

    def lower(self, symbol: str) -> tuple[str, int]:
        """Return the function as LLVM IR that defines `symbol`, and the number of its operations."""
        lowered = modules.lower_function(self.code, symbol)
        return lowered.ir, lowered.operations

    def lower_standalone(self, symbol: str) -> tuple[str, int]:
        """Return LLVM IR that defines `symbol` and, where work is hoisted, `symbol_precomputed` as well."""
        if not self.n_hoisted:
            return self.lower(symbol)
        lowered = modules.lower_kernel(self.code, symbol, self.n_hoisted, self.offset)
        return lowered.ir, lowered.operations

    def python_function(self) -> Callable:
        """Return the function as plain Python, after the grammar's check."""
        self.lower("checked")
        return self.code.python_function()

    def njit_function(self) -> Callable:
        """Return the same compiled by Numba."""
        from numba import njit

        self.lower("checked")
        return self.code.python_function(njit(error_model="numpy"))

    def key_text(self) -> str:
        """Return all that the IR depends on."""
        code, source = self.code, self.system.source
        own = code.tables == source.tables
        tables = source.tables_hash if own else repr(sorted(code.tables.items()))
        return f"{code.lengths}\0{tables}\0{self.n_hoisted} {self.offset}\0{code.text}"


@record(eq=False)
class Kernel:
    """A compiled function `f(t, y, p, out)` of a model.

    Attributes
    ----------
    name : str
    precomputed_address : int
        As `address`, for a `p` that `System.precomputed` has made: without the work that depends on parameters only.
    out_size : int
        The number of values that it may write. Structural zeros are not written.
    """

    name: str
    _address: int
    precomputed_address: int
    source: KernelSource = field(repr=False)
    _owner: Any = field(repr=False)
    _draft: drafts.Draft | None = field(default=None, repr=False)

    def __post_init__(self):
        lengths = self.source.lengths
        vars(self).update(
            _lengths=lengths, _shapes=((lengths.y,), (lengths.p,)), _call=_PROTOTYPE(self._address)
        )

    @property
    def address(self) -> int:
        """Of the machine code, for `symgen.runtime.code.bridge.call_kernel`, valid as long as this kernel lives."""
        self.settle()
        return self._address

    def settle(self) -> None:
        """Make the best code now if a draft stands in for it: for who must not wait for LLVM later."""
        if self._draft is not None:
            self._draft.go_over()
            self._leave_draft()

    def _leave_draft(self) -> None:
        """Take the better code, if it is there; the draft lives on, as its addresses may be known."""
        draft = self._draft
        if draft is not None and (better := draft.better()):
            vars(self).update(
                _address=better[0], precomputed_address=better[-1], _call=_PROTOTYPE(better[0]), _draft=None,
                _owner=(self._owner, draft),
            )  # fmt: skip

    @property
    def out_size(self) -> int:
        """The number of values that the function writes."""
        return self._lengths.out

    @property
    def operations(self) -> int:
        """The number of operations, as the generator counted them, else as lowering does."""
        counted = self.source.system.operations.get(self.name)
        return self.source.lower("counted")[1] if counted is None else counted

    def __call__(self, t: float, y: Any, p: Any, out: np.ndarray | None = None) -> np.ndarray:
        """Evaluate the function.

        Parameters
        ----------
        t : float [s]
        y, p : array_like of float
            `system.describe_y(name)` says what is in y; p is parameters, then inputs.
        out : ndarray of float64, shape (out_size,), C-contiguous, optional
            Written in place, but for structural zeros. A new array of zeros by default.
        """
        of_y, of_p = self._shapes
        if not _fits(y, of_y):
            y = self._checked("y", y, of_y[0])
        if not _fits(p, of_p):
            p = self._checked("p", p, of_p[0])
        if out is None:
            out = np.zeros(self._lengths.out)
        else:
            self._check_out(out)
        if self._draft is None:
            self._call(float(t), address_of(y), address_of(p), address_of(out))
        else:
            with stand_ins.counted():
                self._call(float(t), address_of(y), address_of(p), address_of(out))
            self._leave_draft()
        return out

    def rows(self, times: np.ndarray, states: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Evaluate the function at several states, to the same bits.

        Parameters
        ----------
        times : ndarray, shape (n,) [s]
        states : ndarray, shape (n, at least what it reads)
        p : ndarray
            Parameters, then inputs: of all states, or shape (n, n_p), of each.

        Returns
        -------
        ndarray, shape (n, out_size)
        """
        out = np.zeros((len(times), self.out_size))
        evaluate_rows(self._address, times, states, p, out)
        return out

    def _checked(self, name: str, values: Any, length: int) -> np.ndarray:
        """Return `values` as a contiguous float64 array of `length`, or say what was expected."""
        model = self.source.system.name
        try:
            array = np.ascontiguousarray(values)
            casting = "same_kind" if array.dtype.kind == "f" else "safe"
            array = array.astype(np.float64, casting=casting, copy=False)
        except (TypeError, ValueError):
            raise TypeError(
                f"{name} cannot be read as float64 numbers, which {self.name} of model {model!r} needs"
            ) from None
        if np.shape(values) != (length,):
            system = self.source.system
            holds = system.describe_y(self.name) if name == "y" else system.describe_p()
            what = f"{length} value{'s' * (length != 1)}" + (f": {holds}" if holds else "")
            raise ValueError(
                f"{name} has shape {np.shape(values)}, but {self.name} of model {model!r} reads {what}"
            )
        return array

    def _check_out(self, out: Any) -> None:
        kind = f"{out.dtype} of shape {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        fits = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.shape == (self.out_size,)
        if not fits:
            raise TypeError(
                f"out of {self.name} must be a float64 array of shape ({self.out_size},), not {kind}"
            )
        if not (out.flags.c_contiguous and out.flags.writeable):
            raise TypeError(
                f"out of {self.name} must be contiguous and writeable: use np.zeros({self.out_size})"
            )


def _fits(values: Any, shape: tuple[int]) -> bool:
    """Whether code can read `values` where they are."""
    return (
        type(values) is np.ndarray
        and values.dtype is _FLOAT
        and values.shape == shape
        and values.flags.c_contiguous
    )


def compile_kernel(source: KernelSource) -> Kernel:
    """Compile a function, or take it from the cache."""
    try:
        owner, symbol = source.system.machine_code(), f"symgen_{source.name}"
        key = engine.cache_key(f"{symbol}\0{source.key_text()}")
        seconds = drafts.seconds_of(source.code.text)
        if drafts.is_wanted(key, seconds):
            symbols = (symbol, symbol + PRECOMPUTED) if source.n_hoisted else (symbol,)
            draft = drafts.Draft(key, source.name, symbols, source.lower_standalone, seconds, owner)
            return Kernel(source.name, draft.addresses[0], draft.addresses[-1], source, owner, draft)
        address = owner.add(engine.object_code(key, source.name, symbol, source.lower_standalone), symbol)
        precomputed = owner.address(symbol + PRECOMPUTED) if source.n_hoisted else address
    except ModuleError:
        raise
    except Exception as error:
        warnings.warn(
            f"LLVM did not compile {source.name} of model {source.system.name!r} "
            f"({type(error).__name__}: {error}); "
            "Numba compiles it instead, which takes much longer. Does symgen know this llvmlite?",
            SlowCompileWarning,
            stacklevel=3,
        )
        owner = _compile_with_numba(source)
        address = precomputed = owner.address
    return Kernel(source.name, address, precomputed, source, owner)


@record(eq=False)
class Setup:
    """The compiled hoisted work of functions.

    Attributes
    ----------
    address : int
        Of code with the signature of a kernel: it reads `p`, and writes what is hoisted to `out`.
    """

    address: int
    _owner: Any = field(repr=False)
    _call: Any = field(repr=False)

    def __call__(self, p: np.ndarray, n: int) -> None:
        """Read parameters and inputs from `p[:n]`, and write the functions' hoisted values behind them."""
        first = address_of(p)
        self._call(0.0, None, first, first + n * p.itemsize)


def compile_setup(sources: Sequence[KernelSource]) -> Setup:
    """Compile the hoisted work of functions, or take it from the cache."""
    parts = [(source.code, source.n_hoisted) for source in sources]

    def lower(symbol: str) -> tuple[str, int]:
        lowered = modules.lower_setup(parts, symbol)
        return lowered.ir, lowered.operations

    owner, symbol = sources[0].system.machine_code(), "symgen_setup"
    key = engine.cache_key("\0".join((symbol, *(source.key_text() for source in sources))))
    address = owner.add(engine.object_code(key, "setup", symbol, lower), symbol)
    return Setup(address, owner, _PROTOTYPE(address))


def _compile_with_numba(source: KernelSource) -> Any:
    import numba
    from numba import types

    array = types.CPointer(types.float64)
    signature = types.void(types.float64, array, array, array)
    return numba.cfunc(signature, error_model="numpy")(source.njit_function().py_func)
