"""Run time of symgen: load a generated module, integrate, check, record. Never imports SymPy or symgen."""

from runtime.lazy import lazy_exports

# The function `solve` is not among them: `runtime.solve` is its module, whichever was imported first.
_EXPORTS = {
    "Kernel": "runtime.kernel",
    "ModuleError": "runtime.errors",
    "RuntimeModelError": "runtime.errors",
    "Solution": "runtime.solution",
    "System": "runtime.system",
    "load": "runtime.system",
    "read_module": "runtime.module",
}

__all__ = sorted(_EXPORTS)
# Numba and LLVM take longer to import than many runs take.
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
