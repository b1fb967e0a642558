"""Run time of symgen: load a generated module, integrate, check, record. Never imports SymPy or symgen."""

from symgen.runtime.lazy import lazy_exports

_EXPORTS = {
    "Kernel": "symgen.runtime.kernel",
    "ModuleError": "symgen.runtime.errors",
    "RuntimeModelError": "symgen.runtime.errors",
    "RunOptions": "symgen.runtime.options",
    "Solution": "symgen.runtime.front",
    "System": "symgen.runtime.front",
    "load": "symgen.runtime.front",
    "read_module": "symgen.runtime.module",
    "solve": "symgen.runtime.front",
}

__all__ = sorted(_EXPORTS)
# Numba and LLVM take longer to import than many runs take.
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
