"""Run time of symgen: load a generated module, integrate, check, record. Never imports SymPy or symgen."""

from importlib import import_module
from typing import Any

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


def __getattr__(name: str) -> Any:
    # A name is imported when it is first used: Numba and LLVM take longer to import than many runs take.
    if name not in _EXPORTS:
        raise AttributeError(f"module 'runtime' has no attribute {name!r}")
    value = getattr(import_module(_EXPORTS[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
