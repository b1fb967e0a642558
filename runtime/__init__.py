"""Run time of symgen: load a generated module, integrate, check, record. Never imports SymPy or symgen."""

from symgen.runtime.lazy import lazy_exports

# The function `solve` is not among them: `symgen.runtime.solve` is its module, whichever was imported first.
_EXPORTS = {
    "Kernel": "symgen.runtime.kernel",
    "ModuleError": "symgen.runtime.errors",
    "RuntimeModelError": "symgen.runtime.errors",
    "Solution": "symgen.runtime.solution",
    "System": "symgen.runtime.system",
    "load": "symgen.runtime.system",
    "read_module": "symgen.runtime.module",
}

__all__ = sorted(_EXPORTS)
# Numba and LLVM take longer to import than many runs take.
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
