"""The part of `symgen.runtime.code.jitted` that needs Numba: from Python functions to bitcode.

Numba would optimise, link and load every inner function by itself, and again inside each of its callers. Here it
only types and lowers; all functions of a step loop are linked once and optimised once.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Protocol

import llvmlite.binding as llvm
import numba
from numba.core import config, types
from numba.core.callconv import CPUCallConv
from numba.core.compiler import Compiler
from numba.core.typing.typeof import typeof_impl

from symgen.runtime.code import compiler, native
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.bridge_numba import teach

if TYPE_CHECKING:
    from numba.core.dispatcher import Dispatcher

_ENTRY = "entry"  # the name of what Python calls
_LARGEST_INLINED = 300  # lines of LLVM IR; inlining longer functions costs compile time, and run time
_dispatchers: dict[Jitted, Dispatcher] = {}
teach(call_kernel)


class Jitted(Protocol):
    """A `symgen.runtime.code.jitted.Jitted`, as far as its compilation looks at it."""

    py_func: Callable
    distinct_arrays: bool

    def called(self) -> list[Jitted]: ...

    def constants(self) -> Iterator[tuple[str, Any]]: ...


class _LoweringOnly(Compiler):
    """Numba's compiler without its last steps: linking, optimisation, machine code."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.state.flags.no_compile = True
        library = self.state.targetctx.codegen().create_library("symgen")

        def finalize() -> None:
            library._finalized = True

        library.finalize = finalize
        self.state.library = library


class _LoweringDistinctArrays(_LoweringOnly):
    """The same for functions whose array arguments do not overlap."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.state.flags.noalias = True


class _Token:
    """What Numba knows an overload by, instead of its address in memory."""


def _dispatcher(function: Jitted) -> Dispatcher:
    found = _dispatchers.get(function)
    if found is None:
        made = numba.njit(
            error_model="numpy",
            _nrt=False,
            no_cpython_wrapper=True,
            no_cfunc_wrapper=True,
            pipeline_class=_LoweringDistinctArrays if function.distinct_arrays else _LoweringOnly,
        )(function.py_func)

        def add_overload(result: Any) -> None:
            token = _Token()
            made.targetctx.insert_user_function(token, result.fndesc, [result.library])
            made.overloads[tuple(result.signature.args)] = result._replace(entry_point=token)

        made.add_overload = add_overload
        found = _dispatchers[function] = made
    return found


def _type_of_jitted(value: Jitted, context: Any) -> Any:
    """Let Numba see the dispatcher where jitted code names one of our functions."""
    return typeof_impl(_dispatcher(value), context)


def compile_jitted(function: Jitted, args: tuple) -> bytes:
    """Compile `function` for the types of `args`.

    Returns
    -------
    bytes
        From `native.pack`: bitcode that knows no machine.
    """
    typeof_impl.register(type(function), _type_of_jitted)
    kinds = tuple(numba.typeof(value) for value in args)
    dispatcher = _dispatcher(function)
    with _unoptimised():
        dispatcher.compile(kinds)
    result = dispatcher.overloads[kinds]
    module = _link(result.library, result.fndesc.llvm_func_name)
    bitcode = compiler.neutral_bitcode(module)
    needs = sorted(f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm."))
    return native.pack(bitcode, _ENTRY, _results(result.signature.return_type), needs)


@contextlib.contextmanager
def _unoptimised() -> Iterator[None]:
    """Keep Numba from optimising inner functions: that is done once, on the whole.

    And from putting its own files and lines, where it was installed, into the code, for exceptions that nobody reads.
    """
    before, raising = config.OPT, CPUCallConv.set_static_user_exc

    def without_place(convention: Any, builder: Any, exc: Any, exc_args: Any = None, **_: Any) -> None:
        raising(convention, builder, exc, exc_args)

    config.OPT = type(before)(0)
    CPUCallConv.set_static_user_exc = without_place
    try:
        yield
    finally:
        config.OPT, CPUCallConv.set_static_user_exc = before, raising


def _results(kind: Any) -> list[str]:
    members = [] if kind == types.none else list(kind.types) if isinstance(kind, types.BaseTuple) else [kind]
    names = ["int64" if isinstance(member, types.IntegerLiteral) else str(member) for member in members]
    if not set(names) <= set(native.RESULTS):
        raise TypeError(f"a jitted function that Python calls returns numbers or a tuple of them, not {kind}")
    return names


def _link(library: Any, symbol: str) -> llvm.ModuleRef:
    """All functions of a library and of those it calls in one module, in the order in which they are called.

    Only the entry is visible, and the numbers that Numba gives to names are gone: they differ from process to process.
    """
    module = library._final_module.clone()
    defined = {}
    for other in _libraries(library):
        defined |= {f.name: other for f in other._final_module.functions if not f.is_declaration}
    while wanted := [f.name for f in module.functions if f.is_declaration and f.name in defined]:
        for name in wanted:
            if module.get_function(name).is_declaration:
                module.link_in(defined[name]._final_module, preserve=True)
    for k, function in enumerate(f for f in module.functions if not f.is_declaration):
        if function.name == symbol:
            function.name = _ENTRY
        else:
            function.linkage = llvm.Linkage.internal
            function.name = f"f{k}"
    for k, variable in enumerate(module.global_variables):
        if not variable.is_declaration:
            variable.name = f"v{k}"
    compiler.drop_unused_arguments(module)
    for function in module.functions:
        if not function.is_declaration and str(function).count("\n") > _LARGEST_INLINED:
            function.add_function_attribute("noinline")
    return module


def _libraries(library: Any) -> set:
    """All libraries that a library calls, directly or not."""
    pending, seen = list(library._linking_libraries), set()
    while pending:
        other = pending.pop()
        if other not in seen:
            seen.add(other)
            pending += other._linking_libraries
    return seen
