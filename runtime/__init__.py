"""Run time of symgen: load a generated module, integrate, check, record. Never imports SymPy or symgen."""

from typing import TYPE_CHECKING

from symgen.runtime.lazy import lazy_exports

if TYPE_CHECKING:
    from symgen.runtime.errors import ModuleError as ModuleError
    from symgen.runtime.errors import RuntimeModelError as RuntimeModelError
    from symgen.runtime.front import Solution as Solution
    from symgen.runtime.front import System as System
    from symgen.runtime.front import load as load
    from symgen.runtime.front import solve as solve
    from symgen.runtime.kernel import Kernel as Kernel
    from symgen.runtime.module import read_module as read_module
    from symgen.runtime.options import RunOptions as RunOptions
    from symgen.runtime.robot import load_robot as load_robot

_EXPORTS = {
    "Kernel": "symgen.runtime.kernel",
    "ModuleError": "symgen.runtime.errors",
    "RuntimeModelError": "symgen.runtime.errors",
    "RunOptions": "symgen.runtime.options",
    "Solution": "symgen.runtime.front",
    "System": "symgen.runtime.front",
    "load": "symgen.runtime.front",
    "load_robot": "symgen.runtime.robot",
    "read_module": "symgen.runtime.module",
    "solve": "symgen.runtime.front",
}

__all__ = sorted(_EXPORTS)
# Numba and LLVM take longer to import than many runs take.
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
